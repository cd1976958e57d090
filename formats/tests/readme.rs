//! The tables of formats in the guide are the code's.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::sync::Mutex;

use tumble_formats::dialect::DIALECTS;
use tumble_formats::dialect::write::WRITTEN;
use tumble_formats::surface::SurfaceKind;
use tumble_formats::{FORMATS, Feature, PATHS, SURFACES};

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
            (Some(_), true, true) => "results, clips",
            (Some(_), true, false) => "results, one clip",
            (None, true, true) => "clips",
            (None, true, false) => "one clip",
        };
        let (endings, summary) = (endings.join(" "), format.summary);
        writeln!(table, "| {endings} | {summary} | {written} |").unwrap();
    }
    update("formats.md", "formats", &table);
}

#[test]
fn the_table_of_what_formats_hold_is_that_of_the_code() {
    let all = FORMATS.iter().filter(|format| format.writes_clips());
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
    update("formats.md", "features", &table);
}

#[test]
fn the_table_of_surfaces_is_that_of_the_code() {
    let mut table = String::from("| file | kind | what is read |\n|---|---|---|\n");
    for format in SURFACES {
        let endings: Vec<String> = format.endings().map(|it| format!("`.{it}`")).collect();
        let kind = match format.kind {
            SurfaceKind::Mesh => "mesh",
            SurfaceKind::Net => "net",
        };
        let (endings, summary) = (endings.join(" "), format.summary);
        writeln!(table, "| {endings} | {kind} | {summary} |").unwrap();
    }
    update("routes.md", "surfaces", &table);
}

#[test]
fn the_table_of_paths_is_that_of_the_code() {
    let mut table = String::from("| format | what it is |\n|---|---|\n");
    for format in PATHS {
        writeln!(
            table,
            "| {} | {} |",
            format.name.to_uppercase(),
            format.summary
        )
        .unwrap();
    }
    update("paths.md", "paths", &table);
}

#[test]
fn the_table_of_dialects_is_that_of_the_code() {
    let mut table = String::from("| dialect | arrays |\n|---|---|\n");
    for dialect in DIALECTS {
        writeln!(table, "| {} | {} |", dialect.name, dialect.summary).unwrap();
    }
    update("robots.md", "dialects", &table);
    let mut table = String::from(
        "| dialect | what is written | bodies and joints | rate |\n|---|---|---|---|\n",
    );
    for dialect in WRITTEN {
        let rate = match dialect.assumed_rate {
            Some(rate) => format!("none; readers take {rate}"),
            None if dialect.has_whole_rate => "whole".to_owned(),
            None => "any".to_owned(),
        };
        writeln!(
            table,
            "| {} | {} | {} | {rate} |",
            dialect.name, dialect.summary, dialect.order
        )
        .unwrap();
    }
    update("robots.md", "written dialects", &table);
}

/// Compares a table of a page of `docs/` with the code's, or writes it.
fn update(page: &str, name: &str, table: &str) {
    static WRITING: Mutex<()> = Mutex::new(());
    let _one = WRITING.lock();
    let begin =
        format!("<!-- {name}: written by `UPDATE_EXPECTED=1 cargo test -p tumble-formats` -->\n");
    let end = format!("<!-- end of {name} -->\n");
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../docs")
        .join(page);
    let text = fs::read_to_string(&file).unwrap();
    let (before, rest) = text.split_once(&begin).expect("the page has the table");
    let (found, after) = rest.split_once(&end).expect("the table ends");
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        fs::write(&file, format!("{before}{begin}{table}{end}{after}")).unwrap();
        return;
    }
    assert_eq!(found, table);
}
