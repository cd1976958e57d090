//! Counts the lines of memory that the waves of a card touch, and the statements that they execute. Cards run 32 or 64
//! invocations together, and move memory in lines: sectors of 32 bytes on NVIDIA's cards, lines of 64 or 128 bytes on
//! AMD's. A wave executes a branch if any of its invocations takes it. The tests run the kernels for cards, as Rust,
//! over the work lists of small workloads like those of `tumble bench`. No device is needed, because only addresses and
//! branches count, and these follow from the shaders. The results must be the CPU's.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::panic::resume_unwind;
use std::rc::Rc;

use fastrand::Rng;
use glam::{DQuat, DVec3, Quat};

use crate::from_keys::KeyCurve;
use crate::gpu::physical::shapes::run_lanes;
use crate::method::Method;
use crate::method::bessel_overhauser::BESSEL_OVERHAUSER;
use crate::method::interpolation::Interpolation;
use crate::method::slerp::SLERP;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::clip_data::{ClipData, PrepareRequest};
use crate::prepare::preparation::SetRequest;
use crate::shader::{FROM_KEYS_WORKGROUP, Form, Kernel, KeySample, List, Store, TangentWeights};
use crate::time::error::SampleTimesError;
use crate::time::frames::{SampleTimes, Timeline};
use crate::tracks::set::TrackSet;
use crate::twin::entries::Global;
use crate::twin::machine::{Memory, UNTOUCHED, Watch};
use crate::work::lists::keys::KeyJob;
use crate::work::lists::{ListRequest, ListRoom, Lister, Stored};
use crate::work::recording::{Recording, Step};
use crate::{Device, Engine};

use super::numbers::{Kind, Number, is_planted, is_touched};

/// Workgroups of a dispatch that are run, of all that it has.
const WORKGROUPS: u32 = 60;

/// The number of invocations that a card runs together, and of bytes that it moves together.
pub(super) const CARDS: [(u32, u64); 6] =
    [(32, 32), (32, 64), (32, 128), (64, 32), (64, 64), (64, 128)];

/// A load or a store of an invocation.
pub(super) struct Touch {
    global: Global,
    words: Range<usize>,
    is_store: bool,
    /// The blocks around it: invocations that run together take it together where they are the same.
    path: u64,
}

impl Touch {
    fn bytes(&self) -> Range<u64> {
        4 * self.words.start as u64..4 * self.words.end as u64
    }
}

/// The blocks of statements that an invocation entered. A path stands for a block, in a call, in an iteration of a
/// loop, and so on up to the entry point.
#[derive(Default)]
struct Blocks {
    path: Cell<u64>,
    /// How often each line of the file was entered from each path.
    entered: RefCell<BTreeMap<(u64, u32), u64>>,
    /// The operations of each path.
    steps: RefCell<BTreeMap<u64, u64>>,
}

/// The accesses to memory and the operations of an invocation.
#[derive(Default)]
pub(super) struct Seen {
    touches: RefCell<Vec<Touch>>,
    blocks: Rc<Blocks>,
}

/// Leaves the block when it is dropped.
pub(super) struct Left(Rc<Blocks>, u64);

impl Drop for Left {
    fn drop(&mut self) {
        self.0.path.set(self.1);
    }
}

impl Seen {
    fn block(&self, line: u32, steps: usize) -> Left {
        let before = self.blocks.path.get();
        let mut entered = self.blocks.entered.borrow_mut();
        let times = entered.entry((before, line)).or_default();
        *times += 1;
        // FNV's step for each number.
        let path = [before, line.into(), *times]
            .iter()
            .fold(0xcbf2_9ce4_8422_2325, |hash, n| {
                (hash ^ n).wrapping_mul(0x0100_0000_01b3).rotate_left(23)
            });
        self.blocks.steps.borrow_mut().insert(path, steps as u64);
        self.blocks.path.set(path);
        Left(Rc::clone(&self.blocks), before)
    }
}

/// An invocation whose loads, stores and blocks are counted, or one that ends where a mistake leads it astray.
pub(super) enum Lane {
    Counted(Seen),
    /// By its number in the workgroup; with the number of blocks that it entered.
    Guarded(u32, Cell<usize>),
}

/// No invocation of a trial has buffers of more words, or enters more blocks.
const MAX_WORDS: usize = 1 << 20;
const MAX_BLOCKS: usize = 1 << 14;

fn stop_if(is_astray: bool) {
    if is_astray {
        resume_unwind(Box::new("astray"));
    }
}

impl Lane {
    pub(super) fn counted(_: u32) -> Self {
        Self::Counted(Seen::default())
    }

    fn seen(self) -> Option<Seen> {
        match self {
            Self::Counted(seen) => Some(seen),
            Self::Guarded(..) => None,
        }
    }

    pub(super) fn guarded(invocation: u32) -> Self {
        Self::Guarded(invocation, Cell::new(0))
    }
}

impl Watch for Lane {
    type Block = Option<Left>;

    #[track_caller]
    fn location(&self, at: usize, words: usize) -> usize {
        if is_planted(Kind::Address) {
            at + words
        } else {
            at
        }
    }

    fn touch(&self, global: Global, words: Range<usize>, is_store: bool) {
        match self {
            Self::Guarded(invocation, _) => {
                stop_if(words.end > MAX_WORDS);
                is_touched(*invocation, &words);
            }
            Self::Counted(seen) => seen.touches.borrow_mut().push(Touch {
                global,
                words,
                is_store,
                path: seen.blocks.path.get(),
            }),
        }
    }

    fn block(&self, line: u32, steps: usize) -> Option<Left> {
        match self {
            Self::Guarded(_, blocks) => {
                blocks.set(blocks.get() + 1);
                stop_if(blocks.get() > MAX_BLOCKS);
                None
            }
            Self::Counted(seen) => Some(seen.block(line, steps)),
        }
    }
}

/// A dispatch: its kernel, and its inputs.
struct Launch {
    kernel: Kernel,
    groups: [u32; 3],
    inputs: Vec<Vec<u8>>,
    arguments: Vec<u8>,
}

fn bytes<T: bytemuck::NoUninit>(values: &[T]) -> Vec<u8> {
    bytemuck::cast_slice(values).to_vec()
}

/// The lines that waves touched, and the smallest possible number.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Lines {
    touched: u64,
    least: u64,
}

impl Lines {
    pub(super) fn ratio(self) -> f64 {
        self.touched as f64 / self.least.max(1) as f64
    }

    fn add(&mut self, more: Self) {
        self.touched += more.touched;
        self.least += more.least;
    }
}

/// The lines of ranges of bytes.
fn touched(ranges: &[Range<u64>], line: u64) -> u64 {
    let lines = ranges
        .iter()
        .flat_map(|range| range.start / line..range.end.div_ceil(line));
    lines.collect::<BTreeSet<_>>().len() as u64
}

/// The lines that a store of all lanes of a wave touches, and the fewest possible: those of the bytes side by side.
fn store(ranges: &[Range<u64>], line: u64) -> Lines {
    let bytes: u64 = ranges.iter().map(|range| range.end - range.start).sum();
    Lines {
        touched: touched(ranges, line),
        least: bytes.div_ceil(line),
    }
}

/// The lines that a workgroup reads of a buffer, and the fewest possible: those of each stretch of bytes if it
/// began where a line does. Bytes that are less than a line apart are one stretch. A line counts once, since the
/// waves of a workgroup share a cache.
fn load(ranges: &mut [Range<u64>], line: u64) -> Lines {
    ranges.sort_by_key(|range| range.start);
    let (mut least, mut stretch) = (0, 0..0);
    for range in &*ranges {
        if range.start >= stretch.end + line || stretch.is_empty() {
            least += (stretch.end - stretch.start).div_ceil(line);
            stretch = range.clone();
        }
        stretch.end = stretch.end.max(range.end);
    }
    least += (stretch.end - stretch.start).div_ceil(line);
    Lines {
        touched: touched(ranges, line),
        least,
    }
}

/// The lines, bytes and operations of the waves of some workgroups, for each kind of card.
#[derive(Default)]
pub(super) struct Count {
    /// Stores and loads.
    pub(super) of_cards: [[Lines; 2]; CARDS.len()],
    /// Words stored.
    pub(super) words: u64,
    /// Bytes that lanes loaded.
    loaded: u64,
    /// Lines of 64 bytes that workgroups loaded.
    of_workgroups: Lines,
    /// Operations of waves of 32 lanes, and of their lanes.
    pub(super) steps: [u64; 2],
}

impl Count {
    /// Runs a workgroup, and counts what it does in buffers.
    pub(super) fn add(&mut self, memory: &Memory, group: [u32; 3], groups: [u32; 3]) {
        let lanes = memory.run_group::<Number, Lane>(group, groups, Lane::counted);
        let lanes = &Vec::from_iter(lanes.into_iter().filter_map(Lane::seen));
        for lane in lanes {
            let is_buffer = |touch: &Touch| memory.is_buffer(touch.global);
            lane.touches.borrow_mut().retain(is_buffer);
            for touch in &*lane.touches.borrow() {
                match touch.is_store {
                    true => self.words += touch.words.len() as u64,
                    false => self.loaded += 4 * touch.words.len() as u64,
                }
            }
        }
        self.of_workgroups.add(loads_of(lanes, 64));
        for ((wave, line), lines) in CARDS.into_iter().zip(&mut self.of_cards) {
            for wave in lanes.chunks(wave as usize) {
                lines[0].add(stores_of(wave, line));
            }
            lines[1].add(loads_of(lanes, line));
        }
        for wave in lanes.chunks(32) {
            let mut together = BTreeMap::new();
            for lane in wave {
                let steps = lane.blocks.steps.borrow();
                self.steps[1] += steps.values().sum::<u64>();
                together.extend(steps.iter().map(|(path, block)| (*path, *block)));
            }
            self.steps[0] += together.values().sum::<u64>();
        }
    }
}

impl Launch {
    fn memory(&self) -> Memory {
        let inputs = self.inputs.iter().map(Vec::as_slice);
        Memory::new(self.kernel, inputs, &self.arguments, Vec::new())
    }

    /// The rotations that it stores.
    fn rotations(&self) -> Vec<[u32; 4]> {
        let memory = self.memory();
        memory.run::<f32, ()>(self.groups, |_| ());
        bytemuck::pod_collect_to_vec(&memory.into_output())
    }

    fn run(&self) -> Count {
        let memory = self.memory();
        let [x, y, z] = self.groups;
        let all = x * y * z;
        let mut count = Count::default();
        for number in (0..all).step_by((all / WORKGROUPS).max(1) as usize) {
            let group = [number % x, number / x % y, number / (x * y)];
            count.add(&memory, group, self.groups);
        }
        assert!(count.words > 400, "{:?}: {}", self.kernel, count.words);
        count
    }
}

/// The nth stores of all lanes in one block go together.
fn stores_of(wave: &[Seen], line: u64) -> Lines {
    let mut together = BTreeMap::<(u64, usize), Vec<Range<u64>>>::new();
    for lane in wave {
        let mut stores = BTreeMap::<u64, usize>::new();
        for touch in lane.touches.borrow().iter().filter(|touch| touch.is_store) {
            let nth = stores.entry(touch.path).or_default();
            together
                .entry((touch.path, *nth))
                .or_default()
                .push(touch.bytes());
            *nth += 1;
        }
    }
    let mut lines = Lines::default();
    for ranges in together.values() {
        lines.add(store(ranges, line));
    }
    lines
}

fn loads_of(workgroup: &[Seen], line: u64) -> Lines {
    let mut buffers = BTreeMap::<Global, Vec<_>>::new();
    for lane in workgroup {
        for touch in lane.touches.borrow().iter().filter(|touch| !touch.is_store) {
            buffers.entry(touch.global).or_default().push(touch.bytes());
        }
    }
    let mut lines = Lines::default();
    for ranges in buffers.values_mut() {
        lines.add(load(ranges, line));
    }
    lines
}

// ---------------------------------------------------------------- the workloads

pub(super) fn walk(random: &mut Rng, keys: usize, step: f64) -> Vec<Quat> {
    let mut rotation = DQuat::IDENTITY;
    let mut next = || {
        let axis = DVec3::from_array([(); 3].map(|()| 2.0 * random.f64() - 1.0));
        rotation *= DQuat::from_axis_angle(axis.normalize_or(DVec3::X), step * random.f64());
        rotation = rotation.normalize();
        rotation.as_quat()
    };
    (0..keys).map(|_| next()).collect()
}

/// Tracks of 26 keys at uneven times, 1200 frames.
fn sparse(tracks: usize) -> (TrackSet, SampleTimes) {
    let (mut random, mut set) = (Rng::with_seed(1), TrackSet::new());
    for _ in 0..tracks {
        let mut times = vec![0.0];
        for key in 1..26 {
            times.push(times[key - 1] + 0.25 + 1.5 * random.f64());
        }
        let scale = 20.0 / times[25];
        times.iter_mut().for_each(|time| *time *= scale);
        set.push("", &times, &walk(&mut random, 26, 1.0)).unwrap();
    }
    (set, SampleTimes::fps(60).between(0.0, 1199.0 / 60.0))
}

/// Tracks of 2400 keys, 120 a second, and a frame between every second pair.
fn dense(tracks: usize) -> (TrackSet, SampleTimes) {
    let (mut random, mut set) = (Rng::with_seed(2), TrackSet::new());
    let times: Vec<f64> = (0..2400).map(|key| f64::from(key) / 120.0).collect();
    for _ in 0..tracks {
        set.push("", &times, &walk(&mut random, 2400, 0.05))
            .unwrap();
    }
    let start = 1.0 / 240.0;
    (
        set,
        SampleTimes::fps(60).between(start, start + 1198.0 / 60.0),
    )
}

/// Two poses and one moment for each track.
fn crowd(tracks: usize) -> (TrackSet, SampleTimes) {
    let (mut random, mut set) = (Rng::with_seed(3), TrackSet::new());
    for _ in 0..tracks {
        set.push("", &[0.0, 1.0], &walk(&mut random, 2, 1.0))
            .unwrap();
    }
    let times = (0..tracks).map(|_| random.f64()).collect();
    (set, SampleTimes::at_each(times))
}

/// Several times of each track, in no order: runs of a sample or two.
fn scattered(tracks: usize) -> (TrackSet, SampleTimes) {
    let mut random = Rng::with_seed(4);
    let times = (0..400).map(|_| 20.0 * random.f64()).collect();
    (sparse(tracks).0, SampleTimes::at(times))
}

// ---------------------------------------------------------------- the dispatches

/// Memory for the lists of a window.
#[derive(Default)]
struct Room([Vec<u32>; 3]);

impl<'r> ListRoom<'r> for &'r mut Room {
    type Error = SampleTimesError;

    fn room(self, bytes: [Option<usize>; 3]) -> Result<[&'r mut [u8]; 3], SampleTimesError> {
        let mut lists = self.0.each_mut();
        for (list, bytes) in lists.iter_mut().zip(bytes) {
            list.resize(bytes.unwrap_or_default() / size_of::<u32>(), 0);
        }
        Ok(lists.map(|list| bytemuck::cast_slice_mut(list)))
    }
}

/// A clip's dispatch, as a device gets it: on cards, or with an item for each invocation.
fn of_clip(
    set: &TrackSet,
    frames: &SampleTimes,
    method: Method,
    layout: Layout,
    maps_samples: bool,
) -> Launch {
    let request = PrepareRequest {
        group_bytes: Some(1 << 30),
        ..PrepareRequest::all(set)
    };
    let clip = &ClipData::new(set, method.into(), request).unwrap();
    let timeline = &frames.resolve(clip.track_count(), clip.time_span).unwrap();
    let window = Window::whole(clip.track_count(), timeline.len(), layout);
    let [group] = &clip.groups[..] else {
        panic!("one group");
    };
    let form = match method.name {
        "slerp" => Form::Arc,
        _ => Form::Polynomial,
    };
    let request = ListRequest {
        maps_samples,
        run_lanes: run_lanes(0),
        clip,
        timeline,
    };
    let mut room = Room::default();
    let work = (Lister::default().list(request, &window, &mut room)).unwrap();
    let kernel = Kernel::over_segments(form, work.list, Store::F32);
    let mut recording = Recording::default();
    let bound = kernel.compiled().bindings.iter();
    let bound = Vec::from_iter(bound.map(|_| recording.resource().into()));
    recording.set(kernel, bound);
    let stored = Stored {
        encoding: Encoding::F32,
        stride: window.stride() as u32,
        first: 0,
        begins_lines: maps_samples,
    };
    let mut sets = recording.all_sets();
    work.record(&mut recording, &mut sets, stored);
    let [Step::Dispatch { push, groups, .. }] = recording.steps() else {
        panic!("one dispatch");
    };
    let mut inputs = vec![group.segments.as_bytes().to_vec(), bytes(&group.constants)];
    let [items, distances, blocks] = room.0.map(|list| bytes(&list));
    inputs.extend(match work.list {
        List::Frames | List::FramesSpread | List::Samples => vec![items],
        List::Times | List::TimesSpread => vec![items, distances],
        List::FramesCoalesced => vec![items, blocks],
        List::TimesCoalesced => vec![items, blocks, distances],
    });
    Launch {
        kernel,
        groups: *groups,
        inputs,
        arguments: recording.bytes(push).to_vec(),
    }
}

/// The first dispatch of a set that is evaluated from its keys.
fn of_keys(set: &TrackSet, frames: &SampleTimes, method: Method) -> Launch {
    let interpolation = Interpolation::from(method);
    let timeline: Timeline = frames.resolve(set.track_count(), set.time_span()).unwrap();
    let request = SetRequest::whole(set, &interpolation, &timeline);
    let curve = KeyCurve::of(&request, 1).expect("fewer samples than keys");
    let job = KeyJob {
        request: &request,
        curve,
    };
    let dispatch = job.dispatches(1 << 21).unwrap().next(1 << 21).unwrap();
    let rows = dispatch.rows(true);
    let [keys, samples, weights] = dispatch.bytes();
    let mut keys = vec![[0u32; 4]; keys / 16];
    let mut samples: Vec<KeySample> =
        vec![bytemuck::Zeroable::zeroed(); samples / size_of::<KeySample>()];
    let mut weights: Vec<TangentWeights> =
        vec![bytemuck::Zeroable::zeroed(); weights / size_of::<TangentWeights>()];
    dispatch
        .write(None, &mut keys, &mut samples, &mut weights)
        .unwrap();
    let mut inputs = vec![bytes(&keys), bytes(&samples)];
    inputs.extend((!weights.is_empty()).then(|| bytes(&weights)));
    Launch {
        kernel: match curve {
            KeyCurve::Arcs => Kernel::FromKeysArcs,
            KeyCurve::TwoKeys => Kernel::FromKeysTwoKeys,
            KeyCurve::Cubics(_) => Kernel::FromKeysCubics,
        },
        groups: [
            (rows.samples + rows.line).div_ceil(FROM_KEYS_WORKGROUP),
            rows.count.div_ceil(rows.each),
            1,
        ],
        inputs,
        arguments: bytes(&[rows]),
    }
}

/// Asserts that a dispatch stores the bits of the CPU's result: all of it, or a part.
fn assert_is_the_cpus(
    launch: &Launch,
    (set, frames): (&TrackSet, &SampleTimes),
    method: Method,
    layout: Layout,
) {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let request = cpu.request(set, method, frames).layout(layout);
    let expected = request.evaluate().unwrap();
    let (expected, found) = (expected.as_arrays(), launch.rotations());
    assert!(found.len() <= expected.len(), "{:?}", launch.kernel);
    let mut left_out = 0;
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        // The host stores the remaining samples, and those of cubics that rotate too far.
        if *found == [UNTOUCHED; 4] || *found == [0; 4] {
            left_out += 1;
        } else {
            let expected = expected.map(f32::to_bits);
            assert_eq!(
                *found, expected,
                "{:?}, {layout:?}, rotation {i}",
                launch.kernel
            );
        }
    }
    assert!(
        left_out * 20 < found.len(),
        "{:?}: {left_out}",
        launch.kernel
    );
}

// ---------------------------------------------------------------- the tests

/// Stores touch at most 1.1 times as many lines as they need. Runs end anywhere, so for lines of 128 bytes their stores
/// touch up to 1.2 times as many. Loads touch at most 1.3 times as many, frame by frame 1.4 times. Frame by frame,
/// stores of tracks that do not fill whole lines begin anywhere, and touch up to 1.25 times as many lines of 128 bytes.
#[test]
fn cards_touch_hardly_more_lines_than_they_need() {
    let layouts = [Layout::TrackMajor, Layout::FrameMajor];
    let mut count_of_launches = 0;
    for method in [SLERP, BESSEL_OVERHAUSER] {
        for (name, (set, frames)) in [
            ("sparse", sparse(96)),
            ("dense", dense(24)),
            ("crowd", crowd(4000)),
            ("scattered", scattered(24)),
            // The number of tracks does not fill whole lines; results are frame by frame.
            ("odd", sparse(509)),
            // Tracks with the same times.
            ("even", even(96, 48, GENTLE)),
            ("odd and even", even(141, 48, GENTLE)),
        ] {
            let layouts = match name.contains("even") {
                true => &layouts[1..],
                false => &layouts,
            };
            let mut launches = Vec::from_iter(layouts.iter().map(|&layout| {
                let launch = of_clip(&set, &frames, method, layout, true);
                (format!("{name}, {method}, {layout:?}"), launch, layout)
            }));
            if ["dense", "crowd"].contains(&name) {
                let launch = of_keys(&set, &frames, method);
                launches.push((format!("{name}, {method}, from keys"), launch, layouts[0]));
            }
            for (name, launch, layout) in &launches {
                assert_touches_hardly_more_lines(name, launch);
                if *layout == Layout::FrameMajor {
                    let has_same_times = ["even", "dense"].iter().any(|part| name.contains(part));
                    assert_eq!(is_spread(launch.kernel), has_same_times, "{name}");
                }
                if !name.starts_with("odd,") {
                    assert_is_the_cpus(launch, (&set, &frames), method, *layout);
                }
            }
            count_of_launches += launches.len();
        }
    }
    assert_eq!(count_of_launches, 2 * (5 * 2 + 2 + 2));
}

/// Whether neighbouring invocations of a kernel evaluate runs together.
fn is_spread(kernel: Kernel) -> bool {
    let segments = kernel.compiled().segments;
    segments.is_some_and(|(_, list, _)| matches!(list, List::FramesSpread | List::TimesSpread))
}

fn assert_touches_hardly_more_lines(name: &str, launch: &Launch) {
    let count = launch.run();
    let is_spread = is_spread(launch.kernel);
    let mut ratios = String::new();
    for ((wave, line), [stores, loads]) in CARDS.into_iter().zip(count.of_cards) {
        let (stored, loaded) = (stores.ratio(), loads.ratio());
        ratios += &format!(" {stored:.2} {loaded:.2} |");
        let label = format!("{name}, {wave} lanes, lines of {line}");
        // If a run ends within a line, the next run stores the rest of the line, in another wave.
        let limit = match (is_spread, line) {
            (true, 128) if name.starts_with("odd") && name.ends_with("FrameMajor") => 1.25,
            (true, 128) => 1.2,
            _ => 1.1,
        };
        assert!(stored <= limit, "{label}: stores {stored}");
        // Frame by frame, neighbouring lanes have separate items, some of which cross a line.
        let limit = if name.ends_with("FrameMajor") {
            1.4
        } else {
            1.3
        };
        assert!(loaded <= limit, "{label}: loads {loaded}");
    }
    let each = |count_of: u64| 4.0 * count_of as f64 / count.words as f64;
    let (lanes, lines) = (each(count.loaded), each(64 * count.of_workgroups.touched));
    let [wave, lane] = count.steps.map(each);
    println!(
        "{name} |{ratios} loads of a rotation: lanes {lanes:.0} B, lines {lines:.0} B; operations: a wave's {:.1}, a \
         lane's {lane:.1}",
        32.0 * wave
    );
}

/// The negative control: with the other mapping, neighbours store 256 bytes from each other, and
/// the count is higher.
#[test]
fn an_item_for_each_invocation_touches_more_lines() {
    let (set, frames) = sparse(96);
    for layout in [Layout::TrackMajor, Layout::FrameMajor] {
        let launch = of_clip(&set, &frames, SLERP, layout, false);
        assert_eq!(launch.kernel, Kernel::ArcFramesF32);
        let count = launch.run();
        for ((_, line), [stores, _]) in CARDS.into_iter().zip(count.of_cards) {
            let least = 0.85 * line as f64 / 16.0;
            assert!(stores.ratio() > least, "{layout:?}, {line}: {stores:?}");
        }
        assert_is_the_cpus(&launch, (&set, &frames), SLERP, layout);
    }
    for method in [SLERP, BESSEL_OVERHAUSER] {
        let (set, frames) = scattered(24);
        let launch = of_clip(&set, &frames, method, Layout::TrackMajor, false);
        assert_is_the_cpus(&launch, (&set, &frames), method, Layout::TrackMajor);
    }
}

/// The largest angle in R⁴ between the keys of tracks of which some cubics are divided, and of tracks of which none is.
const WILD: f64 = 1.0;
const GENTLE: f64 = 0.1;

/// Tracks whose keys lie a number of frames apart, each on a frame.
fn even(tracks: usize, step: usize, angle: f64) -> (TrackSet, SampleTimes) {
    let (mut random, mut set) = (Rng::with_seed(5), TrackSet::new());
    let keys = 960 / step + 1;
    let times: Vec<f64> = (0..keys).map(|key| (key * step) as f64 / 60.0).collect();
    for _ in 0..tracks {
        set.push("", &times, &walk(&mut random, keys, angle))
            .unwrap();
    }
    let last = ((keys - 1) * step) as f64;
    (set, SampleTimes::fps(60).between(0.0, last / 60.0))
}

/// As many tracks, one of which has other times, so that the tracks have separate lists.
fn uneven(tracks: usize, step: usize, angle: f64) -> (TrackSet, SampleTimes) {
    let (mut set, frames) = even(tracks - 1, step, angle);
    let keys = walk(&mut Rng::with_seed(6), 2, angle);
    set.push("", &[0.0, 16.0], &keys).unwrap();
    (set, frames)
}

/// The operations of a wave for a rotation, of arcs and of cubics, for runs of some lengths: at most a fiftieth more than
/// counted. Frame by frame, tracks with other times have a grid.
#[test]
fn a_wave_executes_few_operations_for_a_rotation() {
    type Workload = fn(usize, usize, f64) -> (TrackSet, SampleTimes);
    type Case = (Workload, usize, (Layout, f64), usize, [f64; 2]);
    let (by_track, by_frame) = ((Layout::TrackMajor, WILD), (Layout::FrameMajor, GENTLE));
    let workloads: [Case; 8] = [
        (even, 40, by_track, 8, [95.2, 109.5]),
        (even, 40, by_track, 16, [68.1, 75.8]),
        (even, 40, by_track, 48, [60.2, 66.2]),
        (even, 40, by_track, 192, [47.1, 49.9]),
        (even, 64, by_frame, 8, [45.3, 49.4]),
        (even, 64, by_frame, 48, [48.0, 52.3]),
        (uneven, 64, by_frame, 8, [118.0, 110.0]),
        (uneven, 64, by_frame, 48, [123.0, 114.0]),
    ];
    let mut wrong = Vec::new();
    for (workload, tracks, (layout, angle), step, counted) in workloads {
        for (method, counted) in [SLERP, BESSEL_OVERHAUSER].into_iter().zip(counted) {
            let (set, frames) = workload(tracks, step, angle);
            let launch = of_clip(&set, &frames, method, layout, true);
            let count = launch.run();
            let each = 4.0 * 32.0 * count.steps[0] as f64 / count.words as f64;
            let label = format!(
                "{method}, {layout:?}, {:?}, runs of {step}: {each:.1} operations",
                launch.kernel
            );
            println!("{label}");
            if !(0.9 * counted..1.02 * counted).contains(&each) {
                wrong.push(label);
            }
            assert_is_the_cpus(&launch, (&set, &frames), method, layout);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
