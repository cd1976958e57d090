//! Errors of evaluating a set, on any device.

use crate::curve::options::InterpolationError;
use crate::memory::OutOfMemoryError;
use crate::threads::OutOfThreadsError;
use crate::threads::stop::StoppedError;
use crate::time::error::SampleTimesError;

/// Why a set cannot be evaluated as requested, on any device.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SetError {
    #[error(transparent)]
    Frames(#[from] SampleTimesError),
    #[error(transparent)]
    Interpolation(#[from] InterpolationError),
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemoryError),
    #[error(transparent)]
    Threads(#[from] OutOfThreadsError),
    #[error(transparent)]
    Stopped(#[from] StoppedError),
}
