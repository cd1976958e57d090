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
    /// Places of segments that nothing has become yet.
    spare: Vec<usize>,
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
    pub(super) segment: Option<usize>,
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
            spare: Vec::new(),
        }
    }

    /// Adds the curve of a span: at least two parts will come of it. It may have a segment.
    pub(super) fn push(&mut self, span: usize, curve: Curve, segment: Option<usize>) {
        self.push_pieces(span, &curve.piece.halves());
        self.curves.push(curve);
        self.spare.extend(segment);
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
    pub(super) fn cut(&mut self, segments: &mut Vec<PolynomialSegment>) {
        let mut done = 0;
        while done < self.waiting.len() {
            let new = || Box::new(FitBlock::new(self.shape, self.quantity, Tier::Piece));
            let block = self.block.get_or_insert_with(new);
            block.clear();
            let some = done..self.waiting.len().min(done + LANES);
            for part in &self.waiting[some.clone()] {
                block.push(&self.curves[part.curve], part.piece);
                if self.spare.len() < block.count() {
                    self.spare.push(segments.len());
                    segments.push(PolynomialSegment::zeroed());
                }
            }
            let first = self.spare.len() - block.count();
            block.run(segments, self.spare.drain(first..));
            for (lane, part) in some.clone().enumerate() {
                let part = self.waiting[part];
                if block.fits(lane, segments) {
                    self.parts.push(Part {
                        segment: Some(block.place(lane)),
                        ..part
                    });
                    continue;
                }
                self.spare.push(block.place(lane));
                if part.piece.is_finest() {
                    self.parts.push(part);
                } else {
                    let half = |piece| Part { piece, ..part };
                    self.waiting.extend(part.piece.halves().map(half));
                }
            }
            done = some.end;
        }
        self.waiting.clear();
        for place in self.spare.drain(..) {
            segments[place] = PolynomialSegment::zeroed();
        }
        // Most are in order.
        self.parts.sort_by_key(|part| (part.span, part.piece.from));
    }

    /// The parts of every curve given, in order of spans and time.
    pub(super) fn parts(&self) -> &[Part] {
        &self.parts
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
    }
}
