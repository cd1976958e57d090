//! Curves between keys: the options that any method takes, the formulas in f64, and the segments
//! that kernels evaluate.

pub(crate) mod formula;
pub(crate) mod options;
pub(crate) mod segment;
