//! Prepares smooth curves: collects intervals of as many tracks as it takes to fill a block,
//! computes their curves by the method's functions, and has them fitted.

use std::ops::Range;

use crate::curve::options::{Ends, Quantity, Speed};
use crate::fit::double::handles::{FramesHeld, Steps};
use crate::fit::double::intervals::{Intervals, LANES, Stretch};
use crate::math::canonical::round_quat;
use crate::math::quaternion::Vector;
use crate::method::interpolation::Interpolation;
use crate::method::{Given, Smooth};
use crate::prepare::constant_speed::{Waiting, retime};
use crate::prepare::direct::Direct;
use crate::prepare::fitting::Fitting;
use crate::prepare::preparation::Prepare;
use crate::prepare::prepared::Prepared;
use crate::simd::dispatch::in_lanes;
use crate::time::frame_clock::FrameClock;
use crate::time::frame_rate::FrameRate;
use crate::time::spans::{NONE, Source};
use crate::time::wrap::WrapMode;
use crate::tracks::set::{Track, TrackSet};
use crate::tracks::signs::Signs;

/// The angular velocity and the angular acceleration of a track that stands still.
const STILL: [f32; 4] = [0.0; 4];

/// The lanes of context that a stretch needs beside those of its intervals.
const CONTEXT: usize = 2;

/// No stretch with fewer intervals than this is begun at the end of a block, unless
/// it is all that is left of its track.
const SHORTEST: usize = 8;

/// Prepares smooth curves; its blocks are made once for many tracks.
pub(crate) struct SmoothPreparation {
    interpolation: Interpolation,
    smooth: Smooth,
    intervals: Intervals,
    stretches: Vec<Stretch>,
    fitting: Fitting,
    /// Prepares curves straight from keys in f32, if method and options allow it.
    direct: Option<Box<Direct>>,
    /// Curves that are traversed at constant speed, until their whole track is there.
    waiting: Vec<Waiting>,
    /// The frames' rate and start, if only intervals that contain a frame are wanted.
    frames: Option<(FrameRate, f64)>,
}

impl SmoothPreparation {
    pub(crate) fn new(interpolation: &Interpolation, smooth: Smooth) -> Self {
        let path = interpolation.method.path.unwrap_or(interpolation.path);
        let suits =
            interpolation.quantity == Quantity::Rotation && interpolation.speed == Speed::AsKeyed;
        let direct = smooth.direct.filter(|_| suits);
        Self {
            direct: direct.map(|how| Box::new(Direct::new(how, smooth, interpolation.ends))),
            interpolation: Interpolation {
                path,
                ..*interpolation
            },
            smooth,
            intervals: Intervals::new(smooth.shape.own),
            stretches: Vec::new(),
            fitting: Fitting::new(smooth.shape, interpolation.quantity),
            waiting: Vec::new(),
            frames: None,
        }
    }
}

impl Prepare for SmoothPreparation {
    fn only_frames(&mut self, frames: Option<(FrameRate, f64)>) {
        self.frames = frames;
    }

    fn add(
        &mut self,
        prepared: &mut Prepared,
        set: &TrackSet,
        index: usize,
        intervals: Range<usize>,
    ) {
        let track = set.track(index);
        let signs = self.interpolation.path.signs(set, index);
        let all = track.keys.len() - 1;
        let first_key = prepared.constants.len() as u32;
        let of_rotations = self.interpolation.quantity == Quantity::Rotation;
        // A curve that does not pass through its keys has end values of its own.
        let meets_keys = of_rotations && self.interpolation.method.interpolates || all == 0;
        let last_key = first_key + intervals.len() as u32;
        // Intervals that stand still are held at a key, so the keys are stored for them too.
        if of_rotations && (meets_keys || self.is_frozen()) {
            let keys = &track.keys[intervals.start..=intervals.end];
            prepared
                .constants
                .extend_from_slice(bytemuck::cast_slice(keys));
        } else if meets_keys {
            prepared.constant(STILL);
        }
        let held = |key: u32, outside: WrapMode| {
            let goes_on = self.goes_on(outside) && all > 0;
            if meets_keys && !goes_on { key } else { NONE }
        };
        let held = [
            held(first_key, self.interpolation.before),
            held(last_key, self.interpolation.after),
        ];
        let part = prepared.parts.len();
        prepared.push_part(index, track.times, &intervals, 0..0, held);
        let looped = matches!(self.interpolation.ends, Ends::Loop);
        // Two keys are joined by constant velocity, whatever lies beside them.
        let alone = all == 1 && self.interpolation.method.interpolates;
        let context = if alone { 0 } else { CONTEXT };
        let velocities = match self.smooth.given {
            Given::Velocities(solve) => solve(track, signs, intervals.clone(), &self.interpolation),
            _ => Vec::new(),
        };
        let mut from = intervals.start;
        while from < intervals.end {
            let left = intervals.end - from;
            if self.intervals.count + context + left.min(SHORTEST) > LANES {
                self.flush(prepared);
            }
            let to = from + left.min(LANES - context - self.intervals.count);
            // Across the seam of a loop, keys are multiplied by the last key's sign, so that they
            // continue the signs on this side.
            let beyond = signs.sign(all);
            if context > 0 {
                match from.checked_sub(1) {
                    Some(before) => self.push(track, signs, before..before + 1, None),
                    None if looped => self.push_beyond(track, signs, all - 1, beyond),
                    None => self.intervals.push_nothing(),
                }
            }
            let own_key = first_key + (from - intervals.start) as u32;
            self.stretches.push(Stretch {
                lane: self.intervals.count,
                intervals: from..to,
                all,
                span: (track.times[0], track.times[all]),
                part,
                key: if meets_keys { own_key } else { NONE },
                still: if self.is_frozen() { own_key } else { NONE },
            });
            let own = velocities.get(from - intervals.start..);
            self.push(track, signs, from..to, own);
            if context > 0 {
                match to < all {
                    true => self.push(track, signs, to..to + 1, None),
                    false if looped => self.push_beyond(track, signs, 0, beyond),
                    false => self.intervals.push_nothing(),
                }
            }
            from = to;
        }
    }

    fn finish(&mut self, prepared: &mut Prepared) {
        self.flush(prepared);
        if let Some(direct) = &mut self.direct {
            direct.finish(prepared, &mut self.fitting);
        }
        retime(prepared, &mut self.waiting, &mut self.fitting);
        self.waiting.clear();
        self.fitting.finish(prepared);
    }
}

impl SmoothPreparation {
    /// Adds an interval from the other side of a loop's seam as context, with its keys multiplied
    /// by `sign`.
    fn push_beyond(&mut self, track: Track, signs: Signs<'_>, interval: usize, sign: f32) {
        let lane = self.intervals.count;
        self.push(track, signs, interval..interval + 1, None);
        self.intervals.turn(lane, sign);
    }

    /// Adds some intervals of a track. `velocities` starts with the velocity at the first
    /// interval's first key.
    fn push(
        &mut self,
        track: Track,
        signs: Signs<'_>,
        intervals: Range<usize>,
        velocities: Option<&[Vector]>,
    ) {
        let first = self.intervals.count;
        self.intervals.push(track, signs, intervals.clone());
        for (i, interval) in intervals.enumerate() {
            let velocities = velocities.and_then(|all| all.get(i..));
            let Some([outward, inward]) = self.given(track, interval, velocities) else {
                break; // the method has no numbers of its own for any interval
            };
            self.intervals.set_given(first + i, outward, inward);
        }
    }

    /// The method's own numbers for an interval. `velocities` starts with the velocity at its first
    /// key.
    fn given(
        &self,
        track: Track,
        interval: usize,
        velocities: Option<&[Vector]>,
    ) -> Option<[[f64; 4]; 2]> {
        match (self.smooth.given, velocities) {
            (Given::Numbers(numbers), _) => Some(numbers(track, interval, &self.interpolation)),
            (Given::Velocities(_), Some([first, second, ..])) => {
                Some([first, second].map(|&[x, y, z]| [x, y, z, 0.0]))
            }
            _ => None,
        }
    }

    /// Computes the curves of the intervals that wait, and has them fitted.
    fn flush(&mut self, prepared: &mut Prepared) {
        let is_exact = self.curves();
        let stretches = std::mem::take(&mut self.stretches);
        for stretch in &stretches {
            self.end_values(prepared, stretch);
            self.beyond(prepared, stretch);
            let latest = prepared.parts[stretch.part].end;
            let holds_frame = self.frames.map(|(rate, start)| {
                let mut held = FramesHeld {
                    clock: FrameClock::new(rate, start, latest),
                    intervals: &self.intervals,
                    lanes: stretch.lanes(),
                    held: [true; LANES],
                };
                in_lanes(&mut held);
                held.held
            });
            if self.interpolation.speed == Speed::Constant {
                self.wait(stretch);
            } else {
                self.push_spans(prepared, stretch, holds_frame.as_ref());
            }
        }
        if let Some(direct) = &mut self.direct {
            let (intervals, fitting) = (&mut self.intervals, &mut self.fitting);
            direct.fit(prepared, intervals, &stretches, is_exact, fitting);
        }
        self.fitting.bring(prepared, &self.intervals);
        self.intervals.clear();
        self.stretches = stretches;
        self.stretches.clear();
    }

    /// Lets the curves of a stretch wait until all of its track is there.
    fn wait(&mut self, stretch: &Stretch) {
        for (i, lane) in stretch.lanes().enumerate() {
            let quantity = self.interpolation.quantity;
            let moves = !self.holds(stretch, lane);
            let curve = || self.intervals.curve(lane, self.smooth.shape, quantity);
            self.waiting.push(Waiting {
                part: stretch.part,
                start: self.intervals.starts[lane],
                key: stretch.key_at(i),
                curve: moves.then(curve),
            });
        }
    }

    /// Makes the intervals of a stretch into spans.
    fn push_spans(
        &mut self,
        prepared: &mut Prepared,
        stretch: &Stretch,
        holds_frame: Option<&[bool; LANES]>,
    ) {
        let first_span = prepared.spans.len();
        let is_steady = stretch.all == 1 && self.interpolation.is_steady_alone();
        let lanes = stretch.lanes();
        let holds_frame = |lane: usize| holds_frame.is_none_or(|held| held[lane]);
        let all_hold = lanes.clone().all(holds_frame);
        let fits_alike = !is_steady && !self.is_frozen() && all_hold;
        if fits_alike {
            self.take(prepared, stretch, lanes.clone());
        }
        for (i, lane) in lanes.enumerate().filter(|_| !fits_alike) {
            let source = if !holds_frame(lane) {
                Source::Constant(NONE)
            } else if is_steady {
                let keys = self.intervals.keys(lane);
                self.fitting.take_steady(prepared, keys)
            } else if !self.holds(stretch, lane) {
                self.take(prepared, stretch, lane..lane + 1);
                continue;
            } else if self.interpolation.quantity == Quantity::Rotation {
                Source::Constant(stretch.still + i as u32)
            } else {
                Source::Constant(prepared.constant(STILL))
            };
            let key = match source {
                Source::Constant(_) => NONE,
                _ => stretch.key_at(i),
            };
            prepared.push_span(self.intervals.starts[lane], source, key);
        }
        let end = prepared.spans.len();
        let spans = &mut prepared.parts[stretch.part].spans;
        if spans.start == spans.end {
            spans.start = first_span;
        }
        spans.end = end;
    }

    /// Takes the curves in some lanes of a stretch: they become the next spans.
    fn take(&mut self, prepared: &mut Prepared, stretch: &Stretch, lanes: Range<usize>) {
        let key = stretch.key_at(lanes.start - stretch.lane);
        match &mut self.direct {
            Some(direct) => direct.take(prepared, &self.intervals, lanes, key),
            None => self.fitting.take(prepared, &self.intervals, lanes, key),
        }
    }

    /// Computes the curves of the intervals that wait. Returns whether they are there in f64.
    fn curves(&mut self) -> bool {
        if let Some(direct) = &mut self.direct {
            direct.find_curves(&self.intervals, &self.stretches);
            let sides = [self.interpolation.before, self.interpolation.after];
            let is_wanted = sides.into_iter().any(|side| self.goes_on(side)) || self.is_frozen();
            if !is_wanted {
                return false;
            }
        }
        in_lanes(&mut Steps(&mut self.intervals));
        let ends = self.interpolation.ends;
        (self.smooth.curves)(&mut self.intervals, &self.stretches, ends);
        true
    }

    /// Whether an interval stands still.
    fn holds(&self, stretch: &Stretch, lane: usize) -> bool {
        let at_end = stretch.first() == Some(lane) || stretch.last() == Some(lane);
        self.is_frozen() && at_end && stretch.all > 1
    }

    /// Whether tracks are extrapolated on a side with this wrap mode. A track that stands still in
    /// its first and last interval stands still outside them too.
    fn goes_on(&self, outside: WrapMode) -> bool {
        outside == WrapMode::Extrapolate && !self.is_frozen()
    }

    fn is_frozen(&self) -> bool {
        let uses_ends = self.interpolation.method.uses_neighbours;
        uses_ends && matches!(self.interpolation.ends, Ends::Frozen)
    }

    /// Adds the curves that extrapolate a track at the angular velocity of its ends, where the wrap
    /// mode asks for it.
    fn beyond(&self, prepared: &mut Prepared, stretch: &Stretch) {
        let sides = [
            (stretch.first(), self.interpolation.before, 0.0),
            (stretch.last(), self.interpolation.after, 1.0),
        ];
        for (lane, outside, t) in sides {
            let (Some(lane), true) = (lane, self.goes_on(outside)) else {
                continue;
            };
            let quantity = self.interpolation.quantity;
            let curve = self.intervals.curve(lane, self.smooth.shape, quantity);
            prepared.exact.push(curve.beyond(t));
            let place = prepared.exact.len() as u32 - 1;
            let beyond = prepared.parts[stretch.part].beyond(stretch.span);
            if t == 0.0 {
                beyond.from_before = place;
            } else {
                beyond.from_after = place;
            }
        }
    }

    /// Adds the constants held outside a curve that does not pass through its keys: its own end
    /// values for rotations, 0 for velocities and accelerations.
    fn end_values(&self, prepared: &mut Prepared, stretch: &Stretch) {
        if stretch.key != NONE {
            return;
        }
        let quantity = self.interpolation.quantity;
        let value =
            |constants: &[[f32; 4]], lane: usize, end: usize| match (self.is_frozen(), quantity) {
                (true, Quantity::Rotation) => {
                    let place = stretch.still as usize + (lane - stretch.lane) + end;
                    constants[place]
                }
                (true, _) => STILL,
                _ => {
                    let curve = self.intervals.curve(lane, self.smooth.shape, quantity);
                    round_quat(curve.value(end as f64))
                }
            };
        let held = |value| match quantity {
            Quantity::Rotation => value,
            _ => STILL,
        };
        if let (Some(lane), false) = (stretch.first(), self.goes_on(self.interpolation.before)) {
            let at_start = value(&prepared.constants, lane, 0);
            prepared.parts[stretch.part].before = prepared.constant(held(at_start));
        }
        if let Some(lane) = stretch.last() {
            let at_end = value(&prepared.constants, lane, 1);
            if !self.goes_on(self.interpolation.after) {
                let after = prepared.constant(held(at_end));
                prepared.parts[stretch.part].after = after;
            }
            if quantity != Quantity::Rotation {
                let at_end = prepared.constant(at_end);
                prepared.parts[stretch.part].beyond(stretch.span).at_end = at_end;
            }
        }
    }
}
