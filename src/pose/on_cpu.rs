//! Passes over poses on the CPU, in tasks for all threads.

use rayon::prelude::*;

use crate::shader::Link;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::twin::pose_world;

/// Values in one task.
const TASK: usize = 8192;

/// Turns frames of local rotations into rotations and positions in the world.
pub(crate) fn world(local: &[[f32; 4]], links: &[Link], output: &mut [[f32; 4]]) {
    let tracks = links.len();
    let frames = output
        .par_chunks_mut(2 * tracks)
        .zip(local.par_chunks(tracks));
    frames.for_each(|(world, local)| pose_world::pose(local, links, world));
}

struct Task<'a, F> {
    first: usize,
    output: &'a mut [[f32; 4]],
    pose: &'a F,
}

impl<F: Fn(usize) -> [f32; 4]> InLanes for Task<'_, F> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        for (i, value) in self.output.iter_mut().enumerate() {
            *value = (self.pose)(self.first + i);
        }
    }
}

/// Sets the values at all places.
pub(crate) fn for_each(output: &mut [[f32; 4]], pose: impl Fn(usize) -> [f32; 4] + Sync) {
    let tasks = output.par_chunks_mut(TASK).enumerate();
    tasks.for_each(|(task, output)| {
        in_lanes(&mut Task {
            first: task * TASK,
            output,
            pose: &pose,
        });
    });
}
