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
use tumble::{Encoding, Engine, Error, Frames, Interpolation, Layout, Method};
use tumble_formats::Loaded;
use tumble_formats::motion::Motion;
use tumble_formats::npy::ComponentOrder;
use tumble_formats::sample::ChannelMethods;

use crate::arguments::device::{DeviceArguments, Opened};
use crate::arguments::given::Given;
use crate::arguments::input;
use crate::arguments::input::Inputs;
use crate::arguments::interpolation::{Manner, Wanted, curve_warning, wanted};
use crate::arguments::results::{Results, each_file, kept};
use crate::arguments::time::{AtKeys, Samples, Sampling};
use crate::arguments::what::{OrderArgument, What, quaternions};
use crate::batch::digest::InputFile;
use crate::batch::output::Target;
use crate::batch::place::Written;
use crate::batch::run::{Done, Evaluated};
use crate::commands::eval::applies::Kind;
use crate::commands::eval::shards::Part;
use crate::messages::exit::Failure;
use crate::messages::words;

/// Evaluate keyframe tracks at every frame
#[derive(Debug, Args)]
#[command(after_help = "\
The result is float32 of shape (tracks, frames, 4) in NPY, x y z w (or as --output, --layout
and --order say), or CSV with a row for each frame, whose header names the columns, w x y z where
--order says nothing. An option that says nothing to a result is refused. CPU and Vulkan give the
same bits.

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
    given: Given,
    #[command(flatten)]
    pub(crate) inputs: Inputs,
    #[command(flatten)]
    pub(crate) results: Results,
    /// How to interpolate (`tumble methods`); channels that hold each key until the next one stay
    /// as they are
    #[arg(
        short,
        long,
        value_name = "METHOD",
        default_value = "authored",
        value_parser = wanted()
    )]
    method: Wanted,
    #[command(flatten)]
    sampling: Sampling,
    #[command(flatten)]
    at_keys: AtKeys,
    #[command(flatten)]
    manner: Manner,
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    /// The order of results: (tracks, frames, 4) or (frames, tracks, 4); poses and CSV come frame by
    /// frame
    #[arg(long, value_enum, default_value = "track")]
    layout: LayoutArgument,
    /// The order of a quaternion's components [default: xyzw; CSV of rotations: wxyz]
    #[arg(long, value_enum)]
    order: Option<OrderArgument>,
    /// What a component of NPY results is stored as
    #[arg(long, value_name = "ENCODING", default_value = "f32", value_parser = quaternions())]
    encoding: Encoding,
    #[command(flatten)]
    what: What,
    /// NPZ in and out: arrays with a number for each frame that are interpolated linearly, instead
    /// of being left out
    #[arg(long, value_name = "ARRAYS", value_delimiter = ',')]
    linear: Vec<String>,
    /// Also say which way each input takes to its rotations; all ways give the same bits
    #[arg(long)]
    explain_route: bool,
    /// Evaluate one part of several into a directory that other processes fill too, then `tumble
    /// merge` it: I/N, such as 3/64, or one shard by its number
    #[arg(long, value_name = "I/N")]
    shard: Option<Part>,
    /// The input of a shard, at most; shards have 256 inputs at most, and depend on nothing else
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

/// What is told of one result with `--json`.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Told {
    /// The input, and its animation where it has several.
    input: String,
    /// Where the result is; `-` is standard output.
    output: String,
    format: &'static str,
    tracks: usize,
    frames: usize,
    /// Of the first and the last frame, seconds; nothing where there are none.
    first_time: Option<f64>,
    last_time: Option<f64>,
    /// Times between keys that are too far apart, which were left out or held; nothing without `--max-gap`.
    #[serde(skip_serializing_if = "Option::is_none")]
    in_gaps: Option<usize>,
    /// What was written of each rotation.
    what: &'static str,
    /// The components of a quaternion as they are written; nothing where none are, or where the
    /// format has an order of its own.
    order: Option<&'static str>,
    method: String,
    device: String,
    seconds: f64,
}

impl Told {
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
    if arguments.json && plan.targets.iter().any(Target::is_standard) {
        return Err(Failure::usage(
            "--json and the result cannot both go to standard output; give -o FILE",
        ));
    }
    arguments.take_keys();
    let mut device = arguments.device.open()?;
    let options = arguments.options(&samples);
    let results = &arguments.results;
    let mut told = Vec::new();
    let outcome = results.make(
        &arguments.inputs,
        plan,
        options,
        |file, loaded, target, done| {
            let job = Job {
                arguments,
                device: &mut device,
                samples: &samples,
                file,
                loaded,
                started: Instant::now(),
                in_gaps: 0,
            };
            job.run(target, done, &mut told)
        },
    );
    if arguments.json {
        words::json(&told)?;
    }
    outcome
}

impl Arguments {
    /// The samples, once the method takes what is said of it.
    fn checked_samples(&self) -> Result<Samples, Failure> {
        if let Some(method) = self.method.0 {
            let checked = self.manner.check(&[method]);
            checked.map_err(Failure::usage)?;
        }
        match self.at_keys.samples()? {
            Some(samples) => Ok(samples),
            None => self.sampling.samples(),
        }
    }

    /// Says which keys are read.
    fn take_keys(&self) {
        if self.method.0.is_some() {
            self.inputs.reading.take_keyframes();
        }
    }

    /// All that decides over the bytes of a result besides its input.
    fn options(&self, samples: &Samples) -> String {
        let mut options = self.given.options();
        if let Samples::Times(_) | Samples::Keys(_) = samples {
            options += &format!(" times={}", samples.digest());
        }
        options
    }

    fn order(&self) -> Option<ComponentOrder> {
        self.order.map(OrderArgument::order)
    }
}

/// What the results of one input are made with.
struct Job<'a> {
    arguments: &'a Arguments,
    device: &'a mut Opened,
    samples: &'a Samples,
    file: &'a InputFile,
    loaded: &'a Loaded,
    started: Instant,
    /// Times in gaps of the clips that are being evaluated.
    in_gaps: usize,
}

impl Job<'_> {
    /// All clips of the input; `told` gets what is to be said of each result that is done.
    fn run(
        mut self,
        target: &Target,
        done: &mut Done<'_>,
        told: &mut Vec<Told>,
    ) -> Result<(), Failure> {
        let path = self.file.path();
        let name = input::name(path);
        let file = (path, self.loaded);
        let latest = RefCell::new(None);
        let mut done = |name: &str, evaluated: Evaluated| {
            done(name, evaluated)?;
            told.extend(latest.take());
            Ok(())
        };
        each_file(&name, file, target, &mut done, |name, clips, target| {
            let (evaluated, own) = self.evaluate(name, clips, target)?;
            latest.replace(Some(own));
            Ok(evaluated)
        })
    }

    /// Some clips, into one file.
    fn evaluate(
        &mut self,
        name: &str,
        clips: &[&Motion],
        target: &Target,
    ) -> Result<(Evaluated, Told), Failure> {
        for clip in clips {
            self.check_manner(name, clip)?;
            self.note_curves(name, clip)?;
        }
        let what = &self.arguments.what;
        let kind = match what.poses() {
            _ if self.is_baked(target) => Kind::Baked,
            _ if self.is_motion(clips, target) => Kind::Motion,
            Some(_) => Kind::Poses,
            None => Kind::Rotations,
        };
        let refused = |failure: Failure| failure.of(name);
        self.arguments
            .check(kind, target.format())
            .map_err(refused)?;
        if kind == Kind::Baked {
            return self.bake(name, clips, target);
        }
        let tracks = &self.arguments.inputs.tracks;
        if kind == Kind::Motion {
            let some = self.arguments.given.has("tracks");
            let some = some.then_some("some tracks make");
            kept(name, self.loaded, target, some);
            let selected = clips
                .iter()
                .map(|&clip| tracks.select_with_ancestors(clip, name));
            let selected: Vec<Cow<'_, Motion>> = selected.collect::<Result<_, Failure>>()?;
            let clips: Vec<&Motion> = selected.iter().map(|clip| &**clip).collect();
            return self.motion(name, &clips, target);
        }
        let [clip] = clips else {
            let message = format!(
                "{name}: --output and its like are of one animation; choose one with --animation"
            );
            return Err(Failure::usage(message));
        };
        if let (Kind::Poses, Some(poses)) = (kind, what.poses()) {
            return self.poses(name, clip, poses, target);
        }
        self.rotations(name, &*tracks.select(clip, name)?, target)
    }

    /// Says where the curves of the tracks that are evaluated are less smooth than their method promises.
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

    /// Refuses what says nothing to the methods of a clip's channels, and units of what has none.
    fn check_manner(&self, name: &str, clip: &Motion) -> Result<(), Failure> {
        let (method, with) = self.methods();
        let methods = ChannelMethods {
            method,
            with: &with,
        };
        let own: Vec<Method> = methods
            .groups_of(clip)
            .iter()
            .map(|group| group.0)
            .collect();
        let checked = self.arguments.manner.check(&own);
        checked.map_err(|message| Failure::usage(format!("{name}: {message}")))
    }

    /// Says which way a clip's rotations take, where that is asked for.
    fn explain(
        &mut self,
        name: &str,
        clip: &Motion,
        frames: &Frames,
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

    /// What made a result, for formats that have room for it.
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

    /// Which method interpolates each channel.
    fn methods(&self) -> (Option<Method>, impl Fn(Method) -> Interpolation + use<>) {
        let quantity = self.arguments.what.quantity();
        let manner = self.arguments.manner;
        let with = move |method| Interpolation {
            quantity,
            ..manner.with(method)
        };
        (self.arguments.method.0, with)
    }

    fn evaluated(
        &self,
        name: &str,
        (tracks, frames, span): (usize, usize, Option<(f64, f64)>),
        method: &str,
        written: Written,
        target: &Target,
        order: Option<ComponentOrder>,
    ) -> (Evaluated, Told) {
        let elapsed = self.started.elapsed();
        let told = format!(
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
        let own = Told {
            input: name.to_owned(),
            output: target.path().display().to_string(),
            format: target.format().name,
            tracks,
            frames,
            first_time: span.map(|span| span.0),
            in_gaps: self.arguments.given.has("max_gap").then_some(self.in_gaps),
            last_time: span.map(|span| span.1),
            what: self.arguments.what.name(),
            order: order.map(ComponentOrder::name),
            method: method.to_owned(),
            device: self.device.label.clone(),
            seconds: elapsed.as_secs_f64(),
        };
        let evaluated = Evaluated {
            written,
            device: self.device.label.clone(),
            told,
        };
        (evaluated, own)
    }
}
