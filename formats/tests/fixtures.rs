//! Every kind of file, good and bad, with the messages about it: the fixtures of all formats (`cases.rs`).

use std::path::Path;

use tumble_formats::{FORMATS, Format, ReadOptions, Severity};

use crate::cases;

/// The text that a user reads: the verdict, then each message.
pub(crate) fn verdict(path: &Path) -> String {
    let folder = path.parent().unwrap();
    let format = Format::of(path).unwrap();
    let read = format.open(path, &ReadOptions::default());
    let mut text = String::new();
    match read {
        Ok(loaded) => {
            for clip in &loaded.clips {
                let (tracks, keys) = (clip.set.track_count(), clip.set.key_count());
                text += &format!("accepted: {tracks} tracks, {keys} keys\n");
            }
            for error in &loaded.refused {
                assert_eq!(error.code.severity(), Severity::Error);
                text += &format!("refused\n{error}\n");
            }
            for warning in &loaded.warnings {
                assert_eq!(warning.code.severity(), Severity::Warning);
                text += &format!("{warning}\n");
            }
        }
        Err(error) => {
            assert_eq!(error.code.severity(), Severity::Error);
            text = format!("refused\n{error}\n");
        }
    }
    // The folder's name is removed with the separator of this system.
    text.replace(&folder.join("").display().to_string(), "")
}

/// Set `UPDATE_EXPECTED=1` to write the verdicts of now into the tables, then read the difference.
#[test]
fn every_fixture_gets_its_verdict_and_message() {
    let mut wrong = Vec::new();
    let mut count = 0;
    for &format in FORMATS {
        let folder = cases::folder(format.name);
        let mut all = cases::read(format.name);
        count += all.len();
        for case in &mut all {
            let found = verdict(&folder.join(&case.name));
            if found != case.expected {
                let (name, expected) = (&case.name, &case.expected);
                wrong.push(format!("{name}:\n{found}expected:\n{expected}"));
            }
            case.expected = found;
        }
        if std::env::var_os("UPDATE_EXPECTED").is_some() {
            cases::write(format.name, &all);
            wrong.clear();
        }
    }
    assert!(count >= 75, "{count} fixtures");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
