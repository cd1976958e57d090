//! `tumble merge`: the shards that many processes have made become one directory of results.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::batch::shards::merge::{MergeSummary, ResultLocation, merge};
use crate::batch::shards::record::RefusedInput;
use crate::messages::exit::{FailedInputs, Failure};
use crate::messages::listing;
use crate::messages::progress::busy;
use crate::messages::words;

/// Merge the shards of a directory into one manifest
#[derive(Debug, Args)]
#[command(after_help = "\
`tumble eval LIBRARY -o OUT --shard I/N` writes OUT/manifest.d. When all shards are done, merging \
writes OUT/manifest.jsonl and removes manifest.d. The file is the same as that of a single \
`tumble eval LIBRARY -o OUT`, byte for byte if all processes used the same device. The exit code is 3 \
if inputs failed. If shards or results are missing, or results have another length than when they were \
written, nothing is changed and the exit code is 8; `tumble check` compares all their bytes.

Examples:
  tumble merge results
  seq 64 | xargs -P8 -I{} tumble eval clips -o out --resume --shard {}/64; tumble merge out")]
pub(crate) struct Arguments {
    /// The directory of results
    #[arg(value_name = "OUT")]
    folder: PathBuf,
    /// Print JSON: about the results and the inputs that failed
    #[arg(long)]
    json: bool,
}

/// The JSON that `--json` prints.
#[derive(Debug, Serialize)]
struct MergeReport<'a> {
    output: String,
    results: usize,
    shards: usize,
    inputs: usize,
    failed: &'a [RefusedInput],
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let folder = &arguments.folder;
    let MergeSummary {
        results,
        shards,
        inputs,
        failed,
    } = busy("merging", || merge(folder, ResultLocation::Beside))?;
    if arguments.json {
        listing::json(&MergeReport {
            output: folder.display().to_string(),
            results,
            shards,
            inputs,
            failed: &failed,
        })?;
    }
    for refused in &failed {
        words::note(&refused.message);
    }
    let all = words::count(results, "result");
    words::note(&format!(
        "{}: {all} of {}, from {}",
        folder.display(),
        words::count(inputs, "input"),
        words::count(shards, "shard")
    ));
    let codes = failed.iter().map(|refused| Some(refused.code));
    FailedInputs::of_codes(codes).outcome_of(inputs)
}
