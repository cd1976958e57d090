//! SPIR-V modules as words: parsing of instructions, adding of the float controls that a device reports, and removal
//! of the decorations that the shader compiler's exactness pass added.

use std::collections::BTreeMap;

const MAGIC: u32 = 0x0723_0203;
pub(crate) const HEADER_WORDS: usize = 5;

/// The opcodes of the instructions that are examined.
pub(crate) mod op {
    pub(crate) const EXTENSION: u16 = 10;
    pub(crate) const ENTRY_POINT: u16 = 15;
    pub(crate) const EXECUTION_MODE: u16 = 16;
    pub(crate) const CAPABILITY: u16 = 17;
    pub(crate) const TYPE_ARRAY: u16 = 28;
    pub(crate) const TYPE_POINTER: u16 = 32;
    pub(crate) const CONSTANT: u16 = 43;
    pub(crate) const STORE: u16 = 62;
    pub(crate) const MULTIPLY_INTEGERS: u16 = 132;
    pub(crate) const SHIFT_RIGHT: u16 = 194;
    pub(crate) const DECORATE: u16 = 71;
}
/// A decoration.
pub(crate) const NO_CONTRACTION: u32 = 42;

/// Why a module was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SpirvError {
    /// The module is too short, or does not start with the magic number.
    #[error("not a SPIR-V module")]
    NotSpirv,
    /// An instruction extends past the end of the module, or has no length.
    #[error("instruction at word {word} is cut short")]
    Truncated {
        /// Offset of the instruction in words.
        word: usize,
    },
    /// The module lacks the parts next to which modes are added: types, a memory model or an entry point.
    #[error("the module has no memory model or entry point, or not the types that it uses")]
    Incomplete,
}

/// One instruction: its offset, its opcode and its words.
pub(crate) struct Instruction<'a> {
    pub(crate) start: usize,
    pub(crate) opcode: u16,
    pub(crate) words: &'a [u32],
}

impl Instruction<'_> {
    pub(crate) fn word(&self, index: usize) -> Result<u32, SpirvError> {
        let word = self.words.get(index).copied();
        word.ok_or(SpirvError::Truncated { word: self.start })
    }

    /// The id that the instruction decorates as `NoContraction`, if it is such a decoration.
    pub(crate) fn decorated(&self) -> Option<u32> {
        match (self.opcode, self.words) {
            (op::DECORATE, &[_, id, NO_CONTRACTION]) => Some(id),
            _ => None,
        }
    }
}

pub(crate) fn instructions(module: &[u32]) -> Result<Vec<Instruction<'_>>, SpirvError> {
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

pub(crate) fn instruction_word(opcode: u16, words: u32) -> u32 {
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

/// Adds the execution modes that the device supports to every entry point.
///
/// # Errors
/// When the words are not a complete module.
pub fn float_controls(module: &[u32], offered: FloatControls) -> Result<Vec<u32>, SpirvError> {
    // SPIR-V 1.4; by extension before that.
    let modes: Vec<Mode> = [
        (offered.preserve_signed_zero_inf_nan, (4466, 4461)),
        (offered.round_to_nearest_even, (4467, 4462)),
    ]
    .into_iter()
    .filter(|(is_offered, _)| *is_offered)
    .map(|(_, (capability, mode))| Mode {
        capability,
        mode,
        width: 32,
    })
    .collect();
    with_modes(module, &modes)
}

/// An execution mode for floats of a width, and the capability that it needs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mode {
    pub(crate) capability: u32,
    pub(crate) mode: u32,
    pub(crate) width: u32,
}

/// Adds modes of float controls to every entry point.
pub(crate) fn with_modes(module: &[u32], modes: &[Mode]) -> Result<Vec<u32>, SpirvError> {
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
    for &Mode { capability, .. } in modes {
        head.extend([instruction_word(op::CAPABILITY, 2), capability]);
    }
    let name = string_words("SPV_KHR_float_controls");
    head.push(instruction_word(op::EXTENSION, 1 + name.len() as u32));
    head.extend(name);
    let mut execution_modes = Vec::new();
    for entry in &entry_points {
        let id = entry.word(2)?;
        for &Mode { mode, width, .. } in modes {
            execution_modes.extend([instruction_word(op::EXECUTION_MODE, 4), id, mode, width]);
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

/// A hash of words (64-bit FNV-1a, a word at a time), the same in every process.
pub(crate) fn hash(words: &[u32]) -> u64 {
    words.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &word| {
        (hash ^ u64::from(word)).wrapping_mul(0x100_0000_01b3)
    })
}

fn string_words(text: &str) -> Vec<u32> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(bytes.len() / 4 * 4 + 4, 0); // always at least one NUL
    bytes
        .chunks_exact(4)
        .map(|c| u32::from_le_bytes([c[0], c[1], c[2], c[3]]))
        .collect()
}

/// The module without its `NoContraction` decorations, as a driver would compile it without the exactness pass. Tests
/// use it to show that the pass has an effect.
///
/// # Errors
/// When the words are not a module.
pub fn without_decorations(module: &[u32]) -> Result<Vec<u32>, SpirvError> {
    let code = instructions(module)?;
    let kept = code.iter().filter(|i| i.decorated().is_none());
    let kept = kept.flat_map(|i| i.words);
    Ok(module[..HEADER_WORDS].iter().chain(kept).copied().collect())
}

/// A module whose workgroups have `to` invocations along x instead of `from`. Constants that are `from` are changed where
/// they are factors or shifts, because they are numbers of invocations there; the size of workgroup memory changes too.
/// Other uses of equal constants, such as masks, are not changed.
///
/// # Errors
/// When the words are not a module, or not one of workgroups of `from`.
pub fn with_workgroup(module: &[u32], [from, to]: [u32; 2]) -> Result<Vec<u32>, SpirvError> {
    const LOCAL_SIZE: u32 = 17; // an execution mode
    const WORKGROUP: u32 = 4; // a storage class
    let code = instructions(module)?;
    let mut lengths = BTreeMap::new();
    let mut shared = BTreeMap::new();
    for instruction in &code {
        match (instruction.opcode, instruction.words) {
            (op::TYPE_ARRAY, &[_, id, _, length]) => {
                lengths.insert(id, length);
            }
            (op::TYPE_POINTER, &[_, _, WORKGROUP, array]) => {
                shared.extend(lengths.get(&array).map(|&length| (array, length)));
            }
            _ => {}
        }
    }
    let mut words = module[..HEADER_WORDS].to_vec();
    let mut bound = words[3];
    // New constants by old ones: the number of invocations, and the lengths of arrays.
    let (mut numbers, mut new_lengths) = (BTreeMap::new(), BTreeMap::new());
    let mut is_found = false;
    for instruction in &code {
        let start = words.len();
        words.extend_from_slice(instruction.words);
        match (instruction.opcode, instruction.words) {
            (op::EXECUTION_MODE, &[_, _, LOCAL_SIZE, x, ..]) if x == from => {
                (words[start + 3], is_found) = (to, true);
            }
            (op::CONSTANT, &[first, kind, id, value]) => {
                let is_length = shared.values().any(|&length| length == id);
                for (is_used, changed, value) in [
                    (value == from, &mut numbers, to),
                    (is_length, &mut new_lengths, value / from * to),
                ] {
                    if is_used {
                        words.extend([first, kind, bound, value]);
                        changed.insert(id, bound);
                        bound += 1;
                    }
                }
            }
            (op::TYPE_ARRAY, &[_, id, _, length]) if shared.contains_key(&id) => {
                words[start + 3] = new_lengths.get(&length).copied().unwrap_or(length);
            }
            (op::MULTIPLY_INTEGERS | op::SHIFT_RIGHT, &[_, _, _, one, other]) => {
                let new = |id: u32| numbers.get(&id).copied().unwrap_or(id);
                (words[start + 3], words[start + 4]) = (new(one), new(other));
            }
            _ => {}
        }
    }
    words[3] = bound;
    match is_found {
        true => Ok(words),
        false => Err(SpirvError::Incomplete),
    }
}

/// The module without the operand `Nontemporal` of its stores.
///
/// # Errors
/// When the words are not a module.
pub fn temporal_stores(module: &[u32]) -> Result<Vec<u32>, SpirvError> {
    const NONTEMPORAL: u32 = 4; // a memory operand
    let code = instructions(module)?;
    let mut words = module[..HEADER_WORDS].to_vec();
    for instruction in &code {
        match (instruction.opcode, instruction.words) {
            (op::STORE, &[_, pointer, value, NONTEMPORAL]) => {
                words.extend([instruction_word(op::STORE, 3), pointer, value]);
            }
            (_, all) => words.extend_from_slice(all),
        }
    }
    Ok(words)
}
