//! Evaluation of crowds into the caller's memory.

use tumble::crowd::{Crowd, CrowdError, CrowdOutput, CrowdValues};

use crate::arguments::{Number, Out, flag, list_mut, option};
use crate::crowd::player::TumbleCrowd;
use crate::handle;
use crate::result::{Failure, TumbleResult, code};

/// The values that are stored for every joint of every visible instance, in the order `[instance][joint]`.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleCrowdValues {
    /// The rotation in the parent's frame: four numbers `x y z w`.
    Rotations = 0,
    /// The transform in the parent's frame: a matrix of twelve numbers, three rows of four, for column vectors. The
    /// last column is the translation.
    Local = 1,
    /// The transform in the model's frame, as a matrix of the same form.
    Model = 2,
    /// The transform in the model's frame times the inverse bind matrix, as a matrix of the same form, for skinning
    /// of vertices.
    Skinning = 3,
}

/// The output for a C constant, in 32 or 16 bits.
pub(crate) fn output(values: u32, is_half: bool) -> Result<CrowdOutput, Failure> {
    let values = option(values, &CrowdValues::ALL, "values")?;
    Ok(match is_half {
        true => CrowdOutput::half(values),
        false => values.into(),
    })
}

/// The caller's memory for a result; an error if `count` is not exactly the result's size.
///
/// # Safety
/// As [`list_mut`].
unsafe fn vectors<'a, T: Number>(
    crowd: &Crowd,
    values: CrowdOutput,
    output: *mut T,
    count: usize,
) -> Result<&'a mut [[T; 4]], Failure> {
    // Use the number of the submission: the list of visible instances may have changed since.
    let needed = 4 * crowd.submitted_len().unwrap_or(crowd.output_len(values));
    if count != needed {
        let (joints, each) = (crowd.library().joint_count(), 4 * values.vector_count());
        let instances = needed / (joints * each);
        let message = format!(
            "`output_count` is {count}; the result has {needed} numbers: {instances} instances × {joints} joints × {each}"
        );
        return Err(Failure::new(TumbleResult::WrongSize, message));
    }
    // SAFETY: as the caller promises.
    let output = unsafe { list_mut(output, count, "output")? };
    Ok(output.as_chunks_mut::<4>().0)
}

/// Returns the number of numbers of a result: 4 for rotations, or 12 for matrices, × joints × visible instances.
/// `values` is a `TumbleCrowdValues`.
///
/// # Safety
/// `count` must point to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_output_count(
    crowd: *const TumbleCrowd,
    values: u32,
    count: *mut usize,
) -> TumbleResult {
    code(|| {
        let out = Out::new(count, "count")?;
        let values = output(values, false)?;
        let vectors = handle::get(crowd)?.lock()?.inner.output_len(values);
        // SAFETY: as the caller promises.
        unsafe { out.set(4 * vectors) };
        Ok(())
    })
}

/// Evaluates all visible instances at the clock's time into the caller's memory, and waits for the result.
///
/// `values` is a `TumbleCrowdValues`. `output_count` is the number of floats of `output`, exactly that of
/// `tumble_crowd_output_count`.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is another number.
/// - `TUMBLE_RESULT_WRONG_STATE` if the result of `tumble_crowd_submit` was not taken, or skinning matrices are
///   requested but the library has no inverse bind matrices.
/// - `TUMBLE_RESULT_DEVICE` if the device fails.
///
/// # Safety
/// `output` must have `output_count` floats, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_evaluate(
    crowd: *mut TumbleCrowd,
    values: u32,
    output: *mut f32,
    output_count: usize,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        let mut state = crowd.lock()?;
        let values = self::output(values, false)?;
        // SAFETY: as the caller promises.
        let output = unsafe { vectors(&state.inner, values, output, output_count)? };
        Ok(state.inner.evaluate_into(values.values, output)?)
    })
}

/// As `tumble_crowd_evaluate`, in 16 bits: each number is the bits of an IEEE 754 half-precision float, rounded to
/// nearest.
///
/// # Safety
/// `output` must have `output_count` numbers of 16 bits, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_evaluate_half(
    crowd: *mut TumbleCrowd,
    values: u32,
    output: *mut u16,
    output_count: usize,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        let mut state = crowd.lock()?;
        let values = self::output(values, true)?;
        // SAFETY: as the caller promises.
        let output = unsafe { vectors(&state.inner, values, output, output_count)? };
        Ok(state.inner.evaluate_half_into(values.values, output)?)
    })
}

/// Starts an evaluation of all visible instances at the clock's time and returns at once.
///
/// `values` is a `TumbleCrowdValues`. `half` is 0 for a result in 32 bits, 1 for 16 bits. A Vulkan device evaluates
/// while instances and the clock are changed for the next frame; the CPU evaluates before this function returns. The
/// caller takes the result with `tumble_crowd_wait`, or with `tumble_crowd_wait_half` if `half` is 1, before it
/// evaluates or submits again.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_STATE` if the result of the previous submission was not taken, or skinning matrices are
///   requested but the library has no inverse bind matrices.
/// - `TUMBLE_RESULT_DEVICE` if the device fails.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_submit(
    crowd: *mut TumbleCrowd,
    values: u32,
    half: u32,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        let output = output(values, flag(half, "half")?)?;
        Ok(crowd.lock()?.inner.submit(output)?)
    })
}

/// Returns whether the submitted evaluation has ended, so that `tumble_crowd_wait` does not wait.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_STATE` if nothing was submitted.
/// - `TUMBLE_RESULT_DEVICE` if the device fails.
///
/// # Safety
/// `done` must point to memory for a `bool`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_poll(
    crowd: *const TumbleCrowd,
    done: *mut bool,
) -> TumbleResult {
    code(|| {
        let out = Out::new(done, "done")?;
        let is_done = handle::get(crowd)?.lock()?.inner.poll()?;
        // SAFETY: as the caller promises.
        unsafe { out.set(is_done) };
        Ok(())
    })
}

/// Waits for an evaluation that was submitted in 32 or 16 bits, and takes its result. If the precision or the size
/// differs, the result can still be taken.
///
/// # Safety
/// As [`list_mut`].
unsafe fn wait<T: Number>(
    crowd: *mut TumbleCrowd,
    is_half: bool,
    (output, count): (*mut T, usize),
    take: fn(&mut Crowd, &mut [[T; 4]]) -> Result<(), CrowdError>,
) -> Result<(), Failure> {
    let crowd = handle::get(crowd)?;
    let mut state = crowd.lock()?;
    let submitted = state.inner.submitted();
    let submitted = submitted.ok_or(CrowdError::NothingSubmitted)?;
    if submitted.is_half != is_half {
        let is_half = submitted.is_half;
        return Err(CrowdError::Precision { is_half }.into());
    }
    // SAFETY: as the caller promises.
    let output = unsafe { vectors(&state.inner, submitted, output, count)? };
    Ok(take(&mut state.inner, output)?)
}

/// Waits for an evaluation that was submitted with `half` 0, and takes its result.
///
/// `output_count` is the number of floats of `output`: exactly the `tumble_crowd_output_count` at the time of the
/// submission.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_STATE` if nothing was submitted, or `half` was 1.
/// - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is another number.
/// - `TUMBLE_RESULT_DEVICE` if the device fails.
///
/// After the first two errors, a submitted result can still be taken.
///
/// # Safety
/// `output` must have `output_count` floats, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_wait(
    crowd: *mut TumbleCrowd,
    output: *mut f32,
    output_count: usize,
) -> TumbleResult {
    // SAFETY: as the caller promises.
    code(|| unsafe { wait(crowd, false, (output, output_count), Crowd::wait_into) })
}

/// Waits for an evaluation that was submitted with `half` 1, and takes its result.
///
/// `output_count` is the number of numbers of 16 bits of `output`: exactly the `tumble_crowd_output_count` at the
/// time of the submission.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_STATE` if nothing was submitted, or `half` was 0.
/// - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is another number.
/// - `TUMBLE_RESULT_DEVICE` if the device fails.
///
/// After the first two errors, a submitted result can still be taken.
///
/// # Safety
/// `output` must have `output_count` numbers of 16 bits, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_wait_half(
    crowd: *mut TumbleCrowd,
    output: *mut u16,
    output_count: usize,
) -> TumbleResult {
    // SAFETY: as the caller promises.
    code(|| unsafe { wait(crowd, true, (output, output_count), Crowd::wait_half_into) })
}
