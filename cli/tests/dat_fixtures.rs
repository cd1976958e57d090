//! What the program says of `.dat` files, good and bad: the fixtures of `formats/tests`.

use std::fs;
use std::path::PathBuf;

use rayon::prelude::{IntoParallelRefIterator, ParallelIterator};

/// As a person meets them: by the program, with its exit code.
#[test]
fn the_program_says_of_every_fixture_what_is_expected() {
    let folder = crate::program::root().join("formats/tests/fixtures/dat");
    let files = fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let files: Vec<PathBuf> = files
        .filter(|path| path.extension().unwrap() == "dat")
        .collect();
    assert!(files.len() >= 75, "{} fixtures", files.len());
    let wrong: Vec<String> = files
        .par_iter()
        .filter_map(|path| {
            let expected = fs::read_to_string(path.with_extension("expected")).unwrap();
            let mut lines = expected.lines();
            let refused = lines.next() == Some("refused");
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            let line = [
                "eval",
                &name,
                // Some begin as files of other formats do.
                "--from",
                "dat",
                "-o",
                "-",
                "--device",
                "cpu",
                "--times",
                "times.txt",
            ];
            let run = crate::program::run(&folder, &line);
            let code = if refused { 4 } else { 0 };
            let said = lines.all(|line| run.words.lines().any(|word| word == line));
            let data = run.out.starts_with(b"\x93NUMPY");
            (run.code != code || !said || data == refused).then(|| {
                format!(
                    "{name}: {}, {}wanted {code}, {expected}",
                    run.code, run.words
                )
            })
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
