//! How large an input may be.

use crate::source::MAX_BYTES;

/// The largest sizes of an input that is read; a larger input is refused.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Length of one line in bytes.
    pub line: u64,
    /// Length of the whole input in bytes.
    pub file: u64,
    /// Memory in bytes that reading may take in addition to the input [default: [`FACTOR`](crate::budget::FACTOR)
    /// times the length of the input, plus [`BASE`](crate::budget::BASE)].
    pub memory: Option<u64>,
}

impl Default for Limits {
    /// 64 MiB for a line, 16 GiB for an input, and the default memory.
    fn default() -> Self {
        Self {
            line: 1 << 26,
            file: MAX_BYTES,
            memory: None,
        }
    }
}
