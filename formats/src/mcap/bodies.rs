//! Makes the tracks of a clip from the poses of a log: the clock of their times, poses without a time, and names.
//!
//! Static transforms have no time: their stamps say when a node was started, often before the recording,
//! or are 0. They are constant, and a value that is published later is a step at the time when it was logged.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::{DQuat, DVec3, Quat};
use tumble::{TrackError, TrackSet};

use crate::budget::Borrowed;
use crate::decimal::{Decimal, offset_of};
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::format::{Loaded, ReadOptions};
use crate::motion::grid::restore;
use crate::motion::keys::{Origin, select};
use crate::motion::{ChannelInterpolation, Channels, Joint, Motion, Transform};
use crate::names::unique_name;
use crate::rate::Precision;
use crate::time_order::{TimeOrder, time_order};
use crate::warnings::{Warnings, listed};

/// Number of decimals of a stamp in seconds.
const NANOSECONDS: u32 = 9;

const SECOND: i64 = 1_000_000_000;

/// Stamps this near to the times at which their messages were logged are of the log's clock. Simulations count from
/// 0, and a robot that was switched on without a network counts from 1970.
const SAME_CLOCK: u64 = 600 * SECOND as u64;

/// The pose of a body at a time.
#[derive(Debug, Clone, Copy)]
pub(super) struct TimedPose {
    /// The stamp, nanoseconds; later the time that is used.
    pub(super) time: i64,
    /// When its message was logged, nanoseconds.
    pub(super) logged: i64,
    pub(super) position: DVec3,
    pub(super) rotation: DQuat,
    /// Offset of its message in the file, or in its chunk.
    pub(super) offset: u64,
}

impl TimedPose {
    fn has_gap(&self) -> bool {
        self.position.is_nan() || self.rotation.is_nan()
    }

    fn is_of_log_clock(&self) -> bool {
        self.time.abs_diff(self.logged) <= SAME_CLOCK
    }
}

/// The poses of a body, as its messages state them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BodyKind {
    /// Its pose at a time.
    Moving,
    /// Its rotation at a time, and no position.
    Turning,
    /// Its pose, which stays.
    Static,
    /// All of its poses at once.
    Path,
}

/// The poses of one body.
pub(super) struct Body<'a> {
    /// Index of its topic.
    pub(super) topic: usize,
    pub(super) topic_name: Arc<str>,
    /// The parent frame and the child frame of a transform.
    pub(super) frames: Option<[String; 2]>,
    pub(super) kind: BodyKind,
    /// In the order of the log.
    pub(super) poses: Vec<TimedPose>,
    /// The budget's memory of a path, which the next message replaces.
    pub(super) borrowed: Option<Borrowed<'a>>,
}

impl Body<'_> {
    fn short_name(&self) -> String {
        match &self.frames {
            None => self.topic_name.to_string(),
            Some([parent, child]) => format!("{parent}/{child}"),
        }
    }

    fn location(&self, pose: usize) -> Location {
        let offset = self.poses[pose].offset;
        Location::Inside(format!("{} at byte {offset}", self.short_name()))
    }

    fn refuse(&self, file: &str, pose: usize, code: Code, message: String) -> Diagnostic {
        Diagnostic {
            location: Some(self.location(pose)),
            ..Diagnostic::new(file, code, message)
        }
    }
}

/// The names of bodies: a topic, or a pair of frames. A pair of several topics, as of several robots, has its topic
/// before it.
fn names(bodies: &[Body<'_>]) -> Vec<String> {
    let mut count_of: HashMap<String, usize> = HashMap::new();
    for body in bodies {
        *count_of.entry(body.short_name()).or_default() += 1;
    }
    let mut used = HashSet::new();
    let name = |(index, body): (usize, &Body<'_>)| {
        let short = body.short_name();
        let full = match body.frames {
            Some(_) if count_of[&short] > 1 => format!("{}/{short}", body.topic_name),
            _ => short,
        };
        unique_name(full, index, &mut used)
    };
    bodies.iter().enumerate().map(name).collect()
}

/// Replaces stamps of 0 by log times if they mean that there is no stamp, and finds static transforms.
fn resolve_stamps(bodies: &mut [Body<'_>]) {
    let mut is_stamped: HashMap<usize, bool> = HashMap::new();
    for body in &*bodies {
        let stamped = body.poses.iter().any(|pose| pose.time != 0);
        *is_stamped.entry(body.topic).or_default() |= stamped;
    }
    for body in bodies {
        let all_zero = body.poses.iter().all(|pose| pose.time == 0);
        match body.kind {
            BodyKind::Static | BodyKind::Path => {}
            _ if !is_stamped[&body.topic] => {
                body.poses
                    .iter_mut()
                    .for_each(|pose| pose.time = pose.logged);
            }
            // All stamps of this transform are 0, but others in its topic have stamps: it is static.
            _ if all_zero && body.frames.is_some() => body.kind = BodyKind::Static,
            _ => {
                let mut stamps = body.poses.iter().filter(|pose| pose.time != 0);
                if stamps.all(TimedPose::is_of_log_clock) {
                    let zeros = body.poses.iter_mut().filter(|pose| pose.time == 0);
                    zeros
                        .filter(|pose| !pose.is_of_log_clock())
                        .for_each(|pose| pose.time = pose.logged);
                }
            }
        }
    }
}

/// Times at which messages were logged as times of the stamps' clock.
struct StampClock {
    /// When a pose was logged, and its time minus that; in the order of logging.
    known: Vec<(i64, i64)>,
}

impl StampClock {
    fn of(bodies: &[Body<'_>]) -> Self {
        let moving = bodies
            .iter()
            .filter(|body| matches!(body.kind, BodyKind::Moving | BodyKind::Turning));
        let poses = moving.flat_map(|body| &body.poses);
        let ahead = |pose: &TimedPose| match pose.is_of_log_clock() {
            true => 0,
            false => pose.time.saturating_sub(pose.logged),
        };
        let mut known: Vec<_> = poses.map(|pose| (pose.logged, ahead(pose))).collect();
        known.sort_unstable();
        Self { known }
    }

    fn time_of(&self, logged: i64) -> i64 {
        let after = self.known.partition_point(|&(at, _)| at <= logged);
        let nearest = self.known.get(after.saturating_sub(1));
        logged.saturating_add(nearest.map_or(0, |&(_, ahead)| ahead))
    }
}

/// Sets the times of a static transform: the time of its first value is `start`, and the times of its other values are
/// their stamps, or else the times at which they were logged.
fn resolve_static(body: &mut Body<'_>, start: Option<i64>, clock: &StampClock) {
    let mut kept: Vec<TimedPose> = Vec::new();
    let mut last_stamp = i64::MIN;
    for pose in &body.poses {
        let stamp = pose.time;
        let is_known = kept
            .last()
            .is_some_and(|last| (last.position, last.rotation) == (pose.position, pose.rotation));
        if !is_known {
            let time = match (kept.is_empty(), start) {
                (true, Some(start)) => start,
                _ if stamp != 0 && stamp > last_stamp && !kept.is_empty() => stamp,
                _ => clock.time_of(pose.logged),
            };
            let time = time.max(start.unwrap_or(i64::MIN));
            // If there are several values at the start, the last one is used.
            if kept.last().is_some_and(|last| time <= last.time) {
                kept.pop();
            }
            kept.push(TimedPose { time, ..*pose });
        }
        last_stamp = stamp;
    }
    body.poses = kept;
}

/// Warns if some bodies have times of the log's clock, and others have times of another clock.
fn warn_of_clocks(bodies: &[Body<'_>], warnings: &mut Warnings) {
    let moving = bodies
        .iter()
        .filter(|body| matches!(body.kind, BodyKind::Moving | BodyKind::Turning));
    let (of_log, of_others): (Vec<&Body<'_>>, Vec<_>) =
        moving.partition(|body| body.poses.iter().all(TimedPose::is_of_log_clock));
    if of_log.is_empty() || of_others.is_empty() {
        return;
    }
    let list = |bodies: Vec<&Body<'_>>| {
        let names = bodies.iter().map(|body| format!("`{}`", body.short_name()));
        listed(names.collect()).unwrap_or_default()
    };
    warnings.warn(Code::McapClocks, || {
        let (others, log) = (list(of_others), list(of_log));
        let message = format!(
            "the times of {others} come from another clock than those of {log}; choose tracks of one clock by --tracks"
        );
        (None, message)
    });
}

/// The keys of one track.
struct BodyKeys {
    name: String,
    kind: BodyKind,
    times: Vec<f64>,
    positions: Vec<DVec3>,
    rotations: Vec<Quat>,
}

/// Makes the clip of all bodies. `refused` has the errors so far.
///
/// # Errors
/// The first error when no body can be read.
pub(super) fn into_loaded(
    file: &str,
    mut bodies: Vec<Body<'_>>,
    mut refused: Vec<Diagnostic>,
    mut warnings: Warnings,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    resolve_stamps(&mut bodies);
    let of_time = |body: &&Body<'_>| body.kind != BodyKind::Static;
    let timed = bodies.iter().filter(of_time).flat_map(|body| &body.poses);
    let start = timed.map(|pose| pose.time).min();
    // Collected and sorted only if the log has static transforms.
    if bodies.iter().any(|body| body.kind == BodyKind::Static) {
        let clock = StampClock::of(&bodies);
        let statics = bodies.iter_mut();
        let statics = statics.filter(|body| body.kind == BodyKind::Static);
        statics.for_each(|body| resolve_static(body, start, &clock));
    }
    warn_of_clocks(&bodies, &mut warnings);
    let first = bodies.iter().flat_map(|body| &body.poses);
    let first = first.map(|pose| pose.time).min().unwrap_or_default();
    let offset = offset_of(first.div_euclid(SECOND));
    let mut all: Vec<BodyKeys> = Vec::new();
    for (name, body) in names(&bodies).into_iter().zip(bodies) {
        match keys(file, name, body, offset, options, &mut warnings) {
            Ok(keys) => all.push(keys),
            Err(fault) => refused.push(fault),
        }
    }
    if all.is_empty() && !refused.is_empty() {
        return Err(refused.remove(0));
    }
    let mut clip = Motion {
        set: TrackSet::new(),
        time_offset: offset,
        ..Motion::default()
    };
    if !options.raw_times {
        // The times of static transforms have no meaning, so they do not determine the rate.
        let mut timed: Vec<&mut BodyKeys> = all
            .iter_mut()
            .filter(|keys| keys.kind != BodyKind::Static)
            .collect();
        let lists = timed.iter_mut().map(|keys| std::mem::take(&mut keys.times));
        let mut lists: Vec<Vec<f64>> = lists.collect();
        clip.rate = restore(&mut lists, Precision::Decimals(NANOSECONDS));
        for (keys, times) in timed.into_iter().zip(lists) {
            keys.times = times;
        }
    }
    let is_step = |keys: &BodyKeys| keys.kind == BodyKind::Static && keys.times.len() > 1;
    if all.iter().any(is_step) {
        let step = Some(ChannelInterpolation::Step);
        let channels = all.iter().map(|keys| match is_step(keys) {
            true => Channels {
                rotation: step,
                translation: step,
                scale: None,
            },
            false => Channels::default(),
        });
        clip.channels = channels.collect();
    }
    let refuse = |error: TrackError| Diagnostic::new(file, Code::McapMessage, error.to_string());
    for (index, keys) in all.into_iter().enumerate() {
        clip.set
            .push(&keys.name, &keys.times, &keys.rotations)
            .map_err(refuse)?;
        clip.skeleton.push(Joint {
            parent: None,
            rest: Transform::default(),
        });
        if keys.kind != BodyKind::Turning {
            clip.set_positions(index, &keys.times, &keys.positions)
                .map_err(refuse)?;
        }
    }
    Ok(Loaded {
        refused,
        ..Loaded::of(clip, warnings.into_list())
    })
}

/// Removes the poses that have a number that is missing.
fn leave_out_gaps(
    file: &str,
    name: &str,
    body: &mut Body<'_>,
    warnings: &mut Warnings,
) -> Result<(), Diagnostic> {
    let gaps = body.poses.iter().filter(|pose| pose.has_gap()).count();
    let Some(first) = body.poses.iter().position(TimedPose::has_gap) else {
        return Ok(());
    };
    if gaps == body.poses.len() {
        let message = format!("no pose of `{name}` is without a gap");
        return Err(body.refuse(file, first, Code::NotFinite, message));
    }
    warnings.warn_of(gaps, Code::Bridged, || {
        let message = format!(
            "the track `{name}` lacks {gaps} of its poses; it is interpolated from the others"
        );
        (Some(body.location(first)), message)
    });
    body.poses.retain(|pose| !pose.has_gap());
    Ok(())
}

/// The keys of a body, with its times in seconds after `offset`.
fn keys(
    file: &str,
    name: String,
    mut body: Body<'_>,
    offset: i64,
    options: &ReadOptions,
    warnings: &mut Warnings,
) -> Result<BodyKeys, Diagnostic> {
    if options.bridge_gaps {
        leave_out_gaps(file, &name, &mut body, warnings)?;
    }
    let stamps: Vec<i64> = body.poses.iter().map(|pose| pose.time).collect();
    if body.kind == BodyKind::Path && stamps.len() > 1 && stamps.iter().all(|at| *at == stamps[0]) {
        let message = format!(
            "the path `{name}` of {} poses has no times: all have the stamp {} s, as planners write routes; move a body \
             along it by tumble follow with --seconds or --pace",
            stamps.len(),
            stamps[0] as f64 / SECOND as f64
        );
        return Err(body.refuse(file, 0, Code::McapRoute, message));
    }
    if let TimeOrder::Reset { row } = time_order(&stamps) {
        let [before, time] = [row - 1, row].map(|row| stamps[row] as f64 / SECOND as f64);
        let message = format!(
            "the clock of `{name}` was set back from {before} s to {time} s; the parts before and after do not belong \
             together: cut the log there"
        );
        return Err(body.refuse(file, row, Code::TimeNotIncreasing, message));
    }
    // Messages may be in another order in the log than that of their times.
    body.poses.sort_by_key(|pose| pose.time);
    let location = |key: usize| body.location(key);
    let origin = Origin {
        file,
        location: &location,
        duplicates: options.duplicates,
    };
    let remedy = |mut fault: Diagnostic| {
        if fault.code == Code::NotFinite && !options.bridge_gaps {
            fault.message += ", or leave it out with --bridge-gaps";
        }
        fault
    };
    let rotations = body.poses.iter().map(|pose| pose.rotation);
    let mut rotations = origin.unit(rotations, warnings).map_err(remedy)?;
    let mut positions: Vec<DVec3> = body.poses.iter().map(|pose| pose.position).collect();
    if let Some(key) = positions.iter().position(|at| !at.as_vec3().is_finite()) {
        let message = format!(
            "the position {} is not a finite f32; repair or remove it",
            positions[key]
        );
        return Err(remedy(body.refuse(file, key, Code::NotFinite, message)));
    }
    let seconds = |pose: &TimedPose| {
        Decimal::whole(pose.time, -9).map_or(f64::NAN, |time| time.since(offset))
    };
    let mut times: Vec<f64> = body.poses.iter().map(seconds).collect();
    let equal = |i: usize, j: usize| rotations[i] == rotations[j] && positions[i] == positions[j];
    let kept = origin.increasing(&mut times, equal, warnings)?;
    select(&mut times, kept.as_deref());
    select(&mut positions, kept.as_deref());
    select(&mut rotations, kept.as_deref());
    Ok(BodyKeys {
        name,
        kind: body.kind,
        times,
        positions,
        rotations,
    })
}
