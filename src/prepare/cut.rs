//! Curves that one polynomial does not fit, cut in two until every part fits.

use bytemuck::Zeroable;

use super::curve::{Curve, Piece};
use super::fit::{FitBlock, Tier};
use super::intervals::LANES;
use super::shape::Shape;
use crate::method::Quantity;
use crate::segment::PolynomialSegment;

/// Cuts curves; what it needs for that is kept.
pub(super) struct Cutter {
    shape: &'static Shape,
    quantity: Quantity,
    /// Made when there is something to cut.
    block: Option<Box<FitBlock>>,
    /// The curves given since the last were taken.
    curves: Vec<Curve>,
    waiting: Vec<Part>,
    parts: Vec<Part>,
    /// What those parts have become that a polynomial fits.
    segments: Vec<PolynomialSegment>,
}

/// A part of a curve.
#[derive(Clone, Copy)]
pub(super) struct Part {
    /// The span that the curve is of.
    pub(super) span: usize,
    /// Its place among the curves given.
    curve: usize,
    pub(super) piece: Piece,
    /// Its place among the segments; nothing where even the finest does not fit.
    segment: Option<usize>,
}

impl Cutter {
    pub(super) fn new(shape: &'static Shape, quantity: Quantity) -> Self {
        Self {
            shape,
            quantity,
            block: None,
            curves: Vec::new(),
            waiting: Vec::new(),
            parts: Vec::new(),
            segments: Vec::new(),
        }
    }

    /// Adds the curve of a span: at least two parts will come of it.
    pub(super) fn push(&mut self, span: usize, curve: Curve) {
        self.push_pieces(span, &curve.piece.halves());
        self.curves.push(curve);
    }

    /// Adds the curve of a span, to be cut where it does not fit whole.
    pub(super) fn push_whole(&mut self, span: usize, curve: Curve) {
        self.push_pieces(span, &[curve.piece]);
        self.curves.push(curve);
    }

    /// Of the curve that is given next.
    fn push_pieces(&mut self, span: usize, pieces: &[Piece]) {
        self.waiting.extend(pieces.iter().map(|&piece| Part {
            span,
            curve: self.curves.len(),
            piece,
            segment: None,
        }));
    }

    /// Cuts the curves given.
    pub(super) fn cut(&mut self) {
        while !self.waiting.is_empty() {
            let new = || Box::new(FitBlock::new(self.shape, self.quantity, Tier::Piece));
            let block = self.block.get_or_insert_with(new);
            block.clear();
            let first = self.waiting.len().saturating_sub(LANES);
            for part in &self.waiting[first..] {
                block.push(&self.curves[part.curve], part.piece);
            }
            block.run();
            let mut halves = Vec::new();
            for (lane, part) in self.waiting.drain(first..).enumerate() {
                if block.fits(lane) {
                    let mut segment = PolynomialSegment::zeroed();
                    block.write(lane, &mut segment);
                    let place = Some(self.segments.len());
                    self.segments.push(segment);
                    self.parts.push(Part {
                        segment: place,
                        ..part
                    });
                } else if part.piece.is_finest() {
                    self.parts.push(part);
                } else {
                    let half = |piece| Part { piece, ..part };
                    halves.extend(part.piece.halves().map(half));
                }
            }
            self.waiting.append(&mut halves);
        }
        self.parts
            .sort_unstable_by_key(|part| (part.span, part.piece.from));
    }

    /// The parts of every curve given, in order of spans and time.
    pub(super) fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// What a part has become.
    pub(super) fn segment(&self, part: &Part) -> Option<PolynomialSegment> {
        part.segment.map(|place| self.segments[place])
    }

    /// The part as a curve of its own.
    pub(super) fn curve(&self, part: &Part) -> Curve {
        Curve {
            piece: part.piece,
            ..self.curves[part.curve].clone()
        }
    }

    /// Forgets the curves given, and their parts.
    pub(super) fn clear(&mut self) {
        self.curves.clear();
        self.parts.clear();
        self.segments.clear();
    }
}
