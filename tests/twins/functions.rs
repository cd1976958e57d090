//! The functions of the shaders that compute, each beside its twin.

use crate::fit::constant_velocity::arc_component;
use crate::math::quaternion::{cross3, dot, dot3, product};
use crate::shader::{ArcSegment, PolynomialSegment, TangentWeights};
use crate::simd::lanes::canonical;
use crate::twin::Evaluate as _;
use crate::twin::arc_between::arc_between;
use crate::twin::arc_tangent::{arc_tangent, flushed, reciprocal_root, root};
use crate::twin::axis_angle::axis_angle;
use crate::twin::euler::euler;
use crate::twin::evaluate_arc::norm_squared;
use crate::twin::evaluate_polynomial::polynomial;
use crate::twin::f16::to_half;
use crate::twin::functions::{
    canonical_product, magnitude, reciprocal, small_exp, small_log, wrapped,
};
use crate::twin::matrix::{MatrixRows, matrix_rows};
use crate::twin::quaternion::{normalised, over, rotated, slerp};
use crate::twin::sine_cosine::{sine_cosine, sine_cosm1, sine_cosm1_quarter};
use crate::twin::small_angle::{
    FromIdentity, composed, inverse_rotated, small_angle_cubic, step_vector,
};
use crate::twin::snorm16::to_snorm;

use super::cells::Cells;
use super::stores::euler_detail;
use super::trial::{Twin, twin};
use crate::gpu::kernel_check::random::Random;

const ARCS: &str = "from_keys_arcs";
const CUBICS: &str = "from_keys_cubics";
const POSES: &str = "poses_mix";

impl Cells for FromIdentity<f32> {
    fn put(&self, cells: &mut Vec<u64>) {
        (self.vector, self.cosm1).put(cells);
    }
}

impl Cells for TangentWeights {
    fn put(&self, cells: &mut Vec<u64>) {
        [self.before, self.after, self.outgoing, self.kind].put(cells);
    }
}

/// An angle, or a number that is none.
fn angle(random: &mut Random) -> f32 {
    let number = random.finite();
    if number.abs() <= 1.0 {
        number * 1.6
    } else {
        number
    }
}

/// A rotation that differs little from the identity, or anything of that shape.
fn from_identity(random: &mut Random) -> FromIdentity<f32> {
    FromIdentity {
        vector: random.vector(),
        cosm1: random.number(),
    }
}

pub(super) fn math() -> Vec<Twin> {
    let quaternion = Random::vector::<4>;
    let two = move |random: &mut Random| (quaternion(random), quaternion(random));
    vec![
        twin(POSES, "canonical", quaternion, canonical),
        twin(POSES, "flushed", Random::finite, flushed),
        twin(POSES, "flushed4", quaternion, |q| q.map(flushed)),
        twin(POSES, "magnitude", Random::finite, magnitude),
        twin(POSES, "reciprocal", Random::positive, reciprocal),
        twin(POSES, "reciprocal_root", Random::positive, reciprocal_root),
        twin(POSES, "root", Random::positive, root),
        twin(
            POSES,
            "arc_tangent",
            |random| (random.finite(), random.finite()),
            |(y, x)| arc_tangent(y, x),
        ),
        twin(POSES, "sine_cosine", angle, sine_cosine),
        twin(
            POSES,
            "sine_cosm1",
            |random| (angle(random), random.positive()),
            |(x, z)| sine_cosm1(x, z),
        ),
        twin(
            POSES,
            "sine_cosm1_quarter",
            |random| (angle(random), random.positive()),
            |(x, z)| sine_cosm1_quarter(x, z),
        ),
        twin(POSES, "product", two, |(a, b)| product(a, b)),
        twin(POSES, "dot4", two, |(a, b)| dot(a, b)),
        twin(
            POSES,
            "rotated",
            |random| (random.vector(), random.vector()),
            |(q, v)| rotated(q, v),
        ),
        twin(POSES, "normalised", quaternion, normalised),
        twin(
            POSES,
            "slerp",
            |random| (random.pair(), random.number()),
            |([a, b], t)| slerp(a, b, t),
        ),
        twin(
            POSES,
            "over",
            |random| {
                let inner = random.number();
                let t = [0.0, 1.0, inner, inner][random.below(4) as usize];
                (random.pair(), t)
            },
            |([a, b], t)| over(a, b, t),
        ),
        twin(
            "polynomial_frames_f32",
            "polynomial",
            |random| (random.vector::<44>(), random.parameter()),
            |(c, s)| {
                let (powers, _) = c.as_chunks::<4>();
                let component = |i: usize| std::array::from_fn(|power| powers[power][i]);
                [0, 1, 2, 3].map(|i| polynomial(component(i), s))
            },
        ),
    ]
}

pub(super) fn forms() -> Vec<Twin> {
    vec![
        twin(
            "arc_frames_f32",
            "evaluate",
            |random| (random.vector(), random.vector(), random.parameter()),
            |(middle, tangent, s)| ArcSegment { middle, tangent }.at(s).to_array(),
        ),
        twin(
            "polynomial_frames_f32",
            "evaluate",
            |random| (random.vector::<44>(), random.parameter()),
            |(c, s)| {
                let coefficients = bytemuck::cast(c);
                PolynomialSegment { coefficients }.at(s).to_array()
            },
        ),
        twin(
            "arc_frames_f32",
            "norm_squared",
            Random::vector::<4>,
            norm_squared,
        ),
        twin(
            "arc_frames_f32",
            "distance_from_middle",
            |random| {
                let bits = random.below(32);
                ((random.word() as i32) >> bits, random.below(16))
            },
            |(first, j)| first.wrapping_add(j as i32) as f32,
        ),
    ]
}

pub(super) fn from_keys() -> Vec<Twin> {
    let three = Random::vector::<3>;
    let two = move |random: &mut Random| (three(random), three(random));
    vec![
        twin(ARCS, "arc_between", Random::pair, |[a, b]| {
            arc_between(a, b)
        }),
        twin(
            "from_keys_two_keys",
            "constant_velocity",
            |random| (random.vector::<4>(), random.vector::<4>()),
            |(middle, tangent)| {
                let each: [[f32; 11]; 4] = std::array::from_fn(|c| {
                    arc_component(middle[c], tangent[c], norm_squared(tangent))
                });
                std::array::from_fn::<_, 11, _>(|power| each.map(|powers| powers[power]))
            },
        ),
        twin(CUBICS, "cross3", two, |(a, b)| cross3(a, b)),
        twin(CUBICS, "dot3", two, |(a, b)| dot3(a, b)),
        twin(
            CUBICS,
            "step_vector",
            |random| (random.vector(), random.vector()),
            |(a, chord)| step_vector(a, chord),
        ),
        twin(CUBICS, "small_log", three, small_log),
        twin(CUBICS, "small_exp", three, small_exp),
        twin(
            CUBICS,
            "composed",
            |random| (from_identity(random), from_identity(random)),
            |(a, b)| composed(a, b),
        ),
        twin(
            CUBICS,
            "inverse_rotated",
            |random| (random.vector(), from_identity(random)),
            |(v, r)| inverse_rotated(v, r),
        ),
        twin(
            CUBICS,
            "canonical_product",
            |random| (random.vector(), random.vector(), random.number()),
            |(m, v, w)| canonical_product(m, v, w),
        ),
        twin(
            CUBICS,
            "small_angle_cubic",
            |random| {
                let keys: [[f32; 4]; 4] = match random.once_in(8) {
                    true => std::array::from_fn(|_| random.vector()),
                    false => random.four_keys(),
                };
                (keys, random.weights(), random.weights())
            },
            |([before, start, end, after], first, last)| {
                let curve = small_angle_cubic(before, start, end, after, first, last);
                (curve.powers, curve.is_valid)
            },
        ),
    ]
}

pub(super) fn conversions() -> Vec<Twin> {
    vec![
        twin(
            "arc_frames_f16",
            "to_half",
            |random| {
                random
                    .vector::<4>()
                    .map(|c| if c.abs() < 2.0 { c } else { 1.0 })
            },
            |q| q.map(to_half),
        ),
        twin(
            "arc_frames_snorm16",
            "to_snorm",
            |random| {
                random
                    .vector::<4>()
                    .map(|c| if c.abs() < 2.0 { c } else { 1.0 })
            },
            |q| q.map(to_snorm),
        ),
        twin(
            "arc_frames_axis_angle",
            "axis_angle",
            Random::rotation,
            axis_angle,
        ),
        twin(
            "arc_frames_euler",
            "wrapped",
            |random| match random.once_in(2) {
                true => random.finite(),
                false => 4.0 * angle(random),
            },
            wrapped,
        ),
        twin(
            "arc_frames_euler",
            "euler",
            |random| (random.rotation(), euler_detail(random)),
            |(q, detail)| euler(q, detail),
        ),
        twin(
            "arc_frames_matrix3x3",
            "matrix_rows",
            |random| (random.rotation(), random.below(2)),
            |(q, detail)| {
                let MatrixRows {
                    first,
                    second,
                    third,
                } = matrix_rows(q, detail);
                [first, second, third]
            },
        ),
        twin(
            "arc_frames_f32_texels",
            "wide",
            Random::rotation,
            bytemuck::cast::<[f32; 4], [u64; 2]>,
        ),
    ]
}
