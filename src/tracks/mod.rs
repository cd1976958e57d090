//! Keyframe tracks. When keys are added to a `TrackSet`, they and their times are checked, and the signs of keys for
//! the shortest path are computed once.

pub(crate) mod error;
pub(crate) mod joints;
pub(crate) mod per_track;
pub(crate) mod rotation;
pub(crate) mod set;
pub(crate) mod signs;
pub(crate) mod track_keys;
