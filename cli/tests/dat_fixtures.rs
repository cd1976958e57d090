//! The program's verdicts on `.dat` files, good and bad: the fixtures of `formats/tests`.

use std::fs;

use rayon::prelude::{IntoParallelRefIterator, ParallelIterator};

use crate::cases;

/// The messages and the exit code of the program, as a user sees them.
#[test]
fn the_program_says_of_every_fixture_what_is_expected() {
    let temporary = tempfile::tempdir().unwrap();
    let times = temporary.path().join("times.txt");
    fs::write(&times, "0\n").unwrap();
    let folder = cases::folder("dat");
    let all = cases::read("dat");
    assert!(all.len() >= 75, "{} fixtures", all.len());
    let wrong: Vec<String> = all
        .par_iter()
        .filter_map(|case| {
            let (name, expected) = (&case.name, &case.expected);
            let mut lines = expected.lines();
            let refused = lines.next() == Some("refused");
            let line = [
                "eval",
                name,
                // Without it, some of them would be recognised as files of other formats.
                "--from",
                "dat",
                "-o",
                "-",
                "--device",
                "cpu",
                "--times",
                times.to_str().unwrap(),
            ];
            let run = crate::program::run(&folder, &line);
            let code = if refused { 4 } else { 0 };
            let said = lines.all(|line| run.words.lines().any(|word| word == line));
            let data = run.out.starts_with(b"\x93NUMPY");
            (run.code != code || !said || data == refused).then(|| {
                format!(
                    "{name}: {}, {}expected {code}, {expected}",
                    run.code, run.words
                )
            })
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
