//! Inputs: which files a command works on (those named, those in directories, those that a pattern matches,
//! and those in a list), and how they are opened and read, and their warnings passed on.

use std::cell::Cell;
use std::collections::{BTreeSet, HashMap};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use tumble_formats::format::{Document, FormatOption};
use tumble_formats::motion::Motion;
use tumble_formats::printable::printable;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::{
    Code, Diagnostic, FORMATS, Feature, Format, Limits, Loaded, ReadOptions, file_kind,
};
use walkdir::WalkDir;

use crate::arguments::reading::ReadingArguments;
use crate::arguments::tracks::TrackArguments;
use crate::arguments::wildcard::{self, PathPattern, is_pattern};
use crate::batch::entry::{self, InputEntry};
use crate::messages::exit::{self, Failure};
use crate::messages::progress::busy;
use crate::messages::{names, words};

/// The inputs of a command, and limits on them.
#[derive(Debug, Clone, Args)]
pub(crate) struct Inputs {
    /// Keyframe files, directories of them, or patterns such as 'walks/*.dat' (`-`: standard input)
    #[arg(required_unless_present = "files_from", value_name = "INPUT")]
    paths: Vec<PathBuf>,
    /// Also the inputs in a text file, one a line (`-`: standard input)
    #[arg(long, value_name = "LIST")]
    files_from: Option<PathBuf>,
    /// With --files-from: the inputs in the list end in NUL characters, as `find -print0` writes them, instead of line ends
    #[arg(short = '0', long, requires = "files_from")]
    null: bool,
    /// Leave out files and folders whose names match a pattern, such as '*_draft.bvh', or a part of a path such
    /// as 'takes/old'; may be given several times
    #[arg(long, value_name = "PATTERN", value_parser = PathPattern::new)]
    exclude: Vec<PathPattern>,
    /// Read named pipes too
    #[arg(long)]
    pipes: bool,
    /// The largest input to read
    #[arg(long, value_name = "SIZE", default_value = "16GiB", value_parser = words::parse_bytes)]
    max_size: u64,
    /// The memory limit for reading an input, not counting the input itself [default: 64 times its length
    /// plus 64MiB]
    #[arg(long, value_name = "SIZE", value_parser = words::parse_bytes)]
    max_memory: Option<u64>,
    #[command(flatten)]
    pub(crate) reading: ReadingArguments,
    #[command(flatten)]
    pub(crate) tracks: TrackArguments,
}

impl Inputs {
    /// The inputs without repetitions, each of which earns a warning. Standard input can be read only once.
    pub(crate) fn gather(&self, times_from_stdin: bool) -> Result<GatheredInputs, Failure> {
        self.gather_with(times_from_stdin, Repeats::Once)
    }

    /// The paths of the inputs, with repetitions: if an input is named twice, the command compares it with itself.
    pub(crate) fn with_repeats(&self) -> Result<Vec<PathBuf>, Failure> {
        Ok(self.gather_with(false, Repeats::Keep)?.paths())
    }

    fn gather_with(
        &self,
        times_from_stdin: bool,
        repeats: Repeats,
    ) -> Result<GatheredInputs, Failure> {
        let uses = [
            (times_from_stdin, "the times"),
            (
                self.files_from.as_deref().is_some_and(names::is_standard),
                "the list of inputs",
            ),
        ];
        let readers: Vec<&str> = uses.iter().filter(|t| t.0).map(|t| t.1).collect();
        let keys = self.paths.iter().any(|path| names::is_standard(path));
        if readers.len() + usize::from(keys) > 1 {
            let all = readers.iter().copied().chain(keys.then_some("the keys"));
            let all = all.collect::<Vec<_>>().join(" and ");
            return Err(Failure::usage(format!(
                "standard input cannot be both {all}; put one in a file"
            )));
        }
        let selection = InputSelection {
            repeats,
            ..self.selection()
        };
        let gathered = GatheredInputs::new(&self.paths, &selection)?;
        let paths = gathered.paths();
        self.check_formats(&paths.iter().collect::<Vec<_>>())?;
        // Read the robot's file now, so that its warnings belong to the command and not to the input that a thread
        // reads first.
        self.reading.robot()?;
        Ok(gathered)
    }

    /// Refuses options that apply to none of these inputs.
    pub(crate) fn check_formats(&self, paths: &[&PathBuf]) -> Result<(), Failure> {
        let formats = || paths.iter().map(|path| self.format(path));
        self.reading.check(formats).map_err(Failure::usage)
    }

    /// The inputs of a library, with the options that select some of them.
    pub(crate) fn gather_library(&self, library: &Path) -> Result<GatheredInputs, Failure> {
        let selection = InputSelection {
            list: None,
            ..self.selection()
        };
        GatheredInputs::new(&[library.to_owned()], &selection)
    }

    /// Whether `--exclude` leaves out a file of this path below the library.
    pub(crate) fn excludes(&self, path: &Path) -> bool {
        self.selection().excludes(path)
    }

    fn selection(&self) -> InputSelection<'_> {
        InputSelection {
            list: self.files_from.as_deref(),
            is_null_separated: self.null,
            exclude: &self.exclude,
            pipes: self.pipes,
            repeats: Repeats::Once,
        }
    }

    /// The same inputs, read with another order of quaternions' components. The robot is read before, so that its
    /// warnings are printed once.
    pub(crate) fn with_source_order(&self, order: ComponentOrder) -> Result<Self, Failure> {
        self.reading.robot()?;
        Ok(Self {
            reading: self.reading.with_source_order(order),
            ..self.clone()
        })
    }

    /// The format in which an input is read.
    pub(crate) fn format(&self, path: &Path) -> &'static Format {
        self.reading.from.unwrap_or_else(|| Format::detected(path))
    }

    /// Whether an input is read with extra keys that follow its curves.
    pub(crate) fn follows_curves(&self, path: &Path) -> bool {
        self.format(path).takes(FormatOption::Keyframes) && !self.reading.reads_file_keys()
    }

    /// Whether there is a list of inputs.
    pub(crate) fn has_list(&self) -> bool {
        self.files_from.is_some()
    }

    /// The paths that the command line names.
    pub(crate) fn named_paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// As [`Inputs::gather`], but only the paths.
    pub(crate) fn distinct(&self, times_from_stdin: bool) -> Result<Vec<PathBuf>, Failure> {
        Ok(self.gather(times_from_stdin)?.paths())
    }

    /// Reads a keyframe file, and prints its warnings.
    pub(crate) fn load(&self, path: &Path) -> Result<Loaded, Failure> {
        let loaded = self.load_quietly(path)?;
        loaded.warnings.iter().cloned().for_each(words::warn_of);
        words::print_kept(&loaded.refused);
        Ok(loaded)
    }

    /// As [`Inputs::load`], for commands that work on one clip.
    pub(crate) fn load_one(&self, path: &Path) -> Result<OnlyClip, Failure> {
        let mut loaded = self.load(path)?;
        let rest = check_complete(&names::input(path), &loaded);
        match loaded.clips.pop() {
            Some(clip) if loaded.clips.is_empty() => Ok(OnlyClip {
                clip,
                document: loaded.document_in_place(),
                rest,
            }),
            Some(clip) => {
                loaded.clips.push(clip);
                Err(several_clips_failure(path, &loaded))
            }
            None => Err(no_clips(path)),
        }
    }

    /// As [`Inputs::load`], without warning.
    pub(crate) fn load_quietly(&self, path: &Path) -> Result<Loaded, Failure> {
        busy(&format!("reading {}", names::input(path)), || {
            self.read(path)
        })
    }

    pub(crate) fn limits(&self) -> Limits {
        Limits {
            file: self.max_size,
            memory: self.max_memory,
            ..Limits::default()
        }
    }

    /// How files are read.
    pub(crate) fn options(&self) -> Result<ReadOptions, Failure> {
        let options = self.reading.options(self.limits(), self.pipes);
        options.map_err(|fault| Failure::input(&fault, ""))
    }

    /// The failure of an input that is not read, with the option that may help.
    pub(crate) fn refused(&self, diagnostic: &Diagnostic) -> Failure {
        let hint = match diagnostic.code {
            Code::FileTooLong => " (--max-size)",
            Code::Memory => " (--max-memory)",
            Code::NotAFile if !self.pipes => " (--pipes reads named pipes)",
            _ => "",
        };
        Failure::input(diagnostic, hint)
    }

    /// As [`Inputs::load_quietly`], without a progress display.
    pub(crate) fn read(&self, path: &Path) -> Result<Loaded, Failure> {
        let options = self.options()?;
        if path.is_dir() {
            return Err(directory_failure(path));
        }
        let read = self.format(path).open(path, &options);
        let mut loaded = read.map_err(|error| self.refused(&error))?;
        match (loaded.clips.is_empty(), loaded.refused.is_empty()) {
            (true, true) => return Err(no_clips(path)),
            (true, false) => return Err(Failure::parts(&loaded.refused)),
            (false, _) => {}
        }
        self.reading.apply(&mut loaded, path)?;
        Ok(loaded)
    }
}

/// Reads the inputs of a command, on a thread that runs ahead.
pub(crate) trait InputReader: Send + 'static {
    /// Reads an input; its warnings are not printed.
    fn read(&self, path: &Path) -> Result<Loaded, Failure>;

    /// The limits within which it reads.
    fn limits(&self) -> Limits;

    /// Whether an input may have several clips, by its format.
    fn may_have_several_clips(&self, _path: &Path) -> bool {
        false
    }
}

impl InputReader for Inputs {
    fn read(&self, path: &Path) -> Result<Loaded, Failure> {
        self.read(path)
    }

    fn limits(&self) -> Limits {
        self.limits()
    }

    fn may_have_several_clips(&self, path: &Path) -> bool {
        self.format(path).supports(Feature::SeveralClips)
    }
}

/// The clip of a file, for commands that work on one.
pub(crate) struct OnlyClip {
    pub(crate) clip: Motion,
    /// The file, unless the clip was converted to another unit or up axis.
    pub(crate) document: Option<Arc<dyn Document>>,
    /// An error if other animations of the file were refused: the result is then incomplete.
    pub(crate) rest: Result<(), Failure>,
}

/// Returns an error if animations of an input were refused. It is called when the work on the other animations is done.
pub(crate) fn check_complete(name: &str, loaded: &Loaded) -> Result<(), Failure> {
    let refused: u64 = loaded.refused.iter().map(|fault| fault.count).sum();
    if refused == 0 {
        return Ok(());
    }
    let all = refused + loaded.clips.len() as u64;
    let message = format!("{name}: {refused} of {all} animations failed");
    let causes = loaded.refused.iter().map(ToString::to_string).collect();
    Err(Failure::new(exit::SOME_INPUTS, message).with_causes(causes))
}

fn no_clips(path: &Path) -> Failure {
    let message = format!(
        "{}: has no animation that moves anything",
        names::input(path)
    );
    Failure::new(exit::ALL_INPUTS, message)
}

/// The failure of a directory that no files were found in.
pub(crate) fn directory_failure(path: &Path) -> Failure {
    let refuse = |code, message: String| {
        Failure::input(
            &Diagnostic::new(path.display().to_string(), code, message),
            "",
        )
    };
    if let Err(error) = std::fs::read_dir(path) {
        let message = format!("is a directory that cannot be read: {error}");
        return refuse(Code::Open, message);
    }
    let mut endings: Vec<&str> = FORMATS.iter().map(|format| format.name).collect();
    endings.sort_unstable();
    let message = format!(
        "is a directory without files in readable formats ({}); if its files have other endings, name them",
        endings.join(", ")
    );
    refuse(Code::NotAFile, message)
}

/// The failure of a command that works on one clip for a file with several.
pub(crate) fn several_clips_failure(path: &Path, loaded: &Loaded) -> Failure {
    let (name, names) = (names::input(path), names::clips(loaded));
    Failure::new(
        exit::ALL_INPUTS,
        format!("{name}: has several animations, {names}; choose one with --animation"),
    )
}

/// Files to work on, in order, each once.
pub(crate) struct GatheredInputs {
    pub(crate) files: Vec<FoundInput>,
    /// Whether the command line has a directory, a pattern or a list, so that there may be any number of files.
    pub(crate) many: bool,
    /// Skipped entries of directories that are named like inputs: pipes, sockets, links in a circle.
    pub(crate) skipped: Vec<InputEntry>,
    /// Other files of directories.
    unread: UnreadFiles,
}

/// The files of directories whose names are not those of inputs.
#[derive(Default)]
struct UnreadFiles {
    count: usize,
    /// The endings of their names, `""` for none.
    endings: BTreeSet<String>,
}

impl UnreadFiles {
    /// The most endings that are listed.
    const MAX_LISTED: usize = 6;

    fn add(&mut self, path: &Path) {
        let name = path.file_name().unwrap_or_default();
        // In a directory of results, the manifest is not an input.
        if name == entry::NAME {
            return;
        }
        self.count += 1;
        let ending = path.extension().unwrap_or_default().to_string_lossy();
        self.endings.insert(ending.into_owned());
    }

    /// `5 files are not read because of their endings (.bak, .txt, none); name one on the command line to read it, or to
    /// see why it cannot be read`.
    fn note(&self) {
        if self.count == 0 {
            return;
        }
        let shown = |ending: &String| match &**ending {
            "" => "none".to_owned(),
            ending => format!(".{}", printable(ending)),
        };
        let listed = self.endings.iter().take(Self::MAX_LISTED).map(shown);
        let mut listed: Vec<String> = listed.collect();
        if self.endings.len() > listed.len() {
            listed.push("…".to_owned());
        }
        let (are, their, one) = match self.count {
            1 => ("is", "its ending", "it"),
            _ => ("are", "their endings", "one"),
        };
        words::note(&format!(
            "{} {are} not read because of {their} ({}); name {one} on the command line to read it, or to see why it \
             cannot be read",
            words::count(self.count, "file"),
            listed.join(", ")
        ));
    }
}

/// Which inputs are meant, besides those that are named.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct InputSelection<'a> {
    /// A file that lists more of them.
    pub(crate) list: Option<&'a Path>,
    pub(crate) is_null_separated: bool,
    pub(crate) exclude: &'a [PathPattern],
    /// Whether named pipes in directories are inputs.
    pub(crate) pipes: bool,
    pub(crate) repeats: Repeats,
}

/// How inputs that are named several times are processed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Repeats {
    /// They are processed once, with a warning.
    #[default]
    Once,
    /// A file is an input as often as it is named.
    Keep,
}

impl InputSelection<'_> {
    fn excludes(&self, path: &Path) -> bool {
        self.exclude.iter().any(|pattern| pattern.matches(path))
    }
}

/// The patterns of `--exclude`, and which of them have left something out.
struct Exclusions<'a> {
    patterns: &'a [PathPattern],
    has_matched: Vec<Cell<bool>>,
}

impl<'a> Exclusions<'a> {
    fn new(patterns: &'a [PathPattern]) -> Self {
        Self {
            patterns,
            has_matched: vec![Cell::new(false); patterns.len()],
        }
    }

    /// Whether a file or a folder is left out.
    fn contain(&self, path: &Path) -> bool {
        let mut is_excluded = false;
        for (pattern, has_matched) in self.patterns.iter().zip(&self.has_matched) {
            if pattern.matches(path) {
                has_matched.set(true);
                is_excluded = true;
            }
        }
        is_excluded
    }

    /// Warns of patterns that leave nothing out: they may be misspelt.
    fn warn(&self) {
        let unused = self.patterns.iter().zip(&self.has_matched);
        for (pattern, _) in unused.filter(|(_, has_matched)| !has_matched.get()) {
            words::warning(&format!(
                "--exclude '{}' leaves nothing out: no name of a file or a folder matches it",
                printable(pattern.text())
            ));
        }
    }
}

/// A path that the command line or a list of inputs names.
struct NamedPath<'a> {
    path: &'a Path,
    is_listed: bool,
}

/// The inputs that a path stands for.
#[derive(Default)]
struct Expansion {
    found: Vec<FoundInput>,
    /// The number of inputs that `--exclude` leaves out. The files of a directory count only if none of them is left.
    excluded: usize,
    /// Whether the path is a pattern that no file matches.
    is_unmatched: bool,
}

/// One input file, and its path below a directory of results.
#[derive(Debug, Clone)]
pub(crate) struct FoundInput {
    pub(crate) path: PathBuf,
    /// Its name, or its path below a directory that the command line names.
    pub(crate) below: PathBuf,
    /// The directory that it was found below, rather than named.
    pub(crate) root: Option<Arc<Path>>,
}

impl FoundInput {
    /// A file that was named.
    pub(crate) fn named(path: PathBuf, below: PathBuf) -> Self {
        Self {
            path,
            below,
            root: None,
        }
    }

    /// The same input, with a result at the same path below the directory of results as the input has below `base`.
    ///
    /// # Errors
    /// When it does not lie below `base`.
    pub(crate) fn below(mut self, base: &Path) -> Result<Self, Failure> {
        let relative = |path: &Path, base: &Path| path.strip_prefix(base).ok().map(Path::to_owned);
        let real = || {
            let parent = self.path.parent().filter(|parent| *parent != Path::new(""));
            let parent = parent.unwrap_or(Path::new(".")).canonicalize().ok()?;
            let path = parent.join(self.path.file_name()?);
            relative(&path, &base.canonicalize().ok()?)
        };
        let is_plain = |path: &PathBuf| plain(path).as_ref() == Some(path);
        let below = relative(&self.path, base).filter(is_plain).or_else(real);
        self.below = below.ok_or_else(|| {
            let (name, base) = (names::input(&self.path), base.display());
            Failure::usage(format!(
                "{name}: is not below --base {base}; give a directory that has all inputs"
            ))
        })?;
        Ok(self)
    }
}

impl FoundInput {
    /// Whether the file is a symbolic link, or a directory above it is, up to the directory that the command line
    /// names.
    fn is_below_link(&self) -> bool {
        let root = self.root.as_deref();
        let mut above = self.path.ancestors();
        let above = above
            .by_ref()
            .take_while(|path| root != Some(path) && *path != Path::new(""));
        let mut above = above.map(std::fs::symlink_metadata);
        above.any(|found| found.is_ok_and(|found| found.is_symlink()))
    }
}

impl GatheredInputs {
    /// Files that were named.
    pub(crate) fn of(files: Vec<FoundInput>) -> Self {
        Self {
            files,
            many: true,
            skipped: Vec::new(),
            unread: UnreadFiles::default(),
        }
    }

    /// Files named on the command line come first, then those of the list.
    pub(crate) fn new(paths: &[PathBuf], selection: &InputSelection<'_>) -> Result<Self, Failure> {
        let mut gathered = Self {
            files: Vec::new(),
            many: selection.list.is_some(),
            skipped: Vec::new(),
            unread: UnreadFiles::default(),
        };
        let listed = selection.list.map_or_else(
            || Ok(Vec::new()),
            |list| read_list(list, selection.is_null_separated),
        )?;
        // The index in `files` of each file, by its path without links.
        let mut seen: HashMap<PathBuf, usize> = HashMap::new();
        let mut repeated: Vec<(usize, FoundInput)> = Vec::new();
        let mut excluded = 0;
        let mut unmatched: Vec<String> = Vec::new();
        let exclusions = Exclusions::new(selection.exclude);
        let named = paths.iter().map(|path| NamedPath {
            path,
            is_listed: false,
        });
        let listed = listed.iter().map(|path| NamedPath {
            path,
            is_listed: true,
        });
        for NamedPath { path, is_listed } in named.chain(listed) {
            let expansion = gathered.expand(path, selection, &exclusions);
            excluded += expansion.excluded;
            if expansion.is_unmatched {
                unmatched.push(names::input(path));
            }
            for mut found in expansion.found {
                // The results of a list have the same directory tree as the list.
                if is_listed && let Some(below) = plain(&found.path) {
                    found.below = below;
                }
                // A missing file is reported when it is opened.
                let identity = found.path.canonicalize();
                let identity = identity.unwrap_or_else(|_| found.path.clone());
                let may_repeat =
                    selection.repeats == Repeats::Keep && !names::is_standard(&found.path);
                match seen.get(&identity) {
                    Some(&first) if !may_repeat => repeated.push((first, found)),
                    _ => {
                        seen.entry(identity).or_insert(gathered.files.len());
                        gathered.files.push(found);
                    }
                }
            }
        }
        // Said here, because a command checks its output before it opens its inputs.
        if !unmatched.is_empty() && unmatched.len() >= gathered.files.len() {
            let message = format!("{}: no file matches this pattern", unmatched.join(", "));
            return Err(Failure::new(exit::ALL_INPUTS, message));
        }
        gathered.settle(repeated);
        gathered.unread.note();
        exclusions.warn();
        for skipped in &gathered.skipped {
            let message = skipped.message.as_deref().unwrap_or_default();
            words::note(&format!("{}: {message}", printable(&skipped.input)));
        }
        if gathered.files.is_empty() {
            return Err(Failure::usage(match (excluded, selection.list) {
                (0, list) => format!(
                    "{}: lists no files",
                    list.map(names::input).unwrap_or_default()
                ),
                _ => {
                    let all = words::count(excluded, "input");
                    format!("--exclude leaves out all inputs ({all}); is the pattern too wide?")
                }
            }));
        }
        Ok(gathered)
    }

    /// For each file that was found several times, in any order, keeps the path without symbolic links, and warns about
    /// the other paths.
    fn settle(&mut self, repeated: Vec<(usize, FoundInput)>) {
        const LISTED: usize = 3;
        let count = repeated.len();
        for (index, (first, mut found)) in repeated.into_iter().enumerate() {
            let kept = &mut self.files[first];
            if kept.is_below_link() && !found.is_below_link() {
                std::mem::swap(kept, &mut found);
            }
            if index < LISTED {
                let [name, kept] = [&found.path, &kept.path].map(|path| names::input(path));
                words::warning(&match name == kept {
                    true => format!(
                        "{name}: named twice (by itself, a directory or a pattern); it is processed once"
                    ),
                    false => {
                        format!("{name}: is the same file as {kept}, and is processed once")
                    }
                });
            }
        }
        if count > LISTED {
            let more = words::count(count - LISTED, "more path");
            words::warning(&format!("{more} of files that are processed once"));
        }
    }

    pub(crate) fn paths(&self) -> Vec<PathBuf> {
        self.files.iter().map(|found| found.path.clone()).collect()
    }

    /// The inputs that a path stands for. Exclusions are compared with the path as written for files that are named or
    /// match a pattern, and with the path below the directory for files in directories.
    fn expand(
        &mut self,
        path: &Path,
        selection: &InputSelection<'_>,
        exclusions: &Exclusions<'_>,
    ) -> Expansion {
        let alone = || {
            let name = path.file_name().unwrap_or(path.as_os_str());
            vec![FoundInput::named(path.to_owned(), name.into())]
        };
        if names::is_standard(path) {
            return Expansion {
                found: alone(),
                ..Expansion::default()
            };
        }
        if path.is_dir() {
            let found = self.below(path, selection, exclusions);
            let excluded = match found.is_empty() {
                true => count_inputs(path, selection),
                false => 0,
            };
            if found.is_empty() && excluded == 0 {
                // The error is reported when the file is opened.
                return Expansion {
                    found: alone(),
                    ..Expansion::default()
                };
            }
            self.many = true;
            return Expansion {
                found,
                excluded,
                is_unmatched: false,
            };
        }
        let matching = match path.is_file() {
            true => Vec::new(),
            false => matches(path),
        };
        self.many |= !matching.is_empty();
        let is_unmatched =
            matching.is_empty() && !path.exists() && path.to_str().is_some_and(is_pattern);
        // A file that does not exist is reported when it is opened.
        let all = match matching.is_empty() {
            true => alone(),
            false => matching,
        };
        let count = all.len();
        let left = all
            .into_iter()
            .filter(|found| !exclusions.contain(&found.path));
        let found: Vec<FoundInput> = left.collect();
        Expansion {
            excluded: count - found.len(),
            is_unmatched: is_unmatched && !found.is_empty(),
            found,
        }
    }

    /// Every file of a format that can be read below a directory, by name. A directory that cannot be listed is an
    /// input too, which fails when it is opened.
    fn below(
        &mut self,
        directory: &Path,
        selection: &InputSelection<'_>,
        exclusions: &Exclusions<'_>,
    ) -> Vec<FoundInput> {
        let root: Arc<Path> = directory.into();
        let relative = |path: &Path| path.strip_prefix(directory).unwrap_or(path).to_owned();
        let walk = WalkDir::new(directory)
            .follow_links(true)
            .sort_by_file_name();
        let walk = walk.into_iter().filter_entry(|entry| {
            entry.depth() == 0 || !exclusions.contain(&relative(entry.path()))
        });
        let mut found = Vec::new();
        for entry in walk {
            let is_input = match &entry {
                Ok(entry) if entry.file_type().is_dir() => continue,
                Ok(entry) if Format::of_input(entry.path()).is_none() => {
                    self.unread.add(entry.path());
                    continue;
                }
                Ok(entry) if entry.file_type().is_file() => Ok(()),
                Ok(entry) => {
                    let kind = entry
                        .metadata()
                        .map_or("no file", |found| file_kind(&found));
                    match kind {
                        "a named pipe" if selection.pipes => Ok(()),
                        "a named pipe" => Err(format!("is {kind}; skipped (--pipes reads it)")),
                        _ => Err(format!("is {kind}; skipped")),
                    }
                }
                Err(error) => match unreadable(error) {
                    UnreadableEntry::Input => Ok(()),
                    UnreadableEntry::Skipped(why) => Err(why),
                    UnreadableEntry::Other => continue,
                },
            };
            let path = match &entry {
                Ok(entry) => entry.path(),
                Err(error) => error.path().unwrap_or(directory),
            };
            match is_input {
                Ok(()) => found.push(FoundInput {
                    path: path.to_owned(),
                    below: relative(path),
                    root: Some(Arc::clone(&root)),
                }),
                Err(why) => self.skipped.push(InputEntry::skipped(path, why)),
            }
        }
        found
    }
}

/// The number of inputs below a directory, for the message that `--exclude` leaves out all of them.
fn count_inputs(directory: &Path, selection: &InputSelection<'_>) -> usize {
    if selection.exclude.is_empty() {
        return 0;
    }
    let walk = WalkDir::new(directory).follow_links(true).into_iter();
    let is_input = |entry: &walkdir::DirEntry| {
        entry.file_type().is_file() && Format::of_input(entry.path()).is_some()
    };
    walk.flatten().filter(is_input).count()
}

/// Directories and links that a walk could not read.
enum UnreadableEntry {
    /// It is an input, which fails.
    Input,
    /// It leads to nothing new; with the reason.
    Skipped(String),
    /// An entry that could not be an input.
    Other,
}

fn unreadable(error: &walkdir::Error) -> UnreadableEntry {
    if let Some(ancestor) = error.loop_ancestor() {
        let ancestor = ancestor.display();
        return UnreadableEntry::Skipped(format!(
            "is a link to {ancestor}, the directory that contains it; not followed"
        ));
    }
    let Some(path) = error.path() else {
        return UnreadableEntry::Other;
    };
    let is_link = path
        .symlink_metadata()
        .is_ok_and(|found| found.is_symlink());
    match error.io_error().map(io::Error::kind) {
        Some(io::ErrorKind::NotFound) if is_link && Format::of_input(path).is_none() => {
            UnreadableEntry::Other
        }
        Some(io::ErrorKind::NotFound | io::ErrorKind::PermissionDenied) | None => {
            UnreadableEntry::Input
        }
        // Two links that lead to each other.
        Some(_) if is_link => {
            UnreadableEntry::Skipped("is a link in a circle of links; not followed".to_owned())
        }
        Some(_) => UnreadableEntry::Input,
    }
}

/// The path without `.`; `None` if it is absolute or has `..`, so that it does not stay below a directory.
fn plain(path: &Path) -> Option<PathBuf> {
    let mut plain = PathBuf::new();
    for component in path.components() {
        match component {
            Component::Normal(name) => plain.push(name),
            Component::CurDir => {}
            _ => return None,
        }
    }
    Some(plain)
}

/// The files that a pattern matches: shells expand patterns, but not in lists, not in
/// quotes, and not on every system.
fn matches(pattern: &Path) -> Vec<FoundInput> {
    let Some(text) = pattern.to_str().filter(|text| is_pattern(text)) else {
        return Vec::new();
    };
    let files = wildcard::paths(text).into_iter();
    let files = files.filter(|path| path.is_file());
    files
        .map(|path| {
            let below = path.file_name().unwrap_or(path.as_os_str()).into();
            FoundInput::named(path, below)
        })
        .collect()
}

/// The paths in a list: one on each line, without blank lines and lines that begin with `#`; or each ended by a NUL
/// character.
fn read_list(list: &Path, is_null_separated: bool) -> Result<Vec<PathBuf>, Failure> {
    let read = if names::is_standard(list) {
        let mut text = Vec::new();
        io::stdin().read_to_end(&mut text).map(|_| text)
    } else {
        std::fs::read(list)
    };
    let text = read.map_err(|error| {
        let name = names::input(list);
        Failure::new(
            crate::messages::exit::ALL_INPUTS,
            format!("{name}: the list cannot be read: {error}"),
        )
    })?;
    if is_null_separated {
        let paths = text.split(|&byte| byte == 0);
        return Ok(paths.filter(|path| !path.is_empty()).map(named).collect());
    }
    // Editors of Windows begin a file with a byte-order mark.
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
    let lines = text
        .split(|&byte| byte == b'\n')
        .map(<[u8]>::trim_ascii_end);
    let lines = lines.filter(|line| !line.is_empty());
    let (comments, paths): (Vec<&[u8]>, Vec<&[u8]>) =
        lines.partition(|line| line.starts_with(b"#"));
    // A list that was written by `ls` may contain names of files that begin with `#`.
    let files = comments.iter().filter(|line| named(line).exists()).count();
    if files > 0 {
        let lines = words::count(files, "line");
        words::warning(&format!(
            "{}: {lines} that begin with `#` are comments, though files of these names exist; write ./#… for them",
            names::input(list)
        ));
    }
    Ok(paths.into_iter().map(named).collect())
}

/// The path of these bytes: names of files need be not UTF-8.
#[cfg(unix)]
fn named(bytes: &[u8]) -> PathBuf {
    use std::os::unix::ffi::OsStrExt;
    std::ffi::OsStr::from_bytes(bytes).into()
}

#[cfg(not(unix))]
fn named(bytes: &[u8]) -> PathBuf {
    String::from_utf8_lossy(bytes).into_owned().into()
}
