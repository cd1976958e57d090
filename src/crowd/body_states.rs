//! States of a robot's clips at any times: the values of its joints, and its bodies with their velocities. The joints are
//! interpolated as states of motion tables are, and a walk along the tree computes the bodies from them in f32.

use rayon::prelude::*;

use crate::crowd::states::{
    FrameStep, JOINT_NUMBERS, MotionTables, PoseScratch, PoseValues, Poses, StateRows, TASK,
    check_clips, check_steps,
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
    rotations: Vec<[f32; 4]>,
    here: SampleScratch,
    /// Those at both ends of a step.
    ends: [SampleScratch; 2],
}

/// The states of as many instances as a vector has lanes.
#[derive(Default)]
struct SampleScratch {
    rows: StateRows,
    /// The numbers of all tracks and of all frames, each as a vector.
    tracks: Vec<f32>,
    frames: Vec<f32>,
    /// One body.
    body: StateRows,
}

impl SampleScratch {
    fn resize<L: Lanes>(&mut self, tracks: usize, frames: usize) {
        self.rows.resize(tracks * L::COUNT);
        self.tracks.resize(tracks * JOINT_NUMBERS * L::COUNT, 0.0);
        self.frames.resize(frames * FRAME_NUMBERS * L::COUNT, 0.0);
        self.body.resize(L::COUNT);
    }

    /// Computes the frames from the rows; without `frames` only the tracks.
    #[inline(always)]
    fn walk<L: Lanes>(&mut self, frames: &[TreeFrame], moves: bool) {
        let each = JOINT_NUMBERS * L::COUNT;
        for (track, numbers) in self.tracks.chunks_exact_mut(each).enumerate() {
            self.rows.joint::<L>(track, moves).store(numbers);
        }
        walk::<L>(frames, &self.tracks, moves, &mut self.frames);
    }

    /// Sets the body to a frame.
    #[inline(always)]
    fn find<L: Lanes>(&mut self, index: u32, moves: bool) {
        let state = frame::<L>(&self.frames, index);
        self.body.put::<L>(0, &state, moves);
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
        let states = &self.states;
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
        let steps = self.steps.filter(|_| has_rates);
        let frames = match has_bodies {
            true => &self.frames.frames[..],
            false => &[],
        };
        let joints = self.poses.tables.joint_count();
        let BodyScratch {
            pose,
            rotations,
            here,
            ends,
        } = &mut *self.memory;
        rotations.resize(joints, [0.0; 4]);
        pose.resize::<L>(joints);
        for sample in [&mut *here].into_iter().chain(&mut *ends) {
            sample.resize::<L>(joints, self.frames.frames.len());
        }
        for (group, instances) in self.at.chunks(L::COUNT).enumerate() {
            let first = group * L::COUNT;
            let steps = steps.map(|steps| &steps[first..][..instances.len()]);
            for (lane, &(clip, tick)) in instances.iter().enumerate() {
                let row = (&mut here.rows, lane);
                (self.poses).compute::<L>((clip, tick), values, pose, rotations, row);
                for step in steps.iter().flat_map(|steps| steps.get(lane)) {
                    for (end, tick) in ends.iter_mut().zip(step.ticks) {
                        let row = (&mut end.rows, lane);
                        let values = PoseValues::World;
                        (self.poses).compute::<L>((clip, tick), values, pose, rotations, row);
                    }
                }
            }
            here.walk::<L>(frames, moves);
            if steps.is_some() {
                for end in &mut *ends {
                    end.walk::<L>(frames, false);
                }
            }
            let group = Group {
                first,
                count: instances.len(),
                steps,
                moves,
            };
            group.put_scalars::<L>(here, ends, &self.frames.scalars, &mut self.states);
            if has_bodies {
                group.put_bodies::<L>(here, ends, self.frames, has_velocities, &mut self.states);
            }
        }
    }
}

/// As many instances as a vector has lanes, or fewer at the end.
struct Group<'a> {
    first: usize,
    count: usize,
    steps: Option<&'a [FrameStep]>,
    /// Whether velocities are those of the walk.
    moves: bool,
}

impl Group<'_> {
    #[inline(always)]
    fn put_scalars<L: Lanes>(
        &self,
        here: &SampleScratch,
        [before, after]: &[SampleScratch; 2],
        scalars: &[u32],
        states: &mut BodyStates<'_>,
    ) {
        let mut per_second = [0.0; MAX_LANES];
        for (lane, step) in per_second.iter_mut().zip(self.steps.unwrap_or_default()) {
            *lane = step.per_second;
        }
        let per_second = L::load(&per_second);
        for (index, &word) in scalars.iter().enumerate() {
            let [value, mut rate] = scalar::<L>(&here.tracks, word);
            if self.steps.is_some() {
                let [low, _] = scalar::<L>(&before.tracks, word);
                let [high, _] = scalar::<L>(&after.tracks, word);
                rate = ((high - low) * per_second).canonical();
            }
            let at = self.first * scalars.len() + index;
            for (array, numbers) in [
                (&mut *states.joint_values, value),
                (&mut *states.joint_rates, rate),
            ] {
                let mut found = [0.0; MAX_LANES];
                numbers.store(&mut found[..L::COUNT]);
                let output = array.get_mut(at..).unwrap_or_default();
                let output = output.iter_mut().step_by(scalars.len());
                for (to, &number) in output.zip(&found[..self.count]) {
                    *to = number;
                }
            }
        }
    }

    #[inline(always)]
    fn put_bodies<L: Lanes>(
        &self,
        here: &mut SampleScratch,
        ends: &mut [SampleScratch; 2],
        frames: &TreeFrames,
        has_velocities: bool,
        states: &mut BodyStates<'_>,
    ) {
        let TreeFrames { bodies, points, .. } = frames;
        for (index, (&body, &point)) in bodies.iter().zip(points).enumerate() {
            let at = (self.first * bodies.len() + index, bodies.len());
            here.find::<L>(body, self.moves);
            let rows = &here.body;
            let lanes = ..self.count;
            put(
                states.positions,
                at,
                &rows.positions[lanes],
                |[x, y, z, _]| [x, y, z],
            );
            match frames.is_w_first {
                true => put(
                    states.rotations,
                    at,
                    &rows.rotations[lanes],
                    |[x, y, z, w]| [w, x, y, z],
                ),
                false => put(states.rotations, at, &rows.rotations[lanes], |row| row),
            }
            if !has_velocities {
                continue;
            }
            self.differ::<L>(here, ends, body);
            let three = |[x, y, z, _]: [f32; 4]| [x, y, z];
            let rates = &here.body.angular_velocities[lanes];
            put(states.angular_velocities, at, rates, three);
            if point != body {
                here.find::<L>(point, self.moves);
                self.differ::<L>(here, ends, point);
            }
            put(states.velocities, at, &here.body.velocities[lanes], three);
        }
    }

    /// With steps, sets the velocities of the body, which is this frame, to differences.
    #[inline(always)]
    fn differ<L: Lanes>(
        &self,
        here: &mut SampleScratch,
        ends: &mut [SampleScratch; 2],
        frame: u32,
    ) {
        let Some(steps) = self.steps else {
            return;
        };
        for end in &mut *ends {
            end.find::<L>(frame, false);
        }
        let ends = [&ends[0].body, &ends[1].body];
        for (lane, step) in steps.iter().enumerate() {
            here.body.differ(lane, ends, step.per_second);
        }
    }
}

/// Stores a body's values of some instances, each so many elements after the one before, in an array that is not left
/// out.
#[inline(always)]
fn put<T>(
    array: &mut [T],
    (first, step): (usize, usize),
    rows: &[[f32; 4]],
    of: fn([f32; 4]) -> T,
) {
    let output = array.get_mut(first..).unwrap_or_default();
    for (value, row) in output.iter_mut().step_by(step).zip(rows) {
        *value = of(*row);
    }
}
