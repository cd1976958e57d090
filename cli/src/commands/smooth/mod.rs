//! `tumble smooth`: motion without its noise.

#[allow(clippy::disallowed_methods)] // a picture
mod picture;

use std::borrow::Cow;
use std::path::PathBuf;

use clap::Args;
use clap::builder::TypedValueParser;
use glam::Vec3;
use tumble::reference::angle_between;
use tumble::{
    EulerSequence, FrameRate, Layout, SampleTimes, Smoothing, SmoothingEnds, SmoothingError,
    SmoothingKernel,
};
use tumble_formats::diagnostic::{Code, Diagnostic};
use tumble_formats::format::{Document, MotionOptions, ResultShape};
use tumble_formats::motion::{Motion, SampledClip};
use tumble_formats::sample::Samples;
use tumble_formats::smooth::{SmoothJob, SmoothMotionError};

use crate::arguments::device::{DeviceArguments, OpenedDevice};
use crate::arguments::input::Inputs;
use crate::arguments::options::CommandLine;
use crate::arguments::output::{one_of, sequence};
use crate::arguments::results::{
    ResultArguments, check_one_drawn, check_sequence, document_to_rewrite, makes_new,
};
use crate::batch::pipeline::{ClipWork, EvaluatedResult};
use crate::batch::preview::PlannedWork;
use crate::batch::room;
use crate::batch::target::{Destination, ResultTarget, WrittenFile};
use crate::commands::smooth::picture::SmoothingSubject;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::{names, words};

/// Smooth rotations and translations by a kernel over samples
#[derive(Debug, Args)]
#[command(after_help = "\
Kernels are linear, cubic, box:S and tent:S (S samples before and after), gaussian:S (standard deviation \
in samples), and savitzky-golay:RADIUS:ORDER. They filter the increments from sample to sample, so that \
constant tracks keep their bits and uniform motion does not change. --low-pass HZ is the Gaussian with \
-3 dB (half the power) at that frequency, at any rate of the samples. If keys are evenly spaced, they are the \
samples; otherwise give the rate by --fps. NPY contains only the rotations; CSV, Parquet and Arrow contain \
positions too, as of `tumble eval`. If the output has the format of the input, everything else in the \
file is kept. Stepped channels stay stepped.

Examples:
  tumble smooth walk.dat --kernel gaussian:2 -o out.npy
  tumble smooth walk.bvh --kernel savitzky-golay:4:3 -o smooth.bvh
  tumble smooth walk.bvh --low-pass 6 -o calm.bvh --plot calm.svg
  tumble smooth takes -o smooth --to glb --fps 60 --kernel linear --passes 3")]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    results: ResultArguments,
    /// The weights: linear, cubic, box:S, tent:S, gaussian:S or savitzky-golay:RADIUS:ORDER
    #[arg(short, long, value_name = "KERNEL", default_value = "gaussian:2")]
    kernel: SmoothingKernel,
    /// Instead of a kernel: keep motion below this frequency; motion at the frequency keeps 71 % of its size
    /// (-3 dB), motion at twice the frequency 25 %
    #[arg(long, value_name = "HZ", conflicts_with_all = ["kernel", "passes"], value_parser = frequency)]
    low_pass: Option<f64>,
    /// The number of passes
    #[arg(long, value_name = "N", default_value_t = 1)]
    passes: u32,
    /// How samples continue beyond the first and the last one
    #[arg(long = "edges", alias = "ends", value_name = "EDGES", default_value_t, value_parser = edges())]
    edges: SmoothingEnds,
    /// Frames per second: sample at this rate first [default: the keys are the samples]
    #[arg(long, value_name = "FPS")]
    fps: Option<FrameRate>,
    /// The sequence of axes: of the angles of BVH, three different ones [default: those of the input, else ZXY]
    #[arg(long, value_name = "AXES", value_parser = sequence)]
    sequence: Option<EulerSequence>,
    /// Also draw a picture, as .svg or .png: the speeds of the noisiest joint before and after; needs a single input
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArguments,
}

fn edges() -> impl TypedValueParser<Value = SmoothingEnds> {
    let help = |ends: SmoothingEnds| match ends {
        SmoothingEnds::Keep => "the end samples stay",
        SmoothingEnds::Parabolic => {
            "cubic: the end samples go to the parabola through the next three"
        }
        SmoothingEnds::Loop => "the last sample repeats the first",
        other => other.name(),
    };
    one_of(SmoothingEnds::ALL.map(|ends| (ends.name(), help(ends), ends)))
}

fn frequency(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(hz) if hz.is_finite() && hz > 0.0 => Ok(hz),
        _ => Err(format!(
            "invalid frequency `{text}`: expected a number of Hz above 0"
        )),
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let smoothing = Smoothing::new(arguments.kernel)
        .with_ends(arguments.edges)
        .with_passes(arguments.passes);
    smoothing
        .check()
        .map_err(|error| Failure::usage(error.to_string()))?;
    let files = arguments.inputs.gather(false)?;
    let options = arguments.command_line.options().of_command("smooth");
    let reader = arguments.inputs.clone();
    let work = PlannedWork {
        reader: &reader,
        options: &options,
    };
    let plan = arguments.results.plan(files, &work)?;
    let plot = match &arguments.plot {
        Some(file) => arguments.results.picture(file, &plan)?,
        None => None,
    };
    check_sequence(
        arguments.sequence,
        plan.targets.first().map(ResultTarget::format),
    )?;
    let mut device = arguments.device.open()?;
    let mut pipeline = arguments.results.start(reader, plan, options);
    while let Some(work) = pipeline.next_work() {
        let made = arguments.make(&work, &smoothing, &mut device, plot.as_ref());
        pipeline.keep(&work, made.map(|result| (result, ())));
    }
    pipeline.finish()
}

impl Arguments {
    /// Smooths clips, and writes them into one file.
    fn make(
        &self,
        work: &ClipWork,
        smoothing: &Smoothing,
        device: &mut OpenedDevice,
        plot: Option<&Destination>,
    ) -> Result<EvaluatedResult, Failure> {
        let (name, clips, target) = (&*work.name, work.clips(), &work.target);
        let loaded = &work.input.loaded;
        let tracks = &self.inputs.tracks;
        let select = |clip| match target.format().takes_motion(&[clip]) {
            true => tracks.select_with_ancestors(clip, name),
            false => tracks.select(clip, name),
        };
        let clips = clips.iter().map(|&clip| select(clip));
        let clips: Vec<Cow<'_, Motion>> = clips.collect::<Result<_, Failure>>()?;
        let clips: Vec<&Motion> = clips.iter().map(|clip| &**clip).collect();
        check_one_drawn(plot, name, clips.len())?;
        let samples = clips
            .iter()
            .map(|clip| {
                let rate = (self.fps, self.low_pass);
                smoothed(device, name, clip, smoothing, rate)
            })
            .collect::<Result<Vec<_>, Failure>>()?;
        let mut plotted = None;
        if let ([clip], [smoothed_clip], Some(destination)) = (&*clips, &*samples, plot) {
            let names = (0..clip.set.track_count()).map(|track| clip.set.track_name(track));
            let names: Vec<String> = names.collect();
            let subject = SmoothingSubject {
                title: names::title(work.path(), clip),
                about: match (self.low_pass, smoothing.passes) {
                    (Some(hz), _) => {
                        format!("low-pass at {hz} Hz, {}", smoothed_clip.kernel)
                    }
                    (None, 1) => smoothed_clip.kernel.to_string(),
                    (None, passes) => format!("{}, {passes} times", smoothed_clip.kernel),
                },
                names: &names,
                before: &smoothed_clip.before,
                after: &smoothed_clip.after,
            };
            plotted = Some(picture::draw(&subject, destination)?);
        }
        let options = MotionOptions {
            sequence: self.sequence,
            box_length: loaded.box_length,
            ..target.motion_options()
        };
        let document = document_to_rewrite(work, makes_new(&self.inputs))?;
        let result = (target, options, document);
        let written = write(work, &clips, &samples, result)?.with(plotted);
        let kernels = samples.iter().map(|smoothed| smoothed.kernel.to_string());
        let mut kernels: Vec<String> = kernels.collect();
        kernels.dedup();
        let times = samples
            .iter()
            .map(|smoothed| smoothed.after.times.len())
            .sum();
        let done = format!("{}, {}", words::count(times, "sample"), kernels.join(", "));
        Ok(work.result(written, &done, Some(&device.label)))
    }
}

/// A clip's samples as they were and smoothed, and the rate that they are frames of.
struct Smoothed {
    before: Samples,
    after: Samples,
    rate: Option<FrameRate>,
    kernel: SmoothingKernel,
}

fn smoothed(
    device: &mut OpenedDevice,
    name: &str,
    clip: &Motion,
    smoothing: &Smoothing,
    (fps, low_pass): (Option<FrameRate>, Option<f64>),
) -> Result<Smoothed, Failure> {
    let job = SmoothJob::new(clip, *smoothing, low_pass, fps).map_err(|error| match error {
        SmoothMotionError::Evaluating(error) => Failure::evaluating(name, &error),
        SmoothMotionError::LowPass { hz, reason } => {
            let hint = match reason {
                SmoothingError::Frequency { .. } => "",
                _ => "; give a higher frequency",
            };
            Failure::usage(format!("{name}: --low-pass {hz}: {reason}{hint}"))
        }
        error => Failure::new(ALL_INPUTS, format!("{name}: {error}; give --fps")),
    })?;
    let timeline = room::in_memory(name, &clip.set, &job.frames, 7)?;
    let last = timeline.len().checked_sub(1);
    let last = last.and_then(|last| timeline.time(0, last));
    if let (Some(last), Some((_, end))) = (last, clip.set.time_span())
        && end - last > 1e-3 * fps.map_or(f64::INFINITY, |rate| rate.time_of(1))
    {
        // A smoothing kernel needs evenly spaced samples, so an additional key at the end is not possible.
        let message = format!(
            "the {} s after the last frame are left out; a rate (--fps) with a frame at the end keeps them",
            words::seconds(end - last)
        );
        words::warn_of(Diagnostic::new(name, Code::EndLeftOut, message));
    }
    if let (SmoothingEnds::Loop, Some(last), Some((_, end))) =
        (smoothing.ends, last, clip.set.time_span())
        && end - last > 1e-6
    {
        let closing = job
            .rate
            .and_then(|rate| rate_with_frame_at(rate, last, end));
        let remedy = closing.map_or("choose a rate that has one".to_owned(), |rate| {
            format!("--fps {rate} has one")
        });
        return Err(Failure::usage(format!(
            "{name}: --edges loop needs a sample at the end of the clip, {} s, where the loop closes, and the last is \
             at {} s; {remedy}",
            words::seconds(end),
            words::seconds(last)
        )));
    }
    let rotations = clip.set.track_count() * timeline.len();
    let found = device
        .choose(rotations)
        .and_then(|()| device.work(|engine| job.run(engine, clip)))
        .map_err(|error| Failure::evaluating(name, &error))?;
    if smoothing.ends == SmoothingEnds::Loop {
        warn_of_open_loop(name, clip, &found.before);
    }
    Ok(Smoothed {
        before: found.before,
        after: found.after,
        rate: job.rate,
        kernel: job.smoothing.kernel,
    })
}

/// The lowest multiple of a rate that has a frame at `end`, too, if the rate has a frame at `frame`.
fn rate_with_frame_at(rate: FrameRate, frame: f64, end: f64) -> Option<FrameRate> {
    (2..=20).find_map(|factor| {
        let finer = rate.times(factor).ok()?;
        let between = (end - frame) * finer.per_second();
        ((between - between.round()).abs() < 1e-3).then_some(finer)
    })
}

/// The largest angle between the ends of a loop that may be due to rounding or to the recording, in degrees.
const CLOSED: f64 = 1.0;

/// Warns if the first and the last sample differ, although they are equal in a loop. The warning names the joint that
/// differs most.
fn warn_of_open_loop(name: &str, clip: &Motion, samples: &Samples) {
    let tracks = clip.set.track_count();
    let last = samples.rotations.len().saturating_sub(tracks);
    let ends = samples.rotations.iter().zip(&samples.rotations[last..]);
    let apart = ends.map(|(first, last)| angle_between(first.as_dquat(), last.as_dquat()));
    let largest = apart
        .enumerate()
        .max_by(|(_, one), (_, other)| one.total_cmp(other));
    if let Some((track, apart)) = largest.filter(|(_, apart)| apart.to_degrees() > CLOSED) {
        let message = format!(
            "--edges loop joins the last sample to the first, but they are up to {:.1}° apart ({}); the clip is no loop, \
             or not a whole one",
            apart.to_degrees(),
            clip.set.track_name(track)
        );
        words::warn_of(Diagnostic::new(name, Code::OpenLoop, message));
    }
}

/// Writes a result as `tumble eval` does: the rotations of one clip that has nothing else, or clips as a motion file.
fn write(
    work: &ClipWork,
    clips: &[&Motion],
    samples: &[Smoothed],
    (target, options, document): (&ResultTarget, MotionOptions, Option<&dyn Document>),
) -> Result<WrittenFile, Failure> {
    let name = &*work.name;
    let notes = [
        (
            "kernel",
            samples
                .first()
                .map_or_else(String::new, |smoothed| smoothed.kernel.to_string()),
        ),
        ("input", work.origin()),
    ];
    let format = target.format();
    let has_clips = format.takes_motion(clips);
    if !has_clips && let ([clip], [Smoothed { after, .. }]) = (clips, samples) {
        if after.translations.iter().any(|it| *it != Vec3::ZERO) {
            let name = format.name.to_uppercase();
            let message = format!("{name} cannot store this, left out: the translations");
            let left_out = Diagnostic::new(target.to_string(), Code::NoRoom, message);
            words::warn_of(left_out);
        }
        let tracks = clip.set.track_count();
        let timeline = SampleTimes::at(after.times.clone())
            .resolve(tracks, None)
            .map_err(|error| Failure::evaluating(name, &error.into()))?;
        let shape = ResultShape {
            name,
            set: &clip.set,
            timeline: &timeline,
            time_offset: clip.time_offset,
            layout: Layout::TrackMajor,
            order: None,
            encoding: tumble::Encoding::F32,
            notes: &notes,
        };
        let layout = target.results()?.layout.unwrap_or(Layout::TrackMajor);
        let count = after.times.len();
        let from = |index: usize| match layout {
            Layout::FrameMajor => index,
            Layout::TrackMajor => (index % count) * tracks + index / count,
        };
        let rotations: Vec<_> = (0..after.rotations.len())
            .map(|index| after.rotations[from(index)])
            .collect();
        return target.write_whole(&ResultShape { layout, ..shape }, &rotations);
    }
    let sampled: Vec<SampledClip<'_>> = (clips.iter().zip(samples))
        .map(|(clip, smoothed)| smoothed.after.of(clip, smoothed.rate, &notes))
        .collect();
    if document.is_none() && !format.writes_clips() {
        let message = format!(
            "{target}: {} holds one animation; choose one with --animation",
            format.name
        );
        return Err(Failure::usage(message));
    }
    let indices = clips.iter().map(|clip| clip.index);
    target.write_clips(&sampled, indices, document, &options)
}
