//! Pickles of results: each is a tuple of its fields.

use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::PyClass;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::True;
use pyo3::types::{PyString, PyTuple};

use crate::errors::input;

/// A result that can be pickled.
pub(crate) trait Value:
    PyClass<Frozen = True> + Sync + Into<PyClassInitializer<Self>>
{
    /// The fields as Python objects.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>>;

    /// The value with these fields.
    fn of_state(state: &Bound<'_, PyTuple>) -> PyResult<Self>;
}

/// Implements [`Value`] for a class by its fields.
macro_rules! value {
    ($type:ident { $($field:ident),+ $(,)? }) => {
        impl $crate::values::Value for $type {
            fn state<'py>(
                &self,
                py: pyo3::Python<'py>,
            ) -> pyo3::PyResult<pyo3::Bound<'py, pyo3::types::PyTuple>> {
                use pyo3::IntoPyObjectExt;
                pyo3::types::PyTuple::new(py, [$(self.$field.clone().into_bound_py_any(py)?),+])
            }

            fn of_state(state: &pyo3::Bound<'_, pyo3::types::PyTuple>) -> pyo3::PyResult<Self> {
                use pyo3::types::{PyAnyMethods, PyTupleMethods};
                let mut fields = state.iter();
                let mut field = || fields.next().ok_or_else($crate::values::broken);
                Ok(Self { $($field: field()?.extract()?),+ })
            }
        }
    };
}
pub(crate) use value;

/// The error for a pickle that this version of the package did not write.
pub(crate) fn broken() -> PyErr {
    input("the pickle of a result is broken, or of another version of tumble")
}

/// The result of `__reduce__`: the function that restores a value, and its arguments.
pub(crate) type Pickled<'py> = (
    Bound<'py, PyAny>,
    (Bound<'py, PyString>, Bound<'py, PyTuple>),
);

/// Pickles a value: `__reduce__` of its class.
pub(crate) fn pickled<'py, T: Value>(value: &Bound<'py, T>) -> PyResult<Pickled<'py>> {
    let py = value.py();
    let again = py.import("tumble._tumble")?.getattr("value_of_state")?;
    let name = value.as_any().get_type().name()?;
    Ok((again, (name, value.get().state(py)?)))
}

/// Rows of `N` numbers as an array of shape (rows, N).
pub(crate) fn rows<T: Element>(
    py: Python<'_>,
    numbers: Vec<T>,
    each: usize,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = numbers.len() / each;
    PyArray1::from_vec(py, numbers).reshape([count, each])
}

/// The rows of an array of shape (rows, N).
pub(crate) fn chunks<T: Element + Copy, const N: usize>(
    of: &Bound<'_, PyAny>,
) -> PyResult<Vec<[T; N]>> {
    let array: PyReadonlyArray2<'_, T> = of.extract()?;
    let array = array.as_array();
    let row = |row: numpy::ndarray::ArrayView1<'_, T>| -> PyResult<[T; N]> {
        let numbers: Vec<T> = row.iter().copied().collect();
        numbers.try_into().map_err(|_| broken())
    };
    array.outer_iter().map(row).collect()
}

/// The numbers of a one-dimensional array.
pub(crate) fn list<T: Element + Copy>(of: &Bound<'_, PyAny>) -> PyResult<Vec<T>> {
    let array: PyReadonlyArray1<'_, T> = of.extract()?;
    Ok(array.as_array().iter().copied().collect())
}
