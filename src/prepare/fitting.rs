//! Curves to segments: they wait in lanes until a block of them is full. Each becomes one
//! span at once, and several where it turns out that it is to be cut.

use std::ops::Range;

use bytemuck::Zeroable;

use crate::curve::options::Quantity;
use crate::fit::constant_velocity::SteadyBlock;
use crate::fit::double::curve::Curve;
use crate::fit::double::cut::{Cutter, Part as CurvePart};
use crate::fit::double::fit::{FitBlock, Tier, tier};
use crate::fit::double::intervals::{Intervals, LANES};
use crate::fit::double::shape::Shape;
use crate::prepare::prepared::Prepared;
use crate::shader::PolynomialSegment;
use crate::simd::dispatch::in_lanes;
use crate::time::spans::{NONE, Part, Source, Spans};

/// Fits curves; what it needs for that is kept. Each is that of the next span, whose source
/// is not there yet.
pub(crate) struct Fitting {
    shape: &'static Shape,
    quantity: Quantity,
    gentle: Queue,
    full: Queue,
    /// Made when there is an interval for it.
    steady: Option<Box<SteadyBlock>>,
    cutter: Cutter,
    /// Spans while curves among them are cut.
    uncut: Spans,
}

/// Curves that wait for a block to fill.
struct Queue {
    tier: Tier,
    /// Made when there is a curve for it: to make one takes longer than to fit few.
    block: Option<Box<FitBlock>>,
    /// The lanes of those that are not in the block yet.
    lanes: Vec<u8>,
    /// Which spans they are of: those in the block, then those in `lanes`.
    spans: Vec<usize>,
}

impl Queue {
    fn new(tier: Tier) -> Self {
        Self {
            tier,
            block: None,
            lanes: Vec::new(),
            spans: Vec::new(),
        }
    }
}

impl Fitting {
    pub(crate) fn new(shape: &'static Shape, quantity: Quantity) -> Self {
        Self {
            shape,
            quantity,
            gentle: Queue::new(Tier::Gentle),
            full: Queue::new(Tier::Full),
            steady: None,
            cutter: Cutter::new(shape, quantity),
            uncut: Spans::default(),
        }
    }

    /// Takes the curves in some lanes of `curves`, which are to be [brought](Fitting::bring)
    /// before they are others: each becomes the next span, the first with this constant at its
    /// start.
    #[inline]
    pub(crate) fn take(
        &mut self,
        prepared: &mut Prepared,
        curves: &Intervals,
        lanes: Range<usize>,
        key: u32,
    ) {
        (prepared.spans).begin(&curves.starts[lanes.clone()], key);
        let first_span = prepared.new_segments(lanes.len());
        for (span, lane) in (first_span..).zip(lanes) {
            self.queue(prepared, curves, lane, span);
        }
    }

    /// As [`Fitting::take`], the curve of a span that has its segment.
    #[inline]
    pub(crate) fn queue(
        &mut self,
        prepared: &Prepared,
        curves: &Intervals,
        lane: usize,
        span: usize,
    ) {
        let queue = match tier(curves.energies[lane]) {
            Tier::Gentle => &mut self.gentle,
            Tier::Full => &mut self.full,
            Tier::Piece => {
                let curve = curves.curve(lane, self.shape, self.quantity);
                if let Source::Segment(place) = prepared.spans.sources[span] {
                    self.cutter.push(span, curve, place as usize);
                }
                return;
            }
        };
        queue.lanes.push(lane as u8);
        queue.spans.push(span);
    }

    /// Brings the curves that were taken into blocks.
    pub(crate) fn bring(&mut self, prepared: &mut Prepared, curves: &Intervals) {
        for queue in [&mut self.gentle, &mut self.full] {
            let mut lanes = &queue.lanes[..];
            while !lanes.is_empty() {
                let new = || Box::new(FitBlock::new(self.shape, self.quantity, queue.tier));
                let block = queue.block.get_or_insert_with(new);
                let (own, others) = lanes.split_at(block.room().min(lanes.len()));
                block.push_from(curves, own);
                if block.room() == 0 {
                    run(block, &mut queue.spans, &mut self.cutter, prepared);
                }
                lanes = others;
            }
            queue.lanes.clear();
        }
    }

    /// Takes two keys that are alone.
    pub(crate) fn take_steady(&mut self, prepared: &mut Prepared, keys: [[f32; 4]; 2]) -> Source {
        let (source, segment) = new_segment(prepared);
        let new = || Box::new(SteadyBlock::new());
        let block = self.steady.get_or_insert_with(new);
        block.push(keys, segment as u32);
        if block.is_full() {
            in_lanes(&mut **block);
            block.write(&mut prepared.segments.polynomials);
        }
        source
    }

    /// Takes any curve.
    pub(crate) fn take_curve(&mut self, prepared: &Prepared, curve: Curve) -> Source {
        self.cutter.push_whole(prepared.spans.sources.len(), curve);
        UNTRIED
    }

    /// Fits what still waits, and puts the parts of curves that were cut where these are
    /// among the spans.
    pub(crate) fn finish(&mut self, prepared: &mut Prepared) {
        for queue in [&mut self.gentle, &mut self.full] {
            if let Some(block) = &mut queue.block {
                run(block, &mut queue.spans, &mut self.cutter, prepared);
            }
        }
        if let Some(block) = &mut self.steady {
            in_lanes(&mut **block);
            block.write(&mut prepared.segments.polynomials);
        }
        self.cutter.cut(&mut prepared.segments.polynomials);
        prepared.put_parts(&self.cutter, &mut self.uncut);
        self.cutter.clear();
    }
}

/// Fits the curves of a block, which are of the first of the `spans`.
fn run(block: &mut FitBlock, spans: &mut Vec<usize>, cutter: &mut Cutter, prepared: &mut Prepared) {
    let own = &spans[..block.count()];
    let sources = &prepared.spans.sources;
    let places = own.iter().filter_map(|&span| match sources[span] {
        Source::Segment(place) => Some(place as usize),
        _ => None,
    });
    let segments = &mut prepared.segments.polynomials;
    block.run(segments, places);
    if !block.is_trusted() {
        for (lane, &span) in own.iter().enumerate() {
            if !block.fits(lane, segments) {
                cutter.push(span, block.curve(lane), block.place(lane));
            }
        }
    }
    spans.drain(..block.count());
    block.clear();
}

/// Segments that are not fitted yet: as a constant, so many of them are cleared at once.
static ZERO: [PolynomialSegment; 2 * LANES] = [PolynomialSegment {
    coefficients: [[0.0; 4]; 11],
}; 2 * LANES];

/// Of curves that are cut untried.
const UNTRIED: Source = Source::Segment(NONE);

/// A segment, which is zero; and its place.
pub(crate) fn new_segment(prepared: &mut Prepared) -> (Source, usize) {
    let segments = &mut prepared.segments.polynomials;
    let place = segments.len();
    segments.push(PolynomialSegment::zeroed());
    (Source::Segment(place as u32), place)
}

impl Prepared {
    /// As many segments, two for each lane at most, which are zero, each the source of the next
    /// span; the first of these spans.
    #[inline]
    pub(crate) fn new_segments(&mut self, count: usize) -> usize {
        let segments = &mut self.segments.polynomials;
        let places = segments.len()..segments.len() + count;
        segments.extend_from_slice(&ZERO[..count]);
        let sources = &mut self.spans.sources;
        let first_span = sources.len();
        sources.extend(places.map(|place| Source::Segment(place as u32)));
        first_span
    }

    /// Puts the parts of curves that were cut where these are among the spans.
    fn put_parts(&mut self, cutter: &Cutter, uncut: &mut Spans) {
        let mut cut = cutter.parts();
        let Some(first) = cut.first().map(|part| part.span) else {
            return;
        };
        std::mem::swap(&mut self.spans, uncut);
        self.spans.clear();
        self.spans.extend(uncut, 0..first);
        for part in 0..self.parts.len() {
            let Part { spans, end, .. } = &self.parts[part];
            let (spans, end) = (spans.clone(), *end);
            if spans.end <= first {
                continue;
            }
            let start = if spans.start > first {
                self.spans.len()
            } else {
                spans.start
            };
            let mut next = spans.start.max(first);
            while next < spans.end {
                let to = cut
                    .first()
                    .map_or(spans.end, |part| part.span.min(spans.end));
                self.spans.extend(uncut, next..to);
                next = to;
                if next < spans.end {
                    next += 1;
                    let is_last = next == spans.end;
                    let end = if is_last { end } else { uncut.starts[next] };
                    cut = self.put_first(cutter, cut, uncut, to, end);
                }
            }
            self.parts[part].spans = start..self.spans.len();
        }
    }

    /// Puts the parts of the first curve there, whose span ends at `end`; the others' parts.
    fn put_first<'c>(
        &mut self,
        cutter: &Cutter,
        parts: &'c [CurvePart],
        uncut: &Spans,
        span: usize,
        end: f64,
    ) -> &'c [CurvePart] {
        let (start, key) = (uncut.starts[span], uncut.keys[span]);
        let count = (parts.iter())
            .take_while(|part| part.span == parts[0].span)
            .count();
        let (own, others) = parts.split_at(count);
        for part in own {
            let (from, _) = part.piece.extent();
            let start = start + (end - start) * from;
            let key = if from == 0.0 { key } else { NONE };
            let source = match part.segment {
                Some(place) => Source::Segment(place as u32),
                None => {
                    self.exact.push(cutter.curve(part));
                    Source::Exact(self.exact.len() as u32 - 1)
                }
            };
            self.push_span(start, source, key);
        }
        others
    }
}
