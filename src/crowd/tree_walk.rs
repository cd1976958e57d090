//! The walk along the frames of a robot's tree, of several instances together. Twin of `shaders/motion/tree.wgsl` and
//! `shaders/math/rotation_about.wgsl`.

use crate::crowd::states::{JOINT_NUMBERS, Joint, canonical3};
use crate::math::quaternion::{cross3, dot, product, scaled, sum};
use crate::pose::tree::frames::TRACK_WORDS;
use crate::shader::{
    FRAME_BALL, FRAME_FIXED, FRAME_FREE, FRAME_HINGE, FRAME_SLIDE, NO_FRAME, TreeFrame,
    VECTOR_WORDS,
};
use crate::simd::lanes::{Lanes, canonical};
use crate::twin::functions::rotation_about;
use crate::twin::quaternion::rotated;

/// The numbers of a frame.
pub(super) const FRAME_NUMBERS: usize = JOINT_NUMBERS + 3;

/// A frame in the world.
struct WalkedFrame<L> {
    in_world: Joint<L>,
    /// The position from its root.
    from_root: [L; 3],
}

impl<L: Lanes> WalkedFrame<L> {
    /// Where frames without one above them are.
    #[inline(always)]
    fn world() -> Self {
        let (zero, one) = (L::all(0.0), L::all(1.0));
        Self {
            in_world: Joint {
                rotation: [zero, zero, zero, one],
                position: [zero; 3],
                velocity: [zero; 3],
                angular_velocity: [zero; 3],
            },
            from_root: [zero; 3],
        }
    }

    #[inline(always)]
    fn load(numbers: &[f32]) -> Self {
        let [x, y, z] = [JOINT_NUMBERS, JOINT_NUMBERS + 1, JOINT_NUMBERS + 2];
        Self {
            in_world: Joint::load(numbers),
            from_root: [
                L::load_unordered(&numbers[x * L::COUNT..]),
                L::load_unordered(&numbers[y * L::COUNT..]),
                L::load_unordered(&numbers[z * L::COUNT..]),
            ],
        }
    }

    #[inline(always)]
    fn store(self, numbers: &mut [f32]) {
        let (joint, from_root) = numbers.split_at_mut(JOINT_NUMBERS * L::COUNT);
        self.in_world.store(joint);
        for (number, lanes) in (self.from_root.iter()).zip(from_root.chunks_exact_mut(L::COUNT)) {
            number.store_unordered(lanes);
        }
    }
}

/// The numbers of a list of joints or frames, which have `each` numbers: those of one of them.
#[inline(always)]
fn numbers_of<L: Lanes>(list: &[f32], each: usize, index: u32) -> &[f32] {
    &list[index as usize * each * L::COUNT..][..each * L::COUNT]
}

/// The track that has a word.
#[inline(always)]
fn track<L: Lanes>(tracks: &[f32], word: u32) -> &[f32] {
    numbers_of::<L>(tracks, JOINT_NUMBERS, word / TRACK_WORDS)
}

/// A frame that was walked to.
#[inline(always)]
pub(super) fn frame<L: Lanes>(walked: &[f32], index: u32) -> Joint<L> {
    Joint::load(numbers_of::<L>(walked, FRAME_NUMBERS, index))
}

/// A scalar among the tracks: its value and its rate.
#[inline(always)]
pub(super) fn scalar<L: Lanes>(tracks: &[f32], word: u32) -> [L; 2] {
    let Joint {
        position, velocity, ..
    } = Joint::load(track::<L>(tracks, word));
    match word % VECTOR_WORDS {
        0 => [position[0], velocity[0]],
        1 => [position[1], velocity[1]],
        _ => [position[2], velocity[2]],
    }
}

/// Computes the frames of as many instances as a vector has lanes, from their tracks. `tracks` and `walked` have the
/// numbers of tracks and frames, each as a vector.
#[inline(always)]
pub(super) fn walk<L: Lanes>(
    frames: &[TreeFrame],
    tracks: &[f32],
    moves: bool,
    walked: &mut [f32],
) {
    let each = FRAME_NUMBERS * L::COUNT;
    for (index, frame) in frames.iter().enumerate() {
        let (before, here) = walked.split_at_mut(index * each);
        let above = match frame.above {
            NO_FRAME => WalkedFrame::world(),
            above => WalkedFrame::load(numbers_of::<L>(before, FRAME_NUMBERS, above)),
        };
        walk_to::<L>(frame, &above, tracks, moves).store(&mut here[..each]);
    }
}

/// A constant of a frame, for all instances.
#[inline(always)]
fn all3<L: Lanes>([x, y, z]: [f32; 3]) -> [L; 3] {
    [L::all(x), L::all(y), L::all(z)]
}

#[inline(always)]
fn walk_to<L: Lanes>(
    frame: &TreeFrame,
    parent: &WalkedFrame<L>,
    tracks: &[f32],
    moves: bool,
) -> WalkedFrame<L> {
    let zero = L::all(0.0);
    let [x, y, z, w] = frame.rest;
    let rest = [L::all(x), L::all(y), L::all(z), L::all(w)];
    let above = parent.in_world.rotation;
    let axes = product(above, rest);
    let mut arm = rotated(above, all3(frame.offset));
    let mut rotation = axes;
    // The joint's linear and angular velocity, in `axes`.
    let (mut linear, mut angular) = ([zero; 3], [zero; 3]);
    match frame.kind {
        FRAME_FIXED => {}
        FRAME_HINGE | FRAME_SLIDE => {
            let (axis, multiplier) = (all3(frame.axis), L::all(frame.multiplier));
            let [coordinate, change] = scalar::<L>(tracks, frame.source);
            let value = multiplier * coordinate + L::all(frame.shift);
            let rate = match moves {
                true => multiplier * change,
                false => zero,
            };
            if frame.kind == FRAME_HINGE {
                rotation = product(axes, rotation_about(axis, value));
                angular = scaled(axis, rate);
            } else {
                arm = sum(arm, rotated(axes, scaled(axis, value)));
                linear = scaled(axis, rate);
            }
        }
        kind => {
            let track = Joint::load(track::<L>(tracks, frame.source));
            rotation = product(axes, track.rotation);
            if kind == FRAME_FREE {
                arm = sum(arm, rotated(axes, track.position));
            }
            if moves {
                angular = track.angular_velocity;
                if kind != FRAME_BALL {
                    linear = track.velocity;
                }
            }
        }
    }
    // One step of Newton's method normalises the rotation, so that rounding errors do not add up along the tree.
    let scale = L::all(1.5) - L::all(0.5) * dot(rotation, rotation);
    let [x, y, z, w] = rotation;
    let from_root = canonical3(sum(parent.from_root, arm));
    let position = match frame.root {
        NO_FRAME => from_root,
        root => {
            let root = Joint::load(track::<L>(tracks, root));
            canonical3(sum(from_root, root.position))
        }
    };
    let mut in_world = Joint {
        rotation: canonical([x * scale, y * scale, z * scale, w * scale]),
        position,
        velocity: [zero; 3],
        angular_velocity: [zero; 3],
    };
    if moves {
        let Joint {
            velocity,
            angular_velocity,
            ..
        } = parent.in_world;
        let carried = sum(velocity, cross3(angular_velocity, arm));
        in_world.velocity = canonical3(sum(carried, rotated(axes, linear)));
        in_world.angular_velocity = canonical3(sum(angular_velocity, rotated(axes, angular)));
    }
    WalkedFrame {
        in_world,
        from_root,
    }
}
