//! Checks before an evaluation: encodings, windows and memory that do not fit the result are refused.

use std::ops::Range;

use glam::Quat;

use crate::curve::options::Quantity;
use crate::error::Error;
use crate::output::buffer::OutputBuffer;
use crate::output::encoding::Encoding;
use crate::output::value::OutputValue;
use crate::output::window::Window;

/// Refuses an encoding that cannot store the quantity.
pub(crate) fn check_encoding(encoding: Encoding, quantity: Quantity) -> Result<(), Error> {
    match encoding.row().takes_vectors || quantity == Quantity::Rotation {
        true => Ok(()),
        false => Err(Error::EncodesRotations { encoding }),
    }
}

/// Refuses memory whose type cannot store the quantity.
pub(crate) fn check_rows<R: OutputValue>(quantity: Quantity) -> Result<(), Error> {
    match quantity == Quantity::Rotation {
        true if !R::STORES_ROTATIONS => Err(Error::NotRates),
        false if !R::STORES_RATES => Err(Error::NotRotations),
        _ => Ok(()),
    }
}

/// Refuses a window that is not within the result, and memory of another size than the window's.
pub(crate) fn check_window(
    window: &Window,
    tracks: usize,
    samples: usize,
    encoding: Encoding,
    output: &[u8],
) -> Result<(), Error> {
    check_within(window, tracks, samples)?;
    match (output.len(), window.len().saturating_mul(encoding.bytes())) {
        (length, needed) if length == needed => Ok(()),
        (length, needed) => Err(Error::OutputBytes { length, needed }),
    }
}

/// Refuses a window that is not within a result of `tracks` tracks and `samples` samples.
pub(crate) fn check_within(window: &Window, tracks: usize, samples: usize) -> Result<(), Error> {
    let lies_in = |part: &Range<usize>, whole| part.start <= part.end && part.end <= whole;
    if !lies_in(&window.tracks, tracks) || !lies_in(&window.samples, samples) {
        return Err(Error::NoSuchPart {
            part: (window.tracks.clone(), window.samples.clone()),
            whole: (tracks, samples),
        });
    }
    Ok(())
}

/// Fills the caller's memory as quaternions, if it is of the result's type and length. If it is not aligned like
/// quaternions, the result is first written to memory that is, and copied.
pub(crate) fn in_quats<R: OutputValue>(
    output: &mut [R],
    needed: usize,
    fill: impl FnOnce(&mut [Quat]) -> Result<(), Error>,
) -> Result<(), Error> {
    let length = output.len();
    if length != needed {
        return Err(Error::OutputLength { length, needed });
    }
    if let Ok(quats) = bytemuck::try_cast_slice_mut(&mut *output) {
        return fill(quats);
    }
    let mut quats = OutputBuffer::new(output.len())?;
    fill(&mut quats)?;
    output.copy_from_slice(bytemuck::cast_slice(&quats));
    Ok(())
}
