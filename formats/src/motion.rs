//! What motion files hold: clips of keyed joints over a skeleton.

mod dense;
pub(crate) mod grid;
mod select;

use std::io;
use std::ops::Range;

use glam::{DVec3, Quat, Vec3};
use tumble::{Channel, FrameRate, Track, TrackError, TrackSet};

use crate::bvh::joint::BvhJoint;
use crate::decimal::Decimal;
use crate::origin::{coordinate, origin_at_rest, relative};

/// One clip of a file.
///
/// `skeleton` and `channels` have an entry for each track of `set`, or none at all. A joint whose
/// channel has no keys rests: its track has one key, the rest rotation, and its `skeleton` entry
/// has the rest translation and scale.
#[derive(Debug, Clone, Default)]
pub struct Motion {
    /// The clip's name, if the file gives it one.
    pub name: Option<String>,
    /// Its index among the file's clips, from 0, those that cannot be read included.
    pub index: usize,
    /// Keys of rotations, one track a joint, and the keys of translations and scales beside them.
    pub set: TrackSet,
    /// The parents and rest transforms of the tracks; empty for tracks that are not joints of a skeleton.
    pub skeleton: Vec<Joint>,
    /// How each track is keyed; empty where rotations are keyed and the file names no method.
    pub channels: Vec<Channels>,
    /// The rate on whose frames all times lie, if there is one.
    pub rate: Option<FrameRate>,
    /// Rotations and translations are relative to the world instead of the parent.
    pub is_world: bool,
    /// Whole seconds that every time of the set is to be moved by. Clocks that count from 1970
    /// would leave f64 only 0.2 µs; times that count from near their first lose nothing.
    pub time_offset: i64,
    /// What each track's translations, at rest and moving, are to be moved by, as positions of maps would
    /// leave f32 only 0.5 m; empty where they count from 0.
    pub origins: Vec<DVec3>,
    /// Why poses in the world cannot be computed, where they cannot.
    pub no_world: Option<String>,
    /// How BVH writes each track down; empty for clips of which no file says it.
    pub bvh: Vec<BvhJoint>,
    /// What is to be known of a body of SMPL.
    pub body: Option<Body>,
}

impl Motion {
    /// The clip without its tracks: what is made of it gets others.
    pub(crate) fn without_tracks(&self) -> Self {
        Self {
            name: self.name.clone(),
            set: TrackSet::new(),
            skeleton: self.skeleton.clone(),
            channels: self.channels.clone(),
            origins: self.origins.clone(),
            no_world: self.no_world.clone(),
            bvh: self.bvh.clone(),
            body: self.body.clone(),
            ..*self
        }
    }

    /// Whether a joint has a parent, or rests elsewhere than at 0.
    #[must_use]
    pub fn has_hierarchy(&self) -> bool {
        let moves = |joint: &Joint| joint.parent.is_some() || joint.rest.translation != Vec3::ZERO;
        self.skeleton.iter().any(moves)
    }

    /// How a track is keyed; nothing where the file says nothing of it.
    #[must_use]
    pub fn channel(&self, track: usize) -> Channels {
        self.channels.get(track).copied().unwrap_or_default()
    }

    /// Where a track rests that has no keys of its translation or scale.
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

    /// Whether any track has keys of translations or scales.
    #[must_use]
    pub fn has_vectors(&self) -> bool {
        let channels = [Channel::Translation, Channel::Scale];
        let keyed = |track| channels.map(|it| self.set.vector_keys(it, track).is_some());
        (0..self.set.track_count()).any(|track| keyed(track).contains(&true))
    }

    /// What a track's translations are to be moved by.
    #[must_use]
    pub fn origin(&self, track: usize) -> DVec3 {
        self.origins.get(track).copied().unwrap_or_default()
    }

    /// Says what a track's translations are to be moved by.
    pub fn set_origin(&mut self, track: usize, origin: DVec3) {
        if origin == DVec3::ZERO && self.origins.is_empty() {
            return;
        }
        let tracks = self.set.track_count().max(track + 1);
        self.origins.resize(tracks, DVec3::ZERO);
        self.origins[track] = origin;
    }

    /// Where a track rests, about an [origin](Self::origins) where it needs one; keys of translation have theirs
    /// already.
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

    /// Gives a track translation keys without tangents, about an [origin](Self::origins) where they
    /// need one.
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

/// A body of SMPL, whose joints lie where its shape puts them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Body {
    /// Where the shape puts the pelvis when `trans` is 0, in the clip's units and about its axes: it is
    /// part of the translations of the first track, and no part of the file's `trans`. 0 as long as
    /// no offsets are given.
    pub pelvis: Vec3,
    /// What the file says of the shape.
    pub shape: Shape,
}

/// The shape of a body of SMPL.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shape {
    /// How far it goes in each direction of the model; empty for the mean shape.
    pub betas: Vec<f64>,
    /// `male`, `female`, `neutral`, or empty where the file does not say it.
    pub gender: String,
}

/// A joint of a skeleton.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// The track of the parent joint; a root has none. Parents may come after their
    /// children.
    pub parent: Option<usize>,
    /// Its transform, relative to the parent, where nothing moves it.
    pub rest: Transform,
}

/// A scale, then a rotation, then a translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform {
    /// Where the origin goes, in the file's units.
    pub translation: Vec3,
    /// A unit quaternion.
    pub rotation: Quat,
    /// Along the axes.
    pub scale: Vec3,
}

impl Default for Transform {
    /// Nothing moves.
    fn default() -> Self {
        Self {
            translation: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
        }
    }
}

/// How the channels of one track are interpolated; `None` for a channel without keys, which rests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Channels {
    /// Of the rotation.
    pub rotation: Option<ChannelInterpolation>,
    /// Of the translation.
    pub translation: Option<ChannelInterpolation>,
    /// Of the scale.
    pub scale: Option<ChannelInterpolation>,
}

impl Channels {
    /// The sampler of a translation or scale.
    #[must_use]
    pub fn of(&self, channel: Channel) -> Option<ChannelInterpolation> {
        match channel {
            Channel::Translation => self.translation,
            Channel::Scale => self.scale,
        }
    }

    /// Whether any of them has that sampler.
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
    /// The key at or before the time.
    Step,
    /// Straight lines; the shorter arc for rotations.
    Linear,
    /// Hermite cubics with given tangents; rotations are normalised.
    Cubic,
}

impl ChannelInterpolation {
    /// Its name in glTF.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Step => "STEP",
            Self::Linear => "LINEAR",
            Self::Cubic => "CUBICSPLINE",
        }
    }
}

/// Gives a track what some keys of another have beside their values: tangents, velocities and tensions.
///
/// # Errors
/// When the track does not have as many keys.
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

/// What a clip is at each of its samples, ready to be written.
///
/// Lists are in the order `[sample][track]`.
#[derive(Debug, Clone)]
pub struct SampledClip<'a> {
    /// The clip.
    pub clip: &'a Motion,
    /// Times of the samples, seconds, increasing.
    pub times: &'a [f64],
    /// The rate, where the times are whole frames of one.
    pub rate: Option<FrameRate>,
    /// Unit quaternions, each with the sign that continues the one before it.
    pub rotations: &'a [Quat],
    /// Translations of all tracks; empty where no track has any.
    pub translations: &'a [Vec3],
    /// Scales of all tracks; empty where no track has any.
    pub scales: &'a [Vec3],
    /// What made them, for formats that have room for it: `("method", "slerp")`.
    pub notes: &'a [(&'a str, String)],
    /// The samples are those of the clip's own keys: a format that has keys of each channel at times of
    /// their own (glTF) writes these instead, unless the clip is in the world.
    pub is_at_keys: bool,
}

impl SampledClip<'_> {
    /// How many samples of all tracks there are.
    ///
    /// # Errors
    /// `InvalidInput` for a list that is shorter or longer than the times and the tracks say.
    pub(crate) fn checked_len(&self) -> io::Result<usize> {
        let tracks = self.clip.set.track_count();
        let all = tracks.saturating_mul(self.times.len());
        let lists = [
            ("rotations", self.rotations.len(), all, false),
            ("translations", self.translations.len(), all, true),
            ("scales", self.scales.len(), all, true),
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

    /// The digits of a sample's time in text. Where samples are not frames of a rate there are at least
    /// nine behind the point, which tell readers that nothing was rounded to fewer. `None` out of range.
    pub(crate) fn time_digits(&self, sample: usize) -> Option<String> {
        let time = Decimal::of(self.clip.time_offset, self.times[sample])?;
        Some(match self.rate {
            Some(_) => time.to_string(),
            None if time.is_whole() => time.to_string(),
            None => format!("{time:.9}"),
        })
    }

    /// Whether the translations of any track are to be moved.
    #[must_use]
    pub fn has_origins(&self) -> bool {
        self.clip
            .origins
            .iter()
            .any(|&origin| origin != DVec3::ZERO)
    }

    /// Where a track is relative to its [origin](Motion::origins): of its
    /// [`translations`](Self::translations) or, where there are none, at rest.
    #[must_use]
    pub fn translation(&self, sample: usize, track: usize) -> Vec3 {
        let index = sample * self.clip.set.track_count() + track;
        let sampled = self.translations.get(index).copied();
        sampled.unwrap_or_else(|| self.clip.rest(Channel::Translation, track))
    }

    /// Where a track is.
    #[must_use]
    pub fn position(&self, sample: usize, track: usize) -> DVec3 {
        self.clip.origin(track) + self.translation(sample, track).as_dvec3()
    }

    /// The digits of where a track is.
    pub(crate) fn coordinates(&self, sample: usize, track: usize) -> [String; 3] {
        let (origin, relative) = (self.clip.origin(track), self.translation(sample, track));
        [0, 1, 2].map(|axis| coordinate(origin[axis], relative[axis]))
    }
}
