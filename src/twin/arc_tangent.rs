//! Twin of `shaders/math/arc_tangent.wgsl`: the same names, the same order.

use crate::shader::*;
use crate::simd::lanes::Number;
pub(crate) use crate::twin::functions::{flushed, reciprocal_root};
use crate::twin::functions::{magnitude, reciprocal};

#[inline(always)]
pub(crate) fn root<N: Number>(x: N) -> N {
    let inverse = reciprocal_root(x);
    root_by(x, inverse)
}

/// The root of a number of which the reciprocal root is known.
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

#[inline(always)]
pub(crate) fn arc_tangent(y: f32, x: f32) -> f32 {
    let up = magnitude(y);
    let along = magnitude(x);
    let steep = up > along;
    let large = if steep { up } else { along };
    let small = if steep { along } else { up };
    let divisor = if large == 0.0 { 1.0 } else { large };
    let flat = flat_arc_tangent(small, divisor);
    let acute = if steep {
        (HALF_PI - flat) + HALF_PI_LOW
    } else {
        flat
    };
    let angle = if x < 0.0 {
        (PI - acute) + PI_LOW
    } else {
        acute
    };
    if y < 0.0 { -angle } else { angle }
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
            let square = x * x + y * y;
            let exact = f64::from(square).sqrt();
            assert!((f64::from(root(square)) - exact).abs() <= 1.2e-7 * exact);
        }
        assert!(worst < 3e-7, "{worst:e}");
        assert_eq!((arc_tangent(0.0, 0.0), root(0.0)), (0.0, 0.0));
        assert_eq!(arc_tangent(0.0, -1.0), std::f32::consts::PI);
    }
}
