//! The one way from a set to its rotations: which route it takes, and the routes.

pub(crate) mod backend;
pub(crate) mod route;
pub(crate) mod set;
pub(crate) mod uploaded;
