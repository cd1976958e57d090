//! The pass: it makes a driver round each operation once, as written.
//!
//! Compilers of shaders emit neither `NoContraction` nor the float-control execution modes unless they are asked to. Without
//! them a driver may fuse a multiplication with an addition, or rewrite `(a + b) - a` to `b`. The pass decorates every float
//! operation, and refuses a module that uses an operation whose rounding Vulkan leaves open.
//!
//! The product of a vector and a scalar has a special opcode. SPIRV-Cross, which translates SPIR-V for Metal, ignores
//! `NoContraction` on it. Therefore the pass replaces it by a product of two vectors.

use std::collections::{BTreeMap, BTreeSet};

use crate::controls::{Mode, with_modes};
use crate::operations::{HalfFloats, InexactOperation, found};
use crate::spirv::{HEADER_WORDS, SpirvError, instruction_word, instructions, op};

/// The decoration.
pub(crate) const NO_CONTRACTION: u32 = 42;
/// The storage class of storage buffers.
const STORAGE_BUFFER: u32 = 12;
const NAME_LAST: [u16; 6] = [3, 4, 5, 6, 7, 330]; // OpSource … OpModuleProcessed
/// The operations that Vulkan requires to be correctly rounded ("Precision and Operation of SPIR-V Instructions").
const EXACT: [u16; 4] = [127, 129, 131, op::MULTIPLY]; // FNegate FAdd FSub FMul

/// Why the pass refuses a module.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PassError {
    /// The words are not a complete module.
    #[error(transparent)]
    Spirv(#[from] SpirvError),
    /// An operation whose result Vulkan does not define to the last bit. [`inexact`](crate::inexact) lists all of them.
    #[error("{0}; use only + - * on f32, comparisons and integers")]
    Inexact(InexactOperation),
    /// A type that a buffer and a workgroup share, of which one needs a layout that the other forbids.
    #[error(
        "type %{id} is used in a buffer and in workgroup memory; declare one of its own for each"
    )]
    SharedLayout {
        /// The id of the type.
        id: u32,
    },
}

/// Decorates a module of any compiler so that a driver must round each operation once, as written: [`splat_products`],
/// then [`no_contraction`].
///
/// When the module is loaded on a device, add the float controls of the device by
/// [`float_controls`](crate::float_controls).
///
/// # Errors
/// * [`PassError::Spirv`] when the words are no SPIR-V module.
/// * [`PassError::Inexact`] when the module has an operation whose last bit Vulkan leaves open.
pub fn exact(module: &[u32]) -> Result<Vec<u32>, PassError> {
    no_contraction(&splat_products(module)?)
}

/// Decorates the result of every float arithmetic instruction with
/// `NoContraction`.
///
/// # Errors
/// * [`PassError::Spirv`] when the words are no SPIR-V module.
/// * [`PassError::Inexact`] when the module has an operation whose last bit Vulkan leaves open.
pub fn no_contraction(module: &[u32]) -> Result<Vec<u32>, PassError> {
    decorated(module, HalfFloats::Refused)
}

/// As [`no_contraction`], for a module that converts f32 to half precision. The result requires modes by which
/// conversions round to nearest, ties to even, and keep subnormal numbers, so only devices that report both modes can
/// use the result.
///
/// # Errors
/// As for [`no_contraction`].
pub fn no_contraction_with_f16(module: &[u32]) -> Result<Vec<u32>, PassError> {
    const DENORM_PRESERVE: [u32; 2] = [4464, 4459]; // the capability and the mode
    const ROUND_TO_NEAREST_EVEN: [u32; 2] = [4467, 4462];
    let words = decorated(module, HalfFloats::Accepted)?;
    let modes = [DENORM_PRESERVE, ROUND_TO_NEAREST_EVEN].map(|[capability, mode]| Mode {
        capability,
        mode,
        width: 16,
    });
    Ok(with_modes(&words, &modes)?)
}

fn decorated(module: &[u32], halves: HalfFloats) -> Result<Vec<u32>, PassError> {
    let code = instructions(module)?;
    if let Some(first) = found(&code, halves).into_iter().next() {
        return Err(PassError::Inexact(first));
    }
    let mut results = BTreeSet::new();
    let mut decorated = BTreeSet::new();
    for instruction in &code {
        match EXACT.contains(&instruction.opcode) {
            true => _ = results.insert(instruction.word(2)?),
            false => decorated.extend(instruction.decorated()),
        }
    }
    let additions: Vec<u32> = results
        .difference(&decorated)
        .flat_map(|&id| [instruction_word(op::DECORATE, 3), id, NO_CONTRACTION])
        .collect();
    // Annotations must follow the debug instructions and precede the types.
    let position = code
        .iter()
        .find(|i| !precedes_annotations(i.opcode))
        .map(|i| i.start)
        .ok_or(SpirvError::Incomplete)?;
    Ok([&module[..position], &additions, &module[position..]].concat())
}

/// Writes each product of a vector and a scalar as the product of two vectors, the second of which has
/// the scalar in every component: `OpCompositeConstruct` and `OpFMul` for `OpVectorTimesScalar`. Both
/// round each component once, so the bits are the same; drivers have one opcode less to get right.
///
/// # Errors
/// A [`SpirvError`] for words that are no module, and for such a product of a type that is no vector.
pub fn splat_products(module: &[u32]) -> Result<Vec<u32>, SpirvError> {
    const BOUND: usize = 3; // where the header says that all ids are less
    let mut words = module.get(..HEADER_WORDS).unwrap_or_default().to_vec();
    let mut components = BTreeMap::new();
    for instruction in instructions(module)? {
        match (instruction.opcode, instruction.words) {
            (op::TYPE_VECTOR, &[_, id, _, count]) => {
                components.insert(id, count);
            }
            (op::VECTOR_TIMES_SCALAR, &[_, kind, id, vector, scalar]) => {
                // A vector has 2, 3 or 4 components.
                let count = components
                    .get(&kind)
                    .filter(|count| (2..=4).contains(*count));
                let &count = count.ok_or(SpirvError::Incomplete)?;
                let splat = words[BOUND];
                words[BOUND] = splat.checked_add(1).ok_or(SpirvError::Incomplete)?;
                words.extend([
                    instruction_word(op::COMPOSITE_CONSTRUCT, 3 + count),
                    kind,
                    splat,
                ]);
                words.extend((0..count).map(|_| scalar));
                words.extend([instruction_word(op::MULTIPLY, 5), kind, id, vector, splat]);
                continue;
            }
            _ => {}
        }
        words.extend_from_slice(instruction.words);
    }
    Ok(words)
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

/// Removes the strides and offsets of types that lie in workgroup memory alone. Vulkan forbids them there
/// (VUID-StandaloneSpirv-None-10684), and naga writes them for every type that can be in a buffer.
///
/// # Errors
/// A [`PassError`] for words that are no module, and for a type with a layout that a buffer uses, too.
pub fn workgroup_layouts(module: &[u32]) -> Result<Vec<u32>, PassError> {
    const UNIFORM: u32 = 2;
    const WORKGROUP: u32 = 4;
    const PUSH_CONSTANT: u32 = 9;
    // RowMajor, ColMajor, ArrayStride, MatrixStride, Offset
    const LAYOUT: [u32; 5] = [4, 5, 6, 7, 35];
    let code = instructions(module)?;
    // SPIR-V declares the parts of a type before the type, and pointers to the type after it, so one pass over the
    // module is enough.
    let mut parts = BTreeMap::<u32, &[u32]>::new();
    let (mut shared, mut laid_out) = (BTreeSet::new(), BTreeSet::new());
    for instruction in &code {
        match (instruction.opcode, instruction.words) {
            (op::TYPE_ARRAY | op::TYPE_RUNTIME_ARRAY, [_, id, element, ..]) => {
                parts.insert(*id, std::slice::from_ref(element));
            }
            (op::TYPE_STRUCT, [_, id, members @ ..]) => {
                parts.insert(*id, members);
            }
            (op::TYPE_POINTER, [_, _, class, to]) => {
                let found = match *class {
                    WORKGROUP => &mut shared,
                    UNIFORM | PUSH_CONSTANT | STORAGE_BUFFER => &mut laid_out,
                    _ => continue,
                };
                let mut types = vec![*to];
                while let Some(id) = types.pop() {
                    if found.insert(id) {
                        types.extend(parts.get(&id).copied().unwrap_or_default());
                    }
                }
            }
            _ => {}
        }
    }
    let mut words = module[..HEADER_WORDS].to_vec();
    for instruction in &code {
        let layout_of = match (instruction.opcode, instruction.words) {
            (op::DECORATE, [_, id, decoration, ..]) if LAYOUT.contains(decoration) => Some(*id),
            (op::MEMBER_DECORATE, [_, id, _, decoration, ..]) if LAYOUT.contains(decoration) => {
                Some(*id)
            }
            _ => None,
        };
        match layout_of.filter(|id| shared.contains(id)) {
            Some(id) if laid_out.contains(&id) => return Err(PassError::SharedLayout { id }),
            Some(_) => {}
            None => words.extend_from_slice(instruction.words),
        }
    }
    Ok(words)
}

/// Marks the stores into buffers as not temporal: what is stored is not soon read again, and need not take the place of
/// what is in the caches.
///
/// # Errors
/// A [`SpirvError`] for words that are no module.
pub fn nontemporal_stores(module: &[u32]) -> Result<Vec<u32>, SpirvError> {
    const NONTEMPORAL: u32 = 4; // a memory operand
    let mut words = module.get(..HEADER_WORDS).unwrap_or_default().to_vec();
    // The types of pointers into buffers, and pointers of these types.
    let mut pointers = BTreeSet::new();
    for instruction in instructions(module)? {
        match (instruction.opcode, instruction.words) {
            (op::TYPE_POINTER, &[_, id, STORAGE_BUFFER, _]) => {
                pointers.insert(id);
            }
            (op::ACCESS_CHAIN, &[_, kind, id, ..]) if pointers.contains(&kind) => {
                pointers.insert(id);
            }
            (op::STORE, &[_, pointer, value]) if pointers.contains(&pointer) => {
                words.extend([instruction_word(op::STORE, 4), pointer, value, NONTEMPORAL]);
                continue;
            }
            _ => {}
        }
        words.extend_from_slice(instruction.words);
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
    ) || NAME_LAST.contains(&opcode)
}
