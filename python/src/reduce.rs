//! `tumble.reduce`: motion with few keys.

use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use tumble::reduce::ReducedCurve;
use tumble_formats::motion::ChannelInterpolation;
use tumble_formats::reduce::{ReduceMotionError, ReduceOptions, reduce as reduced};

use crate::clip::Clip;
use crate::engine::{Engine, default_engine};
use crate::errors::{input, of_engine};
use crate::names::option_of;
use crate::options::frame_rate;
use crate::run::interruptible;
use crate::values::{Pickled, pickled, value};

/// A clip with few keys, and how far it is from its samples.
#[pyclass(frozen, eq, weakref, module = "tumble", from_py_object)]
#[derive(Clone, PartialEq)]
pub(crate) struct Reduction {
    clip: Clip,
    keys: [usize; 2],
    bounds: [f64; 2],
    times: Vec<f64>,
    errors: Vec<[f64; 2]>,
}

value!(Reduction {
    clip,
    keys,
    bounds,
    times,
    errors,
});

#[pymethods]
impl Reduction {
    /// The clip with few keys.
    #[getter]
    fn clip(&self) -> Clip {
        self.clip.clone()
    }

    /// Keys of all channels before.
    #[getter]
    fn keys_before(&self) -> usize {
        self.keys[0]
    }

    /// Keys of all channels that are left.
    #[getter]
    fn keys_after(&self) -> usize {
        self.keys[1]
    }

    /// The times of the samples in seconds, (samples,).
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.times)
    }

    /// The largest angle of all joints at each sample in degrees: (samples,).
    #[getter]
    fn angles<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let angles = self.errors.iter().map(|error| error[0].to_degrees());
        PyArray1::from_iter(py, angles)
    }

    /// The largest distance of all joints at each sample, (samples,).
    #[getter]
    fn distances<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.errors.iter().map(|error| error[1]))
    }

    /// The bounds that hold: an angle in degrees, and a distance.
    #[getter]
    fn bounds(&self) -> (f64, f64) {
        let [angle, distance] = self.bounds;
        (angle.to_degrees(), distance)
    }

    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        format!("Reduction({} of {} keys)", self.keys[1], self.keys[0])
    }
}

/// Removes keys from a clip. The curves of the remaining keys are within a tolerance of all samples.
///
/// The samples are the keys of the clip, or its frames at `fps`. At each sample, every joint is within the angle
/// `tolerance` in degrees, and the distance `distance` (None: the arc of this angle at the end of the longest chain of
/// joints). If the clip has a skeleton, this is measured in the world, otherwise for each track. It is checked by
/// evaluating the remaining keys. `shell`: points at this distance from each joint are within `distance` too. `curve`:
/// "linear" (arcs and straight lines), "bessel-overhauser", or "cubic", glTF's. `together`: all tracks keep keys at the
/// same times, as most formats other than glTF require.
///
/// >>> import numpy as np, tumble
/// >>> half = np.linspace(0.0, 0.5, 101)
/// >>> keys = np.stack([np.sin(half), 0 * half, 0 * half, np.cos(half)], axis=-1)
/// >>> found = tumble.reduce(tumble.Clip(np.arange(101) / 30, keys), tolerance=0.01)
/// >>> found.keys_before, found.keys_after, found.angles.max() < 0.01
/// (101, 2, np.True_)
#[pyfunction]
#[pyo3(signature = (
    clip, *, tolerance=0.1, distance=None, shell=0.0, curve=None, together=false, fps=None, engine=None
), text_signature = "(clip, *, tolerance=0.1, distance=None, shell=0.0, curve='linear', together=False, fps=None, engine=None)")]
#[allow(clippy::too_many_arguments, reason = "keywords")]
pub(crate) fn reduce(
    py: Python<'_>,
    clip: &Bound<'_, Clip>,
    tolerance: f64,
    distance: Option<f64>,
    shell: f64,
    curve: Option<&Bound<'_, PyAny>>,
    together: bool,
    fps: Option<&Bound<'_, PyAny>>,
    engine: Option<&Bound<'_, Engine>>,
) -> PyResult<Reduction> {
    let curve: Option<ReducedCurve> = curve.map(|name| option_of(name, "curve")).transpose()?;
    let rate = fps.map(frame_rate).transpose()?;
    let motion = Arc::clone(&clip.get().motion);
    if rate.is_none()
        && motion
            .channels
            .iter()
            .any(|channels| channels.has(ChannelInterpolation::Cubic))
    {
        return Err(input(
            "its keys are connected by cubics with tangents, so the keys alone are not enough; give `fps`",
        ));
    }
    let options = ReduceOptions {
        curve: curve.unwrap_or(ReducedCurve::Linear),
        angle: tolerance.to_radians(),
        distance,
        shell,
        together: together || motion.is_world,
        quantize: None,
    };
    let engine = match engine {
        Some(engine) => engine.get().engine_for(1)?,
        None => default_engine(py)?.get().engine_for(1)?,
    };
    let found = interruptible(py, move || {
        let sampled = match rate {
            Some(rate) => {
                let sampled = motion.sampled_at_rate(&engine, rate);
                Some(sampled.map_err(|error| of_engine(&error))?)
            }
            None => None,
        };
        let motion = sampled.as_ref().unwrap_or(&motion);
        reduced(motion, &engine, &options).map_err(|error| match error {
            ReduceMotionError::Evaluating(error) => of_engine(&error),
            ReduceMotionError::Steps { joint, name } => input(format!(
                "together: joint {joint} (`{name}`) holds each key until the next one, so that its keys \
                 stay at their own times; leave it out"
            )),
            error => input(error.to_string()),
        })
    })?;
    Ok(Reduction {
        clip: clip.get().with_keys(found.clip),
        keys: found.keys,
        bounds: found.bounds,
        times: found.times,
        errors: found.errors,
    })
}
