//! `tumble.Sampler`: single samples and poses of a clip.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::Quantity;
use tumble::names::counted;

use crate::arrays::{Order, number};
use crate::clip::Clip;
use crate::engine::default_engine;
use crate::errors::{guarded, input, of_engine, warn};
use crate::evaluate::curve_warnings;
use crate::options::EvaluationKeywords;
use crate::output::{array, filled};
use crate::run::work;

/// Evaluates a clip at one time after another, for loops that need one pose at a time. Made by `Clip.sampler`.
///
/// Every value has the bits that `Clip.evaluate` gives at the same times. Times may be in any order; it is
/// fastest if most are near the one before. Threads may share a sampler, but wait for each other; a copy
/// (`copy.copy`) is independent.
///
/// >>> import tumble
/// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [1, 0, 0, 0]], names=["hip"])
/// >>> sampler = clip.sampler(method="slerp")
/// >>> sampler.sample("hip", 1.0).round(4)
/// array([0.7071, 0.    , 0.    , 0.7071], dtype=float32)
/// >>> sampler.pose(1.0).shape
/// (1, 4)
#[pyclass(frozen, weakref, module = "tumble")]
pub(crate) struct Sampler {
    clip: Clip,
    sampler: Mutex<tumble::Sampler>,
}

impl Sampler {
    /// Makes a sampler of a clip from the keywords of `Clip.sampler`.
    pub(crate) fn of(
        clip: &Bound<'_, Clip>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let py = clip.py();
        let request = EvaluationKeywords::new(options)?;
        if request.samples.is_some() {
            return Err(input(
                "a sampler is given its times later; leave out `fps`, `at`, `start` and `end`",
            ));
        }
        if request.outside().leaves_out() != [false; 2] {
            return Err(input(
                "before and after: a sampler has a value at every time, and leaves none out",
            ));
        }
        let clip = clip.get().clone();
        let motion = &clip.motion;
        warn(py, &curve_warnings(py, motion, &request, usize::MAX)?)?;
        let engine = default_engine(py)?.get().engine_for(0)?;
        let (set, keys) = (Arc::clone(motion), motion.set.key_count());
        let interpolations = request.methods(Quantity::Rotation).interpolations(motion);
        let sampler = work(py, keys, move || {
            let uploaded = engine.upload(&set.set, interpolations);
            let sampler = uploaded.and_then(|clip| clip.sampler());
            sampler.map_err(|error| of_engine(&error))
        })?;
        let sampler = Mutex::new(sampler);
        Ok(Self { clip, sampler })
    }

    /// Locks the sampler, also after a panic in another thread: its cursors are only hints, which are checked.
    fn locked(&self) -> MutexGuard<'_, tumble::Sampler> {
        self.sampler.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Converts a time of the clip, or of its file's clock, to the clip's time [s].
    fn time(&self, time: &Bound<'_, PyAny>) -> PyResult<f64> {
        let time = number(time, "time", "seconds")?;
        Ok(self.clip.motion.time_in_set(time))
    }
}

#[pymethods]
impl Sampler {
    /// The number of tracks.
    fn __len__(&self) -> usize {
        self.clip.motion.set.track_count()
    }

    /// The memory that the clip takes for each key, in bytes: if the clip keeps segments, 64 or more for arcs (slerp),
    /// and 144 to 208 or more for polynomials; if the clip keeps its keys instead, 16 or more.
    ///
    /// >>> import tumble
    /// >>> sampler = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [1, 0, 0, 0]]).sampler(method="slerp")
    /// >>> sampler.bytes_per_key > 16
    /// True
    #[getter]
    fn bytes_per_key(&self) -> f64 {
        self.locked().bytes_per_key()
    }

    fn __repr__(&self) -> String {
        format!("Sampler({})", counted(self.__len__(), "track"))
    }

    /// An independent sampler of the same clip.
    fn __copy__(&self) -> Self {
        let sampler = Mutex::new(self.locked().clone());
        Self {
            clip: self.clip.clone(),
            sampler,
        }
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.__copy__()
    }

    /// The rotation of a track, by its index or name, at a time in seconds: float32, (4,), a unit quaternion.
    /// `order`: "xyzw" or "wxyz".
    ///
    /// >>> import tumble
    /// >>> sampler = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [1, 0, 0, 0]]).sampler(method="slerp")
    /// >>> sampler.sample(0, 2.0, order="wxyz")
    /// array([0., 1., 0., 0.], dtype=float32)
    #[pyo3(signature = (track, time, *, order="xyzw"))]
    fn sample<'py>(
        &self,
        track: &Bound<'py, PyAny>,
        time: &Bound<'py, PyAny>,
        order: &str,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let order = Order::named(order)?;
        let (track, at) = (self.clip.track(track)?, self.time(time)?);
        let value = self.locked().sample(track, at);
        let value = value.map_err(|error| of_engine(&error))?;
        let result = array(time.py(), &[4], None, &[])?;
        filled(&result, |numbers| {
            numbers.copy_from_slice(&order.of_xyzw(value.to_array()));
            Ok(())
        })?;
        Ok(result)
    }

    /// The rotations at a time in seconds: float32, (tracks, 4), unit quaternions.
    ///
    /// `tracks`: a list of indices or names; all if it is left out. `out`: a C-contiguous array of that shape, which is
    /// filled and returned. `order`: "xyzw" or "wxyz".
    ///
    /// >>> import numpy as np, tumble
    /// >>> sampler = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [1, 0, 0, 0]]).sampler(method="slerp")
    /// >>> out = np.empty((1, 4), np.float32)
    /// >>> sampler.pose(2.0, out=out) is out
    /// True
    #[pyo3(signature = (time, *, tracks=None, out=None, order="xyzw"))]
    fn pose<'py>(
        &self,
        time: &Bound<'py, PyAny>,
        tracks: Option<Vec<Bound<'py, PyAny>>>,
        out: Option<&Bound<'py, PyAny>>,
        order: &str,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let (order, at) = (Order::named(order)?, self.time(time)?);
        let tracks: Option<Vec<usize>> = tracks
            .map(|tracks| tracks.iter().map(|track| self.clip.track(track)).collect())
            .transpose()?;
        let count = tracks.as_ref().map_or(self.__len__(), Vec::len);
        let result = array(time.py(), &[count, 4], out, &[])?;
        filled(&result, |numbers| {
            guarded(|| {
                let (values, _) = numbers.as_chunks_mut::<4>();
                let mut sampler = self.locked();
                let sampled = match &tracks {
                    Some(tracks) => sampler.pose_of(tracks, at, values),
                    None => sampler.pose(at, values),
                };
                sampled.map_err(|error| of_engine(&error))?;
                for value in values {
                    *value = order.of_xyzw(*value);
                }
                Ok(())
            })
        })?;
        Ok(result)
    }
}
