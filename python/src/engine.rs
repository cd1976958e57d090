//! `tumble.Engine`: one device, kept open.

mod methods;

use std::path::PathBuf;
use std::sync::OnceLock;

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use tumble::{Axes, CacheFiles, EngineOptions, EulerSequence, Layout, UnknownNameError};
use tumble_cli::host;

use crate::errors::{device, input};
use crate::names::{option_named, unknown_value};
use crate::run::interruptible;

/// Below this number of rotations, the CPU finishes before another device is open.
pub(crate) const MIN_DEVICE_ROTATIONS: usize = 1 << 20;

/// Evaluates clips on one device, which stays open.
///
/// `Engine(device="auto", *, memory=None, threads=None, allow_inexact=False, cache=None)`
///
/// * `device`: "auto", the CPU, and for calls of a million rotations or more the device that is measured to be the
///   fastest; "cpu"; "first", the first Vulkan device that is exact, else the CPU; "vulkan"; or a device's index or
///   part of its name (`tumble.devices()`). All give the same bits.
/// * `memory`: the most bytes that segments may take, in the memory of the device.
/// * `threads`: the number of threads of the CPU.
/// * `allow_inexact`: use a device that fails its self-test.
/// * `cache`: the directory in which a Vulkan device's compiled kernels, checks and speed are kept; "off" keeps no
///   files, "user", the default, is `TUMBLE_CACHE_DIR` or the user's cache directory.
///
/// An engine may be used by several threads at once. The interpreter's lock is released while it
/// works, and Ctrl-C ends a long evaluation.
///
/// >>> import tumble
/// >>> engine = tumble.Engine("cpu")
/// >>> engine
/// Engine('CPU')
#[pyclass(frozen, weakref, module = "tumble")]
pub(crate) struct Engine {
    engine: tumble::Engine,
    /// The device for large calls, if `device="auto"`.
    by_cost: Option<OnceLock<(u32, tumble::Engine)>>,
    /// The arguments, with which copies in other processes open their device.
    arguments: EngineArguments,
}

/// The arguments of an engine.
#[derive(Debug, Clone)]
struct EngineArguments {
    device: String,
    memory: Option<u64>,
    threads: Option<usize>,
    allow_inexact: bool,
    /// `None` and "user" are the user's directory, "off" is none, any other is a directory.
    cache: Option<PathBuf>,
}

impl EngineArguments {
    fn options(&self) -> EngineOptions {
        let mut options = EngineOptions::default();
        options.memory = self.memory;
        options.allow_inexact = self.allow_inexact;
        options.thread_count = self.threads;
        options.cache_files = match &self.cache {
            Some(path) if path.as_os_str() == "off" => CacheFiles::Off,
            Some(path) if path.as_os_str() != "user" => CacheFiles::Within(path.clone()),
            _ => CacheFiles::OfUser,
        };
        options
    }
}

/// The engine that functions and methods without one share.
pub(crate) fn default_engine(py: Python<'_>) -> PyResult<&Bound<'_, Engine>> {
    static ENGINE: PyOnceLock<Py<Engine>> = PyOnceLock::new();
    let engine = ENGINE.get_or_try_init(py, || {
        Py::new(py, Engine::new(py, None, None, None, false, None)?)
    })?;
    Ok(engine.bind(py))
}

pub(crate) fn layout_named(name: &str) -> PyResult<Layout> {
    option_named(name, "layout")
}

fn sequence_named(name: &str) -> PyResult<EulerSequence> {
    let sequence = name.parse();
    sequence.map_err(|error| input(format!("sequence: {error}")))
}

/// Parses the keyword `axes`: the axes, and whether the rates are relative to the world, all parents included.
pub(crate) fn axes_named(name: &str) -> PyResult<(Axes, bool)> {
    if name == "world" {
        // The parent of a track without a parent is the world.
        return Ok((Axes::Parent, true));
    }
    let axes = name.parse().map_err(|error: UnknownNameError| {
        let known = [&*error.known, &["world"]].concat();
        unknown_value("axes", name, &known)
    })?;
    Ok((axes, false))
}

impl Engine {
    /// The engine for a call with this number of rotations.
    pub(crate) fn engine_for(&self, rotations: usize) -> PyResult<tumble::Engine> {
        let Some(large) = self
            .by_cost
            .as_ref()
            .filter(|_| rotations >= MIN_DEVICE_ROTATIONS)
        else {
            return Ok(self.engine.clone());
        };
        if let Some((process, large)) = large.get() {
            // A forked process cannot use the device that its parent process has opened.
            return Ok(match *process == std::process::id() {
                true => large.clone(),
                false => self.engine.clone(),
            });
        }
        let options = self.arguments.options();
        let chosen = Python::attach(|py| {
            interruptible(py, move || {
                host::auto(rotations, &options).map_err(|failure| of_host(&failure))
            })
        })?;
        // If two threads chose at the same time, both choices give the same bits.
        let chosen = chosen.unwrap_or_else(|| self.engine.clone());
        let chosen = large.get_or_init(|| (std::process::id(), chosen));
        Ok(chosen.1.clone())
    }
}

/// The exception for a device that cannot be opened.
fn of_host(failure: &host::Refused) -> PyErr {
    match failure.is_usage {
        true => input(&failure.message),
        false => device(&failure.message),
    }
}
