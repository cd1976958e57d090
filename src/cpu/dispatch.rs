//! The widest vector instructions that this processor has, chosen at run time: one
//! binary runs everywhere. Every choice gives the same bits; only addition,
//! subtraction and multiplication are used, never a fused one.
#![allow(unsafe_code)]

use super::evaluate::{Affine, Evaluate, Scratch, distances, frames};
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

type FramesFn<S> = unsafe fn(&S, Affine, i32, usize, &mut Scratch, &mut [[f32; 4]]);
type DistancesFn<S> = unsafe fn(&S, Affine, &[f32], &mut Scratch, &mut [[f32; 4]]);

/// The evaluation of one form, compiled for one width.
#[derive(Clone, Copy)]
pub(crate) struct Kernel<S> {
    frames: FramesFn<S>,
    distances: DistancesFn<S>,
}

impl<S> Kernel<S> {
    /// See [`frames`].
    pub(crate) fn frames(
        &self,
        segment: &S,
        affine: Affine,
        first: i32,
        count: usize,
        scratch: &mut Scratch,
        output: &mut [[f32; 4]],
    ) {
        // SAFETY: a kernel exists only for a width that the processor has
        // (`Kernels::new`); otherwise these are safe functions.
        unsafe { (self.frames)(segment, affine, first, count, scratch, output) }
    }

    /// See [`distances`].
    pub(crate) fn distances(
        &self,
        segment: &S,
        affine: Affine,
        from_middle: &[f32],
        scratch: &mut Scratch,
        output: &mut [[f32; 4]],
    ) {
        // SAFETY: as above.
        unsafe { (self.distances)(segment, affine, from_middle, scratch, output) }
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

fn baseline<S: Evaluate>() -> Kernel<S> {
    Kernel {
        frames: frames::<S>,
        distances: distances::<S>,
    }
}

#[cfg(target_arch = "x86_64")]
macro_rules! compiled_for {
    ($width:ident, $features:literal) => {
        mod $width {
            use super::{Affine, Evaluate, Kernel, Scratch};

            #[target_feature(enable = $features)]
            fn frames<S: Evaluate>(
                segment: &S,
                affine: Affine,
                first: i32,
                count: usize,
                scratch: &mut Scratch,
                output: &mut [[f32; 4]],
            ) {
                super::frames(segment, affine, first, count, scratch, output);
            }

            #[target_feature(enable = $features)]
            fn distances<S: Evaluate>(
                segment: &S,
                affine: Affine,
                from_middle: &[f32],
                scratch: &mut Scratch,
                output: &mut [[f32; 4]],
            ) {
                super::distances(segment, affine, from_middle, scratch, output);
            }

            pub(super) fn kernel<S: Evaluate>() -> Kernel<S> {
                Kernel {
                    frames: frames::<S>,
                    distances: distances::<S>,
                }
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
compiled_for!(avx2, "avx2");
#[cfg(target_arch = "x86_64")]
compiled_for!(avx512, "avx512f,avx512dq,avx512vl,avx512bw");
