//! The keywords that all evaluations share: which samples, and how to interpolate.

use std::borrow::Cow;
use std::sync::Arc;

use glam::DVec3;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use tumble::{
    Ends, FrameRate, InterpolationOption, InterpolationOptions, OptionValue, OptionValueError,
    Quantity, SampleTimes, UnknownNameError,
};
use tumble_formats::motion::Motion;
use tumble_formats::outside::{Outside, OutsideError};
use tumble_formats::sample::{ChannelMethods, MethodChoice};

use crate::arrays::{self, ArrayValues, doubles, parts};
use crate::errors::{input, of_engine};
use crate::names::{option_of, text, unknown_name, unknown_value};

/// The samples that are evaluated.
#[derive(Debug, Clone)]
pub(crate) enum SampleChoice {
    /// Frames at a rate.
    Rate(FrameRate, Option<f64>, Option<f64>),
    /// One list of times for all tracks; a single time stands for a result without an axis of
    /// frames.
    Shared { times: Arc<[f64]>, is_one: bool },
    /// A list of times for each track, all of the same length.
    Each { times: Arc<[f64]>, count: usize },
    /// A list of times for each track, of different lengths.
    Ragged(Vec<Vec<f64>>),
}

/// The keywords of an evaluation.
#[derive(Debug, Clone)]
pub(crate) struct EvaluationKeywords {
    /// `None` without a rate and times.
    pub(crate) samples: Option<SampleChoice>,
    pub(crate) method: MethodChoice,
    options: InterpolationOptions,
    outside: Outside,
}

impl EvaluationKeywords {
    /// Reads the keywords.
    pub(crate) fn new(keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut request = Self {
            samples: None,
            method: MethodChoice::AUTHORED,
            options: InterpolationOptions::default(),
            outside: Outside::default(),
        };
        let (mut rate, mut times, mut start, mut end) = (None, None, None, None);
        for (name, value) in keywords.into_iter().flatten() {
            let name: Cow<'_, str> = name.extract()?;
            if value.is_none() {
                check_name(&name)?;
                continue;
            }
            match &*name {
                "fps" => rate = Some(frame_rate(&value)?),
                "at" | "times" if times.is_some() => {
                    return Err(PyTypeError::new_err(
                        "`times` is another name of `at`; give one of them",
                    ));
                }
                "at" | "times" => times = Some(value),
                "start" => start = Some(arrays::number(&value, "start", "seconds")?),
                "end" => end = Some(arrays::number(&value, "end", "seconds")?),
                "method" => request.method = method_named(&text(&value, "method")?)?,
                "ends" => request.options.ends = Some(ends(&value)?),
                // In Python, times outside the keys can also be left out, which the engine does not support.
                "before" => request.outside.before = option_of(&value, "before")?,
                "after" => request.outside.after = option_of(&value, "after")?,
                _ => match InterpolationOption::named(&name) {
                    Some(option) => set_option(&mut request.options, option, &value)?,
                    None => check_name(&name)?,
                },
            }
        }
        request.options.before = request.outside.before.wrap_mode();
        request.options.after = request.outside.after.wrap_mode();
        request.samples = samples(rate, times, start, end)?;
        let leaves_out = request.outside.leaves_out();
        let is_of_each = |samples: &SampleChoice| {
            matches!(samples, SampleChoice::Each { .. } | SampleChoice::Ragged(_))
        };
        if leaves_out != [false; 2] && request.samples.as_ref().is_some_and(is_of_each) {
            let keyword = if leaves_out[0] { "before" } else { "after" };
            return Err(input(format!(
                "{keyword}=\"leave-out\": all tracks of a result have the same number of samples; give one list of \
                 times for all tracks, or leave out the times yourself"
            )));
        }
        Ok(request)
    }

    /// The samples; an error if there are none.
    pub(crate) fn samples(&self) -> PyResult<&SampleChoice> {
        self.samples.as_ref().ok_or_else(none_asked_for)
    }

    /// How times before the first key and after the last are treated.
    pub(crate) fn outside(&self) -> Outside {
        self.outside
    }

    /// Like [`SampleChoice::frames`], without the times that `before` and `after` leave out.
    pub(crate) fn frames(&self, clip: &Motion, tracks: Option<&[usize]>) -> PyResult<SampleTimes> {
        let samples = self.samples()?;
        let rate = match samples {
            &SampleChoice::Rate(rate, ..) => Some(rate),
            _ => None,
        };
        let kept = (self.outside()).kept(samples.frames(clip, tracks)?, rate, clip);
        kept.map(|kept| kept.samples).map_err(|error| match error {
            OutsideError::Samples(error) => of_engine(&error.into()),
            error => input(error.to_string()),
        })
    }

    /// As [`Self::frames`] of all tracks, and how many there are.
    pub(crate) fn resolved(&self, clip: &Motion) -> PyResult<(SampleTimes, usize)> {
        count_of(self.frames(clip, None)?, clip)
    }

    /// The methods of a clip's channels, for a quantity.
    pub(crate) fn methods(&self, quantity: Quantity) -> ChannelMethods {
        ChannelMethods {
            method: self.method,
            options: self.options.with_quantity(quantity),
        }
    }
}

/// Sets an option whose values are names or numbers.
fn set_option(
    options: &mut InterpolationOptions,
    option: InterpolationOption,
    value: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let keyword = option.name;
    let set = match option.is_number {
        true => {
            let number = arrays::number(value, keyword, "a number")?;
            option.set(options, OptionValue::Number(number))
        }
        false => option.set(options, OptionValue::Text(&text(value, keyword)?)),
    };
    set.map_err(|error| match error {
        OptionValueError::Name(error) => unknown_value(keyword, &error.name, &error.known),
        error => input(error.to_string()),
    })
}

impl SampleChoice {
    /// The samples of some tracks of a clip as the engine takes them.
    pub(crate) fn frames(&self, clip: &Motion, tracks: Option<&[usize]>) -> PyResult<SampleTimes> {
        let set = &clip.set;
        let in_set = |time: f64| clip.time_in_set(time);
        let all = |times: &[f64]| times.iter().copied().map(in_set).collect();
        Ok(match self {
            &Self::Rate(rate, start, end) => {
                let whole = set.time_span().unwrap_or((0.0, 0.0));
                let (start, end) = clip.range_in_set(start, end, whole);
                SampleTimes::rate(rate).between(start, end)
            }
            Self::Shared { times, .. } => SampleTimes::at(all(times)),
            Self::Each { times, count } => {
                let list_count = times.len() / (*count).max(1);
                if list_count != set.track_count() && !times.is_empty() {
                    return Err(input(format!(
                        "there are times for {list_count} tracks; the clip has {}",
                        set.track_count()
                    )));
                }
                match tracks {
                    None => SampleTimes::at_each(all(times)),
                    Some(tracks) => {
                        let row = |&track: &usize| &times[track * count..(track + 1) * count];
                        let of_tracks = tracks.iter().flat_map(row).copied();
                        SampleTimes::at_each(of_tracks.map(in_set).collect())
                    }
                }
            }
            Self::Ragged(_) => {
                return Err(input(
                    "lists of times of different lengths are for rotations; give each track as \
                     many times",
                ));
            }
        })
    }

    /// As [`Self::frames`] of all tracks, and how many there are.
    pub(crate) fn resolved(&self, clip: &Motion) -> PyResult<(SampleTimes, usize)> {
        count_of(self.frames(clip, None)?, clip)
    }
}

fn count_of(frames: SampleTimes, clip: &Motion) -> PyResult<(SampleTimes, usize)> {
    let timeline = frames
        .resolve(clip.set.track_count(), clip.set.time_span())
        .map_err(|error| of_engine(&error.into()))?;
    Ok((frames, timeline.len()))
}

/// The samples that the keywords select; an error if there are none.
pub(crate) fn samples_of(
    fps: Option<&Bound<'_, PyAny>>,
    at: Option<Bound<'_, PyAny>>,
    start: Option<f64>,
    end: Option<f64>,
) -> PyResult<SampleChoice> {
    let finite = |name: &str, number: Option<f64>| match number {
        Some(number) if !number.is_finite() => {
            Err(input(format!("{name}: {number} is not finite")))
        }
        number => Ok(number),
    };
    let rate = fps.map(frame_rate).transpose()?;
    let found = samples(rate, at, finite("start", start)?, finite("end", end)?)?;
    found.ok_or_else(none_asked_for)
}

fn none_asked_for() -> PyErr {
    input("give `fps`, frames per second, or `at`, times in seconds")
}

fn samples(
    rate: Option<FrameRate>,
    times: Option<Bound<'_, PyAny>>,
    start: Option<f64>,
    end: Option<f64>,
) -> PyResult<Option<SampleChoice>> {
    match (rate, times) {
        (Some(_), Some(_)) => Err(input("`fps` and `at` exclude each other; give one of them")),
        (None, Some(_)) if start.is_some() || end.is_some() => {
            Err(input("`start` and `end` need `fps`; `at` lists all times"))
        }
        (Some(rate), None) => Ok(Some(SampleChoice::Rate(rate, start, end))),
        (None, Some(times)) => sample_times(&times).map(Some),
        (None, None) if start.is_some() || end.is_some() => {
            Err(input("`start` and `end` need `fps`; give it too"))
        }
        (None, None) => Ok(None),
    }
}

/// Reads the times of the keyword `at` [s].
pub(crate) fn sample_times(value: &Bound<'_, PyAny>) -> PyResult<SampleChoice> {
    if let Some(parts) = parts(value)? {
        let mut lists = Vec::with_capacity(parts.len());
        for part in &parts {
            let ArrayValues { shape, values } = doubles(part, "at")?;
            if shape.len() != 1 {
                return Err(input(format!(
                    "at: a part of the list has shape {shape:?}; give a list of times for each track"
                )));
            }
            lists.push(values);
        }
        let count = lists.first().map_or(0, Vec::len);
        if lists.iter().any(|list| list.len() != count) {
            return Ok(SampleChoice::Ragged(lists));
        }
        let times: Arc<[f64]> = lists.concat().into();
        return Ok(SampleChoice::Each { times, count });
    }
    let ArrayValues { shape, values } = doubles(value, "at")?;
    let times: Arc<[f64]> = values.into();
    match *shape {
        [] => Ok(SampleChoice::Shared {
            times,
            is_one: true,
        }),
        [_] => Ok(SampleChoice::Shared {
            times,
            is_one: false,
        }),
        [_, count] => Ok(SampleChoice::Each { times, count }),
        _ => Err(input(format!(
            "at: its shape is {shape:?}; give one time, (frames,), or (tracks, frames)"
        ))),
    }
}

/// Reads a rate: `60`, `29.97`, `"30000/1001"` or `Fraction(30000, 1001)`, each taken exactly.
pub(crate) fn frame_rate(value: &Bound<'_, PyAny>) -> PyResult<FrameRate> {
    let text = value.str()?;
    text.to_str()?
        .parse()
        .map_err(|error: tumble::SampleTimesError| input(format!("fps: {error}")))
}

/// The method with this name; "authored" is one.
pub(crate) fn method_named(name: &str) -> PyResult<MethodChoice> {
    name.parse().map_err(|error: UnknownNameError| {
        let refusal = format!("there is no method `{name}`");
        input(unknown_name(&refusal, name, &error.known))
    })
}

/// A name, or a pair of angular velocities.
pub(crate) fn ends(value: &Bound<'_, PyAny>) -> PyResult<Ends> {
    if !value.is_instance_of::<PyString>() {
        let numbers = arrays::doubles(value, "ends")?;
        return match (&*numbers.shape, &*numbers.values) {
            ([2, 3], &[a, b, c, x, y, z]) => Ok(Ends::Clamped {
                start: DVec3::new(a, b, c),
                end: DVec3::new(x, y, z),
            }),
            (shape, _) => Err(input(format!(
                "ends: shape {shape:?}; give a name, or the angular velocities at the first and \
                 the last key, of shape (2, 3), rad/s"
            ))),
        };
    }
    option_of(value, "ends")
}

/// The keywords that name samples and the method.
const NAMES: [&str; 6] = ["fps", "at", "times", "start", "end", "method"];

fn check_name(name: &str) -> PyResult<()> {
    let options = InterpolationOption::ALL.map(|option| option.name);
    let known = [&NAMES[..], &options].concat();
    if known.contains(&name) || InterpolationOption::named(name).is_some() {
        return Ok(());
    }
    let refusal = format!("there is no keyword `{name}`");
    Err(PyTypeError::new_err(unknown_name(&refusal, name, &known)))
}

/// The arrays among the keywords.
pub(crate) fn request_arrays<'py>(
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let Some(options) = options else {
        return Ok(Vec::new());
    };
    let named = |name: &str| options.get_item(name);
    Ok([named("at")?, named("times")?]
        .into_iter()
        .flatten()
        .collect())
}
