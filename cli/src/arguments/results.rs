//! Arguments that say where results go and in which format, and the run over all inputs.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use clap::Args;
use tumble_formats::motion::Motion;
use tumble_formats::{Format, Loaded};

use crate::arguments::gather::Gathered;
use crate::arguments::input::{Inputs, clip_name, is_standard, name, several, tell_warnings};
use crate::batch::output::{self, Plan, Target, Wish};
use crate::batch::place::Place;
use crate::batch::run::{Batch, Done, Evaluated};
use crate::messages::exit::{Failure, SOME_INPUTS, for_each};
use crate::messages::progress::busy;
use crate::messages::words;

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
}

impl Results {
    /// Where a picture goes that is drawn beside the result of one input.
    pub(crate) fn picture(&self, file: &Path, inputs: &Gathered) -> Result<Option<Place>, Failure> {
        let inputs = inputs.paths();
        if inputs.len() > 1 {
            return Err(Failure::usage("--plot is of one input"));
        }
        let place = Place::new(file, self.overwrite, &inputs)?;
        place.try_out()?;
        Ok(Some(place))
    }

    /// The directory of results, for those who evaluate shards of them.
    pub(crate) fn folder(&self) -> Result<&Path, Failure> {
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
        output::plan(
            inputs,
            Wish {
                out: self.out.as_deref(),
                format: self.format,
                overwrite: self.overwrite,
                resume: self.resume,
            },
        )
    }

    /// Makes the results of all inputs. `options` are all that decides over a result besides its
    /// input.
    pub(crate) fn make(
        &self,
        inputs: &Inputs,
        files: &Gathered,
        plan: Plan,
        options: String,
        work: impl FnMut(&Path, &Loaded, &Target, &mut Done<'_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        self.make_of(|path| inputs.read(path), files, plan, options, work)
    }

    /// As [`Results::make`], of inputs that `read` reads.
    pub(crate) fn make_of(
        &self,
        read: impl Fn(&Path) -> Result<Loaded, Failure> + Sync,
        files: &Gathered,
        plan: Plan,
        options: String,
        mut work: impl FnMut(&Path, &Loaded, &Target, &mut Done<'_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let Plan { targets, manifest } = plan;
        let jobs: Vec<(PathBuf, Target)> = files.paths().into_iter().zip(targets).collect();
        if let Some(mut manifest) = manifest {
            let batch = Batch {
                read,
                options,
                resume: self.resume,
            };
            let outcome = batch.run(&jobs, &mut manifest, work);
            manifest.finish()?;
            return outcome;
        }
        for_each(&jobs, |(path, target)| {
            let loaded = busy(&format!("reading {}", name(path)), || read(path))?;
            tell_warnings(&loaded);
            work(path, &loaded, target, &mut |_, evaluated: Evaluated| {
                evaluated.written.commit()?;
                words::note(&evaluated.told);
                Ok(())
            })
        })
    }
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
    if target.format().many_clips || clips.len() == 1 {
        done(target.name(), make(name, &clips, target)?)?;
    } else {
        for (clip, file) in clips.iter().zip(file_names(&clips)) {
            let target = target.of_clip(&file);
            let target = target.ok_or_else(|| {
                several(path, loaded).hinted(", or give a directory for all of them: -o RESULTS/")
            })??;
            let made = make(&format!("{name} {}", clip_name(clip)), &[clip], &target)?;
            done(target.name(), made)?;
        }
    }
    match loaded.refused.len() {
        0 => Ok(()),
        refused => {
            let all = refused + loaded.clips.len();
            let message = format!("{name}: {refused} of {all} animations failed");
            Err(Failure::new(SOME_INPUTS, message))
        }
    }
}

/// What the files of clips are called: by the clips' names, as far as file systems take them; names
/// that are then the same get the clip's place in its file behind them.
fn file_names(clips: &[&Motion]) -> Vec<String> {
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | ' ');
    let plain = |clip: &&Motion| -> String {
        let name = clip_name(clip);
        let each = name.chars().map(|c| if is_plain(c) { c } else { '_' });
        each.collect()
    };
    let mut taken = HashSet::new();
    let names = clips.iter().map(|clip| {
        let mut name = plain(clip);
        while !taken.insert(name.to_lowercase()) {
            name = format!("{name}.{}", clip.place);
        }
        name
    });
    names.collect()
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
        let clips: Vec<&Motion> = clips.iter().collect();
        assert_eq!(
            file_names(&clips),
            ["Run", "run.1", "a_b", "a_b.3", "4", "4.5"]
        );
    }
}
