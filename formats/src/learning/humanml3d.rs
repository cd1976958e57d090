//! HumanML3D: 263 numbers per frame of 22 joints of SMPL, y up, at 20 frames a second, and back.

use glam::{DQuat, DVec3};

use crate::learning::heading::{Ground, facing};
use crate::learning::rotation_between;
use crate::learning::six::{SixOrder, six};

/// Joints of a frame: those of SMPL without hands.
pub const HUMANML3D_JOINTS: usize = 22;

/// Numbers of a frame: half the turn of the root about y (rad), the step of the root (x, z), its height, 21 positions, 21
/// rotations of six numbers, 22 steps, and contacts of two joints of each foot.
pub const HUMANML3D_NUMBERS: usize = 263;

/// Chains of joints from the root; those of the arms begin at the spine, and their rotations at the root.
const CHAINS: [&[usize]; 5] = [
    &[0, 2, 5, 8, 11],
    &[0, 1, 4, 7, 10],
    &[0, 3, 6, 9, 12, 15],
    &[9, 14, 17, 19, 21],
    &[9, 13, 16, 18, 20],
];

/// The direction of each bone that is not turned.
const DIRECTIONS: [DVec3; HUMANML3D_JOINTS] = {
    const X: DVec3 = DVec3::X;
    const Y: DVec3 = DVec3::Y;
    const Z: DVec3 = DVec3::Z;
    const LEFT: DVec3 = DVec3::NEG_X;
    const DOWN: DVec3 = DVec3::NEG_Y;
    [
        DVec3::ZERO,
        X,
        LEFT,
        Y,
        DOWN,
        DOWN,
        Y,
        DOWN,
        DOWN,
        Y,
        Z,
        Z,
        Y,
        X,
        LEFT,
        Z,
        DOWN,
        DOWN,
        DOWN,
        DOWN,
        DOWN,
        DOWN,
    ]
};

const HIPS: [usize; 2] = [1, 2];
const SHOULDERS: [usize; 2] = [16, 17];
/// Ankle and toes of the left foot, then of the right one.
const FEET: [usize; 4] = [7, 10, 8, 11];

/// Frames of the low-pass of the facing direction: its standard deviation.
const SIGMA: f64 = 20.0;

/// Why positions have no features.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Humanml3dError {
    /// The direction that the person faces is not defined.
    #[error(
        "frame {frame}: the hips and shoulders are one above the other, so they have no facing direction"
    )]
    NoFacing {
        /// The frame.
        frame: usize,
    },
    /// A position is not finite.
    #[error("frame {frame}: the position of joint {joint} is not finite")]
    NotFinite {
        /// The frame.
        frame: usize,
        /// The joint.
        joint: usize,
    },
}

type Frame = [DVec3; HUMANML3D_JOINTS];

/// The features of positions (metres, y up, 20 frames a second): a row for each frame but the last. `threshold`: the
/// square of the distance that a joint of a foot that touches the ground moves in a frame, 0.002 in the data set.
///
/// The motion is moved first: its lowest point to y = 0, its first root to x = z = 0, and turned so that it begins facing
/// +z. As in the original program, the facing direction of a frame takes the hips the other way round than the
/// shoulders: published numbers come out only so. Skeletons are not scaled.
///
/// # Errors
/// A [`Humanml3dError`].
pub fn humanml3d(
    positions: &[Frame],
    threshold: f64,
) -> Result<Vec<[f64; HUMANML3D_NUMBERS]>, Humanml3dError> {
    for (frame, joints) in positions.iter().enumerate() {
        if let Some(joint) = joints.iter().position(|point| !point.is_finite()) {
            return Err(Humanml3dError::NotFinite { frame, joint });
        }
    }
    if positions.len() < 2 {
        return Ok(Vec::new());
    }
    let frames = canonical(positions)?;
    let roots = root_rotations(&frames)?;
    let row = |i: usize| {
        let (now, next) = (&frames[i], &frames[i + 1]);
        let (root, root_next) = (roots[i], roots[i + 1]);
        let mut row = [0.0; HUMANML3D_NUMBERS];
        let mut rest = &mut row[..];
        let mut put = |numbers: &[f64]| {
            let (first, others) = std::mem::take(&mut rest).split_at_mut(numbers.len());
            first.copy_from_slice(numbers);
            rest = others;
        };
        let step = root_next * (next[0] - now[0]);
        let heading = root_next * root.inverse();
        put(&[
            libm::asin(heading.y.clamp(-1.0, 1.0)),
            step.x,
            step.z,
            now[0].y,
        ]);
        let below = DVec3::new(now[0].x, 0.0, now[0].z);
        for &joint in &now[1..] {
            put(&(root * (joint - below)).to_array());
        }
        for rotation in &bone_rotations(now, root)[1..] {
            put(&six(*rotation, SixOrder::Columns));
        }
        for (before, after) in now.iter().zip(next) {
            put(&(root * (*after - *before)).to_array());
        }
        for joint in FEET {
            let moved = (next[joint] - now[joint]).length_squared();
            put(&[f64::from(u8::from(moved < threshold))]);
        }
        row
    };
    Ok((0..frames.len() - 1).map(row).collect())
}

/// The positions of features: those of the joints in each frame, from the root at x = z = 0 on.
#[must_use]
pub fn positions_of_humanml3d(features: &[[f64; HUMANML3D_NUMBERS]]) -> Vec<Frame> {
    let (mut half, mut root) = (0.0, DVec3::ZERO);
    let mut before: Option<&[f64; HUMANML3D_NUMBERS]> = None;
    let frame = |row| {
        if let Some(before) = before.replace(row) {
            half += before[0];
            let heading = about_y(half);
            root += heading.inverse() * DVec3::new(before[1], 0.0, before[2]);
        }
        let heading = about_y(half).inverse();
        let mut joints = [DVec3::new(root.x, row[3], root.z); HUMANML3D_JOINTS];
        let local = row[4..67].as_chunks::<3>().0;
        for (joint, &local) in joints[1..].iter_mut().zip(local) {
            *joint = heading * DVec3::from_array(local) + DVec3::new(root.x, 0.0, root.z);
        }
        joints
    };
    features.iter().map(frame).collect()
}

/// The rotation about y by twice an angle.
fn about_y(half: f64) -> DQuat {
    DQuat::from_xyzw(0.0, libm::sin(half), 0.0, libm::cos(half))
}

/// The motion on the ground, from the origin on, facing +z first.
fn canonical(positions: &[Frame]) -> Result<Vec<Frame>, Humanml3dError> {
    let all = positions.iter().flatten();
    let lowest = all.map(|point| point.y).fold(f64::INFINITY, f64::min);
    let [first, ..] = positions else {
        return Ok(Vec::new());
    };
    let origin = DVec3::new(first[0].x, lowest, first[0].z);
    let [hips, shoulders] = [HIPS, SHOULDERS].map(|pair| pair.map(|joint| first[joint]));
    let facing = facing(hips, shoulders, Ground::Y);
    let heading = rotation_between(
        facing.ok_or(Humanml3dError::NoFacing { frame: 0 })?,
        DVec3::Z,
    );
    let moved = |frame: &Frame| frame.map(|point| heading * (point - origin));
    Ok(positions.iter().map(moved).collect())
}

/// The rotation of the root that makes each frame face +z; none in the first.
fn root_rotations(frames: &[Frame]) -> Result<Vec<DQuat>, Humanml3dError> {
    // The hips are swapped; see `humanml3d`. If the body is tilted, this direction has a shorter component on the
    // ground and has less weight.
    let facing = |(frame, joints): (usize, &Frame)| {
        let across =
            (joints[HIPS[0]] - joints[HIPS[1]]) + (joints[SHOULDERS[1]] - joints[SHOULDERS[0]]);
        let across = across.try_normalize();
        let across = across.ok_or(Humanml3dError::NoFacing { frame })?;
        Ok(DVec3::Y.cross(across))
    };
    let facing: Result<Vec<DVec3>, _> = frames.iter().enumerate().map(facing).collect();
    let smooth = low_pass(&facing?);
    let rotations = smooth
        .iter()
        .enumerate()
        .map(|(frame, direction)| match frame {
            0 => Ok(DQuat::IDENTITY),
            _ => {
                let direction = direction.try_normalize();
                let direction = direction.ok_or(Humanml3dError::NoFacing { frame })?;
                Ok(rotation_between(direction, DVec3::Z))
            }
        });
    rotations.collect()
}

/// Weighted means with a Gaussian to 4 standard deviations; the ends are repeated.
fn low_pass(values: &[DVec3]) -> Vec<DVec3> {
    let radius = (4.0 * SIGMA + 0.5) as usize;
    let weight = |i: usize| {
        let x = (i as f64 - radius as f64) / SIGMA;
        libm::exp(-0.5 * x * x)
    };
    let weights: Vec<f64> = (0..=2 * radius).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    let at = |frame: usize| {
        let around = weights.iter().enumerate().map(|(i, weight)| {
            let index = (frame + i).saturating_sub(radius).min(values.len() - 1);
            values[index] * (weight / sum)
        });
        around.sum()
    };
    (0..values.len()).map(at).collect()
}

/// The rotations of bones from their directions; that of the root is the root's.
fn bone_rotations(frame: &Frame, root: DQuat) -> [DQuat; HUMANML3D_JOINTS] {
    let mut rotations = [root; HUMANML3D_JOINTS];
    for chain in CHAINS {
        let mut parent = root;
        for pair in chain.windows(2) {
            let &[from, to] = pair else { continue };
            let direction = (frame[to] - frame[from]).normalize_or(DIRECTIONS[to]);
            let bone = rotation_between(DIRECTIONS[to], direction);
            rotations[to] = parent.inverse() * bone;
            parent *= rotations[to];
        }
    }
    rotations
}
