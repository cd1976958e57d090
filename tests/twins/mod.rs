//! Every function of the shaders against its twin, without a device: the functions are evaluated as
//! naga reads them from the text that is compiled, an operation at a time, and every bit of
//! every result has to be the twin's. `tests/bit_identity.rs` compares whole results on devices; here
//! a function that differs is named, with the arguments that show it.
//!
//! The twins are private to the engine, so this is a test of the library: `src/twin/mod.rs` includes
//! it.

mod cells;
mod coalesced;
mod crowd;
mod crowd_lines;
mod frame;
mod functions;
mod kernels;
mod layout;
mod lines;
mod machine;
mod operations;
mod poses;
mod program;
mod stores;
mod trial;
mod whole_instances;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use naga::{BinaryOperator, Expression, Literal, Module};

use crate::gpu::kernel_check::random::Random;
use operations::FloatMode;
use program::{Checked, Program};
use trial::Twin;

/// Samples of each function; `SOAK` asks for more.
const SAMPLES: usize = 50_000;
const SOAKED: usize = 200_000;
/// Samples of a function with a mistake, of which the first that differs is enough.
const SAMPLES_OF_MISTAKES: usize = 20_000;

fn twins() -> Vec<Twin> {
    let mut all = functions::math();
    all.extend(functions::forms());
    all.extend(functions::from_keys());
    all.extend(functions::conversions());
    all.extend(stores::stores());
    all.extend(stores::readers());
    all.extend(stores::keys());
    all.extend(kernels::evaluation());
    all.extend(coalesced::coalesced());
    all.extend(poses::poses());
    all.extend(crowd::entries());
    all.extend(crowd::times());
    all.extend(crowd::layers());
    all.extend(crowd::matrices());
    all.extend(whole_instances::whole_instances());
    all.push(poses::self_test());
    all
}

/// The functions whose mistakes show in a twin's results: its function, and, of a kernel's `store`, those of
/// the same file that have no entry in the table.
fn covered(twin: &Twin, twins: &[Twin]) -> Vec<String> {
    let mut names = vec![twin.function.to_owned()];
    if twin.function == "store" {
        let has_entry = |name: &String| {
            let mut of_kernel = twins.iter().filter(|other| other.kernel == twin.kernel);
            of_kernel.any(|other| other.function == name)
        };
        names.extend(
            stores::functions_of_file(twin.kernel)
                .into_iter()
                .filter(|name| !has_entry(name)),
        );
    }
    names
}

/// Functions without a twin, and why.
const WITHOUT: [(&str, &str); 4] = [
    (
        "invocation_index",
        "tells invocations apart; `main` calls it",
    ),
    (
        "segment_of",
        "chooses what `segment_at` reads; `main` calls it",
    ),
    (
        "hoisted",
        "gathers the arguments of `rotation_between`; `main` calls it",
    ),
    (
        "rotation_between",
        "one step of a block of lanes; `main` calls it",
    ),
];

/// The text of a kernel as it is compiled.
fn source(kernel: &str) -> &'static str {
    static ALL: LazyLock<BTreeMap<String, String>> = LazyLock::new(tumble_shaders::sources);
    ALL.get(kernel)
        .unwrap_or_else(|| panic!("no kernel {kernel}"))
}

/// The kernels of the table, each read once.
fn kernels(twins: &[Twin]) -> BTreeMap<&'static str, Checked> {
    let names: BTreeSet<&str> = twins.iter().map(|twin| twin.kernel).collect();
    names
        .into_iter()
        .map(|name| (name, Checked::parse(source(name))))
        .collect()
}

/// The same, as they run on a device that keeps or flushes subnormals.
fn programs(twins: &[Twin], arithmetic: FloatMode) -> BTreeMap<&'static str, Program> {
    let program = |(name, checked): (_, Checked)| (name, checked.program(arithmetic));
    kernels(twins).into_iter().map(program).collect()
}

#[test]
fn every_shader_function_has_the_bits_of_its_twin() {
    let twins = twins();
    let programs = programs(&twins, FloatMode::AsWritten);
    let samples = match std::env::var_os("SOAK") {
        Some(_) => SOAKED,
        None => SAMPLES,
    };
    for twin in &twins {
        if let Err(why) = twin.compare(&programs[twin.kernel], Random::new(), samples) {
            panic!("{why}");
        }
    }
}

/// What a kernel ends in: their results are what callers see.
const RESULTS: [&str; 4] = ["main", "pose", "crowd_work", "store"];

/// A driver may take numbers smaller than the least normal one for 0, in any operation. Of inputs as the
/// host gives them no result depends on it.
#[test]
fn results_are_the_same_where_subnormals_are_flushed() {
    results_are_the_same(FloatMode::SubnormalsFlushed);
}

/// Metal's compiler gets every product as a fused sum with +0, which has no negative zeros. No result depends
/// on the sign of a product that is 0.
#[test]
fn results_are_the_same_where_products_are_fused_with_zero() {
    results_are_the_same(FloatMode::ProductsFused);
}

fn results_are_the_same(arithmetic: FloatMode) {
    let twins = twins();
    let programs = programs(&twins, arithmetic);
    // The numbers of the self-test are chosen; they are compared on devices.
    let is_result = |twin: &&Twin| RESULTS.contains(&twin.function) && twin.kernel != "self_test";
    let results: Vec<&Twin> = twins.iter().filter(is_result).collect();
    assert!(results.len() >= 30, "only {} were tried", results.len());
    let compare = |twin: &&Twin| {
        let program = &programs[twin.kernel];
        twin.compare(program, Random::canonical(), SAMPLES).err()
    };
    let differing: Vec<String> = results.iter().filter_map(compare).collect();
    assert!(differing.is_empty(), "{}", differing.join("\n\n"));
}

/// Every function of every kernel, as it is named and as it is written. Kernels share most.
fn functions_of_kernels() -> BTreeMap<(String, String), &'static str> {
    let mut all = BTreeMap::new();
    for (kernel, _) in crate::shader::kernels() {
        let text = source(kernel);
        let module =
            naga::front::wgsl::parse_str(text).expect("the compiler of the shaders parses it too");
        for (handle, function) in module.functions.iter() {
            let name = function.name.clone().expect("functions in WGSL have names");
            let range = module
                .functions
                .get_span(handle)
                .to_range()
                .expect("parsed from text");
            all.insert((name, text[range].to_owned()), kernel);
        }
        let (_, entry) = text.split_once("\nfn main").expect("an entry point");
        let (entry, _) = entry.split_once("\n}").expect("it ends");
        all.insert(("main".to_owned(), entry.to_owned()), kernel);
    }
    all
}

#[test]
fn every_shader_function_is_compared() {
    let twins = twins();
    let functions = functions_of_kernels();
    for (listed, _) in WITHOUT {
        let is_function = functions.keys().any(|(name, _)| name == listed);
        assert!(is_function, "no kernel has a function {listed}");
    }
    let covered_functions: Vec<_> = twins
        .iter()
        .map(|twin| (twin.kernel, covered(twin, &twins)))
        .collect();
    for ((name, text), kernel) in functions {
        let is_compared = covered_functions
            .iter()
            .any(|(kernel, names)| names.contains(&name) && source(kernel).contains(&text));
        let is_listed = WITHOUT.iter().any(|(listed, _)| *listed == name);
        assert!(
            is_compared || is_listed,
            "{name} of {kernel} has no twin in the table"
        );
        assert!(
            !(is_compared && is_listed),
            "{name} of {kernel} is compared and listed"
        );
    }
}

/// What a mistake is likely to be: a sum for a difference or for a product, a difference for a sum,
/// a constant that is a thousandth too large.
fn mistake(module: &Module, expression: &Expression) -> Option<Expression> {
    use BinaryOperator::{Add, Multiply, Subtract};
    match *expression {
        Expression::Binary { op, left, right } => {
            let op = match op {
                Add => Subtract,
                Subtract | Multiply => Add,
                _ => return None,
            };
            Some(Expression::Binary { op, left, right })
        }
        Expression::Literal(Literal::F32(value)) if value != 0.0 => {
            Some(Expression::Literal(Literal::F32(value * 1.001)))
        }
        Expression::Constant(named) => {
            let init = module.constants[named].init;
            mistake(module, &module.global_expressions[init])
        }
        _ => None,
    }
}

/// Constants, and a part of their lines, of which a thousandth does not count, and why.
const COARSE: [(&str, &str, &str); 4] = [
    (
        "HALF_PI_LOW",
        "HALF_PI - flat",
        "less than a rounding of the sum",
    ),
    ("PI_LOW", "PI - acute", "less than a rounding of the sum"),
    ("1.0", "large == 0.0", "the divisor of 0"),
    (
        "LONGEST_STEP",
        "norm_squared(chord)",
        "SMALL_SQUARED_EXTENT is reached first",
    ),
];

/// The samples reach every part of every function: a mistake anywhere is found.
#[test]
fn a_mistake_anywhere_is_found() {
    let twins = twins();
    let kernels = kernels(&twins);
    // Where there is one to be found, and whether it was. The entry point of all kernels that read
    // keys is the same, and has arguments that only one of them uses.
    let mut mistakes = BTreeMap::new();
    let tried = twins.iter().flat_map(|twin| {
        covered(twin, &twins)
            .into_iter()
            .map(move |name| (twin, name))
    });
    for (twin, name) in tried {
        let checked = &kernels[twin.kernel];
        let (mut program, text) = (checked.program(FloatMode::AsWritten), source(twin.kernel));
        let index = twin.index_of(&name, &program);
        let (function, info) = checked.functions()[index];
        for (at, expression) in function.expressions.iter() {
            let Some(wrong) = mistake(&checked.module, expression) else {
                continue;
            };
            let span = function.expressions.get_span(at);
            let line = span.location(text).line_number as usize;
            let line = text.lines().nth(line - 1).unwrap_or_default().to_owned();
            let range = span.to_range().map_or("", |range| &text[range]).to_owned();
            let is_found = mistakes.entry((line, range)).or_insert(false);
            if *is_found {
                continue; // in another kernel that it is joined into
            }
            let mut changed = function.clone();
            *changed.expressions.get_mut(at) = wrong;
            program.functions[index] = checked.compiled(&changed, info);
            *is_found = twin
                .compare(&program, Random::new(), SAMPLES_OF_MISTAKES)
                .is_err();
        }
    }
    assert!(mistakes.len() > 850, "only {} were tried", mistakes.len());
    for ((line, range), is_found) in mistakes {
        let is_coarse = COARSE
            .iter()
            .any(|(constant, part, _)| range == *constant && line.contains(part));
        assert!(
            is_found != is_coarse,
            "`{range}` in `{line}`: found is {is_found}"
        );
    }
}
