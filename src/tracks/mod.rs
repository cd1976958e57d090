//! Keyframe tracks. Keys and key times are checked, and the signs of keys are continued along the
//! shortest path, once, when they come into a `TrackSet`.

pub(crate) mod error;
pub(crate) mod rotation;
pub(crate) mod set;
pub(crate) mod signs;
pub(crate) mod track_keys;
