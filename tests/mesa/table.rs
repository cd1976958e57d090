//! The tables of `docs/gpu-compilers.md`: the instructions and registers of each kernel on AMD's and NVIDIA's cards.
//! `UPDATE_LISTINGS=1 cargo test --test all mesa::` writes the measured numbers into their cells.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The entry of a table for one kernel on one family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cost {
    /// Instructions for a sample, or for the unit that the table names.
    pub(super) instructions: u64,
    /// Vector registers of an invocation.
    pub(super) registers: u64,
}

/// Several tables are on one page, and are written by tests that run at once.
static PAGE: Mutex<()> = Mutex::new(());

fn page() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/gpu-compilers.md")
}

fn cells(line: &str) -> Vec<&str> {
    let inner = line.trim_matches('|').split('|');
    inner.map(|cell| cell.trim().trim_matches('`')).collect()
}

/// The kernels that a table has. `head` is how the table's first line begins; the families follow in it.
pub(super) fn kernels(head: &str) -> Vec<String> {
    let text = std::fs::read_to_string(page()).unwrap();
    let lines = text
        .lines()
        .skip_while(|line| !line.starts_with(head))
        .skip(2);
    let lines = lines.take_while(|line| line.starts_with('|'));
    lines.map(|line| cells(line)[0].to_owned()).collect()
}

/// Compares a table with the measured numbers, by kernel and family; returns the differences.
pub(super) fn check(head: &str, measured: &BTreeMap<(String, &str), Cost>) -> Vec<String> {
    let _page = PAGE.lock().unwrap_or_else(PoisonError::into_inner);
    let text = std::fs::read_to_string(page()).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let head = lines.iter().position(|line| line.starts_with(head));
    let head = head.expect("docs/gpu-compilers.md has the table");
    let families: Vec<String> = cells(&lines[head])
        .iter()
        .skip(1)
        .map(ToString::to_string)
        .collect();
    let mut wrong = Vec::new();
    let mut rows = 0;
    let rows_after = lines[head + 2..].iter_mut();
    for line in rows_after.take_while(|line| line.starts_with('|')) {
        rows += 1;
        let documented = cells(line);
        let kernel = documented[0].to_owned();
        let mut row = format!("| `{kernel}` |");
        for (family, documented) in families.iter().zip(&documented[1..]) {
            let Some(&found) = measured.get(&(kernel.clone(), family)) else {
                wrong.push(format!(
                    "docs/gpu-compilers.md: there is no {kernel} for {family}"
                ));
                continue;
            };
            row += &format!(" {}, {} |", found.instructions, found.registers);
            if let Some(why) = differs(documented, found) {
                wrong.push(format!(
                    "docs/gpu-compilers.md: {kernel} for {family}: {why}"
                ));
            }
        }
        *line = row;
    }
    assert!(
        rows >= 8,
        "the table of docs/gpu-compilers.md has {rows} rows"
    );
    if std::env::var_os("UPDATE_LISTINGS").is_some() {
        std::fs::write(page(), lines.join("\n") + "\n").unwrap();
        return Vec::new();
    }
    wrong
}

/// Compares the first cells behind the kernel's name in a table with the measured ones, and leaves the others as they
/// are; returns the differences. Another version of the compiler may count a little more or less.
pub(super) fn check_rows(head: &str, measured: &BTreeMap<&str, Vec<String>>) -> Vec<String> {
    let _page = PAGE.lock().unwrap_or_else(PoisonError::into_inner);
    let text = std::fs::read_to_string(page()).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let first = lines.iter().position(|line| line.starts_with(head));
    let first = first.expect("docs/gpu-compilers.md has the table") + 2;
    let (mut wrong, mut rows) = (Vec::new(), 0);
    let rows_of_table = lines[first..].iter_mut();
    for line in rows_of_table.take_while(|line| line.starts_with('|')) {
        rows += 1;
        let documented: Vec<String> = cells(line).iter().map(ToString::to_string).collect();
        let Some(found) = measured.get(&*documented[0]) else {
            wrong.push(format!(
                "docs/gpu-compilers.md: {} is not measured",
                documented[0]
            ));
            continue;
        };
        let (compared, others) = documented[1..].split_at(found.len());
        let is_near = |(a, b): (&String, &String)| match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(a), Ok(b)) => (a - b).abs() <= 1.0 + 0.02 * b,
            _ => a == b,
        };
        if !compared.iter().zip(found).all(is_near) {
            let name = &documented[0];
            wrong.push(format!(
                "docs/gpu-compilers.md: {name} has {compared:?}, not {found:?}"
            ));
        }
        let cells = [&found[..], others].concat().join(" | ");
        *line = format!("| `{}` | {cells} |", documented[0]);
    }
    assert_eq!(rows, measured.len(), "rows of the table {head}");
    if std::env::var_os("UPDATE_LISTINGS").is_some() {
        std::fs::write(page(), lines.join("\n") + "\n").unwrap();
        return Vec::new();
    }
    wrong
}

/// Why a cell of the table differs from the measured number. Another version of the compiler may differ by a
/// little; a bound that is far above the measured number is no use.
fn differs(documented: &str, found: Cost) -> Option<String> {
    let numbers = documented.split_once(", ");
    let numbers = numbers.and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    let Some((instructions, registers)): Option<(u64, u64)> = numbers else {
        return Some(format!("`{documented}` is not instructions and registers"));
    };
    let is_near = |documented: f64, found: f64| {
        (0.9 * documented - 2.0..=1.02 * documented + 1.0).contains(&found)
    };
    let instructions_are_near = is_near(instructions as f64, found.instructions as f64);
    // Registers are allocated by eights.
    let registers_are_near = found.registers.abs_diff(registers) <= 8;
    match instructions_are_near && registers_are_near {
        true => None,
        false => Some(format!(
            "{found:?}, not {documented} (UPDATE_LISTINGS=1 writes what is measured)"
        )),
    }
}

#[test]
fn a_cell_that_is_not_measured_is_refused() {
    let found = Cost {
        instructions: 100,
        registers: 72,
    };
    for documented in ["100, 72", "105, 80", "98, 64"] {
        assert_eq!(differs(documented, found), None);
    }
    for documented in [
        "90, 72", "130, 72", "100, 48", "100, 128", "100", "", "x, y",
    ] {
        assert!(differs(documented, found).is_some(), "{documented}");
    }
}
