//! TODO-DOC

pub(crate) mod pieces;
