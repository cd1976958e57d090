//! Rotations as matrices and as rotation vectors, which are computed on the engine's threads.

use rayon::prelude::*;

use crate::engine::Engine;
use crate::error::Error;
use crate::math::quaternion::log;
use crate::output::encoding::{Encoding, EncodingLengthError, MatrixOrder};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;

/// The number of rotations in a task.
const TASK: usize = 256;

/// The numbers of a matrix.
const MATRIX_NUMBERS: usize = 9;

/// The numbers of the first two columns or rows of a matrix.
const PAIR_NUMBERS: usize = 6;

/// The numbers of a rotation vector.
const VECTOR_NUMBERS: usize = 3;

impl Engine {
    /// Stores the matrices of rotations, `x y z w` each, or only the first two columns or rows of each: models that learn
    /// take these six numbers (Zhou et al. 2019). `output` has 9 or 6 numbers for each rotation. They are those of
    /// [`Encoding::Matrix3x3`], and are computed on the threads of the engine.
    ///
    /// ```
    /// use tumble::{Device, Engine, MatrixOrder};
    /// let mut six = [0.0; 6];
    /// let engine = Engine::new(Device::Cpu)?;
    /// engine.matrices_into(&[[0.0, 0.0, 1.0, 0.0]], MatrixOrder::ColumnMajor, &mut six)?;
    /// assert_eq!(six, [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0]);
    /// # Ok::<(), tumble::Error>(())
    /// ```
    ///
    /// # Errors
    /// When `output` has neither 9 nor 6 numbers for each rotation, or the system refuses threads.
    pub fn matrices_into(
        &self,
        rotations: &[[f32; 4]],
        order: MatrixOrder,
        output: &mut [f32],
    ) -> Result<(), Error> {
        let encoding = Encoding::Matrix3x3(order);
        let is_of_pairs = output.len() == PAIR_NUMBERS * rotations.len();
        if !is_of_pairs {
            encoding.check_length(rotations.len(), size_of_val(output))?;
        }
        let numbers = if is_of_pairs {
            PAIR_NUMBERS
        } else {
            MATRIX_NUMBERS
        };
        let task = |(rotations, output): (&[[f32; 4]], &mut [f32])| {
            if !is_of_pairs {
                encoding.encode_all(rotations, bytemuck::cast_slice_mut(output));
                return;
            }
            let matrices = &mut [[0.0_f32; MATRIX_NUMBERS]; TASK][..rotations.len()];
            encoding.encode_all(rotations, bytemuck::cast_slice_mut(matrices));
            let pairs = output.as_chunks_mut::<PAIR_NUMBERS>().0;
            for (pair, matrix) in pairs.iter_mut().zip(&*matrices) {
                pair.copy_from_slice(&matrix[..PAIR_NUMBERS]);
            }
        };
        self.in_tasks(rotations, output, numbers, task)
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

    /// Runs a task for each part of the rotations, on the engine's threads. The result of a rotation has `numbers` numbers.
    fn in_tasks(
        &self,
        rotations: &[[f32; 4]],
        output: &mut [f32],
        numbers: usize,
        task: impl Fn((&[[f32; 4]], &mut [f32])) + Sync,
    ) -> Result<(), Error> {
        if rotations.len() <= TASK {
            task((rotations, output));
            return Ok(());
        }
        let work = || {
            let outputs = output.par_chunks_mut(TASK * numbers);
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
