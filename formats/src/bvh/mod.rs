//! BVH, motion capture as text: a hierarchy of joints, then a row of numbers for each frame.
//!
//! A joint's rotation is a product of rotations about the axes of its rotation channels, with angles in degrees. The
//! order of the factors is that of `CHANNELS`; each axis is rotated by the rotations before it. Position channels
//! replace coordinates of the joint's `OFFSET`. End Sites are not joints. They and the order of the channels are kept
//! with the clip ([`WrittenJoint`](crate::motion::WrittenJoint)), and written again.

mod angles;
mod hierarchy;
mod motion;
mod write;

use std::io::BufRead;
use std::path::Path;

use crate::bvh::hierarchy::Hierarchy;
use crate::bvh::motion::FrameKeys;
use crate::bvh::write::write_motion;
use crate::diagnostic::Diagnostic;
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions};
use crate::source::Source;
use crate::text::lines::Lines;

/// The BVH format: motion capture of a skeleton.
pub static FORMAT: Format = Format {
    name: "bvh",
    summary: "motion capture of a skeleton, as text",
    extensions: &[],
    probe: |start| {
        let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
        let word = start.trim_ascii_start().get(..hierarchy::FIRST_WORD.len());
        word.is_some_and(|word| word.eq_ignore_ascii_case(hierarchy::FIRST_WORD.as_bytes()))
    },
    numbers_in_line: None,
    is_text: true,
    numbers_repeated_names: false,
    guesses_time_unit: false,
    read: open_bvh,
    read_bytes: |name, bytes, options| read_bvh(name, &bytes[..], options),
    write: None,
    write_motion: Some(write_motion),
    features: &[
        Feature::SeveralTracks,
        Feature::TrackNames,
        Feature::Skeleton,
        Feature::Translations,
        Feature::Lines,
        Feature::Bvh,
    ],
    options: &[
        FormatOption::RawTimes,
        FormatOption::OverrideRate,
        FormatOption::Sequence,
    ],
};

/// Reads a BVH file; `-` is standard input.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
pub fn open_bvh(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    Source::read_by(path, options.pipes, |name, reader| {
        read_bvh(name, reader, options)
    })
}

/// Reads a BVH clip; `name` is the input's name in messages. Translations have the file's units. Times are whole
/// frames of the file's rate, from 0.
///
/// # Errors
/// When the input is invalid; the first error is returned.
pub fn read_bvh(
    name: &str,
    reader: impl BufRead,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    let mut lines = Lines::with_names(name, reader, options.limits)?;
    let hierarchy = Hierarchy::read(&mut lines)?;
    let rows = FrameKeys::read(&mut lines, &hierarchy, options)?;
    let clip = rows.into_clip(&lines, &hierarchy)?;
    Ok(Loaded::of(clip, lines.warnings))
}
