//! Where samples lie among the keys of a track, for rotations that are worked out from the
//! two keys beside them. Tracks that share their times share it.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use std::ops::Range;

use crate::math::canonical::{frame_number, round_f32};
use crate::shader::IS_KEY;
use crate::shader::KeySample;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::time::frame_clock::{FrameClock, finite_scale, in_frames};
use crate::time::frames::FramesError;
use crate::time::interval_block::Occupied;
use crate::time::runs::COUNTABLE;
use crate::tracks::track_keys::TrackKeys;

/// Boundaries, or samples, worked out together.
const LANES: usize = 64;

/// Where the frames of a window lie; what it needs to find out is kept.
pub(crate) struct FramePlan<'a> {
    times: &'a [f64],
    clock: Option<FrameClock>,
    window: Range<usize>,
    samples: Vec<KeySample>,
    boundaries: Boundaries,
}

impl<'a> FramePlan<'a> {
    pub(crate) fn new() -> Self {
        Self {
            times: &[],
            clock: None,
            window: 0..0,
            samples: Vec::new(),
            boundaries: Boundaries {
                times: [0.0; LANES],
                count: 0,
                clock: None,
                frames: [0.0; LANES + 1],
                firsts: [0; LANES],
                on_frame: [0; LANES],
                wholes: [0.0; LANES],
                scales: [0.0; LANES],
                offsets: [0.0; LANES],
                occupied: Occupied::default(),
            },
        }
    }

    /// The samples of a window, their keys counted from the first of those given; found out
    /// unless that is known already.
    pub(crate) fn samples(
        &mut self,
        of: TrackKeys<'a>,
        clock: FrameClock,
        window: &Range<usize>,
    ) -> Result<&[KeySample], FramesError> {
        let times = of.times;
        if std::ptr::eq(self.times, times) && self.clock == Some(clock) && self.window == *window {
            return Ok(&self.samples);
        }
        self.times = &[];
        let (from, to) = (window.start as i64, window.end as i64);
        let last = times.len() - 1;
        self.samples.clear();
        self.samples.resize(window.len(), held(0));
        self.boundaries.clock = Some(clock);
        // Each block starts with the boundary that the one before it ended with.
        let mut end = 0;
        for block in (0..last.max(1)).step_by(LANES - 1) {
            let own = &times[block..times.len().min(block + LANES)];
            self.boundaries.times[..own.len()].copy_from_slice(own);
            self.boundaries.count = own.len();
            in_lanes(&mut self.boundaries);
            let bounds = &self.boundaries;
            end = bounds.firsts[own.len() - 1];
            if bounds.firsts[0] >= to {
                break;
            }
            for j in bounds.occupied {
                let first = bounds.firsts[j];
                let own = first.max(from)..bounds.firsts[j + 1].min(to);
                if own.is_empty() {
                    continue;
                }
                let frames = bounds.frames[j + 1] - bounds.frames[j];
                let (whole, scale) = (bounds.wholes[j], bounds.scales[j]);
                let distance = |sample: i64| sample as f64 - whole;
                if frames >= COUNTABLE
                    && (distance(own.start).abs() >= COUNTABLE
                        || distance(own.end - 1).abs() >= COUNTABLE)
                {
                    return Err(FramesError::GapTooLong {
                        track: of.index,
                        key: of.first_key + block + j,
                        frames,
                    });
                }
                let (key, offset) = (block + j, bounds.offsets[j]);
                let at = |sample: i64| KeySample {
                    key: key as u32,
                    parameter: distance(sample) as f32 * scale + offset,
                };
                let places = (own.start - from) as usize..(own.end - from) as usize;
                let samples = &mut self.samples[places];
                if let [only] = samples {
                    *only = at(own.start);
                } else {
                    for (place, sample) in samples.iter_mut().zip(own.clone()) {
                        *place = at(sample);
                    }
                }
                if bounds.on_frame[j] == 1 && own.start == first {
                    samples[0] = held(key);
                }
            }
        }
        if end < to {
            self.samples[(end.max(from) - from) as usize..].fill(held(last));
        }
        (self.times, self.clock, self.window) = (times, Some(clock), window.clone());
        Ok(&self.samples)
    }
}

/// Where intervals start, in frames, and how the parameter runs through them.
struct Boundaries {
    times: [f64; LANES],
    count: usize,
    clock: Option<FrameClock>,
    /// One more than there are.
    frames: [f64; LANES + 1],
    /// The first whole frame not before each.
    firsts: [i64; LANES],
    /// Whether that is the boundary itself: 1 or 0.
    on_frame: [i64; LANES],
    /// As in `InFrames`, of the interval from each to the next.
    wholes: [f64; LANES],
    scales: [f32; LANES],
    offsets: [f32; LANES],
    /// The intervals that hold a frame.
    occupied: Occupied,
}

impl InLanes for Boundaries {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let Some(clock) = self.clock else { return };
        // Whole vectors, or those left over would be done one by one.
        let count = self.count.next_multiple_of(8).min(LANES);
        let times = &self.times[..count];
        let (frames, firsts) = (&mut self.frames[..count], &mut self.firsts[..count]);
        let on_frame = &mut self.on_frame[..count];
        for j in 0..count {
            let boundary = clock.boundary(times[j]);
            frames[j] = boundary.frame;
            firsts[j] = frame_number(boundary.first);
            on_frame[j] = i64::from(boundary.first == boundary.frame);
        }
        let (frames, next) = (&self.frames[..count], &self.frames[1..=count]);
        let (wholes, scales) = (&mut self.wholes[..count], &mut self.scales[..count]);
        let offsets = &mut self.offsets[..count];
        for j in 0..count {
            let span = in_frames(frames[j], next[j], 1.0);
            wholes[j] = span.whole;
            scales[j] = span.scale;
            offsets[j] = span.offset;
        }
        let mut occupied = 0;
        for j in 0..LANES - 1 {
            occupied |= u64::from(self.firsts[j] < self.firsts[j + 1]) << j;
        }
        // Behind the last boundary there is no interval.
        self.occupied = Occupied(occupied & ((1 << (self.count - 1)) - 1));
    }
}

/// Where times lie among keys. What an interval makes of them is kept for the next time in
/// it: many tracks share their times, and a division takes longer than to look.
pub(crate) struct TimePlan {
    start: f64,
    end: f64,
    middle: f64,
    scale: f32,
}

impl TimePlan {
    pub(crate) fn new() -> Self {
        Self {
            start: f64::NAN,
            end: f64::NAN,
            middle: 0.0,
            scale: 0.0,
        }
    }

    /// Where a time lies among keys; `near` is the key to look at first.
    #[inline(always)]
    pub(crate) fn sample(&mut self, starts: &[f64], time: f64, near: usize) -> KeySample {
        let key = key_before(starts, time, near);
        if key & IS_KEY != 0 {
            return KeySample {
                key,
                parameter: 0.0,
            };
        }
        let (start, end) = (starts[key as usize], starts[key as usize + 1]);
        KeySample {
            key,
            parameter: self.parameter(start, end, time),
        }
    }

    /// The parameter of a time between two keys.
    #[inline(always)]
    fn parameter(&mut self, start: f64, end: f64, time: f64) -> f32 {
        if self.start != start || self.end != end {
            let seconds = end - start;
            *self = Self {
                start,
                end,
                middle: start + seconds * 0.5,
                scale: finite_scale(1.0 / seconds),
            };
        }
        round_f32(time - self.middle) * self.scale + 0.0
    }
}

/// The key before a time, which is the rotation itself where it carries IS_KEY; `near` is the
/// one to look at first.
#[inline(always)]
pub(crate) fn key_before(starts: &[f64], time: f64, near: usize) -> u32 {
    let last = starts.len() - 1;
    let holds = |key: usize| starts[key] <= time && time < starts[key + 1];
    // Times mostly increase: there and next before searching.
    let key = if near < last && holds(near) {
        near
    } else if time >= starts[last] {
        return IS_KEY | last as u32;
    } else if time < starts[0] {
        return IS_KEY;
    } else if near + 1 < last && holds(near + 1) {
        near + 1
    } else {
        starts.partition_point(|&start| start <= time) - 1
    };
    key as u32 | if time == starts[key] { IS_KEY } else { 0 }
}

/// A sample that is a key itself.
#[inline(always)]
fn held(key: usize) -> KeySample {
    KeySample {
        key: IS_KEY | key as u32,
        parameter: 0.0,
    }
}

/// Times that have been looked up, of which the parameters are worked out together.
pub(crate) struct TimeLanes {
    /// What gives each: of no concern here.
    pub(crate) sources: [u32; Self::LEN],
    times: [f64; Self::LEN],
    starts: [f64; Self::LEN],
    ends: [f64; Self::LEN],
    pub(crate) count: usize,
}

impl TimeLanes {
    pub(crate) const LEN: usize = LANES;

    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            sources: [0; Self::LEN],
            times: [0.0; Self::LEN],
            starts: [0.0; Self::LEN],
            ends: [1.0; Self::LEN],
            count: 0,
        }
    }

    /// Adds a time between two others.
    #[inline(always)]
    pub(crate) fn push(&mut self, source: u32, time: f64, start: f64, end: f64) {
        let lane = self.count % Self::LEN;
        self.sources[lane] = source;
        self.times[lane] = time;
        (self.starts[lane], self.ends[lane]) = (start, end);
        self.count = lane + 1;
    }

    /// Where between its two others each lies, as `TimePlan::parameter`.
    #[inline(always)]
    pub(crate) fn parameters(&self) -> [f32; Self::LEN] {
        let mut parameters = [0.0; Self::LEN];
        for lane in 0..Self::LEN {
            let seconds = self.ends[lane] - self.starts[lane];
            let middle = self.starts[lane] + seconds * 0.5;
            let scale = finite_scale(1.0 / seconds);
            parameters[lane] = round_f32(self.times[lane] - middle) * scale + 0.0;
        }
        parameters
    }
}
