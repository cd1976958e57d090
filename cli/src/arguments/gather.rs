//! Which files a command works on: those named, those in directories, those that a
//! pattern matches, and those in a list.

use std::collections::HashSet;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use tumble_formats::Format;
use walkdir::WalkDir;

use crate::arguments::wildcard::{self, is_pattern};
use crate::messages::exit::Failure;
use crate::messages::names;
use crate::messages::words;

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
