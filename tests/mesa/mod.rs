//! Mesa's drivers on a machine without a card: RADV and NVK, which compile for AMD's and NVIDIA's cards, and a lavapipe
//! that is newer than the system's. `scripts/mesa.sh` unpacks them.

mod compile;
mod lavapipe;
mod listing;
mod nvk;
mod radv;
mod table;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

/// The manifest of a driver of the newer Mesa.
fn newer(driver: &str) -> Option<PathBuf> {
    unpacked(&format!("{driver}_icd.json"))
}

/// A file that `scripts/mesa.sh` unpacks. CI must have it where there is such a package.
fn unpacked(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/mesa");
    let file = folder.join(name);
    if folder.join("complete").exists() && file.exists() {
        return Some(file);
    }
    let reason = std::fs::read_to_string(folder.join("unavailable"));
    assert!(
        reason.is_ok() || std::env::var_os("CI").is_none(),
        "CI must have the newer Mesa: scripts/mesa.sh unpacks it into target/mesa"
    );
    let reason = reason.unwrap_or_else(|_| "scripts/mesa.sh unpacks it".to_owned());
    eprintln!("NO NEWER MESA ({}): {name} was not tested", reason.trim());
    None
}

/// The same of a file that it unpacks only if it was told a suite of Debian with a newer Mesa yet (`MESA_SUITE`).
fn unpacked_if_there(name: &str) -> Option<PathBuf> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("target/mesa/")
        .join(name);
    file.exists().then_some(file)
}

/// The versions of libraries that were read.
static VERSIONS: Mutex<BTreeMap<PathBuf, (u32, u32)>> = Mutex::new(BTreeMap::new());

/// A driver by its manifest.
struct Driver {
    /// Its folder.
    folder: PathBuf,
    /// Mesa's version, major and minor.
    version: (u32, u32),
}

impl Driver {
    /// A manifest names the library, which has Mesa's version in the text that it tells applications.
    fn of(manifest: &Path) -> Self {
        let text = std::fs::read_to_string(manifest).unwrap();
        let (_, path) = text.split_once("\"library_path\"").unwrap();
        let path = Path::new(path.split('"').nth(1).unwrap());
        // A name without a folder is that of an installed driver.
        let beside = match path.parent() {
            Some(folder) if folder.as_os_str().is_empty() => Path::new("/usr/lib/x86_64-linux-gnu"),
            _ => manifest.parent().unwrap(),
        };
        let library = beside.join(path);
        let mut known = VERSIONS.lock().unwrap_or_else(PoisonError::into_inner);
        let version = known.entry(library.clone()).or_insert_with(|| {
            let text = std::fs::read(&library).unwrap();
            let text = String::from_utf8_lossy(&text);
            let mut named = text.split("Mesa ").skip(1);
            named
                .find_map(version_at)
                .unwrap_or_else(|| panic!("{} does not say which Mesa it is of", library.display()))
        });
        Self {
            version: *version,
            folder: library.parent().unwrap().to_owned(),
        }
    }

    /// This program on the loader and the libraries in the driver's folder, with a layer that is there.
    fn this_program(&self, layer: &str) -> Command {
        let mut program = Command::new(self.folder.join("loader"));
        program
            .arg("--library-path")
            .arg(&self.folder)
            .arg("--preload")
            .arg(self.folder.join(layer))
            .arg(std::env::current_exe().unwrap());
        program
    }
}

/// Major and minor at the start of a text such as `26.2.6-1`.
fn version_at(text: &str) -> Option<(u32, u32)> {
    let mut numbers = text.splitn(3, '.');
    let [major, minor] = [numbers.next()?, numbers.next()?].map(str::parse);
    Some((major.ok()?, minor.ok()?))
}

#[test]
fn the_version_of_a_driver_is_read() {
    assert_eq!(version_at("26.2.6-1%s"), Some((26, 2)));
    assert_eq!(version_at("25.0.7-2+de\u{1}"), Some((25, 0)));
    assert_eq!(version_at("is a library. 3.2"), None);
    assert_eq!(version_at("26"), None);
}

/// The command with one driver and no other, and nothing remembered from another compiler.
fn with_driver<'a>(command: &'a mut Command, manifest: &Path) -> &'a mut Command {
    command
        .env("VK_DRIVER_FILES", manifest)
        .env("VK_ICD_FILENAMES", manifest)
        .env_remove("VK_ADD_DRIVER_FILES")
        .env("MESA_SHADER_CACHE_DISABLE", "true")
}
