//! `tumble convert`: the keys of a file in another format, as they are.

use std::borrow::Cow;
use std::time::Instant;

use clap::Args;
use tumble::{Device, Engine, EulerSequence};
use tumble_formats::dense::KeysError;
use tumble_formats::format::{Document, FormatOption, MotionOptions};
use tumble_formats::motion::{Motion, Sampled};
use tumble_formats::sample::Samples;
use tumble_formats::trim::{TrimError, trim};
use tumble_formats::{Feature, Loaded};

use crate::arguments::given::Given;
use crate::arguments::input::{self, Inputs};
use crate::arguments::results::{Results, check_sequence, each_file, kept};
use crate::arguments::time::{check_range, finite_seconds};
use crate::arguments::what::{OrderArgument, sequence};
use crate::batch::output::Target;
use crate::batch::place::Written;
use crate::batch::run::Evaluated;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Write the keys of motion files in another format, at their own times
#[derive(Debug, Args)]
#[command(after_help = "\
Nothing is sampled: keys stay what and when they are. A file whose channels have keys at
different times goes through `tumble eval --fps`, unless its format holds such. --start and --end
cut: a channel that goes over a cut gets a key there, on its curve, so that steps, lines and arcs stay
as they are; a smooth curve, which depends on keys beyond the cut too, changes beside it. A file of the
same format keeps all else that it holds; --tracks and --animation make a new one of what they name.

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
    /// The axes of the angles of BVH, three different ones [default: those of the input, else ZXY]
    #[arg(long, value_name = "AXES", value_parser = sequence)]
    sequence: Option<EulerSequence>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    check_range(arguments.start, arguments.end)?;
    let files = arguments.inputs.gather(false)?;
    let plan = arguments.results.plan(&files)?;
    let no_motion = |target: &&Target| !target.format().writes_clips();
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
    check_sequence(arguments.sequence, format)?;
    let options = format!("convert {}", arguments.given.options());
    let results = &arguments.results;
    results.make(
        &arguments.inputs,
        plan,
        options,
        |file, loaded, target, done| {
            let path = file.path();
            let convert = |name: &str, clips: &[&Motion], target: &Target| {
                arguments.convert(name, (clips, loaded), target)
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
        (clips, loaded): (&[&Motion], &Loaded),
        target: &Target,
    ) -> Result<Evaluated, Failure> {
        let started = Instant::now();
        let document = kept(name, loaded, target, self.makes_new(target));
        let parts = clips.iter().map(|&clip| self.part(name, clip));
        let parts: Vec<Cow<'_, Motion>> = parts.collect::<Result<_, Failure>>()?;
        let is_whole = (self.start, self.end) == (None, None);
        let is_copy = document.is_some() && is_whole && !self.inputs.reading.changes_keys();
        let options = MotionOptions {
            order: self.order.map(OrderArgument::order),
            sequence: self.sequence,
            box_length: loaded.box_length,
            ..target.motion_options()
        };
        let written = match document.filter(|_| is_copy) {
            Some(document) => {
                target.write_motion(|out| document.write(&[], &options, target.path(), out))?
            }
            None => write(name, &parts, document, options, target)?,
        };
        let told = format!(
            "{name}: {}, {} in {} → {target}",
            words::count(parts.len(), "clip"),
            words::count(parts.iter().map(|clip| clip.key_count()).sum(), "key"),
            words::duration(started.elapsed()),
        );
        Ok(Evaluated {
            written,
            device: "none".to_owned(),
            told,
        })
    }

    /// What makes a new file, where an input is not kept.
    fn makes_new(&self, target: &Target) -> Option<&'static str> {
        let several = target.format().holds(Feature::SeveralClips);
        if self.inputs.tracks.is_given() {
            return Some("some tracks make");
        }
        (self.inputs.reading.chooses() && several).then_some("one animation makes")
    }
}

/// Writes clips: into the input's own file, if it is kept, else into a new one.
fn write(
    name: &str,
    clips: &[Cow<'_, Motion>],
    document: Option<&dyn Document>,
    options: MotionOptions,
    target: &Target,
) -> Result<Written, Failure> {
    let keys = clips.iter().map(|clip| {
        let keys = clip.keys_for(target.format(), document.is_some());
        keys.map_err(|error| match error {
            KeysError::Evaluating(error) => Failure::evaluating(name, &error),
            error => Failure::new(ALL_INPUTS, format!("{name}: {error}")),
        })
    });
    let keys: Vec<(Samples, bool)> = keys.collect::<Result<_, Failure>>()?;
    // Formats of frames need a rate; others have the times.
    let has_times = target.format().holds(Feature::UnevenTimes);
    let rate = |clip: &Motion| match has_times {
        true => clip.rate,
        false => clip.rate.or_else(|| clip.rate_of_keys()),
    };
    let notes = [("input", name.to_owned())];
    let sampled = (clips.iter().zip(&keys)).map(|(clip, (samples, of_own_keys))| Sampled {
        of_own_keys: *of_own_keys,
        ..samples.of(clip, rate(clip), &notes)
    });
    match document {
        Some(document) => {
            let places = clips.iter().map(|clip| clip.place);
            let clips: Vec<(usize, Sampled<'_>)> = places.zip(sampled).collect();
            target.write_motion(|out| document.write(&clips, &options, target.path(), out))
        }
        None => {
            let clips: Vec<Sampled<'_>> = sampled.collect();
            let written =
                target.write_motion(|out| target.format().write_clips(&clips, &options, out))?;
            target.write_times(&clips)?;
            Ok(written)
        }
    }
}
