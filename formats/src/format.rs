//! File formats: how each is recognised, read and written, and which features it can store.
//! [`FORMATS`](crate::FORMATS) lists all formats.

pub mod registry;
mod write_clips;

use std::fmt;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Quat};
use tumble::{Encoding, EulerSequence, FrameRate, Layout, Timeline, TrackSet};

use crate::decimal::LARGEST_SECONDS;
use crate::diagnostic::{Code, Diagnostic};
use crate::feature::Feature;
pub use crate::format::write_clips::left_behind;
pub(crate) use crate::format::write_clips::{check_times, no_offsets, not_one_clip};
pub use crate::gltf::quantized::Quantization;
use crate::limits::Limits;
use crate::motion::carried_mesh::CarriedMesh;
use crate::motion::end_frame::{EndFrame, RateFrames};
use crate::motion::keys::Duplicates;
use crate::motion::poses::Poses;
use crate::motion::signs::Signs;
use crate::motion::{Motion, SampledClip, TrackSelection};
use crate::quaternion::ComponentOrder;
use crate::times::FrameTimes;

/// A file format.
pub struct Format {
    /// Name of the format in options and messages, which is also the extension of its files.
    pub name: &'static str,
    /// A short description.
    pub summary: &'static str,
    /// Other extensions of its files.
    pub extensions: &'static [&'static str],
    /// Whether a file that begins with these bytes (up to 512) is in this format.
    pub probe: fn(&[u8]) -> bool,
    /// How many numbers each line has, for formats that are recognised by this; their files contain nothing but
    /// numbers.
    pub numbers_in_line: Option<usize>,
    /// Whether all files are lines of text with every digit of each number. Results have a line for each frame.
    /// Reading text needs no memory budget, because its memory is limited by its length.
    pub is_text: bool,
    /// Whether names of tracks must be unique in a file. A repeated name is then written with the track's number
    /// after it, and a warning is returned. For writers that warn themselves this is `false`.
    pub numbers_repeated_names: bool,
    /// Whether times are read in a smaller unit if the first one is too large to be in seconds (W305). Times in seconds
    /// that would be misread in this way are not written.
    pub guesses_time_unit: bool,
    /// Reads clips from a file; `-` is standard input.
    pub read: ReadKeys,
    /// Reads clips from the bytes of a file. Other files that it names are not read.
    pub read_bytes: ReadBytes,
    /// Writes the rotations of a result in parts, while they are computed; `None` if the format cannot be written in
    /// parts.
    pub write: Option<WriteResults>,
    /// How sampled clips are written: see [`Format::write_clips`].
    pub(crate) write_motion: Option<WriteMotion>,
    /// The features that the format can store.
    pub features: &'static [Feature],
    /// The options that its reader and its writers support.
    pub options: &'static [FormatOption],
}

/// Options that only some formats support. Programs refuse them for other formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FormatOption {
    /// [`ReadOptions::raw_times`].
    RawTimes,
    /// [`ReadOptions::duplicates`].
    Duplicates,
    /// [`ReadOptions::source_rate`].
    SourceRate,
    /// [`ReadOptions::override_rate`].
    OverrideRate,
    /// [`ReadOptions::frame_times`] and [`MotionOptions::times_apart`].
    TimesApart,
    /// [`ReadOptions::map`].
    Map,
    /// [`ReadOptions::time_unit`].
    TimeUnit,
    /// [`ReadOptions::bridge_gaps`].
    BridgeGaps,
    /// [`ReadOptions::source_order`].
    SourceOrder,
    /// [`ReadOptions::keyframes`].
    Keyframes,
    /// [`MotionOptions::sequence`].
    Sequence,
    /// [`MotionOptions::linear`].
    Linear,
    /// [`MotionOptions::order`].
    Order,
    /// [`MotionOptions::box_length`].
    BoxLength,
    /// [`SampledClip::is_at_keys`].
    AtKeys,
    /// [`MotionOptions::quantize`] and [`MotionOptions::meshopt`].
    Quantize,
}

impl FormatOption {
    /// The options of readers of tables and arrays, whose columns have no fixed meaning.
    pub(crate) const OF_ARRAYS: [Self; 5] = [
        Self::RawTimes,
        Self::Duplicates,
        Self::SourceRate,
        Self::Map,
        Self::TimeUnit,
    ];

    /// The same options, and those for missing keys and for the order of written columns.
    #[cfg(feature = "parquet")]
    pub(crate) const OF_TABLES: [Self; 7] = [
        Self::RawTimes,
        Self::Duplicates,
        Self::SourceRate,
        Self::Map,
        Self::TimeUnit,
        Self::BridgeGaps,
        Self::Order,
    ];
}

/// A function that reads the clips of a file.
pub type ReadKeys = fn(&Path, &ReadOptions) -> Result<Loaded, Diagnostic>;

/// A function that reads clips from the bytes of a file; the text is the input's name in messages.
pub type ReadBytes = fn(&str, Vec<u8>, &ReadOptions) -> Result<Loaded, Diagnostic>;

/// Options for reading inputs.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions {
    /// The largest sizes of inputs that are read.
    pub limits: Limits,
    /// Whether named pipes are read.
    pub pipes: bool,
    /// Whether times stay as stored, instead of being restored to the frames from which they were rounded.
    pub raw_times: bool,
    /// How two different keys at the same time are read.
    pub duplicates: Duplicates,
    /// The rate of the keys, for files that do not contain it. A file that contains another rate keeps that rate, and a
    /// warning is returned.
    pub source_rate: Option<FrameRate>,
    /// The rate of the keys, whatever the file says. If it says another rate, a warning is returned.
    pub override_rate: Option<FrameRate>,
    /// The times of the poses, for formats that store them in a separate file (KITTI).
    pub frame_times: Option<Arc<FrameTimes>>,
    /// The meaning of a file's columns or arrays, for files that do not specify it: `rotations=keys:wxyz,time=t`; see
    /// [`map`](crate::map).
    pub map: Option<String>,
    /// The unit of times that are whole numbers: `s`, `ms`, `us` or `ns`.
    pub time_unit: Option<TimeUnit>,
    /// The order of a quaternion's components, for trajectories whose lines have another one than their format
    /// defines.
    pub source_order: Option<ComponentOrder>,
    /// Whether keys with missing numbers (blank cells, nulls, NaN) are left out, so that their track is interpolated
    /// across them. Otherwise missing numbers are an error.
    pub bridge_gaps: bool,
    /// Whether the curves of an FBX file become keys only at their key times, plus the keys that large rotations
    /// need. Otherwise as many keys are added as are needed to follow the curves.
    pub keyframes: bool,
    /// Whether a body model will supply the positions of joints ([`body_offsets`](crate::npz::body_offsets)), so that
    /// the shape in the file is used, and no warning is returned for it.
    pub has_body_model: bool,
    /// The tracks that will be selected from the clips; `None`: all. Readers need not read the keys of the other tracks,
    /// which then rest; numbers of theirs that are not finite are no errors.
    pub tracks: Option<TrackSelection>,
    /// Whether joints at rest are read too if their partners on the other side move, for mirroring. Files with all of
    /// their joints in each clip have them anyway.
    pub with_partners: bool,
}

/// The unit of times that are whole numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TimeUnit {
    /// Seconds.
    Seconds,
    /// Thousandths of a second.
    Milliseconds,
    /// Millionths of a second.
    Microseconds,
    /// Billionths of a second.
    Nanoseconds,
}

tumble::names! {
    TimeUnit, "unit of time",
    Seconds => "s",
    Milliseconds => "ms",
    Microseconds => "us",
    Nanoseconds => "ns",
}

impl TimeUnit {
    /// The unit of times since 1970 that are too large to be seconds, from the first of them; `None` if it may be
    /// seconds. Each unit has the years from 1973 to 5138 for itself.
    pub(crate) fn of_large(first: f64) -> Option<Self> {
        match first.abs() {
            size if size >= 1e17 => Some(Self::Nanoseconds),
            size if size >= 1e14 => Some(Self::Microseconds),
            size if size >= LARGEST_SECONDS => Some(Self::Milliseconds),
            _ => None,
        }
    }

    /// The unit that is stated for times, of which this is the first; otherwise the unit of times that are too large for
    /// seconds, with a warning.
    pub(crate) fn or_of_first(
        stated: Option<Self>,
        first: f64,
        warn: impl FnOnce(Self),
    ) -> Option<Self> {
        stated.or_else(|| {
            let unit = Self::of_large(first)?;
            warn(unit);
            Some(unit)
        })
    }

    /// The words of a warning that times, of which this is the first, are taken for times in this unit.
    pub(crate) fn assumed(self, first: impl fmt::Display) -> String {
        let word = match self {
            Self::Seconds => "seconds",
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        };
        format!("the time {first} is taken for {word}")
    }

    /// The power of ten of this unit in seconds.
    pub(crate) fn power(self) -> i32 {
        match self {
            Self::Seconds => 0,
            Self::Milliseconds => -3,
            Self::Microseconds => -6,
            Self::Nanoseconds => -9,
        }
    }

    /// Number of these units in a second.
    #[must_use]
    pub fn per_second(self) -> u64 {
        match self {
            Self::Seconds => 1,
            Self::Milliseconds => 1_000,
            Self::Microseconds => 1_000_000,
            Self::Nanoseconds => 1_000_000_000,
        }
    }
}

/// The contents of a file.
#[derive(Debug, Clone, Default)]
pub struct Loaded {
    /// The clips that could be read, each complete.
    pub clips: Vec<Motion>,
    /// The errors of the clips that could not be read.
    pub refused: Vec<Diagnostic>,
    /// The length of each box of a chain (in space, not in time), if the file contains it.
    pub box_length: Option<f64>,
    /// Warnings about the file, one for each kind.
    pub warnings: Vec<Diagnostic>,
    /// The file itself, if it can be written again with other keys and everything else kept.
    pub document: Option<Arc<dyn Document>>,
    /// How the clips were changed after reading, if they were. The rest of the file was not changed, so that
    /// `document` is not written again.
    pub adjustment: Option<Adjustment>,
    /// The unit and the up axis of the clips, if the file specifies them.
    pub space: Option<Space>,
}

/// How the clips of a file differ from the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Adjustment {
    /// They were converted to another unit or up axis ([`adjust_all`](crate::motion::adjust::adjust_all)).
    Space,
    /// Their joints have other offsets ([`set_all_offsets`](crate::motion::adjust::set_all_offsets)).
    Offsets,
    /// Their joints are those of a robot ([`Robot::assign`](crate::robot::Robot::assign)).
    Robot,
}

impl Adjustment {
    /// The reason why the clips are written as a new file; [`left_behind`] begins its message with it.
    #[must_use]
    pub fn makes_new(self) -> &'static str {
        match self {
            Self::Space => "other units or axes make",
            Self::Offsets => "other offsets make",
            Self::Robot => "the joints of a robot make",
        }
    }
}

/// The unit of length and the up axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Space {
    /// The up direction, a unit vector along an axis.
    pub up: DVec3,
    /// The unit of length, in metres.
    pub metres: f64,
}

impl Space {
    /// The unit and the up axis of glTF.
    pub(crate) const GLTF: Self = Self {
        up: DVec3::Y,
        metres: 1.0,
    };
}

impl Loaded {
    /// The warning that clips are written in `format` with another unit or up axis than the format defines. `name` is
    /// the output's name in messages.
    #[must_use]
    pub fn space_warning(&self, format: &Format, name: &str) -> Option<Diagnostic> {
        let space = self
            .space
            .filter(|_| self.adjustment != Some(Adjustment::Space))?;
        if format.name != "glb" || space == Space::GLTF {
            return None;
        }
        let axes = ["x", "y", "z"].into_iter().zip(space.up.to_array());
        let axis = axes
            .filter(|(_, part)| *part != 0.0)
            .map(|(axis, part)| match part > 0.0 {
                true => axis.to_owned(),
                false => format!("-{axis}"),
            });
        let message = format!(
            "glTF requires metres and y up, and the clip has units of {} m and {} up; --up-axis y --scale metres \
             converts it",
            space.metres,
            axis.collect::<String>()
        );
        Some(Diagnostic::new(name, Code::OtherSpace, message))
    }

    /// The file, if its meshes are in the unit and the axes of the clips.
    #[must_use]
    pub fn document_in_place(&self) -> Option<Arc<dyn Document>> {
        let is_converted = self.adjustment == Some(Adjustment::Space);
        self.document.clone().filter(|_| !is_converted)
    }

    /// The contents of a file with one clip.
    #[must_use]
    pub fn of(clip: Motion, warnings: Vec<Diagnostic>) -> Self {
        Self {
            clips: vec![clip],
            warnings,
            ..Self::default()
        }
    }
}

/// A file that can be written again with other keys, keeping everything else.
pub trait Document: fmt::Debug + Send + Sync {
    /// The frames at which clip `clip` is to be sampled at `rate`: its first key time, and the whole frames of the rate
    /// after it. Their times are in seconds.
    ///
    /// # Errors
    /// When the file's type of times cannot distinguish frames of this rate.
    fn frames(&self, clip: usize, rate: FrameRate) -> Result<RateFrames, Diagnostic>;

    /// The default for the end of a clip that ends between two frames.
    fn end_frame(&self) -> EndFrame;

    /// Whether the file can be written again in `format`.
    fn writes(&self, format: &Format) -> bool;

    /// The contents of the file that no clip contains, by their names in its format (`meshes`).
    fn other_contents(&self) -> Vec<String>;

    /// The meshes that move with the tracks of `clip`; `None` if there are none.
    ///
    /// # Errors
    /// When a mesh is invalid or is stored in an unknown form.
    fn carried_mesh(&self, clip: &Motion) -> Result<Option<CarriedMesh>, Diagnostic> {
        let _ = clip;
        Ok(None)
    }

    /// Writes the file with samples of some of its clips instead of their keys. `clips` contains the index and the
    /// samples of each; without any, the file is written unchanged. `path` is the path of the new file. Returns
    /// warnings.
    ///
    /// # Errors
    /// When writing fails, or when the file cannot be written with these samples, in this format or to this path.
    fn write(
        &self,
        clips: &[(usize, SampledClip<'_>)],
        options: &MotionOptions,
        path: &Path,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError>;

    /// Writes the file with the keys of these clips instead of all of its animations. A track moves the node of the same
    /// name. Returns warnings.
    ///
    /// # Errors
    /// As [`Document::write`]; [`io::ErrorKind::Unsupported`] if the format has one clip, whose keys `write` replaces.
    fn write_instead(
        &self,
        clips: &[&Motion],
        options: &MotionOptions,
        path: &Path,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        let _ = (clips, options, path, out);
        let message = "only animations of glTF are replaced";
        Err(io::Error::new(io::ErrorKind::Unsupported, message).into())
    }

    /// Writes the file with the keys of these clips instead of those of the joints in the animations that the clips were
    /// read from, by their indices. Everything else stays: the names of animations, morph weights of clips that were not
    /// cut, and other animations. Returns warnings.
    ///
    /// # Errors
    /// As [`Document::write_instead`].
    fn write_joints(
        &self,
        clips: &[JointClip<'_>],
        options: &MotionOptions,
        path: &Path,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        let joints: Vec<&Motion> = clips.iter().map(|clip| clip.joints).collect();
        self.write_instead(&joints, options, path, out)
    }
}

/// A clip whose joints have other keys than its document.
#[derive(Debug, Clone, Copy)]
pub struct JointClip<'a> {
    /// The new keys of the joints.
    pub joints: &'a Motion,
    /// The clip, or a part of it, with the keys of morph weights.
    pub weights: &'a Motion,
}

/// Writes sampled clips; returns warnings about data that is changed.
pub(crate) type WriteMotion =
    fn(&[SampledClip<'_>], &MotionOptions, &mut dyn Write) -> Result<Vec<Diagnostic>, WriteError>;

/// Options for writing sampled clips.
#[derive(Debug, Clone, Default)]
pub struct MotionOptions {
    /// The output's name in messages.
    pub name: String,
    /// The name or extension by which the format was requested, where these differ: `gltf` is text, `glb` is binary.
    pub format: String,
    /// The order of the axes of Euler angles, for formats with angles (BVH) [default: ZXY].
    pub sequence: Option<EulerSequence>,
    /// Arrays of a [`Document`] with numbers for each frame whose meaning the format does not define (`dmpls`). The
    /// listed ones are interpolated linearly; others are left out.
    pub linear: Vec<String>,
    /// The order of a quaternion's columns, for tables [default: CSV w x y z, the others x y z w].
    pub order: Option<ComponentOrder>,
    /// The length of each box, for chains of boxes [default: 1].
    pub box_length: Option<f64>,
    /// Whether the times are written to a separate file ([`write_frame_times`](crate::kitti::write_frame_times)), for
    /// formats without times (KITTI).
    pub times_apart: bool,
    /// The quantization of rotations (glTF); `None` for f32. Rotations of cubics with tangents stay f32.
    /// [`Quantization::Filtered`] needs [`meshopt`](Self::meshopt).
    pub quantize: Option<Quantization>,
    /// Whether a new file is compressed by `EXT_meshopt_compression` (glTF).
    pub meshopt: bool,
}

/// Why samples could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The system's error.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The format cannot hold these samples.
    #[error(transparent)]
    Refused(#[from] Diagnostic),
}

/// How a format stores results.
pub struct WriteResults {
    /// The order of a quaternion's components unless another order is requested.
    pub order: ComponentOrder,
    /// The only layout of the format; `None` if it has both.
    pub layout: Option<Layout>,
    /// The smallest number of bytes of a rotation.
    pub rotation_bytes: fn(Encoding) -> f64,
    /// Begins a file of rotations by writing its header.
    pub(crate) rotations:
        for<'a> fn(&'a mut dyn Write, &ResultShape<'a>) -> io::Result<Box<dyn ResultWriter + 'a>>,
    /// Writes poses.
    pub poses: fn(&Poses<'_>, &mut dyn Write) -> io::Result<()>,
}

impl WriteResults {
    /// Begins a file of rotations by writing its header. Signs of quaternions continue: each is negated if that makes
    /// it nearer to the one before in its track.
    ///
    /// # Errors
    /// When writing fails.
    pub fn begin<'a>(
        &self,
        out: &'a mut dyn Write,
        shape: &ResultShape<'a>,
    ) -> io::Result<Box<dyn ResultWriter + 'a>> {
        let writer = (self.rotations)(out, shape)?;
        // In other representations, q and -q are the same numbers; vectors have no sign to choose.
        if !shape.encoding.is_quaternion() {
            return Ok(writer);
        }
        let (tracks, samples) = (shape.set.track_count(), shape.timeline.len());
        Ok(Box::new(ContinuedSigns {
            writer,
            signs: Signs::new(shape.layout, tracks, samples),
        }))
    }
}

/// A writer of rotations that continues their signs.
struct ContinuedSigns<'a> {
    writer: Box<dyn ResultWriter + 'a>,
    signs: Signs,
}

impl ResultWriter for ContinuedSigns<'_> {
    fn write(&mut self, rotations: &[Quat]) -> io::Result<()> {
        self.writer.write(&self.signs.next(rotations))
    }

    fn finish(self: Box<Self>) -> io::Result<()> {
        self.writer.finish()
    }
}

/// Writes the rotations of a result, which arrive in parts.
pub trait ResultWriter {
    /// Writes the next rotations, in the order of the result's layout.
    ///
    /// # Errors
    /// When writing fails, or (`InvalidInput`) when there are more rotations than the shape has.
    fn write(&mut self, rotations: &[Quat]) -> io::Result<()>;

    /// Ends the file.
    ///
    /// # Errors
    /// When writing fails, or (`InvalidInput`) when rotations are missing.
    fn finish(self: Box<Self>) -> io::Result<()>;
}

/// A result to be written: a set's rotations at the samples of a timeline.
#[derive(Debug, Clone, Copy)]
pub struct ResultShape<'a> {
    /// The input's name in messages.
    pub name: &'a str,
    /// The set of tracks.
    pub set: &'a TrackSet,
    /// The sample times.
    pub timeline: &'a Timeline,
    /// The seconds to add to them to get the times in the file: the clip's
    /// [`time_offset`](crate::motion::Motion::time_offset).
    pub time_offset: i64,
    /// The order of tracks and samples.
    pub layout: Layout,
    /// The order of a quaternion's components [default: CSV w x y z, the others x y z w].
    pub order: Option<ComponentOrder>,
    /// How a rotation is written.
    pub encoding: Encoding,
    /// How the result was made, for formats that can store it: `("method", "slerp")`.
    pub notes: &'a [(&'a str, String)],
}

impl Format {
    /// Whether these clips, once sampled, are written as clips in this format; otherwise the rotations of one clip
    /// are written as a result. Clips are written if the format stores nothing else, if there are several, or if one
    /// has a skeleton, translations, scales or scalars.
    #[must_use]
    pub fn takes_motion(&self, clips: &[&Motion]) -> bool {
        let is_more = |clip: &&Motion| {
            !clip.skeleton.is_empty() || clip.has_vectors() || clip.set.scalar_count() > 0
        };
        self.write_motion.is_some()
            && (self.write.is_none() || clips.len() > 1 || clips.iter().any(is_more))
    }

    /// Whether the format can store clips.
    #[must_use]
    pub fn writes_clips(&self) -> bool {
        self.write_motion.is_some()
    }

    /// Whether the format can store `feature`.
    #[must_use]
    pub fn supports(&self, feature: Feature) -> bool {
        self.features.contains(&feature)
    }

    /// Whether the format supports `option`.
    #[must_use]
    pub fn takes(&self, option: FormatOption) -> bool {
        self.options.contains(&option)
    }

    /// Whether the format can store results or clips.
    #[must_use]
    pub fn is_writable(&self) -> bool {
        self.write.is_some() || self.write_motion.is_some()
    }

    /// Reads a file in this format.
    ///
    /// # Errors
    /// When the file cannot be opened or is invalid; the first error is returned.
    pub fn open(&self, path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
        (self.read)(path, options)
    }
}

impl fmt::Debug for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Format").field(&self.name).finish()
    }
}
