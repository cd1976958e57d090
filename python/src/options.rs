//! The keywords that all evaluations share: which samples, and how to interpolate.

use std::borrow::Cow;
use std::str::FromStr;
use std::sync::Arc;

use glam::DVec3;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use tumble::{
    Ends, FrameRate, Interpolation, KeySigns, METHODS, Method, Quantity, SampleTimes, Speed, Tcb,
    UnknownNameError,
};
use tumble_cli::host;
use tumble_formats::motion::Motion;
use tumble_formats::outside::{Outside, OutsideError};

use crate::arrays;
use crate::errors::{input, of_engine};

/// Which samples.
#[derive(Debug, Clone)]
pub(crate) enum SampleRequest {
    /// Frames at a rate.
    Rate(FrameRate, Option<f64>, Option<f64>),
    /// One list of times for all tracks; a single time stands for a result without an axis of
    /// frames.
    Shared { times: Arc<[f64]>, is_one: bool },
    /// A list of times for each track, of one length.
    Each { times: Arc<[f64]>, count: usize },
    /// A list of times for each track.
    Ragged(Vec<Vec<f64>>),
}

/// The keywords of an evaluation.
#[derive(Debug, Clone)]
pub(crate) struct Request {
    /// `None` without a rate and times.
    pub(crate) samples: Option<SampleRequest>,
    /// `None`: the method that the file gives each channel.
    pub(crate) method: Option<Method>,
    interpolation: InterpolationOptions,
}

#[derive(Debug, Clone, Copy)]
struct InterpolationOptions {
    signs: KeySigns,
    ends: Option<Ends>,
    speed: Speed,
    outside: Outside,
    tcb: Tcb,
}

/// The name of "the method that the file gives each channel; bessel-overhauser where it gives none".
pub(crate) const AUTHORED: &str = "authored";

impl Request {
    /// Reads the keywords.
    pub(crate) fn new(keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut request = Self {
            samples: None,
            method: None,
            interpolation: InterpolationOptions {
                signs: KeySigns::Shortest,
                ends: None,
                speed: Speed::AsKeyed,
                outside: Outside::default(),
                tcb: Tcb::default(),
            },
        };
        let (mut rate, mut times, mut start, mut end) = (None, None, None, None);
        for (name, value) in keywords.into_iter().flatten() {
            let name: Cow<'_, str> = name.extract()?;
            if value.is_none() {
                check_name(&name)?;
                continue;
            }
            let interpolation = &mut request.interpolation;
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
                "method" => request.method = method(&value)?,
                "path" => {
                    interpolation.signs = option_of(&value, "path")?;
                }
                "ends" => interpolation.ends = Some(ends(&value)?),
                "speed" => {
                    interpolation.speed = option_of(&value, "speed")?;
                }
                "before" => interpolation.outside.before = option_of(&value, "before")?,
                "after" => interpolation.outside.after = option_of(&value, "after")?,
                "tension" => {
                    interpolation.tcb.tension = arrays::number(&value, "tension", "a number")?;
                }
                "continuity" => {
                    interpolation.tcb.continuity =
                        arrays::number(&value, "continuity", "a number")?;
                }
                "bias" => interpolation.tcb.bias = arrays::number(&value, "bias", "a number")?,
                _ => check_name(&name)?,
            }
        }
        request.samples = samples(rate, times, start, end)?;
        let leaves_out = request.interpolation.outside.leaves_out();
        let is_of_each = |samples: &SampleRequest| {
            matches!(
                samples,
                SampleRequest::Each { .. } | SampleRequest::Ragged(_)
            )
        };
        if leaves_out != [false; 2] && request.samples.as_ref().is_some_and(is_of_each) {
            let keyword = if leaves_out[0] { "before" } else { "after" };
            return Err(input(format!(
                "{keyword}=\"leave-out\": a result has as many samples for each track; give one list of times for all \
                 tracks, or leave out the times yourself"
            )));
        }
        Ok(request)
    }

    /// The samples, of which there must be some.
    pub(crate) fn samples(&self) -> PyResult<&SampleRequest> {
        self.samples.as_ref().ok_or_else(none_asked_for)
    }

    /// What is done with times outside the keys.
    pub(crate) fn outside(&self) -> Outside {
        self.interpolation.outside
    }

    /// As [`SampleRequest::frames`], without the times that are left out.
    pub(crate) fn frames(&self, clip: &Motion, tracks: Option<&[usize]>) -> PyResult<SampleTimes> {
        let samples = self.samples()?;
        let rate = match samples {
            &SampleRequest::Rate(rate, ..) => Some(rate),
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

    /// The interpolation by a method, for a quantity.
    pub(crate) fn with(&self, quantity: Quantity) -> impl Fn(Method) -> Interpolation + use<> {
        let interpolation = self.interpolation;
        move |method| Interpolation {
            method,
            signs: method.signs.unwrap_or(interpolation.signs),
            ends: interpolation.ends.unwrap_or(method.ends),
            tcb: interpolation.tcb,
            quantity,
            speed: interpolation.speed,
            before: interpolation.outside.before.wrap_mode(),
            after: interpolation.outside.after.wrap_mode(),
        }
    }

    /// The method's name.
    pub(crate) fn method_name(&self) -> &'static str {
        self.method.map_or(AUTHORED, |method| method.name)
    }
}

impl SampleRequest {
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

/// Which samples some keywords mean, of which there must be some.
pub(crate) fn samples_of(
    fps: Option<&Bound<'_, PyAny>>,
    at: Option<Bound<'_, PyAny>>,
    start: Option<f64>,
    end: Option<f64>,
) -> PyResult<SampleRequest> {
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
) -> PyResult<Option<SampleRequest>> {
    match (rate, times) {
        (Some(_), Some(_)) => Err(input("`fps` and `at` exclude each other; give one of them")),
        (None, Some(_)) if start.is_some() || end.is_some() => {
            Err(input("`start` and `end` need `fps`; `at` lists all times"))
        }
        (Some(rate), None) => Ok(Some(SampleRequest::Rate(rate, start, end))),
        (None, Some(times)) => arrays::sample_times(&times).map(Some),
        (None, None) if start.is_some() || end.is_some() => {
            Err(input("`start` and `end` need `fps`; give it too"))
        }
        (None, None) => Ok(None),
    }
}

/// `60`, `29.97`, `"30000/1001"`, `Fraction(30000, 1001)`: each exactly what it says.
pub(crate) fn frame_rate(value: &Bound<'_, PyAny>) -> PyResult<FrameRate> {
    let text = value.str()?;
    text.to_str()?
        .parse()
        .map_err(|error: tumble::SampleTimesError| input(format!("fps: {error}")))
}

fn method(value: &Bound<'_, PyAny>) -> PyResult<Option<Method>> {
    method_named(&text(value, "method")?)
}

/// The method of that name; `None` for "authored".
pub(crate) fn method_named(name: &str) -> PyResult<Option<Method>> {
    if name == AUTHORED {
        return Ok(None);
    }
    let found = Method::named(name);
    found.map(Some).ok_or_else(|| {
        let names = METHODS.iter().map(|method| method.name);
        let names: Vec<&str> = std::iter::once(AUTHORED).chain(names).collect();
        let refusal = format!("there is no method `{name}`");
        input(unknown_name(&refusal, name, &names))
    })
}

/// The message about a name that is not in the list of the known ones: `refusal`, the list, and the name that was
/// probably meant.
pub(crate) fn unknown_name(refusal: &str, name: &str, known: &[&str]) -> String {
    let similar = host::nearest_name(name, known.iter().copied());
    let hint = similar.map(|similar| format!("; did you mean `{similar}`?"));
    let list = known.join(", ");
    format!("{refusal}; there are {list}{}", hint.unwrap_or_default())
}

/// As [`unknown_name`], for the value of a keyword.
pub(crate) fn unknown_value(keyword: &str, name: &str, known: &[&str]) -> PyErr {
    let refusal = format!("{keyword}: there is no `{name}`");
    input(unknown_name(&refusal, name, known))
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

/// The value of an option of the engine that is called `name`; messages call the keyword `keyword`.
pub(crate) fn option_named<T: FromStr<Err = UnknownNameError>>(
    name: &str,
    keyword: &str,
) -> PyResult<T> {
    name.parse()
        .map_err(|error: UnknownNameError| unknown_value(keyword, name, &error.known))
}

/// As [`option_named`], of a value of Python.
pub(crate) fn option_of<T: FromStr<Err = UnknownNameError>>(
    value: &Bound<'_, PyAny>,
    keyword: &str,
) -> PyResult<T> {
    option_named(&text(value, keyword)?, keyword)
}

/// The value of that name.
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

fn text<'a>(value: &'a Bound<'_, PyAny>, keyword: &str) -> PyResult<Cow<'a, str>> {
    value
        .cast::<PyString>()
        .map_err(|_| PyTypeError::new_err(format!("{keyword}: give a name, as text")))?
        .to_cow()
}

/// The keywords, for the message about one that is none of them.
const NAMES: [&str; 14] = [
    "fps",
    "at",
    "times",
    "start",
    "end",
    "method",
    "path",
    "ends",
    "speed",
    "before",
    "after",
    "tension",
    "continuity",
    "bias",
];

fn check_name(name: &str) -> PyResult<()> {
    if NAMES.contains(&name) {
        return Ok(());
    }
    let refusal = format!("there is no keyword `{name}`");
    Err(PyTypeError::new_err(unknown_name(&refusal, name, &NAMES)))
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
