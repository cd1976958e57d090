//! Functions from arrays of samples to arrays: smoothing, blending, mixing, adding, and poses along a skeleton.

use std::borrow::Cow;
use std::sync::Arc;

use glam::{Affine3A, Mat3, Quat, Vec3};
use numpy::{PyArray1, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use tumble::{
    Layout, Rotations, Samples, SamplesError, Skeleton, Smoothing, SmoothingEnds, SmoothingError,
    SmoothingKernel, Transforms, Vectors,
};
use tumble_formats::diagnostic::Code;
use tumble_formats::smooth::{SmoothJob, SmoothMotionError};

use crate::arrays::{ArrayValues, Order, doubles, parts, quaternions, room};
use crate::clip::Clip;
use crate::engine::Engine;
use crate::errors::{input, input_at, of_engine, of_track};
use crate::names::option_named;
use crate::options::frame_rate;
use crate::output::{array, filled};
use crate::run::{interruptible, work};

/// The shape of samples without the last axis, that of the components.
#[derive(Debug, Clone, Copy)]
struct Axes {
    tracks: usize,
    samples: usize,
}

impl Axes {
    /// Reads the axes from the shape (samples,), or (tracks, samples) in this layout.
    fn of(shape: &[usize], layout: Layout, name: &str) -> PyResult<Self> {
        Ok(match (shape, layout) {
            (&[], _) => Self {
                tracks: 1,
                samples: 1,
            },
            (&[samples], _) => Self { tracks: 1, samples },
            (&[tracks, samples], Layout::TrackMajor) | (&[samples, tracks], Layout::FrameMajor) => {
                Self { tracks, samples }
            }
            _ => {
                return Err(input(format!(
                    "{name}: the shape is {shape:?} and the components; give (frames, …) or \
                     (tracks, frames, …)"
                )));
            }
        })
    }
}

/// The exception for an array that has not the shape of samples.
fn of_samples(name: &str, error: &SamplesError) -> PyErr {
    match error {
        SamplesError::OutOfRange { index, .. } => input_at(
            &format!("{name}: {error}"),
            Code::Norm,
            format!("{name}[{index}]"),
        ),
        _ => input(format!("{name}: {error}")),
    }
}

fn rotations(values: &[Quat], tracks: usize, layout: Layout, name: &str) -> PyResult<Rotations> {
    Rotations::of(values, tracks, layout).map_err(|error| of_samples(name, &error))
}

/// The result as an array: this shape, and the components as the last axis.
fn written<'py>(
    py: Python<'py>,
    shape: &[usize],
    found: &Rotations,
    order: Order,
    out: Option<&Bound<'py, PyAny>>,
    inputs: &[&Bound<'py, PyAny>],
) -> PyResult<Bound<'py, PyAny>> {
    let array = array(py, &[shape, &[4]].concat(), out, inputs)?;
    filled(&array, |numbers| {
        let to = numbers.as_chunks_mut().0.iter_mut();
        for (to, from) in to.zip(found.as_arrays()) {
            *to = order.of_xyzw(*from);
        }
        Ok(())
    })?;
    Ok(array.into_any())
}

/// The options of smoothing.
pub(crate) struct Smooth<'a> {
    pub(crate) kernel: Option<&'a str>,
    pub(crate) low_pass: Option<f64>,
    pub(crate) fps: Option<&'a Bound<'a, PyAny>>,
    pub(crate) passes: u32,
    pub(crate) ends: &'a str,
}

/// The exception for an invalid smoothing kernel.
fn of_kernel(name: &str, error: &SmoothingError) -> PyErr {
    input(format!("{name}: {error}"))
}

impl Smooth<'_> {
    /// The options of smoothing for arrays.
    fn smoothing(&self) -> PyResult<Smoothing> {
        let rate = self.fps.map(frame_rate).transpose()?;
        let mut smoothing = self.of_kernel()?;
        match (self.low_pass, rate) {
            (Some(hz), Some(rate)) => {
                let kernel = SmoothingKernel::low_pass(hz, rate.per_second());
                smoothing.kernel = kernel.map_err(|error| of_kernel("low_pass", &error))?;
            }
            (Some(_), None) => {
                return Err(input("low_pass: give `fps` too, the rate of the samples"));
            }
            (None, Some(_)) => {
                return Err(input(
                    "fps: kernels count samples; it goes with `low_pass`, in Hz",
                ));
            }
            (None, None) => {}
        }
        let checked = smoothing.check();
        checked.map_err(|error| input(error.to_string()))?;
        Ok(smoothing)
    }

    /// The kernel, or the frequency that replaces it, and the rest.
    fn of_kernel(&self) -> PyResult<Smoothing> {
        if self.low_pass.is_some() && self.kernel.is_some() {
            return Err(input(
                "`kernel` and `low_pass` exclude each other; give one of them",
            ));
        }
        let kernel = self.kernel.unwrap_or("gaussian:2").parse();
        let kernel = kernel.map_err(|error| of_kernel("kernel", &error))?;
        let ends: SmoothingEnds = option_named(self.ends, "ends")?;
        Ok(Smoothing::new(kernel)
            .with_ends(ends)
            .with_passes(self.passes))
    }
}

/// Smooths a clip at its keys, or at the frames of a rate.
pub(crate) fn smooth_clip(
    engine: &Engine,
    clip: &Bound<'_, Clip>,
    options: &Smooth<'_>,
) -> PyResult<Clip> {
    let smoothing = options.of_kernel()?;
    if options.low_pass.is_none() {
        let checked = smoothing.check();
        checked.map_err(|error| input(error.to_string()))?;
    }
    let rate = options.fps.map(frame_rate).transpose()?;
    let clip_of = clip.get().clone();
    let motion = Arc::clone(&clip_of.motion);
    let job = SmoothJob::new(&motion, smoothing, options.low_pass, rate);
    let job = job.map_err(|error| match error {
        SmoothMotionError::Evaluating(error) => of_engine(&error),
        SmoothMotionError::LowPass { reason, .. } => of_kernel("low_pass", &reason),
        error => input(format!("{error}; give `fps`, the rate to sample at")),
    })?;
    let tracks = motion.set.track_count();
    let timeline = job.frames.resolve(tracks, motion.set.time_span());
    let samples = timeline.map_err(|error| of_engine(&error.into()))?.len();
    let engine = engine.engine_for(tracks * samples)?;
    let found = interruptible(clip.py(), move || {
        let found = job.run(&engine, &motion);
        let found = found.map_err(|error| of_engine(&error))?;
        job.clip(&motion, &found).map_err(|error| of_track(&error))
    })?;
    Ok(clip_of.with_keys(found))
}

/// Smooths rotations (…, 4), or vectors (…, 3).
pub(crate) fn smooth<'py>(
    engine: &Engine,
    samples: &Bound<'py, PyAny>,
    options: &Smooth<'_>,
    (layout, order): (Layout, Order),
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = samples.py();
    let smoothing = options.smoothing()?;
    let passes = smoothing.passes as usize;
    if are_vectors(samples)? {
        let (shape, values) = vectors(samples, "samples")?;
        let axes = Axes::of(&shape, layout, "samples")?;
        let count = values.len();
        let engine = engine.engine_for(count)?;
        let found = work(py, count.saturating_mul(passes), move || {
            let before = Vectors::of(&values, axes.tracks, layout);
            let before = before.map_err(|error| of_samples("samples", &error))?;
            let found = engine.smooth_vectors(&before, &smoothing);
            found.map_err(|error| of_engine(&error))
        })?;
        let array = array(py, &[&shape[..], &[3]].concat(), out, &[samples])?;
        filled(&array, |numbers| {
            let to = numbers.as_chunks_mut().0.iter_mut();
            for (to, &[x, y, z, _]) in to.zip(found.as_arrays()) {
                *to = [x, y, z];
            }
            Ok(())
        })?;
        return Ok(array.into_any());
    }
    let ArrayValues { shape, values } = quaternions(samples, order, "samples")?;
    let axes = Axes::of(&shape, layout, "samples")?;
    let count = values.len();
    let engine = engine.engine_for(count)?;
    let found = work(py, count.saturating_mul(passes), move || {
        let before = rotations(&values, axes.tracks, layout, "samples")?;
        let found = engine.smooth(&before, &smoothing);
        found.map_err(|error| of_engine(&error))
    })?;
    written(py, &shape, &found, order, out, &[samples])
}

/// Whether the last axis has three components.
fn are_vectors(value: &Bound<'_, PyAny>) -> PyResult<bool> {
    if let Ok(array) = value.cast::<PyUntypedArray>() {
        return Ok(array.shape().last() == Some(&3));
    }
    if value.hasattr(intern!(value.py(), "as_quat"))? {
        return Ok(false);
    }
    Ok(doubles(value, "samples")?.shape.last() == Some(&3))
}

/// Vectors (…, 3) of any shape, and this shape without the last axis.
fn vectors(value: &Bound<'_, PyAny>, name: &str) -> PyResult<(Vec<usize>, Vec<Vec3>)> {
    let ArrayValues { mut shape, values } = doubles(value, name)?;
    if shape.pop() != Some(3) {
        return Err(input(format!(
            "{name}: the last axis has the 3 components of a vector"
        )));
    }
    let vectors = values.as_chunks::<3>().0.iter();
    let vectors = vectors.map(|of| Vec3::from_array(of.map(|number| number as f32)));
    Ok((shape, vectors.collect()))
}

/// The weights of layers.
pub(crate) enum LayerWeights {
    /// A number for each layer; none: 1 for each.
    Numbers(Vec<f32>),
    /// For each layer an array, whose shape broadcasts to that of the layers.
    Arrays(Vec<ArrayValues<f32>>),
}

impl LayerWeights {
    fn len(&self) -> usize {
        match self {
            Self::Numbers(numbers) => numbers.len(),
            Self::Arrays(arrays) => arrays.len(),
        }
    }
}

/// `Engine.blend`: the normalised weighted sum of layers.
pub(crate) fn blend<'py>(
    engine: &Engine,
    layers: &Bound<'py, PyAny>,
    weights: Option<LayerWeights>,
    order: Order,
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = layers.py();
    let mut all = Vec::new();
    let mut inputs = Vec::new();
    for (index, layer) in layers.try_iter()?.enumerate() {
        let layer = layer?;
        all.push(quaternions(&layer, order, &format!("layers[{index}]"))?);
        inputs.push(layer);
    }
    let weights = weights.unwrap_or_else(|| LayerWeights::Numbers(vec![1.0; all.len()]));
    if weights.len() != all.len() {
        return Err(input(format!(
            "weights: there are {} for {} layers",
            weights.len(),
            all.len()
        )));
    }
    let mut shapes: Vec<(String, &[usize])> = Vec::new();
    for (index, layer) in all.iter().enumerate() {
        shapes.push((format!("layers[{index}]"), &layer.shape));
    }
    if let LayerWeights::Arrays(arrays) = &weights {
        for (index, array) in arrays.iter().enumerate() {
            shapes.push((format!("weights[{index}]"), &array.shape));
        }
    }
    let shape = common_shape(&shapes)?;
    let layers = all.iter().enumerate().map(|(index, layer)| {
        let name = format!("layers[{index}]");
        let values = broadcast(layer, &shape, &name)?;
        rotations(&values, 1, Layout::TrackMajor, &name)
    });
    let layers: Vec<Rotations> = layers.collect::<PyResult<_>>()?;
    let count = size(&shape);
    let engine = engine.engine_for(count)?;
    let target = shape.clone();
    let found = work(py, count.saturating_mul(layers.len()), move || {
        let blended = match weights {
            LayerWeights::Numbers(weights) => {
                let layers: Vec<(&Rotations, f32)> = layers.iter().zip(weights).collect();
                engine.blend(&layers)
            }
            LayerWeights::Arrays(arrays) => {
                let weights = arrays
                    .iter()
                    .map(|array| broadcast(array, &target, "weights"));
                let weights: Vec<Cow<'_, [f32]>> = weights.collect::<PyResult<_>>()?;
                let each = layers.iter().zip(&weights);
                let layers: Vec<(&Rotations, &[f32])> =
                    each.map(|(layer, weights)| (layer, &**weights)).collect();
                engine.blend_each(&layers)
            }
        };
        blended.map_err(|error| of_engine(&error))
    })?;
    let inputs: Vec<_> = inputs.iter().collect();
    written(py, &shape, &found, order, out, &inputs)
}

/// The shape to which all shapes broadcast, by NumPy's rules.
fn common_shape(shapes: &[(String, &[usize])]) -> PyResult<Vec<usize>> {
    let mut common: Vec<usize> = Vec::new();
    for (name, shape) in shapes {
        let added = shape.len().saturating_sub(common.len());
        common.splice(0..0, std::iter::repeat_n(1, added));
        let first = common.len() - shape.len();
        for (size, &other) in common[first..].iter_mut().zip(*shape) {
            match (*size, other) {
                (size, other) if size == other => {}
                (1, other) => *size = other,
                (_, 1) => {}
                _ => {
                    return Err(input(format!(
                        "{name}: its shape is {shape:?}, that of {} {:?} (without the components); give shapes that broadcast",
                        shapes[0].0, shapes[0].1
                    )));
                }
            }
        }
    }
    Ok(common)
}

/// Values with a shape to which theirs broadcasts.
fn broadcast<'a, T: Copy>(
    array: &'a ArrayValues<T>,
    shape: &[usize],
    name: &str,
) -> PyResult<Cow<'a, [T]>> {
    if array.shape == shape {
        return Ok(Cow::Borrowed(&array.values));
    }
    let first = shape.len() - array.shape.len();
    let count = size(shape);
    let mut values = room(count, name)?;
    let value = |index: usize| {
        let (mut rest, mut at, mut stride) = (index, 0, 1);
        for (axis, &size) in shape.iter().enumerate().rev() {
            let along = rest % size;
            rest /= size;
            if axis >= first && array.shape[axis - first] != 1 {
                at += along * stride;
            }
            if axis >= first {
                stride *= array.shape[axis - first];
            }
        }
        array.values[at]
    };
    values.extend((0..count).map(value));
    Ok(Cow::Owned(values))
}

/// The number of elements of a shape.
fn size(shape: &[usize]) -> usize {
    (shape.iter()).fold(1, |product, &size| product.saturating_mul(size))
}

fn check_shape(name: &str, shape: &[usize], first: &[usize], of: &str) -> PyResult<()> {
    match shape == first {
        true => Ok(()),
        false => Err(input(format!(
            "{name}: its shape is {:?}, that of {of} {:?}; they are to be the same",
            [shape, &[4]].concat(),
            [first, &[4]].concat()
        ))),
    }
}

/// `Engine.mix`: slerp from each rotation of one array to that of the other.
pub(crate) fn mix<'py>(
    engine: &Engine,
    [first, second]: [&Bound<'py, PyAny>; 2],
    weight: &Bound<'py, PyAny>,
    order: Order,
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = first.py();
    let from = quaternions(first, order, "first")?;
    let to = quaternions(second, order, "second")?;
    let weights = singles(doubles(weight, "weight")?);
    let shape = common_shape(&[
        ("first".to_owned(), &from.shape),
        ("second".to_owned(), &to.shape),
        ("weight".to_owned(), &weights.shape),
    ])?;
    let row = |array, name| {
        let values = broadcast(array, &shape, name)?;
        rotations(&values, 1, Layout::TrackMajor, name)
    };
    let (from, to) = (row(&from, "first")?, row(&to, "second")?);
    let engine = engine.engine_for(from.as_arrays().len())?;
    let target = shape.clone();
    let found = work(py, from.as_arrays().len(), move || {
        let found = match weights.values[..] {
            [weight] => engine.mix(&from, &to, weight),
            _ => engine.mix_each(&from, &to, &broadcast(&weights, &target, "weight")?),
        };
        found.map_err(|error| of_engine(&error))
    })?;
    written(py, &shape, &found, order, out, &[first, second])
}

/// `base · (reference⁻¹ layer)^weight`.
pub(crate) fn add<'py>(
    engine: &Engine,
    [base, layer]: [&Bound<'py, PyAny>; 2],
    reference: Option<&Bound<'py, PyAny>>,
    weight: f32,
    (layout, order): (Layout, Order),
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = base.py();
    let ArrayValues { shape, values } = quaternions(base, order, "base")?;
    let Axes { tracks, .. } = Axes::of(&shape, layout, "base")?;
    let ArrayValues {
        shape: other,
        values: layers,
    } = quaternions(layer, order, "layer")?;
    check_shape("layer", &other, &shape, "base")?;
    let reference = match reference {
        None => vec![Quat::IDENTITY; tracks],
        Some(value) => match quaternions(value, order, "reference")? {
            ArrayValues { shape, values } if shape.is_empty() => vec![values[0]; tracks],
            ArrayValues { shape, values } if *shape == [tracks] => values,
            ArrayValues { shape, .. } => {
                return Err(input(format!(
                    "reference: its shape is {:?}; give ({tracks}, 4), a rotation for each track",
                    [&shape[..], &[4]].concat()
                )));
            }
        },
    };
    // If the reference is not a rotation, it is refused with the same message as other rotations.
    rotations(&reference, 1, layout, "reference")?;
    let count = values.len();
    let engine = engine.engine_for(count)?;
    let found = work(py, count, move || {
        let base = rotations(&values, tracks, layout, "base")?;
        let layer = rotations(&layers, tracks, layout, "layer")?;
        let found = engine.add(&base, &layer, &reference, weight);
        found.map_err(|error| of_engine(&error))
    })?;
    written(py, &shape, &found, order, out, &[base, layer])
}

/// A skeleton and its poses, as arrays: the arguments of `local_to_model`.
pub(crate) struct ModelPoses<'a, 'py> {
    pub(crate) rotations: &'a Bound<'py, PyAny>,
    pub(crate) parents: Vec<Option<i64>>,
    pub(crate) offsets: Option<&'a Bound<'py, PyAny>>,
    pub(crate) translations: Option<&'a Bound<'py, PyAny>>,
    pub(crate) scales: Option<&'a Bound<'py, PyAny>>,
    pub(crate) inverse_bind: Option<&'a Bound<'py, PyAny>>,
}

impl<'py> ModelPoses<'_, 'py> {
    /// The matrices of all joints in the model, 3 × 4.
    pub(crate) fn local_to_model(
        self,
        engine: &Engine,
        (layout, order): (Layout, Order),
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = self.rotations.py();
        let ArrayValues { shape, values } = quaternions(self.rotations, order, "rotations")?;
        // The shape of a single pose is (tracks,).
        let is_one = shape.len() == 1;
        let axes = match (&*shape, layout) {
            (&[tracks], _) => Axes { tracks, samples: 1 },
            _ => Axes::of(&shape, layout, "rotations")?,
        };
        let Axes { tracks, samples } = axes;
        let rotations = rotations(&values, tracks, layout, "rotations")?;
        let (translations, has_translation) = channel(
            self.translations,
            "translations",
            (&shape, axes),
            layout,
            Vec3::ZERO,
        )?;
        let (scales, _) = channel(self.scales, "scales", (&shape, axes), layout, Vec3::ONE)?;
        let skeleton = skeleton(&self.parents, self.offsets, tracks)?;
        let inverse_bind = self.inverse_bind.map(|value| matrices(value, tracks));
        let inverse_bind = inverse_bind.transpose()?;
        let engine = engine.engine_for(tracks * samples)?;
        let local = Transforms {
            translations,
            rotations,
            scales,
            has_translation,
        };
        let found = work(py, tracks * samples, move || {
            let found = engine.local_to_model(&local, &skeleton, inverse_bind.as_deref());
            found.map_err(|error| of_engine(&error))
        })?;
        let numbers: &[f32] = found.as_arrays().as_flattened().as_flattened();
        let flat = PyArray1::from_slice(py, numbers);
        if is_one {
            return Ok(flat.reshape([tracks, 3, 4])?.into_any());
        }
        let array = flat.reshape([samples, tracks, 3, 4])?;
        match layout {
            Layout::FrameMajor => Ok(array.into_any()),
            Layout::TrackMajor => array.call_method1(intern!(py, "swapaxes"), (0, 1)),
        }
    }
}

/// The translations or scales of all joints, and which joints have any.
fn channel(
    value: Option<&Bound<'_, PyAny>>,
    name: &str,
    (shape, axes): (&[usize], Axes),
    layout: Layout,
    rest: Vec3,
) -> PyResult<(Vectors, Vec<bool>)> {
    let Axes { tracks, samples } = axes;
    let made = |values: &[Vec3]| {
        Vectors::of(values, tracks, layout).map_err(|error| of_samples(name, &error))
    };
    let count = tracks * samples;
    let Some(value) = value else {
        return Ok((made(&vec![rest; count])?, vec![false; tracks]));
    };
    let lists = parts(value)?.filter(|parts| parts.iter().any(Bound::is_none));
    let Some(lists) = lists else {
        let (other, values) = vectors(value, name)?;
        if other != shape {
            return Err(input(format!(
                "{name}: the shape is {:?}, that of the rotations {:?}; all axes but the last are the same",
                [&other[..], &[3]].concat(),
                [shape, &[4]].concat()
            )));
        }
        return Ok((made(&values)?, vec![true; tracks]));
    };
    if lists.len() != tracks {
        return Err(input(format!(
            "{name}: a list of {} for {tracks} tracks; give an array or None for each",
            lists.len()
        )));
    }
    let mut all = vec![rest; count];
    let mut has = vec![false; tracks];
    for (track, part) in lists.iter().enumerate().filter(|(_, part)| !part.is_none()) {
        let (other, values) = vectors(part, &format!("{name}[{track}]"))?;
        if values.len() != samples {
            return Err(input(format!(
                "{name}[{track}]: the shape is {:?}; give ({samples}, 3)",
                [&other[..], &[3]].concat()
            )));
        }
        has[track] = true;
        for (sample, value) in values.into_iter().enumerate() {
            if let Some(index) = layout.index(track, sample, tracks, samples) {
                all[index] = value;
            }
        }
    }
    Ok((made(&all)?, has))
}

/// A skeleton of parents and offsets.
pub(crate) fn skeleton(
    parents: &[Option<i64>],
    offsets: Option<&Bound<'_, PyAny>>,
    tracks: usize,
) -> PyResult<Skeleton> {
    let parents = joint_parents(parents, tracks)?;
    let offsets = match offsets {
        None => vec![Vec3::ZERO; tracks],
        Some(value) => joint_offsets(value, tracks)?,
    };
    let skeleton = Skeleton::new(parents, offsets);
    skeleton.map_err(|error| input(format!("parents: {error}")))
}

/// The parent of each track; roots have None or -1.
pub(crate) fn joint_parents(
    parents: &[Option<i64>],
    tracks: usize,
) -> PyResult<Vec<Option<usize>>> {
    if parents.len() != tracks {
        return Err(input(format!(
            "parents: there are {} for {tracks} tracks",
            parents.len()
        )));
    }
    let parent = |(track, &parent): (usize, &Option<i64>)| {
        match parent {
        None | Some(-1) => Ok(None),
        Some(parent) => usize::try_from(parent)
            .ok()
            .filter(|&parent| parent < tracks)
            .map(Some)
            .ok_or_else(|| {
                input(format!(
                    "parents: track {track} cannot have the parent {parent}; give the index of a track, or None for \
                     a root"
                ))
            }),
    }
    };
    parents.iter().enumerate().map(parent).collect()
}

/// The offset of each track.
pub(crate) fn joint_offsets(value: &Bound<'_, PyAny>, tracks: usize) -> PyResult<Vec<Vec3>> {
    match vectors(value, "offsets")? {
        (shape, offsets) if *shape == [tracks] => Ok(offsets),
        (shape, _) => Err(input(format!(
            "offsets: the shape is {:?}; give ({tracks}, 3)",
            [&shape[..], &[3]].concat()
        ))),
    }
}

/// Affine matrices, (tracks, 3, 4) or (tracks, 4, 4).
pub(crate) fn matrices(value: &Bound<'_, PyAny>, tracks: usize) -> PyResult<Vec<Affine3A>> {
    let ArrayValues { shape, values } = doubles(value, "inverse_bind")?;
    let rows = match *shape {
        [count, rows @ (3 | 4), 4] if count == tracks => rows,
        _ => {
            return Err(input(format!(
                "inverse_bind: the shape is {shape:?}; give ({tracks}, 3, 4) or ({tracks}, 4, 4)"
            )));
        }
    };
    let matrix = |numbers: &[f64]| {
        let number = |row: usize, column: usize| numbers[4 * row + column] as f32;
        let column = |column: usize| Vec3::from_array([0, 1, 2].map(|row| number(row, column)));
        let linear_part = Mat3::from_cols(column(0), column(1), column(2));
        Affine3A::from_mat3_translation(linear_part, column(3))
    };
    Ok(values.chunks_exact(4 * rows).map(matrix).collect())
}

/// Samples as a NumPy array of shape (tracks, frames, components), or (frames, tracks, components) with layout "frame".
pub(crate) fn of_values<'py, T, const N: usize>(
    py: Python<'py>,
    found: &Samples<T>,
    order: impl Fn([f32; 4]) -> [f32; N],
) -> PyResult<Bound<'py, PyAny>> {
    let numbers = found.as_arrays().iter().flat_map(|&of| order(of));
    let numbers: Vec<f32> = numbers.collect();
    let (tracks, samples) = (found.track_count(), found.sample_count());
    let flat = PyArray1::from_vec(py, numbers);
    let shape = match found.layout() {
        Layout::TrackMajor => [tracks, samples, N],
        Layout::FrameMajor => [samples, tracks, N],
    };
    Ok(flat.reshape(shape)?.into_any())
}

/// The weights of layers.
pub(crate) fn weights(value: Option<&Bound<'_, PyAny>>) -> PyResult<Option<LayerWeights>> {
    let Some(value) = value else { return Ok(None) };
    let each = |items: &Bound<'_, PyAny>| {
        let arrays = items
            .try_iter()?
            .enumerate()
            .map(|(index, weights)| Ok(singles(doubles(&weights?, &format!("weights[{index}]"))?)));
        arrays.collect::<PyResult<_>>().map(LayerWeights::Arrays)
    };
    Ok(Some(match doubles(value, "weights") {
        Ok(weights) if weights.shape.len() == 1 => LayerWeights::Numbers(singles(weights).values),
        Ok(weights) if weights.shape.is_empty() => {
            return Err(PyTypeError::new_err(
                "weights: give a list with a number or an array for each layer",
            ));
        }
        // A list of arrays of different shapes cannot become one array.
        Err(_) if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() => {
            each(value)?
        }
        found => {
            found?;
            each(value)?
        }
    }))
}

fn singles(numbers: ArrayValues<f64>) -> ArrayValues<f32> {
    ArrayValues {
        values: numbers.values.iter().map(|&number| number as f32).collect(),
        shape: numbers.shape,
    }
}
