//! Rotations of 16 bits a component, as accessors of normalised `SHORT` have them.

use glam::{DQuat, Quat};

use crate::quaternion::unit;

/// What 1 is.
const ONE: f32 = 32767.0;

/// The nearest components, which glTF divides by 32767.
pub(crate) fn quantized(rotation: [f32; 4]) -> [i16; 4] {
    rotation.map(|component| (component * ONE).round_ties_even() as i16) // saturates
}

/// What is read of a rotation that was written so.
pub(crate) fn read_back(rotation: Quat) -> Quat {
    let components = quantized(rotation.to_array()).map(|own| f64::from(own) / f64::from(ONE));
    unit(DQuat::from_array(components))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_stay_within_half_a_step_of_each_component() {
        for step in 0..2000u16 {
            let axis = glam::Vec3::new(1.0, f32::from(step % 37) - 18.0, f32::from(step % 11));
            let q = Quat::from_axis_angle(axis.normalize(), f32::from(step) * 0.01);
            let off = 2.0 * (read_back(q).as_dquat() - q.as_dquat()).length();
            assert!(off < 4.0 * 0.5 / 32767.0 * 1.01, "{q} {off:e}");
        }
        assert_eq!(quantized([0.0, -1.0, 1.0, 0.5]), [0, -32767, 32767, 16384]);
        assert_eq!(read_back(Quat::IDENTITY), Quat::IDENTITY);
    }
}
