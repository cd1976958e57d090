//! The frames of a tree with constants in f32, along which kernels walk.

use glam::DVec3;

use crate::math::canonical::canonical;
use crate::pose::tree::configuration::check_counts;
use crate::pose::tree::joint_frames::{FrameMotion, JointFrames};
use crate::pose::tree::{JointValue, Tree, TreeError, TreeJoint};
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

/// The first word of a track; one that is in no table for a track that does not exist.
fn first_word(track: u32) -> u32 {
    track.saturating_mul(TRACK_WORDS)
}

/// A constant as kernels have it.
fn rounded(value: f64) -> f32 {
    canonical(value as f32)
}

impl Tree {
    /// Frames of these bodies (indices of [`Tree::bodies`]), whose joints are moved by `tracks`. If `points` is empty,
    /// velocities are those of the bodies' origins. Otherwise it has a point for each body of the tree, in the body's
    /// frame, such as the centre of mass, and velocities are those of these points. Quaternions are `x y z w`;
    /// [`TreeFrames::with_w_first`] changes this to `w x y z`.
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
        check_counts([
            ("tracks of free joints", tracks.free.len(), counts.free),
            ("tracks of balls", tracks.balls.len(), counts.balls),
            ("tracks of scalars", tracks.scalars.len(), counts.scalars),
        ])?;
        self.check_bodies(bodies, points)?;
        self.check_constants(points)?;
        let word = |[track, coordinate]: [u32; 2]| {
            first_word(track).saturating_add((POSITION * VECTOR_WORDS).saturating_add(coordinate))
        };
        let JointFrames {
            frames: all,
            bodies: of_bodies,
            points: of_points,
        } = JointFrames::new(self, tracks.base.is_some(), points);
        let mut frames: Vec<TreeFrame> = Vec::with_capacity(all.len());
        for frame in &all {
            let above = frame.above.map(|above| &frames[above]);
            let mut made = TreeFrame {
                offset: frame.offset.to_array().map(rounded),
                above: frame.above.map_or(NO_FRAME, |above| above as u32),
                rest: frame.rest.to_array().map(rounded),
                axis: [0.0; 3],
                kind: FRAME_FIXED,
                source: 0,
                root: above.map_or(NO_FRAME, |above| above.root),
                multiplier: 0.0,
                shift: 0.0,
            };
            (made.kind, made.source) = match frame.motion {
                FrameMotion::Fixed => (FRAME_FIXED, 0),
                FrameMotion::Base => (FRAME_ROOT, first_word(tracks.base.unwrap_or_default())),
                FrameMotion::Root(index) => (FRAME_ROOT, first_word(tracks.free[index])),
                FrameMotion::Free(index) => (FRAME_FREE, first_word(tracks.free[index])),
                FrameMotion::Ball(index) => (FRAME_BALL, first_word(tracks.balls[index])),
                FrameMotion::Hinge(scalar) => (FRAME_HINGE, word(tracks.scalars[scalar.index])),
                FrameMotion::Slide(scalar) => (FRAME_SLIDE, word(tracks.scalars[scalar.index])),
            };
            match frame.motion {
                FrameMotion::Base | FrameMotion::Root(_) => made.root = made.source,
                FrameMotion::Hinge(scalar) | FrameMotion::Slide(scalar) => {
                    made.axis = scalar.axis.to_array().map(rounded);
                    made.multiplier = rounded(scalar.multiplier);
                    made.shift = rounded(scalar.shift);
                }
                FrameMotion::Fixed | FrameMotion::Free(_) | FrameMotion::Ball(_) => {}
            }
            frames.push(made);
        }
        let at = |list: &[usize]| bodies.iter().map(|&body| list[body] as u32).collect();
        Ok(TreeFrames {
            points: at(&of_points),
            bodies: at(&of_bodies),
            frames,
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
