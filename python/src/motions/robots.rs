//! Motion libraries of a robot: the joints of clips are interpolated, and its bodies follow from them.

use std::borrow::Cow;

use numpy::{BorrowError, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadwriteArrayDyn};
use pyo3::prelude::*;
use tumble::crowd::{BodyStates, BodyTables, MotionClip};
use tumble::trees::{Tree, TreeError};
use tumble::{Channel, Method, VectorMethod};
use tumble_formats::Diagnostic;
use tumble_formats::motion::Motion;
use tumble_formats::robot::{self, RobotTracks, VelocityPoint};
use tumble_formats::sample::{ChannelMethods, MethodChoice};

use crate::arrays::{ListArgument, Order};
use crate::clip::Clip;
use crate::engine::Engine;
use crate::errors::{guarded, input, of_diagnostic, warn};
use crate::motions::scalars::vector_method;
use crate::motions::{
    ListedClip, MANY, Motions, SkippedClip, Tables, built, none_fits, of_crowd, precision_of, rows,
    ticks_for,
};
use crate::names::option_named;
use crate::options::method_named;
use crate::robot::{Robot, of_bodies};
use crate::run::stoppable;

/// The clips of a robot, prepared by a method. `order` is that of quaternions; the orders of bodies and the point of their
/// velocities are those of `Engine.bodies`. `skip`: clips that do not fit are left out.
#[pyfunction]
#[pyo3(signature = (clips, robot, method, *, order, body_order, siblings, velocity_at, skip=false, packed=false))]
#[allow(clippy::too_many_arguments, reason = "keywords")]
pub(crate) fn robot_motions(
    py: Python<'_>,
    clips: ListArgument<Clip>,
    robot: &Bound<'_, Robot>,
    method: &str,
    order: &str,
    body_order: &str,
    siblings: &str,
    velocity_at: &str,
    skip: bool,
    packed: bool,
) -> PyResult<Motions> {
    let ListArgument(clips) = clips;
    let (robot, method) = (robot.get(), method_named(method)?);
    let is_w_first = matches!(Order::named(order)?, Order::Wxyz);
    let tree = robot.tree();
    let bodies = tree.order(
        option_named(body_order, "body_order")?,
        option_named(siblings, "siblings")?,
    );
    let point: VelocityPoint = option_named(velocity_at, "velocity_at")?;
    let points = robot::mass_centres(tree, point).map_err(|error| of_bodies(&error))?;
    let (mut motions, mut kept, mut skipped) = (Vec::new(), Vec::new(), Vec::new());
    let mut warnings = Vec::new();
    for listed in ListedClip::all(&clips) {
        match assigned(py, robot, listed, method) {
            Ok((motion, of_clip)) => {
                motions.push(motion);
                kept.push(listed);
                warnings.extend(of_clip);
            }
            Err(error) if skip => {
                let skipped_clip: SkippedClip = (listed.index, error.value(py).to_string());
                skipped.push(skipped_clip);
            }
            Err(error) => return Err(error),
        }
    }
    if motions.is_empty() {
        return Err(none_fits(&skipped));
    }
    warn(py, &warnings)?;
    let of_tree = |error: TreeError| input(format!("robot: {error}"));
    let (parts, frames) = py.detach(|| {
        stoppable(|| {
            let tracks = RobotTracks::new(tree, &motions);
            let frames = tracks.frames(&bodies, &points).map_err(of_tree)?;
            let frames = if is_w_first {
                frames.with_w_first()
            } else {
                frames
            };
            let skeleton = tracks.skeleton();
            let skeleton = skeleton.map_err(|error| input(format!("robot: {error}")))?;
            let options = (ticks_for(&motions), precision_of(packed));
            let parts = built(&skeleton, options, &kept, |index, listed| {
                let motion = &motions[index];
                let set = tracks.set(motion);
                let set = set.map_err(|error| input(format!("{listed}: {error}")))?;
                let found = methods(tree, motion, method);
                let (of_rotations, vectors) = found.ok_or_else(|| several_methods(listed))?;
                Ok(MotionClip {
                    set: Cow::Owned(set),
                    interpolation: of_rotations.into(),
                    vectors,
                })
            })?;
            Ok((parts, frames))
        })
    })?;
    let (tables, spans, cells) = parts;
    let tables = BodyTables::new(tables, frames).map_err(of_crowd)?;
    let joints = tree.scalar_joints().map(|joint| joint.name.clone());
    let bodies = bodies.iter().map(|&body| tree.bodies()[body].name.clone());
    Ok(Motions {
        skipped,
        body_names: bodies.collect(),
        ..Motions::of_parts(py, (Tables::Robot(tables), spans, cells), joints.collect())?
    })
}

/// A clip with the names of the robot's joints, and the warnings about it.
fn assigned(
    py: Python<'_>,
    robot: &Robot,
    listed: ListedClip<'_>,
    method: MethodChoice,
) -> PyResult<(Motion, Vec<Diagnostic>)> {
    let name = listed.to_string();
    let clip = listed.clip;
    let (motion, warnings) = py.detach(|| {
        let assigned = robot.described().assign_clip(&clip.motion, &name);
        assigned.map_err(|fault| of_diagnostic(&fault))
    })?;
    match methods(robot.tree(), &motion, method) {
        Some(_) => Ok((motion, warnings)),
        None => Err(several_methods(listed)),
    }
}

fn several_methods(listed: ListedClip<'_>) -> PyErr {
    input(format!(
        "{listed}: its tracks have several methods; name one as `method`"
    ))
}

/// The methods of a clip's rotations and of its positions and scalars; `None` if it has several.
fn methods(tree: &Tree, motion: &Motion, method: MethodChoice) -> Option<(Method, VectorMethod)> {
    let choice = ChannelMethods {
        method,
        ..ChannelMethods::AUTHORED
    };
    let of_rotations = choice.method_of(motion)?;
    let names: Vec<String> = tree
        .scalar_joints()
        .map(|joint| joint.name.clone())
        .collect();
    let of_scalars = vector_method(motion, &names, method);
    let keys = |track| motion.set.vector_keys(Channel::Translation, track);
    let moves = |track| keys(track).is_some();
    if method.0.is_none() && (0..motion.set.track_count()).any(moves) {
        let of_positions = choice.vector_method_of(motion)?;
        let has_scalars = motion.set.scalar_count() > 0;
        return (!has_scalars || of_positions == of_scalars)
            .then_some((of_rotations, of_positions));
    }
    Some((of_rotations, of_scalars))
}

/// Fills arrays of a robot's library: the values and velocities of joints, and the positions, rotations, velocities and
/// angular velocities of bodies, each None where it is left out. `frames`: as of `Motions.sample`.
#[pyfunction]
#[pyo3(signature = (motions, engine, clip_ids, times, outputs, frames=None))]
pub(crate) fn sample_bodies(
    py: Python<'_>,
    motions: &Bound<'_, Motions>,
    engine: &Bound<'_, Engine>,
    clip_ids: PyReadonlyArray1<'_, i64>,
    times: PyReadonlyArray1<'_, f64>,
    outputs: [Option<Bound<'_, PyArrayDyn<f32>>>; 6],
    frames: Option<(PyReadonlyArray1<'_, f64>, PyReadonlyArray1<'_, f64>)>,
) -> PyResult<()> {
    let motions = motions.get();
    let Tables::Robot(tables) = &motions.tables else {
        return Err(input("arrays: the library has no robot"));
    };
    let at = motions.instances(&clip_ids, &times)?;
    let steps = match &frames {
        Some((rates, lengths)) => {
            let frames = (rates.as_slice()?, lengths.as_slice()?);
            Some(motions.steps(&at, &times, frames)?)
        }
        None => None,
    };
    let scalars = at.len() * tables.frames().scalar_count();
    let bodies = at.len() * tables.frames().body_count();
    let mut outputs = outputs.each_ref().map(|array| {
        array
            .as_ref()
            .map(PyArrayMethods::try_readwrite)
            .transpose()
    });
    let [p, v, x, q, l, a] = &mut outputs;
    let states = BodyStates {
        joint_values: memory::<1>(p, scalars)?.as_flattened_mut(),
        joint_rates: memory::<1>(v, scalars)?.as_flattened_mut(),
        positions: memory(x, bodies)?,
        rotations: memory(q, bodies)?,
        velocities: memory(l, bodies)?,
        angular_velocities: memory(a, bodies)?,
    };
    let engine = engine.get().engine_for(1)?;
    motions.with_parts(py, |_, parts| {
        let work = || {
            let sampled = tables.sample_into(&engine, parts, &at, steps.as_deref(), states);
            sampled.map_err(of_crowd)
        };
        match bodies < MANY {
            true => guarded(work),
            false => stoppable(work),
        }
    })
}

/// The memory of an output, if it could be borrowed.
fn memory<'a, const N: usize>(
    of: &'a mut Result<Option<PyReadwriteArrayDyn<'_, f32>>, BorrowError>,
    count: usize,
) -> PyResult<&'a mut [[f32; N]]> {
    match of {
        Ok(of) => rows(of, count),
        Err(error) => Err(input(format!("out: {error}"))),
    }
}
