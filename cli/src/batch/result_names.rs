//! The name of each input's result in a directory of results, or why it can have none.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use tumble_formats::format::Format;

use crate::arguments::input::FoundInput;
use crate::batch::shards::record;
use crate::batch::target::{self, choose};
use crate::messages::exit::Failure;
use crate::messages::names;

/// The path of an input's result below the directory of results, or why it has none.
pub(crate) type ResultName = Result<String, Failure>;

/// The longest file name that file systems accept, in bytes.
const MAX_NAME: usize = 255;

/// The format of the results of several inputs.
pub(crate) fn format(
    folder: &Path,
    requested: Option<&'static Format>,
) -> Result<&'static Format, Failure> {
    if !folder.is_dir() && (folder.exists() || target::of(folder).is_some()) {
        let shown = folder.display();
        return Err(Failure::usage(format!(
            "{shown}: several inputs need a directory for their results, not one file"
        )));
    }
    choose(Path::new("-"), requested)
}

/// The names of the results in the directory, in the order of their inputs. Those of `walk.bvh` and
/// `walk.tum` are `walk.bvh.npy` and `walk.tum.npy`.
pub(crate) fn name_results(
    inputs: &[FoundInput],
    folder: &Path,
    format: &Format,
) -> Vec<ResultName> {
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
        let input = names::input(&found.path);
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
                names::input(other),
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
        if name.starts_with(record::FOLDER) {
            let of_shards = record::FOLDER;
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
                names::input(other),
                names::input(&found.path),
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
    match names::is_standard(&found.path) {
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
