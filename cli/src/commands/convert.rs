//! `tumble convert`: the keys of a file in another format, as they are.

use std::borrow::Cow;
use std::time::Instant;

use clap::Args;
use tumble::{Device, Engine};
use tumble_formats::format::{FormatOption, MotionOptions};
use tumble_formats::keyed::keyed;
use tumble_formats::motion::{Motion, Sampled};
use tumble_formats::sample::Samples;
use tumble_formats::trim::{TrimError, trim};

use crate::arguments::given::Given;
use crate::arguments::input::{self, Inputs};
use crate::arguments::results::{Results, each_file};
use crate::arguments::time::{check_range, finite_seconds};
use crate::arguments::what::OrderArgument;
use crate::batch::output::Target;
use crate::batch::run::Evaluated;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Write the keys of motion files in another format, at their own times
#[derive(Debug, Args)]
#[command(after_help = "\
Nothing is sampled: keys stay what and when they are. A file whose channels have keys at
different times goes through `tumble eval --fps`, unless its format holds such. --start and --end
cut: a channel that goes over a cut gets a key there, on its curve, so that steps, lines and arcs stay
as they are; a smooth curve, which depends on keys beyond the cut too, changes beside it.

Examples:
  tumble convert walk.bvh -o walk.glb
  tumble convert data/pendulum.dat --start 2.5 --end 8 -o part.dat
  tumble convert walk.bvh --tracks 'Left*' -o left.bvh
  tumble convert amass -o glb --to glb         a directory's tree
  tumble convert walk.npz --up y --scale 100 -o walk.bvh")]
pub(crate) struct Arguments {
    #[command(flatten)]
    given: Given,
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    results: Results,
    /// Where to start, seconds [default: the first key]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    start: Option<f64>,
    /// Where to end, seconds [default: the last key]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    end: Option<f64>,
    /// The order of a quaternion's columns in tables [default: xyzw; CSV: wxyz]
    #[arg(long, value_enum)]
    order: Option<OrderArgument>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    check_range(arguments.start, arguments.end)?;
    let files = arguments.inputs.gather(false)?;
    let plan = arguments.results.plan(&files)?;
    let no_motion = |target: &&Target| target.format().write_motion.is_none();
    if let Some(target) = plan.targets.iter().find(no_motion) {
        let format = target.format().name;
        return Err(Failure::usage(format!(
            "{target}: {format} holds results of `tumble eval`, not keys"
        )));
    }
    let format = plan.targets.first().map(Target::format);
    if let Some(format) = format.filter(|format| !format.takes(FormatOption::Order))
        && arguments.order.is_some()
    {
        return Err(Failure::usage(format!(
            "{} has an order of its own for the components of quaternions; leave out --order",
            format.name
        )));
    }
    let options = format!("convert {}", arguments.given.options());
    let results = &arguments.results;
    results.make(
        &arguments.inputs,
        plan,
        options,
        |file, loaded, target, done| {
            let path = file.path();
            let convert = |name: &str, clips: &[&Motion], target: &Target| {
                arguments.convert(name, (clips, loaded.box_length), target)
            };
            each_file(&input::name(path), (path, loaded), target, done, convert)
        },
    )
}

impl Arguments {
    /// The part of a clip that is asked for.
    fn part<'a>(&self, name: &str, clip: &'a Motion) -> Result<Cow<'a, Motion>, Failure> {
        let clip = self.inputs.tracks.select_with_ancestors(clip, name)?;
        let Some((first, last)) = clip.set.time_span() else {
            return Ok(clip);
        };
        if (self.start, self.end) == (None, None) {
            return Ok(clip);
        }
        let failed = |error: TrimError| match error {
            TrimError::Evaluating(error) => Failure::evaluating(name, &error),
            error => Failure::new(ALL_INPUTS, format!("{name}: {error}")),
        };
        let engine = Engine::new(Device::Cpu).map_err(|error| Failure::evaluating(name, &error))?;
        let (start, end) = (self.start.unwrap_or(first), self.end.unwrap_or(last));
        trim(&clip, start, end, &engine)
            .map(Cow::Owned)
            .map_err(failed)
    }

    fn convert(
        &self,
        name: &str,
        (clips, box_length): (&[&Motion], Option<f64>),
        target: &Target,
    ) -> Result<Evaluated, Failure> {
        let started = Instant::now();
        let clips = clips.iter().map(|&clip| self.part(name, clip));
        let clips: Vec<Cow<'_, Motion>> = clips.collect::<Result<_, Failure>>()?;
        let options = MotionOptions {
            order: self.order.map(OrderArgument::order),
            box_length,
            ..target.motion_options()
        };
        write(name, &clips, options, started, target)
    }
}

fn write(
    name: &str,
    clips: &[Cow<'_, Motion>],
    options: MotionOptions,
    started: Instant,
    target: &Target,
) -> Result<Evaluated, Failure> {
    // A format that has keys of each channel at times of their own keeps them, where channels differ.
    let has_own_keys = target.format().takes(FormatOption::OwnKeys);
    let mut keys: Vec<(Samples, bool)> = Vec::new();
    for clip in clips {
        keys.push(match keyed(clip) {
            Ok(samples) => (samples, false),
            Err(_) if has_own_keys && !clip.is_world => {
                let engine = Engine::new(Device::Cpu);
                let ends = engine.and_then(|engine| clip.ends(&engine));
                (
                    ends.map_err(|error| Failure::evaluating(name, &error))?,
                    true,
                )
            }
            Err(error) => return Err(Failure::new(ALL_INPUTS, format!("{name}: {error}"))),
        });
    }
    let notes = [("input", name.to_owned())];
    let sampled: Vec<Sampled<'_>> = (clips.iter().zip(&keys))
        .map(|(clip, (samples, of_own_keys))| Sampled {
            of_own_keys: *of_own_keys,
            ..samples.of(clip, clip.rate, &notes)
        })
        .collect();
    let write = target.format().write_motion;
    let written = target.write_motion(|out| match write {
        Some(write) => write(&sampled, &options, out),
        None => Ok(Vec::new()),
    })?;
    let told = format!(
        "{name}: {}, {} in {} → {target}",
        words::count(clips.len(), "clip"),
        words::count(clips.iter().map(|clip| clip.key_count()).sum(), "key"),
        words::duration(started.elapsed()),
    );
    Ok(Evaluated {
        written,
        device: "none".to_owned(),
        told,
    })
}
