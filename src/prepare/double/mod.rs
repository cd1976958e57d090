//! TODO-DOC

pub(crate) mod curve;
pub(crate) mod cut;
pub(crate) mod expansion;
pub(crate) mod fit;
pub(crate) mod fitting;
pub(crate) mod handles;
pub(crate) mod intervals;
pub(crate) mod shape;
pub(crate) mod smooth;
