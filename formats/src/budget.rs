//! The memory budget of reading one input.
//!
//! A file of a megabyte can claim to contain gigabytes: by a count in a header, by compressed data, or by many
//! references to one part. Each reader asks the budget before it allocates memory whose size the file determines. An
//! input that would exceed the budget is refused, with the number of bytes. The budget covers the whole input, so
//! that its parts cannot exceed it together.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::limits::Limits;

/// Memory budget of every input, whatever its length, in bytes.
pub const BASE: u64 = 64 << 20;

/// Additional memory budget for each byte of an input, in bytes. A number of one byte can become an f32 key with an
/// f64 time, and compressed files unpack to several times their length.
pub const FACTOR: u64 = 64;

/// The memory budget of one input, and how much of it is used.
#[derive(Debug)]
pub(crate) struct Budget {
    limit: AtomicU64,
    used: AtomicU64,
    /// Whether the budget grows when files beside the input are read.
    grows: bool,
}

/// An input needs more memory than its budget.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("reading it would take at least {needed} bytes of memory; {}", self.allowance())]
pub(crate) struct OverBudget {
    needed: u64,
    limit: u64,
    /// Whether the limit is [`Limits::memory`], rather than that of an input of this length.
    is_requested: bool,
}

impl OverBudget {
    fn allowance(&self) -> String {
        let limit = self.limit;
        match self.is_requested {
            true => format!("the limit is {limit}"),
            false => {
                format!(
                    "the limit for an input of this length is {limit}; it states more data than it contains"
                )
            }
        }
    }
}

impl Budget {
    /// The budget of an input of `input` bytes.
    pub(crate) fn of(input: usize, limits: Limits) -> Self {
        let limit = match limits.memory {
            Some(limit) => limit,
            None => BASE.saturating_add(FACTOR.saturating_mul(input as u64)),
        };
        Self {
            limit: AtomicU64::new(limit),
            used: AtomicU64::new(0),
            grows: limits.memory.is_none(),
        }
    }

    /// Adds `bytes` to the length of the input: those of a file beside it.
    pub(crate) fn add_input(&self, bytes: usize) {
        if self.grows {
            let more = FACTOR.saturating_mul(bytes as u64);
            self.limit.fetch_add(more, Ordering::Relaxed);
        }
    }

    /// All bytes, used or not.
    #[cfg(feature = "mcap")]
    pub(crate) fn limit(&self) -> u64 {
        self.limit.load(Ordering::Relaxed)
    }

    /// Bytes that are not used yet.
    #[cfg(feature = "fbx")]
    pub(crate) fn left(&self) -> u64 {
        let limit = self.limit.load(Ordering::Relaxed);
        limit.saturating_sub(self.used.load(Ordering::Relaxed))
    }

    /// Takes memory for `count` elements of `bytes` each, until the input has been read.
    ///
    /// # Errors
    /// When less than that is left.
    pub(crate) fn take(&self, count: usize, bytes: usize) -> Result<(), OverBudget> {
        let requested = (count as u64).saturating_mul(bytes as u64);
        let (used, limit) = (&self.used, self.limit.load(Ordering::Relaxed));
        let before = used.fetch_add(requested, Ordering::Relaxed);
        let needed = before.saturating_add(requested);
        if needed <= limit && before <= limit {
            return Ok(());
        }
        used.fetch_sub(requested, Ordering::Relaxed);
        Err(OverBudget {
            needed,
            limit,
            is_requested: !self.grows,
        })
    }

    /// Takes memory that is returned to the budget when the value is dropped.
    ///
    /// # Errors
    /// When less than that is left.
    pub(crate) fn borrow(&self, count: usize, bytes: usize) -> Result<Borrowed<'_>, OverBudget> {
        self.take(count, bytes)?;
        let bytes = (count as u64).saturating_mul(bytes as u64);
        Ok(Borrowed {
            budget: self,
            bytes,
        })
    }
}

/// Memory of a budget, returned when this is dropped.
#[must_use]
pub(crate) struct Borrowed<'a> {
    budget: &'a Budget,
    bytes: u64,
}

impl Drop for Borrowed<'_> {
    fn drop(&mut self) {
        self.budget.used.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_add_up_and_are_refused_together() {
        let limits = Limits {
            memory: Some(1000),
            ..Limits::default()
        };
        let budget = Budget::of(usize::MAX / 2, limits);
        budget.add_input(usize::MAX / 2);
        budget.take(100, 6).unwrap();
        let borrowed = budget.borrow(1, 400).unwrap();
        let over = budget.take(1, 1).unwrap_err();
        assert_eq!((over.needed, over.limit), (1001, 1000));
        drop(borrowed);
        budget.take(4, 100).unwrap();
        assert!(budget.take(usize::MAX, usize::MAX).is_err());
        assert!(budget.take(1, 1).is_err());
        assert!(budget.take(0, 99).is_ok());
    }

    #[test]
    fn longer_inputs_get_more() {
        let budget = Budget::of(10, Limits::default());
        assert!(budget.take(1, (BASE + 10 * FACTOR) as usize).is_ok());
        assert!(budget.take(1, 1).is_err());
        budget.add_input(1);
        assert!(budget.take(FACTOR as usize, 1).is_ok());
    }
}
