//! The files that an input refers to. They belong to the identity of the input: when one of them changes, the content
//! of the input changes too.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use crate::beneath::open_beneath;
use crate::format::Format;
use crate::gltf;
use crate::limits::Limits;
#[cfg(feature = "parquet")]
use crate::parquet;
use crate::robot::{self, Robot};

/// The files that reading `path` also reads, as paths relative to its folder, in order and each once. Whether they
/// exist is not checked. There are none for standard input, for paths that are not regular files, and for invalid
/// files, whose error is reported when they are opened.
///
/// glTF refers to its buffers, the MJCF of a robot to the files that it includes, and a table of `LeRobot` to the description
/// of its data set. Of FBX, nothing outside the file is
/// read, and images of glTF do not change motion. Files that options name (`source_times`, body models) are not listed.
#[must_use]
pub fn referred_files(path: &Path, limits: Limits) -> Vec<PathBuf> {
    let is_file = std::fs::metadata(path).is_ok_and(|found| found.is_file());
    if path.as_os_str() == "-" || !is_file {
        return Vec::new();
    }
    let mut files = match Robot::has_extension(path) {
        true => robot::included_files(path),
        false if std::ptr::eq(Format::detected(path), &raw const gltf::FORMAT) => {
            gltf::buffer_files(path, limits)
        }
        #[cfg(feature = "parquet")]
        false if std::ptr::eq(Format::detected(path), &raw const parquet::FORMAT) => {
            let info =
                parquet::lerobot::info_of(path).map(|_| PathBuf::from(parquet::lerobot::INFO));
            info.into_iter().collect()
        }
        false => Vec::new(),
    };
    files.sort();
    files.dedup();
    files
}

/// Opens one of the [`referred_files`] of a file in `folder`. None but the description of a data set is outside it.
///
/// # Errors
/// When it cannot be opened, or its name leads out of the folder.
pub fn open_referred(folder: &Path, name: &Path) -> io::Result<File> {
    #[cfg(feature = "parquet")]
    if name == Path::new(parquet::lerobot::INFO) {
        return File::open(folder.join(name));
    }
    open_beneath(folder, name)
}
