//! Curves that one polynomial does not fit, cut in two until every part fits.

use bytemuck::Zeroable;

use crate::curve::options::Quantity;
use crate::fit::double::curve::{Curve, Piece};
use crate::fit::double::fit::{FitBlock, Tier};
use crate::fit::double::intervals::LANES;
use crate::fit::double::shape::Shape;
use crate::shader::PolynomialSegment;

/// Cuts curves; what it needs for that is kept.
pub(crate) struct Cutter {
    shape: &'static Shape,
    quantity: Quantity,
    /// Made when there is something to cut.
    block: Option<Box<FitBlock>>,
    /// The curves given since the last were taken.
    curves: Vec<Curve>,
    waiting: Vec<Part>,
    parts: Vec<Part>,
}

/// A part of a curve.
#[derive(Clone, Copy)]
pub(crate) struct Part {
    /// The span that the curve is of.
    pub(crate) span: usize,
    /// Its place among the curves given.
    curve: usize,
    pub(crate) piece: Piece,
    /// Its place among the segments, given when it is fitted; nothing where even the finest
    /// does not fit.
    pub(crate) segment: Option<usize>,
}

impl Part {
    /// The first takes its segment: so those that are evaluated one after the other lie one
    /// after the other, or nearly.
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

    /// Adds the curve of a span that has a segment: at least two parts will come of it.
    pub(crate) fn push(&mut self, span: usize, curve: Curve, segment: usize) {
        let whole = self.part(span, &curve, Some(segment));
        self.waiting.extend(whole.halves());
        self.curves.push(curve);
    }

    /// Adds the curve of a span, to be cut where it does not fit whole.
    pub(crate) fn push_whole(&mut self, span: usize, curve: Curve) {
        self.waiting.push(self.part(span, &curve, None));
        self.curves.push(curve);
    }

    /// All of the curve that is given next.
    fn part(&self, span: usize, curve: &Curve, segment: Option<usize>) -> Part {
        Part {
            span,
            curve: self.curves.len(),
            piece: curve.piece,
            segment,
        }
    }

    /// Cuts the curves given.
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
                    segments[block.place(lane)] = PolynomialSegment::zeroed();
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
        // Most are in order.
        self.parts.sort_by_key(|part| (part.span, part.piece.from));
    }

    /// The parts of every curve given, in order of spans and time.
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

    /// Forgets the curves given, and their parts.
    pub(crate) fn clear(&mut self) {
        self.curves.clear();
        self.parts.clear();
    }
}
