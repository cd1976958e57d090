//! Quantized rotations: 16 bits for each component, as accessors of normalised `SHORT` store them; or fewer bits for
//! three components, which meshopt's filter QUATERNION decodes to these.

use std::array;

use glam::{DQuat, Quat};

use crate::gltf::meshopt::quaternion;
use crate::quaternion::unit;

/// The integer that represents 1.
const ONE: f32 = 32767.0;

/// The nearest components as integers, which glTF divides by 32767.
pub(crate) fn quantized(rotation: [f32; 4]) -> [i16; 4] {
    rotation.map(|component| (component * ONE).round_ties_even() as i16) // saturates
}

/// How the rotations of a file are quantized.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantization {
    /// 16 bits for each of four components.
    Components,
    /// The three smaller components only, by meshopt's filter QUATERNION. The number is that of the steps from 0 to
    /// √½: 7 to 32767, one less than a multiple of 4. Of q and -q, the one whose largest component is positive is
    /// stored.
    Filtered(u16),
}

impl Quantization {
    /// The rotation that is read back after `rotation` was written.
    pub(crate) fn read_back(self, rotation: Quat) -> Quat {
        let components = match self {
            Self::Components => quantized(rotation.to_array()),
            Self::Filtered(steps) => {
                let mut element = filtered(rotation.to_array(), steps);
                quaternion(&mut element);
                array::from_fn(|i| i16::from_le_bytes([element[2 * i], element[2 * i + 1]]))
            }
        };
        unit(DQuat::from_array(
            components.map(|component| f64::from(component) / f64::from(ONE)),
        ))
    }
}

/// The bytes of a rotation for meshopt's filter: see [`quaternion`].
pub(crate) fn filtered(rotation: [f32; 4], steps: u16) -> [u8; 8] {
    let steps = steps.min(i16::MAX as u16) | 3;
    let one = f32::from(steps);
    let largest = (1..4).fold(0, |largest, i| {
        match rotation[i].abs() > rotation[largest].abs() {
            true => i,
            false => largest,
        }
    });
    let sign = if rotation[largest] < 0.0 { -1.0 } else { 1.0 };
    let short = |offset: usize| {
        let component = rotation[(largest + offset) % 4] * std::f32::consts::SQRT_2 * sign;
        (component.clamp(-1.0, 1.0) * one).round_ties_even() as i16
    };
    // The two lowest bits say which component is left out.
    let last = (steps & !3) as i16 | largest as i16;
    let mut element = [0; 8];
    for (bytes, component) in element
        .chunks_exact_mut(2)
        .zip([short(1), short(2), short(3), last])
    {
        bytes.copy_from_slice(&component.to_le_bytes());
    }
    element
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_stay_within_half_a_step_of_each_component() {
        for step in 0..2000u16 {
            let axis = glam::Vec3::new(1.0, f32::from(step % 37) - 18.0, f32::from(step % 11));
            let q = Quat::from_axis_angle(axis.normalize(), f32::from(step) * 0.01);
            let off =
                2.0 * (Quantization::Components.read_back(q).as_dquat() - q.as_dquat()).length();
            assert!(off < 4.0 * 0.5 / 32767.0 * 1.01, "{q} {off:e}");
        }
        for steps in [31, 511, 1447, 2047, 32767] {
            for step in 0..500u16 {
                let axis =
                    glam::Vec3::new(f32::from(step % 7) - 3.0, 1.0, f32::from(step % 5) - 2.0);
                let q = Quat::from_axis_angle(axis.normalize(), f32::from(step) * 0.03);
                let found = Quantization::Filtered(steps).read_back(q).as_dquat();
                let q = q.as_dquat();
                let off = 2.0 * (found - q).length().min((found + q).length());
                // Half a step in each of three components, and the resulting error of the largest component.
                let limit = 2.0 * 2.0 * 0.5 / f64::from(steps) + 1e-4;
                assert!(off < limit, "{steps} {q} {off:e}");
            }
        }
        assert_eq!(quantized([0.0, -1.0, 1.0, 0.5]), [0, -32767, 32767, 16384]);
        let read_back = |q| Quantization::Components.read_back(q);
        assert_eq!(read_back(Quat::IDENTITY), Quat::IDENTITY);
    }
}
