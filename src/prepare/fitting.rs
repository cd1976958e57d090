//! Fitting of curves into segments. Curves are collected until they fill a block. Each has one span immediately; that
//! span is replaced by several if the curve must be divided.

use crate::curve::options::Quantity;
use crate::fit::block::Intervals;
use crate::fit::exact::cut::Cutter;
use crate::fit::exact::fit::{FitBlock, IntervalCurve, Shape, Tier};
use crate::prepare::prepared::{CurveSlot, Prepared};
use crate::threads::stop;
use crate::time::runs::NONE;
use crate::time::spans::SpanSource;

/// Fits curves in blocks, whose memory is kept.
pub(crate) struct Fitting {
    shape: &'static Shape,
    quantity: Quantity,
    small_angle: FitQueue,
    full: FitQueue,
    cutter: Cutter,
}

/// Curves of one tier that are collected for a block.
#[derive(Default)]
struct FitQueue {
    /// The block, which is allocated for the first curve, because making a block takes longer than fitting a few
    /// curves.
    block: Option<Box<FitBlock>>,
    /// The lanes of curves that are not copied to the block yet.
    lanes: Vec<u8>,
    /// The destinations of the curves: those in the block, then those in `lanes`.
    slots: Vec<CurveSlot>,
}

impl Fitting {
    pub(crate) fn new(shape: &'static Shape, quantity: Quantity) -> Self {
        Self {
            shape,
            quantity,
            small_angle: FitQueue::default(),
            full: FitQueue::default(),
            cutter: Cutter::default(),
        }
    }

    /// Queues the curve in a lane of `curves`, which has a span and a segment already. The lane is read later, by
    /// [`Fitting::copy_queued`], which must be called before the lanes of `curves` change.
    #[inline]
    pub(crate) fn queue(&mut self, curves: &Intervals, lane: usize, slot: CurveSlot) {
        let queue = match self.shape.tier(curves.squared_extents[lane]) {
            Tier::SmallAngle => &mut self.small_angle,
            Tier::Full => &mut self.full,
            Tier::Piece => {
                let curve = IntervalCurve::of_interval(curves, lane, self.shape, self.quantity);
                let (start, segment) = (curves.starts[lane], Some(slot.segment));
                return self.cutter.push(slot.span, start, curve, segment);
            }
        };
        queue.lanes.push(lane as u8);
        queue.slots.push(slot);
    }

    /// Copies the curves that were queued into blocks, and fits the blocks that are full.
    pub(crate) fn copy_queued(&mut self, prepared: &mut Prepared, curves: &Intervals) {
        let (small_angle, full) = (&mut self.small_angle, &mut self.full);
        for (tier, queue) in [(Tier::SmallAngle, small_angle), (Tier::Full, full)] {
            let mut lanes = &queue.lanes[..];
            while !lanes.is_empty() {
                let new = || Box::new(FitBlock::new(self.shape, self.quantity, tier));
                let block = queue.block.get_or_insert_with(new);
                let (copied, others) = lanes.split_at(block.room().min(lanes.len()));
                block.push_from(curves, copied);
                if block.room() == 0 {
                    run(block, &mut queue.slots, &mut self.cutter, prepared);
                }
                lanes = others;
            }
            queue.lanes.clear();
        }
    }

    /// Queues a curve of any length as the next span, with this constant at its start. [`Fitting::finish`] fits it,
    /// and divides it if necessary; until then it has no segment.
    pub(crate) fn queue_curve(
        &mut self,
        prepared: &mut Prepared,
        curve: IntervalCurve,
        start: f64,
        key: u32,
    ) {
        self.cutter.push(prepared.spans.len(), start, curve, None);
        prepared.push_span(start, SpanSource::Constant(NONE), key);
    }

    /// Fits the remaining curves, and replaces the spans of divided curves by those of their parts.
    pub(crate) fn finish(&mut self, prepared: &mut Prepared) {
        for queue in [&mut self.small_angle, &mut self.full] {
            if let Some(block) = &mut queue.block {
                run(block, &mut queue.slots, &mut self.cutter, prepared);
            }
        }
        let segments = &mut prepared.segments.polynomials;
        self.cutter.cut(self.shape, self.quantity, segments);
        if !stop::is_stopped() {
            prepared.replace_cut_spans(&self.cutter);
        }
        self.cutter.curves.clear();
        self.cutter.subcurves.clear();
    }
}

/// Fits the curves of a block, whose destinations are the first `slots`.
fn run(
    block: &mut FitBlock,
    slots: &mut Vec<CurveSlot>,
    cutter: &mut Cutter,
    prepared: &mut Prepared,
) {
    let count = block.count;
    let segments = &mut prepared.segments.polynomials;
    block.run(segments, slots.iter().map(|slot| slot.segment));
    let is_trusted = block.is_trusted();
    for (lane, slot) in slots.drain(..count).enumerate() {
        if !is_trusted && !block.fits(lane, segments) {
            let start = prepared.spans.starts[slot.span];
            cutter.push(slot.span, start, block.curve(lane), Some(slot.segment));
        }
    }
    block.clear();
}
