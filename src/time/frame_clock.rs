//! From seconds to frames, in f64: where spans start and end among the frames, and how the
//! parameter of a sample follows from its frame number.

use std::ops::Range;

use crate::math::canonical::{nearest_whole, round_f32};
use crate::time::frame_rate::FrameRate;
use crate::time::moment::Moment;

/// How the parameter of a frame within a span follows from the frame's number.
pub(crate) struct InFrames {
    /// The whole frame nearest to the span's middle.
    pub(crate) whole: f64,
    /// parameter = (frame - whole) × scale + offset
    pub(crate) scale: f32,
    pub(crate) offset: f32,
}

/// The constants of a span between two frame coordinates, over which the parameter grows by
/// `extent`: 1, or -1 for a span that runs backwards.
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

/// Rounds a scale to a finite f32. Only a segment far shorter than a frame exceeds f32; it holds at
/// most the frame at distance 0, for which an infinite scale would give NaN.
#[inline(always)]
pub(crate) fn finite_scale(scale: f64) -> f32 {
    let largest = f64::from(f32::MAX);
    round_f32(if scale < largest { scale } else { largest })
}

/// Two moments this close, in seconds, are one: 2^-33, so that a joint that turns 50 times a second is
/// at most 4e-8 rad off.
pub(crate) const RESOLUTION: f64 = 1.0 / (1u64 << 33) as f64;

/// When frame 0 is, and the magnitude of a time up to which all times are taken to be rounded alike: that
/// of frame 0, and at least [`CLIP`]. It does not depend on the set: a track has the same bits alone and beside others.
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

/// Times of a clip up to this long, in seconds, were often summed up, and have the rounding of its end.
const CLIP: f64 = 64.0;

/// By how much the rounding of times of this magnitude may have moved a key, in seconds: times are often
/// sums or products, so a few steps
/// of f64. From two days on that would be longer than [`RESOLUTION`], and there a curve is evaluated where
/// its frame lies. Only where keys are `held` until the next one, and the rounding decides which of two is shown,
/// is a key moved by up to a step of its f64.
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

/// Converts the key times of a track, or of one of its copies, to frame coordinates, in f64 and by an
/// exact frame rate.
///
/// It is the same for all parts of a track: they agree where they meet.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct FrameClock {
    rate: FrameRate,
    /// When frame 0 is.
    start: f64,
    /// The track's time from which frames are counted, and its frame coordinate.
    origin: f64,
    at_origin: f64,
    /// -1 in a copy that runs backwards.
    sign: f64,
    /// Whether keys are held until the next one.
    steps: bool,
    /// The magnitude of a time up to which all are rounded alike.
    latest: f64,
    per_second: f64,
}

/// Where one span ends and the next starts.
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

    /// The same in a copy of the track.
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

    /// Whether frames run against the track's own time: intervals are met from the last to the
    /// first, and the parameter falls.
    #[inline]
    pub(crate) fn is_reversed(self) -> bool {
        self.sign < 0.0
    }

    /// A time that is within its rounding of a whole frame counts as that frame, so that a sample
    /// on a key returns the key even at hour 24.
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

/// Where a copy lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum CopyPosition {
    /// It is the track itself.
    Track,
    /// The track's first key, at `first` seconds, lies at the frame coordinate `at_first` in it.
    Frames {
        first: f64,
        at_first: f64,
        backwards: bool,
    },
    /// The track's time at the copy's only sample: copies that are too short, or too far out, to be laid
    /// out in frames.
    At(Moment),
}

impl TrackCopy {
    /// The track itself.
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
