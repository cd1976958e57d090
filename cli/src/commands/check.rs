//! `tumble check`: have the results of a batch changed?

use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use rayon::prelude::*;

use crate::batch::digest;
use crate::batch::entry::{ManifestEntry, ManifestLines, NAME};
use crate::batch::shards::merge::ShardProgress;
use crate::batch::shards::plan::RecordedPlan;
use crate::batch::shards::record;
use crate::messages::exit::{ALL_INPUTS, DIFFERENCE, Failure};
use crate::messages::listing;
use crate::messages::progress::busy;
use crate::messages::words;
use crate::threads::on_threads;

/// Check results against the manifest of their directory, bit for bit
#[derive(Debug, Args)]
#[command(after_help = "\
`tumble eval` writes a manifest into every directory of results: for each result a line of
JSON with the SHA-256 of the result and of its input, the options, the kernels, the program's
version and the device. If shards are missing in the directory, it checks the results of the
complete shards, and prints how many there are.

Examples:
  tumble check results/manifest.jsonl
  tumble check results")]
pub(crate) struct Arguments {
    /// The manifest, or its directory
    manifest: PathBuf,
}

/// What is wrong with one result.
enum Fault {
    Damaged,
    Unreadable(io::Error),
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let manifest = &arguments.manifest;
    let path = if manifest.is_dir() {
        manifest.join(NAME)
    } else {
        manifest.clone()
    };
    let shown = path.display();
    let folder = path.parent().unwrap_or(Path::new(""));
    let shards = RecordedPlan::read(folder)?;
    // A pipe or a device may have no end.
    let read = match std::fs::metadata(&path) {
        Ok(found) if !found.is_file() => {
            let message = format!("{shown}: is not a manifest; `tumble eval` writes one, {NAME}");
            return Err(Failure::new(ALL_INPUTS, message));
        }
        _ => std::fs::read(&path),
    };
    let bytes = match read {
        Err(error) if error.kind() == io::ErrorKind::NotFound && shards.is_some() => Vec::new(),
        read => read.map_err(|error| {
            Failure::new(
                ALL_INPUTS,
                format!("{shown}: the manifest cannot be read: {error}"),
            )
        })?,
    };
    let ManifestLines {
        mut entries,
        damaged,
    } = ManifestLines::parse(&bytes);
    if shards.is_some() {
        entries.extend(record::entries(folder));
    } else if entries.is_empty() {
        let message = format!("{shown}: is not a manifest; `tumble eval` writes one, {NAME}");
        return Err(Failure::new(ALL_INPUTS, message));
    }
    let entries: Vec<ManifestEntry> = entries.into_values().collect();
    let faults: Vec<(&ManifestEntry, Fault)> = busy("checking", || {
        let faulty = |entry| fault(folder, entry).map(|fault| (entry, fault));
        on_threads(
            || entries.par_iter().filter_map(faulty).collect(),
            || entries.iter().filter_map(faulty).collect(),
        )
    });
    for (entry, fault) in &faults {
        let output = folder.join(&entry.output);
        let output = output.display();
        words::error(&match fault {
            Fault::Damaged => format!("{output}: its bits have changed since it was written"),
            Fault::Unreadable(error) => format!("{output}: cannot be read: {error}"),
        });
    }
    if damaged > 0 {
        words::error(&format!(
            "{shown}: {} damaged",
            words::count(damaged, "line")
        ));
    }
    let total = words::count(entries.len(), "result");
    if faults.len() + damaged > 0 {
        let message = format!(
            "{} of {total} differ; `tumble eval … --resume` makes them again",
            faults.len()
        );
        return Err(Failure::new(DIFFERENCE, message));
    }
    listing::text(&format!("{total}, unchanged since they were written\n"))?;
    match shards.map(|recorded| ShardProgress::of(folder, &recorded)) {
        None => Ok(()),
        Some(progress) => Err(Failure::new(DIFFERENCE, unmerged(folder, &progress))),
    }
}

/// What is yet to do in a directory with shards.
fn unmerged(folder: &Path, progress: &ShardProgress) -> String {
    let (folder, summary) = (folder.display(), progress.summary());
    match progress.is_done() {
        true => format!("{folder}: {summary}; `tumble merge {folder}` combines them"),
        false => format!("{folder}: {summary}; --resume makes the others"),
    }
}

fn fault(folder: &Path, entry: &ManifestEntry) -> Option<Fault> {
    let (bytes, sha256) = (entry.output_bytes, &entry.output_sha256);
    match digest::is_whole(folder, &entry.output, bytes, sha256) {
        Ok(true) => None,
        Ok(false) => Some(Fault::Damaged),
        Err(error) => Some(Fault::Unreadable(error)),
    }
}
