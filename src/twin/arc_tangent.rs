//! Reciprocal, square root and arc tangent, of `shaders/math/arc_tangent.wgsl`; and the parts of them that vectors of
//! rotations need, in the same order of operations.

use crate::shader::*;
use crate::simd::lanes::{Choice, Number};
pub(crate) use crate::twin::functions::{arc_tangent, flushed, reciprocal, reciprocal_root, root};

/// The root of a number whose reciprocal root is known.
#[inline(always)]
pub(crate) fn root_by<N: Number>(x: N, inverse: N) -> N {
    let near = x * inverse;
    near + (x - near * near) * (N::all(0.5) * inverse)
}

/// The arc tangent of `small / large`, for 0 <= small <= large and large > 0.
#[inline(always)]
pub(crate) fn flat_arc_tangent<N: Number>(small: N, large: N) -> N {
    let inverse = reciprocal(large);
    let near = small * inverse;
    let t = near + (small - near * large) * inverse;
    let z = t * t;
    let upper = (N::all(ARC_8) * z + N::all(ARC_7)) * z + N::all(ARC_6);
    let high = (upper * z + N::all(ARC_5)) * z + N::all(ARC_4);
    let lower = (high * z + N::all(ARC_3)) * z + N::all(ARC_2);
    let tail = (lower * z + N::all(ARC_1)) * z + N::all(ARC_0);
    tail * (z * t) + t
}

/// The angle of the point (along, up), neither of which is negative and not both are 0, from 0 to pi/2.
#[inline(always)]
pub(crate) fn acute_angle<N: Choice>(up: N, along: N) -> N {
    let is_flat = up.at_most(along);
    let small = N::choose(is_flat, up, along);
    let flat = flat_arc_tangent(small, N::choose(is_flat, along, up));
    N::choose(is_flat, flat, N::all(HALF_PI) - flat + N::all(HALF_PI_LOW))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a wrong digit, and a wrong quadrant.
    #[test]
    fn arc_tangents_and_roots_are_within_two_roundings() {
        let mut worst = 0.0f64;
        for i in 0..200_000 {
            let angle = f64::from(i) * 3.2e-5 - 3.2;
            let size = 10.0f64.powi(i % 9 - 4);
            let (y, x) = ((angle.sin() * size) as f32, (angle.cos() * size) as f32);
            let expected = f64::from(y).atan2(f64::from(x));
            let found = f64::from(arc_tangent(y, x));
            worst = worst.max((found - expected).abs() / (0.1 + expected.abs()));
            let acute = acute_angle(y.abs(), x.abs());
            assert_eq!(acute.to_bits(), arc_tangent(y.abs(), x.abs()).to_bits());
            let square = x * x + y * y;
            let exact = f64::from(square).sqrt();
            assert!((f64::from(root(square)) - exact).abs() <= 1.2e-7 * exact);
        }
        assert!(worst < 3e-7, "{worst:e}");
        assert_eq!((arc_tangent(0.0, 0.0), root(0.0)), (0.0, 0.0));
        assert_eq!(arc_tangent(0.0, -1.0), std::f32::consts::PI);
    }
}
