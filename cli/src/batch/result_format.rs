//! The format of results: requested, or by the name of the output.

use std::path::Path;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use tumble_formats::format::Format;

use crate::messages::exit::Failure;
use crate::messages::names;

/// The requested format, else that of the path's extension.
pub(crate) fn choose(
    path: &Path,
    format: Option<&'static Format>,
) -> Result<&'static Format, Failure> {
    let named = if names::is_standard(path) {
        Format::writable().next()
    } else {
        of(path)
    };
    format.or(named).ok_or_else(|| {
        let (path, extensions) = (path.display(), extensions(|name| format!(".{name}")));
        let extensions = extensions.join(", ");
        Failure::usage(format!(
            "{path}: end the output in {extensions}, or give --format"
        ))
    })
}

/// The format of results of a file's extension.
pub(crate) fn of(path: &Path) -> Option<&'static Format> {
    Format::of(path).filter(|format| format.is_writable())
}

/// The extensions of results, each as `show` has it.
pub(super) fn extensions(show: impl Fn(&str) -> String) -> Vec<String> {
    Format::writable().map(|format| show(format.name)).collect()
}

/// Reads the name of a format of results, for clap.
pub(crate) fn format() -> impl TypedValueParser<Value = &'static Format> {
    let values =
        Format::writable().map(|format| PossibleValue::new(format.name).help(format.summary));
    PossibleValuesParser::new(values)
        .map(|name| Format::named(&name).expect("clap takes names of the table alone"))
}

/// The help of `--out`.
pub(crate) fn out_help() -> String {
    format!(
        "Where to write: {}, `-` (standard output), or a directory for several inputs",
        extensions(|name| format!("OUT.{name}")).join(", ")
    )
}
