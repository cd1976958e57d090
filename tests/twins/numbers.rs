//! Numbers as devices may compute with them, where Vulkan or a translator of its shaders leaves a choice, and mistakes.
//! The inputs are those of the kernels' check.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};
use std::marker::PhantomData;
use std::ops::{Add, Mul, Neg, Range, Sub};
use std::panic::{AssertUnwindSafe, Location, catch_unwind, resume_unwind};

use crate::gpu::kernel_check::random::Random;
use crate::gpu::kernel_check::{Trial, trials};
use crate::shader::{KERNELS, Kernel};
use crate::twin::entries::Global;
use crate::twin::machine::{Float, Stored, Watch};

/// How a device computes.
trait Rule: Copy + Default + PartialOrd {
    #[track_caller]
    fn sum(a: f32, b: f32) -> f32 {
        a + b
    }

    #[track_caller]
    fn difference(a: f32, b: f32) -> f32 {
        a - b
    }

    #[track_caller]
    fn product(a: f32, b: f32) -> f32 {
        a * b
    }

    #[track_caller]
    fn constant(value: f32) -> f32 {
        value
    }
}

#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd)]
struct Number<R>(f32, PhantomData<R>);

macro_rules! operator {
    ($operator:ident $method:ident $rule:ident) => {
        impl<R: Rule> $operator for Number<R> {
            type Output = Self;

            #[track_caller]
            fn $method(self, other: Self) -> Self {
                Self(R::$rule(self.0, other.0), PhantomData)
            }
        }
    };
}
operator!(Add add sum);
operator!(Sub sub difference);
operator!(Mul mul product);

impl<R: Rule> Neg for Number<R> {
    type Output = Self;

    fn neg(self) -> Self {
        Self(-self.0, PhantomData)
    }
}

impl<R: Rule> Stored for Number<R> {
    const WORDS: usize = 1;

    fn of_words(words: &[u32]) -> Self {
        Self::of_bits(words[0])
    }

    fn put(self, words: &mut [u32]) {
        words[0] = self.bits();
    }
}

impl<R: Rule> Float for Number<R> {
    #[track_caller]
    fn of(value: f32) -> Self {
        Self(R::constant(value), PhantomData)
    }

    fn bits(self) -> u32 {
        self.0.to_bits()
    }

    fn of_bits(bits: u32) -> Self {
        Self(f32::from_bits(bits), PhantomData)
    }
}

/// Numbers smaller than the least normal one are 0 as operands and as results. Comparisons are as they are where no
/// subnormal is left.
#[derive(Clone, Copy, Default, PartialEq, PartialOrd)]
struct Flushed;

fn flushed(a: f32) -> f32 {
    if a.is_subnormal() { 0.0 } else { a }
}

impl Rule for Flushed {
    fn sum(a: f32, b: f32) -> f32 {
        flushed(flushed(a) + flushed(b))
    }

    fn difference(a: f32, b: f32) -> f32 {
        flushed(flushed(a) - flushed(b))
    }

    fn product(a: f32, b: f32) -> f32 {
        flushed(flushed(a) * flushed(b))
    }
}

/// Products are `fma(a, b, 0)`, as SPIRV-Cross writes them for Metal: where a factor is 0, the product is +0 whatever
/// the signs; one that is too small keeps its sign.
#[derive(Clone, Copy, Default, PartialEq, PartialOrd)]
struct Fused;

impl Rule for Fused {
    fn product(a: f32, b: f32) -> f32 {
        if a == 0.0 || b == 0.0 {
            a * b + 0.0
        } else {
            a * b
        }
    }
}

fn results<R: Rule, W: Watch>(trial: &Trial, kernel: Kernel, watch: impl Fn(u32) -> W) -> Vec<u32> {
    let memory = trial.memory(kernel);
    memory.run::<Number<R>, W>(trial.groups, watch);
    memory.into_output()
}

/// Trials of each kernel; `SOAK` asks for more.
fn rounds() -> usize {
    std::env::var_os("SOAK").map_or(12, |_| 100)
}

fn assert_results_are_the_same<R: Rule>() {
    for code in &KERNELS {
        // The numbers of the self-test are chosen; they are compared on devices.
        if code.kernel == Kernel::SelfTest {
            continue;
        }
        let random = &mut Random::canonical();
        for round in 0..rounds() {
            for (i, trial) in trials(code.kernel, random).iter().enumerate() {
                let (found, expected) = (
                    results::<R, ()>(trial, code.kernel, |_| ()),
                    trial.expected(code.kernel),
                );
                let differs = found.iter().zip(&expected).position(|(a, b)| a != b);
                assert_eq!(
                    differs, None,
                    "{:?}, trial {i} of round {round}",
                    code.kernel
                );
            }
        }
    }
}

/// A driver may take numbers smaller than the least normal one for 0, in any operation. Of inputs as the
/// host gives them no result depends on it.
#[test]
fn results_are_the_same_where_subnormals_are_flushed() {
    assert_results_are_the_same::<Flushed>();
}

/// Metal's compiler gets every product as a fused sum with +0, which has no negative zeros. No result depends
/// on the sign of a product that is 0.
#[test]
fn results_are_the_same_where_products_are_fused_with_zero() {
    assert_results_are_the_same::<Fused>();
}

/// What the rules change, and what they leave.
#[test]
fn a_rule_changes_what_it_says() {
    fn product<R: Rule>(a: f32, b: f32) -> u32 {
        (Number::<R>::of(a) * Number::of(b)).bits()
    }
    let tiny = f32::MIN_POSITIVE;
    let [zero, minus_zero] = [0.0f32, -0.0].map(f32::to_bits);
    for (a, b, flushed, fused) in [
        (-1.0, 0.0, minus_zero, zero),
        (0.0, -3.0, minus_zero, zero),
        (-tiny, tiny, minus_zero, minus_zero),
        (tiny, 0.5, zero, (tiny / 2.0).to_bits()),
        (-3.0, 0.5, (-1.5f32).to_bits(), (-1.5f32).to_bits()),
    ] {
        assert_eq!(product::<Flushed>(a, b), flushed, "{a} {b}");
        assert_eq!(product::<Fused>(a, b), fused, "{a} {b}");
    }
}

/// A line and a column of the generated file.
type Spot = (u32, u32);

thread_local! {
    static PLANTED: Cell<Option<Spot>> = const { Cell::new(None) };
    static BLOCKS: Cell<usize> = const { Cell::new(0) };
    static SEEN: RefCell<Option<BTreeSet<Spot>>> = const { RefCell::new(None) };
}

/// Whether the mistake is planted where this is called from.
#[track_caller]
fn is_planted() -> bool {
    let spot = Location::caller();
    let spot = (spot.line(), spot.column());
    SEEN.with_borrow_mut(|seen| seen.iter_mut().for_each(|seen| seen.extend([spot])));
    PLANTED.get() == Some(spot)
}

/// What a mistake is likely to be: a sum for a difference or for a product, a difference for a sum, a constant that is
/// a thousandth too large, a neighbour of what is loaded or stored.
#[derive(Clone, Copy, Default, PartialEq, PartialOrd)]
struct Mistaken;

impl Rule for Mistaken {
    #[track_caller]
    fn sum(a: f32, b: f32) -> f32 {
        if is_planted() { a - b } else { a + b }
    }

    #[track_caller]
    fn difference(a: f32, b: f32) -> f32 {
        if is_planted() { a + b } else { a - b }
    }

    #[track_caller]
    fn product(a: f32, b: f32) -> f32 {
        if is_planted() { a + b } else { a * b }
    }

    #[track_caller]
    fn constant(value: f32) -> f32 {
        if value != 0.0 && is_planted() {
            value * 1.001
        } else {
            value
        }
    }
}

impl Watch for Mistaken {
    type Block = ();

    #[track_caller]
    fn location(&self, at: usize, words: usize) -> usize {
        if is_planted() { at + words } else { at }
    }

    fn touch(&self, _: Global, words: Range<usize>, _: bool) {
        stop_if(words.end > MAX_WORDS);
    }

    fn block(&self, _: u32, _: usize) {
        BLOCKS.set(BLOCKS.get() + 1);
        stop_if(BLOCKS.get() > MAX_BLOCKS);
    }
}

/// No trial has buffers of more words, or enters more blocks: a kernel that does has a mistake.
const MAX_WORDS: usize = 1 << 20;
const MAX_BLOCKS: usize = 1 << 21;

/// Ends a kernel that a mistake leads astray.
fn stop_if(is_astray: bool) {
    if is_astray {
        resume_unwind(Box::new("astray"));
    }
}

/// Whether a trial has another result; one that ends otherwise, as by a division by 0, has none.
fn differs(trial: &Trial, kernel: Kernel, expected: &[u32]) -> bool {
    BLOCKS.set(0);
    let run = || results::<Mistaken, _>(trial, kernel, |_| Mistaken);
    catch_unwind(AssertUnwindSafe(run)).map_or(true, |found| found != expected)
}

/// Parts of lines with mistakes that the check's inputs need not show, and why.
const COARSE: [(&str, &str); 13] = [
    ("HALF_PI_LOW", "less than a rounding of the sum"),
    ("PI_LOW", "less than a rounding of the sum"),
    (
        "M::F::of(1.0)",
        "the divisor of 0, and a weight that is 1 in either case",
    ),
    (
        "Global::Rows, 0",
        "where the first of neighbours begins: `lines.rs` counts that",
    ),
    (
        "Global::Rows, 2",
        "how many rows the last of them have, which others store too",
    ),
    (
        "Global::Dispatch, 13",
        "where the first of neighbours begins: `lines.rs` counts that",
    ),
    (
        "Global::Dispatch, 5",
        "the level that is walked: the others have the same joints",
    ),
    (
        "SERIES_",
        "less than a rounding of most sums: hashes find them",
    ),
    ("B_", "small corrections of a small angle: hashes find them"),
    ("LOG_", "the same"),
    (
        "SMALL_SQUARED_EXTENT",
        "a limit: no input lies within a thousandth of it",
    ),
    ("GIMBAL", "a limit: no input lies within a thousandth of it"),
    ("M::F::of(L", "limits likewise"),
];

/// The check's inputs reach every part of every kernel: a mistake anywhere is found.
#[test]
fn a_mistake_anywhere_is_found() {
    let text: Vec<&str> = include_str!("../../shaders/compiled/entries.rs")
        .lines()
        .collect();
    let mut of_kernels = Vec::new();
    let mut spots = BTreeMap::<Spot, Vec<usize>>::new();
    for (i, code) in KERNELS.iter().enumerate() {
        let random = &mut Random::canonical();
        let all: Vec<(Trial, Vec<u32>)> = (0..2)
            .flat_map(|_| trials(code.kernel, random))
            .map(|trial| {
                let expected = trial.expected(code.kernel);
                (trial, expected)
            })
            .collect();
        SEEN.set(Some(BTreeSet::new()));
        for (trial, expected) in &all {
            assert!(!differs(trial, code.kernel, expected), "{:?}", code.kernel);
        }
        for spot in SEEN.take().unwrap_or_default() {
            spots.entry(spot).or_default().push(i);
        }
        of_kernels.push((code.kernel, all));
    }
    assert!(spots.len() > 900, "only {} were tried", spots.len());
    let mut kept = Vec::new();
    for (&spot, kernels) in &spots {
        PLANTED.set(Some(spot));
        let is_found = kernels.iter().any(|&i| {
            let (kernel, all) = &of_kernels[i];
            all.iter()
                .any(|(trial, expected)| differs(trial, *kernel, expected))
        });
        PLANTED.set(None);
        let line = text[spot.0 as usize - 1];
        let is_coarse = COARSE.iter().any(|(part, _)| line.contains(part));
        if !is_found && !is_coarse {
            kept.push(format!("{spot:?}: {line}"));
        }
    }
    assert!(kept.is_empty(), "of {}:\n{}", spots.len(), kept.join("\n"));
}
