//! The samples of one track: its runs, evaluated one behind the other. Compiled as
//! one function for each vector width, so that nothing is called for a run.

use super::evaluate::{Affine, CHUNK, Evaluate, FEW, Room, distances, frames, one};
use crate::clock::{FramesError, Timeline};
use crate::cycle::Cycle;
use crate::numeric::round_f32;
use crate::prepare::PartRef;
use crate::schedule::{Distance, Emit, Run, RunSource};

/// The samples of one part of a track in a cycle, into `output`, which
/// starts with the first of them.
#[inline(always)]
pub(super) fn row<S: Evaluate>(
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
    let mut row = Row {
        part: PartRef { prepared, part },
        segments,
        timeline,
        first,
        output,
        // Its own, and not borrowed: the compiler must see that it is not the output.
        room: S::Room::new(),
    };
    prepared.runs(part, timeline, cycle, &mut row)
}

struct Row<'a, S: Evaluate> {
    part: PartRef<'a>,
    segments: &'a [S],
    timeline: &'a Timeline,
    /// The sample that `output` starts with.
    first: usize,
    output: &'a mut [[f32; 4]],
    room: S::Room,
}

impl<S: Evaluate> Emit for Row<'_, S> {
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
                distance: Distance::Frames { first },
                scale,
                offset,
            } => {
                let segment = &self.segments[index as usize];
                let affine = Affine { scale, offset };
                frames(segment, affine, first, run.count, &mut self.room, output);
            }
            RunSource::Segment {
                index,
                distance: Distance::Seconds { middle },
                scale,
                offset,
            } => {
                let segment = &self.segments[index as usize];
                let affine = Affine { scale, offset };
                let mut from_middle = [0.0; CHUNK];
                for start in (0..run.count).step_by(CHUNK) {
                    let count = (run.count - start).min(CHUNK);
                    let from_middle = &mut from_middle[..count];
                    for (j, distance) in from_middle.iter_mut().enumerate() {
                        let sample = run.sample + start + j;
                        let time = self.timeline.time(self.part.part.track as usize, sample);
                        *distance = round_f32(time - middle);
                    }
                    let output = &mut output[start..];
                    distances(segment, affine, from_middle, &mut self.room, output);
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
        let PartRef { prepared, part } = self.part;
        let output = &mut self.output[run.sample - self.first..][..run.count];
        for (sample, rotation) in (run.sample..).zip(output) {
            *rotation = match run.source {
                RunSource::Constant(index) => prepared.constants[index as usize],
                RunSource::Segment {
                    index,
                    distance,
                    scale,
                    offset,
                } => {
                    let distance = match distance {
                        Distance::Frames { first } => {
                            first.wrapping_add((sample - run.sample) as i32) as f32
                        }
                        Distance::Seconds { middle } => {
                            round_f32(self.timeline.time(part.track as usize, sample) - middle)
                        }
                    };
                    one(
                        &self.segments[index as usize],
                        Affine { scale, offset },
                        distance,
                    )
                }
                RunSource::Exact { index, parameter } => {
                    prepared.exact(index, parameter, self.timeline, part.track as usize, sample)
                }
            };
        }
    }
}
