//! A result as the page stores it: in 16 bits, as differences between samples.

use glam::{DVec3, Quat, Vec3, Vec4};
use serde::Serialize;
use tumble::Encoding;

use crate::commands::view::pack::differences;

/// The samples of one method.
#[derive(Serialize)]
pub(crate) struct StoredResult {
    method: &'static str,
    #[serde(skip)]
    boxes: usize,
    /// `[sample][box][xyzw]`, to be divided by 32767.
    rotations: String,
    /// `[sample][box]`, to be divided by 65535 and multiplied with `fastest`, rad/s.
    speeds: String,
    fastest: f32,
    /// Where the joints are; nothing for the boxes of a chain.
    positions: Option<StoredPositions>,
}

/// Where joints are in the world.
#[derive(Serialize)]
struct StoredPositions {
    /// The least coordinates of all, in the file's units.
    low: [f64; 3],
    /// How far the largest are from them.
    size: [f64; 3],
    /// `[sample][joint][xyz]`, to be divided by 65535, multiplied with `size` and added to `low`.
    packed: String,
}

impl StoredResult {
    /// Rotations and angular velocities, `[sample][box]`.
    pub(crate) fn new(
        method: &'static str,
        boxes: usize,
        rotations: &[Quat],
        velocities: &[Vec4],
    ) -> Self {
        let speeds = || {
            velocities
                .iter()
                .map(|velocity| velocity.truncate().length())
        };
        let fastest = speeds().fold(0.0, f32::max);
        let share = |speed: f32| match fastest {
            0.0 => 0,
            _ => (speed / fastest * 65535.0).round() as u16,
        };
        Self {
            method,
            boxes,
            rotations: differences(&short(rotations), 4 * boxes),
            speeds: differences(&speeds().map(share).collect::<Vec<u16>>(), boxes),
            fastest,
            positions: None,
        }
    }

    /// With the positions of joints, `[sample][joint]`; `None` if one is not finite.
    pub(crate) fn at(self, joints: &[Vec3]) -> Option<Self> {
        let positions = || joints.iter().map(|joint| joint.as_dvec3());
        let low = positions().reduce(DVec3::min).unwrap_or_default();
        let size = positions().reduce(DVec3::max).unwrap_or_default() - low;
        if !positions().all(DVec3::is_finite) {
            return None;
        }
        // A coordinate that never changes has the range 0, by which one cannot divide.
        let scale = DVec3::select(size.cmpgt(DVec3::ZERO), 65535.0 / size, DVec3::ZERO);
        let short = |position: DVec3| {
            let share = (position - low) * scale;
            share.to_array().map(|share| share.round() as u16)
        };
        let packed: Vec<u16> = positions().flat_map(short).collect();
        let positions = StoredPositions {
            low: low.to_array(),
            size: size.to_array(),
            packed: differences(&packed, 3 * self.boxes),
        };
        Some(Self {
            positions: Some(positions),
            ..self
        })
    }
}

/// Components in 16 bits, as the engine stores them.
pub(super) fn short(rotations: &[Quat]) -> Vec<u16> {
    let rotations: Vec<[f32; 4]> = rotations.iter().map(Quat::to_array).collect();
    let mut bytes = vec![0; rotations.len() * Encoding::Snorm16.bytes()];
    Encoding::Snorm16
        .encode(&rotations, &mut bytes)
        .expect("8 bytes a rotation");
    let pairs = bytes.chunks_exact(2);
    pairs
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect()
}
