//! The treatment of times before the first key and after the last key of a clip.

use std::fmt;
use std::str::FromStr;

use tumble::{FrameRate, SampleTimes, SampleTimesError, UnknownNameError, WrapMode};

use crate::motion::Motion;

/// The treatment of times at one end: before the first key, or after the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutsideValue {
    /// They have values.
    Wrap(WrapMode),
    /// They are left out.
    LeaveOut,
}

impl OutsideValue {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Wrap(WrapMode::Hold),
        Self::Wrap(WrapMode::Loop),
        Self::Wrap(WrapMode::Mirror),
        Self::Wrap(WrapMode::Extrapolate),
        Self::LeaveOut,
    ];

    /// Its name, which [`FromStr`] reads.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Wrap(mode) => mode.name(),
            Self::LeaveOut => "leave-out",
        }
    }

    /// The mode for the engine. Times that are left out are not evaluated, so that any would do.
    #[must_use]
    pub fn wrap_mode(self) -> WrapMode {
        match self {
            Self::Wrap(mode) => mode,
            Self::LeaveOut => WrapMode::default(),
        }
    }

    /// Whether values there depend on time. Where the value of the end is held they do not.
    fn is_motion(self) -> bool {
        !matches!(self, Self::Wrap(WrapMode::Hold) | Self::LeaveOut)
    }
}

impl Default for OutsideValue {
    fn default() -> Self {
        Self::Wrap(WrapMode::default())
    }
}

impl fmt::Display for OutsideValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for OutsideValue {
    type Err = UnknownNameError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        if name == Self::LeaveOut.name() {
            return Ok(Self::LeaveOut);
        }
        name.parse().map(Self::Wrap).map_err(|error| {
            let mut error: UnknownNameError = error;
            error.known = Self::ALL.map(Self::name).to_vec();
            error
        })
    }
}

/// The treatment of times outside the keys of a clip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Outside {
    /// Before the first key.
    pub before: OutsideValue,
    /// After the last key.
    pub after: OutsideValue,
}

/// Samples without those that are left out.
#[derive(Debug, Clone)]
pub struct KeptSamples {
    /// The times that are kept [s]; frames of a rate stay frames of this rate.
    pub samples: SampleTimes,
    /// The number of times before.
    pub all: usize,
    /// How many are left out.
    pub left_out: usize,
}

/// Why no time of a clip is kept.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OutsideError {
    /// The sample times are invalid for the clip.
    #[error(transparent)]
    Samples(#[from] SampleTimesError),
    /// All sample times are outside the keys. The numbers are seconds.
    #[error(
        "none of the requested times, {} to {} s, lies between its keys, {} to {} s",
        asked[0], asked[1], keys[0], keys[1]
    )]
    NothingInCommon {
        /// The first and the last time.
        asked: [f64; 2],
        /// The first and the last key.
        keys: [f64; 2],
    },
}

impl Outside {
    /// Whether times before the first and after the last key are left out.
    #[must_use]
    pub fn leaves_out(self) -> [bool; 2] {
        [self.before, self.after].map(|it| it == OutsideValue::LeaveOut)
    }

    /// Whether the values of the first and of the last key are held, which is the default.
    #[must_use]
    pub fn is_default(self) -> [bool; 2] {
        [self.before, self.after].map(|it| it == OutsideValue::default())
    }

    /// The time at which the samples of a clip end, in seconds of its set: `end`, or the last key if `end` is `None`.
    #[must_use]
    pub fn end(self, end: Option<f64>, clip: &Motion) -> f64 {
        let last = clip.set.time_span().map_or(0.0, |span| span.1);
        match self.leaves_out() {
            [_, true] => end.map_or(last, |end| end.min(last)),
            [_, false] => end.unwrap_or(last),
        }
    }

    /// The samples without those that are left out, for times that all tracks share. `rate` is the rate whose frames
    /// the samples are, if there is one.
    ///
    /// # Errors
    /// When none is left.
    pub fn kept(
        self,
        samples: SampleTimes,
        rate: Option<FrameRate>,
        clip: &Motion,
    ) -> Result<KeptSamples, OutsideError> {
        let leaves = self.leaves_out();
        let whole = |samples| KeptSamples {
            samples,
            all: 0,
            left_out: 0,
        };
        let (true, Some((first, last))) = (leaves != [false; 2], clip.set.time_span()) else {
            return Ok(whole(samples));
        };
        let timeline = samples.resolve(clip.set.track_count(), clip.set.time_span())?;
        let is_left_out = |time: f64| leaves[0] && time < first || leaves[1] && time > last;
        let kept: Vec<f64> = timeline.times(0).filter(|&it| !is_left_out(it)).collect();
        let (Some(&start), Some(&end)) = (kept.first(), kept.last()) else {
            return Err(nothing_in_common(timeline.times(0), clip));
        };
        let all = timeline.len();
        let left_out = all - kept.len();
        if left_out == 0 {
            return Ok(whole(samples));
        }
        let samples = match rate {
            Some(rate) => SampleTimes::rate(rate).between(start, end),
            None => SampleTimes::at(kept),
        };
        Ok(KeptSamples {
            samples,
            all,
            left_out,
        })
    }

    /// Refuses times that all lie outside the keys, where values do not depend on time.
    ///
    /// # Errors
    /// When no time has a value that depends on time.
    pub fn check_common(self, times: &[f64], clip: &Motion) -> Result<(), OutsideError> {
        let Some((first, last)) = clip.set.time_span() else {
            return Ok(());
        };
        let says_something = |&time: &f64| {
            (time >= first || self.before.is_motion()) && (time <= last || self.after.is_motion())
        };
        match times.is_empty() || times.iter().any(says_something) {
            true => Ok(()),
            false => Err(nothing_in_common(times.iter().copied(), clip)),
        }
    }
}

fn nothing_in_common(times: impl Iterator<Item = f64>, clip: &Motion) -> OutsideError {
    let asked = times.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], time| {
        [low.min(time), high.max(time)]
    });
    let (first, last) = clip.set.time_span().unwrap_or((0.0, 0.0));
    let of_clock = |times: [f64; 2]| times.map(|time| time + clip.time_offset as f64);
    OutsideError::NothingInCommon {
        asked: of_clock(asked),
        keys: of_clock([first, last]),
    }
}
