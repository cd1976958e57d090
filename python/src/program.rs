//! The program and its parts: `python -m tumble`, devices, methods, the page of `tumble view`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::METHODS;
use tumble_cli::host;

use crate::errors::{device, guarded, in_python, input};
use crate::output::rotation_encodings;
use crate::run::interruptible;
use crate::save::clips_of;

/// Runs the program `tumble` with these arguments, the first of which is its name; gives its exit
/// code.
#[pyfunction]
pub(crate) fn run(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| host::run(arguments))
}

/// Says which command loads the Vulkan drivers in a process of its own, where one that crashes does
/// no harm.
#[pyfunction]
pub(crate) fn set_probe(command: Vec<OsString>) {
    host::set_probe(command);
}

/// Loads the Vulkan drivers, in a process that the package starts for this.
#[pyfunction]
pub(crate) fn load_drivers(py: Python<'_>) {
    py.detach(host::load_drivers);
}

/// The names of the Vulkan devices, in the order of their indices; empty where there is no Vulkan.
///
/// >>> import tumble
/// >>> isinstance(tumble.devices(), list)
/// True
#[pyfunction]
pub(crate) fn devices(py: Python<'_>) -> PyResult<Vec<String>> {
    interruptible(py, || {
        let devices = host::devices().unwrap_or_default();
        Ok(devices
            .iter()
            .map(|device| device.name().to_owned())
            .collect())
    })
}

/// The names of the methods, each with a short description.
///
/// >>> import tumble
/// >>> tumble.methods()["slerp"]
/// 'constant angular velocity between keys; velocity jumps at each key'
#[pyfunction]
pub(crate) fn methods(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let found = PyDict::new(py);
    for method in METHODS {
        found.set_item(method.name, method.summary)?;
    }
    Ok(found)
}

/// The names of the representations of rotations (`Engine.encoded`), each with a short description.
///
/// >>> import tumble
/// >>> tumble.encodings()["axis-angle"]
/// 'x y z of the axis, and degrees, 0 to 360'
#[pyfunction]
pub(crate) fn encodings(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let found = PyDict::new(py);
    for encoding in rotation_encodings() {
        found.set_item(encoding.name(), encoding.summary())?;
    }
    Ok(found)
}

/// The page of `tumble view` with some clips, as HTML that needs nothing beside it.
#[pyfunction]
pub(crate) fn page(
    py: Python<'_>,
    clips: &Bound<'_, PyAny>,
    options: Vec<String>,
) -> PyResult<String> {
    let clips = clips_of(clips)?;
    let source = clips.first().and_then(|clip| clip.source.clone());
    let path = source
        .as_ref()
        .map_or(PathBuf::from("clip"), |source| source.path.clone());
    let motions = clips.iter().map(|clip| (*clip.motion).clone()).collect();
    let box_length = source.and_then(|source| source.box_length);
    interruptible(py, move || {
        let made = host::page(Path::new(&path), motions, box_length, &options);
        made.map_err(|refused| match refused.is_usage {
            true => input(in_python(&refused.message)),
            false => device(&refused.message),
        })
    })
}

/// Panics, so that tests see how panics are reported.
#[pyfunction]
pub(crate) fn panic() -> PyResult<()> {
    guarded(|| panic!("asked for"))
}
