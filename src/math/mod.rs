//! TODO-DOC

pub(crate) mod canonical;
pub(crate) mod dual;
pub(crate) mod quaternion;
pub(crate) mod ranges;
