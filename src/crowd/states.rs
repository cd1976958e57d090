//! States of a library's clips at any times: rotations, positions and velocities of all joints, for the training of
//! models of motion. The rotations have a crowd's bits. The rest is computed from them with sums and products alone,
//! so that every machine has the same bits.

use std::ops::Range;

use rayon::prelude::*;

use crate::crowd::clip_tables::{ClipTables, arcs, constants_of, runs_of};
use crate::crowd_error::CrowdError;
use crate::engine::Engine;
use crate::math::canonical::canonical;
use crate::math::quaternion::{cross3, dot, product, scaled, sum};
use crate::shader::{
    CHANNELS, CrowdBase, CrowdChannel, CrowdClip, CrowdLink, CrowdPosition, CrowdSpan, FORM_ARC,
    FORM_CONSTANT, FORM_CUBIC, FORM_POLYNOMIAL, ON_KEY, POWERS, TICKS, TRANSLATION,
};
use crate::simd::dispatch::{InLanes, in_lanes_of};
use crate::simd::lanes::Lanes;
use crate::threads::stop;
use crate::twin::crowd_layers::sampled;
use crate::twin::crowd_times::position_at;
use crate::twin::quaternion::rotated;

/// The number of instances in a task.
const TASK: usize = 64;

/// Output arrays for the poses and velocities of all joints, `[instance][joint]`. Arrays that are empty are not
/// computed. Units are seconds, radians, and the unit of length of the clips.
#[derive(Debug, Default)]
pub struct MotionStates<'a> {
    /// The rotation in the parent's frame, `x y z w`.
    pub rotations: &'a mut [[f32; 4]],
    /// The position in the world: offsets and translations along the skeleton.
    pub positions: &'a mut [[f32; 3]],
    /// The rotation in the world, `x y z w`.
    pub world_rotations: &'a mut [[f32; 4]],
    /// The velocity in the world: the derivative of the position.
    pub velocities: &'a mut [[f32; 3]],
    /// The angular velocity about the world's axes, radians per second: the derivative of the world rotation.
    pub angular_velocities: &'a mut [[f32; 3]],
}

/// The clips of a [`CrowdLibrary`](crate::crowd::library::CrowdLibrary) as plain tables. The two large tables, spans
/// and cells, are separate, so that several processes can map them from a file.
///
/// ```
/// use tumble::glam::{Quat, Vec3};
/// use tumble::crowd::{CrowdLibrary, MotionStates};
/// use tumble::{Device, Engine, Skeleton, TrackSet, VectorMethod, method};
/// let mut door = TrackSet::new();
/// door.push("door", &[0.0, 2.0], &[Quat::IDENTITY, Quat::from_rotation_y(1.0)])?;
/// let mut library = CrowdLibrary::new(&Skeleton::new(vec![None], vec![Vec3::X])?)?;
/// library.push(&door, method::SLERP, VectorMethod::Linear)?;
/// let (tables, spans, cells) = library.into_tables();
///
/// let engine = Engine::new(Device::Cpu)?;
/// let mut angular_velocities = [[0.0; 3]; 1];
/// let second = tables.ticks_per_second();
/// let states = MotionStates { angular_velocities: &mut angular_velocities, ..MotionStates::default() };
/// tables.sample_into(&engine, (&spans, &cells), &[(0, second)], states)?;
/// assert!((angular_velocities[0][1] - 0.5).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct MotionTables {
    clips: Vec<CrowdClip>,
    bases: Vec<CrowdBase>,
    channels: Vec<CrowdChannel>,
    links: Vec<CrowdLink>,
    runs: Vec<Vec<Range<u32>>>,
    joints: usize,
    ticks_per_second: u32,
    /// The expected numbers of spans and cells.
    sizes: (usize, usize),
}

/// The small tables of [`MotionTables`] as 32-bit words, for files.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct MotionWords {
    /// For each clip: its length in ticks, and the first and the number of its time bases.
    pub clips: Vec<[u32; 3]>,
    /// For each time base: the first and the number of its spans, and the step with which a search in them starts.
    pub bases: Vec<[u32; 3]>,
    /// For each channel of each joint of each clip: its form, its time base and its cells.
    pub channels: Vec<[u32; 4]>,
    /// The joints that have a parent, each with its parent, level by level.
    pub links: Vec<[u32; 2]>,
    /// Number of joints of the skeleton.
    pub joint_count: usize,
    /// Number of ticks in a second.
    pub ticks_per_second: u32,
}

impl MotionTables {
    /// The tables of a library's clips, with their spans and cells.
    pub(crate) fn of_library(
        library_tables: ClipTables,
        links: Vec<CrowdLink>,
        joints: usize,
        ticks_per_second: u32,
    ) -> (Self, Vec<[u32; 4]>, Vec<[f32; 4]>) {
        let spans: Vec<[u32; 4]> = bytemuck::cast_vec(library_tables.spans);
        let tables = Self {
            sizes: (spans.len(), library_tables.cells.len()),
            clips: library_tables.clips,
            bases: library_tables.bases,
            channels: library_tables.channels,
            links,
            runs: library_tables.runs,
            joints,
            ticks_per_second,
        };
        (tables, spans, library_tables.cells)
    }

    /// Makes tables from words, for these spans and cells.
    ///
    /// # Errors
    /// When the tables do not fit together: the file is broken or was written by another version.
    pub fn new(
        words: MotionWords,
        (spans, cells): (&[[u32; 4]], &[[f32; 4]]),
    ) -> Result<Self, CrowdError> {
        let channels: Vec<CrowdChannel> = bytemuck::cast_vec(words.channels);
        let each = words.joint_count.saturating_mul(CHANNELS as usize);
        let runs = match each {
            0 => Vec::new(),
            each => channels.chunks(each).map(runs_of).collect(),
        };
        let tables = Self {
            clips: bytemuck::cast_vec(words.clips),
            bases: bytemuck::cast_vec(words.bases),
            channels,
            links: bytemuck::cast_vec(words.links),
            runs,
            joints: words.joint_count,
            ticks_per_second: words.ticks_per_second,
            sizes: (spans.len(), cells.len()),
        };
        match tables.are_sound(bytemuck::cast_slice(spans), cells.len()) {
            true => Ok(tables),
            false => Err(CrowdError::BrokenTables),
        }
    }

    /// Whether every index in the tables is within its table.
    fn are_sound(&self, spans: &[CrowdSpan], cells: usize) -> bool {
        let each = self.joints.saturating_mul(CHANNELS as usize);
        let is_sound_base = |base: &CrowdBase| {
            let end = base.first as usize + base.count as usize;
            let step = match base.count {
                ..2 => 0,
                count => 1 << (count - 1).ilog2(),
            };
            base.count > 0 && end <= spans.len() && base.step == step
        };
        let mut has_parents = vec![true; self.joints];
        for link in &self.links {
            match has_parents.get_mut(link.joint as usize) {
                Some(has_parent) => *has_parent = false,
                None => return false,
            }
        }
        let mut is_sound_link = |link: &CrowdLink| {
            let is_there = has_parents.get(link.parent as usize) == Some(&true);
            let has_parent = &mut has_parents[link.joint as usize];
            is_there && !std::mem::replace(has_parent, true)
        };
        let is_sound_clip = |(index, clip): (usize, &CrowdClip)| {
            let first = clip.first_base as usize;
            let Some(bases) = self.bases.get(first..first + clip.bases as usize) else {
                return false;
            };
            let is_sound_channel = |channel: &CrowdChannel| {
                let form = channel.form_and_base >> 24;
                let Some(base) = bases.get((channel.form_and_base & 0x00ff_ffff) as usize) else {
                    return false;
                };
                let last = (base.count as usize - 1) * channel.count as usize;
                let constants = constants_of(form);
                let end = match form {
                    FORM_CONSTANT => channel.first as usize,
                    _ => {
                        let behind = (constants - 1) * channel.count as usize;
                        channel.first as usize + last * constants + behind
                    }
                };
                let base_spans = &spans[base.first as usize..][..base.count as usize];
                let has_keys =
                    form != FORM_CONSTANT && base_spans.iter().any(|span| span.start & ON_KEY != 0);
                let keys = channel.keys as usize + last;
                [FORM_CONSTANT, FORM_ARC, FORM_CUBIC, FORM_POLYNOMIAL].contains(&form)
                    && end < cells
                    && (!has_keys || keys < cells)
            };
            let channels = &self.channels[index * each..][..each];
            clip.bases > 0 && clip.period > 0 && channels.iter().all(is_sound_channel)
        };
        each > 0
            && self.ticks_per_second > 0
            && self.channels.len() == self.clips.len() * each
            && self.bases.iter().all(is_sound_base)
            && self.links.iter().all(&mut is_sound_link)
            && self.clips.iter().enumerate().all(is_sound_clip)
    }

    /// The small tables as words.
    #[must_use]
    pub fn words(&self) -> MotionWords {
        MotionWords {
            clips: bytemuck::cast_slice(&self.clips).to_vec(),
            bases: bytemuck::cast_slice(&self.bases).to_vec(),
            channels: bytemuck::cast_slice(&self.channels).to_vec(),
            links: bytemuck::cast_slice(&self.links).to_vec(),
            joint_count: self.joints,
            ticks_per_second: self.ticks_per_second,
        }
    }

    /// Number of clips.
    #[must_use]
    pub fn clip_count(&self) -> usize {
        self.clips.len()
    }

    /// Number of joints.
    #[must_use]
    pub fn joint_count(&self) -> usize {
        self.joints
    }

    /// Number of ticks in a second.
    #[must_use]
    pub fn ticks_per_second(&self) -> u32 {
        self.ticks_per_second
    }

    /// The length of a clip, ticks, at least 1; `None` if there is no such clip.
    #[must_use]
    pub fn ticks(&self, clip: usize) -> Option<u32> {
        self.clips.get(clip).map(|clip| clip.period)
    }

    /// Computes the states of instances. `at` has a clip and a tick for each instance; ticks after the clip's end
    /// give its last pose. The spans and cells are those that belong to the tables.
    ///
    /// `engine` provides the threads and the vector width. The host computes for every device.
    ///
    /// # Errors
    /// When a clip does not exist, an array is neither empty nor as long as the instances times the joints, the spans
    /// and cells do not belong to the tables, the system refuses threads, or the work is stopped.
    pub fn sample_into(
        &self,
        engine: &Engine,
        (spans, cells): (&[[u32; 4]], &[[f32; 4]]),
        at: &[(u32, u32)],
        states: MotionStates<'_>,
    ) -> Result<(), CrowdError> {
        if (spans.len(), cells.len()) != self.sizes {
            return Err(CrowdError::BrokenTables);
        }
        let count = self.clips.len();
        if let Some(&(clip, _)) = at.iter().find(|(clip, _)| *clip as usize >= count) {
            let (subject, index) = ("clip", clip as usize);
            return Err(CrowdError::Missing {
                subject,
                index,
                count,
            });
        }
        let needed = at.len() * self.joints;
        let lengths = [
            states.rotations.len(),
            states.positions.len(),
            states.world_rotations.len(),
            states.velocities.len(),
            states.angular_velocities.len(),
        ];
        if let Some(&length) = lengths
            .iter()
            .find(|&&length| length != 0 && length != needed)
        {
            return Err(CrowdError::OutputLength { length, needed });
        }
        let width = engine.machine.width();
        let stop = stop::current();
        let each = TASK * self.joints;
        let task = |memory: &mut StateScratch, (at, states): (&[(u32, u32)], MotionStates<'_>)| {
            stop::check_of(stop.as_ref())?;
            let spans = bytemuck::cast_slice(spans);
            let tables = self;
            in_lanes_of(
                width,
                &mut StatesTask {
                    tables,
                    spans,
                    cells,
                    at,
                    states,
                    memory,
                },
            );
            Ok(())
        };
        if at.len() <= TASK {
            return task(&mut StateScratch::default(), (at, states));
        }
        let mut left = states;
        let tasks: Vec<_> = at
            .chunks(TASK)
            .map(|at| (at, left.split_off(each)))
            .collect();
        let work = || (tasks.into_par_iter()).try_for_each_init(StateScratch::default, task);
        engine.machine.threads().run(work)?
    }
}

impl<'a> MotionStates<'a> {
    /// Splits off the states of the first `joints` joints.
    fn split_off(&mut self, joints: usize) -> Self {
        fn first<'a, T>(of: &mut &'a mut [T], count: usize) -> &'a mut [T] {
            of.split_off_mut(..count.min(of.len())).unwrap_or_default()
        }
        Self {
            rotations: first(&mut self.rotations, joints),
            positions: first(&mut self.positions, joints),
            world_rotations: first(&mut self.world_rotations, joints),
            velocities: first(&mut self.velocities, joints),
            angular_velocities: first(&mut self.angular_velocities, joints),
        }
    }
}

/// Scratch memory of one thread.
#[derive(Default)]
struct StateScratch {
    positions: Vec<CrowdPosition>,
    rotations: Vec<[f32; 4]>,
    joints: Vec<Joint>,
}

/// A joint in the world.
#[derive(Clone, Copy, Default)]
struct Joint {
    rotation: [f32; 4],
    position: [f32; 3],
    velocity: [f32; 3],
    angular_velocity: [f32; 3],
}

/// Some instances.
struct StatesTask<'a, 'b> {
    tables: &'a MotionTables,
    spans: &'a [CrowdSpan],
    cells: &'a [[f32; 4]],
    at: &'a [(u32, u32)],
    states: MotionStates<'a>,
    memory: &'b mut StateScratch,
}

impl InLanes for StatesTask<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (tables, joints) = (self.tables, self.tables.joints);
        let states = &mut self.states;
        let moves = !(states.velocities.is_empty() && states.angular_velocities.is_empty());
        let in_world = moves || !(states.positions.is_empty() && states.world_rotations.is_empty());
        let StateScratch {
            positions,
            rotations,
            joints: world,
        } = &mut *self.memory;
        rotations.resize(joints, [0.0; 4]);
        world.resize(joints, Joint::default());
        for (instance, &(clip, tick)) in self.at.iter().enumerate() {
            let clip_entry = &tables.clips[clip as usize];
            let tick = tick.min(clip_entry.period);
            let bases =
                &tables.bases[clip_entry.first_base as usize..][..clip_entry.bases as usize];
            positions.clear();
            let position = |base| guessed_position(base, self.spans, tick, clip_entry.period);
            positions.extend(bases.iter().map(position));
            let each = joints * CHANNELS as usize;
            let channels = &tables.channels[clip as usize * each..][..each];
            let at = instance * joints..(instance + 1) * joints;
            let local = match states.rotations.get_mut(at.clone()) {
                Some(rotations) => rotations,
                None => &mut rotations[..],
            };
            local_rotations::<L>(
                &tables.runs[clip as usize],
                channels,
                self.cells,
                positions,
                local,
            );
            if !in_world {
                continue;
            }
            let moment = ClipMoment {
                bases,
                spans: self.spans,
                cells: self.cells,
                positions,
                tick,
                per_second: tables.ticks_per_second as f32,
            };
            for (joint, state) in world.iter_mut().enumerate() {
                let [rotation, moved] = [
                    &channels[joint * 3],
                    &channels[joint * 3 + TRANSLATION as usize],
                ];
                let [x, y, z, _] = moment.value(moved);
                *state = Joint {
                    rotation: local[joint],
                    position: [x, y, z],
                    ..Joint::default()
                };
                if moves {
                    state.angular_velocity = moment.angular_velocity(rotation);
                    state.velocity = moment.velocity(moved);
                }
            }
            for link in &tables.links {
                let parent = world[link.parent as usize];
                let child = &mut world[link.joint as usize];
                child.hang_on(&parent, moves);
            }
            fn put<T: Copy>(to: &mut [T], at: Range<usize>, world: &[Joint], of: fn(&Joint) -> T) {
                for (value, joint) in to.get_mut(at).into_iter().flatten().zip(world) {
                    *value = of(joint);
                }
            }
            put(states.positions, at.clone(), world, |joint| joint.position);
            put(states.world_rotations, at.clone(), world, |joint| {
                joint.rotation
            });
            put(states.velocities, at.clone(), world, |joint| joint.velocity);
            put(states.angular_velocities, at, world, |joint| {
                joint.angular_velocity
            });
        }
    }
}

impl Joint {
    /// Converts the joint's state from its parent's frame to the world.
    #[inline(always)]
    fn hang_on(&mut self, parent: &Self, moves: bool) {
        let arm = rotated(parent.rotation, self.position);
        self.position = sum(parent.position, arm).map(canonical);
        let rotation = product(parent.rotation, self.rotation);
        // One step of Newton's: rounding does not add up along the skeleton.
        let scale = 1.5 - 0.5 * dot(rotation, rotation);
        self.rotation = rotation.map(|component| canonical(component * scale));
        if !moves {
            return;
        }
        let relative = rotated(parent.rotation, self.velocity);
        let carried = sum(parent.velocity, cross3(parent.angular_velocity, arm));
        self.velocity = sum(carried, relative).map(canonical);
        let relative = rotated(parent.rotation, self.angular_velocity);
        self.angular_velocity = sum(parent.angular_velocity, relative).map(canonical);
    }
}

/// The position of a tick in a time base, as [`position_at`] computes it. Most keys are at even times. Therefore the
/// span that would contain the tick at even times is tried first, without a search, each step of which waits for
/// memory.
#[inline(always)]
fn guessed_position(
    base: &CrowdBase,
    spans: &[CrowdSpan],
    tick: u32,
    period: u32,
) -> CrowdPosition {
    let count = base.count as usize;
    let base_spans = &spans[base.first as usize..][..count];
    let even = (u64::from(tick) * (count as u64 - 1)).checked_div(u64::from(period));
    let guess = (even.unwrap_or(0) as usize).min(count - 1);
    let start = |index: usize| base_spans[index].start & TICKS;
    // Rounding may have put the key on the other side of the tick.
    for index in [guess, guess + 1, guess.saturating_sub(1)] {
        if index < count && start(index) <= tick && (index + 1 == count || tick < start(index + 1))
        {
            let only = CrowdBase {
                first: base.first + index as u32,
                count: 1,
                step: 0,
            };
            let position = position_at(&only, spans, tick);
            let span = position.span + index as u32;
            return CrowdPosition { span, ..position };
        }
    }
    position_at(base, spans, tick)
}

/// The rotations of an instance, as in a crowd with one layer.
#[inline(always)]
fn local_rotations<L: Lanes>(
    runs: &[Range<u32>],
    channels: &[CrowdChannel],
    cells: &[[f32; 4]],
    positions: &[CrowdPosition],
    output: &mut [[f32; 4]],
) {
    for run in runs {
        let values = &mut output[run.start as usize..run.end as usize];
        let of = |joint: u32| &channels[(joint * CHANNELS) as usize];
        let channel = of(run.start);
        let stands = positions[(channel.form_and_base & 0x00ff_ffff) as usize];
        if channel.form_and_base >> 24 == FORM_ARC && stands.span & ON_KEY == 0 {
            let middle = (channel.first + stands.span * channel.count * 2) as usize;
            let tangent = middle + channel.count as usize;
            let cells = |first: usize| &cells[first..first + values.len()];
            arcs::<L>(cells(middle), cells(tangent), stands.parameter, values);
            continue;
        }
        for (joint, value) in run.clone().zip(values) {
            *value = sampled(cells, of(joint), stands);
        }
    }
}

/// A moment of a clip.
struct ClipMoment<'a> {
    bases: &'a [CrowdBase],
    spans: &'a [CrowdSpan],
    cells: &'a [[f32; 4]],
    positions: &'a [CrowdPosition],
    tick: u32,
    per_second: f32,
}

impl ClipMoment<'_> {
    #[inline(always)]
    fn value(&self, channel: &CrowdChannel) -> [f32; 4] {
        let position = self.positions[(channel.form_and_base & 0x00ff_ffff) as usize];
        sampled(self.cells, channel, position)
    }

    /// The span of a channel, the parameter in it and the parameter's rate per second. At the last key these are of
    /// the span that ends there.
    #[inline(always)]
    fn along(&self, channel: &CrowdChannel) -> (u32, f32, f32) {
        let base = (channel.form_and_base & 0x00ff_ffff) as usize;
        let position = self.positions[base];
        let mut index = position.span & TICKS;
        let first = self.bases[base].first;
        let mut span = &self.spans[(first + index) as usize];
        let mut parameter = position.parameter;
        let is_end = span.scale == 0.0 && span.start & TICKS == self.tick;
        if is_end && index > 0 {
            index -= 1;
            span = &self.spans[(first + index) as usize];
            let distance = (self.tick as i32).wrapping_sub(span.whole) as f32;
            parameter = distance * span.scale + span.offset;
        }
        (index, parameter, span.scale * self.per_second)
    }

    /// The angular velocity of a rotation, about the parent's axes.
    #[inline(always)]
    fn angular_velocity(&self, channel: &CrowdChannel) -> [f32; 3] {
        let form = channel.form_and_base >> 24;
        if form == FORM_CONSTANT {
            return [0.0; 3];
        }
        let (span, s, rate) = self.along(channel);
        let (rotation, slope) = match form {
            // An arc turns as fast everywhere as in its middle.
            FORM_ARC => {
                let first = channel.first + span * channel.count * 2;
                let [middle, tangent] =
                    [first, first + channel.count].map(|cell| self.cells[cell as usize]);
                (middle, tangent)
            }
            _ => self.polynomial::<POWERS>(channel, span, s),
        };
        let [x, y, z, w] = rotation;
        let [x, y, z, _] = product(slope, [-x, -y, -z, w]);
        scaled([x, y, z], 2.0 * rate).map(canonical)
    }

    /// The derivative of a translation, in the parent's frame.
    #[inline(always)]
    fn velocity(&self, channel: &CrowdChannel) -> [f32; 3] {
        if channel.form_and_base >> 24 == FORM_CONSTANT {
            return [0.0; 3];
        }
        let (span, s, rate) = self.along(channel);
        let (_, [x, y, z, _]) = match channel.form_and_base >> 24 {
            FORM_CUBIC => self.polynomial::<4>(channel, span, s),
            _ => self.polynomial::<POWERS>(channel, span, s),
        };
        scaled([x, y, z], rate).map(canonical)
    }

    /// A polynomial's value and its derivative by its parameter.
    #[inline(always)]
    fn polynomial<const N: usize>(
        &self,
        channel: &CrowdChannel,
        span: u32,
        s: f32,
    ) -> ([f32; 4], [f32; 4]) {
        let first = channel.first + span * channel.count * N as u32;
        let power = |power: usize| self.cells[(first + power as u32 * channel.count) as usize];
        let (mut value, mut slope) = (power(N - 1), [0.0; 4]);
        for below in (0..N - 1).rev() {
            slope = std::array::from_fn(|c| slope[c] * s + value[c]);
            let coefficient = power(below);
            value = std::array::from_fn(|c| value[c] * s + coefficient[c]);
        }
        (value, slope)
    }
}
