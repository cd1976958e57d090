//! Curves that one polynomial does not fit, cut in two until every part fits.

use bytemuck::Zeroable;

use super::cubic::Cubic;
use super::fit::{FitBlock, Tier};
use super::intervals::LANES;
use crate::cpu::in_lanes;
use crate::method::Basis;
use crate::segment::PolynomialSegment;

/// Cuts curves; what it needs for that is kept.
pub(super) struct Cutter {
    basis: &'static Basis,
    /// Made when there is something to cut.
    block: Option<Box<FitBlock>>,
    waiting: Vec<Part>,
    /// The parts of every curve given, in order of intervals and time.
    parts: Vec<Part>,
}

/// A part of a curve.
#[derive(Clone, Copy)]
pub(super) struct Part {
    /// The interval that the curve is of.
    pub(super) interval: usize,
    pub(super) cubic: Cubic,
    /// Nothing where even the finest does not fit.
    pub(super) segment: Option<PolynomialSegment>,
}

impl Cutter {
    pub(super) fn new(basis: &'static Basis) -> Self {
        Self {
            basis,
            block: None,
            waiting: Vec::new(),
            parts: Vec::new(),
        }
    }

    /// Adds the curve of an interval: at least two parts will come of it.
    pub(super) fn push(&mut self, interval: usize, cubic: Cubic) {
        for piece in cubic.piece.halves() {
            self.waiting.push(Part {
                interval,
                cubic: Cubic { piece, ..cubic },
                segment: None,
            });
        }
    }

    /// The parts of the curves given since the last call.
    pub(super) fn cut(&mut self) -> &[Part] {
        self.parts.clear();
        while !self.waiting.is_empty() {
            let first = self.waiting.len().saturating_sub(LANES);
            let now = self.waiting.split_off(first);
            let mut block = match self.block.take() {
                Some(block) => block,
                None => Box::new(FitBlock::new(self.basis, Tier::Full)),
            };
            block.clear();
            now.iter().for_each(|part| block.push(&part.cubic));
            in_lanes(&mut *block);
            for (lane, part) in now.into_iter().enumerate() {
                if block.fits(lane) {
                    let mut segment = PolynomialSegment::zeroed();
                    block.write(lane, &mut segment);
                    let segment = Some(segment);
                    self.parts.push(Part { segment, ..part });
                } else if part.cubic.piece.is_finest() {
                    self.parts.push(part);
                } else {
                    self.push(part.interval, part.cubic);
                }
            }
            self.block = Some(block);
        }
        self.parts
            .sort_unstable_by_key(|part| (part.interval, part.cubic.piece.from));
        &self.parts
    }
}
