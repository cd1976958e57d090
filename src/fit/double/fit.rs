//! Fits curves by the polynomials that the kernels evaluate, in vector lanes.
//!
//! A curve is sampled at Chebyshev nodes, and each component of the rotation becomes the polynomial
//! through the samples. One node is the middle, which the polynomial meets exactly; the others
//! enter as differences from it, for which f32 is precise enough. Divided differences come first
//! and powers last, which keeps the rounding errors of f32 small.

use std::sync::Arc;

use bytemuck::Zeroable;

use crate::curve::formula::Numbers;
use crate::curve::options::Quantity;
use crate::fit::double::curve::{Curve, Piece};
use crate::fit::double::intervals::{Intervals, LANES};
use crate::fit::double::shape::{self, Shape};
use crate::fit::motion::arc_length::Pace;
use crate::fit::motion::derivatives::Motion;
use crate::fit::nodes::{Nodes, tail};
use crate::shader::{POWERS, PolynomialSegment};
use crate::simd::lanes::{Lanes, canonical};

/// The number of lanes in the widest vector.
pub(crate) const MOST: usize = 16;

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

/// The largest accepted estimate of twice a fit's truncation error; see [`tail`].
pub(crate) const TOLERANCE: f32 = 1.5e-7;

/// The largest angles from the middle of a piece, and of a whole curve: the polynomials of sine and
/// cosine hold up to pi/2 and up to pi/4.
const REACH: f64 = 1.57;
const SHORT_REACH: f64 = 0.785;

pub(crate) type Lane64 = [f64; LANES];
pub(crate) type Lane32 = [f32; LANES];

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
    /// Each curve's own numbers.
    pub(crate) numbers: Vec<Lane64>,
    /// The middle of the piece to fit and its width, as fractions of the interval.
    pub(crate) middles: Lane64,
    pub(crate) widths: Lane64,
    /// The change of the parameter per second.
    pub(crate) rates: Lane64,
    /// The arc lengths of curves traversed at constant speed; either every curve of a block has
    /// them or none.
    paces: Vec<Arc<Pace>>,
    pub(crate) quantity: Quantity,
    /// How many curves it has.
    pub(crate) count: usize,
    /// The segments that they become.
    pub(crate) places: [usize; LANES],
    /// Estimates of twice the truncation error, the largest of each curve's components.
    tails: Lane32,
    /// The squares of the farthest angles from the middle.
    pub(crate) reaches: Lane64,
}

/// Samples of curves: the rotations at the middle, and for each pair of nodes `-s` and `s` the
/// differences from the middle, as their sum (`even`) and their difference (`odd`).
pub(crate) struct Samples<L, const PAIRS: usize> {
    pub(crate) middle: [L; 4],
    pub(crate) even: [[L; 4]; PAIRS],
    pub(crate) odd: [[L; 4]; PAIRS],
}

impl<L: Lanes, const PAIRS: usize> Samples<L, PAIRS> {
    /// Samples that all have the same value.
    #[inline(always)]
    pub(crate) fn all(number: L) -> Self {
        Self {
            middle: [number; 4],
            even: [[number; 4]; PAIRS],
            odd: [[number; 4]; PAIRS],
        }
    }

    /// Sets the samples of the `k`th pair of nodes from the differences of the rotations before
    /// and after the middle from the one at the middle.
    #[inline(always)]
    pub(crate) fn set_differences(&mut self, k: usize, before: [L; 4], after: [L; 4]) {
        for c in 0..4 {
            self.even[k][c] = after[c] + before[c];
            self.odd[k][c] = after[c] - before[c];
        }
    }

    /// Sets the derivatives by s at the ends, which are the last pair of nodes and are there twice.
    /// Each is stored as a second sample, whose difference from the first is the derivative by s²
    /// that the divided differences of [`Nodes::powers`] need there.
    #[inline(always)]
    pub(crate) fn set_slopes(&mut self, before: [L; 4], after: [L; 4]) {
        // At s = 1/2 the polynomials even / 2s² and odd / 2s have the values 2 even and odd, and
        // the derivatives by s² 2 (after - before) - 8 even and after + before - 2 odd.
        for c in 0..4 {
            let (even, odd) = (self.even[PAIRS - 2][c], self.odd[PAIRS - 2][c]);
            self.even[PAIRS - 1][c] = (after[c] - before[c]) - L::all(3.0) * even;
            self.odd[PAIRS - 1][c] = (after[c] + before[c]) - odd;
        }
    }
}

impl FitBlock {
    pub(crate) fn new(shape: &'static Shape, quantity: Quantity, tier: Tier) -> Self {
        let lane = [0.0; LANES];
        Self {
            shape,
            tier,
            numbers: vec![lane; shape.own],
            middles: lane,
            widths: lane,
            rates: lane,
            paces: Vec::new(),
            quantity,
            count: 0,
            places: [0; LANES],
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
        self.paces.clear();
    }

    /// The number of lanes to compute, rounded up to whole vectors of eight.
    #[inline(always)]
    pub(crate) fn whole(&self) -> usize {
        self.count.next_multiple_of(8).min(LANES)
    }

    /// Adds a piece of a curve; the block must not be full.
    pub(crate) fn push(&mut self, curve: &Curve, piece: Piece) {
        let lane = self.count;
        for (lanes, &number) in self.numbers.iter_mut().zip(&curve.numbers) {
            lanes[lane] = number;
        }
        self.rates[lane] = curve.rate;
        self.paces.extend(curve.pace.clone());
        let (start, width) = piece.extent();
        self.widths[lane] = width;
        self.middles[lane] = start + 0.5 * width;
        self.count += 1;
    }

    /// Adds the curves in some lanes of `intervals`; the block must have room for them.
    pub(crate) fn push_from(&mut self, intervals: &Intervals, lanes: &[u8]) {
        let own = self.count..self.count + lanes.len();
        for (numbers, all) in self.numbers.iter_mut().zip(&intervals.numbers) {
            for (number, &lane) in numbers[own.clone()].iter_mut().zip(lanes) {
                *number = all[usize::from(lane) % LANES];
            }
        }
        for (rate, &lane) in self.rates[own.clone()].iter_mut().zip(lanes) {
            *rate = intervals.rate(usize::from(lane) % LANES);
        }
        let (start, width) = Piece::WHOLE.extent();
        self.widths[own.clone()].fill(width);
        self.middles[own.clone()].fill(start + 0.5 * width);
        self.count = own.end;
    }

    /// All numbers of the curve in a lane.
    pub(crate) fn numbers_of(&self, lane: usize) -> Numbers {
        self.shape.with(|i| self.numbers[i][lane])
    }

    /// The whole curve in a lane.
    pub(crate) fn curve(&self, lane: usize) -> Curve {
        let (numbers, rate) = (self.numbers_of(lane), self.rates[lane]);
        Curve {
            pace: self.paces.get(lane).cloned(),
            ..Curve::new(self.shape, numbers, self.quantity, rate)
        }
    }

    /// Fits the curves that wait, into the segments at these places. Coefficients of powers above
    /// the tier's degree are not written.
    pub(crate) fn run(
        &mut self,
        segments: &mut Vec<PolynomialSegment>,
        places: impl Iterator<Item = usize>,
    ) {
        // The lanes of the last vector that have no curve write to one extra segment.
        self.places.fill(segments.len());
        segments.push(PolynomialSegment::zeroed());
        for (own, place) in self.places[..self.count].iter_mut().zip(places) {
            *own = place;
        }
        match self.quantity {
            _ if self.count == 0 => {}
            Quantity::Rotation if self.paces.is_empty() => (self.shape.fit)(self, segments),
            _ if self.paces.is_empty() => (self.shape.fit_rates)(self, segments),
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
        let of_rotations = self.quantity == Quantity::Rotation && self.paces.is_empty();
        self.shape.entire && of_rotations
    }

    /// Multiplies the polynomial of each lane by its scale.
    pub(crate) fn scale(&self, scales: &Lane32, segments: &mut [PolynomialSegment]) {
        for (&place, &scale) in self.places[..self.count].iter().zip(scales) {
            for own in &mut segments[place].coefficients {
                *own = canonical(own.map(|c| c * scale));
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
        let [middle, ..] = &segments[self.places[lane]].coefficients;
        is_near && middle.iter().all(|c| c.is_finite())
    }

    /// Interpolates the samples of the curves from `lane` on, and keeps the estimates of their
    /// truncation errors.
    #[inline(always)]
    pub(crate) fn interpolate<L: Lanes, const PAIRS: usize>(
        &mut self,
        lane: usize,
        nodes: &Nodes<PAIRS>,
        samples: &Samples<L, PAIRS>,
        segments: &mut [PolynomialSegment],
    ) {
        let own = lane..lane + L::COUNT;
        let places = &self.places[own.clone()];
        let tails = interpolate(self.is_entire(), nodes, samples, places, segments);
        tails.store(&mut self.tails[own]);
    }
}

/// Interpolates samples and writes the coefficients to each lane's segment. Returns estimates of
/// twice the truncation error.
#[inline(always)]
pub(crate) fn interpolate<L: Lanes, const PAIRS: usize>(
    are_entire: bool,
    nodes: &Nodes<PAIRS>,
    samples: &Samples<L, PAIRS>,
    places: &[usize],
    segments: &mut [PolynomialSegment],
) -> L {
    let mut powers = [[L::all(0.0); 4]; POWERS];
    let tails = coefficients(are_entire, nodes, samples, &mut powers);
    L::store_powers(&powers[..=2 * PAIRS], segments, places);
    tails
}

/// Sets the coefficients of the polynomials through samples. Returns estimates of twice the
/// truncation error, which depend on whether the curves are [entire](Shape::entire).
#[allow(clippy::needless_range_loop)]
#[inline(always)]
pub(crate) fn coefficients<L: Lanes, const PAIRS: usize>(
    are_entire: bool,
    nodes: &Nodes<PAIRS>,
    samples: &Samples<L, PAIRS>,
    powers: &mut [[L; 4]; POWERS],
) -> L {
    powers[0] = canonical(samples.middle);
    let mut tails = L::all(0.0);
    for c in 0..4 {
        let own = nodes.powers(samples, c);
        tails = tail(are_entire, &own).larger(tails);
        let [odd, even] = own;
        for i in 0..PAIRS {
            powers[2 * i + 1][c] = odd[i].canonical();
            powers[2 * i + 2][c] = even[i].canonical();
        }
    }
    tails
}
