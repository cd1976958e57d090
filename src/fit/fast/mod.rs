//! Fast fitting, in f32 directly from four keys, for curves of moderate angles. Lanes whose numbers are outside its
//! range are marked, and are fitted by exact fitting.

pub(crate) mod exp_log;
pub(crate) mod fit_range;
pub(crate) mod handles;
pub(crate) mod hermite_fit;
pub(crate) mod long_tangents;
pub(crate) mod small_angle;
