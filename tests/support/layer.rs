//! Runs a process under the Khronos validation layer: the system's, or a newer one.
#![allow(dead_code)] // each test program uses some of it

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::{lavapipe, vulkan_devices};

const CHROMIUM: &str = "/usr/lib/chromium/libVkLayer_khronos_validation.so";

/// A validation layer with its settings, which prints its messages on standard output.
pub(crate) struct Layer {
    pub(crate) name: &'static str,
    folder: tempfile::TempDir,
    has_manifest: bool,
    /// The one driver to run with; else all there are.
    driver: Option<PathBuf>,
    pub(crate) planted: &'static [(&'static str, &'static str)],
}

/// The kind of each planted fault, and a part of the layer's message about it.
const CORE: (&str, &str) = ("core", "VUID-VkBufferCreateInfo-size-00912");
const SYNCHRONIZATION: (&str, &str) = ("synchronization", "WRITE-AFTER-WRITE");
const OLD_SYNCHRONIZATION: (&str, &str) = ("synchronization", "WRITE_AFTER_WRITE");
const BOUNDS: (&str, &str) = ("bounds", "VUID-vkCmdDispatch-storageBuffers-06936");

impl Layer {
    fn settings(&self, lines: &[&str]) {
        let common = [
            "debug_action = VK_DBG_LAYER_ACTION_LOG_MSG",
            "report_flags = error,warn,perf",
            "log_filename = stdout",
        ];
        let lines: String = common
            .iter()
            .chain(lines)
            .map(|line| format!("khronos_validation.{line}\n"))
            .collect();
        fs::write(self.folder.path().join("vk_layer_settings.txt"), lines).unwrap();
    }

    /// The system's, which knows core and synchronization checks.
    fn system() -> Option<Self> {
        let there = Path::new("/usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json");
        if !there.exists() {
            return None;
        }
        let layer = Self {
            name: "the system's layer",
            folder: tempfile::tempdir().unwrap(),
            has_manifest: false,
            driver: None,
            planted: &[CORE, OLD_SYNCHRONIZATION],
        };
        layer.settings(&["enables = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT"]);
        Some(layer)
    }

    /// Chromium's, with core and synchronization checks, or with those on the device.
    fn chromium(on_device: bool) -> Option<Self> {
        if !Path::new(CHROMIUM).exists() || on_device && lavapipe().is_none() {
            return None;
        }
        let (name, planted): (_, &[_]) = match on_device {
            true => ("chromium's layer on the device", &[BOUNDS]),
            false => ("chromium's layer", &[CORE, SYNCHRONIZATION]),
        };
        let layer = Self {
            name,
            folder: tempfile::tempdir().unwrap(),
            has_manifest: true,
            // Checks on the device need buffer addresses, which SwiftShader does not have.
            driver: on_device.then(lavapipe).flatten(),
            planted,
        };
        // Messages of the layer about its own settings are not faults.
        let filter = "message_id_filter = VALIDATION-SETTINGS,WARNING-Setting-Limit-Adjusted";
        match on_device {
            true => layer.settings(&["validate_core = false", "gpuav_enable = true", filter]),
            false => layer.settings(&["validate_sync = true", filter]),
        }
        let manifest = format!(
            r#"{{"file_format_version": "1.2.0", "layer": {{
                "name": "VK_LAYER_KHRONOS_validation", "type": "GLOBAL",
                "library_path": "{CHROMIUM}", "api_version": "1.3.0",
                "implementation_version": "1", "description": "validation",
                "instance_extensions": [{{"name": "VK_EXT_debug_utils", "spec_version": "1"}}]}}}}"#
        );
        fs::write(layer.folder.path().join("layer.json"), manifest).unwrap();
        Some(layer)
    }

    pub(crate) fn all() -> Vec<Self> {
        let all = [Self::system(), Self::chromium(false), Self::chromium(true)];
        let in_ci = std::env::var_os("CI").is_some();
        assert!(
            !in_ci || all.iter().all(Option::is_some),
            "CI has both layers (Debian: vulkan-validationlayers, chromium)"
        );
        let found: Vec<Self> = all.into_iter().flatten().collect();
        if vulkan_devices().is_empty() || found.is_empty() {
            eprintln!("NOT VALIDATED: no device, or no validation layer");
            return Vec::new();
        }
        found
    }

    /// The layer's messages while a command runs.
    pub(crate) fn messages(&self, command: &mut Command) -> Vec<String> {
        command
            .env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation")
            .env("VK_LAYER_SETTINGS_PATH", self.folder.path());
        if self.has_manifest {
            command.env("VK_LAYER_PATH", self.folder.path());
        }
        if let Some(driver) = &self.driver {
            command
                .env("VK_DRIVER_FILES", driver)
                .env_remove("VK_ADD_DRIVER_FILES");
        }
        let output = command.output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        let words = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{}: {text}\n{words}", self.name);
        let needs_version = self.has_manifest && text.contains(RACE);
        let version = needs_version.then(|| version_in(&fs::read(CHROMIUM).unwrap()));
        messages_in(&text, version.flatten())
    }
}

/// The name of a message that older layers print wrongly.
const RACE: &str = "SharedMemoryDataRace-RaceOnStore";

/// The version of Vulkan for which a layer was built, from the properties in its library: a name in 256 bytes, this
/// version, and the version of the implementation, which is 1.
fn version_in(library: &[u8]) -> Option<[u32; 3]> {
    let mut name = b"VK_LAYER_KHRONOS_validation".to_vec();
    name.resize(256, 0);
    let mut start = 0;
    while let Some(found) = (library[start..].windows(256)).position(|bytes| bytes == name) {
        start += found + 256;
        let mut numbers = library[start..].chunks_exact(4);
        let mut number = || Some(u32::from_le_bytes(numbers.next()?.try_into().unwrap()));
        if let (Some(packed), Some(1)) = (number(), number()) {
            let [major, minor, patch] = [packed >> 22, packed >> 12 & 0x3ff, packed & 0xfff];
            return Some([major, minor, patch]);
        }
    }
    None
}

/// The messages of a layer of this version, without those that are known to be wrong.
pub(crate) fn messages_in(text: &str, version: Option<[u32; 3]>) -> Vec<String> {
    let is_message = |line: &str| {
        [
            "Validation Error",
            "Validation Warning",
            "Validation Performance",
            "VUID-",
            "UNASSIGNED-",
        ]
        .iter()
        .any(|sign| line.contains(sign))
    };
    let lines: Vec<&str> = text.lines().collect();
    let mut messages = Vec::new();
    for (index, &line) in lines.iter().enumerate() {
        let more = lines[index + 1..]
            .iter()
            .take_while(|line| !is_message(line));
        let whole: Vec<&str> = std::iter::once(&line).chain(more).copied().collect();
        if is_message(line) && !is_race_with_itself(&whole.join("\n"), version) {
            messages.push(line.to_owned());
        }
    }
    messages
}

/// Layers before 1.4.354 take a load and a store of one word by one invocation for a race
/// (KhronosGroup/Vulkan-ValidationLayers#12415).
fn is_race_with_itself(message: &str, version: Option<[u32; 3]>) -> bool {
    let number_after = |words: &str| {
        let (_, rest) = message.split_once(words)?;
        let digits = rest
            .find(|c: char| !c.is_ascii_digit())
            .unwrap_or(rest.len());
        rest[..digits].parse::<u32>().ok()
    };
    let invocation = number_after("in local invocation index ");
    version.is_some_and(|version| version < [1, 4, 354])
        && message.contains(RACE)
        && invocation.is_some()
        && invocation == number_after("(Likely against local invocation index ")
}
