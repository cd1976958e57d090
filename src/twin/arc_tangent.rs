//! Twin of `shaders/math/arc_tangent.wgsl`: the same names, the same order.

use crate::shader::*;

#[inline(always)]
pub(crate) fn flushed(x: f32) -> f32 {
    if x.to_bits() & 0x7fff_ffff < FLUSHED_BITS {
        0.0
    } else {
        x
    }
}

#[inline(always)]
pub(super) fn magnitude(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & 0x7fff_ffff)
}

#[inline(always)]
pub(super) fn reciprocal(x: f32) -> f32 {
    let seed = f32::from_bits(RECIPROCAL_SEED.wrapping_sub(x.to_bits()));
    let first = seed * (2.0 - x * seed);
    let second = first * (2.0 - x * first);
    let third = second * (2.0 - x * second);
    third * (2.0 - x * third)
}

#[inline(always)]
pub(crate) fn reciprocal_root(x: f32) -> f32 {
    let seed = f32::from_bits(ROOT_SEED.wrapping_sub(x.to_bits() >> 1));
    let half = 0.5 * x;
    let first = seed * (1.5 - half * seed * seed);
    let second = first * (1.5 - half * first * first);
    second * (1.5 - half * second * second)
}

#[inline(always)]
pub(crate) fn root(x: f32) -> f32 {
    let near = x * reciprocal_root(x);
    near + (x - near * near) * (0.5 * reciprocal_root(x))
}

#[inline(always)]
pub(crate) fn arc_tangent(y: f32, x: f32) -> f32 {
    let up = magnitude(y);
    let along = magnitude(x);
    let steep = up > along;
    let large = if steep { up } else { along };
    let small = if steep { along } else { up };
    let divisor = if large == 0.0 { 1.0 } else { large };
    let inverse = reciprocal(divisor);
    let near = small * inverse;
    let t = near + (small - near * divisor) * inverse;
    let z = t * t;
    let high = (((ARC_8 * z + ARC_7) * z + ARC_6) * z + ARC_5) * z + ARC_4;
    let tail = (((high * z + ARC_3) * z + ARC_2) * z + ARC_1) * z + ARC_0;
    let flat = tail * (z * t) + t;
    let acute = if steep {
        (HALF_PI - flat) + HALF_PI_LOW
    } else {
        flat
    };
    let turned = if x < 0.0 {
        (PI - acute) + PI_LOW
    } else {
        acute
    };
    if y < 0.0 { -turned } else { turned }
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
