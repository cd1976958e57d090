//! The features of Kimodo's model, for the 22 joints of SMPL with y up: numbers as its code computes them, before they are
//! normalised.
//!
//! A frame is the smooth root (x, the height of the hips, z), the heading of the hips (cosine, sine), the positions of
//! all joints relative to the smooth root on the ground, their rotations in the world as
//! [`SixOrder::Columns`], their velocities, and the contacts of ankle and foot, left then right.
//!
//! The smooth root accelerates least within 6 cm of the hips: coarse to fine, with 500 steps of ADMM at each of the
//! resolutions. Then each frame is averaged with the next one, as in Kimodo's code (`smooth_root.py` at 7330e7eb), whose
//! interpolation to the next resolution also runs after the last. This moves the path half a frame ahead.

use glam::{DQuat, DVec2, DVec3};

use crate::learning::contacts::{ContactLimits, contacts};
use crate::learning::heading::Ground;
use crate::learning::humanml3d::HUMANML3D_JOINTS;
use crate::learning::six::{SixOrder, six};

/// Numbers of a frame: root, heading, positions, rotations and velocities of the joints, contacts.
pub const KIMODO_NUMBERS: usize = 3 + 2 + HUMANML3D_JOINTS * (3 + 6 + 3) + FEET.len();

/// Ankle and foot, left then right.
const FEET: [usize; 4] = [7, 10, 8, 11];
const LEFT_HIP: usize = 1;
const RIGHT_HIP: usize = 2;

/// How far the smooth root may be from the hips, metres, before its frames are averaged.
const MARGIN: f64 = 0.06;
/// Steps at each resolution.
const STEPS: usize = 500;
/// The factor of a step of the multipliers.
const RELAXATION: f64 = 1.8;
/// With fewer frames, the coarsest resolution has no acceleration.
const FEWEST_FRAMES: usize = 5;

/// Why there are no features of Kimodo.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum KimodoError {
    /// The smooth root needs more frames.
    #[error("Kimodo's smooth root needs {FEWEST_FRAMES} frames or more, and there are {frames}")]
    TooFewFrames {
        /// How many frames there are.
        frames: usize,
    },
}

/// The features of each frame. Positions are in metres, rotations are those of SMPL's joints in the world, and there are
/// `per_second` frames a second.
///
/// # Errors
/// With fewer than five frames.
pub fn kimodo(
    positions: &[[DVec3; HUMANML3D_JOINTS]],
    rotations: &[[DQuat; HUMANML3D_JOINTS]],
    per_second: f64,
) -> Result<Vec<[f64; KIMODO_NUMBERS]>, KimodoError> {
    let frames = positions.len();
    if frames < FEWEST_FRAMES {
        return Err(KimodoError::TooFewFrames { frames });
    }
    let hips: Vec<DVec2> = positions.iter().map(|all| on_ground(all[0])).collect();
    let smooth = smooth_root(&hips);
    let limits = ContactLimits::PROTOMOTIONS;
    let rows = positions.iter().zip(rotations).enumerate();
    let rows = rows.map(|(frame, (joints, rotations))| {
        // The last frame repeats the velocity before it.
        let first = frame.min(frames - 2);
        let velocity =
            |joint: usize| (positions[first + 1][joint] - positions[first][joint]) * per_second;
        let root = smooth[frame];
        let across = on_ground(joints[RIGHT_HIP] - joints[LEFT_HIP]);
        let heading = DVec2::new(-across.x, across.y).try_normalize();
        let mut row = vec![root.x, joints[0].y, root.y];
        row.extend(heading.unwrap_or(DVec2::X).to_array());
        row.extend(
            joints
                .iter()
                .flat_map(|joint| [joint.x - root.x, joint.y, joint.z - root.y]),
        );
        row.extend(rotations.iter().flat_map(|&it| six(it, SixOrder::Columns)));
        row.extend((0..joints.len()).flat_map(|joint| velocity(joint).to_array()));
        let [at, speeds] = [FEET.map(|joint| joints[joint]), FEET.map(velocity)];
        let touching = contacts(&at, &speeds, Ground::Y, limits).into_iter();
        row.extend(touching.map(|touches| f64::from(u8::from(touches))));
        let mut numbers = [0.0; KIMODO_NUMBERS];
        numbers.copy_from_slice(&row);
        numbers
    });
    Ok(rows.collect())
}

fn on_ground(point: DVec3) -> DVec2 {
    DVec2::new(point.x, point.z)
}

/// The smooth path near a path on the ground, from every `2^n`-th frame to all.
fn smooth_root(path: &[DVec2]) -> Vec<DVec2> {
    let frames = path.len();
    let mean = path.iter().sum::<DVec2>() / frames as f64;
    let mut smooth = vec![mean; frames];
    let levels = frames.ilog2().saturating_sub(4).max(1);
    for level in (0..=levels).rev() {
        let step = 1 << level;
        let every = |path: &[DVec2]| -> Vec<DVec2> { path.iter().copied().step_by(step).collect() };
        let found = smoothed(&every(path), &every(&smooth));
        let last = found.len() - 1;
        let after_last = found[last] + (found[last] - found[last - 1]) / 2.0;
        for (index, &position) in found.iter().enumerate() {
            smooth[index * step] = position;
        }
        // A frame halfway between two of these gets their mean. A frame after the last of them gets a position on the
        // line through the last two. With a step of 1, they are these frames themselves.
        let half = step / 2;
        let between = (half..frames).step_by(step);
        let ends_after = between.clone().count() == found.len();
        for (index, frame) in between.enumerate() {
            // With a step of 1, the last frame is moved to `after_last`, so the frame before it uses that position.
            let next = |index: usize| match half == 0 && index == last {
                true => after_last,
                false => found[index],
            };
            smooth[frame] = match index == last && ends_after {
                true => after_last,
                false => (next(index) + next(index + 1)) / 2.0,
            };
        }
    }
    smooth
}

/// The positions within the margin around `targets` with the least accelerations, by ADMM from `start`.
fn smoothed(targets: &[DVec2], start: &[DVec2]) -> Vec<DVec2> {
    let system = Accelerations::new(targets.len());
    let (mut found, mut near) = (start.to_vec(), vec![DVec2::ZERO; start.len()]);
    let mut multipliers = vec![DVec2::ZERO; start.len()];
    for _ in 0..STEPS {
        for (index, near) in near.iter_mut().enumerate() {
            let away = found[index] + multipliers[index] - targets[index];
            let length = away.length();
            let away = match length > MARGIN {
                true => away * (MARGIN / length),
                false => away,
            };
            *near = away + targets[index];
            multipliers[index] += RELAXATION * (found[index] - *near);
        }
        for (index, found) in found.iter_mut().enumerate() {
            *found = system.weight * (near[index] - multipliers[index]);
        }
        system.solve(&mut found);
    }
    found
}

/// The matrix `AᵀA + weight`, where a row of `A` is the acceleration at a frame, factored as `L D Lᵀ`. Below the main
/// diagonal, it has two more.
struct Accelerations {
    weight: f64,
    diagonal: Vec<f64>,
    /// The numbers of `L` one and two below the diagonal.
    below: Vec<[f64; 2]>,
}

impl Accelerations {
    fn new(frames: usize) -> Self {
        let mut bands = vec![[0.0; 3]; frames];
        for middle in 1..frames.saturating_sub(1) {
            let row = [-1.0, 2.0, -1.0];
            for (one, a) in row.into_iter().enumerate() {
                for (two, b) in row.into_iter().enumerate().skip(one) {
                    bands[middle - 1 + one][two - one] += a * b;
                }
            }
        }
        let largest = bands.iter().map(|band| band[0]).fold(0.0, f64::max);
        let weight = 0.25 * libm::sqrt(largest);
        let mut diagonal = vec![0.0; frames];
        let mut below = vec![[0.0; 2]; frames];
        for (column, [middle, first, second]) in bands.into_iter().enumerate() {
            let mut pivot = middle + weight;
            let mut beside = first;
            for back in 1..=2.min(column) {
                let before = column - back;
                let factor = below[before][back - 1] * diagonal[before];
                pivot -= factor * below[before][back - 1];
                if back == 1 {
                    beside -= factor * below[before][1];
                }
            }
            diagonal[column] = pivot;
            below[column] = [beside / pivot, second / pivot];
        }
        Self {
            weight,
            diagonal,
            below,
        }
    }

    fn solve(&self, right: &mut [DVec2]) {
        let frames = right.len();
        for row in 0..frames {
            for back in 1..=2.min(row) {
                right[row] -= self.below[row - back][back - 1] * right[row - back];
            }
        }
        for row in (0..frames).rev() {
            right[row] /= self.diagonal[row];
            for ahead in 1..=2.min(frames - 1 - row) {
                right[row] -= self.below[row][ahead - 1] * right[row + ahead];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the formulas of Kimodo's code with a dense inverse.
    #[test]
    fn the_smooth_root_is_that_of_the_formulas() {
        let path = |frames: usize| -> Vec<DVec2> {
            let frames = (0..frames).map(|frame| frame as f64);
            frames
                .map(|t| {
                    DVec2::new(
                        0.05 * t + 0.1 * libm::sin(0.7 * t),
                        0.2 * libm::cos(0.4 * t),
                    )
                })
                .collect()
        };
        for (frames, frame, expected) in [
            (5, 0, [0.079164702231294, 0.1736411006956915]),
            (5, 4, [0.26333264962680436, 0.035249689882659245]),
            (40, 20, [1.0600955887315564, -0.049474199595073896]),
            (40, 38, [2.0127807225771863, -0.1996486771565886]),
            (70, 35, [1.768489557192376, -0.008748340326556626]),
            (70, 69, [3.4122790920376724, -0.15363771201512352]),
        ] {
            let found = smooth_root(&path(frames))[frame];
            let apart = (found - DVec2::from(expected)).length();
            assert!(apart < 1e-9, "{frame} of {frames}: {found}");
        }
    }

    /// On a straight walk the path is shifted by half a step, and by other parts of it at its end: it may be further from the
    /// hips than the margin.
    #[test]
    fn averaging_moves_the_smooth_root_half_a_frame_ahead() {
        const STEP: f64 = 1.0 / 30.0;
        let hips: Vec<DVec2> = (0..61)
            .map(|frame| DVec2::new(0.0, STEP * f64::from(frame)))
            .collect();
        let smooth = smooth_root(&hips);
        let steps: Vec<f64> = smooth
            .windows(2)
            .map(|pair| pair[1].y - pair[0].y)
            .collect();
        let inner = steps[0];
        for (index, step) in steps.iter().enumerate() {
            let expected = match steps.len() - index {
                1 => 0.75 * inner,
                2 => 1.25 * inner,
                _ => inner,
            };
            // 500 steps of ADMM leave the middle 4 % slower.
            assert!(
                (step - expected).abs() < 0.05 * inner,
                "{index}: {step} {expected}"
            );
        }
        let away = (smooth[0] - hips[0]).length();
        let expected = MARGIN + STEP / 2.0;
        assert!((away - expected).abs() < 1e-3, "{away} {expected}");
    }

    /// A body that stands, faces z and moves along x in the last frame.
    #[test]
    fn a_frame_is_root_heading_joints_and_contacts() {
        let mut body = [DVec3::new(0.0, 0.05, 0.0); HUMANML3D_JOINTS];
        body[0].y = 0.9;
        body[LEFT_HIP] = DVec3::new(0.1, 0.8, 0.0);
        body[RIGHT_HIP] = DVec3::new(-0.1, 0.8, 0.0);
        let mut frames = [body; 6];
        frames[5][FEET[0]].x = 0.1;
        let rotations = [[DQuat::IDENTITY; HUMANML3D_JOINTS]; 6];
        let rows = kimodo(&frames, &rotations, 30.0).unwrap();
        let first = &rows[0];
        assert_eq!(first[..5], [0.0, 0.9, 0.0, 1.0, 0.0]);
        assert_eq!(first[5 + 3 * LEFT_HIP..][..3], [0.1, 0.8, 0.0]);
        assert_eq!(first[5 + 66..][..6], [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        assert_eq!(first[KIMODO_NUMBERS - 4..], [1.0; 4]);
        for row in &rows[4..] {
            let speed = row[5 + 66 + 132 + 3 * FEET[0]];
            assert!((speed - 3.0).abs() < 1e-12, "{speed}");
            assert_eq!(row[KIMODO_NUMBERS - 4..], [0.0, 1.0, 1.0, 1.0]);
        }
        let refused = kimodo(&frames[..4], &rotations[..4], 30.0).unwrap_err();
        assert_eq!(refused, KimodoError::TooFewFrames { frames: 4 });
    }

    /// Solving gives back the points whose second differences are the right side.
    #[test]
    fn the_system_is_solved() {
        for frames in [3, 4, 5, 17] {
            let system = Accelerations::new(frames);
            let found: Vec<DVec2> = (0..frames)
                .map(|index| DVec2::new(libm::sin(index as f64), 0.3 * index as f64))
                .collect();
            let acceleration = |row: usize| match row == 0 || row + 1 == frames {
                true => DVec2::ZERO,
                false => 2.0 * found[row] - found[row - 1] - found[row + 1],
            };
            let product = |row: usize| {
                let of = |row: usize| acceleration(row);
                let before = if row > 0 { of(row - 1) } else { DVec2::ZERO };
                let after = if row + 1 < frames {
                    of(row + 1)
                } else {
                    DVec2::ZERO
                };
                2.0 * of(row) - before - after + system.weight * found[row]
            };
            let mut right: Vec<DVec2> = (0..frames).map(product).collect();
            system.solve(&mut right);
            for (found, right) in found.iter().zip(&right) {
                assert!(
                    (*found - *right).length() < 1e-12,
                    "{frames}: {found} {right}"
                );
            }
        }
    }
}
