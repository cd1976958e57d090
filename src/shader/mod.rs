//! Constants, buffer structs and kernels (as SPIR-V, by name) that the shaders share with Rust, as the shader
//! compiler wrote them into `shaders/compiled`.

#[cfg(feature = "lab")]
pub(crate) mod spirv;

mod generated {
    // The shaders write pi in two parts, and have constants that Rust does not use.
    #![allow(dead_code, clippy::approx_constant)]

    use super::Access::{Read, ReadWrite, Write};
    use super::{Form, KernelCode};

    include!("../../shaders/compiled/kernels.rs");
}

pub(crate) use generated::*;

/// The number of coefficients of a [`PolynomialSegment`]: those of 1, s, … s¹⁰.
pub(crate) const POWERS: usize = 11;

/// The form of the curve that a kernel evaluates. Many methods share one form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Form {
    /// A great circle at constant angular velocity.
    Arc,
    /// A polynomial in time for each component, fitted to the curve.
    Polynomial,
}

/// Bytes with the alignment of words.
#[repr(C, align(4))]
struct Aligned<Bytes: ?Sized>(Bytes);

/// The SPIR-V of all kernels, one after another, as little-endian words.
static SPIRV: &Aligned<[u8]> = &Aligned(*include_bytes!("../../shaders/compiled/kernels.spv"));

/// How a kernel uses a buffer that it binds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    Read,
    /// Each dispatch writes elements of its own, and reads none.
    Write,
    ReadWrite,
}

/// A compiled kernel: the name of each variant, and its number of words in [`SPIRV`].
pub(crate) struct KernelCode {
    pub(crate) kernel: Kernel,
    /// The code that reads storage buffers.
    storage: (&'static str, usize),
    /// The variant that reads texel buffers, for all bindings but the last.
    texels: Option<(&'static str, usize)>,
    /// The variant that converts to half precision as the device does.
    converting: Option<(&'static str, usize)>,
    /// How it uses the buffers that it binds, in the order of the bindings.
    pub(crate) bindings: &'static [Access],
    /// For kernels that evaluate segments: the form, the kind of work list, and the stored encoding.
    pub(crate) segments: Option<(Form, List, Store)>,
    /// Whether the lanes of its subgroups ask each other, which not every device can.
    pub(crate) subgroups: bool,
}

/// The variants of kernels that a device uses if they exist.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Variants {
    /// Whether to use the variants that read texel buffers.
    pub(crate) reads_texels: bool,
    /// Whether to use the variants that convert to half precision by the device's instruction.
    pub(crate) converts: bool,
}

impl Kernel {
    /// The compiled kernel.
    pub(crate) fn compiled(self) -> &'static KernelCode {
        &KERNELS[self as usize]
    }

    /// Whether other kernels can replace this one: on a device that cannot run it, or on which its bits differ from the
    /// CPU's.
    pub(crate) fn is_replaceable(self) -> bool {
        self.compiled().subgroups
    }

    /// The name, the code, and whether the code reads texel buffers: it does if this is requested and the kernel has
    /// such a variant.
    pub(crate) fn code(self, variants: Variants) -> (&'static str, &'static [u32], bool) {
        let all = self.compiled();
        let texels = all.texels.filter(|_| variants.reads_texels);
        let converting = all.converting.filter(|_| variants.converts);
        let reads_texels = texels.is_some();
        let (name, _) = texels.or(converting).unwrap_or(all.storage);
        let mut all = kernels();
        let (_, code) = all
            .find(|kernel| kernel.0 == name)
            .expect("it is one of them");
        (name, bytemuck::cast_slice(code), reads_texels)
    }
}

/// Every kernel that may run on a Vulkan device: its name and its SPIR-V, as little-endian words, without the float
/// controls that are added for the device.
pub fn kernels() -> impl Iterator<Item = (&'static str, &'static [u8])> {
    let all = KERNELS.iter();
    let all = all.flat_map(|kernel| [Some(kernel.storage), kernel.texels, kernel.converting]);
    let mut rest = &SPIRV.0;
    all.flatten().map(move |(name, words)| {
        let (code, behind) = rest.split_at(4 * words);
        rest = behind;
        (name, code)
    })
}
