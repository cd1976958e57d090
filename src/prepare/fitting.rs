//! Curves to segments: they wait in lanes until a block of them is full, and become
//! spans in order of time once all of them are fitted.

use bytemuck::Zeroable;

use super::curve::Curve;
use super::cut::{Cutter, Part as CurvePart};
use super::fit::{FitBlock, Tier, tier};
use super::intervals::Intervals;
use super::shape::Shape;
use super::steady::SteadyBlock;
use super::{NONE, Prepared, Source};
use crate::cpu::in_lanes;
use crate::method::Quantity;
use crate::segment::{PolynomialSegment, Segments};

/// Fits curves; what it needs for that is kept.
pub(super) struct Fitting {
    shape: &'static Shape,
    quantity: Quantity,
    gentle: Queue,
    full: Queue,
    /// Made when there is an interval for it.
    steady: Option<Box<SteadyBlock>>,
    cutter: Cutter,
    intervals: Vec<Fitted>,
}

/// Where an interval is, and what it becomes.
pub(super) struct Place {
    /// Its part of the prepared tracks.
    pub(super) part: usize,
    /// Seconds.
    pub(super) start: f64,
    pub(super) end: f64,
    /// The constant to store at exactly the start, or [`NONE`].
    pub(super) key: u32,
}

struct Fitted {
    place: Place,
    source: CurveSource,
}

#[derive(Clone, Copy)]
enum CurveSource {
    Constant(u32),
    Segment(u32),
    /// Parts, the first of which may have that place among the segments.
    Parts(Option<u32>),
}

/// Curves that wait for a block to fill, and which intervals they are of.
#[derive(Default)]
struct Queue {
    /// Made when there is a curve for it: to make one takes longer than to fit few.
    block: Option<Box<FitBlock>>,
    intervals: Vec<usize>,
}

impl Fitting {
    pub(super) fn new(shape: &'static Shape, quantity: Quantity) -> Self {
        Self {
            shape,
            quantity,
            gentle: Queue::default(),
            full: Queue::default(),
            steady: None,
            cutter: Cutter::new(shape, quantity),
            intervals: Vec::new(),
        }
    }

    /// Adds an interval that stands still.
    pub(super) fn push_constant(&mut self, place: Place, constant: u32) {
        let source = CurveSource::Constant(constant);
        self.intervals.push(Fitted { place, source });
    }

    /// Adds an interval with the curve in a lane of `curves`.
    pub(super) fn push(
        &mut self,
        prepared: &mut Prepared,
        place: Place,
        curves: &Intervals,
        lane: usize,
    ) {
        let interval = self.intervals.len();
        let Some(tier) = tier(curves.energies[lane]) else {
            self.cutter
                .push(interval, curves.curve(lane, self.shape, self.quantity));
            let source = CurveSource::Parts(None);
            self.intervals.push(Fitted { place, source });
            return;
        };
        self.push_segment(prepared, place);
        let queue = match tier {
            Tier::Gentle => &mut self.gentle,
            Tier::Full => &mut self.full,
        };
        queue.intervals.push(interval);
        let new = || Box::new(FitBlock::new(self.shape, self.quantity, tier));
        let block = queue.block.get_or_insert_with(new);
        block.push_from(curves, lane);
        if block.is_full() {
            self.run(tier, prepared);
        }
    }

    /// Adds an interval with a segment, which is zero.
    pub(super) fn push_segment<'p>(
        &mut self,
        prepared: &'p mut Prepared,
        place: Place,
    ) -> &'p mut PolynomialSegment {
        let segments = polynomials(prepared);
        let segment = segments.len();
        let source = CurveSource::Segment(segment as u32);
        self.intervals.push(Fitted { place, source });
        segments.push(PolynomialSegment::zeroed());
        &mut segments[segment]
    }

    /// Adds two keys that are alone.
    pub(super) fn push_steady(
        &mut self,
        prepared: &mut Prepared,
        place: Place,
        keys: [[f32; 4]; 2],
    ) {
        let segments = polynomials(prepared);
        let segment = segments.len() as u32;
        segments.push(PolynomialSegment::zeroed());
        let source = CurveSource::Segment(segment);
        self.intervals.push(Fitted { place, source });
        let new = || Box::new(SteadyBlock::new());
        let block = self.steady.get_or_insert_with(new);
        block.push(keys, segment);
        if block.is_full() {
            in_lanes(&mut **block);
            block.write(segments);
        }
    }

    /// Adds an interval with any curve.
    pub(super) fn push_curve(&mut self, place: Place, curve: Curve) {
        self.cutter.push_whole(self.intervals.len(), curve);
        let source = CurveSource::Parts(None);
        self.intervals.push(Fitted { place, source });
    }

    /// Fits the curves of a queue.
    fn run(&mut self, tier: Tier, prepared: &mut Prepared) {
        let queue = match tier {
            Tier::Gentle => &mut self.gentle,
            Tier::Full => &mut self.full,
        };
        let Some(block) = &mut queue.block else {
            return;
        };
        block.run();
        let trusted = block.is_trusted();
        let segments = polynomials(prepared);
        for (lane, interval) in queue.intervals.drain(..).enumerate() {
            let source = &mut self.intervals[interval].source;
            let CurveSource::Segment(segment) = *source else {
                continue;
            };
            if trusted || block.fits(lane) {
                block.write(lane, &mut segments[segment as usize]);
            } else {
                *source = CurveSource::Parts(Some(segment));
                self.cutter.push(interval, block.curve(lane));
            }
        }
        block.clear();
    }

    /// Fits what still waits, and appends the spans of all intervals given.
    pub(super) fn finish(&mut self, prepared: &mut Prepared) {
        self.run(Tier::Gentle, prepared);
        self.run(Tier::Full, prepared);
        if let Some(block) = &mut self.steady {
            in_lanes(&mut **block);
            block.write(polynomials(prepared));
        }
        self.cutter.cut();
        let mut parts = self.cutter.parts();
        for (interval, Fitted { place, source }) in self.intervals.drain(..).enumerate() {
            let first_span = prepared.spans.len();
            let Place { start, key, .. } = place;
            match source {
                CurveSource::Constant(constant) => {
                    prepared.push_span(start, Source::Constant(constant), NONE);
                }
                CurveSource::Segment(segment) => {
                    prepared.push_span(start, Source::Segment(segment), key);
                }
                CurveSource::Parts(mut spare) => {
                    let is_own = |part: &&CurvePart| part.interval == interval;
                    let own = parts.iter().take_while(is_own).count();
                    for part in parts.split_off(..own).unwrap_or_default() {
                        let (from, _) = part.piece.extent();
                        let start = start + (place.end - start) * from;
                        let key = if from == 0.0 { key } else { NONE };
                        let source = prepared.part_source(&self.cutter, part, &mut spare);
                        prepared.push_span(start, source, key);
                    }
                }
            }
            let spans = &mut prepared.parts[place.part].spans;
            let is_first = spans.start == spans.end;
            let start = if is_first { first_span } else { spans.start };
            *spans = start..prepared.spans.len();
        }
        self.cutter.clear();
    }
}

impl Prepared {
    fn part_source(
        &mut self,
        cutter: &Cutter,
        part: &CurvePart,
        spare: &mut Option<u32>,
    ) -> Source {
        let Some(segment) = cutter.segment(part) else {
            self.exact.push(cutter.curve(part));
            return Source::Exact(self.exact.len() as u32 - 1);
        };
        let segments = polynomials(self);
        let place = spare.take().unwrap_or_else(|| {
            segments.push(segment);
            segments.len() as u32 - 1
        });
        segments[place as usize] = segment;
        Source::Segment(place)
    }
}

pub(super) fn polynomials(prepared: &mut Prepared) -> &mut Vec<PolynomialSegment> {
    match &mut prepared.segments {
        Segments::Polynomial(segments) => segments,
        Segments::Arc(_) => unreachable!("the method's form"),
    }
}
