//! CSV: `frame,time,<track>.w,<track>.x,<track>.y,<track>.z,…`, a line a frame.

use std::fmt::Write as _;
use std::io::{self, Write};

use crate::clock::Timeline;
use crate::rotations::Rotations;
use crate::tracks::TrackSet;

/// Writes rotations with as many digits as it takes to read the same bits again;
/// times are seconds. `set` and `timeline` are those that `rotations` came from.
///
/// # Errors
/// When writing fails.
pub fn write_csv(
    writer: impl Write,
    set: &TrackSet,
    timeline: &Timeline,
    rotations: &Rotations,
) -> io::Result<()> {
    let csv = ::csv::Writer::from_writer(writer);
    write_rows(csv, set, timeline, rotations).map_err(|error| match error.into_kind() {
        // The conversion that the crate offers loses the kind, a broken pipe's too.
        ::csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    })
}

fn write_rows(
    mut csv: ::csv::Writer<impl Write>,
    set: &TrackSet,
    timeline: &Timeline,
    rotations: &Rotations,
) -> ::csv::Result<()> {
    csv.write_field("frame")?;
    csv.write_field("time")?;
    for track in 0..set.track_count() {
        let name = set.track_name(track);
        for component in ["w", "x", "y", "z"] {
            csv.write_field(format!("{name}.{component}"))?;
        }
    }
    csv.write_record(None::<&[u8]>)?;
    let mut text = String::new();
    for frame in 0..rotations.samples() {
        csv.write_field(frame.to_string())?;
        let time = timeline.time(0, frame);
        csv.write_field(time.to_string())?;
        for track in 0..rotations.tracks() {
            let q = rotations.get(track, frame).unwrap_or_default();
            for component in [q.w, q.x, q.y, q.z] {
                text.clear();
                let _ = write!(text, "{component}"); // a String takes everything
                csv.write_field(&text)?;
            }
        }
        csv.write_record(None::<&[u8]>)?;
    }
    Ok(csv.flush()?)
}
