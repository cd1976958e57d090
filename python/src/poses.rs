//! Whole poses: translations, rotations and scales, relative to the parents or in the world.

use std::sync::Arc;

use glam::{DVec3, Quat, Vec3};
use numpy::{Element, PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tumble::{Layout, Quantity};
use tumble_formats::motion::Motion;
use tumble_formats::sample::Samples;
use tumble_formats::world::world;

use crate::clip::Clip;
use crate::engine::Engine;
use crate::errors::{in_python, input, of_engine};
use crate::options::{EvaluationKeywords, SampleChoice};
use crate::run::interruptible;

/// Translations, rotations and scales relative to the parents.
pub(crate) fn local<'py>(
    engine: &Engine,
    clip: &Bound<'py, Clip>,
    layout: Layout,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let py = clip.py();
    let (samples, tracks) = samples(engine, clip, options)?;
    let count = samples.times.len();
    let three = (tracks, count, 3);
    let motion = Arc::clone(&clip.get().motion);
    let (translations, rotations, scales) = interruptible(py, move || {
        let or_rest = |list: Vec<Vec3>, rest: Vec3| match list.is_empty() {
            true => vec![rest; tracks * count],
            false => list,
        };
        let translations = or_rest(samples.translations, Vec3::ZERO);
        let moved = translations.iter().enumerate();
        let moved = moved.map(|(index, point)| motion.origin(index % tracks) + point.as_dvec3());
        let rotations = samples.rotations.iter().flat_map(Quat::to_array);
        let scales = or_rest(samples.scales, Vec3::ONE);
        Ok((
            Positions::of(&motion, moved),
            rotations.collect::<Vec<f32>>(),
            scales.iter().flat_map(Vec3::to_array).collect::<Vec<f32>>(),
        ))
    })?;
    PyTuple::new(
        py,
        [
            translations.array(py, three, layout)?,
            shaped(py, rotations, (tracks, count, 4), layout)?,
            shaped(py, scales, three, layout)?,
        ],
    )
}

/// Positions and rotations in the world.
pub(crate) fn in_world<'py>(
    engine: &Engine,
    clip: &Bound<'py, Clip>,
    layout: Layout,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let py = clip.py();
    let (samples, tracks) = samples(engine, clip, options)?;
    let motion = Arc::clone(&clip.get().motion);
    let count = samples.times.len();
    let (positions, rotations) = interruptible(py, move || {
        let poses =
            world(&motion, &samples).map_err(|error| input(in_python(&error.to_string())))?;
        let points = poses.iter().map(|pose| pose.position);
        let rotations = poses.iter().flat_map(|pose| pose.rotation.to_array());
        Ok((
            Positions::of(&motion, points),
            rotations.collect::<Vec<f32>>(),
        ))
    })?;
    PyTuple::new(
        py,
        [
            positions.array(py, (tracks, count, 3), layout)?,
            shaped(py, rotations, (tracks, count, 4), layout)?,
        ],
    )
}

/// All channels of a clip, `[sample][track]`.
fn samples(
    engine: &Engine,
    clip: &Bound<'_, Clip>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<(Samples, usize)> {
    let request = EvaluationKeywords::new(options)?;
    let motion = &clip.get().motion;
    let requested = request.samples()?;
    if !matches!(
        requested,
        SampleChoice::Rate(..) | SampleChoice::Shared { .. }
    ) {
        return Err(input("at: poses need the same times for all tracks"));
    }
    let (frames, count) = request.resolved(motion)?;
    let tracks = motion.set.track_count();
    let engine = engine.engine_for(tracks * count)?;
    let motion = Arc::clone(motion);
    let samples = interruptible(clip.py(), move || {
        request
            .methods(Quantity::Rotation)
            .sample(&engine, &motion, &frames)
            .map_err(|error| of_engine(&error))
    })?;
    Ok((samples, tracks))
}

/// The coordinates of positions: f64 if any track has an origin, otherwise f32.
enum Positions {
    Single(Vec<f32>),
    Double(Vec<f64>),
}

impl Positions {
    fn of(motion: &Motion, points: impl Iterator<Item = DVec3>) -> Self {
        match motion.origins.is_empty() {
            true => Self::Single(
                points
                    .flat_map(|point| point.as_vec3().to_array())
                    .collect(),
            ),
            false => Self::Double(points.flat_map(|point| point.to_array()).collect()),
        }
    }

    fn array(
        self,
        py: Python<'_>,
        shape: (usize, usize, usize),
        layout: Layout,
    ) -> PyResult<Bound<'_, PyAny>> {
        match self {
            Self::Single(numbers) => shaped(py, numbers, shape, layout),
            Self::Double(numbers) => shaped(py, numbers, shape, layout),
        }
    }
}

/// Sampled numbers as an array, without a copy. If the layout is by tracks, `[sample][track]` becomes a transposed view
/// `[track][sample]`.
fn shaped<'py, T: Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    (tracks, samples, components): (usize, usize, usize),
    layout: Layout,
) -> PyResult<Bound<'py, PyAny>> {
    let flat = PyArray1::from_vec(py, numbers);
    debug_assert_eq!(flat.len(), tracks * samples * components);
    let array = flat.reshape([samples, tracks, components])?;
    match layout {
        Layout::FrameMajor => Ok(array.into_any()),
        Layout::TrackMajor => array.call_method1(intern!(py, "swapaxes"), (0, 1)),
    }
}
