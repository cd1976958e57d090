//! Passes over poses of the host, on a device.

use bytemuck::cast_slice;

use crate::gpu::engine::VulkanEngine;
use crate::gpu::run_once::run_once;
use crate::machine::error::{EvaluateError, VulkanError};
use crate::machine::poses::{Pass, PassRunner, SampleRows};
use crate::shader::{Kernel, PoseDispatch};
use crate::smooth::rows::{SampleRow, SmoothingPass};
use crate::work::recording::workgroups;

impl PassRunner for VulkanEngine {
    fn window(&self) -> usize {
        self.window()
    }

    fn run(&self, pass: &Pass<'_>, output: &mut [[f32; 4]]) -> Result<(), EvaluateError> {
        let count = output.len();
        Ok(match *pass {
            Pass::Blend { layers, weights } => {
                let inputs = [cast_slice(layers), cast_slice(weights)];
                self.run_pass(Kernel::PosesBlend, &inputs, [count, weights.len()], output)
            }
            Pass::Mix { from, to, weight } => {
                let weight = [weight];
                let inputs = [cast_slice(from), cast_slice(to), cast_slice(&weight)];
                self.run_pass(Kernel::PosesMix, &inputs, [count, 0], output)
            }
            Pass::Add {
                base,
                layer,
                references,
            } => {
                let inputs = [base, layer, references].map(cast_slice);
                self.run_pass(Kernel::PosesAdd, &inputs, [count, 0], output)
            }
            Pass::World { local, links } => {
                let inputs = [cast_slice(local), cast_slice(links)];
                let counts = [local.len() / links.len(), links.len()];
                self.run_pass(Kernel::PosesWorld, &inputs, counts, output)
            }
        }?)
    }

    /// Smooths as many tracks at once as one pass can process. The host writes the steps outside the ends of rows.
    fn smooth(
        &self,
        all: &SampleRows<'_>,
        pass: &SmoothingPass<'_>,
        output: &mut [[f32; 4]],
    ) -> Result<(), EvaluateError> {
        if pass.weights.is_empty() {
            return self.host.smooth(all, pass, output);
        }
        let (limit, radius) = (self.window().max(2), pass.weights.len());
        let detail = usize::from(pass.are_rotations);
        let stride = all.samples - 1 + 2 * radius;
        // Between rows that are smoothed at once the kernel runs over the values beyond their ends too:
        // more than the rows themselves where it is wider than they are long.
        let each = match 2 * radius > all.samples {
            true => 1,
            false => (limit / stride).max(1),
        };
        for first in (0..all.tracks).step_by(each) {
            let rows: Vec<SampleRow<'_>> = (first..all.tracks.min(first + each))
                .map(|track| all.row(track))
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
                self.run_pass(Kernel::PosesSteps, &[cast_slice(values)], counts, output)?;
            }
            let mut padded = Vec::with_capacity(rows.len() * stride);
            let mut spaced = Vec::with_capacity(rows.len() * stride);
            for (values, first) in values.chunks(all.samples).zip((0..).step_by(all.samples)) {
                let before = (0..stride).map(|step| step as isize - radius as isize);
                padded.extend(before.map(|step| steps[first + pass.step_at(step, all.samples)]));
                spaced.extend_from_slice(values);
                spaced.resize(padded.len(), [0.0; 4]);
            }
            let mut found = vec![[0.0; 4]; spaced.len() - stride + all.samples];
            let block = limit.saturating_sub(2 * radius).max(1);
            for (first, output) in (0..).step_by(block).zip(found.chunks_mut(block)) {
                let steps = &padded[first..first + output.len() + 2 * radius - 1];
                let values = &spaced[first..first + output.len()];
                let inputs = [
                    cast_slice(values),
                    cast_slice(steps),
                    cast_slice(pass.weights),
                ];
                let counts = [output.len(), 2 * radius + detail];
                self.run_pass(Kernel::PosesSmooth, &inputs, counts, output)?;
            }
            for (row, start) in rows.iter().zip((0..).step_by(stride)) {
                for sample in 0..all.samples {
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

impl VulkanEngine {
    /// Runs the kernel of a pass with these inputs, each of at most as many values of 16 bytes as a window has
    /// rotations. The kernel has `count` invocations and the parameter `detail`.
    fn run_pass(
        &self,
        kernel: Kernel,
        inputs: &[&[u8]],
        [count, detail]: [usize; 2],
        output: &mut [[f32; 4]],
    ) -> Result<(), VulkanError> {
        let output = bytemuck::cast_slice_mut(output);
        for bytes in inputs.iter().copied().chain([&*output]) {
            self.check_size("poses", bytes)?;
        }
        let [count, detail] = [count as u32, detail as u32];
        let (pipeline, groups) = (self.pipeline(kernel)?, workgroups(count));
        let pass = PoseDispatch { count, detail };
        run_once(&pipeline, inputs, bytemuck::bytes_of(&pass), groups, output)
    }
}
