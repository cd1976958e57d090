//! The exactness pass: what makes a driver round each operation once, as written.
//!
//! naga emits neither `NoContraction` nor the float-control execution modes, and
//! without them a driver may fuse a multiplication with an addition or rewrite
//! `(a + b) - a` to `b`. This pass works on the words of a module: it decorates
//! every float arithmetic instruction, and refuses a module that uses an operation
//! whose rounding Vulkan leaves open. The compiler of the shaders runs it over
//! every one ([`no_contraction`]); at run time [`float_controls`] adds the modes that the
//! device reports.

use std::collections::BTreeSet;

const MAGIC: u32 = 0x0723_0203;
const HEADER_WORDS: usize = 5;

mod op {
    pub(crate) const NAME_LAST: [u16; 6] = [3, 4, 5, 6, 7, 330]; // OpSource … OpModuleProcessed
    pub(crate) const EXTENSION: u16 = 10;
    pub(crate) const EXT_INST_IMPORT: u16 = 11;
    pub(crate) const EXT_INST: u16 = 12;
    pub(crate) const MEMORY_MODEL: u16 = 14;
    pub(crate) const ENTRY_POINT: u16 = 15;
    pub(crate) const EXECUTION_MODE: u16 = 16;
    pub(crate) const CAPABILITY: u16 = 17;
    pub(crate) const TYPE_IMAGE: u16 = 25;
    pub(crate) const LOAD: u16 = 61;
    pub(crate) const IMAGE_FETCH: u16 = 95;
    pub(crate) const TYPE_FLOAT: u16 = 22;
    pub(crate) const EXECUTION_MODE_ID: u16 = 331;
    pub(crate) const DECORATE: u16 = 71;
    // Correctly rounded by Vulkan ("Precision and Operation of SPIR-V Instructions").
    pub(crate) const EXACT: [u16; 5] = [127, 129, 131, 133, 142]; // FNegate FAdd FSub FMul VectorTimesScalar
    // Float arithmetic with a looser bound, or conversions that round freely.
    pub(crate) const INEXACT: [u16; 17] = [
        109, 110, 115, 116, // ConvertFToU ConvertFToS FConvert QuantizeToF16
        136, 140, 141, // FDiv FRem FMod
        143, 144, 145, 146, 147, 148, // matrix products, OuterProduct, Dot
        207, 208, 209, 215, // DPdx DPdy Fwidth and relatives
    ];
}
/// A decoration.
const NO_CONTRACTION: u32 = 42;

/// Why a module was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SpirvError {
    /// Too short, or not starting with the magic number.
    #[error("not a SPIR-V module")]
    NotSpirv,
    /// An instruction runs past the end of the module, or has no length.
    #[error("instruction at word {word} is cut short")]
    Truncated {
        /// Offset of the instruction in words.
        word: usize,
    },
    /// An instruction whose result Vulkan does not define to the last bit.
    #[error("opcode {opcode} at word {word} does not round exactly; use only + - * and integers")]
    Inexact {
        /// Offset of the instruction in words.
        word: usize,
        /// Its opcode.
        opcode: u16,
    },
    /// A floating-point type other than 32 bits wide.
    #[error("a float type of {bits} bits; only 32 are exact everywhere")]
    FloatWidth {
        /// Its width in bits.
        bits: u32,
    },
    /// The module has no types, memory model or entry point, so there is no place for the
    /// additions.
    #[error("the module has no memory model, entry point or types")]
    Incomplete,
}

/// One instruction: where it starts, its opcode and its words.
struct Instruction<'a> {
    start: usize,
    opcode: u16,
    words: &'a [u32],
}

impl Instruction<'_> {
    fn word(&self, place: usize) -> Result<u32, SpirvError> {
        let word = self.words.get(place).copied();
        word.ok_or(SpirvError::Truncated { word: self.start })
    }

    /// The id that it says must not be contracted, if it is such a decoration.
    fn decorated(&self) -> Option<u32> {
        match (self.opcode, self.words) {
            (op::DECORATE, &[_, id, NO_CONTRACTION]) => Some(id),
            _ => None,
        }
    }
}

fn instructions(module: &[u32]) -> Result<Vec<Instruction<'_>>, SpirvError> {
    if module.len() < HEADER_WORDS || module[0] != MAGIC {
        return Err(SpirvError::NotSpirv);
    }
    let mut found = Vec::new();
    let mut start = HEADER_WORDS;
    while start < module.len() {
        let length = (module[start] >> 16) as usize;
        if length == 0 || length > module.len() - start {
            return Err(SpirvError::Truncated { word: start });
        }
        let words = &module[start..start + length];
        found.push(Instruction {
            start,
            opcode: module[start] as u16,
            words,
        });
        start += length;
    }
    Ok(found)
}

/// Decorates the result of every float arithmetic instruction with
/// `NoContraction`.
///
/// # Errors
/// A [`SpirvError`] for words that are no module, and for a module that computes
/// anything whose last bit Vulkan leaves open.
pub fn no_contraction(module: &[u32]) -> Result<Vec<u32>, SpirvError> {
    let code = instructions(module)?;
    let mut results = BTreeSet::new();
    let mut decorated = BTreeSet::new();
    for instruction in &code {
        let (word, opcode) = (instruction.start, instruction.opcode);
        match (opcode, instruction.words) {
            (op::TYPE_FLOAT, &[_, _, bits, ..]) if bits != 32 => {
                return Err(SpirvError::FloatWidth { bits });
            }
            // Every built-in function of GLSL.std.450 that naga would emit for our
            // shaders is one of those that round freely.
            _ if opcode == op::EXT_INST || op::INEXACT.contains(&opcode) => {
                return Err(SpirvError::Inexact { word, opcode });
            }
            _ if op::EXACT.contains(&opcode) => {
                results.insert(instruction.word(2)?);
            }
            _ => decorated.extend(instruction.decorated()),
        }
    }
    let additions: Vec<u32> = results
        .difference(&decorated)
        .flat_map(|&id| [instruction_word(op::DECORATE, 3), id, NO_CONTRACTION])
        .collect();
    // Annotations come after the debug instructions and before the types.
    let place = code
        .iter()
        .find(|i| !precedes_annotations(i.opcode))
        .map(|i| i.start)
        .ok_or(SpirvError::Incomplete)?;
    Ok([&module[..place], &additions, &module[place..]].concat())
}

/// Turns the one-dimensional textures of a module into texel buffers, which WGSL does not have.
/// They are read in the same way, and may be as long as a buffer.
///
/// # Errors
/// A [`SpirvError`] for words that are no module.
pub fn texel_buffers(module: &[u32]) -> Result<Vec<u32>, SpirvError> {
    const SAMPLED_1D: u32 = 43;
    const SAMPLED_BUFFER: u32 = 46;
    const BUFFER: u32 = 5; // a dimension
    const FETCH_WORDS: usize = 5; // without the level of detail, which buffers do not have
    let code = instructions(module)?;
    let mut words = module[..HEADER_WORDS].to_vec();
    // The ids of the types that were changed, and of values loaded of these types.
    let mut buffers = BTreeSet::new();
    for instruction in &code {
        let first = words.len();
        words.extend_from_slice(instruction.words);
        match (instruction.opcode, instruction.words) {
            (op::CAPABILITY, [_, SAMPLED_1D]) => words[first + 1] = SAMPLED_BUFFER,
            (op::TYPE_IMAGE, [_, id, _, 0, ..]) => {
                words[first + 3] = BUFFER;
                buffers.insert(*id);
            }
            (op::LOAD, [_, kind, id, ..]) if buffers.contains(kind) => {
                buffers.insert(*id);
            }
            (op::IMAGE_FETCH, [_, _, _, image, _, ..]) if buffers.contains(image) => {
                words.truncate(first + FETCH_WORDS);
                words[first] = instruction_word(op::IMAGE_FETCH, FETCH_WORDS as u32);
            }
            _ => {}
        }
    }
    Ok(words)
}

fn precedes_annotations(opcode: u16) -> bool {
    matches!(
        opcode,
        op::CAPABILITY
            | op::EXTENSION
            | op::EXT_INST_IMPORT
            | op::MEMORY_MODEL
            | op::ENTRY_POINT
            | op::EXECUTION_MODE
            | op::EXECUTION_MODE_ID
    ) || op::NAME_LAST.contains(&opcode)
}

fn instruction_word(opcode: u16, words: u32) -> u32 {
    words << 16 | u32::from(opcode)
}

/// The float-control properties of a device (`VK_KHR_shader_float_controls`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FloatControls {
    /// `shaderSignedZeroInfNanPreserveFloat32`
    pub preserve_signed_zero_inf_nan: bool,
    /// `shaderRoundingModeRTEFloat32`
    pub round_to_nearest_even: bool,
}

/// Adds the execution modes that the device offers to every entry point.
///
/// # Errors
/// A [`SpirvError`] for words that are no complete module.
pub fn float_controls(module: &[u32], offered: FloatControls) -> Result<Vec<u32>, SpirvError> {
    // (capability, execution mode), SPIR-V 1.4; by extension before that.
    let modes: Vec<(u32, u32)> = [
        (offered.preserve_signed_zero_inf_nan, (4466, 4461)),
        (offered.round_to_nearest_even, (4467, 4462)),
    ]
    .into_iter()
    .filter_map(|(wanted, mode)| wanted.then_some(mode))
    .collect();
    let code = instructions(module)?;
    if modes.is_empty() {
        return Ok(module.to_vec());
    }
    let entry_points: Vec<_> = code
        .iter()
        .filter(|i| i.opcode == op::ENTRY_POINT)
        .collect();
    let after_capabilities = code.iter().rfind(|i| i.opcode == op::CAPABILITY);
    let (Some(last_entry), Some(last_capability)) = (entry_points.last(), after_capabilities)
    else {
        return Err(SpirvError::Incomplete);
    };
    let end = |i: &Instruction<'_>| i.start + i.words.len();
    let (capabilities_end, entries_end) = (end(last_capability), end(last_entry));
    if entries_end < capabilities_end {
        return Err(SpirvError::Incomplete);
    }

    let mut head = Vec::new();
    for &(capability, _) in &modes {
        head.extend([instruction_word(op::CAPABILITY, 2), capability]);
    }
    let name = string_words("SPV_KHR_float_controls");
    head.push(instruction_word(op::EXTENSION, 1 + name.len() as u32));
    head.extend(name);
    let mut execution_modes = Vec::new();
    for entry in &entry_points {
        let id = entry.word(2)?;
        for &(_, mode) in &modes {
            execution_modes.extend([instruction_word(op::EXECUTION_MODE, 4), id, mode, 32]);
        }
    }
    Ok([
        &module[..capabilities_end],
        &head,
        &module[capabilities_end..entries_end],
        &execution_modes,
        &module[entries_end..],
    ]
    .concat())
}

fn string_words(text: &str) -> Vec<u32> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(bytes.len() / 4 * 4 + 4, 0); // always at least one NUL
    bytes
        .chunks_exact(4)
        .map(|c| u32::from_le_bytes([c[0], c[1], c[2], c[3]]))
        .collect()
}

/// The module without its `NoContraction` decorations: what a driver gets to see
/// when the pass is left out. Tests use it to prove that the pass matters.
///
/// # Errors
/// A [`SpirvError`] for words that are no module.
pub fn without_decorations(module: &[u32]) -> Result<Vec<u32>, SpirvError> {
    let code = instructions(module)?;
    let kept = code.iter().filter(|i| i.decorated().is_none());
    let kept = kept.flat_map(|i| i.words);
    Ok(module[..HEADER_WORDS].iter().chain(kept).copied().collect())
}
