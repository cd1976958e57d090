//! TODO-DOC

pub(crate) mod buffer;
pub(crate) mod encoding;
pub(crate) mod euler;
pub(crate) mod rotations;
pub(crate) mod window;
