//! Names of the values of keywords, and the messages about names that there are not.

use std::borrow::Cow;
use std::str::FromStr;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyString;
use tumble::UnknownNameError;
use tumble_cli::host;

use crate::errors::input;

/// The message about a name that is not in the list of the known ones: `refusal`, the list, and the name that was
/// probably meant.
pub(crate) fn unknown_name(refusal: &str, name: &str, known: &[&str]) -> String {
    let similar = host::nearest_name(name, known.iter().copied());
    let hint = similar.map(|similar| format!("; did you mean `{similar}`?"));
    let list = known.join(", ");
    format!("{refusal}; there are {list}{}", hint.unwrap_or_default())
}

/// Like [`unknown_name`], for the value of a keyword.
pub(crate) fn unknown_value(keyword: &str, name: &str, known: &[&str]) -> PyErr {
    let refusal = format!("{keyword}: there is no `{name}`");
    input(unknown_name(&refusal, name, known))
}

/// The value of an option of the engine that is called `name`; messages call the keyword `keyword`.
pub(crate) fn option_named<T: FromStr<Err = UnknownNameError>>(
    name: &str,
    keyword: &str,
) -> PyResult<T> {
    name.parse()
        .map_err(|error: UnknownNameError| unknown_value(keyword, name, &error.known))
}

/// Like [`option_named`], for a Python object.
pub(crate) fn option_of<T: FromStr<Err = UnknownNameError>>(
    value: &Bound<'_, PyAny>,
    keyword: &str,
) -> PyResult<T> {
    option_named(&text(value, keyword)?, keyword)
}

/// The value with this name.
pub(crate) fn one_of<T: Copy>(
    value: &Bound<'_, PyAny>,
    keyword: &str,
    known: &[(&str, T)],
) -> PyResult<T> {
    let name = text(value, keyword)?;
    let found = known.iter().find(|(known_name, _)| **known_name == *name);
    found.map(|&(_, value)| value).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|&(name, _)| name).collect();
        unknown_value(keyword, &name, &names)
    })
}

/// The text of a keyword.
pub(crate) fn text<'a>(value: &'a Bound<'_, PyAny>, keyword: &str) -> PyResult<Cow<'a, str>> {
    value
        .cast::<PyString>()
        .map_err(|_| PyTypeError::new_err(format!("{keyword}: give a name, as text")))?
        .to_cow()
}
