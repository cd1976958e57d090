//! The lines of a manifest: those of earlier batches, and the recorder of new ones.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use serde::{Deserialize, Serialize};
use tumble_formats::beneath::{is_beneath, open_beneath};

use crate::arguments::options::{self, OptionFile, with_present_names};
use crate::batch::digest;
use crate::batch::target::WrittenFile;
use crate::messages::exit::{Failure, OUTPUT};
use crate::messages::warnings::RecordedWarning;
use crate::messages::{names, words};

/// The name of a manifest in its directory.
pub(crate) const NAME: &str = "manifest.jsonl";

/// One result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct ManifestEntry {
    /// Below the manifest's directory.
    pub(crate) output: String,
    pub(crate) output_sha256: String,
    pub(crate) output_bytes: u64,
    /// As on the command line.
    pub(crate) input: String,
    /// `None` for standard input.
    pub(crate) input_sha256: Option<String>,
    /// Everything that determines the result besides the input, by the names that options have now.
    pub(crate) options: String,
    /// The files that these name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) option_files: Vec<OptionFile>,
    pub(crate) kernels_sha256: String,
    /// The program's version.
    pub(crate) tumble: String,
    /// Which device computed it; on every other the bits would be the same.
    pub(crate) device: String,
    /// For a clip of a file with several: the result that all clips together would have been, and
    /// how many clips there are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) one_of: Option<(String, usize)>,
    #[serde(flatten)]
    pub(crate) frames: FrameNotes,
    /// The warnings about the input and about writing the result.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) warnings: Vec<RecordedWarning>,
}

/// Assumptions about the frames of a result, and times that they leave out, in a manifest and in JSON.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct FrameNotes {
    /// The frames per second, if they were assumed because the keys have no rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) assumed_fps: Option<String>,
    /// The seconds from the last frame to the end of the clip, where nothing follows the last frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) left_out_seconds: Option<f64>,
}

impl FrameNotes {
    /// The seconds in whole nanoseconds: so few digits are the same after reading and writing.
    pub(crate) fn new(assumed_fps: Option<String>, left_out_seconds: Option<f64>) -> Self {
        Self {
            assumed_fps,
            left_out_seconds: left_out_seconds.map(|seconds| (seconds * 1e9).round() / 1e9),
        }
    }
}

/// An input without a result, or with a part of its results.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct InputEntry {
    pub(crate) state: InputState,
    /// As on the command line.
    pub(crate) input: String,
    /// The result that it has, or would have; `None` if no name for it is possible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) result: Option<String>,
    /// The exit code of a command that has only this input.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) code: Option<u8>,
    /// Why it failed or was skipped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) message: Option<String>,
    /// The code of the error in it, such as E021.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) diagnostic: Option<String>,
    /// Why each of its animations failed, where some did.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) causes: Vec<String>,
    /// The warnings about the input and those of its animations that failed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) warnings: Vec<RecordedWarning>,
    /// The command that processes it, if this is not `tumble eval`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) command: Option<String>,
}

/// Why an input has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum InputState {
    /// It was refused, or some of its animations were.
    Failed,
    /// The batch has not come to it.
    Pending,
    /// It is no file that can be read, such as a named pipe in a directory.
    Skipped,
}

impl InputEntry {
    /// An input that a batch has yet to evaluate.
    pub(crate) fn pending(input: &Path, result: &str) -> Self {
        Self {
            state: InputState::Pending,
            input: names::recorded(input),
            result: Some(result.to_owned()),
            code: None,
            message: None,
            diagnostic: None,
            causes: Vec::new(),
            warnings: Vec::new(),
            command: None,
        }
    }

    /// An input that failed.
    pub(crate) fn failed(input: &Path, result: Option<&str>, failure: &Failure) -> Self {
        Self {
            state: InputState::Failed,
            input: names::recorded(input),
            result: result.map(str::to_owned),
            code: Some(failure.code),
            message: Some(failure.message().to_owned()),
            diagnostic: failure.input_code().map(|code| code.name().to_owned()),
            causes: failure.causes().to_vec(),
            warnings: Vec::new(),
            command: None,
        }
    }

    /// Paths that were skipped because they are no files that can be read, and why.
    pub(crate) fn skipped(path: &Path, why: String) -> Self {
        Self {
            state: InputState::Skipped,
            input: names::recorded(path),
            result: None,
            code: None,
            message: Some(why),
            diagnostic: None,
            causes: Vec::new(),
            warnings: Vec::new(),
            command: None,
        }
    }

    /// The entry in a line; `None` if the line is not an entry, or if it names a result outside its directory.
    pub(crate) fn of_line(line: &[u8]) -> Option<Self> {
        let entry: Self = serde_json::from_slice(line).ok()?;
        entry
            .result
            .as_deref()
            .is_none_or(is_beneath)
            .then_some(entry)
    }

    /// As [`InputEntry::command`], of a request with these options.
    pub(crate) fn command_in(options: &str) -> Option<String> {
        let command = options::command_of(options);
        (command != options::DEFAULT_COMMAND).then(|| command.to_owned())
    }

    /// The command that processes it.
    pub(crate) fn command(&self) -> &str {
        self.command.as_deref().unwrap_or(options::DEFAULT_COMMAND)
    }

    /// The key that all entries of one input share: its result, or else `/` (with which no result begins) and its name.
    pub(crate) fn key(&self) -> String {
        let by_input = || Self::key_by_input(&self.input);
        self.result.clone().unwrap_or_else(by_input)
    }

    fn key_by_input(input: &str) -> String {
        format!("/{input}")
    }

    /// The entry as a line.
    pub(crate) fn line(&self) -> String {
        serde_json::to_string(self).expect("strings and numbers") + "\n"
    }
}

/// The entries of inputs without results, by [`InputEntry::key`].
pub(crate) type InputEntries = BTreeMap<String, InputEntry>;

impl ManifestEntry {
    /// The entry in a line; `None` if the line is not an entry, or if it names a result outside its directory.
    pub(crate) fn of_line(line: &[u8]) -> Option<Self> {
        let mut entry: Self = serde_json::from_slice(line).ok()?;
        if let Cow::Owned(options) = with_present_names(&entry.options) {
            entry.options = options;
        }
        let all = entry.one_of.as_ref().map(|(all, _)| &**all);
        (is_beneath(&entry.output) && all.is_none_or(is_beneath)).then_some(entry)
    }

    /// The input's result that it is a part of, and of how many parts.
    pub(crate) fn whole(&self) -> (&str, usize) {
        match &self.one_of {
            Some((all, count)) => (all, *count),
            None => (&self.output, 1),
        }
    }

    /// Removes earlier lines about the input of this entry, because the input has a result now.
    pub(crate) fn settle(&self, inputs: &mut InputEntries) {
        if !inputs.is_empty() {
            inputs.remove(self.whole().0);
            inputs.remove(&InputEntry::key_by_input(&self.input));
        }
    }

    /// The command that made it.
    pub(crate) fn command(&self) -> &str {
        options::command_of(&self.options)
    }

    /// Whether it is the result of the same request.
    pub(crate) fn is_made_from(&self, input_sha256: &str, options: &str) -> bool {
        self.input_sha256.as_deref() == Some(input_sha256) && self.is_made_with(options)
    }

    /// Whether it is a table with rows of many inputs; the manifest then names the directory of these inputs.
    pub(crate) fn is_of_directory(&self) -> bool {
        self.options.ends_with(" into=parquet")
    }

    /// As [`ManifestEntry::is_made_from`], of any input.
    pub(crate) fn is_made_with(&self, options: &str) -> bool {
        self.options == options && self.is_of_this_program()
    }

    /// Whether a program of this version with the same kernels made it.
    pub(crate) fn is_of_this_program(&self) -> bool {
        self.kernels_sha256 == kernels_sha256() && self.tumble == env!("CARGO_PKG_VERSION")
    }
}

/// The SHA-256 of the SPIR-V of all kernels, one after the other.
pub(crate) fn kernels_sha256() -> &'static str {
    static HASH: LazyLock<String> =
        LazyLock::new(|| digest::of_bytes(tumble::vulkan::kernels().map(|(_, code)| code)));
    &HASH
}

/// A manifest's lines: the last one for each output and each input, and how many are no entries.
pub(crate) struct ManifestLines {
    pub(crate) entries: BTreeMap<String, ManifestEntry>,
    pub(crate) inputs: InputEntries,
    pub(crate) damaged: usize,
}

/// The subject of a line of a manifest.
enum ManifestLine {
    Result(ManifestEntry),
    Input(InputEntry),
}

impl ManifestLine {
    fn parse(line: &[u8]) -> Option<Self> {
        let result = ManifestEntry::of_line(line).map(Self::Result);
        result.or_else(|| InputEntry::of_line(line).map(Self::Input))
    }
}

/// The inputs without all their results.
pub(crate) struct UnfinishedInputs<'a> {
    /// The inputs that failed, at least in part.
    pub(crate) failed: Vec<&'a InputEntry>,
    /// The paths of inputs that no batch has processed yet, or in which a batch was stopped.
    pub(crate) pending: BTreeSet<&'a str>,
}

impl ManifestLines {
    /// Parses the lines. A last line without a line end was being written when the program was killed. It is not
    /// needed: the batch has not ended, and all inputs that it had yet to evaluate have lines before this one.
    pub(crate) fn parse(bytes: &[u8]) -> Self {
        let mut lines = Self {
            entries: BTreeMap::new(),
            inputs: BTreeMap::new(),
            damaged: 0,
        };
        for line in bytes.split_inclusive(|&byte| byte == b'\n') {
            match ManifestLine::parse(line) {
                Some(ManifestLine::Result(entry)) => {
                    entry.settle(&mut lines.inputs);
                    lines.entries.insert(entry.output.clone(), entry);
                }
                Some(ManifestLine::Input(entry)) => {
                    lines.inputs.insert(entry.key(), entry);
                }
                None if line.ends_with(b"\n") && line.len() > 1 => lines.damaged += 1,
                None => {}
            }
        }
        lines
    }

    /// The lines of a directory's manifest, and whether there is a file of its name; none of a file that is no
    /// manifest, if it may be replaced.
    pub(crate) fn of_folder(folder: &Path, overwrite: bool) -> Result<(Self, bool), Failure> {
        let mut bytes = Vec::new();
        let exists = match open(folder) {
            Ok(None) => false,
            Ok(Some(mut file)) => {
                let read = file.read_to_end(&mut bytes);
                read.map_err(|error| {
                    let path = folder.join(NAME);
                    let message = format!("{}: cannot be read: {error}", path.display());
                    Failure::new(OUTPUT, message)
                })?;
                true
            }
            Err(_) if overwrite && folder.join(NAME).is_file() => true,
            Err(failure) => return Err(failure),
        };
        let lines = Self::parse(&bytes);
        warn_of_damaged_lines(folder, lines.damaged);
        Ok((lines, exists))
    }

    /// Adds later lines.
    pub(crate) fn extend(&mut self, later: Self) {
        for entry in later.entries.values() {
            entry.settle(&mut self.inputs);
        }
        self.entries.extend(later.entries);
        self.inputs.extend(later.inputs);
        self.damaged += later.damaged;
    }

    /// The inputs without all their results.
    pub(crate) fn unfinished_inputs(&self) -> UnfinishedInputs<'_> {
        let in_state = |state: InputState| self.inputs.values().filter(move |it| it.state == state);
        let failed: Vec<&InputEntry> = in_state(InputState::Failed).collect();
        let failed_results: BTreeSet<&str> = failed
            .iter()
            .filter_map(|it| it.result.as_deref())
            .collect();
        let mut pending: BTreeSet<&str> =
            in_state(InputState::Pending).map(|it| &*it.input).collect();
        // An input is pending, too, if some of its clips have no result: the batch was stopped between these clips.
        let mut clips: BTreeMap<(&str, usize), (usize, &str)> = BTreeMap::new();
        for entry in self.entries.values() {
            clips.entry(entry.whole()).or_insert((0, &entry.input)).0 += 1;
        }
        let cut = clips.iter().filter(|((whole, count), (found, _))| {
            found < count && !failed_results.contains(whole)
        });
        pending.extend(cut.map(|(_, (_, input))| input));
        UnfinishedInputs { failed, pending }
    }

    /// The results of inputs that failed, at least in part, or that no batch has processed yet.
    pub(crate) fn unfinished(&self) -> BTreeSet<String> {
        self.inputs.keys().cloned().collect()
    }
}

/// Opens the manifest of a directory; `None` if there is none.
///
/// # Errors
/// When it is a link, not a regular file, or not a manifest.
pub(crate) fn open(folder: &Path) -> Result<Option<File>, Failure> {
    let path = folder.join(NAME);
    let shown = path.display();
    let refuse = |why: &str| Err(Failure::usage(format!("{shown}: {why}")));
    match std::fs::symlink_metadata(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Ok(found) if found.is_symlink() => {
            return refuse(
                "is a symbolic link, and a manifest must be a regular file; remove the link",
            );
        }
        Ok(found) if !found.is_file() => {
            return refuse("is not a regular file, as a manifest must be; give another directory");
        }
        Ok(_) | Err(_) => {}
    }
    let failed = |error| Failure::new(OUTPUT, format!("{shown}: cannot be read: {error}"));
    let file = open_beneath(folder, Path::new(NAME)).map_err(failed)?;
    let mut first = Vec::new();
    let mut reader = BufReader::new(file.try_clone().map_err(failed)?).take(MAX_LINE);
    reader.read_until(b'\n', &mut first).map_err(failed)?;
    if ManifestLine::parse(&first).is_none() {
        return refuse(
            "is not a manifest of tumble: its first line is not an entry; move it, give another directory, \
             or --overwrite to replace it",
        );
    }
    io::Seek::rewind(&mut &file).map_err(failed)?;
    Ok(Some(file))
}

/// Warns of lines of a directory's manifest that are not entries: they are left out of the next one.
pub(crate) fn warn_of_damaged_lines(folder: &Path, lines: usize) {
    if lines > 0 {
        let path = folder.join(NAME);
        let belong = if lines == 1 { "belongs" } else { "belong" };
        words::warning(&format!(
            "{}: left out: {} that {belong} to no result in this directory",
            path.display(),
            words::count(lines, "line")
        ));
    }
}

/// The longest line, in bytes.
const MAX_LINE: u64 = 1 << 20;

/// The inputs of a batch before its work begins.
pub(crate) struct BatchStart<'a> {
    /// Each input that it evaluates, with the name of its result.
    pub(crate) inputs: Vec<(&'a Path, &'a str)>,
    /// Skipped entries of directories.
    pub(crate) skipped: Vec<InputEntry>,
    /// As in [`ManifestEntry`].
    pub(crate) options: &'a str,
    /// Whether results that are done are kept.
    pub(crate) resume: bool,
}

/// Records the results of a batch.
pub(crate) trait ResultRecorder {
    /// The results recorded before this batch.
    fn previous(&self) -> PreviousEntries;

    /// The batch begins.
    fn begin(&mut self, _start: BatchStart<'_>) -> Result<(), Failure> {
        Ok(())
    }

    /// Records a complete result, which is renamed now or together with others.
    fn keep(&mut self, entry: ManifestEntry, written: WrittenFile) -> Result<(), Failure>;

    /// A result, or the results of its clips, exist already.
    fn skip(&mut self, _output: &str) {}

    /// All results of an input are made.
    fn end_input(&mut self, _output: &str) {}

    /// An input failed; the batch continues.
    fn refuse(&mut self, entry: InputEntry) -> Result<(), Failure>;

    /// The file that lists the results.
    fn list(&self) -> PathBuf;

    /// Prints a message.
    fn tell(&self, text: &str) {
        words::note(text);
    }

    /// The batch is over.
    fn close(self: Box<Self>) -> Result<(), Failure> {
        Ok(())
    }
}

/// The entries of a manifest before the batch.
#[derive(Clone)]
pub(crate) struct PreviousEntries {
    pub(super) folder: PathBuf,
    pub(super) entries: Arc<BTreeMap<String, ManifestEntry>>,
    /// The results of inputs that failed, at least in part, or that no batch has processed yet.
    pub(super) unfinished: Arc<BTreeSet<String>>,
}

impl PreviousEntries {
    pub(crate) fn new(
        folder: &Path,
        entries: BTreeMap<String, ManifestEntry>,
        unfinished: BTreeSet<String>,
    ) -> Self {
        Self {
            folder: folder.to_owned(),
            entries: Arc::new(entries),
            unfinished: Arc::new(unfinished),
        }
    }

    /// The directory of results.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// All entries, by the names of their results.
    pub(crate) fn entries(&self) -> &BTreeMap<String, ManifestEntry> {
        &self.entries
    }

    /// The entry of an output, or the entries of its clips.
    pub(crate) fn results_of<'a>(
        &'a self,
        output: &'a str,
    ) -> impl Iterator<Item = &'a ManifestEntry> {
        let one = self.entries.get(output);
        let clips = of_clips(&self.entries, output).filter(move |_| one.is_none());
        one.into_iter().chain(clips.map(|(entry, _)| entry))
    }

    /// Whether the output, or the outputs of all its clips, exist, are complete, and were made by the
    /// same request.
    pub(crate) fn is_done(&self, output: &str, input_sha256: &str, options: &str) -> bool {
        let is_whole = |entry: &ManifestEntry| {
            let (bytes, sha256) = (entry.output_bytes, &entry.output_sha256);
            entry.is_made_from(input_sha256, options)
                && digest::is_whole(&self.folder, &entry.output, bytes, sha256)
                    .is_ok_and(|is_whole| is_whole)
        };
        if self.unfinished.contains(output) {
            return false;
        }
        if let Some(entry) = self.entries.get(output) {
            return is_whole(entry);
        }
        let clips = of_clips(&self.entries, output);
        let clips = clips.filter_map(|(entry, count)| is_whole(entry).then_some(count));
        let counts: Vec<usize> = clips.collect();
        counts.first().is_some_and(|&count| count == counts.len())
    }
}

/// The results of the single clips of an output, with the number of clips: `fox.Run.npy` and so on for
/// `fox.npy`.
pub(super) fn of_clips<'a>(
    entries: &'a BTreeMap<String, ManifestEntry>,
    output: &'a str,
) -> impl Iterator<Item = (&'a ManifestEntry, usize)> {
    let stem = output.rsplit_once('.').map_or(output, |(stem, _)| stem);
    let beside = entries.range(format!("{stem}.")..);
    let candidates = beside.take_while(move |(name, _)| name.starts_with(stem));
    candidates.filter_map(move |(_, entry)| {
        let (all, count) = entry.one_of.as_ref()?;
        (all == output).then_some((entry, *count))
    })
}

/// An entry as a line.
pub(crate) fn line(entry: &ManifestEntry) -> String {
    serde_json::to_string(entry).expect("strings and numbers") + "\n"
}
