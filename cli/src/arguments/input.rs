//! Inputs: which files a command works on (those named, those in directories, those that a pattern matches,
//! and those in a list), and how they are opened and read, and their warnings passed on.

use std::collections::HashSet;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use tumble_formats::format::{Document, FormatOption};
use tumble_formats::motion::Motion;
use tumble_formats::{Code, Diagnostic, Format, Limits, Loaded, ReadOptions};
use walkdir::WalkDir;

use crate::arguments::reading::ReadingArguments;
use crate::arguments::tracks::TrackArguments;
use crate::arguments::wildcard::{self, is_pattern};
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
    /// Read named pipes too
    #[arg(long)]
    pipes: bool,
    /// The largest input to read
    #[arg(long, value_name = "SIZE", default_value = "16GiB", value_parser = words::parse_bytes)]
    max_size: u64,
    /// The memory limit for reading an input, besides the input itself [default: 64 times its length
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
        let gathered = GatheredInputs::new(&self.paths, self.files_from.as_deref())?;
        let paths = gathered.paths();
        self.check_formats(&paths.iter().collect::<Vec<_>>())?;
        Ok(gathered)
    }

    /// Refuses options that apply to none of these inputs.
    pub(crate) fn check_formats(&self, paths: &[&PathBuf]) -> Result<(), Failure> {
        let format = |path: &&PathBuf| match self.reading.from {
            Some(format) => format,
            None => Format::detected(path),
        };
        let formats = || paths.iter().map(format);
        self.reading.check(formats).map_err(Failure::usage)
    }

    /// Whether an input is read with extra keys that follow its curves.
    pub(crate) fn follows_curves(&self, path: &Path) -> bool {
        let format = self.reading.from.unwrap_or_else(|| Format::detected(path));
        format.takes(FormatOption::Keyframes) && !self.reading.reads_file_keys()
    }

    /// The paths that the command line names.
    pub(crate) fn named_paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// As [`Inputs::gather`], the paths alone.
    pub(crate) fn distinct(&self, times_from_stdin: bool) -> Result<Vec<PathBuf>, Failure> {
        Ok(self.gather(times_from_stdin)?.paths())
    }

    /// Reads a keyframe file; its warnings go to standard error.
    pub(crate) fn load(&self, path: &Path) -> Result<Loaded, Failure> {
        let loaded = self.load_quietly(path)?;
        print_warnings(&loaded);
        Ok(loaded)
    }

    /// As [`Inputs::load`], for commands that work on one clip.
    pub(crate) fn load_one(&self, path: &Path) -> Result<OnlyClip, Failure> {
        let mut loaded = self.load(path)?;
        let rest = check_complete(&names::input(path), &loaded);
        match loaded.clips.pop() {
            Some(clip) if loaded.clips.is_empty() => Ok(OnlyClip {
                clip,
                document: loaded.document.filter(|_| !loaded.is_adjusted),
                rest,
            }),
            Some(clip) => {
                loaded.clips.push(clip);
                Err(several_clips_failure(path, &loaded))
            }
            None => Err(no_clips(path)),
        }
    }

    /// As [`Inputs::load`], without printing its warnings.
    pub(crate) fn load_quietly(&self, path: &Path) -> Result<Loaded, Failure> {
        busy(&format!("reading {}", names::input(path)), || {
            self.read(path)
        })
    }

    /// How files are read.
    pub(crate) fn options(&self) -> Result<ReadOptions, Failure> {
        let limits = Limits {
            file: self.max_size,
            memory: self.max_memory,
            ..Limits::default()
        };
        let options = self.reading.options(limits, self.pipes);
        options.map_err(|fault| Failure::input(&fault, ""))
    }

    /// As [`Inputs::load_quietly`], without a progress display.
    pub(crate) fn read(&self, path: &Path) -> Result<Loaded, Failure> {
        let options = self.options()?;
        let refuse = |diagnostic: Diagnostic| {
            let hint = match diagnostic.code {
                Code::FileTooLong => " (--max-size)",
                Code::Memory => " (--max-memory)",
                Code::NotAFile if !self.pipes => " (--pipes reads named pipes)",
                _ => "",
            };
            Failure::input(&diagnostic, hint)
        };
        let read = match self.reading.from {
            Some(format) => format.open(path, &options),
            None => Format::open_detected(path, &options),
        };
        let mut loaded = read.map_err(refuse)?;
        match (loaded.clips.is_empty(), loaded.refused.is_empty()) {
            (true, true) => return Err(no_clips(path)),
            (true, false) => return Err(Failure::parts(&loaded.refused)),
            (false, _) => {}
        }
        self.reading.apply(&mut loaded, path)?;
        Ok(loaded)
    }
}

/// What reads the inputs of a command, on a thread that runs ahead.
pub(crate) trait InputReader: Send + 'static {
    /// Reads an input; its warnings are not printed.
    fn read(&self, path: &Path) -> Result<Loaded, Failure>;

    /// The longest input that it accepts, bytes.
    fn max_size(&self) -> u64;
}

impl InputReader for Inputs {
    fn read(&self, path: &Path) -> Result<Loaded, Failure> {
        self.read(path)
    }

    fn max_size(&self) -> u64 {
        self.max_size
    }
}

/// The clip of a file, for commands that work on one.
pub(crate) struct OnlyClip {
    pub(crate) clip: Motion,
    /// The file, unless the clip was converted to another unit or up axis.
    pub(crate) document: Option<Arc<dyn Document>>,
    /// Fails where other animations of the file were refused: the result is then incomplete.
    pub(crate) rest: Result<(), Failure>,
}

/// Fails where animations of an input were refused; the others are done by then.
pub(crate) fn check_complete(name: &str, loaded: &Loaded) -> Result<(), Failure> {
    let refused: u64 = loaded.refused.iter().map(|fault| fault.count).sum();
    if refused == 0 {
        return Ok(());
    }
    let all = refused + loaded.clips.len() as u64;
    let message = format!("{name}: {refused} of {all} animations failed");
    Err(Failure::new(exit::SOME_INPUTS, message))
}

fn no_clips(path: &Path) -> Failure {
    let message = format!(
        "{}: has no animation that moves anything",
        names::input(path)
    );
    Failure::new(exit::ALL_INPUTS, message)
}

/// Prints the warnings of an input.
pub(crate) fn print_warnings(loaded: &Loaded) {
    for warning in loaded.warnings.iter().chain(&loaded.refused) {
        words::note(&warning.to_string());
    }
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
    /// The command line has a directory, a pattern or a list: there may be any number of files.
    pub(crate) many: bool,
}

/// One input file, and its path below a directory of results.
#[derive(Debug, Clone)]
pub(crate) struct FoundInput {
    pub(crate) path: PathBuf,
    /// Its name, or its path below a directory that the command line names.
    pub(crate) below: PathBuf,
    /// It was found below a directory, rather than named.
    pub(crate) is_from_directory: bool,
}

impl FoundInput {
    /// A file that was named.
    pub(crate) fn named(path: PathBuf, below: PathBuf) -> Self {
        Self {
            path,
            below,
            is_from_directory: false,
        }
    }

    /// The directory that it was met below.
    pub(crate) fn root(&self) -> Option<&Path> {
        let steps = self.below.components().count();
        self.path
            .ancestors()
            .nth(steps)
            .filter(|_| self.is_from_directory)
    }
}

impl GatheredInputs {
    /// Files named on the command line come first, then those of the list.
    pub(crate) fn new(paths: &[PathBuf], list: Option<&Path>) -> Result<Self, Failure> {
        let mut gathered = Self {
            files: Vec::new(),
            many: list.is_some(),
        };
        let listed = list.map_or_else(|| Ok(Vec::new()), read_list)?;
        let mut seen = HashSet::new();
        for path in paths.iter().chain(&listed) {
            for found in gathered.expand(path) {
                // A missing file is reported when it is opened.
                let identity = found.path.canonicalize();
                if seen.insert(identity.unwrap_or_else(|_| found.path.clone())) {
                    gathered.files.push(found);
                } else {
                    let name = names::input(&found.path);
                    words::warning(&format!("{name}: named twice; it is processed once"));
                }
            }
        }
        if gathered.files.is_empty() {
            let list = list.map(names::input).unwrap_or_default();
            return Err(Failure::usage(format!("{list}: lists no files")));
        }
        Ok(gathered)
    }

    pub(crate) fn paths(&self) -> Vec<PathBuf> {
        self.files.iter().map(|found| found.path.clone()).collect()
    }

    fn expand(&mut self, path: &Path) -> Vec<FoundInput> {
        let alone = || {
            let name = path.file_name().unwrap_or(path.as_os_str());
            FoundInput::named(path.to_owned(), name.into())
        };
        if names::is_standard(path) || path.is_file() {
            return vec![alone()];
        }
        let found = if path.is_dir() {
            below(path)
        } else {
            matches(path)
        };
        if found.is_empty() {
            // Opening it reports what is wrong.
            return vec![alone()];
        }
        self.many = true;
        found
    }
}

/// Every file of a format that can be read below a directory, by name. What cannot be looked into is an input
/// too, which fails when it is opened.
fn below(directory: &Path) -> Vec<FoundInput> {
    let walk = WalkDir::new(directory).follow_links(true);
    let mut found = Vec::new();
    for entry in walk.sort_by_file_name() {
        let path = match entry {
            Ok(entry) if entry.file_type().is_dir() => continue,
            Ok(entry) if Format::of(entry.path()).is_some() => entry.into_path(),
            Ok(_) => continue,
            Err(error) => match error.path() {
                Some(path) => path.to_owned(),
                None => continue,
            },
        };
        let below = path.strip_prefix(directory).unwrap_or(&path).to_owned();
        found.push(FoundInput {
            path,
            below,
            is_from_directory: true,
        });
    }
    found
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

/// A path on each line; blank lines and lines that begin with `#` are none.
fn read_list(list: &Path) -> Result<Vec<PathBuf>, Failure> {
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
    let lines = text
        .split(|&byte| byte == b'\n')
        .map(<[u8]>::trim_ascii_end);
    let paths = lines.filter(|line| !line.is_empty() && !line.starts_with(b"#"));
    Ok(paths.map(named).collect())
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
