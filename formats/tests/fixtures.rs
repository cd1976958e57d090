//! Every kind of file, good and bad, with what is reported of it: the fixtures of all formats (`cases.rs`).

use std::fs;
use std::path::{Path, PathBuf};

#[cfg(all(feature = "fbx", feature = "mcap", feature = "parquet"))]
use tumble_formats::Code;
use tumble_formats::{FORMATS, Format, ReadOptions, Severity};

use crate::cases;

/// The files of all formats. Those that end in a format's name or extension all have a case.
fn fixtures() -> Vec<PathBuf> {
    let mut files = Vec::new();
    for format in FORMATS {
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

/// What a user reads: the verdict, then each message.
fn verdict(path: &Path) -> String {
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
    text.replace(&format!("{}/", folder.display()), "")
}

/// Set `UPDATE_EXPECTED=1` to write the verdicts of now into the tables, then read the difference.
#[test]
fn every_fixture_gets_its_verdict_and_message() {
    let mut wrong = Vec::new();
    let mut count = 0;
    for format in FORMATS {
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

/// A code that no fixture shows is a code that nobody has seen. It takes the files of all formats.
#[cfg(all(feature = "fbx", feature = "mcap", feature = "parquet"))]
#[test]
fn every_code_of_a_file_is_shown_by_a_fixture_or_a_test() {
    let all: String = fixtures().iter().map(|path| verdict(path)).collect();
    // Those that need a system's fault, an option or a size that no fixture has, and those of
    // writing; each has a test.
    let elsewhere = [
        Code::Open,
        Code::NotAFile,
        Code::Changed,
        Code::LineTooLong,
        Code::FileTooLong,
        Code::Time,
        Code::NothingToAnimate,
        Code::NotTrees,
        Code::TimesInF32,
        Code::TimesBelowZero,
        Code::GlbTooLong,
        Code::BvhWrite,
        Code::TumWrite,
        Code::Path,
        Code::PathTimes,
        Code::NameChanged,
        Code::NoRoom,
        Code::StaysWhole,
        Code::KittiPose,
        Code::FrameTimes,
        Code::NoRotation,
        Code::Mesh,
        Code::Net,
        Code::Pairs,
        Code::Walkers,
        Code::Offsets,
        Code::StartMoved,
        Code::GltfFolder,
        Code::StaysOutside,
        Code::Map,
        Code::OneClip,
        Code::Layout,
        Code::NotPerFrame,
        Code::LeftOut,
        Code::ListLength,
        Code::SeveralClips,
        Code::RateBesideTimes,
        Code::AccelerationJumps,
        Code::Bridged,
        Code::BodyModel,
        Code::FbxDepth,
        Code::FbxWork,
    ];
    for &code in Code::ALL {
        let shown = all.contains(&format!("[{code}]"));
        assert!(
            shown != elsewhere.contains(&code),
            "{code}: {}",
            code.title()
        );
        assert_eq!(Code::named(&code.name().to_lowercase()), Some(code));
    }
}

/// `docs/codes.md`: every code, why, and what is said of a file that has it.
/// `UPDATE_EXPECTED=1` writes it.
#[cfg(all(feature = "fbx", feature = "mcap", feature = "parquet"))]
#[test]
fn the_page_of_codes_is_up_to_date() {
    use std::fmt::Write;

    let messages: Vec<String> = fixtures().iter().map(|path| verdict(path)).collect();
    let mut page = String::from(
        "# Codes\n\nWhat `tumble` says of its inputs, as `FILE:LINE:COLUMN: error[CODE]: …`. \
         Codes with `E` refuse an\ninput, those with `W` are warnings, reported once for each file. \
         `tumble explain CODE` says the same.\n",
    );
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
