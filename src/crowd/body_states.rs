//! States of a robot's clips at any times: the values of its joints, and its bodies with their velocities. The joints are
//! interpolated as states of motion tables are, and a walk along the tree computes the bodies from them in f32.

use std::ops::Range;

use rayon::prelude::*;

use crate::crowd::states::{
    FrameStep, Joint, MotionTables, PoseScratch, PoseValues, Poses, StateRows, TASK, check_clips,
    check_steps,
};
use crate::crowd::tree_walk::{WalkedFrame, scalar, walk};
use crate::crowd_error::CrowdError;
use crate::engine::Engine;
use crate::pose::tree::frames::TreeFrames;
use crate::simd::dispatch::{InLanes, in_lanes_of};
use crate::simd::lanes::Lanes;
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
    rotations: Vec<[f32; 4]>,
    rows: StateRows,
    sample: SampleScratch,
    /// Those at both ends of a step.
    ends: [SampleScratch; 2],
}

/// The states of a sample.
#[derive(Default)]
struct SampleScratch {
    tracks: Vec<Joint<f32>>,
    frames: Vec<WalkedFrame>,
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
        let BodyScratch {
            pose,
            rotations,
            rows,
            sample,
            ends,
        } = &mut *self.memory;
        let states = &mut self.states;
        let joints = self.poses.tables.joint_count();
        rotations.resize(joints, [0.0; 4]);
        pose.resize::<L>(joints);
        rows.resize(joints * L::COUNT);
        let has_velocities =
            !(states.velocities.is_empty() && states.angular_velocities.is_empty());
        let has_bodies =
            has_velocities || !(states.positions.is_empty() && states.rotations.is_empty());
        let has_rates = has_velocities || !states.joint_rates.is_empty();
        let moves = has_rates && self.steps.is_none();
        let values = match moves {
            true => PoseValues::Velocities,
            false => PoseValues::World,
        };
        let TreeFrames {
            frames,
            bodies,
            points,
            scalars,
            is_w_first,
        } = self.frames;
        for (instance, &(clip, tick)) in self.at.iter().enumerate() {
            let mut compute = |tick, values, sample: &mut SampleScratch| {
                let SampleScratch {
                    tracks,
                    frames: walked,
                } = sample;
                let row = (&mut *rows, 0);
                (self.poses).compute::<L>((clip, tick), values, pose, rotations, row);
                let is_moving = values == PoseValues::Velocities;
                let states = (0..joints).map(|joint| rows.state(joint * L::COUNT, is_moving));
                tracks.clear();
                tracks.extend(states);
                if has_bodies {
                    walk(frames, tracks, moves, walked);
                }
            };
            compute(tick, values, sample);
            if let (Some(steps), true) = (self.steps, has_rates) {
                let step = steps[instance];
                for (end, tick) in ends.iter_mut().zip(step.ticks) {
                    compute(tick, PoseValues::World, end);
                }
                let [before, after] = &*ends;
                let pairs = before.tracks.iter().zip(&after.tracks);
                for (track, (before, after)) in sample.tracks.iter_mut().zip(pairs) {
                    track.differ(before, after, step.per_second);
                }
                let pairs = before.frames.iter().zip(&after.frames);
                for (frame, (before, after)) in sample.frames.iter_mut().zip(pairs) {
                    let (before, after) = (&before.in_world, &after.in_world);
                    frame.in_world.differ(before, after, step.per_second);
                }
            }
            let of_scalars = instance * scalars.len()..(instance + 1) * scalars.len();
            let of_bodies = instance * bodies.len()..(instance + 1) * bodies.len();
            let tracks = &sample.tracks;
            for (array, part) in [
                (&mut *states.joint_values, 0),
                (&mut *states.joint_rates, 1),
            ] {
                let output = array.get_mut(of_scalars.clone()).unwrap_or_default();
                for (value, &word) in output.iter_mut().zip(scalars) {
                    *value = scalar(tracks, word)[part];
                }
            }
            let put = |to: &mut [[f32; 3]], list: &[u32], of: fn(&Joint<f32>) -> [f32; 3]| {
                let output = to.get_mut(of_bodies.clone()).unwrap_or_default();
                for (value, &frame) in output.iter_mut().zip(list) {
                    *value = of(&sample.frames[frame as usize].in_world);
                }
            };
            put(states.positions, bodies, |body| body.position);
            put(states.velocities, points, |body| body.velocity);
            put(states.angular_velocities, bodies, |body| {
                body.angular_velocity
            });
            let output = states.rotations.get_mut(Range::clone(&of_bodies));
            for (value, &frame) in output.unwrap_or_default().iter_mut().zip(bodies) {
                let [x, y, z, w] = sample.frames[frame as usize].in_world.rotation;
                *value = match is_w_first {
                    true => [w, x, y, z],
                    false => [x, y, z, w],
                };
            }
        }
    }
}
