//! Conversion from seconds to frames, in f64: the starts and ends of spans in frames, and the parameter of a sample
//! from its frame number.

use std::ops::Range;

use crate::math::canonical::{nearest_whole, round_f32};
use crate::time::frame_rate::FrameRate;
use crate::time::moment::Moment;

/// The parameter of a frame within a span as a function of the frame's number.
pub(crate) struct InFrames {
    /// The whole frame nearest to the span's middle.
    pub(crate) whole: f64,
    /// parameter = (frame - whole) × scale + offset
    pub(crate) scale: f32,
    pub(crate) offset: f32,
}

/// The constants of a span between two frame coordinates, over which the parameter increases by `extent`: 1, or -1
/// for a span that runs backwards.
#[inline(always)]
pub(crate) fn in_frames(from: f64, to: f64, extent: f64) -> InFrames {
    let middle = (from + to) * 0.5;
    let scale = extent / (to - from);
    let whole = nearest_whole(middle);
    InFrames {
        whole,
        scale: finite_scale(scale),
        offset: round_f32((whole - middle) * scale),
    }
}

/// The parameter of a time within a span as a function of the seconds from the span's start.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InSeconds {
    /// A power of two, by which seconds are multiplied before they are rounded to f32. It is 1 unless the span is so
    /// short that [`round_f32`] would change its seconds to 0, or so long that it would change the scale to 0: then all
    /// samples would be at the middle.
    pub(crate) unit: f64,
    /// Half the span's length, in seconds times `unit`.
    pub(crate) half: f64,
    /// parameter = (seconds × unit - half) × scale
    pub(crate) scale: f32,
}

impl InSeconds {
    /// The parameter of a time, from its seconds after the span's start.
    #[inline(always)]
    pub(crate) fn parameter(self, seconds: f64) -> f32 {
        round_f32(seconds * self.unit - self.half) * self.scale + 0.0
    }
}

/// The constants of a span of this length.
#[inline(always)]
pub(crate) fn in_seconds(seconds: f64) -> InSeconds {
    let unit = match (SHORT..=LONG).contains(&seconds) {
        true => 1.0,
        false => reciprocal_power_of_two(seconds),
    };
    let length = seconds * unit;
    InSeconds {
        unit,
        half: length * 0.5,
        scale: finite_scale(1.0 / length),
    }
}

/// In spans of 2^-40 s to 2^62 s, distances are counted in seconds. The reciprocals of such spans are at least 2^-62, so
/// they are not flushed. Distances below 2^-64 s become 0, which changes the parameter by less than its rounding.
const SHORT: f64 = 1.0 / (1u64 << 40) as f64;
const LONG: f64 = (1u64 << 62) as f64;

/// One divided by the largest power of two that does not exceed `x`, which is positive; at most 2^1023.
#[cold]
fn reciprocal_power_of_two(x: f64) -> f64 {
    const BIAS: u64 = 1023;
    let exponent = x.to_bits() >> 52;
    f64::from_bits((2 * BIAS - exponent.min(2 * BIAS - 1)) << 52)
}

/// Rounds a scale to a finite f32. Only a segment much shorter than a frame exceeds f32; it contains at most the
/// frame at distance 0, for which an infinite scale would give NaN.
#[inline(always)]
pub(crate) fn finite_scale(scale: f64) -> f32 {
    let largest = f64::from(f32::MAX);
    round_f32(if scale < largest { scale } else { largest })
}

/// Two times that are at most this far apart, in seconds, count as the same: 2^-33, so that the error of a joint with
/// 50 rotations per second is at most 4e-8 rad.
pub(crate) const RESOLUTION: f64 = 1.0 / (1u64 << 33) as f64;

/// The time of frame 0, and the magnitude of a time up to which all times are assumed to have the same rounding: the
/// larger of frame 0's and [`CLIP`]. It does not depend on the set: a track has the same bits alone and together with
/// others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrameStart {
    pub(crate) seconds: f64,
    pub(crate) latest: f64,
}

impl FrameStart {
    pub(crate) fn new(seconds: f64) -> Self {
        let latest = seconds.abs().max(CLIP);
        Self { seconds, latest }
    }
}

/// Times of a clip up to this length, in seconds, are often sums, and have the rounding of the clip's end.
const CLIP: f64 = 64.0;

/// The distance by which the rounding of times of this magnitude may have moved a key, in seconds: times are often
/// sums or products, so it is a few steps of f64. From two days on this would be more than [`RESOLUTION`]; there a
/// curve is evaluated at the time of its frame. Only if keys are `held` until the next one, so that rounding decides
/// between two keys, is a key moved by up to a step of its f64.
#[inline(always)]
pub(crate) fn rounding(magnitude: f64, held: bool) -> f64 {
    let rounded_steps = 4.0 * f64::EPSILON * magnitude;
    let step = if held { f64::EPSILON * magnitude } else { 0.0 };
    let limit = if step > RESOLUTION { step } else { RESOLUTION };
    if rounded_steps < limit {
        rounded_steps
    } else {
        limit
    }
}

/// Converts the key times of a track, or of one of its copies, to frame coordinates, in f64 and with an exact frame
/// rate.
///
/// The clock is the same for all parts of a track, so that they agree where they meet.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct FrameClock {
    rate: FrameRate,
    /// The time of frame 0.
    start: f64,
    /// The time of the track from which frames are counted, and its frame coordinate.
    origin: f64,
    at_origin: f64,
    /// -1 in a copy that runs backwards.
    sign: f64,
    /// Whether keys are held until the next one.
    steps: bool,
    /// The magnitude of a time up to which all times are rounded in the same way.
    latest: f64,
    per_second: f64,
}

/// The end of one span and the start of the next.
#[derive(Clone, Copy)]
pub(crate) struct Boundary {
    /// Its frame coordinate.
    pub(crate) frame: f64,
    /// The first whole frame not before it.
    pub(crate) first: f64,
}

impl FrameClock {
    /// `steps` is whether the track's keys are held until the next one.
    pub(crate) fn new(rate: FrameRate, start: FrameStart, steps: bool) -> Self {
        let FrameStart { seconds, latest } = start;
        Self {
            rate,
            start: seconds,
            origin: seconds,
            at_origin: 0.0,
            sign: 1.0,
            steps,
            latest,
            per_second: rate.frames_in(1.0),
        }
    }

    /// The clock for a copy of the track.
    #[inline]
    pub(crate) fn in_copy(self, copy: &TrackCopy) -> Self {
        match copy.position {
            CopyPosition::Track | CopyPosition::At(_) => self,
            CopyPosition::Frames {
                first,
                at_first,
                backwards,
            } => {
                let latest = self.latest + at_first.abs() / self.rate.per_second();
                Self {
                    origin: first,
                    at_origin: at_first,
                    sign: if backwards { -1.0 } else { 1.0 },
                    latest,
                    ..self
                }
            }
        }
    }

    /// Whether frames run against the track's time: intervals are processed from the last to the first, and the
    /// parameter decreases.
    #[inline]
    pub(crate) fn is_reversed(self) -> bool {
        self.sign < 0.0
    }

    /// Converts a time to a boundary. A time that is within its rounding of a whole frame counts as that frame, so
    /// that a sample at a key is the key even at hour 24.
    #[inline(always)]
    pub(crate) fn boundary(self, time: f64) -> Boundary {
        let exact = self.rate.frames_in(time - self.origin) * self.sign + self.at_origin;
        let whole = nearest_whole(exact);
        let magnitude = time.abs();
        let latest = self.latest;
        let magnitude = if magnitude > latest {
            magnitude
        } else {
            latest
        };
        let moved = rounding(magnitude, self.steps) * self.per_second;
        let is_whole = (exact - whole).abs() <= moved;
        let frame = if is_whole { whole } else { exact };
        let first = if whole < frame { whole + 1.0 } else { whole };
        Boundary { frame, first }
    }

    /// The first frame not before a time.
    #[inline(always)]
    pub(crate) fn first_frame(self, time: f64) -> f64 {
        let first = self.boundary(time).first;
        if first > 0.0 { first } else { 0.0 }
    }

    /// The track's time at a frame; `None` in a copy.
    #[inline]
    pub(crate) fn time_of_track(self, frame: usize) -> Option<f64> {
        let is_track = self.sign == 1.0 && self.origin == self.start && self.at_origin == 0.0;
        is_track.then(|| self.start + self.rate.time_of(frame as u64))
    }

    /// Frames per second, as f64 has it.
    pub(crate) fn rate(self) -> f64 {
        self.rate.frames_in(1.0)
    }
}

/// Consecutive samples that lie in one copy of a track.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrackCopy {
    pub(crate) samples: Range<usize>,
    pub(crate) position: CopyPosition,
}

/// The position of a copy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum CopyPosition {
    /// It is the track itself.
    Track,
    /// The track's first key, at `first` seconds, is at the frame coordinate `at_first` in it.
    Frames {
        first: f64,
        at_first: f64,
        backwards: bool,
    },
    /// The track's time at the copy's only sample, for copies that are too short or too distant to be computed in
    /// frames.
    At(Moment),
}

impl TrackCopy {
    /// The track itself, neither shifted nor mirrored.
    pub(crate) fn of_track(samples: Range<usize>) -> Self {
        Self {
            samples,
            position: CopyPosition::Track,
        }
    }

    pub(crate) fn is_track(&self) -> bool {
        self.position == CopyPosition::Track
    }

    pub(crate) fn is_backwards(&self) -> bool {
        matches!(
            self.position,
            CopyPosition::Frames {
                backwards: true,
                ..
            }
        )
    }
}
