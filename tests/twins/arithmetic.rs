//! The shaders' functions as they are written for the CPU, for lanes or by hand, beside the kernels' own, on hostile
//! arguments.

use crate::fit::constant_velocity::arc_component;
use crate::gpu::kernel_check::random::Random;
use crate::math::quaternion::{cross3, dot, dot3, product};
use crate::output::encoding::Encoding;
use crate::output::euler::EulerSequence;
use crate::shader::{
    CrowdEntry, Kernel, ROTATION, SCALE, SPEED_MAGNITUDE, START_BIAS, TRANSLATION,
};
use crate::twin::Evaluate as _;
use crate::twin::entries::{self, Global};
use crate::twin::machine::{Invocation, Memory, Stored};
use crate::twin::{crowd_matrices, crowd_times, functions, pose_steps, quaternion};

/// Arguments that a function is tried with.
const SAMPLES: usize = 20_000;

type One<'a> = Invocation<'a, f32, ()>;

/// The bits of a value; IEEE 754 leaves those of a NaN to the processor.
fn bits<T: Stored>(value: T) -> Vec<u32> {
    let mut words = vec![0; T::WORDS];
    value.put(&mut words);
    for word in &mut words {
        if f32::from_bits(*word).is_nan() {
            *word = f32::NAN.to_bits();
        }
    }
    words
}

/// Compares a function of the kernels with one of the CPU.
fn same<A: Copy + std::fmt::Debug, R: Stored>(
    name: &str,
    mut arguments: impl FnMut(&mut Random) -> A,
    of_kernels: impl Fn(&One<'_>, A) -> R,
    of_cpu: impl Fn(A) -> R,
) {
    let memory = Memory::new(Kernel::SelfTest, [&[][..]].into_iter(), &[], Vec::new());
    let (machine, mut random) = (memory.invocation(), Random::new());
    for _ in 0..SAMPLES {
        let tried = arguments(&mut random);
        let (expected, found) = (bits(of_kernels(&machine, tried)), bits(of_cpu(tried)));
        assert_eq!(found, expected, "{name} of {tried:?}");
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

fn two(random: &mut Random) -> ([f32; 4], [f32; 4]) {
    (random.vector(), random.vector())
}

#[test]
fn numbers_and_rotations() {
    let (quaternion, three) = (Random::vector::<4>, Random::vector::<3>);
    let numbers = |random: &mut Random| (angle(random), random.positive());
    same(
        "canonical",
        quaternion,
        |on, x| entries::canonical(on, x),
        |q| q.map(functions::canonical),
    );
    same(
        "flushed",
        Random::finite,
        |on, x| entries::flushed(on, x),
        |x| functions::flushed(x),
    );
    same(
        "flushed4",
        quaternion,
        |on, x| entries::flushed4(on, x),
        |q| functions::flushed4(q),
    );
    same(
        "magnitude",
        Random::finite,
        |on, x| entries::magnitude(on, x),
        |x| functions::magnitude(x),
    );
    same(
        "reciprocal",
        Random::positive,
        |on, x| entries::reciprocal(on, x),
        |x| functions::reciprocal(x),
    );
    let inverse = |x| functions::reciprocal_root(x);
    same(
        "reciprocal_root",
        Random::positive,
        |on, x| entries::reciprocal_root(on, x),
        inverse,
    );
    let root = |x| crate::twin::arc_tangent::root(x);
    same("root", Random::positive, |on, x| entries::root(on, x), root);
    same(
        "arc_tangent",
        |random| (random.finite(), random.finite()),
        |on, (y, x)| entries::arc_tangent(on, y, x),
        |(y, x)| crate::twin::arc_tangent::arc_tangent(y, x),
    );
    same(
        "sine_cosine",
        angle,
        |on, x| entries::sine_cosine(on, x),
        |x| functions::sine_cosine(x).into(),
    );
    same(
        "sine_cosm1",
        numbers,
        |on, (x, z)| entries::sine_cosm1(on, x, z),
        |(x, z)| functions::sine_cosm1(x, z).into(),
    );
    same(
        "sine_cosm1_quarter",
        numbers,
        |on, (x, z)| entries::sine_cosm1_quarter(on, x, z),
        |(x, z)| functions::sine_cosm1_quarter(x, z).into(),
    );
    same(
        "product",
        two,
        |on, (a, b)| entries::product(on, a, b),
        |(a, b)| product(a, b),
    );
    same(
        "dot4",
        two,
        |on, (a, b)| entries::dot4(on, a, b),
        |(a, b)| dot(a, b),
    );
    same(
        "norm_squared",
        quaternion,
        |on, x| entries::norm_squared(on, x),
        functions::norm_squared,
    );
    same(
        "normalised",
        quaternion,
        |on, x| entries::normalised(on, x),
        functions::normalised,
    );
    same(
        "rotated",
        |random| (quaternion(random), three(random)),
        |on, (q, v)| entries::rotated(on, q, v),
        |(q, v)| functions::rotated(q, v),
    );
    same(
        "slerp",
        |random| (random.pair(), random.number()),
        |on, ([a, b], t)| entries::slerp(on, a, b, t),
        |([a, b], t)| quaternion::slerp(a, b, t),
    );
    let ends = |random: &mut Random| {
        let inner = random.number();
        let t = [0.0, 1.0, inner, inner][random.below(4) as usize];
        (random.pair(), t)
    };
    same(
        "over",
        ends,
        |on, ([a, b], t)| entries::over(on, a, b, t),
        |([a, b], t)| functions::over(a, b, t),
    );
    same(
        "rotation_step",
        |random| random.pair(),
        |on, [a, b]| entries::rotation_step(on, a, b),
        |[a, b]| pose_steps::rotation_step(a, b),
    );
    same(
        "rotated_by",
        |random| {
            let long = if random.once_in(4) { 2.0 } else { 0.8 };
            let mut step = random.vector::<4>().map(|c| long * c);
            step[3] = 0.0;
            (random.rotation(), step)
        },
        |on, (q, v)| entries::rotated_by(on, q, v),
        |(q, v)| functions::rotated_by(q, v),
    );
}

/// The coefficients of a curve, and whether it is one.
fn valid(powers: [[f32; 4]; 7], is_valid: bool) -> [[f32; 4]; 8] {
    std::array::from_fn(|i| match powers.get(i) {
        Some(power) => *power,
        None => [f32::from(u8::from(is_valid)); 4],
    })
}

#[test]
fn curves() {
    same(
        "evaluate of an arc",
        |random| (two(random), random.parameter()),
        |on, ((middle, tangent), s)| {
            entries::evaluate_arc_segment(on, entries::ArcSegment { middle, tangent }, s)
        },
        |((middle, tangent), s)| {
            crate::shader::ArcSegment { middle, tangent }
                .at(s)
                .to_array()
        },
    );
    same(
        "evaluate of a polynomial",
        |random| ([(); 11].map(|()| random.vector::<4>()), random.parameter()),
        |on, (coefficients, s)| {
            let segment = entries::PolynomialSegment { coefficients };
            entries::evaluate_polynomial_segment(on, segment, s)
        },
        |(coefficients, s)| {
            crate::shader::PolynomialSegment { coefficients }
                .at(s)
                .to_array()
        },
    );
    same(
        "distance_from_middle",
        |random| {
            let bits = random.below(32);
            ((random.word() as i32) >> bits, random.below(16))
        },
        |on, (first, j)| entries::distance_from_middle_of_frame_distance(on, first, j),
        |(first, j)| first.wrapping_add(j as i32) as f32,
    );
    same(
        "arc_between",
        |random| random.pair(),
        |on, [a, b]| {
            let arc = entries::arc_between(on, a, b);
            [arc.middle, arc.tangent]
        },
        |[a, b]| <[_; 2]>::from(functions::arc_between(a, b)),
    );
    same(
        "constant_velocity",
        two,
        |on, (middle, tangent)| {
            entries::constant_velocity(on, entries::ArcSegment { middle, tangent })
        },
        |(middle, tangent)| {
            let square = functions::norm_squared(tangent);
            let each = [0, 1, 2, 3].map(|c| arc_component(middle[c], tangent[c], square));
            std::array::from_fn(|power| each.map(|powers| powers[power]))
        },
    );
    let three = Random::vector::<3>;
    let pair = move |random: &mut Random| (three(random), three(random));
    same(
        "cross3",
        pair,
        |on, (a, b)| entries::cross3(on, a, b),
        |(a, b)| cross3(a, b),
    );
    same(
        "dot3",
        pair,
        |on, (a, b)| entries::dot3(on, a, b),
        |(a, b)| dot3(a, b),
    );
    same(
        "small_angle_cubic",
        |random| {
            let keys = match random.once_in(8) {
                true => [(); 4].map(|()| random.vector()),
                false => random.four_keys(),
            };
            (keys, [random.weights(), random.weights()])
        },
        |on, (keys, weights)| {
            let [before, start, end, after] = keys;
            let [first, last] = weights.map(|w| entries::TangentWeights {
                before: w.before,
                after: w.after,
                outgoing: w.outgoing,
                kind: w.kind,
            });
            let curve = entries::small_angle_cubic(on, before, start, end, after, first, last);
            valid(curve.powers, curve.is_valid)
        },
        |([before, start, end, after], [first, last])| {
            let curve = functions::small_angle_cubic(before, start, end, after, first, last);
            valid(curve.powers, curve.is_valid)
        },
    );
}

#[test]
fn what_is_stored() {
    same(
        "to_half",
        |r| r.vector::<4>(),
        |on, x| entries::to_half(on, x),
        |q| q.map(functions::to_half),
    );
    let large = |random: &mut Random| {
        [(); 4].map(|()| match random.once_in(4) {
            true => 65_520.0 + 100.0 * random.number(),
            false => random.finite(),
        })
    };
    same(
        "to_any_half",
        large,
        |on, x| entries::to_any_half(on, x),
        |q| q.map(|c| crowd_matrices::to_any_half(c).into()),
    );
    same(
        "to_snorm",
        Random::rotation,
        |on, x| entries::to_snorm(on, x),
        |q| q.map(functions::to_snorm),
    );
    same(
        "axis_angle",
        Random::rotation,
        |on, x| entries::axis_angle(on, x),
        |q| functions::axis_angle(q),
    );
    let angles = |random: &mut Random| match random.once_in(2) {
        true => random.finite(),
        false => 4.0 * angle(random),
    };
    same(
        "wrapped",
        angles,
        |on, x| entries::wrapped(on, x),
        functions::wrapped,
    );
    let sequences = EulerSequence::all();
    same(
        "euler",
        |random| {
            let sequence = sequences[random.below(sequences.len() as u32) as usize];
            (random.rotation(), Encoding::Euler(sequence).row().detail)
        },
        |on, (q, detail)| entries::euler(on, q, detail),
        |(q, detail)| functions::euler(q, detail),
    );
    same(
        "matrix_rows",
        |random| (random.rotation(), random.below(2)),
        |on, (q, detail)| {
            let rows = entries::matrix_rows(on, q, detail);
            [rows.first, rows.second, rows.third]
        },
        |(q, detail)| {
            let rows = functions::matrix_rows(q, detail);
            [rows.first, rows.second, rows.third]
        },
    );
    same(
        "transform_row",
        |random| (random.vector(), random.vector(), random.finite()),
        |on, (axis, scale, moved)| entries::transform_row(on, axis, scale, moved),
        |(axis, scale, moved)| crowd_matrices::transform_row(axis, scale, moved),
    );
    same(
        "row_product",
        |random| [(); 4].map(|()| random.vector()),
        |on, [row, a, b, c]| entries::row_product(on, row, a, b, c),
        |[row, a, b, c]| crowd_matrices::row_product(row, &[a, b, c]),
    );
}

#[test]
fn layers() {
    same(
        "cubic",
        |random| ([(); 4].map(|()| random.vector::<4>()), random.parameter()),
        |on, ([a, b, c, d], s)| entries::cubic(on, a, b, c, d, s),
        |(c, s)| [0, 1, 2, 3].map(|i| functions::cubic(c[0][i], c[1][i], c[2][i], c[3][i], s)),
    );
    same(
        "laid_over",
        |random| {
            let kind = [ROTATION, TRANSLATION, SCALE][random.below(3) as usize];
            let rotations = [(); 3].map(|()| random.rotation());
            (kind, random.once_in(2), rotations, random.number())
        },
        |on, (kind, is_additive, [below, layer, reference], weight)| {
            entries::laid_over(on, kind, is_additive, below, layer, reference, weight)
        },
        |(kind, is_additive, [below, layer, reference], weight)| {
            functions::laid_over(kind, is_additive, below, layer, reference, weight)
        },
    );
}

/// A number below 2^`bits`, of any magnitude.
fn whole(random: &mut Random, bits: u32) -> u64 {
    let word = u64::from(random.word()) << 32 | u64::from(random.word());
    let length = random.below(bits + 1);
    word.checked_shr(64 - length).unwrap_or(0)
}

fn words(value: u64) -> [u32; 2] {
    [value as u32, (value >> 32) as u32]
}

#[test]
fn times_in_two_words_are_those_in_64_bits() {
    let pair = |random: &mut Random| {
        let (a, mut b) = (whole(random, 64), whole(random, 64));
        if random.once_in(4) {
            b = a & 0xffff_ffff | b << 32; // the same lower word
        }
        if random.once_in(4) {
            b = a >> 32 << 32 | b & 0xffff_ffff;
        }
        (a, b)
    };
    same(
        "wide_less",
        pair,
        |on, (a, b)| u32::from(entries::wide_less(on, words(a), words(b))),
        |(a, b)| u32::from(a < b),
    );
    same(
        "wide_sum",
        pair,
        |on, (a, b)| entries::wide_sum(on, words(a), words(b)),
        |(a, b)| words(a.wrapping_add(b)),
    );
    same(
        "wide_difference",
        pair,
        |on, (a, b)| entries::wide_difference(on, words(a), words(b)),
        |(a, b)| words(a.wrapping_sub(b)),
    );
    same(
        "wide_product",
        |random| (whole(random, 32), whole(random, 32)),
        |on, (a, b)| entries::wide_product(on, a as u32, b as u32),
        |(a, b)| words(a * b),
    );
    same(
        "wide_remainder",
        |random| (whole(random, 63), 1 + whole(random, 62)),
        |on, (x, q)| entries::wide_remainder(on, words(x), words(q)),
        |(x, q)| words(crowd_times::wide_remainder(x, q)),
    );
    same(
        "in_parts",
        Random::word,
        |on, x| entries::in_parts(on, x),
        |ticks| words(crowd_times::in_parts(ticks)),
    );
}

/// The tick of a clip depends on the clock, which comes with the dispatch.
#[test]
fn ticks_of_clips() {
    let mut random = Random::new();
    for _ in 0..SAMPLES {
        let period = 1 + whole(&mut random, 30) as u32;
        let clock = whole(&mut random, 64);
        let wrap = random.below(3);
        let within = whole(&mut random, 32) % (u64::from(period) * u64::from(wrap.max(1)) + 1);
        let entry = CrowdEntry {
            clip_and_weight: random.word(),
            speed_and_modes: whole(&mut random, 23) as u32 & SPEED_MAGNITUDE
                | random.word() & !(SPEED_MAGNITUDE | 3 << 29)
                | wrap << 29,
            start: START_BIAS + within as u32,
            anchor: (clock.wrapping_sub(whole(&mut random, 40)) >> 8) as u32,
        };
        let dispatch = crate::shader::CrowdDispatch {
            clock_low: clock as u32,
            clock_high: (clock >> 32) as u32,
            ..bytemuck::Zeroable::zeroed()
        };
        let inputs = [&[][..]; 4];
        let arguments = bytemuck::bytes_of(&dispatch);
        let memory = Memory::new(Kernel::CrowdTimes, inputs.into_iter(), arguments, vec![]);
        let of_kernels = entries::CrowdEntry {
            clip_and_weight: entry.clip_and_weight,
            speed_and_modes: entry.speed_and_modes,
            start: entry.start,
            anchor: entry.anchor,
        };
        assert!(!memory.is_buffer(Global::Dispatch));
        let expected = entries::tick_of(&memory.invocation(), of_kernels, period);
        let found = crowd_times::tick_of(&entry, period, clock);
        assert_eq!(found, expected, "{entry:?}, {period}, {clock}");
    }
}
