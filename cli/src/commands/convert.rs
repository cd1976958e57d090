//! `tumble convert`: the keys of a file in another format, as they are.

use std::borrow::Cow;
use std::time::Instant;

use clap::Args;
use tumble::{Device, Engine, EulerSequence};
use tumble_formats::Feature;
use tumble_formats::format::{Document, FormatOption, MotionOptions};
use tumble_formats::keyed::{KeysError, keys_for};
use tumble_formats::motion::{Motion, SampledClip};
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::sample::Samples;
use tumble_formats::trim::{TrimError, trim};

use crate::arguments::command_line::CommandLine;
use crate::arguments::input::Inputs;
use crate::arguments::output::{component_order, sequence};
use crate::arguments::results::{ResultArguments, check_sequence, document_to_rewrite};
use crate::arguments::time::{check_range, finite_seconds};
use crate::batch::destination::WrittenFile;
use crate::batch::pipeline::{ClipWork, EvaluatedResult};
use crate::batch::target::ResultTarget;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Write the keys of motion files in another format, at their own times
#[derive(Debug, Args)]
#[command(after_help = "\
Nothing is sampled: keys keep their values and their times. If channels have keys at different times
and the output format cannot store that, use `tumble eval --fps`. --start and --end cut: a channel
that crosses a cut gets a key there, on its curve, so that steps, lines and arcs do not change; a smooth
curve, which depends on keys outside the cut too, changes near it. An output of the input's format keeps
everything else in the file; --tracks and --animation make a new file of the selection.

Examples:
  tumble convert walk.bvh -o walk.glb
  tumble convert data/pendulum.dat --start 2.5 --end 8 -o part.dat
  tumble convert walk.bvh --tracks 'Left*' -o left.bvh
  tumble convert amass -o glb --to glb         a directory's tree
  tumble convert walk.npz --up y --scale 100 -o walk.bvh")]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    results: ResultArguments,
    /// Where to start, seconds [default: the first key]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    start: Option<f64>,
    /// Where to end, seconds [default: the last key]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    end: Option<f64>,
    /// The order of a quaternion's columns in tables [default: xyzw; CSV: wxyz]
    #[arg(long, value_parser = component_order())]
    order: Option<ComponentOrder>,
    /// The axes of the angles of BVH, three different ones [default: those of the input, else ZXY]
    #[arg(long, value_name = "AXES", value_parser = sequence)]
    sequence: Option<EulerSequence>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    check_range(arguments.start, arguments.end)?;
    let files = arguments.inputs.gather(false)?;
    let plan = arguments.results.plan(&files)?;
    let no_motion = |target: &&ResultTarget| !target.format().writes_clips();
    if let Some(target) = plan.targets.iter().find(no_motion) {
        let format = target.format().name;
        return Err(Failure::usage(format!(
            "{target}: {format} holds results of `tumble eval`, not keys"
        )));
    }
    let format = plan.targets.first().map(ResultTarget::format);
    if let Some(format) = format.filter(|format| !format.takes(FormatOption::Order))
        && arguments.order.is_some()
    {
        return Err(Failure::usage(format!(
            "{} has a fixed order of quaternion components; leave out --order",
            format.name
        )));
    }
    check_sequence(arguments.sequence, format)?;
    let options = format!("convert {}", arguments.command_line.options());
    let reader = arguments.inputs.clone();
    let mut pipeline = arguments.results.start(reader, plan, options);
    while let Some(work) = pipeline.next_work() {
        let converted = arguments.convert(&work);
        pipeline.keep(&work, converted.map(|result| (result, ())));
    }
    pipeline.finish()
}

impl Arguments {
    /// The requested part of a clip.
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

    fn convert(&self, work: &ClipWork) -> Result<EvaluatedResult, Failure> {
        let started = Instant::now();
        let (name, clips, target) = (&*work.name, work.clips(), &work.target);
        let loaded = &work.input.loaded;
        let document = document_to_rewrite(name, loaded, target, self.makes_new(target));
        let parts = clips.iter().map(|&clip| self.part(name, clip));
        let parts: Vec<Cow<'_, Motion>> = parts.collect::<Result<_, Failure>>()?;
        let is_whole = (self.start, self.end) == (None, None);
        let is_copy = document.is_some() && is_whole && !self.inputs.reading.changes_keys();
        let options = MotionOptions {
            order: self.order,
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
        let message = format!(
            "{name}: {}, {} in {} → {target}",
            words::count(parts.len(), "clip"),
            words::count(parts.iter().map(|clip| clip.key_count()).sum(), "key"),
            words::duration(started.elapsed()),
        );
        Ok(EvaluatedResult {
            written,
            device: "none".to_owned(),
            message,
        })
    }

    /// The reason for a new file, where the input is not rewritten.
    fn makes_new(&self, target: &ResultTarget) -> Option<&'static str> {
        let several = target.format().supports(Feature::SeveralClips);
        if self.inputs.tracks.is_set() {
            return Some("some tracks make");
        }
        (self.inputs.reading.chooses_animation() && several).then_some("one animation makes")
    }
}

/// Writes clips: into the input's own file, if it is kept, else into a new one.
fn write(
    name: &str,
    clips: &[Cow<'_, Motion>],
    document: Option<&dyn Document>,
    options: MotionOptions,
    target: &ResultTarget,
) -> Result<WrittenFile, Failure> {
    let keys = clips.iter().map(|clip| {
        let keys = keys_for(clip, target.format(), document.is_some());
        keys.map_err(|error| match error {
            KeysError::Evaluating(error) => Failure::evaluating(name, &error),
            error => Failure::new(ALL_INPUTS, format!("{name}: {error}")),
        })
    });
    let keys: Vec<(Samples, bool)> = keys.collect::<Result<_, Failure>>()?;
    // Formats of frames need a rate; others have the times.
    let has_times = target.format().supports(Feature::UnevenTimes);
    let rate = |clip: &Motion| match has_times {
        true => clip.rate,
        false => clip.rate.or_else(|| clip.rate_of_keys()),
    };
    let notes = [("input", name.to_owned())];
    let sampled = (clips.iter().zip(&keys)).map(|(clip, (samples, per_channel))| SampledClip {
        is_at_keys: *per_channel,
        ..samples.of(clip, rate(clip), &notes)
    });
    let sampled: Vec<SampledClip<'_>> = sampled.collect();
    let indices = clips.iter().map(|clip| clip.index);
    target.write_clips(&sampled, indices, document, &options)
}
