//! The work of `tumble eval` on one input: its clips are evaluated and written into one file, as motion files
//! with their skeletons, as rotations that are streamed as they come, or as whole poses.

use std::borrow::Cow;

use glam::{DVec3, Quat, Vec3};
use serde::Serialize;
use tumble::{
    Channel, Device, Engine, Error, Layout, Quantity, SampleTimes, ScalarQuantity, Timeline,
    TrackSet,
};
use tumble_formats::dialect::write::WrittenDialect;
use tumble_formats::end_frame::{EndFrame, EndRows, sample_to_end};
use tumble_formats::format::{Document, FormatOption, MotionOptions, ResultShape};
use tumble_formats::motion::{Joint, Motion, SampledClip, Transform};
use tumble_formats::origin::origin_of;
use tumble_formats::poses::{Poses, SCALAR, TRANSFORM, WORLD};
use tumble_formats::printable::printable;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::root_motion::{
    RootMotionRule, keys_with_root_motion, track_samples, with_root_motion,
};
use tumble_formats::sample::{MethodChoice, Samples};
use tumble_formats::world::{HierarchyError, world};
use tumble_formats::{Code, Diagnostic};

use crate::arguments::device::{OpenedDevice, stream_chunk};
use crate::arguments::interpolation::{CurveChoice, curve_warning};
use crate::arguments::options::ResultKind;
use crate::arguments::output::PoseKind;
use crate::arguments::results::{check_whole, document_to_rewrite};
use crate::arguments::robot::{RobotFrames, RobotReport, or_engine_error};
use crate::arguments::time::{ClipFrames, SampleChoice};
use crate::batch::entry::FrameNotes;
use crate::batch::pipeline::{ClipWork, EvaluatedResult, Pipeline};
use crate::batch::room;
use crate::batch::target::{ResultTarget, WrittenFile};
use crate::commands::eval::arguments::Arguments;
use crate::messages::drawn::check_has_tracks;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Whether the rotations of a clip are evaluated at once into memory, or in chunks that are written one after another.
#[derive(Debug, Clone, Copy)]
enum Delivery {
    InMemory,
    InChunks,
}

/// The report of one result for `--json`.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct EvaluationReport {
    format: &'static str,
    tracks: usize,
    frames: usize,
    /// The times of the first and the last frame, seconds; null if there are none.
    first_time: Option<f64>,
    last_time: Option<f64>,
    /// Times between keys that are too far apart, which were left out or held; nothing without `--max-gap`.
    #[serde(skip_serializing_if = "Option::is_none")]
    in_gaps: Option<usize>,
    #[serde(flatten)]
    notes: FrameNotes,
    /// The numbers that were written for each rotation, as `--quantity` names them.
    quantity: &'static str,
    /// The order of a quaternion's components as written; null where none are written, or where the
    /// format fixes the order.
    order: Option<&'static str>,
    /// As `--method` names it.
    method: &'static str,
    device: String,
    /// The report of a robot's motion in the layout of another program; absent for other results.
    #[serde(skip_serializing_if = "Option::is_none")]
    robot: Option<RobotReport>,
}

impl EvaluationReport {
    /// How many were evaluated.
    pub(crate) fn rotations(&self) -> u64 {
        self.tracks as u64 * self.frames as u64
    }
}

/// Evaluates all inputs of a pipeline; returns the number of rotations in the results that are kept.
pub(super) fn evaluate_all(
    arguments: &Arguments,
    samples: &SampleChoice,
    device: &mut OpenedDevice,
    pipeline: &mut Pipeline<'_>,
) -> u64 {
    let mut rotations = 0;
    while let Some(work) = pipeline.next_work() {
        let mut job = EvaluationJob {
            arguments,
            device,
            samples,
            work: &work,
            in_gaps: 0,
            left_out: None,
        };
        let made = job.evaluate();
        let of_this = made.as_ref().map_or(0, |(_, report)| report.rotations());
        if pipeline.keep(&work, made) {
            rotations += of_this;
        }
    }
    rotations
}

/// The evaluation of some clips of an input, into one file.
struct EvaluationJob<'a> {
    arguments: &'a Arguments,
    device: &'a mut OpenedDevice,
    samples: &'a SampleChoice,
    work: &'a ClipWork,
    /// Times in gaps of the clips that are being evaluated.
    in_gaps: usize,
    /// The seconds after the last frame of one of these clips that are left out; `None` if the command line asks for
    /// this.
    left_out: Option<f64>,
}

impl EvaluationJob<'_> {
    /// Evaluates the clips of a file, and writes it.
    fn evaluate(&mut self) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let work = self.work;
        let (name, clips, target) = (&*work.name, &*work.clips(), &work.target);
        if let Some(dialect) = self.arguments.dialect.chosen() {
            return self.robot(dialect, name, clips);
        }
        for clip in clips {
            self.check_interpolation(name, clip)?;
            self.note_curves(name, clip)?;
        }
        let output = &self.arguments.output;
        let kind = match output.poses() {
            _ if self.is_baked(target) => ResultKind::Baked,
            _ if self.is_motion(clips, target) => ResultKind::Motion,
            _ if output.scalars().is_some() => ResultKind::Poses,
            Some(_) => ResultKind::Poses,
            None => ResultKind::Rotations,
        };
        let refused = |failure: Failure| failure.of(name);
        self.arguments
            .check(kind, target.format())
            .map_err(refused)?;
        if kind == ResultKind::Baked {
            return self.bake(name, clips, target);
        }
        if matches!(kind, ResultKind::Rotations | ResultKind::Poses) && output.scalars().is_none() {
            let remedy = "write NPZ, CSV or Parquet, or add --quantity scalars";
            let mut each = clips.iter();
            each.try_for_each(|clip| check_has_tracks(name, clip, remedy))?;
        }
        let end_frame = (self.arguments.end_frame)
            .for_result(self.arguments.result(kind, target.format()).sampled())
            .map_err(|message| refused(Failure::usage(message)))?;
        let tracks = &self.arguments.inputs.tracks;
        if kind == ResultKind::Motion {
            let some = self.arguments.command_line.has("tracks");
            let more = self.arguments.root.rule() == RootMotionRule::Extract;
            let some = some.then_some("some tracks make");
            document_to_rewrite(
                work,
                some.or(more.then_some("a joint with root motion makes")),
            )?;
            let selected = clips
                .iter()
                .map(|&clip| tracks.select_with_ancestors(clip, name));
            let selected: Vec<Cow<'_, Motion>> = selected.collect::<Result<_, Failure>>()?;
            let clips: Vec<&Motion> = selected.iter().map(|clip| &**clip).collect();
            return self.motion(name, &clips, end_frame, target);
        }
        let [clip] = clips else {
            let message =
                format!("{name}: --quantity needs a single animation; choose one with --animation");
            return Err(Failure::usage(message));
        };
        // Writers of clips, which returned above, report the data that they cannot store themselves.
        if let Some(quantity) = output.scalars() {
            self.warn_of_lost_channels(clips);
            return self.scalars(name, clip, quantity, end_frame, target);
        }
        if let (ResultKind::Poses, Some(poses)) = (kind, output.poses()) {
            self.warn_of_lost_channels(clips);
            return self.poses(name, clip, poses, end_frame, target);
        }
        // Tracks are selected before the warning is printed, so that an unknown track is the only message.
        let selected = tracks.select(clip, name)?;
        self.warn_of_lost_channels(clips);
        self.rotations(name, &selected, end_frame, target)
    }

    /// Warns if the evaluated curves are less smooth than their method promises.
    fn note_curves(&self, name: &str, clip: &Motion) -> Result<(), Failure> {
        let curve = self.curve();
        let Some(method) = curve.method.0 else {
            return Ok(()); // No file asks for such a method.
        };
        let selected = self.arguments.inputs.tracks.select(clip, name)?;
        if let Some(warning) = curve_warning(name, &selected, &curve.interpolation(method)) {
            words::warn_of(warning);
        }
        Ok(())
    }

    /// Says which channels of clips are not among the numbers that are written.
    fn warn_of_lost_channels(&self, clips: &[&Motion]) {
        let has = |says: fn(&Motion) -> bool| clips.iter().any(|clip| says(clip));
        let mut lost = Vec::new();
        let output = &self.arguments.output;
        let is_of_scalars = output.scalars().is_some();
        if is_of_scalars && has(|clip| clip.set.track_count() > 0) {
            lost.push("the rotations");
        }
        if output.poses().is_none() {
            if has(|clip| clip.has_keys_of(Channel::Translation)) {
                lost.push("the translations");
            }
            if has(|clip| clip.has_keys_of(Channel::Scale)) {
                lost.push("the scales");
            }
        }
        let first = clips
            .iter()
            .find_map(|clip| clip.set.scalar(0))
            .filter(|_| !is_of_scalars);
        let scalars = first.map(|first| format!("the scalars (`{}` …)", printable(first.name)));
        lost.extend(scalars.as_deref());
        if !lost.is_empty() {
            let message = format!(
                "--quantity {} is all that the result contains; left out: {}; -o FILE.npz stores them too",
                self.arguments.output.name(),
                lost.join(", ")
            );
            let target = self.work.target.to_string();
            words::warn_of(Diagnostic::new(target, Code::NoRoom, message));
        }
    }

    /// Refuses options that have no effect on the methods of a clip's channels.
    fn check_interpolation(&self, name: &str, clip: &Motion) -> Result<(), Failure> {
        let (options, method) = (self.arguments.interpolation, self.arguments.method);
        options.check_clip(name, clip, &[method])
    }

    /// The samples of a clip.
    fn clip_frames(
        &self,
        clip: &Motion,
        end_frame: EndFrame,
        name: &str,
    ) -> Result<ClipFrames, Failure> {
        let outside = self.arguments.interpolation.outside();
        self.samples
            .of_clip(clip, &self.arguments.gaps, outside, end_frame, name)
    }

    /// With `--explain-route`, prints the route by which a clip's rotations are evaluated: as a stream where they
    /// are written chunk by chunk.
    fn explain(
        &mut self,
        name: &str,
        clip: &Motion,
        frames: &SampleTimes,
        layout: Layout,
        delivery: Delivery,
    ) -> Result<(), Failure> {
        if !self.arguments.explain_route {
            return Ok(());
        }
        let (set, tracks) = (&clip.set, clip.set.track_count());
        let interpolations = self.curve().channel_methods().interpolations(clip);
        let explain = |engine: &Engine| {
            let request = engine.request(set, interpolations.clone(), frames);
            let request = request.layout(layout);
            match delivery {
                Delivery::InMemory => request.explain(),
                Delivery::InChunks => request.explain_stream(stream_chunk(layout, tracks)),
            }
        };
        let timeline = frames.resolve(tracks, set.time_span());
        let routes = timeline
            .map_err(Error::from)
            .and_then(|timeline| {
                self.device.choose(tracks * timeline.len())?;
                self.device.work(explain)
            })
            .map_err(|error| Failure::evaluating(name, &error))?;
        let lines = routes.lines();
        lines.for_each(|route| words::note(&format!("{name}: {route}")));
        Ok(())
    }

    /// All channels of a clip.
    fn sample(
        &mut self,
        name: &str,
        clip: &Motion,
        samples: &ClipFrames,
    ) -> Result<Samples, Failure> {
        let frames = &samples.frames;
        let curve = self.curve();
        let tracks = clip.set.track_count();
        let timeline = frames.resolve(tracks, clip.set.time_span());
        let found = timeline.map_err(Error::from).and_then(|timeline| {
            self.device.choose(tracks * timeline.len())?;
            self.device.work(|engine| {
                let methods = curve.channel_methods();
                sample_to_end(&methods, engine, clip, frames, samples.end)
            })
        });
        let mut found = found.map_err(|error| Failure::evaluating(name, &error))?;
        if self.arguments.inputs.reading.robot()?.is_some() {
            let of_clip = (clip, &*found.times);
            let dialect = &self.arguments.dialect;
            dialect.limit_scalars(self.work, of_clip, &mut found.scalars, None)?;
        }
        Ok(found)
    }

    /// How a result was made, for formats that store it.
    fn notes(&self) -> Result<Vec<(&'static str, String)>, Failure> {
        let mut notes = vec![
            ("method", self.arguments.method.to_string()),
            ("input", self.work.origin()),
        ];
        let sha256 = self.work.input.file.sha256().map(str::to_owned);
        // A file that changed since it was read has another hash, so that is an error.
        self.work.input.file.check_unchanged()?;
        notes.extend(sha256.map(|hash| ("input_sha256", hash)));
        Ok(notes)
    }

    /// The curves that are evaluated.
    fn curve(&self) -> CurveChoice {
        let (method, options) = (self.arguments.method, self.arguments.interpolation);
        CurveChoice::of_rotations(method, options).of(self.arguments.output.quantity())
    }

    /// The result of this work, and the report about it. The message says which method the channels state, if it is one.
    fn evaluated(
        &self,
        (tracks, frames, span): (usize, usize, Option<(f64, f64)>),
        written: WrittenFile,
        order: Option<ComponentOrder>,
    ) -> (EvaluatedResult, EvaluationReport) {
        let methods = self.curve().channel_methods();
        let mut of_clips = self
            .work
            .clips()
            .into_iter()
            .map(|clip| methods.name_of(clip));
        let first = of_clips.next().flatten();
        let stated = first.filter(|_| {
            self.arguments.method == MethodChoice::AUTHORED && of_clips.all(|other| other == first)
        });
        let stated = stated.map_or(String::new(), |method| format!(" ({method})"));
        let scalars: usize = (self.work.clips().iter())
            .map(|clip| clip.set.scalar_count())
            .sum();
        let counted = match tracks {
            0 if scalars > 0 => words::count(scalars, "scalar"),
            _ => words::count(tracks, "track"),
        };
        self.reported(&counted, &stated, (tracks, frames, span), written, order)
    }

    /// As [`Self::evaluated`], with another noun for the samples in the message; they are no rotations.
    fn evaluated_as(
        &self,
        counted: &str,
        extent: (usize, usize, Option<(f64, f64)>),
        written: WrittenFile,
        order: Option<ComponentOrder>,
    ) -> (EvaluatedResult, EvaluationReport) {
        self.reported(counted, "", extent, written, order)
    }

    fn reported(
        &self,
        counted: &str,
        stated: &str,
        (tracks, frames, span): (usize, usize, Option<(f64, f64)>),
        written: WrittenFile,
        order: Option<ComponentOrder>,
    ) -> (EvaluatedResult, EvaluationReport) {
        let (work, device) = (self.work, &self.device.label);
        let in_gaps = match self.in_gaps {
            0 => String::new(),
            count => format!(" ({count} in gaps {})", self.arguments.gaps.done_in_gaps()),
        };
        let left_out = match self.left_out {
            Some(seconds) => {
                format!(" ({seconds:.3} s of the clip, after the last frame, are left out)")
            }
            None => String::new(),
        };
        let assumed = work.clips();
        let mut assumed = assumed
            .iter()
            .filter_map(|clip| self.samples.assumed_rate(clip));
        let assumed_fps = assumed.next().map(|rate| rate.to_string());
        let assumed = assumed_fps.as_ref().map_or(String::new(), |rate| {
            format!(" ({rate} fps, because its keys have no rate)")
        });
        let counted_frames = words::count(frames, "frame");
        let extent = match work.clips().len() {
            0 | 1 => format!("{counted} × {counted_frames}"),
            clips => format!("{clips} clips of {counted}, {counted_frames} in all"),
        };
        let done = format!(
            "{extent}{assumed}{in_gaps}{left_out}, {}{stated}",
            self.arguments.method,
        );
        let report = EvaluationReport {
            format: work.target.format().name,
            tracks,
            frames,
            first_time: span.map(|span| span.0),
            in_gaps: self
                .arguments
                .command_line
                .has("max_gap")
                .then_some(self.in_gaps),
            last_time: span.map(|span| span.1),
            notes: FrameNotes::new(assumed_fps, self.left_out),
            quantity: self.arguments.output.name(),
            order: order.map(ComponentOrder::name),
            method: self.arguments.method.name(),
            device: device.clone(),
            robot: None,
        };
        let result = EvaluatedResult {
            frames: report.notes.clone(),
            ..work.result(written, &done, Some(device))
        };
        (result, report)
    }
}

impl EvaluationJob<'_> {
    /// Whether the result is the input's file with other keys.
    fn is_baked(&self, target: &ResultTarget) -> bool {
        // With --tracks, the result is a new file.
        self.arguments.output.is_rotations()
            && !self.arguments.command_line.has("tracks")
            && self.arguments.root.rule() != RootMotionRule::Extract
            && self.keeps(target)
    }

    /// Whether the input's file can be written again.
    fn keeps(&self, target: &ResultTarget) -> bool {
        let document = self.work.input.loaded.document.as_ref();
        self.work.input.loaded.adjustment.is_none()
            && document.is_some_and(|document| document.writes(target.format()))
    }

    /// Whether the result is a motion file: of a format that holds nothing else, or of a clip that
    /// is more than rotations.
    fn is_motion(&self, clips: &[&Motion], target: &ResultTarget) -> bool {
        self.arguments.output.is_rotations() && target.format().takes_motion(clips)
    }

    /// Clips as a separate file.
    fn motion(
        &mut self,
        name: &str,
        clips: &[&Motion],
        end_frame: EndFrame,
        target: &ResultTarget,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let times: Vec<ClipFrames> = clips
            .iter()
            .map(|clip| self.clip_frames(clip, end_frame, name))
            .collect::<Result<_, _>>()?;
        self.written(name, clips, &times, target, None)
    }

    /// The clip after its keys were changed to the requested root motion.
    fn treated_keys<'b>(
        &mut self,
        name: &str,
        clip: &'b Motion,
    ) -> Result<Cow<'b, Motion>, Failure> {
        let root = &self.arguments.root;
        if root.rule() == RootMotionRule::Keep {
            return Ok(Cow::Borrowed(clip));
        }
        let engine = Engine::new(Device::Cpu).map_err(|error| Failure::evaluating(name, &error))?;
        let samples = track_samples(clip, &engine);
        let samples = samples.map_err(|error| Failure::evaluating(name, &error))?;
        root.say_assumption(name, clip);
        let options = root.options(clip, self.arguments.inputs.reading.robot()?.is_some());
        let treated = keys_with_root_motion(clip, &samples, &options, root.rule());
        treated
            .map(Cow::Owned)
            .map_err(|error| root.failure(name, &error))
    }

    /// The motion of a robot in the layout of another program.
    fn robot(
        &mut self,
        dialect: &WrittenDialect,
        name: &str,
        clips: &[&Motion],
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let [clip] = clips else {
            let message = format!(
                "{name}: {} has one clip; choose it with --animation",
                dialect.name
            );
            return Err(Failure::usage(message));
        };
        let Some(robot) = self.arguments.inputs.reading.robot()? else {
            return Err(Failure::usage("--dialect needs --robot"));
        };
        let robot = self.arguments.dialect.robot_of(dialect, &robot)?;
        self.check_interpolation(name, clip)?;
        self.check_scale(name, clip, false)?;
        let clip = &*self.treated_keys(name, clip)?;
        let samples = self.clip_frames(clip, EndFrame::LeaveOut, name)?;
        self.left_out = samples.left_out;
        // Memory for the pose and the velocity of each body, and for the same in the result.
        let bodies = robot.tree.bodies().len();
        let timeline = room::in_memory(name, &clip.set, &samples.frames, 12 * bodies.max(1))?;
        let methods = self.curve().channel_methods();
        let frames = RobotFrames {
            frames: &samples.frames,
            rate: samples.rate,
            methods,
        };
        let arguments = &self.arguments.dialect;
        let scalars = clip.set.scalar_count();
        let device = &mut *self.device;
        let found = arguments.evaluate(dialect, &robot, (name, clip), &frames, |run| {
            device.choose(scalars * timeline.len())?;
            device.work(|engine| or_engine_error(run(engine)))?
        })?;
        let notes = self.notes()?;
        let (written, report) = arguments.write(
            dialect,
            &robot,
            (self.work, clip),
            (&found, frames.rate),
            notes,
        )?;
        let extent = (report.body_count(), found.times.len(), span(&timeline));
        let counted = report.text();
        let (result, evaluated) = self.evaluated_as(&counted, extent, written, None);
        let robot = EvaluationReport {
            order: report.quaternion(),
            quantity: "robot",
            robot: Some(report),
            ..evaluated
        };
        Ok((result, robot))
    }

    /// Counts the times in gaps, and tells of ends between two frames.
    fn note_frames(&mut self, frames: &[ClipFrames], target: &ResultTarget) {
        self.in_gaps = frames.iter().map(|of_clip| of_clip.in_gaps).sum();
        if self.arguments.end_frame.is_chosen() {
            return;
        }
        self.left_out = frames.iter().find_map(|of_clip| of_clip.left_out);
        let warning = frames.iter().find_map(|of_clip| {
            let (end, rate) = of_clip.end.zip(of_clip.rate)?;
            end.warning(rate, of_clip.time_offset, &target.to_string())
        });
        if let Some(warning) = warning {
            words::warn_of(warning);
        }
    }

    /// The input's file, everything kept but the keys of some of its animations.
    fn bake(
        &mut self,
        name: &str,
        clips: &[&Motion],
        target: &ResultTarget,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let (
            Some(document),
            &SampleChoice::Rate {
                rate,
                start: None,
                end: None,
                from_zero: false,
            },
        ) = (self.work.input.loaded.document.clone(), self.samples)
        else {
            return Err(Failure::usage(format!(
                "{name}: in a copy of the file, animations keep their lengths; leave out --times, --at, --start, --end \
                 and --from-zero (`tumble convert --start` cuts a file first), or write another format"
            )));
        };
        if self.arguments.command_line.has("max_gap") {
            return Err(Failure::usage(format!(
                "{name}: in a copy of the file, animations keep all frames; leave out --max-gap, or write another \
                 format"
            )));
        }
        check_whole(self.work)?;
        let end_frame = self.arguments.end_frame.for_document(&*document);
        let end_frame =
            end_frame.map_err(|message| Failure::usage(format!("{name}: {message}")))?;
        let at = |clip: &&Motion| {
            let frames = document.frames(clip.index, rate.of(clip));
            let frames = frames.map_err(|diagnostic| Failure::input(&diagnostic, ""))?;
            ClipFrames::at_rate(clip, frames, end_frame, name)
        };
        let times: Vec<ClipFrames> = clips.iter().map(at).collect::<Result<_, Failure>>()?;
        self.written(name, clips, &times, target, Some(&*document))
    }

    fn options(&self, target: &ResultTarget) -> MotionOptions {
        MotionOptions {
            sequence: self.arguments.output.sequence(),
            linear: self.arguments.linear.clone(),
            order: self.arguments.order(),
            box_length: self.work.input.loaded.box_length,
            ..target.motion_options()
        }
    }

    /// Samples clips and writes them: into the input's file, if it is given, else into a new one.
    fn written(
        &mut self,
        name: &str,
        clips: &[&Motion],
        frames: &[ClipFrames],
        target: &ResultTarget,
        document: Option<&dyn Document>,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        self.note_frames(frames, target);
        let mut all: Vec<(Cow<'_, Motion>, Samples)> = Vec::new();
        let root = &self.arguments.root;
        for (clip, samples) in clips.iter().zip(frames) {
            if document.is_some() && root.rule() != RootMotionRule::Keep {
                root.check_kept(name, clip)?;
            }
            let frames = &samples.frames;
            let boxes = target.format().takes(FormatOption::BoxLength);
            self.check_scale(name, clip, boxes)?;
            // Memory for rotations, translations and scales, and for the same in the written form.
            room::in_memory(name, &clip.set, frames, 6)?;
            self.explain(name, clip, frames, Layout::FrameMajor, Delivery::InMemory)?;
            let mut found = self.sample(name, clip, samples)?;
            if samples.is_held() {
                found.times = samples.written_times(clip, name)?.times(0).collect();
            }
            if root.rule() == RootMotionRule::Keep {
                all.push((Cow::Borrowed(*clip), found));
                continue;
            }
            root.say_assumption(name, clip);
            let options = root.options(clip, self.arguments.inputs.reading.robot()?.is_some());
            let treated = with_root_motion(clip, &found, &options, root.rule());
            let (clip, found) = treated.map_err(|error| root.failure(name, &error))?;
            all.push((Cow::Owned(clip), found));
        }
        let notes = self.notes()?;
        let sampled: Vec<SampledClip<'_>> = (all.iter().zip(frames))
            .map(|((clip, samples), frames)| samples.of(clip, frames.rate, &notes))
            .collect();
        let indices = clips.iter().map(|clip| clip.index);
        let written = target.write_clips(&sampled, indices, document, &self.options(target))?;
        let tracks = all.iter().map(|(clip, _)| clip.set.track_count()).max();
        let samples = all.iter().map(|(_, samples)| samples.times.len()).sum();
        let times = || all.iter().flat_map(|(_, samples)| &samples.times).copied();
        let span = times().reduce(f64::min).zip(times().reduce(f64::max));
        let format = target.format();
        let writer = format
            .takes(FormatOption::Order)
            .then_some(format.write.as_ref())
            .flatten();
        let order = writer.map(|write| self.arguments.order().unwrap_or(write.order));
        let size = (tracks.unwrap_or(0), samples, span);
        Ok(self.evaluated(size, written, order))
    }

    /// Refuses to scale a clip that goes nowhere. `boxes`: the result has the length of boxes.
    pub(super) fn check_scale(
        &self,
        name: &str,
        clip: &Motion,
        boxes: bool,
    ) -> Result<(), Failure> {
        let is_placed = clip.has_vectors()
            || clip
                .skeleton
                .iter()
                .any(|joint| joint.rest.translation != Vec3::ZERO)
            || boxes && self.work.input.loaded.box_length.is_some();
        if self.arguments.command_line.has("scale") && !is_placed {
            return Err(Failure::usage(format!(
                "{name}: --scale has no effect on a clip without translations; leave it out"
            )));
        }
        Ok(())
    }
}

impl EvaluationJob<'_> {
    /// The rotations of one clip, or values derived from them.
    fn rotations(
        &mut self,
        name: &str,
        clip: &Motion,
        end_frame: EndFrame,
        target: &ResultTarget,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let (arguments, set) = (self.arguments, &clip.set);
        let samples = self.clip_frames(clip, end_frame, name)?;
        self.note_frames(std::slice::from_ref(&samples), target);
        if samples.is_held() && arguments.output.quantity() != Quantity::Rotation {
            return Err(Failure::usage(format!(
                "{name}: a rotation that is held has no velocity; leave times in gaps out (--in-gaps leave-out)"
            )));
        }
        let frames = &samples.frames;
        let timeline = samples.written_times(clip, name)?;
        let encoding = arguments.output.encoding(arguments.encoding);
        target.has_room(name, set.track_count(), timeline.len(), encoding)?;
        let requested = arguments.layout;
        let mut notes = self.notes()?;
        notes.extend(samples.rate.map(|rate| ("rate", rate.to_string())));
        let format = target.results()?;
        let order = arguments.order().unwrap_or(format.order);
        let order = encoding.is_quaternion().then_some(order);
        notes.extend(order.map(|order| ("order", order.name().to_owned())));
        let result = ResultShape {
            name,
            set,
            timeline: &timeline,
            time_offset: clip.time_offset,
            layout: format.layout.unwrap_or(requested),
            order,
            encoding,
            notes: &notes,
        };
        self.explain(name, clip, frames, result.layout, Delivery::InChunks)?;
        let methods = self.curve().channel_methods();
        let size = (set.track_count(), timeline.len());
        let extent = (size.0, size.1, span(&timeline));
        let quantity = arguments.output.quantity();
        let rows = |engine: &Engine, at: &SampleTimes| {
            match quantity {
                Quantity::Rotation => methods.rotations(engine, clip, at, result.layout),
                // Velocities are rows of four numbers too.
                _ => {
                    let rates = methods.rates(engine, clip, at, result.layout)?;
                    Ok(rates.into_iter().map(Quat::from_vec4).collect())
                }
            }
        };
        let ends = samples.end.map(|end| SampleTimes::at(vec![end.at]));
        let frame_count = timeline.len() - usize::from(ends.is_some());
        let ends = ends.map(|at| self.device.work(|engine| rows(engine, &at)));
        let ends = ends.transpose();
        let ends = ends.map_err(|error| Failure::evaluating(name, &error))?;
        let ends = EndRows::new(ends.unwrap_or_default(), result.layout, frame_count);
        let interpolations = methods.interpolations(clip);
        let written = target.write_rotations(&result, ends, |sink| {
            self.device
                .stream(set, &interpolations, frames, result.layout, sink)
        })?;
        Ok(self.evaluated(extent, written, order))
    }

    /// The scalars of a clip, `[frame][scalar]`, or their velocities.
    fn scalars(
        &mut self,
        name: &str,
        clip: &Motion,
        quantity: ScalarQuantity,
        end_frame: EndFrame,
        target: &ResultTarget,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let on = format!("--quantity {}", self.arguments.output.name());
        let options = [("tracks", "--tracks"), ("explain_route", "--explain-route")];
        self.arguments
            .command_line
            .refuse(&options, &on, "it has all scalars; leave it out")?;
        let count = clip.set.scalar_count();
        if count == 0 {
            return Err(Failure::usage(format!(
                "{name}: has no scalars, such as the joints of a robot; leave out --quantity {}",
                self.arguments.output.name()
            )));
        }
        let samples = self.clip_frames(clip, end_frame, name)?;
        self.note_frames(std::slice::from_ref(&samples), target);
        if samples.is_held() && quantity != ScalarQuantity::Value {
            return Err(Failure::usage(format!(
                "{name}: a number that is held has no velocity; leave times in gaps out (--in-gaps leave-out)"
            )));
        }
        let timeline = samples.written_times(clip, name)?;
        let methods = self.curve().channel_methods();
        // A set that contains only the names of the rows.
        let mut set = TrackSet::new();
        for index in 0..count {
            let scalar = clip.set.scalar(index).map_or("", |scalar| scalar.name);
            set.push(scalar, &[0.0], &[Quat::IDENTITY])
                .map_err(|error| Failure::evaluating(name, &error.into()))?;
        }
        room::in_memory(name, &set, &samples.frames, 1)?;
        let mut all = vec![samples.frames.clone()];
        all.extend(samples.end.map(|end| SampleTimes::at(vec![end.at])));
        let mut evaluated = |quantity: ScalarQuantity| {
            let mut numbers = Vec::new();
            for frames in &all {
                let device = &mut *self.device;
                let found = device.choose(count * timeline.len()).and_then(|()| {
                    device.work(|engine| methods.scalars(engine, clip, frames, quantity))
                });
                numbers.extend(found.map_err(|error| Failure::evaluating(name, &error))?);
            }
            Ok::<Vec<f32>, Failure>(numbers)
        };
        let mut numbers = evaluated(quantity)?;
        if self.arguments.inputs.reading.robot()?.is_some() {
            let times: Vec<f64> = timeline.times(0).collect();
            let (dialect, of_clip) = (&self.arguments.dialect, (clip, &*times));
            match quantity {
                ScalarQuantity::Value => {
                    dialect.limit_scalars(self.work, of_clip, &mut numbers, None)?;
                }
                _ => {
                    let mut values = evaluated(ScalarQuantity::Value)?;
                    dialect.limit_scalars(self.work, of_clip, &mut values, Some(&mut numbers))?;
                }
            }
        }
        if quantity == ScalarQuantity::Value {
            for (index, number) in numbers.iter_mut().enumerate() {
                *number = (f64::from(*number) + clip.scalar(index % count).origin) as f32;
            }
        }
        let rows = Poses {
            set: &set,
            timeline: &timeline,
            time_offset: clip.time_offset,
            components: &SCALAR,
            numbers: &numbers,
            origins: &[],
        };
        let write = target.results()?.poses;
        let written = target.prepare(|out| write(&rows, out))?;
        let extent = (count, timeline.len(), span(&timeline));
        let counted = words::count(count, "scalar");
        Ok(self.evaluated_as(&counted, extent, written, None))
    }

    /// Whole poses, `[frame][track]`: along the clip's skeleton, or of the boxes of a chain, each of
    /// which hangs at the end of the one before it. All tracks are evaluated, since the position of a
    /// joint depends on its ancestors; the selected ones are written.
    fn poses(
        &mut self,
        name: &str,
        clip: &Motion,
        kind: PoseKind,
        end_frame: EndFrame,
        target: &ResultTarget,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        let clip = &*self.with_parents(clip, name)?;
        let set = &clip.set;
        let samples = self.clip_frames(clip, end_frame, name)?;
        self.note_frames(std::slice::from_ref(&samples), target);
        let frames = &samples.frames;
        let timeline = samples.written_times(clip, name)?;
        // The rotations, and twice the size of their results.
        room::in_memory(name, set, frames, 8)?;
        self.check_scale(name, clip, true)?;
        self.explain(name, clip, frames, Layout::FrameMajor, Delivery::InMemory)?;
        let (mut numbers, mut origins) = if clip.is_chain() {
            let mut numbers = self.chain(name, clip, frames, kind)?;
            if let Some(end) = samples.end {
                numbers.extend(self.chain(name, clip, &SampleTimes::at(vec![end.at]), kind)?);
            }
            (numbers, Vec::new())
        } else {
            let samples = self.sample(name, clip, &samples)?;
            numbers_of(clip, &samples, kind)
                .map_err(|error| Failure::new(ALL_INPUTS, format!("{name}: {error}")))?
        };
        let mut components = match kind {
            PoseKind::World => WORLD.to_vec(),
            PoseKind::Transform => TRANSFORM.to_vec(),
        };
        let width = components.len();
        let order = self.arguments.order().unwrap_or_default();
        if let Some(index) = components.iter().position(|name| *name == "x")
            && order == ComponentOrder::Wxyz
        {
            components[index..index + 4].rotate_right(1);
            let poses = numbers.chunks_exact_mut(width);
            poses.for_each(|pose| pose[index..index + 4].rotate_right(1));
        }
        let selected = self.arguments.inputs.tracks.of(clip, name)?;
        if let Some(tracks) = &selected {
            let frames = numbers.chunks_exact(width * set.track_count());
            let pose = |frame: &[f32], track: usize| frame[track * width..][..width].to_vec();
            let of_tracks =
                frames.flat_map(|frame| tracks.iter().flat_map(move |&track| pose(frame, track)));
            numbers = of_tracks.collect();
            if !origins.is_empty() {
                origins = tracks.iter().map(|&track| origins[track]).collect();
            }
        }
        let selection = selected.map(|tracks| set.select(tracks)).transpose();
        let subset = selection.map_err(|error| Failure::evaluating(name, &error.into()))?;
        let set = subset.as_ref().unwrap_or(set);
        let size = (set.track_count(), timeline.len(), span(&timeline));
        let poses = Poses {
            set,
            timeline: &timeline,
            time_offset: clip.time_offset,
            components: &components,
            numbers: &numbers,
            origins: &origins,
        };
        let write = target.results()?.poses;
        let written = target.prepare(|out| write(&poses, out))?;
        Ok(self.evaluated(size, written, Some(order)))
    }

    /// The clip; one with translations and without a skeleton gets the parents of `--parents`.
    fn with_parents<'a>(&self, clip: &'a Motion, name: &str) -> Result<Cow<'a, Motion>, Failure> {
        let refused = |message: String| Failure::usage(format!("{name}: {message}"));
        let parents = self.arguments.output.parents(clip.set.track_count());
        let Some(parents) = parents.map_err(refused)? else {
            return Ok(Cow::Borrowed(clip));
        };
        if !clip.skeleton.is_empty() || clip.is_world {
            let message = "has a skeleton, or poses in the world, already; leave out --parents";
            return Err(refused(message.to_owned()));
        }
        if !clip.has_vectors() {
            // Tracks without translations are drawn as boxes of a chain, which need no skeleton.
            return Ok(Cow::Borrowed(clip));
        }
        let rest = Transform::default();
        let mut with_parents = clip.clone();
        with_parents.skeleton = (parents.into_iter())
            .map(|parent| Joint { parent, rest })
            .collect();
        if with_parents.has_unplaced_joints() {
            let message = "joints with a parent have no translations; their positions are those of their parents";
            words::warn_of(Diagnostic::new(name, Code::NoOffsets, message));
        }
        Ok(Cow::Owned(with_parents))
    }

    /// The poses of boxes that hang at the ends of others.
    fn chain(
        &mut self,
        name: &str,
        clip: &Motion,
        frames: &SampleTimes,
        kind: PoseKind,
    ) -> Result<Vec<f32>, Failure> {
        let set = &clip.set;
        let (tracks, length) = (
            set.track_count(),
            self.work.input.loaded.box_length.unwrap_or(1.0),
        );
        let (skeleton, offsets) = self
            .arguments
            .output
            .skeleton(tracks, length)
            .map_err(|message| Failure::usage(format!("{name}: {message}")))?;
        let curve = self.curve();
        let methods = curve.channel_methods();
        let samples = frames.resolve(tracks, set.time_span());
        let evaluated = samples.map_err(Error::from).and_then(|timeline| {
            self.device.choose(tracks * timeline.len())?;
            self.device.work(|engine| {
                let local = engine
                    .request(set, methods.interpolations(clip), frames)
                    .layout(Layout::FrameMajor)
                    .evaluate()?;
                match kind {
                    PoseKind::World => {
                        let world = engine.world(&local, &skeleton)?;
                        let numbers = world.as_slice().chunks_exact(2).flat_map(|pose| {
                            let ([x, y, z, w], [px, py, pz, _]) = (pose[0], pose[1]);
                            [px, py, pz, x, y, z, w]
                        });
                        Ok(numbers.collect::<Vec<f32>>())
                    }
                    PoseKind::Transform => {
                        let hung = offsets.iter().cycle();
                        let numbers = local.as_quats().iter().zip(hung).flat_map(|(q, at)| {
                            [at.x, at.y, at.z, q.x, q.y, q.z, q.w, 1.0, 1.0, 1.0]
                        });
                        Ok(numbers.collect())
                    }
                }
            })
        });
        evaluated.map_err(|error| Failure::evaluating(name, &error))
    }
}

/// The first and the last time of a result.
fn span(timeline: &Timeline) -> Option<(f64, f64)> {
    let last = timeline.len().checked_sub(1)?;
    Some((timeline.time(0, 0)?, timeline.time(0, last)?))
}

/// The numbers of the poses of a clip with a skeleton, or with translations or scales, and the origin of
/// each track.
fn numbers_of(
    clip: &Motion,
    samples: &Samples,
    kind: PoseKind,
) -> Result<(Vec<f32>, Vec<DVec3>), HierarchyError> {
    Ok(match kind {
        PoseKind::World => {
            let poses = world(clip, samples)?;
            let tracks = clip.set.track_count();
            let of_track = |track: usize| poses.iter().skip(track).step_by(tracks);
            let mut origins = Vec::new();
            if !clip.origins.is_empty() {
                let origin = |track| origin_of(of_track(track).map(|pose| pose.position));
                origins = (0..tracks).map(origin).collect();
            }
            let numbers = poses.iter().enumerate().flat_map(|(index, pose)| {
                let origin = origins.get(index % tracks).copied().unwrap_or_default();
                let [px, py, pz] = (pose.position - origin).as_vec3().to_array();
                let [x, y, z, w] = pose.rotation.to_array();
                [px, py, pz, x, y, z, w]
            });
            (numbers.collect(), origins)
        }
        PoseKind::Transform => {
            let at = |list: &[Vec3], index: usize| list.get(index).copied();
            let numbers = samples
                .rotations
                .iter()
                .enumerate()
                .flat_map(|(index, rotation)| {
                    let [tx, ty, tz] = at(&samples.translations, index)
                        .unwrap_or(Vec3::ZERO)
                        .to_array();
                    let [sx, sy, sz] = at(&samples.scales, index).unwrap_or(Vec3::ONE).to_array();
                    let [x, y, z, w] = rotation.to_array();
                    [tx, ty, tz, x, y, z, w, sx, sy, sz]
                });
            (numbers.collect(), clip.origins.clone())
        }
    })
}
