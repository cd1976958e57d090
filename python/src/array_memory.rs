//! The memory of arrays that stay on a device.

use pyo3::prelude::*;
use tumble::crowd::MappedStates;
use tumble::vulkan::ExportedResult;

use crate::cuda::{CudaError, Mapping};
use crate::errors::device;

/// `kDLCPU` and `kDLCUDA`.
pub(crate) const CPU: i32 = 1;
pub(crate) const CUDA: i32 = 2;

/// The memory of one or several arrays.
pub(crate) enum ArrayMemory {
    /// Memory of a card that CUDA has.
    Card(Mapping),
    /// Memory of the host; the result in it is complete.
    Host(MappedStates),
}

impl ArrayMemory {
    /// Memory of a card. Called without the interpreter's lock.
    pub(crate) fn on_card(result: ExportedResult) -> Result<Self, CudaError> {
        Mapping::new(result).map(Self::Card)
    }

    /// The device, as DLPack numbers devices: (type, index).
    pub(crate) fn device(&self) -> (i32, i32) {
        match self {
            Self::Card(mapping) => (CUDA, mapping.ordinal),
            Self::Host(_) => (CPU, 0),
        }
    }

    /// The address of the first byte.
    pub(crate) fn address(&self) -> usize {
        match self {
            Self::Card(mapping) => mapping.address() as usize,
            Self::Host(states) => states.bytes().as_ptr().expose_provenance(),
        }
    }

    /// Copies bytes from `start` on to the host.
    pub(crate) fn copy_to_host(&self, start: usize, bytes: &mut [u8]) -> PyResult<()> {
        match self {
            Self::Card(mapping) => {
                let copied = mapping.copy_to_host(start, bytes);
                copied.map_err(|error| of_cuda(&error))
            }
            Self::Host(states) => {
                bytes.copy_from_slice(&states.bytes()[start..][..bytes.len()]);
                Ok(())
            }
        }
    }
}

/// The exception for an error of CUDA, with the remedy in Python.
pub(crate) fn of_cuda(error: &CudaError) -> PyErr {
    device(&format!(
        "device_array: {error}; without device_array=True results are arrays of NumPy's"
    ))
}
