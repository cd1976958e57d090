//! Plans where results go, before any work.

use std::collections::HashSet;
use std::io::{self, IsTerminal};
use std::path::Path;

use crate::arguments::gather::GatheredInputs;
use crate::batch::destination::Destination;
use crate::batch::folder;
use crate::batch::output_plan::{OutputPlan, OutputRequest};
use crate::batch::result_format::{choose, extensions, of};
use crate::batch::target::ResultTarget;
use crate::messages::exit::Failure;
use crate::messages::names;

/// Plans the targets. Refuses, before any work, outputs that exist, that are inputs, or that two inputs share.
pub(crate) fn plan(
    inputs: &GatheredInputs,
    request: OutputRequest<'_>,
) -> Result<OutputPlan, Failure> {
    if request.out.is_none() && io::stdout().is_terminal() {
        return Err(Failure::usage(format!(
            "where should the result go? give {}, or -o - for standard output",
            extensions(|name| format!("-o OUT.{name}")).join(", ")
        )));
    }
    let out = request.out.unwrap_or(Path::new("-"));
    let paths = inputs.paths();
    // A single input has a single output, however it was found.
    let is_file = out.is_file() || of(out).is_some() || names::is_standard(out);
    let is_folder = out.is_dir() || out.as_os_str().as_encoded_bytes().ends_with(b"/");
    let plan = match &*paths {
        [_] if is_file || !inputs.many && !is_folder => {
            if request.resume {
                let message = "--resume is for a directory of results";
                return Err(Failure::usage(message));
            }
            let format = choose(out, request.format)?;
            let destination = Destination::new(out, request.overwrite, &paths)?;
            // The surest check is to try.
            destination.check_writable()?;
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
        _ => folder::in_folder(inputs, out, request)?,
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
