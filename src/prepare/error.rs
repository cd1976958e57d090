//! Why a set cannot be evaluated as asked, on any device.

use crate::curve::options::InterpolationError;
use crate::memory::OutOfMemory;
use crate::threads::OutOfThreads;
use crate::threads::stop::Stopped;
use crate::time::frames::SampleTimesError;

/// Why a set cannot be evaluated as asked, on any device.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SetError {
    #[error(transparent)]
    Frames(#[from] SampleTimesError),
    #[error(transparent)]
    Interpolation(#[from] InterpolationError),
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemory),
    #[error(transparent)]
    Threads(#[from] OutOfThreads),
    #[error(transparent)]
    Stopped(#[from] Stopped),
}
