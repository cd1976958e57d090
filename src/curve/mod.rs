//! TODO-DOC

pub(crate) mod formula;
pub(crate) mod segment;
