//! SPIR-V modules as words: their instructions, one after another.

/// The words before the first instruction.
pub const HEADER_WORDS: usize = 5;

const MAGIC: u32 = 0x0723_0203;

/// The opcodes of the instructions that the passes examine.
pub(crate) mod op {
    pub(crate) const EXTENSION: u16 = 10;
    pub(crate) const EXT_INST_IMPORT: u16 = 11;
    pub(crate) const EXT_INST: u16 = 12;
    pub(crate) const MEMORY_MODEL: u16 = 14;
    pub(crate) const ENTRY_POINT: u16 = 15;
    pub(crate) const EXECUTION_MODE: u16 = 16;
    pub(crate) const CAPABILITY: u16 = 17;
    pub(crate) const TYPE_FLOAT: u16 = 22;
    pub(crate) const TYPE_VECTOR: u16 = 23;
    pub(crate) const TYPE_IMAGE: u16 = 25;
    pub(crate) const TYPE_ARRAY: u16 = 28;
    pub(crate) const TYPE_RUNTIME_ARRAY: u16 = 29;
    pub(crate) const TYPE_STRUCT: u16 = 30;
    pub(crate) const TYPE_POINTER: u16 = 32;
    pub(crate) const LOAD: u16 = 61;
    pub(crate) const STORE: u16 = 62;
    pub(crate) const ACCESS_CHAIN: u16 = 65;
    pub(crate) const DECORATE: u16 = 71;
    pub(crate) const MEMBER_DECORATE: u16 = 72;
    pub(crate) const COMPOSITE_CONSTRUCT: u16 = 80;
    pub(crate) const IMAGE_FETCH: u16 = 95;
    pub(crate) const F_CONVERT: u16 = 115;
    pub(crate) const MULTIPLY: u16 = 133;
    pub(crate) const VECTOR_TIMES_SCALAR: u16 = 142;
    pub(crate) const EXECUTION_MODE_ID: u16 = 331;
}

/// Why a module cannot be read or changed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SpirvError {
    /// The module is too short, or does not start with the magic number.
    #[error("not a SPIR-V module")]
    NotSpirv,
    /// An instruction extends past the end of the module, or has no length.
    #[error("the instruction at word {word} is cut short")]
    Truncated {
        /// The offset of the instruction, in words.
        word: usize,
    },
    /// The module lacks the parts next to which the pass adds its own: types, a memory model or an entry point.
    #[error("the module has no memory model or entry point, or not the types that it uses")]
    Incomplete,
}

/// An instruction of a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Instruction<'a> {
    /// The offset of its first word in the module.
    pub start: usize,
    /// Its opcode, the lower half of its first word.
    pub opcode: u16,
    /// All its words; the first has the number of words and the opcode.
    pub words: &'a [u32],
}

impl Instruction<'_> {
    /// A word of the instruction.
    ///
    /// # Errors
    /// [`SpirvError::Truncated`] if it has not so many words.
    pub fn word(&self, index: usize) -> Result<u32, SpirvError> {
        let word = self.words.get(index).copied();
        word.ok_or(SpirvError::Truncated { word: self.start })
    }

    /// The id that the instruction decorates as `NoContraction`, if it is such a decoration.
    pub(crate) fn decorated(&self) -> Option<u32> {
        match (self.opcode, self.words) {
            (op::DECORATE, &[_, id, crate::pass::NO_CONTRACTION]) => Some(id),
            _ => None,
        }
    }
}

/// The instructions of a module, in their order.
///
/// # Errors
/// A [`SpirvError`] if the words are not a module, or if an instruction of it is cut short.
pub fn instructions(module: &[u32]) -> Result<Vec<Instruction<'_>>, SpirvError> {
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

/// The first word of an instruction of `words` words.
#[must_use]
pub fn instruction_word(opcode: u16, words: u32) -> u32 {
    words << 16 | u32::from(opcode)
}

/// A text as the operand of an instruction.
pub(crate) fn string_words(text: &str) -> Vec<u32> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(bytes.len() / 4 * 4 + 4, 0); // always at least one NUL
    bytes
        .chunks_exact(4)
        .map(|c| u32::from_le_bytes([c[0], c[1], c[2], c[3]]))
        .collect()
}

/// The text that the operand of an instruction is.
pub(crate) fn text_of(words: &[u32]) -> String {
    let bytes = words.iter().flat_map(|word| word.to_le_bytes());
    let bytes: Vec<u8> = bytes.take_while(|&byte| byte != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}
