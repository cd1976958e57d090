//! Curves in f64: their handles, their formulas and the polynomials fitted to them.

pub(crate) mod curve;
pub(crate) mod cut;
pub(crate) mod expansion;
pub(crate) mod fit;
pub(crate) mod handles;
pub(crate) mod intervals;
pub(crate) mod shape;
