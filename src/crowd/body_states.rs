//! States of a robot's clips at any times: the values of its joints, and its bodies with their velocities. The joints are
//! interpolated as states of motion tables are, and a walk along the tree computes the bodies from them in f32.

use rayon::prelude::*;

use crate::crowd::states::lanes::{InstanceGroup, put, three};
use crate::crowd::states::{
    FrameStep, JOINT_NUMBERS, MotionTables, PoseScratch, PoseValues, Poses, TASK, check_clips,
    check_steps, ends_of_steps, steps_per_second,
};
use crate::crowd::tree_walk::{FRAME_NUMBERS, frame, scalar, walk};
use crate::crowd_error::CrowdError;
use crate::engine::Engine;
use crate::pose::tree::frames::TreeFrames;
use crate::shader::TreeFrame;
use crate::simd::dispatch::{InLanes, in_lanes_of};
use crate::simd::lanes::{Lanes, MAX_LANES};
use crate::threads::stop;

/// The clips of a robot: [`MotionTables`] whose joints are tracks without parents, and the [`TreeFrames`] that follow them.
///
/// The bodies are computed in f32, with the same bits on every machine and device. For robots that are about 1 m large, they
/// are within 1e-6 m and 2e-6 rad of those that [`Tree::motions`](crate::trees::Tree::motions) computes in f64 from the same
/// joints; far from the origin, the root's position is rounded once.
///
/// ```
/// use tumble::glam::{DVec3, Quat, Vec3};
/// use tumble::crowd::{BodyStates, BodyTables, KeyPrecision, MotionBuilder};
/// use tumble::trees::{BodyOrder, JointKind, JointTracks, Siblings, Tree, TreeBody, TreeJoint};
/// use tumble::{Device, Engine, Skeleton, TrackSet, VectorMethod, method};
/// let body = |name: &str, parent, joints| TreeBody {
///     name: name.to_owned(),
///     parent,
///     position: DVec3::X,
///     rotation: tumble::glam::DQuat::IDENTITY,
///     joints,
///     mass_centre: None,
/// };
/// let upper = body("upper", None, vec![TreeJoint::new("shoulder", JointKind::Hinge)]);
/// let tree = Tree::new(vec![upper, body("hand", Some(0), Vec::new())])?;
///
/// // The angle of the shoulder is the first coordinate of a track.
/// let mut clip = TrackSet::new();
/// clip.push("joints", &[0.0, 2.0], &[Quat::IDENTITY; 2])?;
/// clip.set_translations(0, &[0.0, 2.0], &[Vec3::ZERO, Vec3::X], &[])?;
/// let tracks = JointTracks { scalars: vec![[0, 0]], ..JointTracks::default() };
/// let frames = tree.frames(&tracks, &tree.order(BodyOrder::DepthFirst, Siblings::File), &[])?;
///
/// let skeleton = Skeleton::new(vec![None], vec![Vec3::ZERO])?;
/// let mut builder = MotionBuilder::new(&skeleton, 705_600, KeyPrecision::Exact)?;
/// builder.push(&clip, method::SLERP, VectorMethod::Linear)?;
/// let (tables, spans, cells) = builder.finish();
/// let tables = BodyTables::new(tables, frames)?;
/// let (mut positions, mut velocities) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
/// let states = BodyStates { positions: &mut positions, velocities: &mut velocities, ..BodyStates::default() };
/// tables.sample_into(&Engine::new(Device::Cpu)?, (&spans, &cells), &[(0, 0)], None, states)?;
/// assert_eq!((positions[1], velocities[1]), ([2.0, 0.0, 0.0], [0.0, 0.5, 0.0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct BodyTables {
    pub(super) tables: MotionTables,
    pub(super) frames: TreeFrames,
}

/// Output arrays for the joints and bodies of a robot, `[instance][joint]` and `[instance][body]`. Arrays that are empty
/// are not computed. Units are seconds, radians and metres.
#[derive(Debug, Default)]
pub struct BodyStates<'a> {
    /// The values of hinges and slides, in the order of [`Tree::scalar_joints`](crate::trees::Tree::scalar_joints).
    pub joint_values: &'a mut [f32],
    /// Their velocities per second.
    pub joint_rates: &'a mut [f32],
    /// The positions of the bodies' origins in the world.
    pub positions: &'a mut [[f32; 3]],
    /// The rotations in the world, `x y z w` or `w x y z`, as the frames have them.
    pub rotations: &'a mut [[f32; 4]],
    /// The velocities of the bodies' points in the world.
    pub velocities: &'a mut [[f32; 3]],
    /// The angular velocities about the world's axes.
    pub angular_velocities: &'a mut [[f32; 3]],
}

impl BodyTables {
    /// The bodies of `frames`, moved by the clips of `tables`. No joint of the tables has a parent.
    ///
    /// # Errors
    /// When the frames do not belong to the tables.
    pub fn new(tables: MotionTables, frames: TreeFrames) -> Result<Self, CrowdError> {
        let fit = tables.links.is_empty() && frames.are_sound(tables.joint_count());
        match fit {
            true => Ok(Self { tables, frames }),
            false => Err(CrowdError::BrokenTables),
        }
    }

    /// The clips.
    #[must_use]
    pub fn tables(&self) -> &MotionTables {
        &self.tables
    }

    /// The bodies.
    #[must_use]
    pub fn frames(&self) -> &TreeFrames {
        &self.frames
    }

    /// Computes the states of instances. `at` has a clip and a tick for each instance; ticks after the clip's end give its
    /// last state. With `steps`, one for each instance, velocities are differences between two ticks. The spans and cells
    /// are those that belong to the tables.
    ///
    /// `engine` provides the threads. The host computes for every device; with the feature `vulkan`, a `DeviceBodies` has
    /// the tables on a device, which computes there.
    ///
    /// # Errors
    /// * When a clip does not exist, or there are more or fewer steps than instances.
    /// * When an array is neither empty nor as long as the instances times the joints or bodies.
    /// * When the spans and cells do not belong to the tables.
    /// * When the system refuses threads, or the work is stopped.
    pub fn sample_into(
        &self,
        engine: &Engine,
        (spans, cells): (&[[u32; 4]], &[[f32; 4]]),
        at: &[(u32, u32)],
        steps: Option<&[FrameStep]>,
        states: BodyStates<'_>,
    ) -> Result<(), CrowdError> {
        self.tables.check_parts((spans, cells))?;
        check_clips(self.tables.clip_count(), at)?;
        if let Some(steps) = steps {
            check_steps(steps.len(), at.len())?;
        }
        self.check_lengths(at.len(), &states)?;
        let width = engine.machine.width();
        let stop = stop::current();
        let task = |memory: &mut BodyScratch, (first, states): (usize, BodyStates<'_>)| {
            stop::check_of(stop.as_ref())?;
            let instances = first..at.len().min(first + TASK);
            let poses = Poses {
                tables: &self.tables,
                spans: bytemuck::cast_slice(spans),
                cells,
            };
            let mut task = BodyTask {
                poses,
                frames: &self.frames,
                at: &at[instances.clone()],
                steps: steps.map(|steps| &steps[instances]),
                states,
                memory,
            };
            in_lanes_of(width, &mut task);
            Ok(())
        };
        if at.len() <= TASK {
            return task(&mut BodyScratch::default(), (0, states));
        }
        let each = [self.frames.scalars.len(), self.frames.bodies.len()];
        let mut left = states;
        let tasks: Vec<_> = (0..at.len())
            .step_by(TASK)
            .map(|first| (first, left.split_off(each.map(|count| TASK * count))))
            .collect();
        let work = || (tasks.into_par_iter()).try_for_each_init(BodyScratch::default, task);
        engine.machine.threads().run(work)?
    }

    fn check_lengths(&self, instances: usize, states: &BodyStates<'_>) -> Result<(), CrowdError> {
        let scalars = instances * self.frames.scalars.len();
        let bodies = instances * self.frames.bodies.len();
        let lengths = [
            (states.joint_values.len(), scalars),
            (states.joint_rates.len(), scalars),
            (states.positions.len(), bodies),
            (states.rotations.len(), bodies),
            (states.velocities.len(), bodies),
            (states.angular_velocities.len(), bodies),
        ];
        let is_other = |&&(length, needed): &&(usize, usize)| length != 0 && length != needed;
        match lengths.iter().find(is_other) {
            None => Ok(()),
            Some(&(length, needed)) => Err(CrowdError::OutputLength { length, needed }),
        }
    }
}

impl BodyStates<'_> {
    /// Splits off the states of the first joints and bodies.
    fn split_off(&mut self, [scalars, bodies]: [usize; 2]) -> Self {
        fn first<'a, T>(of: &mut &'a mut [T], count: usize) -> &'a mut [T] {
            of.split_off_mut(..count.min(of.len())).unwrap_or_default()
        }
        Self {
            joint_values: first(&mut self.joint_values, scalars),
            joint_rates: first(&mut self.joint_rates, scalars),
            positions: first(&mut self.positions, bodies),
            rotations: first(&mut self.rotations, bodies),
            velocities: first(&mut self.velocities, bodies),
            angular_velocities: first(&mut self.angular_velocities, bodies),
        }
    }
}

/// Scratch memory of one thread.
#[derive(Default)]
struct BodyScratch {
    pose: PoseScratch,
    here: SampleScratch,
    /// Those at both ends of a step.
    ends: [SampleScratch; 2],
}

/// The numbers of all tracks and of all frames of a group of instances, each as a vector.
#[derive(Default)]
struct SampleScratch {
    tracks: Vec<f32>,
    frames: Vec<f32>,
}

impl SampleScratch {
    /// Computes the tracks and the frames of a group.
    #[inline(always)]
    fn compute<L: Lanes>(
        &mut self,
        poses: Poses<'_>,
        at: &[(u32, u32)],
        (frames, values): (&[TreeFrame], PoseValues),
        pose: &mut PoseScratch,
    ) {
        let tracks = poses.tables.joint_count();
        self.tracks.resize(tracks * JOINT_NUMBERS * L::COUNT, 0.0);
        self.frames
            .resize(frames.len() * FRAME_NUMBERS * L::COUNT, 0.0);
        poses.locate(at, pose);
        let group = InstanceGroup {
            poses,
            at,
            located: &pose.located,
        };
        group.pose::<L>(values, &mut [], &mut self.tracks);
        let moves = values == PoseValues::Velocities;
        walk::<L>(frames, &self.tracks, moves, &mut self.frames);
    }
}

/// Some instances.
struct BodyTask<'a, 'b> {
    poses: Poses<'a>,
    frames: &'a TreeFrames,
    at: &'a [(u32, u32)],
    steps: Option<&'a [FrameStep]>,
    states: BodyStates<'a>,
    memory: &'b mut BodyScratch,
}

impl InLanes for BodyTask<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let states = &mut self.states;
        let has_velocities =
            !(states.velocities.is_empty() && states.angular_velocities.is_empty());
        let has_bodies =
            has_velocities || !(states.positions.is_empty() && states.rotations.is_empty());
        let has_rates = has_velocities || !states.joint_rates.is_empty();
        let values = match has_rates && self.steps.is_none() {
            true => PoseValues::Velocities,
            false => PoseValues::World,
        };
        let steps = self.steps.filter(|_| has_rates);
        let frames = match has_bodies {
            true => &self.frames.frames[..],
            false => &[],
        };
        let each = [self.frames.scalars.len(), self.frames.bodies.len()];
        let BodyScratch { pose, here, ends } = &mut *self.memory;
        for (group, instances) in self.at.chunks(L::COUNT).enumerate() {
            let mut outputs = states.split_off(each.map(|count| count * instances.len()));
            here.compute::<L>(self.poses, instances, (frames, values), pose);
            let mut differences = None;
            if let Some(steps) = steps {
                let steps = &steps[group * L::COUNT..][..instances.len()];
                for (side, end) in ends.iter_mut().enumerate() {
                    let at = ends_of_steps(instances, steps, side);
                    let at = &at[..instances.len()];
                    end.compute::<L>(self.poses, at, (frames, PoseValues::World), pose);
                }
                differences = Some(Differences {
                    ends: &*ends,
                    per_second: L::load(&steps_per_second(steps)),
                });
            }
            put_scalars(here, &differences, &self.frames.scalars, &mut outputs);
            if has_bodies {
                put_bodies(here, &differences, self.frames, &mut outputs);
            }
        }
    }
}

/// The states of a group at both ends of its steps, whose differences are its velocities.
struct Differences<'a, L> {
    ends: &'a [SampleScratch; 2],
    per_second: L,
}

#[inline(always)]
fn put_scalars<L: Lanes>(
    here: &SampleScratch,
    differences: &Option<Differences<'_, L>>,
    scalars: &[u32],
    states: &mut BodyStates<'_>,
) {
    for (index, &word) in scalars.iter().enumerate() {
        let [value, mut rate] = scalar::<L>(&here.tracks, word);
        if let Some(Differences { ends, per_second }) = differences {
            let [low, high] = ends.each_ref().map(|end| scalar::<L>(&end.tracks, word)[0]);
            rate = ((high - low) * *per_second).canonical();
        }
        for (array, numbers) in [
            (&mut *states.joint_values, value),
            (&mut *states.joint_rates, rate),
        ] {
            let mut found = [0.0; MAX_LANES];
            numbers.store(&mut found[..L::COUNT]);
            let output = array.get_mut(index..).unwrap_or_default();
            for (to, number) in output.iter_mut().step_by(scalars.len()).zip(found) {
                *to = number;
            }
        }
    }
}

#[inline(always)]
fn put_bodies<L: Lanes>(
    here: &SampleScratch,
    differences: &Option<Differences<'_, L>>,
    frames: &TreeFrames,
    states: &mut BodyStates<'_>,
) {
    let TreeFrames { bodies, points, .. } = frames;
    let has_velocities = !(states.velocities.is_empty() && states.angular_velocities.is_empty());
    for (index, (&body, &point)) in bodies.iter().zip(points).enumerate() {
        let at = (index, bodies.len());
        let state = frame::<L>(&here.frames, body);
        let zero = L::all(0.0);
        let [x, y, z] = state.position;
        put::<L, _>(states.positions, [x, y, z, zero], at, three);
        match frames.is_w_first {
            true => put::<L, _>(states.rotations, state.rotation, at, |[x, y, z, w]| {
                [w, x, y, z]
            }),
            false => put::<L, _>(states.rotations, state.rotation, at, |row| row),
        }
        if !has_velocities {
            continue;
        }
        let [linear, angular] = [point, body].map(|index| {
            let mut state = frame::<L>(&here.frames, index);
            if let Some(Differences { ends, per_second }) = differences {
                let [before, after] = ends.each_ref().map(|end| frame::<L>(&end.frames, index));
                state.differ(&before, &after, *per_second);
            }
            state
        });
        let [x, y, z] = linear.velocity;
        put::<L, _>(states.velocities, [x, y, z, zero], at, three);
        let [x, y, z] = angular.angular_velocity;
        put::<L, _>(states.angular_velocities, [x, y, z, zero], at, three);
    }
}
