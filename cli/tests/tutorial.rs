//! The pages with commands and what these print: the commands run in a clone, one after another, and print that.
//! `UPDATE_EXPECTED=1 cargo test -p tumble-cli --test all tutorial::` writes what they print.
#![cfg(unix)]

use std::fs;
use std::io::BufReader;
use std::path::Path;

use tempfile::TempDir;

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
    for directory in ["data", "docs/retarget"] {
        fs::create_dir_all(folder.join(directory)).unwrap();
        let files = fs::read_dir(root().join(directory)).unwrap();
        let mut files: Vec<_> = files.map(|entry| entry.unwrap().file_name()).collect();
        files.sort();
        // The commands make the pictures.
        for name in files
            .iter()
            .filter(|name| !name.to_string_lossy().ends_with(".png"))
        {
            let file = Path::new(directory).join(name);
            fs::copy(root().join(&file), folder.join(&file)).unwrap();
        }
    }
}

/// Runs the commands of a page, of which there are at least so many; gives the folder with what they made.
fn check(page: &str, least: usize) -> TempDir {
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
        return folder;
    }
    assert_eq!(found, expected, "UPDATE_EXPECTED=1 writes what is printed");
    folder
}

/// The size and the colours of a picture.
fn pixels(path: &Path) -> (png::OutputInfo, Vec<u8>) {
    let file = BufReader::new(fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    (info, bytes)
}

#[test]
fn the_commands_of_the_tutorial_print_what_it_says() {
    check("docs/tutorial.md", 20);
}

#[test]
fn the_first_steps_of_each_kind_of_user_print_what_the_page_says() {
    check("docs/start.md", 10);
}

/// The pictures of motions on other skeletons are those that the commands under them make.
#[test]
fn the_pictures_of_retargeting_are_those_of_the_commands() {
    let folder = check("docs/retarget.md", 6);
    for name in ["vrm", "mixamo", "smpl"] {
        let picture = format!("docs/retarget/{name}.png");
        let [made, kept] = [folder.path(), &root()].map(|folder| folder.join(&picture));
        if std::env::var_os("UPDATE_EXPECTED").is_some() {
            fs::copy(&made, &kept).unwrap();
        }
        let ((info, made), (expected, kept)) = (pixels(&made), pixels(&kept));
        assert_eq!(info, expected, "{picture}");
        // Edges may be a pixel further on other processors.
        let others = made
            .iter()
            .zip(&kept)
            .filter(|(one, other)| one.abs_diff(**other) > 8);
        let others = others.count();
        assert!(
            others * 200 < kept.len(),
            "{picture}: {others} of {} differ",
            kept.len()
        );
    }
}

/// The plots of the gallery are those that the commands under them make.
#[test]
fn the_plots_of_the_gallery_are_those_of_the_commands() {
    let page = fs::read_to_string(root().join("docs/gallery.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    copy_data(folder.path());
    let mut plots = 0;
    for command in page.lines().filter_map(|line| line.strip_prefix("tumble ")) {
        let Some(picture) = command
            .split(" -o ")
            .nth(1)
            .filter(|it| it.ends_with(".svg"))
        else {
            continue;
        };
        let words: Vec<&str> = command.split_whitespace().collect();
        program::succeed(folder.path(), &words);
        let [made, kept] = [folder.path(), &root()].map(|folder| folder.join(picture));
        if std::env::var_os("UPDATE_EXPECTED").is_some() {
            fs::copy(&made, &kept).unwrap();
        }
        let [made, kept] = [made, kept].map(|path| fs::read_to_string(path).unwrap());
        assert!(made == kept, "{picture}: UPDATE_EXPECTED=1 writes it");
        plots += 1;
    }
    assert_eq!(plots, 3);
}
