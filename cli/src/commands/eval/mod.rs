//! `tumble eval`: keyframe files in, rotations and whole poses at every frame out.

mod motion;
mod rotations;

use std::path::Path;
use std::time::Instant;

use clap::{Args, ValueEnum};
use tumble::{Encoding, Interpolation, Method};
use tumble_formats::Loaded;
use tumble_formats::motion::Motion;
use tumble_formats::npy::ComponentOrder;

use crate::arguments::device::{DeviceArguments, Opened};
use crate::arguments::input;
use crate::arguments::input::Inputs;
use crate::arguments::interpolation::{Manner, Wanted, wanted};
use crate::arguments::results::{Results, each_file};
use crate::arguments::time::{Samples, Sampling};
use crate::arguments::what::{What, quaternions};
use crate::batch::digest;
use crate::batch::output::Target;
use crate::batch::place::Written;
use crate::batch::run::Evaluated;
use crate::messages::exit::Failure;
use crate::messages::words;

/// Evaluate keyframe tracks at every frame
#[derive(Debug, Args)]
#[command(after_help = "\
The result is float32 of shape (tracks, frames, 4) in NPY (or as --output says), or CSV
with a row for each frame. CPU and Vulkan give the same bits.

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
  tumble eval - -o - < data/pendulum.dat | python3 -c \\
    'import io, sys, numpy; print(numpy.load(io.BytesIO(sys.stdin.buffer.read())).shape)'")]
pub(crate) struct Arguments {
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    results: Results,
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
    manner: Manner,
    #[command(flatten)]
    device: DeviceArguments,
    /// The order of NPY results in memory: (tracks, frames, 4) or (frames, tracks, 4)
    #[arg(long, value_enum, default_value = "track")]
    layout: LayoutArgument,
    /// The order of a quaternion's components in NPY results
    #[arg(long, value_enum, default_value = "xyzw")]
    order: OrderArgument,
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
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum LayoutArgument {
    /// (tracks, frames, 4)
    Track,
    /// (frames, tracks, 4)
    Frame,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum OrderArgument {
    Xyzw,
    Wxyz,
}

impl From<OrderArgument> for ComponentOrder {
    fn from(order: OrderArgument) -> Self {
        match order {
            OrderArgument::Xyzw => Self::Xyzw,
            OrderArgument::Wxyz => Self::Wxyz,
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    // Everything that can be refused is refused before any work.
    let inputs = arguments
        .inputs
        .gather(arguments.sampling.reads_standard_input())?;
    let samples = arguments.sampling.samples()?;
    let plan = arguments.results.plan(&inputs)?;
    let is_text = |target: &Target| target.format().write.as_ref().is_some_and(|it| it.is_text);
    let short = arguments.encoding != Encoding::F32;
    if short && plan.targets.iter().any(is_text) {
        return Err(Failure::usage(
            "--encoding is for binary results (NPY); text holds every digit",
        ));
    }
    let encoding = arguments.what.encoding(arguments.encoding);
    if short && encoding != arguments.encoding {
        return Err(Failure::usage("--encoding is for quaternions"));
    }
    let mut device = arguments.device.open()?;
    let options = arguments.options(&samples);
    let results = &arguments.results;
    results.make(
        &arguments.inputs,
        &inputs,
        plan,
        options,
        |path, loaded, target, done| {
            let mut job = Job {
                arguments,
                device: &mut device,
                samples: &samples,
                path,
                loaded,
                started: Instant::now(),
            };
            let name = input::name(path);
            each_file(
                &name,
                (path, loaded),
                target,
                done,
                |name, clips, target| job.evaluate(name, clips, target),
            )
        },
    )
}

impl Arguments {
    /// All that decides over the bytes of a result besides its input.
    fn options(&self, samples: &Samples) -> String {
        let times = samples.digest();
        format!(
            "{} {:?} {:?} {:?} {times} {:?} {:?} {:?} {:?} {:?}",
            self.method,
            self.inputs.reading,
            self.linear,
            self.sampling,
            self.manner,
            self.layout,
            self.order,
            self.encoding,
            self.what
        )
    }
}

/// What the results of one input are made with.
struct Job<'a> {
    arguments: &'a Arguments,
    device: &'a mut Opened,
    samples: &'a Samples,
    path: &'a Path,
    loaded: &'a Loaded,
    started: Instant,
}

impl Job<'_> {
    /// Some clips, into one file.
    fn evaluate(
        &mut self,
        name: &str,
        clips: &[&Motion],
        target: &Target,
    ) -> Result<Evaluated, Failure> {
        if self.is_baked(target) {
            return self.bake(name, clips, target);
        }
        if self.is_motion(clips, target) {
            return self.motion(name, clips, target);
        }
        let [clip] = clips else {
            let message = format!(
                "{name}: --output and its like are of one animation; choose one with --animation"
            );
            return Err(Failure::usage(message));
        };
        self.rotations(name, clip, target)
    }

    /// What made a result, for formats that have room for it.
    fn notes(&self, name: &str) -> Vec<(&'static str, String)> {
        let mut notes = vec![
            ("method", self.arguments.method.to_string()),
            ("input", name.to_owned()),
        ];
        notes.extend(digest::of_input(self.path).map(|hash| ("input_sha256", hash)));
        notes
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
        (tracks, frames): (usize, usize),
        method: &str,
        written: Written,
        target: &Target,
    ) -> Evaluated {
        let told = format!(
            "{name}: {} × {}, {method}, on {} in {} → {target}",
            words::count(tracks, "track"),
            words::count(frames, "frame"),
            self.device.label,
            words::duration(self.started.elapsed()),
        );
        Evaluated {
            written,
            device: self.device.label.clone(),
            told,
        }
    }
}
