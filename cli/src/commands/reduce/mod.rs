//! `tumble reduce`: motion with few keys.

mod picture;

use std::borrow::Cow;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use clap::builder::TypedValueParser;
use serde::Serialize;
use tumble::reduce::ReducedCurve;
use tumble::{Device, Engine, EulerSequence, FrameRate, SampleTimes};
use tumble_formats::format::{FormatOption, MotionOptions, Quantization};
use tumble_formats::keyed::keyed;
use tumble_formats::motion::{ChannelInterpolation, Motion, SampledClip};
use tumble_formats::reduce::{ReduceMotionError, ReduceOptions, Reduced, quantize_all, reduce};
use tumble_formats::{Feature, Format};

use crate::arguments::input::Inputs;
use crate::arguments::options::CommandLine;
use crate::arguments::output::{one_of, sequence};
use crate::arguments::results::{
    ResultArguments, check_one_drawn, check_sequence, check_stores_keys, document_to_rewrite,
    makes_new,
};
use crate::arguments::tolerance::{degrees, not_negative};
use crate::batch::entry::FrameNotes;
use crate::batch::pipeline::{ClipWork, EvaluatedResult};
use crate::batch::preview::PlannedWork;
use crate::batch::room;
use crate::batch::target::{Destination, ResultTarget, WrittenFile};
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::{names, words};

/// Remove keys from motion; the curves of the remaining keys stay within a tolerance of all samples
#[derive(Debug, Args)]
#[command(after_help = "\
The keys of the input are the samples (or the frames of --fps). At each of them every joint stays \
within the angle of --tolerance and the distance of --distance. If the input has a skeleton, both are \
measured in world space, else for each track. The program evaluates the remaining keys to check this. glTF stores \
separate key times for each channel; other formats store all joints at the same times, which takes \
more keys. A GLB or glTF that is written as one keeps everything else in the file.

Examples:
  tumble reduce walk.bvh --tolerance 0.1deg -o walk.glb
  tumble reduce dance.glb --tolerance 0.05deg --distance 0.001 --shell 0.1 -o small.glb
  tumble reduce walk.bvh --method cubic -o walk.glb --plot errors.svg
  tumble reduce takes -o small --to glb --resume")]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    results: ResultArguments,
    /// The largest allowed angle: 0.1deg or 0.002rad, degrees without a unit
    #[arg(long, value_name = "ANGLE", default_value = "0.1deg", value_parser = degrees, allow_hyphen_values = true)]
    tolerance: f64,
    /// The largest allowed distance: in the input's unit of length [default: the arc of the angle at the end of the longest chain of joints]
    #[arg(long, value_name = "LENGTH", value_parser = not_negative, allow_hyphen_values = true)]
    distance: Option<f64>,
    /// Points at this distance from each joint, along its axes, stay within --distance too, as a
    /// stand-in for the skin
    #[arg(long, value_name = "LENGTH", default_value = "0", value_parser = not_negative, allow_hyphen_values = true)]
    shell: f64,
    /// How to interpolate: the curve that joins the remaining keys
    #[arg(id = "method", short, long = "method", alias = "curve", value_name = "METHOD", default_value_t, value_parser = curve())]
    method: ReducedCurve,
    /// glTF: store rotations with 16 bits per component instead of f32. The reported errors include this rounding
    #[arg(long)]
    quantize: bool,
    /// glTF: write a new file, compressed by meshopt; players need `EXT_meshopt_compression`. With --quantize, all
    /// samples become keys with as few bits as the bounds allow, if that makes the file smaller
    #[arg(long)]
    meshopt: bool,
    /// Frames per second: sample at this rate first [default: the keys are the samples]
    #[arg(long, value_name = "FPS")]
    fps: Option<FrameRate>,
    /// The sequence of axes: of the angles of BVH, three different ones [default: those of the input, else ZXY]
    #[arg(long, value_name = "AXES", value_parser = sequence)]
    sequence: Option<EulerSequence>,
    /// Also draw a picture, as .svg or .png: the errors of the joints over time; needs a single input
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

fn curve() -> impl TypedValueParser<Value = ReducedCurve> {
    let help = |curve| match curve {
        ReducedCurve::Linear => "arcs (slerp) and straight lines",
        ReducedCurve::BesselOverhauser => "bessel-overhauser, which glTF does not have",
        ReducedCurve::GltfCubic => "glTF's cubics",
        _ => "",
    };
    one_of(ReducedCurve::ALL.map(|curve| (curve.name(), help(curve), curve)))
}

/// The report of one clip.
#[derive(Debug, Clone, Serialize)]
struct ReductionReport {
    /// The input, and its animation if it has several.
    input: String,
    keys_before: usize,
    keys_after: usize,
    samples: usize,
    /// Degrees.
    angle: LargestError,
    /// In the input's unit of length.
    distance: LargestError,
    seconds: f64,
}

/// The largest error of a kind.
#[derive(Debug, Clone, Serialize)]
struct LargestError {
    largest: f64,
    bound: f64,
    track: String,
    /// Seconds, on the clock of the file.
    time: f64,
}

impl LargestError {
    fn of(reduced: &Reduced, kind: usize, factor: f64) -> Self {
        let (joint, sample) = reduced.worst[kind];
        Self {
            largest: reduced
                .errors
                .get(sample)
                .map_or(0.0, |errors| errors[kind])
                * factor,
            bound: reduced.bounds[kind] * factor,
            track: reduced.clip.set.track_name(joint),
            time: reduced.times.get(sample).copied().unwrap_or(0.0)
                + reduced.clip.time_offset as f64,
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let files = arguments.inputs.gather(false)?;
    let options = arguments.command_line.options().of_command("reduce");
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
    let format = plan.targets.first().map(ResultTarget::format);
    check_stores_keys(&plan)?;
    check_sequence(arguments.sequence, format)?;
    let is_bessel = matches!(arguments.method, ReducedCurve::BesselOverhauser);
    if is_bessel && format.is_some_and(|format| format.takes(FormatOption::AtKeys)) {
        return Err(Failure::usage(
            "glTF has no bessel-overhauser; choose --method linear or cubic, or write .npz",
        ));
    }
    arguments.check_quantized(format)?;
    let engine =
        Engine::new(Device::Cpu).map_err(|error| Failure::evaluating("the CPU", &error))?;
    let mut pipeline = arguments.results.start(reader, plan, options);
    while let Some(work) = pipeline.next_work() {
        let made = arguments.make(&engine, &work, plot.as_ref());
        pipeline.keep(&work, made);
    }
    pipeline.finish()
}

impl Arguments {
    /// Refuses `--quantize` and `--meshopt` where they do not apply.
    fn check_quantized(&self, format: Option<&Format>) -> Result<(), Failure> {
        let option = match (self.quantize, self.meshopt) {
            (true, _) => "quantize",
            (_, true) => "meshopt",
            _ => return Ok(()),
        };
        if let Some(format) = format.filter(|format| !format.takes(FormatOption::Quantize)) {
            let name = format.name;
            return Err(Failure::usage(format!(
                "--{option} is for glTF and has no effect on {name}; leave it out"
            )));
        }
        if self.quantize && matches!(self.method, ReducedCurve::GltfCubic) {
            return Err(Failure::usage(
                "--quantize cannot store the tangents of cubics; leave out --method cubic",
            ));
        }
        Ok(())
    }

    /// Reduces clips and writes them into one file.
    fn make(
        &self,
        engine: &Engine,
        work: &ClipWork,
        plot: Option<&Destination>,
    ) -> Result<(EvaluatedResult, Vec<ReductionReport>), Failure> {
        let started = Instant::now();
        let (name, clips, target) = (&*work.name, &*work.clips(), &work.target);
        let name_of = |clip: &&Motion| match clips.len() {
            1 => name.to_owned(),
            _ => format!("{name} {}", names::clip(clip)),
        };
        let names: Vec<String> = clips.iter().map(name_of).collect();
        check_one_drawn(plot, name, clips.len())?;
        let mut all = Vec::new();
        for (clip, name) in clips.iter().zip(&names) {
            let together = clip.is_world || !target.format().takes(FormatOption::AtKeys);
            all.push(self.reduced(engine, (name, clip), together)?);
        }
        let all = self.smaller(engine, &names, all)?;
        let quantize = all.first().and_then(|pair| pair.1);
        let all: Vec<Reduced> = all.into_iter().map(|pair| pair.0).collect();
        let plotted = match (plot, &*all) {
            (Some(destination), [reduced]) => {
                let title = names::title(work.path(), &reduced.clip);
                Some(picture::draw(&title, reduced, destination)?)
            }
            _ => None,
        };
        let written = self.write(engine, work, &all, quantize)?.with(plotted);
        let mut reports = Vec::new();
        let mut lines = Vec::new();
        for (reduced, input) in all.iter().zip(names) {
            let report = ReductionReport {
                input,
                keys_before: reduced.keys[0],
                keys_after: reduced.keys[1],
                samples: reduced.times.len(),
                angle: LargestError::of(reduced, 0, 1f64.to_degrees()),
                distance: LargestError::of(reduced, 1, 1.0),
                seconds: started.elapsed().as_secs_f64(),
            };
            lines.push(report.line(reduced));
            reports.push(report);
        }
        let spent = words::duration(started.elapsed());
        let mut sizes = work.sizes(&written);
        if let Some(before) = work
            .input
            .file
            .bytes()
            .filter(|&before| before < written.bytes)
        {
            let more = words::bytes((written.bytes - before) as f64);
            sizes += &format!(", {more} more than the input");
        }
        let evaluated = EvaluatedResult {
            written,
            device: engine.device_name().to_owned(),
            message: format!("{} in {spent} → {target}{sizes}", lines.join("; ")),
            frames: FrameNotes::default(),
        };
        Ok((evaluated, reports))
    }

    fn reduced(
        &self,
        engine: &Engine,
        (name, clip): (&str, &Motion),
        together: bool,
    ) -> Result<(Reduced, Option<(Reduced, Quantization)>), Failure> {
        let clip = self.inputs.tracks.select_with_ancestors(clip, name)?;
        let failed = |error: ReduceMotionError| match error {
            ReduceMotionError::Evaluating(error) => Failure::evaluating(name, &error),
            error => Failure::new(ALL_INPUTS, format!("{name}: {error}")),
        };
        let clip = match self.fps {
            Some(rate) => {
                let frames = SampleTimes::rate(rate);
                room::in_memory(name, &clip.set, &frames, 7)?;
                let sampled = clip.sampled_at_rate(engine, rate);
                Cow::Owned(sampled.map_err(|error| Failure::evaluating(name, &error))?)
            }
            None if clip
                .channels
                .iter()
                .any(|channel| channel.has(ChannelInterpolation::Cubic)) =>
            {
                return Err(Failure::usage(format!(
                    "{name}: its keys are connected by cubics with tangents, so the keys alone are not \
                     enough; give --fps"
                )));
            }
            None => clip,
        };
        let times = SampleTimes::at(clip.key_times());
        // Memory for the samples and the poses of the input and of the result.
        room::in_memory(name, &clip.set, &times, 14)?;
        let options = ReduceOptions {
            curve: self.method,
            angle: self.tolerance.to_radians(),
            distance: self.distance,
            shell: self.shell,
            together,
            quantize: self.quantize.then_some(match self.meshopt {
                true => Quantization::Filtered(32767),
                false => Quantization::Components,
            }),
        };
        let sparse = reduce(&clip, engine, &options).map_err(failed)?;
        let is_packed = self.quantize && self.meshopt;
        let all = is_packed.then(|| quantize_all(&clip, engine, &options));
        let all = all.transpose().map_err(failed)?.flatten();
        Ok((sparse, all))
    }

    /// Writes clips as new files, with few keys and with all keys of few bits; returns the clips whose
    /// file is smaller.
    fn smaller(
        &self,
        engine: &Engine,
        names: &[String],
        reduced: Vec<(Reduced, Option<(Reduced, Quantization)>)>,
    ) -> Result<Vec<(Reduced, Option<Quantization>)>, Failure> {
        let sixteen = self.quantize.then_some(match self.meshopt {
            true => Quantization::Filtered(32767),
            false => Quantization::Components,
        });
        let format = Format::named("glb");
        let size = |reduced: &Reduced, quantize| -> Result<usize, Failure> {
            let ends = reduced.clip.ends(engine);
            let ends = ends.map_err(|error| Failure::evaluating(&names[0], &error))?;
            let options = MotionOptions {
                quantize,
                meshopt: true,
                ..MotionOptions::default()
            };
            let sampled = [SampledClip {
                is_at_keys: true,
                ..ends.of(&reduced.clip, None, &[])
            }];
            let mut bytes = Vec::new();
            // Warnings are ignored here, because only the number of bytes is needed; the final file has the warnings.
            let written = format.map(|format| format.write_clips(&sampled, &options, &mut bytes));
            Ok(written
                .and_then(Result::ok)
                .map_or(usize::MAX, |_| bytes.len()))
        };
        // All clips of a file get the same quantization.
        let mut each = reduced.iter().map(|(_, all)| all.as_ref().map(|all| all.1));
        let first = each.next().flatten();
        let same = first.filter(|&first| each.all(|bits| bits == Some(first)));
        let (mut sparse_size, mut all) = (0usize, 0usize);
        for (sparse, other) in &reduced {
            sparse_size = sparse_size.saturating_add(size(sparse, sixteen)?);
            all = match other {
                Some((other, _)) => all.saturating_add(size(other, same)?),
                None => usize::MAX,
            };
        }
        let takes_all = same.filter(|_| all < sparse_size);
        let chosen = reduced
            .into_iter()
            .map(|(sparse, other)| match (takes_all, other) {
                (Some(bits), Some((other, _))) => (other, Some(bits)),
                _ => (sparse, sixteen),
            });
        Ok(chosen.collect())
    }

    /// Writes reduced clips: into the input's own file where that is of the same format, else into a
    /// new one.
    fn write(
        &self,
        engine: &Engine,
        work: &ClipWork,
        reduced: &[Reduced],
        quantize: Option<Quantization>,
    ) -> Result<WrittenFile, Failure> {
        let (name, clips, target) = (&*work.name, work.clips(), &work.target);
        let format = target.format();
        let keys_per_channel = format.takes(FormatOption::AtKeys);
        let mut samples = Vec::new();
        for reduced in reduced {
            samples.push(match keys_per_channel && !reduced.clip.is_world {
                true => reduced
                    .clip
                    .ends(engine)
                    .map_err(|error| Failure::evaluating(name, &error))?,
                false => keyed(&reduced.clip)
                    .map_err(|error| Failure::new(ALL_INPUTS, format!("{name}: {error}")))?,
            });
        }
        let notes = [
            ("input", name.to_owned()),
            ("tolerance", format!("{}°", self.tolerance)),
        ];
        // Formats without times need the rate: they can store the keys if every frame has one.
        let has_times = format.supports(Feature::UnevenTimes);
        let rate = |clip: &Motion| clip.rate.filter(|_| !has_times);
        let both = reduced.iter().zip(&samples);
        let sampled: Vec<SampledClip<'_>> = both
            .map(|(reduced, samples)| SampledClip {
                is_at_keys: keys_per_channel,
                ..samples.of(&reduced.clip, rate(&reduced.clip), &notes)
            })
            .collect();
        let options = MotionOptions {
            sequence: self.sequence,
            box_length: work.input.loaded.box_length,
            quantize,
            meshopt: self.meshopt,
            ..target.motion_options()
        };
        let otherwise = match keys_per_channel {
            // A file that is edited keeps its other content, uncompressed; only new files are compressed.
            true if self.meshopt => Some("compression makes"),
            true => makes_new(&self.inputs),
            false => Some("keys at uneven times make"),
        };
        let document = document_to_rewrite(work, otherwise)?;
        let indices = clips.iter().map(|clip| clip.index);
        target.write_clips(&sampled, indices, document, &options)
    }
}

impl ReductionReport {
    fn line(&self, reduced: &Reduced) -> String {
        let (before, after) = (self.keys_before, self.keys_after);
        let keys = match before == after {
            true => format!("{before} keys, of which none can be left out"),
            false => {
                let times = before as f64 / after.max(1) as f64;
                format!("{before} → {after} keys ({times:.1} times fewer)")
            }
        };
        format!(
            "{}: {keys}, at most {:.4}° ({}, {:.3} s) and {} ({}, {:.3} s) from {}",
            self.input,
            self.angle.largest,
            self.angle.track,
            self.angle.time,
            words::decimals(self.distance.largest),
            self.distance.track,
            self.distance.time,
            words::count(reduced.times.len(), "sample")
        )
    }
}
