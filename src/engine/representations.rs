//! Rotations in other representations, which are computed on the engine's threads.

use rayon::prelude::*;

use crate::engine::Engine;
use crate::error::Error;
use crate::math::quaternion::log;
use crate::output::encoding::{Encoding, EncodingLengthError};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;

/// The number of rotations in a task.
const TASK: usize = 256;

/// The numbers of a rotation vector.
const VECTOR_NUMBERS: usize = 3;

impl Engine {
    /// Encodes rotations, `x y z w` each, as [`Encoding::encode`], on the threads of the engine.
    ///
    /// ```
    /// use tumble::{Device, Encoding, Engine};
    /// let mut six = [0.0_f32; 6];
    /// let engine = Engine::new(Device::Cpu)?;
    /// engine.encode(&[[0.0, 0.0, 1.0, 0.0]], Encoding::SixD, tumble::bytemuck::cast_slice_mut(&mut six))?;
    /// assert_eq!(six, [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0]);
    /// # Ok::<(), tumble::Error>(())
    /// ```
    ///
    /// # Errors
    /// When the length of `output` is not [`Encoding::bytes`] for each rotation, or the system refuses threads.
    pub fn encode(
        &self,
        rotations: &[[f32; 4]],
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        encoding.check_length(rotations.len(), output.len())?;
        let task = |(rotations, output): (&[[f32; 4]], &mut [u8])| {
            encoding.encode_all(rotations, output);
        };
        self.in_tasks(rotations, output, encoding.bytes(), task)
    }

    /// Stores the rotation vectors of rotations, `x y z w` each: the axis times the angle in radians, which is at most π, as
    /// the poses of SMPL and SciPy's `as_rotvec` have them. They are computed in f64, on the threads of the engine.
    ///
    /// ```
    /// use tumble::{Device, Engine};
    /// let mut vector = [0.0; 3];
    /// let engine = Engine::new(Device::Cpu)?;
    /// engine.rotation_vectors_into(&[[0.0, 0.0, -1.0, 0.0]], &mut vector)?;
    /// assert_eq!(vector, [0.0, 0.0, -std::f32::consts::PI]);
    /// # Ok::<(), tumble::Error>(())
    /// ```
    ///
    /// # Errors
    /// When `output` does not have 3 numbers for each rotation, or the system refuses threads.
    pub fn rotation_vectors_into(
        &self,
        rotations: &[[f32; 4]],
        output: &mut [f32],
    ) -> Result<(), Error> {
        if output.len() != VECTOR_NUMBERS * rotations.len() {
            return Err(Error::EncodingLength(EncodingLengthError {
                rotations: rotations.len(),
                bytes: size_of_val(output),
                needed: size_of::<[f32; VECTOR_NUMBERS]>() * rotations.len(),
            }));
        }
        let task = |(rotations, output): (&[[f32; 4]], &mut [f32])| {
            in_lanes(&mut RotationVectors { rotations, output });
        };
        self.in_tasks(rotations, output, VECTOR_NUMBERS, task)
    }

    /// Runs a task for each part of the rotations, on the engine's threads. The result of a rotation has `each` elements.
    fn in_tasks<T: Send>(
        &self,
        rotations: &[[f32; 4]],
        output: &mut [T],
        each: usize,
        task: impl Fn((&[[f32; 4]], &mut [T])) + Sync,
    ) -> Result<(), Error> {
        if rotations.len() <= TASK {
            task((rotations, output));
            return Ok(());
        }
        let work = || {
            let outputs = output.par_chunks_mut(TASK * each);
            rotations.par_chunks(TASK).zip(outputs).for_each(&task);
        };
        Ok(self.machine.threads().run(work)?)
    }
}

/// Rotation vectors of some rotations.
struct RotationVectors<'a> {
    rotations: &'a [[f32; 4]],
    output: &'a mut [f32],
}

impl InLanes for RotationVectors<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let outputs = self.output.as_chunks_mut::<VECTOR_NUMBERS>().0;
        for (rotation, output) in self.rotations.iter().zip(outputs) {
            // A rotation has two quaternions; that with w of 0 or more has the smaller angle.
            let sign = if rotation[3] < 0.0 { -1.0 } else { 1.0 };
            let half = log(rotation.map(|number| sign * f64::from(number)));
            *output = half.map(|number| (2.0 * number) as f32);
        }
    }
}
