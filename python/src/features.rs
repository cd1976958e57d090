//! `tumble.features`: features for learning, computed from arrays.

use glam::{DQuat, DVec3};
use numpy::{Element, PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use tumble_formats::learning::{
    self, ContactLimits, Ground, HUMANML3D_JOINTS, HUMANML3D_NUMBERS, HeadingSource, RootMotion,
    SixOrder,
};

use crate::arrays::{ArrayValues, ListArgument, Order, doubles, vectors, whole_number};
use crate::errors::input;
use crate::names::{one_of, option_named};
use crate::output::shown;
use crate::run::work;

/// An array of numbers.
fn array<T: Element>(
    py: Python<'_>,
    numbers: Vec<T>,
    shape: Vec<usize>,
) -> PyResult<Bound<'_, PyAny>> {
    Ok(PyArray1::from_vec(py, numbers).reshape(shape)?.into_any())
}

/// The numbers of an array whose last axis has a fixed length, and the shape before that axis.
fn rows<const N: usize>(
    value: &Bound<'_, PyAny>,
    name: &str,
) -> PyResult<(Vec<usize>, Vec<[f64; N]>)> {
    let ArrayValues { mut shape, values } = doubles(value, name)?;
    match shape.pop() {
        Some(width) if width == N => Ok((shape, values.as_chunks::<N>().0.to_vec())),
        width => {
            shape.extend(width);
            Err(input(format!(
                "{name}: its shape is {}; the last axis has {N} numbers",
                shown(&shape)
            )))
        }
    }
}

/// Quaternions in f64, normalised; 0 and numbers that are not finite are refused.
fn rotations(value: &Bound<'_, PyAny>, order: Order) -> PyResult<(Vec<usize>, Vec<DQuat>)> {
    let (shape, rows) = rows::<4>(value, "quaternions")?;
    let unit = |(index, row): (usize, [f64; 4])| {
        let q = DQuat::from_array(order.xyzw(row));
        match q.length() {
            length if length.is_finite() && length > 1e-6 => Ok(q / length),
            length => Err(input(format!(
                "quaternions: number {index} has the norm {length}"
            ))),
        }
    };
    let rotations: PyResult<Vec<DQuat>> = rows.into_iter().enumerate().map(unit).collect();
    Ok((shape, rotations?))
}

fn with(shape: &[usize], width: usize) -> Vec<usize> {
    [shape, &[width]].concat()
}

/// Rotations as six numbers, float64 (…, 6), of `quaternions` (…, 4). `kind`: "six-columns" (HumanML3D, Kimodo),
/// "six-rows" (PyTorch3D) or "six-interleaved" (SPIN); there is no default, because programs differ. `order`: "wxyz" or
/// "xyzw".
///
/// >>> import tumble
/// >>> tumble.features.six([0.0, 0.0, 0.0, 1.0], "six-interleaved", order="xyzw")
/// array([1., 0., 0., 1., 0., 0.])
#[pyfunction]
#[pyo3(signature = (quaternions, kind, *, order))]
pub(crate) fn six<'py>(
    quaternions: &Bound<'py, PyAny>,
    kind: &str,
    order: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let kind: SixOrder = option_named(kind, "kind")?;
    let (shape, rotations) = rotations(quaternions, Order::named(order)?)?;
    let numbers = rotations.iter().flat_map(|&q| learning::six(q, kind));
    array(quaternions.py(), numbers.collect(), with(&shape, 6))
}

/// The quaternions, float64 (…, 4), of six numbers each, (…, 6), such as those of a network: they need not be those of a
/// rotation. Otherwise as `six`.
///
/// >>> import tumble
/// >>> tumble.features.rotations_of_six([2.0, 0, 0, 0.1, 3, 0], "six-columns", order="xyzw")
/// array([0., 0., 0., 1.])
#[pyfunction]
#[pyo3(signature = (numbers, kind, *, order))]
pub(crate) fn rotations_of_six<'py>(
    numbers: &Bound<'py, PyAny>,
    kind: &str,
    order: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let kind: SixOrder = option_named(kind, "kind")?;
    let order = Order::named(order)?;
    let (shape, all) = rows::<6>(numbers, "numbers")?;
    let mut found = Vec::with_capacity(all.len() * 4);
    for (index, numbers) in all.into_iter().enumerate() {
        let rotation = learning::rotation_of_six(numbers, kind).ok_or_else(|| {
            input(format!(
                "numbers: {numbers:?}, number {index}, are no rotation"
            ))
        })?;
        found.extend(order.of_xyzw(rotation.to_array()));
    }
    array(numbers.py(), found, with(&shape, 4))
}

/// The headings of `quaternions` (…, 4) in radians, from -π to π, about the axis that points `up`, "y" or "z": float64 (…).
/// By default it is the twist about that axis; with `axis` "x", "y" or "z", it is the direction of this axis of the body
/// on the ground. With z up the heading of +x is 0, with y up that of +z.
///
/// >>> import tumble
/// >>> tumble.features.heading([[0.8, 0, 0, 0.6]], order="wxyz", up="z").round(3)
/// array([1.287])
#[pyfunction]
#[pyo3(signature = (quaternions, *, order, up, axis=None))]
pub(crate) fn heading<'py>(
    quaternions: &Bound<'py, PyAny>,
    order: &str,
    up: &str,
    axis: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let ground: Ground = option_named(up, "up")?;
    let axis = axis.map(axis_of).transpose()?;
    let (shape, rotations) = rotations(quaternions, Order::named(order)?)?;
    let of = |&rotation: &DQuat| match axis {
        None => learning::twist_heading(rotation, ground),
        Some(axis) => learning::forward_heading(rotation, DVec3::AXES[axis], ground),
    };
    array(quaternions.py(), rotations.iter().map(of).collect(), shape)
}

/// How the heading of a root is measured: by an axis of its body, or by its twist.
pub(crate) fn heading_source(axis: Option<&Bound<'_, PyAny>>) -> PyResult<HeadingSource> {
    let axes = [HeadingSource::X, HeadingSource::Y, HeadingSource::Z];
    let axis = axis.map(axis_of).transpose()?;
    Ok(axis.map_or(HeadingSource::Twist, |axis| axes[axis]))
}

/// The motion over the ground of a root at `positions` (frames, 3) with `quaternions` (frames, 4), and the rest: its
/// places on the ground (frames, 3), its headings (frames,) in rad, which count whole turns, and the positions and
/// quaternions of the root in place, above the origin and facing heading 0. All are float64. `up` and `axis` are those of
/// `heading`.
///
/// >>> import tumble
/// >>> places, headings, positions, quaternions = tumble.features.root_motion(
/// ...     [[1, 2, 0.9]], [[0.8, 0, 0, 0.6]], order="wxyz", up="z")
/// >>> places, headings.round(3), positions
/// (array([[1., 2., 0.]]), array([1.287]), array([[0. , 0. , 0.9]]))
#[pyfunction]
#[pyo3(signature = (positions, quaternions, *, order, up, axis=None))]
pub(crate) fn root_motion<'py>(
    positions: &Bound<'py, PyAny>,
    quaternions: &Bound<'py, PyAny>,
    order: &str,
    up: &str,
    axis: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let (ground, source): (Ground, _) = (option_named(up, "up")?, heading_source(axis)?);
    let order = Order::named(order)?;
    let (shape, points) = vectors(positions, "positions")?;
    let (frames, rotations) = rotations(quaternions, order)?;
    let &[count] = &shape[..] else {
        let shape = shown(&with(&shape, 3));
        return Err(input(format!(
            "positions: its shape is {shape}; give (frames, 3)"
        )));
    };
    if frames != shape {
        let shape = shown(&with(&frames, 4));
        return Err(input(format!(
            "quaternions: its shape is {shape}, not ({count}, 4)"
        )));
    }
    let motion = RootMotion::of(&points, &rotations, ground, source);
    let (mut still, mut upright) = (Vec::new(), Vec::new());
    for (frame, (&point, &rotation)) in points.iter().zip(&rotations).enumerate() {
        let (point, rotation) = motion.in_place(frame, point, rotation);
        still.extend(point.to_array());
        upright.extend(order.of_xyzw(rotation.to_array()));
    }
    let py = positions.py();
    let ground_points = motion.positions.iter().flat_map(DVec3::to_array).collect();
    let all = [
        array(py, ground_points, vec![count, 3])?,
        array(py, motion.headings, vec![count])?,
        array(py, still, vec![count, 3])?,
        array(py, upright, vec![count, 4])?,
    ];
    PyTuple::new(py, all)
}

/// The positions (frames, 3) and headings (frames,) of a root motion after `loops` whole loops, each of which
/// begins where the one before ended; float64. A negative number means loops before the first. Rounding errors do
/// not grow with the number of loops.
///
/// >>> import tumble
/// >>> ahead = [[0, 0, 0], [1, 0, 0]]
/// >>> tumble.features.root_after_loops(ahead, [0, 0], 10, up="z")[0]
/// array([[10.,  0.,  0.],
///        [11.,  0.,  0.]])
#[pyfunction]
#[pyo3(signature = (positions, headings, loops, *, up))]
pub(crate) fn root_after_loops<'py>(
    positions: &Bound<'py, PyAny>,
    headings: &Bound<'py, PyAny>,
    loops: i64,
    up: &str,
) -> PyResult<Bound<'py, PyTuple>> {
    let ground: Ground = option_named(up, "up")?;
    let (shape, points) = vectors(positions, "positions")?;
    let ArrayValues {
        shape: frames,
        values,
    } = doubles(headings, "headings")?;
    if shape.len() != 1 || frames != shape {
        let shapes = [shown(&with(&shape, 3)), shown(&frames)];
        return Err(input(format!(
            "positions and headings: their shapes are {} and {}; give (frames, 3) and (frames,)",
            shapes[0], shapes[1]
        )));
    }
    let motion = RootMotion {
        ground,
        positions: points,
        headings: values,
    };
    let motion = motion.after_loops(loops);
    let py = positions.py();
    let ground_points = motion.positions.iter().flat_map(DVec3::to_array).collect();
    let all = [
        array(py, ground_points, with(&shape, 3))?,
        array(py, motion.headings, shape)?,
    ];
    PyTuple::new(py, all)
}

/// The index of an axis: 0, 1 or 2 for "x", "y" or "z".
pub(crate) fn axis_of(axis: &Bound<'_, PyAny>) -> PyResult<usize> {
    one_of(axis, "axis", &[("x", 0), ("y", 1), ("z", 2)])
}

/// An odd number of frames.
fn odd_window(window: &Bound<'_, PyAny>) -> PyResult<usize> {
    let count = whole_number(window, "window", "an odd number of frames")?;
    match count % 2 {
        0 => Err(input(format!(
            "window: {count} is even; give an odd number of frames"
        ))),
        _ => Ok(count),
    }
}

/// Which bodies touch the ground: bool (…), of `positions` and `velocities` (…, 3). A body touches it while it is
/// lower than `height` (metres) and slower than `speed` (m/s). `window`: an odd number of frames; each value is
/// replaced by the majority of this many frames around it. The arrays are then (…, frames, bodies, 3), such as
/// those of `MotionLibrary.sample_windows`, or (frames, 3) for one body; each item of the other axes is filtered
/// separately.
///
/// >>> import tumble
/// >>> tumble.features.contacts([[0.0, 0.0, 0.02]], [[0.1, 0.0, 0.0]], up="z", height=0.05, speed=0.2)
/// array([ True])
#[pyfunction]
#[pyo3(signature = (positions, velocities, *, up, height, speed, window=None))]
pub(crate) fn contacts<'py>(
    positions: &Bound<'py, PyAny>,
    velocities: &Bound<'py, PyAny>,
    up: &str,
    height: f64,
    speed: f64,
    window: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let ground: Ground = option_named(up, "up")?;
    for (name, limit) in [("height", height), ("speed", speed)] {
        if limit.is_nan() {
            return Err(input(format!("{name}: it is not a number")));
        }
    }
    let window = window.map(odd_window).transpose()?;
    let (shape, points) = vectors(positions, "positions")?;
    let (other, rates) = vectors(velocities, "velocities")?;
    if shape != other {
        return Err(input(format!(
            "positions and velocities: their shapes are {} and {}; they are of the same bodies",
            shown(&with(&shape, 3)),
            shown(&with(&other, 3))
        )));
    }
    let limits = ContactLimits { height, speed };
    let mut found = learning::contacts(&points, &rates, ground, limits);
    if let Some(window) = window {
        let (frames, bodies) = match shape[..] {
            [.., frames, bodies] => (frames, bodies),
            [frames] => (frames, 1),
            [] => (1, 1),
        };
        for item in found.chunks_mut((frames * bodies).max(1)) {
            for body in 0..bodies {
                let of_body: Vec<bool> = item.iter().skip(body).step_by(bodies).copied().collect();
                let kept = learning::majority(&of_body, window);
                for (frame, touches) in kept.into_iter().enumerate() {
                    item[frame * bodies + body] = touches;
                }
            }
        }
    }
    array(positions.py(), found, shape)
}

/// The index of each name's partner on the other side, by the words for sides in names (`left_hip`, `RightArm`, `foot_l`,
/// `Arm.L`, `Bip01 L Thigh`, `kLeftElbow`); a name without a partner is its own.
///
/// >>> import tumble
/// >>> tumble.features.mirror_pairs(["hips", "left_knee", "right_knee"])
/// [0, 2, 1]
#[pyfunction]
pub(crate) fn mirror_pairs(names: ListArgument<String>) -> Vec<usize> {
    learning::mirror_pairs(&names.0)
}

/// Checks `pairs`: the index of the body from which each row of the second-last axis is copied.
fn partners(pairs: Option<ListArgument<usize>>, shape: &[usize]) -> PyResult<Option<Vec<usize>>> {
    let Some(ListArgument(pairs)) = pairs else {
        return Ok(None);
    };
    let bodies = shape.last().copied().unwrap_or(0);
    match pairs.len() == bodies && pairs.iter().all(|&partner| partner < bodies) {
        true => Ok(Some(pairs)),
        false => Err(input(format!(
            "pairs: {} indices for {bodies} bodies; give the partner of each, as `mirror_pairs` does",
            pairs.len()
        ))),
    }
}

/// Exchanges rows with their partners (`pairs`).
fn exchanged<T: Copy>(rows: Vec<T>, pairs: Option<&[usize]>) -> Vec<T> {
    let Some(pairs) = pairs.filter(|pairs| !pairs.is_empty()) else {
        return rows;
    };
    let frames = rows.chunks(pairs.len());
    frames
        .flat_map(|frame| pairs.iter().map(|&partner| frame[partner]))
        .collect()
}

/// Positions or velocities (…, bodies, 3), mirrored at the plane through the origin that is perpendicular to `axis`,
/// "x", "y" or "z", the axis from left to right. `pairs`: the partner of each body (`mirror_pairs`), with which it is
/// exchanged.
///
/// >>> import tumble
/// >>> tumble.features.mirrored_positions([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], axis="y", pairs=[1, 0])
/// array([[ 4., -5.,  6.],
///        [ 1., -2.,  3.]])
#[pyfunction]
#[pyo3(signature = (positions, *, axis, pairs=None))]
pub(crate) fn mirrored_positions<'py>(
    positions: &Bound<'py, PyAny>,
    axis: &Bound<'py, PyAny>,
    pairs: Option<ListArgument<usize>>,
) -> PyResult<Bound<'py, PyAny>> {
    let axis = axis_of(axis)?;
    let (shape, points) = vectors(positions, "positions")?;
    let pairs = partners(pairs, &shape)?;
    let points = exchanged(points, pairs.as_deref()).into_iter();
    let numbers = points.flat_map(|point| learning::mirrored_point(point, axis).to_array());
    array(positions.py(), numbers.collect(), with(&shape, 3))
}

/// Rotations in the world, `quaternions` (…, bodies, 4), mirrored as `mirrored_positions`.
///
/// >>> import tumble
/// >>> tumble.features.mirrored_rotations([[0.8, 0.6, 0.0, 0.0]], order="wxyz", axis="y")
/// array([[ 0.8, -0.6, -0. , -0. ]])
#[pyfunction]
#[pyo3(signature = (quaternions, *, order, axis, pairs=None))]
pub(crate) fn mirrored_rotations<'py>(
    quaternions: &Bound<'py, PyAny>,
    order: &str,
    axis: &Bound<'py, PyAny>,
    pairs: Option<ListArgument<usize>>,
) -> PyResult<Bound<'py, PyAny>> {
    let axis = axis_of(axis)?;
    let order = Order::named(order)?;
    let (shape, rotations) = rotations(quaternions, order)?;
    let pairs = partners(pairs, &shape)?;
    let rotations = exchanged(rotations, pairs.as_deref()).into_iter();
    let numbers =
        rotations.flat_map(|q| order.of_xyzw(learning::mirrored_rotation(q, axis).to_array()));
    array(quaternions.py(), numbers.collect(), with(&shape, 4))
}

/// The 263 numbers of HumanML3D, float64 (frames - 1, 263), of `positions` (frames, 22, 3): SMPL's joints without hands,
/// metres, y up, at 20 frames a second. The motion is moved to the ground and the origin and turned to face +z first;
/// skeletons are not scaled. `threshold`: a foot touches the ground while the square of its step is less.
///
/// >>> import numpy as np, tumble
/// >>> joints = np.random.default_rng(1).normal(size=(5, 22, 3))
/// >>> tumble.features.humanml3d(joints).shape
/// (4, 263)
#[pyfunction]
#[pyo3(signature = (positions, *, threshold=0.002))]
pub(crate) fn humanml3d<'py>(
    positions: &Bound<'py, PyAny>,
    threshold: f64,
) -> PyResult<Bound<'py, PyAny>> {
    let py = positions.py();
    let (shape, points) = vectors(positions, "positions")?;
    let &[_, HUMANML3D_JOINTS] = &shape[..] else {
        return Err(input(format!(
            "positions: its shape is {}; give (frames, {HUMANML3D_JOINTS}, 3)",
            shown(&with(&shape, 3))
        )));
    };
    let found = work(py, points.len(), move || {
        let frames = points.as_chunks().0;
        learning::humanml3d(frames, threshold).map_err(|error| input(format!("positions: {error}")))
    })?;
    let count = found.len();
    array(py, found.into_flattened(), vec![count, HUMANML3D_NUMBERS])
}

/// The positions, float64 (frames, 22, 3), of HumanML3D's numbers (frames, 263).
///
/// >>> import numpy as np, tumble
/// >>> tumble.features.positions_of_humanml3d(np.zeros((3, 263))).shape
/// (3, 22, 3)
#[pyfunction]
pub(crate) fn positions_of_humanml3d<'py>(
    features: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let (shape, rows) = rows::<HUMANML3D_NUMBERS>(features, "features")?;
    let &[frames] = &shape[..] else {
        return Err(input(format!(
            "features: its shape is {}; give (frames, {HUMANML3D_NUMBERS})",
            shown(&with(&shape, HUMANML3D_NUMBERS))
        )));
    };
    let found = learning::positions_of_humanml3d(&rows);
    let numbers = found.iter().flatten().flat_map(DVec3::to_array);
    array(
        features.py(),
        numbers.collect(),
        vec![frames, HUMANML3D_JOINTS, 3],
    )
}
