//! Results in memory: their layout, the representations in which rotations are stored, the windows
//! into which long results are cut, and what crowds leave.

pub(crate) mod buffer;
pub(crate) mod component_type;
pub(crate) mod crowd;
pub(crate) mod encoding;
pub(crate) mod euler;
pub(crate) mod pose_error;
pub(crate) mod rotations;
pub(crate) mod signs;
pub(crate) mod value;
pub(crate) mod window;
