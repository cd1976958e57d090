//! Preparation of smooth curves: fills a block with intervals of several tracks, computes their curves by the
//! method's functions, and passes them on to be fitted.

use std::ops::Range;

use bytemuck::Zeroable as _;

use crate::curve::formula::{RotationVectorNumbers, clamped, quantity_value};
use crate::curve::options::{Axes, Ends, Quantity, Speed};
use crate::fit::block::{CONTEXT, Intervals, LANES, TrackStretch, at, put};
use crate::fit::constant_velocity::arc_polynomial;
use crate::fit::exact::fit::IntervalCurve;
use crate::fit::exact::handles::FindFrames;
use crate::fit::exact::shape::ROTATION_VECTOR;
use crate::math::dual::Dual;
use crate::math::quaternion::{Vector, rotated, round_quat};
use crate::method::interpolation::Interpolation;
use crate::method::{CurveKind, MethodInput, SmoothCurves};
use crate::prepare::constant_speed::{PendingInterval, retime};
use crate::prepare::fast::FastPreparation;
use crate::prepare::fitting::Fitting;
use crate::prepare::prepared::Prepared;
use crate::shader::PolynomialSegment;
use crate::simd::dispatch::in_lanes;
use crate::threads::stop;
use crate::time::frame_clock::{FrameClock, FrameStart};
use crate::time::frame_rate::FrameRate;
use crate::time::runs::NONE;
use crate::time::spans::SpanSource;
use crate::time::wrap::WrapMode;
use crate::tracks::set::{Track, TrackSet};
use crate::tracks::signs::Signs;

/// The angular velocity and the angular acceleration of a track that stands still.
const STILL: [f32; 4] = [0.0; 4];

/// Prepares smooth curves; its blocks are made once for many tracks.
pub(crate) struct SmoothPreparation {
    interpolation: Interpolation,
    smooth: SmoothCurves,
    intervals: Intervals,
    stretches: Vec<TrackStretch>,
    fitting: Fitting,
    /// Prepares curves directly from keys in f32, if method and options allow it.
    fast: Option<Box<FastPreparation>>,
    /// Curves that are traversed at constant speed, until their whole track is there.
    waiting: Vec<PendingInterval>,
    /// The frames' rate and start, if only intervals that contain a frame are prepared.
    pub(crate) frames: Option<(FrameRate, FrameStart)>,
}

impl SmoothPreparation {
    pub(crate) fn new(interpolation: &Interpolation, smooth: SmoothCurves) -> Self {
        let suits =
            interpolation.quantity == Quantity::Rotation && interpolation.speed == Speed::AsKeyed;
        let fast = smooth.fast.filter(|_| suits);
        Self {
            fast: fast.map(|fast| Box::new(FastPreparation::new(fast, smooth, interpolation.ends))),
            interpolation: *interpolation,
            smooth,
            intervals: Intervals::new(smooth.shape.per_curve),
            stretches: Vec::new(),
            fitting: Fitting::new(smooth.shape, interpolation.quantity),
            waiting: Vec::new(),
            frames: None,
        }
    }

    /// Adds some intervals of the track `index` of a set, as a separate part.
    pub(crate) fn add(
        &mut self,
        prepared: &mut Prepared,
        set: &TrackSet,
        index: usize,
        intervals: Range<usize>,
    ) {
        let track = set.track(index);
        let signs = self.interpolation.signs_of(track).signs(set, index);
        let all = track.keys.len() - 1;
        let first_key = prepared.constants.len() as u32;
        let of_rotations = self.interpolation.quantity == Quantity::Rotation;
        // If a curve does not pass through its keys, its end values are not its first and its last key.
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
            let is_extrapolated = self.extrapolates(outside) && all > 0;
            if meets_keys && !is_extrapolated {
                key
            } else {
                NONE
            }
        };
        let held = [
            held(first_key, self.interpolation.before),
            held(last_key, self.interpolation.after),
        ];
        let part = prepared.parts.len();
        prepared.push_part(index, track.times, &intervals, 0..0, held);
        // A curve between two keys does not depend on neighbouring keys.
        let alone = all == 1 && self.interpolation.method.interpolates;
        let context = if alone { 0 } else { CONTEXT };
        let velocities = match self.smooth.input {
            MethodInput::Velocities { solve, .. } => {
                solve(track, signs, intervals.clone(), &self.interpolation)
            }
            _ => Vec::new(),
        };
        let mut from = intervals.start;
        // If the work was stopped, the caller notices it after this function has returned.
        while from < intervals.end && !stop::is_stopped() {
            if self.intervals.count + context >= LANES {
                self.flush(prepared);
            }
            let room = LANES - context - self.intervals.count;
            let to = intervals.end.min(from + room);
            if context > 0 {
                self.push_context(track, signs, from.checked_sub(1), all - 1);
            }
            let stretch_key = first_key + (from - intervals.start) as u32;
            self.stretches.push(TrackStretch {
                lane: self.intervals.count,
                intervals: from..to,
                track_intervals: all,
                span: (track.times[0], track.times[all]),
                part,
                first_key: if meets_keys { stretch_key } else { NONE },
                first_still_key: if self.is_frozen() { stretch_key } else { NONE },
            });
            let stretch_velocities = velocities.get(from - intervals.start..);
            self.push(
                track,
                signs,
                from..to,
                stretch_velocities.unwrap_or_default(),
            );
            if context > 0 {
                self.push_context(track, signs, (to < all).then_some(to), 0);
            }
            from = to;
        }
    }

    /// Finishes the segments of all intervals that were added.
    pub(crate) fn finish(&mut self, prepared: &mut Prepared) {
        self.flush(prepared);
        if let Some(fast) = &mut self.fast {
            fast.finish(prepared, &mut self.fitting);
        }
        retime(prepared, &mut self.waiting, &mut self.fitting);
        self.waiting.clear();
        self.fitting.finish(prepared);
    }

    /// Adds an interval of a track as context. At an end of the track it is the interval at the `other` end of a
    /// loop, or an empty lane.
    fn push_context(
        &mut self,
        track: Track,
        signs: Signs<'_>,
        interval: Option<usize>,
        other: usize,
    ) {
        let lane = self.intervals.count;
        match interval {
            Some(inner) => self.push(track, signs, inner..inner + 1, &[]),
            None if self.interpolation.ends == Ends::Loop => {
                self.push(track, signs, other..other + 1, &[]);
                // Across the seam, keys are multiplied by the last key's sign, so that they continue
                // the signs on this side.
                let sign = signs.sign(track.keys.len() - 1);
                let Intervals { from, to, .. } = &mut self.intervals;
                for key in [&mut from[lane], &mut to[lane]] {
                    *key = key.map(|component| component * sign);
                }
            }
            None => self.intervals.push_nothing(),
        }
    }

    /// Adds some intervals of a track. `velocities` starts with the velocity at the first
    /// interval's first key.
    fn push(
        &mut self,
        track: Track,
        signs: Signs<'_>,
        intervals: Range<usize>,
        velocities: &[Vector],
    ) {
        let first = self.intervals.count;
        self.intervals.push(track, signs, intervals.clone());
        for (i, interval) in intervals.enumerate() {
            let [outward, inward] = match (self.smooth.input, velocities.get(i..i + 2)) {
                (MethodInput::Numbers(numbers), _) => numbers(track, interval, &self.interpolation),
                (MethodInput::Velocities { .. }, Some(both)) => {
                    [both[0], both[1]].map(|[x, y, z]| [x, y, z, 0.0])
                }
                _ => break, // the method has no numbers of its own for any interval
            };
            put(&mut self.intervals.outward, first + i, outward);
            put(&mut self.intervals.inward, first + i + 1, inward);
        }
    }

    /// Computes the curves of the collected intervals, and passes them on to be fitted.
    fn flush(&mut self, prepared: &mut Prepared) {
        let is_exact = self.find_curves();
        let stretches = std::mem::take(&mut self.stretches);
        for stretch in &stretches {
            self.add_ends(prepared, stretch);
            if self.interpolation.speed == Speed::Constant {
                self.wait(stretch);
            } else {
                self.push_spans(prepared, stretch);
            }
        }
        if let Some(fast) = &mut self.fast {
            let (intervals, fitting) = (&self.intervals, &mut self.fitting);
            fast.fit(prepared, intervals, &stretches, is_exact, fitting);
        }
        self.fitting.copy_queued(prepared, &self.intervals);
        self.intervals.count = 0;
        self.stretches = stretches;
        self.stretches.clear();
    }

    /// Computes the curves of the intervals that wait. Returns whether they were computed in f64.
    fn find_curves(&mut self) -> bool {
        if let Some(fast) = &mut self.fast {
            fast.find_curves(&self.intervals, &self.stretches);
            // Extrapolation needs the derivatives at the ends.
            let Interpolation { before, after, .. } = self.interpolation;
            if !self.extrapolates(before) && !self.extrapolates(after) {
                return false;
            }
        }
        let (intervals, ends) = (&mut self.intervals, self.interpolation.ends);
        self.smooth.find_curves(intervals, &self.stretches, ends);
        true
    }

    /// The curve in a lane, in f64.
    fn curve(&self, lane: usize) -> IntervalCurve {
        let (shape, quantity) = (self.smooth.shape, self.interpolation.quantity);
        IntervalCurve::of_interval(&self.intervals, lane, shape, quantity)
    }

    /// Collects the curves of a stretch until its whole track is complete.
    fn wait(&mut self, stretch: &TrackStretch) {
        for (i, lane) in stretch.lanes().enumerate() {
            let moves = !self.is_still(stretch, lane);
            self.waiting.push(PendingInterval {
                part: stretch.part,
                start: self.intervals.starts[lane],
                key: stretch.key_at(i),
                curve: moves.then(|| self.curve(lane)),
            });
        }
    }

    /// Makes the intervals of a stretch into spans.
    fn push_spans(&mut self, prepared: &mut Prepared, stretch: &TrackStretch) {
        let first_span = prepared.spans.len();
        let is_steady = stretch.track_intervals == 1 && self.interpolation.is_steady_alone();
        let mut has_frame = [true; LANES];
        if let Some((rate, start)) = self.frames {
            let mut frames = FindFrames {
                clock: FrameClock::new(rate, start, false),
                intervals: &self.intervals,
                lanes: stretch.lanes(),
                has_frame,
            };
            in_lanes(&mut frames);
            has_frame = frames.has_frame;
        }
        let arc_axes = self.axes_of_arc_velocities();
        let is_closed = is_steady || arc_axes.is_some();
        let is_fitted =
            |this: &Self, lane| has_frame[lane] && !is_closed && !this.is_still(stretch, lane);
        let Range {
            start: mut lane,
            end,
        } = stretch.lanes();
        while lane < end {
            let (start, i) = (self.intervals.starts[lane], lane - stretch.lane);
            let fitted = (lane..end)
                .take_while(|&lane| is_fitted(self, lane))
                .count();
            if fitted > 0 {
                self.queue(prepared, lane..lane + fitted, stretch.key_at(i));
            } else if !has_frame[lane] {
                prepared.push_span(start, SpanSource::Constant(NONE), NONE);
            } else if self.is_still(stretch, lane) {
                let constant = match self.interpolation.quantity {
                    Quantity::Rotation => stretch.first_still_key + i as u32,
                    _ => prepared.constant(STILL),
                };
                prepared.push_span(start, SpanSource::Constant(constant), NONE);
            } else if let Some(axes) = arc_axes {
                let constant = prepared.constant(self.arc_velocity(lane, axes));
                prepared.push_span(start, SpanSource::Constant(constant), NONE);
            } else {
                let keys = [self.intervals.from[lane], self.intervals.to[lane]];
                prepared.push_segment(start, arc_polynomial(keys), stretch.key_at(i));
            }
            lane += fitted.max(1);
        }
        let end = prepared.spans.len();
        let spans = &mut prepared.parts[stretch.part].spans;
        if spans.start == spans.end {
            spans.start = first_span;
        }
        spans.end = end;
    }

    /// The axes of requested angular velocities, if curves are arcs: the velocity is constant along an arc, so
    /// nothing is fitted.
    fn axes_of_arc_velocities(&self) -> Option<Axes> {
        match (
            self.interpolation.method.curves,
            self.interpolation.quantity,
        ) {
            (CurveKind::Arcs(_), Quantity::Velocity(axes)) => Some(axes),
            _ => None,
        }
    }

    /// The angular velocity of the arc in a lane.
    fn arc_velocity(&self, lane: usize, axes: Axes) -> [f32; 4] {
        let rate = 2.0 * self.intervals.rate(lane);
        let body = at(&self.intervals.logs, lane).map(|half| clamped(rate * half));
        let [x, y, z] = match axes {
            Axes::Body => body,
            Axes::Parent => rotated(self.intervals.key(lane), body),
        };
        round_quat([x, y, z, 0.0])
    }

    /// Queues the curves in some lanes to be fitted: they become the next spans. `key` is the
    /// constant at the start of the first.
    fn queue(&mut self, prepared: &mut Prepared, lanes: Range<usize>, key: u32) {
        if let Some(fast) = &mut self.fast {
            return fast.queue(prepared, &self.intervals, lanes, key);
        }
        for (i, lane) in lanes.enumerate() {
            let (start, segment) = (self.intervals.starts[lane], PolynomialSegment::zeroed());
            let key = if key == NONE { NONE } else { key + i as u32 };
            let slot = prepared.push_segment(start, segment, key);
            self.fitting.queue(&self.intervals, lane, slot);
        }
    }

    /// Whether an interval stands still.
    fn is_still(&self, stretch: &TrackStretch, lane: usize) -> bool {
        let at_end = || stretch.first() == Some(lane) || stretch.last() == Some(lane);
        self.is_frozen() && stretch.track_intervals > 1 && at_end()
    }

    /// Whether tracks are extrapolated on a side with this wrap mode. A track that is constant in its first and last
    /// interval is constant outside them too.
    fn extrapolates(&self, outside: WrapMode) -> bool {
        outside == WrapMode::Extrapolate && !self.is_frozen()
    }

    fn is_frozen(&self) -> bool {
        let uses_ends = self.interpolation.method.uses_neighbours;
        uses_ends && self.interpolation.ends == Ends::Frozen
    }

    /// Adds the values at a track's ends and outside them, if a stretch reaches these ends. If the wrap mode requests
    /// it, these are curves that extrapolate the track with the angular velocity of its ends. If the curve does not
    /// pass through its keys, they are constants that are held there: the curve's end values for rotations, 0 for
    /// velocities and accelerations.
    fn add_ends(&self, prepared: &mut Prepared, stretch: &TrackStretch) {
        let Interpolation { before, after, .. } = self.interpolation;
        let of_rotations = self.interpolation.quantity == Quantity::Rotation;
        let sides = [(stretch.first(), before, 0), (stretch.last(), after, 1)];
        for (lane, outside, end) in sides {
            let Some(lane) = lane else { continue };
            let is_extrapolated = self.extrapolates(outside);
            if is_extrapolated {
                let extended = extended_from(&self.curve(lane), end as f64);
                prepared.exact.push(extended);
                let index = prepared.exact.len() as u32 - 1;
                let extension = prepared.parts[stretch.part].extension_mut(stretch.span);
                *[&mut extension.from_before, &mut extension.from_after][end] = index;
            }
            if stretch.first_key != NONE {
                continue;
            }
            let end_value = || round_quat(self.curve(lane).value(end as f64));
            if !is_extrapolated {
                let held = if of_rotations && self.is_frozen() {
                    prepared.constants
                        [stretch.first_still_key as usize + (lane - stretch.lane) + end]
                } else if of_rotations {
                    end_value()
                } else {
                    STILL
                };
                let held = prepared.constant(held);
                let part = &mut prepared.parts[stretch.part];
                *[&mut part.before, &mut part.after][end] = held;
            }
            if !of_rotations && end == 1 {
                let at_end = if self.is_frozen() { STILL } else { end_value() };
                let at_end = prepared.constant(at_end);
                prepared.parts[stretch.part]
                    .extension_mut(stretch.span)
                    .at_end = at_end;
            }
        }
    }
}

/// The curve that continues from `t` with the constant angular velocity of this curve there; its parameter is in
/// seconds.
fn extended_from(curve: &IntervalCurve, t: f64) -> IntervalCurve {
    let rotation = curve.moving(Dual::parameter(t));
    let velocity = Quantity::Velocity(Axes::Body);
    let [x, y, z, _] = quantity_value(velocity, rotation, curve.rate);
    let half = [0.5 * x, 0.5 * y, 0.5 * z];
    let numbers = RotationVectorNumbers {
        base: rotation.map(|dual| dual.value),
        linear: half,
        ..RotationVectorNumbers::default()
    };
    IntervalCurve::new(&ROTATION_VECTOR, numbers.into(), curve.quantity, 1.0)
}
