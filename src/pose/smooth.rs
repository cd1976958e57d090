//! Smoothing of evaluated rotations and vectors, on the engine's device.

use rayon::prelude::*;

use crate::engine::Engine;
use crate::error::Error;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::VulkanError;
use crate::output::buffer::OutputBuffer;
use crate::output::rotations::{Layout, Rotations, Samples, Vectors};
use crate::pose::poses::bytes;
use crate::shader::Kernel;
use crate::simd::dispatch::in_lanes;
use crate::smooth::kernel::Smoothing;
use crate::smooth::rows::{SampleRow, SmoothingBlock, SmoothingPass};
use crate::threads::on_threads;

impl Engine {
    /// Smooths the rotations of every track over its samples, which must be evenly spaced in time: `q' = q exp(Σ b_m
    /// (d_{i+m} - d_{i-1-m}))` with the steps `d` between neighbours (Lee and Shin 2002).
    ///
    /// A track that stands still keeps its bits, and motion with constant velocity does not change. If all samples
    /// are multiplied by a rotation, from either side, the result is multiplied by it too.
    ///
    /// ```
    /// use glam::Quat;
    /// use tumble::{Device, Engine, SampleTimes, Smoothing, SmoothingKernel, TrackSet, method};
    /// let mut set = TrackSet::new();
    /// let keys = [0.0, 0.2, -0.1, 0.3, 0.0].map(Quat::from_rotation_z);
    /// set.push("noise", &[0.0, 1.0, 2.0, 3.0, 4.0], &keys)?;
    /// let engine = Engine::new(Device::Cpu)?;
    /// let samples = engine.evaluate(&set, method::STEP, &SampleTimes::fps(1))?;
    /// let smooth = engine.smooth(&samples, &Smoothing::new(SmoothingKernel::Linear))?;
    /// // ¼ 0.2 - ½ 0.1 + ¼ 0.3
    /// let expected = Quat::from_rotation_z(0.075);
    /// assert!(smooth.get(0, 2).unwrap().angle_between(expected) < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When the smoothing options are invalid, there is not enough memory, or the device fails.
    pub fn smooth(&self, rotations: &Rotations, smoothing: &Smoothing) -> Result<Rotations, Error> {
        self.smoothed(rotations, smoothing, true)
    }

    /// Smooths vectors; otherwise as [`Engine::smooth`].
    ///
    /// # Errors
    /// As [`Engine::smooth`].
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
        let (tracks, samples, layout) =
            (values.track_count(), values.sample_count(), values.layout());
        let weights = smoothing.step_weights(samples)?;
        let passes = if samples > 1 { smoothing.passes } else { 0 };
        let pass = SmoothingPass {
            smoothing,
            weights: &weights,
            are_rotations,
        };
        let count = values.as_arrays().len();
        let mut output = OutputBuffer::new(count)?;
        let mut other = OutputBuffer::new(if passes > 1 { count } else { 0 })?;
        if passes == 0 {
            output.copy_from_slice(bytemuck::cast_slice(values.as_arrays()));
        }
        for done in 0..passes {
            let (from, to) = match (passes - done) % 2 {
                1 => (&other, &mut output),
                _ => (&output, &mut other),
            };
            let input = PassInput {
                values: match done {
                    0 => values.as_arrays(),
                    _ => bytemuck::cast_slice(from),
                },
                tracks,
                samples,
                layout,
            };
            let to = bytemuck::cast_slice_mut(to);
            self.on_device(|device| match device {
                Some(device) if !weights.is_empty() => Ok(input.on(&pass, device, to)?),
                _ => Ok(on_threads(|| input.on_cpu(&pass, to))?),
            })?;
            for track in 0..tracks {
                pass.set_ends(input.row(track), |sample, value| {
                    to[layout.offset(track, sample, tracks, samples)] = value;
                });
            }
        }
        Ok(Samples::new(Box::new(output), tracks, samples, layout))
    }
}

/// The number of samples of each track that a thread smooths at once, for a kernel that is not wider. Their steps
/// stay in the caches.
const BLOCK: usize = 1024;

/// The values of a pass.
struct PassInput<'a> {
    values: &'a [[f32; 4]],
    tracks: usize,
    samples: usize,
    layout: Layout,
}

impl PassInput<'_> {
    fn row(&self, track: usize) -> SampleRow<'_> {
        let at = |sample| self.layout.offset(track, sample, self.tracks, self.samples);
        SampleRow {
            values: self.values,
            first: at(0),
            stride: at(1) - at(0),
            count: self.samples,
        }
    }

    /// Runs the pass on the engine's threads.
    fn on_cpu(&self, pass: &SmoothingPass<'_>, output: &mut [[f32; 4]]) {
        let length = BLOCK.max(4 * pass.weights.len());
        let block =
            |steps: &mut _, output: &mut [[f32; 4]], track: usize, output_start, i: usize| {
                let row = self.row(track);
                in_lanes(&mut SmoothingBlock {
                    pass: *pass,
                    row,
                    first: i * length,
                    steps,
                    count: output.len() / row.stride,
                    output,
                    output_start,
                });
            };
        match self.layout {
            Layout::TrackMajor => {
                let rows = output.par_chunks_mut(self.samples).enumerate();
                rows.for_each(|(track, row)| {
                    let blocks = row.par_chunks_mut(length).enumerate();
                    blocks.for_each_init(Default::default, |steps, (i, output)| {
                        block(steps, output, track, 0, i);
                    });
                });
            }
            Layout::FrameMajor => {
                let blocks = output.par_chunks_mut(length * self.tracks).enumerate();
                blocks.for_each_init(Default::default, |steps, (i, output)| {
                    for track in 0..self.tracks {
                        block(steps, output, track, track, i);
                    }
                });
            }
        }
    }

    /// Runs the pass on a device, for as many tracks at once as one pass can process. The host writes the steps
    /// outside the ends of rows.
    fn on(
        &self,
        pass: &SmoothingPass<'_>,
        device: &VulkanEngine,
        output: &mut [[f32; 4]],
    ) -> Result<(), VulkanError> {
        let (limit, radius) = (device.window().max(2), pass.weights.len());
        let detail = usize::from(pass.are_rotations);
        let stride = self.samples - 1 + 2 * radius;
        // Between rows that are smoothed at once the kernel runs over the values beyond their ends too:
        // more than the rows themselves where it is wider than they are long.
        let each = match 2 * radius > self.samples {
            true => 1,
            false => (limit / stride).max(1),
        };
        for first in (0..self.tracks).step_by(each) {
            let rows: Vec<SampleRow<'_>> = (first..self.tracks.min(first + each))
                .map(|track| self.row(track))
                .collect();
            let samples = rows
                .iter()
                .flat_map(|row| (0..row.count).map(|i| row.get(i)));
            let values: Vec<[f32; 4]> = samples.collect();
            // A step from one row to the next is found too, and not used.
            let mut steps = vec![[0.0; 4]; values.len() - 1];
            for (first, output) in (0..).step_by(limit - 1).zip(steps.chunks_mut(limit - 1)) {
                let values = &values[first..=first + output.len()];
                let counts = [output.len(), detail];
                device.pass(Kernel::PosesSteps, &[bytes(values)], counts, output)?;
            }
            let mut padded = Vec::with_capacity(rows.len() * stride);
            let mut spaced = Vec::with_capacity(rows.len() * stride);
            for (values, first) in values.chunks(self.samples).zip((0..).step_by(self.samples)) {
                let before = (0..stride).map(|step| step as isize - radius as isize);
                padded.extend(before.map(|step| steps[first + pass.step_at(step, self.samples)]));
                spaced.extend_from_slice(values);
                spaced.resize(padded.len(), [0.0; 4]);
            }
            let mut found = vec![[0.0; 4]; spaced.len() - stride + self.samples];
            let block = limit.saturating_sub(2 * radius).max(1);
            for (first, output) in (0..).step_by(block).zip(found.chunks_mut(block)) {
                let steps = &padded[first..first + output.len() + 2 * radius - 1];
                let values = &spaced[first..first + output.len()];
                let inputs = [bytes(values), bytes(steps), bytes(pass.weights)];
                let counts = [output.len(), 2 * radius + detail];
                device.pass(Kernel::PosesSmooth, &inputs, counts, output)?;
            }
            for (row, start) in rows.iter().zip((0..).step_by(stride)) {
                for sample in 0..self.samples {
                    let mut value = found[start + sample];
                    if pass.are_rotations && value == [0.0; 4] {
                        let center = (start + sample + radius) as isize;
                        value = pass.smoothed_in_f64(row.get(sample), |step| {
                            let [x, y, z, _] = padded[(center + step) as usize];
                            [x, y, z]
                        });
                    }
                    output[row.first + sample * row.stride] = value;
                }
            }
        }
        Ok(())
    }
}
