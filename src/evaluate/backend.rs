//! What an engine evaluates on.

use crate::cpu::engine::CpuEngine;
use crate::gpu::recovery::Opened;

/// What an engine evaluates on.
pub(crate) enum Backend {
    Cpu(CpuEngine),
    Vulkan(Box<Opened>),
}
