//! What the shaders and Rust share, as the build reads it from `shaders/`: constants, the structs
//! that buffers hold, and the kernels by name, as SPIR-V.

// The build has its own copy of the pass, and uses more of it.
#[allow(dead_code, unreachable_pub)]
pub(crate) mod spirv;

mod generated {
    // The shaders write pi in two parts, and use constants that Rust has no use for.
    #![allow(dead_code, clippy::approx_constant)]

    use super::{Form, KernelCode};

    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}

pub(crate) use generated::*;

/// Coefficients of a [`PolynomialSegment`]: those of 1, s, … s¹⁰.
pub(crate) const POWERS: usize = 11;

/// What a kernel evaluates. Many methods share one form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// A great circle at constant angular velocity.
    Arc,
    /// A polynomial in time for each component, fitted to the curve.
    Polynomial,
}

/// A kernel's name and its SPIR-V, words with the least significant byte first.
pub(crate) type Code = (&'static str, &'static [u8]);

/// A kernel as the build compiled it.
pub(crate) struct KernelCode {
    /// The code that reads storage buffers.
    storage: Code,
    /// The code that reads texel buffers: all bindings but the last.
    texels: Option<Code>,
    /// How many buffers it binds.
    pub(crate) bindings: u32,
}

impl Kernel {
    /// As the build compiled it.
    pub(crate) fn compiled(self) -> &'static KernelCode {
        &KERNELS[self as usize]
    }

    /// Its code, and whether that reads texel buffers: it does if asked to and if the kernel has
    /// such code.
    pub(crate) fn code(self, reads_texels: bool) -> (Code, bool) {
        let KernelCode {
            storage, texels, ..
        } = self.compiled();
        match texels {
            Some(texels) if reads_texels => (*texels, true),
            _ => (*storage, false),
        }
    }
}

/// Every kernel that a Vulkan device may be given: its name and its SPIR-V, words with the
/// least significant byte first, before the float controls that depend on the device.
pub fn kernels() -> impl Iterator<Item = (&'static str, &'static [u8])> {
    let all = KERNELS.iter();
    all.flat_map(|kernel| [Some(kernel.storage), kernel.texels])
        .flatten()
}
