//! Turns key intervals into the coefficients of segments, many intervals at once in vector lanes.
//! The methods are built on this folder; it knows none of them. `prepare` applies methods to
//! tracks.

pub(crate) mod constant_velocity;
pub(crate) mod double;
pub(crate) mod motion;
pub(crate) mod nodes;
pub(crate) mod single;
pub(crate) mod tangent_weights;
