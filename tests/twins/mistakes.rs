//! Plants mistakes in the kernels, one after another. Each must change a value that a kernel stores for the inputs of
//! the check of kernels, or a result of a function for hostile arguments. The hashes of all these results without
//! mistakes are recorded. They find a mistake in a shader, which all code that is generated from the shader shares. The
//! check of kernels finds mistakes of a driver.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use crate::gpu::kernel_check::random::Random;
use crate::gpu::kernel_check::{Trial, trials};
use crate::shader::{KERNELS, Kernel};

use super::arithmetic::{Function, functions};
use super::numbers::{Rule, Spot, by, results, spots};

/// Calls of a function of which spots are listed.
const LISTED_CALLS: usize = 500;

/// Trials of a kernel, and their results.
struct Tried {
    kernel: Kernel,
    trials: Vec<(Trial, Vec<u32>)>,
}

impl Tried {
    /// Two of each kind.
    fn new(kernel: Kernel) -> Self {
        let random = &mut Random::canonical();
        let trials = (0..2).flat_map(|_| trials(kernel, random));
        let trials = trials.map(|trial| {
            let result = results(&trial, kernel);
            let stored = trial.expected(kernel);
            assert_eq!(result[..result.len() - 1], stored, "{kernel:?}");
            (trial, result)
        });
        let trials: Vec<_> = trials.collect();
        assert!(
            !trials.is_empty(),
            "{kernel:?} has no trial: devices would not be checked"
        );
        Self { kernel, trials }
    }

    /// Whether a trial has another result; one that ends otherwise, as by an index that is too large, has none.
    fn differs(&self, rule: Rule, trial: usize) -> bool {
        let (trial, expected) = &self.trials[trial];
        let run = || catch_unwind(AssertUnwindSafe(|| results(trial, self.kernel)));
        by(rule, run).map_or(true, |found| found != *expected)
    }
}

/// All results of a function, one after another.
fn returned(function: &Function) -> Vec<u32> {
    let mut all = Vec::new();
    function.try_results(|result| {
        all.extend(result);
        false
    });
    all
}

/// FNV's hash of words.
fn hash<'a>(words: impl IntoIterator<Item = &'a u32>) -> u64 {
    let step = |hash: u64, word: &u32| (hash ^ u64::from(*word)).wrapping_mul(0x0100_0000_01b3);
    words.into_iter().fold(0xcbf2_9ce4_8422_2325, step)
}

/// Compares all results with the recorded hashes; `UPDATE_GOLDEN=1` records them anew.
fn compare_with_recorded(tried: &[Tried], functions: &[Function], returned: &[Vec<u32>]) {
    let mut found = String::new();
    for Tried { kernel, trials } in tried {
        let words = trials.iter().flat_map(|(_, result)| result);
        found += &format!("{:016x} {kernel:?}\n", hash(words));
    }
    for (function, returned) in functions.iter().zip(returned) {
        found += &format!("{:016x} {}\n", hash(returned), function.name);
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/twins/recorded.txt");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &found).unwrap();
    }
    let recorded = std::fs::read_to_string(path).unwrap();
    let differing = found.lines().filter(|line| !recorded.contains(line));
    let differing: Vec<&str> = differing.collect();
    assert!(
        differing.is_empty(),
        "not what is recorded:\n{}",
        differing.join("\n")
    );
    assert_eq!(found.len(), recorded.len(), "others are recorded, too");
}

/// Whether a function has another result.
fn returns_else(rule: Rule, function: &Function, expected: &[u32]) -> bool {
    let (mut from, mut is_other) = (0, false);
    let compare = |result: Vec<u32>| {
        is_other = expected[from..][..result.len()] != result[..];
        from += result.len();
        is_other
    };
    by(rule, || function.try_results(compare));
    is_other
}

/// A constant is a thousandth too large.
const SLIGHT: f32 = 1.001;

/// Mistakes that change no bit of a result: the function, the beginning of the text, the factor of a constant that does
/// change one, and why.
const WITHOUT_EFFECT: [(&str, &str, Option<f32>, &str); 6] = [
    (
        "acute_arc_tangent",
        "M::F::of(1.0)",
        None,
        "the divisor of 0",
    ),
    (
        "acute_arc_tangent",
        "M::F::of(HALF_PI_LOW)",
        Some(0.5),
        "less than a rounding of the sum",
    ),
    (
        "arc_tangent",
        "M::F::of(PI_LOW)",
        Some(0.5),
        "less than a rounding of the sum",
    ),
    (
        "small_angle_cubic",
        "M::F::of(LONGEST_STEP)",
        Some(0.1),
        "SMALL_SQUARED_EXTENT is reached first",
    ),
    (
        "authored_key",
        "M::F::of(LONGEST_KEY)",
        Some(0.1),
        "stored keys are 1 or 4 long",
    ),
    (
        "continued_key",
        "M::F::of(LONGEST_KEY)",
        Some(0.1),
        "stored keys are 1 or 4 long",
    ),
];

/// The trials and functions that reach a spot: the indices of kernels with those of their trials, and of functions.
#[derive(Default)]
struct Reached {
    trials: Vec<(usize, usize)>,
    functions: Vec<usize>,
}

/// Trials with a mistake before functions are called with it; most mistakes are found by the first one.
const TRIALS_FIRST: usize = 8;

/// Functions that are called with a mistake, the simplest ones in which it is.
const FUNCTIONS: usize = 3;

/// The check's inputs and the functions' arguments reach every part of every kernel: a mistake anywhere is found.
#[test]
fn a_mistake_anywhere_is_found() {
    let (mut tried, functions) = (
        Vec::from_iter(KERNELS.iter().map(|code| Tried::new(code.kernel))),
        functions(),
    );
    let returned: Vec<_> = functions.iter().map(returned).collect();
    compare_with_recorded(&tried, &functions, &returned);
    // Small kernels first.
    tried.sort_by_key(|one| {
        one.trials
            .iter()
            .map(|(_, result)| result.len())
            .sum::<usize>()
    });
    let mut all = BTreeMap::<Spot, Reached>::new();
    for (i, Tried { kernel, trials }) in tried.iter().enumerate() {
        for (j, (trial, _)) in trials.iter().enumerate() {
            let spots = spots(|| drop(results(trial, *kernel)));
            spots
                .into_iter()
                .for_each(|spot| all.entry(spot).or_default().trials.push((i, j)));
        }
    }
    for (i, function) in functions.iter().enumerate() {
        let mut calls = 0..LISTED_CALLS;
        let spots = spots(|| function.try_results(|_| calls.next().is_none()));
        spots
            .into_iter()
            .for_each(|spot| all.entry(spot).or_default().functions.push(i));
    }
    let is_found = |spot: Spot, factor: f32| {
        let (rule, reached) = (Rule::Mistaken(spot, factor), &all[&spot]);
        let differs = |&(i, j): &(usize, usize)| tried[i].differs(rule, j);
        let (first, others) = reached
            .trials
            .split_at(reached.trials.len().min(TRIALS_FIRST));
        let mut called = reached.functions.iter().take(FUNCTIONS);
        first.iter().any(differs)
            || called.any(|&i| returns_else(rule, &functions[i], &returned[i]))
            || others.iter().any(differs)
    };
    let text = include_str!("../../shaders/compiled/entries.rs");
    let text: Vec<&str> = text.lines().collect();
    let (mut used, mut wrong) = (BTreeSet::new(), Vec::new());
    for &spot in all.keys().filter(|spot| !is_found(**spot, SLIGHT)) {
        let (line, column, kind) = spot;
        let (line, column) = (line as usize - 1, column as usize - 1);
        let before = text[..=line].iter().rev();
        let mut names = before.filter_map(|line| line.split(" fn ").nth(1)?.split('<').next());
        let (name, part) = (names.next().unwrap_or_default(), &text[line][column..]);
        let mut listed = WITHOUT_EFFECT.iter();
        let listed = listed.position(|(of, start, ..)| *of == name && part.starts_with(start));
        let is_reason_true = listed.is_some_and(|i| {
            used.insert(i);
            WITHOUT_EFFECT[i]
                .2
                .is_none_or(|factor| is_found(spot, factor))
        });
        if !is_reason_true {
            wrong.push(format!("{kind:?} in {name}: {part}"));
        }
    }
    println!(
        "{} mistakes, of which {} change no bit",
        all.len(),
        used.len()
    );
    assert!(all.len() > 1100, "only {} were tried", all.len());
    assert!(
        wrong.is_empty(),
        "not found, of {}:\n{}",
        all.len(),
        wrong.join("\n")
    );
    assert_eq!(
        used.len(),
        WITHOUT_EFFECT.len(),
        "listed mistakes are found"
    );
}
