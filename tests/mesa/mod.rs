//! Mesa's drivers where there is no card: RADV and NVK, which compile for AMD's and NVIDIA's processors
//! without one, and a lavapipe of today beside that of the system. `scripts/mesa.sh` unpacks them.

mod compile;
mod lavapipe;
mod listing;
mod nvk;
mod radv;
mod table;

use std::path::{Path, PathBuf};
use std::process::Command;

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

/// The command with one driver and no other, and nothing remembered from another compiler.
fn with_driver<'a>(command: &'a mut Command, manifest: &Path) -> &'a mut Command {
    command
        .env("VK_DRIVER_FILES", manifest)
        .env("VK_ICD_FILENAMES", manifest)
        .env_remove("VK_ADD_DRIVER_FILES")
        .env("MESA_SHADER_CACHE_DISABLE", "true")
}
