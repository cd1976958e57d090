//! Clips of motion files: keys of joints over a skeleton. The modules below are operations on clips: sampling,
//! reducing, comparing, trimming and so on. None of them knows a format; formats and programs use them.

pub mod adjust;
pub mod carried_mesh;
pub mod collapse;
pub mod compare;
pub mod crowd_library;
mod dense;
pub mod end_frame;
pub(crate) mod grid;
pub mod join;
pub mod keyed;
pub mod keys;
pub mod origin;
pub mod outside;
pub mod packed;
pub mod poses;
pub mod recorded;
pub mod reduce;
pub mod retime;
pub mod root_motion;
pub mod sample;
pub mod scalar_tracks;
pub mod scalars;
mod select;
pub mod signs;
mod similarity;
pub mod skeleton;
pub mod smooth;
pub mod trajectory;
pub mod trim;
pub mod world;
mod written_joint;

use std::io;
use std::ops::Range;

use glam::{DVec3, Quat, Vec3};
use tumble::{Channel, FrameRate, Joints, Track, TrackError, TrackSet};

use crate::decimal::{Decimal, LARGEST_SECONDS, is_clock, offset_of};
use crate::motion::origin::{coordinate, origin_at_rest, relative};
pub use crate::motion::recorded::{RecordedBodies, RecordedRobot, RecordedSample};
pub use crate::motion::scalars::{Scalar, ScalarKind};
pub use crate::motion::select::{TrackName, TrackSelection};
pub use crate::motion::written_joint::{WrittenChannel, WrittenJoint};
use crate::names::same_named;

/// One clip of a file.
///
/// `skeleton` and `channels` have an entry for each track of `set`, or are empty. A joint is at rest in a channel
/// without keys: its track then has one key, the rest rotation, and its entry of `skeleton` has the rest translation
/// and scale.
#[derive(Debug, Clone, Default)]
pub struct Motion {
    /// The clip's name, if the file contains one.
    pub name: Option<String>,
    /// Index of the clip in the file, from 0; clips that cannot be read count too.
    pub index: usize,
    /// The keys of rotations, one track for each joint, and the keys of translations and scales.
    pub set: TrackSet,
    /// The parents and rest transforms of the tracks; empty if the tracks are not joints of a skeleton.
    pub skeleton: Vec<Joint>,
    /// How each track's channels are interpolated; empty if rotations have keys and the file specifies no method.
    pub channels: Vec<Channels>,
    /// The kinds and limits of the scalars of `set`, in their order; empty if none is known.
    pub scalars: Vec<Scalar>,
    /// The rate of which all key times are frames, if there is one.
    pub rate: Option<FrameRate>,
    /// Whether rotations and translations are relative to the world instead of the parent.
    pub is_world: bool,
    /// The seconds to add to every time of the set to get the time in the file. In f64, times since 1970 are exact
    /// only to 0.2 µs; times relative to a second near the first one lose nothing.
    pub time_offset: i64,
    /// The vector to add to each track's translations, at rest and animated; empty if all are 0. In f32, positions of
    /// maps would be exact only to 0.5 m.
    pub origins: Vec<DVec3>,
    /// Why poses in the world cannot be computed; `None` if they can.
    pub no_world: Option<String>,
    /// How the file wrote the joint of each track, so that a new file in the same format can write it in the same way;
    /// empty if the file does not contain it.
    pub written_joints: Vec<WrittenJoint>,
    /// The data of an SMPL body, if the clip is the motion of one.
    pub body: Option<Body>,
    /// The robot that moves, as the file describes it; `None` if the file is in no dialect.
    pub robot: Option<RecordedRobot>,
}

/// The whole second to subtract from these times, which becomes the [`time_offset`](Motion::time_offset) of their clip.
/// For most times it is 0; for times of a clock that counts from 1970, it is the second at or before the first time.
#[must_use]
pub fn clock_second<'a>(times: impl IntoIterator<Item = &'a f64>) -> i64 {
    let first = times.into_iter().copied().fold(f64::INFINITY, f64::min);
    match first.abs() <= LARGEST_SECONDS {
        true => offset_of(first.floor() as i64),
        false => 0,
    }
}

impl Motion {
    /// The clip without its tracks and scalars, for a clip with others.
    pub(crate) fn without_tracks(&self) -> Self {
        Self {
            name: self.name.clone(),
            set: TrackSet::new(),
            skeleton: self.skeleton.clone(),
            channels: self.channels.clone(),
            origins: self.origins.clone(),
            no_world: self.no_world.clone(),
            written_joints: self.written_joints.clone(),
            body: self.body.clone(),
            robot: self.robot.clone(),
            scalars: Vec::new(),
            ..*self
        }
    }

    /// The time in the set of a requested time. A clip with a [`time_offset`](Self::time_offset) accepts both times of
    /// the file and times of the set. A time that is nearer to the offset than to 0, for example 1700000000.5, is a
    /// time of the file, so the offset is subtracted. All other times are times of the set.
    #[must_use]
    pub fn time_in_set(&self, time: f64) -> f64 {
        let offset = self.time_offset as f64;
        let after = time - offset;
        match after.abs() < time.abs() {
            true => after,
            false => time,
        }
    }

    /// The [times in the set](Self::time_in_set) of a start and an end; if one is not requested, that of `whole`.
    #[must_use]
    pub fn range_in_set(
        &self,
        start: Option<f64>,
        end: Option<f64>,
        whole: (f64, f64),
    ) -> (f64, f64) {
        let in_set = |time| self.time_in_set(time);
        (start.map_or(whole.0, in_set), end.map_or(whole.1, in_set))
    }

    /// Whether a joint has a parent, or a rest translation other than 0.
    #[must_use]
    pub fn has_hierarchy(&self) -> bool {
        let moves = |joint: &Joint| joint.parent.is_some() || joint.rest.translation != Vec3::ZERO;
        self.skeleton.iter().any(moves)
    }

    /// The joints that the tracks are, with their parents if the clip has a skeleton.
    #[must_use]
    pub fn joints(&self) -> Joints {
        let joints = Joints::of(&self.set);
        match &self.skeleton[..] {
            [] => joints,
            all => joints.with_parents(all.iter().map(|joint| joint.parent).collect()),
        }
    }

    /// A text for a warning if several joints of one parent have the same name in the file, so that only their order
    /// distinguishes them. It says that their order is assumed to be the same in other clips. `None` if there are no
    /// such joints.
    #[must_use]
    pub fn order_assumption(&self, input: &str) -> Option<String> {
        let tracks = 0..self.set.track_count();
        let names: Vec<String> = tracks.map(|track| self.set.track_name(track)).collect();
        let parents: Vec<Option<usize>> = self.skeleton.iter().map(|joint| joint.parent).collect();
        let [first, second] = same_named(&names, &parents)?;
        Some(format!(
            "{input}: several joints are called `{}`; they are matched with those of other clips by their order in the \
             file (track {first}, track {second}): give them different names",
            names[first]
        ))
    }

    /// Whether the clip has parents, but no offsets, so that the positions of joints in the world are unknown. An SMPL
    /// body without a model of its shape is such a clip. Its rotations in the world are known.
    #[must_use]
    pub fn lacks_offsets(&self) -> bool {
        self.no_world.is_some() && (self.body.is_some() || self.has_unplaced_joints())
    }

    /// Whether some joints have parents, but none of these has an offset, or translation keys other than 0.
    #[must_use]
    pub fn has_unplaced_joints(&self) -> bool {
        let joints = self.skeleton.iter().enumerate();
        let mut children = joints
            .filter(|(_, joint)| joint.parent.is_some())
            .peekable();
        let is_placed = |(track, joint): (usize, &Joint)| {
            let keys = self.set.vector_keys(Channel::Translation, track);
            joint.rest.translation != Vec3::ZERO
                || keys.is_some_and(|keys| keys.keys.iter().any(|&key| key != Vec3::ZERO))
        };
        children.peek().is_some() && !children.any(is_placed)
    }

    /// How the channels of a track are interpolated; `None` for each if the file does not specify it.
    #[must_use]
    pub fn channel(&self, track: usize) -> Channels {
        self.channels.get(track).copied().unwrap_or_default()
    }

    /// The translation or scale at which a track rests without keys for it.
    #[must_use]
    pub fn rest(&self, channel: Channel, track: usize) -> Vec3 {
        let rest = self
            .skeleton
            .get(track)
            .map(|joint| joint.rest)
            .unwrap_or_default();
        match channel {
            Channel::Translation => rest.translation,
            Channel::Scale => rest.scale,
        }
    }

    /// Whether any track has keys of a channel.
    #[must_use]
    pub fn has_keys_of(&self, channel: Channel) -> bool {
        (0..self.set.track_count()).any(|track| self.set.vector_keys(channel, track).is_some())
    }

    /// Whether any track has keys of translations or scales.
    #[must_use]
    pub fn has_vectors(&self) -> bool {
        self.has_keys_of(Channel::Translation) || self.has_keys_of(Channel::Scale)
    }

    /// Whether the tracks are boxes of a chain: only rotations, without a skeleton, positions or scalars.
    #[must_use]
    pub fn is_chain(&self) -> bool {
        self.skeleton.is_empty() && !self.has_vectors() && self.set.scalar_count() == 0
    }

    /// The vector to add to a track's translations ([`origins`](Self::origins)).
    #[must_use]
    pub fn origin(&self, track: usize) -> DVec3 {
        self.origins.get(track).copied().unwrap_or_default()
    }

    /// The rest position of a joint relative to its parent: its rest translation plus its [origin](Self::origins).
    #[must_use]
    pub fn rest_position(&self, track: usize) -> DVec3 {
        self.origin(track) + self.rest(Channel::Translation, track).as_dvec3()
    }

    /// Sets the vector to add to a track's translations.
    pub fn set_origin(&mut self, track: usize, origin: DVec3) {
        if origin == DVec3::ZERO && self.origins.is_empty() {
            return;
        }
        let tracks = self.set.track_count().max(track + 1);
        self.origins.resize(tracks, DVec3::ZERO);
        self.origins[track] = origin;
    }

    /// The rest translation of a track at `position`, relative to an [origin](Self::origins) if it needs one. With
    /// keys of translation it is relative to their origin.
    pub(crate) fn resting_at(
        &mut self,
        track: usize,
        parent: Option<usize>,
        position: DVec3,
    ) -> Vec3 {
        let moves = self.set.vector_keys(Channel::Translation, track).is_some();
        if !moves {
            self.set_origin(track, origin_at_rest(parent, position));
        }
        (position - self.origin(track)).as_vec3()
    }

    /// Sets translation keys of a track, without tangents. They are stored relative to an [origin](Self::origins) if
    /// they need one.
    ///
    /// # Errors
    /// As [`TrackSet::set_translations`].
    pub fn set_positions(
        &mut self,
        track: usize,
        times: &[f64],
        points: &[DVec3],
    ) -> Result<(), TrackError> {
        let (origin, points) = relative(points);
        self.set.set_translations(track, times, &points, &[])?;
        self.set_origin(track, origin);
        Ok(())
    }
}

/// An SMPL body. The shape of the body determines where its joints are.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Body {
    /// The position of the pelvis when `trans` is 0, in the clip's units and axes. It is included in the translations
    /// of the first track, but not in the file's `trans`. It is 0 until [`set_offsets`](crate::motion::adjust::set_offsets)
    /// sets it.
    pub pelvis: Vec3,
    /// The shape, as the file specifies it.
    pub shape: Shape,
    /// The direction that points up in the clip's axes; `None` if it is not known, because most files of bodies do not
    /// state it. At rest, a body stands along y and faces z in the axes of its model, whichever direction this is.
    pub up: Option<DVec3>,
}

/// The shape of an SMPL body.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shape {
    /// The coefficients of the model's shape directions; empty for the mean shape.
    pub betas: Vec<f64>,
    /// `male`, `female`, `neutral`, or empty if the file does not contain it.
    pub gender: String,
}

/// A joint of a skeleton.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// Index of the parent's track; `None` for a root. A parent may come after its children.
    pub parent: Option<usize>,
    /// The rest transform, relative to the parent.
    pub rest: Transform,
}

/// A track that is its own ancestor, by the parent of each track; `None` if there is none. Parents that do not exist
/// count as none.
#[must_use]
pub fn circle(parents: &[Option<usize>]) -> Option<usize> {
    let mut is_done = vec![false; parents.len()];
    for track in 0..parents.len() {
        let mut line = Vec::new();
        let mut next = Some(track);
        while let Some(joint) = next.filter(|&joint| is_done.get(joint) == Some(&false)) {
            if line.len() == parents.len() {
                return Some(joint);
            }
            line.push(joint);
            next = parents[joint];
        }
        line.into_iter().for_each(|joint| is_done[joint] = true);
    }
    None
}

/// A transform: first the scale, then the rotation, then the translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform {
    /// The translation, in the file's unit of length.
    pub translation: Vec3,
    /// The rotation, a unit quaternion.
    pub rotation: Quat,
    /// The scale along each axis.
    pub scale: Vec3,
}

impl Default for Transform {
    /// The identity.
    fn default() -> Self {
        Self {
            translation: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
        }
    }
}

/// How the channels of one track are interpolated; `None` for a channel without keys, which is at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Channels {
    /// Interpolation of the rotation.
    pub rotation: Option<ChannelInterpolation>,
    /// Interpolation of the translation.
    pub translation: Option<ChannelInterpolation>,
    /// Interpolation of the scale.
    pub scale: Option<ChannelInterpolation>,
}

impl Channels {
    /// The interpolation of the translation or the scale.
    #[must_use]
    pub fn of(&self, channel: Channel) -> Option<ChannelInterpolation> {
        match channel {
            Channel::Translation => self.translation,
            Channel::Scale => self.scale,
        }
    }

    /// Whether any channel has this interpolation.
    #[must_use]
    pub fn has(self, sampler: ChannelInterpolation) -> bool {
        [self.rotation, self.translation, self.scale].contains(&Some(sampler))
    }
}

/// How a channel is interpolated between its keys, as glTF 2.0 defines it.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum ChannelInterpolation {
    /// The value of the key at or before the time.
    Step,
    /// Straight lines, or the shorter arcs for rotations.
    Linear,
    /// Cubic Hermite splines with stored tangents; rotations are normalised.
    Cubic,
}

impl ChannelInterpolation {
    /// The name in glTF.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Step => "STEP",
            Self::Linear => "LINEAR",
            Self::Cubic => "CUBICSPLINE",
        }
    }
}

/// Copies the tangents, velocities and tensions of some keys of one track to another track.
///
/// # Errors
/// When the track does not have the same number of keys.
pub(crate) fn carry_key_data(
    set: &mut TrackSet,
    track: usize,
    from: &Track<'_>,
    keys: Range<usize>,
) -> Result<(), TrackError> {
    if !from.tangents.is_empty() {
        set.set_tangents(track, &from.tangents[keys.clone()])?;
    }
    if !from.velocities.is_empty() {
        set.set_velocities(track, &from.velocities[keys.clone()])?;
    }
    if !from.tcb.is_empty() {
        set.set_tcb(track, &from.tcb[keys])?;
    }
    Ok(())
}

/// The samples of a clip, ready to be written.
///
/// The lists of rotations, translations and scales are in the order `[sample][track]`.
#[derive(Debug, Clone)]
pub struct SampledClip<'a> {
    /// The clip.
    pub clip: &'a Motion,
    /// Sample times, in seconds, increasing.
    pub times: &'a [f64],
    /// The rate, if all times are frames of one.
    pub rate: Option<FrameRate>,
    /// Unit quaternions with continued signs: each is nearer to the one before in its track than its negative.
    pub rotations: &'a [Quat],
    /// Translations of all tracks; empty if no track has any.
    pub translations: &'a [Vec3],
    /// Scales of all tracks; empty if no track has any.
    pub scales: &'a [Vec3],
    /// All scalars of the clip, in the order `[sample][scalar]`.
    pub scalars: &'a [f32],
    /// How the samples were made, for formats that can store it: `("method", "slerp")`.
    pub notes: &'a [(&'a str, String)],
    /// Whether the samples are those of the clip's keys. A format with separate key times for each channel (glTF)
    /// then writes the keys instead, unless the poses are relative to the world.
    pub is_at_keys: bool,
}

impl SampledClip<'_> {
    /// Number of samples of all tracks together.
    ///
    /// # Errors
    /// `InvalidInput` if the length of a list does not fit the times and the tracks.
    pub(crate) fn checked_len(&self) -> io::Result<usize> {
        let tracks = self.clip.set.track_count();
        let all = tracks.saturating_mul(self.times.len());
        let scalars = self
            .clip
            .set
            .scalar_count()
            .saturating_mul(self.times.len());
        let lists = [
            ("rotations", self.rotations.len(), all, false),
            ("translations", self.translations.len(), all, true),
            ("scales", self.scales.len(), all, true),
            ("scalars", self.scalars.len(), scalars, false),
            ("joints", self.clip.skeleton.len(), tracks, true),
            ("channels", self.clip.channels.len(), tracks, true),
        ];
        for (name, length, expected, may_be_empty) in lists {
            if length != expected && !(may_be_empty && length == 0) {
                let message =
                    format!("a clip of {tracks} tracks has {length} {name}, not {expected}");
                return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
            }
        }
        Ok(all)
    }

    /// The time of a sample as text; `None` if it is out of range. If the samples are not frames of a rate, it has at
    /// least nine decimals, so that readers do not take it for a rounded time. Times of a clock have nanoseconds,
    /// unless two samples are nearer to each other.
    pub(crate) fn time_digits(&self, sample: usize) -> Option<String> {
        const NEAR: f64 = 2e-9;
        let exact = Decimal::of(self.clip.time_offset, self.times[sample])?;
        let beside = [sample.checked_sub(1), Some(sample + 1)]
            .into_iter()
            .flatten();
        let mut beside = beside.filter_map(|beside| self.times.get(beside));
        let is_near = beside.any(|time| (time - self.times[sample]).abs() < NEAR);
        let time = match is_clock(self.clip.time_offset) && !is_near {
            true => exact.to_clock(),
            false => exact,
        };
        Some(match self.rate {
            Some(_) => time.to_string(),
            None if time.is_whole() => time.to_string(),
            None => format!("{time:.9}"),
        })
    }

    /// Whether any track has an origin other than 0.
    #[must_use]
    pub fn has_origins(&self) -> bool {
        self.clip
            .origins
            .iter()
            .any(|&origin| origin != DVec3::ZERO)
    }

    /// The translation of a track, relative to its [origin](Motion::origins): from
    /// [`translations`](Self::translations), or the rest translation if that is empty.
    #[must_use]
    pub fn translation(&self, sample: usize, track: usize) -> Vec3 {
        let index = sample * self.clip.set.track_count() + track;
        let sampled = self.translations.get(index).copied();
        sampled.unwrap_or_else(|| self.clip.rest(Channel::Translation, track))
    }

    /// The position of a track: its translation plus its origin.
    #[must_use]
    pub fn position(&self, sample: usize, track: usize) -> DVec3 {
        self.clip.origin(track) + self.translation(sample, track).as_dvec3()
    }

    /// The value of a scalar at a sample.
    pub(crate) fn scalar_value(&self, sample: usize, index: usize) -> f64 {
        let all = self.clip.set.scalar_count();
        let value = f64::from(self.scalars[sample * all + index]);
        value + self.clip.scalar(index).origin
    }

    /// The value of a scalar as text, with every digit.
    pub(crate) fn scalar_text(&self, sample: usize, index: usize) -> String {
        match self.clip.scalar(index).origin == 0.0 {
            true => (self.scalar_value(sample, index) as f32).to_string(),
            false => self.scalar_value(sample, index).to_string(),
        }
    }

    /// The position of a track as text.
    pub(crate) fn coordinates(&self, sample: usize, track: usize) -> [String; 3] {
        let (origin, relative) = (self.clip.origin(track), self.translation(sample, track));
        [0, 1, 2].map(|axis| coordinate(origin[axis], relative[axis]))
    }
}
