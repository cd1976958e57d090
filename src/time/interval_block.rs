//! Where the spans of a part lie among the samples, some of them at once, in vector lanes.

use std::ops::Range;

use crate::math::canonical::whole_number;
use crate::prepare::{Part, Prepared};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::time::frame_clock::{Clock, in_frames};
use crate::time::runs::Parameter;

/// The frame coordinates of consecutive spans, and what their samples' parameters
/// follow from.
pub(crate) struct SpanBlock {
    /// Where each span starts, and at the end where the last one ends, in frames.
    frame: [f64; Self::LEN + 1],
    /// The first of the samples asked for that is not before `frame`, or their end.
    pub(crate) first: [usize; Self::LEN + 1],
    /// Whether that is `frame` itself: 1 or 0.
    pub(crate) is_held: [u64; Self::LEN],
    /// The whole frame nearest to each span's middle.
    pub(crate) whole: [f64; Self::LEN],
    /// From there to `first`.
    pub(crate) distance: [f32; Self::LEN],
    pub(crate) scale: [f32; Self::LEN],
    pub(crate) offset: [f32; Self::LEN],
    /// Whether all distances of samples are whole numbers of f32.
    pub(crate) are_near: bool,
    /// The spans that hold samples, by their places in the block.
    pub(crate) occupied: Occupied,
}

impl SpanBlock {
    const LEN: usize = 32;

    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            frame: [0.0; Self::LEN + 1],
            first: [0; Self::LEN + 1],
            is_held: [0; Self::LEN],
            whole: [0.0; Self::LEN],
            distance: [0.0; Self::LEN],
            scale: [0.0; Self::LEN],
            offset: [0.0; Self::LEN],
            are_near: true,
            occupied: Occupied::default(),
        }
    }

    /// What a cubic of the `j`th span that is evaluated in f64 needs.
    pub(crate) fn parameter(&self, j: usize) -> Parameter {
        Parameter::Frames {
            start: self.frame[j],
            frames: self.frame[j + 1] - self.frame[j],
        }
    }
}

/// A bit for each of some spans that holds samples, and their places in order. Where keys are
/// denser than samples no processor guesses which these are.
#[derive(Clone, Copy, Default)]
pub(crate) struct Occupied(pub(crate) u64);

impl Iterator for Occupied {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let place = self.0.trailing_zeros();
        self.0 &= self.0.wrapping_sub(1);
        (place < u64::BITS).then_some(place as usize)
    }
}

/// The spans of a part in blocks.
pub(crate) struct SpanBlocks<'a, C> {
    clock: C,
    starts: &'a [f64],
    /// Where the last span ends.
    end: f64,
    /// The samples asked for.
    samples: Range<usize>,
    /// The first span's place among all.
    first_span: usize,
    /// How many spans are done.
    done: usize,
}

impl<'a, C: Clock> SpanBlocks<'a, C> {
    pub(crate) fn new(
        prepared: &'a Prepared,
        part: &Part,
        clock: C,
        samples: Range<usize>,
    ) -> Self {
        let starts = &prepared.spans.starts[part.spans.clone()];
        // The span that holds the first sample; a time's own rounding may put it one
        // further.
        let mut done = 0;
        if samples.start > 0
            && let Some(first_time) = clock.own_time(samples.start)
        {
            // Mostly none of a long track's part is asked for: no search through cold memory.
            let found = match starts.last() {
                Some(&last) if last <= first_time => starts.len(),
                _ => starts.partition_point(|&start| start <= first_time),
            };
            done = found.saturating_sub(2);
        }
        Self {
            clock,
            starts,
            end: part.end,
            samples,
            first_span: part.spans.start,
            done,
        }
    }

    /// Fills a block with the next spans, and tells which these are; nothing where no span
    /// is left that holds samples.
    pub(crate) fn fill(&mut self, block: &mut SpanBlock) -> Option<Range<usize>> {
        let from = self.done;
        if from == self.starts.len() {
            return None;
        }
        let to = (from + SpanBlock::LEN).min(self.starts.len());
        self.done = to;
        in_lanes(&mut Fill {
            clock: self.clock,
            starts: &self.starts[from..to],
            next: self.starts.get(to).copied().unwrap_or(self.end),
            samples: [self.samples.start as f64, self.samples.end as f64],
            block,
        });
        (block.first[0] < self.samples.end).then_some(self.first_span + from..self.first_span + to)
    }
}

struct Fill<'a, C> {
    clock: C,
    /// At most [`SpanBlock::LEN`].
    starts: &'a [f64],
    /// Where the last of them ends.
    next: f64,
    samples: [f64; 2],
    block: &'a mut SpanBlock,
}

impl<C: Clock> InLanes for Fill<'_, C> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (clock, samples, starts) = (self.clock, self.samples, self.starts);
        let count = starts.len();
        // Their own, and not borrowed: the compiler must see that nothing else is in them.
        let mut frames = [0.0; SpanBlock::LEN + 1];
        let mut firsts = [0.0; SpanBlock::LEN + 1];
        let (frame, first) = (&mut frames[..count], &mut firsts[..count]);
        for j in 0..count {
            let boundary = clock.boundary(starts[j]);
            frame[j] = boundary.frame;
            first[j] = within(boundary.first, samples);
        }
        let end = clock.boundary(self.next);
        (frames[count], firsts[count]) = (end.frame, within(end.first, samples));
        let block = &mut *self.block;
        (block.frame, block.first) = (frames, firsts.map(|first| whole_number(first) as usize));
        let (frame, next_frame) = (&frames[..count], &frames[1..=count]);
        let (first, next_first) = (&firsts[..count], &firsts[1..=count]);
        let is_held = &mut block.is_held[..count];
        let whole = &mut block.whole[..count];
        let distance = &mut block.distance[..count];
        let scale = &mut block.scale[..count];
        let offset = &mut block.offset[..count];
        let mut far = 0;
        for j in 0..count {
            let span = in_frames(frame[j], next_frame[j], 1.0);
            let (before, after) = (first[j] - span.whole, next_first[j] - span.whole);
            let is_far = (before.abs() >= FAR) | (after.abs() >= FAR);
            far |= u64::from(is_far & (first[j] < next_first[j]));
            is_held[j] = u64::from(first[j] == frame[j]);
            whole[j] = span.whole;
            distance[j] = before as f32;
            scale[j] = span.scale;
            offset[j] = span.offset;
        }
        block.are_near = far == 0;
        // No span is behind the last one's end: there `first` is 0.
        let mut occupied = 0;
        for j in 0..SpanBlock::LEN {
            occupied |= u64::from(firsts[j] < firsts[j + 1]) << j;
        }
        block.occupied = Occupied(occupied);
    }
}

/// So many frames, and those that fill a vector behind them, are whole numbers of f32.
const FAR: f64 = (1u64 << 23) as f64;

/// The sample, or the nearer of the first one asked for and their end.
#[inline(always)]
fn within(sample: f64, [start, end]: [f64; 2]) -> f64 {
    let from = if sample > start { sample } else { start };
    if from < end { from } else { end }
}
