//! The textbook in f64, against which the engine's results are measured.
//!
//! It shares no code and no trick with the engine: formulas as the papers have
//! them, one rotation at a time, with the platform's own sine and cosine. Slow, and
//! accurate to about 1e-15.

pub(crate) mod b_spline;
pub(crate) mod c2;
pub(crate) mod curve;
pub(crate) mod follow;
pub(crate) mod given;
pub(crate) mod handles;
pub(crate) mod pace;
pub(crate) mod quaternion;
pub(crate) mod segment;
pub(crate) mod track;
pub(crate) mod vector;

pub use crate::reference::curve::{Curve, Definition};
pub use crate::reference::follow::{Followed, Follower, Frame, Heading, Travel, eased};
pub use crate::reference::quaternion::{
    angle_between, nlerp, slerp, slerp_from_end, slerp_from_end_left, slerp_from_start,
    slerp_from_start_left, squad,
};
pub use crate::reference::vector::VectorCurve;
