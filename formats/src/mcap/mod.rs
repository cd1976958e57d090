//! Trajectories in MCAP, the log format of ROS 2: topics of poses, odometry and paths, and transforms between frames.
//!
//! The file is read from its beginning to its end, record by record and chunk by chunk, so that a truncated file (of
//! a robot that lost power) returns everything that it contains. The crate `mcap` is not used, because it unpacks
//! chunks without a memory budget and depends on other decompressors than Parquet does.

mod bodies;
mod cdr;
mod records;

use std::collections::HashMap;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use glam::{DQuat, DVec3};

use crate::budget::{Borrowed, Budget, OverBudget};
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions};
use crate::limits::Limits;
use crate::mcap::bodies::{Body, BodyKind, TimedPose, into_loaded};
use crate::mcap::cdr::Cdr;
use crate::mcap::records::{MAGIC, Record, Records};
use crate::path::{PathFormat, PathPoints};
use crate::source::Source;
use crate::warnings::{Warnings, listed};

/// The MCAP format: poses in a log.
pub static FORMAT: Format = Format {
    name: "mcap",
    summary: "logs of ROS 2: poses, odometry, orientations, paths and transforms",
    extensions: &[],
    probe: |start| start.starts_with(MAGIC),
    numbers_in_line: None,
    is_text: false,
    numbers_repeated_names: false,
    guesses_time_unit: false,
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
        Feature::TimesPerTrack,
        Feature::TimesPerChannel,
        Feature::UnevenTimes,
        Feature::Start,
        Feature::Nanoseconds,
    ],
    options: &[
        FormatOption::RawTimes,
        FormatOption::Duplicates,
        FormatOption::BridgeGaps,
    ],
};

/// Bytes of memory of a pose: as it is read, sorted, and as a key.
const POSE: usize = 2 * size_of::<TimedPose>() + 64;

/// Bytes of memory of a body without its poses.
const BODY: usize = 400;

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
/// poses or orientations is a track with the topic's name, and each pair of frames is a track named `parent/child`,
/// with the topic before it if several topics have this pair. The time of a pose is the stamp of its header, or the
/// time at which it was logged if its topic has no stamps. Static transforms are constant; another value is a step.
/// Times count from the whole second at or before the first one.
///
/// # Errors
/// As [`open_mcap`].
pub fn read_mcap(name: &str, bytes: &[u8], options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let budget = Budget::of(bytes.len(), options.limits);
    Log::read(name, bytes, &budget)?.into_loaded(options)
}

/// The paths in logs, each the last one of its topic.
pub static PATH_FORMAT: PathFormat = PathFormat {
    name: "mcap",
    summary: "the paths (nav_msgs/Path) of a log of ROS 2; those of planners have no times",
    probe: |start| (FORMAT.probe)(start),
    // A log is read for its poses by default, not for paths.
    is_of_paths: |_| false,
    read_bytes: read_paths,
};

fn read_paths(name: &str, bytes: &[u8]) -> Result<Vec<PathPoints>, Diagnostic> {
    let budget = Budget::of(bytes.len(), Limits::default());
    let log = Log::read(name, bytes, &budget)?;
    let of_paths = |body: &&Body<'_>| body.kind == BodyKind::Path && !body.poses.is_empty();
    let paths = log.bodies.iter().filter(of_paths).map(|body| {
        let first = body.poses[0].time;
        let is_route = body.poses.iter().all(|pose| pose.time == first);
        let seconds = |pose: &TimedPose| pose.time.saturating_sub(first) as f64 * 1e-9;
        PathPoints {
            times: match is_route {
                true => Vec::new(),
                false => body.poses.iter().map(seconds).collect(),
            },
            points: body.poses.iter().map(|pose| pose.position).collect(),
            ups: Vec::new(),
        }
    });
    let paths: Vec<PathPoints> = paths.collect();
    if paths.is_empty() {
        let message = "the log has no messages of the type nav_msgs/Path in CDR";
        return Err(Diagnostic::new(name, Code::McapEmpty, message));
    }
    Ok(paths)
}

/// The content of a message of a known type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MessageKind {
    PoseStamped,
    PoseWithCovarianceStamped,
    Odometry,
    QuaternionStamped,
    Imu,
    TransformStamped,
    TransformList,
    Path,
}

/// The types that are read, for messages.
const KNOWN_TYPES: &str = "PoseStamped, PoseWithCovarianceStamped, Odometry, QuaternionStamped, Imu, \
                           TransformStamped, TFMessage and Path in CDR, the encoding of ROS 2, are read";

impl MessageKind {
    /// The kind with this name of a type, which may contain `msg/`.
    fn of(schema: &str) -> Option<Self> {
        let (package, rest) = schema.split_once('/')?;
        let name = rest.strip_prefix("msg/").unwrap_or(rest);
        Some(match (package, name) {
            ("geometry_msgs", "PoseStamped") => Self::PoseStamped,
            ("geometry_msgs", "PoseWithCovarianceStamped") => Self::PoseWithCovarianceStamped,
            ("geometry_msgs", "QuaternionStamped") => Self::QuaternionStamped,
            ("geometry_msgs", "TransformStamped") => Self::TransformStamped,
            ("nav_msgs", "Odometry") => Self::Odometry,
            ("nav_msgs", "Path") => Self::Path,
            ("sensor_msgs", "Imu") => Self::Imu,
            ("tf2_msgs", "TFMessage") => Self::TransformList,
            _ => return None,
        })
    }
}

/// A topic of a log.
#[derive(Default)]
struct Topic {
    name: Arc<str>,
    left_out: Option<LeftOut>,
    is_refused: bool,
    /// The index of its body, if its messages are of one.
    body: Option<usize>,
    /// The indices of the bodies of transforms, by parent and child.
    transforms: HashMap<String, HashMap<String, usize>>,
}

/// Why a topic is left out.
enum LeftOut {
    /// Its messages are of another type or in another encoding than those that are read.
    OtherType { schema: Arc<str>, encoding: String },
    /// The covariance of a message says that it has no orientation.
    NoOrientation { schema: Arc<str> },
}

impl LeftOut {
    fn is_ros1(&self) -> bool {
        matches!(self, Self::OtherType { encoding, .. } if encoding == "ros1")
    }
}

/// The type of the topic, and why it is left out.
impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherType { schema, encoding } => {
                f.write_str(match &**schema {
                    "" => "no type",
                    schema => schema,
                })?;
                match &**encoding {
                    CDR => Ok(()),
                    encoding => write!(f, ", encoded as `{encoding}`"),
                }
            }
            Self::NoOrientation { schema } => {
                write!(f, "{schema}, whose covariance says: no orientation")
            }
        }
    }
}

/// The encoding of messages of ROS 2.
const CDR: &str = "cdr";

/// A log that is being read.
struct Log<'a> {
    name: &'a str,
    budget: &'a Budget,
    topics: Vec<Topic>,
    /// The index of a topic.
    topic_of: HashMap<Arc<str>, usize>,
    bodies: Vec<Body<'a>>,
    /// The errors of topics that cannot be read.
    refused: Vec<Diagnostic>,
    warnings: Warnings,
}

impl<'a> Log<'a> {
    fn read(name: &'a str, bytes: &[u8], budget: &'a Budget) -> Result<Self, Diagnostic> {
        let mut log = Self {
            name,
            budget,
            topics: Vec::new(),
            topic_of: HashMap::new(),
            bodies: Vec::new(),
            refused: Vec::new(),
            warnings: Warnings::new(name),
        };
        let mut records = Records::new(name, bytes, budget)?;
        while let Some(record) = records.next(&mut log.warnings)? {
            log.message(&record)?;
        }
        Ok(log)
    }

    fn over(&self, error: &OverBudget) -> Diagnostic {
        Diagnostic::new(self.name, Code::Memory, error.to_string())
    }

    /// Adds the poses of a message. If a message cannot be read, its topic is refused.
    fn message(&mut self, record: &Record<'_>) -> Result<(), Diagnostic> {
        let channel = record.channel;
        let topic = self.topic(&channel.topic)?;
        if self.topics[topic].is_refused {
            return Ok(());
        }
        let kind = MessageKind::of(&channel.schema).filter(|_| channel.encoding == CDR);
        let schema = || Arc::clone(&channel.schema);
        let Some(kind) = kind else {
            return self.leave_out(topic, channel.encoding.len(), || LeftOut::OtherType {
                schema: schema(),
                encoding: channel.encoding.clone(),
            });
        };
        match self.poses(kind, topic, record) {
            Ok(()) => Ok(()),
            Err(MessageFault::Memory(error)) => Err(self.over(&error)),
            Err(MessageFault::NoOrientation) => {
                self.leave_out(topic, 0, || LeftOut::NoOrientation { schema: schema() })
            }
            Err(MessageFault::Message(reason)) => {
                let (name, schema) = (&channel.topic, &channel.schema);
                let message = format!("a message of `{name}` ({schema}) {reason}");
                let mut fault = Diagnostic::new(self.name, Code::McapMessage, message);
                let location = format!("{name} at byte {}", record.offset);
                fault.location = Some(Location::Inside(location));
                self.refused.push(fault);
                self.topics[topic].is_refused = true;
                Ok(())
            }
        }
    }

    /// The index of a topic, which is added if it is new.
    fn topic(&mut self, name: &str) -> Result<usize, Diagnostic> {
        if let Some(&topic) = self.topic_of.get(name) {
            return Ok(topic);
        }
        let charged = self.budget.take(name.len() + size_of::<Topic>() + 64, 1);
        charged.map_err(|error| self.over(&error))?;
        let name: Arc<str> = name.into();
        self.topics.push(Topic {
            name: Arc::clone(&name),
            ..Topic::default()
        });
        self.topic_of.insert(name, self.topics.len() - 1);
        Ok(self.topics.len() - 1)
    }

    /// Notes why a topic is left out, which takes `bytes` of memory.
    fn leave_out(
        &mut self,
        topic: usize,
        bytes: usize,
        reason: impl FnOnce() -> LeftOut,
    ) -> Result<(), Diagnostic> {
        if self.topics[topic].left_out.is_none() {
            let charged = self.budget.take(bytes, 1);
            charged.map_err(|error| self.over(&error))?;
            self.topics[topic].left_out = Some(reason());
        }
        Ok(())
    }

    /// Adds a body, and returns its index.
    fn add_body(
        &mut self,
        topic: usize,
        kind: BodyKind,
        frames: Option<[String; 2]>,
    ) -> Result<usize, OverBudget> {
        let topic_name = Arc::clone(&self.topics[topic].name);
        // The name of a track is made of these, and may have the topic before it.
        let texts = frames.iter().flatten().map(String::len).sum::<usize>();
        self.budget.take(BODY + 4 * (topic_name.len() + texts), 1)?;
        self.bodies.push(Body {
            topic,
            topic_name,
            frames,
            kind,
            poses: Vec::new(),
            borrowed: None,
        });
        Ok(self.bodies.len() - 1)
    }

    /// The index of the only body of a topic, which is added if it is new.
    fn body_of_topic(&mut self, topic: usize, kind: BodyKind) -> Result<usize, OverBudget> {
        if let Some(body) = self.topics[topic].body {
            return Ok(body);
        }
        let body = self.add_body(topic, kind, None)?;
        self.topics[topic].body = Some(body);
        Ok(body)
    }

    /// The index of the body of a transform, which is added if it is new.
    fn body_of_frames(&mut self, topic: usize, frames: [String; 2]) -> Result<usize, OverBudget> {
        let [parent, child] = &frames;
        let known = &self.topics[topic].transforms;
        if let Some(&body) = known.get(parent).and_then(|of| of.get(child)) {
            return Ok(body);
        }
        // Topics of this name hold static transforms by convention; tf2 reads them so.
        let is_static = self.topics[topic].name.ends_with("tf_static");
        let kind = match is_static {
            true => BodyKind::Static,
            false => BodyKind::Moving,
        };
        let body = self.add_body(topic, kind, Some(frames.clone()))?;
        let [parent, child] = frames;
        let of_parent = self.topics[topic].transforms.entry(parent).or_default();
        of_parent.insert(child, body);
        Ok(body)
    }

    /// Adds the poses of a message to their bodies.
    fn poses(
        &mut self,
        kind: MessageKind,
        topic: usize,
        record: &Record<'_>,
    ) -> Result<(), MessageFault> {
        let mut cdr = Cdr::new(record.data)?;
        let logged = i64::try_from(record.log_time).unwrap_or(i64::MAX);
        let pose = |time: i64, (position, rotation): (DVec3, DQuat)| TimedPose {
            time,
            logged,
            position,
            rotation,
            offset: record.offset,
        };
        match kind {
            MessageKind::PoseStamped
            | MessageKind::PoseWithCovarianceStamped
            | MessageKind::Odometry => {
                let (stamp, _) = cdr.header()?;
                if kind == MessageKind::Odometry {
                    cdr.text()?;
                }
                let found = pose(stamp.nanoseconds(), cdr.pose()?);
                let body = self.body_of_topic(topic, BodyKind::Moving)?;
                self.push(body, found)?;
            }
            MessageKind::QuaternionStamped | MessageKind::Imu => {
                let (stamp, _) = cdr.header()?;
                let rotation = cdr.rotation()?;
                // By REP 145, a sensor without an orientation writes -1 here.
                if kind == MessageKind::Imu && cdr.real()? == -1.0 {
                    return Err(MessageFault::NoOrientation);
                }
                let found = pose(stamp.nanoseconds(), (DVec3::ZERO, rotation));
                let body = self.body_of_topic(topic, BodyKind::Turning)?;
                self.push(body, found)?;
            }
            MessageKind::TransformStamped | MessageKind::TransformList => {
                let count = match kind {
                    MessageKind::TransformList => cdr.count()?,
                    _ => 1,
                };
                // A message is used completely or not at all.
                let mut found = Vec::new();
                for _ in 0..count {
                    let (stamp, parent) = cdr.header()?;
                    let child = cdr.text()?;
                    let frames =
                        [parent, child].map(|frame| frame.trim_start_matches('/').to_owned());
                    found.push((frames, pose(stamp.nanoseconds(), cdr.pose()?)));
                }
                for (frames, pose) in found {
                    let body = self.body_of_frames(topic, frames)?;
                    self.push(body, pose)?;
                }
            }
            MessageKind::Path => {
                cdr.header()?;
                let count = cdr.count()?;
                let body = self.body_of_topic(topic, BodyKind::Path)?;
                // Each message of a path replaces the path before. Its memory is released first.
                let path = &mut self.bodies[body];
                (path.poses, path.borrowed) = (Vec::new(), None);
                let borrowed: Borrowed<'a> = self.budget.borrow(count, POSE)?;
                let poses = (0..count).map(|_| {
                    let (stamp, _) = cdr.header()?;
                    Ok(pose(stamp.nanoseconds(), cdr.pose()?))
                });
                path.poses = poses.collect::<Result<_, String>>()?;
                path.borrowed = Some(borrowed);
            }
        }
        Ok(())
    }

    fn push(&mut self, body: usize, pose: TimedPose) -> Result<(), OverBudget> {
        self.budget.take(1, POSE)?;
        self.bodies[body].poses.push(pose);
        Ok(())
    }

    fn into_loaded(mut self, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
        self.bodies.retain(|body| !body.poses.is_empty());
        let left_out = self.topics.iter().filter_map(|topic| {
            let reason = topic.left_out.as_ref()?;
            Some(format!("`{}` ({reason})", topic.name))
        });
        let left_out = listed(left_out.collect());
        if self.bodies.is_empty() {
            if !self.refused.is_empty() {
                return Err(self.refused.remove(0));
            }
            let mut reasons = self
                .topics
                .iter()
                .filter_map(|topic| topic.left_out.as_ref());
            let remedy = match reasons.any(LeftOut::is_ros1) {
                true => "; convert messages of ROS 1 to ROS 2, for example by rosbags-convert",
                false => "",
            };
            let found = match left_out {
                Some(topics) => format!("the log has the topics {topics}"),
                None => "the log has no messages".to_owned(),
            };
            let message = format!("no poses: {found}; {KNOWN_TYPES}{remedy}");
            return Err(Diagnostic::new(self.name, Code::McapEmpty, message));
        }
        if let Some(topics) = left_out {
            self.warnings.warn(Code::McapOthers, || {
                let message =
                    format!("topics without poses that can be read are left out: {topics}");
                (None, message)
            });
        }
        into_loaded(self.name, self.bodies, self.refused, self.warnings, options)
    }
}

/// Why a message cannot be read.
enum MessageFault {
    Memory(OverBudget),
    /// The message says that it has no orientation.
    NoOrientation,
    /// The error in the message, as a text that follows its name.
    Message(String),
}

impl From<OverBudget> for MessageFault {
    fn from(error: OverBudget) -> Self {
        Self::Memory(error)
    }
}

impl From<String> for MessageFault {
    fn from(reason: String) -> Self {
        Self::Message(reason)
    }
}
