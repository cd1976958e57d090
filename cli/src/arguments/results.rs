//! Options for outputs and their format, and the loop over all inputs.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use clap::Args;
use tumble::EulerSequence;
use tumble_formats::format::{Document, FormatOption, left_behind};
use tumble_formats::motion::Motion;
use tumble_formats::{Feature, Format, Loaded};

use crate::arguments::gather::GatheredInputs;
use crate::arguments::input::{
    Inputs, check_complete, clip_name, is_standard, name, print_warnings, several_clips_failure,
};
use crate::batch::destination::Destination;
use crate::batch::digest::InputFile;
use crate::batch::output::{self, OutputPlan, OutputRequest, ResultTarget};
use crate::batch::run::{Batch, EvaluatedResult, ResultCallback};
use crate::messages::exit::{Failure, SOME_INPUTS, for_all};
use crate::messages::progress::busy;
use crate::messages::words;

const ONE_INPUT: &str = "--times-out needs a single input whose result is a single file";

#[derive(Debug, Args)]
pub(crate) struct ResultArguments {
    #[arg(short, long = "out", value_name = "OUT", help = output::out_help())]
    out: Option<PathBuf>,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// In a directory of results: skip those that are complete and were made from the same input with
    /// the same options
    #[arg(long)]
    resume: bool,
    /// The format of the results [default: by the name of the output, else npy]
    #[arg(long, visible_alias = "to", value_parser = output::format())]
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
        inputs: &GatheredInputs,
        plan: &OutputPlan,
    ) -> Result<Option<Destination>, Failure> {
        let inputs = inputs.paths();
        if inputs.len() > 1 {
            return Err(Failure::usage("--plot needs a single input"));
        }
        let destination = Destination::of_picture(file, self.overwrite, &inputs)?;
        for target in &plan.targets {
            destination.refuse_same(target.path())?;
        }
        destination.check_writable()?;
        Ok(Some(destination))
    }

    /// The directory of results, for those who evaluate shards of them.
    pub(crate) fn folder(&self) -> Result<&Path, Failure> {
        if self.times_out.is_some() {
            return Err(Failure::usage(ONE_INPUT));
        }
        match self.out.as_deref() {
            Some(out) if !is_standard(out) => Ok(out),
            _ => Err(Failure::usage(
                "shards need a directory for their results: -o DIRECTORY",
            )),
        }
    }

    /// The format that was asked for.
    pub(crate) fn format(&self) -> Option<&'static Format> {
        self.format
    }

    /// Whether results that are done are skipped.
    pub(crate) fn is_resumed(&self) -> bool {
        self.resume
    }

    /// Whether results that are there are replaced.
    pub(crate) fn overwrites(&self) -> bool {
        self.overwrite
    }

    /// The destination of each input's result. Everything that can be refused is refused here, before any work.
    pub(crate) fn plan(&self, inputs: &GatheredInputs) -> Result<OutputPlan, Failure> {
        let mut plan = output::plan(
            inputs,
            OutputRequest {
                out: self.out.as_deref(),
                format: self.format,
                overwrite: self.overwrite,
                resume: self.resume,
            },
        )?;
        if let Some(file) = &self.times_out {
            let (1, None, Some(target)) = (plan.targets.len(), &plan.manifest, plan.targets.pop())
            else {
                return Err(Failure::usage(ONE_INPUT));
            };
            let format = target.format();
            if !format.takes(FormatOption::TimesApart) {
                return Err(Failure::usage(format!(
                    "--times-out is for kitti, which stores no times; {} stores times or a frame rate: leave it out",
                    format.name
                )));
            }
            let destination = Destination::new(file, self.overwrite, &inputs.paths())?;
            plan.targets.push(target.with_times(destination)?);
        }
        Ok(plan)
    }

    /// Makes the results of all inputs. `options` is everything that determines a result besides its input.
    pub(crate) fn make(
        &self,
        inputs: &Inputs,
        plan: OutputPlan,
        options: String,
        work: impl FnMut(
            &InputFile,
            &Loaded,
            &ResultTarget,
            &mut ResultCallback<'_>,
        ) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let read = |path: &Path| inputs.read(path);
        self.make_of((read, inputs.max_size()), plan, options, work)
    }

    /// As [`Results::make`], of inputs that `read` reads, each at most `max_bytes` long.
    pub(crate) fn make_of(
        &self,
        (read, max_bytes): (impl Fn(&Path) -> Result<Loaded, Failure> + Sync, u64),
        plan: OutputPlan,
        options: String,
        mut work: impl FnMut(
            &InputFile,
            &Loaded,
            &ResultTarget,
            &mut ResultCallback<'_>,
        ) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let OutputPlan {
            paths,
            targets,
            refused,
            manifest,
        } = plan;
        let jobs: Vec<(PathBuf, ResultTarget)> = paths.into_iter().zip(targets).collect();
        if let Some(mut manifest) = manifest {
            let batch = Batch {
                read,
                max_bytes,
                options,
                resume: self.resume,
            };
            let outcome = batch.run(&jobs, refused, &mut manifest, work);
            manifest.finish()?;
            return outcome;
        }
        for_all(refused, &jobs, |(path, target)| {
            let file = InputFile::new(path);
            let loaded = busy(&format!("reading {}", name(path)), || read(path))?;
            print_warnings(&loaded);
            work(
                &file,
                &loaded,
                target,
                &mut |_, evaluated: EvaluatedResult| {
                    evaluated.written.commit()?;
                    words::note(&evaluated.message);
                    Ok(())
                },
            )
        })
    }
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
/// reason for a new file of the same format, if there is one; then a note lists what is not copied.
pub(crate) fn document_to_rewrite<'a>(
    name: &str,
    loaded: &'a Loaded,
    target: &ResultTarget,
    otherwise: Option<&str>,
) -> Option<&'a dyn Document> {
    let document = loaded.document.as_deref()?;
    let adjusted = loaded.is_adjusted.then_some("other units or axes make");
    let why = otherwise.or(adjusted);
    if let Some(lost) = left_behind(document, &loaded.warnings, target.format(), why) {
        words::note(&format!("{name}: {lost}"));
    }
    (document.writes(target.format()) && why.is_none()).then_some(document)
}

/// Makes a file of each input's clips: of all together where its format holds several, else of
/// each. `make` gets what messages call the clips, the clips, and where they go.
pub(crate) fn each_file(
    name: &str,
    (path, loaded): (&Path, &Loaded),
    target: &ResultTarget,
    done: &mut ResultCallback<'_>,
    mut make: impl FnMut(&str, &[&Motion], &ResultTarget) -> Result<EvaluatedResult, Failure>,
) -> Result<(), Failure> {
    let clips: Vec<&Motion> = loaded.clips.iter().collect();
    if target.format().supports(Feature::SeveralClips) || clips.len() == 1 {
        done(target.name(), make(name, &clips, target)?)?;
    } else {
        if target.name().is_empty() {
            let hint = ", or give a directory for all of them: -o RESULTS/";
            return Err(several_clips_failure(path, loaded).hinted(hint));
        }
        // A clip that fails does not stop the others.
        let jobs: Vec<(&Motion, String)> =
            clips.into_iter().zip(file_names(&loaded.clips)).collect();
        for_clips(name, &jobs, |(clip, file)| {
            let target = target.of_clip(file)?;
            let made = make(&format!("{name} {}", clip_name(clip)), &[clip], &target)?;
            done(target.name(), made)
        })?;
    }
    check_complete(name, loaded)
}

/// Makes something of each clip of an input. A failure is reported and the others go on, unless they
/// would fail alike.
fn for_clips<T>(
    name: &str,
    clips: &[T],
    mut work: impl FnMut(&T) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut failed: Vec<Failure> = Vec::new();
    for clip in clips {
        match work(clip) {
            Ok(()) => {}
            Err(failure) if failure.is_final() => return Err(failure),
            Err(failure) => failed.push(failure),
        }
    }
    let count = failed.len();
    let Some(last) = failed.pop() else {
        return Ok(());
    };
    for failure in failed {
        failure.report();
    }
    if count == clips.len() {
        return Err(last);
    }
    last.report();
    let message = format!("{name}: {count} of {} animations failed", clips.len());
    Err(Failure::new(SOME_INPUTS, message))
}

/// The names of the clips' files: the clips' names, with characters that file systems refuse replaced;
/// names that are then equal get the clip's index appended.
fn file_names(clips: &[Motion]) -> Vec<String> {
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | ' ');
    let plain = |clip: &Motion| -> String {
        let name = clip.name.clone().unwrap_or_else(|| clip.index.to_string());
        let each = name.chars().map(|c| if is_plain(c) { c } else { '_' });
        each.collect()
    };
    let mut used = HashSet::new();
    let names = clips.iter().map(|clip| {
        let whole = plain(clip);
        let mut name = short(&whole, "");
        let mut end = String::new();
        if name != whole {
            end = format!(".{}", clip.index);
            name = short(&whole, &end);
        }
        while !used.insert(name.to_lowercase()) {
            end = format!("{end}.{}", clip.index);
            name = short(&whole, &end);
        }
        name
    });
    names.collect()
}

/// The most bytes of a clip's name in a file name: the input's name and two extensions must fit too.
const MAX_CLIP_NAME: usize = 120;

/// The name, cut so that it fits with `end` into [`MAX_CLIP_NAME`] bytes, and `end`.
fn short(name: &str, end: &str) -> String {
    let max_length = MAX_CLIP_NAME.saturating_sub(end.len()).min(name.len());
    let cut = (0..=max_length).rfind(|&at| name.is_char_boundary(at));
    format!("{}{end}", &name[..cut.unwrap_or(0)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clips_never_share_a_file() {
        let names = [
            Some("Run"),
            Some("run"),
            Some("a/b"),
            Some("a:b"),
            None,
            Some("4"),
        ];
        let clips: Vec<Motion> = names
            .iter()
            .enumerate()
            .map(|(index, name)| Motion {
                name: name.map(str::to_owned),
                index,
                ..Motion::default()
            })
            .collect();
        assert_eq!(
            file_names(&clips),
            ["Run", "run.1", "a_b", "a_b.3", "4", "4.5"]
        );
    }

    #[test]
    fn long_names_are_cut_between_letters_and_stay_apart() {
        let long = "ä".repeat(200);
        let clip = |index| Motion {
            name: Some(long.clone()),
            index,
            ..Motion::default()
        };
        let names = file_names(&[clip(0), clip(1)]);
        assert_eq!(names[0], format!("{}.0", "ä".repeat(59)));
        assert_eq!(names[1], format!("{}.1", "ä".repeat(59)));
    }
}
