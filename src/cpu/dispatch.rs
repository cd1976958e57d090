//! The widest vector instructions that this processor has, chosen at run time: one
//! binary runs everywhere. Every choice gives the same bits; only addition,
//! subtraction and multiplication are used, never a fused one.
#![allow(unsafe_code)]

mod doubles;
#[cfg(target_arch = "x86_64")]
mod eight;
#[cfg(target_arch = "x86_64")]
mod operators;
#[cfg(target_arch = "x86_64")]
mod sixteen;

use std::str::FromStr;
use std::sync::OnceLock;

use glam::Vec4;

pub(crate) use doubles::Four;
#[cfg(target_arch = "x86_64")]
use eight::Eight;
#[cfg(target_arch = "x86_64")]
use sixteen::Sixteen;

use super::evaluate::Evaluate;
use super::lanes::Lanes;
use super::row::row;
use super::stage::{Line, Output, Staged};
use crate::clock::{FramesError, Timeline};
use crate::cycle::Cycle;
use crate::prepare::PartRef;
use crate::segment::{ArcSegment, PolynomialSegment};

/// Vector instructions that the twins can be compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum VectorWidth {
    /// What the target always has: SSE2 on x86-64, NEON on `AArch64`.
    Baseline,
    /// AVX2, eight lanes.
    Avx2,
    /// AVX-512, sixteen lanes.
    Avx512,
}

impl VectorWidth {
    /// Every width that this processor can run, narrowest first.
    #[must_use]
    pub fn available() -> Vec<Self> {
        [Self::Baseline, Self::Avx2, Self::Avx512]
            .into_iter()
            .filter(|width| width.is_available())
            .collect()
    }

    /// The widest that this process uses where nobody chooses: what the processor has,
    /// or less where the environment's `TUMBLE_VECTOR_WIDTH` says so.
    pub fn widest() -> Self {
        static WIDEST: OnceLock<VectorWidth> = OnceLock::new();
        #[cfg(test)]
        if let Some(width) = tests::WIDTH.get() {
            return width;
        }
        *WIDEST.get_or_init(|| {
            let limit = Self::limit().ok().flatten().unwrap_or(Self::Avx512);
            limit.narrowed()
        })
    }

    /// The limit that the environment sets.
    pub(crate) fn limit() -> Result<Option<Self>, UnknownWidth> {
        match std::env::var("TUMBLE_VECTOR_WIDTH") {
            Ok(name) if !name.is_empty() => name.parse().map(Some),
            _ => Ok(None),
        }
    }

    /// This width, or the next narrower one that the processor has.
    fn narrowed(self) -> Self {
        let narrower = Self::available().into_iter().filter(|&have| have <= self);
        narrower.max().unwrap_or(Self::Baseline)
    }

    fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => std::arch::is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                std::arch::is_x86_feature_detected!("avx512f")
                    && std::arch::is_x86_feature_detected!("avx512dq")
                    && std::arch::is_x86_feature_detected!("avx512vl")
                    && std::arch::is_x86_feature_detected!("avx512bw")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }
}

/// A name that is no vector width's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no vector width `{name}`; there are baseline, avx2 and avx512")]
pub struct UnknownWidth {
    /// The name given.
    pub name: String,
}

impl FromStr for VectorWidth {
    type Err = UnknownWidth;

    fn from_str(name: &str) -> Result<Self, UnknownWidth> {
        match name.to_lowercase().as_str() {
            "baseline" | "sse2" | "neon" => Ok(Self::Baseline),
            "avx2" => Ok(Self::Avx2),
            "avx512" => Ok(Self::Avx512),
            _ => Err(UnknownWidth {
                name: name.to_owned(),
            }),
        }
    }
}

type RowFn<S> =
    unsafe fn(PartRef<'_>, &[S], &Timeline, &Cycle, &mut [[f32; 4]]) -> Result<(), FramesError>;

type StagedFn<S> =
    unsafe fn(PartRef<'_>, &[S], &Timeline, &Cycle, &mut Staged<'_, '_>) -> Result<(), FramesError>;

/// The evaluation of one form, compiled for one width.
#[derive(Clone, Copy)]
pub(crate) struct Kernel<S> {
    row: RowFn<S>,
    staged: StagedFn<S>,
}

impl<S> Kernel<S> {
    /// See [`row`].
    pub(crate) fn row(
        &self,
        part: PartRef<'_>,
        segments: &[S],
        timeline: &Timeline,
        cycle: &Cycle,
        output: &mut Output<'_, '_>,
    ) -> Result<(), FramesError> {
        // SAFETY: a kernel exists only for a width that the processor has
        // (`Kernels::new`); otherwise this is a safe function.
        unsafe {
            match output {
                Output::Here(samples) => (self.row)(part, segments, timeline, cycle, samples),
                Output::Staged(staged) => (self.staged)(part, segments, timeline, cycle, staged),
            }
        }
    }
}

/// The twins, compiled for the chosen width.
#[derive(Clone, Copy)]
pub(crate) struct Kernels {
    width: VectorWidth,
    pub(crate) arc: Kernel<ArcSegment>,
    pub(crate) polynomial: Kernel<PolynomialSegment>,
}

impl Kernels {
    /// The kernels of a width; narrower ones where the processor does not have it.
    pub(crate) fn new(width: VectorWidth) -> Self {
        let width = width.narrowed();
        match width {
            #[cfg(target_arch = "x86_64")]
            VectorWidth::Avx512 => Self {
                width,
                arc: avx512::kernel(),
                polynomial: avx512::kernel(),
            },
            #[cfg(target_arch = "x86_64")]
            VectorWidth::Avx2 => Self {
                width,
                arc: avx2::kernel(),
                polynomial: avx2::kernel(),
            },
            _ => Self {
                width,
                arc: baseline(),
                polynomial: baseline(),
            },
        }
    }

    /// Whether long results are better written past the caches. A core of Intel's waits for
    /// each line that it overwrites, one of AMD's Zen 5 often; Zen 3 writes as fast either way.
    pub(crate) fn gain_past_caches(&self) -> bool {
        static FROM: OnceLock<Option<VectorWidth>> = OnceLock::new();
        let from = FROM.get_or_init(gains_past_caches_from);
        from.is_some_and(|from| self.width >= from)
    }

    /// Does work over lanes with vectors of this width.
    pub(crate) fn in_lanes<W: InLanes>(&self, work: &mut W) {
        lanes_of(self.width, work);
    }
}

/// Work over lanes: `run` is compiled for each vector width. Implementations are
/// `#[inline(always)]`. Loops that are not written in vectors have no branches, calls or
/// intrinsics, so that the compiler makes vectors of them.
pub(crate) trait InLanes {
    /// `L`: the vectors, for work that is written in them.
    fn run<L: Lanes>(&mut self);
}

/// Does work over lanes with the widest vectors there are.
pub(crate) fn in_lanes<W: InLanes>(work: &mut W) {
    lanes_of(VectorWidth::widest(), work);
}

/// `width` is one that the processor has.
fn lanes_of<W: InLanes>(width: VectorWidth, work: &mut W) {
    let run: unsafe fn(&mut W) = match width {
        #[cfg(target_arch = "x86_64")]
        VectorWidth::Avx512 => avx512::in_lanes::<W>,
        #[cfg(target_arch = "x86_64")]
        VectorWidth::Avx2 => avx2::in_lanes::<W>,
        _ => W::run::<Vec4>,
    };
    // SAFETY: the processor has the vectors of that width, which is the widest or a
    // narrowed one; the last is a safe function.
    unsafe { run(work) }
}

/// The narrowest vectors for which [`Kernels::gain_past_caches`] holds on this processor.
#[cfg(target_arch = "x86_64")]
fn gains_past_caches_from() -> Option<VectorWidth> {
    use std::arch::x86_64::__cpuid;
    const ZEN_5: u32 = 26;
    let vendor = __cpuid(0);
    let name = [vendor.ebx, vendor.edx, vendor.ecx].map(u32::to_le_bytes);
    // Above 15, it is told in two parts.
    let signature = __cpuid(1).eax;
    let family = (signature >> 8 & 0xf) + (signature >> 20 & 0xff);
    match name.as_flattened() {
        b"GenuineIntel" => Some(VectorWidth::Avx2),
        b"AuthenticAMD" if family >= ZEN_5 => Some(VectorWidth::Avx512),
        _ => None,
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn gains_past_caches_from() -> Option<VectorWidth> {
    None
}

/// Has memory brought into the cache, while what comes next is done.
pub(crate) fn bring_near(memory: &[u8]) {
    #[cfg(target_arch = "x86_64")]
    for line in memory.chunks(size_of::<Line>()) {
        use std::arch::x86_64::{_MM_HINT_T1, _mm_prefetch};
        // SAFETY: SSE is always there; nothing is read that counts.
        unsafe { _mm_prefetch::<_MM_HINT_T1>(line.as_ptr().cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = memory;
}

/// What this thread stored past the caches is seen before what it stores from here on.
pub(crate) fn fence() {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: SSE is always there.
    unsafe {
        std::arch::x86_64::_mm_sfence();
    }
}

fn baseline<S: Evaluate>() -> Kernel<S> {
    Kernel {
        row: row::<Vec4, S, [[f32; 4]]>,
        staged: |part, segments, timeline, cycle, output| {
            row::<Vec4, S, _>(part, segments, timeline, cycle, output)
        },
    }
}

#[cfg(target_arch = "x86_64")]
macro_rules! compiled_for {
    ($width:ident, $features:literal, $lanes:ident) => {
        mod $width {
            use super::{Cycle, Evaluate, FramesError, InLanes, Kernel, PartRef, Staged, Timeline};

            #[target_feature(enable = $features)]
            fn row<S: Evaluate>(
                part: PartRef<'_>,
                segments: &[S],
                timeline: &Timeline,
                cycle: &Cycle,
                output: &mut [[f32; 4]],
            ) -> Result<(), FramesError> {
                super::row::<super::$lanes, S, _>(part, segments, timeline, cycle, output)
            }

            #[target_feature(enable = $features)]
            fn staged<S: Evaluate>(
                part: PartRef<'_>,
                segments: &[S],
                timeline: &Timeline,
                cycle: &Cycle,
                output: &mut Staged<'_, '_>,
            ) -> Result<(), FramesError> {
                super::row::<super::$lanes, S, _>(part, segments, timeline, cycle, output)
            }

            #[target_feature(enable = $features)]
            pub(super) fn in_lanes<W: InLanes>(work: &mut W) {
                work.run::<super::$lanes>();
            }

            pub(super) fn kernel<S: Evaluate>() -> Kernel<S> {
                Kernel {
                    row: row::<S>,
                    staged: staged::<S>,
                }
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
compiled_for!(avx2, "avx2", Eight);
#[cfg(target_arch = "x86_64")]
compiled_for!(avx512, "avx512f,avx512dq,avx512vl,avx512bw", Sixteen);

#[cfg(test)]
pub(crate) mod tests {
    use std::cell::Cell;

    use super::VectorWidth;

    thread_local! {
        pub(super) static WIDTH: Cell<Option<VectorWidth>> = const { Cell::new(None) };
    }

    /// What `work` gives on this thread at every width that the processor has.
    pub(crate) fn at_every_width<R>(work: impl Fn() -> R) -> Vec<(VectorWidth, R)> {
        let at = |width| {
            WIDTH.set(Some(width));
            (width, work())
        };
        let results = VectorWidth::available().into_iter().map(at).collect();
        WIDTH.set(None);
        results
    }

    #[test]
    fn widths_have_names() {
        assert_eq!("AVX2".parse(), Ok(VectorWidth::Avx2));
        assert_eq!("sse2".parse(), Ok(VectorWidth::Baseline));
        let error = "avx".parse::<VectorWidth>().unwrap_err();
        assert!(error.to_string().contains("baseline, avx2 and avx512"));
    }
}
