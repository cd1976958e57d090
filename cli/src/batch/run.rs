//! Many inputs into a directory of results: the next input is read while one is evaluated, and results
//! are recorded in the manifest.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use tumble_formats::Loaded;

use crate::arguments::input;
use crate::batch::destination::WrittenFile;
use crate::batch::digest::InputFile;
use crate::batch::manifest::{ManifestEntry, PreviousEntries, kernels_sha256};
use crate::batch::output::ResultTarget;
use crate::messages::exit::{DEVICE, Failure, for_all};
use crate::messages::{signals, words};

/// The options of a batch.
pub(crate) struct Batch<R> {
    /// Reads an input.
    pub(crate) read: R,
    /// The longest input that `read` accepts: longer ones are not hashed.
    pub(crate) max_bytes: u64,
    /// Everything that determines a result besides its input.
    pub(crate) options: String,
    /// Results that are done are skipped.
    pub(crate) resume: bool,
}

/// An input that was read; `None` where its result exists and is complete.
type Input = Option<ReadInput>;

struct ReadInput {
    file: InputFile,
    loaded: Result<Loaded, Failure>,
}

/// A result that still has its temporary name, the device that computed it, and the message about it.
pub(crate) struct EvaluatedResult {
    pub(crate) written: WrittenFile,
    pub(crate) device: String,
    pub(crate) message: String,
}

/// Accepts each complete result, with its name in the manifest.
pub(crate) type ResultCallback<'a> = dyn FnMut(&str, EvaluatedResult) -> Result<(), Failure> + 'a;

/// Records the results of a batch.
pub(crate) trait ResultRecorder {
    /// The results recorded before this batch.
    fn previous(&self) -> PreviousEntries;

    /// Records a complete result, which is renamed now or together with others.
    fn keep(&mut self, entry: ManifestEntry, written: WrittenFile) -> Result<(), Failure>;

    /// A result, or the results of its clips, exist already.
    fn skip(&mut self, _output: &str) {}

    /// An input failed; the batch continues.
    fn refuse(&mut self, _path: &Path, _failure: &Failure) {}

    /// The file that lists the results.
    fn list(&self) -> PathBuf;

    /// Prints a message.
    fn tell(&self, text: &str) {
        words::note(text);
    }
}

impl<R: Fn(&Path) -> Result<Loaded, Failure> + Sync> Batch<R> {
    pub(crate) fn run(
        &self,
        jobs: &[(PathBuf, ResultTarget)],
        refused: Vec<Failure>,
        records: &mut impl ResultRecorder,
        mut evaluate: impl FnMut(
            &InputFile,
            &Loaded,
            &ResultTarget,
            &mut ResultCallback<'_>,
        ) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let previous = records.previous();
        let mut skipped = 0;
        let mut failed = refused.len();
        let inputs = failed + jobs.len();
        let mut made = HashSet::new();
        let outcome = thread::scope(|scope| {
            // At most one input waits, so that at most two are in memory.
            let (hand_over, inputs) = sync_channel(0);
            let reader = thread::Builder::new()
                .spawn_scoped(scope, move || self.read_all(jobs, &previous, &hand_over));
            if let Err(error) = reader {
                let message =
                    format!("the system refuses a thread: {error}; allow more (ulimit -u)");
                return Err(Failure::new(DEVICE, message));
            }
            let mut make = |path: &Path,
                            target: &ResultTarget,
                            records: &mut dyn ResultRecorder| {
                if let Some(stop) = signals::stopped() {
                    return Err(stop);
                }
                let Some((file, loaded)) = next_input(&inputs)? else {
                    skipped += 1;
                    records.skip(target.name());
                    return Ok(());
                };
                let clips = loaded.clips.len();
                evaluate(&file, &loaded, target, &mut |name, mut evaluated| {
                    // Clips of one input may be called as another input is: walk.glb's `Run` and
                    // walk.Run.bvh.
                    if !made.insert(name.to_owned()) {
                        let input = input::name(path);
                        return Err(Failure::usage(format!(
                            "{input}: another input's result is {name} already; evaluate them into \
                             different directories"
                        )));
                    }
                    let digest = evaluated.written.digest.take().unwrap_or_default();
                    let entry = ManifestEntry {
                        output: name.to_owned(),
                        output_bytes: digest.bytes(),
                        output_sha256: digest.finish(),
                        input: path.display().to_string(),
                        input_sha256: file.sha256().map(str::to_owned),
                        options: self.options.clone(),
                        kernels_sha256: kernels_sha256().to_owned(),
                        tumble: env!("CARGO_PKG_VERSION").to_owned(),
                        device: evaluated.device,
                        one_of: (name != target.name()).then(|| (target.name().to_owned(), clips)),
                    };
                    records.keep(entry, evaluated.written)?;
                    records.tell(&evaluated.message);
                    Ok(())
                })
            };
            for_all(refused, jobs, |(path, target)| {
                make(path, target, records).inspect_err(|failure| {
                    if !failure.is_final() {
                        failed += 1;
                        records.refuse(path, failure);
                    }
                })
            })
        });
        // The summary of a batch of several inputs.
        if inputs > 1 || skipped > 0 {
            let list = records.list();
            let mut parts = vec![format!("{} made", words::count(made.len(), "result"))];
            if skipped > 0 {
                let results = words::count(skipped, "result");
                parts.push(format!("{results} skipped (done before, and whole)"));
            }
            if failed > 0 {
                parts.push(format!("{} failed", words::count(failed, "input")));
            }
            let summary = parts.join(", ");
            records.tell(&match list.exists() || !made.is_empty() {
                true => format!("{summary}; listed in {}", list.display()),
                false => summary,
            });
        }
        outcome
    }

    /// Reads the inputs one by one; stops when the receiver is gone.
    fn read_all(
        &self,
        jobs: &[(PathBuf, ResultTarget)],
        previous: &PreviousEntries,
        hand_over: &SyncSender<Input>,
    ) {
        for (path, target) in jobs {
            let file = InputFile::new(path);
            let is_done = |hash: &str| previous.is_done(target.name(), hash, &self.options);
            // The hash is of the bytes that are read next.
            let is_read = std::fs::metadata(path).is_ok_and(|found| found.len() <= self.max_bytes);
            let sha256 = is_read.then(|| file.sha256()).flatten();
            let done = self.resume && sha256.is_some_and(is_done);
            let input = (!done).then(|| {
                let loaded = (self.read)(path);
                let loaded = loaded.and_then(|loaded| file.check_unchanged().map(|()| loaded));
                ReadInput { file, loaded }
            });
            if hand_over.send(input).is_err() {
                return;
            }
        }
    }
}

/// The next input and its hash, if it has to be evaluated; prints its warnings.
fn next_input(inputs: &Receiver<Input>) -> Result<Option<(InputFile, Loaded)>, Failure> {
    let input = inputs.recv().expect("the reader hands over every input");
    let Some(ReadInput { file, loaded }) = input else {
        return Ok(None);
    };
    let loaded = loaded?;
    input::print_warnings(&loaded);
    Ok(Some((file, loaded)))
}
