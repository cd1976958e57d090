//! `tumble smooth`: motion without its noise.

#[allow(clippy::disallowed_methods)] // a picture
mod picture;

use std::borrow::Cow;
use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use tumble::{
    Engine, Error, EulerSequence, FrameRate, Frames, Layout, Rotations, Smoothing, SmoothingEnds,
    SmoothingError, SmoothingKernel, Vectors,
};
use tumble_formats::format::{Document, MotionOptions, ResultShape};
use tumble_formats::motion::{Motion, Sampled};
use tumble_formats::sample::{ChannelMethods, Samples};

use crate::arguments::device::{DeviceArguments, Opened};
use crate::arguments::given::Given;
use crate::arguments::input::{self, Inputs};
use crate::arguments::results::{Results, check_sequence, each_file, kept};
use crate::arguments::what::sequence;
use crate::batch::output::Target;
use crate::batch::place::Written;
use crate::batch::room;
use crate::batch::run::Evaluated;
use crate::commands::smooth::picture::Subject;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Smooth rotations and translations by a kernel over samples
#[derive(Debug, Args)]
#[command(after_help = "\
Kernels act on the steps from sample to sample, so that still tracks keep their bits and even
motion stays: linear, cubic, box:S and tent:S (S samples to either side), gaussian:S (standard
deviation), savitzky-golay:RADIUS:ORDER. --low-pass HZ is the bell that halves the power of motion at
that frequency, whatever the rate of the samples. Samples are the keys where these are evenly spaced, else
--fps says how to sample. NPY and CSV hold the rotations, motion files everything. A file of the same
format keeps all else that it holds; steps stay steps there.

Examples:
  tumble smooth walk.dat --kernel gaussian:2 -o out.npy
  tumble smooth walk.bvh --kernel savitzky-golay:4:3 -o smooth.bvh
  tumble smooth walk.bvh --low-pass 6 -o calm.bvh --plot calm.svg
  tumble smooth takes -o smooth --to glb --fps 60 --kernel linear --passes 3")]
pub(crate) struct Arguments {
    #[command(flatten)]
    given: Given,
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    results: Results,
    /// The weights: linear, cubic, box:S, tent:S, gaussian:S or savitzky-golay:RADIUS:ORDER
    #[arg(short, long, value_name = "KERNEL", default_value = "gaussian:2")]
    kernel: SmoothingKernel,
    /// Instead of a kernel: keep what is slower than this frequency; motion at it keeps 71 % of its size
    /// (-3 dB), motion at twice of it 25 %
    #[arg(long, value_name = "HZ", conflicts_with_all = ["kernel", "passes"], value_parser = frequency)]
    low_pass: Option<f64>,
    /// How often
    #[arg(long, value_name = "N", default_value_t = 1)]
    passes: u32,
    /// What lies beyond the first and the last sample
    #[arg(long, value_name = "ENDS", default_value = "keep")]
    ends: EndsArgument,
    /// Sample at this rate first [default: the keys themselves]
    #[arg(long, value_name = "FPS")]
    fps: Option<FrameRate>,
    /// The axes of the angles of BVH, three different ones [default: those of the input, else ZXY]
    #[arg(long, value_name = "AXES", value_parser = sequence)]
    sequence: Option<EulerSequence>,
    /// Also draw, as .svg or .png, how fast the joint turns and moves that had the most noise, before
    /// and after; of one input
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArguments,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum EndsArgument {
    /// the end samples stay
    Keep,
    /// cubic: the end samples go to the parabola through the next three
    Parabolic,
    /// the last sample repeats the first
    Loop,
}

fn frequency(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(hz) if hz.is_finite() && hz > 0.0 => Ok(hz),
        _ => Err(format!(
            "`{text}` is no frequency; give a number of Hz over 0"
        )),
    }
}

/// The smoothing of samples at those times.
fn smoothing_at(
    times: &[f64],
    smoothing: &Smoothing,
    low_pass: Option<f64>,
) -> Result<Smoothing, String> {
    let (Some(hz), [first, .., last]) = (low_pass, times) else {
        return Ok(*smoothing);
    };
    let rate = (times.len() - 1) as f64 / (last - first);
    let kernel = SmoothingKernel::low_pass(hz, rate);
    let kernel = kernel.map_err(|error| match error {
        SmoothingError::Frequency { .. } => format!("--low-pass {hz}: {error}"),
        error => format!("--low-pass {hz}: {error}; give a higher frequency"),
    })?;
    Ok(Smoothing {
        kernel,
        ..*smoothing
    })
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let smoothing = Smoothing {
        kernel: arguments.kernel,
        ends: match arguments.ends {
            EndsArgument::Keep => SmoothingEnds::Keep,
            EndsArgument::Parabolic => SmoothingEnds::Parabolic,
            EndsArgument::Loop => SmoothingEnds::Loop,
        },
        passes: arguments.passes,
    };
    smoothing
        .check()
        .map_err(|error| Failure::usage(error.to_string()))?;
    let files = arguments.inputs.gather(false)?;
    let plan = arguments.results.plan(&files)?;
    let plot = match &arguments.plot {
        Some(file) => arguments.results.picture(file, &files, &plan)?,
        None => None,
    };
    check_sequence(arguments.sequence, plan.targets.first().map(Target::format))?;
    let mut device = arguments.device.open()?;
    let options = format!("smooth {}", arguments.given.options());
    arguments.results.make(
        &arguments.inputs,
        plan,
        options,
        |file, loaded, target, done| {
            let path = file.path();
            let mut make = |name: &str, clips: &[&Motion], target: &Target| {
                let started = Instant::now();
                let tracks = &arguments.inputs.tracks;
                let own = |clip| match target.format().takes_motion(&[clip]) {
                    true => tracks.select_with_ancestors(clip, name),
                    false => tracks.select(clip, name),
                };
                let clips = clips.iter().map(|&clip| own(clip));
                let clips: Vec<Cow<'_, Motion>> = clips.collect::<Result<_, Failure>>()?;
                let clips: Vec<&Motion> = clips.iter().map(|clip| &**clip).collect();
                let samples = clips
                    .iter()
                    .map(|clip| {
                        let rate = (arguments.fps, arguments.low_pass);
                        smoothed(&mut device, name, clip, &smoothing, rate)
                    })
                    .collect::<Result<Vec<_>, Failure>>()?;
                if let ([clip], [own], Some(place)) = (&*clips, &*samples, &plot) {
                    let names = (0..clip.set.track_count()).map(|track| clip.set.track_name(track));
                    let names: Vec<String> = names.collect();
                    let subject = Subject {
                        title: input::file_name(path),
                        about: match (arguments.low_pass, smoothing.passes) {
                            (Some(hz), _) => format!("low-pass at {hz} Hz, {}", own.kernel),
                            (None, 1) => own.kernel.to_string(),
                            (None, passes) => format!("{}, {passes} times", own.kernel),
                        },
                        names: &names,
                        before: &own.before,
                        after: &own.after,
                    };
                    picture::draw(&subject, place)?;
                }
                let options = MotionOptions {
                    sequence: arguments.sequence,
                    box_length: loaded.box_length,
                    ..target.motion_options()
                };
                let some = tracks.is_given().then_some("some tracks make");
                let document = kept(name, loaded, target, some);
                let result = (target, options, document);
                let written = write(name, &clips, &samples, result)?;
                let kernels = samples.iter().map(|own| own.kernel.to_string());
                let mut kernels: Vec<String> = kernels.collect();
                kernels.dedup();
                let times = samples.iter().map(|own| own.after.times.len()).sum();
                let told = format!(
                    "{name}: {}, {}, on {} in {} → {target}",
                    words::count(times, "sample"),
                    kernels.join(", "),
                    device.label,
                    words::duration(started.elapsed()),
                );
                Ok(Evaluated {
                    written,
                    device: device.label.clone(),
                    told,
                })
            };
            each_file(&input::name(path), (path, loaded), target, done, &mut make)
        },
    )
}

/// A clip's samples as they were and smoothed, and the rate that they are frames of.
struct Smoothed {
    before: Samples,
    after: Samples,
    rate: Option<FrameRate>,
    kernel: SmoothingKernel,
}

/// How far steps of time may differ, as a part of a step.
const EVEN: f64 = 1e-3;

/// The times of the keys, if all tracks have the same and these are evenly spaced.
fn even_times(clip: &Motion) -> Option<Vec<f64>> {
    let longest = clip.set.tracks().max_by_key(|track| track.times.len())?;
    let times = longest.times;
    let fits = |own: &[f64]| own == times || own.len() == 1;
    let channels = [tumble::Channel::Translation, tumble::Channel::Scale];
    let vectors = (0..clip.set.track_count())
        .flat_map(|track| channels.map(|channel| clip.set.vector_keys(channel, track)));
    let all = clip.set.tracks().all(|track| fits(track.times))
        && vectors.flatten().all(|keys| fits(keys.times));
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let (least, most) = (
        steps().fold(f64::INFINITY, f64::min),
        steps().fold(0.0, f64::max),
    );
    (all && (times.len() < 2 || most - least <= EVEN * most)).then(|| times.to_vec())
}

fn smoothed(
    device: &mut Opened,
    name: &str,
    clip: &Motion,
    smoothing: &Smoothing,
    (fps, low_pass): (Option<FrameRate>, Option<f64>),
) -> Result<Smoothed, Failure> {
    let (frames, rate) = match fps {
        Some(rate) => (Frames::rate(rate), Some(rate)),
        None => match even_times(clip) {
            Some(times) => (Frames::at(times), clip.rate),
            None => {
                let message = format!(
                    "{name}: the keys are not evenly spaced, or not at the same times in all tracks; give --fps"
                );
                return Err(Failure::new(ALL_INPUTS, message));
            }
        },
    };
    let timeline = room::in_memory(name, &clip.set, &frames, 7)?;
    let rotations = clip.set.track_count() * timeline.len();
    let times: Vec<f64> = timeline.times(0).collect();
    let smoothing = smoothing_at(&times, smoothing, low_pass)
        .map_err(|message| Failure::usage(format!("{name}: {message}")))?;
    let methods = ChannelMethods::AUTHORED;
    let tracks = clip.set.track_count();
    let work = |engine: &Engine| {
        let before = methods.sample(engine, clip, &frames)?;
        let mut samples = before.clone();
        let layout = Layout::FrameMajor;
        if let Ok(own) = Rotations::of(&samples.rotations, tracks, layout) {
            samples.rotations = engine.smooth(&own, &smoothing)?.as_quats().to_vec();
        }
        if let Ok(own) = Vectors::of(&samples.translations, tracks, layout) {
            let moved = engine.smooth_vectors(&own, &smoothing)?;
            samples.translations = moved.as_slice().iter().map(|v| v.truncate()).collect();
        }
        Ok::<_, Error>((before, samples))
    };
    let (before, after) = device
        .choose(rotations)
        .and_then(|()| device.work(work))
        .map_err(|error| Failure::evaluating(name, &error))?;
    Ok(Smoothed {
        before,
        after,
        rate,
        kernel: smoothing.kernel,
    })
}

/// Writes rotations as they come, or clips as a motion file.
fn write(
    name: &str,
    clips: &[&Motion],
    samples: &[Smoothed],
    (target, options, document): (&Target, MotionOptions, Option<&dyn Document>),
) -> Result<Written, Failure> {
    let notes = [
        (
            "kernel",
            samples
                .first()
                .map_or_else(String::new, |own| own.kernel.to_string()),
        ),
        ("input", name.to_owned()),
    ];
    let format = target.format();
    if let ([clip], [Smoothed { after: own, .. }], Some(_)) = (clips, samples, &format.write) {
        let tracks = clip.set.track_count();
        let timeline = Frames::at(own.times.clone())
            .resolve(tracks, None)
            .map_err(|error| Failure::evaluating(name, &error.into()))?;
        let shape = ResultShape {
            name,
            set: &clip.set,
            timeline: &timeline,
            layout: Layout::TrackMajor,
            order: None,
            encoding: tumble::Encoding::F32,
            notes: &notes,
        };
        let layout = target.results()?.layout.unwrap_or(Layout::TrackMajor);
        let count = own.times.len();
        let from = |place: usize| match layout {
            Layout::FrameMajor => place,
            Layout::TrackMajor => (place % count) * tracks + place / count,
        };
        let rotations: Vec<_> = (0..own.rotations.len())
            .map(|place| own.rotations[from(place)])
            .collect();
        return target.write_whole(&ResultShape { layout, ..shape }, &rotations);
    }
    let sampled: Vec<Sampled<'_>> = (clips.iter().zip(samples))
        .map(|(clip, own)| own.after.of(clip, own.rate, &notes))
        .collect();
    if let Some(document) = document {
        let places = clips.iter().map(|clip| clip.place);
        let clips: Vec<(usize, Sampled<'_>)> = places.zip(sampled).collect();
        return target.write_motion(|out| document.write(&clips, &options, target.path(), out));
    }
    if !format.writes_clips() {
        let message = format!(
            "{target}: {} holds one animation; choose one with --animation",
            format.name
        );
        return Err(Failure::usage(message));
    }
    let written = target.write_motion(|out| format.write_clips(&sampled, &options, out))?;
    target.write_times(&sampled)?;
    Ok(written)
}
