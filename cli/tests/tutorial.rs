//! The pages with commands and what these print: the commands run in a clone, one after another, and print that.
//! `UPDATE_EXPECTED=1 cargo test -p tumble-cli --test all tutorial::` writes what they print.
#![cfg(unix)]

use std::fs;
use std::path::Path;

use crate::program::{self, root};

/// A text whose durations, such as `in 2.6 ms`, are left out: they differ from run to run.
fn without_durations(text: &str) -> String {
    let lines = text.lines().map(|line| {
        let mut words: Vec<&str> = line.split(' ').collect();
        for i in 2..words.len() {
            let is_number = words[i - 1].parse::<f64>().is_ok();
            let is_unit = ["ns", "µs", "ms", "s"].contains(&words[i]);
            if words[i - 2] == "in" && is_number && is_unit {
                words[i - 1] = "";
                words[i] = "a while";
            }
        }
        words.join(" ") + "\n"
    });
    lines.collect()
}

/// Copies the files of a clone that the pages use.
fn copy_data(folder: &Path) {
    fs::create_dir(folder.join("data")).unwrap();
    let files = fs::read_dir(root().join("data")).unwrap();
    let mut files: Vec<_> = files.map(|entry| entry.unwrap().file_name()).collect();
    files.sort();
    for name in files {
        let file = Path::new("data").join(name);
        fs::copy(root().join(&file), folder.join(&file)).unwrap();
    }
}

/// Runs the commands of a page, of which there are at least so many.
fn check(page: &str, least: usize) {
    let page = root().join(page);
    let text = fs::read_to_string(&page).unwrap();
    let folder = tempfile::tempdir().unwrap();
    copy_data(folder.path());
    let (mut written, mut commands, mut is_console) = (String::new(), 0, false);
    for line in text.lines() {
        let is_fence = line.starts_with("```");
        if is_fence {
            is_console = line == "```console";
        }
        let command = line.strip_prefix("$ tumble ").filter(|_| is_console);
        if is_fence || !is_console || command.is_some() {
            written.push_str(line);
            written.push('\n');
        }
        let Some(command) = command else {
            continue;
        };
        commands += 1;
        let words = command.split_whitespace();
        let words: Vec<&str> = words.map(|word| word.trim_matches('\'')).collect();
        let run = program::run(folder.path(), &words);
        let printed = String::from_utf8(run.out).unwrap() + &run.words;
        // The tutorial also shows what happens to a file that exists.
        let is_error = printed.starts_with("error: ");
        assert_eq!(run.code != 0, is_error, "{line}: {printed}");
        for line in printed.lines() {
            written.push_str(line.trim_end());
            written.push('\n');
        }
    }
    assert!(commands >= least, "only {commands} commands were found");
    let (found, expected) = (without_durations(&written), without_durations(&text));
    if found != expected && std::env::var_os("UPDATE_EXPECTED").is_some() {
        fs::write(&page, written).unwrap();
        return;
    }
    assert_eq!(found, expected, "UPDATE_EXPECTED=1 writes what is printed");
}

#[test]
fn the_commands_of_the_tutorial_print_what_it_says() {
    check("docs/tutorial.md", 20);
}

#[test]
fn the_first_steps_of_each_kind_of_user_print_what_the_page_says() {
    check("docs/start.md", 10);
}
