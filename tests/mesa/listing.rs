//! Reads RADV's listing of a compiled kernel: statistics and instructions. Every instruction that computes
//! with floats must round as the shader does.

use std::collections::BTreeMap;

use super::compile::{representations, statistics};

/// AMD's generations of processors for graphics, as far as arithmetic differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Generation {
    /// Its `v_mad_f32` and `v_mac_f32` round the product, then the sum.
    Gcn,
    /// On these, every multiply-add rounds once.
    Rdna,
}

/// One kernel as one driver compiled it for one processor.
pub(super) struct Listing {
    statistics: BTreeMap<String, u64>,
    instructions: Vec<String>,
    /// The index in `instructions` that each label stands before.
    labels: BTreeMap<String, usize>,
}

impl Listing {
    /// From the child's file: of the representations the assembler's, else, where the driver has
    /// no assembler for the processor, that of its compiler after registers are allocated.
    pub(super) fn read(text: &str) -> Self {
        let representations = representations(text);
        let of = |name: &str| {
            let lines = representations.get(name).copied().unwrap_or_default();
            Self::of_lines(lines.lines())
        };
        let mut listing = of("Assembly");
        if listing.vector_instructions() == 0 {
            listing = of("ACO IR");
        }
        assert!(
            listing.vector_instructions() > 0,
            "no instructions in {:?}",
            representations.keys()
        );
        listing.statistics = statistics(text);
        listing
    }

    fn of_lines<'a>(lines: impl Iterator<Item = &'a str>) -> Self {
        let mut listing = Self {
            statistics: BTreeMap::new(),
            instructions: Vec::new(),
            labels: BTreeMap::new(),
        };
        for line in lines {
            let line = line.split(';').next().unwrap_or_default().trim();
            let first = line.split([' ', ':']).next().unwrap_or_default();
            if first.strip_prefix("BB").is_some_and(is_number) {
                let index = listing.instructions.len();
                listing.labels.insert(first.to_owned(), index);
                continue;
            }
            let instruction = match line.rsplit_once(" = ") {
                Some((_, instruction)) => as_assembler(instruction),
                None => line.to_owned(),
            };
            if instruction.starts_with(|letter: char| letter.is_ascii_lowercase()) {
                listing.instructions.push(instruction);
            }
        }
        listing
    }

    pub(super) fn statistic(&self, name: &str) -> u64 {
        let found = self.statistics.get(name);
        *found.unwrap_or_else(|| panic!("no `{name}` in {:?}", self.statistics))
    }

    fn vector_instructions(&self) -> usize {
        count_vector(&self.instructions)
    }

    /// The vector instructions of the longest loop without a loop inside, or of the whole kernel: those
    /// for a sample, whether a kernel walks over the samples of an item or evaluates one.
    pub(super) fn vector_instructions_a_sample(&self) -> usize {
        let mut loops = Vec::new();
        for (index, instruction) in self.instructions.iter().enumerate() {
            let (_, operands) = instruction.split_once("branch").unwrap_or_default();
            let words = operands.split(|letter: char| !letter.is_ascii_alphanumeric());
            let targets = words.filter_map(|word| self.labels.get(word));
            loops.extend(
                targets
                    .filter(|&&start| start <= index)
                    .map(|&start| start..index),
            );
        }
        let is_innermost = |range: &&std::ops::Range<usize>| {
            let mut others = loops.iter().filter(|other| other != range);
            !others.any(|other| range.start <= other.start && other.end <= range.end)
        };
        let lengths = loops.iter().filter(is_innermost);
        lengths
            .map(|range| count_vector(&self.instructions[range.clone()]))
            .max()
            .unwrap_or_else(|| self.vector_instructions())
    }

    /// Every instruction on floats that may round otherwise than the shader says.
    pub(super) fn inexact(&self, generation: Generation) -> Vec<&str> {
        let halves = self.instructions.iter().flat_map(|line| line.split("::"));
        halves
            .map(str::trim)
            .filter(|one| !is_exact(one, generation))
            .collect()
    }
}

/// Whether an instruction is an exact one whose result is halved. Half of a rounded number is exact, but for subnormal
/// numbers and the sign of zero: only for kernels no value of which depends on these.
pub(super) fn is_exact_half(instruction: &str, generation: Generation) -> bool {
    let whole = instruction.strip_suffix(" div:2");
    whole.is_some_and(|whole| is_exact(whole, generation))
}

/// An instruction of the compiler's text, which writes what is defined before it, in the order of
/// the assembler's operands.
fn as_assembler(instruction: &str) -> String {
    let (name, operands) = instruction.split_once(' ').unwrap_or((instruction, ""));
    let mut operands: Vec<&str> = operands.split(',').map(str::trim).collect();
    if name.starts_with("v_fmamk") || name.starts_with("v_madmk") {
        operands.swap(1, 2); // the constant is last there, and is multiplied with
    }
    format!("{name} defined, {}", operands.join(", "))
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

fn count_vector(instructions: &[String]) -> usize {
    let is_vector = |line: &&String| line.starts_with("v_");
    instructions.iter().filter(is_vector).count()
}

/// Whether an instruction gives the bits that the shader's operations give: it is not one on
/// floats, or it rounds once where the shader rounds once. The allowed instructions are listed, so
/// that an unknown one is refused.
fn is_exact(instruction: &str, generation: Generation) -> bool {
    let (name, operands) = instruction.split_once(' ').unwrap_or((instruction, ""));
    let Some(name) = name.strip_prefix("v_").or_else(|| name.strip_prefix("s_")) else {
        return true; // memory
    };
    let name = name.strip_prefix("dual_").unwrap_or(name);
    let ending = name.find("_e32").or_else(|| name.find("_e64"));
    let name = &name[..ending.unwrap_or(name.len())];
    let name = name.trim_end_matches("_sdwa").trim_end_matches("_dpp");
    let is_float = ["f16", "f32", "f64", "fp8", "bf8", "dot", "mix"];
    if !is_float.iter().any(|sign| name.contains(sign)) {
        return true;
    }
    let modifiers = ["mul:", "div:", "clamp", "*2", "*4", "*0.5"];
    if modifiers.iter().any(|sign| operands.contains(sign)) {
        return false;
    }
    let operands: Vec<&str> = operands.split(',').map(str::trim).collect();
    let is_power = |i: usize| {
        operands
            .get(i)
            .is_some_and(|operand| is_power_of_two(operand))
    };
    match name {
        "add_f32" | "sub_f32" | "subrev_f32" | "mul_f32" => true,
        // The result is one of the operands, so it is not rounded. The compiler makes this instruction of a comparison
        // and a selection. They differ only for NaN and for the sign of zero.
        "min_f32" | "max_f32" | "min_num_f32" | "max_num_f32" => true,
        "cvt_f32_i32" | "cvt_f32_u32" | "cvt_f32_ubyte0" | "cvt_f32_ubyte1" | "cvt_f32_ubyte2"
        | "cvt_f32_ubyte3" => true,
        // The exactness pass allows this conversion in kernels that specify its rounding.
        "cvt_f16_f32" => true,
        // The same conversion; the product with 1 and the sum with -0 before it change nothing.
        "fma_mixlo_f16" | "fma_mixhi_f16" => {
            let zero = operands.get(3).copied().unwrap_or_default();
            operands.get(1) == Some(&"1.0") && (zero.starts_with("neg(0)") || zero == "neg(lo(0))")
        }
        // Packs two halves into a word. In a mode that flushes subnormal numbers, this would flush them. But kernels
        // that convert request a mode that keeps them, and Mesa uses this instruction only in that mode.
        "pack_b32_f16" => true,
        _ if name.starts_with("cmp_") || name.starts_with("cmpx_") => true,
        "mad_f32" | "mac_f32" | "madak_f32" | "madmk_f32" => generation == Generation::Gcn,
        // The product with a power of two is exact, and the sum is rounded once.
        "fma_f32" | "fmac_f32" | "fmamk_f32" | "fmaak_f32" => is_power(1) || is_power(2),
        _ => false,
    }
}

/// Whether an operand is a constant of some power of two, with either sign.
fn is_power_of_two(operand: &str) -> bool {
    let operand = operand.trim_start_matches('-');
    let value = match operand.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).map(f32::from_bits).ok(),
        None => operand.parse().ok().filter(|_| operand.contains('.')),
    };
    const MANTISSA: u32 = 0x7f_ffff;
    value.is_some_and(|value: f32| value.is_normal() && value.to_bits() & MANTISSA == 0)
}

/// The check refuses instructions that round otherwise, and accepts exact ones.
#[test]
fn what_rounds_otherwise_is_refused() {
    use Generation::{Gcn, Rdna};
    let exact = |line| [is_exact(line, Gcn), is_exact(line, Rdna)];
    for line in [
        "v_mul_f32_e32 v1, v2, v3",
        "v_sub_f32 v4, 1.0, v4",
        "v_cmp_lt_f32_e64 s[0:1], |v1|, v2",
        "v_fma_f32 v1, v2, 2.0, v3",
        "v_fma_f32 v1, -4.0, v2, v3",
        "v_fmac_f32_e32 v1, 0.5, v2",
        "v_fmamk_f32 v1, v2, 0x40800000, v3",
        "v_min_f32_e32 v1, v2, v3",
        "v_min_num_f32_e32 v1, v2, v3",
        "v_cvt_f16_f32_e32 v1, v2",
        "v_pack_b32_f16 v1, v2, v3",
        "v_fma_mixlo_f16 v1, 1.0, v2, neg(lo(0))",
        "v_fma_mixhi_f16 v1, 1.0, v2, neg(0) op_sel_hi:[0,0,1]",
        "v_mad_u32_u24 v1, v2, v3, v4",
        "v_lshl_add_u32 v1, v2, 2, v3",
        "buffer_store_dwordx4 v[0:3], v4, s[0:3], 0 offen",
    ] {
        assert_eq!(exact(line), [true; 2], "{line}");
    }
    for line in ["v_mad_f32 v1, v2, v3, v4", "v_mac_f32_e32 v1, v2, v3"] {
        assert_eq!(exact(line), [true, false], "{line}");
    }
    for line in [
        "v_fma_f32 v1, v2, v3, v4",
        "v_fma_f32 v1, v2, v3, 2.0",
        "v_fma_f32 v1, v2, 2, v3",
        "v_fmac_f32_e32 v1, 0.75, v2",
        "v_fmaak_f32 v1, v2, v3, 0x40800000",
        "v_fmamk_f32 v1, v2, 0x40a00000, v3",
        "v_dual_fmac_f32 v1, v2, v3",
        "s_fmac_f32 s1, s2, s3",
        "v_pk_fma_f32 v[0:1], v[2:3], v[4:5], v[6:7]",
        "v_fma_mix_f32 v1, v2, v3, v4",
        "v_dot2_f32_f16 v1, v2, v3, v4",
        "v_dual_dot2acc_f32_f16 v1, v2, v3",
        "v_rcp_f32_e32 v1, v2",
        "v_min3_f32 v1, v2, v3, v4",
        "v_fma_mixlo_f16 v1, 1.0, v2, v3",
        "v_add_f32_e64 v1, v2, v3 mul:2",
        "v_add_f32_e64 v1, v2, v3 div:2",
        "v_fma_f32 v1, v2, v3, v4 div:2",
        "v_add_f32_e64 v1, v2, v3 clamp",
    ] {
        assert_eq!(exact(line), [false; 2], "{line}");
    }
    let both = Listing::of_lines(
        ["v_dual_mul_f32 v0, v1, v2 :: v_dual_fmac_f32 v3, v4, v5 // 0"].into_iter(),
    );
    assert_eq!(both.inexact(Rdna).len(), 1);
}

#[test]
fn the_loop_over_samples_is_found() {
    let text = "BB0:\n\tv_mul_f32_e32 v1, v2, v3 ; 0a\nBB1:\n\tv_add_f32_e32 v1, v1, v2\nBB2:\n\t\
                v_mul_f32_e32 v1, v1, v2\n\tv_mov_b32_e32 v1, v2\n\ts_cbranch_scc1 BB2 ; bf\n\t\
                s_branch BB1\nBB3:\n\ts_endpgm\n";
    let listing = Listing::of_lines(text.lines());
    assert_eq!(listing.vector_instructions(), 4);
    assert_eq!(listing.vector_instructions_a_sample(), 2);
    // Text of the compiler.
    let text = "BB1\n/* logical preds: BB0 */\n\tv1: %5:v[1] = v_add_f32 %3:v[1], %4:v[2]\n\t\
                v1: %6:v[3] = v_fmamk_f32 %3:v[1], %4:v[2], 0x40000000\n\t\
                v1: %7:v[4] = v_fma_f32 %3:v[1], %4:v[2], 2.0\n\t\
                s_cbranch_vccnz block:BB1, block:BB2\n";
    let listing = Listing::of_lines(text.lines());
    assert_eq!(listing.vector_instructions_a_sample(), 3);
    let fused = ["v_fma_f32 defined, %3:v[1], %4:v[2], 2.0"];
    assert_eq!(listing.inexact(Generation::Rdna), fused);
    let straight = Listing::of_lines(["v_nop", "v_add_f32_e32 v1, v1, v2"].into_iter());
    assert_eq!(straight.vector_instructions_a_sample(), 2);
}
