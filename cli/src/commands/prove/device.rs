//! The environment of a proof: the program, the host, and how the device is connected.

use std::fs;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use sha2::{Digest as _, Sha256};
use tumble::VectorWidth;
use tumble_verify::golden::Golden;

use crate::commands::prove::report::{Bus, Host, Program, hexadecimal};

pub(crate) fn program() -> Program {
    let mut kernels = Sha256::new();
    for (name, code) in tumble::vulkan::kernels() {
        kernels.update(name);
        kernels.update([0]);
        kernels.update(code);
    }
    Program {
        version: env!("CARGO_PKG_VERSION"),
        // `scripts/card.sh`, which builds releases, sets this variable. If a build script asked for the commit, every
        // commit would compile the program again.
        commit: option_env!("TUMBLE_COMMIT").unwrap_or("unknown"),
        kernels: hexadecimal(&kernels.finalize()),
        golden_table: hexadecimal(&Sha256::digest(Golden::table())),
        target: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
    }
}

pub(crate) fn host() -> Host {
    Host {
        system: system(),
        processor: processor(),
        threads: rayon::current_num_threads(),
        vector_width: format!("{:?}", VectorWidth::widest()).to_lowercase(),
    }
}

/// The value of `name = value` or `name : value` in a file of such lines.
fn value(path: &str, name: &str, separator: char) -> Option<String> {
    let text = fs::read_to_string(path).ok()?;
    let mut lines = text.lines().filter_map(|line| line.split_once(separator));
    let (_, value) = lines.find(|(key, _)| key.trim() == name)?;
    Some(value.trim().trim_matches('"').to_owned())
}

fn system() -> String {
    value("/etc/os-release", "PRETTY_NAME", '=').unwrap_or_else(|| std::env::consts::OS.to_owned())
}

fn processor() -> String {
    value("/proc/cpuinfo", "model name", ':').unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

/// The speed and the width of the link to a PCI device, as Linux has them in `/sys`; `None` if it has neither.
pub(crate) fn bus(address: &str) -> Option<Bus> {
    bus_in(Path::new("/sys/bus/pci/devices"), address)
}

fn bus_in(devices: &Path, address: &str) -> Option<Bus> {
    let folder = devices.join(address);
    let read = |name: &str| {
        let text = fs::read_to_string(folder.join(name)).ok()?;
        Some(text.trim().to_owned()).filter(|text| !text.is_empty())
    };
    let bus = Bus {
        link_speed: read("current_link_speed"),
        link_width: read("current_link_width"),
        largest_link_speed: read("max_link_speed"),
        largest_link_width: read("max_link_width"),
    };
    (bus != Bus::default()).then_some(bus)
}

/// Now, as `2026-01-31 23:59:59 UTC`.
pub(crate) fn now() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    date(since.map_or(0, |since| since.as_secs()))
}

/// A time in seconds since 1970, by the Gregorian calendar (Howard Hinnant's `civil_from_days`).
fn date(seconds: u64) -> String {
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    // Days since 1 March of year 0. From there, all periods of 400 years have the same length.
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    // The month, counted from March.
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let (month, next_year) = if month < 10 {
        (month + 3, 0)
    } else {
        (month - 9, 1)
    };
    let year = 400 * era + year + next_year;
    format!(
        "{year:04}-{month:02}-{day:02} {:02}:{:02}:{:02} UTC",
        second / 3600,
        second / 60 % 60,
        second % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, expected) in [
            (0, "1970-01-01 00:00:00 UTC"),
            (951_782_399, "2000-02-28 23:59:59 UTC"),
            (951_782_400, "2000-02-29 00:00:00 UTC"),
            (1_704_067_199, "2023-12-31 23:59:59 UTC"),
            (1_798_761_600, "2027-01-01 00:00:00 UTC"),
            (4_107_542_400, "2100-03-01 00:00:00 UTC"),
        ] {
            assert_eq!(date(seconds), expected);
        }
    }

    #[test]
    fn a_bus_is_what_the_system_says_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let device = folder.path().join("0000:01:00.0");
        fs::create_dir(&device).unwrap();
        assert_eq!(bus_in(folder.path(), "0000:01:00.0"), None);
        fs::write(device.join("current_link_width"), "16\n").unwrap();
        let bus = bus_in(folder.path(), "0000:01:00.0").unwrap();
        assert_eq!(bus.link_width.as_deref(), Some("16"));
        assert_eq!(bus_in(folder.path(), "0000:02:00.0"), None);
    }

    #[test]
    fn who_runs_is_told_in_full() {
        let program = program();
        assert_eq!(program.kernels.len(), 64);
        assert_eq!(program.golden_table.len(), 64);
        assert!(!host().processor.is_empty());
    }
}
