//! Exact fitting, in f64, for every method, angle and quantity: the handles of keys, the curves by their formulas,
//! and the polynomials that are fitted to them.

pub(crate) mod cut;
pub(crate) mod expansion;
pub(crate) mod fit;
pub(crate) mod handles;
pub(crate) mod sampling;
pub(crate) mod shape;
