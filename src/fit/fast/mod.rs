//! The fast way, in f32 straight from four keys, for curves that turn through moderate angles. Lanes whose
//! numbers are outside its range are marked, and go the exact way.

pub(crate) mod exp_log;
pub(crate) mod fit_range;
pub(crate) mod handles;
pub(crate) mod hermite_fit;
pub(crate) mod long_tangents;
pub(crate) mod small_angle;
