//! The comparisons and measurements of the lab, on a device.

use std::sync::Arc;
use std::time::Instant;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::QueueLane;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::kernel_check::segments::{rotations, spread_trial};
use crate::gpu::physical::DeviceKind;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::submission::Submission;
use crate::lab::rules::{self, Timed};
use crate::lab::variant::{KernelVariant, LabKernel, RunList};
use crate::lab::{Ceiling, Decision, LabOptions, LabReport, LabRow, RejectedVariant, VariantTime};
use crate::machine::error::VulkanError;
use crate::machine::options::RunLanes;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::shader::{Form, IS_CONSTANT, Kernel, NO_KEY, Spread, SpreadRun, Variants};
use crate::work::lists::WorkChunk;
use crate::work::lists::spread::{NO_RUN, RunRepetitions, SpreadLanes};
use crate::work::recording::Users;

/// How much is measured.
struct Effort {
    /// Samples of a dispatch.
    samples: u32,
    /// Dispatches of a row.
    dispatches: u32,
    /// Rows whose median is a time in the last measurements.
    rows: u32,
    /// The name of the ceiling of empty workgroups, and their number.
    workgroups: (&'static str, u32),
}

/// 4096 tracks of 1200 frames. What [`rules`] decide was written for such rows.
const OF_CARDS: Effort = Effort {
    samples: 4096 * TRACK_SAMPLES,
    dispatches: 32,
    rows: 5,
    workgroups: ("32 768 workgroups that end at once", 1 << 15),
};

/// On software devices the times decide nothing; everything is measured there to see that the lab comes to its end.
const OF_SOFTWARE: Effort = Effort {
    samples: 2 * LISTED_TRACKS * TRACK_SAMPLES,
    dispatches: 2,
    rows: 1,
    workgroups: ("64 workgroups that end at once", 64),
};

/// Runs that are measured together.
#[derive(Clone, Copy)]
struct RunShape {
    layout: Layout,
    samples: u32,
    /// Whether each begins with a key.
    has_keys: bool,
}

const fn shape(layout: Layout, samples: u32, has_keys: bool) -> RunShape {
    RunShape {
        layout,
        samples,
        has_keys,
    }
}

/// The runs that are measured, the most typical first.
const RUNS: [RunShape; 10] = [
    shape(Layout::TrackMajor, 48, false),
    shape(Layout::FrameMajor, 48, false),
    shape(Layout::TrackMajor, 48, true),
    shape(Layout::TrackMajor, 16, false),
    shape(Layout::TrackMajor, 200, false),
    shape(Layout::FrameMajor, 200, false),
    shape(Layout::TrackMajor, 8, false),
    shape(Layout::TrackMajor, 4, false),
    shape(Layout::TrackMajor, 16, true),
    shape(Layout::FrameMajor, 16, false),
];

/// Segments that runs share in turn, more than a cache has.
const SEGMENTS: u32 = 1 << 20;

/// The samples of a track, and the tracks of a list that is repeated.
const TRACK_SAMPLES: u32 = 1200;
const LISTED_TRACKS: u32 = 4;

/// The repetitions that are compared with twins; frame by frame, the tracks and those of their result.
const REPETITIONS: u32 = 3;
const COMPARED_TRACKS: [u32; 2] = [11, 13];

/// The lanes whose numbers decide for a class of runs.
const LANES: [u32; 4] = [4, 8, 16, 32];

/// The barriers whose time is measured, beside none.
const BARRIERS: [(&str, [Users; 2]); 5] = [
    ("barrier between kernels", [Users::Kernel, Users::Kernel]),
    (
        "barrier between kernels and copies",
        [Users::KernelAndCopy, Users::KernelAndCopy],
    ),
    ("barrier from all to kernels", [Users::Any, Users::Kernel]),
    ("barrier from kernels to all", [Users::Kernel, Users::Any]),
    ("barrier from all to all", [Users::Any, Users::Any]),
];
const BETWEEN_KERNELS: [Users; 2] = [Users::Kernel, Users::Kernel];

/// Variants that are left for the last measurement.
const FINALISTS: usize = 3;

/// A pipeline of a kernel's variant.
type MadePipeline = (Kernel, KernelVariant, Arc<Pipeline>);

struct Bench<'a> {
    engine: &'a VulkanEngine,
    submission: Submission,
    deadline: Instant,
    is_software: bool,
    effort: Effort,
    pipelines: Vec<MadePipeline>,
    report: LabReport,
}

/// A dispatch of which a row is made.
#[derive(Clone, Copy)]
struct RowDispatch<'a> {
    pipeline: &'a Pipeline,
    buffers: [&'a Buffer; 4],
    push: Spread,
    groups: [u32; 3],
}

/// A list of runs on the device, for some lanes and a workgroup.
struct ListedRuns {
    lanes: SpreadLanes,
    list: RunList,
    entries: u32,
    repetitions: RunRepetitions,
    buffer: Buffer,
}

impl ListedRuns {
    /// The push constants and the workgroups of a dispatch over all runs.
    fn dispatch(&self, detail: u32) -> (Spread, [u32; 3]) {
        let Self {
            lanes, repetitions, ..
        } = *self;
        let push = lanes.dispatch_repeated([0, self.entries], repetitions, detail, 0);
        let groups = lanes.workgroups(self.entries, repetitions.count);
        (push, groups)
    }
}

pub(super) fn run(engine: &VulkanEngine, options: &LabOptions) -> Result<LabReport, VulkanError> {
    let info = &engine.device.physical.info;
    let is_software = matches!(info.kind, DeviceKind::Cpu | DeviceKind::Other);
    let mut bench = Bench {
        engine,
        submission: Submission::new(&engine.device, QueueLane::Kernels)?,
        deadline: Instant::now() + options.budget,
        is_software,
        effort: match is_software {
            true => OF_SOFTWARE,
            false => OF_CARDS,
        },
        pipelines: Vec::new(),
        report: LabReport {
            variants_compared: 0,
            words_compared: 0,
            rejected: Vec::new(),
            samples: 0,
            row: 0,
            ceilings: Vec::new(),
            rows: Vec::new(),
            decisions: Vec::new(),
            run_lanes: None,
            is_complete: true,
        },
    };
    bench.compare()?;
    if !options.bits_only && engine.device.physical.timestamp_bits() > 0 {
        bench.report.samples = bench.effort.samples;
        bench.report.row = bench.effort.dispatches;
        bench.measure()?;
    }
    Ok(bench.report)
}

impl Bench<'_> {
    fn is_over(&self) -> bool {
        Instant::now() > self.deadline
    }

    /// The variants of a kernel. Software devices take a tenth of a second for a pipeline: they have as few as have all
    /// workgroups and both kinds of stores, and those that the rules compare.
    fn variants(&self, kernel: LabKernel, layout: Layout, lanes: u32) -> Vec<KernelVariant> {
        let physical = &self.engine.device.physical;
        let largest = physical.info.max_compute_work_group_invocations;
        let mut all = kernel.variants(layout, lanes, physical.converts_halves, largest);
        let cached = all[0].cached();
        all.retain(|variant| !self.is_software || variant.is_typical() || *variant == cached);
        all
    }

    fn pipeline(
        &mut self,
        kernel: Kernel,
        variant: KernelVariant,
    ) -> Result<Arc<Pipeline>, VulkanError> {
        let code = variant.code();
        let mut known = self.pipelines.iter();
        if let Some((.., made)) = known.find(|(of, is, _)| (*of, *is) == (kernel, code)) {
            return Ok(Arc::clone(made));
        }
        let (name, words) = variant.code_of(kernel)?;
        let made = Arc::new(Pipeline::of_code(
            &self.engine.device,
            kernel,
            (name, &words),
        )?);
        self.pipelines.push((kernel, code, Arc::clone(&made)));
        Ok(made)
    }

    /// The tracks of a measured result.
    fn tracks(&self) -> u32 {
        self.effort.samples / TRACK_SAMPLES
    }

    /// The engine's lanes of these tracks, frame by frame.
    fn track_lanes(&self) -> u32 {
        let tracks = self.tracks();
        SpreadLanes::of_tracks(tracks, TRACK_SAMPLES, tracks).lanes()
    }

    /// Compares every variant of every kernel with the kernel's twin, word for word.
    fn compare(&mut self) -> Result<(), VulkanError> {
        for lab_kernel in LabKernel::all() {
            let LabKernel { form, encoding } = lab_kernel;
            let kernel = lab_kernel.kernel();
            let [tracks, stride] = COMPARED_TRACKS;
            let trial = |lanes, list| {
                let repetitions = match list {
                    RunList::EachTrack => 1,
                    RunList::Shared => REPETITIONS,
                    RunList::Tracks => tracks,
                };
                spread_trial((form, encoding), lanes, repetitions)
            };
            let each = trial(SpreadLanes::new(3), RunList::EachTrack).expected(kernel);
            let shared = trial(SpreadLanes::new(3), RunList::Shared).expected(kernel);
            let of_tracks = SpreadLanes::with_tracks(3, stride);
            let of_tracks = trial(of_tracks, RunList::Tracks).expected(kernel);
            let by_track = self.variants(lab_kernel, Layout::TrackMajor, 8);
            let by_frame = self.variants(lab_kernel, Layout::FrameMajor, self.track_lanes());
            for variant in by_track.into_iter().chain(by_frame) {
                let pipeline = self.pipeline(kernel, variant)?;
                let expected = match variant.list {
                    RunList::EachTrack => each.clone(),
                    RunList::Shared => shared.clone(),
                    RunList::Tracks => of_tracks.clone(),
                };
                let trial = trial(variant.spread_lanes(stride), variant.list);
                let [differing, words] = trial.differing_from(expected, &pipeline)?;
                self.report.variants_compared += 1;
                self.report.words_compared += words as u64;
                if differing > 0 {
                    self.report.rejected.push(RejectedVariant {
                        kernel: pipeline.name,
                        variant,
                        words: words as u64,
                        differing: differing as u64,
                    });
                }
            }
        }
        Ok(())
    }

    /// The time in microseconds of one dispatch of a row with a barrier between them: the median of some rows.
    fn row(
        &mut self,
        dispatch: RowDispatch<'_>,
        barrier: Option<[Users; 2]>,
        rows: u32,
    ) -> Result<f64, VulkanError> {
        let mut times = Vec::new();
        for _ in 0..rows {
            self.submission.begin()?;
            let work = &mut self.submission.work;
            let bindings = dispatch.buffers.map(|buffer| work.whole(buffer).into());
            let set = work.recording.set(dispatch.pipeline.kernel, bindings);
            for _ in 0..self.effort.dispatches {
                work.recording
                    .dispatch(set, &dispatch.push, dispatch.groups);
                if let Some([from, to]) = barrier {
                    work.recording.barrier(from, to);
                }
            }
            work.bind(|_| Ok(dispatch.pipeline))?;
            times.push(self.submitted()?);
        }
        Ok(median(times))
    }

    /// Submits what was recorded. Returns the time of each part of a row in microseconds.
    fn submitted(&mut self) -> Result<f64, VulkanError> {
        let spent = self.submission.run()?;
        let seconds = spent.map_or(0.0, |spent| spent.on_device.as_secs_f64());
        Ok(seconds * 1e6 / f64::from(self.effort.dispatches))
    }

    /// As [`Bench::row`], twice, after a row that is ignored.
    fn twice(
        &mut self,
        dispatch: RowDispatch<'_>,
        barrier: Option<[Users; 2]>,
    ) -> Result<Timed, VulkanError> {
        let rows = self.effort.rows;
        self.row(dispatch, barrier, 1)?;
        let one = self.row(dispatch, barrier, rows)?;
        Ok(Timed::new(one, self.row(dispatch, barrier, rows)?))
    }

    /// The time of filling so many bytes, in a row with a barrier between any commands, or none.
    fn fill(
        &mut self,
        buffer: &Buffer,
        bytes: u64,
        has_barriers: bool,
    ) -> Result<Timed, VulkanError> {
        let mut times = [0.0; 3];
        for time in &mut times {
            self.submission.begin()?;
            for _ in 0..self.effort.dispatches {
                let commands = self.submission.commands();
                if has_barriers {
                    commands.barrier(Users::Any, Users::Any);
                }
                commands.fill(buffer, bytes, 0x3f80_0000);
                if has_barriers {
                    commands.barrier(Users::Any, Users::Any);
                }
            }
            *time = self.submitted()?;
        }
        Ok(Timed::new(times[1], times[2]))
    }

    fn resident(&self, bytes: &[u8]) -> Result<Buffer, VulkanError> {
        self.engine.resident("tumble lab", bytes, &mut Vec::new())
    }

    fn results(&self, bytes: u64) -> Result<Buffer, VulkanError> {
        Buffer::new(&self.engine.device, "tumble lab", bytes, Residence::Results)
    }

    /// Lists runs that follow each other, for some lanes and a workgroup: all, or those of a few tracks or of one, which
    /// are repeated.
    fn listed(
        &self,
        run: SpreadRun,
        count: u32,
        lanes: SpreadLanes,
        list: RunList,
    ) -> Result<ListedRuns, VulkanError> {
        let runs_of_track = TRACK_SAMPLES.div_ceil(count);
        let (track, listed, repetitions) = match list {
            RunList::EachTrack => (
                self.effort.samples,
                self.effort.samples,
                RunRepetitions::ONE,
            ),
            RunList::Shared => (
                TRACK_SAMPLES,
                TRACK_SAMPLES * LISTED_TRACKS,
                RunRepetitions {
                    count: self.tracks() / LISTED_TRACKS,
                    segments: runs_of_track * LISTED_TRACKS,
                    constants: 0,
                    outputs: TRACK_SAMPLES * LISTED_TRACKS,
                },
            ),
            RunList::Tracks => (
                TRACK_SAMPLES,
                TRACK_SAMPLES,
                RunRepetitions {
                    count: self.tracks(),
                    segments: runs_of_track,
                    constants: 0,
                    outputs: 1,
                },
            ),
        };
        let stride = match list {
            RunList::EachTrack | RunList::Shared => 1,
            RunList::Tracks => self.tracks(),
        };
        let mut chunk = WorkChunk::default();
        let mut output = 0;
        while output < listed {
            let source = chunk.runs.len() as u32 % SEGMENTS.min(self.effort.samples / 4);
            let count = count.min(track - output % track);
            chunk.runs.push(SpreadRun {
                source: if run.count & IS_CONSTANT != 0 {
                    0
                } else {
                    source
                },
                output: output * stride,
                count: count | run.count,
                ..run
            });
            output += count;
        }
        let mut written = vec![NO_RUN; lanes.entries(&chunk)];
        lanes.write_chunk(&chunk, 0, &mut written);
        Ok(ListedRuns {
            lanes,
            list,
            entries: written.len() as u32,
            repetitions,
            buffer: self.resident(bytemuck::cast_slice(&written))?,
        })
    }

    /// Whether the segments are enough for runs of so many samples in a list of a kind.
    fn has_segments(&self, run: u32, list: RunList) -> bool {
        let needed = u64::from(self.tracks()) * u64::from(TRACK_SAMPLES.div_ceil(run));
        list == RunList::EachTrack || needed <= u64::from(SEGMENTS.min(self.effort.samples / 4))
    }

    fn measure(&mut self) -> Result<(), VulkanError> {
        let largest = (Encoding::ALL.into_iter().map(Encoding::bytes).max()).unwrap_or_default();
        let results = self.results(u64::from(self.effort.samples) * largest as u64)?;
        let constants = self.resident(bytemuck::cast_slice(&[[0.0_f32, 0.0, 0.0, 1.0]; 2]))?;
        let fill = self.ceilings(&results, &constants)?;
        let segments = [Form::Arc, Form::Polynomial]
            .map(|form| rotations(form, SEGMENTS.min(self.effort.samples / 4) as usize));
        let [arcs, polynomials] = segments;
        let of_forms = [self.resident(&arcs)?, self.resident(&polynomials)?];
        // For each class of runs and each number of lanes: the times of all kernels, relative to the engine's present
        // variant.
        let mut shares: [Vec<[Timed; 4]>; 5] = Default::default();
        for shape in RUNS {
            let class = RunLanes::class(1, u64::from(shape.samples));
            let today_lanes = match shape.layout {
                Layout::TrackMajor => self.engine.run_lanes.of_class(class),
                Layout::FrameMajor => self.track_lanes(),
            };
            let mut lists: Vec<ListedRuns> = Vec::new();
            for lab_kernel in LabKernel::all() {
                if self.is_over() {
                    self.report.is_complete = false;
                    break;
                }
                let buffers = [
                    &of_forms[usize::from(lab_kernel.form == Form::Polynomial)],
                    &constants,
                ];
                let all = (buffers, &results);
                let (row, of_lanes) =
                    self.kernel_row(lab_kernel, shape, today_lanes, all, &mut lists)?;
                let filled = fill * row.bytes as f64;
                let share_of_filling = filled / row.winner.time.best().max(f64::MIN_POSITIVE);
                self.report.rows.push(LabRow {
                    share_of_filling,
                    ..row
                });
                if !shape.has_keys {
                    shares[class].extend(of_lanes);
                }
            }
        }
        self.decide(&shares);
        Ok(())
    }

    /// Measures the variants of a kernel over runs of a length. Track by track, it also measures the engine's present
    /// variant with other numbers of lanes, relative to the present time, if no variant was rejected.
    fn kernel_row(
        &mut self,
        lab_kernel: LabKernel,
        shape: RunShape,
        today_lanes: u32,
        (read, results): ([&Buffer; 2], &Buffer),
        lists: &mut Vec<ListedRuns>,
    ) -> Result<(LabRow, Option<[Timed; 4]>), VulkanError> {
        let kernel = lab_kernel.kernel();
        let detail = lab_kernel.encoding.row().detail;
        let RunShape {
            layout,
            samples: run,
            has_keys,
        } = shape;
        let mut variants = self.variants(lab_kernel, layout, today_lanes);
        variants.retain(|variant| {
            let mut rejected = self.report.rejected.iter();
            let is_rejected = |one: &RejectedVariant| {
                one.variant == *variant && one.kernel == variant_name(kernel, *variant)
            };
            !rejected.any(is_rejected) && self.has_segments(run, variant.list)
        });
        let like = SpreadRun {
            first: -(run as i32 / 2),
            scale: 2.0 / run as f32,
            key: if has_keys { 0 } else { NO_KEY },
            ..NO_RUN
        };
        let mut prepared = Vec::new();
        for &variant in &variants {
            let lanes = variant.spread_lanes(self.tracks());
            let is_listed = |list: &ListedRuns| (list.lanes, list.list) == (lanes, variant.list);
            if !lists.iter().any(is_listed) {
                lists.push(self.listed(like, run, lanes, variant.list)?);
            }
            let index = lists.iter().position(is_listed).unwrap_or_default();
            prepared.push((self.pipeline(kernel, variant)?, index));
        }
        let dispatch = |index: usize| {
            let (pipeline, list) = &prepared[index];
            let list = &lists[*list];
            let (push, groups) = list.dispatch(detail);
            RowDispatch {
                pipeline,
                buffers: [read[0], read[1], &list.buffer, results],
                push,
                groups,
            }
        };
        let between = Some(BETWEEN_KERNELS);
        let mut left = rules::halve(variants.len(), FINALISTS, &mut |index, rows| {
            self.row(dispatch(index), between, rows)
        })?;
        // The rule about stores compares with the variant that differs only in its stores, so this variant is never
        // removed.
        let cached = variants[0].cached();
        let cached = variants.iter().position(|variant| *variant == cached);
        left.extend(cached.filter(|index| !left.contains(index)));
        let mut finalists = Vec::new();
        for index in left {
            finalists.push(VariantTime {
                variant: variants[index],
                time: self.twice(dispatch(index), between)?,
            });
        }
        let today = finalists[0];
        let candidates = finalists.iter();
        let candidates = candidates.map(|one| (one.time, one.variant.new_pipelines(today.variant)));
        let winner = finalists[rules::winner(&Vec::from_iter(candidates))];
        let mut of_lanes = Vec::new();
        let by_frames = layout == Layout::FrameMajor;
        for lanes in LANES.into_iter().filter(|_| !by_frames) {
            let variant = KernelVariant {
                lanes,
                ..today.variant
            };
            if let Some(index) = variants.iter().position(|one| *one == variant) {
                let [shorter, longer] = self.twice(dispatch(index), between)?.microseconds;
                let of_today = today.time.best().max(f64::MIN_POSITIVE);
                of_lanes.push(Timed::new(shorter / of_today, longer / of_today));
            }
        }
        let row = LabRow {
            kernel: prepared[0].0.name,
            run,
            has_keys,
            by_frames,
            bytes: u64::from(self.effort.samples) * lab_kernel.encoding.bytes() as u64,
            today,
            winner,
            share_of_filling: 0.0,
            finalists,
        };
        Ok((row, of_lanes.try_into().ok()))
    }

    /// Measures the ceilings. Returns the time of filling a byte in microseconds.
    fn ceilings(&mut self, results: &Buffer, constants: &Buffer) -> Result<f64, VulkanError> {
        let mut found = Vec::new();
        let mut add = |name, time, bytes| found.push(Ceiling { name, time, bytes });
        let bytes = u64::from(self.effort.samples) * 16;
        let more = (bytes / 10 * 34).min(results.size) / 16 * 16;
        for (name, bytes, has_barriers) in [
            ("fill", bytes, false),
            ("fill between barriers for all", bytes, true),
            ("fill more", more, false),
            ("fill more between barriers for all", more, true),
        ] {
            add(name, self.fill(results, bytes, has_barriers)?, Some(bytes));
        }
        let fill = found[0].time.best() / bytes as f64;
        let kernel = LabKernel {
            form: Form::Arc,
            encoding: Encoding::F32,
        };
        let today = self.variants(kernel, Layout::TrackMajor, 8)[0];
        let pipeline = self.pipeline(kernel.kernel(), today)?;
        let constant = SpreadRun {
            count: IS_CONSTANT,
            ..NO_RUN
        };
        let mut add = |name, time, bytes| found.push(Ceiling { name, time, bytes });
        for (name, lanes_log2, run) in [
            ("store, neighbours in line", 5, 512),
            ("store, eight lanes at 1 KiB from the next", 3, 64),
            ("store, a workgroup in line", 7, 2048),
        ] {
            let lanes = SpreadLanes::new(lanes_log2);
            let list = self.listed(constant, run, lanes, RunList::EachTrack)?;
            let (push, groups) = list.dispatch(0);
            let dispatch = RowDispatch {
                pipeline: &pipeline,
                buffers: [constants, constants, &list.buffer, results],
                push,
                groups,
            };
            add(
                name,
                self.twice(dispatch, Some(BETWEEN_KERNELS))?,
                Some(bytes),
            );
        }
        let nothing = RowDispatch {
            pipeline: &pipeline,
            buffers: [constants, constants, constants, results],
            push: SpreadLanes::new(3).dispatch([0, 0], 0, 0),
            groups: [1, 1, 1],
        };
        add(
            "empty dispatch, no barrier",
            self.twice(nothing, None)?,
            None,
        );
        for (name, barrier) in BARRIERS {
            add(name, self.twice(nothing, Some(barrier))?, None);
        }
        let (name, workgroups) = self.effort.workgroups;
        let many = RowDispatch {
            groups: [workgroups, 1, 1],
            ..nothing
        };
        add(name, self.twice(many, None)?, None);
        self.report.ceilings = found;
        Ok(fill)
    }

    fn ceiling(&self, name: &str) -> f64 {
        let mut all = self.report.ceilings.iter();
        all.find(|ceiling| ceiling.name == name)
            .map_or(0.0, |ceiling| ceiling.time.best())
    }

    fn decide(&mut self, shares: &[Vec<[Timed; 4]>; 5]) {
        let fill = self.ceiling("fill");
        let linear = self.ceiling("store, neighbours in line");
        let strided = self.ceiling("store, eight lanes at 1 KiB from the next");
        let is_wide = rules::needs_wide_runs(fill, linear, strided);
        let mut decisions = vec![Decision {
            rule: "where linear stores are as fast as filling and those of eight lanes are not, long runs get 32 lanes",
            microseconds: vec![fill, linear, strided],
            applies: is_wide,
            result: match is_wide {
                true => "runs of 32 samples and more get 32 lanes".to_owned(),
                false => "lanes follow from the times of kernels".to_owned(),
            },
        }];
        let for_kernels = self.ceiling("barrier between kernels");
        let for_all = self.ceiling("barrier from all to all");
        let needs_scopes = rules::needs_scopes(for_all, for_kernels);
        decisions.push(Decision {
            rule: "where a barrier for all takes 2 µs more than one for kernels, the users of results are named",
            microseconds: vec![for_all, for_kernels],
            applies: needs_scopes,
            result: match needs_scopes {
                true => "scopes by default".to_owned(),
                false => "scopes only where applications name them".to_owned(),
            },
        });
        decisions.extend(self.streaming());
        let today = self.engine.run_lanes;
        let mut lanes = [0, 1, 2, 3, 4].map(|class| today.of_class(class));
        for (class, of_kernels) in shares.iter().enumerate() {
            let today = lanes[class];
            let mut all = Vec::from_iter(LANES.iter().enumerate().map(|(index, &lanes)| {
                let mean = |which: usize| {
                    let times = of_kernels
                        .iter()
                        .map(|of_lanes| of_lanes[index].microseconds[which]);
                    times.sum::<f64>() / of_kernels.len().max(1) as f64
                };
                (lanes, Timed::new(mean(0), mean(1)))
            }));
            all.sort_by_key(|(lanes, _)| *lanes != today);
            if !of_kernels.is_empty() {
                lanes[class] = rules::lanes(&all);
            }
            let is_long = RunLanes::CLASSES[..class]
                .last()
                .is_some_and(|&start| start >= 32);
            if is_wide && is_long {
                lanes[class] = 32;
            }
        }
        let run_lanes = RunLanes(lanes);
        decisions.push(Decision {
            rule: "other lanes than today's must save 2 % beyond what measurements vary, on average over kernels",
            microseconds: Vec::new(),
            applies: run_lanes.0 != [0, 1, 2, 3, 4].map(|class| today.of_class(class)),
            result: format!("lanes of runs below 8, 16, 32, 128 samples and longer: {lanes:?}"),
        });
        (self.report.decisions, self.report.run_lanes) = (decisions, Some(run_lanes));
    }

    /// Whether results go past the caches, by the times of cubics over typical runs.
    fn streaming(&self) -> Option<Decision> {
        let mut rows = self.report.rows.iter();
        let cubics = Kernel::PolynomialFramesSpreadF32
            .code(Variants::default())
            .0;
        let row = rows.find(|row| row.kernel == cubics)?;
        let cached = row.today.variant.cached();
        let cached = row.finalists.iter().find(|one| one.variant == cached)?;
        let times = [cached.time.best(), row.today.time.best()];
        let streams = rules::streams(times[0], times[1]);
        Some(Decision {
            rule: "stores go past the caches where cubics are a tenth faster so",
            microseconds: times.to_vec(),
            applies: streams,
            result: match streams {
                true => "stores stay as they are: past the caches".to_owned(),
                false => "stores through the caches would do".to_owned(),
            },
        })
    }
}

fn variant_name(kernel: Kernel, variant: KernelVariant) -> &'static str {
    variant.code_of(kernel).map_or("", |(name, _)| name)
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or_default()
}
