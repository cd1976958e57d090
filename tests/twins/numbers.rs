//! Runs the kernels with numbers as devices may compute them, if Vulkan or a translator of shaders leaves a choice:
//! flushed subnormal numbers, fused products. The inputs are those of the check of kernels.

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::ops::{Add, Mul, Neg, Range, Sub};
use std::panic::Location;

use crate::gpu::kernel_check::random::Random;
use crate::gpu::kernel_check::{Trial, trials};
use crate::shader::{KERNELS, Kernel};
use crate::twin::machine::{Float, Stored};

use super::lines::Lane;

/// How a device computes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Rule {
    AsWritten,
    /// Numbers smaller than the least normal one are 0 as operands and as results. Comparisons are as they are where
    /// no subnormal is left.
    Flushed,
    /// Products are `fma(a, b, 0)`, as SPIRV-Cross writes them for Metal: where a factor is 0, the product is +0
    /// whatever the signs; one that is too small keeps its sign.
    FusedWithZero,
    /// As written; every [`Spot`] is listed.
    Listing,
    /// With a mistake. A constant is multiplied by the factor.
    Mistaken(Spot, f32),
}

/// The kinds of mistakes that are likely in a shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// A difference for a sum.
    Sum,
    /// A sum for a difference.
    Difference,
    /// A sum for a product.
    Product,
    /// Another constant.
    Constant,
    /// The neighbour of the address that is loaded or stored.
    Address,
}

/// Where a mistake can be: a line and a column of the generated file.
pub(super) type Spot = (u32, u32, Kind);

const RECENT_SPOTS: usize = 1024;

thread_local! {
    static RULE: Cell<Rule> = const { Cell::new(Rule::AsWritten) };
    /// A checksum of the loads and stores of buffers: which invocation made each, and where.
    static TOUCHED: Cell<u32> = const { Cell::new(0) };
    static LISTED: RefCell<BTreeSet<Spot>> = const { RefCell::new(BTreeSet::new()) };
    /// Spots that were listed last, by some of their bits: most are met thousands of times.
    static RECENT: RefCell<[Option<Spot>; RECENT_SPOTS]> = const { RefCell::new([None; RECENT_SPOTS]) };
}

/// Does something by a rule.
pub(super) fn by<T>(rule: Rule, action: impl FnOnce() -> T) -> T {
    RULE.set(rule);
    let result = action();
    RULE.set(Rule::AsWritten);
    result
}

/// The spots of an action at which there can be mistakes.
pub(super) fn spots(action: impl FnOnce()) -> BTreeSet<Spot> {
    RECENT.set([None; RECENT_SPOTS]);
    by(Rule::Listing, action);
    LISTED.take()
}

/// Whether the mistake is planted where this is called from.
#[track_caller]
pub(super) fn is_planted(kind: Kind) -> bool {
    let rule = RULE.get();
    if !matches!(rule, Rule::Listing | Rule::Mistaken(..)) {
        return false;
    }
    let caller = Location::caller();
    let spot = (caller.line(), caller.column(), kind);
    if rule == Rule::Listing {
        RECENT.with_borrow_mut(|recent| {
            let bits = (spot.0 << 5 ^ spot.1 << 2) as usize + kind as usize;
            let recent = &mut recent[bits % RECENT_SPOTS];
            if recent.replace(spot) != Some(spot) {
                LISTED.with_borrow_mut(|listed| listed.insert(spot));
            }
        });
    }
    matches!(rule, Rule::Mistaken(planted, _) if planted == spot)
}

pub(super) fn is_touched(invocation: u32, words: &Range<usize>) {
    let (start, end) = (words.start as u32, words.end as u32);
    let mixed = (invocation ^ start.rotate_left(8) ^ end.rotate_left(20)).wrapping_mul(0x9e37_79b1);
    TOUCHED.set(TOUCHED.get().wrapping_add(mixed ^ mixed >> 15));
}

/// A number of which [`by`] says how to compute with it.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd)]
pub(super) struct Number(pub(super) f32);

fn flushed(a: f32) -> f32 {
    if a.is_subnormal() { 0.0 } else { a }
}

impl Add for Number {
    type Output = Self;

    #[track_caller]
    fn add(self, Self(b): Self) -> Self {
        let Self(a) = self;
        Self(match RULE.get() {
            Rule::Flushed => flushed(flushed(a) + flushed(b)),
            _ if is_planted(Kind::Sum) => a - b,
            _ => a + b,
        })
    }
}

impl Sub for Number {
    type Output = Self;

    #[track_caller]
    fn sub(self, Self(b): Self) -> Self {
        let Self(a) = self;
        Self(match RULE.get() {
            Rule::Flushed => flushed(flushed(a) - flushed(b)),
            _ if is_planted(Kind::Difference) => a + b,
            _ => a - b,
        })
    }
}

impl Mul for Number {
    type Output = Self;

    #[track_caller]
    fn mul(self, Self(b): Self) -> Self {
        let Self(a) = self;
        Self(match RULE.get() {
            Rule::Flushed => flushed(flushed(a) * flushed(b)),
            Rule::FusedWithZero if a == 0.0 || b == 0.0 => a * b + 0.0,
            _ if is_planted(Kind::Product) => a + b,
            _ => a * b,
        })
    }
}

impl Neg for Number {
    type Output = Self;

    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Stored for Number {
    const WORDS: usize = 1;

    fn of_words(words: &[u32]) -> Self {
        Self::of_bits(words[0])
    }

    fn put(self, words: &mut [u32]) {
        words[0] = self.bits();
    }
}

impl Float for Number {
    #[track_caller]
    fn of(value: f32) -> Self {
        let is_mistaken = value != 0.0 && is_planted(Kind::Constant);
        Self(match RULE.get() {
            Rule::Mistaken(_, factor) if is_mistaken => value * factor,
            _ => value,
        })
    }

    fn bits(self) -> u32 {
        self.0.to_bits()
    }

    fn of_bits(bits: u32) -> Self {
        Self(f32::from_bits(bits))
    }
}

/// The words that a kernel stores by the present rule, then a checksum of which invocation accessed which words.
pub(super) fn results(trial: &Trial, kernel: Kernel) -> Vec<u32> {
    let memory = trial.memory(kernel);
    TOUCHED.set(0);
    memory.run::<Number, Lane>(trial.groups, Lane::guarded);
    let mut all = memory.into_output();
    all.push(TOUCHED.get());
    all
}

/// Trials of each kernel; `SOAK` asks for more.
fn rounds() -> usize {
    std::env::var_os("SOAK").map_or(12, |_| 100)
}

fn assert_results_are_the_same(rule: Rule) {
    // The inputs of the self-test are fixed numbers, so its kernel is compared only on devices.
    let kernels = KERNELS.iter().map(|code| code.kernel);
    for kernel in kernels.filter(|kernel| *kernel != Kernel::SelfTest) {
        let random = &mut Random::canonical();
        for round in 0..rounds() {
            for (i, trial) in trials(kernel, random).iter().enumerate() {
                let found = by(rule, || results(trial, kernel));
                let expected = trial.expected(kernel);
                let mut pairs = found.iter().zip(&expected);
                let differs = pairs.position(|(a, b)| a != b);
                assert_eq!(differs, None, "{kernel:?}, trial {i} of round {round}");
            }
        }
    }
}

/// A driver may take numbers smaller than the least normal one for 0, in any operation. Of inputs as the
/// host gives them no result depends on it.
#[test]
fn results_are_the_same_where_subnormals_are_flushed() {
    assert_results_are_the_same(Rule::Flushed);
}

/// Metal's compiler gets every product as a fused sum with +0, which has no negative zeros. No result depends
/// on the sign of a product that is 0.
#[test]
fn results_are_the_same_where_products_are_fused_with_zero() {
    assert_results_are_the_same(Rule::FusedWithZero);
}

/// Each rule changes the products that it is about, and no others.
#[test]
fn a_rule_changes_what_it_says() {
    let product = |rule, a, b| by(rule, || (Number(a) * Number(b)).bits());
    let tiny = f32::MIN_POSITIVE;
    let [zero, minus_zero] = [0.0f32, -0.0].map(f32::to_bits);
    for (a, b, flushed, fused) in [
        (-1.0, 0.0, minus_zero, zero),
        (0.0, -3.0, minus_zero, zero),
        (-tiny, tiny, minus_zero, minus_zero),
        (tiny, 0.5, zero, (tiny / 2.0).to_bits()),
        (-3.0, 0.5, (-1.5f32).to_bits(), (-1.5f32).to_bits()),
    ] {
        assert_eq!(product(Rule::Flushed, a, b), flushed, "{a} {b}");
        assert_eq!(product(Rule::FusedWithZero, a, b), fused, "{a} {b}");
    }
}
