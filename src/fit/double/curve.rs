//! A curve in f64 by its formula, and the piece of it that one polynomial fits.

use std::sync::Arc;

use crate::curve::formula::Numbers;
use crate::curve::options::{Axes, Quantity};
use crate::fit::double::shape::Shape;
use crate::fit::motion::arc_length::Pace;
use crate::fit::motion::derivatives as motion;
use crate::math::dual::Dual;
use crate::math::quaternion::{Quaternion, dot};

/// The curve of one key interval, or a piece of it.
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    pub(crate) shape: &'static Shape,
    pub(crate) numbers: Numbers,
    pub(crate) piece: Piece,
    pub(crate) quantity: Quantity,
    /// The change of the parameter per second.
    pub(crate) rate: f64,
    /// The curve's arc lengths if it is traversed at constant speed.
    pub(crate) pace: Option<Arc<Pace>>,
}

/// The part of an interval that one polynomial fits, from where until where, as fractions of the interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    from: f64,
    to: f64,
    /// How often the interval was halved.
    cuts: u8,
}

/// A curve that no polynomial fits even after so many cuts turns by dozens of radians within one
/// interval; the host evaluates it in f64 for every device.
const MOST_CUTS: u8 = 4;

impl Piece {
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
        (cuts <= MOST_CUTS && is_between).then_some([
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

impl Curve {
    /// A whole curve, traversed as the key times say.
    pub(crate) fn new(
        shape: &'static Shape,
        numbers: Numbers,
        quantity: Quantity,
        rate: f64,
    ) -> Self {
        Self {
            shape,
            numbers,
            piece: Piece::WHOLE,
            quantity,
            rate,
            pace: None,
        }
    }

    /// The value of the curve's quantity at `t`, which runs from 0 to 1 over its piece.
    pub(crate) fn value(&self, t: f64) -> Quaternion {
        let (start, width) = self.piece.extent();
        self.value_at(start + width * t)
    }

    /// The value of the curve's quantity at `t`, which runs from 0 to 1 over its interval.
    pub(crate) fn value_at(&self, t: f64) -> Quaternion {
        if self.quantity != Quantity::Rotation || self.pace.is_some() {
            let parameter = match &self.pace {
                Some(pace) => pace.parameter(self, t),
                None => Dual::parameter(t),
            };
            let rotation = self.moving(parameter);
            return motion::value(self.quantity, rotation, self.rate);
        }
        let rotation = (self.shape.rotation)(&self.numbers, t);
        if dot(rotation, rotation) > 0.5 || !self.shape.is_unit {
            return rotation;
        }
        // A normalised polynomial may pass through 0, where it is no rotation: the rotation just
        // after that is taken.
        (self.shape.rotation)(&self.numbers, t + 1e-9)
    }

    /// The curve that continues from `t` at the constant angular velocity that this one has there;
    /// its parameter is in seconds.
    pub(crate) fn beyond(&self, t: f64) -> Self {
        let rotation = self.moving(Dual::parameter(t));
        let [x, y, z, _] = motion::value(Quantity::Velocity(Axes::Body), rotation, self.rate);
        let half = [0.5 * x, 0.5 * y, 0.5 * z];
        let shape = Shape::ROTATION_VECTOR;
        let mut numbers = shape.shared;
        numbers[..4].copy_from_slice(&rotation.map(|dual| dual.value));
        numbers[4..7].copy_from_slice(&half);
        Self::new(shape, numbers, self.quantity, 1.0)
    }

    /// The rotation and its derivatives, as dual numbers.
    pub(crate) fn moving(&self, parameter: Dual) -> [Dual; 4] {
        (self.shape.moving)(&self.numbers, parameter)
    }
}
