//! Reads text files as a stream: lines, numbers and columns.

pub(crate) mod blocks;
pub(crate) mod cell;
pub(crate) mod last_number;
pub(crate) mod lines;
pub(crate) mod number;
