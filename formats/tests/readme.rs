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
        let written = match (&format.write, format.writes_clips(), format.holds(Feature::SeveralClips)) {
            (None, false, _) => "no",
            (Some(_), false, _) => "results",
            (Some(_), true, _) => "results, clips",
            (None, true, true) => "clips",
            (None, true, false) => "one clip",
        };
        let (endings, summary) = (endings.join(" "), format.summary);
        writeln!(table, "| {endings} | {summary} | {written} |").unwrap();
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/formats.md");
    let text = fs::read_to_string(&file).unwrap();
    let (before, rest) = text
        .split_once(BEGIN)
        .expect("docs/formats.md has a table of formats");
    let (found, after) = rest.split_once(END).expect("the table of formats ends");
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        fs::write(&file, format!("{before}{BEGIN}{table}{END}{after}")).unwrap();
        return;
    }
    assert_eq!(found, table);
}
