//! Fits curves by the polynomials that the kernels evaluate, in vector lanes.
//!
//! A curve is sampled at Chebyshev nodes, and each component of the rotation becomes the polynomial
//! through the samples ([`nodes`](crate::fit::nodes)).

use std::sync::Arc;

use bytemuck::Zeroable;

use crate::curve::formula::FormulaNumbers;
use crate::curve::options::Quantity;
use crate::fit::block::{Intervals, LANES};
use crate::fit::exact::curve::{CurvePiece, IntervalCurve};
use crate::fit::exact::shape::{self, Shape};
use crate::fit::motion::arc_length::ArcLengths;
use crate::fit::motion::derivatives::Motion;
use crate::fit::nodes::{NodeSamples, Nodes, interpolate};
use crate::shader::PolynomialSegment;
use crate::simd::lanes::{Lanes, canonical};

/// How a curve is fitted, by how far it turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tier {
    /// Degree 6, for curves that turn through small angles, such as between the dense keys of
    /// motion capture.
    SmallAngle,
    /// Degree 10.
    Full,
    /// Degree 10 for a piece of a curve, which may turn any distance.
    Piece,
}

/// The squared extent (the sum of the three half-rotation vectors' squares) up to which degree 6
/// fits a curve within 2e-8.
pub(crate) const SMALL_ANGLE: f64 = 0.002;

/// The squared extent above which curves are cut without trying to fit them whole: hardly any
/// would fit.
pub(crate) const LARGEST_UNCUT: f64 = 0.2;

/// The largest accepted estimate of twice a fit's truncation error; see [`tail`](crate::fit::nodes::tail).
pub(crate) const TOLERANCE: f32 = 1.5e-7;

/// The largest angles from the middle of a piece, and of a whole curve: the polynomials of sine and
/// cosine are valid up to pi/2 and up to pi/4.
const REACH: f64 = 1.57;
const SHORT_REACH: f64 = 0.785;

pub(crate) type FitRow = [f64; LANES];
pub(crate) type FitRowF32 = [f32; LANES];

/// The tier for a curve with this squared extent; [`Tier::Piece`] if it is to be cut without a try.
pub(crate) fn tier(squared_extent: f64) -> Tier {
    if squared_extent <= SMALL_ANGLE {
        Tier::SmallAngle
    } else if squared_extent <= LARGEST_UNCUT {
        Tier::Full
    } else {
        // NaN comes here too; such a curve is cut down to the finest pieces, and none fits.
        Tier::Piece
    }
}

/// Up to [`LANES`] curves that wait to be fitted, all of one shape and tier.
pub(crate) struct FitBlock {
    pub(crate) shape: &'static Shape,
    pub(crate) tier: Tier,
    /// The numbers that differ from curve to curve.
    pub(crate) numbers: Vec<FitRow>,
    /// The middle of the piece to fit and its width, as fractions of the interval.
    pub(crate) middles: FitRow,
    pub(crate) widths: FitRow,
    /// The change of the parameter per second.
    pub(crate) rates: FitRow,
    /// The arc lengths of curves traversed at constant speed; either every curve of a block has
    /// them or none.
    arc_lengths: Vec<Arc<ArcLengths>>,
    pub(crate) quantity: Quantity,
    /// How many curves it has.
    pub(crate) count: usize,
    /// The segments that they become.
    pub(crate) segment_indices: [usize; LANES],
    /// Estimates of twice the truncation error, the largest of each curve's components.
    tails: FitRowF32,
    /// The squares of the farthest angles from the middle.
    pub(crate) reaches: FitRow,
}

impl FitBlock {
    pub(crate) fn new(shape: &'static Shape, quantity: Quantity, tier: Tier) -> Self {
        let lane = [0.0; LANES];
        Self {
            shape,
            tier,
            numbers: vec![lane; shape.per_curve],
            middles: lane,
            widths: lane,
            rates: lane,
            arc_lengths: Vec::new(),
            quantity,
            count: 0,
            segment_indices: [0; LANES],
            tails: [0.0; LANES],
            reaches: lane,
        }
    }

    /// How many more it takes.
    pub(crate) fn room(&self) -> usize {
        LANES - self.count
    }

    pub(crate) fn clear(&mut self) {
        self.count = 0;
        self.arc_lengths.clear();
    }

    /// The number of lanes to compute, rounded up to whole vectors of eight.
    #[inline(always)]
    pub(crate) fn padded_count(&self) -> usize {
        self.count.next_multiple_of(8).min(LANES)
    }

    /// Adds a piece of a curve; the block must not be full.
    pub(crate) fn push(&mut self, curve: &IntervalCurve, piece: CurvePiece) {
        let lane = self.count;
        for (lanes, &number) in self.numbers.iter_mut().zip(&curve.numbers) {
            lanes[lane] = number;
        }
        self.rates[lane] = curve.rate;
        self.arc_lengths.extend(curve.arc_lengths.clone());
        let (start, width) = piece.extent();
        self.widths[lane] = width;
        self.middles[lane] = start + 0.5 * width;
        self.count += 1;
    }

    /// Adds the curves in some lanes of `intervals`; the block must have room for them.
    pub(crate) fn push_from(&mut self, intervals: &Intervals, lanes: &[u8]) {
        let added = self.count..self.count + lanes.len();
        for (numbers, all) in self.numbers.iter_mut().zip(&intervals.numbers) {
            for (number, &lane) in numbers[added.clone()].iter_mut().zip(lanes) {
                *number = all[usize::from(lane) % LANES];
            }
        }
        for (rate, &lane) in self.rates[added.clone()].iter_mut().zip(lanes) {
            *rate = intervals.rate(usize::from(lane) % LANES);
        }
        let (start, width) = CurvePiece::WHOLE.extent();
        self.widths[added.clone()].fill(width);
        self.middles[added.clone()].fill(start + 0.5 * width);
        self.count = added.end;
    }

    /// All numbers of the curve in a lane.
    pub(crate) fn numbers_of(&self, lane: usize) -> FormulaNumbers {
        self.shape.curve_numbers(|i| self.numbers[i][lane])
    }

    /// The whole curve in a lane.
    pub(crate) fn curve(&self, lane: usize) -> IntervalCurve {
        let (numbers, rate) = (self.numbers_of(lane), self.rates[lane]);
        IntervalCurve {
            arc_lengths: self.arc_lengths.get(lane).cloned(),
            ..IntervalCurve::new(self.shape, numbers, self.quantity, rate)
        }
    }

    /// Fits the curves that wait, into the segments with these indices. Coefficients of powers above
    /// the tier's degree are not written.
    pub(crate) fn run(
        &mut self,
        segments: &mut Vec<PolynomialSegment>,
        indices: impl Iterator<Item = usize>,
    ) {
        // The lanes of the last vector that have no curve write to one extra segment.
        self.segment_indices.fill(segments.len());
        segments.push(PolynomialSegment::zeroed());
        for (slot, index) in self.segment_indices[..self.count].iter_mut().zip(indices) {
            *slot = index;
        }
        match self.quantity {
            _ if self.count == 0 => {}
            Quantity::Rotation if self.arc_lengths.is_empty() => (self.shape.fit)(self, segments),
            _ if self.arc_lengths.is_empty() => (self.shape.fit_rates)(self, segments),
            _ => shape::fit::<Motion>(self, segments),
        }
        segments.pop();
    }

    /// Whether every fit of this block is good enough without a check: curves of small angle whose
    /// shape is [entire](Shape::entire).
    pub(crate) fn is_trusted(&self) -> bool {
        self.tier == Tier::SmallAngle && self.is_entire()
    }

    fn is_entire(&self) -> bool {
        let of_rotations = self.quantity == Quantity::Rotation && self.arc_lengths.is_empty();
        self.shape.entire && of_rotations
    }

    /// Multiplies the polynomial of each lane by its scale.
    pub(crate) fn scale(&self, scales: &FitRowF32, segments: &mut [PolynomialSegment]) {
        for (&index, &scale) in self.segment_indices[..self.count].iter().zip(scales) {
            for power in &mut segments[index].coefficients {
                *power = canonical(power.map(|c| c * scale));
            }
        }
    }

    /// Whether the polynomial of a lane is near enough to its curve.
    pub(crate) fn fits(&self, lane: usize, segments: &[PolynomialSegment]) -> bool {
        let reach = match self.tier {
            Tier::SmallAngle | Tier::Full => SHORT_REACH,
            Tier::Piece => REACH,
        };
        let is_near = self.tails[lane] <= TOLERANCE && self.reaches[lane] <= reach * reach;
        let [middle, ..] = &segments[self.segment_indices[lane]].coefficients;
        is_near && middle.iter().all(|c| c.is_finite())
    }

    /// Interpolates the samples of the curves from `lane` on, and keeps the estimates of their
    /// truncation errors.
    #[inline(always)]
    pub(crate) fn interpolate<L: Lanes, const PAIRS: usize>(
        &mut self,
        lane: usize,
        nodes: &Nodes<PAIRS>,
        samples: &NodeSamples<L, PAIRS>,
        segments: &mut [PolynomialSegment],
    ) {
        let lanes = lane..lane + L::COUNT;
        let indices = &self.segment_indices[lanes.clone()];
        let tails = interpolate(self.is_entire(), nodes, samples, indices, segments);
        tails.store(&mut self.tails[lanes]);
    }
}
