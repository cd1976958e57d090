//! The names of options in the stubs of Python's package are those of the engine. (Those of methods are checked where
//! the engine's are, `tests/method_lists.rs`.)
//! `UPDATE_EXPECTED=1 cargo test -p tumble-cli --test all stubs::` writes them.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use tumble::crowd::CrowdValues;
use tumble::paths::{PathFrame, Twist};
use tumble::reduce::ReducedCurve;
use tumble::{
    Axes, Encoding, Ends, KeySigns, Layout, MatrixOrder, SmoothingEnds, Speed, VectorMethod,
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
        ("_Way", names!(KeySigns)),
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
