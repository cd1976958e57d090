//! Compiles every kernel for NVIDIA's cards, without a card: `mesa-drm-shim` replaces the driver in the kernel of
//! Linux, and Mesa's NVK creates a device for which it can compile but not compute. Every instruction on floats must
//! round as the shader requires. NVIDIA's driver has another compiler. Both must obey the decorations, and both need
//! about the same number of instructions for a kernel.
//!
//! Debian 12 has no NVK. Debian 13's runs beside this system's libraries with its own loader and C library.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use super::compile::{divisions, listings, representations, statistics};
use super::table::{self, Cost};
use super::{Driver, unpacked, with_driver};

/// The head of the table of docs/gpu-compilers.md with the cost of a store on NVIDIA's processors, kernel by kernel.
const TABLE: &str = "| kernel | ga102 |";

/// Processors: the table's name, and the number by which the layer knows it.
const CHIPS: [(&str, &str); 2] = [("tu102", "162"), ("ga102", "172")];

/// A processor with so many registers for an invocation runs 16 warps or more of the 48 (64 on some) that fit.
const MAX_REGISTERS: u64 = 128;

/// One kernel as it was compiled for one processor.
struct Listing {
    statistics: BTreeMap<String, u64>,
    blocks: Vec<Block>,
}

/// Instructions of which either all are executed or none.
#[derive(Default)]
struct Block {
    id: usize,
    /// The blocks that may come next.
    next: Vec<usize>,
    /// Names of operations with their operands.
    instructions: Vec<String>,
}

impl Listing {
    fn read(text: &str) -> Self {
        let representations = representations(text);
        let assembly = representations.get("NAK assembly");
        let assembly = assembly.unwrap_or_else(|| panic!("only {:?}", representations.keys()));
        Self {
            statistics: statistics(text),
            blocks: blocks(assembly),
        }
    }

    fn statistic(&self, name: &str) -> u64 {
        let found = self.statistics.get(name);
        *found.unwrap_or_else(|| panic!("no `{name}` in {:?}", self.statistics))
    }

    /// The blocks of the loop without a loop inside that stores most, the longest of several; else all.
    fn hot(&self) -> &[Block] {
        let ends = self.blocks.iter().enumerate();
        let loops: Vec<_> = ends
            .flat_map(|(end, block)| {
                let starts = block.next.iter();
                let starts = starts.filter_map(|&id| self.blocks.iter().position(|b| b.id == id));
                starts
                    .filter(move |&start| start <= end)
                    .map(move |start| start..=end)
            })
            .collect();
        let is_innermost = |range: &&std::ops::RangeInclusive<usize>| {
            let mut others = loops.iter().filter(|other| other != range);
            !others.any(|other| range.contains(other.start()) && range.contains(other.end()))
        };
        let hot = loops.iter().filter(is_innermost);
        let hot = hot.map(|range| &self.blocks[range.clone()]);
        let stores = |name: &str| name.starts_with("st.");
        hot.max_by_key(|blocks| (count(blocks, stores), count(blocks, |_| true)))
            .unwrap_or(&self.blocks)
    }

    /// Instructions for each store of up to 16 bytes, with every branch taken: lanes of a warp that differ execute both
    /// sides. An unrolled loop has several samples, and so several stores.
    fn instructions_a_store(&self) -> u64 {
        let hot = self.hot();
        let stores = count(hot, |name| name.starts_with("st."));
        count(hot, |_| true).div_ceil(stores.max(1)) as u64
    }

    /// The instructions of a warp on its typical path from the start to the end. `trips` returns the number of
    /// iterations of a loop, from the number of stores of one iteration.
    fn typical(&self, trips: &dyn Fn(usize) -> usize) -> usize {
        self.typical_by(&|_, stores| trips(stores), PRODUCTS)
    }

    /// As [`Listing::typical`]. `trips` also gets the block at which a loop begins, and blocks with `products` products
    /// or more count as evaluating.
    fn typical_by(&self, trips: &dyn Fn(usize, usize) -> usize, products: usize) -> usize {
        let all = (0..self.blocks.len()).collect();
        let ends = |at: usize| self.blocks[at].next.is_empty();
        let walk = Walk {
            listing: self,
            trips,
            products,
            inside: &all,
            loops: &self.loops(),
        };
        walk.from(0, &ends).expect("a way to the end").instructions
    }

    /// The instructions of the typical path through the loop that stores once and lies in another loop, if there is
    /// such a loop.
    fn storing_loop(&self) -> usize {
        let loops = self.loops();
        let inner = loops.iter().filter(|(start, body)| {
            let mut others = loops.iter().filter(|(other, _)| other != start);
            others.any(|(_, other)| body.is_subset(other))
        });
        let once = (&|_: usize, _: usize| 1_usize) as &dyn Fn(usize, usize) -> usize;
        let traces = inner.map(|(start, body)| self.through(*start, body, once, PRODUCTS, &loops));
        let storing = traces.filter(|trace| trace.stores == 1);
        storing.map(|trace| trace.instructions).max().unwrap_or(0)
    }

    /// The typical path through one iteration of a loop.
    fn through(
        &self,
        start: usize,
        body: &BTreeSet<usize>,
        trips: &dyn Fn(usize, usize) -> usize,
        products: usize,
        loops: &Loops,
    ) -> Trace {
        let inner = loops
            .iter()
            .filter(|(other, inner)| **other != start && inner.is_subset(body));
        let walk = Walk {
            listing: self,
            trips,
            products,
            inside: body,
            loops: &inner.map(|(start, body)| (*start, body.clone())).collect(),
        };
        let ends = |at: usize| self.next(at).any(|next| next == start);
        walk.from(start, &ends).expect("a loop goes back")
    }

    fn next(&self, at: usize) -> impl Iterator<Item = usize> {
        let next = self.blocks[at].next.iter();
        next.filter_map(|&id| self.blocks.iter().position(|block| block.id == id))
    }

    /// The blocks of each loop, by the one where it begins.
    fn loops(&self) -> Loops {
        let mut loops = Loops::new();
        for end in 0..self.blocks.len() {
            for start in self.next(end).filter(|start| *start <= end) {
                let body = loops.entry(start).or_default();
                body.insert(start);
                let mut found = vec![end];
                while let Some(at) = found.pop() {
                    if body.insert(at) {
                        found.extend(
                            (0..self.blocks.len())
                                .filter(|&one| self.next(one).any(|next| next == at)),
                        );
                    }
                }
            }
        }
        loops
    }

    /// Every instruction on floats that may round otherwise than the shader says, but for so many reciprocals, and
    /// conversions of them to whole numbers, as there are divisions of whole numbers.
    fn inexact(&self, divisions: usize) -> Vec<&str> {
        let mut left = [divisions; 2];
        let all = self.blocks.iter().flat_map(|block| &block.instructions);
        let inexact = all.map(String::as_str).filter(|instruction| {
            let of_division = ["mufu.rcp", "f2i.u32.f32"];
            let part = of_division
                .iter()
                .position(|part| instruction.starts_with(part));
            match part.map(|part| &mut left[part]) {
                Some(left) if *left > 0 => {
                    *left -= 1;
                    false
                }
                _ => !is_exact(instruction),
            }
        });
        inexact.collect()
    }
}

/// The minimum number of products of a block that counts as evaluating.
const PRODUCTS: usize = 9;

/// The blocks of each loop, by the first of them.
type Loops = BTreeMap<usize, BTreeSet<usize>>;

/// A path through blocks. The typical path stores and evaluates the most; of several such paths, it is the shortest. So
/// it does not contain the code for runs that need the filter of tiny components, or for stores that compare each part
/// with the end of the run.
#[derive(Debug, Clone, Copy, Default)]
struct Trace {
    stores: usize,
    /// Blocks with the products of an evaluation, or with the division of a time that goes round.
    evaluations: usize,
    instructions: usize,
}

impl Trace {
    fn and(self, other: Self) -> Self {
        Self {
            stores: self.stores + other.stores,
            evaluations: self.evaluations + other.evaluations,
            instructions: self.instructions + other.instructions,
        }
    }

    fn times(self, count: usize) -> Self {
        Self {
            stores: self.stores * count,
            evaluations: self.evaluations * count,
            instructions: self.instructions * count,
        }
    }

    fn rank(&self) -> (usize, usize, Reverse<usize>) {
        (self.stores, self.evaluations, Reverse(self.instructions))
    }
}

/// Looks for the usual way among some blocks.
struct Walk<'a> {
    listing: &'a Listing,
    trips: &'a dyn Fn(usize, usize) -> usize,
    /// The products of a block that evaluates, at least.
    products: usize,
    inside: &'a BTreeSet<usize>,
    /// The loops inside, each of which is one step.
    loops: &'a Loops,
}

impl Walk<'_> {
    /// The usual way from a block to one that ends it.
    fn from(&self, at: usize, ends: &dyn Fn(usize) -> bool) -> Option<Trace> {
        self.search(at, at, ends, &mut BTreeMap::new())
    }

    fn search(
        &self,
        start: usize,
        at: usize,
        ends: &dyn Fn(usize) -> bool,
        known: &mut BTreeMap<usize, Option<Trace>>,
    ) -> Option<Trace> {
        if let Some(trace) = known.get(&at) {
            return *trace;
        }
        known.insert(at, None);
        let (step, next) = self.step(at);
        let rest = next
            .into_iter()
            .filter(|next| self.inside.contains(next) && *next != start);
        let rest = rest.filter_map(|next| self.search(start, next, ends, known));
        let rest = rest.chain(ends(at).then(Trace::default));
        let best = rest.max_by_key(Trace::rank).map(|rest| step.and(rest));
        known.insert(at, best);
        best
    }

    /// A block or a whole loop, and the blocks that may come next.
    fn step(&self, at: usize) -> (Trace, Vec<usize>) {
        let Some(body) = self.loops.get(&at) else {
            let block = std::slice::from_ref(&self.listing.blocks[at]);
            let products = count(block, |name| name.starts_with("fmul"));
            let divisions = count(block, |name| name.starts_with("mufu.rcp"));
            let trace = Trace {
                stores: count(block, is_store),
                evaluations: usize::from(products >= self.products || divisions > 0),
                instructions: count(block, |_| true),
            };
            return (trace, self.listing.next(at).collect());
        };
        let Self {
            trips, products, ..
        } = *self;
        let once = self.listing.through(at, body, trips, products, self.loops);
        let next = body.iter().flat_map(|&one| self.listing.next(one));
        let next = next.filter(|next| !body.contains(next)).collect();
        (once.times(trips(at, once.stores)), next)
    }
}

/// Whether an instruction stores into a buffer.
fn is_store(instruction: &str) -> bool {
    instruction.starts_with("st.global")
}

fn count(blocks: &[Block], counts: impl Fn(&str) -> bool) -> usize {
    let instructions = blocks.iter().flat_map(|block| &block.instructions);
    instructions
        .filter(|instruction| counts(instruction))
        .count()
}

/// The blocks of an assembler's text: `block 7 L10 [6] -> {`, instructions `@!p0 r1 = fadd.ftz r2 r3 // delay=4`, and
/// `} -> [9]` with the blocks that may come next.
fn blocks(assembly: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut current: Option<Block> = None;
    for line in assembly.lines() {
        let line = line.split("//").next().unwrap_or_default().trim();
        if let Some(rest) = line.strip_prefix("block") {
            let rest = rest.trim_start_matches(".u").trim_start();
            let digits = rest.split(' ').next().unwrap_or_default();
            current = Some(Block {
                id: digits.parse().expect("a number of a block"),
                ..Block::default()
            });
        } else if let Some(next) = line.strip_prefix("} -> [") {
            let mut block = current.take().expect("a block that ends has begun");
            let next = next.trim_end_matches(']').split(',');
            block.next = next.filter_map(|id| id.trim().parse().ok()).collect();
            blocks.push(block);
        } else if let Some(block) = &mut current
            && !line.is_empty()
        {
            let line = match line.split_once(' ') {
                Some((predicate, rest)) if predicate.starts_with('@') => rest.trim_start(),
                _ => line,
            };
            let operation = line
                .split_once(" = ")
                .map_or(line, |(_, operation)| operation);
            block.instructions.push(operation.trim().to_owned());
        }
    }
    blocks
}

/// Whether an instruction gives the bits that the shader's operations give: it is not one on floats, or it rounds once,
/// to the nearest, where the shader rounds once. The allowed instructions are listed. With `.ftz` subnormal numbers
/// count as 0, which no value depends on.
fn is_exact(instruction: &str) -> bool {
    let (name, operands) = instruction.split_once(' ').unwrap_or((instruction, ""));
    let mut parts = name.split('.').filter(|&part| part != "ftz");
    let first = parts.next().unwrap_or_default();
    let rest: Vec<&str> = parts.collect();
    match first {
        // Comparisons do not round, and one of two numbers is selected.
        "fsetp" | "fset" | "fsel" | "fmnmx" => true,
        "fadd" | "fmul" => rest.is_empty(),
        // The product with a power of two is exact, and the sum is rounded once.
        "ffma" => rest.is_empty() && operands.split_whitespace().take(2).any(is_power_of_two),
        // To half precision, to the nearest; with `.ftz` subnormal inputs count as 0.
        "f2f" => rest == ["f16", "f32", "re"],
        // Exact for whole numbers below 2^24.
        "i2f" | "i2f32" => rest
            .iter()
            .all(|part| ["f32", "i32", "u32", "re"].contains(part)),
        _ => !FLOATS.iter().any(|float| first.starts_with(float)) && !name.contains(".f32"),
    }
}

/// How names of operations on floats begin.
const FLOATS: [&str; 10] = ["mufu", "fa", "fc", "ff", "fm", "fs", "f2", "h", "d", "rro"];

/// Whether an operand is a constant of some power of two, with either sign.
fn is_power_of_two(operand: &str) -> bool {
    let digits = operand.trim_start_matches('-').strip_prefix("0x");
    let value = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
    value
        .map(f32::from_bits)
        .is_some_and(|value| value.is_normal() && value.to_bits() & 0x7f_ffff == 0)
}

/// This program with NVK for a chip.
fn program(loader: &Path, chip: &str) -> Command {
    let manifest = loader.with_file_name("nouveau_icd.json");
    let mut program = Driver::of(&manifest).this_program("libnouveau_noop_drm_shim.so");
    program
        .env("NOUVEAU_CHIPSET", chip)
        .env("NVK_I_WANT_A_BROKEN_VULKAN_DRIVER", "1"); // Turing and Ampere need it in some versions
    with_driver(&mut program, &manifest);
    program
}

fn compiled(
    loader: &Path,
    chip: (&str, &str),
    kernels: &[&str],
    is_bare: bool,
) -> Vec<(String, Listing)> {
    let label = format!("nvk-{}-{}", chip.0, kernels.len());
    let texts = listings(&mut program(loader, chip.1), &label, kernels, is_bare);
    let texts = texts.into_iter();
    texts
        .map(|(name, text)| (name, Listing::read(&text)))
        .collect()
}

/// The heads of the tables of docs/gpu-compilers.md with what is predicted for cards, in either order of the result.
const PREDICTIONS: [(Order, &str); 2] = [
    (Order::Tracks, "| kernel | of 48 | of 200 |"),
    (Order::Frames, "| frame by frame | of 48 | of 200 |"),
];

/// The order of values in a result: the lanes of a run have neighbouring samples of a track, or neighbouring tracks.
#[derive(Clone, Copy, PartialEq)]
enum Order {
    Tracks,
    Frames,
}

/// A kernel over spread runs: the parts of a value and its bytes, and the most instructions that a sample of a run of
/// 200 may take, in either order.
struct Goal {
    kernel: &'static str,
    parts: usize,
    bytes: usize,
    max: [Option<usize>; 2],
}

const fn goal(
    kernel: &'static str,
    parts: usize,
    bytes: usize,
    track_by_track: Option<usize>,
    frame_by_frame: Option<usize>,
) -> Goal {
    Goal {
        kernel,
        parts,
        bytes,
        max: [track_by_track, frame_by_frame],
    }
}

const GOALS: [Goal; 10] = [
    goal("arc_frames_spread_f32", 1, 16, Some(66), Some(54)),
    goal("polynomial_frames_spread_f32", 1, 16, Some(120), Some(104)),
    goal("arc_frames_spread_f16_converting", 1, 8, Some(72), Some(66)),
    goal("polynomial_frames_spread_f16_converting", 1, 8, None, None),
    goal("arc_frames_spread_matrix3x4", 3, 48, Some(240), Some(200)),
    goal("polynomial_frames_spread_matrix3x4", 3, 48, None, None),
    goal("arc_frames_spread_matrix3x3", 9, 36, None, None),
    goal("arc_frames_spread_six_d", 6, 24, None, None),
    goal("arc_frames_spread_axis_angle", 1, 16, None, None),
    goal("arc_frames_spread_euler", 3, 12, None, None),
];

impl Goal {
    /// Instructions of a warp for each of its lanes' samples, in runs of so many.
    fn instructions(&self, listing: &Listing, samples: usize, order: Order) -> usize {
        match order {
            Order::Tracks => self.track_by_track(listing, samples),
            Order::Frames => self.frame_by_frame(listing, samples),
        }
    }

    /// Of runs that begin in the middle of a line. A run has eight lanes, and is cut after 32 iterations.
    fn track_by_track(&self, listing: &Listing, samples: usize) -> usize {
        const LANES: usize = 8;
        const IDLE: usize = LANES / 2;
        const CUT: usize = 32 * LANES;
        let mut all = 0;
        for done in (0..samples).step_by(CUT) {
            let end = IDLE + (samples - done).min(CUT);
            let iterations = end.div_ceil(LANES);
            if self.parts > 1 {
                all += self.together(listing, iterations);
                // In the first and the last iteration of a run, a loop compares each part with the end of the run and
                // stores it.
                all += 2 * self.parts * listing.storing_loop();
            } else {
                all += alone(listing, iterations, end / LANES);
            }
        }
        (all * LANES).div_ceil(samples)
    }

    /// Each lane has the whole run of its track, cut into pieces of at most 32 samples that are about as long as each
    /// other.
    fn frame_by_frame(&self, listing: &Listing, samples: usize) -> usize {
        let pieces = samples.div_ceil(32);
        let each = samples.div_ceil(pieces);
        let of_piece = match self.parts {
            1 => alone(listing, each, each),
            _ => self.together(listing, each),
        };
        of_piece.div_ceil(each)
    }

    /// As `spread/together.wgsl` goes through whole lines.
    fn together(&self, listing: &Listing, iterations: usize) -> usize {
        listing.typical(&|stores| if stores > 1 { iterations } else { self.parts })
    }

    /// The predicted time of a dispatch over 4096 tracks of 1200 frames on an H200, µs. It is limited by the instructions
    /// of each sample and by the bytes that are written.
    fn time(&self, instructions: usize) -> f64 {
        const SAMPLES: f64 = 4096.0 * 1200.0;
        time_on_h200(
            instructions as f64 * SAMPLES / 32.0,
            self.bytes as f64 * SAMPLES,
        )
    }
}

/// The predicted time on an H200 of so many instructions of warps and bytes that are written, µs.
fn time_on_h200(instructions: f64, bytes: f64) -> f64 {
    // 0.147 µs for each instruction of the warps that have 4096 × 1200 samples.
    let issued = 0.147 * instructions / (4096.0 * 1200.0 / 32.0);
    let written = bytes / 4.18e6;
    (issued.powi(3) + written.powi(3)).cbrt()
}

/// The instructions of `spread/alone.wgsl` for a run, which divides the iterations behind the first one: `full` have a
/// sample in every lane.
fn alone(listing: &Listing, iterations: usize, full: usize) -> usize {
    let pairs = full.div_ceil(2) - 1;
    listing.typical(&|stores| match stores {
        2 => pairs,
        _ => iterations - 1 - 2 * pairs,
    })
}

/// The kernels for cards take no more instructions than planned, and about as many as the table says.
#[test]
fn samples_take_as_many_instructions_as_planned() {
    let Some(loader) = unpacked("nvk/loader") else {
        return;
    };
    let kernels = Vec::from_iter(GOALS.iter().map(|goal| goal.kernel));
    let listings = compiled(&loader, CHIPS[1], &kernels, false);
    let listings = BTreeMap::from_iter(listings);
    let mut wrong = Vec::new();
    for (index, (order, head)) in PREDICTIONS.into_iter().enumerate() {
        let mut rows = BTreeMap::new();
        for goal in &GOALS {
            let listing = &listings[goal.kernel];
            let [short, long] = [48, 200].map(|n| goal.instructions(listing, n, order));
            if let Some(max) = goal.max[index].filter(|max| long > *max) {
                wrong.push(format!(
                    "{head} {}: {long} instructions, not {max}",
                    goal.kernel
                ));
            }
            let time = format!("{:.1}", goal.time(long));
            rows.insert(goal.kernel, vec![short.to_string(), long.to_string(), time]);
        }
        wrong.extend(table::check_rows(head, &rows));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The head of the table of docs/gpu-compilers.md with what is predicted for crowds.
const CROWDS: &str = "| crowd | instructions | predicted |";

/// A result of a crowd: the name of its row, the kernel, the bytes of a joint, and the most instructions of a warp for an
/// instance.
struct CrowdGoal {
    row: &'static str,
    kernel: &'static str,
    bytes: usize,
    max: Option<usize>,
}

const fn crowd(
    row: &'static str,
    kernel: &'static str,
    bytes: usize,
    max: Option<usize>,
) -> CrowdGoal {
    CrowdGoal {
        row,
        kernel,
        bytes,
        max,
    }
}

const ROTATIONS: &str = "crowd_subgroup_rotations";
const HALVES: &str = "crowd_subgroup_rotations_f16_converting";
const MATRICES: &str = "crowd_plain_whole_matrices";

const CROWD_GOALS: [CrowdGoal; 4] = [
    crowd("rotations", ROTATIONS, 16, Some(260)),
    crowd("rotations, f16", HALVES, 8, Some(280)),
    crowd("local", MATRICES, 48, Some(900)),
    crowd("model", MATRICES, 48, Some(1500)),
];

const INSTANCES: f64 = 10_000.0;
const JOINTS: usize = 60;

/// Crowds of 60 joints and 61 keys, whose clips go round: rotations by arcs, other channels constant.
#[test]
fn crowds_take_as_many_instructions_as_planned() {
    let Some(loader) = unpacked("nvk/loader") else {
        return;
    };
    let kernels = [ROTATIONS, HALVES, MATRICES];
    let listings = BTreeMap::from_iter(compiled(&loader, CHIPS[1], &kernels, false));
    let mut wrong = Vec::new();
    let mut rows = BTreeMap::new();
    for goal in &CROWD_GOALS {
        let listing = &listings[goal.kernel];
        let instructions = match (goal.kernel, goal.row) {
            (MATRICES, "local") => instance_of_matrices(listing, 0),
            (MATRICES, _) => instance_of_matrices(listing, 10),
            _ => instance_of_rotations(listing),
        };
        if let Some(max) = goal.max.filter(|max| instructions > *max) {
            wrong.push(format!(
                "{}: {instructions} instructions, not {max}",
                goal.row
            ));
        }
        let bytes = (goal.bytes * JOINTS) as f64 * INSTANCES;
        let time = time_on_h200(instructions as f64 * INSTANCES, bytes);
        rows.insert(
            goal.row,
            vec![instructions.to_string(), format!("{time:.1}")],
        );
    }
    wrong.extend(table::check_rows(CROWDS, &rows));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The instructions of a warp for the rotations of an instance, of the four of a subgroup.
fn instance_of_rotations(listing: &Listing) -> usize {
    // Eight lanes find one of 60 spans in two steps. Seven times all lanes have a joint; after that, only some lanes
    // have one.
    let trips = |stores| if stores == 0 { 2 } else { 7 };
    listing.typical(&trips).div_ceil(4)
}

/// The instructions of both warps of a workgroup for the matrices of an instance, of four, whose skeleton has so many
/// levels of at most eight joints below the roots.
fn instance_of_matrices(listing: &Listing, levels: usize) -> usize {
    let loops = listing.loops();
    let has = |start: usize, name: &str| {
        let body = loops[&start].iter().map(|&at| &listing.blocks[at]);
        let mut instructions = body.flat_map(|block| &block.instructions);
        instructions.any(|instruction| instruction.starts_with(name))
    };
    let is_inner = |start: usize| {
        let mut others = loops.iter().filter(|(other, _)| **other != start);
        others.any(|(_, other)| other.is_superset(&loops[&start]))
    };
    // The loops are distinguished by their instructions. Joints are read from buffers and written to the workgroup's
    // memory; the loop over levels changes this memory, and the loop of stores reads it.
    let trips = |start: usize, of_first: bool| match (is_inner(start), has(start, "st.shared")) {
        // 720 rows remain after the first ones.
        _ if has(start, "st.global") => 10 + usize::from(of_first),
        // The joints of a level are those of the first warp.
        (true, true) => usize::from(of_first),
        // One of 60 spans is found by six loads.
        (true, false) if has(start, "ld.global") => 6,
        (true, false) => 0,
        (false, true) if has(start, "bar.sync") => levels,
        (false, true) if has(start, "mufu.rcp") => usize::from(of_first),
        (false, true) => 4,
        (false, false) => 0,
    };
    // Only blocks with 13 products or more count as evaluating. So the path avoids curves of translations and scales
    // (ten products) and products with inverse bind matrices (twelve).
    let warp = |of_first| listing.typical_by(&|start, _| trips(start, of_first), 13);
    (warp(true) + warp(false)).div_ceil(4)
}

#[test]
fn every_kernel_is_exact_and_costs_what_the_table_says() {
    let Some(loader) = unpacked("nvk/loader") else {
        return;
    };
    let mut wrong = Vec::new();
    let mut costs = BTreeMap::new();
    for chip in CHIPS {
        let listings = compiled(&loader, chip, &[], false);
        assert!(listings.len() > 100, "{}: {}", chip.0, listings.len());
        for (kernel, listing) in listings {
            let mut fault = |fault: String| wrong.push(format!("{}, {kernel}: {fault}", chip.0));
            for instruction in listing.inexact(divisions(&kernel)) {
                fault(format!("`{instruction}` is not exact"));
            }
            let spilled = listing.statistic("SLM Size");
            if spilled > 0 {
                fault(format!("{spilled} bytes of registers are spilled"));
            }
            let registers = listing.statistic("Number of GPRs");
            if registers > MAX_REGISTERS {
                fault(format!("{registers} registers"));
            }
            let instructions = listing.instructions_a_store();
            costs.insert(
                (kernel, chip.0),
                Cost {
                    instructions,
                    registers,
                },
            );
        }
    }
    wrong.extend(table::check(TABLE, &costs));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The negative control: without the exactness pass the same compiler fuses, and the judge sees it.
#[test]
fn without_the_pass_products_and_sums_are_fused() {
    let Some(loader) = unpacked("nvk/loader") else {
        return;
    };
    let kernels = ["arc_frames_f32", "polynomial_frames_f32"];
    for (kernel, listing) in compiled(&loader, CHIPS[1], &kernels, true) {
        let fused = listing.inexact(0);
        let fused = fused.iter().filter(|line| line.starts_with("ffma"));
        assert!(fused.count() > 10, "{kernel}");
    }
}

/// The judge can refuse, and knows what it may not.
#[test]
fn what_rounds_otherwise_is_refused() {
    for line in [
        "fadd.ftz r1 r2 r3",
        "fmul r1 0x3f000000 -r3",
        "fsetp.lt.ftz r1 |r2|",
        "fmnmx.ftz r1 r2 pT",
        "i2f.f32.i32.re r3",
        "i2f32 r3",
        "ffma.ftz r1 0x40000000 r3",
        "f2f.f16.f32.re r1",
        "imad r1 r2 r3",
        "ldc.b32 c[0x0][0x4]",
        "shf.l.w.u32 r1 rZ 0x5",
    ] {
        assert!(is_exact(line), "{line}");
    }
    for line in [
        "ffma r1 r2 r3",
        "ffma.ftz r1 0x40400000 r3",
        "ffma.ftz r1 r2 0x40000000",
        "fadd.rz r1 r2",
        "fmul.ftz.sat r1 r2",
        "mufu.rsq r1",
        "f2f.f16.f32.rz r1",
        "f2i.u32.f32.rz.ftz r1",
        "i2f.f32.u32.rz r1",
        "hfma2 r1 r2 r3",
        "dfma r1 r2 r3",
    ] {
        assert!(!is_exact(line), "{line}");
    }
}

#[test]
fn the_loop_over_samples_is_found() {
    let text = "block.u 0 [] -> {\n ur0 = s2r sr[0x25] // delay=1 wr:0\n} -> [1]\nblock 1 L0 [0, 2] -> {\n\
                @!p0            bra pT L1\n r1 = fmul.ftz r2 r3\n} -> [2, 3]\nblock.u 2 L1 [1] -> {\n\
                st.global.a64.strong.gpu.b128 [r4..6+rZ] r0..4 // delay=1\n\
                st.global.a64.strong.gpu.b128 [r6..8+rZ] r0..4\n r1 p1 = iadd3 r1 r2 rZ\n} -> [1]\n\
                block 3 [1] -> {\n exit\n} -> []\n";
    let listing = Listing {
        statistics: BTreeMap::new(),
        blocks: blocks(text),
    };
    assert_eq!(listing.hot().len(), 2);
    assert_eq!(count(&listing.blocks, |_| true), 7);
    // Five instructions, two stores.
    assert_eq!(listing.instructions_a_store(), 3);
    assert_eq!(
        listing.blocks[1].instructions,
        ["bra pT L1", "fmul.ftz r2 r3"]
    );
}
