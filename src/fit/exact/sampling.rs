//! The first half of a fit: sampling of the curves of a block at the nodes; one implementation works for any formula,
//! by the formula itself in f64. The second half, [`FitBlock::interpolate`], is the same for all.

use std::marker::PhantomData;

use crate::curve::formula::{Formula, NUMBERS};
use crate::fit::block::{load, put, rounded, store};
use crate::fit::exact::fit::FitBlock;
use crate::fit::exact::handles::redo;
use crate::math::dual::Near;
use crate::math::quaternion::Real as _;
use crate::shader::{POWERS, PolynomialSegment};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::doubles::Doubles;
use crate::simd::lanes::{Lanes, MAX_LANES};

/// A method of sampling the curves of a block.
pub(crate) trait Sampling: 'static {
    /// Whether it samples in the units [`FitBlock::scales`].
    const IS_SCALED: bool = false;

    /// Sets the samples of all curves at the nodes of the block's tier.
    fn sample<L: Lanes>(block: &mut FitBlock);
}

/// Fits the curves of a block, and writes the polynomials to their segments.
pub(crate) fn fit<S: Sampling>(block: &mut FitBlock, segments: &mut [PolynomialSegment]) {
    in_lanes(&mut BlockSampling::<S>(block, PhantomData));
    block.interpolate(segments);
    if S::IS_SCALED {
        block.scale(segments);
    }
}

struct BlockSampling<'a, S>(&'a mut FitBlock, PhantomData<S>);

impl<S: Sampling> InLanes for BlockSampling<'_, S> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        S::sample::<L>(self.0);
    }
}

/// Samples curves by the formula itself, in f64.
pub(crate) struct Directly<F>(PhantomData<F>);

impl<F: Formula> Sampling for Directly<F> {
    #[inline(always)]
    fn sample<L: Lanes>(block: &mut FitBlock) {
        let zero = L::Doubles::all(0.0);
        let offsets = block.tier.offsets();
        let pairs = offsets.len() / 2;
        for lane in (0..block.padded_count()).step_by(L::COUNT) {
            let mut numbers = [zero; NUMBERS];
            for (number, lanes) in numbers.iter_mut().zip(&block.numbers) {
                *number = L::Doubles::load(&lanes[lane..]);
            }
            let at = L::Doubles::load(&block.middles[lane..]);
            let width = L::Doubles::load(&block.widths[lane..]);
            // A single loop over all nodes, so that the formula is compiled once and terms that are constant along a
            // curve are computed once.
            let mut found = [[zero; 4]; POWERS];
            let mut doubt = zero;
            for (found, &offset) in found.iter_mut().zip(offsets) {
                let t = at + L::Doubles::all(offset) * width;
                let [Near(x), Near(y), Near(z), Near(w)] = F::rotation(&numbers, Near(t));
                *found = [x, y, z, w];
                // NaN if any component is NaN or infinite, else 0.
                doubt = doubt + (x + y + z + w) * zero;
            }
            let mut again = FullRangeSamples::<L> {
                block,
                first: lane,
                found,
            };
            redo(
                doubt,
                0..L::COUNT,
                &mut again,
                FullRangeSamples::sample::<F>,
            );
            let found = again.found;
            let middle = found[0];
            block.set_middle::<L>(lane, rounded(middle));
            for k in 0..pairs {
                let (before, after) = (found[1 + k], found[1 + pairs + k]);
                let (mut even, mut odd) = ([L::all(0.0); 4], [L::all(0.0); 4]);
                for c in 0..4 {
                    let sum = (after[c] - middle[c]) + (before[c] - middle[c]);
                    even[c] = L::rounded(sum);
                    odd[c] = L::rounded(after[c] - before[c]);
                }
                block.set_pair(lane, k, even, odd);
            }
        }
    }
}

/// Samples of curves whose angles are too long for [`Near`] in some lanes.
struct FullRangeSamples<'a, L: Lanes> {
    block: &'a FitBlock,
    /// The curve in the first lane.
    first: usize,
    found: [[L::Doubles; 4]; POWERS],
}

impl<L: Lanes> FullRangeSamples<'_, L> {
    /// Samples the curve in the `j`th lane over the full range.
    fn sample<F: Formula>(&mut self, j: usize) {
        let (block, lane) = (self.block, self.first + j);
        let numbers = block.numbers_of(lane);
        let (at, width) = (block.middles[lane], block.widths[lane]);
        for (found, &offset) in self.found.iter_mut().zip(block.tier.offsets()) {
            let mut lanes = [[0.0; MAX_LANES]; 4];
            store(&mut lanes, 0, *found);
            put(&mut lanes, j, F::rotation(&numbers, at + offset * width));
            *found = load(&lanes, 0);
        }
    }
}
