//! The names of options in the stubs of Python's package are those of the engine. (Those of methods are checked where
//! the engine's are, `tests/method_lists.rs`.)
//! `UPDATE_EXPECTED=1 cargo test -p tumble-cli --test all stubs::` writes them, and the options of interpolations into
//! the signatures of stubs and functions.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use tumble::crowd::CrowdValues;
use tumble::paths::{PathFrame, Twist};
use tumble::reduce::ReducedCurve;
use tumble::{
    Axes, Encoding, Ends, InterpolationOption, KeySigns, Layout, MatrixOrder, SmoothingEnds, Speed,
    VectorMethod,
};
use tumble_formats::adjust::UpAxis;
use tumble_formats::end_frame::EndFrame;
use tumble_formats::format::TimeUnit;
use tumble_formats::outside::OutsideValue;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::trajectory::Align;

const BEGIN: &str = "# Names of options: written by `UPDATE_EXPECTED=1 cargo test -p tumble-cli --test all stubs::`\n";
const END: &str = "# End of names.\n";

/// Longer lines are broken, as Python's formatters do it.
const LINE: usize = 100;

/// The names of all values of an option.
macro_rules! names {
    ($type:ident) => {
        $type::ALL.map(|value| value.name()).to_vec()
    };
}

/// A type of each option, and its names.
fn options() -> Vec<(&'static str, Vec<&'static str>)> {
    let rotations = Encoding::kinds().filter(|encoding| encoding.stores_rotations());
    let encodings = rotations.map(Encoding::name).collect();
    vec![
        ("_Align", names!(Align)),
        ("_Axes", [&names!(Axes)[..], &["world"]].concat()),
        ("_Curve", names!(ReducedCurve)),
        ("_Encoding", encodings),
        ("_EndFrame", names!(EndFrame)),
        ("_Frame", names!(PathFrame)),
        ("_Layout", names!(Layout)),
        ("_Major", names!(MatrixOrder)),
        ("_NamedEnds", names!(Ends)),
        ("_Order", names!(ComponentOrder)),
        ("_Outside", names!(OutsideValue)),
        ("_SmoothingEnds", names!(SmoothingEnds)),
        ("_Speed", names!(Speed)),
        ("_TimeUnit", names!(TimeUnit)),
        ("_Twist", names!(Twist)),
        ("_UpAxis", names!(UpAxis)),
        ("_Values", names!(CrowdValues)),
        ("_VectorMethod", names!(VectorMethod)),
        ("_KeySigns", names!(KeySigns)),
    ]
}

#[test]
fn the_names_in_pythons_stubs_are_those_of_the_engine() {
    let mut expected = String::new();
    for (alias, names) in options() {
        let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
        let line = format!("{alias}: TypeAlias = Literal[{}]", quoted.join(", "));
        if line.len() <= LINE {
            writeln!(expected, "{line}").unwrap();
        } else {
            let lines = quoted.join(",\n    ");
            writeln!(expected, "{alias}: TypeAlias = Literal[\n    {lines},\n]").unwrap();
        }
    }
    let stubs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../python/package/tumble/_tumble.pyi");
    let text = fs::read_to_string(&stubs).unwrap();
    let (before, behind) = text.split_once(BEGIN).expect("the stubs have the names");
    let (found, after) = behind.split_once(END).expect("the names end");
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        fs::write(&stubs, format!("{before}{BEGIN}{expected}{END}{after}")).unwrap();
        return;
    }
    assert_eq!(found, expected, "UPDATE_EXPECTED=1 writes the names");
}

/// The type of an option of interpolations in the stubs.
fn type_of(option: &InterpolationOption) -> &'static str {
    match option.name {
        _ if option.is_number => "float",
        "signs" => "_KeySigns",
        "ends" => "_Ends",
        "speed" => "_Speed",
        "before" | "after" => "_Outside",
        name => panic!("say which type the option `{name}` has in the stubs"),
    }
}

/// A text in which each list of options behind the keyword `method` has all of them, and how many lists there are.
fn with_all_options(
    text: &str,
    method: &str,
    keyword: impl Fn(&InterpolationOption) -> String,
) -> (String, usize) {
    let keywords = InterpolationOption::ALL.map(|option| keyword(&option));
    let mut parts = text.split(method);
    let (mut whole, mut lists) = (parts.next().unwrap_or_default().to_owned(), 0);
    for part in parts {
        let mut rest = part;
        while let Some(behind) = keywords.iter().find_map(|it| rest.strip_prefix(&**it)) {
            rest = behind;
        }
        whole += method;
        if rest.len() < part.len() {
            whole += &keywords.concat();
            lists += 1;
        }
        whole += rest;
    }
    (whole, lists)
}

/// Checks a file, or writes it.
fn check_file(file: &Path, found: &str, expected: &str) {
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        fs::write(file, expected).unwrap();
    } else {
        let name = file.display();
        assert!(
            found == expected,
            "{name} lacks an option of interpolations, or has them in another order: UPDATE_EXPECTED=1 writes them"
        );
    }
}

#[test]
fn signatures_in_python_have_the_options_of_interpolations() {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("../python");
    let stubs = python.join("package/tumble/_tumble.pyi");
    let found = fs::read_to_string(&stubs).unwrap();
    let (mut expected, mut in_stubs) = (found.clone(), 0);
    for indent in ["    ", "        "] {
        let keyword = |option: &InterpolationOption| {
            format!(
                "{indent}{}: {} | None = None,\n",
                option.name,
                type_of(option)
            )
        };
        let (text, lists) =
            with_all_options(&expected, "method: _Method | None = None,\n", keyword);
        (expected, in_stubs) = (text, in_stubs + lists);
    }
    check_file(&stubs, &found, &expected);
    let mut in_sources = 0;
    for file in rust_files(&python.join("src")) {
        let found = fs::read_to_string(&file).unwrap();
        let keyword = |option: &InterpolationOption| format!(", {}=None", option.name);
        let (expected, lists) = with_all_options(&found, "method=None", keyword);
        in_sources += lists;
        check_file(&file, &found, &expected);
    }
    assert!(in_stubs > 20 && in_sources > 10, "{in_stubs}, {in_sources}");
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let of_path = |path: PathBuf| match path.is_dir() {
        true => rust_files(&path),
        false => vec![path],
    };
    paths.flat_map(of_path).collect()
}

#[test]
fn a_missing_option_is_found() {
    let keyword = |option: &InterpolationOption| format!(", {}=None", option.name);
    let whole = "(method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, out=None)";
    for removed in [", bias=None", ", ends=None"] {
        let text = whole.replace(removed, "");
        assert_eq!(with_all_options(&text, "method=None", keyword).0, whole);
    }
}
