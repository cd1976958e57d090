//! Angular velocities and accelerations of curves, and curves traversed at constant speed.

pub(crate) mod arc_length;
pub(crate) mod derivatives;
