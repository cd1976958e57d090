//! `tumble methods`: what there is to choose from with `-m`.

use std::fmt::Write;

use clap::Args;
use tumble::METHODS;

use super::exit::Failure;
use super::words;

/// List the methods of interpolation
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Print JSON, with formulas and sources
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.json {
        let methods = METHODS.map(|method| {
            serde_json::json!({
                "name": method.name,
                "summary": method.summary,
                "formula": method.formula,
                "source": method.source,
                "continuity": method.continuity.to_string(),
                "continuity_on_even_keys": method.continuity_on_even_keys.to_string(),
                "interpolates": method.interpolates,
            })
        });
        return words::json(&methods);
    }
    let width = METHODS
        .iter()
        .map(|method| method.name.len())
        .max()
        .unwrap_or(0);
    let smooth = METHODS
        .iter()
        .map(|method| method.smoothness().len())
        .max()
        .unwrap_or(0);
    let mut text = String::new();
    for method in METHODS {
        let _ = writeln!(
            text,
            "{:width$}  {:smooth$}  {}",
            method.name,
            method.smoothness(),
            method.summary
        );
    }
    words::listing(&text)
}
