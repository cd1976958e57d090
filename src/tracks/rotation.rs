//! Rotations as callers have them.

use glam::Quat;

/// A rotation as callers have it: [`Quat`], or its numbers `x y z w`.
pub trait Rotation: Copy + sealed::Sealed {
    /// As a quaternion.
    #[doc(hidden)]
    fn quat(self) -> Quat;
}

impl Rotation for Quat {
    #[inline]
    fn quat(self) -> Quat {
        self
    }
}

impl Rotation for [f32; 4] {
    #[inline]
    fn quat(self) -> Quat {
        Quat::from_array(self)
    }
}

mod sealed {
    /// Types of which it is known what their numbers are.
    pub trait Sealed {}

    impl Sealed for glam::Quat {}
    impl Sealed for [f32; 4] {}
}
