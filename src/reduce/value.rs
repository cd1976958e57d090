//! The values that are reduced: rotations and vectors.

use glam::{DQuat, DVec3, DVec4};

use crate::curve::options::{Ends, KeySigns};
use crate::reference::curve::ReferenceCurve;
use crate::reference::handles::BESSEL_OVERHAUSER;
use crate::reference::quaternion::slerp;
use crate::reference::vector::VectorCurve;

/// A sample of a channel.
pub(crate) trait Value: Copy + Default + PartialEq {
    /// The distance of two values: the angle between rotations, or the distance of vectors.
    fn apart(self, other: Self) -> f64;

    /// The interpolated value at a fraction of the distance to another value.
    fn towards(self, other: Self, part: f64) -> Self;

    fn numbers(self) -> DVec4;

    /// The value with these numbers; a rotation's need not be a unit quaternion.
    fn of_numbers(numbers: DVec4) -> Self;

    /// The value nearest to these numbers.
    fn nearest(numbers: DVec4) -> Self;

    /// The Bessel-Overhauser curve through keys.
    fn bessel_overhauser(times: &[f64], keys: &[Self]) -> Box<dyn Fn(f64) -> Self>;
}

impl Value for DQuat {
    fn apart(self, other: Self) -> f64 {
        let step = self.conjugate() * other;
        2.0 * libm::atan2(step.xyz().length(), step.w.abs())
    }

    fn towards(self, other: Self, part: f64) -> Self {
        let near = if self.dot(other) < 0.0 { -other } else { other };
        slerp(self, near, part)
    }

    fn numbers(self) -> DVec4 {
        self.into()
    }

    fn of_numbers(numbers: DVec4) -> Self {
        Self::from_vec4(numbers)
    }

    fn nearest(numbers: DVec4) -> Self {
        Self::from_vec4(numbers).normalize()
    }

    fn bessel_overhauser(times: &[f64], keys: &[Self]) -> Box<dyn Fn(f64) -> Self> {
        let keys: Vec<_> = keys.iter().map(|key| key.as_quat()).collect();
        let curve = ReferenceCurve::new(
            BESSEL_OVERHAUSER,
            KeySigns::Shortest,
            Ends::Parabolic,
            times,
            &keys,
        );
        Box::new(move |time| curve.rotation(time))
    }
}

impl Value for DVec3 {
    fn apart(self, other: Self) -> f64 {
        self.distance(other)
    }

    fn towards(self, other: Self, part: f64) -> Self {
        self.lerp(other, part)
    }

    fn numbers(self) -> DVec4 {
        self.extend(0.0)
    }

    fn of_numbers(numbers: DVec4) -> Self {
        numbers.truncate()
    }

    fn nearest(numbers: DVec4) -> Self {
        numbers.truncate()
    }

    fn bessel_overhauser(times: &[f64], keys: &[Self]) -> Box<dyn Fn(f64) -> Self> {
        let curve = VectorCurve {
            method: "bessel-overhauser",
            ends: Ends::Parabolic,
            times: times.to_vec(),
            keys: keys.to_vec(),
            tangents: Vec::new(),
        };
        Box::new(move |time| curve.value(time))
    }
}
