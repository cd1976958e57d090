//! The textbook in f64: what the engine's bits are measured against.
//!
//! It shares no code and no trick with the engine: formulas as the papers have
//! them, one rotation at a time, with the platform's own sine and cosine. Slow, and
//! accurate to about 1e-15.

mod b_spline;
mod c2;
mod curve;
mod pace;
mod quaternion;
mod segment;
mod tangents;
mod vector;

pub use curve::{Curve, Kind};
pub use quaternion::{
    angle_between, nlerp, slerp, slerp_from_end, slerp_from_end_left, slerp_from_start,
    slerp_from_start_left, squad,
};
pub use vector::VectorCurve;
