//! Twin of `shaders/gentle.wgsl`: the same names, the same order.

use super::evaluate::canonical;
use super::evaluate_arc::square;
use crate::branchless::{Arithmetic, scaled, sum};
use crate::segment::Joint;
use crate::segment::shader::{
    B_111_1, B_111_2, B_111_3, B_111_4, B_111_5, B_111_6, B_122_1, B_122_2, B_122_3, B_122_4,
    B_122_5, B_122_6, B_123_1, B_123_3, B_123_5, B_133_1, B_133_2, B_133_3, B_133_4, B_133_5,
    B_133_6, B_211_1, B_211_2, B_211_3, B_211_4, B_211_5, B_211_6, B_222_1, B_222_3, B_222_5, END,
    FALL_1, FALL_2, GENTLE, LOG_1, LOG_2, LOG_3, LOG_4, LONGEST_PART, LONGEST_STEP, OUTSIDE,
    SINC_1, SINC_2, THIRD, TWO_THIRDS,
};

type Vector = [f32; 3];
type Quaternion = [f32; 4];

/// A rotation as what it is more than none.
#[derive(Clone, Copy)]
pub(crate) struct Turn<N> {
    pub(crate) vector: [N; 3],
    /// The cosine - 1.
    pub(crate) fall: N,
}

/// A cubic that turns little.
pub(crate) struct Gentle {
    /// The coefficients of 1, s, s², … s⁶.
    pub(crate) powers: [Quaternion; 7],
    /// Whether they are those of the curve.
    pub(crate) holds: bool,
}

#[inline(always)]
pub(crate) fn minus<N: Arithmetic>(a: [N; 3], b: [N; 3]) -> [N; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn across<N: Arithmetic>(a: [N; 3], b: [N; 3]) -> [N; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub(crate) fn along<N: Arithmetic>(a: [N; 3], b: [N; 3]) -> N {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
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

#[inline(always)]
fn short_log(v: Vector) -> Vector {
    let x = along(v, v);
    let tail = ((LOG_4 * x + LOG_3) * x + LOG_2) * x + LOG_1;
    sum(scaled(v, tail * x), v)
}

#[inline(always)]
fn short_exp(v: Vector) -> Turn<f32> {
    let x = along(v, v);
    let sinc = (SINC_2 * x + SINC_1) * x;
    Turn {
        vector: sum(scaled(v, sinc), v),
        fall: (FALL_2 * x + FALL_1) * x,
    }
}

#[inline(always)]
pub(crate) fn both<N: Arithmetic>(a: Turn<N>, b: Turn<N>) -> Turn<N> {
    let apart = sum(a.vector, b.vector);
    let shortened = sum(scaled(a.vector, b.fall), scaled(b.vector, a.fall));
    Turn {
        vector: sum(sum(apart, shortened), across(a.vector, b.vector)),
        fall: (a.fall + b.fall) + a.fall * b.fall - along(a.vector, b.vector),
    }
}

#[inline(always)]
pub(crate) fn brought_behind<N: Arithmetic>(v: [N; 3], r: Turn<N>) -> [N; 3] {
    let once = across(r.vector, v);
    let twice = sum(once, once);
    let back = sum(scaled(twice, r.fall), twice);
    sum(minus(v, back), across(r.vector, twice))
}

#[inline(always)]
fn carried(m: Quaternion, v: Vector, w: f32) -> Quaternion {
    [
        canonical(m[3] * v[0] + m[0] * w + m[1] * v[2] - m[2] * v[1]),
        canonical(m[3] * v[1] - m[0] * v[2] + m[1] * w + m[2] * v[0]),
        canonical(m[3] * v[2] + m[0] * v[1] - m[1] * v[0] + m[2] * w),
        canonical(m[3] * w - m[0] * v[0] - m[1] * v[1] - m[2] * v[2]),
    ]
}

/// A key in the sign that those before it give.
#[inline(always)]
pub(crate) fn signed([x, y, z, w]: Quaternion, sign: f32) -> Quaternion {
    [x * sign, y * sign, z * sign, w * sign]
}

/// Between `start` and `end`, four keys each in the sign nearer to its predecessor's.
#[inline(always)]
pub(crate) fn gentle(keys: [Quaternion; 4], first: Joint, last: Joint) -> Gentle {
    let [before, start, end, after] = keys;
    let chord_before = chord_of(before, start);
    let chord = chord_of(start, end);
    let chord_after = chord_of(end, after);
    let step = step_vector(start, chord);
    let log_before = short_log(step_vector(before, chord_before));
    let log = short_log(step);
    let log_after = short_log(step_vector(end, chord_after));

    let first_left = scaled(log_before, first.before);
    let first_right = scaled(log, first.after);
    let last_left = scaled(log, last.before);
    let last_right = scaled(log_after, last.after);
    let first_tangent = short_log(both(short_exp(first_left), short_exp(first_right)).vector);
    let last_tangent = short_log(both(short_exp(last_left), short_exp(last_right)).vector);
    let outgoing = scaled(first_tangent, first.outgoing);
    let incoming = scaled(last_tangent, THIRD - last.outgoing);
    let parabola = scaled(log, TWO_THIRDS);
    let [from_end, from_start] = [minus(parabola, incoming), minus(parabola, outgoing)];
    let w1 = if first.kind == END {
        from_end
    } else {
        outgoing
    };
    let w3 = if last.kind == END {
        from_start
    } else {
        incoming
    };
    let whole = Turn {
        vector: step,
        fall: square(chord) * -0.5,
    };
    let without_first = both(short_exp([-w1[0], -w1[1], -w1[2]]), whole);
    let back = short_exp([-w3[0], -w3[1], -w3[2]]);
    let w2 = short_log(both(without_first, back).vector);

    let energy = along(w1, w1) + along(w2, w2) + along(w3, w3);
    let holds = (energy <= GENTLE)
        & (square(chord_before) <= LONGEST_STEP)
        & (square(chord) <= LONGEST_STEP)
        & (square(chord_after) <= LONGEST_STEP)
        & (along(first_left, first_left) <= LONGEST_PART)
        & (along(first_right, first_right) <= LONGEST_PART)
        & (along(last_left, last_left) <= LONGEST_PART)
        & (along(last_right, last_right) <= LONGEST_PART)
        & (first.kind != OUTSIDE)
        & (last.kind != OUTSIDE);

    let third_turn = short_exp(scaled(w3, 0.125));
    let second_turn = both(short_exp(scaled(w2, 0.5)), third_turn);
    let turn = both(short_exp(scaled(w1, 0.875)), second_turn);
    let gain = carried(start, turn.vector, turn.fall);
    let m = [
        gain[0] + start[0],
        gain[1] + start[1],
        gain[2] + start[2],
        gain[3] + start[3],
    ];
    let v1 = brought_behind(w1, second_turn);
    let v2 = brought_behind(w2, third_turn);
    let v3 = w3;

    let outer = sum(v1, v3);
    let a = sum(scaled(outer, 0.75), scaled(v2, 1.5));
    let b = scaled(minus(v3, v1), 1.5);
    let c = minus(outer, sum(v2, v2));
    let x12 = across(v1, v2);
    let x23 = across(v2, v3);
    let x13 = across(v1, v3);
    let even = sum(x12, x23);
    let odd = minus(x12, x23);
    let n1 = along(v1, v1);
    let n2 = along(v2, v2);
    let n3 = along(v3, v3);
    let d12 = along(v1, v2);
    let d13 = along(v1, v3);
    let d23 = along(v2, v3);
    let outward = n1 + n3;
    let difference = n1 - n3;
    let volume = along(v1, x23);

    // Odd powers, and even ones.
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
    Gentle {
        powers: [
            [
                canonical(m[0]),
                canonical(m[1]),
                canonical(m[2]),
                canonical(m[3]),
            ],
            carried(m, sum(a, f1), -(volume * B_123_1)),
            carried(m, sum(b, second), along(a, a) * -0.5),
            carried(
                m,
                sum(c, sum(scaled(odd, -2.25), f3)),
                -along(a, b) - volume * B_123_3,
            ),
            carried(m, fourth, along(b, b) * -0.5 - along(a, c)),
            carried(
                m,
                sum(scaled(odd, 3.0), f5),
                -along(b, c) - volume * B_123_5,
            ),
            carried(m, sixth, along(c, c) * -0.5),
        ],
        holds,
    }
}
