//! Options for interpolation: method, signs of keys, ends.

use std::collections::BTreeMap;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use tumble::method::{BESSEL_OVERHAUSER, KOCHANEK_BARTELS};
use tumble::{
    Ends, Engine, Error, FrameRate, Interpolation, InterpolationOption, InterpolationOptions,
    InterpolationWarning, KeySigns, METHODS, Method, Quantity, SampleTimes, Speed, WrapMode,
};
use tumble_formats::motion::Motion;
use tumble_formats::outside::{Outside, OutsideError, OutsideValue};
use tumble_formats::sample::{ChannelMethods, MethodChoice, Samples};
use tumble_formats::times::clock_text;
use tumble_formats::{Code, Diagnostic};

use crate::arguments::output::one_of;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// `--signs` and `--ends`, which every method takes.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct InterpolationArguments {
    /// The boundary condition at the first and the last key [default: depends on the method]
    #[arg(long, value_name = "ENDS", value_parser = ends())]
    ends: Option<Ends>,
    /// Which way to rotate between neighbouring keys
    #[arg(id = "signs", long = "signs", alias = "path", value_name = "SIGNS", value_parser = key_signs())]
    signs: Option<KeySigns>,
    /// The speed along the curve
    #[arg(long, value_name = "SPEED", default_value_t, value_parser = speed())]
    speed: Speed,
    /// The values before the first key
    #[arg(long, value_name = "OUTSIDE", default_value_t, value_parser = outside())]
    before: OutsideValue,
    /// The values after the last key
    #[arg(long, value_name = "OUTSIDE", default_value_t, value_parser = outside())]
    after: OutsideValue,
    /// kochanek-bartels: 0 is neutral, 1 stops at the keys, -1 doubles the speed at the keys
    #[arg(long, value_name = "NUMBER", value_parser = finite, allow_negative_numbers = true)]
    tension: Option<f64>,
    /// kochanek-bartels: 0 is smooth, -1 makes corners at the keys
    #[arg(long, value_name = "NUMBER", value_parser = finite, allow_negative_numbers = true)]
    continuity: Option<f64>,
    /// kochanek-bartels: 0 is neutral, 1 uses the velocity of the interval before a key, -1 of the one after it
    #[arg(long, value_name = "NUMBER", value_parser = finite, allow_negative_numbers = true)]
    bias: Option<f64>,
}

fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("not a finite number".to_owned()),
    }
}

impl InterpolationArguments {
    /// The options as the engine has them.
    pub(crate) fn options(self) -> InterpolationOptions {
        InterpolationOptions::DEFAULT
            .with_signs(self.signs)
            .with_ends(self.ends)
            .with_speed(self.speed)
            .with_before(self.before.wrap_mode())
            .with_after(self.after.wrap_mode())
            .with_tcb(tumble::Tcb {
                tension: self.tension.unwrap_or_default(),
                continuity: self.continuity.unwrap_or_default(),
                bias: self.bias.unwrap_or_default(),
            })
    }

    /// The interpolation by a method.
    pub(crate) fn with(self, method: Method) -> Interpolation {
        self.options().with(method)
    }

    /// How times before the first key and after the last are treated.
    pub(crate) fn outside(self) -> Outside {
        Outside {
            before: self.before,
            after: self.after,
        }
    }

    /// The options that are set, by their names in the npm package.
    pub(crate) fn named(self) -> BTreeMap<&'static str, String> {
        let options = self.options();
        let all = InterpolationOption::ALL.into_iter();
        all.filter_map(|option| Some((option.name, option.get(&options)?)))
            .collect()
    }

    /// Refuses options that have no effect on the channels of a clip by any of these methods.
    pub(crate) fn check_clip(
        self,
        name: &str,
        clip: &Motion,
        methods: &[MethodChoice],
    ) -> Result<(), Failure> {
        let used = methods.iter().flat_map(|&method| {
            let choice = CurveChoice::of_rotations(method, self);
            choice.channel_methods().methods(clip)
        });
        let used: Vec<Method> = used.collect();
        let used = each_once(used.iter());
        let checked = self
            .check(&used)
            .and_then(|()| self.check_signs(&used, clip));
        checked.map_err(|message| Failure::usage(format!("{name}: {message}")))
    }

    /// Refuses `--signs` if it has no effect on any track. It has none on a track with tangents if the method
    /// prescribes the signs of tangents.
    fn check_signs(self, methods: &[Method], clip: &Motion) -> Result<(), String> {
        let takes = |method: &Method| method.signs.is_none() || method.signs == self.signs;
        let has_tangents = clip.set.tracks().all(|track| !track.tangents.is_empty());
        if self.signs.is_some() && has_tangents && !methods.iter().any(takes) {
            return Err(format!(
                "--signs has no effect on {}: the keys have tangents, which depend on the stored signs; leave \
                 it out",
                names_of(methods)
            ));
        }
        Ok(())
    }

    /// Refuses options that have no effect on any of these methods.
    pub(crate) fn check(self, methods: &[Method]) -> Result<(), String> {
        let is_none = |says: fn(&Method) -> bool| !methods.iter().any(says);
        for (option, value) in [
            ("--tension", self.tension),
            ("--continuity", self.continuity),
            ("--bias", self.bias),
        ] {
            if value.is_some() && is_none(|method| method.name == KOCHANEK_BARTELS.name) {
                let method = KOCHANEK_BARTELS.name;
                return Err(format!(
                    "{option} is for {method}; add -m {method}, or leave it out"
                ));
            }
        }
        if self.ends.is_some() && is_none(|method| method.uses_neighbours) {
            return Err(format!(
                "--ends has no effect on {}, whose curves depend on the two keys that they join; \
                 leave it out, or choose another method (-m)",
                names_of(methods)
            ));
        }
        Ok(())
    }
}

fn names_of(methods: &[Method]) -> String {
    let names: Vec<&str> = methods.iter().map(|method| method.name).collect();
    names.join(", ")
}

/// Parses the name of a kind of ends, of curves through rotations or through points.
pub(crate) fn ends() -> impl TypedValueParser<Value = Ends> {
    let help = |ends: Ends| match ends {
        Ends::Parabolic => "the parabola through the last three keys or points",
        Ends::Natural => "no acceleration at the ends",
        Ends::Clamped { .. } => "start and end at rest",
        Ends::Secant => "the mean velocity between the last two keys or points",
        Ends::Loop => "a closed curve: the last key or point equals the first",
        Ends::Frozen => "no motion in the first and in the last interval",
        other => other.name(),
    };
    one_of(Ends::ALL.map(|ends| (ends.name(), help(ends), ends)))
}

fn speed() -> impl TypedValueParser<Value = Speed> {
    let help = |speed: Speed| match speed {
        Speed::AsKeyed => "as the key times say",
        Speed::Constant => "at constant angular speed",
        other => other.name(),
    };
    one_of(Speed::ALL.map(|speed| (speed.name(), help(speed), speed)))
}

/// The samples that [`Outside::kept`] keeps; says how many are left out.
///
/// # Errors
/// When none is left.
pub(crate) fn kept(
    outside: Outside,
    frames: SampleTimes,
    rate: Option<FrameRate>,
    clip: &Motion,
    name: &str,
) -> Result<SampleTimes, Failure> {
    let found = outside.kept(frames, rate, clip);
    let kept = found.map_err(|error| of_outside(error, name))?;
    if kept.left_out > 0 {
        let lie = if kept.all == 1 { "lies" } else { "lie" };
        words::note(&format!(
            "{name}: {} of {} {lie} outside the keys; they are left out",
            kept.left_out,
            words::count(kept.all, "time")
        ));
    }
    Ok(kept.samples)
}

/// Why no time of a clip can be evaluated.
pub(crate) fn of_outside(error: OutsideError, name: &str) -> Failure {
    match error {
        OutsideError::Samples(error) => Failure::evaluating(name, &error.into()),
        error => Failure::new(ALL_INPUTS, format!("{name}: {error}")),
    }
}

fn outside() -> impl TypedValueParser<Value = OutsideValue> {
    let help = |mode: WrapMode| match mode {
        WrapMode::Hold => "the first or the last value is held",
        WrapMode::Loop => "the track repeats",
        WrapMode::Mirror => "the track runs forwards and backwards alternately (ping-pong)",
        WrapMode::Extrapolate => "continues at the velocity of the end",
        other => other.name(),
    };
    let wrapped = WrapMode::ALL.map(|mode| (mode.name(), help(mode), OutsideValue::Wrap(mode)));
    let left_out = OutsideValue::LeaveOut;
    let left_out = (
        left_out.name(),
        "no value: times there are left out",
        left_out,
    );
    one_of(wrapped.into_iter().chain([left_out]).collect::<Vec<_>>())
}

fn key_signs() -> impl TypedValueParser<Value = KeySigns> {
    let help = |signs| match signs {
        KeySigns::Shortest => "the shorter rotation (default)",
        KeySigns::AsAuthored => {
            "as the signs of the keys state, since q and -q differ: possibly the longer rotation"
        }
    };
    one_of(KeySigns::ALL.map(|signs| (signs.name(), help(signs), signs)))
}

/// A warning if curves of a set are less smooth at some keys than their method promises. It names the first such key
/// and counts the others.
pub(crate) fn curve_warning(
    name: &str,
    clip: &Motion,
    interpolation: &Interpolation,
) -> Option<Diagnostic> {
    let set = &clip.set;
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
    let time = clock_text(clip.time_offset, track.times[key]);
    let others = match (keys, tracks) {
        (1, _) => String::new(),
        (_, 1) => format!(" (and at {} more)", keys - 1),
        _ => format!(" (and at {} more, in {tracks} tracks)", keys - 1),
    };
    let message = format!(
        "the angular acceleration of {} jumps at key {}, at {time} s{others}; add keys in long intervals \
         beside short ones, or use `-m bessel-overhauser`",
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

/// The methods among these that draw a clip differently. A file that states no method has bessel-overhauser, which is
/// then not drawn a second time.
pub(crate) fn distinct_methods(methods: &[MethodChoice], clip: &Motion) -> Vec<MethodChoice> {
    if !clip.channels.is_empty() {
        return methods.to_vec();
    }
    let meant = MethodChoice(Some(BESSEL_OVERHAUSER));
    let mut kept = methods.to_vec();
    if kept.contains(&meant) {
        kept.retain(|method| method.0.is_some());
    }
    let named = kept.iter().map(|choice| MethodChoice(choice.0.or(meant.0)));
    let named: Vec<MethodChoice> = named.collect();
    each_once(named.iter())
}

/// A method of the command line, with the other options of curves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CurveChoice {
    pub(crate) method: MethodChoice,
    options: InterpolationArguments,
    quantity: Quantity,
}

impl CurveChoice {
    /// Rotations by a method.
    pub(crate) fn of_rotations(method: MethodChoice, options: InterpolationArguments) -> Self {
        Self {
            method,
            options,
            quantity: Quantity::Rotation,
        }
    }

    /// The same curve, with another quantity.
    pub(crate) fn of(self, quantity: Quantity) -> Self {
        Self { quantity, ..self }
    }

    /// The methods among these that draw a clip, each differently.
    ///
    /// # Errors
    /// When an option has no effect on any of them.
    pub(crate) fn of_clip(
        methods: &[MethodChoice],
        options: InterpolationArguments,
        name: &str,
        clip: &Motion,
    ) -> Result<Vec<Self>, Failure> {
        let methods = distinct_methods(methods, clip);
        options.check_clip(name, clip, &methods)?;
        let choices = methods.into_iter();
        Ok(choices
            .map(|method| Self::of_rotations(method, options))
            .collect())
    }

    /// The methods by which scalars are drawn, each once: a file may state an interpolation for each of them.
    ///
    /// # Errors
    /// When an option has no effect on any of them.
    pub(crate) fn of_scalars(
        methods: &[MethodChoice],
        options: InterpolationArguments,
        name: &str,
    ) -> Result<Vec<Self>, Failure> {
        let used = methods
            .iter()
            .map(|method| method.0.unwrap_or(BESSEL_OVERHAUSER));
        let checked = options.check(&used.collect::<Vec<Method>>());
        checked.map_err(|message| Failure::usage(format!("{name}: {message}")))?;
        let choices = each_once(methods.iter()).into_iter();
        Ok(choices
            .map(|method| Self::of_rotations(method, options))
            .collect())
    }

    /// The curve by a method, with the other options.
    pub(crate) fn interpolation(self, method: Method) -> Interpolation {
        self.channel_methods().options.with(method)
    }

    /// The methods of a clip's channels.
    pub(crate) fn channel_methods(self) -> ChannelMethods {
        ChannelMethods {
            method: self.method,
            options: self.options.options().with_quantity(self.quantity),
        }
    }

    /// How the rotations of a track are interpolated.
    pub(crate) fn of_track(self, clip: &Motion, track: usize) -> Interpolation {
        let method = self.channel_methods().methods(clip).nth(track);
        self.interpolation(method.unwrap_or(BESSEL_OVERHAUSER))
    }

    /// All channels of a clip.
    pub(crate) fn sample(
        self,
        engine: &Engine,
        clip: &Motion,
        frames: &SampleTimes,
    ) -> Result<Samples, Error> {
        self.channel_methods().sample(engine, clip, frames)
    }
}

fn method_argument_names() -> impl Iterator<Item = PossibleValue> {
    MethodChoice::all().map(|argument| PossibleValue::new(argument.name()).help(argument.summary()))
}

/// Parses the name of one of [`MethodChoice::all`]; help, errors and completions list all of them.
pub(crate) fn method_argument() -> impl TypedValueParser<Value = MethodChoice> {
    PossibleValuesParser::new(method_argument_names())
        .map(|name| MethodChoice(Method::named(&name)))
}

/// One of [`MethodChoice::all`], or all of them.
#[derive(Debug, Clone)]
pub(crate) struct MethodArgumentSelection(pub(crate) Vec<MethodChoice>);

/// As [`method_argument`], and `all`.
pub(crate) fn method_arguments() -> impl TypedValueParser<Value = MethodArgumentSelection> {
    let all = PossibleValue::new(ALL).help("every method");
    PossibleValuesParser::new(std::iter::once(all).chain(method_argument_names())).map(|name| {
        MethodArgumentSelection(match &*name {
            ALL => MethodChoice::all().collect(),
            _ => vec![MethodChoice(Method::named(&name))],
        })
    })
}

const ALL: &str = "all";

/// One method, or all of them.
#[derive(Debug, Clone)]
pub(crate) struct MethodSelection(pub(crate) Vec<Method>);

/// Parses the name of a method, or `all`.
pub(crate) fn methods() -> impl TypedValueParser<Value = MethodSelection> {
    let all = PossibleValue::new(ALL).help("every method");
    PossibleValuesParser::new(std::iter::once(all).chain(names())).map(|name| {
        MethodSelection(
            Method::named(&name).map_or_else(|| METHODS.to_vec(), |method| vec![method]),
        )
    })
}

/// The methods of several selections, each once.
pub(crate) fn chosen(selections: &[MethodSelection]) -> Vec<Method> {
    each_once(selections.iter().flat_map(|selection| &selection.0))
}

/// The values without repetitions, in order.
pub(crate) fn each_once<'a, T: Copy + PartialEq + 'a>(all: impl Iterator<Item = &'a T>) -> Vec<T> {
    let mut found = Vec::new();
    for one in all {
        if !found.contains(one) {
            found.push(*one);
        }
    }
    found
}
