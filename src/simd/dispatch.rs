//! Vector widths of the CPU, chosen at run time, so that one binary runs on every processor of a target. Every width
//! gives the same bits: only addition, subtraction and multiplication are used, never fused multiply-add.
//!
//! Work is compiled once for each width. A build without optimisation has only the baseline, because the wide vectors
//! would take two thirds of the build time and would not be faster (the build script sets `wide_vectors` in other
//! builds). Unit tests compile most work only for the baseline too; integration tests compare the widths.

use std::fmt;
use std::str::FromStr;
use std::sync::OnceLock;

use glam::{Quat, Vec4};

use crate::names::{UnknownNameError, named};
use crate::simd::cache_line::CacheLine;
#[cfg(wide_vectors)]
use crate::simd::eight::Eight;
use crate::simd::lanes::Lanes;
#[cfg(wide_vectors)]
use crate::simd::sixteen::Sixteen;

/// Vector instructions of the CPU engine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum VectorWidth {
    /// The instructions that every processor of the target has: SSE2 on x86-64, NEON on `AArch64`.
    Baseline,
    /// AVX2, eight lanes of f32.
    Avx2,
    /// AVX-512, sixteen lanes of f32.
    Avx512,
}

impl VectorWidth {
    /// Every width, narrowest first.
    pub const ALL: [Self; 3] = [Self::Baseline, Self::Avx2, Self::Avx512];

    /// The name that programs use.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// Every width of this processor, narrowest first.
    #[must_use]
    pub fn available() -> Vec<Self> {
        Self::ALL
            .into_iter()
            .filter(|width| width.is_available())
            .collect()
    }

    /// The default width: the widest of this processor, or a narrower one that the environment variable
    /// `TUMBLE_VECTOR_WIDTH` names.
    pub fn widest() -> Self {
        static WIDEST: OnceLock<VectorWidth> = OnceLock::new();
        *WIDEST.get_or_init(|| {
            let limit = Self::limit().ok().flatten().unwrap_or(Self::Avx512);
            limit.narrowed()
        })
    }

    /// The width that the environment variable `TUMBLE_VECTOR_WIDTH` names, if it is set.
    pub(crate) fn limit() -> Result<Option<Self>, UnknownNameError> {
        match std::env::var("TUMBLE_VECTOR_WIDTH") {
            Ok(name) if !name.is_empty() => name.parse().map(Some),
            _ => Ok(None),
        }
    }

    /// This width, or the next narrower one of this processor.
    #[inline]
    pub(crate) fn narrowed(self) -> Self {
        static WIDEST_THERE_IS: OnceLock<VectorWidth> = OnceLock::new();
        let widest = || *Self::available().last().unwrap_or(&Self::Baseline);
        self.min(*WIDEST_THERE_IS.get_or_init(widest))
    }

    /// Whether this processor has the width; then it has the narrower ones too.
    fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(wide_vectors)]
            Self::Avx2 => std::arch::is_x86_feature_detected!("avx2"),
            #[cfg(wide_vectors)]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && std::arch::is_x86_feature_detected!("avx512f")
                    && std::arch::is_x86_feature_detected!("avx512dq")
                    && std::arch::is_x86_feature_detected!("avx512vl")
                    && std::arch::is_x86_feature_detected!("avx512bw")
            }
            #[cfg(not(wide_vectors))]
            _ => false,
        }
    }
}

impl fmt::Display for VectorWidth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// `sse2` and `neon` are names of the baseline too.
impl FromStr for VectorWidth {
    type Err = UnknownNameError;

    fn from_str(name: &str) -> Result<Self, UnknownNameError> {
        match name.to_lowercase().as_str() {
            "sse2" | "neon" => Ok(Self::Baseline),
            name => named("vector width", &Self::ALL, Self::name, name),
        }
    }
}

/// Work over lanes: `run` is compiled for each vector width. Implementations are `#[inline(always)]`. Plain loops in
/// them have no branches, calls or intrinsics, so that the compiler vectorises them.
pub(crate) trait InLanes {
    /// Whether unit tests compile the work for wide vectors too.
    const WIDE_IN_TESTS: bool = false;

    /// Does the work; `L` is the vector type.
    fn run<L: Lanes>(&mut self);
}

/// Does work over lanes with the width [`VectorWidth::widest`].
pub(crate) fn in_lanes<W: InLanes>(work: &mut W) {
    in_lanes_of(VectorWidth::widest(), work);
}

/// Does work over lanes with this width, or with the next narrower one of this processor.
pub(crate) fn in_lanes_of<W: InLanes>(width: VectorWidth, work: &mut W) {
    struct InPlace;

    impl<W: InLanes> InLanesInto<(), W> for InPlace {
        const WIDE_IN_TESTS: bool = W::WIDE_IN_TESTS;
        type Outcome = ();

        #[inline(always)]
        fn run<L: Lanes>(&self, (): &(), work: &mut W) {
            work.run::<L>();
        }
    }
    in_lanes_into(width, &InPlace, &(), work);
}

/// As [`InLanes`], with input and output as separate arguments. If both are behind the `&mut self` of [`InLanes`],
/// the compiler does not know that they do not overlap, and a row takes a fifth longer.
pub(crate) trait InLanesInto<I: ?Sized, O: ?Sized> {
    /// As in [`InLanes`].
    const WIDE_IN_TESTS: bool = false;
    /// The result of `run` in addition to the output.
    type Outcome;

    /// Does the work; `L` is the vector type.
    fn run<L: Lanes>(&self, input: &I, output: &mut O) -> Self::Outcome;
}

/// As [`in_lanes_of`], with input and output as separate arguments.
pub(crate) fn in_lanes_into<W: InLanesInto<I, O>, I: ?Sized, O: ?Sized>(
    width: VectorWidth,
    work: &W,
    input: &I,
    output: &mut O,
) -> W::Outcome {
    if cfg!(test) && !W::WIDE_IN_TESTS {
        return baseline(work, input, output);
    }
    match width.narrowed() {
        #[cfg(wide_vectors)]
        // SAFETY: the processor has AVX-512, because `narrowed` returns only widths that the processor has.
        VectorWidth::Avx512 => unsafe { avx512(work, input, output) },
        #[cfg(wide_vectors)]
        // SAFETY: the processor has AVX2, for the same reason.
        VectorWidth::Avx2 => unsafe { avx2(work, input, output) },
        _ => baseline(work, input, output),
    }
}

#[inline(never)]
fn baseline<W: InLanesInto<I, O>, I: ?Sized, O: ?Sized>(
    work: &W,
    input: &I,
    output: &mut O,
) -> W::Outcome {
    work.run::<Vec4>(input, output)
}

#[cfg(wide_vectors)]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw")]
fn avx512<W: InLanesInto<I, O>, I: ?Sized, O: ?Sized>(
    work: &W,
    input: &I,
    output: &mut O,
) -> W::Outcome {
    work.run::<Sixteen>(input, output)
}

#[cfg(wide_vectors)]
#[target_feature(enable = "avx2")]
fn avx2<W: InLanesInto<I, O>, I: ?Sized, O: ?Sized>(
    work: &W,
    input: &I,
    output: &mut O,
) -> W::Outcome {
    work.run::<Eight>(input, output)
}

/// The narrowest width with which non-temporal stores write long results faster on this processor, if there is one.
/// With ordinary stores, Intel's cores wait for each cache line that they overwrite, and AMD's Zen 5 often does; on
/// Zen 3 both take the same time.
pub(crate) fn streaming_stores_from() -> Option<VectorWidth> {
    static FROM: OnceLock<Option<VectorWidth>> = OnceLock::new();
    *FROM.get_or_init(detect_streaming_stores)
}

fn detect_streaming_stores() -> Option<VectorWidth> {
    // Miri executes neither `cpuid` nor non-temporal stores.
    #[cfg(all(target_arch = "x86_64", not(miri)))]
    {
        use std::arch::x86_64::__cpuid;
        const ZEN_5: u32 = 26;
        // Newer compilers know that it is safe.
        #[allow(unused_unsafe)]
        // SAFETY: every x86-64 processor has this instruction.
        let [vendor, model] = [0, 1].map(|leaf| unsafe { __cpuid(leaf) });
        let name = [vendor.ebx, vendor.edx, vendor.ecx].map(u32::to_le_bytes);
        // The family is a sum of two fields, the second of which is 0 for families below 15.
        let signature = model.eax;
        let family = (signature >> 8 & 0xf) + (signature >> 20 & 0xff);
        match name.as_flattened() {
            b"GenuineIntel" => Some(VectorWidth::Baseline),
            b"AuthenticAMD" if family >= ZEN_5 => Some(VectorWidth::Avx512),
            _ => None,
        }
    }
    #[cfg(any(not(target_arch = "x86_64"), miri))]
    None
}

/// Orders this thread's non-temporal stores before its later stores, as other threads see them.
pub(crate) fn fence() {
    #[cfg(all(target_arch = "x86_64", not(miri)))]
    // SAFETY: SSE is part of x86-64.
    unsafe {
        std::arch::x86_64::_mm_sfence();
    }
}

/// Fills memory with one rotation.
struct FillPastCaches([f32; 4]);

impl InLanesInto<(), [CacheLine]> for FillPastCaches {
    const WIDE_IN_TESTS: bool = true;
    type Outcome = ();

    #[inline(always)]
    fn run<L: Lanes>(&self, (): &(), lines: &mut [CacheLine]) {
        let value = L::repeated(self.0);
        for block in bytemuck::cast_slice_mut::<CacheLine, L::Block>(lines) {
            value.store_past_caches(block);
        }
        fence();
    }
}

impl VectorWidth {
    /// Fills `output` with one rotation by non-temporal stores. On some processors this is the fastest method to
    /// write more than the caches can contain; the speed of evaluation is compared with it.
    pub fn fill_past_caches(self, output: &mut [Quat], value: Quat) {
        let rotations: &mut [[f32; 4]] = bytemuck::cast_slice_mut(output);
        let (before, lines, after) = bytemuck::pod_align_to_mut(rotations);
        let value = value.to_array();
        before.fill(value);
        in_lanes_into(self, &FillPastCaches(value), &(), lines);
        after.fill(value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_have_names() {
        assert_eq!("AVX2".parse(), Ok(VectorWidth::Avx2));
        assert_eq!("sse2".parse(), Ok(VectorWidth::Baseline));
        let error = "avx".parse::<VectorWidth>().unwrap_err();
        assert!(error.to_string().contains("baseline, avx2, avx512"));
    }

    #[test]
    fn memory_is_filled_from_any_start() {
        let value = Quat::from_array([1.0, 2.0, 3.0, 4.0]);
        for width in VectorWidth::available() {
            for (start, count) in (0..5).flat_map(|start| [0, 1, 7, 100].map(|n| (start, n))) {
                let mut memory = vec![Quat::IDENTITY; 110];
                width.fill_past_caches(&mut memory[start..start + count], value);
                for (i, found) in memory.iter().enumerate() {
                    let is_inside = (start..start + count).contains(&i);
                    assert_eq!(*found, if is_inside { value } else { Quat::IDENTITY });
                }
            }
        }
    }
}
