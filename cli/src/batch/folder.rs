//! A directory of results: what each input's result is called in it, and that none of the files
//! there is a stranger's.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};

use tumble_formats::format::Format;
use tumble_formats::output::remove_abandoned;

use crate::arguments::gather::{Found, Gathered};
use crate::arguments::input;
use crate::batch::manifest::Manifest;
use crate::batch::output::{Plan, Target, Wish, choose, of};
use crate::batch::place::{self, Place};
use crate::batch::shards::plan::{Stated, hash_of};
use crate::messages::exit::Failure;

/// A file in `folder` for each input, named after it; below it, where the input lay below
/// a directory.
pub(crate) fn in_folder(inputs: &Gathered, folder: &Path, wish: Wish<'_>) -> Result<Plan, Failure> {
    let format = format(folder, wish.format)?;
    let names = names(&inputs.files, folder, format)?;
    let shards = Stated::read(folder)?;
    if let Some(stated) = &shards {
        refuse_shards(stated, &names, folder, wish)?;
    }
    place::folder(folder)?;
    for parent in &parents(&names, folder)? {
        if wish.resume {
            remove_abandoned(parent);
        }
    }
    let manifest = Manifest::open(folder, shards.is_some())?;
    let target = |name: String| {
        // What shards were making has no line yet.
        let known = shards.is_some() || manifest.knows(&name);
        let overwrite = wish.overwrite || wish.resume && known;
        let place = Place::new(&folder.join(&name), overwrite, &[]).map_err(|failure| {
            if known {
                failure.hinted(" (--resume skips what is done)")
            } else {
                failure
            }
        })?;
        Ok(Target::new(place.hashed(), format, name))
    };
    let targets = names.into_iter().map(target).collect::<Result<_, _>>()?;
    let manifest = Some(manifest);
    Ok(Plan { targets, manifest })
}

/// Shards that are not merged yet are gone on with by the same inputs alone.
fn refuse_shards(
    stated: &Stated,
    names: &[String],
    folder: &Path,
    wish: Wish<'_>,
) -> Result<(), Failure> {
    let shown = folder.display();
    if !wish.resume && !wish.overwrite {
        return Err(Failure::usage(format!(
            "{shown}: has shards that are not merged; --resume goes on, `tumble merge {shown}` ends it"
        )));
    }
    match stated.outputs_sha256 == hash_of(names) {
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
    wished: Option<&'static Format>,
) -> Result<&'static Format, Failure> {
    if !folder.is_dir() && (folder.exists() || of(folder).is_some()) {
        let shown = folder.display();
        return Err(Failure::usage(format!(
            "{shown}: several inputs need a directory for their results, not one file"
        )));
    }
    choose(Path::new("-"), wished)
}

/// What the results are called in the directory, in the order of their inputs.
pub(crate) fn names(
    inputs: &[Found],
    folder: &Path,
    format: &Format,
) -> Result<Vec<String>, Failure> {
    let sources: HashSet<PathBuf> = (inputs.iter())
        .filter_map(|found| found.path.canonicalize().ok())
        .collect();
    let mut owners: HashMap<PathBuf, &Path> = HashMap::new();
    let mut names = Vec::new();
    for found in inputs {
        let (path, name) = (&found.path, name_for(format, found));
        let target = folder.join(&name);
        if target
            .canonicalize()
            .is_ok_and(|target| sources.contains(&target))
        {
            let target = target.display();
            return Err(Failure::usage(format!(
                "{target}: is an input; give another directory"
            )));
        }
        if let Some(other) = owners.insert(name.clone(), path) {
            return Err(Failure::usage(format!(
                "{} and {} would both write {}; give their directory, whose tree is kept, or \
                 evaluate them into different directories",
                input::name(other),
                input::name(path),
                target.display()
            )));
        }
        let Some(name) = name.to_str() else {
            let message = "its name is not UTF-8, and a manifest could not name it; rename it";
            let input = input::name(path);
            return Err(Failure::usage(format!("{input}: {message}")));
        };
        names.push(name.to_owned());
    }
    Ok(names)
}

/// `walk.dat` becomes `walk.npy`, where it lies.
fn name_for(format: &Format, found: &Found) -> PathBuf {
    let below = if input::is_standard(&found.path) {
        Path::new("stdin")
    } else {
        &found.below
    };
    below.with_extension(format.name)
}

/// The directories that the results lie in, made where they are not there.
pub(crate) fn parents(names: &[String], folder: &Path) -> Result<BTreeSet<PathBuf>, Failure> {
    let parents: BTreeSet<PathBuf> = (names.iter())
        .filter_map(|name| folder.join(name).parent().map(Path::to_owned))
        .collect();
    for parent in &parents {
        std::fs::create_dir_all(parent)
            .map_err(|error| Failure::writing(&parent.display().to_string(), &error))?;
    }
    Ok(parents)
}
