//! Cuts curves that one polynomial does not fit in two, until every part fits.

use bytemuck::Zeroable;

use crate::curve::options::Quantity;
use crate::fit::double::curve::{Curve, Piece};
use crate::fit::double::fit::{FitBlock, Tier};
use crate::fit::double::intervals::LANES;
use crate::fit::double::shape::Shape;
use crate::shader::PolynomialSegment;

/// Cuts curves; its memory is kept for the next ones.
pub(crate) struct Cutter {
    shape: &'static Shape,
    quantity: Quantity,
    /// Made for the first curve to cut.
    block: Option<Box<FitBlock>>,
    /// The curves added since the last [`Cutter::clear`].
    curves: Vec<Curve>,
    waiting: Vec<Part>,
    parts: Vec<Part>,
}

/// A part of a curve.
#[derive(Clone, Copy)]
pub(crate) struct Part {
    /// The span to which the curve belongs.
    pub(crate) span: usize,
    /// The curve's place in [`Cutter::curves`].
    curve: usize,
    pub(crate) piece: Piece,
    /// Its place among the segments, chosen when it is fitted; `None` after that if it is one of
    /// the finest pieces and does not fit.
    pub(crate) segment: Option<usize>,
}

impl Part {
    /// Both halves. The first keeps the segment of the whole, so that segments lie nearly in the
    /// order in which they are evaluated.
    fn halves(self) -> [Self; 2] {
        let [first, second] = self.piece.halves();
        let second = Self {
            piece: second,
            segment: None,
            ..self
        };
        [
            Self {
                piece: first,
                ..self
            },
            second,
        ]
    }
}

impl Cutter {
    pub(crate) fn new(shape: &'static Shape, quantity: Quantity) -> Self {
        Self {
            shape,
            quantity,
            block: None,
            curves: Vec::new(),
            waiting: Vec::new(),
            parts: Vec::new(),
        }
    }

    /// Adds the curve of a span that has a segment. It is cut into at least two parts.
    pub(crate) fn push(&mut self, span: usize, curve: Curve, segment: usize) {
        let whole = self.part(span, &curve, Some(segment));
        self.waiting.extend(whole.halves());
        self.curves.push(curve);
    }

    /// Adds the curve of a span, which is cut only if it does not fit as a whole.
    pub(crate) fn push_whole(&mut self, span: usize, curve: Curve) {
        self.waiting.push(self.part(span, &curve, None));
        self.curves.push(curve);
    }

    /// The part that is the whole of the curve added next.
    fn part(&self, span: usize, curve: &Curve, segment: Option<usize>) -> Part {
        Part {
            span,
            curve: self.curves.len(),
            piece: curve.piece,
            segment,
        }
    }

    /// Cuts and fits the curves that were added.
    pub(crate) fn cut(&mut self, segments: &mut Vec<PolynomialSegment>) {
        let mut done = 0;
        while done < self.waiting.len() {
            let new = || Box::new(FitBlock::new(self.shape, self.quantity, Tier::Piece));
            let block = self.block.get_or_insert_with(new);
            block.clear();
            let some = done..self.waiting.len().min(done + LANES);
            for part in &mut self.waiting[some.clone()] {
                block.push(&self.curves[part.curve], part.piece);
                if part.segment.is_none() {
                    part.segment = Some(segments.len());
                    segments.push(PolynomialSegment::zeroed());
                }
            }
            let places = self.waiting[some.clone()].iter();
            block.run(segments, places.filter_map(|part| part.segment));
            for (lane, part) in some.clone().enumerate() {
                let part = self.waiting[part];
                if block.fits(lane, segments) {
                    self.parts.push(part);
                } else if part.piece.is_finest() {
                    segments[block.places[lane]] = PolynomialSegment::zeroed();
                    self.parts.push(Part {
                        segment: None,
                        ..part
                    });
                } else {
                    self.waiting.extend(part.halves());
                }
            }
            done = some.end;
        }
        self.waiting.clear();
        // Most parts are in order already.
        self.parts.sort_by_key(|part| (part.span, part.piece.from));
    }

    /// The parts of every curve, in order of spans and time.
    pub(crate) fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The part as a curve of its own.
    pub(crate) fn curve(&self, part: &Part) -> Curve {
        Curve {
            piece: part.piece,
            ..self.curves[part.curve].clone()
        }
    }

    /// Forgets the curves and their parts.
    pub(crate) fn clear(&mut self) {
        self.curves.clear();
        self.parts.clear();
    }
}
