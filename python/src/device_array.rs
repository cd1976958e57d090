//! `tumble.DeviceArray`: a result that stays in the memory of a device.

use std::sync::Arc;

use pyo3::exceptions::{PyAttributeError, PyBufferError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tumble::ComponentType;
use tumble::vulkan::ExportedResult;

use crate::array_memory::{ArrayMemory, CPU, CUDA, of_cuda};
use crate::arrays::numpy;
use crate::cuda::DEFAULT_STREAM;
use crate::dlpack;
use crate::errors::guarded;
use crate::output::{array_of, filled_bytes, type_name};

/// A result in the memory of a device, made by `Engine.evaluate(…, device_array=True)` on an NVIDIA card, or by a
/// `MotionLibrary(…, device=…)`: `torch.from_dlpack`, `cupy.from_dlpack` and `jax.dlpack.from_dlpack` import it without a
/// copy, and so do libraries that use `__cuda_array_interface__`. The card may still be writing the result. The stream
/// that imports it waits for the card; your Python code does not. All imported tensors share its memory, which is freed
/// after the last of them.
///
/// Results of a motion library on a device that CUDA does not see are in the host's memory: software devices write
/// them there, and other cards copy them there. `numpy.from_dlpack` imports them without a copy, too.
///
/// >>> import tumble, torch  # doctest: +SKIP
/// >>> clip = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [0, 0, 1, 0]])  # doctest: +SKIP
/// >>> q = tumble.Engine("vulkan").evaluate(clip, fps=24, device_array=True)  # doctest: +SKIP
/// >>> q, torch.from_dlpack(q).device  # doctest: +SKIP
/// (DeviceArray(shape=(1, 25, 4), dtype=float32, device='cuda:0'), device(type='cuda', index=0))
#[pyclass(frozen, weakref, module = "tumble")]
pub(crate) struct DeviceArray {
    memory: Arc<ArrayMemory>,
    /// The offset of the array in the memory in bytes.
    start: usize,
    shape: Vec<usize>,
    component: ComponentType,
}

impl DeviceArray {
    /// The array of a result of that shape. Called without the interpreter's lock.
    pub(crate) fn new(
        result: ExportedResult,
        shape: Vec<usize>,
        component: ComponentType,
    ) -> PyResult<Self> {
        let memory = ArrayMemory::on_card(result).map_err(|error| of_cuda(&error))?;
        Ok(Self {
            memory: Arc::new(memory),
            start: 0,
            shape,
            component,
        })
    }

    /// An array of f32 in memory of several arrays.
    pub(crate) fn within(memory: &Arc<ArrayMemory>, start: usize, shape: Vec<usize>) -> Self {
        Self {
            memory: Arc::clone(memory),
            start,
            shape,
            component: ComponentType::F32,
        }
    }

    /// Lets a stream wait for the result, as the standard of arrays numbers streams: none is the default one.
    fn order(&self, stream: Option<i64>) -> PyResult<()> {
        let ArrayMemory::Card(mapping) = &*self.memory else {
            return Ok(());
        };
        let stream = match stream {
            None => DEFAULT_STREAM,
            Some(-1) => return Ok(()), // the consumer orders its work itself
            Some(0) => {
                return Err(PyBufferError::new_err(
                    "stream: 0 is ambiguous; give 1 (the default stream of all threads) or 2 (the default stream of \
                     each thread)",
                ));
            }
            Some(stream) => usize::try_from(stream).map_err(|_| {
                PyBufferError::new_err(format!(
                    "stream: there is no stream {stream}; give None, -1, 1, 2 or a pointer"
                ))
            })?,
        };
        mapping.order(stream).map_err(|error| of_cuda(&error))
    }
}

#[pymethods]
impl DeviceArray {
    /// The shape, as of a NumPy array.
    #[getter]
    fn shape<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.shape)
    }

    /// The type of the numbers, NumPy's.
    #[getter]
    fn dtype<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        numpy(py)?.call_method1("dtype", (type_name(self.component),))
    }

    /// How readers are ordered after the device's writing: "stream" if the stream that takes the array waits for it,
    /// "host" if the host has waited already: for results in memory of the host, and if the Vulkan device exports no
    /// semaphore or CUDA takes none.
    #[getter]
    fn waited_by(&self) -> &'static str {
        match &*self.memory {
            ArrayMemory::Card(mapping) if mapping.is_ordered_by_streams() => "stream",
            _ => "host",
        }
    }

    /// The array as a capsule of DLPack's. `stream`: the stream that will use it, which waits for the engine: None or
    /// 1, the default one, 2, that of each thread, a pointer, or -1, to wait for nothing. With `max_version` of (1, 0)
    /// or more the capsule has a version. `dl_device`: (1, 0) copies to the host. `copy=True` is refused on the card.
    #[pyo3(signature = (*, stream=None, max_version=None, dl_device=None, copy=None))]
    fn __dlpack__<'py>(
        &self,
        py: Python<'py>,
        stream: Option<i64>,
        max_version: Option<(u32, u32)>,
        dl_device: Option<(i32, i32)>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let here = self.memory.device();
        let is_on_host = here.0 == CPU;
        match dl_device {
            None if is_on_host && copy == Some(true) => {
                return self.numpy(py)?.call_method0("__dlpack__");
            }
            Some((CPU, _)) if copy == Some(true) || (copy.is_none() && !is_on_host) => {
                return self.numpy(py)?.call_method0("__dlpack__");
            }
            None => {}
            Some(there) if there == here => {}
            Some(there) => {
                return Err(PyBufferError::new_err(format!(
                    "dl_device: the array is on {here:?}, not on {there:?}; import it there, and then copy it"
                )));
            }
        }
        if copy == Some(true) {
            return Err(PyBufferError::new_err(
                "copy: the array is shared without a copy; import it, and then copy it",
            ));
        }
        self.order(stream)?;
        let is_versioned = max_version.is_some_and(|(major, _)| major >= 1);
        let located = (&self.memory, self.start);
        dlpack::capsule(py, located, &self.shape, self.component, is_versioned)
    }

    /// Where it is: (2, the card's number among those that CUDA sees), or (1, 0) in memory of the host.
    fn __dlpack_device__(&self) -> (i32, i32) {
        self.memory.device()
    }

    /// Numba's interface, version 3, of an array on a card. The library that takes the array lets its stream wait for the
    /// one that is named there.
    #[getter]
    fn __cuda_array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        if let ArrayMemory::Host(_) = &*self.memory {
            return Err(PyAttributeError::new_err(
                "__cuda_array_interface__: the array is in memory of the host; use numpy.from_dlpack",
            ));
        }
        self.order(None)?;
        let interface = PyDict::new(py);
        interface.set_item("shape", self.shape(py)?)?;
        interface.set_item("typestr", self.dtype(py)?.getattr("str")?)?;
        interface.set_item("data", (self.memory.address() + self.start, false))?;
        interface.set_item("version", 3)?;
        interface.set_item("strides", py.None())?;
        interface.set_item("stream", DEFAULT_STREAM)?;
        Ok(interface)
    }

    /// Copies the result to the host: a NumPy array of the same shape and type.
    ///
    /// >>> tumble.Engine("vulkan").evaluate(clip, fps=24, device_array=True).numpy()  # doctest: +SKIP
    fn numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let array = array_of(py, self.component, &self.shape, None, &[])?;
        filled_bytes(&array, |bytes| {
            guarded(|| self.memory.copy_to_host(self.start, bytes))
        })?;
        Ok(array)
    }

    /// `numpy.asarray` copies the result to the host, too.
    #[pyo3(signature = (dtype=None, copy=None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if copy == Some(false) {
            return Err(PyValueError::new_err(
                "the array is on a device, and NumPy needs a copy of it: leave copy=False out",
            ));
        }
        let array = self.numpy(py)?;
        match dtype {
            Some(dtype) => array.call_method1("astype", (dtype,)),
            None => Ok(array),
        }
    }

    fn __len__(&self) -> PyResult<usize> {
        let first = self.shape.first().copied();
        first.ok_or_else(|| PyTypeError::new_err("len() of an array without axes"))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let device = match self.memory.device() {
            (CUDA, ordinal) => format!("cuda:{ordinal}"),
            _ => "cpu".to_owned(),
        };
        Ok(format!(
            "DeviceArray(shape={}, dtype={}, device='{device}')",
            self.shape(py)?.repr()?,
            type_name(self.component),
        ))
    }
}
