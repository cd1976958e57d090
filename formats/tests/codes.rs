//! The codes of messages: each is shown by a fixture or a test, and `docs/codes.md` has them all. These tests read
//! the files of all formats.

use std::fs;
use std::path::{Path, PathBuf};

use tumble_formats::{Code, FORMATS, Format};

use crate::cases;
use crate::fixtures::verdict;

/// The files of all formats. Every file whose name ends in the name or extension of a format has a
/// case.
fn fixtures() -> Vec<PathBuf> {
    let mut files = Vec::new();
    for &format in FORMATS {
        let folder = cases::folder(format.name);
        let entries = fs::read_dir(&folder).expect("fixtures of every format");
        let paths = entries.map(|entry| entry.unwrap().path());
        let matching =
            paths.filter(|path| Format::of(path).is_some_and(|of| of.name == format.name));
        let mut matching: Vec<PathBuf> = matching.collect();
        matching.sort();
        let all = cases::read(format.name);
        let named: Vec<PathBuf> = all.iter().map(|case| folder.join(&case.name)).collect();
        assert_eq!(matching, named, "a case for every file, by name");
        files.extend(named);
    }
    files
}

/// The texts of all tests and fixtures, and of the sources, which have unit tests.
fn texts_of_tests() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folders = [
        "formats/tests",
        "cli/tests",
        "python/tests",
        "formats/src",
        "cli/src",
    ];
    let mut pending: Vec<PathBuf> = folders.iter().map(|folder| root.join(folder)).collect();
    let mut texts = Vec::new();
    while let Some(path) = pending.pop() {
        if path.is_dir() {
            let entries = fs::read_dir(&path).unwrap();
            pending.extend(entries.map(|entry| entry.unwrap().path()));
        } else if path
            .extension()
            .is_some_and(|end| end == "rs" || end == "py")
        {
            let text = fs::read_to_string(&path).unwrap();
            let has_tests = !path.components().any(|part| part.as_os_str() == "src");
            let start = match has_tests || path.ends_with("tests.rs") {
                true => Some(0),
                false => text.find("#[cfg(test)]\nmod "),
            };
            texts.extend(start.map(|start| text[start..].to_owned()));
        }
    }
    texts
}

/// Whether a source has a code, by its name or as messages show it.
fn mentions(text: &str, code: Code) -> bool {
    let is_of_name = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    [format!("Code::{code:?}"), code.name().to_owned()]
        .iter()
        .any(|name| {
            let mut found = text.match_indices(name.as_str());
            found.any(|(at, _)| {
                let behind = text.as_bytes().get(at + name.len());
                !behind.is_some_and(|&byte| is_of_name(byte))
            })
        })
}

/// Every code has a fixture that causes it, because no other test shows its message. It takes the files of all formats.
#[test]
fn every_code_of_a_file_is_shown_by_a_fixture_or_a_test() {
    let all: String = fixtures().iter().map(|path| verdict(path)).collect();
    let tests = texts_of_tests();
    for &code in Code::ALL {
        let is_shown = all.contains(&format!("[{code}]"));
        assert_eq!(is_shown, code.has_case(), "{code}: {}", code.title());
        let is_tested = is_shown || tests.iter().any(|text| mentions(text, code));
        assert!(is_tested, "{code}, {}: no test has it", code.title());
        assert_eq!(Code::named(&code.name().to_lowercase()), Some(code));
    }
}

/// `docs/codes.md`: every code, the reason for it, and the message about a file that has it.
/// `UPDATE_EXPECTED=1` writes it.
#[test]
fn the_page_of_codes_is_up_to_date() {
    use std::fmt::Write;

    let messages: Vec<String> = fixtures().iter().map(|path| verdict(path)).collect();
    let mut page = String::from(
        "# Codes\n\nMessages of `tumble` about an input have the form `FILE:LINE:COLUMN: error[CODE]: …`. \
         With a code that begins with `E`, the\ninput is refused. Codes with `W` are warnings, \
         reported once for each file. `tumble explain CODE` prints the same text.\n",
    );
    assert!(Code::ALL.is_sorted_by_key(|code| code.name()));
    for &code in Code::ALL {
        let (title, text) = (code.title(), code.explanation());
        write!(page, "\n## {code}: {title}\n\n{text}\n").unwrap();
        let sign = format!("[{code}]");
        let mut lines = messages.iter().flat_map(|message| message.lines());
        if let Some(line) = lines.find(|line| line.contains(&sign)) {
            write!(page, "\n```text\n{line}\n```\n").unwrap();
        }
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/codes.md");
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        fs::write(&file, &page).unwrap();
    }
    assert_eq!(fs::read_to_string(file).unwrap(), page);
}
