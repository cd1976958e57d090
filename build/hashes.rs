//! The list of hashes of the files in `shaders/` from which the compiled kernels were made. The compiler of the shaders
//! (`shader-compiler/`) writes it, and the engine's build script compares it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::{fs, io};

/// Where the list is checked in.
pub(crate) const LIST: &str = "shaders/compiled/hashes.txt";

/// The hash of each file, by its path from the package's root, with `/` on every system.
pub(crate) type Hashes = BTreeMap<String, String>;

/// FNV-1a of 64 bits: the same on every system and with every version of Rust.
pub(crate) fn hash(bytes: &[u8]) -> String {
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}

/// The hashes of the shaders and of the files compiled from them, below a folder. Hidden files do not
/// count, nor do line endings, which a checkout may change.
pub(crate) fn of_folder(root: &Path, folder: &str) -> io::Result<Hashes> {
    let mut found = Hashes::new();
    for entry in fs::read_dir(root.join(folder))? {
        let entry = entry?;
        let name = entry.file_name();
        let path = format!("{folder}/{}", name.display());
        if name.as_encoded_bytes().starts_with(b".") {
            continue;
        }
        if entry.path().is_dir() {
            found.extend(of_folder(root, &path)?);
        } else if [".wgsl", ".rs", ".spv"]
            .iter()
            .any(|end| path.ends_with(end))
        {
            let mut bytes = fs::read(entry.path())?;
            if !path.ends_with(".spv") {
                bytes.retain(|&byte| byte != b'\r');
            }
            found.insert(path, hash(&bytes));
        }
    }
    Ok(found)
}

/// The files that are not as the list says: changed, new or gone.
pub(crate) fn changed(list: &str, now: &Hashes) -> Vec<String> {
    let listed = list.lines().filter_map(|line| line.split_once(' '));
    let listed: BTreeMap<&str, &str> = listed.map(|(hash, path)| (path, hash)).collect();
    let paths: BTreeSet<&str> = now
        .keys()
        .map(String::as_str)
        .chain(listed.keys().copied())
        .collect();
    let differs = |path: &&str| listed.get(path).copied() != now.get(*path).map(String::as_str);
    paths
        .into_iter()
        .filter(differs)
        .map(str::to_owned)
        .collect()
}
