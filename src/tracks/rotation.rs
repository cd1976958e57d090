//! The types of rotations that callers pass.

use glam::Quat;

/// A type of rotations that callers pass: [`Quat`], or the numbers `x y z w`.
pub trait Rotation: bytemuck::Pod + sealed::Sealed {
    /// The rotation as a quaternion.
    #[doc(hidden)]
    #[inline]
    fn quat(self) -> Quat {
        bytemuck::cast(self)
    }
}

impl Rotation for Quat {}
impl Rotation for [f32; 4] {}

pub(crate) mod sealed {
    /// Types of four numbers whose order in memory is known. Keys are passed as some of them, and
    /// [`OutputValue`](crate::OutputValue)s of results are any of them.
    pub trait Sealed {}

    impl Sealed for glam::Quat {}
    impl Sealed for glam::Vec4 {}
    impl Sealed for [f32; 4] {}
}
