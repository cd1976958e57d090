//! The tables of `tumble.MotionLibrary` on a Vulkan device.

use std::sync::Arc;

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use tumble::crowd::{FrameStep, StateArray};
use tumble::vulkan::{ExportedResult, VulkanError};
use tumble::{Encoding, EncodingOptions};

use crate::array_memory::ArrayMemory;
use crate::cuda::CudaError;
use crate::device_array::DeviceArray;
use crate::engine::Engine;
use crate::errors::{device, guarded, input};
use crate::motions::{MANY, Motions, of_crowd};
use crate::output::encoding_named;
use crate::run::stoppable;

/// The clips of a motion library on a device, which samples them there.
#[pyclass(frozen, weakref, module = "tumble._tumble")]
pub(crate) struct DeviceMotions {
    device: tumble::crowd::DeviceMotions,
    motions: Py<Motions>,
    /// Whether CUDA has the device, so that results stay in its memory.
    is_on_card: bool,
}

/// The reason why results do not stay on the card.
fn of_cuda(error: &CudaError) -> PyErr {
    device(&format!(
        "device: {error}; leave out `device`, and results are arrays of NumPy's"
    ))
}

/// Whether CUDA has the device of a result. A device that it does not see, or a machine without CUDA, is no error:
/// results are then in memory of the host.
fn is_on_card(result: ExportedResult) -> PyResult<bool> {
    match ArrayMemory::on_card(result) {
        Ok(_) => Ok(true),
        Err(CudaError::NoLibrary(_) | CudaError::NoDevice { .. }) => Ok(false),
        #[cfg(not(unix))]
        Err(CudaError::NoFiles) => Ok(false),
        Err(error) => Err(of_cuda(&error)),
    }
}

#[pymethods]
impl DeviceMotions {
    /// Copies clips to the device of an engine.
    #[new]
    fn new(py: Python<'_>, motions: Py<Motions>, engine: &Bound<'_, Engine>) -> PyResult<Self> {
        let engine = engine.get().engine_for(1)?;
        if engine.device_info().is_none() {
            return Err(input(format!(
                "device: the engine's device is {}; name a Vulkan device (tumble.devices()), or leave out `device`",
                engine.device_name()
            )));
        }
        let of_tables = motions.get();
        let device = of_tables.with_parts(py, |tables, parts| {
            guarded(|| tumble::crowd::DeviceMotions::new(&engine, tables, parts).map_err(of_crowd))
        })?;
        let is_on_card = py.detach(|| {
            guarded(|| match device.export(&[], None, &[], Encoding::F32) {
                Ok((result, _)) => is_on_card(result),
                Err(tumble::crowd::CrowdError::Vulkan(VulkanError::NoExport { .. })) => Ok(false),
                Err(error) => Err(of_crowd(error)),
            })
        })?;
        Ok(Self {
            device,
            motions,
            is_on_card,
        })
    }

    /// The bytes of the clips in the device's memory.
    #[getter]
    fn nbytes(&self) -> u64 {
        self.device.bytes()
    }

    /// The arrays with these names, of a shape without the axes of joints and numbers. `rotations`: "quaternion", "matrix"
    /// or "6d". `frames`: as of `Motions.sample`.
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    #[pyo3(signature = (clip_ids, times, shape, names, rotations, frames=None))]
    fn sample(
        &self,
        py: Python<'_>,
        clip_ids: PyReadonlyArray1<'_, i64>,
        times: PyReadonlyArray1<'_, f64>,
        shape: Vec<usize>,
        names: Vec<String>,
        rotations: &str,
        frames: Option<(PyReadonlyArray1<'_, f64>, PyReadonlyArray1<'_, f64>)>,
    ) -> PyResult<Vec<DeviceArray>> {
        let motions = self.motions.get();
        let arrays = names.iter().map(|name| name.parse());
        let arrays: Vec<StateArray> = arrays
            .collect::<Result<_, _>>()
            .map_err(|error: tumble::UnknownNameError| input(format!("arrays: {error}")))?;
        let encoding = match rotations {
            "quaternion" => Encoding::F32,
            other => encoding_named(other, EncodingOptions::default())?,
        };
        let at = motions.instances(&clip_ids, &times)?;
        let steps: Option<Vec<FrameStep>> = match &frames {
            Some((rates, lengths)) => {
                let frames = (rates.as_slice()?, lengths.as_slice()?);
                Some(motions.steps(&at, &times, frames)?)
            }
            None => None,
        };
        let are_placed =
            |array: &StateArray| matches!(array, StateArray::Positions | StateArray::Velocities);
        if arrays.iter().any(are_placed) {
            motions.check_placed(&at)?;
        }
        let work = || match self.is_on_card {
            true => {
                let made = (self.device).export(&at, steps.as_deref(), &arrays, encoding);
                let (result, ranges) = made.map_err(of_crowd)?;
                let memory = ArrayMemory::on_card(result).map_err(|error| of_cuda(&error))?;
                Ok((memory, ranges))
            }
            false => {
                let made = (self.device).sample(&at, steps.as_deref(), &arrays, encoding);
                let (states, ranges) = made.map_err(of_crowd)?;
                Ok((ArrayMemory::Host(states), ranges))
            }
        };
        let joints = at.len().saturating_mul(motions.joints());
        let (memory, ranges) = py.detach(|| match joints < MANY {
            true => guarded(work),
            false => stoppable(work),
        })?;
        let memory = Arc::new(memory);
        let array = |(array, range): (&StateArray, std::ops::Range<usize>)| {
            let each = array.encoding(encoding).shape();
            let shape = [&shape[..], &[motions.joints()], each].concat();
            DeviceArray::within(&memory, range.start, shape)
        };
        Ok(arrays.iter().zip(ranges).map(array).collect())
    }
}
