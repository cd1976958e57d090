//! `--dry-run`: the results that a batch would write, skip and remove. Nothing is created or changed.
//!
//! Inputs are read only where their clips decide the names of results.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io;
use std::path::Path;

use serde::Serialize;
use tumble_formats::beneath::parent_beneath;
use tumble_formats::format::Format;
use tumble_formats::printable::printable;
use tumble_formats::{Feature, Loaded};

use crate::arguments::input::{FoundInput, GatheredInputs, InputReader, several_clips_failure};
use crate::arguments::options::{ResultOptions, changed_options};
use crate::batch::digest::{self, InputFile};
use crate::batch::entry::{ManifestEntry, ManifestLines, PreviousEntries};
use crate::batch::manifest::PlannedResults;
use crate::batch::output_plan::{
    OutputOptions, UnplannedInput, goes_to_file, refuse_existing, refuse_lost_plan, refuse_shards,
    without_results,
};
use crate::batch::owner::{CommandsOfResults, Owner, ReplacedOwners};
use crate::batch::pipeline::{SEVERAL_CLIPS_REMEDY, clip_file_names, hash_before_reading};
use crate::batch::result_names::{format, name_results};
use crate::batch::shards::plan::RecordedPlan;
use crate::batch::shards::record;
use crate::batch::target::{Destination, choose, name_of_clip};
use crate::messages::exit::Failure;
use crate::messages::progress::Progress;
use crate::messages::{names, words};

/// How the inputs of a batch are read, and everything that determines its results besides them.
pub(crate) struct PlannedWork<'a> {
    pub(crate) reader: &'a dyn InputReader,
    pub(crate) options: &'a ResultOptions,
}

/// The results that a batch would write, skip and remove.
#[derive(Default)]
pub(crate) struct Preview {
    pub(crate) results: Vec<PreviewedResult>,
    /// The inputs that would have no result.
    pub(crate) refused: Vec<UnplannedInput>,
}

/// A result of a batch that has not run.
#[derive(Debug, Serialize)]
pub(crate) struct PreviewedResult {
    state: PreviewState,
    input: String,
    /// The name of the only animation in it, where the input has several.
    #[serde(skip_serializing_if = "Option::is_none")]
    animation: Option<String>,
    output: String,
    /// Whether a file of that name is there.
    exists: bool,
    /// Whether its input failed in the last run, at least in part.
    failed_before: bool,
    /// Why it is kept or removed, or why an existing file is replaced.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<Cow<'static, str>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum PreviewState {
    /// It would be written.
    Planned,
    /// It is complete, and would be kept.
    Kept,
    /// It would be removed.
    Pruned,
}

impl fmt::Display for PreviewedResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let output = printable(&self.output);
        if self.state == PreviewState::Pruned {
            write!(f, "removes {output}")?;
        } else {
            write!(f, "{}", printable(&self.input))?;
            if let Some(animation) = &self.animation {
                write!(f, " {animation}")?;
            }
            write!(f, " → {output}")?;
        }
        let mut reason = self.reason.iter();
        reason.try_for_each(|reason| write!(f, " ({reason})"))
    }
}

impl Preview {
    /// How many results would be made, kept and removed.
    pub(crate) fn summary(&self) -> String {
        let count = |state| {
            let of_state = self.results.iter().filter(|result| result.state == state);
            of_state.count()
        };
        let planned = words::count(count(PreviewState::Planned), "result");
        let mut summary = format!("{planned} would be made");
        let failed = self.results.iter().filter(|result| result.failed_before);
        match failed.count() {
            0 => {}
            count => summary += &format!(" ({count} of inputs that failed in the last run)"),
        }
        for (state, done) in [
            (PreviewState::Kept, "kept (already complete)"),
            (PreviewState::Pruned, "removed"),
        ] {
            match count(state) {
                0 => {}
                count => summary += &format!(", {count} {done}"),
            }
        }
        summary + "; nothing was written (--dry-run)"
    }
}

/// The results that a plan would have targets for, those that it would skip or remove, and the inputs that it would
/// refuse.
pub(crate) fn preview(
    inputs: &GatheredInputs,
    options: OutputOptions<'_>,
    work: &PlannedWork<'_>,
) -> Result<Preview, Failure> {
    let out = options.out.unwrap_or(Path::new("-"));
    if let [path] = &*inputs.paths()
        && goes_to_file(inputs, out)
    {
        return of_one_file(path, out, options, work);
    }
    let files = without_results(inputs.files.clone(), out)?;
    let mut folder = PreviewedFolder::open(out, &files, options, work)?;
    let mut progress = Progress::new("listing", files.len() as u64);
    let result_names = name_results(&files, out, folder.format, options.naming);
    for (found, name) in files.iter().zip(result_names) {
        let added = name.and_then(|name| folder.add(found, &name));
        if let Err(failure) = added {
            folder.preview.refused.push(UnplannedInput {
                path: found.path.clone(),
                failure,
            });
        }
        progress.advance(1);
    }
    drop(progress);
    folder.replaced.note();
    if options.prune {
        folder.add_removed();
    }
    Ok(folder.preview)
}

/// The result of a single input that is one file.
fn of_one_file(
    path: &Path,
    out: &Path,
    options: OutputOptions<'_>,
    work: &PlannedWork<'_>,
) -> Result<Preview, Failure> {
    for (is_set, option) in [(options.resume, "--resume"), (options.prune, "--prune")] {
        if is_set {
            let message = format!("{option} is for a directory of results");
            return Err(Failure::usage(message));
        }
    }
    let paths = [path.to_owned()];
    Destination::new(out, options.overwrite, &paths)?;
    let format = choose(out, options.format)?;
    if let Some(loaded) = work.several_clips(path, format)? {
        return Err(several_clips_failure(path, &loaded).hinted(SEVERAL_CLIPS_REMEDY));
    }
    let exists = !names::is_standard(out) && std::fs::symlink_metadata(out).is_ok();
    Ok(Preview {
        results: vec![PreviewedResult {
            state: PreviewState::Planned,
            input: names::recorded(path),
            animation: None,
            output: out.display().to_string(),
            exists,
            failed_before: false,
            reason: exists.then_some(REPLACED.into()),
        }],
        refused: Vec::new(),
    })
}

const REPLACED: &str = "replaces a file";

/// For each result of inputs that failed in the last run, at least in part: why it is made again.
fn failed_before(lines: &ManifestLines) -> BTreeMap<String, String> {
    let failed = lines.unfinished_inputs().failed.into_iter();
    let reasons = failed.filter_map(|entry| {
        let code = entry.diagnostic.as_ref();
        let code = code.map_or(String::new(), |code| format!(" ({code})"));
        let failed = match entry.causes.is_empty() {
            true => "it failed",
            false => "some of its animations failed",
        };
        Some((
            entry.result.clone()?,
            format!("{failed} in the last run{code}"),
        ))
    });
    reasons.collect()
}

impl PlannedWork<'_> {
    /// The input, if it has several clips and the format can store only one.
    fn several_clips(&self, path: &Path, format: &Format) -> Result<Option<Loaded>, Failure> {
        if format.supports(Feature::SeveralClips) || !self.reader.may_have_several_clips(path) {
            return Ok(None);
        }
        let loaded = self.reader.read(path)?;
        Ok((loaded.clips.len() > 1).then_some(loaded))
    }
}

/// A directory of results that is not written into.
struct PreviewedFolder<'a> {
    out: &'a Path,
    options: OutputOptions<'a>,
    work: &'a PlannedWork<'a>,
    format: &'static Format,
    previous: PreviousEntries,
    /// Why results of the last run are missing, by name.
    failed: BTreeMap<String, String>,
    has_shards: bool,
    planned: PlannedResults,
    /// The results that would be made.
    made: BTreeSet<String>,
    replaced: ReplacedOwners,
    preview: Preview,
}

impl<'a> PreviewedFolder<'a> {
    fn open(
        out: &'a Path,
        files: &[FoundInput],
        options: OutputOptions<'a>,
        work: &'a PlannedWork<'a>,
    ) -> Result<Self, Failure> {
        let format = format(out, options.format)?;
        let shards = RecordedPlan::read(out)?;
        if let Some(recorded) = &shards {
            let result_names = name_results(files, out, format, options.naming);
            refuse_shards(recorded, &result_names, out, options)?;
        } else {
            refuse_lost_plan(out, options)?;
        }
        let (mut lines, _) = ManifestLines::of_folder(out, options.overwrite)?;
        if shards.is_some() {
            lines.extend(record::lines(out));
        }
        if options.resume && !options.overwrite {
            let result_names = name_results(files, out, format, options.naming);
            let commands = CommandsOfResults::of(&lines.entries, &lines.inputs);
            commands.check(out, result_names.iter().flatten(), options.command)?;
        }
        let (unfinished, failed) = (lines.unfinished(), failed_before(&lines));
        Ok(Self {
            failed,
            out,
            options,
            work,
            format,
            previous: PreviousEntries::new(out, lines.entries, unfinished),
            has_shards: shards.is_some(),
            planned: PlannedResults::default(),
            made: BTreeSet::new(),
            replaced: ReplacedOwners::default(),
            preview: Preview::default(),
        })
    }

    /// Adds the results of an input, whose result of all clips is `name`.
    fn add(&mut self, found: &FoundInput, name: &str) -> Result<(), Failure> {
        let OutputOptions {
            overwrite, resume, ..
        } = self.options;
        let (path, input) = (&*found.path, names::recorded(&found.path));
        self.planned.plan(path, name);
        let owner = self.previous.results_of(name).next().map(Owner::from);
        if let Some(owner) = owner.as_ref().filter(|_| !overwrite) {
            self.replaced.check(path, &self.out.join(name), owner)?;
        }
        if resume && self.is_complete(path, name) {
            let kept = self.previous.results_of(name);
            self.preview
                .results
                .extend(kept.map(|entry| PreviewedResult {
                    state: PreviewState::Kept,
                    input: input.clone(),
                    animation: None,
                    output: self.out.join(&entry.output).display().to_string(),
                    exists: true,
                    failed_before: false,
                    reason: Some("complete, would be kept".into()),
                }));
            self.planned.complete(name);
            return Ok(());
        }
        let is_known = self.has_shards || owner.is_some();
        let results = match self.work.several_clips(path, self.format)? {
            None => vec![(None, name.to_owned())],
            Some(loaded) => {
                let clips = loaded.clips.iter().map(|clip| Some(names::clip(clip)));
                let of_clips = clip_file_names(&loaded.clips).into_iter();
                let of_clips = of_clips.map(|clip| name_of_clip(name, &clip, self.format));
                clips.zip(of_clips).collect()
            }
        };
        let replaces = overwrite || resume && is_known;
        if !replaces {
            let mut results = results.iter();
            results.try_for_each(|(_, output)| refuse_existing(self.out, output, is_known))?;
        }
        for (_, output) in &results {
            self.check_file(output, replaces)?;
        }
        for (animation, output) in results {
            let whole = self.out.join(&output);
            let exists = std::fs::symlink_metadata(&whole).is_ok();
            let known = self.previous.entries().get(&output);
            let reason: Option<Cow<'static, str>> = match (self.failed.get(name), known) {
                (Some(reason), _) if resume => Some(reason.clone().into()),
                (_, Some(entry)) if resume => Some(self.why_made_again(entry, path).into()),
                _ if !exists => None,
                _ => Some(REPLACED.into()),
            };
            self.preview.results.push(PreviewedResult {
                state: PreviewState::Planned,
                input: input.clone(),
                animation,
                output: whole.display().to_string(),
                exists,
                failed_before: resume && self.failed.contains_key(name),
                reason,
            });
            self.made.insert(output);
        }
        self.planned.end(name);
        Ok(())
    }

    /// Refuses a result whose file could not be written: something else has its name, or a link leads out of its directory.
    fn check_file(&self, output: &str, overwrite: bool) -> Result<(), Failure> {
        let whole = self.out.join(output);
        if std::fs::symlink_metadata(&whole).is_err() {
            return Ok(());
        }
        parent_beneath(self.out, Path::new(output)).map_err(|error| {
            let shown = whole.display();
            Failure::usage(format!("{shown}: its directory cannot be used: {error}"))
        })?;
        Destination::new(&whole, overwrite, &[]).map(drop)
    }

    /// Whether the results of an input are there, made with the same options.
    fn is_complete(&self, path: &Path, name: &str) -> bool {
        let limits = self.work.reader.limits();
        let file = InputFile::within(path, limits);
        let options = &self.work.options.text;
        hash_before_reading(&file, limits)
            .is_some_and(|hash| self.previous.is_done(name, hash, options))
    }

    /// The differences between the recorded request of a result and the present one.
    fn why_made_again(&self, entry: &ManifestEntry, path: &Path) -> String {
        let limits = self.work.reader.limits();
        let file = InputFile::within(path, limits);
        let options = &self.work.options.text;
        let mut changed = Vec::new();
        if entry.input_sha256.as_deref() != hash_before_reading(&file, limits) {
            changed.push("its input".to_owned());
        }
        if entry.options != *options {
            changed.push(changed_options(&entry.options, options));
        }
        if !entry.is_of_this_program() {
            changed.push("the program".to_owned());
        }
        if !changed.is_empty() {
            return format!("made again: {} changed", changed.join(", "));
        }
        let (bytes, sha256) = (entry.output_bytes, &entry.output_sha256);
        match digest::is_whole(self.out, &entry.output, bytes, sha256) {
            Ok(true) => "made again: not all results of its input are complete".to_owned(),
            _ if digest::is_link(self.out, &entry.output) => {
                "made again: its file was replaced by a link".to_owned()
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                "made again: its file is missing".to_owned()
            }
            _ => "made again: its file was changed or damaged".to_owned(),
        }
    }

    /// Adds the results that `--prune` would remove.
    fn add_removed(&mut self) {
        let entries = self.previous.entries();
        let is_removed = |entry: &&ManifestEntry| {
            let is_made = self.made.contains(&entry.output);
            self.planned.is_orphan(entry, is_made, entries)
        };
        for entry in entries.values().filter(is_removed) {
            let (bytes, sha256) = (entry.output_bytes, &entry.output_sha256);
            let output = self.out.join(&entry.output).display().to_string();
            match digest::is_whole(self.out, &entry.output, bytes, sha256) {
                Ok(true) => {}
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                _ => {
                    words::warning(&format!(
                        "{output}: has no input any more, but differs from its line in the manifest; it would stay"
                    ));
                    continue;
                }
            }
            self.preview.results.push(PreviewedResult {
                state: PreviewState::Pruned,
                input: entry.input.clone(),
                animation: None,
                output,
                exists: true,
                failed_before: false,
                reason: Some(self.planned.why_orphan(entry).into()),
            });
        }
    }
}
