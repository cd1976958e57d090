//! A curve in f64 by its formula, and the piece of it that one polynomial fits.

use std::sync::Arc;

use crate::curve::formula::{FormulaNumbers, RotationVector, RotationVectorNumbers};
use crate::curve::options::{Axes, Quantity};
use crate::fit::block::Intervals;
use crate::fit::exact::shape::Shape;
use crate::fit::motion::arc_length::ArcLengths;
use crate::fit::motion::derivatives;
use crate::math::dual::Dual;
use crate::math::quaternion::{Quaternion, Vector, dot, length};

/// The curve of one key interval, or a piece of it.
#[derive(Debug, Clone)]
pub(crate) struct IntervalCurve {
    pub(crate) shape: &'static Shape,
    pub(crate) numbers: FormulaNumbers,
    pub(crate) piece: CurvePiece,
    pub(crate) quantity: Quantity,
    /// The change of the parameter per second.
    pub(crate) rate: f64,
    /// The curve's arc lengths if it is traversed at constant speed.
    pub(crate) arc_lengths: Option<Arc<ArcLengths>>,
}

/// The part of an interval that one polynomial fits, from where until where, as fractions of the interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CurvePiece {
    from: f64,
    to: f64,
    /// How often the interval was halved.
    cuts: u8,
}

/// A curve that no polynomial fits even after so many cuts turns by dozens of radians within one
/// interval; the host evaluates it in f64 for every device.
const MAX_CUTS: u8 = 4;

impl CurvePiece {
    pub(crate) const WHOLE: Self = Self {
        from: 0.0,
        to: 1.0,
        cuts: 0,
    };

    /// The time at which it begins in an interval that starts at `start` and takes `duration`, seconds.
    pub(crate) fn begins(self, start: f64, duration: f64) -> f64 {
        start + duration * self.from
    }

    /// Both halves of a piece of that interval; `None` if it is not cut further. They meet at a time
    /// that an f64 has: far from 0 that is not quite the middle, and may be one of the ends.
    pub(crate) fn halves(self, start: f64, duration: f64) -> Option<[Self; 2]> {
        let cuts = self.cuts + 1;
        let mut middle = 0.5 * (self.from + self.to);
        let rounded = ((start + duration * middle) - start) / duration;
        if (rounded - middle).abs() > INDISTINCT * (self.to - self.from) {
            middle = rounded;
        }
        let is_between = self.from < middle && middle < self.to;
        (cuts <= MAX_CUTS && is_between).then_some([
            Self {
                to: middle,
                cuts,
                ..self
            },
            Self {
                from: middle,
                cuts,
                ..self
            },
        ])
    }

    /// Its start and its width as fractions of the interval.
    pub(crate) fn extent(self) -> (f64, f64) {
        (self.from, self.to - self.from)
    }
}

/// A part of an interval's duration within which polynomials in f32 have the same coefficients.
pub(crate) const INDISTINCT: f64 = 1.0 / (1u64 << 28) as f64;

impl IntervalCurve {
    /// A whole curve, traversed as the key times say.
    pub(crate) fn new(
        shape: &'static Shape,
        numbers: FormulaNumbers,
        quantity: Quantity,
        rate: f64,
    ) -> Self {
        Self {
            shape,
            numbers,
            piece: CurvePiece::WHOLE,
            quantity,
            rate,
            arc_lengths: None,
        }
    }

    /// The whole curve in a lane of a block.
    pub(crate) fn of_interval(
        intervals: &Intervals,
        lane: usize,
        shape: &'static Shape,
        quantity: Quantity,
    ) -> Self {
        let numbers = shape.curve_numbers(|i| intervals.numbers[i][lane]);
        Self::new(shape, numbers, quantity, intervals.rate(lane))
    }

    /// The value of the curve's quantity at `t`, which runs from 0 to 1 over its piece.
    pub(crate) fn value(&self, t: f64) -> Quaternion {
        let (start, width) = self.piece.extent();
        self.value_at(start + width * t)
    }

    /// The value of the curve's quantity at `t`, which runs from 0 to 1 over its interval.
    pub(crate) fn value_at(&self, t: f64) -> Quaternion {
        if self.quantity != Quantity::Rotation || self.arc_lengths.is_some() {
            let parameter = match &self.arc_lengths {
                Some(arc_lengths) => arc_lengths.parameter(&|u| self.moving(u), t),
                None => Dual::parameter(t),
            };
            let rotation = self.moving(parameter);
            return derivatives::value(self.quantity, rotation, self.rate);
        }
        let rotation = (self.shape.rotation)(&self.numbers, t);
        if dot(rotation, rotation) > 0.5 || !self.shape.is_unit {
            return rotation;
        }
        // A normalised polynomial may pass through 0, where it is not a rotation: the rotation just
        // after that is taken.
        (self.shape.rotation)(&self.numbers, t + 1e-9)
    }

    /// The curve that continues from `t` at the constant angular velocity that this one has there;
    /// its parameter is in seconds.
    pub(crate) fn extended_from(&self, t: f64) -> Self {
        let rotation = self.moving(Dual::parameter(t));
        let [x, y, z, _] = derivatives::value(Quantity::Velocity(Axes::Body), rotation, self.rate);
        let half = [0.5 * x, 0.5 * y, 0.5 * z];
        let numbers = RotationVectorNumbers {
            base: rotation.map(|dual| dual.value),
            linear: half,
            ..RotationVectorNumbers::default()
        };
        Self::new(Shape::ROTATION_VECTOR, numbers.into(), self.quantity, 1.0)
    }

    /// Sets the speed of a curve of constant angular velocity, in radians per second.
    pub(crate) fn set_speed(&mut self, speed: f64) {
        let (_, half) = self.numbers.split_at_mut(RotationVector::LINEAR);
        let half: &mut Vector = half.first_chunk_mut().expect("a rotation vector");
        let current = 2.0 * length(*half);
        if current > 0.0 {
            for number in half {
                *number *= speed / current;
            }
        }
    }

    /// The rotation and its derivatives, as dual numbers.
    pub(crate) fn moving(&self, parameter: Dual) -> [Dual; 4] {
        (self.shape.moving)(&self.numbers, parameter)
    }
}
