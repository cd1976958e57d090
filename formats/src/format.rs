//! What a file format is: how it is recognised, read and written, and what it has room for. The formats
//! themselves build on this; [`FORMATS`](crate::FORMATS) names them all.

pub mod registry;
mod write_clips;

use std::fmt;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Quat};
use tumble::{Encoding, EulerSequence, FrameRate, Layout, Timeline, TrackSet};

use crate::carried_mesh::CarriedMesh;
use crate::diagnostic::Diagnostic;
use crate::feature::Feature;
pub use crate::format::write_clips::left_behind;
pub use crate::gltf::quantized::Quantization;
use crate::keys::Duplicates;
use crate::motion::{Motion, SampledClip};
use crate::poses::Poses;
use crate::quaternion::ComponentOrder;
use crate::signs::Signs;
use crate::text::lines::Limits;
use crate::times::FrameTimes;

/// A file format.
pub struct Format {
    /// The name by which programs call it, and the extension of its files.
    pub name: &'static str,
    /// What it is, in a few words.
    pub summary: &'static str,
    /// Other extensions of its files.
    pub extensions: &'static [&'static str],
    /// Whether a file that begins with these bytes (up to 512) is one.
    pub probe: fn(&[u8]) -> bool,
    /// How many numbers each of its lines has, where files of nothing but numbers are known by that.
    pub numbers_in_line: Option<usize>,
    /// Whether all its files are lines of text, in which numbers keep every digit; results in it have a line
    /// for each frame. Text takes no more memory than its length allows, and is read without a budget.
    pub is_text: bool,
    /// Whether a second track of a name is written with its number behind the name, because each name
    /// stands once in a file. Writers that do otherwise say so themselves.
    pub numbers_repeated_names: bool,
    /// Reads keyframes from a file; `-` is standard input.
    pub read: ReadKeys,
    /// Reads keyframes from the bytes of a file; files beside it are not read.
    pub read_bytes: ReadBytes,
    /// How rotations are written as they come.
    pub write: Option<WriteResults>,
    /// How sampled clips are written: see [`Format::write_clips`].
    pub(crate) write_motion: Option<WriteMotion>,
    /// What its clips may hold beside rotations at times.
    pub features: &'static [Feature],
    /// The options that its reader and its writers take.
    pub options: &'static [FormatOption],
}

/// Options that not every format takes: programs refuse them for the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FormatOption {
    /// [`ReadOptions::raw_times`].
    RawTimes,
    /// [`ReadOptions::duplicates`].
    Duplicates,
    /// [`ReadOptions::source_rate`].
    SourceRate,
    /// [`ReadOptions::frame_times`] and [`MotionOptions::times_apart`].
    TimesApart,
    /// [`ReadOptions::map`].
    Map,
    /// [`ReadOptions::time_unit`].
    TimeUnit,
    /// [`ReadOptions::bridge_gaps`].
    BridgeGaps,
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
    /// The options for reading tables and arrays, whose meaning is not fixed.
    pub(crate) const OF_ARRAYS: [Self; 5] = [
        Self::RawTimes,
        Self::Duplicates,
        Self::SourceRate,
        Self::Map,
        Self::TimeUnit,
    ];

    /// The same, keys that are missing, and the order of the columns that are written.
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

/// Reads the keyframes of a file.
pub type ReadKeys = fn(&Path, &ReadOptions) -> Result<Loaded, Diagnostic>;

/// Reads the keyframes of the bytes of a file; the text is what messages call it.
pub type ReadBytes = fn(&str, Vec<u8>, &ReadOptions) -> Result<Loaded, Diagnostic>;

/// How inputs are read.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions {
    /// How much is read at most.
    pub limits: Limits,
    /// Named pipes are read too.
    pub pipes: bool,
    /// Times stay as the file has them, instead of on the frames that they were rounded from.
    pub raw_times: bool,
    /// What becomes of two different keys at one time.
    pub duplicates: Duplicates,
    /// The rate of the keys, for files that do not say it.
    pub source_rate: Option<FrameRate>,
    /// The times of the poses, for files that do not say them and whose format has them in a file of their own
    /// (KITTI).
    pub frame_times: Option<Arc<FrameTimes>>,
    /// Which of a file's columns or arrays are what, for files that do not say it:
    /// `rotations=keys:wxyz,time=t`.
    pub map: Option<String>,
    /// The unit of times that are whole numbers: `s`, `ms`, `us` or `ns`.
    pub time_unit: Option<TimeUnit>,
    /// Keys of a track some of whose numbers are missing (blank cells, nulls, NaN) are left out, so that it is
    /// interpolated from those beside them; else they refuse the file.
    pub bridge_gaps: bool,
    /// Of a file whose curves are of another kind than a clip's (FBX) the keys at its key times alone, and as
    /// many more as its turns take; else as many as it takes to follow the curves.
    pub keyframes: bool,
    /// A model of the body is going to say where joints are
    /// ([`body_offsets`](crate::npz::body_offsets)): the shape in the file is not left out.
    pub has_body_model: bool,
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
    /// The power of ten that it is of a second.
    pub(crate) fn power(self) -> i32 {
        match self {
            Self::Seconds => 0,
            Self::Milliseconds => -3,
            Self::Microseconds => -6,
            Self::Nanoseconds => -9,
        }
    }

    /// How many of them a second has.
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

/// What was read.
#[derive(Debug, Clone, Default)]
pub struct Loaded {
    /// The clips of the file that could be read.
    pub clips: Vec<Motion>,
    /// Why the others could not; those that could are whole.
    pub refused: Vec<Diagnostic>,
    /// The length of each box of a chain (a length, not a duration), where the file is about such.
    pub box_length: Option<f64>,
    /// What is remarkable, one entry for each kind.
    pub warnings: Vec<Diagnostic>,
    /// The file itself, where it can be written again with other keys and everything else kept.
    pub document: Option<Arc<dyn Document>>,
    /// The clips are in other units or about other axes than the file: whatever else it holds does not
    /// go with them, so that it is not written again.
    pub is_adjusted: bool,
    /// The unit and the axes of the clips, where the file says them.
    pub space: Option<Space>,
}

/// The unit of lengths, and the axis that is up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Space {
    /// Up, a unit vector along an axis.
    pub up: DVec3,
    /// A unit of length, metres.
    pub metres: f64,
}

impl Loaded {
    /// A file of one clip.
    #[must_use]
    pub fn of(clip: Motion, warnings: Vec<Diagnostic>) -> Self {
        Self {
            clips: vec![clip],
            warnings,
            ..Self::default()
        }
    }
}

/// A file that keeps what it holds beside animations.
pub trait Document: fmt::Debug + Send + Sync {
    /// The times, seconds, at which clip `clip` is to be sampled at `rate`: whole frames of the
    /// rate, and the clip's first and last time themselves, so that its length stays.
    ///
    /// # Errors
    /// When the file's type of times cannot tell frames of this rate apart.
    fn times(&self, clip: usize, rate: FrameRate) -> Result<Vec<f64>, Diagnostic>;

    /// Whether the file can be written again in that format.
    fn writes(&self, format: &Format) -> bool;

    /// What the file holds that no clip holds, by names that its format has for it (`meshes`).
    fn other_contents(&self) -> Vec<String>;

    /// The meshes that tracks of one of its clips carry, where the format has meshes.
    ///
    /// # Errors
    /// When a mesh is broken, or is stored in a way that is not known.
    fn carried_mesh(&self, clip: &Motion) -> Result<Option<CarriedMesh>, Diagnostic> {
        let _ = clip;
        Ok(None)
    }

    /// Writes the file, as the one that `path` names, with the samples of some of its clips, each
    /// with the clip's index, instead of their keys; without any, everything stays as it is. Gives
    /// warnings.
    ///
    /// # Errors
    /// When writing fails, or what was read cannot be written in this way.
    fn write(
        &self,
        clips: &[(usize, SampledClip<'_>)],
        options: &MotionOptions,
        path: &Path,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError>;
}

/// Writes sampled clips; gives warnings of what becomes another thing.
pub(crate) type WriteMotion =
    fn(&[SampledClip<'_>], &MotionOptions, &mut dyn Write) -> Result<Vec<Diagnostic>, WriteError>;

/// How sampled clips are written.
#[derive(Debug, Clone, Default)]
pub struct MotionOptions {
    /// What messages call the output.
    pub name: String,
    /// By which of the format's name and extensions it was asked for, where they differ: `gltf` is
    /// text, `glb` is binary.
    pub format: String,
    /// The axes of the angles, for formats that have angles (BVH) [default: ZXY].
    pub sequence: Option<EulerSequence>,
    /// Arrays of a [`Document`] that hold a number a frame, of which the format does not know what
    /// they are (`dmpls`): they are interpolated linearly instead of being left out.
    pub linear: Vec<String>,
    /// The order of a quaternion's columns, for tables [default: CSV w x y z, the others x y z w].
    pub order: Option<ComponentOrder>,
    /// The length of each box, for chains of boxes [default: 1].
    pub box_length: Option<f64>,
    /// The times are written into a file of their own ([`write_frame_times`](crate::kitti::write_frame_times)),
    /// for formats that have none (KITTI).
    pub times_apart: bool,
    /// Rotations have few bits instead of f32 (glTF); those of cubics with tangents stay f32. A filter needs
    /// [`meshopt`](Self::meshopt).
    pub quantize: Option<Quantization>,
    /// A new file is compressed by `EXT_meshopt_compression` (glTF).
    pub meshopt: bool,
}

/// Why samples could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The system's reason.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The format cannot hold these samples.
    #[error(transparent)]
    Refused(#[from] Diagnostic),
}

/// How a format holds results.
pub struct WriteResults {
    /// The order of a quaternion's components where none is asked for.
    pub order: ComponentOrder,
    /// The only layout that it has, if it has but one.
    pub layout: Option<Layout>,
    /// The fewest bytes that a rotation takes.
    pub rotation_bytes: fn(Encoding) -> f64,
    /// Begins a file of rotations, with its header.
    pub(crate) rotations:
        for<'a> fn(&'a mut dyn Write, &ResultShape<'a>) -> io::Result<Box<dyn ResultWriter + 'a>>,
    /// Writes poses.
    pub poses: fn(&Poses<'_>, &mut dyn Write) -> io::Result<()>,
}

impl WriteResults {
    /// Begins a file of rotations, with its header. Each quaternion gets the sign that continues the
    /// one before it in its track.
    ///
    /// # Errors
    /// When writing fails.
    pub fn begin<'a>(
        &self,
        out: &'a mut dyn Write,
        shape: &ResultShape<'a>,
    ) -> io::Result<Box<dyn ResultWriter + 'a>> {
        let writer = (self.rotations)(out, shape)?;
        // Of other representations q and -q are the same numbers; vectors have no sign to choose.
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

/// Quaternions on their way into a file, with signs that continue.
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

/// Takes the rotations of a result as they come.
pub trait ResultWriter {
    /// Writes the next rotations, in the order of the result's layout.
    ///
    /// # Errors
    /// When writing fails, or (`InvalidInput`) there are more than the shape has.
    fn write(&mut self, rotations: &[Quat]) -> io::Result<()>;

    /// Ends the file.
    ///
    /// # Errors
    /// When writing fails, or (`InvalidInput`) rotations are missing.
    fn finish(self: Box<Self>) -> io::Result<()>;
}

/// What is written: a set's rotations at the samples of a timeline.
#[derive(Debug, Clone, Copy)]
pub struct ResultShape<'a> {
    /// What messages call the input.
    pub name: &'a str,
    /// The tracks.
    pub set: &'a TrackSet,
    /// The samples.
    pub timeline: &'a Timeline,
    /// The order of tracks and samples.
    pub layout: Layout,
    /// The order of a quaternion's components [default: CSV w x y z, the others x y z w].
    pub order: Option<ComponentOrder>,
    /// What a rotation is written as.
    pub encoding: Encoding,
    /// What made them, for formats that have room for it: `("method", "slerp")`.
    pub notes: &'a [(&'a str, String)],
}

impl Format {
    /// Whether these clips, sampled, are written in it as clips, rather than the rotations of one
    /// alone: of a format that holds nothing else, or of clips that are more than rotations.
    #[must_use]
    pub fn takes_motion(&self, clips: &[&Motion]) -> bool {
        let is_more = |clip: &&Motion| !clip.skeleton.is_empty() || clip.has_vectors();
        self.write_motion.is_some()
            && (self.write.is_none() || clips.len() > 1 || clips.iter().any(is_more))
    }

    /// Whether clips are written in it.
    #[must_use]
    pub fn writes_clips(&self) -> bool {
        self.write_motion.is_some()
    }

    /// Whether its files have room for that.
    #[must_use]
    pub fn supports(&self, feature: Feature) -> bool {
        self.features.contains(&feature)
    }

    /// Whether it takes this option.
    #[must_use]
    pub fn takes(&self, option: FormatOption) -> bool {
        self.options.contains(&option)
    }

    /// Whether results are written in it.
    #[must_use]
    pub fn is_writable(&self) -> bool {
        self.write.is_some() || self.write_motion.is_some()
    }

    /// Reads a file in this format.
    ///
    /// # Errors
    /// The first fault that refuses the file.
    pub fn open(&self, path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
        (self.read)(path, options)
    }
}

impl fmt::Debug for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Format").field(&self.name).finish()
    }
}
