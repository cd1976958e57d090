//! Curves in f64 by their formulas, and their fit by the polynomials that the kernels evaluate, in vector
//! lanes.
//!
//! A [`Shape`] is a formula as a value, so that the preparation is independent of it;
//! [`shape`](crate::fit::exact::shape) has those that several methods share. An [`IntervalCurve`] is one curve of a
//! shape, or the piece of it that one polynomial fits. A [`FitBlock`] collects up to [`LANES`] curves of one shape:
//! each is sampled at Chebyshev nodes, and each component of the rotation becomes the polynomial through the samples
//! ([`nodes`](crate::fit::nodes)).

use std::sync::Arc;

use bytemuck::Zeroable;

use crate::curve::formula::{FormulaNumbers, RotationVector, quantity_value};
use crate::curve::options::Quantity;
use crate::fit::block::{Intervals, LANES};
use crate::fit::motion::arc_length::ArcLengths;
use crate::fit::nodes::{FULL_NODES, NodeSamples, Nodes, SMALL_ANGLE_NODES, interpolate};
use crate::math::dual::Dual;
use crate::math::quaternion::{Quaternion, Vector, dot, length};
use crate::shader::PolynomialSegment;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::{Lanes, canonical};

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
    /// The squared extent up to which degree 6 fits its curves; see [`SMALL_ANGLE`].
    pub(crate) small_angle: f64,
    /// Samples the curves of a block and fits polynomials to them.
    pub(crate) fit: fn(&mut FitBlock, &mut [PolynomialSegment]),
    /// As `fit`, for velocities and accelerations.
    pub(crate) fit_rates: fn(&mut FitBlock, &mut [PolynomialSegment]),
    /// As `fit`, for any quantity of curves at constant speed.
    pub(crate) fit_at_constant_speed: fn(&mut FitBlock, &mut [PolynomialSegment]),
}

impl Shape {
    /// All numbers of a curve: those that differ from curve to curve, then the shared ones.
    pub(crate) fn curve_numbers(&self, number_at: impl Fn(usize) -> f64) -> FormulaNumbers {
        let mut numbers = self.shared;
        for (i, number) in numbers[..self.per_curve].iter_mut().enumerate() {
            *number = number_at(i);
        }
        numbers
    }

    /// The tier for a curve with this squared extent; [`Tier::Piece`] if it is to be divided without a try.
    pub(crate) fn tier(&self, squared_extent: f64) -> Tier {
        if squared_extent <= self.small_angle {
            Tier::SmallAngle
        } else if squared_extent <= LARGEST_UNCUT {
            Tier::Full
        } else {
            // NaN also takes this branch: the curve is divided down to the smallest pieces, and none fits.
            Tier::Piece
        }
    }
}

/// The curve of one key interval, or a piece of it.
#[derive(Debug, Clone)]
pub(crate) struct IntervalCurve {
    pub(crate) shape: &'static Shape,
    pub(crate) numbers: FormulaNumbers,
    pub(crate) piece: CurvePiece,
    pub(crate) quantity: Quantity,
    /// The change of the parameter per second.
    pub(crate) rate: f64,
    /// The curve's arc lengths if it is traversed at constant speed.
    pub(crate) arc_lengths: Option<Arc<ArcLengths>>,
}

/// The part of an interval that one polynomial fits: its start and its end, as fractions of the interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CurvePiece {
    from: f64,
    to: f64,
    /// How often the interval was halved.
    cuts: u8,
}

/// The maximum number of halvings. A curve that no polynomial fits even then rotates by dozens of radians within one
/// interval; the host evaluates it in f64 for every device.
const MAX_CUTS: u8 = 4;

impl CurvePiece {
    pub(crate) const WHOLE: Self = Self {
        from: 0.0,
        to: 1.0,
        cuts: 0,
    };

    /// The time in seconds at which it begins in an interval that starts at `start` and takes `duration`.
    pub(crate) fn begins(self, start: f64, duration: f64) -> f64 {
        start + duration * self.from
    }

    /// Both halves of a piece of the interval; `None` if it is not divided further. They meet at a time that f64
    /// represents: far from 0 that is not exactly the middle, and may be one of the ends.
    pub(crate) fn halves(self, start: f64, duration: f64) -> Option<[Self; 2]> {
        let cuts = self.cuts + 1;
        let mut middle = 0.5 * (self.from + self.to);
        let rounded = ((start + duration * middle) - start) / duration;
        if (rounded - middle).abs() > INDISTINCT * (self.to - self.from) {
            middle = rounded;
        }
        let is_between = self.from < middle && middle < self.to;
        (cuts <= MAX_CUTS && is_between).then_some([
            Self {
                to: middle,
                cuts,
                ..self
            },
            Self {
                from: middle,
                cuts,
                ..self
            },
        ])
    }

    /// Its start and its width as fractions of the interval.
    pub(crate) fn extent(self) -> (f64, f64) {
        (self.from, self.to - self.from)
    }
}

/// The largest difference, as a fraction of an interval's duration, for which polynomials in f32 have the same
/// coefficients.
pub(crate) const INDISTINCT: f64 = 1.0 / (1u64 << 28) as f64;

impl IntervalCurve {
    /// A whole curve with the speed of the key times.
    pub(crate) fn new(
        shape: &'static Shape,
        numbers: FormulaNumbers,
        quantity: Quantity,
        rate: f64,
    ) -> Self {
        Self {
            shape,
            numbers,
            piece: CurvePiece::WHOLE,
            quantity,
            rate,
            arc_lengths: None,
        }
    }

    /// The whole curve in a lane of a block.
    pub(crate) fn of_interval(
        intervals: &Intervals,
        lane: usize,
        shape: &'static Shape,
        quantity: Quantity,
    ) -> Self {
        let numbers = shape.curve_numbers(|i| intervals.numbers[i][lane]);
        Self::new(shape, numbers, quantity, intervals.rate(lane))
    }

    /// The value of the curve's quantity at `t`, which runs from 0 to 1 over its piece.
    pub(crate) fn value(&self, t: f64) -> Quaternion {
        let (start, width) = self.piece.extent();
        self.value_at(start + width * t)
    }

    /// The value of the curve's quantity at `t`, which runs from 0 to 1 over its interval.
    pub(crate) fn value_at(&self, t: f64) -> Quaternion {
        if self.quantity != Quantity::Rotation || self.arc_lengths.is_some() {
            let parameter = match &self.arc_lengths {
                Some(arc_lengths) => arc_lengths.parameter(&|u| self.moving(u), t),
                None => Dual::parameter(t),
            };
            let rotation = self.moving(parameter);
            return quantity_value(self.quantity, rotation, self.rate);
        }
        let rotation = (self.shape.rotation)(&self.numbers, t);
        if dot(rotation, rotation) > 0.5 || !self.shape.is_unit {
            return rotation;
        }
        // A normalised polynomial may pass through 0, where it is not a rotation. Then use the rotation just after this
        // point.
        (self.shape.rotation)(&self.numbers, t + 1e-9)
    }

    /// Sets the speed of a curve of constant angular velocity, in radians per second.
    pub(crate) fn set_speed(&mut self, speed: f64) {
        let (_, half) = self.numbers.split_at_mut(RotationVector::LINEAR);
        let half: &mut Vector = half.first_chunk_mut().expect("a rotation vector");
        let current = 2.0 * length(*half);
        if current > 0.0 {
            for number in half {
                *number *= speed / current;
            }
        }
    }

    /// The rotation and its derivatives, as dual numbers.
    pub(crate) fn moving(&self, parameter: Dual) -> [Dual; 4] {
        (self.shape.moving)(&self.numbers, parameter)
    }
}

/// The degree with which a curve is fitted; it depends on the angle of the curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tier {
    /// Degree 6, for curves of small angles, such as between the dense keys of motion capture.
    SmallAngle,
    /// Degree 10.
    Full,
    /// Degree 10 for a piece of a curve of any angle.
    Piece,
}

impl Tier {
    /// The nodes at which its curves are sampled, in the order of [`Nodes::offsets`].
    #[inline(always)]
    pub(crate) fn offsets(self) -> &'static [f64] {
        static SMALL_ANGLE_OFFSETS: [f64; 7] = SMALL_ANGLE_NODES.offsets();
        static FULL_OFFSETS: [f64; 11] = FULL_NODES.offsets();
        match self {
            Self::SmallAngle => &SMALL_ANGLE_OFFSETS,
            Self::Full | Self::Piece => &FULL_OFFSETS,
        }
    }
}

/// The squared extent (the sum of the three half-rotation vectors' squares) up to which degree 6
/// fits a curve of most shapes within 2e-8.
pub(crate) const SMALL_ANGLE: f64 = 0.002;

/// The squared extent above which curves are divided without trying to fit the whole, because very few would fit.
pub(crate) const LARGEST_UNCUT: f64 = 0.2;

/// The largest accepted estimate of twice a fit's truncation error; see [`tail`](crate::fit::nodes::tail).
pub(crate) const TOLERANCE: f32 = 1.5e-7;

/// The largest angles from the middle of a piece, and of a whole curve: the polynomials of sine and
/// cosine are valid up to pi/2 and up to pi/4.
const REACH: f64 = 1.57;
const SHORT_REACH: f64 = 0.785;

pub(crate) type FitRow = [f64; LANES];
pub(crate) type FitRowF32 = [f32; LANES];

/// A block of up to [`LANES`] curves of one shape and tier that are to be fitted.
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
    /// The samples at the nodes, each vector's lanes in its order: a row for each component of the middle, then
    /// of the sums and of the differences of each pair of nodes.
    samples: Vec<FitRowF32>,
    /// The units in which velocities and accelerations are sampled.
    pub(crate) scales: FitRowF32,
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
            samples: vec![[0.0; LANES]; 4 * tier.offsets().len()],
            scales: [1.0; LANES],
            tails: [0.0; LANES],
            reaches: lane,
        }
    }

    /// The number of curves for which it has room.
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
            _ => (self.shape.fit_at_constant_speed)(self, segments),
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
    pub(crate) fn scale(&self, segments: &mut [PolynomialSegment]) {
        let indices = self.segment_indices[..self.count].iter();
        for (&index, &scale) in indices.zip(&self.scales) {
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

    /// Sets the samples of the curves from `lane` on at the middle.
    #[inline(always)]
    pub(crate) fn set_middle<L: Lanes>(&mut self, lane: usize, middle: [L; 4]) {
        for (row, number) in self.samples[..4].iter_mut().zip(middle) {
            number.store_unordered(&mut row[lane..]);
        }
    }

    /// Sets the samples of the curves from `lane` on at the `k`th pair of nodes: the sum and the difference of
    /// the differences from the middle, as [`NodeSamples`] has them.
    #[inline(always)]
    pub(crate) fn set_pair<L: Lanes>(&mut self, lane: usize, k: usize, even: [L; 4], odd: [L; 4]) {
        let rows = &mut self.samples[4 + 8 * k..12 + 8 * k];
        for c in 0..4 {
            even[c].store_unordered(&mut rows[c][lane..]);
            odd[c].store_unordered(&mut rows[4 + c][lane..]);
        }
    }

    /// The samples of the curves from `lane` on.
    #[inline(always)]
    fn samples<L: Lanes, const PAIRS: usize>(&self, lane: usize) -> NodeSamples<L, PAIRS> {
        let mut samples = NodeSamples::all(L::all(0.0));
        let rows = &self.samples[..4 + 8 * PAIRS];
        for c in 0..4 {
            samples.middle[c] = L::load_unordered(&rows[c][lane..]);
            for k in 0..PAIRS {
                samples.even[k][c] = L::load_unordered(&rows[4 + 8 * k + c][lane..]);
                samples.odd[k][c] = L::load_unordered(&rows[8 + 8 * k + c][lane..]);
            }
        }
        samples
    }

    /// Interpolates the samples, and keeps the estimates of the truncation errors.
    pub(crate) fn interpolate(&mut self, segments: &mut [PolynomialSegment]) {
        in_lanes(&mut Interpolation(self, segments));
    }
}

/// The second half of a fit: one function for the samples of all formulas.
struct Interpolation<'a>(&'a mut FitBlock, &'a mut [PolynomialSegment]);

impl InLanes for Interpolation<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        match self.0.tier {
            Tier::SmallAngle => self.run_with::<L, _>(&SMALL_ANGLE_NODES),
            Tier::Full | Tier::Piece => self.run_with::<L, _>(&FULL_NODES),
        }
    }
}

impl Interpolation<'_> {
    #[inline(always)]
    fn run_with<L: Lanes, const PAIRS: usize>(&mut self, nodes: &Nodes<PAIRS>) {
        let Self(block, segments) = self;
        for lane in (0..block.padded_count()).step_by(L::COUNT) {
            let lanes = lane..lane + L::COUNT;
            let samples = block.samples::<L, PAIRS>(lane);
            let indices = &block.segment_indices[lanes.clone()];
            let tails = interpolate(block.is_entire(), nodes, &samples, indices, segments);
            tails.store(&mut block.tails[lanes]);
        }
    }
}
