//! Allocations whose size depends on a caller's request: they may fail, and then return an error.

/// Below this number of bytes, only the system decides.
const LARGE: u128 = 1 << 28;

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
    if asked.bytes >= LARGE && left(Swap::Counts).is_some_and(|bytes| asked.bytes > bytes.into()) {
        return Err(asked);
    }
    match isize::try_from(asked.bytes) {
        Ok(_) => Ok(()),
        Err(_) => Err(asked),
    }
}

/// The memory in bytes that this process can still get without swap space: the memory that the system has free or can
/// free; in a container at most the rest of its limit. `None` if the system does not say, such as in a browser.
///
/// Allocations of 256 MiB and more are refused with an [`OutOfMemoryError`] if less than they need is available, swap
/// space included. Systems may promise memory that they do not have, and then end the process that uses it.
#[must_use]
pub fn available_memory() -> Option<u64> {
    left(Swap::LeftOut)
}

/// Whether free swap space counts as memory.
enum Swap {
    Counts,
    LeftOut,
}

#[cfg(target_family = "wasm")]
fn left(_: Swap) -> Option<u64> {
    None
}

#[cfg(not(target_family = "wasm"))]
fn left(swap: Swap) -> Option<u64> {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    if system.total_memory() == 0 {
        return None;
    }
    let swap = match swap {
        Swap::Counts => system.free_swap(),
        Swap::LeftOut => 0,
    };
    let free = system.available_memory().saturating_add(swap);
    let limits = system.cgroup_limits();
    let limits = limits.map(|limits| (limits.total_memory, limits.rss));
    Some(within_limits(free, system.total_memory(), limits))
}

/// The part of a system's free memory that a container's limit leaves: the limit without the memory of its processes.
/// Memory that caches files counts as free, because the system frees it when it is needed. A limit that is not less
/// than the whole memory is ignored.
#[cfg(not(target_family = "wasm"))]
fn within_limits(free: u64, total: u64, limits: Option<(u64, u64)>) -> u64 {
    match limits {
        Some((limit, used)) if limit < total => free.min(limit.saturating_sub(used)),
        _ => free,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_has_is_refused_and_named() {
        for count in [
            usize::try_from(1_u64 << 46).unwrap_or(usize::MAX / 4),
            usize::MAX / 16,
            usize::MAX,
        ] {
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

    #[cfg(not(target_family = "wasm"))]
    #[test]
    fn a_containers_limit_counts_and_the_systems_does_not() {
        assert_eq!(within_limits(70, 100, None), 70);
        assert_eq!(within_limits(70, 100, Some((100, 60))), 70);
        assert_eq!(within_limits(70, 100, Some((90, 60))), 30);
        assert_eq!(within_limits(20, 100, Some((90, 60))), 20);
        assert_eq!(within_limits(70, 100, Some((40, 60))), 0);
    }

    #[cfg(any(target_os = "linux", target_os = "macos", windows))]
    #[test]
    fn the_system_says_what_is_free() {
        let free = available_memory().unwrap();
        assert!(left(Swap::Counts).unwrap() > 1 << 20);
        assert!(free > 1 << 20, "{free}");
        assert!(free < 1 << 50, "{free}");
    }
}
