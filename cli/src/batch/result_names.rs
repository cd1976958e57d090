//! The name of each input's result in a directory of results, or the reason why no name is possible.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use tumble_formats::format::Format;

use crate::arguments::input::FoundInput;
use crate::batch::shards::record;
use crate::batch::target::{self, choose};
use crate::messages::exit::Failure;
use crate::messages::{names, words};

/// The path of an input's result below the directory of results, or the reason why it has none.
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
            "{shown}: is one file; several inputs, and shards, need a directory for their results"
        )));
    }
    choose(Path::new("-"), requested)
}

/// How results are named after their inputs. The name of a result depends only on its input, so that it does not change
/// when other inputs are added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum ResultNaming {
    /// walk.bvh becomes walk.npy
    #[default]
    Stem,
    /// walk.bvh becomes walk.bvh.npy
    Full,
}

impl ResultNaming {
    /// The name by which the results of an input are known, from its path below the library: that of its result without
    /// the extension of a format.
    pub(crate) fn key(self, below: &Path) -> String {
        match self {
            Self::Stem => below.with_extension("").display().to_string(),
            Self::Full => below.display().to_string(),
        }
    }

    /// The path of an input's result below the directory of results.
    fn name(self, format: &Format, found: &FoundInput) -> PathBuf {
        match self {
            Self::Stem => below(found).with_extension(format.ending()),
            Self::Full => {
                let mut name = below(found).as_os_str().to_owned();
                name.push(format!(".{}", format.ending()));
                name.into()
            }
        }
    }
}

/// The name by which the results of an input are known, from the name of its result: without the extension, which
/// depends on the format. Files of rows have the results of many inputs, and are known by their whole names.
pub(crate) fn key_of_result(name: &str) -> String {
    match name.ends_with(".parquet") {
        true => name.to_owned(),
        false => Path::new(name).with_extension("").display().to_string(),
    }
}

/// The names of the results in the directory, in the order of their inputs. Inputs whose results would have one name
/// are refused, except the one whose result has it already.
pub(crate) fn name_results(
    inputs: &[FoundInput],
    folder: &Path,
    format: &Format,
    naming: ResultNaming,
) -> Vec<ResultName> {
    let sources: HashSet<PathBuf> = (inputs.iter())
        .filter_map(|found| found.path.canonicalize().ok())
        .collect();
    let names: Vec<PathBuf> = (inputs.iter())
        .map(|found| naming.name(format, found))
        .collect();
    let mut sharing: HashMap<&Path, Vec<&FoundInput>> = HashMap::new();
    for (found, name) in inputs.iter().zip(&names) {
        sharing.entry(name).or_default().push(found);
    }
    let shared = sharing.iter().filter(|(_, inputs)| inputs.len() > 1);
    let shared: HashSet<&str> = shared.filter_map(|(name, _)| name.to_str()).collect();
    let owners = match shared.is_empty() {
        true => HashMap::new(),
        false => record::inputs_of(folder, &shared),
    };
    let checked = inputs.iter().zip(&names).map(|(found, name)| {
        let input = names::input(&found.path);
        let refuse = |why: String| Err(Failure::usage(format!("{input}: {why}")));
        let target = folder.join(name);
        let is_input = |target: PathBuf| sources.contains(&target);
        if target.canonicalize().is_ok_and(is_input) {
            let target = target.display();
            return refuse(format!("its result {target} is an input; give another directory"));
        }
        let owner = name.to_str().and_then(|name| owners.get(name));
        let has_it = owner.is_some_and(|owner| *owner == found.path.display().to_string());
        let others = &sharing[name.as_path()];
        let other = others.iter().find(|other| other.path != found.path);
        if let Some(other) = other.filter(|_| !has_it) {
            let remedy = match others.iter().all(|other| other.below == found.below) {
                true => {
                    "name their common directory (its tree is kept), or use --base, or write the results to different \
                     directories"
                }
                false => "give --names full, which names results after the whole names of inputs",
            };
            let other = names::input(&other.path);
            let target = target.display();
            return refuse(format!(
                "its result and that of {other} would both be {target}; {remedy}"
            ));
        }
        let length = name.file_name().map_or(0, std::ffi::OsStr::len);
        if length > MAX_NAME {
            return refuse(format!(
                "the name of its result has {length} bytes, at most {MAX_NAME} are possible; give the input \
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

/// Warns of results whose names differ only in case, because they are one file on file systems that ignore case.
pub(crate) fn warn_of_case(results: &[ResultName]) {
    let mut seen: HashMap<String, &str> = HashMap::new();
    let mut alike = results.iter().flatten().filter_map(|name| {
        let known = seen.insert(name.to_lowercase(), name)?;
        Some([known, name])
    });
    let Some([first, second]) = alike.next() else {
        return;
    };
    let others = match alike.count() {
        0 => String::new(),
        more => format!(" ({} more)", words::count(more, "result")),
    };
    words::warning(&format!(
        "{first} and {second} differ in case alone{others}: copied to Windows or macOS, one would replace the other"
    ));
}

/// Refuses inputs whose results would have the same name: a worker has only some of the inputs, and
/// could not tell.
pub(crate) fn refuse_shared_names(
    inputs: &[FoundInput],
    format: &Format,
    naming: ResultNaming,
) -> Result<(), Failure> {
    let mut owners = HashMap::new();
    for found in inputs {
        let name = naming.name(format, found);
        let shown = name.display().to_string();
        if let Some(other) = owners.insert(name, &found.path) {
            return Err(Failure::usage(format!(
                "{} and {} would both write {shown}; give --names full, or write the results to different \
                 directories",
                names::input(other),
                names::input(&found.path),
            )));
        }
    }
    Ok(())
}

fn below(found: &FoundInput) -> &Path {
    match names::is_standard(&found.path) {
        true => Path::new("stdin"),
        false => &found.below,
    }
}
