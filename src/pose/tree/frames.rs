//! A tree as a list of frames, each of which moves by at most one joint: what kernels walk.

use glam::{DQuat, DVec3};

use crate::math::canonical::canonical;
use crate::pose::tree::{JointKind, JointValue, Tree, TreeError, TreeJoint};
use crate::shader::{
    FRAME_BALL, FRAME_FIXED, FRAME_FREE, FRAME_HINGE, FRAME_ROOT, FRAME_SLIDE, NO_FRAME, POSITION,
    STATE_VECTORS, TreeFrame, VECTOR_WORDS,
};

/// The words of a track's state.
pub(crate) const TRACK_WORDS: u32 = STATE_VECTORS * VECTOR_WORDS;

/// The largest magnitude of constants in f32.
const LARGEST_CONSTANT: f64 = 1e30;

/// The tracks of a clip that move the joints of a [`Tree`], by their indices.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct JointTracks {
    /// The track that moves the tree's world, if one does: the base of a robot without a free joint.
    pub base: Option<u32>,
    /// The track of each free joint.
    pub free: Vec<u32>,
    /// The track of each ball.
    pub balls: Vec<u32>,
    /// The track of each hinge and slide of [`Tree::scalar_joints`], and the coordinate of the track's position that is its
    /// value: 0 to 2.
    pub scalars: Vec<[u32; 2]>,
}

/// The bodies of a tree for [`BodyTables`](crate::crowd::BodyTables), in some order: constants in f32.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeFrames {
    /// Each after the one above it.
    pub(crate) frames: Vec<TreeFrame>,
    /// The frame of each body.
    pub(crate) bodies: Vec<u32>,
    /// The frame at whose origin the velocity of each body is.
    pub(crate) points: Vec<u32>,
    /// The word of each scalar in the states of a sample's tracks.
    pub(crate) scalars: Vec<u32>,
    /// Whether quaternions are `w x y z`, not `x y z w`.
    pub(crate) is_w_first: bool,
}

/// [`TreeFrames`] as 32-bit words, for files.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FrameWords {
    /// The constants of each frame.
    pub frames: Vec<[u32; 16]>,
    /// For each body its frame, and the one at whose origin its velocity is.
    pub bodies: Vec<[u32; 2]>,
    /// Where the value of each scalar is.
    pub scalars: Vec<u32>,
    /// Whether quaternions are `w x y z`, not `x y z w`.
    pub is_w_first: bool,
}

impl TreeFrames {
    /// The same with quaternions in the order `w x y z`.
    #[must_use]
    pub fn with_w_first(mut self) -> Self {
        self.is_w_first = true;
        self
    }

    /// Number of bodies.
    #[must_use]
    pub fn body_count(&self) -> usize {
        self.bodies.len()
    }

    /// Number of scalars.
    #[must_use]
    pub fn scalar_count(&self) -> usize {
        self.scalars.len()
    }

    /// As words.
    #[must_use]
    pub fn words(&self) -> FrameWords {
        let pairs = self.bodies.iter().zip(&self.points);
        FrameWords {
            frames: bytemuck::cast_slice(&self.frames).to_vec(),
            bodies: pairs.map(|(&body, &point)| [body, point]).collect(),
            scalars: self.scalars.clone(),
            is_w_first: self.is_w_first,
        }
    }

    /// Frames from words. [`BodyTables::new`](crate::crowd::BodyTables::new) checks them.
    #[must_use]
    pub fn of_words(words: &FrameWords) -> Self {
        Self {
            frames: bytemuck::cast_slice(&words.frames).to_vec(),
            bodies: words.bodies.iter().map(|pair| pair[0]).collect(),
            points: words.bodies.iter().map(|pair| pair[1]).collect(),
            scalars: words.scalars.clone(),
            is_w_first: words.is_w_first,
        }
    }

    /// Whether every index is within its table, for so many tracks.
    pub(crate) fn are_sound(&self, tracks: usize) -> bool {
        // Indices of words are 32-bit numbers.
        let Ok(tracks) = u32::try_from(tracks) else {
            return false;
        };
        let Some(words) = tracks.checked_mul(TRACK_WORDS) else {
            return false;
        };
        let count = self.frames.len();
        let is_track = |word: u32| word < words && word.is_multiple_of(TRACK_WORDS);
        let is_coordinate = |word: u32| {
            let first = POSITION * VECTOR_WORDS;
            word < words && (first..first + 3).contains(&(word % TRACK_WORDS))
        };
        let is_sound = |(index, frame): (usize, &TreeFrame)| {
            let is_of_kind = match frame.kind {
                FRAME_FIXED => frame.source < words,
                FRAME_HINGE | FRAME_SLIDE => is_coordinate(frame.source),
                FRAME_BALL | FRAME_FREE | FRAME_ROOT => is_track(frame.source),
                _ => false,
            };
            is_of_kind
                && (frame.above == NO_FRAME || (frame.above as usize) < index)
                && (frame.root == NO_FRAME || is_track(frame.root))
        };
        let are_frames = |list: &[u32]| list.iter().all(|&frame| (frame as usize) < count);
        u32::try_from(count).is_ok_and(|count| count.checked_mul(TRACK_WORDS).is_some())
            && !self.bodies.is_empty()
            && self.points.len() == self.bodies.len()
            && are_frames(&self.bodies)
            && are_frames(&self.points)
            && self.scalars.iter().all(|&word| is_coordinate(word))
            && self.frames.iter().enumerate().all(is_sound)
    }
}

/// The frames of a tree while they are made.
struct Frames(Vec<TreeFrame>);

impl Frames {
    /// Adds a frame that does not move in the frame above it, and returns its index.
    fn fixed(&mut self, above: u32, offset: DVec3, rest: DQuat) -> u32 {
        let root = self.0.get(above as usize).map_or(NO_FRAME, |it| it.root);
        self.0.push(TreeFrame {
            offset: offset.to_array().map(rounded),
            above,
            rest: rest.to_array().map(rounded),
            axis: [0.0; 3],
            kind: FRAME_FIXED,
            source: 0,
            root,
            multiplier: 0.0,
            shift: 0.0,
        });
        self.0.len() as u32 - 1
    }

    /// Adds a frame that moves in the world as a track does.
    fn of_world(&mut self, track: u32) -> u32 {
        let index = self.fixed(NO_FRAME, DVec3::ZERO, DQuat::IDENTITY);
        let frame = &mut self.0[index as usize];
        (frame.kind, frame.source) = (FRAME_ROOT, first_word(track));
        frame.root = frame.source;
        index
    }
}

/// The first word of a track; one that is in no table for a track that does not exist.
fn first_word(track: u32) -> u32 {
    track.saturating_mul(TRACK_WORDS)
}

/// A constant as kernels have it.
fn rounded(value: f64) -> f32 {
    canonical(value as f32)
}

impl Tree {
    /// Frames of these bodies (indices of [`Tree::bodies`]), whose joints `tracks` move. Velocities are those at the
    /// bodies' origins, or at `points`, one in the frame of each body of the tree, such as its centre of mass. Quaternions
    /// are `x y z w`, or `w x y z` of [`TreeFrames::with_w_first`].
    ///
    /// # Errors
    /// When there is not a track for each joint or a point for each body, a body does not exist, or a constant is too
    /// large for f32.
    pub fn frames(
        &self,
        tracks: &JointTracks,
        bodies: &[usize],
        points: &[DVec3],
    ) -> Result<TreeFrames, TreeError> {
        let counts = self.counts();
        let count = |kind, found, expected| match found == expected {
            true => Ok(()),
            false => Err(TreeError::Count {
                kind,
                found,
                expected,
            }),
        };
        count("tracks of free joints", tracks.free.len(), counts.free)?;
        count("tracks of balls", tracks.balls.len(), counts.balls)?;
        count("tracks of scalars", tracks.scalars.len(), counts.scalars)?;
        if !points.is_empty() {
            count("points", points.len(), self.bodies.len())?;
        }
        if let Some(&body) = bodies.iter().find(|&&body| body >= self.bodies.len()) {
            return Err(TreeError::MissingBody {
                body,
                count: self.bodies.len(),
            });
        }
        self.check_constants(points)?;
        let word = |[track, coordinate]: [u32; 2]| {
            first_word(track).saturating_add((POSITION * VECTOR_WORDS).saturating_add(coordinate))
        };
        let mut frames = Frames(Vec::new());
        let base = tracks.base.map(|track| frames.of_world(track));
        let mut of_bodies: Vec<u32> = Vec::with_capacity(self.bodies.len());
        let mut values = self.values.iter();
        for body in &self.bodies {
            let parent = body.parent.map(|parent| of_bodies[parent]);
            let above = parent.or(base).unwrap_or(NO_FRAME);
            // The pose of the next frame in the one above, and the origin of that in the axes of the body.
            let (mut last, mut offset, mut rest) = (above, body.position, body.rotation);
            let mut origin = DVec3::ZERO;
            for (joint, value) in body.joints.iter().zip(&mut values) {
                let anchor = match joint.kind {
                    JointKind::Hinge | JointKind::Ball => joint.anchor,
                    JointKind::Slide | JointKind::Free => origin,
                };
                last = match (*value, parent) {
                    (JointValue::Free(index), None) => frames.of_world(tracks.free[index]),
                    _ => frames.fixed(last, offset + rest * (anchor - origin), rest),
                };
                let frame = &mut frames.0[last as usize];
                match *value {
                    JointValue::Free(_) if parent.is_none() => {}
                    JointValue::Free(index) => {
                        (frame.kind, frame.source) = (FRAME_FREE, first_word(tracks.free[index]));
                    }
                    JointValue::Ball(index) => {
                        (frame.kind, frame.source) = (FRAME_BALL, first_word(tracks.balls[index]));
                    }
                    JointValue::Scalar {
                        index,
                        multiplier,
                        offset,
                    } => {
                        frame.kind = match joint.kind {
                            JointKind::Hinge => FRAME_HINGE,
                            _ => FRAME_SLIDE,
                        };
                        frame.axis = joint.axis.to_array().map(rounded);
                        frame.source = word(tracks.scalars[index]);
                        frame.multiplier = rounded(multiplier);
                        frame.shift = rounded(offset - joint.reference);
                    }
                }
                (offset, rest, origin) = (DVec3::ZERO, DQuat::IDENTITY, anchor);
            }
            let is_at_origin = !body.joints.is_empty() && origin == DVec3::ZERO;
            of_bodies.push(match is_at_origin {
                true => last,
                false => frames.fixed(last, offset - origin, rest),
            });
        }
        let of_points: Vec<u32> = (points.iter().zip(&of_bodies))
            .map(|(&point, &body)| match point == DVec3::ZERO {
                true => body,
                false => frames.fixed(body, point, DQuat::IDENTITY),
            })
            .collect();
        let at = |list: &[u32]| bodies.iter().map(|&body| list[body]).collect::<Vec<u32>>();
        Ok(TreeFrames {
            points: match points {
                [] => at(&of_bodies),
                _ => at(&of_points),
            },
            bodies: at(&of_bodies),
            frames: frames.0,
            scalars: tracks.scalars.iter().map(|&scalar| word(scalar)).collect(),
            is_w_first: false,
        })
    }

    /// Refuses constants that f32 does not have.
    fn check_constants(&self, points: &[DVec3]) -> Result<(), TreeError> {
        let refuse = |quantity, name: &str, value: String| {
            Err(TreeError::Constant {
                quantity,
                name: name.to_owned(),
                value,
            })
        };
        let is_large =
            |vector: DVec3| !vector.is_finite() || vector.abs().max_element() > LARGEST_CONSTANT;
        for (index, body) in self.bodies.iter().enumerate() {
            let point = points.get(index).copied().unwrap_or_default();
            if let Some(vector) = [body.position, point].into_iter().find(|&it| is_large(it)) {
                let quantity = "position or centre of mass, up to 1e30,";
                return refuse(quantity, &body.name, format!("{vector:?}"));
            }
        }
        for (joint, value) in self.joints().zip(&self.values) {
            let TreeJoint {
                anchor, reference, ..
            } = *joint;
            let of_mimic = match *value {
                JointValue::Scalar {
                    multiplier, offset, ..
                } => DVec3::new(multiplier, offset, reference),
                _ => DVec3::ZERO,
            };
            if let Some(vector) = [anchor, of_mimic].into_iter().find(|&it| is_large(it)) {
                let quantity = "anchor, factor, offset or reference, up to 1e30,";
                return refuse(quantity, &joint.name, format!("{vector:?}"));
            }
        }
        Ok(())
    }
}
