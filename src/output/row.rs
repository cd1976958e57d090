//! The types in which a result lies in the caller's memory.

use glam::{Quat, Vec4};

use crate::curve::options::Quantity;
use crate::tracks::rotation::sealed::Sealed;

/// A value of a result in the caller's memory, 16 bytes: [`Quat`] holds rotations, [`Vec4`] velocities
/// and accelerations (`x y z 0`), `[f32; 4]` either.
pub trait Row: bytemuck::Pod + Send + Sync + Sealed {
    /// Whether it may hold such values.
    #[doc(hidden)]
    fn holds(quantity: Quantity) -> bool;
}

impl Row for Quat {
    fn holds(quantity: Quantity) -> bool {
        quantity == Quantity::Rotation
    }
}

impl Row for Vec4 {
    fn holds(quantity: Quantity) -> bool {
        quantity != Quantity::Rotation
    }
}

impl Row for [f32; 4] {
    fn holds(_: Quantity) -> bool {
        true
    }
}
