//! Text files: lines, numbers and columns, read as a stream.

pub(crate) mod blocks;
pub(crate) mod cell;
pub(crate) mod lines;
pub(crate) mod number;
