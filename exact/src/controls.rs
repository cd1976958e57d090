//! Float controls: the execution modes that a device supports.

use crate::spirv::{
    HEADER_WORDS, Instruction, SpirvError, instruction_word, instructions, op, string_words,
};

/// The float controls that a device offers for f32 (`VK_KHR_shader_float_controls`): none by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub struct FloatControls {
    /// `shaderSignedZeroInfNanPreserveFloat32`
    pub preserve_signed_zero_inf_nan: bool,
    /// `shaderRoundingModeRTEFloat32`
    pub round_to_nearest_even: bool,
}

impl FloatControls {
    /// With the value of `shaderSignedZeroInfNanPreserveFloat32`.
    #[must_use]
    pub const fn with_preserve_signed_zero_inf_nan(mut self, is_offered: bool) -> Self {
        self.preserve_signed_zero_inf_nan = is_offered;
        self
    }

    /// With the value of `shaderRoundingModeRTEFloat32`.
    #[must_use]
    pub const fn with_round_to_nearest_even(mut self, is_offered: bool) -> Self {
        self.round_to_nearest_even = is_offered;
        self
    }
}

/// Adds the execution modes that the device offers to every entry point.
///
/// # Errors
/// A [`SpirvError`] for words that are no complete module.
pub fn float_controls(module: &[u32], offered: FloatControls) -> Result<Vec<u32>, SpirvError> {
    // The capabilities and modes are part of SPIR-V 1.4; modules of older versions need an extension.
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

/// Removes the `NoContraction` decorations of a module, so that a driver compiles it as without the pass. A test needs
/// such a module to show that the pass has an effect.
///
/// # Errors
/// A [`SpirvError`] for words that are no module.
pub fn without_decorations(module: &[u32]) -> Result<Vec<u32>, SpirvError> {
    let code = instructions(module)?;
    let kept = code.iter().filter(|i| i.decorated().is_none());
    let kept = kept.flat_map(|i| i.words);
    Ok(module[..HEADER_WORDS].iter().chain(kept).copied().collect())
}
