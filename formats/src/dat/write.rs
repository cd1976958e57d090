//! Writes keys as `.dat`: the header, then a line for each time.

use std::borrow::Borrow;
use std::io::{self, Write};

use glam::Quat;
use tumble::TrackSet;

use crate::dat::MAX_BOXES;
use crate::diagnostic::{Code, Diagnostic};
use crate::format::{MotionOptions, WriteError, check_times, not_one_clip};
use crate::motion::SampledClip;

/// Writes the samples of a clip.
///
/// # Errors
/// When writing fails, or when there are several clips, too many tracks, or a time that does not increase.
pub(super) fn write_motion(
    clips: &[SampledClip<'_>],
    options: &MotionOptions,
    out: &mut dyn Write,
) -> Result<Vec<Diagnostic>, WriteError> {
    let refuse = |code, message: String| Diagnostic::new(&options.name, code, message);
    let [sampled] = clips else {
        let message = not_one_clip(clips.len(), "a .dat file");
        return Err(refuse(Code::SeveralClips, message).into());
    };
    let tracks = sampled.clip.set.track_count();
    if !(1..=MAX_BOXES).contains(&tracks) {
        let message = format!("{tracks} tracks; a .dat file holds 1 to {MAX_BOXES}");
        return Err(refuse(Code::Boxes, message).into());
    }
    sampled.checked_len()?;
    let offset = sampled.clip.time_offset as f64;
    check_times(sampled, &options.name)?;
    let times = sampled.times.iter().map(|time| time + offset);
    let rows = times.zip(sampled.rotations.chunks_exact(tracks));
    write_rows(out, tracks, options.box_length.unwrap_or(1.0), rows)?;
    Ok(Vec::new())
}

/// Writes a set whose tracks share their key times; `box_length` is the length of each box. Numbers have as many
/// digits as are needed to read back the same bits.
///
/// # Errors
/// When writing fails, or (`InvalidInput`) when the key times of tracks differ.
pub fn write_dat(mut writer: &mut impl Write, set: &TrackSet, box_length: f64) -> io::Result<()> {
    let times = set.tracks().next().map_or(&[][..], |track| track.times);
    if set.tracks().any(|track| track.times != times) {
        let message = "a .dat file has one list of times for all tracks; these differ";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    let row = |i: usize| set.tracks().map(move |track| track.keys[i]);
    let rows = times.iter().enumerate().map(|(i, &time)| (time, row(i)));
    write_rows(&mut writer, set.track_count(), box_length, rows)
}

/// Writes the header, and a line for each time with a rotation for each box.
fn write_rows<Q: Borrow<Quat>>(
    writer: &mut dyn Write,
    boxes: usize,
    box_length: f64,
    rows: impl Iterator<Item = (f64, impl IntoIterator<Item = Q>)>,
) -> io::Result<()> {
    writeln!(writer, "# {boxes} {box_length:?}")?;
    for (time, rotations) in rows {
        write!(writer, "{time:?}")?;
        for q in rotations {
            let q = q.borrow();
            write!(writer, " {:?} {:?} {:?} {:?}", q.w, q.x, q.y, q.z)?;
        }
        writeln!(writer)?;
    }
    Ok(())
}
