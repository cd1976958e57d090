//! Checks before any work that a result fits into memory or on the disk, so that a mistyped frame rate
//! is refused.

use std::path::Path;

use glam::Quat;
use tumble::{SampleTimes, Timeline, TrackSet};

use crate::messages::exit::{Failure, USAGE};
use crate::messages::words;

/// The samples that `frames` means for a set, if `copies` results of that size fit
/// into the memory that is free.
pub(crate) fn in_memory(
    name: &str,
    set: &TrackSet,
    frames: &SampleTimes,
    copies: usize,
) -> Result<Timeline, Failure> {
    let tracks = set.track_count();
    let timeline = frames
        .resolve(tracks, set.time_span())
        .map_err(|error| Failure::evaluating(name, &error.into()))?;
    let needed = (tracks * timeline.len() * size_of::<Quat>()) as f64 * copies as f64;
    match tumble::available_memory() {
        Some(free) if needed > free as f64 => {
            let samples = of_samples(tracks, timeline.len());
            Err(Failure::memory(name, &samples, needed, Some(free)))
        }
        _ => Ok(timeline),
    }
}

/// `4 tracks × 501 frames`.
fn of_samples(tracks: usize, samples: usize) -> String {
    let (tracks, samples) = (
        words::count(tracks, "track"),
        words::count(samples, "frame"),
    );
    format!("{tracks} × {samples}")
}

/// Refuses more samples than can be seen in a picture or computed in a reasonable time.
pub(crate) fn to_draw(name: &str, samples: usize) -> Result<(), Failure> {
    const MAX_DRAWN: usize = 1 << 24;
    match samples <= MAX_DRAWN {
        true => Ok(()),
        false => Err(Failure::new(
            USAGE,
            format!(
                "{name}: {} are more than the {MAX_DRAWN} that are drawn; ask for fewer (--fps, --start, \
                 --end)",
                words::count(samples, "frame")
            ),
        )),
    }
}

/// Whether `bytes` more fit on the disk that holds `folder`.
pub(crate) fn on_disk(
    name: &str,
    (tracks, samples): (usize, usize),
    bytes: f64,
    folder: &Path,
) -> Result<(), Failure> {
    match available_disk(folder) {
        Some(free) if bytes > free => {
            let limit = format!(
                "{} on the disk of {} are free",
                words::bytes(free),
                folder.display()
            );
            let samples = of_samples(tracks, samples);
            Err(Failure::room(name, &samples, bytes, &limit))
        }
        _ => Ok(()),
    }
}

#[cfg(unix)]
fn available_disk(folder: &Path) -> Option<f64> {
    let disk = rustix::fs::statvfs(folder).ok()?;
    Some(disk.f_bavail as f64 * disk.f_frsize as f64)
}

#[cfg(not(unix))]
fn available_disk(_: &Path) -> Option<f64> {
    None
}
