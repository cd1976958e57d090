//! The table of formats in the guide, all of which are read, is the code's.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use tumble_formats::{FORMATS, Feature};

const BEGIN: &str =
    "<!-- formats: written by `UPDATE_EXPECTED=1 cargo test -p tumble-formats` -->\n";
const END: &str = "<!-- end of formats -->\n";

#[test]
fn the_table_of_formats_is_that_of_the_code() {
    let mut table = String::from("| format | what it is | written |\n|---|---|---|\n");
    for format in FORMATS {
        let endings = std::iter::once(&format.name).chain(format.extensions);
        let endings: Vec<String> = endings.map(|ending| format!("`.{ending}`")).collect();
        let written = match (
            &format.write,
            format.writes_clips(),
            format.supports(Feature::SeveralClips),
        ) {
            (None, false, _) => "no",
            (Some(_), false, _) => "results",
            (Some(_), true, _) => "results, clips",
            (None, true, true) => "clips",
            (None, true, false) => "one clip",
        };
        let (endings, summary) = (endings.join(" "), format.summary);
        writeln!(table, "| {endings} | {summary} | {written} |").unwrap();
    }
    update(BEGIN, END, &table);
}

const BEGIN_FEATURES: &str =
    "<!-- features: written by `UPDATE_EXPECTED=1 cargo test -p tumble-formats` -->\n";
const END_FEATURES: &str = "<!-- end of features -->\n";

#[test]
fn the_table_of_what_formats_hold_is_that_of_the_code() {
    let all = FORMATS.into_iter().filter(|format| format.writes_clips());
    let all: Vec<_> = all.collect();
    let mut table = String::from("| |");
    for format in &all {
        write!(table, " {} |", format.name).unwrap();
    }
    writeln!(table, "\n|---|{}", "---|".repeat(all.len())).unwrap();
    for feature in Feature::ALL {
        write!(table, "| {} |", feature.summary()).unwrap();
        for format in &all {
            let cell = if format.supports(feature) {
                "yes"
            } else {
                "–"
            };
            write!(table, " {cell} |").unwrap();
        }
        table.push('\n');
    }
    update(BEGIN_FEATURES, END_FEATURES, &table);
}

/// Compares a table of the page with the code's, or writes it.
fn update(begin: &str, end: &str, table: &str) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/formats.md");
    let text = fs::read_to_string(&file).unwrap();
    let (before, rest) = text
        .split_once(begin)
        .expect("docs/formats.md has the table");
    let (found, after) = rest.split_once(end).expect("the table ends");
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        fs::write(&file, format!("{before}{begin}{table}{end}{after}")).unwrap();
        return;
    }
    assert_eq!(found, table);
}
