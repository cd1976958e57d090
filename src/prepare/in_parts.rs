//! Curves straight from keys that are fitted in parts of equal length: they wait until a block
//! is full.

use std::array;

use bytemuck::Zeroable as _;

use super::Prepared;
use super::curve::{Curve, Piece};
use super::fitting::{Fitting, polynomials};
use super::intervals::{LANES, ROOM};
use super::part::Part;
use super::shape::Shape;
use super::whole_fit::{List, Queue};
use super::whole_lanes::CurveNumbers;
use crate::branchless::ratio;
use crate::method::Quantity;
use crate::segment::PolynomialSegment;

/// Curves in the lanes of a block, and the spans that they become, which have these segments.
pub(super) struct TakenCurves<'a> {
    pub(super) numbers: &'a CurveNumbers,
    pub(super) durations: &'a [f64; ROOM],
    pub(super) spans: &'a [u32; ROOM],
    pub(super) places: &'a [u32; ROOM],
}

/// Such curves, of so many parts each.
pub(super) struct InParts<const COUNT: usize> {
    parts: &'static [Part<5, 5>; COUNT],
    shape: &'static Shape,
    /// The lanes of a block that are to be taken.
    pub(super) lanes: List,
    /// Made when there is a curve for it.
    block: Option<Box<Block<COUNT>>>,
}

/// Curves that wait.
struct Block<const COUNT: usize> {
    waiting: Queue,
    durations: [f64; LANES],
    /// The spans that they become, and the segments of their parts.
    spans: [usize; LANES],
    places: [[u32; ROOM]; COUNT],
    /// Those that do not fit.
    unfit: List,
}

impl<const COUNT: usize> InParts<COUNT> {
    pub(super) fn new(parts: &'static [Part<5, 5>; COUNT], shape: &'static Shape) -> Self {
        Self {
            parts,
            shape,
            lanes: List::new(),
            block: None,
        }
    }

    /// Takes the curves in the lanes, and fits a block of them whenever there is one.
    pub(super) fn take(
        &mut self,
        curves: &TakenCurves,
        prepared: &mut Prepared,
        fitting: &mut Fitting,
    ) {
        for lane in self.lanes.iter() {
            let block = (self.block).get_or_insert_with(|| Box::new(Block::new()));
            block.push(curves, lane);
            if block.waiting.is_full() {
                block.fit(self.parts, self.shape, prepared, fitting);
            }
        }
        self.lanes.clear();
    }

    /// Fits those that still wait.
    pub(super) fn finish(&mut self, prepared: &mut Prepared, fitting: &mut Fitting) {
        if let Some(block) = &mut self.block {
            block.fit(self.parts, self.shape, prepared, fitting);
        }
    }
}

impl<const COUNT: usize> Block<COUNT> {
    fn new() -> Self {
        Self {
            waiting: Queue::new(),
            durations: [1.0; LANES],
            spans: [0; LANES],
            places: [[0; ROOM]; COUNT],
            unfit: List::new(),
        }
    }

    fn push(&mut self, curves: &TakenCurves, lane: usize) {
        let own = self.waiting.push(curves.numbers, lane);
        self.durations[own] = curves.durations[lane];
        self.spans[own] = curves.spans[lane] as usize;
        self.places[0][own] = curves.places[lane];
    }

    /// Fits them; those that do not fit are cut further.
    fn fit(
        &mut self,
        parts: &[Part<5, 5>; COUNT],
        shape: &'static Shape,
        prepared: &mut Prepared,
        fitting: &mut Fitting,
    ) {
        let count = self.waiting.count();
        let segments = polynomials(prepared);
        for places in &mut self.places[1..] {
            for place in &mut places[..count] {
                *place = segments.len() as u32;
                segments.push(PolynomialSegment::zeroed());
            }
        }
        for (part, places) in parts.iter().zip(&self.places) {
            (self.waiting).fit(part, places, segments, &mut self.unfit);
        }
        for lane in 0..count {
            let span = self.spans[lane];
            let places = self.places.each_ref().map(|all| all[lane] as usize);
            if self.unfit.iter().any(|unfit| unfit == lane) {
                fitting.take_long(span, self.curve(lane, shape), places[0]);
            } else {
                fitting.take_parts(span, places);
            }
        }
        self.waiting.clear();
        self.unfit.clear();
    }

    /// The curve in f64: from the first key on, with the half-rotation vectors that f32 has.
    fn curve(&self, lane: usize, shape: &'static Shape) -> Curve {
        let [start, first, second, third, _] = self.waiting.numbers(lane);
        let own = array::from_fn(|i| match i {
            0..4 => start[i],
            4..7 => first[i - 4],
            7..10 => second[i - 7],
            _ => third[i - 10],
        });
        let own: [f32; 13] = own;
        Curve {
            shape,
            numbers: shape.with(|i| f64::from(own[i])),
            piece: Piece::WHOLE,
            quantity: Quantity::Rotation,
            rate: ratio(1.0, self.durations[lane]),
            pace: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::method::BESSEL_OVERHAUSER;
    use crate::prepare::part::QUARTERS;

    /// Catches numbers in another order, or of another lane: few curves come this way.
    #[test]
    fn what_does_not_fit_is_the_same_curve_in_f64() {
        let random = &mut Rng::with_seed(1);
        let mut number = || random.f32() - 0.5;
        let mut halves = Block::<2>::new();
        let [x, y, z, w] = [0.1, -0.7, 0.5, 0.5f32];
        let key = DQuat::from_xyzw(x.into(), y.into(), z.into(), w.into());
        for _ in 0..3 {
            let mut numbers: CurveNumbers = [[[0.0; 4]; ROOM]; 5];
            numbers[0][7] = [x, y, z, w];
            for vectors in &mut numbers[1..4] {
                vectors[7] = [number(), number(), number(), 1.0];
            }
            let own = halves.waiting.push(&numbers, 7);
            halves.durations[own] = 2.0;
            let curve = halves.curve(own, Shape::BERNSTEIN);
            for t in [0.0, 0.3, 1.0] {
                let u: f64 = 1.0 - t;
                let basis = [1.0 - u * u * u, (3.0 - 2.0 * t) * t * t, t * t * t];
                let mut expected = key;
                for (vectors, weight) in numbers[1..].iter().zip(basis) {
                    let [x, y, z, _] = vectors[7].map(f64::from);
                    expected *= DQuat::from_scaled_axis(DVec3::new(x, y, z) * 2.0 * weight);
                }
                let found = DQuat::from_array(curve.value(t));
                assert!((found - expected).length() < 1e-12, "{found} {expected}");
            }
            assert_eq!(curve.rate, 0.5);
        }
    }

    /// Catches a list that is too short for every part of every curve.
    #[test]
    fn a_block_of_which_no_part_fits_is_cut_further() {
        let mut prepared = Prepared::new(&BESSEL_OVERHAUSER.into());
        let mut fitting = Fitting::new(Shape::BERNSTEIN, Quantity::Rotation);
        let mut quarters = InParts::new(&QUARTERS, Shape::BERNSTEIN);
        let mut numbers: CurveNumbers = [[[0.0; 4]; ROOM]; 5];
        numbers[0] = [[0.0, 0.0, 0.0, 1.0]; ROOM];
        numbers[1] = [[9.0, -2.0, 1.0, 1.0]; ROOM];
        numbers[2] = [[-3.0, 8.0, 1.0, 1.0]; ROOM];
        numbers[3] = [[2.0, -7.0, 8.0, 1.0]; ROOM];
        let (spans, places) = (array::from_fn(|i| i as u32), array::from_fn(|i| i as u32));
        prepared.new_segments(LANES);
        let curves = TakenCurves {
            numbers: &numbers,
            durations: &[1.0; ROOM],
            spans: &spans,
            places: &places,
        };
        (0..LANES).for_each(|lane| quarters.lanes.push(lane));
        quarters.take(&curves, &mut prepared, &mut fitting);
        let block = quarters.block.expect("curves waited");
        assert_eq!((block.waiting.count(), block.unfit.count()), (0, 0));
    }
}
