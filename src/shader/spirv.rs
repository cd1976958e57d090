//! Changes SPIR-V of compiled kernels, for the variants that the lab measures: workgroups of another size, and stores
//! that stay in the caches.

use std::collections::BTreeMap;

use tumble_exact::SpirvError;
use tumble_exact::spirv::{HEADER_WORDS, instruction_word, instructions};

/// The opcodes of the instructions that are examined.
mod op {
    pub(super) const EXECUTION_MODE: u16 = 16;
    pub(super) const TYPE_ARRAY: u16 = 28;
    pub(super) const TYPE_POINTER: u16 = 32;
    pub(super) const CONSTANT: u16 = 43;
    pub(super) const STORE: u16 = 62;
    pub(super) const MULTIPLY_INTEGERS: u16 = 132;
    pub(super) const SHIFT_RIGHT: u16 = 194;
}

/// A module whose workgroups have `to` invocations along x instead of `from`. Constants that are `from` are changed where
/// they are factors or shifts, because they are numbers of invocations there; the size of workgroup memory changes too.
/// Other uses of equal constants, such as masks, are not changed.
///
/// # Errors
/// When the words are not a module, or not one of workgroups of `from`.
pub(crate) fn with_workgroup(module: &[u32], [from, to]: [u32; 2]) -> Result<Vec<u32>, SpirvError> {
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
pub(crate) fn temporal_stores(module: &[u32]) -> Result<Vec<u32>, SpirvError> {
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
