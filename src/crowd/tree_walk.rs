//! The walk along the frames of a robot's tree. Twin of `shaders/motion/tree.wgsl` and `shaders/math/rotation_about.wgsl`.

use crate::crowd::states::Joint;
use crate::math::canonical::canonical;
use crate::math::quaternion::{cross3, dot, product, scaled, sum};
use crate::pose::tree::frames::TRACK_WORDS;
use crate::shader::{
    FRAME_BALL, FRAME_FIXED, FRAME_FREE, FRAME_HINGE, FRAME_SLIDE, NO_FRAME, TreeFrame,
    VECTOR_WORDS,
};
use crate::twin::functions::rotation_about;
use crate::twin::quaternion::rotated;

/// A frame in the world.
#[derive(Clone, Copy)]
pub(super) struct WalkedFrame {
    pub(super) in_world: Joint<f32>,
    /// The position from its root.
    from_root: [f32; 3],
}

/// Where frames without one above them are.
const WORLD: WalkedFrame = WalkedFrame {
    in_world: Joint {
        rotation: [0.0, 0.0, 0.0, 1.0],
        position: [0.0; 3],
        velocity: [0.0; 3],
        angular_velocity: [0.0; 3],
    },
    from_root: [0.0; 3],
};

/// A scalar among the tracks: its value and its rate.
#[inline(always)]
pub(super) fn scalar(tracks: &[Joint<f32>], word: u32) -> [f32; 2] {
    let track = &tracks[(word / TRACK_WORDS) as usize];
    let coordinate = (word % VECTOR_WORDS) as usize;
    [track.position[coordinate], track.velocity[coordinate]]
}

/// Computes the frames of a sample from its tracks.
#[inline(always)]
pub(super) fn walk(
    frames: &[TreeFrame],
    tracks: &[Joint<f32>],
    moves: bool,
    walked: &mut Vec<WalkedFrame>,
) {
    walked.clear();
    for frame in frames {
        let above = match frame.above {
            NO_FRAME => &WORLD,
            above => &walked[above as usize],
        };
        walked.push(walk_to(frame, above, tracks, moves));
    }
}

#[inline(always)]
fn walk_to(
    frame: &TreeFrame,
    parent: &WalkedFrame,
    tracks: &[Joint<f32>],
    moves: bool,
) -> WalkedFrame {
    let above = parent.in_world.rotation;
    let axes = product(above, frame.rest);
    let mut arm = rotated(above, frame.offset);
    let mut rotation = axes;
    // Its velocities about and along `axes`.
    let (mut linear, mut angular) = ([0.0; 3], [0.0; 3]);
    match frame.kind {
        FRAME_FIXED => {}
        FRAME_HINGE | FRAME_SLIDE => {
            let [coordinate, change] = scalar(tracks, frame.source);
            let value = frame.multiplier * coordinate + frame.shift;
            let rate = match moves {
                true => frame.multiplier * change,
                false => 0.0,
            };
            if frame.kind == FRAME_HINGE {
                rotation = product(axes, rotation_about(frame.axis, value));
                angular = scaled(frame.axis, rate);
            } else {
                arm = sum(arm, rotated(axes, scaled(frame.axis, value)));
                linear = scaled(frame.axis, rate);
            }
        }
        kind => {
            let track = &tracks[(frame.source / TRACK_WORDS) as usize];
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
    // One step of Newton's: rounding does not add up along the tree.
    let scale = 1.5 - 0.5 * dot(rotation, rotation);
    let from_root = sum(parent.from_root, arm).map(canonical);
    let position = match frame.root {
        NO_FRAME => from_root,
        root => {
            let root = &tracks[(root / TRACK_WORDS) as usize];
            sum(from_root, root.position).map(canonical)
        }
    };
    let mut in_world = Joint {
        rotation: rotation.map(|component| canonical(component * scale)),
        position,
        ..WORLD.in_world
    };
    if moves {
        let Joint {
            velocity,
            angular_velocity,
            ..
        } = parent.in_world;
        let carried = sum(velocity, cross3(angular_velocity, arm));
        in_world.velocity = sum(carried, rotated(axes, linear)).map(canonical);
        in_world.angular_velocity = sum(angular_velocity, rotated(axes, angular)).map(canonical);
    }
    WalkedFrame {
        in_world,
        from_root,
    }
}
