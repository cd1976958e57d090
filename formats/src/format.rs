//! The table of file formats. Help, the choice by a file's name, directory walks, shell
//! completions and errors walk it: a format is its own file and one line in [`FORMATS`].

use std::fmt;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Quat};
use tumble::{Encoding, EulerSequence, FrameRate, Layout, Timeline, TrackSet};

use crate::diagnostic::Diagnostic;
#[cfg(feature = "fbx")]
use crate::fbx;
use crate::feature::{self, Feature};
pub use crate::gltf::quantized::Quantization;
use crate::gltf::skins::CarriedMesh;
use crate::keys::Duplicates;
use crate::kitti::FrameTimes;
#[cfg(feature = "mcap")]
use crate::mcap;
use crate::motion::{Motion, Sampled};
use crate::npy::ComponentOrder;
use crate::poses::Poses;
use crate::signs::{Signs, continue_signs, signs_jump};
use crate::source::{START, Source};
use crate::text::lines::Limits;
#[cfg(feature = "parquet")]
use crate::{arrow, parquet};
use crate::{bvh, csv, dat, euroc, gltf, kitti, npy, npz, tum};

/// Every format. All of them are read. Inputs are known by their first bytes, then by the ending of
/// their name; the first format is that of inputs which tell neither way, the first of
/// [`Format::writable`] that of such outputs.
pub static FORMATS: [&Format; COUNT] = [
    &dat::FORMAT,
    &gltf::FORMAT,
    &bvh::FORMAT,
    #[cfg(feature = "fbx")]
    &fbx::FORMAT,
    &npz::FORMAT,
    &npy::FORMAT,
    #[cfg(feature = "parquet")]
    &parquet::FORMAT,
    #[cfg(feature = "parquet")]
    &arrow::FORMAT,
    &csv::FORMAT,
    &tum::FORMAT,
    &euroc::FORMAT,
    &kitti::FORMAT,
    #[cfg(feature = "mcap")]
    &mcap::FORMAT,
];

const COUNT: usize = 9
    + 2 * cfg!(feature = "parquet") as usize
    + cfg!(feature = "fbx") as usize
    + cfg!(feature = "mcap") as usize;

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
    /// What its reader and its writers can be told.
    pub options: &'static [FormatOption],
}

/// What not every format can be told: programs refuse to tell it the others.
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
    /// [`Sampled::of_own_keys`].
    OwnKeys,
    /// [`MotionOptions::quantize`] and [`MotionOptions::meshopt`].
    Quantize,
}

impl FormatOption {
    /// All that tables and arrays, whose meaning is not fixed, can be told when they are read.
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
    fn beside(&self) -> Vec<String>;

    /// The meshes that tracks of one of its clips carry, where the format has meshes.
    ///
    /// # Errors
    /// When a mesh is broken, or is stored in a way that is not known.
    fn carried_mesh(&self, clip: &Motion) -> Result<Option<CarriedMesh>, Diagnostic> {
        let _ = clip;
        Ok(None)
    }

    /// Writes the file, as the one that `path` names, with the samples of some of its clips, each
    /// with the clip's place, instead of their keys; without any, everything stays as it is. Gives
    /// warnings.
    ///
    /// # Errors
    /// When writing fails, or what was read cannot be written in this way.
    fn write(
        &self,
        clips: &[(usize, Sampled<'_>)],
        options: &MotionOptions,
        path: &Path,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError>;
}

/// Writes sampled clips; gives warnings of what becomes another thing.
pub(crate) type WriteMotion =
    fn(&[Sampled<'_>], &MotionOptions, &mut dyn Write) -> Result<Vec<Diagnostic>, WriteError>;

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
    /// Whether it is text, a line for each frame, in which numbers keep every digit: encodings
    /// that are shorter than f32 are not for it.
    pub is_text: bool,
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
        Ok(Box::new(Continued {
            writer,
            signs: Signs::new(shape.layout, tracks, samples),
        }))
    }
}

/// Quaternions on their way into a file, with signs that continue.
struct Continued<'a> {
    writer: Box<dyn ResultWriter + 'a>,
    signs: Signs,
}

impl ResultWriter for Continued<'_> {
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
    /// The format with that name, in any case.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        let has_name = |format: &&Self| {
            let mut names = [format.name]
                .into_iter()
                .chain(format.extensions.iter().copied());
            names.any(|own| own.eq_ignore_ascii_case(name))
        };
        FORMATS.into_iter().find(has_name)
    }

    /// The format that the extension of a file tells.
    #[must_use]
    pub fn of(path: &Path) -> Option<&'static Self> {
        Self::named(path.extension()?.to_str()?)
    }

    /// The formats that results are written in, those that hold them as they come first.
    pub fn writable() -> impl Iterator<Item = &'static Self> {
        let as_they_come = FORMATS.into_iter().filter(|format| format.write.is_some());
        let whole = |format: &&Self| format.write.is_none() && format.write_motion.is_some();
        as_they_come.chain(FORMATS.into_iter().filter(whole))
    }

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
    pub fn holds(&self, feature: Feature) -> bool {
        self.features.contains(&feature)
    }

    /// Writes sampled clips, each rotation with the sign that continues the one before it. Gives
    /// warnings of what is left out, because the format has no room for it, or becomes another thing.
    ///
    /// # Errors
    /// When writing fails, or the format cannot hold the clips; results alone ([`Format::writes_clips`])
    /// are written by [`WriteResults`].
    pub fn write_clips(
        &self,
        clips: &[Sampled<'_>],
        options: &MotionOptions,
        out: &mut dyn Write,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        let Some(write) = self.write_motion else {
            let message = format!("{} holds results, not clips", self.name);
            return Err(io::Error::new(io::ErrorKind::Unsupported, message).into());
        };
        let mut warnings = feature::warnings(self, clips, options);
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
        let clips: Vec<Sampled<'_>> = clips
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

    /// Whether it can be told that.
    #[must_use]
    pub fn takes(&self, option: FormatOption) -> bool {
        self.options.contains(&option)
    }

    /// Whether results are written in it.
    #[must_use]
    pub fn is_writable(&self) -> bool {
        self.write.is_some() || self.write_motion.is_some()
    }

    /// The format of a file that begins with these bytes; by its name where they tell nothing, by how
    /// many numbers its lines have where that tells nothing either, and else the first of the table.
    #[must_use]
    pub fn detect(path: &Path, start: &[u8]) -> &'static Self {
        let probed = FORMATS.into_iter().find(|format| (format.probe)(start));
        // Trajectories are mostly called `.txt`, and few say what they are.
        let by_numbers = || match table_width(start)? {
            8 => Some(&tum::FORMAT),
            12 => Some(&kitti::FORMAT),
            _ => None,
        };
        probed
            .or_else(|| Self::of(path))
            .or_else(by_numbers)
            .unwrap_or(FORMATS[0])
    }

    /// Reads a file in the format that it is in: see [`Format::detect`].
    ///
    /// # Errors
    /// The first fault that refuses the file.
    pub fn open_detected(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
        Self::detected(path).open(path, options)
    }

    /// Reads the bytes of a file in the format that they are in: see [`Format::detect`]. Files that it names
    /// beside itself are not read.
    ///
    /// # Errors
    /// The first fault that refuses the file.
    pub fn read_detected(
        name: &str,
        bytes: Vec<u8>,
        options: &ReadOptions,
    ) -> Result<Loaded, Diagnostic> {
        let start = &bytes[..bytes.len().min(START)];
        (Self::detect(Path::new(name), start).read_bytes)(name, bytes, options)
    }

    /// The format that a file is in: see [`Format::detect`]. Nothing is known of one that cannot be
    /// read, and that is told about when it is opened.
    #[must_use]
    pub fn detected(path: &Path) -> &'static Self {
        Self::detect(path, &Source::start(path))
    }

    /// Reads a file in this format.
    ///
    /// # Errors
    /// The first fault that refuses the file.
    pub fn open(&self, path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
        (self.read)(path, options)
    }
}

/// How many numbers the first line of text has that is no comment; nothing if it has anything else, or
/// if the first line is the header of a `.dat` file.
fn table_width(start: &[u8]) -> Option<usize> {
    let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    // The last line may be cut.
    let whole = start.iter().rposition(|&byte| byte == b'\n')?;
    let text = std::str::from_utf8(&start[..whole]).ok()?;
    let header = text.lines().next()?.trim_start().strip_prefix('#');
    let mut header = header.into_iter().flat_map(str::split_ascii_whitespace);
    let boxes = header
        .next()
        .is_some_and(|word| word.parse::<usize>().is_ok());
    if boxes
        && header
            .next()
            .is_some_and(|word| word.parse::<f64>().is_ok())
    {
        return None;
    }
    let content = |line: &str| line.split('#').next().unwrap_or_default().replace(',', " ");
    let line = text
        .lines()
        .map(content)
        .find(|line| !line.trim().is_empty())?;
    let mut words = line.split_ascii_whitespace();
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    words.clone().all(is_number).then(|| words.by_ref().count())
}

impl fmt::Debug for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Format").field(&self.name).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_again() {
        for format in FORMATS {
            assert!(std::ptr::eq(Format::named(format.name).unwrap(), format));
            let shouted = format!("a.b.{}", format.name.to_uppercase());
            assert!(std::ptr::eq(
                Format::of(Path::new(&shouted)).unwrap(),
                format
            ));
        }
        assert!(Format::of(Path::new("walk")).is_none());
        assert_eq!(Format::detect(Path::new("walk"), b"# 4 3.0\n").name, "dat");
        assert_eq!(Format::detect(Path::new("walk"), b"\x93NUMPY").name, "npy");
        for (text, name) in [
            ("1311868164.36 0 0 0 0 0 0 1\n", "tum"),
            ("# a remark\n\n1,0,0,0,0,0,0,1 # here\n2,0", "tum"),
            ("1 0 0 0 0 1 0 0 0 0 1 0\n", "kitti"),
            ("# 2 1.0\n0 1 0 0 0 1 0 0\n", "dat"),
            ("0 1 0 0 0\n", "dat"),
            ("a 0 0 0 0 0 0 1\n", "dat"),
            ("0 0 0 0 0 0 0 1", "dat"),
        ] {
            let found = Format::detect(Path::new("poses.txt"), text.as_bytes());
            assert_eq!(found.name, name, "{text}");
        }
        let named = Format::detect(Path::new("a.dat"), b"1 0 0 0 0 0 0 1\n");
        assert_eq!(named.name, "dat");
    }
}
