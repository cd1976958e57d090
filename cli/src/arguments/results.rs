//! Options for outputs and their format.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use clap::Args;
use tumble::EulerSequence;
use tumble_formats::format::{Adjustment, Document, FormatOption, MotionOptions, left_behind};
use tumble_formats::keyed::{KeysError, keys_for};
use tumble_formats::motion::{Motion, SampledClip};
use tumble_formats::sample::Samples;
use tumble_formats::{Code, Diagnostic, Feature, Format};

use crate::arguments::input::{GatheredInputs, InputReader, Inputs};
use crate::arguments::options::{self, ResultOptions};
use crate::batch::entry::InputEntry;
use crate::batch::output_plan::{self, OutputOptions, OutputPlan};
use crate::batch::pipeline::{BatchOptions, ClipWork, Pipeline, PipelineInputs};
use crate::batch::preview::{PlannedWork, Preview, preview};
use crate::batch::result_names::ResultNaming;
use crate::batch::target::{self, Destination, ResultTarget, WrittenFile};
use crate::messages::exit::{ALL_INPUTS, DONE, Failure, Outcomes};
use crate::messages::{listing, names, words};

const ONE_INPUT: &str = "--times-out needs a single input whose result is a single file";

#[derive(Debug, Args)]
pub(crate) struct ResultArguments {
    #[arg(short, long = "output", alias = "out", value_name = "OUT", help = target::out_help())]
    out: Option<PathBuf>,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// In a directory of results: skip those that are complete and were made from the same input with
    /// the same options
    #[arg(long)]
    resume: bool,
    /// List the results that would be written, kept (--resume) and removed (--prune), and change nothing
    #[arg(short = 'n', long)]
    dry_run: bool,
    /// In a directory of results: remove those whose inputs do not exist any more, and their lines in the manifest
    #[arg(long)]
    prune: bool,
    /// In a directory of results: how results are named after their inputs
    #[arg(long, value_name = "NAMES", value_enum, default_value_t)]
    names: ResultNaming,
    /// Name results by the paths of their inputs below this directory
    #[arg(long, value_name = "DIR")]
    base: Option<PathBuf>,
    /// Print every result and every warning of a batch, which otherwise prints a summary if it is long
    #[arg(short, long)]
    verbose: bool,
    /// Print JSON: about the results and the inputs that failed
    #[arg(long)]
    json: bool,
    /// The format of the results [default: by the name of the output; npy in a directory and to standard output]
    #[arg(long, visible_alias = "to", value_parser = target::format())]
    format: Option<&'static Format>,
    /// KITTI, which stores no times: also write the times of the poses to this file, in seconds, one per
    /// line; needs a single input
    #[arg(long, value_name = "FILE")]
    times_out: Option<PathBuf>,
}

impl ResultArguments {
    /// The destination of a picture that is drawn beside the result of one input.
    pub(crate) fn picture(
        &self,
        file: &Path,
        plan: &OutputPlan,
    ) -> Result<Option<Destination>, Failure> {
        check_single("--plot", plan)?;
        let destination = Destination::of_picture(file, self.overwrite, &plan.paths)?;
        apart(destination, plan).map(Some)
    }

    /// The destination of a file that `option` names, which is written beside the result of one input.
    pub(crate) fn beside(
        &self,
        option: &str,
        file: &Path,
        plan: &OutputPlan,
    ) -> Result<Destination, Failure> {
        check_single(option, plan)?;
        apart(Destination::new(file, self.overwrite, &plan.paths)?, plan)
    }

    /// The directory of results, which the evaluation of shards needs.
    pub(crate) fn folder(&self) -> Result<&Path, Failure> {
        if self.times_out.is_some() {
            return Err(Failure::usage(ONE_INPUT));
        }
        match self.out.as_deref() {
            Some(out) if !names::is_standard(out) => Ok(out),
            _ => Err(Failure::usage(
                "shards need a directory for their results: -o DIRECTORY",
            )),
        }
    }

    /// The inputs with the paths of their results: those below `--base`.
    pub(crate) fn based(&self, mut inputs: GatheredInputs) -> Result<GatheredInputs, Failure> {
        if let Some(base) = &self.base {
            let files = inputs.files.into_iter().map(|found| found.below(base));
            inputs.files = files.collect::<Result<_, Failure>>()?;
        }
        Ok(inputs)
    }

    /// Refuses `--base` where the results of objects are named by the names of the objects.
    pub(crate) fn refuse_base(&self, library: &Path) -> Result<(), Failure> {
        match &self.base {
            None => Ok(()),
            Some(base) => Err(Failure::usage(format!(
                "--base {}: the results of objects are named by the objects' names below {}; leave it out, or give \
                 another library",
                base.display(),
                library.display()
            ))),
        }
    }

    /// Whether the times of the result are written to a separate file.
    pub(crate) fn has_times_apart(&self) -> bool {
        self.times_out.is_some()
    }

    /// How results are named.
    pub(crate) fn naming(&self) -> ResultNaming {
        self.names
    }

    /// Whether every line of a batch is printed.
    pub(crate) fn is_verbose(&self) -> bool {
        self.verbose
    }

    /// Whether JSON is printed.
    pub(crate) fn prints_json(&self) -> bool {
        self.json
    }

    /// Refuses options for shards that need all results of a directory.
    pub(crate) fn check_shards(&self) -> Result<(), Failure> {
        if self.dry_run {
            let message = "--dry-run lists the results of all inputs; leave out --shard";
            return Err(Failure::usage(message));
        }
        match self.prune {
            true => Err(Failure::usage(
                "--prune needs all inputs, and a shard has some of them; merge the shards, then run the command \
                 once more with --resume --prune and without shards",
            )),
            false => Ok(()),
        }
    }

    /// Where results go.
    pub(crate) fn out(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    /// The format that was asked for.
    pub(crate) fn format(&self) -> Option<&'static Format> {
        self.format
    }

    /// Whether results that are done are kept.
    pub(crate) fn is_resumed(&self) -> bool {
        self.resume
    }

    /// Whether results that are there are replaced.
    pub(crate) fn overwrites(&self) -> bool {
        self.overwrite
    }

    /// The destination of each input's result. Everything that can be refused is refused here, before any work.
    pub(crate) fn plan(
        &self,
        inputs: GatheredInputs,
        work: &PlannedWork<'_>,
    ) -> Result<OutputPlan, Failure> {
        self.plan_in(inputs, self.format, work)
    }

    /// As [`ResultArguments::plan`], in a format that another option may say.
    pub(crate) fn plan_in(
        &self,
        inputs: GatheredInputs,
        format: Option<&'static Format>,
        work: &PlannedWork<'_>,
    ) -> Result<OutputPlan, Failure> {
        let inputs = &self.based(inputs)?;
        let options = OutputOptions {
            out: self.out.as_deref(),
            format,
            overwrite: self.overwrite,
            resume: self.resume,
            prune: self.prune,
            naming: self.names,
            command: options::command_of(&work.options.text),
        };
        if self.dry_run {
            return Err(self.list_plan(inputs, options, work)?);
        }
        let mut plan = output_plan::plan(inputs, options)?;
        if plan.manifest.is_none() {
            let options = [
                ("--base", self.base.is_some()),
                ("--names full", self.names == ResultNaming::Full),
            ];
            if let Some((option, _)) = options.into_iter().find(|(_, is_set)| *is_set) {
                let message = format!("{option} is for a directory of results; leave it out");
                return Err(Failure::usage(message));
            }
        }
        for target in &plan.targets {
            target::refuse_both_on_standard(self.json, target.path())?;
        }
        if let Some(file) = &self.times_out {
            let (1, None, Some(target)) = (plan.targets.len(), &plan.manifest, plan.targets.pop())
            else {
                return Err(Failure::usage(ONE_INPUT));
            };
            let format = target.format();
            if !format.takes(FormatOption::TimesApart) {
                return Err(Failure::usage(format!(
                    "--times-out is for {}, whose times are in a separate file, and has no effect on {}; leave it out",
                    Format::names_taking(FormatOption::TimesApart),
                    format.name
                )));
            }
            let destination = Destination::new(file, self.overwrite, &plan.paths)?;
            plan.targets.push(target.with_times(destination)?);
        }
        Ok(plan)
    }

    /// `--dry-run`: lists the results, and ends the command.
    fn list_plan(
        &self,
        inputs: &GatheredInputs,
        options: OutputOptions<'_>,
        work: &PlannedWork<'_>,
    ) -> Result<Failure, Failure> {
        let preview = preview(inputs, options, work)?;
        let summary = preview.summary();
        let Preview { results, refused } = preview;
        let mut outcomes = Outcomes::of(inputs.files.len());
        let failed = refused.iter();
        let failed = failed.map(|input| InputEntry::failed(&input.path, None, &input.failure));
        let failed: Vec<InputEntry> = failed.collect();
        match self.json {
            true => listing::records(&results, &failed)?,
            false => {
                let lines = results.iter().map(|result| format!("{result}\n"));
                listing::text(&lines.collect::<String>())?;
            }
        }
        words::note(&summary);
        refused
            .into_iter()
            .for_each(|input| outcomes.add(Err(input.failure)));
        outcomes.finish()?;
        Ok(Failure::quiet(DONE))
    }

    /// Starts the work that `plan` has. `options` is everything that determines a result besides its input.
    pub(crate) fn start(
        &self,
        reader: impl InputReader,
        plan: OutputPlan,
        options: ResultOptions,
    ) -> Pipeline<'static> {
        let inputs = PipelineInputs {
            jobs: plan.paths.into_iter().zip(plan.targets).collect(),
            refused: plan.refused,
            skipped: plan.skipped,
            prints_json: self.json,
        };
        match plan.manifest {
            None => Pipeline::of_one(reader, inputs),
            Some(manifest) => Pipeline::of_batch(
                reader,
                inputs,
                BatchOptions {
                    options,
                    resume: self.resume,
                    overwrite: self.overwrite,
                    verbose: self.verbose,
                },
                Box::new(manifest),
            ),
        }
    }
}

/// Refuses an option for the result of one input.
fn check_single(option: &str, plan: &OutputPlan) -> Result<(), Failure> {
    match plan.paths.len() + plan.refused.len() > 1 {
        true => Err(Failure::usage(format!("{option} needs a single input"))),
        false => Ok(()),
    }
}

/// Refuses a picture of an input that has several animations to draw.
pub(crate) fn check_one_drawn(
    plot: Option<&Destination>,
    name: &str,
    clips: usize,
) -> Result<(), Failure> {
    match plot {
        Some(_) if clips != 1 => Err(Failure::usage(format!(
            "{name}: --plot draws one animation, and there are {clips}; choose one with --animation, or leave \
             --plot out"
        ))),
        _ => Ok(()),
    }
}

/// Refuses a destination that is a result of the plan, or that cannot be written.
fn apart(destination: Destination, plan: &OutputPlan) -> Result<Destination, Failure> {
    for target in &plan.targets {
        destination.refuse_same(target.path())?;
    }
    destination.check_writable()?;
    Ok(destination)
}

/// Refuses axes of angles for a format that has none.
pub(crate) fn check_sequence(
    sequence: Option<EulerSequence>,
    format: Option<&'static Format>,
) -> Result<(), Failure> {
    match format.filter(|format| !format.takes(FormatOption::Sequence)) {
        Some(format) if sequence.is_some() => Err(Failure::usage(format!(
            "{} has no angles; leave out --sequence",
            format.name
        ))),
        _ => Ok(()),
    }
}

/// The document to rewrite, where the result is the input file with other keys. `otherwise` is the
/// reason for a new file of the same format, if there is one; then a warning lists what is not copied.
///
/// # Errors
/// As [`check_whole`].
pub(crate) fn document_to_rewrite<'a>(
    work: &'a ClipWork,
    otherwise: Option<&str>,
) -> Result<Option<&'a dyn Document>, Failure> {
    let (loaded, format) = (&work.input.loaded, work.target.format());
    let Some(document) = loaded.document.as_deref() else {
        return Ok(None);
    };
    let why = otherwise.or(loaded.adjustment.map(Adjustment::makes_new));
    if let Some(lost) = left_behind(document, &loaded.warnings, format, why) {
        words::warn_of(Diagnostic::new(&work.name, Code::NoRoom, lost));
    }
    if !document.writes(format) || why.is_some() {
        return Ok(None);
    }
    check_whole(work)?;
    Ok(Some(document))
}

/// Refuses to write a file again of which some animations were refused: they would stay in it, and programs that read
/// it may refuse the whole file.
pub(crate) fn check_whole(work: &ClipWork) -> Result<(), Failure> {
    if work.input.loaded.refused.is_empty() {
        return Ok(());
    }
    Err(Failure::new(
        ALL_INPUTS,
        format!(
            "{}: the result would contain the animation that cannot be read; repair or remove it, or write another format",
            work.name
        ),
    ))
}

/// Why a selection of an input makes a new file, rather than the input's file with other keys.
pub(crate) fn makes_new(inputs: &Inputs) -> Option<&'static str> {
    inputs.tracks.is_set().then_some("some tracks make")
}

/// Refuses, before any work, formats that hold results and no keys.
pub(crate) fn check_stores_keys(plan: &OutputPlan) -> Result<(), Failure> {
    let stores_results = |target: &&ResultTarget| !target.format().writes_clips();
    match plan.targets.iter().find(stores_results) {
        None => Ok(()),
        Some(target) => Err(Failure::usage(format!(
            "{target}: {} holds results of `tumble eval`, not keys",
            target.format().name
        ))),
    }
}

/// Writes the keys of clips: into `document`, where the input's file is written again, else into a new one.
pub(crate) fn write_keys(
    work: &ClipWork,
    clips: &[Cow<'_, Motion>],
    document: Option<&dyn Document>,
    options: &MotionOptions,
) -> Result<WrittenFile, Failure> {
    let target = &work.target;
    let name = &*work.name;
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
    let notes = [("input", work.origin())];
    let sampled = (clips.iter().zip(&keys)).map(|(clip, (samples, per_channel))| SampledClip {
        is_at_keys: *per_channel,
        ..samples.of(clip, rate(clip), &notes)
    });
    let sampled: Vec<SampledClip<'_>> = sampled.collect();
    let indices = clips.iter().map(|clip| clip.index);
    target.write_clips(&sampled, indices, document, options)
}
