//! What an engine evaluates on: the CPU, or an opened Vulkan device.

use crate::cpu::engine::CpuEngine;
use crate::gpu::recovery::Opened;

/// What an engine evaluates on.
pub(crate) enum Backend {
    Cpu(CpuEngine),
    Vulkan(Box<Opened>),
}
