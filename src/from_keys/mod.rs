//! TODO-DOC

pub(crate) mod arcs;
pub(crate) mod cubics;
pub(crate) mod evaluate;
pub(crate) mod fallback;
pub(crate) mod pieces;
pub(crate) mod upload;
