//! Arguments: arrays of NumPy with any layout in memory, lists, and objects that
//! NumPy makes arrays of.

use glam::{DQuat, DVec3, Quat};
use numpy::{
    PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::conversion::FromPyObjectOwned;
use pyo3::exceptions::{PyMemoryError, PyOverflowError, PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyFloat, PyInt, PyList, PyString, PyTuple};
use tumble_formats::quaternion::{ComponentOrder, nearest_unit};

use crate::errors::{expected, has_attribute, input};
use crate::names::option_named;

/// The order of a quaternion's components.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    Xyzw,
    Wxyz,
}

impl Order {
    pub(crate) fn named(name: &str) -> PyResult<Self> {
        Ok(match option_named(name, "order")? {
            ComponentOrder::Xyzw => Self::Xyzw,
            ComponentOrder::Wxyz => Self::Wxyz,
        })
    }

    pub(crate) fn xyzw<T: Copy>(self, [a, b, c, d]: [T; 4]) -> [T; 4] {
        match self {
            Self::Xyzw => [a, b, c, d],
            Self::Wxyz => [b, c, d, a],
        }
    }

    /// Components of this order, from `x y z w`.
    pub(crate) fn of_xyzw<T: Copy>(self, [x, y, z, w]: [T; 4]) -> [T; 4] {
        match self {
            Self::Xyzw => [x, y, z, w],
            Self::Wxyz => [w, x, y, z],
        }
    }
}

/// Numbers with a shape, in C order.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ArrayValues<T> {
    pub(crate) shape: Vec<usize>,
    pub(crate) values: Vec<T>,
}

/// A borrowed float32 or float64 array, which is used without a conversion.
enum Array<'py> {
    Single(PyReadonlyArrayDyn<'py, f32>),
    Double(PyReadonlyArrayDyn<'py, f64>),
}

impl Array<'_> {
    fn shape(&self) -> &[usize] {
        match self {
            Self::Single(array) => array.shape(),
            Self::Double(array) => array.shape(),
        }
    }
}

/// The `numpy` module.
pub(crate) fn numpy(py: Python<'_>) -> PyResult<&Bound<'_, PyModule>> {
    static MODULE: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let module = MODULE.get_or_try_init(py, || py.import("numpy").map(Bound::unbind))?;
    Ok(module.bind(py))
}

/// Converts an object to a NumPy array: the array itself, or by the array protocol or DLPack.
fn as_array<'py>(value: &Bound<'py, PyAny>, label: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
    let py = value.py();
    if let Ok(array) = value.cast_exact::<PyUntypedArray>() {
        return Ok(array.clone());
    }
    if value.is_instance_of::<PyUntypedArray>() && value.hasattr(intern!(py, "mask"))? {
        return Err(input(format!(
            "{label}: a masked array; fill or remove the masked elements"
        )));
    }
    let speaks_dlpack = value.hasattr(intern!(py, "__dlpack__"))?;
    let name = match speaks_dlpack && !value.hasattr(intern!(py, "__array__"))? {
        true => intern!(py, "from_dlpack"),
        false => intern!(py, "asarray"),
    };
    let made = numpy(py)?.call_method1(name, (value,));
    let made = made.map_err(|error| match error.is_instance_of::<PyValueError>(py) {
        true => input(format!(
            "{label}: it cannot be converted to an array: {error}"
        )),
        false => error,
    })?;
    Ok(made.cast_into::<PyUntypedArray>()?)
}

/// The numbers of an array; those of other types than float32 and float64 are converted.
fn array<'py>(value: &Bound<'py, PyAny>, label: &str) -> PyResult<Array<'py>> {
    let untyped = as_array(value, label)?;
    if let Some(array) = borrowed(untyped.as_any())? {
        return Ok(array);
    }
    let kind = untyped.dtype().kind();
    if !matches!(kind, b'f' | b'i' | b'u') {
        return Err(input(format!(
            "{label}: its type is {}; give float32 or float64",
            untyped.dtype()
        )));
    }
    check_room::<f64>(untyped.len(), label)?;
    let converted = untyped.call_method1(intern!(value.py(), "astype"), ("float64",))?;
    borrowed(&converted)?.ok_or_else(|| input(format!("{label}: it is not an array of numbers")))
}

/// The array, if its type and alignment allow to read it without a copy.
fn borrowed<'py>(value: &Bound<'py, PyAny>) -> PyResult<Option<Array<'py>>> {
    let of_borrow = |error: numpy::BorrowError| PyValueError::new_err(error.to_string());
    if let Ok(array) = value.cast::<PyArrayDyn<f32>>()
        && is_aligned(array.data() as usize, array.strides(), 4)
    {
        return Ok(Some(Array::Single(
            array.try_readonly().map_err(of_borrow)?,
        )));
    }
    if let Ok(array) = value.cast::<PyArrayDyn<f64>>()
        && is_aligned(array.data() as usize, array.strides(), 8)
    {
        return Ok(Some(Array::Double(
            array.try_readonly().map_err(of_borrow)?,
        )));
    }
    Ok(None)
}

pub(crate) fn is_aligned(start: usize, strides: &[isize], to: usize) -> bool {
    start.is_multiple_of(to)
        && strides
            .iter()
            .all(|stride| stride.unsigned_abs().is_multiple_of(to))
}

/// The numbers as a slice of the array's memory, if this is in C order. (`as_slice` also accepts Fortran order.)
fn in_order<'a, T: numpy::Element>(array: &'a PyReadonlyArrayDyn<'_, T>) -> Option<&'a [T]> {
    array.as_slice().ok().filter(|_| array.is_c_contiguous())
}

/// Numbers of any shape, in f64.
pub(crate) fn doubles(value: &Bound<'_, PyAny>, label: &str) -> PyResult<ArrayValues<f64>> {
    let array = array(value, label)?;
    let shape = array.shape().to_vec();
    let mut values = room(shape.iter().product(), label)?;
    match &array {
        Array::Single(array) => values.extend(array.as_array().iter().map(|&it| f64::from(it))),
        Array::Double(array) => match in_order(array) {
            Some(slice) => values.extend_from_slice(slice),
            None => values.extend(array.as_array().iter()),
        },
    }
    Ok(ArrayValues { shape, values })
}

/// Points, the last axis with 3 coordinates, and the shape before it.
pub(crate) fn vectors(value: &Bound<'_, PyAny>, name: &str) -> PyResult<(Vec<usize>, Vec<DVec3>)> {
    let ArrayValues { mut shape, values } = doubles(value, name)?;
    if shape.pop() != Some(3) {
        return Err(input(format!(
            "{name}: the last axis has the 3 coordinates of a point"
        )));
    }
    let points = values.as_chunks::<3>().0.iter();
    Ok((
        shape,
        points.map(|&point| DVec3::from_array(point)).collect(),
    ))
}

/// Whether an object converts to a number, but is none: True and False, and durations of NumPy's, whose number is that of
/// their unit.
fn is_no_number(value: &Bound<'_, PyAny>) -> PyResult<bool> {
    let kind = value.get_type().name()?;
    let kinds = ["bool", "bool_", "timedelta64", "datetime64"];
    Ok(kinds.iter().any(|name| kind == *name))
}

/// One finite number.
pub(crate) fn number(value: &Bound<'_, PyAny>, label: &str, unit: &str) -> PyResult<f64> {
    if is_no_number(value)? {
        let shown = value.repr()?;
        return Err(PyTypeError::new_err(format!(
            "{label}: {shown} is no number; give {unit}, as a number"
        )));
    }
    let number: f64 = value.extract().map_err(|error| {
        expected(value.py(), error, || {
            format!("{label}: give {unit}, as a number")
        })
    })?;
    match number.is_finite() {
        true => Ok(number),
        false => Err(input(format!("{label}: {number} is not finite"))),
    }
}

/// A whole number from 0 on; True and False are none.
pub(crate) fn whole_number<T: TryFrom<u64>>(
    value: &Bound<'_, PyAny>,
    label: &str,
    meaning: &str,
) -> PyResult<T> {
    let refused = || {
        let shown = value
            .repr()
            .map_or_else(|_| String::new(), |text| format!("{text}: "));
        format!("{label}: {shown}give {meaning}, as a whole number from 0 on")
    };
    if is_no_number(value)? {
        return Err(PyTypeError::new_err(refused()));
    }
    match value.extract::<u64>() {
        Ok(number) => T::try_from(number).map_err(|_| input(refused())),
        Err(error) if error.is_instance_of::<PyOverflowError>(value.py()) => Err(input(refused())),
        Err(error) => Err(expected(value.py(), error, refused)),
    }
}

/// Quaternions: an array whose last axis has four components, or rotations of `SciPy`'s, which are
/// always x y z w.
pub(crate) fn quaternions(
    value: &Bound<'_, PyAny>,
    order: Order,
    label: &str,
) -> PyResult<ArrayValues<Quat>> {
    if !value.is_instance_of::<PyUntypedArray>()
        && let Some(as_quat) = value.getattr_opt(intern!(value.py(), "as_quat"))?
    {
        return components(&as_quat.call0()?, Order::Xyzw, label);
    }
    components(value, order, label)
}

fn components(value: &Bound<'_, PyAny>, order: Order, label: &str) -> PyResult<ArrayValues<Quat>> {
    let array = array(value, label)?;
    let mut shape = array.shape().to_vec();
    if shape.pop() != Some(4) {
        return Err(input(format!(
            "{label}: its shape is {:?}; the last axis has the 4 components of a quaternion",
            array.shape()
        )));
    }
    let single = |of: [f32; 4]| Quat::from_array(order.xyzw(of));
    let double = |of: [f64; 4]| unit(DQuat::from_array(order.xyzw(of)));
    let mut values = room(shape.iter().product(), label)?;
    match &array {
        Array::Single(array) => match in_order(array) {
            Some(slice) => values.extend(slice.as_chunks().0.iter().copied().map(single)),
            None => values.extend(fours(array.as_array().iter().copied(), single)),
        },
        Array::Double(array) => values.extend(fours(array.as_array().iter().copied(), double)),
    }
    Ok(ArrayValues { shape, values })
}

fn fours<T: Copy + Default>(
    mut numbers: impl ExactSizeIterator<Item = T>,
    make: impl Fn([T; 4]) -> Quat,
) -> impl Iterator<Item = Quat> {
    let count = numbers.len() / 4;
    let next = move |_| make([(); 4].map(|()| numbers.next().unwrap_or_default()));
    (0..count).map(next)
}

/// From this number of bytes, free memory is checked first, because the system may promise more memory than it has.
const LARGE: usize = 1 << 28;

/// Allocates memory for the values of an argument. This may fail: a broadcast array may have more elements than memory
/// has room for, because its elements share memory.
pub(crate) fn room<T>(count: usize, label: &str) -> PyResult<Vec<T>> {
    check_room::<T>(count, label)?;
    let mut values = Vec::new();
    match values.try_reserve_exact(count) {
        Ok(()) => Ok(values),
        Err(_) => Err(no_room::<T>(count, label)),
    }
}

/// Fails if the system has too little memory for this number of values.
fn check_room<T>(count: usize, label: &str) -> PyResult<()> {
    let bytes = count.saturating_mul(size_of::<T>());
    let is_small = bytes < LARGE;
    match is_small || tumble::available_memory().is_none_or(|there| bytes as u64 <= there) {
        true => Ok(()),
        false => Err(no_room::<T>(count, label)),
    }
}

fn no_room<T>(count: usize, label: &str) -> PyErr {
    let bytes = count as u128 * size_of::<T>() as u128;
    PyMemoryError::new_err(format!(
        "{label}: {count} values take {bytes} bytes, and there is less memory"
    ))
}

/// Reads an argument that is a list or another sequence.
pub(crate) struct ListArgument<T>(pub(crate) Vec<T>);

/// After this number of elements, Ctrl-C is checked, because reading elements may call no Python code that would do so.
const ELEMENTS: usize = 1 << 16;

impl<'py, T: FromPyObjectOwned<'py>> FromPyObject<'_, 'py> for ListArgument<T> {
    type Error = PyErr;

    fn extract(list: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if list.is_instance_of::<PyString>() {
            return Err(PyTypeError::new_err("a text is no list"));
        }
        let mut values = room(list.len()?, "a list")?;
        for (index, value) in list.try_iter()?.enumerate() {
            if index % ELEMENTS == ELEMENTS - 1 {
                list.py().check_signals()?;
            }
            values.push(value?.extract().map_err(Into::into)?);
        }
        Ok(Self(values))
    }
}

/// Rounded to f32, and normalised before if only rounding made its norm differ from 1; a quaternion that is no
/// rotation is left for the set to refuse.
fn unit(key: DQuat) -> Quat {
    let is_near = (key.length() - 1.0).abs() <= tumble::NORM_TOLERANCE;
    match is_near {
        true => nearest_unit(key),
        false => Quat::from_array(key.to_array().map(|component| component as f32)),
    }
}

/// The parts of a list or tuple whose parts are arrays or lists themselves.
pub(crate) fn parts<'py>(value: &Bound<'py, PyAny>) -> PyResult<Option<Vec<Bound<'py, PyAny>>>> {
    let parts: Vec<Bound<'py, PyAny>> = if let Ok(list) = value.cast::<PyList>() {
        list.iter().collect()
    } else if let Ok(tuple) = value.cast::<PyTuple>() {
        tuple.iter().collect()
    } else {
        return Ok(None);
    };
    let Some(first) = parts.first() else {
        return Ok(None);
    };
    let is_number = first.is_instance_of::<PyFloat>()
        || first.is_instance_of::<PyInt>()
        || has_attribute(first, "ndim")? && first.getattr("ndim")?.eq(0)?;
    Ok((!is_number).then_some(parts))
}

/// Whether any element of a list is an array.
pub(crate) fn has_arrays(parts: &[Bound<'_, PyAny>]) -> PyResult<bool> {
    for part in parts {
        if has_attribute(part, "shape")? {
            return Ok(true);
        }
    }
    Ok(false)
}
