//! The samples of one track: its runs, evaluated one behind the other. Compiled as
//! one function for each vector width, so that nothing is called for a run.

use std::marker::PhantomData;

use super::evaluate::{Affine, Evaluate, FEW, are_exact, distances, frames, one};
use super::lanes::Lanes;
use crate::clock::{FramesError, Timeline};
use crate::cycle::Cycle;
use crate::numeric::round_f32;
use crate::prepare::PartRef;
use crate::schedule::{Distance, Emit, Run, RunSource};

/// Samples whose distances are found out together.
const CHUNK: usize = 64;

/// The samples of one part of a track in a cycle, into `output`, which
/// starts with the first of them.
#[inline(always)]
pub(super) fn row<L: Lanes, S: Evaluate>(
    PartRef { prepared, part }: PartRef<'_>,
    segments: &[S],
    timeline: &Timeline,
    cycle: &Cycle,
    output: &mut [[f32; 4]],
) -> Result<(), FramesError> {
    let first = cycle.samples.start;
    if cycle.samples.len() <= FEW {
        let mut row = ShortRow {
            part: PartRef { prepared, part },
            segments,
            timeline,
            first,
            output,
        };
        return prepared.runs(part, timeline, cycle, &mut row);
    }
    let mut row = Row::<L, S> {
        part: PartRef { prepared, part },
        segments,
        timeline,
        first,
        output,
        lanes: PhantomData,
    };
    if cycle.is_own() {
        return prepared.own_runs(part, timeline, cycle.samples.clone(), &mut row);
    }
    // What finds a copy's runs is compiled once, not for each width.
    let mut runs = Vec::new();
    prepared.runs(part, timeline, cycle, &mut |run| runs.push(run))?;
    for run in runs {
        row.run(run);
    }
    Ok(())
}

struct Row<'a, L, S> {
    part: PartRef<'a>,
    segments: &'a [S],
    timeline: &'a Timeline,
    /// The sample that `output` starts with.
    first: usize,
    output: &'a mut [[f32; 4]],
    lanes: PhantomData<L>,
}

impl<L: Lanes, S: Evaluate> Emit for Row<'_, L, S> {
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
                    frames::<L, S>(segment, affine, first, run.count, output);
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

/// A few samples, one by one: nothing is prepared for many.
struct ShortRow<'a, S> {
    part: PartRef<'a>,
    segments: &'a [S],
    timeline: &'a Timeline,
    /// The sample that `output` starts with.
    first: usize,
    output: &'a mut [[f32; 4]],
}

impl<S: Evaluate> Emit for ShortRow<'_, S> {
    #[inline(always)]
    fn run(&mut self, run: Run) {
        let prepared = self.part.prepared;
        let output = &mut self.output[run.sample - self.first..][..run.count];
        for (j, rotation) in output.iter_mut().enumerate() {
            *rotation = match run.source {
                RunSource::Constant(index) => prepared.constants[index as usize],
                RunSource::Segment {
                    index,
                    distance,
                    scale,
                    offset,
                } => {
                    let distance = self.part.distance(distance, self.timeline, &run, j);
                    let segment = &self.segments[index as usize];
                    one(segment, Affine { scale, offset }, distance)
                }
                RunSource::Exact { index, parameter } => {
                    let track = self.part.part.track as usize;
                    prepared.exact(index, parameter, self.timeline, track, run.sample + j)
                }
            };
        }
    }
}
