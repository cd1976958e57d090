//! The table of file formats. Help, the choice by a file's name, directory walks, shell
//! completions and errors walk it: a format is its own file and one line in [`FORMATS`].

use std::fmt;
use std::io::{self, Write};
use std::path::Path;

use glam::Quat;
use tumble::{Encoding, Layout, Timeline, TrackSet};

use crate::diagnostic::Diagnostic;
use crate::npy::ComponentOrder;
use crate::poses::Poses;
use crate::text::lines::Limits;
use crate::{csv, dat, npy};

/// Every format; the first that can be read is that of inputs whose name tells none, the first
/// that can be written that of such outputs.
pub static FORMATS: [&Format; 3] = [&dat::FORMAT, &npy::FORMAT, &csv::FORMAT];

/// A file format.
pub struct Format {
    /// The name by which programs call it, and the extension of its files.
    pub name: &'static str,
    /// What it is, in a few words.
    pub summary: &'static str,
    /// Reads keyframes from a file; `-` is standard input.
    pub read: Option<ReadKeys>,
    /// How results are written.
    pub write: Option<WriteResults>,
}

/// Reads the keyframes of a file.
pub type ReadKeys = fn(&Path, &ReadOptions) -> Result<Loaded, Diagnostic>;

/// How inputs are read.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReadOptions {
    /// How much is read at most.
    pub limits: Limits,
    /// Named pipes are read too.
    pub pipes: bool,
}

/// What was read.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The tracks of the file.
    pub set: TrackSet,
    /// The length of each box (a length, not a duration), where the file says it; else 1.
    pub box_length: f64,
    /// What is remarkable, one entry for each kind.
    pub warnings: Vec<Diagnostic>,
}

/// How a format holds results.
pub struct WriteResults {
    /// Whether it is text, a line for each frame, in which numbers keep every digit: encodings
    /// that are shorter than f32 are not for it.
    pub is_text: bool,
    /// The only layout that it has, if it has but one.
    pub layout: Option<Layout>,
    /// The fewest bytes that a rotation takes.
    pub rotation_bytes: fn(Encoding) -> f64,
    /// Begins a file of rotations, with its header.
    pub rotations:
        for<'a> fn(&'a mut dyn Write, &ResultShape<'a>) -> io::Result<Box<dyn ResultWriter + 'a>>,
    /// Writes poses.
    pub poses: fn(&Poses<'_>, &mut dyn Write) -> io::Result<()>,
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
    /// The order of a quaternion's components.
    pub order: ComponentOrder,
    /// What a rotation is written as.
    pub encoding: Encoding,
}

impl Format {
    /// The format with that name, in any case.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        let mut formats = FORMATS.into_iter();
        formats.find(|format| format.name.eq_ignore_ascii_case(name))
    }

    /// The format that the extension of a file tells.
    #[must_use]
    pub fn of(path: &Path) -> Option<&'static Self> {
        Self::named(path.extension()?.to_str()?)
    }

    /// The formats that keyframes are read from.
    pub fn readable() -> impl Iterator<Item = (&'static Self, ReadKeys)> {
        let formats = FORMATS.into_iter();
        formats.filter_map(|format| Some((format, format.read?)))
    }

    /// The formats that results are written in.
    pub fn writable() -> impl Iterator<Item = (&'static Self, &'static WriteResults)> {
        let formats = FORMATS.into_iter();
        formats.filter_map(|format| Some((format, format.write.as_ref()?)))
    }

    /// What reads a file: by its extension; by the first of the table where that tells none.
    #[must_use]
    pub fn reader(path: &Path) -> Option<ReadKeys> {
        let named = Self::of(path).and_then(|format| format.read);
        named.or_else(|| Self::readable().map(|(_, read)| read).next())
    }
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
    fn names_are_found_again_and_every_format_serves_for_something() {
        for format in FORMATS {
            assert!(std::ptr::eq(Format::named(format.name).unwrap(), format));
            let shouted = format!("a.b.{}", format.name.to_uppercase());
            assert!(std::ptr::eq(
                Format::of(Path::new(&shouted)).unwrap(),
                format
            ));
            assert!(format.read.is_some() || format.write.is_some());
        }
        assert!(Format::of(Path::new("walk")).is_none());
        assert!(Format::reader(Path::new("walk")).is_some());
    }
}
