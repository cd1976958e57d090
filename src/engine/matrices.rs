//! Rotations as matrices, which are computed on the engine's threads.

use rayon::prelude::*;

use crate::engine::Engine;
use crate::error::Error;
use crate::output::encoding::{Encoding, MatrixOrder};

/// The number of rotations in a task.
const TASK: usize = 256;

/// The numbers of a matrix.
const MATRIX_NUMBERS: usize = 9;

/// The numbers of the first two columns or rows of a matrix.
const PAIR_NUMBERS: usize = 6;

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
        if rotations.len() <= TASK {
            task((rotations, output));
            return Ok(());
        }
        let work = || {
            let outputs = output.par_chunks_mut(TASK * numbers);
            rotations.par_chunks(TASK).zip(outputs).for_each(task);
        };
        Ok(self.machine.threads().run(work)?)
    }
}
