//! `tumble explain`: the meanings of the codes in messages about inputs.

use std::fmt::Write;

use clap::Args;
use tumble_formats::Code;

use crate::messages::exit::Failure;
use crate::messages::listing;
use crate::messages::words;

/// Explain the code of an error or a warning about an input, such as E025
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The code; without one all are listed
    code: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut text = String::new();
    match &arguments.code {
        None => {
            for code in Code::ALL {
                let _ = writeln!(text, "{code}  {}", code.title());
            }
        }
        Some(name) => {
            let code = Code::named(name).ok_or_else(|| {
                // All codes have four characters. A shorter text is similar to too many of them, so none is suggested.
                let known = Code::ALL.iter().map(|code| code.name());
                let known = known.filter(|known| known.len() == name.len());
                let hint = words::nearest(name, known)
                    .map(|near| format!("; did you mean {near}?"))
                    .unwrap_or_default();
                Failure::usage(format!(
                    "there is no code `{name}`{hint} (`tumble explain` lists all)"
                ))
            })?;
            let _ = writeln!(text, "{code}: {}\n\n{}", code.title(), code.explanation());
        }
    }
    listing::text(&text)
}
