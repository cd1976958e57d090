//! clap's list of commands, and all that follows from it: the table of the guide, and the tests that run for
//! every command. And the list of the tests' files. `UPDATE_EXPECTED=1 cargo test -p tumble-cli --test all
//! commands::` writes the table and the list anew.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Command, CommandFactory};

/// The commands that help lists.
pub(crate) fn commands() -> Vec<Command> {
    let program = tumble_cli::Arguments::command();
    let listed = program
        .get_subcommands()
        .filter(|command| !command.is_hide_set());
    listed.cloned().collect()
}

/// Sentences of the help are broken where a line is full, and nowhere else, in terminals of any width.
#[test]
fn help_breaks_lines_where_they_are_full() {
    for (command, width) in commands()
        .iter()
        .flat_map(|it| [80, 100, 120].map(|width| (it, width)))
    {
        let mut command = command.clone().term_width(width).max_term_width(width);
        let help = command.render_long_help().to_string();
        // Examples and tables have lines as they are.
        let prose = help.split("\nExamples:").next().unwrap_or_default();
        let prose = prose.split("\nExit codes:").next().unwrap_or_default();
        let lines: Vec<&str> = prose.lines().collect();
        for pair in lines.windows(2) {
            let [line, next] = [pair[0], pair[1]];
            let indent = |line: &str| line.len() - line.trim_start().len();
            let is_item =
                |line: &str| line.trim().is_empty() || line.trim().starts_with(['-', '[']);
            let ends = line.trim_end().ends_with(['.', ':', ')']);
            if is_item(line) || is_item(next) || ends || indent(line) != indent(next) {
                continue;
            }
            let word = next.split_whitespace().next().unwrap_or_default();
            let joined = line.chars().count() + 1 + word.chars().count();
            let name = command.get_name();
            assert!(joined > width, "{name} at {width}: `{line}` | `{next}`");
        }
    }
}

pub(crate) fn named(name: &str) -> Command {
    let mut all = commands().into_iter();
    all.find(|command| command.get_name() == name)
        .expect("a command of this name")
}

/// Whether a command has an option, by the name of its field.
pub(crate) fn has(command: &Command, option: &str) -> bool {
    let mut options = command.get_arguments();
    options.any(|argument| argument.get_id() == option)
}

/// The commands that make a result of each motion file, with a manifest for many, and need nothing else.
pub(crate) fn writing_results() -> Vec<String> {
    let needs_more = |command: &Command| {
        let mut required = command
            .get_arguments()
            .filter(|argument| argument.is_required_set());
        required.any(|argument| argument.get_long().is_some())
    };
    let all = commands()
        .into_iter()
        .filter(|command| !needs_more(command));
    let writing = all.filter(|command| has(command, "files_from") && has(command, "resume"));
    let names: Vec<String> = writing
        .map(|command| command.get_name().to_owned())
        .collect();
    assert!(names.len() >= 4, "{names:?}");
    names
}

/// The README's commands over files of a clone do what it says, in a clone.
#[test]
fn commands_of_the_readme_work_in_a_clone() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("data")).unwrap();
    let sample = "data/pendulum.dat";
    fs::copy(root.join(sample), folder.path().join(sample)).unwrap();
    let text = fs::read_to_string(root.join("README.md")).unwrap();
    let lines = text.lines().filter_map(|line| line.strip_prefix("tumble "));
    let lines: Vec<&str> = lines.filter(|line| line.contains(sample)).collect();
    assert!(lines.len() >= 2, "{lines:?}");
    for line in lines {
        let command = line.split('#').next().unwrap();
        // `--open` would need a browser.
        let command = command.replace("--open", "-o page.html");
        let words: Vec<&str> = command.split_whitespace().collect();
        let run = crate::program::run(folder.path(), &words);
        // Without a Vulkan device, `verify` ends with the exit code 5.
        let is_done = run.code == 0 || words[0] == "verify" && run.code == 5;
        assert!(is_done, "{line}: {}", run.words);
    }
    assert!(folder.path().join("speed.svg").exists());
}

/// A file, its part between two lines, and the expected text of that part.
struct WrittenPart {
    file: PathBuf,
    begin: &'static str,
    end: &'static str,
    expected: String,
}

impl WrittenPart {
    /// Compares the part with the expected text, or writes it.
    fn check(&self) {
        let text = fs::read_to_string(&self.file).unwrap();
        let shown = self.file.display();
        let (before, rest) = text
            .split_once(self.begin)
            .expect("the first line is there");
        let (found, after) = rest.split_once(self.end).expect("the last line is there");
        if std::env::var_os("UPDATE_EXPECTED").is_some() {
            let (begin, end, expected) = (self.begin, self.end, &self.expected);
            fs::write(&self.file, format!("{before}{begin}{expected}{end}{after}")).unwrap();
            return;
        }
        assert_eq!(found, self.expected, "{shown}: UPDATE_EXPECTED=1 writes it");
    }
}

fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_table_of_commands_is_that_of_the_program() {
    let mut table = String::from("| command | what it does |\n|---|---|\n");
    for command in commands() {
        let about = command.get_about().expect("a command says what it does");
        writeln!(table, "| `tumble {}` | {about} |", command.get_name()).unwrap();
    }
    let part = WrittenPart {
        file: here().join("../docs/program.md"),
        begin: "<!-- commands: written by `UPDATE_EXPECTED=1 cargo test -p tumble-cli` -->\n",
        end: "<!-- end of commands -->\n",
        expected: table,
    };
    part.check();
}

/// Each option with its value, its default, its meaning and the commands that have it: a row for each meaning.
#[test]
fn the_table_of_options_is_that_of_the_program() {
    struct OptionRow {
        names: String,
        meaning: String,
        commands: Vec<String>,
    }
    let plain = |text: String| text.replace('|', "\\|").replace('<', "&lt;");
    let mut rows: BTreeMap<String, Vec<OptionRow>> = BTreeMap::new();
    let program = tumble_cli::Arguments::command();
    let all = commands();
    let each = all.iter().map(|command| (command.get_name(), command));
    for (name, command) in each.chain([("every command", &program)]) {
        for option in command.get_arguments() {
            let Some(long) = option.get_long().filter(|_| !option.is_hide_set()) else {
                continue;
            };
            let short = option.get_short();
            let short = short.map_or(String::new(), |letter| format!("`-{letter}` "));
            let visible = option.get_visible_aliases().unwrap_or_default();
            let aliases: String = visible
                .iter()
                .map(|alias| format!(" `--{alias}`"))
                .collect();
            let takes_value = option.get_action().takes_values();
            let value = option.get_value_names().filter(|_| takes_value);
            let value = value.map_or(String::new(), |names| format!(" {}", names.join(" ")));
            let is_shown = takes_value && !option.is_hide_default_value_set();
            let defaults = option.get_default_values().iter().filter(|_| is_shown);
            let defaults: Vec<_> = defaults.map(|value| value.to_string_lossy()).collect();
            let default = match defaults.is_empty() {
                true => String::new(),
                false => format!(" [default: {}]", defaults.join(",")),
            };
            let help = option.get_help().unwrap_or_default();
            let names = plain(format!("{short}`--{long}{value}`{aliases}"));
            let meaning = plain(format!("{help}{default}"));
            let of_name = rows.entry(long.to_owned()).or_default();
            let same = of_name
                .iter_mut()
                .find(|row| row.names == names && row.meaning == meaning);
            match same {
                Some(row) => row.commands.push(name.to_owned()),
                None => of_name.push(OptionRow {
                    names,
                    meaning,
                    commands: vec![name.to_owned()],
                }),
            }
        }
    }
    let mut table = String::from("| option | meaning | commands |\n|---|---|---|\n");
    for row in rows.values().flatten() {
        let commands = row.commands.join(", ");
        writeln!(table, "| {} | {} | {commands} |", row.names, row.meaning).unwrap();
    }
    let part = WrittenPart {
        file: here().join("../docs/options.md"),
        begin: "<!-- options: written by `UPDATE_EXPECTED=1 cargo test -p tumble-cli` -->\n",
        end: "<!-- end of options -->\n",
        expected: table,
    };
    part.check();
}

/// A file of tests that is not in the list would never run.
#[test]
fn every_file_of_tests_is_run() {
    /// Separate programs (`Cargo.toml`), and those that only Unix has.
    const PROGRAMS: [&str; 3] = ["all", "fuzz", "options"];
    const UNIX: [&str; 3] = ["attack", "interface", "remedies"];
    let entries = fs::read_dir(here().join("tests")).unwrap();
    let mut files: Vec<String> = entries
        .filter_map(|entry| {
            let path = entry.unwrap().path();
            let name = path.file_stem()?.to_str()?.to_owned();
            let is_file = path.extension().is_some_and(|ending| ending == "rs");
            let is_listed = is_file || path.join("mod.rs").is_file() && name != "support";
            (is_listed && !PROGRAMS.contains(&&*name)).then_some(name)
        })
        .collect();
    files.sort();
    let mut list = String::new();
    for name in files {
        if UNIX.contains(&&*name) {
            list += "#[cfg(unix)]\n";
        }
        writeln!(list, "mod {name};").unwrap();
    }
    let part = WrittenPart {
        file: here().join("tests/all.rs"),
        begin: "// Written by `UPDATE_EXPECTED=1 cargo test -p tumble-cli --test all commands::`.\n",
        end: "// End of the list.\n",
        expected: list,
    };
    part.check();
}
