//! The kernels that were found to be exact on devices, kept from process to process in the user's cache directory, if
//! there is one. Only passed checks are stored, so a lost file costs only another check.

use std::collections::{BTreeMap, BTreeSet};
use std::env;
use std::sync::{Arc, Mutex};

use crate::gpu::physical::{DeviceKind, PhysicalDevice};
use crate::machine::cache::Cache;
use crate::simd::dispatch::VectorWidth;
use crate::threads::lock;

/// The file's name.
const FILE: &str = "kernel-checks";

/// The start of every line. The number changes when the checks change.
const MARK: &str = "exact 2";

/// The maximum number of bytes that are read.
const MAX_BYTES: usize = 1 << 20;

/// The maximum number of lines that are written.
const MAX_LINES: usize = 4096;

/// A kernel that passed on a device.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct KernelPass(String);

impl KernelPass {
    /// The pass of a kernel with this hash of its code
    /// ([`Pipeline::code_hash`](crate::gpu::pipeline::Pipeline::code_hash)).
    pub(crate) fn new(physical: &PhysicalDevice, code: u64) -> Self {
        Self::of(&of_device(physical, env::vars_os()), code)
    }

    fn of(device: &str, code: u64) -> Self {
        Self(format!("{MARK} {device} {code:016x}"))
    }

    /// Parses a line of the file; `None` if no version with the same checks wrote it.
    fn parse(line: &str) -> Option<Self> {
        let fields: Vec<&str> = line
            .strip_prefix(MARK)?
            .strip_prefix(' ')?
            .split(' ')
            .collect();
        let is_hex = |text: &str, digits| {
            text.len() == digits && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'))
        };
        match *fields {
            [uuid, version, setting, code]
                if is_hex(&uuid.replace('-', ""), 32)
                    && is_hex(version, 8)
                    && is_hex(setting, 16)
                    && is_hex(code, 16) =>
            {
                Some(Self(line.to_owned()))
            }
            _ => None,
        }
    }
}

/// Prefixes of the environment variables that affect drivers and loaders.
const OF_DRIVERS: [&str; 22] = [
    "ACO_",
    "AMD_",
    "ANV_",
    "DRI",
    "GALLIUM_",
    "GALLIVM_",
    "INTEL_",
    "LD_",
    "LP_",
    "MESA_",
    "MVK_",
    "NIR_",
    "NVK_",
    "RADV_",
    "SPIRV_",
    "SWIFTSHADER",
    "TU_",
    "VK_",
    "V3D_",
    "ZINK_",
    "__GL_",
    "__NV_",
];

/// A hash of a device with its driver, and of other inputs of the driver's compiler: its name and version, the
/// environment variables that affect drivers, and on software devices the processor's instructions.
fn of_device(
    physical: &PhysicalDevice,
    environment: impl Iterator<Item = (std::ffi::OsString, std::ffi::OsString)>,
) -> String {
    let info = &physical.info;
    let mut settings = vec![
        env!("CARGO_PKG_VERSION").to_owned(),
        format!(
            "{:x} {:x} {}",
            info.vendor_id, info.device_id, info.api_version
        ),
        info.name.clone(),
        info.driver.clone(),
    ];
    if info.kind == DeviceKind::Cpu {
        settings.push(format!("{} {:?}", env::consts::ARCH, VectorWidth::widest()));
    }
    let mut variables: Vec<String> = environment
        .filter(|(name, _)| {
            let name = name.to_string_lossy();
            OF_DRIVERS.iter().any(|start| name.starts_with(start))
        })
        .map(|(name, value)| format!("{}={}", name.display(), value.display()))
        .collect();
    variables.sort_unstable();
    settings.extend(variables);
    let setting = settings.iter().flat_map(|text| text.bytes().chain([0]));
    let setting = setting.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
    });
    format!(
        "{} {:08x} {setting:016x}",
        info.uuid, physical.driver_version
    )
}

/// The kernels that have passed so far, in this process and before.
pub(crate) struct Passes {
    cache: Cache,
    known: Mutex<BTreeSet<KernelPass>>,
}

impl Passes {
    /// The passed checks that a cache keeps. All engines of a process that use the same cache share them, also without files.
    pub(crate) fn kept_in(cache: &Cache) -> Arc<Self> {
        static ALL: Mutex<BTreeMap<Cache, Arc<Passes>>> = Mutex::new(BTreeMap::new());
        let mut all = lock(&ALL);
        let passes = all
            .entry(cache.clone())
            .or_insert_with(|| Arc::new(Self::of(cache.clone())));
        Arc::clone(passes)
    }

    fn of(cache: Cache) -> Self {
        let known = Mutex::new(read(&cache));
        Self { cache, known }
    }

    pub(crate) fn has(&self, pass: &KernelPass) -> bool {
        lock(&self.known).contains(pass)
    }

    pub(crate) fn remember(&self, passed: impl IntoIterator<Item = KernelPass>) {
        let mut known = lock(&self.known);
        let before = known.len();
        known.extend(passed);
        if known.len() == before {
            return;
        }
        // Other processes may have written to the file meanwhile.
        let mut all = read(&self.cache);
        all.extend(known.iter().cloned());
        if all.len() > MAX_LINES {
            all.clone_from(&known);
        }
        drop(known);
        let lines: String = all
            .iter()
            .flat_map(|KernelPass(line)| [line.as_str(), "\n"])
            .collect();
        self.cache.write(FILE, lines.as_bytes());
    }
}

/// The lines of the file that can be read.
fn read(cache: &Cache) -> BTreeSet<KernelPass> {
    let bytes = cache.read(FILE, MAX_BYTES).unwrap_or_default();
    let text = String::from_utf8_lossy(&bytes);
    text.lines().filter_map(KernelPass::parse).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEVICE: &str = "6d657361-3232-2e33-2e36-000000000000 00000001 0123456789abcdef";

    #[test]
    fn what_passed_is_known_to_the_next_process() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::within(folder.path());
        let (one, two) = (KernelPass::of(DEVICE, 1), KernelPass::of(DEVICE, 2));
        let passes = Passes::of(cache.clone());
        assert!(!passes.has(&one));
        passes.remember([one.clone()]);
        assert!(passes.has(&one) && !passes.has(&two));
        // Two processes that start at the same time.
        let other = Passes::of(cache.clone());
        passes.remember([two.clone()]);
        let three = KernelPass::of(DEVICE, 3);
        other.remember([three.clone()]);
        let next = Passes::of(cache);
        assert!([&one, &two, &three].into_iter().all(|pass| next.has(pass)));
    }

    /// Lines that this version does not know are skipped, because another version may have written the file.
    #[test]
    fn a_line_of_another_kind_means_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::within(folder.path());
        let sound = KernelPass::of(DEVICE, 7);
        let KernelPass(line) = &sound;
        let foreign = [
            "",
            "exact",
            "exact 2",
            &line[..line.len() - 1],
            &line.replace("exact 2", "exact 1"),
            &line.replace("exact", "inexact"),
            &line.to_uppercase(),
            &format!("{line} more"),
            &format!(" {line}"),
            &"exact 2 ".repeat(1000),
            "\u{fffd}\0",
        ];
        for other in foreign {
            assert_eq!(KernelPass::parse(other), None, "{other}");
        }
        let file = format!("{}\n{line}\n{}", foreign.join("\n"), &line[..20]);
        assert!(cache.write(FILE, &[file.as_bytes(), &[0xff, 0xfe]].concat()));
        assert_eq!(read(&cache), BTreeSet::from([sound]));
        // As many lines as the file may have: the entries of this process must stay.
        let many: String = (0..MAX_LINES as u64)
            .map(|code| KernelPass::of(DEVICE, code).0 + "\n")
            .collect();
        assert!(cache.write(FILE, many.as_bytes()));
        let passes = Passes::of(Cache::within(&folder.path().join("other")));
        let passes = Passes { cache, ..passes };
        let newest = KernelPass::of(DEVICE, u64::MAX);
        passes.remember([newest.clone()]);
        assert_eq!(read(&passes.cache), BTreeSet::from([newest]));
    }
}
