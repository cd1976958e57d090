//! What is asked of the outputs of a command, and what is planned.

use std::path::{Path, PathBuf};

use tumble_formats::format::Format;

use crate::batch::manifest::Manifest;
use crate::batch::target::ResultTarget;
use crate::messages::exit::Failure;

/// One target for each input, and the manifest of their directory.
#[derive(Default)]
pub(crate) struct OutputPlan {
    /// The inputs that have targets.
    pub(crate) paths: Vec<PathBuf>,
    pub(crate) targets: Vec<ResultTarget>,
    /// The failures of inputs that have no target.
    pub(crate) refused: Vec<Failure>,
    pub(crate) manifest: Option<Manifest>,
}

/// The options that decide where results go.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutputRequest<'a> {
    pub(crate) out: Option<&'a Path>,
    pub(crate) format: Option<&'static Format>,
    pub(crate) overwrite: bool,
    pub(crate) resume: bool,
}
