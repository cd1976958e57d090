//! Fits curves into segments. Curves wait until they fill a block. Each has one span at once;
//! that span is replaced by several if the curve has to be cut.

use crate::curve::options::Quantity;
use crate::fit::double::curve::Curve;
use crate::fit::double::cut::Cutter;
use crate::fit::double::fit::{FitBlock, Tier, tier};
use crate::fit::double::intervals::Intervals;
use crate::fit::double::shape::Shape;
use crate::prepare::prepared::{Place, Prepared};
use crate::threads::stop;
use crate::time::spans::{NONE, Source};

/// Fits curves in blocks, whose memory is kept.
pub(crate) struct Fitting {
    shape: &'static Shape,
    quantity: Quantity,
    small_angle: Queue,
    full: Queue,
    cutter: Cutter,
}

/// Curves of one tier that wait to fill a block.
#[derive(Default)]
struct Queue {
    /// Made for the first curve: making a block takes longer than fitting a few curves.
    block: Option<Box<FitBlock>>,
    /// The lanes of curves that are not copied into the block yet.
    lanes: Vec<u8>,
    /// Where the curves go: those in the block, then those in `lanes`.
    places: Vec<Place>,
}

impl Fitting {
    pub(crate) fn new(shape: &'static Shape, quantity: Quantity) -> Self {
        Self {
            shape,
            quantity,
            small_angle: Queue::default(),
            full: Queue::default(),
            cutter: Cutter::default(),
        }
    }

    /// Takes the curve in a lane of `curves`, whose span and segment are there already.
    /// [`Fitting::bring`] must copy it before the lanes of `curves` change.
    #[inline]
    pub(crate) fn take(&mut self, curves: &Intervals, lane: usize, place: Place) {
        let queue = match tier(curves.squared_extents[lane]) {
            Tier::SmallAngle => &mut self.small_angle,
            Tier::Full => &mut self.full,
            Tier::Piece => {
                let curve = curves.curve(lane, self.shape, self.quantity);
                let (start, segment) = (curves.starts[lane], Some(place.segment));
                return self.cutter.push(place.span, start, curve, segment);
            }
        };
        queue.lanes.push(lane as u8);
        queue.places.push(place);
    }

    /// Copies the curves that were taken into blocks, and fits the blocks that are full.
    pub(crate) fn bring(&mut self, prepared: &mut Prepared, curves: &Intervals) {
        let (small_angle, full) = (&mut self.small_angle, &mut self.full);
        for (tier, queue) in [(Tier::SmallAngle, small_angle), (Tier::Full, full)] {
            let mut lanes = &queue.lanes[..];
            while !lanes.is_empty() {
                let new = || Box::new(FitBlock::new(self.shape, self.quantity, tier));
                let block = queue.block.get_or_insert_with(new);
                let (own, others) = lanes.split_at(block.room().min(lanes.len()));
                block.push_from(curves, own);
                if block.room() == 0 {
                    run(block, &mut queue.places, &mut self.cutter, prepared);
                }
                lanes = others;
            }
            queue.lanes.clear();
        }
    }

    /// Takes a curve of any length as the next span, with this constant at its start.
    /// [`Fitting::finish`] fits it, and cuts it if necessary; until then it has no segment.
    pub(crate) fn take_curve(
        &mut self,
        prepared: &mut Prepared,
        curve: Curve,
        start: f64,
        key: u32,
    ) {
        self.cutter.push(prepared.spans.len(), start, curve, None);
        prepared.push_span(start, Source::Segment(NONE), key);
    }

    /// Fits the curves that still wait, and replaces the spans of cut curves by those of their
    /// parts.
    pub(crate) fn finish(&mut self, prepared: &mut Prepared) {
        for queue in [&mut self.small_angle, &mut self.full] {
            if let Some(block) = &mut queue.block {
                run(block, &mut queue.places, &mut self.cutter, prepared);
            }
        }
        let segments = &mut prepared.segments.polynomials;
        self.cutter.cut(self.shape, self.quantity, segments);
        if !stop::is_stopped() {
            prepared.put_subcurves(&self.cutter);
        }
        self.cutter.curves.clear();
        self.cutter.subcurves.clear();
    }
}

/// Fits the curves of a block, which go to the first of the `places`.
fn run(
    block: &mut FitBlock,
    places: &mut Vec<Place>,
    cutter: &mut Cutter,
    prepared: &mut Prepared,
) {
    let count = block.count;
    let segments = &mut prepared.segments.polynomials;
    block.run(segments, places.iter().map(|place| place.segment));
    let is_trusted = block.is_trusted();
    for (lane, place) in places.drain(..count).enumerate() {
        if !is_trusted && !block.fits(lane, segments) {
            let start = prepared.spans.starts[place.span];
            cutter.push(place.span, start, block.curve(lane), Some(place.segment));
        }
    }
    block.clear();
}

impl Prepared {
    /// Replaces the spans of curves that were cut by those of their parts.
    fn put_subcurves(&mut self, cutter: &Cutter) {
        let mut cut = &cutter.subcurves[..];
        if cut.is_empty() {
            return;
        }
        let uncut = std::mem::take(&mut self.spans);
        self.spans.reserve(uncut.len() + cut.len());
        for part in 0..self.parts.len() {
            let (spans, first_span) = (self.parts[part].spans.clone(), self.spans.len());
            let mut next = spans.start;
            loop {
                let first_cut = cut.first().map_or(spans.end, |first| first.span);
                let span = first_cut.min(spans.end);
                self.spans.extend_from(&uncut, next..span);
                if span == spans.end {
                    break;
                }
                next = span + 1;
                let (start, key) = (uncut.starts[span], uncut.keys[span]);
                let end = match next < spans.end {
                    true => uncut.starts[next],
                    false => self.parts[part].end,
                };
                let own = cut.partition_point(|subcurve| subcurve.span <= span);
                let (own, others) = cut.split_at(own);
                for subcurve in own {
                    let (from, _) = subcurve.piece.extent();
                    let key = if from == 0.0 { key } else { NONE };
                    let source = match subcurve.segment {
                        Some(place) => Source::Segment(place as u32),
                        None => {
                            self.exact.push(cutter.curve(subcurve));
                            Source::Exact(self.exact.len() as u32 - 1)
                        }
                    };
                    self.push_span(subcurve.piece.begins(start, end - start), source, key);
                }
                cut = others;
            }
            self.parts[part].spans = first_span..self.spans.len();
        }
    }
}
