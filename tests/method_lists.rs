//! The lists of methods besides `METHODS`: the table of the guide, that of the errors, and the names in the
//! Python package's stubs. `UPDATE_EXPECTED=1 cargo test -p tumble --test all -- method_lists accuracy motion`
//! writes them.

use std::fs;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use tumble::{METHODS, Method};

const GUIDE: &str = "docs/methods.md";
const ERRORS: &str = "docs/accuracy.md";
const STUBS: &str = "python/package/tumble/_tumble.pyi";

/// Tests run beside each other, and several write one file.
static FILES: Mutex<()> = Mutex::new(());

fn path(file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(file)
}

fn is_update() -> bool {
    std::env::var_os("UPDATE_EXPECTED").is_some()
}

/// Replaces what stands behind `start` in a file, up to `end`, or compares it.
fn assert_list(file: &str, [start, end]: [&str; 2], expected: &str) {
    let _lock = FILES.lock().unwrap_or_else(PoisonError::into_inner);
    let text = fs::read_to_string(path(file)).unwrap();
    let (before, behind) = text.split_once(start).expect(start);
    let (found, after) = behind.split_once(end).expect(end);
    if is_update() {
        let text = [before, start, expected, end, after].concat();
        fs::write(path(file), text).unwrap();
    } else {
        assert_eq!(
            found, expected,
            "{file} lists other methods: UPDATE_EXPECTED=1 writes it"
        );
    }
}

#[test]
fn the_guide_has_every_method() {
    let rows = METHODS.map(|method| {
        let through = match method.interpolates {
            true => "yes",
            false => "no, near them",
        };
        let (name, smoothness, summary) = (method.name, method.smoothness(), method.summary);
        let vectors = method.vector_method.name();
        format!("| `{name}` | {through} | {smoothness} | `{vectors}` | {summary} |")
    });
    let head = "| method | through its keys | continuity | positions, scalars | use |\n|---|---|---|---|---|\n";
    assert_list(GUIDE, [head, "\n\n"], &rows.join("\n"));
}

/// A reader finds a method by its name.
#[test]
fn every_method_has_its_file() {
    for method in METHODS {
        let file = format!("src/method/{}.rs", method.name.replace('-', "_"));
        assert!(path(&file).exists(), "{file}");
    }
}

#[test]
fn the_stubs_have_every_method() {
    let mut names = METHODS.map(|method| method.name).to_vec();
    names.push("authored");
    names.sort_unstable();
    let lines = names.iter().map(|name| format!("    \"{name}\",\n"));
    let lines: String = lines.collect();
    assert_list(STUBS, ["_Method: TypeAlias = Literal[\n", "]"], &lines);
}

/// The columns of the table of errors.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Column {
    Largest,
    Hostile,
    Rms,
    Norm,
    Velocity,
    Acceleration,
}

const COLUMNS: usize = 6;

/// Compares an error with the one that the table states, which is the largest that any test finds; writes
/// it if it is larger, where files are to be written.
pub(crate) fn assert_stated(method: Method, column: Column, error: f64) {
    let _lock = FILES.lock().unwrap_or_else(PoisonError::into_inner);
    let text = fs::read_to_string(path(ERRORS)).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let row_of = |method: Method| format!("| `{}` |", method.name);
    let is_row = |line: &String, method| line.starts_with(&row_of(method));
    let row = lines.iter().position(|line| is_row(line, method));
    let mut cells = row.map_or_else(
        || vec!["0".to_owned(); COLUMNS],
        |row| {
            let cells = lines[row]
                .split('|')
                .skip(2)
                .map(|cell| cell.trim().to_owned());
            cells.take(COLUMNS).collect()
        },
    );
    // In as many digits as the table has.
    let rounded: f64 = format!("{error:.1e}").parse().unwrap();
    let stated: f64 = cells[column as usize].parse().unwrap();
    if row.is_some() && rounded <= stated {
        return;
    }
    assert!(
        is_update(),
        "{ERRORS} states {stated:e} for {method}, {column:?}, and it is {error:e}: UPDATE_EXPECTED=1 writes it"
    );
    cells[column as usize] = format!("{error:.1e}");
    let line = format!("{} {} |", row_of(method), cells.join(" | "));
    if let Some(row) = row {
        lines[row] = line;
    } else {
        // Behind the row of the method before it.
        let before = METHODS.into_iter().take_while(|&other| other != method);
        let rows: Vec<Method> = before.collect();
        let last = lines
            .iter()
            .rposition(|line| rows.iter().any(|&method| is_row(line, method)));
        lines.insert(last.expect("a row of another method") + 1, line);
    }
    fs::write(path(ERRORS), lines.join("\n") + "\n").unwrap();
}
