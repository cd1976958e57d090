//! The result of comparing a device with the CPU and with the reference.

use pyo3::prelude::*;
use tumble::verify::{Verdict, verify};
use tumble::{Engine, Quantity, TrackGroup};
use tumble_formats::motion::Motion;

use crate::errors::of_engine;
use crate::options::EvaluationKeywords;
use crate::values::{Pickled, pickled, value};

/// The result of `Engine.verify`.
#[pyclass(frozen, get_all, eq, weakref, module = "tumble", from_py_object)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Verification {
    /// The method; "authored" where tracks have different methods.
    method: String,
    /// The Vulkan device; None on the CPU, where nothing is compared between devices.
    device: Option<String>,
    /// Rotations compared.
    rotations: u64,
    /// Rotations whose bits differ between the device and the CPU.
    differing: u64,
    /// The largest angle between a result and the reference in rad.
    max_error: f64,
    /// The root mean square of that angle in rad.
    rms_error: f64,
    /// The largest distance of a norm from 1.
    max_norm_error: f64,
    /// The largest `max_error` that is allowed in rad.
    error_bound: f64,
    /// Whether a Vulkan device was compared with the CPU, all bits agree and all errors are within
    /// their bounds, those of velocities, matrices and other outputs included.
    passes: bool,
    /// "passed", "reference-only" (the CPU is near the reference, and no device took part), "nothing"
    /// (there was no sample) or "failed".
    verdict: String,
}

value!(Verification {
    method,
    device,
    rotations,
    differing,
    max_error,
    rms_error,
    max_norm_error,
    error_bound,
    passes,
    verdict,
});

impl Verification {
    /// Verifies the tracks of each method, and combines their results.
    pub(crate) fn of(
        engine: &Engine,
        clip: &Motion,
        request: &EvaluationKeywords,
    ) -> PyResult<Self> {
        let mut all = Self {
            method: request.method.name().to_owned(),
            device: None,
            rotations: 0,
            differing: 0,
            max_error: 0.0,
            rms_error: 0.0,
            max_norm_error: 0.0,
            error_bound: 0.0,
            passes: false,
            verdict: Verdict::Nothing.name().to_owned(),
        };
        let mut verdict: Option<Verdict> = None;
        let groups = request.methods(Quantity::Rotation).interpolations(clip);
        let groups = groups.groups(clip.set.track_count());
        let groups = groups.map_err(|error| of_engine(&error.into()))?;
        let is_one = groups.len() == 1;
        for TrackGroup { value, tracks, .. } in groups {
            let set = clip.set.select(tracks.iter().copied());
            let set = set.map_err(|error| of_engine(&error.into()))?;
            let frames = request.frames(clip, Some(&tracks))?;
            let found = verify(engine, &set, value, &frames);
            let found = found.map_err(|error| of_engine(&error))?;
            if is_one {
                all.method = found.method.to_owned();
            }
            verdict = verdict.max(Some(found.verdict()));
            all.device = found.device;
            let squares = |rms: f64, count: u64| rms * rms * count as f64;
            let sum =
                squares(all.rms_error, all.rotations) + squares(found.rms_error, found.rotations);
            all.rotations += found.rotations;
            all.rms_error = (sum / all.rotations.max(1) as f64).sqrt();
            all.differing += found.differing;
            all.max_error = all.max_error.max(found.max_error);
            all.max_norm_error = all.max_norm_error.max(found.max_norm_error);
            all.error_bound = all.error_bound.max(found.error_bound);
        }
        let verdict = verdict.unwrap_or(Verdict::Nothing);
        (all.passes, all.verdict) = (verdict == Verdict::Passed, verdict.name().to_owned());
        Ok(all)
    }
}

#[pymethods]
impl Verification {
    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        format!(
            "Verification({} by {} on {}: {}, {} differ, error {:.1e} of {:.0e} rad)",
            self.rotations,
            self.method,
            self.device.as_deref().unwrap_or("CPU"),
            self.verdict,
            self.differing,
            self.max_error,
            self.error_bound,
        )
    }
}
