//! Smoothing of evaluated rotations and vectors, on the engine's machine.

use crate::engine::Engine;
use crate::error::Error;
use crate::machine::poses::SampleRows;
use crate::output::buffer::OutputBuffer;
use crate::output::rotations::{Rotations, Samples, Vectors};
use crate::smooth::kernel::Smoothing;
use crate::smooth::rows::SmoothingPass;
use crate::threads::copy;

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
        let passes = if samples > 1 && tracks > 0 {
            smoothing.passes
        } else {
            0
        };
        let pass = SmoothingPass {
            smoothing,
            weights: &weights,
            are_rotations,
        };
        let count = values.as_arrays().len();
        let mut output = OutputBuffer::new(count)?;
        let mut other = OutputBuffer::new(if passes > 1 { count } else { 0 })?;
        if passes == 0 {
            copy(
                bytemuck::cast_slice_mut(&mut output),
                bytemuck::cast_slice(values.as_arrays()),
            );
        }
        for done in 0..passes {
            let (from, to) = match (passes - done) % 2 {
                1 => (&other, &mut output),
                _ => (&output, &mut other),
            };
            let rows = SampleRows {
                values: match done {
                    0 => values.as_arrays(),
                    _ => bytemuck::cast_slice(from),
                },
                tracks,
                samples,
                layout,
            };
            let to = bytemuck::cast_slice_mut(to);
            (self.machine).passes(&mut |runner| runner.smooth(&rows, &pass, to))?;
            for track in 0..tracks {
                pass.set_ends(rows.row(track), |sample, value| {
                    to[layout.offset(track, sample, tracks, samples)] = value;
                });
            }
        }
        Ok(Samples::new(Box::new(output), tracks, samples, layout))
    }
}
