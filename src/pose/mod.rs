//! Poses: blending and adding layers of rotations, skeletons with rotations and positions in the
//! world, transforms of rotations, translations and scales, and scalars.

pub(crate) mod affine;
pub(crate) mod follow;
pub(crate) mod local_to_model;
#[cfg(feature = "vulkan")]
pub(crate) mod pass;
pub(crate) mod poses;
pub(crate) mod scalars;
pub(crate) mod skeleton;
pub(crate) mod smooth;
pub(crate) mod transforms;
pub(crate) mod tree;
