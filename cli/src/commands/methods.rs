//! `tumble methods`: the methods for `-m`.

use std::fmt::Write;

use clap::Args;
use tumble::METHODS;

use crate::messages::exit::Failure;
use crate::messages::listing;

/// List the interpolation methods
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Print JSON: with formulas and sources
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
                "symmetric": method.symmetric,
                "nanoseconds_a_key": method.cost.key,
                "nanoseconds_a_rotation": method.cost.rotation,
            })
        });
        return listing::records(&methods, &[]);
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
    let _ = writeln!(
        text,
        "{:width$}  {:smooth$}  ns: key rotation  use",
        "method", "continuity"
    );
    for method in METHODS {
        let _ = writeln!(
            text,
            "{:width$}  {:smooth$}  {:>5.0} {:>8.1}  {}",
            method.name,
            method.smoothness(),
            method.cost.key,
            method.cost.rotation,
            method.summary
        );
    }
    listing::text(&text)
}
