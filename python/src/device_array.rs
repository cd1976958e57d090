//! `tumble.DeviceArray`: a result that stays on the card.

use std::sync::Arc;

use pyo3::exceptions::PyBufferError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tumble::ComponentType;
use tumble::vulkan::ExportedResult;

use crate::arrays::numpy;
use crate::cuda::{CudaError, DEFAULT_STREAM, Mapping};
use crate::dlpack::{self, CPU, CUDA};
use crate::errors::{device, guarded};
use crate::output::{array_of, filled_bytes, type_name};

/// A result in the memory of an NVIDIA card, made by `Engine.evaluate(…, device_array=True)` there:
/// `torch.from_dlpack`, `cupy.from_dlpack` and `jax.dlpack.from_dlpack` import it without a copy, and so do libraries
/// that use `__cuda_array_interface__`. The card may still be writing the result. The stream that imports it waits for
/// the card; your Python code does not. All imported tensors share its memory, which is freed after the last of them.
///
/// >>> import tumble, torch  # doctest: +SKIP
/// >>> clip = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [0, 0, 1, 0]])  # doctest: +SKIP
/// >>> q = tumble.Engine("vulkan").evaluate(clip, fps=24, device_array=True)  # doctest: +SKIP
/// >>> q, torch.from_dlpack(q).device  # doctest: +SKIP
/// (DeviceArray(shape=(1, 25, 4), dtype=float32, device='cuda:0'), device(type='cuda', index=0))
#[pyclass(frozen, weakref, module = "tumble")]
pub(crate) struct DeviceArray {
    mapping: Arc<Mapping>,
    shape: Vec<usize>,
    component: ComponentType,
}

/// CUDA's refusal, with the remedy in Python.
fn of_cuda(error: &CudaError) -> PyErr {
    device(&format!(
        "device_array: {error}; without device_array=True results are arrays of NumPy's"
    ))
}

impl DeviceArray {
    /// The array of a result of that shape. Called without the interpreter's lock.
    pub(crate) fn new(
        result: ExportedResult,
        shape: Vec<usize>,
        component: ComponentType,
    ) -> PyResult<Self> {
        let mapping = Mapping::new(result).map_err(|error| of_cuda(&error))?;
        Ok(Self {
            mapping: Arc::new(mapping),
            shape,
            component,
        })
    }

    /// Lets a stream wait for the result, as the standard of arrays numbers streams: none is the default one.
    fn order(&self, stream: Option<i64>) -> PyResult<()> {
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
        (self.mapping.order(stream)).map_err(|error| of_cuda(&error))
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

    /// How readers are ordered after the card's writing: "stream" if the stream that takes the array waits for it,
    /// "host" if the host has waited already, because the Vulkan device exports no semaphore or CUDA takes none.
    #[getter]
    fn waited_by(&self) -> &'static str {
        match self.mapping.is_ordered_by_streams() {
            true => "stream",
            false => "host",
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
        let ordinal = self.mapping.ordinal;
        match dl_device {
            Some((CPU, _)) if copy != Some(false) => {
                return self.numpy(py)?.call_method0("__dlpack__");
            }
            None => {}
            Some(there) if there == (CUDA, ordinal) => {}
            Some(there) => {
                return Err(PyBufferError::new_err(format!(
                    "dl_device: the array is on (2, {ordinal}), not on {there:?}; import it there, and then copy it"
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
        let (mapping, shape) = (&self.mapping, &self.shape);
        dlpack::capsule(py, mapping, shape, self.component, is_versioned)
    }

    /// Where it is: (2, the card's number among those that CUDA sees).
    fn __dlpack_device__(&self) -> (i32, i32) {
        (CUDA, self.mapping.ordinal)
    }

    /// Numba's interface, version 3. The library that takes the array lets its stream wait for the one that is named there.
    #[getter]
    fn __cuda_array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.order(None)?;
        let interface = PyDict::new(py);
        interface.set_item("shape", self.shape(py)?)?;
        interface.set_item("typestr", self.dtype(py)?.getattr("str")?)?;
        interface.set_item("data", (self.mapping.address(), false))?;
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
            guarded(|| (self.mapping.copy_to_host(bytes)).map_err(|error| of_cuda(&error)))
        })?;
        Ok(array)
    }

    fn __len__(&self) -> usize {
        self.shape[0]
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!(
            "DeviceArray(shape={}, dtype={}, device='cuda:{}')",
            self.shape(py)?.repr()?,
            type_name(self.component),
            self.mapping.ordinal
        ))
    }
}
