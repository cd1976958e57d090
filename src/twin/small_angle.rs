//! Twin of `shaders/from_keys/small_angle.wgsl`: the same names, the same order.

use crate::math::quaternion::{Arithmetic, cross3, dot3, minus, product, scaled, sum};
use crate::shader::*;
use crate::simd::lanes::canonical;
use crate::twin::evaluate_arc::norm_squared;

/// A rotation as its difference from the identity, which keeps the digits of a small rotation.
#[derive(Clone, Copy)]
pub(crate) struct FromIdentity<N> {
    pub(crate) vector: [N; 3],
    /// Cosine minus one.
    pub(crate) cosm1: N,
}

/// A cubic through small angles, as a polynomial about its middle.
pub(crate) struct SmallAngleCubic {
    /// The coefficients of 1, s, s², … s⁶.
    pub(crate) powers: [[f32; 4]; 7],
    /// Whether the curve is within the limits of small angles; if not, `powers` mean nothing.
    pub(crate) is_valid: bool,
}

#[inline(always)]
pub(crate) fn chord_of<N: Arithmetic>(a: [N; 4], b: [N; 4]) -> [N; 4] {
    [b[0] - a[0], b[1] - a[1], b[2] - a[2], b[3] - a[3]]
}

#[inline(always)]
pub(crate) fn step_vector<N: Arithmetic>(a: [N; 4], chord: [N; 4]) -> [N; 3] {
    [
        a[3] * chord[0] - chord[3] * a[0] - (a[1] * chord[2] - a[2] * chord[1]),
        a[3] * chord[1] - chord[3] * a[1] - (a[2] * chord[0] - a[0] * chord[2]),
        a[3] * chord[2] - chord[3] * a[2] - (a[0] * chord[1] - a[1] * chord[0]),
    ]
}

/// The logarithm by a series in the squared sine, for small angles.
#[inline(always)]
pub(super) fn small_log(v: [f32; 3]) -> [f32; 3] {
    let x = dot3(v, v);
    let tail = ((LOG_4 * x + LOG_3) * x + LOG_2) * x + LOG_1;
    sum(scaled(v, tail * x), v)
}

/// The exponential by a series from the identity, for small angles: it adds `v` last, so that no
/// digit of it is lost.
#[inline(always)]
pub(super) fn small_exp(v: [f32; 3]) -> FromIdentity<f32> {
    let x = dot3(v, v);
    let sinc = (SINC_2 * x + SINC_1) * x;
    FromIdentity {
        vector: sum(scaled(v, sinc), v),
        cosm1: (COSM1_2 * x + COSM1_1) * x,
    }
}

#[inline(always)]
pub(crate) fn composed<N: Arithmetic>(a: FromIdentity<N>, b: FromIdentity<N>) -> FromIdentity<N> {
    let apart = sum(a.vector, b.vector);
    let shortened = sum(scaled(a.vector, b.cosm1), scaled(b.vector, a.cosm1));
    FromIdentity {
        vector: sum(sum(apart, shortened), cross3(a.vector, b.vector)),
        cosm1: (a.cosm1 + b.cosm1) + a.cosm1 * b.cosm1 - dot3(a.vector, b.vector),
    }
}

#[inline(always)]
pub(crate) fn inverse_rotated<N: Arithmetic>(v: [N; 3], r: FromIdentity<N>) -> [N; 3] {
    let once = cross3(r.vector, v);
    let twice = sum(once, once);
    let back = sum(scaled(twice, r.cosm1), twice);
    sum(minus(v, back), cross3(r.vector, twice))
}

#[inline(always)]
pub(super) fn canonical_product(m: [f32; 4], v: [f32; 3], w: f32) -> [f32; 4] {
    canonical(product(m, [v[0], v[1], v[2], w]))
}

/// The cubic between the second and the third of four keys, each of which has the sign nearer to
/// its predecessor.
#[inline(always)]
pub(crate) fn small_angle_cubic(
    keys: [[f32; 4]; 4],
    first: TangentWeights,
    last: TangentWeights,
) -> SmallAngleCubic {
    let [before, start, end, after] = keys;
    let chord_before = chord_of(before, start);
    let chord = chord_of(start, end);
    let chord_after = chord_of(end, after);
    let step = step_vector(start, chord);
    let log_before = small_log(step_vector(before, chord_before));
    let log = small_log(step);
    let log_after = small_log(step_vector(end, chord_after));

    let first_left = scaled(log_before, first.before);
    let first_right = scaled(log, first.after);
    let last_left = scaled(log, last.before);
    let last_right = scaled(log_after, last.after);
    let first_tangent = small_log(composed(small_exp(first_left), small_exp(first_right)).vector);
    let last_tangent = small_log(composed(small_exp(last_left), small_exp(last_right)).vector);
    let outgoing = scaled(first_tangent, first.outgoing);
    let incoming = scaled(last_tangent, THIRD - last.outgoing);
    let parabola = scaled(log, TWO_THIRDS);
    let [from_end, from_start] = [minus(parabola, incoming), minus(parabola, outgoing)];
    let w1 = if first.kind == KEY_AT_END {
        from_end
    } else {
        outgoing
    };
    let w3 = if last.kind == KEY_AT_END {
        from_start
    } else {
        incoming
    };
    let whole = FromIdentity {
        vector: step,
        cosm1: norm_squared(chord) * -0.5,
    };
    let without_first = composed(small_exp([-w1[0], -w1[1], -w1[2]]), whole);
    let back = small_exp([-w3[0], -w3[1], -w3[2]]);
    let w2 = small_log(composed(without_first, back).vector);

    let squared_extent = dot3(w1, w1) + dot3(w2, w2) + dot3(w3, w3);
    let is_valid = (squared_extent <= SMALL_SQUARED_EXTENT)
        & (norm_squared(chord_before) <= LONGEST_STEP)
        & (norm_squared(chord) <= LONGEST_STEP)
        & (norm_squared(chord_after) <= LONGEST_STEP)
        & (dot3(first_left, first_left) <= LONGEST_TANGENT_PART)
        & (dot3(first_right, first_right) <= LONGEST_TANGENT_PART)
        & (dot3(last_left, last_left) <= LONGEST_TANGENT_PART)
        & (dot3(last_right, last_right) <= LONGEST_TANGENT_PART)
        & (first.kind != KEY_UNKNOWN)
        & (last.kind != KEY_UNKNOWN);

    let third_rotation = small_exp(scaled(w3, 0.125));
    let second_rotation = composed(small_exp(scaled(w2, 0.5)), third_rotation);
    let rotation = composed(small_exp(scaled(w1, 0.875)), second_rotation);
    let gain = canonical_product(start, rotation.vector, rotation.cosm1);
    let m = [
        gain[0] + start[0],
        gain[1] + start[1],
        gain[2] + start[2],
        gain[3] + start[3],
    ];
    let v1 = inverse_rotated(w1, second_rotation);
    let v2 = inverse_rotated(w2, third_rotation);
    let v3 = w3;

    let outer = sum(v1, v3);
    let a = sum(scaled(outer, 0.75), scaled(v2, 1.5));
    let b = scaled(minus(v3, v1), 1.5);
    let c = minus(outer, sum(v2, v2));
    let x12 = cross3(v1, v2);
    let x23 = cross3(v2, v3);
    let x13 = cross3(v1, v3);
    let even = sum(x12, x23);
    let odd = minus(x12, x23);
    let n1 = dot3(v1, v1);
    let n2 = dot3(v2, v2);
    let n3 = dot3(v3, v3);
    let d12 = dot3(v1, v2);
    let d13 = dot3(v1, v3);
    let d23 = dot3(v2, v3);
    let outward = n1 + n3;
    let difference = n1 - n3;
    let volume = dot3(v1, x23);

    // The terms of third order in the coefficients of odd powers, and in those of even powers.
    macro_rules! odd_power {
        ($b111:ident, $b122:ident, $b133:ident, $b123:ident, $b211:ident, $b222:ident) => {{
            let by_first = n1 * $b111 + n2 * $b122 + n3 * $b133 - d23 * $b123;
            let by_third = n3 * $b111 + n2 * $b122 + n1 * $b133 - d12 * $b123;
            let by_second = outward * $b211 + n2 * $b222 + d13 * $b123;
            let ends = sum(scaled(v1, by_first), scaled(v3, by_third));
            sum(ends, scaled(v2, by_second))
        }};
    }
    macro_rules! even_power {
        ($b111:ident, $b122:ident, $b133:ident, $b211:ident) => {{
            let by_first = n1 * $b111 + n2 * $b122 + n3 * $b133;
            let by_third = n3 * $b111 + n2 * $b122 + n1 * $b133;
            let ends = minus(scaled(v1, by_first), scaled(v3, by_third));
            sum(ends, scaled(v2, difference * $b211))
        }};
    }
    let f1 = odd_power!(B_111_1, B_122_1, B_133_1, B_123_1, B_211_1, B_222_1);
    let f2 = even_power!(B_111_2, B_122_2, B_133_2, B_211_2);
    let f3 = odd_power!(B_111_3, B_122_3, B_133_3, B_123_3, B_211_3, B_222_3);
    let f4 = even_power!(B_111_4, B_122_4, B_133_4, B_211_4);
    let f5 = odd_power!(B_111_5, B_122_5, B_133_5, B_123_5, B_211_5, B_222_5);
    let f6 = even_power!(B_111_6, B_122_6, B_133_6, B_211_6);

    let second = sum(sum(scaled(even, 1.125), scaled(x13, 0.5625)), f2);
    let fourth = sum(scaled(x13, -0.75), f4);
    let sixth = sum(minus(x13, sum(even, even)), f6);
    SmallAngleCubic {
        powers: [
            canonical(m),
            canonical_product(m, sum(a, f1), -(volume * B_123_1)),
            canonical_product(m, sum(b, second), dot3(a, a) * -0.5),
            canonical_product(
                m,
                sum(c, sum(scaled(odd, -2.25), f3)),
                -dot3(a, b) - volume * B_123_3,
            ),
            canonical_product(m, fourth, dot3(b, b) * -0.5 - dot3(a, c)),
            canonical_product(m, sum(scaled(odd, 3.0), f5), -dot3(b, c) - volume * B_123_5),
            canonical_product(m, sixth, dot3(c, c) * -0.5),
        ],
        is_valid,
    }
}
