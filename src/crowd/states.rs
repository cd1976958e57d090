//! States of a library's clips at any times: rotations, positions and velocities of all joints, for the training of
//! models of motion. The rotations have a crowd's bits. The rest is computed from them with sums and products alone,
//! so that every machine has the same bits. Twin of `shaders/motion/joints.wgsl`,
//! `shaders/motion/walk.wgsl` and `shaders/motion/differences.wgsl`.

pub(super) mod lanes;

use std::ops::Range;

use rayon::prelude::*;

use crate::crowd::channel_curve::constants_of;
use crate::crowd::clip_keys::{KeyRows, keeps_keys};
use crate::crowd::clip_tables::{ClipTables, runs_of};
use crate::crowd::states::lanes::{InstanceGroup, put_differences, put_states, walk};
use crate::crowd_error::CrowdError;
use crate::engine::Engine;
use crate::math::canonical::canonical;
use crate::math::quaternion::{cross3, dot, product, scaled, sum};
use crate::memory::reserved;
use crate::shader::{
    ArcSegment, CHANNELS, CrowdBase, CrowdChannel, CrowdClip, CrowdLink, CrowdPosition, CrowdSpan,
    FORM_ARC, FORM_CONSTANT, FORM_CUBIC, FORM_KEYS, FORM_LINE, FORM_PACKED, FORM_POLYNOMIAL,
    ON_KEY, POWERS, TICKS, TRANSLATION,
};
use crate::simd::cache_line::request;
use crate::simd::dispatch::{InLanes, in_lanes_of};
use crate::simd::lanes::{Choice, Lanes, MAX_LANES, Number};
use crate::threads::stop;
use crate::twin::Evaluate as _;
use crate::twin::arc_tangent::{acute_angle, flushed, reciprocal, root};
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

/// Where the instances of a group are at one end of their steps.
#[inline(always)]
pub(super) fn ends_of_steps(
    instances: &[(u32, u32)],
    steps: &[FrameStep],
    side: usize,
) -> [(u32, u32); MAX_LANES] {
    let mut at = [(0, 0); MAX_LANES];
    for (at, (&(clip, _), step)) in at.iter_mut().zip(instances.iter().zip(steps)) {
        *at = (clip, step.ticks[side]);
    }
    at
}

/// How many steps of each instance of a group are in a second.
#[inline(always)]
pub(super) fn steps_per_second(steps: &[FrameStep]) -> [f32; MAX_LANES] {
    let mut per_second = [0.0; MAX_LANES];
    for (per_second, step) in per_second.iter_mut().zip(steps) {
        *per_second = step.per_second;
    }
    per_second
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
    /// The numbers of the states of a group of instances.
    numbers: Vec<f32>,
    /// Those at both ends of their steps.
    ends: [Vec<f32>; 2],
}

/// Scratch memory for poses.
#[derive(Default)]
pub(super) struct PoseScratch {
    /// Where the ticks of the poses are, and where those of the poses before were.
    pub(super) located: LocatedTicks,
    before: LocatedTicks,
}

/// Where ticks are in the time bases of their clips.
#[derive(Default)]
pub(super) struct LocatedTicks {
    clips: Vec<u32>,
    /// The first position of each tick.
    firsts: Vec<usize>,
    positions: Vec<BasePosition>,
}

impl LocatedTicks {
    fn clear(&mut self) {
        self.clips.clear();
        self.firsts.clear();
        self.positions.clear();
    }

    /// The positions of a tick in the time bases of its clip.
    #[inline(always)]
    pub(super) fn of(&self, index: usize) -> &[BasePosition] {
        let end = self.firsts.get(index + 1).copied();
        &self.positions[self.firsts[index]..end.unwrap_or(self.positions.len())]
    }

    /// The positions of a tick of this clip that is probably near, of the poses before: the last one, which is the one
    /// before in a window, or the one with this index, which is at the other end of a step.
    #[inline(always)]
    fn near(&self, clip: u32, index: usize) -> Option<&[BasePosition]> {
        if index == 0 && self.clips.last() == Some(&clip) {
            return Some(self.of(self.clips.len() - 1));
        }
        (self.clips.get(index) == Some(&clip)).then(|| self.of(index))
    }
}

/// Where a tick is in a time base.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BasePosition {
    /// Its span, marked if the tick is that of the span's key.
    pub(super) span: u32,
    /// The span along which poses move there: at the last key the one that ends there.
    pub(super) along: u32,
    /// The parameters in the two spans.
    pub(super) parameter: f32,
    pub(super) parameter_along: f32,
    /// The rate of the second one, per second.
    pub(super) rate: f32,
}

impl BasePosition {
    fn stands(self) -> CrowdPosition {
        CrowdPosition {
            span: self.span,
            parameter: self.parameter,
        }
    }
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
pub(super) const JOINT_NUMBERS: usize = 13;

impl<L: Lanes> Joint<L> {
    #[inline(always)]
    pub(super) fn load(numbers: &[f32]) -> Self {
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
    pub(super) fn store(self, numbers: &mut [f32]) {
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

impl<N: Choice> Joint<N> {
    /// Sets the velocities to the difference of two states, divided by the time between them, `1 / per_second`.
    #[inline(always)]
    pub(super) fn differ(&mut self, before: &Self, after: &Self, per_second: N) {
        let [x, y, z] = before.position;
        let moved = sum(after.position, [-x, -y, -z]);
        self.velocity = canonical3(scaled(moved, per_second));
        let [x, y, z, w] = before.rotation;
        let [x, y, z, w] = product(after.rotation, [-x, -y, -z, w]);
        let [x, y, z, w] = [flushed(x), flushed(y), flushed(z), flushed(w)];
        let zero = N::all(0.0);
        let sine = root(x * x + y * y + z * z);
        let is_long = !zero.at_most(w);
        let cosine = N::choose(is_long, -w, w);
        // The shorter arc, by the rotation vector's length; 0 if the angle is.
        let scale = N::all(2.0) * acute_angle(sine, cosine) * reciprocal(sine);
        let scale = N::choose(sine.equals(zero), zero, scale);
        let scale = N::choose(is_long, -scale, scale);
        self.angular_velocity = canonical3(scaled([x, y, z], scale * per_second));
    }
}

/// [`canonical`] of each number.
#[inline(always)]
pub(super) fn canonical3<N: Number>([x, y, z]: [N; 3]) -> [N; 3] {
    [x.canonical(), y.canonical(), z.canonical()]
}

impl<N: Number> Joint<N> {
    /// Converts the joint's state from its parent's frame to the world; `parent` is the parent's state in the world.
    #[inline(always)]
    pub(super) fn hung_on(self, parent: &Self, moves: bool) -> Self {
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
        let values = match (moves && self.steps.is_none(), in_world) {
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
            numbers,
            ends,
        } = &mut *self.memory;
        numbers.resize(joints * JOINT_NUMBERS * L::COUNT, 0.0);
        let steps = self.steps.filter(|_| moves);
        let is_posed = values > PoseValues::Rotations || !states.rotations.is_empty();
        for (group, instances) in self.at.chunks(L::COUNT).enumerate() {
            let mut outputs = states.split_off(instances.len() * joints);
            if is_posed {
                poses.locate(instances, pose);
                let group = InstanceGroup {
                    poses,
                    at: instances,
                    located: &pose.located,
                };
                group.pose::<L>(values, outputs.rotations, numbers);
                if values > PoseValues::Rotations {
                    walk::<L>(&tables.links, values, numbers);
                    put_states::<L>(values, joints, numbers, &mut outputs);
                }
            }
            let Some(steps) = steps else { continue };
            let steps = &steps[group * L::COUNT..][..instances.len()];
            for (side, end) in ends.iter_mut().enumerate() {
                let at = ends_of_steps(instances, steps, side);
                let at = &at[..instances.len()];
                poses.locate(at, pose);
                let group = InstanceGroup {
                    poses,
                    at,
                    located: &pose.located,
                };
                end.resize(numbers.len(), 0.0);
                group.pose::<L>(PoseValues::World, &mut [], end);
                walk::<L>(&tables.links, PoseValues::World, end);
            }
            put_differences::<L>(&steps_per_second(steps), joints, ends, &mut outputs);
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

impl<'a> Poses<'a> {
    /// The time bases of a clip.
    #[inline(always)]
    pub(super) fn bases(&self, clip: u32) -> &'a [CrowdBase] {
        let clip = &self.tables.clips[clip as usize];
        &self.tables.bases[clip.first_base as usize..][..clip.bases as usize]
    }

    /// The channels of a clip.
    #[inline(always)]
    pub(super) fn channels(&self, clip: u32) -> &'a [CrowdChannel] {
        let each = self.tables.joints * CHANNELS as usize;
        &self.tables.channels[clip as usize * each..][..each]
    }

    /// Finds where ticks are in the time bases of their clips. What is read of the tables is requested for all of them before
    /// the first is used, because each wait for memory takes longer than a pose.
    #[inline(always)]
    pub(super) fn locate(&self, at: &[(u32, u32)], scratch: &mut PoseScratch) {
        let PoseScratch {
            located, before, ..
        } = scratch;
        std::mem::swap(located, before);
        located.clear();
        let has_several = at.len() > 1;
        for (index, &(clip, tick)) in at.iter().enumerate() {
            located.clips.push(clip);
            located.firsts.push(located.positions.len());
            let period = self.tables.clips[clip as usize].period;
            let is_like_previous = index > 0 && at[index - 1].0 == clip;
            let near = before.near(clip, index);
            for (base, of_base) in self.bases(clip).iter().enumerate() {
                let span = match near {
                    _ if is_like_previous => 0,
                    Some(near) => near[base].span & TICKS,
                    // As if keys were at even times.
                    None => spans_in(of_base, tick.min(period).into(), period) as u32,
                };
                let guess = BasePosition {
                    span,
                    ..BasePosition::default()
                };
                located.positions.push(guess);
                if has_several && !is_like_previous {
                    let base_spans =
                        &self.spans[of_base.first as usize..][..of_base.count as usize];
                    let (first, end) = neighbours(span as usize, base_spans.len());
                    request(&base_spans[first..end]);
                }
            }
            if has_several {
                request(self.channels(clip));
            }
        }
        for (index, &(clip, tick)) in at.iter().enumerate() {
            let period = self.tables.clips[clip as usize].period;
            let first = located.firsts[index];
            let is_like_previous = index > 0 && at[index - 1].0 == clip;
            let guesses = match is_like_previous {
                true => located.firsts[index - 1],
                false => first,
            };
            for (base, of_base) in self.bases(clip).iter().enumerate() {
                let guess = located.positions[guesses + base].span & TICKS;
                located.positions[first + base] =
                    self.position(of_base, (tick.min(period), period), guess);
            }
            if has_several {
                self.request_cells(clip, &located.positions[first..]);
            }
        }
    }

    /// Where a tick is in a time base.
    #[inline(always)]
    fn position(&self, base: &CrowdBase, (tick, period): (u32, u32), guess: u32) -> BasePosition {
        let stands = guessed_position(base, self.spans, (tick, period), guess);
        let mut along = stands.span & TICKS;
        let mut span = &self.spans[(base.first + along) as usize];
        let mut parameter_along = stands.parameter;
        let is_end = span.scale == 0.0 && span.start & TICKS == tick;
        if is_end && along > 0 {
            along -= 1;
            span = &self.spans[(base.first + along) as usize];
            let distance = (tick as i32).wrapping_sub(span.whole) as f32;
            parameter_along = distance * span.scale + span.offset;
        }
        BasePosition {
            span: stands.span,
            along,
            parameter: stands.parameter,
            parameter_along,
            rate: span.scale * self.tables.ticks_per_second as f32,
        }
    }

    /// Requests the cells that a pose of a clip reads at these positions.
    #[inline(always)]
    fn request_cells(&self, clip: u32, positions: &[BasePosition]) {
        let channels = self.channels(clip);
        let request_of = |channel: &CrowdChannel, count: usize| {
            let base = (channel.form_and_base & 0x00ff_ffff) as usize;
            let (first, span) = (channel.first as usize, positions[base].along as usize);
            let form = channel.form_and_base >> 24;
            let row = match form {
                FORM_CONSTANT => 0,
                _ => channel.count as usize,
            };
            let cells = match form {
                FORM_CONSTANT => first..first + 1,
                FORM_PACKED => {
                    let first = first + span * row;
                    first / 2..(first + row + count) / 2 + 1
                }
                _ if keeps_keys(form) => first + span * row..first + (span + 1) * row + count,
                _ => {
                    let constants = constants_of(form);
                    let first = first + span * row * constants;
                    first..first + row * (constants - 1) + count
                }
            };
            request(self.cells.get(cells).unwrap_or_default());
        };
        for run in &self.tables.runs[clip as usize] {
            request_of(&channels[(run.start * CHANNELS) as usize], run.len());
        }
        for channel in channels
            .iter()
            .skip(TRANSLATION as usize)
            .step_by(CHANNELS as usize)
        {
            request_of(channel, 1);
        }
    }
}

/// The spans of a time base in so many ticks if keys are at even times, rounded towards 0.
#[inline(always)]
fn spans_in(base: &CrowdBase, ticks: i64, period: u32) -> i64 {
    let count = i64::from(base.count);
    (ticks * (count - 1) / i64::from(period).max(1)).min(count - 1)
}

/// The spans around one that are compared together: the first, and the one behind the last.
#[inline(always)]
fn neighbours(index: usize, count: usize) -> (usize, usize) {
    let first = (index.saturating_sub(NEIGHBOURS / 2)).min(count.saturating_sub(NEIGHBOURS));
    (first, count.min(first + NEIGHBOURS))
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
        let (first, end) = neighbours(index, count);
        let neighbours = &base_spans[first..end];
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
#[derive(Clone, Copy, Default)]
pub(super) struct ClipMoment<'a> {
    pub(super) bases: &'a [CrowdBase],
    pub(super) cells: &'a [[f32; 4]],
    pub(super) positions: &'a [BasePosition],
}

impl ClipMoment<'_> {
    /// Where the moment is in the time base of a channel.
    #[inline(always)]
    pub(super) fn position(&self, channel: &CrowdChannel) -> BasePosition {
        self.positions[(channel.form_and_base & 0x00ff_ffff) as usize]
    }

    /// The rows of a channel that consists of keys.
    #[inline(always)]
    pub(super) fn rows(&self, channel: &CrowdChannel) -> KeyRows<'_> {
        let base = (channel.form_and_base & 0x00ff_ffff) as usize;
        KeyRows::new(self.cells, channel, self.bases[base].count as usize)
    }

    /// A rotation.
    #[inline(always)]
    pub(super) fn rotation(&self, channel: &CrowdChannel) -> [f32; 4] {
        let position = self.position(channel);
        if !keeps_keys(channel.form_and_base >> 24) {
            return sampled(self.cells, channel, position.stands());
        }
        let (span, along) = (position.span & TICKS, position.along);
        if position.span & ON_KEY != 0 || along != span {
            let mut key = [[0.0; 4]];
            self.rows(channel).copy(span, &mut key);
            return key[0];
        }
        let [middle, tangent] = self.rows(channel).arc(span);
        let arc = ArcSegment { middle, tangent };
        arc.at(position.parameter).to_array().map(canonical)
    }

    /// A translation.
    #[inline(always)]
    pub(super) fn value(&self, channel: &CrowdChannel) -> [f32; 4] {
        let position = self.position(channel);
        if channel.form_and_base >> 24 != FORM_LINE {
            return sampled(self.cells, channel, position.stands());
        }
        let rows = self.rows(channel);
        let span = position.span & TICKS;
        if position.span & ON_KEY != 0 {
            let mut key = [[0.0; 4]];
            rows.copy(span, &mut key);
            return key[0];
        }
        rows.point(span, position.parameter)
    }

    /// The angular velocity of a rotation about the parent's axes.
    #[inline(always)]
    pub(super) fn angular_velocity(&self, channel: &CrowdChannel) -> [f32; 4] {
        let form = channel.form_and_base >> 24;
        if form == FORM_CONSTANT {
            return [0.0; 4];
        }
        let BasePosition {
            along: span,
            parameter_along: s,
            rate,
            ..
        } = self.position(channel);
        let (rotation, slope) = match form {
            FORM_KEYS | FORM_PACKED => {
                let [middle, tangent] = self.rows(channel).arc(span);
                (middle, tangent)
            }
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
    pub(super) fn velocity(&self, channel: &CrowdChannel) -> [f32; 4] {
        if channel.form_and_base >> 24 == FORM_CONSTANT {
            return [0.0; 4];
        }
        let BasePosition {
            along: span,
            parameter_along: s,
            rate,
            ..
        } = self.position(channel);
        let (_, [x, y, z, _]) = match channel.form_and_base >> 24 {
            FORM_CUBIC => self.polynomial::<4>(channel, span, s),
            FORM_LINE => {
                let [middle, rise] = self.rows(channel).line(span);
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
