//! The parts of `tumble.distributed`: a library cut into shards, a worker that evaluates them, and the
//! merge. Outcomes are JSON, since they are sent to other machines.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use tumble_cli::host::Refused;
use tumble_cli::shards;

use crate::errors::guarded;
use crate::run::interruptible;

/// The outcome of a call, as the program would end: JSON, or an exit code and a message.
type Outcome = (u8, String);

fn ended(outcome: Result<String, Refused>) -> Outcome {
    match outcome {
        Ok(json) => (0, json),
        Err(refused) => (refused.code, refused.message),
    }
}

/// Converts a failure to an exception: a `ValueError` with the exit code and the message.
fn refuse(refused: Refused) -> PyErr {
    pyo3::exceptions::PyValueError::new_err((refused.code, refused.message))
}

/// The inputs that a command line of `tumble eval` names.
#[pyfunction]
pub(crate) fn inputs_of(py: Python<'_>, line: Vec<OsString>) -> PyResult<Vec<OsString>> {
    interruptible(py, move || {
        let inputs = shards::inputs(&line).map_err(refuse)?;
        Ok(inputs.into_iter().map(PathBuf::into_os_string).collect())
    })
}

/// The files that an input refers to, relative to its folder.
#[pyfunction]
pub(crate) fn referred_files(path: PathBuf) -> Vec<OsString> {
    let files = shards::referred_files(&path).into_iter();
    files.map(PathBuf::into_os_string).collect()
}

/// The hash of an input with the files that it refers to; None if it cannot be read.
#[pyfunction]
pub(crate) fn input_sha256(py: Python<'_>, path: PathBuf) -> Option<String> {
    py.detach(|| shards::input_sha256(&path))
}

/// A line for each input in a manifest and in the records of shards that failed or does not have all its results yet.
#[pyfunction]
pub(crate) fn manifest_unfinished(text: &str, records: Vec<String>) -> Vec<String> {
    shards::manifest_unfinished(text, &records)
}

/// The hash of every kernel: machines that agree in it, and in the version, write the same bytes.
#[pyfunction]
pub(crate) fn kernels_sha256() -> &'static str {
    shards::kernels_sha256()
}

/// Makes one manifest of a directory's shards; gives an exit code, and JSON or a message.
#[pyfunction]
pub(crate) fn merge(py: Python<'_>, folder: PathBuf) -> PyResult<Outcome> {
    interruptible(py, move || {
        Ok(ended(shards::merge(&folder).map(|merged| merged.to_json())))
    })
}

/// A library, cut into shards.
#[pyclass(frozen, weakref, module = "tumble")]
pub(crate) struct Plan {
    plan: shards::LibraryPlan,
}

#[pymethods]
impl Plan {
    #[new]
    fn new(
        py: Python<'_>,
        line: Vec<OsString>,
        library: PathBuf,
        listed: Option<Vec<(String, u64)>>,
        folder: PathBuf,
        shard_bytes: String,
        into: String,
    ) -> PyResult<Self> {
        interruptible(py, move || {
            let plan =
                shards::LibraryPlan::new(&line, &library, listed, &folder, &shard_bytes, &into);
            Ok(Self {
                plan: plan.map_err(refuse)?,
            })
        })
    }

    /// Writes the plan into the directory of results.
    fn claim(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        py.detach(|| guarded(|| self.plan.claim(&folder).map_err(refuse)))
    }

    /// The identity of the plan.
    #[getter]
    fn id(&self) -> &str {
        self.plan.id()
    }

    /// All that decides over results besides their inputs.
    #[getter]
    fn options(&self) -> &str {
        self.plan.options()
    }

    /// The number of inputs.
    #[getter]
    fn inputs(&self) -> usize {
        self.plan.inputs()
    }

    /// The number of shards.
    fn __len__(&self) -> usize {
        self.plan.shards()
    }

    /// The inputs of a shard, from 1: where they are, and where they lie below the library.
    fn inputs_of(&self, shard: usize) -> Vec<(OsString, OsString)> {
        let inputs = self.plan.inputs_of(shard).unwrap_or_default();
        let text = |(path, below): (PathBuf, PathBuf)| (path.into(), below.into());
        inputs.into_iter().map(text).collect()
    }

    /// The paths of the results of a shard, relative to the directory of results.
    fn names_of(&self, shard: usize) -> Vec<String> {
        self.plan.names_of(shard).unwrap_or_default()
    }
}

/// Evaluates shards on a device that stays open.
#[pyclass(frozen, weakref, module = "tumble")]
pub(crate) struct Worker {
    worker: Arc<Mutex<shards::Worker>>,
    device: String,
    options: String,
}

#[pymethods]
impl Worker {
    /// The part of an input's path below the library that names its results.
    fn key_of(&self, below: PathBuf) -> String {
        let worker = self.worker.lock().unwrap_or_else(PoisonError::into_inner);
        worker.key_of(&below)
    }

    #[new]
    fn new(py: Python<'_>, line: Vec<OsString>, threads: Option<usize>) -> PyResult<Self> {
        interruptible(py, move || {
            let worker = shards::Worker::new(&line, threads).map_err(refuse)?;
            Ok(Self {
                device: worker.device().to_owned(),
                options: worker.options().to_owned(),
                worker: Arc::new(Mutex::new(worker)),
            })
        })
    }

    /// The name of its device.
    #[getter]
    fn device(&self) -> &str {
        &self.device
    }

    /// All that decides over results besides their inputs.
    #[getter]
    fn options(&self) -> &str {
        &self.options
    }

    /// Evaluates inputs into a directory; gives an exit code, and JSON or a message. `record`: it
    /// writes the shard's file, rather than give it.
    #[allow(clippy::too_many_arguments, reason = "what a task is made of")]
    #[pyo3(signature = (folder, shard, of, plan, inputs, *, record))]
    fn run(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        shard: usize,
        of: usize,
        plan: String,
        inputs: Vec<(PathBuf, PathBuf)>,
        record: bool,
    ) -> PyResult<Outcome> {
        let task = shards::ShardTask {
            shard,
            of,
            plan,
            inputs,
            record,
        };
        let worker = Arc::clone(&self.worker);
        // If Ctrl-C stops the work, the evaluation of the current input fails, and no record of the shard is written.
        interruptible(py, move || {
            let mut worker = worker.lock().unwrap_or_else(PoisonError::into_inner);
            let outcome = worker.run(&task, &folder);
            Ok(ended(outcome.map(|outcome| outcome.to_json())))
        })
    }
}

/// A shard's file, for results that the program cannot write itself.
#[pyclass(weakref, module = "tumble")]
pub(crate) struct Record {
    record: shards::ShardRecord,
}

#[pymethods]
impl Record {
    /// The file of a shard whose results are these lines of a manifest.
    #[new]
    fn new(shard: usize, of: usize, plan: String, inputs: usize, lines: Vec<String>) -> Self {
        Self {
            record: shards::ShardRecord::new(shard, of, plan, inputs, &lines),
        }
    }

    /// Reads a shard's file; nothing where the text is none.
    #[staticmethod]
    fn parse(text: &str) -> Option<Self> {
        let record = shards::ShardRecord::parse(text)?;
        Some(Self { record })
    }

    /// The name of a shard's file below the directory of results.
    #[staticmethod]
    fn name_of(shard: usize) -> String {
        shards::ShardRecord::name_of(shard)
    }

    /// Whether the text had all its lines, as they were written.
    #[getter]
    fn is_whole(&self) -> bool {
        self.record.is_whole()
    }

    /// The SHA-256 that identifies the shard's plan.
    #[getter]
    fn plan(&self) -> &str {
        self.record.plan()
    }

    #[setter]
    fn set_plan(&mut self, plan: String) {
        self.record.set_plan(plan);
    }

    /// The name, the hash and the length of each result.
    fn results(&self) -> Vec<(String, String, u64)> {
        self.record.results()
    }

    /// Adds an input that has no result.
    fn refuse(&mut self, input: String, message: String) {
        self.record.refuse(input, message);
    }

    /// Whether it has all results of inputs of these hashes, made with these options, and no others.
    #[allow(clippy::needless_pass_by_value, reason = "a dictionary is converted")]
    fn is_made_from(&self, inputs: BTreeMap<String, String>, options: &str) -> bool {
        self.record.is_made_from(&inputs, options)
    }

    /// Replaces its results by a file of rows.
    #[allow(clippy::too_many_arguments, reason = "what a line of a manifest says")]
    #[pyo3(signature = (name, *, sha256, bytes, library, inputs_sha256, into))]
    fn join(
        &mut self,
        name: String,
        sha256: String,
        bytes: u64,
        library: String,
        inputs_sha256: String,
        into: String,
    ) {
        self.record.join(shards::RowsFile {
            name,
            sha256,
            bytes,
            library,
            inputs_sha256,
            into,
        });
    }

    /// The file.
    fn text(&self) -> String {
        self.record.text()
    }
}

/// The results that a manifest lists: the name, the hash and the length of each.
#[pyfunction]
pub(crate) fn manifest_results(text: &str) -> Vec<(String, String, u64)> {
    shards::manifest_results(text)
}

/// The lines of a manifest, by the keys of their inputs.
#[pyfunction]
pub(crate) fn manifest_by_input(text: &str) -> BTreeMap<String, Vec<String>> {
    shards::manifest_by_input(text)
}
