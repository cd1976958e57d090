//! From seconds to frames, in f64: where spans start and end among the frames, and how the
//! parameter of a sample follows from its frame number.

use crate::math::canonical::{nearest_whole, round_f32};
use crate::time::frame_rate::FrameRate;
use crate::time::wrap::TrackCopy;

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

/// Converts the key times of a track, or of one of its copies, to frame coordinates, in f64 and by an
/// exact frame rate.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct FrameClock {
    rate: FrameRate,
    start: f64,
    /// As in [`TrackCopy`]; 1 and 0 for the track itself.
    sign: f64,
    offset: f64,
    /// How far the rounding of a time to f64 may move a key, in frames.
    rounding: f64,
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
    /// `latest` is the largest time that will be converted, in seconds.
    pub(crate) fn new(rate: FrameRate, start: f64, latest: f64) -> Self {
        let rounding = 4.0 * f64::EPSILON * rate.frames_in(latest.abs().max(start.abs()));
        Self {
            rate,
            start,
            sign: 1.0,
            offset: 0.0,
            rounding,
        }
    }

    /// The same in a copy of the track.
    #[inline]
    pub(crate) fn in_copy(self, copy: &TrackCopy) -> Self {
        Self {
            sign: copy.sign,
            offset: copy.offset,
            rounding: self.rounding + 4.0 * f64::EPSILON * copy.offset.abs(),
            ..self
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
        let exact = self.rate.frames_in(time - self.start) * self.sign + self.offset;
        let whole = nearest_whole(exact);
        let is_whole = (exact - whole).abs() <= self.rounding;
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
    pub(crate) fn own_time(self, frame: usize) -> Option<f64> {
        let is_own = self.sign == 1.0 && self.offset == 0.0;
        is_own.then(|| self.start + self.rate.time_of(frame as u64))
    }

    /// Frames per second, as f64 has it.
    pub(crate) fn rate(self) -> f64 {
        self.rate.frames_in(1.0)
    }
}
