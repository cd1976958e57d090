//! The files that an input refers to. They belong to the identity of the input: when one of them changes, so does what
//! the input contains.

use std::path::{Path, PathBuf};

use crate::format::Format;
use crate::gltf;
use crate::limits::Limits;

/// The files that reading `path` also reads, as paths relative to its folder, in order and each once. Whether they
/// exist is not checked. There are none for standard input, for what is not a regular file, and for a file that is
/// invalid, which opening it reports.
///
/// Only glTF refers to files that are read (its buffers). Of FBX, nothing outside the file is read, and images of glTF
/// do not change motion. Files that options name (`source_times`, body models) are not listed.
#[must_use]
pub fn referred_files(path: &Path, limits: Limits) -> Vec<PathBuf> {
    let is_file = std::fs::metadata(path).is_ok_and(|found| found.is_file());
    if path.as_os_str() == "-"
        || !is_file
        || !std::ptr::eq(Format::detected(path), &raw const gltf::FORMAT)
    {
        return Vec::new();
    }
    let mut files = gltf::buffer_files(path, limits);
    files.sort();
    files.dedup();
    files
}
