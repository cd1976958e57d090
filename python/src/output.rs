//! Results as arrays of NumPy.

use numpy::{PyArrayDescr, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods};
use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyException, PyTypeError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyTuple};
use tumble::{ComponentType, Encoding, EncodingOptions};

use crate::arrays::{is_aligned, numpy};
use crate::errors::input;
use crate::names::unknown_value;

/// The NumPy type in which a component is stored.
pub(crate) fn type_name(component: ComponentType) -> &'static str {
    match component {
        ComponentType::F32 => "float32",
        ComponentType::F16 => "float16",
        ComponentType::Snorm16 => "int16",
    }
}

/// The representation of rotations that a NumPy type stands for (`dtype="float16"`).
pub(crate) fn quaternions_of(dtype: &Bound<'_, PyAny>) -> PyResult<Encoding> {
    let kind = PyArrayDescr::new(dtype.py(), dtype.clone())?;
    let name = kind.str()?.to_string();
    let mut all = Encoding::kinds().filter(|encoding| encoding.is_quaternion());
    let found = all.find(|encoding| type_name(encoding.component_type()) == name);
    found.ok_or_else(|| {
        input(format!(
            "dtype: there are no rotations in {name}; there are float32, float16, and int16, to be divided by 32767"
        ))
    })
}

/// The representation of rotations with this name and these options.
pub(crate) fn encoding_named(name: &str, options: EncodingOptions) -> PyResult<Encoding> {
    let found = rotation_encodings().find(|encoding| encoding.name() == name);
    found.map(|encoding| encoding.with(options)).ok_or_else(|| {
        let names: Vec<&str> = rotation_encodings().map(Encoding::name).collect();
        unknown_value("encoding", name, &names)
    })
}

/// All representations of rotations, each with its default options.
pub(crate) fn rotation_encodings() -> impl Iterator<Item = Encoding> {
    Encoding::kinds().filter(|encoding| encoding.stores_rotations())
}

/// An array of float32 for a result of that shape: a fresh one, or `out`, if it is exactly what is needed and
/// none of `inputs` lies in its memory.
pub(crate) fn array<'py>(
    py: Python<'py>,
    shape: &[usize],
    out: Option<&Bound<'py, PyAny>>,
    inputs: &[&Bound<'py, PyAny>],
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let array = array_of(py, ComponentType::F32, shape, out, inputs)?;
    Ok(array.cast_into()?)
}

/// Like [`array`], for any type of components.
pub(crate) fn array_of<'py>(
    py: Python<'py>,
    component: ComponentType,
    shape: &[usize],
    out: Option<&Bound<'py, PyAny>>,
    inputs: &[&Bound<'py, PyAny>],
) -> PyResult<Bound<'py, PyAny>> {
    let name = type_name(component);
    let Some(out) = out else {
        return match component {
            ComponentType::F32 => Ok(fresh(py, shape)?.into_any()),
            _ => numpy(py)?.call_method1(intern!(py, "empty"), (PyTuple::new(py, shape)?, name)),
        };
    };
    let Ok(array) = out.cast::<PyUntypedArray>() else {
        let kind = out.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "out: a {kind}; give an array of NumPy's, such as np.empty({}, np.{name})",
            shown(shape)
        )));
    };
    if !array.dtype().is_equiv_to(&PyArrayDescr::new(py, name)?) {
        return Err(input(format!(
            "out: its type is {}; results are {name} in the machine's byte order",
            array.dtype()
        )));
    }
    if array.shape() != shape {
        return Err(input(format!(
            "out: its shape is {}; the result's is {}",
            shown(array.shape()),
            shown(shape)
        )));
    }
    if !array.is_c_contiguous() {
        return Err(input(
            "out: its numbers are not contiguous (C order); a part of an array, or a transposed one, cannot be \
             written to",
        ));
    }
    let (start, bytes) = (address(out)?, component.bytes());
    if !is_aligned(start, &[], bytes) {
        return Err(input(format!(
            "out: its memory is not aligned to {bytes} bytes"
        )));
    }
    for &other in inputs {
        let shares = numpy(py)?.call_method1(intern!(py, "shares_memory"), (out, other));
        let shares = match shares {
            // Only arrays can overlap `out` in memory; other inputs were copied.
            Err(error) if error.is_instance_of::<PyException>(py) => false,
            shares => shares?.is_truthy()?,
        };
        if shares {
            return Err(input(
                "out: its memory is an input's, which would be overwritten; give other memory",
            ));
        }
    }
    Ok(out.clone())
}

/// The address of the first number of an array.
fn address(array: &Bound<'_, PyAny>) -> PyResult<usize> {
    if let Ok(array) = array.cast::<PyArrayDyn<f32>>() {
        return Ok(array.data() as usize);
    }
    let interface = array.getattr(intern!(array.py(), "__array_interface__"))?;
    interface.get_item("data")?.get_item(0)?.extract()
}

fn fresh<'py>(py: Python<'py>, shape: &[usize]) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    static EMPTY: PyOnceLock<(Py<PyAny>, Py<PyDict>)> = PyOnceLock::new();
    let (empty, keywords) = EMPTY.get_or_try_init(py, || {
        let numpy = numpy(py)?;
        let keywords = PyDict::new(py);
        keywords.set_item("dtype", numpy.getattr("float32")?)?;
        PyResult::Ok((numpy.getattr("empty")?.unbind(), keywords.unbind()))
    })?;
    let shape = PyTuple::new(py, shape)?;
    let made = empty.bind(py).call((shape,), Some(keywords.bind(py)))?;
    Ok(made.cast_into()?)
}

/// A shape as Python prints it: `(3, 61, 4)`.
pub(crate) fn shown(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => {
            let axes: Vec<String> = shape.iter().map(usize::to_string).collect();
            format!("({})", axes.join(", "))
        }
    }
}

/// Runs `work`, which fills the memory of an array, without the interpreter's lock.
pub(crate) fn filled(
    array: &Bound<'_, PyArrayDyn<f32>>,
    work: impl FnOnce(&mut [f32]) -> PyResult<()> + Send,
) -> PyResult<()> {
    let mut memory = array.try_readwrite().map_err(refused)?;
    let numbers = memory.as_slice_mut()?;
    array.py().detach(|| work(numbers))
}

fn refused(error: numpy::BorrowError) -> PyErr {
    match error {
        numpy::BorrowError::NotWriteable => input("out: it is read-only"),
        _ => input("out: another call is writing to this memory"),
    }
}

/// Like [`filled`], for an array of any type of components.
pub(crate) fn filled_bytes(
    array: &Bound<'_, PyAny>,
    work: impl FnOnce(&mut [u8]) -> PyResult<()> + Send,
) -> PyResult<()> {
    if let Ok(array) = array.cast::<PyArrayDyn<f32>>() {
        return filled(array, |numbers| work(bytemuck::cast_slice_mut(numbers)));
    }
    // Both types of 16 bits (f16 and normalised integers) are written as u16.
    let numbers = array.call_method1(intern!(array.py(), "view"), ("uint16",))?;
    let numbers = numbers.cast_into::<PyArrayDyn<u16>>()?;
    let mut memory = numbers.try_readwrite().map_err(refused)?;
    let numbers = memory.as_slice_mut()?;
    array
        .py()
        .detach(|| work(bytemuck::cast_slice_mut(numbers)))
}
