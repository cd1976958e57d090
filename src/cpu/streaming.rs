//! Streaming (non-temporal) stores of long results, which bypass the caches, on processors where they are faster.
//! They need whole cache lines: rotations of incomplete lines, or that are not computed in order, wait in staging
//! lines, 32 KiB that stay in the first-level cache.

use std::ops::Range;

use crate::cpu::evaluate::{SAMPLES_ONE_BY_ONE, StreamingLines, frames, frames_past_caches};
use crate::output::encoded::EncodedOutput;
use crate::simd::cache_line::{CacheLine, EACH};
use crate::simd::dispatch::{
    InLanesInto, VectorWidth, fence, in_lanes_into, streaming_stores_from,
};
use crate::simd::lanes::Lanes;
use crate::time::runs::Affine;
use crate::twin::Evaluate;

/// The minimum size in bytes of a result for streaming stores. Of such a result, the caches could keep so little that
/// its reader would not benefit.
const LONG: usize = 32 << 20;

/// The minimum number of samples of a row for which streaming stores save more time than staging takes.
const ROW: usize = 64;

/// Number of staging lines.
const LINES: usize = 512;

/// Writes consecutive rows: directly to the result, or through staging lines by streaming stores.
pub(crate) struct Stage<'o> {
    width: VectorWidth,
    destination: Destination<'o>,
    /// The staging lines; `None` if rows are written directly.
    lines: Option<Box<[CacheLine; LINES]>>,
    /// The end of the staged rotations, counted from the start of the first staging line.
    filled: usize,
}

/// The destination of consecutive rows in an encoding.
pub(crate) enum RowStage<'o> {
    /// Values of four f32, for which rows may be staged.
    Values(Stage<'o>),
    Encoded(EncodedStage<'o>),
}

/// Encodes consecutive rows: values wait in memory that stays in the first-level cache until there are enough of them.
pub(crate) struct EncodedStage<'o> {
    values: Vec<[f32; 4]>,
    output: EncodedOutput<'o>,
}

impl<'o> RowStage<'o> {
    /// As [`Stage::row`].
    pub(crate) fn row<E>(
        &mut self,
        count: usize,
        mut make: impl FnMut(Range<usize>, &mut RowOutput<'_, 'o>) -> Result<(), E>,
    ) -> Result<(), E> {
        let stage = match self {
            Self::Values(stage) => return stage.row(count, make),
            Self::Encoded(stage) => stage,
        };
        let mut first = 0;
        while first < count {
            if stage.values.len() + count - first > EACH * LINES {
                stage.store();
            }
            let (start, some) = (stage.values.len(), (count - first).min(EACH * LINES));
            stage.values.resize(start + some, [0.0; 4]);
            let values = &mut stage.values[start..];
            make(first..first + some, &mut RowOutput::Here(values))?;
            first += some;
        }
        Ok(())
    }

    /// Stores the rest after the last row.
    pub(crate) fn finish(self) {
        match self {
            Self::Values(stage) => stage.finish(),
            Self::Encoded(mut stage) => stage.store(),
        }
    }
}

impl<'o> EncodedStage<'o> {
    pub(crate) fn new(output: EncodedOutput<'o>) -> Self {
        let values = Vec::with_capacity(output.len().min(EACH * LINES));
        Self { values, output }
    }

    fn store(&mut self) {
        self.output.split_off(self.values.len()).store(&self.values);
        self.values.clear();
    }
}

/// The part of the output that is not stored yet.
struct Destination<'o> {
    /// Without staging lines the whole output. Otherwise the part before its first whole line, which is staged at the
    /// end of the first staging line.
    before: &'o mut [[f32; 4]],
    lines: &'o mut [CacheLine],
    after: &'o mut [[f32; 4]],
    /// The number of staging lines that are stored already.
    stored: usize,
}

impl<'o> Stage<'o> {
    /// Makes a stage for `output`: rows of `samples` each, a part of a result of `rotations`. `streams` says whether
    /// streaming stores are used. If it is `None`, the average length of a run is computed, but only if all other
    /// conditions are met.
    pub(crate) fn new(
        width: VectorWidth,
        streams: Option<bool>,
        rotations: usize,
        samples: usize,
        samples_of_a_run: impl FnOnce() -> usize,
        output: &'o mut [[f32; 4]],
    ) -> Self {
        let is_staged = streams.unwrap_or_else(|| {
            rotations >= LONG / size_of::<[f32; 4]>()
                && samples >= ROW
                && streaming_stores_from().is_some_and(|from| width.narrowed() >= from)
                && samples_of_a_run() > SAMPLES_ONE_BY_ONE
        });
        Self::with(width, is_staged, output)
    }

    fn with(width: VectorWidth, is_staged: bool, output: &'o mut [[f32; 4]]) -> Self {
        // Where a rotation may lie across two cache lines, rows are written directly.
        let is_aligned = output.as_ptr().addr().is_multiple_of(size_of::<[f32; 4]>());
        let is_staged = is_staged && is_aligned && !cfg!(smallest);
        let (before, lines, after) = match is_staged {
            true => bytemuck::pod_align_to_mut(output),
            false => (output, &mut [][..], &mut [][..]),
        };
        Self {
            width,
            lines: is_staged.then(bytemuck::zeroed_box),
            filled: before.len().wrapping_neg() % EACH,
            destination: Destination {
                before,
                lines,
                after,
                stored: 0,
            },
        }
    }

    /// Computes the next row by calls of `make`, each for as many samples as can be staged.
    pub(crate) fn row<E>(
        &mut self,
        count: usize,
        mut make: impl FnMut(Range<usize>, &mut RowOutput<'_, 'o>) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut first = 0;
        while first < count {
            if self.filled + count - first > EACH * LINES {
                self.clear();
            }
            let Some(lines) = &mut self.lines else {
                let row = self
                    .destination
                    .before
                    .split_off_mut(..count)
                    .unwrap_or_default();
                return make(0..count, &mut RowOutput::Here(row));
            };
            let some = (count - first).min(EACH * LINES - self.filled);
            let mut output = RowOutput::Staged(Staged {
                lines: &mut lines[..],
                start: self.filled,
                end: self.filled + some,
                made: self.filled,
                destination: &mut self.destination,
            });
            make(first..first + some, &mut output)?;
            self.filled += some;
            first += some;
        }
        Ok(())
    }

    /// Stores the rotations that are still staged after the last row.
    pub(crate) fn finish(mut self) {
        self.clear();
        if let Some(lines) = &self.lines {
            let rest = &lines[0].0[..self.filled];
            self.destination.after.copy_from_slice(rest);
        }
    }

    /// Stores all staging lines that are complete; the rest moves to the start of the first.
    fn clear(&mut self) {
        let Some(lines) = &mut self.lines else {
            return;
        };
        let whole = self.filled / EACH;
        in_lanes_into(
            self.width,
            &WholeLines,
            &lines[..whole],
            &mut self.destination,
        );
        if whole < LINES {
            lines[0] = lines[whole];
        }
        self.filled %= EACH;
        self.destination.stored = 0;
    }
}

impl Drop for Stage<'_> {
    fn drop(&mut self) {
        if self.lines.is_some() {
            fence();
        }
    }
}

impl<'o> Destination<'o> {
    /// Stores `lines`, the first staging lines, except those that are stored already.
    #[inline(always)]
    fn store<L: Lanes>(&mut self, lines: &[CacheLine]) {
        if let [first, ..] = lines
            && !self.before.is_empty()
        {
            let before = std::mem::take(&mut self.before);
            before.copy_from_slice(&first.0[EACH - before.len()..]);
            self.stored = 1;
        }
        if lines.len() > self.stored {
            let lines = &lines[self.stored..];
            let blocks = bytemuck::cast_slice_mut(self.next(lines.len()));
            for (block, target) in bytemuck::cast_slice(lines).iter().zip(blocks) {
                L::of_block(block).store_past_caches(target);
            }
        }
    }

    /// Returns the next `count` lines of the output, which the caller stores.
    #[inline(always)]
    fn next(&mut self, count: usize) -> &'o mut [CacheLine] {
        let (lines, others) = std::mem::take(&mut self.lines).split_at_mut(count);
        self.lines = others;
        self.stored += count;
        lines
    }
}

/// Stores whole staging lines.
struct WholeLines;

impl<'o> InLanesInto<[CacheLine], Destination<'o>> for WholeLines {
    const WIDE_IN_TESTS: bool = true;
    type Outcome = ();

    #[inline(always)]
    fn run<L: Lanes>(&self, lines: &[CacheLine], destination: &mut Destination<'o>) {
        destination.store::<L>(lines);
    }
}

/// The destination of some samples of a row.
pub(crate) enum RowOutput<'s, 'o> {
    /// Directly in the output.
    Here(&'s mut [[f32; 4]]),
    Staged(Staged<'s, 'o>),
}

/// Samples in the staging lines.
pub(crate) struct Staged<'s, 'o> {
    lines: &'s mut [CacheLine],
    /// The start and the end of these samples in the lines.
    start: usize,
    end: usize,
    /// The end of the staged rotations that are complete.
    made: usize,
    destination: &'s mut Destination<'o>,
}

impl RowOutput<'_, '_> {
    pub(crate) fn samples(&mut self) -> &mut [[f32; 4]] {
        match self {
            Self::Here(samples) => samples,
            Self::Staged(staged) => staged.samples(),
        }
    }
}

/// The functions of [`RowOutput`], matched once for a row instead of once for each run.
pub(crate) trait Samples {
    fn samples(&mut self) -> &mut [[f32; 4]];

    /// Evaluates `count` frames of a segment into the samples from `start` on; `first` is the
    /// distance of the first one from the segment's middle.
    #[inline(always)]
    fn frames<L: Lanes, S: Evaluate>(
        &mut self,
        segment: &S,
        affine: Affine,
        first: f32,
        start: usize,
        count: usize,
    ) {
        frames::<L, S>(segment, affine, first, count, &mut self.samples()[start..]);
    }

    /// Marks samples as final, so that their lines may be stored.
    #[inline(always)]
    fn made(&mut self, _: Range<usize>) {}
}

impl Samples for [[f32; 4]] {
    #[inline(always)]
    fn samples(&mut self) -> &mut [[f32; 4]] {
        self
    }
}

impl Samples for Staged<'_, '_> {
    #[inline(always)]
    fn samples(&mut self) -> &mut [[f32; 4]] {
        let stage: &mut [[f32; 4]] = bytemuck::cast_slice_mut(self.lines);
        &mut stage[self.start..self.end]
    }

    #[inline(always)]
    fn frames<L: Lanes, S: Evaluate>(
        &mut self,
        segment: &S,
        affine: Affine,
        first: f32,
        start: usize,
        count: usize,
    ) {
        let staged_start = self.start + start;
        let (line, end) = (staged_start / EACH, staged_start + count);
        let is_next = self.made == staged_start;
        if is_next && count > SAMPLES_ONE_BY_ONE && end / EACH < LINES {
            // The lines that were staged before these samples are stored first.
            self.destination.store::<L>(&self.lines[..line]);
            if self.destination.before.is_empty() {
                let streaming_lines = StreamingLines {
                    begun: (self.lines[line], staged_start % EACH),
                    whole: self.destination.next(end / EACH - line),
                    rest: &mut self.lines[end / EACH],
                };
                frames_past_caches::<L, S>(segment, affine, first, count, streaming_lines);
                self.made = end;
                return;
            }
        }
        frames::<L, S>(segment, affine, first, count, &mut self.samples()[start..]);
        if is_next {
            self.made = end;
        }
    }

    #[inline(always)]
    fn made(&mut self, samples: Range<usize>) {
        if self.start + samples.start <= self.made {
            self.made = self.made.max(self.start + samples.end);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use glam::Quat;
    use proptest::prelude::*;

    use super::*;

    /// Catches lines that are stored too early, at a wrong offset or not at all, and gaps between
    /// rows, for every alignment of the output.
    #[test]
    fn rows_come_to_their_places() {
        let run = |rows: Vec<(usize, usize)>, shift: usize, width| {
            let all: usize = rows.iter().map(|row| row.0).sum();
            let mut memory = vec![Quat::from_array([-1.0; 4]); shift + all + 9];
            let memory: &mut [[f32; 4]] = bytemuck::cast_slice_mut(&mut memory);
            let mut stage = Stage::with(width, true, &mut memory[shift..shift + all]);
            let mut next = 0.0;
            for (count, each) in rows {
                let row = stage.row(count, |samples, output| {
                    assert_eq!(output.samples().len(), samples.len());
                    for from in (0..samples.len()).step_by(each) {
                        let to = (from + each).min(samples.len());
                        for value in &mut output.samples()[from..to] {
                            *value = [next; 4];
                            next += 1.0;
                        }
                        // Not all samples are reported as made at once.
                        if let RowOutput::Staged(staged) = output
                            && from % 3 != 1
                        {
                            staged.made(from..to);
                        }
                    }
                    Ok::<(), Infallible>(())
                });
                let Ok(()) = row;
            }
            stage.finish();
            let expected = (0..all).map(|k| [k as f32; 4]);
            assert!(memory[shift..shift + all].iter().copied().eq(expected));
            let (before, after) = (&memory[..shift], &memory[shift + all..]);
            assert!(before.iter().chain(after).all(|rest| *rest == [-1.0; 4]));
        };
        let row = (1usize..5000, 1usize..99);
        let widths = proptest::sample::select(VectorWidth::available());
        let strategy = (proptest::collection::vec(row, 1..9), 0usize..8, widths);
        proptest!(|((rows, shift, width) in strategy)| run(rows, shift, width));
    }
}
