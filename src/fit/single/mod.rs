//! Curves in f32 straight from four keys, for intervals that turn through moderate angles.

pub(crate) mod exp_log;
pub(crate) mod fit_range;
pub(crate) mod handles;
pub(crate) mod hermite_fit;
pub(crate) mod long_tangents;
pub(crate) mod small_angle;
