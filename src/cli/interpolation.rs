//! Arguments that say how to interpolate: method, path, ends.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use glam::DVec3;
use tumble::{Ends, METHODS, Method, Path};

/// `--path` and `--ends`, which every method takes.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct Manner {
    /// What happens in the first and the last segment
    #[arg(
        long,
        value_name = "ENDS",
        default_value = "parabolic",
        hide_default_value = true
    )]
    ends: EndsArgument,
    /// Which way round between neighbouring keys
    #[arg(
        long,
        value_name = "PATH",
        default_value = "shortest",
        hide_default_value = true
    )]
    path: PathArgument,
}

impl Manner {
    pub(crate) fn with(self, method: Method) -> tumble::Interpolation {
        let still = DVec3::ZERO;
        let ends = match self.ends {
            EndsArgument::Parabolic => Ends::Parabolic,
            EndsArgument::Natural => Ends::Natural,
            EndsArgument::Clamped => Ends::Clamped {
                start: still,
                end: still,
            },
            EndsArgument::Loop => Ends::Loop,
            EndsArgument::Frozen => Ends::Frozen,
        };
        let path = match self.path {
            PathArgument::Shortest => Path::Shortest,
            PathArgument::AsAuthored => Path::AsAuthored,
        };
        tumble::Interpolation { method, path, ends }
    }
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum EndsArgument {
    /// the parabola through the last three keys (default)
    Parabolic,
    /// no angular acceleration
    Natural,
    /// start and end at rest
    Clamped,
    /// the last key repeats the first
    Loop,
    /// the first and the last segment stand still
    Frozen,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum PathArgument {
    /// the shorter way (default)
    Shortest,
    /// the way that the signs of the keys say
    AsAuthored,
}

fn names() -> impl Iterator<Item = PossibleValue> {
    METHODS
        .iter()
        .map(|method| PossibleValue::new(method.name).help(method.summary))
}

/// Parses a method's name; help, errors and completions list them all.
pub(crate) fn method() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(names()).try_map(|name| name.parse::<Method>())
}

/// One method, or all of them.
#[derive(Debug, Clone)]
pub(crate) struct Selection(pub(crate) Vec<Method>);

/// As [`method`], and `all`.
pub(crate) fn methods() -> impl TypedValueParser<Value = Selection> {
    let all = PossibleValue::new("all").help("every method");
    PossibleValuesParser::new(std::iter::once(all).chain(names())).map(|name| {
        Selection(Method::named(&name).map_or_else(|| METHODS.to_vec(), |method| vec![method]))
    })
}
