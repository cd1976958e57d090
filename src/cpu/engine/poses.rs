//! Passes over poses on the CPU.

use rayon::prelude::*;

use crate::cpu::engine::CpuEngine;
use crate::machine::Machine;
use crate::machine::error::EvaluateError;
use crate::machine::poses::{Pass, PassRunner, SampleRows};
use crate::output::rotations::Layout;
use crate::simd::dispatch::{InLanes, VectorWidth, in_lanes_of};
use crate::simd::lanes::Lanes;
use crate::smooth::rows::{SmoothingBlock, SmoothingPass};
use crate::threads::{OutOfThreadsError, Threads};
use crate::twin::{pose_add, pose_blend, pose_mix, pose_world};

/// The number of values of one pass: enough for all threads, and gathered in 16 MiB.
const WINDOW: usize = 1 << 20;

/// The number of values in one task.
const TASK: usize = 8192;

/// The number of samples of each track that a thread smooths at once, for a kernel that is not wider. Their steps
/// stay in the caches.
const BLOCK: usize = 1024;

impl PassRunner for CpuEngine {
    fn window(&self) -> usize {
        WINDOW
    }

    fn run(&self, pass: &Pass<'_>, output: &mut [[f32; 4]]) -> Result<(), EvaluateError> {
        let count = output.len();
        Ok(match *pass {
            Pass::Blend { layers, weights } => {
                let blended = |index| pose_blend::pose(layers, weights, count, index);
                set_all(self.threads(), self.width, output, blended)
            }
            Pass::Mix { from, to, weight } => {
                let mixed = |index: usize| pose_mix::pose(from[index], to[index], weight);
                set_all(self.threads(), self.width, output, mixed)
            }
            Pass::Add {
                base,
                layer,
                references,
            } => {
                let [weight, ..] = references[count];
                let added = |i: usize| pose_add::pose(base[i], layer[i], references[i], weight);
                set_all(self.threads(), self.width, output, added)
            }
            Pass::World { local, links } => self.on_threads(|| {
                let frames = output.par_chunks_mut(2 * links.len());
                let frames = frames.zip(local.par_chunks(links.len()));
                frames.for_each(|(world, local)| pose_world::pose(local, links, world));
            }),
        }?)
    }

    fn smooth(
        &self,
        rows: &SampleRows<'_>,
        pass: &SmoothingPass<'_>,
        output: &mut [[f32; 4]],
    ) -> Result<(), EvaluateError> {
        let length = BLOCK.max(4 * pass.weights.len());
        let block =
            |steps: &mut _, output: &mut [[f32; 4]], track: usize, output_start, i: usize| {
                let row = rows.row(track);
                let mut block = SmoothingBlock {
                    pass: *pass,
                    row,
                    first: i * length,
                    steps,
                    count: output.len() / row.stride,
                    output,
                    output_start,
                };
                in_lanes_of(self.width, &mut block);
            };
        Ok(self.on_threads(|| match rows.layout {
            Layout::TrackMajor => {
                let all = output.par_chunks_mut(rows.samples).enumerate();
                all.for_each(|(track, row)| {
                    let blocks = row.par_chunks_mut(length).enumerate();
                    blocks.for_each_init(Default::default, |steps, (i, output)| {
                        block(steps, output, track, 0, i);
                    });
                });
            }
            Layout::FrameMajor => {
                let blocks = output.par_chunks_mut(length * rows.tracks).enumerate();
                blocks.for_each_init(Default::default, |steps, (i, output)| {
                    for track in 0..rows.tracks {
                        block(steps, output, track, track, i);
                    }
                });
            }
        })?)
    }
}

struct PoseTask<'a, F> {
    first: usize,
    output: &'a mut [[f32; 4]],
    pose: &'a F,
}

impl<F: Fn(usize) -> [f32; 4]> InLanes for PoseTask<'_, F> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        for (i, value) in self.output.iter_mut().enumerate() {
            *value = (self.pose)(self.first + i);
        }
    }
}

/// Sets all values, on threads.
pub(crate) fn set_all(
    threads: &Threads,
    width: VectorWidth,
    output: &mut [[f32; 4]],
    pose: impl Fn(usize) -> [f32; 4] + Sync,
) -> Result<(), OutOfThreadsError> {
    let task = |(task, output): (usize, &mut [[f32; 4]])| {
        let mut task = PoseTask {
            first: task * TASK,
            output,
            pose: &pose,
        };
        in_lanes_of(width, &mut task);
    };
    if output.len() <= TASK {
        task((0, output));
        return Ok(());
    }
    threads.run(|| output.par_chunks_mut(TASK).enumerate().for_each(task))
}
