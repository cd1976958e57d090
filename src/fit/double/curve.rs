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
#[derive(Clone)]
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

/// The part of an interval that one polynomial fits: its start and its length in sixteenths of the
/// interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    pub(crate) from: u8,
    length: u8,
}

impl Piece {
    pub(crate) const WHOLE: Self = Self {
        from: 0,
        length: 16,
    };

    /// Whether the piece is cut no further. A curve that no polynomial fits even then turns by
    /// dozens of radians within one interval; the host evaluates it in f64 for every device.
    pub(crate) fn is_finest(self) -> bool {
        self.length == 1
    }

    pub(crate) fn halves(self) -> [Self; 2] {
        let length = self.length / 2;
        [self.from, self.from + length].map(|from| Self { from, length })
    }

    /// Its start and its width as fractions of the interval.
    pub(crate) fn extent(self) -> (f64, f64) {
        let part = |of: u8| f64::from(of) / f64::from(Self::WHOLE.length);
        (part(self.from), part(self.length))
    }
}

impl Curve {
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
        Self {
            shape,
            numbers,
            piece: Piece::WHOLE,
            quantity: self.quantity,
            rate: 1.0,
            pace: None,
        }
    }

    /// The rotation and its derivatives, as dual numbers.
    pub(crate) fn moving(&self, parameter: Dual) -> [Dual; 4] {
        (self.shape.moving)(&self.numbers, parameter)
    }
}
