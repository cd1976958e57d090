//! What goes out: float32 in NumPy's own memory.

use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays::{is_aligned, numpy};
use crate::errors::input;

/// An array for a result of that shape: a fresh one, or `out`, if it is exactly what is needed and
/// none of `inputs` lies in its memory.
pub(crate) fn array<'py>(
    py: Python<'py>,
    shape: &[usize],
    out: Option<&Bound<'py, PyAny>>,
    inputs: &[&Bound<'py, PyAny>],
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let Some(out) = out else {
        return fresh(py, shape);
    };
    let Ok(given) = out.cast::<PyUntypedArray>() else {
        let kind = out.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "out: a {kind}; give an array of NumPy's, such as np.empty({}, np.float32)",
            shown(shape)
        )));
    };
    let Ok(array) = out.cast::<PyArrayDyn<f32>>() else {
        return Err(input(format!(
            "out: its type is {}; results are float32 in the machine's byte order",
            given.dtype()
        )));
    };
    if array.shape() != shape {
        return Err(input(format!(
            "out: its shape is {}; the result's is {}",
            shown(array.shape()),
            shown(shape)
        )));
    }
    if !array.is_c_contiguous() {
        return Err(input(
            "out: its numbers do not lie one behind the other (C order); a view of some of an \
             array, or a transposed one, cannot be written to",
        ));
    }
    if !is_aligned(array.data() as usize, &[], 4) {
        return Err(input("out: its memory is not aligned to 4 bytes"));
    }
    for &other in inputs {
        let shares = numpy(py)?.call_method1(intern!(py, "shares_memory"), (out, other));
        // What is no array shares nothing.
        if shares.is_ok_and(|shares| shares.is_truthy().unwrap_or(false)) {
            return Err(input(
                "out: its memory is an input's, which would be overwritten; give other memory",
            ));
        }
    }
    Ok(array.clone())
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

/// `(3, 61, 4)`, as Python writes it.
fn shown(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => {
            let axes: Vec<String> = shape.iter().map(usize::to_string).collect();
            format!("({})", axes.join(", "))
        }
    }
}

/// Hands the memory of an array to `work`, which runs without the interpreter's lock.
pub(crate) fn filled(
    array: &Bound<'_, PyArrayDyn<f32>>,
    work: impl FnOnce(&mut [f32]) -> PyResult<()> + Send,
) -> PyResult<()> {
    let refused = |error: numpy::BorrowError| match error {
        numpy::BorrowError::NotWriteable => input("out: it is read-only"),
        _ => input("out: another call writes to this memory at this moment"),
    };
    let mut memory = array.try_readwrite().map_err(refused)?;
    let numbers = memory.as_slice_mut()?;
    array.py().detach(|| work(numbers))
}
