//! A tree as a list of frames. Each frame moves in the frame above it, by at most one joint. Walks along a tree follow
//! this list, in f64 ([`TreeWalk`](crate::trees::TreeWalk)) and in f32 ([`TreeFrames`](crate::trees::TreeFrames)).

use glam::{DQuat, DVec3};

use crate::pose::tree::{JointKind, JointValue, Tree};

/// A frame, before and after its joint acts.
pub(super) struct JointFrame {
    /// The index of the frame above it, which comes earlier; `None` in the world.
    pub(super) above: Option<usize>,
    /// The position of its origin in the frame above.
    pub(super) offset: DVec3,
    /// Its rotation in the frame above.
    pub(super) rest: DQuat,
    /// How it moves from there.
    pub(super) motion: FrameMotion,
}

/// How a frame moves.
#[derive(Clone, Copy)]
pub(super) enum FrameMotion {
    Fixed,
    /// About an axis.
    Hinge(ScalarMotion),
    /// Along an axis.
    Slide(ScalarMotion),
    /// As the ball with this index.
    Ball(usize),
    /// As the free joint with this index.
    Free(usize),
    /// The same, in the world.
    Root(usize),
    /// As the base, in the world.
    Base,
}

/// By `multiplier * scalars[index] + shift`.
#[derive(Clone, Copy)]
pub(super) struct ScalarMotion {
    pub(super) axis: DVec3,
    pub(super) index: usize,
    pub(super) multiplier: f64,
    pub(super) shift: f64,
}

/// The frames of a tree.
pub(super) struct JointFrames {
    /// Each after the one above it.
    pub(super) frames: Vec<JointFrame>,
    /// The frame of each body.
    pub(super) bodies: Vec<usize>,
    /// The frame with the origin at a point of each body.
    pub(super) points: Vec<usize>,
}

impl JointFrames {
    /// The frames of a tree, which stands on its base or in the world. Points are those of all bodies, each in its body's
    /// frame, or none for the bodies' origins.
    pub(super) fn new(tree: &Tree, has_base: bool, points: &[DVec3]) -> Self {
        let mut frames = Vec::new();
        let mut add = |above, (offset, rest), motion| {
            frames.push(JointFrame {
                above,
                offset,
                rest,
                motion,
            });
            frames.len() - 1
        };
        let at_origin = (DVec3::ZERO, DQuat::IDENTITY);
        let base = has_base.then(|| add(None, at_origin, FrameMotion::Base));
        let mut bodies: Vec<usize> = Vec::with_capacity(tree.bodies.len());
        let mut values = tree.values.iter();
        for body in &tree.bodies {
            let parent = body.parent.map(|parent| bodies[parent]);
            // The pose of the next frame relative to the frame above (`offset` and `rest`). `origin` is the origin of
            // the frame above, in the axes of the body.
            let (mut above, mut offset, mut rest) = (parent.or(base), body.position, body.rotation);
            let mut origin = DVec3::ZERO;
            for (joint, value) in body.joints.iter().zip(&mut values) {
                let anchor = match joint.kind {
                    JointKind::Hinge | JointKind::Ball => joint.anchor,
                    JointKind::Slide | JointKind::Free => origin,
                };
                let motion = match *value {
                    JointValue::Free(index) if parent.is_none() => FrameMotion::Root(index),
                    JointValue::Free(index) => FrameMotion::Free(index),
                    JointValue::Ball(index) => FrameMotion::Ball(index),
                    JointValue::Scalar {
                        index,
                        multiplier,
                        offset,
                    } => {
                        let scalar = ScalarMotion {
                            axis: joint.axis,
                            index,
                            multiplier,
                            shift: offset - joint.reference,
                        };
                        match joint.kind {
                            JointKind::Hinge => FrameMotion::Hinge(scalar),
                            _ => FrameMotion::Slide(scalar),
                        }
                    }
                };
                above = Some(match motion {
                    FrameMotion::Root(_) => add(None, at_origin, motion),
                    _ => add(above, (offset + rest * (anchor - origin), rest), motion),
                });
                (offset, rest, origin) = (DVec3::ZERO, DQuat::IDENTITY, anchor);
            }
            bodies.push(match above {
                Some(last) if !body.joints.is_empty() && origin == DVec3::ZERO => last,
                _ => add(above, (offset - origin, rest), FrameMotion::Fixed),
            });
        }
        let of_points = points.iter().zip(&bodies);
        let points = of_points
            .map(|(&point, &body)| match point == DVec3::ZERO {
                true => body,
                false => add(Some(body), (point, DQuat::IDENTITY), FrameMotion::Fixed),
            })
            .collect::<Vec<usize>>();
        Self {
            points: match points.is_empty() {
                true => bodies.clone(),
                false => points,
            },
            bodies,
            frames,
        }
    }
}
