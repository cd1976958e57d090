//! TODO-DOC

pub(crate) mod arc_length;
pub(crate) mod constant_speed;
pub(crate) mod derivatives;
