//! Every kernel compiled for NVIDIA's processors, none of which need be there: Mesa's NVK on a layer that stands in
//! for the kernel's driver (`mesa-drm-shim`) makes a device that cannot compute, and compiles for it.
//! Every instruction on floats must round as the shader says. NVIDIA's driver has a compiler of its own; both must
//! obey the decorations, and both need nearly as many instructions for a kernel.
//!
//! Debian 12 has no NVK. Debian 13's runs beside this system's libraries with its own loader and C library.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use super::compile::{divisions, listings, representations, statistics};
use super::table::{self, Cost};
use super::{unpacked, with_driver};

/// The head of the table of docs/gpu.md with the cost of a store on NVIDIA's processors, kernel by kernel.
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

    /// The blocks of the longest loop without a loop inside, else all.
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
        hot.max_by_key(|blocks| count(blocks, |_| true))
            .unwrap_or(&self.blocks)
    }

    /// Instructions for each store of up to 16 bytes, with every branch taken: lanes of a warp that differ execute both
    /// sides. An unrolled loop has several samples, and so several stores.
    fn instructions_a_store(&self) -> u64 {
        let hot = self.hot();
        let stores = count(hot, |name| name.starts_with("st."));
        count(hot, |_| true).div_ceil(stores.max(1)) as u64
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
    let folder = loader.parent().unwrap();
    let mut program = Command::new(loader);
    program
        .arg("--library-path")
        .arg(folder)
        .arg("--preload")
        .arg(folder.join("libnouveau_noop_drm_shim.so"))
        .arg(std::env::current_exe().unwrap())
        .env("NOUVEAU_CHIPSET", chip)
        .env("NVK_I_WANT_A_BROKEN_VULKAN_DRIVER", "1"); // Turing and Ampere need it in some versions
    with_driver(&mut program, &folder.join("nouveau_icd.json"));
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
