//! Searches the table of formats, [`FORMATS`]: for the format with a name, and for the format of a file.

use std::path::Path;

use crate::FORMATS;
use crate::diagnostic::Diagnostic;
use crate::format::{Format, FormatOption, Loaded, ReadOptions};
use crate::pickle;
use crate::source::{START, Source};

impl Format {
    /// The default extension of its files: the one that programs look for, or else the format's name.
    #[must_use]
    pub fn ending(&self) -> &'static str {
        match self.name {
            // Loaders of robots' motions look for `*.pkl`.
            "pickle" => "pkl",
            // The loader of ProtoMotions looks for `*.motion`.
            "torch" => "motion",
            name => name,
        }
    }

    /// The format with this name or extension; case is ignored.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        let has_name = |format: &&Self| {
            let mut names = [format.name]
                .into_iter()
                .chain(format.extensions.iter().copied());
            names.any(|known| known.eq_ignore_ascii_case(name))
        };
        FORMATS.iter().copied().find(has_name)
    }

    /// The format with the extension of this path.
    #[must_use]
    pub fn of(path: &Path) -> Option<&'static Self> {
        Self::named(path.extension()?.to_str()?)
    }

    /// The format of an input with the extension of this path. joblib adds `.gz` to the names of pickles, and these are
    /// read compressed too.
    #[must_use]
    pub fn of_input(path: &Path) -> Option<&'static Self> {
        if !path.extension()?.eq_ignore_ascii_case("gz") {
            return Self::of(path);
        }
        Self::of(Path::new(path.file_stem()?)).filter(|format| pickle::is_pickle(format))
    }

    /// The formats that can be written: first those that store results in parts, then those that store clips only.
    pub fn writable() -> impl Iterator<Item = &'static Self> {
        let as_they_come = FORMATS
            .iter()
            .copied()
            .filter(|format| format.write.is_some());
        let whole = |format: &&Self| format.write.is_none() && format.write_motion.is_some();
        as_they_come.chain(FORMATS.iter().copied().filter(whole))
    }

    /// The names of the formats that support an option, for messages.
    #[must_use]
    pub fn names_taking(option: FormatOption) -> String {
        let all = FORMATS.iter().filter(|format| format.takes(option));
        let names: Vec<&str> = all.map(|format| format.name).collect();
        names.join(", ")
    }

    /// The format of a file that begins with the bytes `start`. It is recognised by these bytes, otherwise by the
    /// extension of `path`, otherwise by the number of numbers in its first line; otherwise it is the first of
    /// [`FORMATS`].
    #[must_use]
    pub fn detect(path: &Path, start: &[u8]) -> &'static Self {
        let probed = FORMATS.iter().copied().find(|format| (format.probe)(start));
        // Most trajectories have the ending `.txt` and no heading, so they are recognised by their numbers.
        let by_numbers = || {
            let width = Some(table_width(start)?);
            let mut all = FORMATS.iter().copied();
            all.find(|format| format.numbers_in_line == width)
        };
        probed
            .or_else(|| Self::of_input(path))
            .or_else(by_numbers)
            .unwrap_or(FORMATS[0])
    }

    /// Reads a file in the format that [`Format::detect`] finds.
    ///
    /// # Errors
    /// When the file cannot be opened or is invalid; the first error is returned.
    pub fn open_detected(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
        Self::detected(path).open(path, options)
    }

    /// Reads the bytes of a file in the format that [`Format::detect`] finds; `name` is the input's name in messages.
    /// Other files that it names are not read.
    ///
    /// # Errors
    /// When the bytes are invalid; the first error is returned.
    pub fn read_detected(
        name: &str,
        bytes: Vec<u8>,
        options: &ReadOptions,
    ) -> Result<Loaded, Diagnostic> {
        if bytes.is_empty() {
            return Err(Diagnostic::empty(name));
        }
        let start = &bytes[..bytes.len().min(START)];
        (Self::detect(Path::new(name), start).read_bytes)(name, bytes, options)
    }

    /// The format of a file, as [`Format::detect`] finds it. For a file that cannot be read, only its name is used;
    /// opening it reports the error.
    #[must_use]
    pub fn detected(path: &Path) -> &'static Self {
        Self::detect(path, &Source::start(path))
    }
}

/// How many numbers the first line of text has that is not a comment; `None` if it has anything else, or if the first
/// line is the header of a `.dat` file.
fn table_width(start: &[u8]) -> Option<usize> {
    let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    // The end of the start may be in the middle of a line, which is ignored.
    let whole = start.iter().rposition(|&byte| byte == b'\n')?;
    let text = std::str::from_utf8(&start[..whole]).ok()?;
    let header = text.lines().next()?.trim_start().strip_prefix('#');
    let mut header = header.into_iter().flat_map(str::split_ascii_whitespace);
    let boxes = header
        .next()
        .is_some_and(|word| word.parse::<usize>().is_ok());
    if boxes
        && header
            .next()
            .is_some_and(|word| word.parse::<f64>().is_ok())
    {
        return None;
    }
    let content = |line: &str| line.split('#').next().unwrap_or_default().replace(',', " ");
    let line = text
        .lines()
        .map(content)
        .find(|line| !line.trim().is_empty())?;
    let mut words = line.split_ascii_whitespace();
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    words.clone().all(is_number).then(|| words.by_ref().count())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_again() {
        for &format in FORMATS {
            assert!(std::ptr::eq(Format::named(format.name).unwrap(), format));
            let shouted = format!("a.b.{}", format.name.to_uppercase());
            assert!(std::ptr::eq(
                Format::of(Path::new(&shouted)).unwrap(),
                format
            ));
        }
        assert!(Format::of(Path::new("walk")).is_none());
        assert_eq!(Format::detect(Path::new("walk"), b"# 4 3.0\n").name, "dat");
        assert_eq!(Format::detect(Path::new("walk"), b"\x93NUMPY").name, "npy");
        for (text, name) in [
            ("1311868164.36 0 0 0 0 0 0 1\n", "tum"),
            ("# a remark\n\n1,0,0,0,0,0,0,1 # here\n2,0", "tum"),
            ("1 0 0 0 0 1 0 0 0 0 1 0\n", "kitti"),
            ("# 2 1.0\n0 1 0 0 0 1 0 0\n", "dat"),
            ("0 1 0 0 0\n", "dat"),
            ("a 0 0 0 0 0 0 1\n", "dat"),
            ("0 0 0 0 0 0 0 1", "dat"),
        ] {
            let found = Format::detect(Path::new("poses.txt"), text.as_bytes());
            assert_eq!(found.name, name, "{text}");
        }
        let gzip = b"\x1f\x8b\x08";
        for (file, name) in [
            ("a.joblib.gz", "pickle"),
            ("a.pkl.GZ", "pickle"),
            ("a.bvh.gz", "dat"),
        ] {
            assert_eq!(Format::detect(Path::new(file), gzip).name, name, "{file}");
        }
        let named = Format::detect(Path::new("a.dat"), b"1 0 0 0 0 0 0 1\n");
        assert_eq!(named.name, "dat");
    }
}
