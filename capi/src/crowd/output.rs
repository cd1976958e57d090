//! Evaluating crowds into the caller's memory.

use tumble::crowd::{Crowd, CrowdError, CrowdOutput, CrowdValues};

use crate::arguments::{Number, Out, flag, list_mut, option};
use crate::crowd::player::TumbleCrowd;
use crate::handle;
use crate::result::{Failure, TumbleResult, code};

/// What is written for every joint of every instance, in the order `[instance][joint]`.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleCrowdValues {
    /// The rotation in the parent's frame, four numbers: `x y z w`.
    Rotations = 0,
    /// The transform in the parent's frame, twelve numbers: three rows of four, for column vectors, the
    /// last column the translation.
    Local = 1,
    /// The transform in the model, likewise.
    Model = 2,
    /// The transform in the model times the inverse bind matrix, likewise: what vertices are skinned
    /// with.
    Skinning = 3,
}

/// The values of a constant, in 32 or in 16 bits.
pub(crate) fn output(values: u32, is_half: bool) -> Result<CrowdOutput, Failure> {
    let values = option(values, &CrowdValues::ALL, "values")?;
    Ok(CrowdOutput { values, is_half })
}

/// Memory of the caller's that is exactly as large as a result.
///
/// # Safety
/// As [`list_mut`].
unsafe fn vectors<'a, T: Number>(
    crowd: &Crowd,
    values: CrowdOutput,
    output: *mut T,
    count: usize,
) -> Result<&'a mut [[T; 4]], Failure> {
    // Other instances may be visible now than when it was submitted.
    let needed = 4 * crowd.submitted_len().unwrap_or(crowd.output_len(values));
    if count != needed {
        let (joints, each) = (crowd.library().joint_count(), 4 * values.vector_count());
        let instances = needed / (joints * each);
        let message = format!(
            "`output_count` is {count}; the result has {needed} numbers: {instances} instances × {joints} joints × {each}"
        );
        return Err(Failure::new(TumbleResult::WrongSize, message));
    }
    // SAFETY: the caller's promise.
    let output = unsafe { list_mut(output, count, "output")? };
    Ok(output.as_chunks_mut::<4>().0)
}

/// How many numbers a result has: 4 or 12 × joints × instances, those that are visible.
///
/// # Safety
/// `count` has room for a number.
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

/// Evaluates all instances, or those that are visible, at the clock's time into the caller's memory, and waits until it is done.
/// `values` is a `TumbleCrowdValues`; `output_count` is exactly as `tumble_crowd_output_count` says.
///
/// # Safety
/// `output` has room for `output_count` floats, which nothing else uses during the call.
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

/// As `tumble_crowd_evaluate`, in 16 bits: the bits of halves (IEEE 754), rounded to nearest.
///
/// # Safety
/// `output` has room for `output_count` halves, which nothing else uses during the call.
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

/// Starts an evaluation at the clock's time and returns at once; a Vulkan device works on it while
/// instances and the clock are changed for the next one. The CPU evaluates before this returns. The
/// result must be taken by `tumble_crowd_wait`, or by `tumble_crowd_wait_half` where `half` is 1, before
/// anything else is evaluated or submitted.
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

/// Whether what was submitted is done, so that `tumble_crowd_wait` does not wait.
///
/// # Safety
/// `done` has room for a truth value.
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

/// Waits for what was submitted in 32 or 16 bits, and takes its result. What has the other precision, or
/// another size, stays.
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
    // SAFETY: the caller's promise.
    let output = unsafe { vectors(&state.inner, submitted, output, count)? };
    Ok(take(&mut state.inner, output)?)
}

/// Waits for what was submitted with `half` 0, and takes its result. If an argument is refused, the
/// result can still be taken.
///
/// # Safety
/// `output` has room for `output_count` floats, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_wait(
    crowd: *mut TumbleCrowd,
    output: *mut f32,
    output_count: usize,
) -> TumbleResult {
    // SAFETY: as the caller promises.
    code(|| unsafe { wait(crowd, false, (output, output_count), Crowd::wait_into) })
}

/// Waits for what was submitted with `half` 1, and takes its result. If an argument is refused, the
/// result can still be taken.
///
/// # Safety
/// `output` has room for `output_count` halves, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_wait_half(
    crowd: *mut TumbleCrowd,
    output: *mut u16,
    output_count: usize,
) -> TumbleResult {
    // SAFETY: as the caller promises.
    code(|| unsafe { wait(crowd, true, (output, output_count), Crowd::wait_half_into) })
}
