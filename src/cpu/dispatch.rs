//! The widest vector instructions that this processor has, chosen at run time: one
//! binary runs everywhere. Every choice gives the same bits; only addition,
//! subtraction and multiplication are used, never a fused one.
#![allow(unsafe_code)]

use std::ops::Range;

use super::evaluate::Evaluate;
use super::row::row;
use crate::clock::{FramesError, Timeline};
use crate::prepare::{ArcBlock, PartRef};
use crate::segment::{ArcSegment, CumulativeSegment};

/// Vector instructions that the twins can be compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum VectorWidth {
    /// What the target always has: SSE2 on x86-64, NEON on AArch64.
    Baseline,
    /// AVX2, eight lanes.
    Avx2,
    /// AVX-512, sixteen lanes.
    Avx512,
}

impl VectorWidth {
    /// Every width that this processor can run, narrowest first.
    pub fn available() -> Vec<Self> {
        [Self::Baseline, Self::Avx2, Self::Avx512]
            .into_iter()
            .filter(|width| width.is_available())
            .collect()
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

type RowFn<S> = unsafe fn(
    PartRef<'_>,
    &[S],
    &Timeline,
    Range<usize>,
    &mut [[f32; 4]],
) -> Result<(), FramesError>;

/// The evaluation of one form, compiled for one width.
#[derive(Clone, Copy)]
pub(crate) struct Kernel<S> {
    row: RowFn<S>,
}

impl<S> Kernel<S> {
    /// See [`row`].
    pub(crate) fn row(
        &self,
        part: PartRef<'_>,
        segments: &[S],
        timeline: &Timeline,
        samples: Range<usize>,
        output: &mut [[f32; 4]],
    ) -> Result<(), FramesError> {
        // SAFETY: a kernel exists only for a width that the processor has
        // (`Kernels::new`); otherwise this is a safe function.
        unsafe { (self.row)(part, segments, timeline, samples, output) }
    }
}

/// The twins, compiled for the chosen width.
#[derive(Clone, Copy)]
pub(crate) struct Kernels {
    pub(crate) arc: Kernel<ArcSegment>,
    pub(crate) cumulative: Kernel<CumulativeSegment>,
}

impl Kernels {
    /// The kernels of a width; narrower ones where the processor does not have it.
    pub(crate) fn new(width: VectorWidth) -> Self {
        let narrower = VectorWidth::available()
            .into_iter()
            .filter(|&have| have <= width);
        match narrower.max() {
            #[cfg(target_arch = "x86_64")]
            Some(VectorWidth::Avx512) => Self {
                arc: avx512::kernel(),
                cumulative: avx512::kernel(),
            },
            #[cfg(target_arch = "x86_64")]
            Some(VectorWidth::Avx2) => Self {
                arc: avx2::kernel(),
                cumulative: avx2::kernel(),
            },
            _ => Self {
                arc: baseline(),
                cumulative: baseline(),
            },
        }
    }
}

/// Works out a block of arcs with the widest vectors there are; see
/// [`ArcBlock::fill`].
pub(crate) fn arc_block(block: &mut ArcBlock, noise: f64) {
    arc_block_at(VectorWidth::Avx512, block, noise);
}

/// As [`arc_block`], with vectors no wider than `width`.
pub(crate) fn arc_block_at(width: VectorWidth, block: &mut ArcBlock, noise: f64) {
    let fill: unsafe fn(&mut ArcBlock, f64) = match width {
        #[cfg(target_arch = "x86_64")]
        VectorWidth::Avx512 if VectorWidth::Avx512.is_available() => avx512::arc_block,
        #[cfg(target_arch = "x86_64")]
        VectorWidth::Avx512 | VectorWidth::Avx2 if VectorWidth::Avx2.is_available() => {
            avx2::arc_block
        }
        _ => ArcBlock::fill,
    };
    // SAFETY: each is chosen only where the processor has its vectors; the last is a
    // safe function.
    unsafe { fill(block, noise) }
}

fn baseline<S: Evaluate>() -> Kernel<S> {
    Kernel { row: row::<S> }
}

#[cfg(target_arch = "x86_64")]
macro_rules! compiled_for {
    ($width:ident, $features:literal) => {
        mod $width {
            use super::{ArcBlock, Evaluate, FramesError, Kernel, PartRef, Range, Timeline};

            #[target_feature(enable = $features)]
            fn row<S: Evaluate>(
                part: PartRef<'_>,
                segments: &[S],
                timeline: &Timeline,
                samples: Range<usize>,
                output: &mut [[f32; 4]],
            ) -> Result<(), FramesError> {
                super::row(part, segments, timeline, samples, output)
            }

            #[target_feature(enable = $features)]
            pub(super) fn arc_block(block: &mut ArcBlock, noise: f64) {
                block.fill(noise);
            }

            pub(super) fn kernel<S: Evaluate>() -> Kernel<S> {
                Kernel { row: row::<S> }
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
compiled_for!(avx2, "avx2");
#[cfg(target_arch = "x86_64")]
compiled_for!(avx512, "avx512f,avx512dq,avx512vl,avx512bw");
