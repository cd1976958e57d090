//! `tumble.compare` and `tumble.path_errors`: how far two motions, arrays or paths are apart.

use std::sync::Arc;

use pyo3::prelude::*;
use tumble::names::counted;
use tumble_formats::compare::{self as differences, ClipPair, CompareError, PathMeasure};
use tumble_formats::motion::Motion;
use tumble_formats::npz;
use tumble_formats::trajectory::{Align, Associate};

use crate::arrays::{ArrayValues, doubles};
use crate::clip::Clip;
use crate::engine::{Engine, default_engine};
use crate::errors::{in_python, input, of_engine, warn_of};
use crate::names::option_named;
use crate::options::{SampleChoice, samples_of};
use crate::run::{interruptible, work};
use crate::values::{Pickled, pickled, value};

/// The mean, the root mean square and the largest of many differences.
#[pyclass(frozen, get_all, eq, weakref, module = "tumble", from_py_object)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Spread {
    /// The mean.
    mean: f64,
    /// The root of the mean square.
    rms: f64,
    /// The largest.
    largest: f64,
}

value!(Spread { mean, rms, largest });

impl From<differences::Spread> for Spread {
    fn from(of: differences::Spread) -> Self {
        Self {
            mean: of.mean,
            rms: of.rms,
            largest: of.largest,
        }
    }
}

#[pymethods]
impl Spread {
    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        let Self { mean, rms, largest } = self;
        format!("Spread(mean {mean:.3e}, rms {rms:.3e}, largest {largest:.3e})")
    }
}

/// How far two arrays of one shape are apart.
#[pyclass(frozen, get_all, eq, weakref, module = "tumble", from_py_object)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ArrayDifference {
    /// The number of numbers that are compared.
    numbers: usize,
    /// The number of numbers that differ.
    differing: usize,
    /// The number of numbers that are NaN or infinite in only one of the arrays; not in `difference`.
    not_finite: usize,
    /// The differences of numbers.
    difference: Spread,
    /// The indices of the largest difference.
    largest_at: Vec<usize>,
    /// The angles in degrees, if the arrays contain rotations (four numbers each); otherwise None.
    rotation: Option<Spread>,
    /// The indices of the rotation with the largest angle; None if there are no rotations.
    largest_rotation_at: Option<Vec<usize>>,
}

value!(ArrayDifference {
    numbers,
    differing,
    not_finite,
    difference,
    largest_at,
    rotation,
    largest_rotation_at,
});

#[pymethods]
impl ArrayDifference {
    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        let Self {
            numbers, differing, ..
        } = self;
        format!("ArrayDifference({differing} of {numbers} numbers differ)")
    }
}

/// The differences of a channel of two clips.
#[pyclass(frozen, get_all, eq, weakref, module = "tumble", from_py_object)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChannelDifference {
    /// The mean difference.
    mean: f64,
    /// The root of the mean square of the differences.
    rms: f64,
    /// The largest difference.
    largest: f64,
    /// The name of the track with the largest difference.
    track: String,
    /// The time of the largest difference in seconds, on the clock of the first clip.
    time: f64,
    /// The frame of the largest difference, counted in the first clip from 0 at its first key; None if it has no rate.
    frame: Option<f64>,
}

value!(ChannelDifference {
    mean,
    rms,
    largest,
    track,
    time,
    frame,
});

impl From<differences::ChannelDifference> for ChannelDifference {
    fn from(of: differences::ChannelDifference) -> Self {
        Self {
            mean: of.spread.mean,
            rms: of.spread.rms,
            largest: of.spread.largest,
            track: of.track,
            time: of.time,
            frame: of.frame,
        }
    }
}

impl ChannelDifference {
    /// The differences of one track.
    fn of_track(track: &str, of: differences::TimedSpread) -> Self {
        Self {
            mean: of.spread.mean,
            rms: of.spread.rms,
            largest: of.spread.largest,
            track: track.to_owned(),
            time: of.time,
            frame: of.frame,
        }
    }
}

/// The differences of one track of two clips.
#[pyclass(frozen, get_all, eq, weakref, module = "tumble", from_py_object)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JointDifference {
    /// The name of the track.
    track: String,
    /// The differences of rotations in degrees.
    rotation: ChannelDifference,
    /// The differences of translations, as lengths; None if neither clip has translations.
    translation: Option<ChannelDifference>,
    /// The differences of scales, as lengths; None if neither clip has scales.
    scale: Option<ChannelDifference>,
}

value!(JointDifference {
    track,
    rotation,
    translation,
    scale,
});

impl From<differences::JointDifference> for JointDifference {
    fn from(of: differences::JointDifference) -> Self {
        let named = |spread| ChannelDifference::of_track(&of.track, spread);
        Self {
            rotation: named(of.rotation),
            translation: of.translation.map(named),
            scale: of.scale.map(named),
            track: of.track,
        }
    }
}

#[pymethods]
impl JointDifference {
    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        let Self {
            track, rotation, ..
        } = self;
        format!(
            "JointDifference({track:?}, largest angle {:.3e}°)",
            rotation.largest
        )
    }
}

#[pymethods]
impl ChannelDifference {
    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        let Self {
            mean,
            rms,
            largest,
            track,
            time,
            ..
        } = self;
        format!(
            "ChannelDifference(mean {mean:.3e}, rms {rms:.3e}, largest {largest:.3e} at {track:?}, {time:.4} s)"
        )
    }
}

/// How far two clips are apart.
#[pyclass(frozen, get_all, eq, weakref, module = "tumble", from_py_object)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ClipDifference {
    /// The number of tracks that both clips have.
    tracks: usize,
    /// The names of the tracks that only one clip has: a list for the first clip, and one for the second.
    missing: (Vec<String>, Vec<String>),
    /// The number of samples of each track.
    samples: usize,
    /// The first and the last time in seconds.
    span: (f64, f64),
    /// The number of rotations whose bits are the same.
    identical: u64,
    /// The differences of rotations in degrees; None if the clips have only scalars in common.
    rotation: Option<ChannelDifference>,
    /// The differences of translations, as lengths; None if neither clip has translations.
    translation: Option<ChannelDifference>,
    /// The differences of scales, as lengths; None if neither clip has scales.
    scale: Option<ChannelDifference>,
    /// The differences of each track, in the order of the first clip.
    joints: Vec<JointDifference>,
    /// The differences of each scalar that both clips have: angles in degrees, others as they are.
    scalars: Vec<ChannelDifference>,
    /// The names of the scalars that only one clip has: a list for the first clip, and one for the second.
    missing_scalars: (Vec<String>, Vec<String>),
}

value!(ClipDifference {
    tracks,
    missing,
    samples,
    span,
    identical,
    rotation,
    translation,
    scale,
    joints,
    scalars,
    missing_scalars,
});

#[pymethods]
impl ClipDifference {
    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        let mut compared = Vec::new();
        if let Some(rotation) = &self.rotation {
            compared.push(counted(self.tracks, "track"));
            compared.push(format!("largest angle {:.3e}°", rotation.largest));
        }
        if !self.scalars.is_empty() {
            compared.push(counted(self.scalars.len(), "scalar"));
        }
        let samples = counted(self.samples, "sample");
        format!("ClipDifference({}, {samples})", compared.join(", "))
    }
}

/// The statistics of errors of one kind, by the names of `evo`.
#[pyclass(frozen, get_all, eq, weakref, module = "tumble", from_py_object)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PathStatistics {
    /// The root of the mean square.
    rmse: f64,
    /// The mean.
    mean: f64,
    /// The median.
    median: f64,
    /// The standard deviation.
    std: f64,
    /// The smallest.
    min: f64,
    /// The largest.
    max: f64,
}

value!(PathStatistics {
    rmse,
    mean,
    median,
    std,
    min,
    max,
});

impl From<differences::PathStatistics> for PathStatistics {
    fn from(of: differences::PathStatistics) -> Self {
        Self {
            rmse: of.rmse,
            mean: of.mean,
            median: of.median,
            std: of.std,
            min: of.min,
            max: of.max,
        }
    }
}

#[pymethods]
impl PathStatistics {
    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        format!(
            "PathStatistics(rmse {:.6}, mean {:.6}, max {:.6})",
            self.rmse, self.mean, self.max
        )
    }
}

/// How far an estimated path is from its reference.
#[pyclass(frozen, get_all, eq, weakref, module = "tumble", from_py_object)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PathErrors {
    /// The index of the clip whose poses are compared, 0 or 1: the clip with fewer poses.
    times_of: usize,
    /// The number of poses that are compared.
    poses: usize,
    /// The number of poses that are not compared because they are outside the times of the other clip.
    outside: usize,
    /// The number of poses that are not compared because they are in gaps of the other clip.
    in_gaps: usize,
    /// First and last time in seconds.
    span: (f64, f64),
    /// The scale of the alignment. The alignment scales the estimate, then rotates it, then translates it.
    scale: f64,
    /// The rotation of the alignment, x y z w.
    rotation: [f64; 4],
    /// The translation of the alignment.
    translation: [f64; 3],
    /// Absolute errors of the positions, lengths.
    ape_translation: PathStatistics,
    /// Absolute errors of the rotations in degrees.
    ape_rotation: PathStatistics,
    /// Relative errors of the positions, lengths; None without `rpe`.
    rpe_translation: Option<PathStatistics>,
    /// Relative errors of the rotations in degrees; None without `rpe`.
    rpe_rotation: Option<PathStatistics>,
    /// The number of steps for which relative errors are computed.
    rpe_count: usize,
}

value!(PathErrors {
    times_of,
    poses,
    outside,
    in_gaps,
    span,
    scale,
    rotation,
    translation,
    ape_translation,
    ape_rotation,
    rpe_translation,
    rpe_rotation,
    rpe_count,
});

#[pymethods]
impl PathErrors {
    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        format!(
            "PathErrors({} poses, rmse {:.6}, {:.6}°)",
            self.poses, self.ape_translation.rmse, self.ape_rotation.rmse
        )
    }
}

fn of_compare(error: CompareError) -> PyErr {
    match error {
        CompareError::Evaluating { error, .. } => of_engine(&error),
        error => input(in_python(&error.to_string())),
    }
}

/// Compares two clips, or two arrays: the largest and the mean difference, and where it is.
///
/// Clips are interpolated as their files state, at every key of both and halfway between neighbouring keys, or at `fps`
/// (from `start` to `end`), or at the times `at`. Tracks are matched by equal names, or by index if neither clip has
/// names, and scalars by equal names. `world` compares joints in the world instead of relative to their parents.
/// Returns a `ClipDifference`, whose `rotation` is in degrees. Arrays of the same shape are compared number by number,
/// and by angles if they contain rotations. Returns an `ArrayDifference`.
///
/// >>> import tumble
/// >>> one = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
/// >>> other = tumble.Clip([0.0, 1.0, 2.0], [[0, 0, 0, 1], [0, 0, 0.6, 0.8], [0, 0, 1, 0]])
/// >>> found = tumble.compare(one, other)
/// >>> round(found.rotation.largest, 3), found.rotation.time
/// (16.26, 1.0)
/// >>> tumble.compare([1.0, 2.0], [1.0, 2.5]).difference.largest
/// 0.5
#[pyfunction]
#[pyo3(signature = (first, second, *, fps=None, at=None, start=None, end=None, world=false, engine=None))]
#[allow(clippy::too_many_arguments, reason = "keywords")]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    first: &Bound<'py, PyAny>,
    second: &Bound<'py, PyAny>,
    fps: Option<&Bound<'py, PyAny>>,
    at: Option<Bound<'py, PyAny>>,
    start: Option<f64>,
    end: Option<f64>,
    world: bool,
    engine: Option<&Bound<'py, Engine>>,
) -> PyResult<Bound<'py, PyAny>> {
    let clips = (first.cast::<Clip>(), second.cast::<Clip>());
    let has_times = fps.is_some() || at.is_some() || start.is_some() || end.is_some();
    let (Ok(one), Ok(other)) = clips else {
        if first.is_instance_of::<Clip>() || second.is_instance_of::<Clip>() {
            return Err(input("give two clips, or two arrays"));
        }
        if has_times || world {
            return Err(input(
                "arrays are compared number by number; leave out times and `world`",
            ));
        }
        let found = of_arrays(py, [first, second])?;
        return Ok(Bound::new(py, found)?.into_any());
    };
    let samples = match has_times {
        true => Some(samples_of(fps, at, start, end)?),
        false => None,
    };
    let clips = [one, other].map(|clip| Arc::clone(&clip.get().motion));
    let engine = engine_of(py, engine)?;
    let (found, warnings) = interruptible(py, move || of_clips(&engine, clips, samples, world))?;
    warn_of(py, &warnings)?;
    Ok(Bound::new(py, found)?.into_any())
}

fn engine_of(py: Python<'_>, engine: Option<&Bound<'_, Engine>>) -> PyResult<tumble::Engine> {
    match engine {
        Some(engine) => engine.get().engine_for(1),
        None => default_engine(py)?.get().engine_for(1),
    }
}

fn of_arrays(py: Python<'_>, arrays: [&Bound<'_, PyAny>; 2]) -> PyResult<ArrayDifference> {
    let read = |value: &Bound<'_, PyAny>, name: &str| {
        let ArrayValues { shape, values } = doubles(value, name)?;
        Ok::<_, PyErr>(npz::NumberArray { shape, values })
    };
    let [first, second] = [read(arrays[0], "first")?, read(arrays[1], "second")?];
    let found = work(py, first.values.len(), move || {
        let found = differences::ArrayDifference::of(["first", "second"], [&first, &second]);
        found.map_err(of_compare)
    })?;
    Ok(ArrayDifference {
        numbers: found.numbers,
        differing: found.differing,
        not_finite: found.not_finite,
        difference: found.difference.into(),
        largest_at: found.largest_at,
        rotation: found.rotation.map(Spread::from),
        largest_rotation_at: found.largest_rotation_at,
    })
}

fn of_clips(
    engine: &tumble::Engine,
    clips: [Arc<Motion>; 2],
    samples: Option<SampleChoice>,
    world: bool,
) -> PyResult<(ClipDifference, Vec<String>)> {
    let pair = ClipPair {
        inputs: ["the first clip", "the second clip"],
        clips: [&clips[0], &clips[1]],
        offset: 0.0,
    };
    let common = pair.common_times().map_err(of_compare)?;
    let mut warning = common.warning.clone();
    // The times are those of the first clip.
    let frames = match samples {
        None => pair.keys(&common),
        Some(SampleChoice::Rate(rate, start, end)) => {
            (pair.frames(&common, rate, start, end)).map_err(of_compare)?
        }
        Some(SampleChoice::Shared { times, .. }) => {
            // With explicit times, a warning about the rates of the clips does not apply.
            warning = None;
            pair.at(&common, &times).map_err(of_compare)?
        }
        Some(_) => {
            return Err(input(
                "at: clips are compared at the same times in all tracks",
            ));
        }
    };
    let warnings = warning.into_iter().chain(pair.assumptions()).collect();
    let found = pair.differences(engine, &frames, world);
    let found = found.map_err(of_compare)?;
    let [first, second] = found.missing;
    let [first_scalars, second_scalars] = found.missing_scalars;
    let scalars = found.each_scalar.into_iter();
    let [start, end] = found.span;
    let difference = ClipDifference {
        tracks: found.tracks,
        missing: (first, second),
        samples: found.samples,
        span: (start, end),
        identical: found.identical,
        rotation: found.rotation.map(ChannelDifference::from),
        translation: found.translation.map(ChannelDifference::from),
        scale: found.scale.map(ChannelDifference::from),
        joints: found
            .joints
            .into_iter()
            .map(JointDifference::from)
            .collect(),
        scalars: scalars
            .map(|scalar| ChannelDifference::from(scalar.difference))
            .collect(),
        missing_scalars: (first_scalars, second_scalars),
    };
    Ok((difference, warnings))
}

/// The errors of an estimated trajectory against its reference, as in benchmarks of odometry and SLAM. The
/// numbers are the same as those of the program `evo`.
///
/// Both clips have one track, or `track` selects one. They are compared at the times of the clip with fewer poses,
/// where the other is interpolated by lines and arcs; `associate="nearest:0.01"` takes its nearest pose within 0.01
/// s, as evo does. The estimate is aligned to the reference by `align`: "position" translates it, "yaw" also rotates
/// it about z, "se3" about any axis, "sim3" also scales it. Absolute errors are computed for each pose. `rpe` adds
/// relative errors over steps of a time or a length: "1s", "0.5m". `max_gap`: poses between two that are more than
/// this many seconds apart are not interpolated. A warning reports gaps, and positions that do not determine the
/// rotation of the alignment.
///
/// >>> import numpy as np, tumble
/// >>> path = np.random.default_rng(1).normal(size=(9, 3))
/// >>> keys = np.tile([0, 0, 0, 1], (9, 1))
/// >>> one = tumble.Clip(np.arange(9), keys, translations=[path])
/// >>> other = tumble.Clip(np.arange(9), keys, translations=[2 * path + 1])
/// >>> found = tumble.path_errors(one, other, align="sim3")
/// >>> round(found.scale, 6), found.ape_translation.max < 1e-6
/// (0.5, True)
#[pyfunction]
#[pyo3(signature = (reference, estimate, *, align="none", rpe=None, associate="interpolated", max_gap=None, track=None, engine=None))]
#[allow(clippy::too_many_arguments, reason = "keywords")]
pub(crate) fn path_errors(
    py: Python<'_>,
    reference: &Bound<'_, Clip>,
    estimate: &Bound<'_, Clip>,
    align: &str,
    rpe: Option<&str>,
    associate: &str,
    max_gap: Option<f64>,
    track: Option<&Bound<'_, PyAny>>,
    engine: Option<&Bound<'_, Engine>>,
) -> PyResult<PathErrors> {
    let align: Align = option_named(align, "align")?;
    if let Some(gap) = max_gap.filter(|gap| gap.is_nan() || *gap < 0.0) {
        return Err(input(format!("max_gap: {gap} is not a number of seconds")));
    }
    let step = rpe.map(|text| {
        let step = text.parse();
        step.map_err(|error| input(format!("rpe: `{text}` is {error}")))
    });
    let associate = (associate.parse())
        .map_err(|error| input(format!("associate: `{associate}` is {error}")))?;
    if matches!(associate, Associate::Nearest(_)) && max_gap.is_some() {
        return Err(input(
            "max_gap: is for interpolated poses; leave out `associate` or `max_gap`",
        ));
    }
    let measure = PathMeasure {
        associate,
        align,
        is_absolute: true,
        step: step.transpose()?,
        max_gap,
        offset: 0.0,
    };
    let one_of = |clip: &Bound<'_, Clip>, name: &str| {
        let clip = clip.get();
        let index = match (track, clip.motion.set.track_count()) {
            (Some(track), _) => clip.track(track)?,
            (None, 1) => 0,
            (None, count) => {
                return Err(input(format!(
                    "{name}: has {count} tracks; a path is one, name it as `track`"
                )));
            }
        };
        Ok((Arc::clone(&clip.motion), index))
    };
    let (first, first_track) = one_of(reference, "reference")?;
    let (second, second_track) = one_of(estimate, "estimate")?;
    let engine = engine_of(py, engine)?;
    let found = interruptible(py, move || {
        let clips = [
            ("the reference", &*first, first_track),
            ("the estimate", &*second, second_track),
        ];
        let found = differences::PathDifference::of(&engine, clips, &measure);
        found.map_err(of_compare)
    })?;
    warn_of(py, &found.warnings)?;
    let Some(absolute) = found.ape else {
        return Err(input("there is no pose to compare"));
    };
    let [start, end] = found.span;
    let rpe_count = found.rpe.as_ref().map_or(0, |errors| errors.count);
    let (rpe_translation, rpe_rotation) = match found.rpe {
        Some(errors) => (
            Some(errors.translation.into()),
            Some(errors.rotation.into()),
        ),
        None => (None, None),
    };
    Ok(PathErrors {
        times_of: found.times_of,
        poses: found.poses,
        outside: found.outside,
        in_gaps: found.in_gaps,
        span: (start, end),
        scale: found.alignment.scale,
        rotation: found.alignment.rotation,
        translation: found.alignment.translation,
        ape_translation: absolute.translation.into(),
        ape_rotation: absolute.rotation.into(),
        rpe_translation,
        rpe_rotation,
        rpe_count,
    })
}
