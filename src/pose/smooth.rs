//! Smoothing of evaluated rotations and vectors, on the engine's device.

use glam::Quat;
use rayon::prelude::*;

use crate::engine::Engine;
use crate::error::Error;
use crate::gpu::engine::VulkanEngine;
use crate::memory::zeroed;
use crate::output::buffer::OutputBuffer;
use crate::output::rotations::{Rotations, Samples, Vectors};
use crate::shader::{Kernel, PoseDispatch};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::smooth::kernel::{Smoothing, SmoothingEnds};
use crate::smooth::rows::{padded, set_ends, turned_far};
use crate::twin::{pose_smooth, pose_steps};

impl Engine {
    /// Smooths the rotations of every track over its samples, which are to be evenly spaced:
    /// `q' = q exp(Σ b_m (d_{i+m} - d_{i-1-m}))` with the steps `d` between neighbours (Lee and Shin
    /// 2002). A track that stands still keeps its bits, even motion stays, and a rotation of all
    /// samples from either side turns the result.
    ///
    /// ```
    /// use glam::Quat;
    /// use tumble::{Device, Engine, Frames, Smoothing, SmoothingKernel, TrackSet, method};
    /// let mut set = TrackSet::new();
    /// let keys = [0.0, 0.2, -0.1, 0.3, 0.0].map(Quat::from_rotation_z);
    /// set.push("noise", &[0.0, 1.0, 2.0, 3.0, 4.0], &keys)?;
    /// let engine = Engine::new(Device::Cpu)?;
    /// let samples = engine.evaluate(&set, method::STEP, &Frames::fps(1))?;
    /// let smooth = engine.smooth(&samples, &Smoothing::new(SmoothingKernel::Linear))?;
    /// // ¼ 0.2 - ½ 0.1 + ¼ 0.3
    /// let expected = Quat::from_rotation_z(0.075);
    /// assert!(smooth.get(0, 2).unwrap().angle_between(expected) < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When the kernel means nothing, or the device fails.
    pub fn smooth(&self, rotations: &Rotations, smoothing: &Smoothing) -> Result<Rotations, Error> {
        self.smoothed(rotations, smoothing, true)
    }

    /// Smooths vectors; otherwise as [`Engine::smooth`].
    ///
    /// # Errors
    /// As there.
    pub fn smooth_vectors(
        &self,
        vectors: &Vectors,
        smoothing: &Smoothing,
    ) -> Result<Vectors, Error> {
        self.smoothed(vectors, smoothing, false)
    }

    fn smoothed<T>(
        &self,
        values: &Samples<T>,
        smoothing: &Smoothing,
        are_rotations: bool,
    ) -> Result<Samples<T>, Error> {
        let (tracks, samples) = (values.tracks(), values.samples());
        let weights = smoothing.step_weights(samples)?;
        let count = tracks * samples; // of which there are as many values
        let mut rows: Vec<[f32; 4]> = zeroed(count, "samples to smooth")?;
        let mut next: Vec<[f32; 4]> = zeroed(count, "smoothed samples")?;
        for (place, row) in rows.iter_mut().enumerate() {
            let (track, sample) = (place / samples.max(1), place % samples.max(1));
            let from = values.layout().place(track, sample, tracks, samples);
            *row = values.as_arrays()[from];
        }
        let passes = if samples > 1 { smoothing.passes } else { 0 };
        for _ in 0..passes {
            self.on_device(|device| {
                let each = rows.par_chunks(samples).zip(next.par_chunks_mut(samples));
                let pass = Pass {
                    smoothing,
                    weights: &weights,
                    are_rotations,
                };
                match device {
                    None => each.for_each(|(values, output)| pass.on_cpu(values, output)),
                    Some(device) => {
                        for (values, output) in rows.chunks(samples).zip(next.chunks_mut(samples)) {
                            pass.on(device, values, output)?;
                        }
                    }
                }
                Ok(())
            })?;
            std::mem::swap(&mut rows, &mut next);
        }
        let mut output = OutputBuffer::new(count)?;
        for (place, row) in rows.iter().enumerate() {
            let (track, sample) = (place / samples.max(1), place % samples.max(1));
            let to = values.layout().place(track, sample, tracks, samples);
            output[to] = Quat::from_array(*row);
        }
        let layout = values.layout();
        Ok(Samples::new(Box::new(output), tracks, samples, layout))
    }
}

/// One pass over the samples of a track.
struct Pass<'a> {
    smoothing: &'a Smoothing,
    weights: &'a [f32],
    are_rotations: bool,
}

impl Pass<'_> {
    /// The steps of a row, with those beyond its ends.
    fn padded(&self, steps: &[[f32; 4]]) -> Vec<[f32; 4]> {
        let radius = self.weights.len();
        let mut all = vec![[0.0; 4]; steps.len() + 2 * radius];
        let is_loop = self.smoothing.ends == SmoothingEnds::Loop;
        padded(steps, radius, is_loop, &mut all);
        all
    }

    /// What the host does after either device.
    fn finish(
        &self,
        values: &[[f32; 4]],
        steps: &[[f32; 4]],
        all: &[[f32; 4]],
        output: &mut [[f32; 4]],
    ) {
        if self.are_rotations {
            turned_far(values, all, self.weights, output);
        }
        set_ends(self.smoothing, values, steps, self.are_rotations, output);
    }

    fn on_cpu(&self, values: &[[f32; 4]], output: &mut [[f32; 4]]) {
        let mut steps = vec![[0.0; 4]; values.len() - 1];
        in_lanes(&mut Steps(values, &mut steps, self.are_rotations));
        let all = self.padded(&steps);
        in_lanes(&mut Sums(self, values, &all, output));
        self.finish(values, &steps, &all, output);
    }

    fn on(
        &self,
        device: &VulkanEngine,
        values: &[[f32; 4]],
        output: &mut [[f32; 4]],
    ) -> Result<(), Error> {
        let limit = device.pass_limit().max(2);
        let are_rotations = u32::from(self.are_rotations);
        let dispatch = |count: usize, detail: u32| PoseDispatch {
            count: count as u32,
            detail,
        };
        let mut steps = vec![[0.0; 4]; values.len() - 1];
        for (first, output) in (0..).step_by(limit - 1).zip(steps.chunks_mut(limit - 1)) {
            let inputs: [&[u8]; 1] = [bytemuck::cast_slice(&values[first..=first + output.len()])];
            let pass = dispatch(output.len(), are_rotations);
            device.pass(
                Kernel::PosesSteps,
                &inputs,
                pass,
                bytemuck::cast_slice_mut(output),
            )?;
        }
        let all = self.padded(&steps);
        let radius = self.weights.len();
        let detail = 2 * radius as u32 + are_rotations;
        let block = limit.saturating_sub(2 * radius).max(1);
        for (first, output) in (0..).step_by(block).zip(output.chunks_mut(block)) {
            let own = &all[first..first + output.len() + 2 * radius - 1];
            let inputs: [&[u8]; 3] = [
                bytemuck::cast_slice(&values[first..first + output.len()]),
                bytemuck::cast_slice(own),
                bytemuck::cast_slice(self.weights),
            ];
            let pass = dispatch(output.len(), detail);
            device.pass(
                Kernel::PosesSmooth,
                &inputs,
                pass,
                bytemuck::cast_slice_mut(output),
            )?;
        }
        self.finish(values, &steps, &all, output);
        Ok(())
    }
}

struct Steps<'a>(&'a [[f32; 4]], &'a mut [[f32; 4]], bool);

impl InLanes for Steps<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let Self(values, steps, are_rotations) = self;
        for (step, pair) in steps.iter_mut().zip(values.windows(2)) {
            *step = pose_steps::pose(pair[0], pair[1], *are_rotations);
        }
    }
}

/// Samples whose sums are built together, so that each weight is applied to all of them in vectors.
const BLOCK: usize = 64;

struct Sums<'a>(
    &'a Pass<'a>,
    &'a [[f32; 4]],
    &'a [[f32; 4]],
    &'a mut [[f32; 4]],
);

impl InLanes for Sums<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let Self(pass, values, steps, output) = self;
        for (block, output) in output.chunks_mut(BLOCK).enumerate() {
            let first = block * BLOCK;
            let mut sums = [[0.0f32; 4]; BLOCK];
            for m in 0..pass.weights.len() {
                for (i, sum) in sums[..output.len()].iter_mut().enumerate() {
                    pose_smooth::add(sum, steps, pass.weights, first + i, m);
                }
            }
            for (i, (own, sum)) in output.iter_mut().zip(sums).enumerate() {
                *own = pose_smooth::moved(values[first + i], sum, pass.are_rotations);
            }
        }
    }
}
