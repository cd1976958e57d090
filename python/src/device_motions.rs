//! The tables of `tumble.MotionLibrary` on a Vulkan device.

use std::sync::Arc;

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use tumble::UnknownNameError;
use tumble::crowd::{BodyArray, CrowdError, DeviceBodies, FrameStep, MappedStates, StateArray};
use tumble::vulkan::{ExportedResult, VulkanError};
use tumble::{Encoding, EncodingOptions};

use crate::array_memory::ArrayMemory;
use crate::cuda::CudaError;
use crate::device_array::DeviceArray;
use crate::engine::Engine;
use crate::errors::{device, guarded, input};
use crate::motions::{MANY, Motions, Tables, of_crowd};
use crate::output::encoding_named;
use crate::run::stoppable;

/// The clips of a motion library on a device, which samples them there.
#[pyclass(frozen, weakref, module = "tumble._tumble")]
pub(crate) struct DeviceMotions {
    device: OnDevice,
    motions: Py<Motions>,
    /// Whether CUDA has the device, so that results stay in its memory.
    is_on_card: bool,
}

/// The tables on a device.
enum OnDevice {
    Skeleton(tumble::crowd::DeviceMotions),
    Robot(DeviceBodies),
}

/// The memory of a result, and the ranges of its arrays.
type Arrays<T> = Result<(T, Vec<std::ops::Range<usize>>), CrowdError>;

/// The arrays that are asked for.
enum Asked {
    /// With the encoding of rotations.
    OfJoints(Vec<StateArray>, Encoding),
    OfBodies(Vec<BodyArray>),
}

impl OnDevice {
    fn bytes(&self) -> u64 {
        match self {
            Self::Skeleton(device) => device.bytes(),
            Self::Robot(device) => device.bytes(),
        }
    }

    fn asked(&self, names: &[String], rotations: Encoding) -> PyResult<Asked> {
        fn parsed<T: std::str::FromStr<Err = UnknownNameError>>(
            names: &[String],
        ) -> PyResult<Vec<T>> {
            let parsed: Result<_, UnknownNameError> = names.iter().map(|it| it.parse()).collect();
            parsed.map_err(|error| input(format!("arrays: {error}")))
        }
        Ok(match self {
            Self::Skeleton(_) => Asked::OfJoints(parsed(names)?, rotations),
            Self::Robot(_) => Asked::OfBodies(parsed(names)?),
        })
    }

    fn sample(
        &self,
        at: &[(u32, u32)],
        steps: Option<&[FrameStep]>,
        asked: &Asked,
    ) -> Arrays<MappedStates> {
        match (self, asked) {
            (Self::Skeleton(device), Asked::OfJoints(arrays, rotations)) => {
                device.sample(at, steps, arrays, *rotations)
            }
            (Self::Robot(device), Asked::OfBodies(arrays)) => device.sample(at, steps, arrays),
            _ => Err(CrowdError::BrokenTables), // cannot happen: `asked` makes those of the device
        }
    }

    fn export(
        &self,
        at: &[(u32, u32)],
        steps: Option<&[FrameStep]>,
        asked: &Asked,
    ) -> Arrays<ExportedResult> {
        match (self, asked) {
            (Self::Skeleton(device), Asked::OfJoints(arrays, rotations)) => {
                device.export(at, steps, arrays, *rotations)
            }
            (Self::Robot(device), Asked::OfBodies(arrays)) => device.export(at, steps, arrays),
            _ => Err(CrowdError::BrokenTables), // as above
        }
    }
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
            let device = || match &of_tables.tables {
                Tables::Skeleton(_) => {
                    let device = tumble::crowd::DeviceMotions::new(&engine, tables, parts);
                    device.map(OnDevice::Skeleton)
                }
                Tables::Robot(tables) => {
                    DeviceBodies::new(&engine, tables, parts).map(OnDevice::Robot)
                }
            };
            guarded(|| device().map_err(of_crowd))
        })?;
        let is_on_card = py.detach(|| {
            let none = device.asked(&[], Encoding::F32)?;
            guarded(|| match device.export(&[], None, &none) {
                Ok((result, _)) => is_on_card(result),
                Err(CrowdError::Vulkan(VulkanError::NoExport { .. })) => Ok(false),
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
        let encoding = match rotations {
            "quaternion" => Encoding::F32,
            other => encoding_named(other, EncodingOptions::default())?,
        };
        let asked = self.device.asked(&names, encoding)?;
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
        // The numbers of an instance in each array, as the axes of its shape.
        let axes: Vec<Vec<usize>> = match (&asked, &motions.tables) {
            (Asked::OfBodies(arrays), Tables::Robot(tables)) => {
                let frames = tables.frames();
                let of = |array: &BodyArray| match array.is_of_joints() {
                    true => vec![frames.scalar_count()],
                    false => vec![frames.body_count(), array.numbers()],
                };
                arrays.iter().map(of).collect()
            }
            (Asked::OfJoints(arrays, rotations), _) => {
                if arrays.iter().any(are_placed) {
                    motions.check_placed(&at)?;
                }
                let of = |array: &StateArray| {
                    [&[motions.joints()][..], array.encoding(*rotations).shape()].concat()
                };
                arrays.iter().map(of).collect()
            }
            _ => Vec::new(),
        };
        let work = || match self.is_on_card {
            true => {
                let made = self.device.export(&at, steps.as_deref(), &asked);
                let (result, ranges) = made.map_err(of_crowd)?;
                let memory = ArrayMemory::on_card(result).map_err(|error| of_cuda(&error))?;
                Ok((memory, ranges))
            }
            false => {
                let made = self.device.sample(&at, steps.as_deref(), &asked);
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
        let array = |(axes, range): (&Vec<usize>, std::ops::Range<usize>)| {
            let shape = [&shape[..], axes].concat();
            DeviceArray::within(&memory, range.start, shape)
        };
        Ok(axes.iter().zip(ranges).map(array).collect())
    }
}
