//! How much the program says, and what it would do: `--quiet`, `--progress`, `--dry-run`, `--color`, `--threads`,
//! manual pages.

use std::fs;

use crate::program::{Run, run, sample_folder, succeed};

fn text(run: &Run) -> &str {
    std::str::from_utf8(&run.out).unwrap()
}

fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

#[test]
fn quiet_commands_print_errors_alone() {
    let folder = sample_folder();
    let run_of = |more: &str| {
        let line = format!("eval a.dat bad.dat -o out --overwrite {more}");
        run(folder.path(), &words(&line))
    };
    let (loud, quiet) = (run_of(""), run_of("--quiet"));
    assert_eq!((loud.code, quiet.code), (3, 3));
    assert!(loud.words.contains("1 result made"), "{}", loud.words);
    assert!(!quiet.words.contains("made"), "{}", quiet.words);
    assert!(quiet.words.contains("bad.dat"), "{}", quiet.words);
    // Manifests have everything.
    let manifest = fs::read_to_string(folder.path().join("out/manifest.jsonl")).unwrap();
    assert!(manifest.contains("bad.dat"), "{manifest}");
    assert!(!manifest.contains("quiet"), "{manifest}");
}

#[test]
fn supervisors_read_the_progress_as_json() {
    let folder = sample_folder();
    let line = "eval a.dat b.dat -o out --quiet --progress json";
    let run = succeed(folder.path(), &words(line));
    let last = run.words.lines().last().unwrap();
    let last: serde_json::Value = serde_json::from_str(last).unwrap();
    let bytes: u64 = ["a.npy", "b.npy"]
        .iter()
        .map(|name| fs::metadata(folder.path().join("out").join(name)).unwrap().len())
        .sum();
    assert_eq!(last["progress"], "inputs");
    assert_eq!(last["done"], 2);
    assert_eq!(last["total"], 2);
    assert_eq!(last["failed"], 0);
    assert_eq!(last["bytes"], bytes);
    assert_eq!(last["seconds_left"], 0.0);
}

#[test]
fn a_dry_run_lists_results_and_writes_none() {
    let folder = sample_folder();
    let run_of = |line: &str| succeed(folder.path(), &words(line));
    let run = run_of("eval a.dat b.dat -o out --to csv --dry-run");
    assert_eq!(text(&run), "a.dat → out/a.csv\nb.dat → out/b.csv\n");
    assert!(run.words.contains("2 results would be made; nothing was written"));
    assert!(!folder.path().join("out").exists());
    run_of("eval a.dat -o out/ --to csv");
    let before = fs::read(folder.path().join("out/manifest.jsonl")).unwrap();
    let run = run_of("convert a.dat b.dat -o out --to csv -n --overwrite --json");
    let planned: serde_json::Value = serde_json::from_slice(&run.out).unwrap();
    assert_eq!(planned[0]["state"], "planned");
    assert_eq!(planned[0]["exists"], true);
    assert_eq!(planned[1]["output"], "out/b.csv");
    assert_eq!(planned[1]["exists"], false);
    let run = run_of("eval a.dat b.dat -o out --to csv -n --resume");
    assert!(
        text(&run).starts_with("a.dat → out/a.csv (exists; made again if"),
        "{}",
        text(&run)
    );
    assert_eq!(fs::read(folder.path().join("out/manifest.jsonl")).unwrap(), before);
    assert!(!folder.path().join("out/b.csv").exists());
    // As without it: a file is not replaced.
    let run = crate::program::run(folder.path(), &words("eval a.dat b.dat -o out --to csv -n"));
    assert_eq!(run.code, 3);
    assert!(run.words.contains("--overwrite"), "{}", run.words);
}

#[test]
fn colours_and_threads_are_chosen() {
    let folder = sample_folder();
    let coloured = |when: &str| {
        let line = format!("eval a.dat -o old.npy --color {when}");
        let run = run(folder.path(), &words(&line));
        run.words.contains('\u{1b}')
    };
    assert!(coloured("always"));
    assert!(!coloured("auto") && !coloured("never"));
    let bits = |threads: &str| {
        let file = format!("{threads}.npy");
        succeed(folder.path(), &["eval", "a.dat", "-o", &file, "-j", threads]);
        fs::read(folder.path().join(file)).unwrap()
    };
    assert_eq!(bits("1"), bits("3"));
    assert_eq!(run(folder.path(), &["eval", "a.dat", "-j", "0"]).code, 2);
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = sample_folder();
    let page = |words: &[&str]| text(&succeed(folder.path(), words)).to_owned();
    assert!(page(&["man"]).contains(".TH tumble 1"), "{}", page(&["man"]));
    for command in crate::commands::commands() {
        let name = command.get_name();
        let page = page(&["man", name]);
        assert!(page.contains(&format!(".TH tumble-{name} 1")), "{page}");
    }
    let run = run(folder.path(), &["man", "evil"]);
    assert_eq!(run.code, 2);
    assert!(run.words.contains("did you mean eval?"), "{}", run.words);
}
