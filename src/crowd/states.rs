//! States of a library's clips at any times: rotations, positions and velocities of all joints, for the training of
//! models of motion. The rotations have a crowd's bits. The rest is computed from them with sums and products alone,
//! so that every machine has the same bits. Twin of `shaders/motion/joints.wgsl`,
//! `shaders/motion/walk.wgsl` and `shaders/motion/differences.wgsl`.

use std::ops::Range;

use rayon::prelude::*;

use crate::crowd::channel_curve::constants_of;
use crate::crowd::clip_keys::{KeyRows, keeps_keys};
use crate::crowd::clip_tables::{ClipTables, arcs, runs_of};
use crate::crowd_error::CrowdError;
use crate::engine::Engine;
use crate::math::canonical::canonical;
use crate::math::quaternion::{cross3, dot, product, scaled, sum};
use crate::memory::reserved;
use crate::shader::{
    CHANNELS, CrowdBase, CrowdChannel, CrowdClip, CrowdLink, CrowdPosition, CrowdSpan, FORM_ARC,
    FORM_CONSTANT, FORM_CUBIC, FORM_KEYS, FORM_LINE, FORM_PACKED, FORM_POLYNOMIAL, ON_KEY, POWERS,
    TICKS, TRANSLATION,
};
use crate::simd::dispatch::{InLanes, in_lanes_of};
use crate::simd::lanes::{Lanes, Number};
use crate::threads::stop;
use crate::twin::arc_tangent::{arc_tangent, flushed, reciprocal, root};
use crate::twin::crowd_layers::sampled;
use crate::twin::crowd_times::position_at;
use crate::twin::quaternion::rotated;

/// The number of instances in a task.
pub(super) const TASK: usize = 64;

/// The number of guesses before spans are searched.
const GUESSES: usize = 4;

/// The number of spans around a guess that are compared together.
const NEIGHBOURS: usize = 16;

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
    /// The angular velocity about the world's axes in radians per second: the derivative of the world rotation.
    pub angular_velocities: &'a mut [[f32; 3]],
}

/// The clips of a [`CrowdLibrary`](crate::crowd::library::CrowdLibrary) as plain tables. The two large tables are
/// separate, so that several processes can map them from a file: spans (intervals in ticks) and cells (constants and
/// keys).
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
    pub(super) clips: Vec<CrowdClip>,
    pub(super) bases: Vec<CrowdBase>,
    pub(super) channels: Vec<CrowdChannel>,
    pub(super) links: Vec<CrowdLink>,
    runs: Vec<Vec<Range<u32>>>,
    joints: usize,
    ticks_per_second: u32,
    /// The expected numbers of spans and cells.
    sizes: (usize, usize),
}

/// Tables, with the spans and cells that belong to them.
type SelectedTables = (MotionTables, Vec<[u32; 4]>, Vec<[f32; 4]>);

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
            let is_sound_channel = |(index, channel): (usize, &CrowdChannel)| {
                let index_of_kind = index % CHANNELS as usize;
                let form = channel.form_and_base >> 24;
                let Some(base) = bases.get((channel.form_and_base & 0x00ff_ffff) as usize) else {
                    return false;
                };
                let used = ChannelCells::of(channel, base, spans);
                // Constants of another form would be read beyond their end.
                let is_of_kind = match index_of_kind {
                    0 => matches!(
                        form,
                        FORM_CONSTANT | FORM_ARC | FORM_POLYNOMIAL | FORM_KEYS | FORM_PACKED
                    ),
                    _ => matches!(form, FORM_CONSTANT | FORM_CUBIC | FORM_LINE),
                };
                is_of_kind && used.all().all(|range| range.end <= cells)
            };
            let channels = &self.channels[index * each..][..each];
            clip.bases > 0 && clip.period > 0 && channels.iter().enumerate().all(is_sound_channel)
        };
        each > 0
            && self.ticks_per_second > 0
            && self.channels.len() == self.clips.len() * each
            && self.bases.iter().all(is_sound_base)
            && self.links.iter().all(&mut is_sound_link)
            && self.clips.iter().enumerate().all(is_sound_clip)
    }

    /// Makes tables that have only some of the clips, in this order, with their spans and cells. They give the same
    /// states.
    ///
    /// # Errors
    /// * When a clip does not exist or is listed twice.
    /// * When the spans and cells do not belong to the tables, or no [`MotionBuilder`](crate::crowd::MotionBuilder)
    ///   made the tables.
    /// * When there is not enough memory.
    pub fn select(
        &self,
        (spans, cells): (&[[u32; 4]], &[[f32; 4]]),
        clips: &[usize],
    ) -> Result<SelectedTables, CrowdError> {
        const PURPOSE: &str = "some clips of a motion library";
        self.check_parts((spans, cells))?;
        let all_spans: &[CrowdSpan] = bytemuck::cast_slice(spans);
        let each = self.joints * CHANNELS as usize;
        let bases_of =
            |clip: &CrowdClip| &self.bases[clip.first_base as usize..][..clip.bases as usize];
        let used = |channel: &CrowdChannel, bases: &[CrowdBase]| {
            let base = &bases[(channel.form_and_base & 0x00ff_ffff) as usize];
            ChannelCells::of(channel, base, all_spans)
        };
        // A builder adds one clip after another, so that the spans and cells of a clip lie side by side.
        let mut ranges = Vec::with_capacity(clips.len());
        for &index in clips {
            let clip = self.clips.get(index).ok_or(CrowdError::Missing {
                subject: "clip",
                index,
                count: self.clips.len(),
            })?;
            let (bases, channels) = (bases_of(clip), &self.channels[index * each..][..each]);
            let of_base =
                |base: &CrowdBase| base.first as usize..(base.first + base.count) as usize;
            let of_channels = channels.iter().flat_map(|channel| {
                let cells = used(channel, bases);
                [Some(cells.constants), cells.keys].into_iter().flatten()
            });
            ranges.push((
                index,
                around(bases.iter().map(of_base)),
                around(of_channels),
            ));
        }
        let span_count: usize = ranges.iter().map(|(_, spans, _)| spans.len()).sum();
        let cell_count: usize = ranges.iter().map(|(_, _, cells)| cells.len()).sum();
        // Refuses clips that share cells: selecting them would need more memory than the file has bytes.
        if span_count > spans.len() || cell_count > cells.len() {
            return Err(CrowdError::BrokenTables);
        }
        let mut found_spans = reserved(span_count, PURPOSE)?;
        let mut found_cells = reserved(cell_count + 1, PURPOSE)?;
        found_cells.push([0.0; 4]); // kernels use the first cell as 0
        let mut found = Self {
            clips: Vec::new(),
            bases: Vec::new(),
            channels: Vec::new(),
            links: self.links.clone(),
            runs: Vec::new(),
            joints: self.joints,
            ticks_per_second: self.ticks_per_second,
            sizes: (span_count, cell_count + 1),
        };
        for (index, span_range, cell_range) in ranges {
            let clip = &self.clips[index];
            let bases = bases_of(clip);
            let first_span = found_spans.len();
            let first_cell = found_cells.len();
            let moved = |first: u32, packed: usize| {
                (first as usize + packed * first_cell - packed * cell_range.start) as u32
            };
            found
                .channels
                .extend(self.channels[index * each..][..each].iter().map(|channel| {
                    let packed = match channel.form_and_base >> 24 {
                        FORM_PACKED => 2,
                        _ => 1,
                    };
                    let first = moved(channel.first, packed);
                    CrowdChannel {
                        first,
                        keys: match used(channel, bases).keys {
                            Some(_) => moved(channel.keys, 1),
                            None => first,
                        },
                        ..*channel
                    }
                }));
            found.clips.push(CrowdClip {
                first_base: found.bases.len() as u32,
                ..*clip
            });
            found.bases.extend(bases.iter().map(|base| CrowdBase {
                first: (base.first as usize + first_span - span_range.start) as u32,
                ..*base
            }));
            found.runs.push(self.runs[index].clone());
            found_spans.extend_from_slice(&spans[span_range]);
            found_cells.extend_from_slice(&cells[cell_range]);
        }
        Ok((found, found_spans, found_cells))
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

    /// The parent of each joint; `None` for roots.
    #[must_use]
    pub fn parents(&self) -> Vec<Option<usize>> {
        let mut parents = vec![None; self.joints];
        for link in &self.links {
            parents[link.joint as usize] = Some(link.parent as usize);
        }
        parents
    }

    /// Number of ticks in a second.
    #[must_use]
    pub fn ticks_per_second(&self) -> u32 {
        self.ticks_per_second
    }

    /// The length of a clip in ticks, at least 1; `None` if there is no such clip.
    #[must_use]
    pub fn ticks(&self, clip: usize) -> Option<u32> {
        self.clips.get(clip).map(|clip| clip.period)
    }

    /// Refuses spans and cells that do not belong to the tables.
    pub(super) fn check_parts(
        &self,
        (spans, cells): (&[[u32; 4]], &[[f32; 4]]),
    ) -> Result<(), CrowdError> {
        match (spans.len(), cells.len()) == self.sizes {
            true => Ok(()),
            false => Err(CrowdError::BrokenTables),
        }
    }

    /// Computes the states of instances. `at` has a clip and a tick for each instance; ticks after the clip's end
    /// give its last pose. The spans and cells are those that belong to the tables.
    ///
    /// `engine` provides the threads and the vector width. The host computes for every device; with the feature
    /// `vulkan`, a `DeviceMotions` has the tables on a device, which computes there.
    ///
    /// # Errors
    /// * When a clip does not exist.
    /// * When an array is neither empty nor as long as the instances times the joints.
    /// * When the spans and cells do not belong to the tables.
    /// * When the system refuses threads, or the work is stopped.
    pub fn sample_into(
        &self,
        engine: &Engine,
        parts: (&[[u32; 4]], &[[f32; 4]]),
        at: &[(u32, u32)],
        states: MotionStates<'_>,
    ) -> Result<(), CrowdError> {
        self.states_into(engine, parts, (at, None), states)
    }

    /// As [`MotionTables::sample_into`], with velocities that are differences between two ticks. There is a step for
    /// each instance.
    ///
    /// # Errors
    /// As [`MotionTables::sample_into`], and when there are more or fewer steps than instances.
    pub fn differences_into(
        &self,
        engine: &Engine,
        parts: (&[[u32; 4]], &[[f32; 4]]),
        at: &[(u32, u32)],
        steps: &[FrameStep],
        states: MotionStates<'_>,
    ) -> Result<(), CrowdError> {
        check_steps(steps.len(), at.len())?;
        self.states_into(engine, parts, (at, Some(steps)), states)
    }

    fn states_into(
        &self,
        engine: &Engine,
        (spans, cells): (&[[u32; 4]], &[[f32; 4]]),
        (at, steps): (&[(u32, u32)], Option<&[FrameStep]>),
        states: MotionStates<'_>,
    ) -> Result<(), CrowdError> {
        self.check_parts((spans, cells))?;
        check_clips(self.clips.len(), at)?;
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
        let task = |memory: &mut StateScratch, (first, states): (usize, MotionStates<'_>)| {
            stop::check_of(stop.as_ref())?;
            let instances = first..at.len().min(first + TASK);
            in_lanes_of(
                width,
                &mut StatesTask {
                    tables: self,
                    spans: bytemuck::cast_slice(spans),
                    cells,
                    at: &at[instances.clone()],
                    steps: steps.map(|steps| &steps[instances]),
                    states,
                    memory,
                },
            );
            Ok(())
        };
        if at.len() <= TASK {
            return task(&mut StateScratch::default(), (0, states));
        }
        let mut left = states;
        let tasks: Vec<_> = (0..at.len())
            .step_by(TASK)
            .map(|first| (first, left.split_off(each)))
            .collect();
        let work = || (tasks.into_par_iter()).try_for_each_init(StateScratch::default, task);
        engine.machine.threads().run(work)?
    }
}

/// The cells that a channel reads.
struct ChannelCells {
    constants: Range<usize>,
    /// The keys beside the constants, if it has any.
    keys: Option<Range<usize>>,
}

impl ChannelCells {
    /// Those of a channel with a time base, whose spans exist.
    fn of(channel: &CrowdChannel, base: &CrowdBase, spans: &[CrowdSpan]) -> Self {
        let form = channel.form_and_base >> 24;
        let (first, count) = (channel.first as usize, channel.count as usize);
        let last = (base.count as usize - 1) * count;
        let constants = match form {
            FORM_CONSTANT => first..first + 1,
            FORM_PACKED => first / 2..(first + last) / 2 + 1,
            _ => {
                let constants = constants_of(form);
                first..first + last * constants + (constants - 1) * count + 1
            }
        };
        let base_spans = &spans[base.first as usize..][..base.count as usize];
        let has_keys = form != FORM_CONSTANT
            && !keeps_keys(form)
            && base_spans.iter().any(|span| span.start & ON_KEY != 0);
        let keys = channel.keys as usize;
        Self {
            constants,
            keys: has_keys.then_some(keys..keys + last + 1),
        }
    }

    fn all(&self) -> impl Iterator<Item = &Range<usize>> {
        [&self.constants].into_iter().chain(&self.keys)
    }
}

/// The smallest range with all of these in it.
fn around(ranges: impl Iterator<Item = Range<usize>>) -> Range<usize> {
    let both = |a: Range<usize>, b: Range<usize>| a.start.min(b.start)..a.end.max(b.end);
    ranges.reduce(both).unwrap_or_default()
}

/// Refuses more or fewer steps than instances.
pub(super) fn check_steps(length: usize, needed: usize) -> Result<(), CrowdError> {
    match length == needed {
        true => Ok(()),
        false => Err(CrowdError::OutputLength { length, needed }),
    }
}

/// Refuses instances of clips that do not exist.
pub(super) fn check_clips(count: usize, at: &[(u32, u32)]) -> Result<(), CrowdError> {
    match at.iter().find(|(clip, _)| *clip as usize >= count) {
        None => Ok(()),
        Some(&(clip, _)) => Err(CrowdError::Missing {
            subject: "clip",
            index: clip as usize,
            count,
        }),
    }
}

/// The two ticks between which an instance's velocities are differences, and one divided by the seconds between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameStep {
    /// The ticks of the clip.
    pub ticks: [u32; 2],
    /// Steps of this length in a second.
    pub per_second: f32,
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
    pose: PoseScratch,
    rotations: Vec<[f32; 4]>,
    /// The states of instances, and those at both ends of their steps.
    here: StateRows,
    ends: [StateRows; 2],
    walk: Vec<f32>,
}

/// Scratch memory for one pose.
#[derive(Default)]
pub(super) struct PoseScratch {
    /// The clip of the previous pose, and the positions of its time bases.
    clip: Option<u32>,
    positions: Vec<CrowdPosition>,
    /// The keys at the start and at the end of the span of each joint.
    keys: [Vec<[f32; 4]>; 2],
    /// The middles and tangents of the arcs between these, and the angular velocities along them. Vectors may reach beyond
    /// the last joint.
    arcs: [Vec<[f32; 4]>; 2],
    rates: Vec<[f32; 4]>,
}

impl PoseScratch {
    pub(super) fn resize<L: Lanes>(&mut self, joints: usize) {
        for memory in &mut self.keys {
            memory.resize(joints, [0.0; 4]);
        }
        for memory in self.arcs.iter_mut().chain([&mut self.rates]) {
            memory.resize(joints + L::COUNT, [0.0; 4]);
        }
    }
}

/// The states of as many instances as a vector has lanes, `[joint][instance]`. Positions and velocities end in a 0.
#[derive(Default)]
pub(super) struct StateRows {
    rotations: Vec<[f32; 4]>,
    positions: Vec<[f32; 4]>,
    velocities: Vec<[f32; 4]>,
    angular_velocities: Vec<[f32; 4]>,
}

/// A joint in its parent's frame, or in the world.
#[derive(Clone, Copy)]
pub(super) struct Joint<N> {
    pub(super) rotation: [N; 4],
    pub(super) position: [N; 3],
    pub(super) velocity: [N; 3],
    pub(super) angular_velocity: [N; 3],
}

/// The numbers of a joint's state.
const JOINT_NUMBERS: usize = 13;

impl StateRows {
    pub(super) fn resize(&mut self, count: usize) {
        for rows in [
            &mut self.rotations,
            &mut self.positions,
            &mut self.velocities,
            &mut self.angular_velocities,
        ] {
            rows.resize(count, [0.0; 4]);
        }
    }

    /// Converts the states from the parents' frames to the world. `memory` has room for the numbers of all joints, each as
    /// a vector: as many instances are walked together.
    #[inline(always)]
    fn walk<L: Lanes>(&mut self, links: &[CrowdLink], moves: bool, memory: &mut [f32]) {
        let each = JOINT_NUMBERS * L::COUNT;
        let joints = self.rotations.len() / L::COUNT;
        for (joint, numbers) in memory.chunks_exact_mut(each).take(joints).enumerate() {
            self.joint::<L>(joint, moves).store(numbers);
        }
        for link in links {
            let [parent, child] = [link.parent, link.joint].map(|joint| joint as usize * each);
            let above = Joint::<L>::load(&memory[parent..parent + each]);
            let numbers = &mut memory[child..child + each];
            Joint::load(numbers).hung_on(&above, moves).store(numbers);
        }
        for (joint, numbers) in memory.chunks_exact(each).take(joints).enumerate() {
            self.put::<L>(joint, &Joint::load(numbers), moves);
        }
    }

    #[inline(always)]
    fn joint<L: Lanes>(&self, joint: usize, moves: bool) -> Joint<L> {
        let at = joint * L::COUNT;
        let zero = [L::all(0.0), L::all(0.0), L::all(0.0)];
        let [x, y, z, _] = L::load_rotations(&self.positions[at..]);
        let mut found = Joint {
            rotation: L::load_rotations(&self.rotations[at..]),
            position: [x, y, z],
            velocity: zero,
            angular_velocity: zero,
        };
        if moves {
            let [x, y, z, _] = L::load_rotations(&self.velocities[at..]);
            found.velocity = [x, y, z];
            let [x, y, z, _] = L::load_rotations(&self.angular_velocities[at..]);
            found.angular_velocity = [x, y, z];
        }
        found
    }

    #[inline(always)]
    fn put<L: Lanes>(&mut self, joint: usize, state: &Joint<L>, moves: bool) {
        let at = joint * L::COUNT..(joint + 1) * L::COUNT;
        let zero = L::all(0.0);
        L::store_rotations(state.rotation, &mut self.rotations[at.clone()]);
        let [x, y, z] = state.position;
        L::store_rotations([x, y, z, zero], &mut self.positions[at.clone()]);
        if moves {
            let [x, y, z] = state.velocity;
            L::store_rotations([x, y, z, zero], &mut self.velocities[at.clone()]);
            let [x, y, z] = state.angular_velocity;
            L::store_rotations([x, y, z, zero], &mut self.angular_velocities[at]);
        }
    }

    /// Sets the velocities of an instance to the difference of two states, divided by the time between them,
    /// `1 / per_second`.
    #[inline(always)]
    fn differ(&mut self, at: usize, ends: [&Self; 2], per_second: f32) {
        let [before, after] = ends.map(|end| end.state(at, false));
        let mut state = self.state(at, false);
        state.differ(&before, &after, per_second);
        let ([x, y, z], [a, b, c]) = (state.velocity, state.angular_velocity);
        (self.velocities[at], self.angular_velocities[at]) = ([x, y, z, 0.0], [a, b, c, 0.0]);
    }

    /// One state; its velocities are 0 unless it moves.
    #[inline(always)]
    pub(super) fn state(&self, at: usize, moves: bool) -> Joint<f32> {
        let three = |[x, y, z, _]: [f32; 4]| [x, y, z];
        let velocity = |rows: &[[f32; 4]]| match moves {
            true => three(rows[at]),
            false => [0.0; 3],
        };
        Joint {
            rotation: self.rotations[at],
            position: three(self.positions[at]),
            velocity: velocity(&self.velocities),
            angular_velocity: velocity(&self.angular_velocities),
        }
    }
}

impl<L: Lanes> Joint<L> {
    #[inline(always)]
    fn load(numbers: &[f32]) -> Self {
        #[inline(always)]
        fn number<L: Lanes>(numbers: &[f32], index: usize) -> L {
            L::load_unordered(&numbers[index * L::COUNT..])
        }
        #[inline(always)]
        fn three<L: Lanes>(numbers: &[f32], first: usize) -> [L; 3] {
            [
                number(numbers, first),
                number(numbers, first + 1),
                number(numbers, first + 2),
            ]
        }
        let [x, y, z] = three(numbers, 0);
        Self {
            rotation: [x, y, z, number(numbers, 3)],
            position: three(numbers, 4),
            velocity: three(numbers, 7),
            angular_velocity: three(numbers, 10),
        }
    }

    #[inline(always)]
    fn store(self, numbers: &mut [f32]) {
        let all = [
            &self.rotation[..],
            &self.position,
            &self.velocity,
            &self.angular_velocity,
        ];
        let mut numbers = numbers.chunks_exact_mut(L::COUNT);
        for part in all {
            for (&number, lanes) in part.iter().zip(&mut numbers) {
                number.store_unordered(lanes);
            }
        }
    }
}

impl Joint<f32> {
    /// Sets the velocities to the difference of two states, divided by the time between them, `1 / per_second`.
    #[inline(always)]
    pub(super) fn differ(&mut self, before: &Self, after: &Self, per_second: f32) {
        let [x, y, z] = before.position.map(|coordinate| -coordinate);
        self.velocity = scaled(sum(after.position, [x, y, z]), per_second).map(canonical);
        let [x, y, z, w] = before.rotation;
        let [x, y, z, w] = product(after.rotation, [-x, -y, -z, w]).map(flushed);
        let sine = root(x * x + y * y + z * z);
        // The factor from the vector part of the quaternion to the rotation vector of the shorter arc; 0 if the angle
        // is 0.
        let scale = match sine == 0.0 {
            true => 0.0,
            false => 2.0 * arc_tangent(sine, w.abs()) * reciprocal(sine),
        };
        let scale = if w < 0.0 { -scale } else { scale };
        self.angular_velocity = scaled([x, y, z], scale * per_second).map(canonical);
    }
}

/// [`canonical`] of each number.
#[inline(always)]
fn canonical3<N: Number>([x, y, z]: [N; 3]) -> [N; 3] {
    [x.canonical(), y.canonical(), z.canonical()]
}

impl<N: Number> Joint<N> {
    /// Converts the joint's state from its parent's frame to the world; `parent` is the parent's state in the world.
    #[inline(always)]
    fn hung_on(self, parent: &Self, moves: bool) -> Self {
        let arm = rotated(parent.rotation, self.position);
        let rotation = product(parent.rotation, self.rotation);
        // One step of Newton's method normalises the rotation, so that rounding errors do not add up along the
        // skeleton.
        let scale = N::all(1.5) - N::all(0.5) * dot(rotation, rotation);
        let [x, y, z, w] = rotation;
        let mut found = Self {
            rotation: [
                (x * scale).canonical(),
                (y * scale).canonical(),
                (z * scale).canonical(),
                (w * scale).canonical(),
            ],
            position: canonical3(sum(parent.position, arm)),
            ..self
        };
        if moves {
            let relative = rotated(parent.rotation, self.velocity);
            let carried = sum(parent.velocity, cross3(parent.angular_velocity, arm));
            found.velocity = canonical3(sum(carried, relative));
            let relative = rotated(parent.rotation, self.angular_velocity);
            found.angular_velocity = canonical3(sum(parent.angular_velocity, relative));
        }
        found
    }
}

/// The angular velocities along arcs of neighbouring joints, about the parents' axes: twice the tangent over the middle,
/// times the parameter's rate.
#[inline(always)]
fn rates_of_arcs<L: Lanes>(
    joints: Range<usize>,
    [middles, tangents]: [&[[f32; 4]]; 2],
    rate: f32,
    rates: &mut [[f32; 4]],
) {
    let factor = L::all(2.0 * rate);
    for first in joints.step_by(L::COUNT) {
        let [x, y, z, w] = L::load_rotations(&middles[first..]);
        let slope = L::load_rotations(&tangents[first..]);
        let [x, y, z, _] = product(slope, [-x, -y, -z, w]);
        let [x, y, z] = canonical3(scaled([x, y, z], factor));
        let rates = &mut rates[first..first + L::COUNT];
        L::store_rotations([x, y, z, L::all(0.0)], rates);
    }
}

/// Some instances.
struct StatesTask<'a, 'b> {
    tables: &'a MotionTables,
    spans: &'a [CrowdSpan],
    cells: &'a [[f32; 4]],
    at: &'a [(u32, u32)],
    /// Between which ticks velocities are differences; `None` if they are derivatives.
    steps: Option<&'a [FrameStep]>,
    states: MotionStates<'a>,
    memory: &'b mut StateScratch,
}

/// The values of a pose that are computed.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
pub(super) enum PoseValues {
    /// Rotations in the parents' frames.
    Rotations,
    /// Rotations and positions in the world, too.
    World,
    /// Velocities, too.
    Velocities,
}

impl InLanes for StatesTask<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (tables, joints) = (self.tables, self.tables.joints);
        let states = &mut self.states;
        let moves = !(states.velocities.is_empty() && states.angular_velocities.is_empty());
        let in_world = !(states.positions.is_empty() && states.world_rotations.is_empty());
        let values_of_pose = match (moves && self.steps.is_none(), in_world) {
            (true, _) => PoseValues::Velocities,
            (false, true) => PoseValues::World,
            (false, false) => PoseValues::Rotations,
        };
        let poses = Poses {
            tables,
            spans: self.spans,
            cells: self.cells,
        };
        let StateScratch {
            pose,
            rotations,
            here,
            ends,
            walk,
        } = &mut *self.memory;
        rotations.resize(joints, [0.0; 4]);
        here.resize(joints * L::COUNT);
        if self.steps.is_some() {
            for end in &mut *ends {
                end.resize(joints * L::COUNT);
            }
        }
        walk.resize(joints * JOINT_NUMBERS * L::COUNT, 0.0);
        pose.resize::<L>(joints);
        let is_posed = values_of_pose > PoseValues::Rotations || !states.rotations.is_empty();
        for (group, instances) in self.at.chunks(L::COUNT).enumerate() {
            let first = group * L::COUNT;
            for (lane, &(clip, tick)) in instances.iter().enumerate() {
                let at = (first + lane) * joints..(first + lane + 1) * joints;
                if is_posed {
                    let local = match states.rotations.get_mut(at) {
                        Some(rotations) => rotations,
                        None => &mut rotations[..],
                    };
                    let rows = (&mut *here, lane);
                    poses.compute::<L>((clip, tick), values_of_pose, pose, local, rows);
                }
                if let (Some(steps), true) = (self.steps, moves) {
                    for (end, tick) in ends.iter_mut().zip(steps[first + lane].ticks) {
                        let values = PoseValues::World;
                        poses.compute::<L>((clip, tick), values, pose, rotations, (end, lane));
                    }
                }
            }
            if values_of_pose > PoseValues::Rotations {
                let moves = values_of_pose == PoseValues::Velocities;
                here.walk::<L>(&tables.links, moves, walk);
            }
            if let (Some(steps), true) = (self.steps, moves) {
                for end in &mut *ends {
                    end.walk::<L>(&tables.links, false, walk);
                }
                let [before, after] = &*ends;
                for joint in 0..joints {
                    for (lane, step) in steps[first..][..instances.len()].iter().enumerate() {
                        let at = joint * L::COUNT + lane;
                        here.differ(at, [before, after], step.per_second);
                    }
                }
            }
            for lane in 0..instances.len() {
                let at = (first + lane) * joints..(first + lane + 1) * joints;
                let positions = states.positions.get_mut(at.clone());
                put(
                    positions,
                    &here.positions,
                    (lane, L::COUNT),
                    |[x, y, z, _]| [x, y, z],
                );
                let rotations = states.world_rotations.get_mut(at.clone());
                put(rotations, &here.rotations, (lane, L::COUNT), |row| row);
                let velocities = states.velocities.get_mut(at.clone());
                put(
                    velocities,
                    &here.velocities,
                    (lane, L::COUNT),
                    |[x, y, z, _]| [x, y, z],
                );
                let rates = states.angular_velocities.get_mut(at);
                let of_rates = &here.angular_velocities;
                put(rates, of_rates, (lane, L::COUNT), |[x, y, z, _]| [x, y, z]);
            }
        }
    }
}

/// Stores the values of an instance's joints in an array that is not left out.
#[inline(always)]
fn put<T>(
    array: Option<&mut [T]>,
    rows: &[[f32; 4]],
    (lane, lanes): (usize, usize),
    of: fn([f32; 4]) -> T,
) {
    if let Some(array) = array {
        for (value, row) in array.iter_mut().zip(rows[lane..].iter().step_by(lanes)) {
            *value = of(*row);
        }
    }
}

/// The poses of a library's clips.
#[derive(Clone, Copy)]
pub(super) struct Poses<'a> {
    pub(super) tables: &'a MotionTables,
    pub(super) spans: &'a [CrowdSpan],
    pub(super) cells: &'a [[f32; 4]],
}

impl Poses<'_> {
    /// Computes the pose of a clip at a tick: rotations in the parents' frames to `local`, and all states in the parents'
    /// frames to the rows of a lane.
    #[inline(always)]
    pub(super) fn compute<L: Lanes>(
        &self,
        (clip, tick): (u32, u32),
        values_of_pose: PoseValues,
        scratch: &mut PoseScratch,
        local: &mut [[f32; 4]],
        (rows, lane): (&mut StateRows, usize),
    ) {
        let Self {
            tables,
            spans,
            cells,
        } = *self;
        let clip_entry = &tables.clips[clip as usize];
        let tick = tick.min(clip_entry.period);
        let bases = &tables.bases[clip_entry.first_base as usize..][..clip_entry.bases as usize];
        let positions = &mut scratch.positions;
        if scratch.clip != Some(clip) {
            scratch.clip = Some(clip);
            positions.clear();
            // For the first guess, the keys are taken to be at even times.
            positions.extend(bases.iter().map(|base| CrowdPosition {
                span: spans_in(base, tick.into(), clip_entry.period) as u32,
                parameter: 0.0,
            }));
        }
        // The previous pose was often of the same clip, about a frame earlier or later (in a window, or at the other
        // end of a step), so the search starts at its positions.
        for (base, position) in bases.iter().zip(&mut *positions) {
            let guess = position.span & TICKS;
            *position = guessed_position(base, spans, (tick, clip_entry.period), guess);
        }
        let each = tables.joints * CHANNELS as usize;
        let channels = &tables.channels[clip as usize * each..][..each];
        let moment = ClipMoment {
            bases,
            spans,
            cells,
            positions,
            tick,
            per_second: tables.ticks_per_second as f32,
        };
        let moves = values_of_pose == PoseValues::Velocities;
        for run in &tables.runs[clip as usize] {
            let joints = run.start as usize..run.end as usize;
            let values = &mut local[joints.clone()];
            let channel = &channels[joints.start * CHANNELS as usize];
            if !keeps_keys(channel.form_and_base >> 24) {
                moment.rotations::<L>(channels, run.clone(), values);
                continue;
            }
            let keys = scratch
                .keys
                .each_mut()
                .map(|keys| &mut keys[joints.clone()]);
            let arcs = (scratch.arcs.each_mut()).map(|arcs| &mut arcs[joints.clone()]);
            moment.rotations_of_keys::<L>(channel, moves, keys, arcs, values);
            if moves {
                let (.., rate) = moment.along(channel);
                let [middles, tangents] = &scratch.arcs;
                rates_of_arcs::<L>(joints, [middles, tangents], rate, &mut scratch.rates);
            }
        }
        if values_of_pose == PoseValues::Rotations {
            return;
        }
        for (joint, &rotation) in local.iter().enumerate() {
            let [rotates, moved] = [
                &channels[joint * 3],
                &channels[joint * 3 + TRANSLATION as usize],
            ];
            let row = joint * L::COUNT + lane;
            let [x, y, z, _] = moment.value(moved);
            (rows.rotations[row], rows.positions[row]) = (rotation, [x, y, z, 0.0]);
            if moves {
                rows.angular_velocities[row] = match keeps_keys(rotates.form_and_base >> 24) {
                    true => scratch.rates[joint],
                    false => moment.angular_velocity(rotates),
                };
                rows.velocities[row] = moment.velocity(moved);
            }
        }
    }
}

/// The spans of a time base in so many ticks if keys are at even times, rounded towards 0.
#[inline(always)]
fn spans_in(base: &CrowdBase, ticks: i64, period: u32) -> i64 {
    let count = i64::from(base.count);
    (ticks * (count - 1) / i64::from(period).max(1)).min(count - 1)
}

/// The position of a tick in a time base, as [`position_at`] computes it. Most keys are at even times, or intervals are
/// divided about evenly. Therefore a guessed span is tried first, then its neighbours, and then those to which the distance
/// from it points. A search from the ends would wait for memory at each step.
#[inline(always)]
fn guessed_position(
    base: &CrowdBase,
    spans: &[CrowdSpan],
    (tick, period): (u32, u32),
    guess: u32,
) -> CrowdPosition {
    let count = base.count as usize;
    let base_spans = &spans[base.first as usize..][..count];
    let start = |index: usize| base_spans[index].start & TICKS;
    let mut index = (guess as usize).min(count - 1);
    let is_before_next = index + 1 == count || tick < start(index + 1);
    if start(index) <= tick && is_before_next {
        return position_in(base, spans, tick, index);
    }
    for _ in 0..GUESSES {
        let first = (index.saturating_sub(NEIGHBOURS / 2)).min(count.saturating_sub(NEIGHBOURS));
        let neighbours = &base_spans[first..count.min(first + NEIGHBOURS)];
        // All starts are compared without branches, because the processor could not predict these.
        let is_begun = |span: &CrowdSpan| usize::from(span.start & TICKS <= tick);
        let begun: usize = neighbours.iter().map(is_begun).sum();
        let is_found = begun > 0 && (begun < neighbours.len() || first + begun == count);
        if is_found {
            return position_in(base, spans, tick, first + begun - 1);
        }
        let at = i64::from(tick) - i64::from(start(index));
        let moved = index as i64 + spans_in(base, at, period);
        index = moved.clamp(0, count as i64 - 1) as usize;
    }
    position_at(base, spans, tick)
}

/// The position of a tick in a span of a time base.
#[inline(always)]
fn position_in(base: &CrowdBase, spans: &[CrowdSpan], tick: u32, index: usize) -> CrowdPosition {
    let only = CrowdBase {
        first: base.first + index as u32,
        count: 1,
        step: 0,
    };
    let position = position_at(&only, spans, tick);
    let span = position.span + index as u32;
    CrowdPosition { span, ..position }
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
    /// The rotations of neighbouring joints, as in a crowd with one layer.
    #[inline(always)]
    fn rotations<L: Lanes>(
        &self,
        channels: &[CrowdChannel],
        run: Range<u32>,
        values: &mut [[f32; 4]],
    ) {
        let of = |joint: u32| &channels[(joint * CHANNELS) as usize];
        let channel = of(run.start);
        let stands = self.positions[(channel.form_and_base & 0x00ff_ffff) as usize];
        if channel.form_and_base >> 24 == FORM_ARC && stands.span & ON_KEY == 0 {
            let middle = (channel.first + stands.span * channel.count * 2) as usize;
            let tangent = middle + channel.count as usize;
            let cells = |first: usize| &self.cells[first..first + values.len()];
            arcs::<L>(cells(middle), cells(tangent), stands.parameter, values);
            return;
        }
        for (joint, value) in run.zip(values) {
            *value = sampled(self.cells, of(joint), stands);
        }
    }

    /// The rotations of neighbouring joints whose channels have keys, from `channel` on. If the joints move, `arcs`
    /// are those along which they do.
    #[inline(always)]
    fn rotations_of_keys<L: Lanes>(
        &self,
        channel: &CrowdChannel,
        moves: bool,
        [starts, ends]: [&mut [[f32; 4]]; 2],
        [middles, tangents]: [&mut [[f32; 4]]; 2],
        values: &mut [[f32; 4]],
    ) {
        let base = (channel.form_and_base & 0x00ff_ffff) as usize;
        let stands = self.positions[base];
        let is_on_key = stands.span & ON_KEY != 0;
        let rows = KeyRows::new(self.cells, channel, self.bases[base].count as usize);
        let span = stands.span & TICKS;
        let (along, ..) = self.along(channel);
        if moves || !is_on_key {
            let arcs = [&mut *middles, &mut *tangents];
            rows.arcs::<L>(along, [starts, ends], arcs);
        }
        if is_on_key || along != span {
            rows.copy(span, values);
        } else {
            arcs::<L>(middles, tangents, stands.parameter, values);
        }
    }

    /// A translation.
    #[inline(always)]
    fn value(&self, channel: &CrowdChannel) -> [f32; 4] {
        let base = (channel.form_and_base & 0x00ff_ffff) as usize;
        let position = self.positions[base];
        if channel.form_and_base >> 24 != FORM_LINE {
            return sampled(self.cells, channel, position);
        }
        let rows = KeyRows::new(self.cells, channel, self.bases[base].count as usize);
        let span = position.span & TICKS;
        if position.span & ON_KEY != 0 {
            let mut key = [[0.0; 4]];
            rows.copy(span, &mut key);
            return key[0];
        }
        rows.point(span, position.parameter)
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

    /// The angular velocity of a rotation whose channel has constants, about the parent's axes.
    #[inline(always)]
    fn angular_velocity(&self, channel: &CrowdChannel) -> [f32; 4] {
        let form = channel.form_and_base >> 24;
        if form == FORM_CONSTANT {
            return [0.0; 4];
        }
        let (span, s, rate) = self.along(channel);
        let (rotation, slope) = match form {
            // The angular velocity of an arc is the same everywhere.
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
        let [x, y, z] = scaled([x, y, z], 2.0 * rate).map(canonical);
        [x, y, z, 0.0]
    }

    /// The derivative of a translation, in the parent's frame.
    #[inline(always)]
    fn velocity(&self, channel: &CrowdChannel) -> [f32; 4] {
        if channel.form_and_base >> 24 == FORM_CONSTANT {
            return [0.0; 4];
        }
        let (span, s, rate) = self.along(channel);
        let (_, [x, y, z, _]) = match channel.form_and_base >> 24 {
            FORM_CUBIC => self.polynomial::<4>(channel, span, s),
            FORM_LINE => {
                let base = (channel.form_and_base & 0x00ff_ffff) as usize;
                let rows = KeyRows::new(self.cells, channel, self.bases[base].count as usize);
                let [middle, rise] = rows.line(span);
                (middle, rise)
            }
            _ => self.polynomial::<POWERS>(channel, span, s),
        };
        let [x, y, z] = scaled([x, y, z], rate).map(canonical);
        [x, y, z, 0.0]
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
