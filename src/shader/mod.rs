//! What the shaders and Rust share, as the compiler of the shaders wrote it into `shaders/compiled`:
//! constants, the structs that buffers hold, and the kernels by name, as SPIR-V.

// The compiler of the shaders (`shader-compiler/`) has its own copy of the pass, and uses more of it.
#[allow(dead_code, unreachable_pub)]
pub(crate) mod spirv;

mod generated {
    // The shaders write pi in two parts, and use constants that Rust has no use for.
    #![allow(dead_code, clippy::approx_constant)]

    use super::{Form, KernelCode};

    include!("../../shaders/compiled/kernels.rs");
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

/// Bytes that lie where words may lie.
#[repr(C, align(4))]
struct Aligned<Bytes: ?Sized>(Bytes);

/// The SPIR-V of all kernels, one behind the other, words with the least significant byte first.
static SPIRV: &Aligned<[u8]> = &Aligned(*include_bytes!("../../shaders/compiled/kernels.spv"));

/// A kernel as it was compiled: names, with how many words of [`SPIRV`] are theirs.
pub(crate) struct KernelCode {
    pub(crate) kernel: Kernel,
    /// The code that reads storage buffers.
    storage: (&'static str, usize),
    /// The code that reads texel buffers: all bindings but the last.
    texels: Option<(&'static str, usize)>,
    /// How many buffers it binds.
    pub(crate) bindings: u32,
    /// What it evaluates, how its work is listed and what it stores, if it evaluates segments.
    pub(crate) segments: Option<(Form, List, Store)>,
}

impl Kernel {
    /// As it was compiled.
    pub(crate) fn compiled(self) -> &'static KernelCode {
        &KERNELS[self as usize]
    }

    /// Its name, its code, and whether that reads texel buffers: it does if asked to and if the
    /// kernel has such code.
    pub(crate) fn code(self, reads_texels: bool) -> (&'static str, &'static [u32], bool) {
        let variants = self.compiled();
        let (name, reads_texels) = match variants.texels {
            Some((name, _)) if reads_texels => (name, true),
            _ => (variants.storage.0, false),
        };
        let mut all = kernels();
        let (_, code) = all
            .find(|kernel| kernel.0 == name)
            .expect("it is one of them");
        (name, bytemuck::cast_slice(code), reads_texels)
    }
}

/// Every kernel that a Vulkan device may be given: its name and its SPIR-V, words with the
/// least significant byte first, before the float controls that depend on the device.
pub fn kernels() -> impl Iterator<Item = (&'static str, &'static [u8])> {
    let all = KERNELS.iter();
    let all = all.flat_map(|kernel| [Some(kernel.storage), kernel.texels]);
    let mut rest = &SPIRV.0;
    all.flatten().map(move |(name, words)| {
        let (code, behind) = rest.split_at(4 * words);
        rest = behind;
        (name, code)
    })
}
