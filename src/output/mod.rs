//! Results in memory: their layouts, their encodings, the windows into which long results are divided, and the
//! results of crowds.

pub(crate) mod buffer;
pub(crate) mod component_type;
pub(crate) mod crowd;
pub(crate) mod encoded;
pub(crate) mod encoding;
pub(crate) mod euler;
pub(crate) mod pose_error;
pub(crate) mod rotations;
pub(crate) mod scalars;
pub(crate) mod signs;
#[cfg(feature = "vulkan")]
pub(crate) mod states;
pub(crate) mod value;
pub(crate) mod window;
