//! Curves in f32, for intervals that turn moderately and know their four keys.

pub(crate) mod exp_log;
pub(crate) mod fit_part;
pub(crate) mod handles;
pub(crate) mod hermite_fit;
pub(crate) mod key_steps;
pub(crate) mod key_weights;
pub(crate) mod long_tangents;
pub(crate) mod small_angle;
