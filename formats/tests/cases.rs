//! The fixtures: a table for each format, `tests/fixtures/FORMAT.cases`, with files and the messages about each:
//!
//! ```text
//! === NAME
//! the lines of the file
//! --- expected
//! the verdict, then each message
//! ```
//!
//! In the lines of a file `\\` is a backslash, `\xHH` a byte, and `\` at the end of a line takes its line end away.
//! `=== NAME (file)` has no lines: the file lies in `tests/fixtures/FORMAT/`, as binary ones do, and those that
//! other packages' tests read.
#![allow(dead_code)] // each test program uses some of it

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

pub(crate) struct Case {
    pub(crate) name: String,
    /// The lines of the file, with escapes; `None` for a file beside the table.
    pub(crate) lines: Option<String>,
    pub(crate) expected: String,
}

/// The folder of the tables, from the tests of any package.
fn tables() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../formats/tests/fixtures")
}

fn table(format: &str) -> PathBuf {
    tables().join(format!("{format}.cases"))
}

/// The cases of a format, in the order of their names.
pub(crate) fn read(format: &str) -> Vec<Case> {
    let text = fs::read_to_string(table(format)).expect("every format has a table");
    let mut cases: Vec<Case> = Vec::new();
    let mut is_expected = false;
    for line in text.split_inclusive('\n') {
        if let Some(title) = line.strip_prefix("=== ") {
            let title = title.trim_end();
            let file = title.strip_suffix(" (file)");
            cases.push(Case {
                name: file.unwrap_or(title).to_owned(),
                lines: file.is_none().then(String::new),
                expected: String::new(),
            });
            is_expected = false;
            continue;
        }
        if line == "--- expected\n" {
            is_expected = true;
            continue;
        }
        let case = cases.last_mut().expect("a table begins with `=== NAME`");
        let section = if is_expected {
            Some(&mut case.expected)
        } else {
            case.lines.as_mut()
        };
        *section.unwrap_or_else(|| panic!("{}: a file has no lines here", case.name)) += line;
    }
    cases
}

/// Writes a format's table.
pub(crate) fn write(format: &str, cases: &[Case]) {
    let mut text = String::new();
    for case in cases {
        let (name, expected) = (&case.name, &case.expected);
        text += &match &case.lines {
            Some(lines) => format!("=== {name}\n{lines}--- expected\n{expected}"),
            None => format!("=== {name} (file)\n--- expected\n{expected}"),
        };
    }
    fs::write(table(format), text).unwrap();
}

/// A folder with the file of every case of a format, and with other files that those refer to.
pub(crate) fn folder(format: &str) -> PathBuf {
    static FOLDERS: Mutex<BTreeMap<String, PathBuf>> = Mutex::new(BTreeMap::new());
    let mut folders = FOLDERS.lock().expect("no table was malformed");
    let entry = folders.entry(format.to_owned());
    entry.or_insert_with(|| extracted(format)).clone()
}

/// Writes the files of a format into a folder whose name changes with the table.
fn extracted(format: &str) -> PathBuf {
    let text = fs::read(table(format)).expect("every format has a table");
    // FNV-1a.
    let hash = text.iter().fold(0xcbf2_9ce4_8422_2325, |hash: u64, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join(format!("fixtures-{hash:016x}"))
        .join(format);
    fs::create_dir_all(&folder).unwrap();
    let files = fs::read_dir(tables().join(format));
    let files = files.into_iter().flatten().map(|file| file.unwrap().path());
    for file in files.filter(|file| file.is_file()) {
        let path = folder.join(file.file_name().unwrap());
        put(&path, &fs::read(&file).unwrap());
    }
    for case in read(format) {
        if let Some(lines) = &case.lines {
            put(&folder.join(&case.name), &unescaped(lines));
        }
    }
    folder
}

/// Other processes may write the same file at the same time: it appears when it is whole.
fn put(path: &Path, bytes: &[u8]) {
    if fs::read(path).is_ok_and(|found| found == bytes) {
        return;
    }
    let beside = path.parent().and_then(Path::parent).unwrap();
    let mut file = tempfile::NamedTempFile::new_in(beside).unwrap();
    file.write_all(bytes).unwrap();
    file.persist(path).unwrap();
}

fn unescaped(lines: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(lines.len());
    let mut rest = lines;
    while let Some((text, escape)) = rest.split_once('\\') {
        bytes.extend_from_slice(text.as_bytes());
        let length = match escape.as_bytes().first() {
            Some(b'\n') => 1,
            Some(b'\\') => {
                bytes.push(b'\\');
                1
            }
            Some(b'x') => {
                bytes.push(u8::from_str_radix(&escape[1..3], 16).unwrap());
                3
            }
            _ => panic!("an unknown escape: \\{escape}"),
        };
        rest = &escape[length..];
    }
    bytes.extend_from_slice(rest.as_bytes());
    bytes
}
