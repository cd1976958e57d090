//! Helpers that several tests of the formats use.

use std::path::PathBuf;

/// The folder of sample files of other projects, which are not in the repository. If it is missing,
/// the test prints this and compares nothing.
pub(crate) fn shared_data() -> Option<PathBuf> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data"));
    let found = folder.is_dir();
    if !found {
        eprintln!("{} is not there: nothing compared", folder.display());
    }
    found.then_some(folder)
}
