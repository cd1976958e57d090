//! What clips may hold beside rotations at times, and which format has room for it: one table, by
//! which is said what is left out, and which the documents show.

use glam::{Quat, Vec3};

use crate::diagnostic::{Code, Diagnostic};
use crate::format::{Document, Format, MotionOptions};
use crate::motion::{Sampled, Sampler};
use crate::names::distinct_names;
use crate::tum;

/// What a clip may hold beside rotations at times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Feature {
    /// Names of the tracks.
    TrackNames,
    /// A name of the clip.
    ClipName,
    /// Which joint hangs on which, and where each rests.
    Skeleton,
    /// Rotations in which joints rest: without them joints rest unturned.
    RestRotations,
    /// Positions, at rest or moving.
    Translations,
    /// Scales.
    Scales,
    /// Channels that hold each key until the next one.
    Steps,
    /// The order of channels and the End Sites that BVH has.
    Bvh,
    /// Poses are relative to the world, not to the parents; a format without room for that gets them
    /// relative to the parents.
    World,
    /// The length of the boxes of a chain.
    BoxLength,
    /// Several clips in one file; a format without room gets a file for each.
    SeveralClips,
    /// Keys of each channel at times of its own; a format without room refuses such keys.
    OwnTimes,
    /// Times that are no frames of a rate; a format without room refuses them.
    UnevenTimes,
    /// Times since 1970, or any other start than 0.
    Start,
}

/// Scales this close to 1 are 1: what rounding leaves of them.
const UNSCALED: f32 = 1e-5;

impl Feature {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::TrackNames,
        Self::ClipName,
        Self::Skeleton,
        Self::RestRotations,
        Self::Translations,
        Self::Scales,
        Self::Steps,
        Self::Bvh,
        Self::World,
        Self::BoxLength,
        Self::SeveralClips,
        Self::OwnTimes,
        Self::UnevenTimes,
        Self::Start,
    ];

    /// What tables of many clips hold.
    #[cfg(feature = "parquet")]
    pub(crate) const OF_TABLES: [Self; 9] = [
        Self::TrackNames,
        Self::ClipName,
        Self::Skeleton,
        Self::Translations,
        Self::Scales,
        Self::World,
        Self::SeveralClips,
        Self::UnevenTimes,
        Self::Start,
    ];

    /// What it is, in a few words.
    #[must_use]
    pub fn summary(self) -> &'static str {
        match self {
            Self::TrackNames => "names of tracks",
            Self::ClipName => "name of the clip",
            Self::Skeleton => "skeleton",
            Self::RestRotations => "rotations at rest",
            Self::Translations => "translations",
            Self::Scales => "scales",
            Self::Steps => "steps",
            Self::Bvh => "channel order and End Sites",
            Self::World => "poses in the world",
            Self::BoxLength => "length of boxes",
            Self::SeveralClips => "several clips",
            Self::OwnTimes => "channels at their own times",
            Self::UnevenTimes => "uneven times",
            Self::Start => "start",
        }
    }

    /// What of it is left out where the format of the output has no room for it; nothing if the clip
    /// has nothing of it, or if it is refused or told apart.
    fn left_out(self, sampled: &Sampled<'_>, options: &MotionOptions) -> Option<&'static str> {
        let clip = sampled.clip;
        let joints = || clip.skeleton.iter();
        let (has_it, what) = match self {
            Self::TrackNames => {
                // What a trajectory is called when it is read is no name that it had.
                let named = |name: Option<&str>| {
                    name.is_some_and(|name| !name.is_empty() && name != tum::BODY)
                };
                let has_names = clip.set.tracks().any(|track| named(track.name));
                (has_names, "the names of the tracks")
            }
            Self::ClipName => (clip.name.is_some(), "the name of the clip"),
            Self::Skeleton => (clip.hangs_together(), "the skeleton"),
            Self::RestRotations => (
                joints().any(|it| it.rest.rotation != Quat::IDENTITY),
                "the rotations in which joints rest",
            ),
            Self::Translations => (
                sampled.translations.iter().any(|it| *it != Vec3::ZERO),
                "the translations",
            ),
            Self::Scales => {
                let is_scaled = |scale: &Vec3| !scale.abs_diff_eq(Vec3::ONE, UNSCALED);
                (sampled.scales.iter().any(is_scaled), "the scales")
            }
            Self::Steps => (
                clip.channels.iter().any(|own| own.has(Sampler::Step)),
                "that channels hold each key until the next one",
            ),
            Self::Bvh => (
                !clip.bvh.is_empty() && !clip.is_world,
                "the order of the channels and the End Sites",
            ),
            Self::BoxLength => (options.box_length.is_some(), "the length of the boxes"),
            Self::World | Self::SeveralClips | Self::OwnTimes | Self::UnevenTimes | Self::Start => {
                return None;
            }
        };
        has_it.then_some(what)
    }
}

/// Says what of some clips a format has no room for, and which names it changes.
pub(crate) fn warnings(
    format: &Format,
    clips: &[Sampled<'_>],
    options: &MotionOptions,
) -> Vec<Diagnostic> {
    let left_out = no_room(format, clips, options);
    // BVH says itself what becomes of names, and in NPZ two tracks may have one.
    let keeps_names = ["bvh", "npz"].contains(&format.name) || !format.holds(Feature::TrackNames);
    let changed = clips.iter().filter(|_| !keeps_names).find_map(|clip| {
        let set = &clip.clip.set;
        let mut names = distinct_names(set).into_iter().enumerate();
        let (track, name) = names.find(|(track, name)| *name != set.track_name(*track))?;
        let message = format!(
            "a second track is called `{}`; it is written as `{name}`",
            set.track_name(track)
        );
        Some(Diagnostic::new(&options.name, Code::NameChanged, message))
    });
    left_out.into_iter().chain(changed).collect()
}

fn no_room(format: &Format, clips: &[Sampled<'_>], options: &MotionOptions) -> Option<Diagnostic> {
    let missing = Feature::ALL.into_iter();
    let missing = missing.filter(|feature| !format.features.contains(feature));
    let left_out: Vec<&str> = missing
        .filter_map(|feature| {
            let mut each = clips.iter();
            each.find_map(|clip| feature.left_out(clip, options))
        })
        .collect();
    let (last, others) = left_out.split_last()?;
    let all = match others {
        [] => (*last).to_owned(),
        others => format!("{} and {last}", others.join(", ")),
    };
    let name = format.name.to_uppercase();
    let message = format!("{name} has no room for it, left out: {all}");
    Some(Diagnostic::new(&options.name, Code::NoRoom, message))
}

/// Says what a file holds that none of its clips holds, and that a file made of clips therefore lacks: meshes,
/// cameras, channels of weights. `warnings` were given when it was read: arrays that they name are not named
/// again. `why` says what makes a new file where the format is the input's own ("some tracks make").
#[must_use]
pub fn stays_behind(
    document: &dyn Document,
    warnings: &[Diagnostic],
    format: &Format,
    why: Option<&str>,
) -> Option<String> {
    let is_kept = document.writes(format);
    let are_named = |warning: &Diagnostic| warning.code == Code::ArraysNotRead;
    if !is_kept && warnings.iter().any(are_named) || is_kept && why.is_none() {
        return None;
    }
    let beside = document.beside();
    if beside.is_empty() {
        return None;
    }
    let all = beside.join(", ");
    Some(match why.filter(|_| is_kept) {
        Some(why) => format!("{why} a new file; stays behind: {all}"),
        None => format!("{} has no room for it, left out: {all}", format.name),
    })
}
