//! The samples of one part of a track: their runs are evaluated as they are found.

use bytemuck::Zeroable as _;
use glam::Vec4;

use crate::cpu::evaluate::SAMPLES_ONE_BY_ONE;
use crate::cpu::segment_list::SegmentList;
use crate::cpu::streaming::{RowOutput, Samples};
use crate::prepare::clip_data::PartRef;
use crate::simd::dispatch::{InLanesInto, VectorWidth, in_lanes_into};
use crate::simd::lanes::Lanes;
use crate::time::error::SampleTimesError;
use crate::time::frame_clock::{FrameClock, TrackCopy};
use crate::time::frames::{Ticks, Timeline};
use crate::time::runs::{
    Distance, Emit, IntervalBlock, IntervalBlocks, NONE, Parameter, Run, RunSource,
};
use crate::time::spans::SpanSource;

/// The number of samples whose distances are computed together.
const CHUNK: usize = 64;

/// The samples of one part of a track, within one track copy.
pub(crate) struct Row<'a> {
    pub(crate) part: PartRef<'a>,
    pub(crate) timeline: &'a Timeline,
    pub(crate) copy: &'a TrackCopy,
    pub(crate) width: VectorWidth,
}

impl Row<'_> {
    /// Evaluates the samples into `output`, which starts at the first sample of the track copy.
    pub(crate) fn evaluate<I: SegmentList + ?Sized>(
        &self,
        segments: &I,
        output: &mut RowOutput<'_, '_>,
    ) -> Result<(), SampleTimesError> {
        match output {
            output if cfg!(smallest) => self.one_by_one(segments, output.samples()),
            RowOutput::Here(samples) => in_lanes_into(self.width, self, segments, *samples),
            RowOutput::Staged(staged) => in_lanes_into(self.width, self, segments, staged),
        }
    }
}

impl<I: SegmentList + ?Sized, O: Samples + ?Sized> InLanesInto<I, O> for Row<'_> {
    type Outcome = Result<(), SampleTimesError>;

    #[inline(always)]
    fn run<L: Lanes>(&self, segments: &I, output: &mut O) -> Result<(), SampleTimesError> {
        let PartRef { prepared, part } = self.part;
        if self.copy.samples.len() <= SAMPLES_ONE_BY_ONE {
            return self.one_by_one(segments, output.samples());
        }
        if let (&Ticks::Frames { rate, start }, true) = (&self.timeline.ticks, self.copy.is_track())
        {
            let clock = FrameClock::new(rate, start, prepared.spans.steps);
            if self.spans::<L, I, O>(clock, segments, output) {
                let runs = (prepared.spans).runs_outside(part, clock, &self.copy.samples);
                let mut outside = OneByOne {
                    row: self,
                    segments,
                    output: output.samples(),
                };
                runs.into_iter().flatten().for_each(|run| outside.run(run));
                return Ok(());
            }
        }
        self.runs(segments, output.samples())
    }
}

impl Row<'_> {
    /// Evaluates the frames between the keys of the track itself (not of a repeated copy), without a list of runs.
    /// Nearly all samples are such frames. Returns false if a distance from a segment's middle is not an integer that
    /// f32 has; then the caller evaluates all samples by runs.
    #[inline(always)]
    fn spans<L: Lanes, I: SegmentList + ?Sized, O: Samples + ?Sized>(
        &self,
        clock: FrameClock,
        segments: &I,
        output: &mut O,
    ) -> bool {
        let PartRef { prepared, part } = self.part;
        let samples = &self.copy.samples;
        let spans = &prepared.spans;
        let starts = &spans.starts[part.spans.clone()];
        let mut intervals = IntervalBlocks::new(starts, part.end, clock, samples.clone());
        let mut block = IntervalBlock::zeroed();
        while let Some(filled) = intervals.fill(&mut block) {
            if !block.are_near {
                return false;
            }
            let range = part.spans.start + filled.start..part.spans.start + filled.end;
            let (sources, keys) = (&spans.sources[range.clone()], &spans.keys[range]);
            for j in block.occupied {
                let (source, key) = (sources[j], keys[j]);
                let (first, last) = (block.first[j], block.first[j + 1]);
                let (mut start, mut count) = (first - samples.start, last - first);
                let mut distance = block.distance[j];
                if key != NONE && block.is_held[j] == 1 {
                    output.samples()[start] = prepared.constants[key as usize];
                    output.made(start..start + 1);
                    (start, count) = (start + 1, count - 1);
                    distance += 1.0;
                }
                match source.source() {
                    SpanSource::Segment(index) => {
                        let affine = block.affine(j);
                        segments.frames::<L, O>(index, affine, distance, start, count, output);
                    }
                    SpanSource::Constant(index) => {
                        let constant = prepared.constants[index as usize];
                        output.samples()[start..][..count].fill(constant);
                        output.made(start..start + count);
                    }
                    SpanSource::Exact(index) => {
                        let parameter = block.parameter(j, clock);
                        let values = &mut output.samples()[start..][..count];
                        self.exact(last - count, index, parameter, values);
                        output.made(start..start + count);
                    }
                }
            }
        }
        true
    }

    /// Evaluates at most [`SAMPLES_ONE_BY_ONE`] samples, one by one.
    #[inline(never)]
    fn one_by_one<I: SegmentList + ?Sized>(
        &self,
        segments: &I,
        output: &mut [[f32; 4]],
    ) -> Result<(), SampleTimesError> {
        let PartRef { prepared, part } = self.part;
        let mut samples = OneByOne {
            row: self,
            segments,
            output,
        };
        (prepared.spans).runs(part, self.timeline, self.copy, &mut samples)
    }

    /// Evaluates all samples by a list of their runs. This is a separate function to keep the usual path small, and
    /// to compile the search for runs only once instead of for each vector width.
    #[inline(never)]
    fn runs<I: SegmentList + ?Sized>(
        &self,
        segments: &I,
        output: &mut [[f32; 4]],
    ) -> Result<(), SampleTimesError> {
        let PartRef { prepared, part } = self.part;
        let mut runs = Vec::new();
        (prepared.spans).runs(part, self.timeline, self.copy, &mut runs)?;
        in_lanes_into(self.width, &RunList { row: self, runs }, segments, output);
        Ok(())
    }

    /// Evaluates a run; `output` starts at the first sample of the track copy.
    #[inline(always)]
    fn evaluate_run<L: Lanes, I: SegmentList + ?Sized>(
        &self,
        run: &Run,
        segments: &I,
        output: &mut [[f32; 4]],
    ) {
        let PartRef { prepared, part } = self.part;
        let output = &mut output[run.sample - self.copy.samples.start..][..run.count];
        match run.source {
            RunSource::Constant(index) => output.fill(prepared.constants[index as usize]),
            RunSource::Segment(index, distance, affine) => {
                if let Distance::Near { first } = distance {
                    return segments.frames::<L, _>(index, affine, first, 0, run.count, output);
                }
                let mut from_middle = [0.0; CHUNK];
                for (chunk, output) in output.chunks_mut(CHUNK).enumerate() {
                    let count = output.len();
                    for (j, value) in (chunk * CHUNK..).zip(&mut from_middle[..count]) {
                        let time = || self.timeline.time_at(part.track as usize, run.sample + j);
                        *value = distance.at_sample(j, time);
                    }
                    segments.distances::<L>(index, affine, &from_middle, output);
                }
            }
            RunSource::Exact { index, parameter } => {
                self.exact(run.sample, index, parameter, output);
            }
        }
    }

    /// Evaluates samples from `first` on in f64.
    #[inline(never)]
    fn exact(&self, first: usize, index: u32, parameter: Parameter, output: &mut [[f32; 4]]) {
        let PartRef { prepared, part } = self.part;
        let track = part.track as usize;
        for (sample, rotation) in (first..).zip(output) {
            *rotation = prepared.exact(index, parameter, self.timeline, track, sample);
        }
    }
}

/// Runs of a row, to be evaluated in vectors.
struct RunList<'a, 'r> {
    row: &'a Row<'r>,
    runs: Vec<Run>,
}

impl<I: SegmentList + ?Sized> InLanesInto<I, [[f32; 4]]> for RunList<'_, '_> {
    type Outcome = ();

    #[inline(always)]
    fn run<L: Lanes>(&self, segments: &I, output: &mut [[f32; 4]]) {
        for run in &self.runs {
            self.row.evaluate_run::<L, I>(run, segments, output);
        }
    }
}

/// Evaluates runs as they are found, for few samples, and for samples outside the keys.
struct OneByOne<'a, 'r, I: ?Sized> {
    row: &'a Row<'r>,
    segments: &'a I,
    output: &'a mut [[f32; 4]],
}

impl<I: SegmentList + ?Sized> Emit for OneByOne<'_, '_, I> {
    // Not inlined, because it has many callers.
    #[inline(never)]
    fn run(&mut self, run: Run) {
        (self.row).evaluate_run::<Vec4, I>(&run, self.segments, self.output);
    }
}
