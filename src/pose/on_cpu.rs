//! Passes over poses on the CPU, in tasks for all threads.

use rayon::prelude::*;

use crate::shader::Link;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::twin::{pose_add, pose_blend, pose_mix, pose_world};

/// Values in one task.
const TASK: usize = 8192;

/// Blends layers, which lie one after another, into one.
pub(crate) fn blend(layers: &[[f32; 4]], weights: &[f32], output: &mut [[f32; 4]]) {
    let count = output.len();
    for_each(output, |place| {
        pose_blend::pose(layers, weights, count, place)
    });
}

/// Mixes two layers by slerp.
pub(crate) fn mix(from: &[[f32; 4]], to: &[[f32; 4]], weight: f32, output: &mut [[f32; 4]]) {
    for_each(output, |place| {
        pose_mix::pose(from[place], to[place], weight)
    });
}

/// Adds a layer to a base: `base · (reference⁻¹ layer)^weight`.
pub(crate) fn add(
    base: &[[f32; 4]],
    layer: &[[f32; 4]],
    reference: &[[f32; 4]],
    weight: f32,
    output: &mut [[f32; 4]],
) {
    for_each(output, |place| {
        pose_add::pose(base[place], layer[place], reference[place], weight)
    });
}

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

fn for_each(output: &mut [[f32; 4]], pose: impl Fn(usize) -> [f32; 4] + Sync) {
    let tasks = output.par_chunks_mut(TASK).enumerate();
    tasks.for_each(|(task, output)| {
        in_lanes(&mut Task {
            first: task * TASK,
            output,
            pose: &pose,
        });
    });
}
