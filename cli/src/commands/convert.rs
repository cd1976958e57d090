//! `tumble convert`: the keys of a file in another format, as they are.

use std::time::Instant;

use clap::Args;
use tumble_formats::keyed::keyed;
use tumble_formats::motion::{Motion, Sampled};
use tumble_formats::sample::Samples;

use crate::arguments::input::{self, Inputs};
use crate::arguments::results::{Results, each_file};
use crate::batch::output::Target;
use crate::batch::run::Evaluated;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Write the keys of motion files in another format, at their own times
#[derive(Debug, Args)]
#[command(after_help = "\
Nothing is sampled: keys stay what and when they are. A file whose channels have keys at
different times goes through `tumble eval --fps`, unless its format holds such.

Examples:
  tumble convert walk.bvh -o walk.glb
  tumble convert amass -o glb --to glb         a directory's tree
  tumble convert walk.npz --up y --scale 100 -o walk.bvh")]
pub(crate) struct Arguments {
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    results: Results,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let files = arguments.inputs.gather(false)?;
    let plan = arguments.results.plan(&files)?;
    let no_motion = |target: &&Target| target.format().write_motion.is_none();
    if let Some(target) = plan.targets.iter().find(no_motion) {
        let format = target.format().name;
        return Err(Failure::usage(format!(
            "{target}: {format} holds results of `tumble eval`, not keys"
        )));
    }
    let options = format!("convert {:?}", arguments.inputs.reading);
    let results = &arguments.results;
    results.make(
        &arguments.inputs,
        &files,
        plan,
        options,
        |path, loaded, target, done| {
            each_file(&input::name(path), (path, loaded), target, done, convert)
        },
    )
}

fn convert(name: &str, clips: &[&Motion], target: &Target) -> Result<Evaluated, Failure> {
    let started = Instant::now();
    let keys: Result<Vec<Samples>, _> = clips.iter().map(|clip| keyed(clip)).collect();
    let keys = keys.map_err(|error| Failure::new(ALL_INPUTS, format!("{name}: {error}")))?;
    let notes = [("input", name.to_owned())];
    let sampled: Vec<Sampled<'_>> = (clips.iter().zip(&keys))
        .map(|(clip, keys)| keys.of(clip, clip.rate, &notes))
        .collect();
    let options = target.motion_options();
    let write = target.format().write_motion;
    let written = target.write_motion(|out| match write {
        Some(write) => write(&sampled, &options, out),
        None => Ok(Vec::new()),
    })?;
    let told = format!(
        "{name}: {}, {} in {} → {target}",
        words::count(clips.len(), "clip"),
        words::count(keys.iter().map(|keys| keys.times.len()).sum(), "time"),
        words::duration(started.elapsed()),
    );
    Ok(Evaluated {
        written,
        device: "none".to_owned(),
        told,
    })
}
