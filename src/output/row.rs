//! The types in which a result lies in the caller's memory.

use glam::{Quat, Vec4};

use crate::tracks::rotation::sealed::Sealed;

/// A value of a result in the caller's memory, 16 bytes: [`Quat`] holds rotations, [`Vec4`] velocities
/// and accelerations (`x y z 0`), `[f32; 4]` either.
pub trait Row: bytemuck::Pod + Send + Sync + Sealed {
    #[doc(hidden)]
    const HOLDS_ROTATIONS: bool = true;
    #[doc(hidden)]
    const HOLDS_RATES: bool = true;
}

impl Row for Quat {
    const HOLDS_RATES: bool = false;
}

impl Row for Vec4 {
    const HOLDS_ROTATIONS: bool = false;
}

impl Row for [f32; 4] {}
