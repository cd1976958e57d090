//! What an engine evaluates on: the choice of a route for a set, and its execution.

pub(crate) mod route;
mod set;

use crate::cpu::engine::CpuEngine;
use crate::gpu::recovery::Opened;

/// What an engine evaluates on.
pub(crate) enum Backend {
    Cpu(CpuEngine),
    Vulkan(Box<Opened>),
}

impl Backend {
    /// Bytes of segments that go into one buffer of a Vulkan device.
    pub(crate) fn group_bytes(&self) -> Option<usize> {
        self.opened().map(|opened| opened.engine().group_bytes)
    }

    /// Bytes that segments may take, if there is a limit.
    pub(crate) fn budget(&self) -> Option<usize> {
        match self {
            Self::Cpu(engine) => engine.memory,
            Self::Vulkan(opened) => opened.engine().clip_bytes,
        }
    }

    /// The Vulkan device; `None` for the CPU.
    pub(crate) fn opened(&self) -> Option<&Opened> {
        match self {
            Self::Cpu(_) => None,
            Self::Vulkan(opened) => Some(opened),
        }
    }
}
