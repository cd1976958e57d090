//! Cubics fitted by polynomials, in vector lanes: what the kernels evaluate.
//!
//! A curve is sampled at Chebyshev nodes, and each component of the rotation becomes
//! the polynomial through the samples. One node is the middle, which the polynomial
//! meets exactly; the others enter as differences from it, so that f32 serves for
//! them. Powers come last: a Chebyshev coefficient's rounding error stays small in
//! their sum, that of a power found directly would not.

use super::curve::{Curve, Piece};
use std::sync::Arc;

use super::intervals::{Intervals, LANES};
use super::motion;
use super::nodes::{EVEN_POWERS, Nodes, ODD_POWERS};
use super::pace::Pace;
use super::shape::Shape;
use crate::cpu::Lanes;
use crate::formula::Numbers;
use crate::method::Quantity;
use crate::numeric::canonical;
use crate::segment::PolynomialSegment;

/// Powers of the parameter in a segment.
const COEFFICIENTS: usize = 11;

/// How many powers a curve needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tier {
    /// Degree 6, for curves that turn little: keys as dense as motion capture has
    /// them. Such a fit is always good enough.
    Gentle,
    /// Degree 10.
    Full,
}

/// Sums of the three half-rotation vectors' squares below this are fitted within 2e-8
/// by degree 6.
const GENTLE: f64 = 0.002;

/// Above this hardly any curve is fitted whole.
const LONGEST_WHOLE: f64 = 0.2;

/// An estimate of twice what a fit leaves out may be this much: from the last two
/// Chebyshev coefficients.
const TOLERANCE: f32 = 1.5e-7;

/// How far the angles may go from the middle: the polynomials of sine and cosine
/// hold to pi/2.
const REACH: f64 = 1.57;

pub(super) type Lane64 = [f64; LANES];
pub(super) type Lane32 = [f32; LANES];

/// What to make of a curve with that sum of squares; nothing where it is to be cut
/// untried.
pub(super) fn tier(energy: f64) -> Option<Tier> {
    if energy <= GENTLE {
        Some(Tier::Gentle)
    } else {
        // NaN is cut until nothing is left of it.
        (energy <= LONGEST_WHOLE).then_some(Tier::Full)
    }
}

/// Curves that wait, and their polynomials.
pub(super) struct FitBlock {
    pub(super) shape: &'static Shape,
    tier: Tier,
    /// Each curve's own numbers.
    pub(super) numbers: Vec<Lane64>,
    /// The middle of the piece to fit, and its width.
    pub(super) middles: Lane64,
    pub(super) widths: Lane64,
    /// Of the parameter, per second.
    rates: Lane64,
    /// Of curves that are run through at constant speed; for all of a block's, or none.
    paces: Vec<Option<Arc<Pace>>>,
    pub(super) quantity: Quantity,
    count: usize,
    /// The coefficients of each power, for every lane.
    coefficients: [[[f32; 4]; LANES]; COEFFICIENTS],
    /// What the fit leaves out, twice, about; the largest of any component.
    tails: Lane32,
    /// The squares of the farthest angles from the middle.
    pub(super) reaches: Lane64,
}

/// The rotations at a block's nodes: that of the middle, and differences from it at each
/// pair of nodes, their mean and half of what they differ by.
pub(super) struct Samples<const PAIRS: usize> {
    pub(super) middle: [Lane32; 4],
    pub(super) even: [[Lane32; 4]; PAIRS],
    pub(super) odd: [[Lane32; 4]; PAIRS],
}

impl<const PAIRS: usize> Samples<PAIRS> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        let lane = [0.0; LANES];
        Self {
            middle: [lane; 4],
            even: [[lane; 4]; PAIRS],
            odd: [[lane; 4]; PAIRS],
        }
    }
}

impl FitBlock {
    pub(super) fn new(shape: &'static Shape, quantity: Quantity, tier: Tier) -> Self {
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
            coefficients: [[[0.0; 4]; LANES]; COEFFICIENTS],
            tails: [0.0; LANES],
            reaches: lane,
        }
    }

    pub(super) fn tier(&self) -> Tier {
        self.tier
    }

    pub(super) fn is_full(&self) -> bool {
        self.count == LANES
    }

    pub(super) fn clear(&mut self) {
        self.count = 0;
        self.paces.clear();
    }

    /// Lanes to work out: whole vectors, or those left over would be done one by one.
    #[inline(always)]
    pub(super) fn whole(&self) -> usize {
        self.count.next_multiple_of(8).min(LANES)
    }

    /// Adds a piece of a curve; the block is not full.
    pub(super) fn push(&mut self, curve: &Curve, piece: Piece) {
        let lane = self.count;
        for (lanes, &number) in self.numbers.iter_mut().zip(&curve.numbers) {
            lanes[lane] = number;
        }
        self.rates[lane] = curve.rate;
        if curve.pace.is_some() {
            self.paces.push(curve.pace.clone());
        }
        self.push_piece(piece);
    }

    /// Adds the curve in a lane of `intervals`; the block is not full.
    pub(super) fn push_from(&mut self, intervals: &Intervals, from: usize) {
        let lane = self.count;
        for (lanes, curves) in self.numbers.iter_mut().zip(&intervals.numbers) {
            lanes[lane] = curves[from];
        }
        self.rates[lane] = intervals.rate(from);
        self.push_piece(Piece::WHOLE);
    }

    fn push_piece(&mut self, piece: Piece) {
        let (start, width) = piece.extent();
        self.widths[self.count] = width;
        self.middles[self.count] = start + 0.5 * width;
        self.count += 1;
    }

    /// A curve's own numbers; 0 behind them.
    #[inline(always)]
    pub(super) fn numbers_of(&self, lane: usize) -> Numbers {
        let own = &self.numbers[..];
        std::array::from_fn(|i| own.get(i).map_or(0.0, |lanes| lanes[lane]))
    }

    /// The whole curve in a lane.
    pub(super) fn curve(&self, lane: usize) -> Curve {
        Curve {
            shape: self.shape,
            numbers: self.shape.with(|i| self.numbers[i][lane]),
            piece: Piece::WHOLE,
            quantity: self.quantity,
            rate: self.rates[lane],
            pace: self.paces.get(lane).cloned().flatten(),
        }
    }

    /// Fits the curves that wait.
    pub(super) fn run(&mut self) {
        match self.quantity {
            _ if self.count == 0 => {}
            Quantity::Rotation if self.paces.is_empty() => (self.shape.fit)(self),
            _ => motion::fit(self),
        }
    }

    /// Whether all that a gentle tier holds is fitted, unchecked.
    pub(super) fn is_trusted(&self) -> bool {
        self.tier == Tier::Gentle && self.is_entire()
    }

    fn is_entire(&self) -> bool {
        let of_rotations = self.quantity == Quantity::Rotation && self.paces.is_empty();
        self.shape.entire && of_rotations
    }

    /// Multiplies every lane's polynomial.
    #[inline(always)]
    pub(super) fn scale(&mut self, scales: &Lane32) {
        for power in &mut self.coefficients {
            for (coefficients, &scale) in power.iter_mut().zip(scales) {
                *coefficients = coefficients.map(|c| canonical(c * scale));
            }
        }
    }

    /// Whether the polynomial of a lane is near enough to its curve.
    pub(super) fn fits(&self, lane: usize) -> bool {
        let is_near = self.tails[lane] <= TOLERANCE && self.reaches[lane] <= REACH * REACH;
        is_near && self.coefficients[0][lane].iter().all(|c| c.is_finite())
    }

    /// Writes the polynomial of a lane. Powers above the tier's stay 0.
    #[inline]
    pub(super) fn write(&self, lane: usize, segment: &mut PolynomialSegment) {
        for (power, coefficients) in segment.coefficients.iter_mut().enumerate() {
            *coefficients = self.coefficients[power][lane];
        }
    }

    /// From the differences at the nodes to the coefficients.
    #[inline(always)]
    pub(super) fn interpolate<L: Lanes, const PAIRS: usize>(
        &mut self,
        count: usize,
        nodes: &Nodes<PAIRS>,
        samples: &Samples<PAIRS>,
    ) {
        let entire = self.is_entire();
        for lane in (0..count).step_by(L::COUNT) {
            let lanes = lane..lane + L::COUNT;
            let nothing = [L::all(0.0); 4];
            let (mut even, mut odd) = ([nothing; PAIRS], [nothing; PAIRS]);
            let mut tails = L::all(0.0);
            for c in 0..4 {
                let means: [L; PAIRS] = coefficients(&nodes.even, &samples.even, c, lane);
                let halves: [L; PAIRS] = coefficients(&nodes.odd, &samples.odd, c, lane);
                for power in 0..PAIRS {
                    even[power][c] = of_power(&EVEN_POWERS, &means, power).canonical();
                    odd[power][c] = of_power(&ODD_POWERS, &halves, power).canonical();
                }
                let last_even: L = means[PAIRS - 1].magnitude();
                let last_odd: L = halves[PAIRS - 1].magnitude();
                let before_last = means[PAIRS - 2].magnitude() + halves[PAIRS - 2].magnitude();
                let tail = if entire {
                    last_even + L::all(0.125) * last_odd
                } else {
                    last_even + last_odd + L::all(0.25) * before_last
                };
                tails = tail.larger(tails);
            }
            tails.store(&mut self.tails[lanes.clone()]);
            let mut store = self.coefficients.iter_mut();
            let [x, y, z, w] = &samples.middle;
            let middle = [
                L::load(&x[lane..]).canonical(),
                L::load(&y[lane..]).canonical(),
                L::load(&z[lane..]).canonical(),
                L::load(&w[lane..]).canonical(),
            ];
            let stored = store.next().expect("the middle");
            L::store_rotations(middle, &mut stored[lanes.clone()]);
            for (odd, even) in odd.into_iter().zip(even) {
                for powers in [odd, even] {
                    let stored = store.next().expect("as many powers");
                    L::store_rotations(powers, &mut stored[lanes.clone()]);
                }
            }
        }
    }
}

/// Chebyshev coefficients of a component, from its samples.
#[inline(always)]
fn coefficients<L: Lanes, const PAIRS: usize>(
    nodes: &[[f32; PAIRS]; PAIRS],
    samples: &[[Lane32; 4]; PAIRS],
    component: usize,
    lane: usize,
) -> [L; PAIRS] {
    let mut sums = [L::all(0.0); PAIRS];
    for k in 0..PAIRS {
        let sample = L::load(&samples[k][component][lane..]);
        for i in 0..PAIRS {
            sums[i] = sums[i] + L::all(nodes[i][k]) * sample;
        }
    }
    sums
}

/// The coefficient of a power, from those of Chebyshev polynomials.
#[inline(always)]
fn of_power<L: Lanes, const PAIRS: usize>(
    powers: &[[f32; 5]; 5],
    coefficients: &[L; PAIRS],
    power: usize,
) -> L {
    let mut sum = L::all(0.0);
    for i in power..PAIRS {
        sum = sum + L::all(powers[i][power]) * coefficients[i];
    }
    sum
}
