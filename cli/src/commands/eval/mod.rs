//! `tumble eval`: keyframe files in, rotations and whole poses at every frame out.

mod applies;
mod motion;
mod rotations;
pub(crate) mod shards;

use std::borrow::Cow;
use std::cell::RefCell;
use std::time::Instant;

use clap::{Args, ValueEnum};
use serde::Serialize;
use tumble::{Encoding, Engine, Error, Interpolation, Layout, Method, SampleTimes};
use tumble_formats::Loaded;
use tumble_formats::motion::Motion;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::sample::ChannelMethods;

use crate::arguments::command_line::CommandLine;
use crate::arguments::device::{DeviceArguments, OpenedDevice};
use crate::arguments::input;
use crate::arguments::input::Inputs;
use crate::arguments::interpolation::{
    InterpolationArguments, MethodArgument, curve_warning, method_argument,
};
use crate::arguments::output::{OrderArgument, OutputArguments, quaternions};
use crate::arguments::results::{ResultArguments, document_to_rewrite, each_file};
use crate::arguments::time::{AtKeysArguments, SampleRequest, SamplingArguments};
use crate::batch::destination::WrittenFile;
use crate::batch::digest::InputFile;
use crate::batch::output::ResultTarget;
use crate::batch::run::{EvaluatedResult, ResultCallback};
use crate::commands::eval::applies::ResultKind;
use crate::commands::eval::shards::ShardSelection;
use crate::messages::exit::Failure;
use crate::messages::words;

/// Evaluate keyframe tracks at every frame
#[derive(Debug, Args)]
#[command(after_help = "\
The result is float32 of shape (tracks, frames, 4) in NPY, x y z w (unless --output, --layout or
--order change that), or CSV with a row for each frame, whose header names the columns, w x y z
without --order. An option that has no effect on a result is refused. CPU and Vulkan give the same
bits.

Examples:
  tumble eval data/pendulum.dat -o out.npy
  tumble eval data/pendulum.dat -m slerp --fps 30000/1001 -o out.csv
  tumble eval data/pendulum.dat --start 2 --end 4.5 --layout frame --order wxyz -o out.npy
  tumble eval data/pendulum.dat --output euler --sequence ZXY -o angles.csv
  tumble eval *.dat -o results                 a file for each input, results/NAME.npy
  tumble eval walks -o results --resume        a directory's tree; skips what is done
  find . -name '*.dat' | tumble eval --files-from - -o results
  tumble eval walk.glb --fps 60 -o walk60.glb  baked; everything else stays as it is
  tumble eval clips -o out --to bvh --resume   formats may be mixed
  seq 64 | xargs -P8 -I{} tumble eval clips -o out --resume --shard {}/64; tumble merge out
  tumble eval - -o - < data/pendulum.dat | python3 -c \\
    'import io, sys, numpy; print(numpy.load(io.BytesIO(sys.stdin.buffer.read())).shape)'")]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    #[command(flatten)]
    pub(crate) inputs: Inputs,
    #[command(flatten)]
    pub(crate) results: ResultArguments,
    /// How to interpolate (`tumble methods`); stepped channels, which keep each key until the next
    /// one, stay stepped
    #[arg(
        short,
        long,
        value_name = "METHOD",
        default_value = "authored",
        value_parser = method_argument()
    )]
    method: MethodArgument,
    #[command(flatten)]
    sampling: SamplingArguments,
    #[command(flatten)]
    at_keys: AtKeysArguments,
    #[command(flatten)]
    interpolation: InterpolationArguments,
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    /// The order of results: (tracks, frames, 4) or (frames, tracks, 4); poses and CSV come frame by
    /// frame
    #[arg(long, value_enum, default_value = "track")]
    layout: LayoutArgument,
    /// The order of a quaternion's components [default: xyzw; CSV of rotations: wxyz]
    #[arg(long, value_enum)]
    order: Option<OrderArgument>,
    /// How components are stored in NPY results
    #[arg(long, value_name = "ENCODING", default_value = "f32", value_parser = quaternions())]
    encoding: Encoding,
    #[command(flatten)]
    output: OutputArguments,
    /// NPZ to NPZ: interpolate these arrays, which have a number for each frame, linearly instead of
    /// leaving them out
    #[arg(long, value_name = "ARRAYS", value_delimiter = ',')]
    linear: Vec<String>,
    /// Also print how each input is evaluated (its route); all routes give the same bits
    #[arg(long)]
    explain_route: bool,
    /// Evaluate one part of several into a directory that other processes fill too, then `tumble
    /// merge` it: I/N, such as 3/64, or one shard by its number
    #[arg(long, value_name = "I/N")]
    shard: Option<ShardSelection>,
    /// The size of a shard's inputs, at most; shards also have at most 256 inputs, and depend on nothing else
    #[arg(
        long,
        value_name = "SIZE",
        default_value = "32MiB",
        requires = "shard",
        value_parser = words::parse_bytes
    )]
    shard_bytes: u64,
    /// Print JSON about the results on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum LayoutArgument {
    /// (tracks, frames, 4)
    Track,
    /// (frames, tracks, 4)
    Frame,
}

/// The report of one result with `--json`.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct EvaluationReport {
    /// The input, and its animation where it has several.
    input: String,
    /// Where the result is; `-` is standard output.
    output: String,
    format: &'static str,
    tracks: usize,
    frames: usize,
    /// Of the first and the last frame, seconds; null where there are none.
    first_time: Option<f64>,
    last_time: Option<f64>,
    /// Times between keys that are too far apart, which were left out or held; nothing without `--max-gap`.
    #[serde(skip_serializing_if = "Option::is_none")]
    in_gaps: Option<usize>,
    /// What was written for each rotation.
    #[serde(rename = "what")]
    output_kind: &'static str,
    /// The order of a quaternion's components as written; null where none are written, or where the
    /// format fixes the order.
    order: Option<&'static str>,
    method: String,
    device: String,
    seconds: f64,
}

impl EvaluationReport {
    /// How many were evaluated.
    pub(crate) fn rotations(&self) -> u64 {
        self.tracks as u64 * self.frames as u64
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(part) = arguments.shard {
        return shards::run(arguments, part);
    }
    // Everything that can be refused is refused before any work.
    let inputs = arguments
        .inputs
        .gather(arguments.sampling.reads_standard_input())?;
    let samples = arguments.checked_samples()?;
    let plan = arguments.results.plan(&inputs)?;
    // All targets have one format.
    if let Some(target) = plan.targets.first() {
        arguments.check_before(target.format())?;
    }
    if arguments.json && plan.targets.iter().any(ResultTarget::is_standard) {
        return Err(Failure::usage(
            "--json and the result cannot both go to standard output; give -o FILE",
        ));
    }
    arguments.choose_keys();
    let mut device = arguments.device.open()?;
    let options = arguments.options(&samples);
    let results = &arguments.results;
    let mut reports = Vec::new();
    let outcome = results.make(
        &arguments.inputs,
        plan,
        options,
        |file, loaded, target, done| {
            let job = EvaluationJob {
                arguments,
                device: &mut device,
                samples: &samples,
                file,
                loaded,
                started: Instant::now(),
                in_gaps: 0,
            };
            job.run(target, done, &mut reports)
        },
    );
    if arguments.json {
        words::json(&reports)?;
    }
    outcome
}

impl Arguments {
    /// The samples, after a check that the options apply to the method.
    fn checked_samples(&self) -> Result<SampleRequest, Failure> {
        if let Some(method) = self.method.0 {
            let checked = self.interpolation.check(&[method]);
            checked.map_err(Failure::usage)?;
        }
        match self.at_keys.samples()? {
            Some(samples) => Ok(samples),
            None => self.sampling.samples(),
        }
    }

    /// Reads only the file's keys where a method is named.
    fn choose_keys(&self) {
        if self.method.0.is_some() {
            self.inputs.reading.set_method_named();
        }
    }

    /// Everything that determines the bytes of a result besides its input.
    fn options(&self, samples: &SampleRequest) -> String {
        let mut options = self.command_line.options();
        if let SampleRequest::Times(_) | SampleRequest::Keys(_) = samples {
            options += &format!(" times={}", samples.digest());
        }
        options
    }

    fn order(&self) -> Option<ComponentOrder> {
        self.order.map(OrderArgument::order)
    }
}

/// The evaluation of one input.
struct EvaluationJob<'a> {
    arguments: &'a Arguments,
    device: &'a mut OpenedDevice,
    samples: &'a SampleRequest,
    file: &'a InputFile,
    loaded: &'a Loaded,
    started: Instant,
    /// Times in gaps of the clips that are being evaluated.
    in_gaps: usize,
}

impl EvaluationJob<'_> {
    /// Evaluates all clips of the input; `reports` gets a report of each result.
    fn run(
        mut self,
        target: &ResultTarget,
        done: &mut ResultCallback<'_>,
        reports: &mut Vec<EvaluationReport>,
    ) -> Result<(), Failure> {
        let path = self.file.path();
        let name = input::name(path);
        let file = (path, self.loaded);
        let latest = RefCell::new(None);
        let mut done = |name: &str, evaluated: EvaluatedResult| {
            done(name, evaluated)?;
            reports.extend(latest.take());
            Ok(())
        };
        each_file(&name, file, target, &mut done, |name, clips, target| {
            let (evaluated, report) = self.evaluate(name, clips, target)?;
            latest.replace(Some(report));
            Ok(evaluated)
        })
    }

    /// Some clips, into one file.
    fn evaluate(
        &mut self,
        name: &str,
        clips: &[&Motion],
        target: &ResultTarget,
    ) -> Result<(EvaluatedResult, EvaluationReport), Failure> {
        for clip in clips {
            self.check_interpolation(name, clip)?;
            self.note_curves(name, clip)?;
        }
        let output = &self.arguments.output;
        let kind = match output.poses() {
            _ if self.is_baked(target) => ResultKind::Baked,
            _ if self.is_motion(clips, target) => ResultKind::Motion,
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
        let tracks = &self.arguments.inputs.tracks;
        if kind == ResultKind::Motion {
            let some = self.arguments.command_line.has("tracks");
            let some = some.then_some("some tracks make");
            document_to_rewrite(name, self.loaded, target, some);
            let selected = clips
                .iter()
                .map(|&clip| tracks.select_with_ancestors(clip, name));
            let selected: Vec<Cow<'_, Motion>> = selected.collect::<Result<_, Failure>>()?;
            let clips: Vec<&Motion> = selected.iter().map(|clip| &**clip).collect();
            return self.motion(name, &clips, target);
        }
        let [clip] = clips else {
            let message =
                format!("{name}: --output needs a single animation; choose one with --animation");
            return Err(Failure::usage(message));
        };
        if let (ResultKind::Poses, Some(poses)) = (kind, output.poses()) {
            return self.poses(name, clip, poses, target);
        }
        self.rotations(name, &*tracks.select(clip, name)?, target)
    }

    /// Warns where the evaluated curves are less smooth than their method promises.
    fn note_curves(&self, name: &str, clip: &Motion) -> Result<(), Failure> {
        let (Some(method), with) = self.methods() else {
            return Ok(()); // No file asks for such a method.
        };
        let selected = self.arguments.inputs.tracks.select(clip, name)?;
        if let Some(warning) = curve_warning(name, &selected.set, &with(method)) {
            words::note(&warning.to_string());
        }
        Ok(())
    }

    /// Refuses options that have no effect on the methods of a clip's channels.
    fn check_interpolation(&self, name: &str, clip: &Motion) -> Result<(), Failure> {
        let (method, with) = self.methods();
        let methods = ChannelMethods {
            method,
            with: &with,
        };
        let used_methods: Vec<Method> = methods
            .groups_of(clip)
            .iter()
            .map(|group| group.0)
            .collect();
        let checked = self.arguments.interpolation.check(&used_methods);
        checked.map_err(|message| Failure::usage(format!("{name}: {message}")))
    }

    /// With `--explain-route`, prints the route by which a clip's rotations are evaluated.
    fn explain(
        &mut self,
        name: &str,
        clip: &Motion,
        frames: &SampleTimes,
        layout: Layout,
    ) -> Result<(), Failure> {
        if !self.arguments.explain_route {
            return Ok(());
        }
        let (method, with) = self.methods();
        let methods = ChannelMethods {
            method,
            with: &with,
        };
        let groups = methods.groups_of(clip);
        let whole = groups.len() == 1;
        for (method, tracks) in groups {
            let set = (clip.set.select(tracks.iter().copied()))
                .map_err(|error| Failure::evaluating(name, &error.into()))?;
            let explain =
                |engine: &Engine| engine.explain_route(&set, with(method), frames, layout);
            let samples = frames.resolve(set.track_count(), clip.set.time_span());
            let route = samples
                .map_err(Error::from)
                .and_then(|timeline| {
                    self.device
                        .choose(clip.set.track_count() * timeline.len())?;
                    self.device.work(explain)
                })
                .map_err(|error| Failure::evaluating(name, &error))?;
            words::note(&match whole {
                true => format!("{name}: {route}"),
                false => format!(
                    "{name}, {} by {method}: {route}",
                    words::count(tracks.len(), "track")
                ),
            });
        }
        Ok(())
    }

    /// How a result was made, for formats that store it.
    fn notes(&self, name: &str) -> Result<Vec<(&'static str, String)>, Failure> {
        let mut notes = vec![
            ("method", self.arguments.method.to_string()),
            ("input", name.to_owned()),
        ];
        let sha256 = self.file.sha256().map(str::to_owned);
        // The hash is of the bytes that were read, or none.
        self.file.check_unchanged()?;
        notes.extend(sha256.map(|hash| ("input_sha256", hash)));
        Ok(notes)
    }

    /// The method of all channels, if there is one, and the interpolation by a method.
    fn methods(&self) -> (Option<Method>, impl Fn(Method) -> Interpolation + use<>) {
        let quantity = self.arguments.output.quantity();
        let interpolation = self.arguments.interpolation;
        let with = move |method| Interpolation {
            quantity,
            ..interpolation.with(method)
        };
        (self.arguments.method.0, with)
    }

    fn evaluated(
        &self,
        name: &str,
        (tracks, frames, span): (usize, usize, Option<(f64, f64)>),
        method: &str,
        written: WrittenFile,
        target: &ResultTarget,
        order: Option<ComponentOrder>,
    ) -> (EvaluatedResult, EvaluationReport) {
        let elapsed = self.started.elapsed();
        let message = format!(
            "{name}: {} × {}{}, {method}, on {} in {} → {target}",
            words::count(tracks, "track"),
            words::count(frames, "frame"),
            match self.in_gaps {
                0 => String::new(),
                count => format!(
                    " ({} in gaps {})",
                    count,
                    self.arguments.at_keys.done_in_gaps()
                ),
            },
            self.device.label,
            words::duration(elapsed),
        );
        let report = EvaluationReport {
            input: name.to_owned(),
            output: target.path().display().to_string(),
            format: target.format().name,
            tracks,
            frames,
            first_time: span.map(|span| span.0),
            in_gaps: self
                .arguments
                .command_line
                .has("max_gap")
                .then_some(self.in_gaps),
            last_time: span.map(|span| span.1),
            output_kind: self.arguments.output.name(),
            order: order.map(ComponentOrder::name),
            method: method.to_owned(),
            device: self.device.label.clone(),
            seconds: elapsed.as_secs_f64(),
        };
        let evaluated = EvaluatedResult {
            written,
            device: self.device.label.clone(),
            message,
        };
        (evaluated, report)
    }
}
