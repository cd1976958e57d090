//! Writes clips with continued signs of rotations, and warns of data that the format cannot store.

use std::io::{self, Write};

use glam::{Quat, Vec3};
use tumble::Channel;

use crate::diagnostic::{Code, Diagnostic};
use crate::feature::Feature;
use crate::format::{Document, Format, FormatOption, MotionOptions, TimeUnit, WriteError};
use crate::motion::signs::{continue_signs, signs_jump};
use crate::motion::{ChannelInterpolation, Motion, SampledClip, circle};
use crate::names::{TRAJECTORY_TRACK, distinct_names};
use crate::printable::printable;

/// Scales this close to 1 count as 1, because of rounding.
const UNSCALED: f32 = 1e-5;

impl Format {
    /// Writes sampled clips with continued signs: each rotation is negated if that makes it nearer to the one before.
    /// Returns warnings about data that the format cannot store or that is changed.
    ///
    /// # Errors
    /// When writing fails, or when the format cannot store these clips. A format that stores results only
    /// ([`Format::writes_clips`]) is written by [`WriteResults`](crate::format::WriteResults).
    pub fn write_clips(
        &self,
        clips: &[SampledClip<'_>],
        options: &MotionOptions,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        let Some(write) = self.write_motion else {
            let message = format!("{} holds results, not clips", self.name);
            return Err(io::Error::new(io::ErrorKind::Unsupported, message).into());
        };
        if self.supports(Feature::Skeleton) {
            clips
                .iter()
                .try_for_each(|clip| check_parents(clip, options))?;
        }
        // Tables have rows in any order; formats that hold only clips are read only with times that increase.
        if self.write.is_none() {
            clips
                .iter()
                .try_for_each(|clip| check_times(clip, &options.name))?;
        }
        let has_times = !self.takes(FormatOption::TimesApart) || options.times_apart;
        if self.guesses_time_unit && has_times {
            clips
                .iter()
                .try_for_each(|clip| check_seconds(clip, &options.name))?;
        }
        let mut warnings = warnings(self, clips, options);
        let continued: Vec<Vec<Quat>> = clips
            .iter()
            .map(|clip| {
                let tracks = clip.clip.set.track_count();
                let mut rotations = Vec::new();
                if signs_jump(clip.rotations, tracks) {
                    rotations = clip.rotations.to_vec();
                    continue_signs(&mut rotations, tracks);
                }
                rotations
            })
            .collect();
        let clips: Vec<SampledClip<'_>> = clips
            .iter()
            .zip(&continued)
            .map(|(clip, continued)| {
                let mut clip = clip.clone();
                if !continued.is_empty() {
                    clip.rotations = continued;
                }
                clip
            })
            .collect();
        warnings.extend(write(&clips, options, out)?);
        Ok(warnings)
    }
}

/// The warning that the joints of a clip have no offsets, for formats that cannot store this.
pub(crate) fn no_offsets(clip: &Motion, options: &MotionOptions) -> Option<Diagnostic> {
    let reason = clip.no_world.as_ref().filter(|_| clip.lacks_offsets())?;
    let message = format!("{reason}; without them all joints are written at their parents");
    Some(Diagnostic::new(&options.name, Code::NoOffsets, message))
}

/// Refuses samples whose times do not increase: no reader of clips takes such a file.
pub(crate) fn check_times(sampled: &SampledClip<'_>, name: &str) -> Result<(), Diagnostic> {
    // If keys are written instead of samples, `sampled.times` is empty, and nothing is checked.
    let mut pairs = sampled.times.windows(2).filter(|_| !sampled.is_at_keys);
    let Some(sample) = pairs.position(|pair| pair[1] <= pair[0]) else {
        return Ok(());
    };
    let seconds = |sample: usize| {
        let digits = sampled.time_digits(sample);
        digits.unwrap_or_else(|| sampled.times[sample].to_string())
    };
    let (time, next) = (seconds(sample), seconds(sample + 1));
    let message = format!(
        "time {time} is followed by {next}; the times of a clip increase strictly: sort them, and give each once"
    );
    Err(Diagnostic::new(name, Code::TimeNotIncreasing, message))
}

/// Why a number of clips other than one is not written to a file of a format that holds one.
pub(crate) fn not_one_clip(count: usize, file: &str) -> String {
    format!("the input has {count} clips, and {file} holds one: choose it with --animation")
}

/// Refuses times that a reader of this format would take for milliseconds or smaller units ([`TimeUnit::of_large`]).
fn check_seconds(sampled: &SampledClip<'_>, name: &str) -> Result<(), Diagnostic> {
    let clip = sampled.clip;
    let keys = (0..clip.set.track_count()).filter_map(|track| clip.set.track(track).times.first());
    let keys = keys.filter(|_| sampled.is_at_keys);
    let times = sampled.times.first().into_iter().chain(keys);
    let seconds = times.map(|time| time + clip.time_offset as f64);
    let Some(time) = seconds
        .into_iter()
        .find(|it| TimeUnit::of_large(*it).is_some())
    else {
        return Ok(());
    };
    let message = format!(
        "the time {time} s would be read in a smaller unit, because seconds since 1970 have ten digits; state the unit \
         of the input's times by --time-unit"
    );
    Err(Diagnostic::new(name, Code::LargeSeconds, message))
}

/// Refuses parents that are no hierarchy: no file with them could be read.
fn check_parents(sampled: &SampledClip<'_>, options: &MotionOptions) -> Result<(), Diagnostic> {
    let clip = sampled.clip;
    let parents: Vec<Option<usize>> = clip.skeleton.iter().map(|joint| joint.parent).collect();
    let Some(track) = circle(&parents) else {
        return Ok(());
    };
    let name = printable(&clip.set.track_name(track)).into_owned();
    let message =
        format!("track {track} (`{name}`) is its own ancestor; the parent of a root is None");
    Err(Diagnostic::new(&options.name, Code::Parents, message))
}

/// Warnings about the features of some clips that a format cannot store, and about names that it changes.
fn warnings(
    format: &Format,
    clips: &[SampledClip<'_>],
    options: &MotionOptions,
) -> Vec<Diagnostic> {
    let left_out = no_room(format, clips, options);
    let numbered = clips.iter().filter(|_| format.numbers_repeated_names);
    let changed = numbered.into_iter().find_map(|clip| {
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

fn no_room(
    format: &Format,
    clips: &[SampledClip<'_>],
    options: &MotionOptions,
) -> Option<Diagnostic> {
    let missing = Feature::ALL.into_iter();
    let missing = missing.filter(|feature| !format.features.contains(feature));
    // If the format has no start, another warning reports that the times are shifted.
    let has_start = format.supports(Feature::Start);
    let missing = missing.filter(|feature| has_start || *feature != Feature::Nanoseconds);
    // Limits belong to scalars. If the format cannot store scalars, limits are not named in addition.
    let has_scalars = format.supports(Feature::Scalars);
    let missing = missing.filter(|feature| has_scalars || *feature != Feature::Limits);
    let left_out: Vec<&str> = missing
        .filter_map(|feature| {
            let mut each = clips.iter();
            each.find_map(|clip| loss(feature, clip, options))
        })
        .collect();
    if left_out.is_empty() {
        return None;
    }
    let name = format.name.to_uppercase();
    // Semicolons, because some entries contain commas and "and".
    let all = left_out.join("; ");
    let message = format!("{name} cannot store this, left out: {all}");
    Some(Diagnostic::new(&options.name, Code::NoRoom, message))
}

/// The loss if a format cannot store a feature; `None` if the clip does not have the feature, or if another error or
/// warning reports its loss.
fn loss(
    feature: Feature,
    sampled: &SampledClip<'_>,
    options: &MotionOptions,
) -> Option<&'static str> {
    let clip = sampled.clip;
    let joints = || clip.skeleton.iter();
    let (has_it, loss) = match feature {
        Feature::TrackNames => {
            // Readers of trajectories add this name, so it was not in the file, and nothing is lost without it.
            let named = |name: Option<&str>| {
                name.is_some_and(|name| !name.is_empty() && name != TRAJECTORY_TRACK)
            };
            let has_names = clip.set.tracks().any(|track| named(track.name));
            (has_names, "the names of the tracks")
        }
        Feature::ClipName => (clip.name.is_some(), "the name of the clip"),
        Feature::Skeleton => (clip.has_hierarchy(), "the skeleton"),
        Feature::RestRotations => (
            joints().any(|it| it.rest.rotation != Quat::IDENTITY),
            "the rotations in which joints rest",
        ),
        Feature::Translations => (
            sampled.translations.iter().any(|it| *it != Vec3::ZERO),
            "the translations",
        ),
        Feature::Scales => {
            let is_scaled = |scale: &Vec3| !scale.abs_diff_eq(Vec3::ONE, UNSCALED);
            (sampled.scales.iter().any(is_scaled), "the scales")
        }
        Feature::Scalars => (clip.set.scalar_count() > 0, "the scalars"),
        Feature::Limits => (
            clip.scalars.iter().any(|scalar| scalar.limits.is_some()),
            "the limits of the joints (--robot sets them again when the file is read)",
        ),
        Feature::Steps => (
            clip.channels
                .iter()
                .any(|channels| channels.has(ChannelInterpolation::Step)),
            "the steps of channels, which keep each key until the next one",
        ),
        Feature::Lines => (
            are_keys(sampled) && bends_by(clip, Some(ChannelInterpolation::Linear)),
            "the lines and arcs between the keys (evaluate the result with the method slerp)",
        ),
        Feature::Curves => (
            are_keys(sampled) && bends_by(clip, None),
            "the smooth curves between the keys (the format has lines and arcs; with more frames they are nearer to \
             the curves)",
        ),
        Feature::Bvh => (
            !clip.written_joints.is_empty() && !clip.is_world,
            "the order of the channels and the End Sites",
        ),
        Feature::Nanoseconds => {
            let offset = clip.time_offset as f64;
            let is_rounded = |&time: &f64| ((time + offset) - offset - time).abs() > 1e-9;
            (
                sampled.times.iter().any(is_rounded),
                "the nanoseconds of times since 1970 (it stores them in f64)",
            )
        }
        Feature::BoxLength => (options.box_length.is_some(), "the length of the boxes"),
        Feature::SeveralTracks
        | Feature::Quaternions
        | Feature::World
        | Feature::SeveralClips
        | Feature::TimesPerTrack
        | Feature::TimesPerChannel
        | Feature::UnevenTimes
        | Feature::Start => {
            return None;
        }
    };
    has_it.then_some(loss)
}

/// Whether the samples are the clip's keys, which a reader interpolates again. Samples that a method made are frames,
/// at whichever times.
fn are_keys(sampled: &SampledClip<'_>) -> bool {
    let is_evaluated = sampled.notes.iter().any(|(name, _)| *name == "method");
    sampled.is_at_keys || !is_evaluated && sampled.times == sampled.clip.key_times()
}

/// Whether a channel has this interpolation, and lines and a smooth method would join its keys differently: two keys
/// are joined by the same line, and equal keys do not move.
fn bends_by(clip: &Motion, interpolation: Option<ChannelInterpolation>) -> bool {
    fn bends<T: Copy>(keys: &[T], is_same: fn(T, T) -> bool) -> bool {
        keys.len() > 2 && keys.windows(2).any(|pair| !is_same(pair[0], pair[1]))
    }
    let is_same_rotation = |a: Quat, b: Quat| a == b || a == -b;
    let set = &clip.set;
    let track_bends = |track: usize| {
        let channels = clip.channel(track);
        let vectors = |channel| set.vector_keys(channel, track);
        channels.rotation == interpolation && bends(set.track(track).keys, is_same_rotation)
            || [Channel::Translation, Channel::Scale]
                .into_iter()
                .filter(|&channel| channels.of(channel) == interpolation)
                .filter_map(vectors)
                .any(|vectors| bends(vectors.keys, |a: Vec3, b| a == b))
    };
    (0..set.track_count()).any(track_bends)
}

/// A message about the contents of a file that none of its clips contains, and that a new file made of these clips
/// therefore lacks: meshes, cameras, channels of weights. `None` if there are none, or if `warnings`, those of
/// reading the file, already name them. `format` is the output's format. If this is the format of the input, `why` is
/// the reason for a new file, as the beginning of the message ("some tracks make").
#[must_use]
pub fn left_behind(
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
    let contents = document.other_contents();
    if contents.is_empty() {
        return None;
    }
    let all = contents.join(", ");
    Some(match why.filter(|_| is_kept) {
        Some(why) => format!("{why} a new file; not copied: {all}"),
        None => format!("{} cannot store this, left out: {all}", format.name),
    })
}
