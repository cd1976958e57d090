//! How many lines of memory the waves of a card touch. Cards run 32 or 64 invocations together, and
//! move memory in lines: sectors of 32 bytes on NVIDIA's, lines of 64 or 128 on AMD's. Here the
//! kernels that cards are given run over the work lists of workloads as `tumble bench` has them,
//! smaller ones; every load and store is noted, and each wave's lines are counted. No device is
//! needed: what counts are the addresses, and those follow from the shaders.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use fastrand::Rng;
use glam::{DQuat, DVec3, Quat};

use crate::from_keys::KeyCurve;
use crate::method::Method;
use crate::method::bessel_overhauser::BESSEL_OVERHAUSER;
use crate::method::interpolation::Interpolation;
use crate::method::slerp::SLERP;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::clip_data::{ClipData, PrepareRequest};
use crate::prepare::preparation::SetRequest;
use crate::shader::{
    Block, Dispatch, FROM_KEYS_WORKGROUP, Form, Item, KeySample, ListedSample, TangentWeights,
    WORKGROUP,
};
use crate::time::frames::{SampleTimes, Ticks, Timeline};
use crate::tracks::set::TrackSet;
use crate::work::lists::grid::{GridRows, write_blocks};
use crate::work::lists::keys::KeyJob;
use crate::work::lists::sample_list::SampleList;
use crate::work::lists::{Cut, GroupWork, work, write};

use super::machine::{Machine, Touch};
use super::operations::FloatMode;
use super::program::{Checked, Program};
use super::source;

/// Workgroups of a dispatch that are run, of all that it has.
const WORKGROUPS: u32 = 60;

/// Invocations that a card runs together, and the bytes that it moves together.
pub(super) const CARDS: [(u32, u64); 6] =
    [(32, 32), (32, 64), (32, 128), (64, 32), (64, 64), (64, 128)];

/// The built-in inputs of an entry point.
#[derive(Clone, Copy)]
enum Builtins {
    /// The workgroup, how many there are, and the invocation's index in it.
    Workgroup,
    /// The invocation's index among all, and how many workgroups there are.
    Invocation,
    /// The invocation's index among all.
    InvocationAlone,
}

/// A dispatch: its kernel, and what it reads.
struct Launch {
    kernel: String,
    builtins: Builtins,
    workgroup: u32,
    groups: [u32; 3],
    globals: Vec<(&'static str, Vec<u64>)>,
    /// Rotations of its result.
    rotations: usize,
}

/// The cells of a buffer, four bytes each.
pub(super) fn cells(bytes: &[u8]) -> Vec<u64> {
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(bytes);
    words.into_iter().map(u64::from).collect()
}

/// Lines that waves touched, and the fewest that would have done.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Lines {
    touched: u64,
    least: u64,
}

impl Lines {
    pub(super) fn ratio(self) -> f64 {
        self.touched as f64 / self.least.max(1) as f64
    }

    pub(super) fn add(&mut self, more: Self) {
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

/// What a store of all lanes of a wave takes: at least the bytes as if they lay side by side.
pub(super) fn store(ranges: &[Range<u64>], line: u64) -> Lines {
    let bytes: u64 = ranges.iter().map(|range| range.end - range.start).sum();
    Lines {
        touched: touched(ranges, line),
        least: bytes.div_ceil(line),
    }
}

/// What a workgroup reads of a buffer: at least each stretch of bytes as if it began where a line
/// does. Bytes that are less than a line apart are one stretch. A line counts once, since the waves
/// of a workgroup share a cache.
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

/// The stores and the loads of a dispatch, for each kind of card, and the rotations stored.
#[derive(Default)]
struct Count {
    of_cards: [[Lines; 2]; CARDS.len()],
    rotations: u64,
    /// Bytes that lanes loaded.
    loaded: u64,
    /// Lines of 64 bytes that workgroups loaded.
    of_workgroups: Lines,
}

impl Launch {
    fn run(&self) -> Count {
        let program = Checked::parse(source(&self.kernel)).program(FloatMode::AsWritten);
        let mut machine = Machine::new(&program);
        for (name, cells) in &self.globals {
            machine.globals[global(&program, name)].clone_from(cells);
        }
        let output = global(&program, "rotations");
        machine.globals[output] = vec![0; 4 * self.rotations];
        let main = program.functions.len() - 1;
        let pushed = ["dispatch", "rows"]
            .map(|name| program.globals.iter().position(|global| global == name));
        let [x, y, z] = self.groups;
        let all = x * y * z;
        let mut count = Count::default();
        for number in (0..all).step_by((all / WORKGROUPS).max(1) as usize) {
            let group = [number % x, number / x % y, number / (x * y)];
            let lanes: Vec<Vec<Touch>> = (0..self.workgroup)
                .map(|lane| {
                    machine.touches = Some(Vec::new());
                    let found = machine.call(main, &self.arguments(group, lane));
                    assert!(found.is_some(), "{}: {group:?}, {lane}", self.kernel);
                    let mut touches = machine.touches.take().unwrap_or_default();
                    touches.retain(|touch| !pushed.contains(&Some(touch.global)));
                    touches
                })
                .collect();
            let stores = lanes.iter().flatten().filter(|touch| touch.is_store);
            count.rotations += stores.count() as u64;
            let loads = lanes.iter().flatten().filter(|touch| !touch.is_store);
            let bytes = |range: Range<u64>| range.end - range.start;
            count.loaded += loads.map(|touch| bytes(touch.bytes())).sum::<u64>();
            count.of_workgroups.add(loads_of(&lanes, 64));
            for ((wave, line), lines) in CARDS.into_iter().zip(&mut count.of_cards) {
                for wave in lanes.chunks(wave as usize) {
                    lines[0].add(stores_of(wave, line));
                }
                lines[1].add(loads_of(&lanes, line));
            }
        }
        assert!(
            count.rotations > 100,
            "{}: {}",
            self.kernel,
            count.rotations
        );
        count
    }

    fn arguments(&self, group: [u32; 3], lane: u32) -> Vec<u64> {
        let invocation = [group[0] * self.workgroup + lane, group[1], group[2]];
        let builtins = match self.builtins {
            Builtins::Workgroup => [&group[..], &self.groups, &[lane]].concat(),
            Builtins::Invocation => [invocation, self.groups].concat(),
            Builtins::InvocationAlone => invocation.to_vec(),
        };
        builtins.into_iter().map(u64::from).collect()
    }
}

pub(super) fn global(program: &Program, name: &str) -> usize {
    let index = program.globals.iter().position(|global| global == name);
    index.unwrap_or_else(|| panic!("no global {name}"))
}

/// Of each iteration of a loop the first stores of all lanes go together, then the second ones.
fn stores_of(wave: &[Vec<Touch>], line: u64) -> Lines {
    let mut together = BTreeMap::<(usize, usize), Vec<Range<u64>>>::new();
    for lane in wave {
        let (mut iteration, mut stores) = (0, 0);
        for touch in lane.iter().filter(|touch| touch.is_store) {
            stores = if touch.iteration == iteration {
                stores + 1
            } else {
                0
            };
            iteration = touch.iteration;
            together
                .entry((iteration, stores))
                .or_default()
                .push(touch.bytes());
        }
    }
    let mut lines = Lines::default();
    for ranges in together.values() {
        lines.add(store(ranges, line));
    }
    lines
}

pub(super) fn loads_of(workgroup: &[Vec<Touch>], line: u64) -> Lines {
    let mut buffers = BTreeMap::<usize, Vec<_>>::new();
    for touch in workgroup.iter().flatten().filter(|touch| !touch.is_store) {
        buffers.entry(touch.global).or_default().push(touch.bytes());
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

/// A clip's dispatch, as a device gets it: on cards, or with an item for each invocation.
fn of_clip(
    set: &TrackSet,
    frames: &SampleTimes,
    method: Method,
    layout: Layout,
    cut: Cut,
) -> Launch {
    let request = PrepareRequest {
        group_bytes: Some(1 << 30),
        ..PrepareRequest::all(set)
    };
    let clip = ClipData::new(set, method.into(), request).unwrap();
    let timeline = frames.resolve(clip.track_count(), clip.time_span).unwrap();
    let window = Window::whole(clip.track_count(), timeline.len(), layout);
    let [group] = &clip.groups[..] else {
        panic!("one group");
    };
    let form = match method.name {
        "slerp" => Form::Arc,
        _ => Form::Polynomial,
    };
    let form = format!("{form:?}").to_lowercase();
    let mut globals = vec![
        ("segments", cells(group.segments.as_bytes())),
        ("constants", cells(bytemuck::cast_slice(&group.constants))),
    ];
    let is_timed = matches!(timeline.ticks, Ticks::Times { .. });
    let rotations = window.len();
    if let Some(list) = SampleList::new(&clip, &timeline, &window) {
        let mut samples = vec![
            ListedSample {
                source: 0,
                parameter: 0.0
            };
            window.len()
        ];
        list.write(&mut samples).unwrap();
        globals.push(("samples", cells(bytemuck::cast_slice(&samples))));
        let dispatch = dispatch_of(samples.len(), 1);
        globals.push(("dispatch", cells(bytemuck::bytes_of(&dispatch))));
        return Launch {
            kernel: format!("{form}_samples_f32"),
            builtins: Builtins::Invocation,
            workgroup: WORKGROUP,
            groups: [(samples.len() as u32).div_ceil(WORKGROUP), 1, 1],
            globals,
            rotations,
        };
    }
    let lists = work(&clip, &timeline, &window, cut, &mut Vec::new()).unwrap();
    let count: usize = lists.iter().map(GroupWork::item_count).sum();
    let chunks = lists.iter().flat_map(|list| &list.chunks);
    let distances: usize = chunks.map(|chunk| chunk.distances.len()).sum();
    let mut items: Vec<Item> = vec![bytemuck::Zeroable::zeroed(); count + 1];
    let mut distances = vec![0.0; distances];
    let rows = GridRows::new(&window).filter(|_| cut == Cut::Whole);
    write(&lists, rows, &mut items[..count], &mut distances);
    globals.push(("items", cells(bytemuck::cast_slice(&items))));
    let listed = if is_timed { "times" } else { "frames" };
    if is_timed {
        globals.push(("distances", cells(bytemuck::cast_slice(&distances))));
    }
    let Some(rows) = rows else {
        let dispatch = dispatch_of(count, window.stride());
        globals.push(("dispatch", cells(bytemuck::bytes_of(&dispatch))));
        return Launch {
            kernel: format!("{form}_{listed}_f32"),
            builtins: Builtins::Invocation,
            workgroup: WORKGROUP,
            groups: [(count as u32).div_ceil(WORKGROUP), 1, 1],
            globals,
            rotations,
        };
    };
    let grids = rows.of_groups(&lists).expect("items in order");
    let mut blocks: Vec<Block> = vec![bytemuck::Zeroable::zeroed(); grids[0].blocks() as usize];
    write_blocks(&lists, &grids, count as u32, &mut blocks);
    globals.push(("blocks", cells(bytemuck::cast_slice(&blocks))));
    let arguments = grids[0].arguments;
    globals.push(("dispatch", cells(bytemuck::bytes_of(&arguments))));
    Launch {
        kernel: format!("{form}_{listed}_coalesced_f32"),
        builtins: Builtins::Workgroup,
        workgroup: WORKGROUP,
        groups: grids[0].workgroups(),
        globals,
        rotations,
    }
}

fn dispatch_of(count: usize, stride: usize) -> Dispatch {
    Dispatch {
        first_item: 0,
        item_count: count as u32,
        stride: stride as u32,
        detail: 0,
        first_output: 0,
        idle: 0,
    }
}

/// The first dispatch of a set that is evaluated from its keys.
fn of_keys(set: &TrackSet, frames: &SampleTimes, method: Method) -> Launch {
    let interpolation = Interpolation::from(method);
    let timeline: Timeline = frames.resolve(set.track_count(), set.time_span()).unwrap();
    let request = SetRequest::whole(set, &interpolation, &timeline);
    let curve = KeyCurve::of(&request).expect("fewer samples than keys");
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
    let kernel = match curve {
        KeyCurve::Arcs => "from_keys_arcs",
        KeyCurve::TwoKeys => "from_keys_two_keys",
        KeyCurve::Cubics(_) => "from_keys_cubics",
    };
    let mut globals = vec![
        ("keys", cells(bytemuck::cast_slice(&keys))),
        ("samples", cells(bytemuck::cast_slice(&samples))),
        ("rows", cells(bytemuck::bytes_of(&rows))),
    ];
    if !weights.is_empty() {
        globals.push(("weights", cells(bytemuck::cast_slice(&weights))));
    }
    Launch {
        kernel: kernel.to_owned(),
        builtins: Builtins::InvocationAlone,
        workgroup: FROM_KEYS_WORKGROUP,
        groups: [
            (rows.samples + rows.line).div_ceil(FROM_KEYS_WORKGROUP),
            rows.count.div_ceil(rows.each),
            1,
        ],
        globals,
        rotations: dispatch.rotation_count(),
    }
}

// ---------------------------------------------------------------- the tests

/// Stores touch at most 1.1 times as many lines as they need, and loads 1.3 times; 1.4 times frame by
/// frame.
#[test]
fn cards_touch_hardly_more_lines_than_they_need() {
    let layouts = [Layout::TrackMajor, Layout::FrameMajor];
    let mut launches = Vec::new();
    for method in [SLERP, BESSEL_OVERHAUSER] {
        for (name, (set, frames)) in [
            ("sparse", sparse(96)),
            ("dense", dense(24)),
            ("crowd", crowd(4000)),
            ("scattered", scattered(24)),
            // As many tracks as fill no whole lines, frame by frame.
            ("odd", sparse(509)),
        ] {
            for layout in layouts {
                let launch = of_clip(&set, &frames, method, layout, Cut::Whole);
                launches.push((format!("{name}, {method}, {layout:?}"), launch));
            }
            if ["dense", "crowd"].contains(&name) {
                let launch = of_keys(&set, &frames, method);
                launches.push((format!("{name}, {method}, from keys"), launch));
            }
        }
    }
    assert_eq!(launches.len(), 2 * (5 * 2 + 2));
    for (name, launch) in &launches {
        let count = launch.run();
        let mut ratios = String::new();
        for ((wave, line), [stores, loads]) in CARDS.into_iter().zip(count.of_cards) {
            let (stored, loaded) = (stores.ratio(), loads.ratio());
            ratios += &format!(" {stored:.2} {loaded:.2} |");
            let label = format!("{name}, {wave} lanes, lines of {line}");
            assert!(stored <= 1.1, "{label}: stores {stored}");
            // Frame by frame neighbours have items of their own, some of which lie across lines.
            let limit = if name.ends_with("FrameMajor") {
                1.4
            } else {
                1.3
            };
            assert!(loaded <= limit, "{label}: loads {loaded}");
        }
        let each = |bytes: u64| bytes as f64 / count.rotations as f64;
        let (lanes, lines) = (count.loaded, 64 * count.of_workgroups.touched);
        let (lanes, lines) = (each(lanes), each(lines));
        println!("{name} |{ratios} loads of a rotation: lanes {lanes:.0} B, lines {lines:.0} B");
    }
}

/// The count sees what the other mapping does: neighbours store 256 bytes from each other.
#[test]
fn an_item_for_each_invocation_touches_more_lines() {
    let (set, frames) = sparse(96);
    for layout in [Layout::TrackMajor, Layout::FrameMajor] {
        let launch = of_clip(&set, &frames, SLERP, layout, Cut::Short);
        assert_eq!(launch.kernel, "arc_frames_f32");
        let count = launch.run();
        for ((_, line), [stores, _]) in CARDS.into_iter().zip(count.of_cards) {
            let least = 0.85 * line as f64 / 16.0;
            assert!(stores.ratio() > least, "{layout:?}, {line}: {stores:?}");
        }
    }
}
