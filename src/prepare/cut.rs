//! Curves that one polynomial does not fit, cut in two until every part fits.

use bytemuck::Zeroable;

use super::curve::Curve;
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
    waiting: Vec<Part>,
    /// The parts of every curve given, in order of intervals and time.
    parts: Vec<Part>,
}

/// A part of a curve.
#[derive(Clone)]
pub(super) struct Part {
    /// The interval that the curve is of.
    pub(super) interval: usize,
    pub(super) curve: Curve,
    /// Nothing where even the finest does not fit.
    pub(super) segment: Option<PolynomialSegment>,
}

impl Cutter {
    pub(super) fn new(shape: &'static Shape, quantity: Quantity) -> Self {
        Self {
            shape,
            quantity,
            block: None,
            waiting: Vec::new(),
            parts: Vec::new(),
        }
    }

    /// Adds the curve of an interval: at least two parts will come of it.
    pub(super) fn push(&mut self, interval: usize, curve: Curve) {
        for piece in curve.piece.halves() {
            self.waiting.push(Part {
                interval,
                curve: Curve {
                    piece,
                    ..curve.clone()
                },
                segment: None,
            });
        }
    }

    /// Adds the curve of an interval, to be cut where it does not fit whole.
    pub(super) fn push_whole(&mut self, interval: usize, curve: Curve) {
        self.waiting.push(Part {
            interval,
            curve,
            segment: None,
        });
    }

    /// The parts of the curves given since the last call.
    pub(super) fn cut(&mut self) -> &[Part] {
        self.parts.clear();
        while !self.waiting.is_empty() {
            let first = self.waiting.len().saturating_sub(LANES);
            let now = self.waiting.split_off(first);
            let mut block = match self.block.take() {
                Some(block) => block,
                None => Box::new(FitBlock::new(self.shape, self.quantity, Tier::Full)),
            };
            block.clear();
            now.iter().for_each(|part| block.push(&part.curve));
            block.run();
            for (lane, part) in now.into_iter().enumerate() {
                if block.fits(lane) {
                    let mut segment = PolynomialSegment::zeroed();
                    block.write(lane, &mut segment);
                    let segment = Some(segment);
                    self.parts.push(Part { segment, ..part });
                } else if part.curve.piece.is_finest() {
                    self.parts.push(part);
                } else {
                    self.push(part.interval, part.curve);
                }
            }
            self.block = Some(block);
        }
        self.parts
            .sort_unstable_by_key(|part| (part.interval, part.curve.piece.from));
        &self.parts
    }
}
