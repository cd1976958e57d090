//! The reports of the commands that draw about the files that they wrote: text for people, JSON for programs.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;
use tumble_formats::motion::Motion;

use crate::messages::exit::Failure;
use crate::messages::warnings::{self, RecordedWarning, WarningMark};
use crate::messages::{names, words};

/// A picture, a film or a page, as `--json` prints it.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct DrawnFile {
    /// As on the command line.
    inputs: Vec<String>,
    /// The file, or the directory of a picture for each frame.
    output: String,
    /// The size of the file, or of all pictures of a directory; `None` for standard output.
    output_bytes: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<usize>,
    /// Which device computed it.
    device: String,
    warnings: Vec<RecordedWarning>,
}

impl DrawnFile {
    /// A file that has been written. It has the warnings since `mark`.
    pub(crate) fn new(inputs: &[PathBuf], output: &Path, device: &str, mark: WarningMark) -> Self {
        Self {
            inputs: inputs.iter().map(|path| names::recorded(path)).collect(),
            output: output.display().to_string(),
            output_bytes: bytes(output),
            frames: None,
            device: device.to_owned(),
            warnings: warnings::recorded_since(mark),
        }
    }

    /// With the number of its frames.
    pub(crate) fn with_frames(self, frames: usize) -> Self {
        Self {
            frames: Some(frames),
            ..self
        }
    }
}

/// Says how many scalars of a clip are not drawn.
pub(crate) fn note_scalars(name: &str, clip: &Motion) {
    let count = clip.set.scalar_count();
    if count > 0 {
        let are = if count == 1 { "is" } else { "are" };
        words::note(&format!(
            "{name}: {} {are} not drawn (`tumble plot --show scalars` draws them)",
            words::count(count, "scalar")
        ));
    }
}

/// Refuses a clip without tracks. `remedy` is the command that its scalars need.
pub(crate) fn check_has_tracks(name: &str, clip: &Motion, remedy: &str) -> Result<(), Failure> {
    if clip.set.track_count() > 0 {
        return Ok(());
    }
    let scalars = words::count(clip.set.scalar_count(), "scalar");
    Err(Failure::usage(format!(
        "{name}: has no tracks of rotations, only {scalars}; {remedy}"
    )))
}

/// The bytes of a file, or of the files in a directory.
fn bytes(path: &Path) -> Option<u64> {
    let found = fs::metadata(path).ok()?;
    if !found.is_dir() {
        return Some(found.len());
    }
    let files = fs::read_dir(path).ok()?;
    let lengths = files.filter_map(|file| file.ok()?.metadata().ok());
    Some(
        lengths
            .filter(fs::Metadata::is_file)
            .map(|file| file.len())
            .sum(),
    )
}
