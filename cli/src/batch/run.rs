//! Many inputs into a directory of results: the next one is read while one is evaluated,
//! and the manifest is kept.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use tumble_formats::Loaded;

use crate::arguments::input;
use crate::batch::digest::InputFile;
use crate::batch::manifest::{Entry, Previous, kernels_sha256};
use crate::batch::output::Target;
use crate::batch::place::Written;
use crate::messages::exit::{DEVICE, Failure, for_all};
use crate::messages::{signals, words};

/// How a batch is done.
pub(crate) struct Batch<R> {
    /// Reads an input.
    pub(crate) read: R,
    /// The longest input that it reads: a longer one is refused, and not hashed before.
    pub(crate) most: u64,
    /// All that decides over a result besides its input.
    pub(crate) options: String,
    /// Results that are done are skipped.
    pub(crate) resume: bool,
}

/// An input that was read; nothing where its result is there, and whole.
type Input = Option<Read>;

struct Read {
    file: InputFile,
    loaded: Result<Loaded, Failure>,
}

/// A result that has yet to get its name, who computed it, and what to say of it.
pub(crate) struct Evaluated {
    pub(crate) written: Written,
    pub(crate) device: String,
    pub(crate) told: String,
}

/// Takes each result as it is whole, with the name that the manifest gives it.
pub(crate) type Done<'a> = dyn FnMut(&str, Evaluated) -> Result<(), Failure> + 'a;

/// Who remembers what a batch has made.
pub(crate) trait Records {
    /// What was there before.
    fn previous(&self) -> Previous;

    /// A result is whole and gets its name, now or with others.
    fn keep(&mut self, entry: Entry, written: Written) -> Result<(), Failure>;

    /// A result, or those of all clips in its place, are there from before.
    fn skip(&mut self, _output: &str) {}

    /// An input has no result, and the batch goes on.
    fn refuse(&mut self, _path: &Path, _failure: &Failure) {}

    /// Where results are listed.
    fn list(&self) -> PathBuf;

    /// Says something to people.
    fn tell(&self, text: &str) {
        words::note(text);
    }
}

impl<R: Fn(&Path) -> Result<Loaded, Failure> + Sync> Batch<R> {
    pub(crate) fn run(
        &self,
        jobs: &[(PathBuf, Target)],
        refused: Vec<Failure>,
        records: &mut impl Records,
        mut evaluate: impl FnMut(&InputFile, &Loaded, &Target, &mut Done<'_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let previous = records.previous();
        let mut skipped = 0;
        let mut failed = refused.len();
        let inputs = failed + jobs.len();
        let mut made = HashSet::new();
        let outcome = thread::scope(|scope| {
            // One is waiting at most: two sets are in memory.
            let (hand_over, inputs) = sync_channel(0);
            let reader = thread::Builder::new()
                .spawn_scoped(scope, move || self.read_all(jobs, &previous, &hand_over));
            if let Err(error) = reader {
                let message =
                    format!("the system refuses a thread: {error}; allow more (ulimit -u)");
                return Err(Failure::new(DEVICE, message));
            }
            let mut make = |path: &Path, target: &Target, records: &mut dyn Records| {
                if let Some(stop) = signals::stopped() {
                    return Err(stop);
                }
                let Some((file, loaded)) = taken(&inputs)? else {
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
                    let entry = Entry {
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
                    records.tell(&evaluated.told);
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
        // The last line of many: what it came to, and where that stands.
        if inputs > 1 || skipped > 0 {
            let list = records.list();
            let mut told = vec![format!("{} made", words::count(made.len(), "result"))];
            if skipped > 0 {
                let results = words::count(skipped, "result");
                told.push(format!("{results} skipped (done before, and whole)"));
            }
            if failed > 0 {
                told.push(format!("{} failed", words::count(failed, "input")));
            }
            let told = told.join(", ");
            records.tell(&match list.exists() || !made.is_empty() {
                true => format!("{told}; listed in {}", list.display()),
                false => told,
            });
        }
        outcome
    }

    /// Reads the inputs one by one; stops when nobody takes them any more.
    fn read_all(
        &self,
        jobs: &[(PathBuf, Target)],
        previous: &Previous,
        hand_over: &SyncSender<Input>,
    ) {
        for (path, target) in jobs {
            let file = InputFile::new(path);
            let is_done = |hash: &str| previous.is_done(target.name(), hash, &self.options);
            // The hash is of the bytes that are read next.
            let is_read = std::fs::metadata(path).is_ok_and(|found| found.len() <= self.most);
            let sha256 = is_read.then(|| file.sha256()).flatten();
            let done = self.resume && sha256.is_some_and(is_done);
            let input = (!done).then(|| {
                let loaded = (self.read)(path);
                let loaded = loaded.and_then(|loaded| file.check_unchanged().map(|()| loaded));
                Read { file, loaded }
            });
            if hand_over.send(input).is_err() {
                return;
            }
        }
    }
}

/// The next input and its hash, when it has to be evaluated; says its warnings.
fn taken(inputs: &Receiver<Input>) -> Result<Option<(InputFile, Loaded)>, Failure> {
    let input = inputs.recv().expect("the reader hands over every input");
    let Some(Read { file, loaded }) = input else {
        return Ok(None);
    };
    let loaded = loaded?;
    input::tell_warnings(&loaded);
    Ok(Some((file, loaded)))
}
