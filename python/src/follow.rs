//! Bodies on paths: where each is at every sample, and which way it faces.

use glam::{DVec3, Vec3};
use numpy::PyArray1;
use numpy::PyArrayMethods;
use pyo3::prelude::*;
use pyo3::types::{PyString, PyTuple};
use tumble::paths::{BodyAxis, Direction, Follow, FollowError, PathSpeed};
use tumble::{Layout, VectorMethod};
use tumble_formats::path::{Pace, PathPoints, paths_of};

use crate::arrays::{ArrayValues, Order, doubles, has_arrays, parts};
use crate::engine::Engine;
use crate::errors::{in_python, input, of_engine, warn_of};
use crate::names::{one_of, option_named, option_of};
use crate::options::{SampleChoice, ends};
use crate::run::interruptible;
use crate::samples::of_values;

/// The keyword arguments about bodies on paths, before they are checked.
pub(crate) struct FollowOptions<'a, 'py> {
    pub(crate) duration: Option<f64>,
    pub(crate) rate: Option<f64>,
    pub(crate) ups: Option<&'a Bound<'py, PyAny>>,
    pub(crate) method: &'a str,
    pub(crate) ends: Option<&'a Bound<'py, PyAny>>,
    pub(crate) ahead: Option<f64>,
    pub(crate) look_at: Option<&'a Bound<'py, PyAny>>,
    pub(crate) frame: Option<&'a Bound<'py, PyAny>>,
    pub(crate) up: [f64; 3],
    pub(crate) twist: Option<&'a Bound<'py, PyAny>>,
    pub(crate) speed: Option<&'a Bound<'py, PyAny>>,
    pub(crate) forward: &'a str,
    pub(crate) upward: &'a str,
}

impl FollowOptions<'_, '_> {
    fn follow(&self, origin: DVec3) -> PyResult<Follow> {
        let method: VectorMethod = option_named(self.method, "method")?;
        let direction = match (self.ahead, self.look_at) {
            (Some(_), Some(_)) => {
                return Err(input(
                    "`ahead` and `look_at` exclude each other; give one of them",
                ));
            }
            (Some(distance), None) => Direction::Ahead(distance),
            (None, None) => Direction::Tangent,
            (None, Some(target)) => match target.extract::<usize>() {
                Ok(track) => Direction::Track(track),
                Err(_) => match &*doubles(target, "look_at")?.values {
                    &[x, y, z] => Direction::Point(DVec3::new(x, y, z) - origin),
                    _ => {
                        return Err(input(
                            "look_at: give a point, 3 numbers, or the index of a track",
                        ));
                    }
                },
            },
        };
        let axis = |name: &str, text: &str| -> PyResult<BodyAxis> {
            text.parse()
                .map_err(|error: FollowError| input(format!("{name}: {error}")))
        };
        let speed = match self.speed {
            None => PathSpeed::Keys,
            Some(name) if name.is_instance_of::<PyString>() => {
                let known = [
                    ("as-keyed", PathSpeed::Keys),
                    ("keys", PathSpeed::Keys),
                    ("constant", PathSpeed::Constant),
                ];
                one_of(name, "speed", &known)?
            }
            Some(parts) => match &*doubles(parts, "speed")?.values {
                &[start, end] => PathSpeed::Eased { start, end },
                _ => {
                    return Err(input(
                        "speed: give as-keyed, constant, or two fractions of the duration, in which the speed grows and falls",
                    ));
                }
            },
        };
        let rest = Follow::default();
        Ok(Follow::default()
            .with_method(method)
            .with_ends(self.ends.map_or(Ok(rest.ends), ends)?)
            .with_direction(direction)
            .with_frame(
                self.frame
                    .map_or(Ok(rest.frame), |name| option_of(name, "frame"))?,
            )
            .with_up(DVec3::from_array(self.up))
            .with_twist(
                self.twist
                    .map_or(Ok(rest.twist), |name| option_of(name, "twist"))?,
            )
            .with_speed(speed)
            .with_axes([axis("forward", self.forward)?, axis("upward", self.upward)?]))
    }

    fn pace(&self) -> PyResult<Option<Pace>> {
        let positive = |name: &str, number: f64| match number.is_finite() && number > 0.0 {
            true => Ok(number),
            false => Err(input(format!(
                "{name}: {number} is not a number greater than 0"
            ))),
        };
        match (self.duration, self.rate) {
            (Some(_), Some(_)) => Err(input(
                "`duration` and `rate` exclude each other; give one of them",
            )),
            (Some(seconds), None) => Ok(Some(Pace::Seconds(positive("duration", seconds)?))),
            (None, Some(rate)) => Ok(Some(Pace::Rate(positive("rate", rate)?))),
            (None, None) => Ok(None),
        }
    }
}

/// The points of each path, from an array (points, 3) or (tracks, points, 3) or a list with an array for each track; and
/// whether there is a single path, so that the result has no axis of tracks.
fn points(value: &Bound<'_, PyAny>, name: &str) -> PyResult<(Vec<Vec<DVec3>>, bool)> {
    let vectors = |values: &[f64]| -> Vec<DVec3> {
        let all = values.as_chunks::<3>().0.iter();
        all.map(|&point| DVec3::from_array(point)).collect()
    };
    let wrong = |shape: &[usize]| {
        input(format!(
            "{name}: the shape is {shape:?}; give (points, 3), (tracks, points, 3), or a list with an array \
             (points, 3) for each track"
        ))
    };
    if let Some(parts) = parts(value)?
        && has_arrays(&parts)?
        && doubles(&parts[0], name)?.shape.len() == 2
    {
        let one = |part: &Bound<'_, PyAny>| match doubles(part, name)? {
            ArrayValues { shape, values } if matches!(*shape, [_, 3]) => Ok(vectors(&values)),
            ArrayValues { shape, .. } => Err(wrong(&shape)),
        };
        let all: PyResult<Vec<_>> = parts.iter().map(one).collect();
        return Ok((all?, false));
    }
    let ArrayValues { shape, values } = doubles(value, name)?;
    match *shape {
        [_, 3] => Ok((vec![vectors(&values)], true)),
        [_, count, 3] => Ok((
            values.chunks((3 * count).max(1)).map(vectors).collect(),
            false,
        )),
        _ => Err(wrong(&shape)),
    }
}

/// The times of the points [s], from one list for all paths or one for each path.
fn times(value: &Bound<'_, PyAny>, tracks: usize) -> PyResult<Vec<Vec<f64>>> {
    let lists: Vec<Vec<f64>> = match parts(value)? {
        Some(parts) => {
            let one = |part: &Bound<'_, PyAny>| Ok(doubles(part, "times")?.values);
            parts.iter().map(one).collect::<PyResult<_>>()?
        }
        None => match doubles(value, "times")? {
            ArrayValues { shape, values } if shape.len() == 1 => vec![values; tracks],
            ArrayValues { shape, values } if shape.len() == 2 => values
                .chunks(shape[1].max(1))
                .map(<[f64]>::to_vec)
                .collect(),
            ArrayValues { shape, .. } => {
                return Err(input(format!(
                    "times: the shape is {shape:?}; give (points,), (tracks, points), or a list with an array \
                     for each track"
                )));
            }
        },
    };
    match lists.len() == tracks {
        true => Ok(lists),
        false => Err(input(format!(
            "times: there are lists for {} tracks, and points for {tracks}",
            lists.len()
        ))),
    }
}

/// Evaluates paths: the positions and rotations of their bodies at the samples.
pub(crate) fn follow<'py>(
    engine: &Engine,
    (key_times, path): (Option<&Bound<'py, PyAny>>, &Bound<'py, PyAny>),
    options: &FollowOptions<'_, 'py>,
    moments: SampleChoice,
    (layout, order): (Layout, Order),
) -> PyResult<Bound<'py, PyTuple>> {
    let py = path.py();
    let (all, is_one_track) = points(path, "points")?;
    let tracks = all.len();
    let lists = match key_times {
        Some(value) => times(value, tracks)?,
        None => vec![Vec::new(); tracks],
    };
    let ups = match options.ups {
        Some(value) => points(value, "ups")?.0,
        None => vec![Vec::new(); tracks],
    };
    if ups.len() != tracks {
        return Err(input(format!(
            "ups: there are lists for {} tracks, and points for {tracks}",
            ups.len()
        )));
    }
    let up = |up: DVec3| {
        let up = up.as_vec3();
        // If the surface has no normal here, there is no upward direction.
        (up != Vec3::ZERO && !up.is_nan()).then_some(up)
    };
    let paths = (all.into_iter().zip(lists).zip(ups)).map(|((points, times), ups)| PathPoints {
        times,
        points,
        ups: ups.into_iter().map(up).collect(),
    });
    let paths: Vec<PathPoints> = paths.collect();
    for (track, path) in paths.iter().enumerate() {
        if path.points.is_empty() {
            return Err(input(format!(
                "points[{track}]: a path needs at least one point"
            )));
        }
        if let Some(point) = path.points.iter().position(|point| !point.is_finite()) {
            return Err(input(format!(
                "points[{track}][{point}]: a coordinate is not finite"
            )));
        }
        let (points, times, ups) = (path.points.len(), path.times.len(), path.ups.len());
        if (times != points && times != 0) || (ups != points && ups != 0) {
            return Err(input(format!(
                "points[{track}]: there are {points}, with {times} times and {ups} upward directions"
            )));
        }
    }
    let made = paths_of("points", "", paths, options.pace()?).map_err(|fault| {
        let message = match options.pace() {
            Ok(None) if key_times.is_none() => {
                "times: a path without times needs `duration` in seconds, or `rate`, its speed"
                    .to_owned()
            }
            Ok(Some(_)) if key_times.is_some() => {
                "times: the path has times; leave out `duration` and `rate`".to_owned()
            }
            _ => in_python(&fault.to_string()),
        };
        input(message)
    })?;
    let origin = made.origin(0);
    let follow = options.follow(origin)?;
    let is_one_time = matches!(moments, SampleChoice::Shared { is_one: true, .. });
    let (frames, count) = moments.resolved(&made)?;
    let engine = engine.engine_for(tracks * count)?;
    let found = interruptible(py, move || {
        let found = engine.follow(&made.set, &follow, &frames, layout);
        found.map_err(|error| match error {
            tumble::Error::Follow(error) => input(error.to_string()),
            error => of_engine(&error),
        })
    })?;
    let warnings: Vec<String> = found.warnings.iter().map(ToString::to_string).collect();
    warn_of(py, &warnings)?;
    let positions = match origin == DVec3::ZERO {
        true => of_values(py, &found.positions, |[x, y, z, _]| [x, y, z])?,
        false => {
            let relative = found.positions.as_slice().iter();
            let exact =
                relative.flat_map(|point| (origin + point.truncate().as_dvec3()).to_array());
            let shape = match layout {
                Layout::TrackMajor => [tracks, count, 3],
                Layout::FrameMajor => [count, tracks, 3],
            };
            let flat = PyArray1::from_vec(py, exact.collect::<Vec<f64>>());
            flat.reshape(shape)?.into_any()
        }
    };
    let rotations = of_values(py, &found.rotations, |of| order.of_xyzw(of))?;
    // A single path has no axis of tracks, and a single time has no axis of frames.
    let (track_axis, frame_axis) = match layout {
        Layout::TrackMajor => (0, 1),
        Layout::FrameMajor => (1, 0),
    };
    let mut axes = Vec::new();
    if is_one_track {
        axes.push(track_axis);
    }
    if is_one_time {
        axes.push(frame_axis);
    }
    let plain = |array: Bound<'py, PyAny>| match axes.is_empty() {
        true => Ok(array),
        false => array.call_method1("squeeze", (PyTuple::new(py, &axes)?,)),
    };
    PyTuple::new(py, [plain(positions)?, plain(rotations)?])
}
