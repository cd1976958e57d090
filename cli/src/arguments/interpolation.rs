//! Arguments that say how to interpolate: method, path, ends.

use std::collections::BTreeMap;
use std::fmt;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use glam::DVec3;
use tumble::method::KOCHANEK_BARTELS;
use tumble::{
    Ends, Interpolation, InterpolationWarning, METHODS, Method, Path, Speed, TrackSet, WrapMode,
};
use tumble_formats::{Code, Diagnostic};

/// `--path` and `--ends`, which every method takes.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct Manner {
    /// What happens in the first and the last segment (default: the method's own)
    #[arg(long, value_name = "ENDS")]
    ends: Option<EndsArgument>,
    /// Which way round between neighbouring keys
    #[arg(long, value_name = "PATH")]
    path: Option<PathArgument>,
    /// How fast the curve is run through
    #[arg(long, value_name = "SPEED", default_value = "as-keyed")]
    speed: SpeedArgument,
    /// What lies before the first key
    #[arg(long, value_name = "OUTSIDE", default_value = "hold")]
    before: OutsideArgument,
    /// What lies after the last key
    #[arg(long, value_name = "OUTSIDE", default_value = "hold")]
    after: OutsideArgument,
    /// kochanek-bartels: 1 stands still at the keys, -1 is twice as fast
    #[arg(long, value_name = "NUMBER", value_parser = finite, allow_negative_numbers = true)]
    tension: Option<f64>,
    /// kochanek-bartels: -1 makes corners at the keys
    #[arg(long, value_name = "NUMBER", value_parser = finite, allow_negative_numbers = true)]
    continuity: Option<f64>,
    /// kochanek-bartels: 1 follows the interval before a key, -1 that behind it
    #[arg(long, value_name = "NUMBER", value_parser = finite, allow_negative_numbers = true)]
    bias: Option<f64>,
}

fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("not a finite number".to_owned()),
    }
}

impl Manner {
    pub(crate) fn with(self, method: Method) -> tumble::Interpolation {
        tumble::Interpolation {
            method,
            path: method.path.or(self.path()).unwrap_or_default(),
            ends: self.ends.map_or(method.ends, EndsArgument::ends),
            quantity: tumble::Quantity::Rotation,
            speed: match self.speed {
                SpeedArgument::AsKeyed => Speed::AsKeyed,
                SpeedArgument::Constant => Speed::Constant,
            },
            before: self.before.into(),
            after: self.after.into(),
            tcb: tumble::Tcb {
                tension: self.tension.unwrap_or_default(),
                continuity: self.continuity.unwrap_or_default(),
                bias: self.bias.unwrap_or_default(),
            },
        }
    }

    fn path(self) -> Option<Path> {
        Some(match self.path? {
            PathArgument::Shortest => Path::Shortest,
            PathArgument::AsAuthored => Path::AsAuthored,
        })
    }

    /// The options by the names that the npm package has for them, those that were given.
    pub(crate) fn named(self) -> BTreeMap<&'static str, String> {
        fn name(value: impl ValueEnum) -> Option<String> {
            Some(value.to_possible_value()?.get_name().to_owned())
        }
        let number = |value: Option<f64>| value.map(|value| value.to_string());
        let options = [
            ("ends", self.ends.and_then(name)),
            ("path", self.path.and_then(name)),
            ("speed", name(self.speed)),
            ("before", name(self.before)),
            ("after", name(self.after)),
            ("tension", number(self.tension)),
            ("continuity", number(self.continuity)),
            ("bias", number(self.bias)),
        ];
        let given = options
            .into_iter()
            .filter_map(|(name, value)| Some((name, value?)));
        given.collect()
    }

    /// Refuses what says nothing to any of these methods.
    pub(crate) fn check(self, methods: &[Method]) -> Result<(), String> {
        let names = || {
            let names: Vec<&str> = methods.iter().map(|method| method.name).collect();
            names.join(", ")
        };
        let is_none = |says: fn(&Method) -> bool| !methods.iter().any(says);
        for (option, value) in [
            ("--tension", self.tension),
            ("--continuity", self.continuity),
            ("--bias", self.bias),
        ] {
            if value.is_some() && is_none(|method| method.name == KOCHANEK_BARTELS.name) {
                let own = KOCHANEK_BARTELS.name;
                return Err(format!(
                    "{option} is for {own}; add -m {own}, or leave it out"
                ));
            }
        }
        if self.ends.is_some() && is_none(|method| method.uses_neighbours) {
            return Err(format!(
                "--ends says nothing to {}, whose curves depend on the two keys that they join; \
                 leave it out, or choose another method (-m)",
                names()
            ));
        }
        let path = self.path();
        let takes = |method: &Method| method.path.is_none() || method.path == path;
        if path.is_some() && !methods.iter().any(takes) {
            return Err(format!(
                "--path: {} always takes the way that the signs of the keys say; leave it out",
                names()
            ));
        }
        Ok(())
    }
}

/// What happens at both ends of a curve, through rotations or through points.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum EndsArgument {
    /// the parabola through the last three keys or points
    Parabolic,
    /// no acceleration
    Natural,
    /// start and end at rest
    Clamped,
    /// the velocity of the straight way between the last two: slerp's, for rotations
    Secant,
    /// the last repeats the first
    Loop,
    /// the first and the last segment stand still
    Frozen,
}

impl EndsArgument {
    pub(crate) fn ends(self) -> Ends {
        let still = DVec3::ZERO;
        match self {
            Self::Parabolic => Ends::Parabolic,
            Self::Natural => Ends::Natural,
            Self::Clamped => Ends::Clamped {
                start: still,
                end: still,
            },
            Self::Loop => Ends::Loop,
            Self::Secant => Ends::Secant,
            Self::Frozen => Ends::Frozen,
        }
    }
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum SpeedArgument {
    /// as the key times say
    AsKeyed,
    /// at one angular speed all the way
    Constant,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum OutsideArgument {
    /// the end value
    Hold,
    /// the track again
    Loop,
    /// the track backwards, and again
    Mirror,
    /// on, at the velocity of the end
    Extrapolate,
}

impl From<OutsideArgument> for WrapMode {
    fn from(outside: OutsideArgument) -> Self {
        match outside {
            OutsideArgument::Hold => Self::Hold,
            OutsideArgument::Loop => Self::Loop,
            OutsideArgument::Mirror => Self::Mirror,
            OutsideArgument::Extrapolate => Self::Extrapolate,
        }
    }
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum PathArgument {
    /// the shorter way (default)
    Shortest,
    /// the way that the signs of the keys say
    AsAuthored,
}

/// Where the curves of a set are less smooth than their method promises: the first such key is named, others
/// are counted.
pub(crate) fn curve_warning(
    name: &str,
    set: &TrackSet,
    interpolation: &Interpolation,
) -> Option<Diagnostic> {
    let mut first = None;
    let (mut keys, mut tracks) = (0, 0);
    for warning in interpolation.warnings(set) {
        let InterpolationWarning::AccelerationJumps { track, key, count } = warning else {
            continue;
        };
        first = first.or(Some((track, key)));
        (keys, tracks) = (keys + count, tracks + 1);
    }
    let (index, key) = first?;
    let track = set.track(index);
    let time = track.times[key];
    let others = match (keys, tracks) {
        (1, _) => String::new(),
        (_, 1) => format!(" (and at {} more)", keys - 1),
        _ => format!(" (and at {} more, in {tracks} tracks)", keys - 1),
    };
    let message = format!(
        "the angular acceleration of {} jumps at key {}, at {time} s{others}; add keys in long intervals \
         beside short ones, or use -m bessel-overhauser",
        interpolation.method,
        key + 1
    );
    let inside = match track.name {
        Some(name) => format!("track {name}"),
        None => format!("track {}", index + 1),
    };
    Some(Diagnostic::new(name, Code::AccelerationJumps, message).inside(inside))
}

fn names() -> impl Iterator<Item = PossibleValue> {
    METHODS
        .iter()
        .map(|method| PossibleValue::new(method.name).help(method.summary))
}

/// A method for every channel, or each channel's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wanted(pub(crate) Option<Method>);

impl fmt::Display for Wanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

const AUTHORED: &str = "authored";

impl Wanted {
    pub(crate) fn name(self) -> &'static str {
        self.0.map_or(AUTHORED, |method| method.name)
    }

    pub(crate) fn summary(self) -> &'static str {
        let authored = "as the file says of each channel; bessel-overhauser where it says nothing";
        self.0.map_or(authored, |method| method.summary)
    }

    /// Each channel's own method, then all methods.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        let methods = METHODS.into_iter().map(Some);
        std::iter::once(None).chain(methods).map(Self)
    }
}

fn wanted_names() -> impl Iterator<Item = PossibleValue> {
    Wanted::all().map(|wanted| PossibleValue::new(wanted.name()).help(wanted.summary()))
}

/// Parses the name of one of [`Wanted::all`]; help, errors and completions list them all.
pub(crate) fn wanted() -> impl TypedValueParser<Value = Wanted> {
    PossibleValuesParser::new(wanted_names()).map(|name| Wanted(Method::named(&name)))
}

/// One of [`Wanted::all`], or all of them.
#[derive(Debug, Clone)]
pub(crate) struct WantedSelection(pub(crate) Vec<Wanted>);

/// As [`wanted`], and `all`.
pub(crate) fn wanted_methods() -> impl TypedValueParser<Value = WantedSelection> {
    let all = PossibleValue::new(ALL).help("every method");
    PossibleValuesParser::new(std::iter::once(all).chain(wanted_names())).map(|name| {
        WantedSelection(match &*name {
            ALL => Wanted::all().collect(),
            _ => vec![Wanted(Method::named(&name))],
        })
    })
}

const ALL: &str = "all";

/// One method, or all of them.
#[derive(Debug, Clone)]
pub(crate) struct Selection(pub(crate) Vec<Method>);

/// Parses the name of a method, or `all`.
pub(crate) fn methods() -> impl TypedValueParser<Value = Selection> {
    let all = PossibleValue::new(ALL).help("every method");
    PossibleValuesParser::new(std::iter::once(all).chain(names())).map(|name| {
        Selection(Method::named(&name).map_or_else(|| METHODS.to_vec(), |method| vec![method]))
    })
}

/// The methods of several selections, each once.
pub(crate) fn chosen(selections: &[Selection]) -> Vec<Method> {
    each_once(selections.iter().flat_map(|selection| &selection.0))
}

/// The first of all that are equal.
pub(crate) fn each_once<'a, T: Copy + PartialEq + 'a>(all: impl Iterator<Item = &'a T>) -> Vec<T> {
    let mut found = Vec::new();
    for one in all {
        if !found.contains(one) {
            found.push(*one);
        }
    }
    found
}
