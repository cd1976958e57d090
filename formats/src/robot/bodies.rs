//! The bodies of a robot at each sample of a motion: its joints are interpolated, and the bodies follow from them.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3, Quat};
use rayon::prelude::*;
use tumble::trees::{
    BodyArrays, BodyMotion, BodyOrder, BodyPose, BodyRows, BodyVelocity, Configuration,
    ConfigurationRates, JointKind, Siblings, Tree, TreeBody, TreeError, TreeJoint, TreeWalk,
};
use tumble::{
    Axes, Channel, Engine, Error, Interpolation, Layout, Quantity, SampleTimes, ScalarQuantity,
    TrackSet, VectorMethod, names,
};

use crate::motion::signs::continue_signs;
use crate::motion::{Motion, ScalarKind};
use crate::npz::rotation_vector;

/// The options of computing a robot's bodies from its motion.
#[derive(Debug, Clone)]
pub struct BodiesRequest {
    /// The samples.
    pub frames: SampleTimes,
    /// How the rotations of free joints and balls are interpolated; its ends and wrap modes are those of all joints.
    pub rotations: Interpolation,
    /// How scalars and positions are interpolated.
    pub vectors: VectorMethod,
    /// The order of the bodies.
    pub order: BodyOrder,
    /// The order of bodies with the same parent.
    pub siblings: Siblings,
    /// The point of a body whose velocity is computed.
    pub velocity_at: VelocityPoint,
    /// How velocities follow from the curves.
    pub velocities: VelocitySource,
    /// How values outside the limits of joints are treated.
    pub limits: LimitRule,
    /// The vector to add to the translations of each track; empty if all are 0.
    pub origins: Vec<DVec3>,
}

/// How velocities follow from the curves of the joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum VelocitySource {
    /// They are the derivatives of the curves.
    #[default]
    Curve,
    /// They are differences of the samples on both sides, as other programs compute them.
    Differences,
}

names! {
    VelocitySource, "source of velocities",
    Curve => "curve",
    Differences => "differences",
}

/// How values outside the limits of joints are treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum LimitRule {
    /// They are reported, and kept.
    #[default]
    Report,
    /// Values outside become the limit; there the joint does not move.
    Clamp,
    /// They are an error.
    Refuse,
}

names! {
    LimitRule, "rule for limits",
    Report => "report",
    Clamp => "clamp",
    Refuse => "refuse",
}

/// The point of a body whose linear velocity is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum VelocityPoint {
    /// The origin of its frame: mjlab.
    #[default]
    Origin,
    /// Its centre of mass: `IsaacLab`, `BeyondMimic`.
    Mass,
}

names! {
    VelocityPoint, "point of a body",
    Origin => "origin",
    Mass => "mass",
}

/// The motion of a robot's joints and bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Bodies {
    /// The value of each joint of [`Tree::scalar_joints`] at each sample, `[sample][joint]`, in rad or metres.
    pub joint_values: Vec<f32>,
    /// The velocities of the same, per second.
    pub joint_rates: Vec<f32>,
    /// The times of the samples, in seconds.
    pub times: Vec<f64>,
    /// The pose of the first body at each sample: the root.
    pub roots: Vec<BodyPose>,
    /// The indices of the bodies in [`Tree::bodies`], in the requested order.
    pub order: Vec<usize>,
    /// Each body at each sample, `[sample][body]`, in the requested order. Linear velocities are those of the requested
    /// point.
    pub motions: Vec<BodyMotion>,
    /// The joints that have no keys, and stay where the file has them.
    pub resting: Vec<String>,
    /// The joints that leave their limits, with the largest excess.
    pub excesses: Vec<LimitExcess>,
}

/// How far a joint leaves its limits.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitExcess {
    /// The joint.
    pub joint: String,
    /// The largest distance from the limits.
    pub excess: f64,
    /// The unit of this distance: `rad` or `m`; empty if the file does not tell angles from lengths.
    pub unit: &'static str,
    /// The first sample outside the limits.
    pub sample: usize,
}

/// Why the bodies of a motion cannot be computed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BodiesError {
    /// The joints cannot be interpolated.
    #[error(transparent)]
    Engine(#[from] Error),
    /// A sample is not a configuration of the tree.
    #[error(transparent)]
    Tree(#[from] TreeError),
    /// The motion has something that is not a joint of the robot.
    #[error(
        "`{name}` is not {kind} of the robot; it has {}",
        if known.is_empty() { "none".to_owned() } else { known.join(", ") }
    )]
    NotAJoint {
        /// The kind of the joint that was expected.
        kind: &'static str,
        /// Its name.
        name: String,
        /// The names that there are.
        known: Vec<String>,
    },
    /// The velocity of a centre of mass is requested, but the file does not state where this centre is.
    #[error(
        "the file does not say where the centre of mass of body `{body}` is (`inertial`); ask for the velocity at the \
         origin, or add it"
    )]
    NoMassCentre {
        /// The body.
        body: String,
    },
    /// A joint leaves its limits, and this is refused.
    #[error(
        "joint `{}` leaves its limits by {:.3} {}, first at sample {}; --limits clamp keeps it \
         inside, --limits report keeps its values",
        excess.joint, excess.excess, excess.unit, excess.sample
    )]
    OutsideLimits {
        /// The joint, and by how much its value is outside.
        excess: LimitExcess,
    },
}

/// Angles without jumps: each differs from the one before by at most half a `period`. A step of exactly half a period
/// keeps its direction, as in `numpy.unwrap`.
pub fn unwrap_angles(angles: &mut [f64], period: f64) {
    let half = period / 2.0;
    let (mut before, mut shift) = (None::<f64>, 0.0);
    for angle in angles {
        if let Some(before) = before {
            let step = *angle - before;
            let periods = ((step.abs() - half) / period).ceil().max(0.0);
            shift -= period * periods * step.signum();
        }
        before = Some(*angle);
        *angle += shift;
    }
}

/// Unwraps the angles of a joint if it is a hinge without limits, and all angles are within one turn: then a file may have
/// wrapped them. Angles in a wider range count turns already.
pub fn unwrap_joint(tree: &Tree, joint: &str, values: &mut [f64]) {
    let is_endless = tree.scalar_joints().any(|known| {
        known.name == joint && known.kind == JointKind::Hinge && known.limits.is_none()
    });
    /// This exceeds the rounding of a full turn to f32.
    const ROUNDING: f64 = 1e-5;
    let [low, high] = [f64::min, f64::max].map(|pick| values.iter().copied().reduce(pick));
    let may_be_wrapped = (low.zip(high)).is_some_and(|(low, high)| high - low <= TAU + ROUNDING);
    if is_endless && may_be_wrapped {
        unwrap_angles(values, TAU);
    }
}

/// The bodies of a robot at each sample of a motion. Scalars of `set` are hinges and slides with the same names. Its
/// tracks are balls by their names, and free joints by their names or those of their bodies; translations of these
/// tracks are positions. A robot without a free joint may have a track with the name of its first body, which moves its
/// base. Joints without keys rest, which the result says.
///
/// The bodies are computed in f64.
///
/// # Errors
/// A [`BodiesError`].
pub fn bodies(
    engine: &Engine,
    tree: &Tree,
    set: &TrackSet,
    request: &BodiesRequest,
) -> Result<Bodies, BodiesError> {
    let joints = JointTracks::new(tree, set)?;
    let channels = Sampled::new(engine, set, request)?;
    let order = tree.order(request.order, request.siblings);
    let centres = mass_centres(tree, request.velocity_at)?;
    let samples = 0..channels.times.len();
    let at = |sample| joints.at(tree, &channels, &request.origins, sample);
    let mut all: Vec<(Configuration, ConfigurationRates)> =
        samples.into_par_iter().map(at).collect();
    if request.velocities == VelocitySource::Differences {
        set_differences(&mut all, &channels.times);
    }
    let mut excesses = Vec::new();
    for (sample, (configuration, _)) in all.iter().enumerate() {
        note_excesses(tree, &configuration.scalars, sample, &mut excesses);
    }
    match (request.limits, excesses.first()) {
        (LimitRule::Refuse, Some(excess)) => {
            let excess = excess.clone();
            return Err(BodiesError::OutsideLimits { excess });
        }
        (LimitRule::Clamp, Some(_)) => clamp(tree, &mut all),
        _ => {}
    }
    let of_sample = |sample: usize, (at, rates): &mut (Configuration, ConfigurationRates)| {
        let (from, from_rates) = &all[sample];
        (at.base, rates.base) = (from.base, from_rates.base);
        at.free.copy_from_slice(&from.free);
        at.balls.copy_from_slice(&from.balls);
        at.scalars.copy_from_slice(&from.scalars);
        rates.free.copy_from_slice(&from_rates.free);
        rates.balls.copy_from_slice(&from_rates.balls);
        rates.scalars.copy_from_slice(&from_rates.scalars);
    };
    let mut motions = bytemuck::zeroed_vec(all.len().saturating_mul(order.len()));
    let rows = motions.chunks_mut((TASK * order.len()).max(1));
    let rows = rows.map(BodyRows::Motions).collect();
    let walk = tree.walk(&order, &centres)?;
    walk_all(&walk, tree, all.len(), of_sample, rows)?;
    let first = order.iter().position(|&body| body == 0);
    let rows = motions.chunks(order.len().max(1));
    let roots = rows.filter_map(|row| Some(row[first?].pose)).collect();
    let scalars = |values: &[f64]| values.iter().map(|&value| value as f32).collect::<Vec<_>>();
    Ok(Bodies {
        joint_values: (all.iter().flat_map(|(at, _)| scalars(&at.scalars))).collect(),
        joint_rates: (all.iter().flat_map(|(_, rates)| scalars(&rates.scalars))).collect(),
        times: channels.times,
        order,
        motions,
        roots,
        resting: joints.resting(tree),
        excesses,
    })
}

/// Replaces rates with differences of the samples on both sides, as `numpy.gradient` does: at the ends those of the end
/// and its neighbour; angular velocities at the ends are those beside them.
fn set_differences(all: &mut [(Configuration, ConfigurationRates)], times: &[f64]) {
    let Some(last) = all.len().checked_sub(1).filter(|&last| last > 0) else {
        for (_, rates) in all {
            let still = |rate: &mut BodyVelocity| *rate = BodyVelocity::default();
            rates.scalars.fill(0.0);
            rates.balls.fill(DVec3::ZERO);
            rates.free.iter_mut().for_each(still);
            still(&mut rates.base);
        }
        return;
    };
    let values: Vec<Configuration> = all.iter().map(|(at, _)| at.clone()).collect();
    for (sample, (at, rates)) in all.iter_mut().enumerate() {
        let (before, after) = (sample.saturating_sub(1), (sample + 1).min(last));
        let seconds = times[after] - times[before];
        let (low, high) = (&values[before], &values[after]);
        for (rate, (low, high)) in rates
            .scalars
            .iter_mut()
            .zip(low.scalars.iter().zip(&high.scalars))
        {
            *rate = (high - low) / seconds;
        }
        // With two samples, there is none between them.
        let centre = if last == 1 {
            sample
        } else {
            sample.clamp(1, last - 1)
        };
        let beside = [centre.saturating_sub(1), (centre + 1).min(last)];
        let apart = times[beside[1]] - times[beside[0]];
        let angular = |rotation: &dyn Fn(&Configuration) -> DQuat| {
            let [low, high] = beside.map(|sample| rotation(&values[sample]));
            let step = high * low.inverse();
            let step = if step.w < 0.0 { -step } else { step };
            rotation_vector::log_of(step, None) / apart
        };
        for (ball, rate) in rates.balls.iter_mut().enumerate() {
            // Angular velocities of ball joints are expressed in the axes of the body.
            *rate = at.balls[ball].inverse() * angular(&|at| at.balls[ball]);
        }
        for (free, rate) in rates.free.iter_mut().enumerate() {
            rate.linear = (high.free[free].position - low.free[free].position) / seconds;
            rate.angular = angular(&|at| at.free[free].rotation);
        }
        rates.base.linear = (high.base.position - low.base.position) / seconds;
        rates.base.angular = angular(&|at| at.base.rotation);
    }
}

/// Moves values outside the limits to them; the joint does not move there.
fn clamp(tree: &Tree, all: &mut [(Configuration, ConfigurationRates)]) {
    for (configuration, rates) in all {
        for (index, joint) in tree.scalar_joints().enumerate() {
            let Some([low, high]) = joint.limits else {
                continue;
            };
            let value = &mut configuration.scalars[index];
            if *value < low || *value > high {
                *value = value.max(low).min(high);
                rates.scalars[index] = 0.0;
            }
        }
    }
}

/// How many configurations a thread computes before it takes more.
const TASK: usize = 256;

/// The bodies of configurations in an order of bodies, `[configuration][body]`, to arrays. `at` sets each, in a state that
/// is that of [`Tree::rest`] or that of another configuration. With `centres` ([`mass_centres`]), linear velocities are
/// those of these points.
///
/// # Errors
/// When a configuration has not one finite value for each joint, or an array is neither empty nor as long as the
/// configurations times the bodies.
pub fn body_arrays(
    tree: &Tree,
    count: usize,
    order: &[usize],
    centres: &[DVec3],
    at: impl Fn(usize, &mut (Configuration, ConfigurationRates)) + Sync,
    mut arrays: BodyArrays<'_>,
) -> Result<(), TreeError> {
    let tasks = 0..count.div_ceil(TASK);
    let rows = tasks.map(|_| BodyRows::Arrays(arrays.split_off(TASK * order.len())));
    walk_all(&tree.walk(order, centres)?, tree, count, at, rows.collect())
}

/// Computes the bodies of tasks of configurations, each to its rows.
fn walk_all(
    walk: &TreeWalk,
    tree: &Tree,
    count: usize,
    at: impl Fn(usize, &mut (Configuration, ConfigurationRates)) + Sync,
    rows: Vec<BodyRows<'_>>,
) -> Result<(), TreeError> {
    let tasks = rows.into_par_iter().enumerate();
    tasks.try_for_each_init(
        || tree.walk_memory(),
        |memory, (task, rows)| {
            let first = task * TASK;
            let at = |sample, state: &mut _| at(first + sample, state);
            walk.bodies_into(memory, TASK.min(count - first), at, rows)
        },
    )
}

/// The points of bodies whose velocities are computed: centres of mass in the order of [`Tree::bodies`]; empty for the
/// origins of bodies.
///
/// # Errors
/// When the file does not say where a body's centre of mass is.
pub fn mass_centres(tree: &Tree, point: VelocityPoint) -> Result<Vec<DVec3>, BodiesError> {
    let centre = |body: &TreeBody| {
        let missing = || BodiesError::NoMassCentre {
            body: body.name.clone(),
        };
        body.mass_centre.ok_or_else(missing)
    };
    match point {
        VelocityPoint::Origin => Ok(Vec::new()),
        VelocityPoint::Mass => tree.bodies().iter().map(centre).collect(),
    }
}

fn note_excesses(tree: &Tree, values: &[f64], sample: usize, excesses: &mut Vec<LimitExcess>) {
    for (joint, &value) in tree.scalar_joints().zip(values) {
        let unit = if joint.kind == JointKind::Slide {
            "m"
        } else {
            "rad"
        };
        note_excess((&joint.name, joint.limits, unit), value, sample, excesses);
    }
}

fn note_excess(
    (name, limits, unit): (&str, Option<[f64; 2]>, &'static str),
    value: f64,
    sample: usize,
    excesses: &mut Vec<LimitExcess>,
) {
    let Some([low, high]) = limits else {
        return;
    };
    let excess = (low - value).max(value - high);
    // Most files store limits and keys as f32, so exceeding by the rounding is allowed.
    if excess <= 1e-6 * value.abs().max(1.0) {
        return;
    }
    match excesses.iter_mut().find(|known| known.joint == name) {
        Some(known) => known.excess = known.excess.max(excess),
        None => excesses.push(LimitExcess {
            joint: name.to_owned(),
            excess,
            unit,
            sample,
        }),
    }
}

/// The scalars of a clip that leave their limits, by their values at samples, `[sample][scalar]`, without origins.
#[must_use]
pub fn scalar_excesses(clip: &Motion, values: &[f32]) -> Vec<LimitExcess> {
    let count = clip.set.scalar_count();
    let mut excesses = Vec::new();
    for (sample, row) in values.chunks_exact(count.max(1)).enumerate() {
        for ((index, keys), &value) in clip.scalar_keys().enumerate().zip(row) {
            let scalar = clip.scalar(index);
            let value = f64::from(value) + scalar.origin;
            let unit = match scalar.kind {
                ScalarKind::Angle => "rad",
                ScalarKind::Length => "m",
                _ => "",
            };
            note_excess(
                (keys.name, scalar.limits, unit),
                value,
                sample,
                &mut excesses,
            );
        }
    }
    excesses
}

/// Keeps the scalars of a clip inside their limits. If a scalar was outside, its velocity in `rates` becomes 0.
pub fn clamp_scalars(clip: &Motion, values: &mut [f32], mut rates: Option<&mut [f32]>) {
    let count = clip.set.scalar_count().max(1);
    for (at, value) in values.iter_mut().enumerate() {
        let scalar = clip.scalar(at % count);
        let Some([low, high]) = scalar.limits else {
            continue;
        };
        let stored = f64::from(*value) + scalar.origin;
        let inside = stored.clamp(low.min(high), high.max(low));
        if inside != stored {
            *value = (inside - scalar.origin) as f32;
            if let Some(rate) = rates.as_mut().and_then(|rates| rates.get_mut(at)) {
                *rate = 0.0;
            }
        }
    }
}

/// Where the keys of each joint are in a set.
struct JointTracks {
    scalars: Vec<Option<usize>>,
    balls: Vec<Option<usize>>,
    free: Vec<Option<usize>>,
    /// The track of the base, for a robot without a free joint.
    base: Option<usize>,
}

impl JointTracks {
    fn new(tree: &Tree, set: &TrackSet) -> Result<Self, BodiesError> {
        let named = |kind: JointKind| {
            let of_bodies = tree.bodies().iter();
            of_bodies.flat_map(move |body| {
                let joints = body.joints.iter().filter(move |joint| joint.kind == kind);
                joints.map(|joint| [&*joint.name, &*body.name])
            })
        };
        let track_of = |name: &str| (0..set.track_count()).find(|&i| set.track_name(i) == name);
        let balls: Vec<_> = named(JointKind::Ball)
            .map(|[joint, _]| track_of(joint))
            .collect();
        let of_free = |[joint, body]: [&str; 2]| track_of(joint).or_else(|| track_of(body));
        let free: Vec<_> = named(JointKind::Free).map(of_free).collect();
        let first = tree.bodies().first().filter(|_| free.is_empty());
        let base = first.and_then(|body| track_of(&body.name));
        let is_used = |track: usize| {
            balls
                .iter()
                .chain(&free)
                .chain([&base])
                .flatten()
                .any(|&used| used == track)
        };
        if let Some(other) = (0..set.track_count()).find(|&track| !is_used(track)) {
            let known = named(JointKind::Free).chain(named(JointKind::Ball));
            return Err(BodiesError::NotAJoint {
                kind: "a free joint or a ball",
                name: set.track_name(other),
                known: known.map(|[joint, _]| joint.to_owned()).collect(),
            });
        }
        let names: Vec<&str> = tree.scalar_joints().map(|joint| &*joint.name).collect();
        for index in 0..set.scalar_count() {
            let name = set.scalar(index).map_or("", |scalar| scalar.name);
            if !names.contains(&name) {
                return Err(BodiesError::NotAJoint {
                    kind: "a hinge or a slide with a value",
                    name: name.to_owned(),
                    known: names.iter().map(|&name| name.to_owned()).collect(),
                });
            }
        }
        let scalars = names.iter().map(|name| set.scalar_named(name)).collect();
        Ok(Self {
            scalars,
            balls,
            free,
            base,
        })
    }

    /// The joints without keys.
    fn resting(&self, tree: &Tree) -> Vec<String> {
        let of = |kind: JointKind| tree.joints().filter(move |joint| joint.kind == kind);
        let without =
            |joint: &TreeJoint, track: &Option<usize>| track.is_none().then(|| joint.name.clone());
        let free = of(JointKind::Free).zip(&self.free);
        let balls = of(JointKind::Ball).zip(&self.balls);
        let scalars = tree.scalar_joints().zip(&self.scalars);
        let all = free.chain(balls).chain(scalars);
        all.filter_map(|(joint, track)| without(joint, track))
            .collect()
    }

    fn at(
        &self,
        tree: &Tree,
        channels: &Sampled,
        origins: &[DVec3],
        sample: usize,
    ) -> (Configuration, ConfigurationRates) {
        let (mut configuration, mut rates) = (tree.rest(), tree.no_rates());
        let pose = |track: usize, rest: DVec3| {
            let (mut pose, rate) = channels.pose(track, sample);
            match channels.positions {
                None => pose.position = rest,
                Some(_) => pose.position += origins.get(track).copied().unwrap_or_default(),
            }
            (pose, rate)
        };
        for (joint, scalar) in self.scalars.iter().enumerate() {
            if let &Some(scalar) = scalar {
                let [value, rate] = channels.scalar(scalar, sample);
                (configuration.scalars[joint], rates.scalars[joint]) = (value, rate);
            }
        }
        for (ball, track) in self.balls.iter().enumerate() {
            if let &Some(track) = track {
                let (pose, rate) = channels.pose(track, sample);
                configuration.balls[ball] = pose.rotation;
                // Angular velocities of ball joints are expressed in the axes of the body.
                rates.balls[ball] = pose.rotation.inverse() * rate.angular;
            }
        }
        for (free, track) in self.free.iter().enumerate() {
            if let &Some(track) = track {
                let rest = configuration.free[free].position;
                (configuration.free[free], rates.free[free]) = pose(track, rest);
            }
        }
        if let Some(track) = self.base {
            (configuration.base, rates.base) = pose(track, configuration.base.position);
        }
        (configuration, rates)
    }
}

/// The samples of a set, `[sample][track]` and `[sample][scalar]`.
struct Sampled {
    /// In seconds.
    times: Vec<f64>,
    tracks: usize,
    scalar_count: usize,
    scalars: Vec<[f32; 2]>,
    rotations: Vec<[f32; 4]>,
    /// In the parents' frames.
    angular: Vec<[f32; 4]>,
    /// `None` without translations.
    positions: Option<[Vec<[f32; 4]>; 2]>,
}

impl Sampled {
    fn new(engine: &Engine, set: &TrackSet, request: &BodiesRequest) -> Result<Self, BodiesError> {
        let BodiesRequest {
            frames,
            rotations,
            vectors,
            ..
        } = request;
        let layout = Layout::FrameMajor;
        let tracks = set.track_count();
        let scalars =
            |quantity| engine.scalars(set, quantity, *vectors, *rotations, frames, layout);
        let [values, rates] = [
            scalars(ScalarQuantity::Value)?,
            scalars(ScalarQuantity::Velocity)?,
        ];
        let timeline = frames
            .resolve(tracks, set.time_span())
            .map_err(Error::from)?;
        let pairs = values.as_slice().iter().zip(rates.as_slice());
        let mut sampled = Self {
            times: timeline.times(0).collect(),
            tracks,
            scalar_count: set.scalar_count(),
            scalars: pairs.map(|(&value, &rate)| [value, rate]).collect(),
            rotations: Vec::new(),
            angular: Vec::new(),
            positions: None,
        };
        if tracks == 0 {
            return Ok(sampled);
        }
        let poses = engine
            .request(set, *rotations, frames)
            .layout(layout)
            .evaluate()?;
        let mut rows: Vec<Quat> = poses.as_quats().to_vec();
        continue_signs(&mut rows, tracks);
        sampled.rotations = rows.iter().map(Quat::to_array).collect();
        let rate = rotations.with_quantity(Quantity::Velocity(Axes::Parent));
        sampled.angular = engine
            .rates(set, rate, frames, layout)?
            .as_arrays()
            .to_vec();
        if (0..tracks).any(|track| set.vector_keys(Channel::Translation, track).is_some()) {
            let channel = Channel::Translation;
            let at = engine.vectors(set, channel, *vectors, *rotations, frames, layout)?;
            let quantity = ScalarQuantity::Velocity;
            let rates = engine
                .vector_rates(set, channel, quantity, *vectors, *rotations, frames, layout)?;
            sampled.positions = Some([at.as_arrays().to_vec(), rates.as_arrays().to_vec()]);
        }
        Ok(sampled)
    }

    fn scalar(&self, scalar: usize, sample: usize) -> [f64; 2] {
        self.scalars[sample * self.scalar_count + scalar].map(f64::from)
    }

    fn pose(&self, track: usize, sample: usize) -> (BodyPose, BodyVelocity) {
        let index = sample * self.tracks + track;
        let vector = |[x, y, z, _]: [f32; 4]| DVec3::new(x.into(), y.into(), z.into());
        let (position, linear) = match &self.positions {
            Some([at, rates]) => (vector(at[index]), vector(rates[index])),
            None => (DVec3::ZERO, DVec3::ZERO),
        };
        let rotation = DQuat::from_array(self.rotations[index].map(f64::from));
        let angular = vector(self.angular[index]);
        (
            BodyPose { position, rotation },
            BodyVelocity { linear, angular },
        )
    }
}
