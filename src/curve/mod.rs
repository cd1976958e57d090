//! Curves between keys: the options that any method takes, and the formulas in f64.

pub(crate) mod formula;
pub(crate) mod options;
