//! Plans where results go, before any work: one file, or a directory with a file for each input. In a directory, no
//! file of another owner is replaced.
//!
//! An input whose result cannot have a name or a file there has failed; the others are evaluated.

use std::collections::{BTreeSet, HashSet};
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use tumble_formats::folder::Folder;
use tumble_formats::format::Format;
use tumble_formats::output::remove_abandoned;

use crate::arguments::input::{FoundInput, GatheredInputs};
use crate::batch::entry::{self, InputEntry};
use crate::batch::manifest::{Manifest, ManifestOptions};
use crate::batch::owner::ReplacedOwners;
use crate::batch::result_names::{ResultName, ResultNaming, format, name_results, warn_of_case};
use crate::batch::shards::plan::{RecordedPlan, hash_of};
use crate::batch::shards::record;
use crate::batch::target::{self, Destination, ResultTarget, choose, extensions, of};
use crate::messages::exit::Failure;
use crate::messages::names;

/// One target for each input, and the manifest of their directory.
#[derive(Default)]
pub(crate) struct OutputPlan {
    /// The inputs that have targets.
    pub(crate) paths: Vec<PathBuf>,
    pub(crate) targets: Vec<ResultTarget>,
    /// Inputs that have no target.
    pub(crate) refused: Vec<UnplannedInput>,
    /// Skipped entries of the directories of inputs.
    pub(crate) skipped: Vec<InputEntry>,
    pub(crate) manifest: Option<Manifest>,
}

/// An input that has no target, and why.
pub(crate) struct UnplannedInput {
    pub(crate) path: PathBuf,
    pub(crate) failure: Failure,
}

/// The options that decide where results go.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutputOptions<'a> {
    pub(crate) out: Option<&'a Path>,
    pub(crate) format: Option<&'static Format>,
    pub(crate) overwrite: bool,
    pub(crate) resume: bool,
    pub(crate) prune: bool,
    pub(crate) naming: ResultNaming,
    /// The command that makes the results.
    pub(crate) command: &'a str,
}

/// Whether a single input's result is one file, and not a file in a directory.
pub(super) fn goes_to_file(inputs: &GatheredInputs, out: &Path) -> bool {
    let is_file = out.is_file() || of(out).is_some() || names::is_standard(out);
    let is_folder = out.is_dir() || out.as_os_str().as_encoded_bytes().ends_with(b"/");
    is_file || !inputs.many && !is_folder
}

/// Plans the targets. Refuses, before any work, outputs that exist, that are inputs, or that two inputs share.
pub(crate) fn plan(
    inputs: &GatheredInputs,
    options: OutputOptions<'_>,
) -> Result<OutputPlan, Failure> {
    if options.out.is_none() && io::stdout().is_terminal() {
        return Err(Failure::usage(format!(
            "where should the result go? give {}, or -o - for standard output",
            extensions(|name| format!("-o OUT.{name}")).join(", ")
        )));
    }
    let out = options.out.unwrap_or(Path::new("-"));
    let paths = inputs.paths();
    // A single input gives a single output, even if it was found in a directory or by a pattern.
    let plan = match &*paths {
        [_] if goes_to_file(inputs, out) => {
            if options.resume {
                let message = "--resume is for a directory of results";
                return Err(Failure::usage(message));
            }
            if options.prune {
                return Err(Failure::usage("--prune is for a directory of results"));
            }
            let destination = Destination::new(out, options.overwrite, &paths)?;
            let format = choose(out, options.format)?;
            // Whether a directory can be written to is only known after writing a file.
            destination.check_writable()?;
            destination.refuse_terminal(format)?;
            OutputPlan {
                paths,
                targets: vec![ResultTarget::new(destination, format, String::new())],
                ..OutputPlan::default()
            }
        }
        _ if names::is_standard(out) => {
            return Err(Failure::usage(
                "several inputs need a directory for their results: -o DIRECTORY",
            ));
        }
        _ => in_folder(inputs, out, options)?,
    };
    if plan.manifest.is_some() {
        check_writable(&plan.targets)?;
    }
    Ok(plan)
}

/// Tries to write into a directory of results; fails if none can be written.
fn check_writable(targets: &[ResultTarget]) -> Result<(), Failure> {
    let mut tried = HashSet::new();
    let mut failed = None;
    for target in targets {
        if !tried.insert(target.path().parent()) {
            continue;
        }
        match target.check_writable() {
            Ok(()) => return Ok(()),
            Err(failure) => failed.get_or_insert(failure),
        };
    }
    failed.map_or(Ok(()), Err)
}

/// A file in `folder` for each input, named after it; in a subdirectory where the input is in one.
fn in_folder(
    inputs: &GatheredInputs,
    folder: &Path,
    options: OutputOptions<'_>,
) -> Result<OutputPlan, Failure> {
    let format = format(folder, options.format)?;
    let files = without_results(inputs.files.clone(), folder)?;
    let names = name_results(&files, folder, format, options.naming);
    warn_of_case(&names);
    let shards = RecordedPlan::read(folder)?;
    if let Some(recorded) = &shards {
        refuse_shards(recorded, &names, folder, options)?;
    } else {
        refuse_lost_plan(folder, options)?;
    }
    target::create_folder(folder)?;
    let manifest = Manifest::open(
        folder,
        ManifestOptions {
            has_shards: shards.is_some(),
            overwrite: options.overwrite,
            prune: options.prune,
        },
    )?;
    if options.resume && !options.overwrite {
        manifest.check_command(&names, options.command)?;
    }
    // Results of unfinished shards have no line yet.
    let is_known = |name: &str| shards.is_some() || manifest.knows(name);
    let overwrites = |name: &str| options.overwrite || options.resume && is_known(name);
    for name in names.iter().flatten().filter(|name| !overwrites(name)) {
        refuse_existing(folder, name, is_known(name))?;
    }
    let mut result_folder = ResultFolder::new(manifest.folder());
    let mut plan = OutputPlan::default();
    let mut replaced = ReplacedOwners::default();
    for (found, name) in files.iter().zip(names) {
        let target = name.and_then(|name| {
            if let Some(owner) = manifest.owner(&name).filter(|_| !options.overwrite) {
                replaced.check(&found.path, &folder.join(&name), &owner)?;
            }
            let destination = result_folder.destination(&name, overwrites(&name))?;
            Ok(ResultTarget::new(destination.hashed(), format, name))
        });
        match target {
            Ok(target) => {
                plan.paths.push(found.path.clone());
                plan.targets.push(target);
            }
            Err(failure) => plan.refused.push(UnplannedInput {
                path: found.path.clone(),
                failure,
            }),
        }
    }
    replaced.note();
    // Locked temporary files belong to a process that still writes them, so they are kept.
    let mut folders = result_folder.made;
    folders.extend(manifest.folders());
    folders.insert(folder.to_owned());
    for folder in &folders {
        remove_abandoned(folder);
    }
    plan.skipped.clone_from(&inputs.skipped);
    plan.manifest = Some(manifest);
    Ok(plan)
}

/// The inputs that are not results of an earlier batch: a directory of results may be below the
/// directory of inputs, or be the same.
pub(crate) fn without_results(
    inputs: Vec<FoundInput>,
    folder: &Path,
) -> Result<Vec<FoundInput>, Failure> {
    let is_below = |path: &Path, folder: &Path| {
        path.canonicalize()
            .is_ok_and(|path| path.starts_with(folder))
    };
    let Ok(real) = folder.canonicalize() else {
        return Ok(inputs);
    };
    let below: Vec<bool> = (inputs.iter())
        .map(|found| found.root.is_some() && is_below(&found.path, &real))
        .collect();
    let has_results = || {
        let manifest = entry::open(folder).is_ok_and(|manifest| manifest.is_some());
        manifest || RecordedPlan::read(folder).is_ok_and(|stated| stated.is_some())
    };
    if !below.contains(&true) || !has_results() {
        return Ok(inputs);
    }
    let names = record::names(folder);
    let is_result = |found: &FoundInput| {
        // If inputs and results are in one directory, the manifest tells which files are results.
        let root = found.root.as_deref();
        let is_shared = root.is_some_and(|root| is_below(root, &real));
        let path = found.path.canonicalize().unwrap_or_default();
        let name = path.strip_prefix(&real).ok().and_then(Path::to_str);
        !is_shared || name.is_some_and(|name| names.contains(name))
    };
    let left: Vec<FoundInput> = (inputs.into_iter().zip(below))
        .filter(|(found, is_below)| !(*is_below && is_result(found)))
        .map(|(found, _)| found)
        .collect();
    match left.is_empty() {
        false => Ok(left),
        true => Err(Failure::usage(format!(
            "{}: contains only results, and no other input was given",
            folder.display()
        ))),
    }
}

/// Refuses, before any work, a batch that would replace a file without `--overwrite`.
pub(super) fn refuse_existing(folder: &Path, name: &str, is_known: bool) -> Result<(), Failure> {
    let path = folder.join(name);
    if std::fs::symlink_metadata(&path).is_err() {
        return Ok(());
    }
    let shown = path.display();
    let failure = Failure::usage(format!("{shown}: exists; give --overwrite to replace it"));
    Err(match is_known {
        true => failure.hinted(" (--resume skips what is done)"),
        false => failure,
    })
}

/// Refuses other inputs for a directory with shards that are not merged yet.
pub(super) fn refuse_shards(
    recorded: &RecordedPlan,
    names: &[ResultName],
    folder: &Path,
    options: OutputOptions<'_>,
) -> Result<(), Failure> {
    let shown = folder.display();
    if !options.resume && !options.overwrite {
        return Err(Failure::usage(format!(
            "{shown}: has shards that are not merged; --resume continues them, `tumble merge {shown}` merges them"
        )));
    }
    match recorded.outputs_sha256 == hash_of(names) {
        true => Ok(()),
        false => Err(Failure::usage(format!(
            "{shown}: has shards of other inputs that are not merged; give those inputs, or another \
             directory"
        ))),
    }
}

/// Refuses a directory whose shards have lost the record of their plan, unless all results are made again.
pub(super) fn refuse_lost_plan(folder: &Path, options: OutputOptions<'_>) -> Result<(), Failure> {
    let lost = RecordedPlan::lost(folder).filter(|_| !options.overwrite);
    lost.map_or(Ok(()), |message| {
        Err(Failure::usage(message).hinted("; --overwrite makes all results again"))
    })
}

/// A directory of results. It makes the subdirectories of results, and refuses links.
pub(crate) struct ResultFolder<'a> {
    folder: &'a Folder,
    /// The subdirectories made so far.
    pub(crate) made: BTreeSet<PathBuf>,
}

impl<'a> ResultFolder<'a> {
    pub(crate) fn new(folder: &'a Folder) -> Self {
        Self {
            folder,
            made: BTreeSet::new(),
        }
    }

    /// The destination of the result of that name.
    pub(crate) fn destination(
        &mut self,
        name: &str,
        overwrite: bool,
    ) -> Result<Destination, Failure> {
        let path = self.folder.path().join(name);
        let parent = path.parent().unwrap_or(self.folder.path());
        if !self.made.contains(parent) {
            let made = self.folder.create_parent_of(Path::new(name));
            made.map_err(|error| {
                let shown = path.display();
                Failure::usage(format!("{shown}: its directory cannot be used: {error}"))
            })?;
            self.made.insert(parent.to_owned());
        }
        Destination::below(self.folder, Path::new(name), overwrite, &[])
    }
}
