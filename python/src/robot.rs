//! `tumble.Robot`: the bodies and joints of a robot, and where they are.

use std::path::PathBuf;

use glam::{DQuat, DVec3, Vec3};
use numpy::{Element, PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyType};
use tumble::method::BESSEL_OVERHAUSER;
use tumble::names::counted;
use tumble::trees::{
    BodyArrays, BodyMotion, BodyPose, BodyVelocity, Configuration, ConfigurationRates, JointKind,
    Tree,
};
use tumble::{Quantity, TrackSet};
use tumble_formats::motion::Motion;
use tumble_formats::robot::{
    self, BodiesError, BodiesRequest, FixedBodies, LimitExcess, LimitRule, VelocityPoint,
    VelocitySource, unwrap_joint,
};

use crate::arrays::{ArrayValues, Order, doubles, quaternions};
use crate::engine::Engine;
use crate::errors::{in_python, input, of_diagnostic, of_engine, of_track, warn, warn_of};
use crate::names::{option_of, unknown_name};
use crate::options::{EvaluationKeywords, frame_rate};
use crate::output::shown;
use crate::run::{interruptible, work};

/// A robot: its bodies (links) and joints, from an MJCF or URDF file.
///
/// `Robot.load(path)` reads it. Bodies and joints are numbered depth first, children as in the file;
/// other orders are asked for by name. Angles are in rad, lengths in metres.
///
/// >>> import pathlib, tempfile, tumble
/// >>> path = pathlib.Path(tempfile.mkdtemp(), "arm.urdf")
/// >>> _ = path.write_text('<robot name="arm"><link name="base"/><link name="hand"/>'
/// ...     '<joint name="elbow" type="continuous"><parent link="base"/><child link="hand"/>'
/// ...     '<origin xyz="0 0 1"/><axis xyz="0 1 0"/></joint></robot>')
/// >>> robot = tumble.Robot.load(path)
/// >>> robot.joint_names
/// ['elbow']
/// >>> robot.forward([[0.0], [3.0]], order="wxyz")["body_pos_w"][:, 1]
/// array([[0., 0., 1.],
///        [0., 0., 1.]])
#[pyclass(frozen, weakref, module = "tumble")]
pub(crate) struct Robot {
    robot: robot::Robot,
    path: PathBuf,
    fixed_bodies: FixedBodies,
}

#[pymethods]
impl Robot {
    /// Reads a robot from an MJCF or URDF file. `fixed_bodies`: "merge" makes bodies without joints parts of the bodies
    /// that they are fixed to, as simulators do with URDF; "keep" keeps them.
    ///
    /// >>> import pathlib, tempfile, tumble
    /// >>> path = pathlib.Path(tempfile.mkdtemp(), "arm.xml")
    /// >>> _ = path.write_text('<mujoco><worldbody><body name="upper"><joint name="shoulder"/>'
    /// ...     '<body name="hand" pos="0 0 1"/></body></worldbody></mujoco>')
    /// >>> robot = tumble.Robot.load(path)
    /// >>> robot
    /// Robot("", 2 bodies, 1 joint)
    #[classmethod]
    #[pyo3(signature = (path, fixed_bodies="keep"))]
    fn load(class: &Bound<'_, PyType>, path: PathBuf, fixed_bodies: &str) -> PyResult<Self> {
        let py = class.py();
        let rule = PyString::new(py, fixed_bodies);
        let fixed_bodies = option_of(rule.as_any(), "fixed_bodies")?;
        let path = std::path::absolute(path)?;
        let read = path.clone();
        let robot = interruptible(py, move || {
            robot::Robot::open(&read).map_err(|fault| of_diagnostic(&fault))
        })?;
        warn(py, &robot.warnings)?;
        let robot = match fixed_bodies {
            FixedBodies::Keep => robot,
            FixedBodies::Merge => robot.merged().map_err(|error| input(error.to_string()))?,
        };
        Ok(Self {
            robot,
            path,
            fixed_bodies,
        })
    }

    /// Its name; empty if the file has none.
    #[getter]
    fn name(&self) -> &str {
        &self.robot.name
    }

    /// The hinges and slides that have a value, in the order of `joint_pos`.
    #[getter]
    fn joint_names(&self) -> Vec<&str> {
        let joints = self.tree().scalar_joints();
        joints.map(|joint| &*joint.name).collect()
    }

    /// The free joints, in the order of `root_pos` and `root_quat`.
    #[getter]
    fn root_names(&self) -> Vec<&str> {
        self.named(JointKind::Free)
    }

    /// The ball joints, in the order of `ball_quat`.
    #[getter]
    fn ball_names(&self) -> Vec<&str> {
        self.named(JointKind::Ball)
    }

    /// The smallest and the largest value of each joint of `joint_names`, float64 (joints, 2); infinite without limits.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let none = [f64::NEG_INFINITY, f64::INFINITY];
        let joints = self.tree().scalar_joints();
        let limits: Vec<f64> = joints
            .flat_map(|joint| joint.limits.unwrap_or(none))
            .collect();
        let count = limits.len() / 2;
        shaped(py, limits, &[count, 2])
    }

    /// The names of the bodies, "depth-first" (mjlab) or "breadth-first" (Isaac); `siblings`: bodies with the
    /// same parent as in the "file", or by "body-name" or "joint-name".
    ///
    /// >>> import pathlib, tempfile, tumble
    /// >>> path = pathlib.Path(tempfile.mkdtemp(), "arm.xml")
    /// >>> _ = path.write_text('<mujoco><worldbody><body name="upper"><joint name="shoulder"/>'
    /// ...     '<body name="hand" pos="0 0 1"/></body></worldbody></mujoco>')
    /// >>> robot = tumble.Robot.load(path)
    /// >>> robot.body_names("breadth-first")
    /// ['upper', 'hand']
    #[pyo3(signature = (body_order="depth-first", *, siblings="file"))]
    fn body_names(&self, py: Python<'_>, body_order: &str, siblings: &str) -> PyResult<Vec<&str>> {
        let bodies = self.tree().bodies();
        let order = self.order(py, body_order, siblings)?;
        Ok(order.into_iter().map(|body| &*bodies[body].name).collect())
    }

    /// The bodies of configurations, by forward kinematics in float64.
    ///
    /// `joint_pos`: (…, joints), a value for each of `joint_names`. `root_pos`, `root_quat`: (…, 3) and (…, 4), the pose
    /// of the free joint in the world; of a robot without one, of its base. With several free joints (…, roots, 3).
    /// `ball_quat`: (…, balls, 4). Poses that are left out are the file's. `order`: "wxyz" or "xyzw", of all
    /// quaternions; there is no default, because files differ.
    ///
    /// The result is a dict: `body_pos_w` (…, bodies, 3) and `body_quat_w` (…, bodies, 4), in the world. With any
    /// velocity also `body_lin_vel_w` and `body_ang_vel_w` (…, bodies, 3), in the world's axes, of the "origin" of each
    /// body, or of its centre of "mass" (`velocity_at`). Velocities of roots are in the world's axes; those of balls in
    /// the axes of their bodies.
    ///
    /// >>> import pathlib, tempfile, tumble
    /// >>> path = pathlib.Path(tempfile.mkdtemp(), "arm.xml")
    /// >>> _ = path.write_text('<mujoco><worldbody><body name="upper"><joint name="shoulder"/>'
    /// ...     '<body name="hand" pos="0 0 1"/></body></worldbody></mujoco>')
    /// >>> robot = tumble.Robot.load(path)
    /// >>> robot.forward([0.0], [0, 0, 5], order="wxyz")["body_pos_w"]
    /// array([[0., 0., 5.],
    ///        [0., 0., 6.]])
    #[pyo3(signature = (joint_pos, root_pos=None, root_quat=None, *, order, joint_vel=None, root_lin_vel=None, root_ang_vel=None, ball_quat=None, ball_vel=None, body_order="depth-first", siblings="file", velocity_at="origin"))]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn forward<'py>(
        slf: &Bound<'py, Self>,
        joint_pos: &Bound<'py, PyAny>,
        root_pos: Option<&Bound<'py, PyAny>>,
        root_quat: Option<&Bound<'py, PyAny>>,
        order: &str,
        joint_vel: Option<&Bound<'py, PyAny>>,
        root_lin_vel: Option<&Bound<'py, PyAny>>,
        root_ang_vel: Option<&Bound<'py, PyAny>>,
        ball_quat: Option<&Bound<'py, PyAny>>,
        ball_vel: Option<&Bound<'py, PyAny>>,
        body_order: &str,
        siblings: &str,
        velocity_at: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        let py = slf.py();
        let this = slf.get();
        let (tree, quaternions) = (this.tree(), Order::named(order)?);
        let bodies = this.order(py, body_order, siblings)?;
        let centres = this.mass_centres(py, velocity_at)?;
        let counts = tree.counts();
        let joints = JointArray::new(joint_pos, "joint_pos", &[counts.scalars], None)?;
        let shape = joints.shape.clone();
        let roots = if counts.free > 1 {
            vec![counts.free]
        } else {
            Vec::new()
        };
        let array = |value: Option<&Bound<'py, PyAny>>, name, each: &[usize]| {
            value
                .map(|value| JointArray::new(value, name, each, Some(&shape)))
                .transpose()
        };
        let of_roots = |width: usize| [&roots[..], &[width]].concat();
        let balls = |width: usize| [counts.balls, width];
        let arrays = ConfigurationArrays {
            root_pos: array(root_pos, "root_pos", &of_roots(3))?,
            root_quat: array(root_quat, "root_quat", &of_roots(4))?,
            joint_vel: array(joint_vel, "joint_vel", &[counts.scalars])?,
            root_lin_vel: array(root_lin_vel, "root_lin_vel", &of_roots(3))?,
            root_ang_vel: array(root_ang_vel, "root_ang_vel", &of_roots(3))?,
            ball_quat: array(ball_quat, "ball_quat", &balls(4))?,
            ball_vel: array(ball_vel, "ball_vel", &balls(3))?,
            joint_pos: joints,
            quaternions,
        };
        let moves = arrays.moves();
        let count: usize = shape.iter().product();
        let robot = slf.clone().unbind();
        let width = bodies.len();
        let [three, four] = [3, 4].map(|each| count.saturating_mul(width).saturating_mul(each));
        let rates = if moves { three } else { 0 };
        let [mut positions, mut rotations] = [three, four].map(|length| vec![0.0; length]);
        let [mut velocities, mut angular_velocities] = [rates; 2].map(|length| vec![0.0; length]);
        let arrays = work(py, count.saturating_mul(width), move || {
            let tree = &robot.get().robot.tree;
            let at = |sample, state: &mut _| arrays.set(sample, state);
            let rows = BodyArrays {
                positions: positions.as_chunks_mut().0,
                rotations: rotations.as_chunks_mut().0,
                velocities: velocities.as_chunks_mut().0,
                angular_velocities: angular_velocities.as_chunks_mut().0,
                is_w_first: quaternions == Order::Wxyz,
            };
            robot::body_arrays(tree, count, &bodies, &centres, at, rows)
                .map_err(|error| input(error.to_string()))?;
            Ok([positions, rotations, velocities, angular_velocities])
        })?;
        let result = PyDict::new(py);
        let shape = [&shape[..], &[width]].concat();
        set_arrays(&result, arrays, &shape, moves)?;
        Ok(result)
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (PathBuf, &'static str))> {
        let load = slf.as_any().get_type().getattr("load")?;
        let robot = slf.get();
        Ok((load, (robot.path.clone(), robot.fixed_bodies.name())))
    }

    fn __repr__(&self) -> String {
        let counts = self.tree().counts();
        format!(
            "Robot({:?}, {}, {})",
            self.robot.name,
            match self.tree().bodies().len() {
                1 => "1 body".to_owned(),
                count => format!("{count} bodies"),
            },
            counted(counts.scalars + counts.balls + counts.free, "joint")
        )
    }
}

impl Robot {
    pub(crate) fn tree(&self) -> &Tree {
        &self.robot.tree
    }

    /// The robot as files describe it.
    pub(crate) fn described(&self) -> &robot::Robot {
        &self.robot
    }

    fn named(&self, kind: JointKind) -> Vec<&str> {
        let joints = self.tree().joints().filter(move |joint| joint.kind == kind);
        joints.map(|joint| &*joint.name).collect()
    }

    fn order(&self, py: Python<'_>, order: &str, siblings: &str) -> PyResult<Vec<usize>> {
        let text = |name: &str| PyString::new(py, name).into_any();
        let order = option_of(&text(order), "body_order")?;
        let siblings = option_of(&text(siblings), "siblings")?;
        Ok(self.tree().order(order, siblings))
    }

    /// The centre of mass of each body; empty for velocities of origins.
    fn mass_centres(&self, py: Python<'_>, point: &str) -> PyResult<Vec<DVec3>> {
        let point: VelocityPoint = option_of(PyString::new(py, point).as_any(), "velocity_at")?;
        robot::mass_centres(self.tree(), point).map_err(|error| of_bodies(&error))
    }
}

/// Numbers for each configuration (pose) of the robot.
struct JointArray {
    /// The shape of the configurations.
    shape: Vec<usize>,
    each: usize,
    values: Vec<f64>,
}

impl JointArray {
    /// Reads an array. `each`: the shape of the last axes. `expected`: the shape of the axes before, if it is known.
    fn new(
        value: &Bound<'_, PyAny>,
        name: &str,
        each: &[usize],
        expected: Option<&[usize]>,
    ) -> PyResult<Self> {
        let ArrayValues { shape, values } = doubles(value, name)?;
        let split = shape.len().checked_sub(each.len());
        let parts = split.map(|at| shape.split_at(at));
        match parts {
            Some((of, last)) if last == each && expected.is_none_or(|expected| of == expected) => {
                Ok(Self {
                    shape: of.to_vec(),
                    each: each.iter().product(),
                    values,
                })
            }
            _ => Err(input(format!(
                "{name}: its shape is {}; give ({}{})",
                shown(&shape),
                expected.map_or("…, ".to_owned(), |axes| axes
                    .iter()
                    .map(|n| format!("{n}, "))
                    .collect()),
                each.iter()
                    .map(ToString::to_string)
                    .collect::<Vec<_>>()
                    .join(", "),
            ))),
        }
    }

    fn at(&self, sample: usize) -> &[f64] {
        &self.values[sample * self.each..][..self.each]
    }

    fn vectors(&self, sample: usize) -> impl Iterator<Item = DVec3> {
        self.at(sample)
            .as_chunks::<3>()
            .0
            .iter()
            .map(|&v| DVec3::from_array(v))
    }

    fn rotations(&self, sample: usize, order: Order) -> impl Iterator<Item = DQuat> {
        let four = self.at(sample).as_chunks::<4>().0.iter();
        four.map(move |&q| DQuat::from_array(order.xyzw(q)))
    }
}

/// The arguments of `forward`.
struct ConfigurationArrays {
    joint_pos: JointArray,
    root_pos: Option<JointArray>,
    root_quat: Option<JointArray>,
    joint_vel: Option<JointArray>,
    root_lin_vel: Option<JointArray>,
    root_ang_vel: Option<JointArray>,
    ball_quat: Option<JointArray>,
    ball_vel: Option<JointArray>,
    quaternions: Order,
}

impl ConfigurationArrays {
    fn moves(&self) -> bool {
        let rates = [
            &self.joint_vel,
            &self.root_lin_vel,
            &self.root_ang_vel,
            &self.ball_vel,
        ];
        rates.iter().any(|rate| rate.is_some())
    }

    /// Sets all values that there are of a sample.
    fn set(&self, sample: usize, (at, rates): &mut (Configuration, ConfigurationRates)) {
        at.scalars.copy_from_slice(self.joint_pos.at(sample));
        if let Some(of) = &self.joint_vel {
            rates.scalars.copy_from_slice(of.at(sample));
        }
        let (poses, velocities): (&mut [BodyPose], &mut [BodyVelocity]) = match at.free.is_empty() {
            true => (
                std::slice::from_mut(&mut at.base),
                std::slice::from_mut(&mut rates.base),
            ),
            false => (&mut at.free, &mut rates.free),
        };
        for (pose, position) in poses.iter_mut().zip(vectors_of(&self.root_pos, sample)) {
            pose.position = position;
        }
        for (pose, rotation) in poses
            .iter_mut()
            .zip(self.rotations(&self.root_quat, sample))
        {
            pose.rotation = rotation;
        }
        for (velocity, linear) in velocities
            .iter_mut()
            .zip(vectors_of(&self.root_lin_vel, sample))
        {
            velocity.linear = linear;
        }
        for (velocity, angular) in velocities
            .iter_mut()
            .zip(vectors_of(&self.root_ang_vel, sample))
        {
            velocity.angular = angular;
        }
        for (ball, rotation) in at
            .balls
            .iter_mut()
            .zip(self.rotations(&self.ball_quat, sample))
        {
            *ball = rotation;
        }
        for (ball, rate) in rates
            .balls
            .iter_mut()
            .zip(vectors_of(&self.ball_vel, sample))
        {
            *ball = rate;
        }
    }

    fn rotations(&self, of: &Option<JointArray>, sample: usize) -> impl Iterator<Item = DQuat> {
        let order = self.quaternions;
        of.iter().flat_map(move |of| of.rotations(sample, order))
    }
}

fn vectors_of(of: &Option<JointArray>, sample: usize) -> impl Iterator<Item = DVec3> {
    of.iter().flat_map(move |of| of.vectors(sample))
}

/// Some numbers of each body, in one list.
fn numbers_of<const N: usize>(
    motions: &[BodyMotion],
    of: impl Fn(&BodyMotion) -> [f64; N],
) -> Vec<f32> {
    let mut numbers = Vec::with_capacity(N * motions.len());
    for motion in motions {
        numbers.extend(of(motion).map(|number| number as f32));
    }
    numbers
}

/// Sets the arrays of bodies in a result: positions, rotations and, with velocities, both of these.
fn set_arrays<T: Element>(
    result: &Bound<'_, PyDict>,
    arrays: [Vec<T>; 4],
    shape: &[usize],
    moves: bool,
) -> PyResult<()> {
    let names = [
        ("body_pos_w", 3),
        ("body_quat_w", 4),
        ("body_lin_vel_w", 3),
        ("body_ang_vel_w", 3),
    ];
    let count = if moves { 4 } else { 2 };
    for ((name, width), numbers) in names.into_iter().zip(arrays).take(count) {
        let shape = [shape, &[width]].concat();
        result.set_item(name, shaped(result.py(), numbers, &shape)?)?;
    }
    Ok(())
}

fn shaped<'py, T: Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray1::from_vec(py, numbers)
        .reshape(shape.to_vec())?
        .into_any())
}

pub(crate) fn of_bodies(error: &BodiesError) -> PyErr {
    match error {
        BodiesError::Engine(error) => of_engine(error),
        error => input(in_python(&error.to_string())),
    }
}

/// The keywords of `Engine.bodies` that describe its arrays: names and orders of joints and bodies.
pub(crate) struct JointKeys<'a, 'py> {
    pub(crate) joint_pos: &'a Bound<'py, PyAny>,
    pub(crate) root_pos: Option<&'a Bound<'py, PyAny>>,
    pub(crate) root_quat: Option<&'a Bound<'py, PyAny>>,
    pub(crate) joint_names: Option<Vec<String>>,
    pub(crate) source_fps: Option<&'a Bound<'py, PyAny>>,
    pub(crate) source_times: Option<&'a Bound<'py, PyAny>>,
}

/// The names of orders that `Engine.bodies` takes.
pub(crate) struct BodyNames<'a> {
    pub(crate) order: &'a str,
    pub(crate) body_order: &'a str,
    pub(crate) siblings: &'a str,
    pub(crate) velocity_at: &'a str,
}

/// The joints and bodies of a robot at samples of a motion.
pub(crate) fn bodies<'py>(
    engine: &Engine,
    robot: &Bound<'py, Robot>,
    keys: &JointKeys<'_, 'py>,
    names: &BodyNames<'_>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let py = robot.py();
    let request = EvaluationKeywords::new(options)?;
    let order = Order::named(names.order)?;
    let text = |name: &str| PyString::new(py, name).into_any();
    let set = keys.set(&robot.get().robot.tree, order)?;
    let motion = Motion {
        set,
        ..Motion::default()
    };
    let (frames, samples) = request.resolved(&motion)?;
    let method = request.method.0.unwrap_or(BESSEL_OVERHAUSER);
    let options = request.methods(Quantity::Rotation).options;
    let request = BodiesRequest {
        frames,
        rotations: options.with(method),
        vectors: method.scalar_method(),
        order: option_of(&text(names.body_order), "body_order")?,
        siblings: option_of(&text(names.siblings), "siblings")?,
        velocity_at: option_of(&text(names.velocity_at), "velocity_at")?,
        velocities: VelocitySource::Curve,
        limits: LimitRule::Report,
        origins: Vec::new(),
    };
    let held = engine.engine_for(samples * motion.set.track_count().max(1))?;
    let tree = robot.clone().unbind();
    let found = interruptible(py, move || {
        let tree = &tree.get().robot.tree;
        robot::bodies(&held, tree, &motion.set, &request).map_err(|error| of_bodies(&error))
    })?;
    if !found.resting.is_empty() {
        let list = found.resting.join(", ");
        warn_of(
            py,
            &[format!(
                "joints without keys stay where the file has them: {list}"
            )],
        )?;
    }
    let excesses: Vec<String> = found.excesses.iter().map(excess_text).collect();
    warn_of(py, &excesses)?;
    let result = PyDict::new(py);
    let joints = robot.get().tree().counts().scalars;
    result.set_item(
        "joint_pos",
        shaped(py, found.joint_values, &[samples, joints])?,
    )?;
    result.set_item(
        "joint_vel",
        shaped(py, found.joint_rates, &[samples, joints])?,
    )?;
    let shape = [samples, found.order.len()];
    let of = &found.motions;
    let arrays = [
        numbers_of(of, |motion| motion.pose.position.to_array()),
        numbers_of(of, |motion| order.of_xyzw(motion.pose.rotation.to_array())),
        numbers_of(of, |motion| motion.velocity.linear.to_array()),
        numbers_of(of, |motion| motion.velocity.angular.to_array()),
    ];
    set_arrays(&result, arrays, &shape, true)?;
    Ok(result)
}

fn excess_text(excess: &LimitExcess) -> String {
    let LimitExcess {
        joint,
        excess,
        unit,
        sample,
    } = excess;
    format!(
        "joint `{joint}` leaves its limits by up to {excess:.4} {unit} (first at sample {sample}); nothing was changed"
    )
}

impl JointKeys<'_, '_> {
    /// The keys as scalars, a track and its positions, by the names of the tree.
    fn set(&self, tree: &Tree, order: Order) -> PyResult<TrackSet> {
        let names: Vec<String> = match &self.joint_names {
            Some(names) => names.clone(),
            None => tree
                .scalar_joints()
                .map(|joint| joint.name.clone())
                .collect(),
        };
        let joints = JointArray::new(self.joint_pos, "joint_pos", &[names.len()], None)?;
        let &[count] = &joints.shape[..] else {
            return Err(input(format!(
                "joint_pos: its shape is {}; give (frames, {})",
                shown(&[&joints.shape[..], &[names.len()]].concat()),
                names.len()
            )));
        };
        let times = self.times(count)?;
        let known: Vec<&str> = tree.scalar_joints().map(|joint| &*joint.name).collect();
        if let Some(name) = names.iter().find(|name| !known.contains(&name.as_str())) {
            let refusal = format!("joint_names: the robot has no joint `{name}` with a value");
            return Err(input(unknown_name(&refusal, name, &known)));
        }
        let is_repeated = |i: &usize| names[..*i].contains(&names[*i]);
        if let Some(i) = (0..names.len()).find(is_repeated) {
            return Err(input(format!(
                "joint_names: `{}` is in the list twice",
                names[i]
            )));
        }
        let mut set = TrackSet::new();
        for (index, name) in names.iter().enumerate() {
            let mut values: Vec<f64> = (0..count).map(|frame| joints.at(frame)[index]).collect();
            unwrap_joint(tree, name, &mut values);
            let values: Vec<f32> = values.into_iter().map(|value| value as f32).collect();
            set.push_scalar(name, &times, &values, &[])
                .map_err(|error| of_track(&error))?;
        }
        let positions = self.root_pos;
        let positions =
            positions.map(|value| JointArray::new(value, "root_pos", &[3], Some(&[count])));
        let positions = positions.transpose()?;
        let rotations = self
            .root_quat
            .map(|value| quaternions(value, order, "root_quat"));
        let rotations = rotations.transpose()?;
        if positions.is_none() && rotations.is_none() {
            return Ok(set);
        }
        let mut free = tree.joints().filter(|joint| joint.kind == JointKind::Free);
        let rest = tree.rest();
        let (root, at_rest) = match (free.next(), free.next(), tree.bodies().first()) {
            (Some(joint), None, _) => (&*joint.name, rest.free[0]),
            // The first body moves the base, as in `forward`.
            (None, _, Some(body)) => (&*body.name, rest.base),
            _ => {
                return Err(input(format!(
                    "root_pos and root_quat are of one root; this robot has {} free joints",
                    tree.counts().free
                )));
            }
        };
        let keys = match rotations {
            Some(ArrayValues { shape, values }) if *shape == [count] => values,
            Some(ArrayValues { shape, .. }) => {
                let found = shown(&[&shape[..], &[4]].concat());
                return Err(input(format!(
                    "root_quat: its shape is {found}; give ({count}, 4)"
                )));
            }
            None => vec![at_rest.rotation.as_quat(); count],
        };
        set.push(root, &times, &keys)
            .map_err(|error| of_track(&error))?;
        if let Some(positions) = &positions {
            let points = positions.values.as_chunks::<3>().0.iter();
            let points: Vec<Vec3> = points.map(|&v| DVec3::from_array(v).as_vec3()).collect();
            set.set_translations(0, &times, &points, &[])
                .map_err(|error| of_track(&error))?;
        }
        Ok(set)
    }

    fn times(&self, count: usize) -> PyResult<Vec<f64>> {
        match (self.source_fps, self.source_times) {
            (Some(rate), None) => {
                let rate = frame_rate(rate)?;
                Ok((0..count).map(|frame| rate.time_of(frame as u64)).collect())
            }
            (None, Some(times)) => match doubles(times, "source_times")? {
                ArrayValues { shape, values } if *shape == [count] => Ok(values),
                ArrayValues { shape, .. } => Err(input(format!(
                    "source_times: its shape is {}; give ({count},)",
                    shown(&shape)
                ))),
            },
            _ => Err(input(
                "give `source_fps`, the rate of the keys, or `source_times`, their times in seconds",
            )),
        }
    }
}
