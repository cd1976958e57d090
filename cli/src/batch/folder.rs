//! A directory of results: the name of each input's result in it, and the check that no file of somebody
//! else is replaced.
//!
//! An input whose result cannot have a name or a file there has failed; the others are evaluated.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};

use tumble_formats::beneath::parent_beneath;
use tumble_formats::format::Format;
use tumble_formats::output::remove_abandoned;

use crate::arguments::gather::{FoundInput, GatheredInputs};
use crate::arguments::input;
use crate::batch::destination::{self, Destination};
use crate::batch::manifest::{self, Manifest};
use crate::batch::output::{OutputPlan, OutputRequest, ResultTarget, choose, of};
use crate::batch::shards::plan::{self, RecordedPlan, hash_of};
use crate::batch::shards::record;
use crate::messages::exit::Failure;

/// The path of an input's result below the directory of results, or why it has none.
pub(crate) type ResultName = Result<String, Failure>;

/// The longest file name that file systems accept, in bytes.
const MAX_NAME: usize = 255;

/// A file in `folder` for each input, named after it; in a subdirectory where the input is in one.
pub(crate) fn in_folder(
    inputs: &GatheredInputs,
    folder: &Path,
    request: OutputRequest<'_>,
) -> Result<OutputPlan, Failure> {
    let format = format(folder, request.format)?;
    let files = without_results(inputs.files.clone(), folder)?;
    let names = names(&files, folder, format);
    let shards = RecordedPlan::read(folder)?;
    if let Some(recorded) = &shards {
        refuse_shards(recorded, &names, folder, request)?;
    }
    destination::create_folder(folder)?;
    let manifest = Manifest::open(folder, shards.is_some(), request.overwrite)?;
    // Results of unfinished shards have no line yet.
    let is_known = |name: &str| shards.is_some() || manifest.knows(name);
    let overwrites = |name: &str| request.overwrite || request.resume && is_known(name);
    for name in names.iter().flatten().filter(|name| !overwrites(name)) {
        refuse_existing(folder, name, is_known(name))?;
    }
    let mut result_folder = ResultFolder::new(folder);
    let mut plan = OutputPlan::default();
    for (found, name) in files.iter().zip(names) {
        let target = name.and_then(|name| {
            let destination = result_folder.destination(&name, overwrites(&name))?;
            Ok(ResultTarget::new(destination.hashed(), format, name))
        });
        match target {
            Ok(target) => {
                plan.paths.push(found.path.clone());
                plan.targets.push(target);
            }
            Err(failure) => plan.refused.push(failure),
        }
    }
    // Locked files are being written: they are kept.
    result_folder.made.extend(manifest.folders());
    result_folder.made.insert(folder.to_owned());
    for folder in &result_folder.made {
        remove_abandoned(folder);
    }
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
        .map(|found| found.is_from_directory && is_below(&found.path, &real))
        .collect();
    let has_results = || {
        let manifest = manifest::open(folder).is_ok_and(|manifest| manifest.is_some());
        manifest || RecordedPlan::read(folder).is_ok_and(|stated| stated.is_some())
    };
    if !below.contains(&true) || !has_results() {
        return Ok(inputs);
    }
    let names = record::names(folder);
    let is_result = |found: &FoundInput| {
        // Where inputs and results share a directory, the manifest tells them apart.
        let is_shared = found.root().is_some_and(|root| is_below(root, &real));
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
            "{}: has results alone, and no other input was given",
            folder.display()
        ))),
    }
}

/// Refuses, before any work, a batch that would replace a file without `--overwrite`.
fn refuse_existing(folder: &Path, name: &str, is_known: bool) -> Result<(), Failure> {
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
fn refuse_shards(
    recorded: &RecordedPlan,
    names: &[ResultName],
    folder: &Path,
    request: OutputRequest<'_>,
) -> Result<(), Failure> {
    let shown = folder.display();
    if !request.resume && !request.overwrite {
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

/// The format of the results of several inputs.
pub(crate) fn format(
    folder: &Path,
    requested: Option<&'static Format>,
) -> Result<&'static Format, Failure> {
    if !folder.is_dir() && (folder.exists() || of(folder).is_some()) {
        let shown = folder.display();
        return Err(Failure::usage(format!(
            "{shown}: several inputs need a directory for their results, not one file"
        )));
    }
    choose(Path::new("-"), requested)
}

/// The names of the results in the directory, in the order of their inputs. Those of `walk.bvh` and
/// `walk.tum` are `walk.bvh.npy` and `walk.tum.npy`.
pub(crate) fn names(inputs: &[FoundInput], folder: &Path, format: &Format) -> Vec<ResultName> {
    let sources: HashSet<PathBuf> = (inputs.iter())
        .filter_map(|found| found.path.canonicalize().ok())
        .collect();
    let mut names: Vec<PathBuf> = (inputs.iter())
        .map(|found| name_for(format, found))
        .collect();
    let shared = counts(&names);
    let whole: Vec<PathBuf> = (inputs.iter().zip(&names))
        .map(|(found, name)| match shared[name] {
            1 => name.clone(),
            _ => whole_name_for(format, found),
        })
        .collect();
    names = whole;
    let mut owners: HashMap<&Path, Vec<&Path>> = HashMap::new();
    for (found, name) in inputs.iter().zip(&names) {
        owners.entry(name).or_default().push(&found.path);
    }
    let checked = inputs.iter().zip(&names).map(|(found, name)| {
        let input = input::name(&found.path);
        let refuse = |why: String| Err(Failure::usage(format!("{input}: {why}")));
        let target = folder.join(name);
        let is_input = |target: PathBuf| sources.contains(&target);
        if target.canonicalize().is_ok_and(is_input) {
            let target = target.display();
            return refuse(format!("its result {target} is an input; give another directory"));
        }
        let other = owners[name.as_path()].iter().find(|other| **other != found.path);
        if let Some(other) = other {
            return refuse(format!(
                "its result and that of {} would both be {}; give their directory, whose tree is \
                 kept, or evaluate them into different directories",
                input::name(other),
                target.display()
            ));
        }
        let length = name.file_name().map_or(0, std::ffi::OsStr::len);
        if length > MAX_NAME {
            return refuse(format!(
                "the name of its result has {length} bytes, and may have {MAX_NAME}; give the input \
                 a shorter name"
            ));
        }
        if name.starts_with(plan::FOLDER) {
            let of_shards = plan::FOLDER;
            return refuse(format!(
                "{of_shards} is the directory of shards; give its directory another name"
            ));
        }
        match name.to_str() {
            Some(name) => Ok(name.to_owned()),
            None => refuse(
                "its name is not UTF-8, and a manifest could not name it; rename it".to_owned(),
            ),
        }
    });
    checked.collect()
}

/// Refuses inputs whose results would have the same name: a worker has only some of the inputs, and
/// could not tell.
pub(crate) fn refuse_shared_names(inputs: &[FoundInput], format: &Format) -> Result<(), Failure> {
    let mut owners = HashMap::new();
    for found in inputs {
        let name = name_for(format, found);
        let shown = name.display().to_string();
        if let Some(other) = owners.insert(name, &found.path) {
            return Err(Failure::usage(format!(
                "{} and {} would both write {shown}; evaluate them into different directories",
                input::name(other),
                input::name(&found.path),
            )));
        }
    }
    Ok(())
}

fn counts(names: &[PathBuf]) -> HashMap<&PathBuf, usize> {
    let mut counts = HashMap::new();
    for name in names {
        *counts.entry(name).or_default() += 1;
    }
    counts
}

fn below(found: &FoundInput) -> &Path {
    match input::is_standard(&found.path) {
        true => Path::new("stdin"),
        false => &found.below,
    }
}

/// `walk.dat` becomes `walk.npy`, where it lies.
fn name_for(format: &Format, found: &FoundInput) -> PathBuf {
    below(found).with_extension(format.name)
}

/// `walk.dat` becomes `walk.dat.npy`.
fn whole_name_for(format: &Format, found: &FoundInput) -> PathBuf {
    let mut name = below(found).as_os_str().to_owned();
    name.push(format!(".{}", format.name));
    name.into()
}

/// A directory of results. It makes the subdirectories of results, and refuses links.
pub(crate) struct ResultFolder<'a> {
    folder: &'a Path,
    /// The subdirectories made so far.
    pub(crate) made: BTreeSet<PathBuf>,
}

impl<'a> ResultFolder<'a> {
    pub(crate) fn new(folder: &'a Path) -> Self {
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
        let path = self.folder.join(name);
        let parent = path.parent().unwrap_or(self.folder);
        if !self.made.contains(parent) {
            let parent = parent_beneath(self.folder, Path::new(name)).map_err(|error| {
                let shown = path.display();
                Failure::usage(format!("{shown}: its directory cannot be used: {error}"))
            })?;
            std::fs::create_dir_all(&parent)
                .map_err(|error| Failure::writing(&parent.display().to_string(), &error))?;
            self.made.insert(parent);
        }
        Destination::new(&path, overwrite, &[])
    }
}
