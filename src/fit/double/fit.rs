//! Cubics fitted by polynomials, in vector lanes: what the kernels evaluate.
//!
//! A curve is sampled at Chebyshev nodes, and each component of the rotation becomes
//! the polynomial through the samples. One node is the middle, which the polynomial
//! meets exactly; the others enter as differences from it, so that f32 serves for
//! them. Powers come last: divided differences keep what f32 rounds small.

use std::array;
use std::sync::Arc;

use bytemuck::Zeroable;

use crate::curve::formula::Numbers;
use crate::curve::formula::product::Product;
use crate::curve::options::Quantity;
use crate::fit::both_sides::Sides;
use crate::fit::double::curve::{Curve, Piece};
use crate::fit::double::intervals::{Intervals, LANES, Lane};
use crate::fit::double::shape::Shape;
use crate::fit::motion::arc_length::Pace;
use crate::fit::motion::derivatives as motion;
use crate::fit::nodes::{Nodes, tail};
use crate::shader::POWERS;
use crate::shader::PolynomialSegment;
use crate::simd::lanes::{Lanes, canonical};

/// The most lanes that a vector has.
pub(crate) const MOST: usize = 16;

/// How many powers a curve needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tier {
    /// Degree 6, for curves that turn little: keys as dense as motion capture has
    /// them. Such a fit is always good enough.
    Gentle,
    /// Degree 10.
    Full,
    /// The same, for pieces of curves that may turn any distance.
    Piece,
}

/// Sums of the three half-rotation vectors' squares below this are fitted within 2e-8
/// by degree 6.
pub(crate) const GENTLE: f64 = 0.002;

/// Above this hardly any curve is fitted whole.
pub(crate) const LONGEST_WHOLE: f64 = 0.2;

/// An estimate of twice what a fit leaves out may be this much: from the last two
/// Chebyshev coefficients.
pub(crate) const TOLERANCE: f32 = 1.5e-7;

/// How far the angles may go from the middle of a piece, and of a whole curve: the
/// polynomials of sine and cosine hold to pi/2 and to pi/4.
const REACH: f64 = 1.57;
const SHORT_REACH: f64 = 0.785;

pub(crate) type Lane64 = [f64; LANES];
pub(crate) type Lane32 = [f32; LANES];

/// How to fit a curve with that sum of squares; pieces of it where it is to be cut untried.
pub(crate) fn tier(energy: f64) -> Tier {
    if energy <= GENTLE {
        Tier::Gentle
    } else if energy <= LONGEST_WHOLE {
        Tier::Full
    } else {
        // Also NaN, which is cut until nothing is left of it.
        Tier::Piece
    }
}

/// Curves that wait, and their polynomials.
pub(crate) struct FitBlock {
    pub(crate) shape: &'static Shape,
    tier: Tier,
    /// Each curve's own numbers.
    pub(crate) numbers: Vec<Lane64>,
    /// The middle of the piece to fit, and its width.
    pub(crate) middles: Lane64,
    pub(crate) widths: Lane64,
    /// Of the parameter, per second.
    rates: Lane64,
    /// Of curves that are run through at constant speed; for all of a block's, or none.
    paces: Vec<Option<Arc<Pace>>>,
    pub(crate) quantity: Quantity,
    count: usize,
    /// The segments that they become.
    places: [usize; LANES],
    /// What the fit leaves out, twice, about; the largest of any component.
    tails: Lane32,
    /// The squares of the farthest angles from the middle.
    pub(crate) reaches: Lane64,
}

/// The rotations at the nodes of curves: those of the middle, and differences from it at
/// each pair of nodes, their sum and what they differ by.
pub(crate) struct Samples<N, const PAIRS: usize> {
    pub(crate) middle: [N; 4],
    pub(crate) even: [[N; 4]; PAIRS],
    pub(crate) odd: [[N; 4]; PAIRS],
}

impl<N: Copy, const PAIRS: usize> Samples<N, PAIRS> {
    /// All the same.
    #[inline(always)]
    pub(crate) fn all(number: N) -> Self {
        Self {
            middle: [number; 4],
            even: [[number; 4]; PAIRS],
            odd: [[number; 4]; PAIRS],
        }
    }
}

impl<const WIDTH: usize, const PAIRS: usize> Samples<[f32; WIDTH], PAIRS> {
    /// Those of the lanes from `lane` on.
    #[inline(always)]
    pub(crate) fn at<L: Lanes>(&self, lane: usize) -> Samples<L, PAIRS> {
        let mut own = Samples::all(L::all(0.0));
        for c in 0..4 {
            own.middle[c] = L::load(&self.middle[c][lane..]);
            for k in 0..PAIRS {
                own.even[k][c] = L::load(&self.even[k][c][lane..]);
                own.odd[k][c] = L::load(&self.odd[k][c][lane..]);
            }
        }
        own
    }
}

impl<L: Lanes, const PAIRS: usize> Samples<L, PAIRS> {
    /// Sets what the rotations before and after the middle are more than it, at the `k`th
    /// pair of nodes.
    #[inline(always)]
    pub(crate) fn set_differences(&mut self, k: usize, differences: [Sides<L>; 4]) {
        for (c, &Sides { before, after }) in differences.iter().enumerate() {
            self.even[k][c] = after + before;
            self.odd[k][c] = after - before;
        }
    }

    /// Makes them those of the curves from their other end.
    #[inline(always)]
    pub(crate) fn turn_round(&mut self) {
        for odd in self.odd.as_flattened_mut() {
            *odd = -*odd;
        }
    }

    /// Sets the derivative by s at the middle, which is the first of the nodes too, and half of
    /// the second.
    #[inline(always)]
    pub(crate) fn set_middle(&mut self, derivative: [L; 4], half_second: [L; 4]) {
        self.odd[0] = derivative;
        self.even[0] = half_second;
    }

    /// Sets the derivatives by s at the ends: the last pair of nodes, which comes twice. They
    /// take the form of one more sample there, so that [`Nodes::powers`] finds, as what it has
    /// more than the sample itself, the derivatives of its polynomials by s².
    #[inline(always)]
    pub(crate) fn set_slopes(&mut self, slopes: [Sides<L>; 4]) {
        // By s², even / 2s² rises there by 2 (after - before) - 8 even, and odd / 2s by after +
        // before - 2 odd; the samples there stand for 2 even, and for odd.
        for (c, &Sides { before, after }) in slopes.iter().enumerate() {
            let (even, odd) = (self.even[PAIRS - 2][c], self.odd[PAIRS - 2][c]);
            self.even[PAIRS - 1][c] = (after - before) - L::all(3.0) * even;
            self.odd[PAIRS - 1][c] = (after + before) - odd;
        }
    }

    /// Every lane's.
    #[inline(always)]
    pub(crate) fn lanes(&self) -> Samples<[f32; MOST], PAIRS> {
        let mut lanes = Samples::all([0.0; MOST]);
        for c in 0..4 {
            self.middle[c].store(&mut lanes.middle[c][..L::COUNT]);
            for k in 0..PAIRS {
                self.even[k][c].store(&mut lanes.even[k][c][..L::COUNT]);
                self.odd[k][c].store(&mut lanes.odd[k][c][..L::COUNT]);
            }
        }
        lanes
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

    pub(crate) fn tier(&self) -> Tier {
        self.tier
    }

    /// The segment that the curve in a lane has become.
    pub(crate) fn place(&self, lane: usize) -> usize {
        self.places[lane]
    }

    /// How many curves it has.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// How many more it takes.
    pub(crate) fn room(&self) -> usize {
        LANES - self.count
    }

    pub(crate) fn clear(&mut self) {
        self.count = 0;
        self.paces.clear();
    }

    /// Lanes to work out: whole vectors, or those left over would be done one by one.
    #[inline(always)]
    pub(crate) fn whole(&self) -> usize {
        self.count.next_multiple_of(8).min(LANES)
    }

    /// Adds a piece of a curve; the block is not full.
    pub(crate) fn push(&mut self, curve: &Curve, piece: Piece) {
        let lane = self.count;
        for (lanes, &number) in self.numbers.iter_mut().zip(&curve.numbers) {
            lanes[lane] = number;
        }
        self.rates[lane] = curve.rate;
        if curve.pace.is_some() {
            self.paces.push(curve.pace.clone());
        }
        let (start, width) = piece.extent();
        self.widths[lane] = width;
        self.middles[lane] = start + 0.5 * width;
        self.count += 1;
    }

    /// Adds the curves in some lanes of `intervals`; the block has room for them.
    pub(crate) fn push_from(&mut self, intervals: &Intervals, lanes: &[u8]) {
        let own = self.count..self.count + lanes.len();
        let (to, from) = (&mut self.numbers[..], &intervals.numbers[..]);
        // All numbers of a lane at once, where it is known how many: half the instructions.
        if let (Ok(to), Ok(from)) = (to.try_into(), from.try_into()) {
            copy::<{ Product::BASIS }>(to, own.start, from, lanes);
        } else {
            for (numbers, all) in self.numbers.iter_mut().zip(&intervals.numbers) {
                copy(
                    array::from_mut(numbers),
                    own.start,
                    array::from_ref(all),
                    lanes,
                );
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

    /// A curve's own numbers; 0 behind them.
    pub(crate) fn numbers_of(&self, lane: usize) -> Numbers {
        let own = &self.numbers[..];
        array::from_fn(|i| own.get(i).map_or(0.0, |lanes| lanes[lane]))
    }

    /// The whole curve in a lane.
    pub(crate) fn curve(&self, lane: usize) -> Curve {
        Curve {
            shape: self.shape,
            numbers: self.shape.with(|i| self.numbers[i][lane]),
            piece: Piece::WHOLE,
            quantity: self.quantity,
            rate: self.rates[lane],
            pace: self.paces.get(lane).cloned().flatten(),
        }
    }

    /// Fits the curves that wait, to segments at these places; powers above the tier's stay
    /// what they are.
    pub(crate) fn run(
        &mut self,
        segments: &mut Vec<PolynomialSegment>,
        places: impl Iterator<Item = usize>,
    ) {
        // One for the last vector's lanes that have no curve.
        self.places.fill(segments.len());
        segments.push(PolynomialSegment::zeroed());
        for (own, place) in self.places[..self.count].iter_mut().zip(places) {
            *own = place;
        }
        match self.quantity {
            _ if self.count == 0 => {}
            Quantity::Rotation if self.paces.is_empty() => (self.shape.fit)(self, segments),
            _ => motion::fit(self, segments),
        }
        segments.pop();
    }

    /// Whether all that a gentle tier holds is fitted, unchecked.
    pub(crate) fn is_trusted(&self) -> bool {
        self.tier == Tier::Gentle && self.is_entire()
    }

    fn is_entire(&self) -> bool {
        let of_rotations = self.quantity == Quantity::Rotation && self.paces.is_empty();
        self.shape.entire && of_rotations
    }

    /// Multiplies every lane's polynomial.
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
            Tier::Gentle | Tier::Full => SHORT_REACH,
            Tier::Piece => REACH,
        };
        let is_near = self.tails[lane] <= TOLERANCE && self.reaches[lane] <= reach * reach;
        let [middle, ..] = &segments[self.places[lane]].coefficients;
        is_near && middle.iter().all(|c| c.is_finite())
    }

    /// From the differences at the nodes of the curves from `lane` on to the coefficients.
    #[inline(always)]
    pub(crate) fn interpolate<L: Lanes, const PAIRS: usize>(
        &mut self,
        lane: usize,
        nodes: &Nodes<PAIRS>,
        samples: &Samples<L, PAIRS>,
        segments: &mut [PolynomialSegment],
    ) {
        let mut places = [0; MOST];
        places[..L::COUNT].copy_from_slice(&self.places[lane..lane + L::COUNT]);
        let tails = interpolate(self.is_entire(), nodes, samples, &places, segments);
        tails.store(&mut self.tails[lane..lane + L::COUNT]);
    }
}

/// From the differences at the nodes to the coefficients, in each lane's segment; and what
/// the fits leave out, twice, about. Curves are [entire](crate::fit::double::shape::Shape::entire), or not.
#[allow(clippy::needless_range_loop)]
#[inline(always)]
pub(crate) fn interpolate<L: Lanes, const PAIRS: usize>(
    are_entire: bool,
    nodes: &Nodes<PAIRS>,
    samples: &Samples<L, PAIRS>,
    places: &[usize; MOST],
    segments: &mut [PolynomialSegment],
) -> L {
    let mut powers = [canonical(samples.middle); POWERS];
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
    L::store_powers(&powers[..=2 * PAIRS], segments, places);
    tails
}

/// Copies numbers of some lanes to consecutive ones, from `start` on.
#[inline(always)]
fn copy<const N: usize>(to: &mut [Lane64; N], start: usize, from: &[Lane; N], lanes: &[u8]) {
    for (place, &lane) in (start..).zip(lanes) {
        for c in 0..N {
            to[c][place % LANES] = from[c][usize::from(lane) % LANES];
        }
    }
}
