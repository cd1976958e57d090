//! The types of results in the caller's memory.

use glam::{Quat, Vec4};

use crate::tracks::rotation::sealed::Sealed;

/// A value of a result in the caller's memory, 16 bytes: [`Quat`] for rotations, [`Vec4`] for velocities and
/// accelerations (`x y z 0`), or `[f32; 4]` for both.
pub trait OutputValue: bytemuck::Pod + Send + Sync + Sealed {
    #[doc(hidden)]
    const STORES_ROTATIONS: bool = true;
    #[doc(hidden)]
    const STORES_RATES: bool = true;
}

impl OutputValue for Quat {
    const STORES_RATES: bool = false;
}

impl OutputValue for Vec4 {
    const STORES_ROTATIONS: bool = false;
}

impl OutputValue for [f32; 4] {}
