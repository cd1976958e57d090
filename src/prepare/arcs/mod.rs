//! TODO-DOC

pub(crate) mod arc_lanes;
pub(crate) mod arcs;
