//! Rotations as callers have them.

use glam::Quat;

/// A rotation as callers have it: [`Quat`], or its numbers `x y z w`.
pub trait Rotation: bytemuck::Pod + sealed::Sealed {
    /// As a quaternion.
    #[doc(hidden)]
    #[inline]
    fn quat(self) -> Quat {
        bytemuck::cast(self)
    }
}

impl Rotation for Quat {}
impl Rotation for [f32; 4] {}

pub(crate) mod sealed {
    /// Types of which it is known how their four numbers lie in memory. Keys come in as some of
    /// them, and [`OutputValue`](crate::OutputValue)s of results lie in any.
    pub trait Sealed {}

    impl Sealed for glam::Quat {}
    impl Sealed for glam::Vec4 {}
    impl Sealed for [f32; 4] {}
}
