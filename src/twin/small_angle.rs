//! Cubics through small angles, of `shaders/from_keys/small_angle.wgsl`.

use crate::math::quaternion::Arithmetic;
pub(crate) use crate::twin::functions::{
    FromIdentity, SmallAngleCubic, composed, inverse_rotated, small_angle_cubic, step_vector,
};

#[inline(always)]
pub(crate) fn chord_of<N: Arithmetic>(a: [N; 4], b: [N; 4]) -> [N; 4] {
    [b[0] - a[0], b[1] - a[1], b[2] - a[2], b[3] - a[3]]
}
