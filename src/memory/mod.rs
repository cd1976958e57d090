//! Allocations whose size depends on a caller's request: they may fail, and then return an error.

/// Below this number of bytes, only the system decides.
#[cfg(target_os = "linux")]
const LARGE: u128 = 1 << 30;

/// There is not enough memory for a result.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "not enough memory for {purpose}: {bytes} bytes needed; ask for less at once, as `stream` and `Clip::request` do"
)]
#[non_exhaustive]
pub struct OutOfMemoryError {
    /// The purpose of the memory.
    pub purpose: &'static str,
    /// The requested number of bytes.
    pub bytes: u128,
}

impl OutOfMemoryError {
    pub(crate) fn new<T>(purpose: &'static str, count: usize) -> Self {
        let bytes = count as u128 * size_of::<T>() as u128;
        Self { purpose, bytes }
    }
}

/// Room for `count` values. The system may promise memory that it does not have and end the process that uses it;
/// therefore large amounts are refused if less is available.
pub(crate) fn reserved<T>(count: usize, purpose: &'static str) -> Result<Vec<T>, OutOfMemoryError> {
    refuse_more_than_there_is::<T>(count, purpose)?;
    let mut values = Vec::new();
    match values.try_reserve_exact(count) {
        Ok(()) => Ok(values),
        Err(_) => Err(OutOfMemoryError::new::<T>(purpose, count)),
    }
}

/// Zero-initialised values.
pub(crate) fn zeroed<T: bytemuck::Zeroable>(
    count: usize,
    purpose: &'static str,
) -> Result<Vec<T>, OutOfMemoryError> {
    refuse_more_than_there_is::<T>(count, purpose)?;
    bytemuck::try_zeroed_vec(count).map_err(|()| OutOfMemoryError::new::<T>(purpose, count))
}

/// Refuses a large amount if the system has less available.
pub(crate) fn refuse_more_than_there_is<T>(
    count: usize,
    purpose: &'static str,
) -> Result<(), OutOfMemoryError> {
    let asked = OutOfMemoryError::new::<T>(purpose, count);
    #[cfg(target_os = "linux")]
    if asked.bytes >= LARGE
        && let Ok(text) = std::fs::read_to_string("/proc/meminfo")
        && asked.bytes > available(&text)
    {
        return Err(asked);
    }
    match isize::try_from(asked.bytes) {
        Ok(_) => Ok(()),
        Err(_) => Err(asked),
    }
}

/// The bytes of memory and of swap space that are free or can be freed, from Linux's `/proc/meminfo`.
#[cfg(target_os = "linux")]
fn available(meminfo: &str) -> u128 {
    let kibibytes = |name: &str| {
        let line = meminfo.lines().find_map(|line| line.strip_prefix(name))?;
        line.split_whitespace().next()?.parse::<u128>().ok()
    };
    match kibibytes("MemAvailable:") {
        Some(memory) => (memory + kibibytes("SwapFree:").unwrap_or(0)) * 1024,
        None => u128::MAX,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_has_is_refused_and_named() {
        for count in [1 << 46, usize::MAX / 16, usize::MAX] {
            let expected = OutOfMemoryError {
                purpose: "a result",
                bytes: 16 * count as u128,
            };
            assert_eq!(zeroed::<[f32; 4]>(count, "a result").unwrap_err(), expected);
            assert_eq!(
                reserved::<[f32; 4]>(count, "a result").unwrap_err(),
                expected
            );
        }
        assert_eq!(zeroed::<f32>(3, "a result").unwrap(), [0.0; 3]);
        assert!(reserved::<f32>(3, "a result").unwrap().capacity() >= 3);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_systems_table_is_read() {
        let table = "MemTotal:  16 kB\nMemAvailable:      5 kB\nSwapFree:   2 kB\n";
        assert_eq!(available(table), 7 * 1024);
        assert_eq!(available("MemTotal: 16 kB\n"), u128::MAX);
    }
}
