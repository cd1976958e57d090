//! The samples of one track: its runs, evaluated one behind the other. Compiled as
//! one function for each vector width, so that nothing is called for a run.

use std::marker::PhantomData;
use std::ops::Range;

use crate::cpu::evaluate::{Affine, Evaluate, FEW, are_exact, distances, frames, one};
use crate::cpu::streaming::{Output, Samples};
use crate::math::canonical::round_f32;
use crate::prepare::clip_data::PartRef;
use crate::prepare::{NONE, Source};
use crate::simd::dispatch::{InLanesInto, VectorWidth, in_lanes_into};
use crate::simd::lanes::Lanes;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::{FramesError, Ticks, Timeline};
use crate::time::interval_block::{SpanBlock, SpanBlocks};
use crate::time::runs::{Distance, Emit, Run, RunSource, runs_after, runs_before};
use crate::time::wrap::Cycle;

/// Samples whose distances are found out together.
const CHUNK: usize = 64;

/// The samples of one part of a track in a cycle.
pub(crate) struct Row<'a, S> {
    pub(crate) part: PartRef<'a>,
    pub(crate) segments: &'a [S],
    pub(crate) timeline: &'a Timeline,
    pub(crate) cycle: &'a Cycle,
}

impl<S: Evaluate> Row<'_, S> {
    /// Evaluates them into `output`, which starts with the first of them.
    pub(crate) fn evaluate(
        &self,
        width: VectorWidth,
        output: &mut Output<'_, '_>,
    ) -> Result<(), FramesError> {
        match output {
            Output::Here(samples) => in_lanes_into(width, self, *samples),
            Output::Staged(staged) => in_lanes_into(width, self, staged),
        }
    }
}

impl<S: Evaluate, O: Samples + ?Sized> InLanesInto<O> for Row<'_, S> {
    type Outcome = Result<(), FramesError>;

    #[inline(always)]
    fn run<L: Lanes>(&self, output: &mut O) -> Result<(), FramesError> {
        let &Self {
            part,
            segments,
            timeline,
            cycle,
        } = self;
        row::<L, S, O>(part, segments, timeline, cycle, output)
    }
}

#[inline(always)]
fn row<L: Lanes, S: Evaluate, O: Samples + ?Sized>(
    part: PartRef<'_>,
    segments: &[S],
    timeline: &Timeline,
    cycle: &Cycle,
    output: &mut O,
) -> Result<(), FramesError> {
    let first = cycle.samples.start;
    let is_short = cycle.samples.len() <= FEW;
    if let Ticks::Frames { rate, start } = &timeline.ticks
        && cycle.is_own()
        && !is_short
    {
        let clock = FrameClock::new(*rate, *start, part.part.end);
        let samples = cycle.samples.clone();
        if spans::<L, S, O>(part, segments, timeline, clock, &samples, output) {
            let mut outside = OneByOne {
                part,
                segments,
                timeline,
                first,
                output: output.samples(),
            };
            let PartRef { prepared, part } = part;
            runs_before(prepared, part, clock, &samples, &mut outside);
            runs_after(part, clock, &samples, &mut outside);
            return Ok(());
        }
    }
    if is_short {
        let mut row = OneByOne {
            part,
            segments,
            timeline,
            first,
            output: output.samples(),
        };
        return part.prepared.runs(part.part, timeline, cycle, &mut row);
    }
    let mut row = Runs::<L, S> {
        part,
        segments,
        timeline,
        first,
        output: output.samples(),
        lanes: PhantomData,
    };
    // What finds them is compiled once, not for each width.
    let mut runs = Vec::new();
    (part.prepared).runs(part.part, timeline, cycle, &mut |run| runs.push(run))?;
    for run in runs {
        row.run(run);
    }
    Ok(())
}

/// The samples between a track's keys, where frames are its own: without a list of runs.
/// Whether all are near enough for that.
#[inline(always)]
fn spans<L: Lanes, S: Evaluate, O: Samples + ?Sized>(
    PartRef { prepared, part }: PartRef<'_>,
    segments: &[S],
    timeline: &Timeline,
    clock: FrameClock,
    samples: &Range<usize>,
    output: &mut O,
) -> bool {
    let mut spans = SpanBlocks::new(prepared, part, clock, samples.clone());
    let mut block = SpanBlock::new();
    while let Some(own) = spans.fill(&mut block) {
        if !block.are_near {
            return false;
        }
        let sources = &prepared.spans.sources[own.clone()];
        let keys = &prepared.spans.keys[own];
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
            match source {
                Source::Segment(index) => {
                    let affine = Affine {
                        scale: block.scale[j],
                        offset: block.offset[j],
                    };
                    let segment = &segments[index as usize];
                    output.frames::<L, S>(segment, affine, distance, start, count);
                }
                Source::Constant(index) => {
                    output.samples()[start..][..count].fill(prepared.constants[index as usize]);
                    output.made(start..start + count);
                }
                Source::Exact(index) => {
                    let (parameter, track) = (block.parameter(j), part.track as usize);
                    let to = &mut output.samples()[start..];
                    for (sample, rotation) in (last - count..last).zip(to) {
                        *rotation = prepared.exact(index, parameter, timeline, track, sample);
                    }
                    output.made(start..start + count);
                }
            }
        }
    }
    true
}

struct Runs<'a, L, S> {
    part: PartRef<'a>,
    segments: &'a [S],
    timeline: &'a Timeline,
    /// The sample that `output` starts with.
    first: usize,
    output: &'a mut [[f32; 4]],
    lanes: PhantomData<L>,
}

impl<L: Lanes, S: Evaluate> Runs<'_, L, S> {
    #[inline(always)]
    fn run(&mut self, run: Run) {
        let prepared = self.part.prepared;
        let output = &mut self.output[run.sample - self.first..];
        match run.source {
            RunSource::Constant(index) => {
                output[..run.count].fill(prepared.constants[index as usize]);
            }
            RunSource::Segment {
                index,
                distance,
                scale,
                offset,
            } => {
                let segment = &self.segments[index as usize];
                let affine = Affine { scale, offset };
                if let Distance::Frames { first } = distance
                    && are_exact(first, run.count)
                {
                    frames::<L, S>(segment, affine, first as f32, run.count, output);
                    return;
                }
                let mut from_middle = [0.0; CHUNK];
                for start in (0..run.count).step_by(CHUNK) {
                    let count = (run.count - start).min(CHUNK);
                    for (j, own) in from_middle[..count].iter_mut().enumerate() {
                        *own = self.part.distance(distance, self.timeline, &run, start + j);
                    }
                    let output = &mut output[start..];
                    distances::<L, S>(segment, affine, &from_middle, count, output);
                }
            }
            RunSource::Exact { index, parameter } => {
                let track = self.part.part.track as usize;
                for (sample, rotation) in (run.sample..).zip(&mut output[..run.count]) {
                    *rotation = prepared.exact(index, parameter, self.timeline, track, sample);
                }
            }
        }
    }
}

impl PartRef<'_> {
    /// From the middle of its segment to the run's `j`th sample.
    #[inline(always)]
    fn distance(self, distance: Distance, timeline: &Timeline, run: &Run, j: usize) -> f32 {
        match distance {
            // An integer converts with one rounding, like the shader's sum of two exact
            // halves.
            Distance::Frames { first } => first.wrapping_add(j as i32) as f32,
            Distance::Seconds { middle } => {
                let time = timeline.time(self.part.track as usize, run.sample + j);
                round_f32(time - middle)
            }
        }
    }
}

/// Samples one by one, where they are few, or outside the keys: nothing is prepared for many.
struct OneByOne<'a, S> {
    part: PartRef<'a>,
    segments: &'a [S],
    timeline: &'a Timeline,
    /// The sample that `output` starts with.
    first: usize,
    output: &'a mut [[f32; 4]],
}

impl<S: Evaluate> Emit for OneByOne<'_, S> {
    #[inline(always)]
    fn run(&mut self, run: Run) {
        let prepared = self.part.prepared;
        let output = &mut self.output[run.sample - self.first..][..run.count];
        match run.source {
            RunSource::Constant(index) => output.fill(prepared.constants[index as usize]),
            RunSource::Segment {
                index,
                distance,
                scale,
                offset,
            } => {
                let segment = &self.segments[index as usize];
                for (j, rotation) in output.iter_mut().enumerate() {
                    let distance = self.part.distance(distance, self.timeline, &run, j);
                    *rotation = one(segment, Affine { scale, offset }, distance);
                }
            }
            RunSource::Exact { index, parameter } => {
                let track = self.part.part.track as usize;
                for (sample, rotation) in (run.sample..).zip(output) {
                    *rotation = prepared.exact(index, parameter, self.timeline, track, sample);
                }
            }
        }
    }
}
