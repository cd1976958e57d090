//! Compares the functions of the shaders as the CPU has them (generated for lanes, or written by hand) with those in
//! the kernels, on hostile arguments.

use std::fmt::Debug;

use crate::crowd::clip_keys::unpacked;
use crate::fit::constant_velocity::arc_component;
use crate::gpu::kernel_check::random::Random;
use crate::math::quaternion::{cross3, dot, dot3, product};
use crate::output::encoding::Encoding;
use crate::output::euler::EulerSequence;
use crate::shader::{
    ArcSegment, CrowdDispatch, CrowdEntry, Kernel, PolynomialSegment, ROTATION, SCALE,
    SPEED_MAGNITUDE, START_BIAS, TRANSLATION, TangentWeights,
};
use crate::twin::Evaluate as _;
use crate::twin::arc_tangent::{arc_tangent, root};
use crate::twin::crowd_compact::line_between;
use crate::twin::entries;
use crate::twin::functions::FromIdentity;
use crate::twin::functions::slerp;
use crate::twin::machine::{Invocation, Memory, Stored};
use crate::twin::{crowd_matrices, crowd_times, functions as cpu, pose_steps};

use super::lines::Lane;
use super::numbers::Number;

/// Arguments that a function is tried with.
const SAMPLES: usize = 20_000;

type Machine<'a> = Invocation<'a, Number, Lane>;

/// An argument, as kernels have it.
trait Argument: Copy + Debug + 'static {
    type OfKernels: 'static;

    fn of_kernels(self) -> Self::OfKernels;
}

macro_rules! arguments {
    ($($ty:ty as $of_kernels:ty: |$value:ident| $converted:expr;)+) => {$(
        impl Argument for $ty {
            type OfKernels = $of_kernels;

            fn of_kernels(self) -> $of_kernels {
                let $value = self;
                $converted
            }
        }
    )+};
}
arguments! {
    u32 as u32: |value| value;
    u64 as [u32; 2]: |value| words(value);
    i32 as i32: |value| value;
    bool as bool: |value| value;
    f32 as Number: |value| Number(value);
    TangentWeights as entries::TangentWeights<Number>: |w| entries::TangentWeights {
        before: Number(w.before),
        after: Number(w.after),
        outgoing: Number(w.outgoing),
        kind: Number(w.kind),
    };
    FromIdentity<f32> as entries::FromIdentity<Number>: |r| entries::FromIdentity {
        vector: r.vector.map(Number),
        cosm1: Number(r.cosm1),
    };
    CrowdEntry as entries::CrowdEntry: |entry| entries::CrowdEntry {
        clip_and_weight: entry.clip_and_weight,
        speed_and_modes: entry.speed_and_modes,
        start: entry.start,
        anchor: entry.anchor,
    };
}
impl<T: Argument, const N: usize> Argument for [T; N] {
    type OfKernels = [T::OfKernels; N];

    fn of_kernels(self) -> Self::OfKernels {
        self.map(T::of_kernels)
    }
}
macro_rules! arguments_together {
    ($($name:ident)+) => {
        impl<$($name: Argument),+> Argument for ($($name,)+) {
            type OfKernels = ($($name::OfKernels,)+);

            #[expect(non_snake_case, reason = "a variable is called like its type")]
            fn of_kernels(self) -> Self::OfKernels {
                let ($($name,)+) = self;
                ($($name.of_kernels(),)+)
            }
        }
    };
}
arguments_together!(A B);
arguments_together!(A B C);
arguments_together!(A B C D);

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

type Call<R> = Box<dyn Fn(&Machine<'_>, &mut Random) -> R>;

/// A function of the kernels, and the CPU's.
pub(super) struct Function {
    pub(super) name: &'static str,
    /// The next result of the kernels' function.
    call: Call<Vec<u32>>,
    /// Compares the next results of both.
    compare: Call<()>,
}

impl Function {
    fn new<A: Argument, R: Stored + 'static, S: Stored + 'static>(
        name: &'static str,
        arguments: fn(&mut Random) -> A,
        of_kernels: fn(&Machine<'_>, A::OfKernels) -> R,
        of_cpu: fn(A) -> S,
    ) -> Self {
        Self {
            name,
            call: Box::new(move |machine, random| {
                bits(of_kernels(machine, arguments(random).of_kernels()))
            }),
            compare: Box::new(move |machine, random| {
                let tried = arguments(random);
                let expected = bits(of_kernels(machine, tried.of_kernels()));
                assert_eq!(bits(of_cpu(tried)), expected, "{name} of {tried:?}");
            }),
        }
    }

    /// Hands each result of the kernels' function on, until it is told to stop.
    pub(super) fn try_results(&self, mut is_enough: impl FnMut(Vec<u32>) -> bool) {
        let memory = memory();
        let mut random = Random::new();
        for _ in 0..SAMPLES {
            let machine = memory.invocation(Lane::guarded(0));
            if is_enough((self.call)(&machine, &mut random)) {
                break;
            }
        }
    }
}

/// The clock, on which the tick of a clip depends.
const CLOCK: u64 = 0x00ab_cdef_0123_4567;

fn memory() -> Memory {
    let dispatch = CrowdDispatch {
        clock_low: CLOCK as u32,
        clock_high: (CLOCK >> 32) as u32,
        ..bytemuck::Zeroable::zeroed()
    };
    let (inputs, arguments) = ([&[][..]; 4], bytemuck::bytes_of(&dispatch));
    Memory::new(Kernel::CrowdTimes, inputs.into_iter(), arguments, vec![])
}

#[test]
fn functions_of_the_kernels_are_the_cpus() {
    let memory = memory();
    for function in functions() {
        let mut random = Random::new();
        for _ in 0..SAMPLES {
            (function.compare)(&memory.invocation(Lane::guarded(0)), &mut random);
        }
    }
}

#[test]
fn every_function_that_is_written_for_the_cpu_is_compared() {
    let text = include_str!("../../shaders/compiled/functions.rs");
    let names = text.split("pub(crate) fn ").skip(1);
    let names = names.filter_map(|rest| rest.split(['<', '(']).next());
    // The parts of a function with a cut are those of the whole one.
    let is_part = |name: &str| name.ends_with("_begin") || name.ends_with("_end");
    let names = Vec::from_iter(names.filter(|name| !is_part(name)));
    let compared = functions();
    let is_compared = |name: &str| compared.iter().any(|function| function.name == name);
    assert!(names.len() > 30, "only {} were found", names.len());
    let missing: Vec<_> = names
        .into_iter()
        .filter(|name| !is_compared(name))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}

/// All angles that a hinge may have, in every quarter turn.
#[test]
fn rotations_by_many_turns_are_as_accurate_as_those_by_small_angles() {
    let mut worst = 0.0f64;
    for step in -400_000..=400_000 {
        let angle = 4096.0 * (step as f32 / 400_000.0);
        let [x, y, z, w] = cpu::rotation_about([0.0, 1.0, 0.0], angle);
        let (sine, cosine) = (0.5 * f64::from(angle)).sin_cos();
        worst = worst.max((f64::from(y) - sine).abs());
        worst = worst.max((f64::from(w) - cosine).abs());
        assert_eq!([x, z], [0.0; 2]);
    }
    assert!(worst < 1.2e-7, "{worst}");
    assert_eq!(
        cpu::rotation_about([1.0, 0.0, 0.0], 0.0),
        [0.0, 0.0, 0.0, 1.0]
    );
}

// ---------------------------------------------------------------- arguments

/// An angle, or a number that is none.
fn angle(random: &mut Random) -> f32 {
    let number = random.finite();
    if number.abs() <= 1.0 {
        number * 1.6
    } else {
        number
    }
}

/// An angle of a hinge, which may be many turns.
fn hinge_angle(random: &mut Random) -> f32 {
    let size = if random.once_in(2) { 2.0 } else { 8192.0 };
    size * random.number()
}

fn two(random: &mut Random) -> ([f32; 4], [f32; 4]) {
    (random.vector(), random.vector())
}

fn three(random: &mut Random) -> ([f32; 3], [f32; 3]) {
    (random.vector(), random.vector())
}

/// A parameter between two rotations, or that of one of them.
fn between(random: &mut Random) -> f32 {
    let inner = random.number();
    [0.0, 1.0, inner, inner][random.below(4) as usize]
}

/// A rotation, and half a rotation vector that may be too long.
fn rotation_and_step(random: &mut Random) -> ([f32; 4], [f32; 4]) {
    let length = if random.once_in(4) { 2.0 } else { 0.8 };
    let [x, y, z] = random.vector().map(|c: f32| length * c);
    (random.rotation(), [x, y, z, 0.0])
}

/// A small rotation as the functions have it.
fn small(random: &mut Random) -> FromIdentity<f32> {
    let (vector, cosm1) = (random.vector(), random.number());
    FromIdentity { vector, cosm1 }
}

fn keys(random: &mut Random) -> [[f32; 4]; 4] {
    match random.once_in(8) {
        true => [(); 4].map(|()| random.vector()),
        false => random.four_keys(),
    }
}

/// A number up to 1 of which the root is taken, or one whose root is nearly half way between two numbers.
fn square(random: &mut Random) -> f32 {
    match random.once_in(8) {
        true => f32::from_bits(((127 - 2 * random.below(12)) << 23) + random.below(4) - 1),
        false => ((random.word() >> 8) + 1) as f32 / (1 << 24) as f32,
    }
}

/// A number near the largest half, or any.
fn large(random: &mut Random) -> f32 {
    match random.once_in(4) {
        true => 65_520.0 + 100.0 * random.number(),
        false => random.finite(),
    }
}

/// A sequence of angles, as the shader gets it.
fn sequence(random: &mut Random) -> u32 {
    let all = EulerSequence::all();
    let sequence = all[random.below(all.len() as u32) as usize];
    Encoding::Euler(sequence).row().detail
}

/// A number below 2^`bits`, of any magnitude.
fn whole(random: &mut Random, bits: u32) -> u64 {
    let word = u64::from(random.word()) << 32 | u64::from(random.word());
    let length = random.below(bits + 1);
    word.checked_shr(64 - length).unwrap_or(0)
}

/// Two numbers, of which a word may be the same.
fn wholes(random: &mut Random) -> (u64, u64) {
    let (a, b) = (whole(random, 64), whole(random, 64));
    match random.below(4) {
        0 => (a, a & 0xffff_ffff | b << 32),
        1 => (a, a >> 32 << 32 | b & 0xffff_ffff),
        _ => (a, b),
    }
}

fn words(value: u64) -> [u32; 2] {
    [value as u32, (value >> 32) as u32]
}

/// An entry, and the period of its clip.
fn entry(random: &mut Random) -> (CrowdEntry, u32) {
    let period = 1 + whole(random, 30) as u32;
    let wrap = random.below(3);
    let within = whole(random, 32) % (u64::from(period) * u64::from(wrap.max(1)) + 1);
    let entry = CrowdEntry {
        clip_and_weight: random.word(),
        speed_and_modes: whole(random, 23) as u32 & SPEED_MAGNITUDE
            | random.word() & !(SPEED_MAGNITUDE | 3 << 29)
            | wrap << 29,
        start: START_BIAS + within as u32,
        anchor: (CLOCK.wrapping_sub(whole(random, 40)) >> 8) as u32,
    };
    (entry, period)
}

/// The coefficients of a curve, and whether it is one.
fn valid<F: Copy>(powers: [[F; 4]; 7], is_valid: bool, number: fn(f32) -> F) -> [[F; 4]; 8] {
    std::array::from_fn(|i| match powers.get(i) {
        Some(power) => *power,
        None => [number(f32::from(u8::from(is_valid))); 4],
    })
}

// ---------------------------------------------------------------- the functions

/// Functions by their names, with their arguments, and how kernels and the CPU call them.
macro_rules! functions {
    ($machine:ident, $random:ident: $($name:literal of $arguments:expr => |$pattern:pat_param|
        $of_kernels:expr, $of_cpu:expr;)+) => {
        pub(super) fn functions() -> Vec<Function> {
            vec![$(Function::new(
                $name,
                |$random| $arguments,
                |$machine, $pattern| $of_kernels,
                |$pattern| $of_cpu,
            ),)+]
        }
    };
}

functions! { on, r:
    "canonical" of r.vector::<4>() => |q| entries::canonical(on, q), q.map(cpu::canonical);
    "flushed" of r.finite() => |x| entries::flushed(on, x), cpu::flushed(x);
    "flushed4" of r.vector::<4>() => |q| entries::flushed4(on, q), cpu::flushed4(q);
    "magnitude" of r.finite() => |x| entries::magnitude(on, x), cpu::magnitude(x);
    "reciprocal" of r.positive() => |x| entries::reciprocal(on, x), cpu::reciprocal(x);
    "reciprocal_root" of r.positive() => |x| entries::reciprocal_root(on, x), cpu::reciprocal_root(x);
    "root" of r.positive() => |x| entries::root(on, x), root(x);
    "acute_arc_tangent" of (r.positive(), r.positive()) => |(y, x)|
        entries::acute_arc_tangent(on, y, x), cpu::acute_arc_tangent(y, x);
    "arc_tangent" of (r.finite(), r.finite()) => |(y, x)| entries::arc_tangent(on, y, x), arc_tangent(y, x);
    "sine_cosine" of angle(r) => |x| entries::sine_cosine(on, x), <[f32; 2]>::from(cpu::sine_cosine(x));
    "sine_cosm1" of (angle(r), r.positive()) => |(x, z)|
        entries::sine_cosm1(on, x, z), <[f32; 2]>::from(cpu::sine_cosm1(x, z));
    "sine_cosm1_quarter" of (angle(r), r.positive()) => |(x, z)|
        entries::sine_cosm1_quarter(on, x, z), <[f32; 2]>::from(cpu::sine_cosm1_quarter(x, z));
    "product" of two(r) => |(a, b)| entries::product(on, a, b), product(a, b);
    "dot4" of two(r) => |(a, b)| entries::dot4(on, a, b), dot(a, b);
    "cross3" of three(r) => |(a, b)| entries::cross3(on, a, b), cross3(a, b);
    "dot3" of three(r) => |(a, b)| entries::dot3(on, a, b), dot3(a, b);
    "norm_squared" of r.vector::<4>() => |q| entries::norm_squared(on, q), cpu::norm_squared(q);
    "normalised" of r.vector::<4>() => |q| entries::normalised(on, q), cpu::normalised(q);
    "rotated" of (r.vector::<4>(), r.vector::<3>()) => |(q, v)| entries::rotated(on, q, v), cpu::rotated(q, v);
    "slerp" of (r.pair(), r.number()) => |([a, b], t)| entries::slerp(on, a, b, t), slerp(a, b, t);
    "over" of (r.pair(), between(r)) => |([a, b], t)| entries::over(on, a, b, t), cpu::over(a, b, t);
    "rotation_step" of r.pair() => |[a, b]| entries::rotation_step(on, a, b), pose_steps::rotation_step(a, b);
    "rotated_by" of rotation_and_step(r) => |(q, v)| entries::rotated_by(on, q, v), cpu::rotated_by(q, v);
    "evaluate of an arc" of (two(r), r.parameter()) => |((middle, tangent), s)|
        entries::evaluate_arc_segment(on, entries::ArcSegment { middle, tangent }, s),
        ArcSegment { middle, tangent }.at(s).to_array();
    "polynomial" of ([(); 11].map(|()| r.vector::<4>()), r.parameter()) => |(coefficients, s)|
        entries::evaluate_polynomial_segment(on, entries::PolynomialSegment { coefficients }, s),
        PolynomialSegment { coefficients }.at(s).to_array();
    "distance_from_middle" of ((r.word() as i32) >> r.below(32), r.below(16)) => |(first, j)|
        entries::distance_from_middle_of_frame_distance(on, first, j), first.wrapping_add(j as i32) as f32;
    "arc_between" of r.pair() => |[a, b]|
        { let arc = entries::arc_between(on, a, b); [arc.middle, arc.tangent] },
        <[_; 2]>::from(cpu::arc_between(a, b));
    "constant_velocity" of two(r) => |(middle, tangent)|
        entries::constant_velocity(on, entries::ArcSegment { middle, tangent }),
        {
            let square = cpu::norm_squared(tangent);
            let each = [0, 1, 2, 3].map(|c| arc_component(middle[c], tangent[c], square));
            <[_; 11]>::map(std::array::from_fn(|power| power), |power| each.map(|powers| powers[power]))
        };
    "step_vector" of two(r) => |(a, chord)| entries::step_vector(on, a, chord), cpu::step_vector(a, chord);
    "small_log" of r.vector::<3>() => |v| entries::small_log(on, v), cpu::small_log(v);
    "small_exp" of r.vector::<3>() => |v|
        { let r = entries::small_exp(on, v); [r.vector[0], r.vector[1], r.vector[2], r.cosm1] },
        { let r = cpu::small_exp(v); [r.vector[0], r.vector[1], r.vector[2], r.cosm1] };
    "composed" of (small(r), small(r)) => |(a, b)|
        { let r = entries::composed(on, a, b); [r.vector[0], r.vector[1], r.vector[2], r.cosm1] },
        { let r = cpu::composed(a, b); [r.vector[0], r.vector[1], r.vector[2], r.cosm1] };
    "rotation_about" of (r.vector::<3>(), hinge_angle(r)) => |(axis, angle)|
        entries::rotation_about(on, axis, angle), cpu::rotation_about(axis, angle);
    "inverse_rotated" of (r.vector::<3>(), small(r)) => |(v, r)|
        entries::inverse_rotated(on, v, r), cpu::inverse_rotated(v, r);
    "canonical_product" of (r.vector::<4>(), r.vector::<3>(), r.number()) => |(m, v, w)|
        entries::canonical_product(on, m, v, w), cpu::canonical_product(m, v, w);
    "small_angle_cubic" of (keys(r), [r.weights(), r.weights()]) => |([before, start, end, after], [first, last])|
        {
            let curve = entries::small_angle_cubic(on, before, start, end, after, first, last);
            valid(curve.powers, curve.is_valid, Number)
        },
        {
            let [first, last] = [first, last].map(|weights| bytemuck::cast::<_, [f32; 4]>(weights).into());
            let curve = cpu::small_angle_cubic(before, start, end, after, first, last);
            valid(curve.powers, curve.is_valid, |flag| flag)
        };
    "to_half" of r.vector::<4>() => |q| entries::to_half(on, q), q.map(cpu::to_half);
    "to_any_half" of [(); 4].map(|()| large(r)) => |q| entries::to_any_half(on, q), q.map(cpu::to_any_half);
    "to_snorm" of r.rotation() => |q| entries::to_snorm(on, q), q.map(cpu::to_snorm);
    "axis_angle" of r.rotation() => |q| entries::axis_angle(on, q), cpu::axis_angle(q);
    "wrapped" of if r.once_in(2) { r.finite() } else { 4.0 * angle(r) } => |x|
        entries::wrapped(on, x), cpu::wrapped(x);
    "euler" of (r.rotation(), sequence(r)) => |(q, detail)| entries::euler(on, q, detail), cpu::euler(q, detail);
    "matrix_rows" of (r.rotation(), r.below(2)) => |(q, detail)|
        { let rows = entries::matrix_rows(on, q, detail); [rows.first, rows.second, rows.third] },
        { let rows = cpu::matrix_rows(q, detail); [rows.first, rows.second, rows.third] };
    "transform_row" of (r.vector::<3>(), r.vector::<4>(), r.finite()) => |(axis, scale, moved)|
        entries::transform_row(on, axis, scale, moved), crowd_matrices::transform_row(axis, scale, moved);
    "row_product" of [(); 4].map(|()| r.vector::<4>()) => |[row, a, b, c]|
        entries::row_product(on, row, a, b, c), crowd_matrices::row_product(row, &[a, b, c]);
    "cubic" of ([(); 4].map(|()| r.vector::<4>()), r.parameter()) => |([a, b, c, d], s)|
        entries::cubic(on, a, b, c, d, s), [0, 1, 2, 3].map(|i| cpu::cubic(a[i], b[i], c[i], d[i], s));
    "rotation_added" of ([(); 3].map(|()| r.rotation()), between(r)) => |([base, layer, reference], weight)|
        entries::rotation_added(on, base, layer, reference, weight),
        cpu::rotation_added(base, layer, reference, weight);
    "laid_over" of (([ROTATION, TRANSLATION, SCALE][r.below(3) as usize], r.once_in(2)),
        [(); 3].map(|()| r.rotation()), between(r)) => |((kind, is_additive), [below, layer, reference], weight)|
        entries::laid_over(on, kind, is_additive, below, layer, reference, weight),
        cpu::laid_over(kind, is_additive, below, layer, reference, weight);
    "exact_root" of square(r) => |x| entries::exact_root(on, x), x.sqrt();
    "unpacked" of [r.word(), r.word()] => |key| entries::unpacked(on, key), unpacked(key);
    "line_between" of two(r) => |(start, end)|
        { let line = entries::line_between(on, start, end); [line.value, line.slope] },
        line_between(start, end);
    "wide_difference" of wholes(r) => |(a, b)| entries::wide_difference(on, a, b), words(a.wrapping_sub(b));
    "move_of" of (whole(r, 23) as u32, whole(r, 40)) => |(speed, time)|
        { let moved = entries::move_of(on, speed, time); [moved.ticks[0], moved.ticks[1], moved.part] },
        {
            let moved = u64::from(speed) * time;
            let [low, high] = words(moved >> 16);
            [low, high, u32::from(moved & 0xffff != 0)]
        };
    "remainder" of (whole(r, 32) as u32, 1 + whole(r, 31) as u32) => |(x, q)| entries::remainder(on, x, q), x % q;
    "tick_remainder" of (whole(r, 48), 1 + whole(r, 31) as u32) => |(x, q)|
        entries::tick_remainder(on, x, q), (x % u64::from(q)) as u32;
    "tick_of" of entry(r) => |(entry, period)|
        entries::tick_of(on, entry, period), crowd_times::tick_of(&entry, period, CLOCK);
}
