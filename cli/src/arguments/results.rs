//! Arguments that say where results go and in which format, and the run over all inputs.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use clap::Args;
use tumble::EulerSequence;
use tumble_formats::feature::stays_behind;
use tumble_formats::format::{Document, FormatOption};
use tumble_formats::motion::Motion;
use tumble_formats::{Feature, Format, Loaded};

use crate::arguments::gather::Gathered;
use crate::arguments::input::{
    Inputs, clip_name, is_standard, name, several, tell_warnings, whole,
};
use crate::batch::digest::InputFile;
use crate::batch::output::{self, Plan, Target, Wish};
use crate::batch::place::Place;
use crate::batch::run::{Batch, Done, Evaluated};
use crate::messages::exit::{Failure, SOME_INPUTS, for_all};
use crate::messages::progress::busy;
use crate::messages::words;

const ONE_INPUT: &str = "--times-out is of one input, whose result is one file";

#[derive(Debug, Args)]
pub(crate) struct Results {
    #[arg(short, long = "out", value_name = "OUT", help = output::out_help())]
    out: Option<PathBuf>,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// In a directory of results: skip those that are there, whole, and made from the same input
    /// in the same way
    #[arg(long)]
    resume: bool,
    /// The format of the results [default: by the name of the output, else npy]
    #[arg(long, visible_alias = "to", value_parser = output::format())]
    format: Option<&'static Format>,
    /// KITTI, which has no times: also write those of the poses, seconds a line, into this file; of one input
    #[arg(long, value_name = "FILE")]
    times_out: Option<PathBuf>,
}

impl Results {
    /// Where a picture goes that is drawn beside the result of one input.
    pub(crate) fn picture(
        &self,
        file: &Path,
        inputs: &Gathered,
        plan: &Plan,
    ) -> Result<Option<Place>, Failure> {
        let inputs = inputs.paths();
        if inputs.len() > 1 {
            return Err(Failure::usage("--plot is of one input"));
        }
        let place = Place::of_picture(file, self.overwrite, &inputs)?;
        for target in &plan.targets {
            place.refuse_same(target.path())?;
        }
        place.try_out()?;
        Ok(Some(place))
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

    /// Where each input's result goes. Everything that can be refused is refused here, before any
    /// work.
    pub(crate) fn plan(&self, inputs: &Gathered) -> Result<Plan, Failure> {
        let mut plan = output::plan(
            inputs,
            Wish {
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
                    "--times-out is for kitti, which has no times; {} has them, or is of frames: leave it out",
                    format.name
                )));
            }
            let place = Place::new(file, self.overwrite, &inputs.paths())?;
            plan.targets.push(target.with_times(place)?);
        }
        Ok(plan)
    }

    /// Makes the results of all inputs. `options` are all that decides over a result besides its
    /// input.
    pub(crate) fn make(
        &self,
        inputs: &Inputs,
        plan: Plan,
        options: String,
        work: impl FnMut(&InputFile, &Loaded, &Target, &mut Done<'_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let read = |path: &Path| inputs.read(path);
        self.make_of((read, inputs.max_size()), plan, options, work)
    }

    /// As [`Results::make`], of inputs that `read` reads, each at most so many bytes long.
    pub(crate) fn make_of(
        &self,
        (read, most): (impl Fn(&Path) -> Result<Loaded, Failure> + Sync, u64),
        plan: Plan,
        options: String,
        mut work: impl FnMut(&InputFile, &Loaded, &Target, &mut Done<'_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let Plan {
            paths,
            targets,
            refused,
            manifest,
        } = plan;
        let jobs: Vec<(PathBuf, Target)> = paths.into_iter().zip(targets).collect();
        if let Some(mut manifest) = manifest {
            let batch = Batch {
                read,
                most,
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
            tell_warnings(&loaded);
            work(&file, &loaded, target, &mut |_, evaluated: Evaluated| {
                evaluated.written.commit()?;
                words::note(&evaluated.told);
                Ok(())
            })
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

/// The input's own file, where the result is that file with other keys. Where it is of the same format
/// and cannot be kept, `otherwise` says what makes a new one; then what stays behind is said.
pub(crate) fn kept<'a>(
    name: &str,
    loaded: &'a Loaded,
    target: &Target,
    otherwise: Option<&str>,
) -> Option<&'a dyn Document> {
    let document = loaded.document.as_deref()?;
    let adjusted = loaded.is_adjusted.then_some("other units or axes make");
    let why = otherwise.or(adjusted);
    if let Some(lost) = stays_behind(document, &loaded.warnings, target.format(), why) {
        words::note(&format!("{name}: {lost}"));
    }
    (document.writes(target.format()) && why.is_none()).then_some(document)
}

/// Makes a file of each input's clips: of all together where its format holds several, else of
/// each. `make` gets what messages call the clips, the clips, and where they go.
pub(crate) fn each_file(
    name: &str,
    (path, loaded): (&Path, &Loaded),
    target: &Target,
    done: &mut Done<'_>,
    mut make: impl FnMut(&str, &[&Motion], &Target) -> Result<Evaluated, Failure>,
) -> Result<(), Failure> {
    let clips: Vec<&Motion> = loaded.clips.iter().collect();
    if target.format().holds(Feature::SeveralClips) || clips.len() == 1 {
        done(target.name(), make(name, &clips, target)?)?;
    } else {
        if target.name().is_empty() {
            let hint = ", or give a directory for all of them: -o RESULTS/";
            return Err(several(path, loaded).hinted(hint));
        }
        // One clip's trouble is no other's.
        let jobs: Vec<(&Motion, String)> =
            clips.into_iter().zip(file_names(&loaded.clips)).collect();
        for_clips(name, &jobs, |(clip, file)| {
            let target = target.of_clip(file)?;
            let made = make(&format!("{name} {}", clip_name(clip)), &[clip], &target)?;
            done(target.name(), made)
        })?;
    }
    whole(name, loaded)
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

/// What the files of clips are called: by the clips' names, as far as file systems take them; names
/// that are then the same get the clip's place in its file behind them.
fn file_names(clips: &[Motion]) -> Vec<String> {
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | ' ');
    let plain = |clip: &Motion| -> String {
        let name = clip.name.clone().unwrap_or_else(|| clip.place.to_string());
        let each = name.chars().map(|c| if is_plain(c) { c } else { '_' });
        each.collect()
    };
    let mut taken = HashSet::new();
    let names = clips.iter().map(|clip| {
        let whole = plain(clip);
        let mut name = short(&whole, "");
        let mut end = String::new();
        if name != whole {
            end = format!(".{}", clip.place);
            name = short(&whole, &end);
        }
        while !taken.insert(name.to_lowercase()) {
            end = format!("{end}.{}", clip.place);
            name = short(&whole, &end);
        }
        name
    });
    names.collect()
}

/// A clip's part of a file's name has no more bytes; the input's name and two extensions are to go
/// beside it.
const MAX_CLIP_NAME: usize = 120;

/// As much of a name as has room before its end, and the end.
fn short(name: &str, end: &str) -> String {
    let most = MAX_CLIP_NAME.saturating_sub(end.len()).min(name.len());
    let most = (0..=most).rfind(|&place| name.is_char_boundary(place));
    format!("{}{end}", &name[..most.unwrap_or(0)])
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
            .map(|(place, name)| Motion {
                name: name.map(str::to_owned),
                place,
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
        let clip = |place| Motion {
            name: Some(long.clone()),
            place,
            ..Motion::default()
        };
        let names = file_names(&[clip(0), clip(1)]);
        assert_eq!(names[0], format!("{}.0", "ä".repeat(59)));
        assert_eq!(names[1], format!("{}.1", "ä".repeat(59)));
    }
}
