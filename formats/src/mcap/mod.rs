//! Trajectories in MCAP, the log format of ROS 2: topics of poses, odometry and paths, and transforms between frames.
//!
//! The file is read from its beginning to its end, record by record and chunk by chunk, so that a truncated file (of
//! a robot that lost power) returns everything that it contains. The crate `mcap` is not used, because it unpacks
//! chunks without a memory budget and depends on other decompressors than Parquet does.

mod cdr;
mod records;

use std::collections::HashMap;
use std::path::Path;

use glam::{DQuat, DVec3, Quat};
use tumble::{TrackError, TrackSet};

use crate::budget::{Budget, OverBudget};
use crate::decimal::{Decimal, offset_of};
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions};
use crate::keys::{Origin, select};
use crate::mcap::cdr::{Cdr, Stamp};
use crate::mcap::records::{MAGIC, McapChannel, Record, Records};
use crate::motion::grid::restore;
use crate::motion::{Joint, Motion, Transform};
use crate::names::unique_name;
use crate::rate::Precision;
use crate::source::Source;
use crate::warnings::Warnings;

/// The MCAP format: poses in a log.
pub static FORMAT: Format = Format {
    name: "mcap",
    summary: "logs of ROS 2: poses, odometry, paths and transforms",
    extensions: &[],
    probe: |start| start.starts_with(MAGIC),
    numbers_in_line: None,
    is_text: false,
    numbers_repeated_names: false,
    read: open_mcap,
    read_bytes: |name, bytes, options| read_mcap(name, &bytes, options),
    write: None,
    write_motion: None,
    features: &[
        Feature::SeveralTracks,
        Feature::Quaternions,
        Feature::TrackNames,
        Feature::Translations,
        Feature::Curves,
        Feature::TimesPerChannel,
        Feature::UnevenTimes,
        Feature::Start,
    ],
    options: &[FormatOption::RawTimes, FormatOption::Duplicates],
};

/// Bytes of memory of a pose: as it is read, sorted, and as a key.
const POSE: usize = 2 * size_of::<TimedPose>() + 64;

/// Bytes of memory of a track without its keys.
const TRACK: usize = 400;

/// Number of decimals of a stamp in seconds.
const NANOSECONDS: u32 = 9;

/// Reads an MCAP file; `-` is standard input.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned. Errors of single tracks are in
/// [`Loaded::refused`].
pub fn open_mcap(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let source = Source::open(path, options.pipes)?;
    let name = source.name.clone();
    let bytes = source.into_bytes(options.limits.file)?;
    read_mcap(&name, &bytes, options)
}

/// Reads the bytes of an MCAP file; `name` is the input's name in messages. The file becomes one clip. Each topic of
/// poses is a track with the topic's name, and each pair of frames is a track named `parent/child`. The time of a
/// pose is the stamp of its header. Times count from the whole second at or before the first one.
///
/// # Errors
/// As [`open_mcap`].
pub fn read_mcap(name: &str, bytes: &[u8], options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let budget = Budget::of(bytes.len(), options.limits);
    let mut log = Log {
        name,
        budget: &budget,
        tracks: Vec::new(),
        track_of: HashMap::new(),
        others: Vec::new(),
        refused: Vec::new(),
        warnings: Warnings::new(name),
    };
    let mut records = Records::new(name, bytes, &budget)?;
    while let Some(record) = records.next(&mut log.warnings)? {
        let Record {
            channel,
            log_time,
            data,
            offset,
        } = record;
        log.message(channel, log_time, data, offset)?;
    }
    log.into_loaded(options)
}

/// The content of a message of a known type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MessageKind {
    PoseStamped,
    PoseWithCovarianceStamped,
    Odometry,
    TransformStamped,
    TransformList,
    Path,
}

impl MessageKind {
    /// The kind with this name of a type, which may contain `msg/`.
    fn of(schema: &str) -> Option<Self> {
        let (package, rest) = schema.split_once('/')?;
        let name = rest.strip_prefix("msg/").unwrap_or(rest);
        Some(match (package, name) {
            ("geometry_msgs", "PoseStamped") => Self::PoseStamped,
            ("geometry_msgs", "PoseWithCovarianceStamped") => Self::PoseWithCovarianceStamped,
            ("geometry_msgs", "TransformStamped") => Self::TransformStamped,
            ("nav_msgs", "Odometry") => Self::Odometry,
            ("nav_msgs", "Path") => Self::Path,
            ("tf2_msgs", "TFMessage") => Self::TransformList,
            _ => return None,
        })
    }
}

/// The pose of a body at a time.
#[derive(Debug, Clone, Copy)]
struct TimedPose {
    /// Nanoseconds.
    time: i64,
    position: DVec3,
    rotation: DQuat,
    /// Offset of its message in the file, or in its chunk.
    offset: u64,
}

/// A track's name, times, positions and rotations.
type BodyKeys = (String, Vec<f64>, Vec<DVec3>, Vec<Quat>);

/// The poses of one body.
struct BodyTrack {
    name: String,
    poses: Vec<TimedPose>,
}

/// A log that is being read.
struct Log<'a> {
    name: &'a str,
    budget: &'a Budget,
    tracks: Vec<BodyTrack>,
    /// The index of the track of a topic, or of a pair of frames.
    track_of: HashMap<[String; 2], usize>,
    /// Topics with messages of other types.
    others: Vec<String>,
    /// Topics that cannot be read.
    refused: Vec<(String, Diagnostic)>,
    warnings: Warnings,
}

impl Log<'_> {
    fn over(&self, error: &OverBudget) -> Diagnostic {
        Diagnostic::new(self.name, Code::Memory, error.to_string())
    }

    /// Adds the poses of a message. If a message cannot be read, its topic is refused.
    fn message(
        &mut self,
        channel: &McapChannel,
        log_time: u64,
        data: &[u8],
        offset: u64,
    ) -> Result<(), Diagnostic> {
        if self
            .refused
            .iter()
            .any(|(topic, _)| *topic == channel.topic)
        {
            return Ok(());
        }
        let kind = MessageKind::of(&channel.schema).filter(|_| channel.encoding == "cdr");
        let Some(kind) = kind else {
            if !self.others.contains(&channel.topic) {
                self.budget
                    .take(channel.topic.len() + 64, 1)
                    .map_err(|error| self.over(&error))?;
                self.others.push(channel.topic.clone());
            }
            return Ok(());
        };
        let mut found = Vec::new();
        let read = self.poses(kind, channel, (log_time, offset), data, &mut found);
        match read {
            Ok(()) => {}
            Err(MessageFault::Memory(error)) => return Err(self.over(&error)),
            Err(MessageFault::Message(reason)) => {
                let message = format!(
                    "a message of `{}` ({}) {reason}",
                    channel.topic, channel.schema
                );
                let mut fault = Diagnostic::new(self.name, Code::McapMessage, message);
                fault.location = Some(Location::Inside(format!(
                    "{} at byte {offset}",
                    channel.topic
                )));
                self.refused.push((channel.topic.clone(), fault));
                return Ok(());
            }
        }
        // A path is said anew as a whole.
        if kind == MessageKind::Path {
            let track = self.track([channel.topic.clone(), String::new()])?;
            self.tracks[track].poses.clear();
        }
        for (key, pose) in found {
            let track = self.track(key)?;
            self.tracks[track].poses.push(pose);
        }
        Ok(())
    }

    /// The index of a track, which is added if it is new.
    fn track(&mut self, key: [String; 2]) -> Result<usize, Diagnostic> {
        if let Some(&track) = self.track_of.get(&key) {
            return Ok(track);
        }
        let length = TRACK + 4 * (key[0].len() + key[1].len());
        self.budget
            .take(length, 1)
            .map_err(|error| self.over(&error))?;
        let name = match &key {
            [topic, none] if none.is_empty() => topic.clone(),
            [parent, child] => format!("{parent}/{child}"),
        };
        self.tracks.push(BodyTrack {
            name,
            poses: Vec::new(),
        });
        self.track_of.insert(key, self.tracks.len() - 1);
        Ok(self.tracks.len() - 1)
    }

    /// The poses of a message, each with the key of its track.
    fn poses(
        &self,
        kind: MessageKind,
        channel: &McapChannel,
        (log_time, offset): (u64, u64),
        data: &[u8],
        found: &mut Vec<([String; 2], TimedPose)>,
    ) -> Result<(), MessageFault> {
        let mut cdr = Cdr::new(data)?;
        let topic = || [channel.topic.clone(), String::new()];
        // Who fills in no stamp leaves 0, and the log then says when the message came.
        let time = |stamp: Stamp| match stamp.nanoseconds() {
            0 => i64::try_from(log_time).unwrap_or(i64::MAX),
            time => time,
        };
        let take = || self.budget.take(1, POSE).map_err(MessageFault::Memory);
        match kind {
            MessageKind::PoseStamped
            | MessageKind::PoseWithCovarianceStamped
            | MessageKind::Odometry => {
                let (stamp, _) = cdr.header()?;
                if kind == MessageKind::Odometry {
                    cdr.text()?;
                }
                let (position, rotation) = cdr.pose()?;
                take()?;
                let time = time(stamp);
                found.push((
                    topic(),
                    TimedPose {
                        time,
                        position,
                        rotation,
                        offset,
                    },
                ));
            }
            MessageKind::TransformStamped | MessageKind::TransformList => {
                let count = match kind {
                    MessageKind::TransformList => cdr.count()?,
                    _ => 1,
                };
                for _ in 0..count {
                    let (stamp, parent) = cdr.header()?;
                    let child = cdr.text()?;
                    let (position, rotation) = cdr.pose()?;
                    take()?;
                    let key = [parent, child].map(|frame| frame.trim_start_matches('/').to_owned());
                    let time = time(stamp);
                    found.push((
                        key,
                        TimedPose {
                            time,
                            position,
                            rotation,
                            offset,
                        },
                    ));
                }
            }
            MessageKind::Path => {
                cdr.header()?;
                for _ in 0..cdr.count()? {
                    let (stamp, _) = cdr.header()?;
                    let (position, rotation) = cdr.pose()?;
                    take()?;
                    // All poses of a path would come when its message did.
                    let time = stamp.nanoseconds();
                    found.push((
                        topic(),
                        TimedPose {
                            time,
                            position,
                            rotation,
                            offset,
                        },
                    ));
                }
            }
        }
        Ok(())
    }

    fn into_loaded(mut self, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
        let mut refused: Vec<Diagnostic> = self.refused.drain(..).map(|(_, fault)| fault).collect();
        self.tracks.retain(|track| !track.poses.is_empty());
        if !self.others.is_empty() {
            let names: Vec<String> = self.others.iter().map(|name| format!("`{name}`")).collect();
            self.warnings.warn(Code::McapOthers, || {
                (
                    None,
                    format!("topics of other types are left out: {}", names.join(", ")),
                )
            });
        }
        let first = self
            .tracks
            .iter()
            .flat_map(|track| &track.poses)
            .map(|pose| pose.time)
            .min();
        let Some(first) = first else {
            let message = "no poses; PoseStamped, Odometry, TFMessage and Path in CDR are read";
            let none = || Diagnostic::new(self.name, Code::McapEmpty, message);
            return Err(if refused.is_empty() {
                none()
            } else {
                refused.remove(0)
            });
        };
        let offset = offset_of(first.div_euclid(1_000_000_000));
        let mut used = std::collections::HashSet::new();
        let mut clip = Motion {
            set: TrackSet::new(),
            time_offset: offset,
            ..Motion::default()
        };
        let mut all: Vec<BodyKeys> = Vec::new();
        for mut track in self.tracks {
            // Messages may overtake each other.
            track.poses.sort_by_key(|pose| pose.time);
            let location = |key: usize| {
                let offset = track.poses[key].offset;
                Location::Inside(format!("{} at byte {offset}", track.name))
            };
            let origin = Origin {
                file: self.name,
                location: &location,
                duplicates: options.duplicates,
            };
            let of_track = (|| {
                let mut keys = origin.unit(
                    track.poses.iter().map(|pose| pose.rotation),
                    &mut self.warnings,
                )?;
                let mut positions: Vec<DVec3> =
                    track.poses.iter().map(|pose| pose.position).collect();
                if let Some(key) = positions.iter().position(|at| !at.as_vec3().is_finite()) {
                    let message = format!("the position {} is not a finite f32", positions[key]);
                    let mut fault = Diagnostic::new(self.name, Code::NotFinite, message);
                    fault.location = Some(location(key));
                    return Err(fault);
                }
                let seconds = |pose: &TimedPose| {
                    Decimal::whole(pose.time, -9).map_or(f64::NAN, |time| time.since(offset))
                };
                let mut times: Vec<f64> = track.poses.iter().map(seconds).collect();
                let equal = |i: usize, j: usize| keys[i] == keys[j] && positions[i] == positions[j];
                let kept = origin.increasing(&mut times, equal, &mut self.warnings)?;
                select(&mut times, kept.as_deref());
                select(&mut positions, kept.as_deref());
                select(&mut keys, kept.as_deref());
                Ok((
                    unique_name(track.name.clone(), all.len(), &mut used),
                    times,
                    positions,
                    keys,
                ))
            })();
            match of_track {
                Ok(track) => all.push(track),
                Err(fault) => refused.push(fault),
            }
        }
        if all.is_empty() && !refused.is_empty() {
            return Err(refused.remove(0));
        }
        if !options.raw_times {
            let mut lists: Vec<Vec<f64>> = all
                .iter_mut()
                .map(|track| std::mem::take(&mut track.1))
                .collect();
            clip.rate = restore(&mut lists, Precision::Decimals(NANOSECONDS));
            for (track, times) in all.iter_mut().zip(lists) {
                track.1 = times;
            }
        }
        let refuse =
            |error: TrackError| Diagnostic::new(self.name, Code::McapMessage, error.to_string());
        for (index, (name, times, positions, keys)) in all.into_iter().enumerate() {
            clip.set.push(&name, &times, &keys).map_err(refuse)?;
            clip.skeleton.push(Joint {
                parent: None,
                rest: Transform::default(),
            });
            clip.set_positions(index, &times, &positions)
                .map_err(refuse)?;
        }
        Ok(Loaded {
            refused,
            ..Loaded::of(clip, self.warnings.into_list())
        })
    }
}

/// Why a message cannot be read.
enum MessageFault {
    Memory(OverBudget),
    /// The error in the message, as a text that follows its name.
    Message(String),
}

impl From<String> for MessageFault {
    fn from(reason: String) -> Self {
        Self::Message(reason)
    }
}
