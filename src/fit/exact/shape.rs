//! Formulas as values: a [`Shape`] has the functions that evaluate and fit the curves of one
//! formula, so that the preparation need not know which it is.

use std::marker::PhantomData;

use crate::curve::formula::{
    DeCasteljau, Formula, FormulaNumbers, Hermite, Linear, NUMBERS, Product, RotationVector, Squad,
    StraightLine,
};
use crate::fit::block::{load, put, rounded, store};
use crate::fit::exact::expansion::Expansion;
use crate::fit::exact::fit::{FitBlock, Tier};
use crate::fit::exact::handles::redo;
use crate::fit::motion::derivatives::{Motion, MotionOf};
use crate::fit::nodes::{FULL_NODES, NodeSamples, Nodes, SMALL_ANGLE_NODES};
use crate::math::dual::{Dual, Near};
use crate::math::quaternion::{Quaternion, Real};
use crate::shader::{POWERS, PolynomialSegment};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::doubles::Doubles;
use crate::simd::lanes::{Lanes, MAX_LANES};

/// A formula, and how its curves are sampled.
#[derive(Debug)]
pub(crate) struct Shape {
    /// The count of numbers that differ from curve to curve.
    pub(crate) per_curve: usize,
    /// The numbers after them, which all curves share.
    pub(crate) shared: FormulaNumbers,
    /// Whether the formula is entire, a product of exponentials: its Chebyshev coefficients then
    /// decrease faster and faster, and the fit of a curve of small angle needs no check.
    pub(crate) entire: bool,
    /// Whether its values are unit quaternions.
    pub(crate) is_unit: bool,
    pub(crate) rotation: fn(&FormulaNumbers, f64) -> Quaternion,
    pub(crate) moving: fn(&FormulaNumbers, Dual) -> [Dual; 4],
    /// See [`Sampling::fit`].
    pub(crate) fit: fn(&mut FitBlock, &mut [PolynomialSegment]),
    /// The same, of velocities and accelerations.
    pub(crate) fit_rates: fn(&mut FitBlock, &mut [PolynomialSegment]),
}

impl Shape {
    const fn of<F: Formula>(per_curve: usize) -> Self {
        Self {
            per_curve,
            shared: [0.0; NUMBERS],
            entire: false,
            is_unit: true,
            rotation: F::rotation::<f64>,
            moving: F::rotation::<Dual>,
            fit: fit::<Directly<F>>,
            fit_rates: fit::<Motion>,
        }
    }

    /// All numbers of a curve: those that differ from curve to curve, then the shared ones.
    pub(crate) fn curve_numbers(&self, number_at: impl Fn(usize) -> f64) -> FormulaNumbers {
        let mut numbers = self.shared;
        for (i, number) in numbers[..self.per_curve].iter_mut().enumerate() {
            *number = number_at(i);
        }
        numbers
    }

    /// [`Product`] with Bernstein's basis.
    pub(crate) const BERNSTEIN: &'static Self = &Self {
        per_curve: Product::BASIS,
        shared: Product::WITH_BERNSTEIN,
        entire: true,
        fit: fit::<Expansion<false>>,
        fit_rates: rates_of::<Product>(),
        ..Self::of::<Product>(NUMBERS)
    };
    /// [`Product`] whose basis functions differ from curve to curve.
    pub(crate) const PRODUCT: &'static Self = &Self {
        entire: true,
        fit: fit::<Expansion<true>>,
        fit_rates: rates_of::<Product>(),
        ..Self::of::<Product>(NUMBERS)
    };
    pub(crate) const DE_CASTELJAU: &'static Self = &Self::of::<DeCasteljau>(16);
    pub(crate) const SQUAD: &'static Self = &Self::of::<Squad>(16);
    pub(crate) const LINEAR: &'static Self = &Self::of::<Linear>(16);
    pub(crate) const HERMITE: &'static Self = &Self::of::<Hermite>(16);
    pub(crate) const LINE: &'static Self = &Self {
        is_unit: false,
        ..Self::of::<StraightLine>(8)
    };
    pub(crate) const ROTATION_VECTOR: &'static Self = &Self {
        fit_rates: rates_of::<RotationVector>(),
        ..Self::of::<RotationVector>(13)
    };
}

/// How velocities and accelerations are fitted: in vector lanes, compiled for each formula; in WebAssembly, where
/// every page would carry that, curve by curve, with the same bits.
const fn rates_of<F: Formula>() -> fn(&mut FitBlock, &mut [PolynomialSegment]) {
    if cfg!(target_arch = "wasm32") {
        fit::<Motion>
    } else {
        fit::<MotionOf<F>>
    }
}

/// A way to sample the curves of a block.
pub(crate) trait Sampling: 'static {
    /// Samples the curves and writes the interpolating polynomials to their segments.
    fn fit<L: Lanes, const PAIRS: usize>(
        block: &mut FitBlock,
        nodes: &Nodes<PAIRS>,
        segments: &mut [PolynomialSegment],
    );
}

/// Fits the curves of a block.
pub(crate) fn fit<S: Sampling>(block: &mut FitBlock, segments: &mut [PolynomialSegment]) {
    in_lanes(&mut BlockFit::<S>(block, segments, PhantomData));
}

struct BlockFit<'a, S>(
    &'a mut FitBlock,
    &'a mut [PolynomialSegment],
    PhantomData<S>,
);

impl<S: Sampling> InLanes for BlockFit<'_, S> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let Self(block, segments, _) = self;
        match block.tier {
            Tier::SmallAngle => S::fit::<L, _>(block, &SMALL_ANGLE_NODES, segments),
            Tier::Full | Tier::Piece => S::fit::<L, _>(block, &FULL_NODES, segments),
        }
    }
}

/// Samples curves by the formula itself, in f64.
struct Directly<F>(PhantomData<F>);

impl<F: Formula> Sampling for Directly<F> {
    #[inline(always)]
    fn fit<L: Lanes, const PAIRS: usize>(
        block: &mut FitBlock,
        nodes: &Nodes<PAIRS>,
        segments: &mut [PolynomialSegment],
    ) {
        let zero = L::Doubles::all(0.0);
        for lane in (0..block.padded_count()).step_by(L::COUNT) {
            let mut numbers = [zero; NUMBERS];
            for (number, lanes) in numbers.iter_mut().zip(&block.numbers) {
                *number = L::Doubles::load(&lanes[lane..]);
            }
            let at = L::Doubles::load(&block.middles[lane..]);
            let width = L::Doubles::load(&block.widths[lane..]);
            // One loop over all nodes: the formula is compiled once, and what does not change along
            // a curve is computed once.
            let mut found = [[zero; 4]; POWERS];
            let mut doubt = zero;
            for (i, found) in found[..=2 * PAIRS].iter_mut().enumerate() {
                let t = at + L::Doubles::all(nodes.offset(i)) * width;
                let [Near(x), Near(y), Near(z), Near(w)] = F::rotation(&numbers, Near(t));
                *found = [x, y, z, w];
                // NaN if any component is NaN or infinite, else 0.
                doubt = doubt + (x + y + z + w) * zero;
            }
            let mut again = FullRangeSamples::<L, PAIRS> {
                block,
                first: lane,
                nodes,
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
            let mut samples = NodeSamples::all(L::all(0.0));
            samples.middle = rounded(middle);
            for k in 0..PAIRS {
                let (before, after) = (found[1 + k], found[1 + PAIRS + k]);
                for c in 0..4 {
                    let sum = (after[c] - middle[c]) + (before[c] - middle[c]);
                    samples.even[k][c] = L::rounded(sum);
                    samples.odd[k][c] = L::rounded(after[c] - before[c]);
                }
            }
            block.interpolate(lane, nodes, &samples, segments);
        }
    }
}

/// Samples of curves whose angles are too long for [`Near`] in some lanes.
struct FullRangeSamples<'a, L: Lanes, const PAIRS: usize> {
    block: &'a FitBlock,
    /// The curve in the first lane.
    first: usize,
    nodes: &'a Nodes<PAIRS>,
    found: [[L::Doubles; 4]; POWERS],
}

impl<L: Lanes, const PAIRS: usize> FullRangeSamples<'_, L, PAIRS> {
    /// Samples the curve in the `j`th lane over the full range.
    fn sample<F: Formula>(&mut self, j: usize) {
        let (block, lane) = (self.block, self.first + j);
        let numbers = block.numbers_of(lane);
        let (at, width) = (block.middles[lane], block.widths[lane]);
        for (i, found) in self.found[..=2 * PAIRS].iter_mut().enumerate() {
            let mut lanes = [[0.0; MAX_LANES]; 4];
            store(&mut lanes, 0, *found);
            let t = at + self.nodes.offset(i) * width;
            put(&mut lanes, j, F::rotation(&numbers, t));
            *found = load(&lanes, 0);
        }
    }
}
