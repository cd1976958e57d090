//! Sampling of spans of paths in f64: positions and rotations at the nodes of the fitted polynomials, one span in
//! each vector lane.

use glam::DVec3;

use crate::fit::block::{at, load, put};
use crate::fit::nodes::FULL_NODES;
use crate::math::quaternion::{Quaternion, Real};
use crate::path::body::BodyOnPath;
use crate::path::carried_piece::CarriedPiece;
use crate::path::lanes::{ByAxes, Carried, LaneValues, PieceLanes, find_directions};
use crate::path::options::Follow;
use crate::path::speed::PathSpeed;
use crate::path::stretch::PathStretch;
use crate::path::timed_path::TimedPath;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::doubles::Doubles;
use crate::simd::lanes::{Lanes, MAX_LANES};

/// Pairs of nodes.
pub(crate) const PAIRS: usize = 5;

/// The order of a span's samples: its nodes, pair by pair, then its middle and its ends.
pub(crate) const MIDDLE: usize = 2 * PAIRS;
pub(crate) const START: usize = MIDDLE + 1;
pub(crate) const END: usize = MIDDLE + 2;
const SAMPLES: usize = MIDDLE + 3;

/// The positions of the samples, as fractions of the span.
const PARTS: [f64; SAMPLES] = {
    let mut parts = [0.0; SAMPLES];
    let mut k = 0;
    while k < PAIRS {
        let node = FULL_NODES.at[k] as f64;
        (parts[2 * k], parts[2 * k + 1]) = (0.5 - node, 0.5 + node);
        k += 1;
    }
    (parts[MIDDLE], parts[START], parts[END]) = (0.5, 0.0, 1.0);
    parts
};

/// The quantity that is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SampleKind {
    /// Unit quaternions of either sign.
    Rotation,
    /// Vectors of any length.
    Vector,
}

/// A part of a path's time, from one time to another, on one stretch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    /// The path's index in a list of frames.
    pub(crate) path: u32,
    pub(crate) stretch: u32,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl Span {
    /// Its path and its stretch, among those of some paths.
    fn path_and_stretch<'a>(&self, bodies: &'a [BodyOnPath]) -> (&'a TimedPath, &'a PathStretch) {
        let body = &bodies[self.path as usize];
        (&body.timed_path, &body.stretches[self.stretch as usize])
    }
}

/// Values at the samples of spans, a row for each of their four components.
pub(crate) type SpanSamples = [[LaneValues; 4]; SAMPLES];

/// Samples spans of some paths; its memory is kept for the next ones.
pub(crate) struct Sampler<'a> {
    pub(crate) bodies: &'a [BodyOnPath],
    pub(crate) kind: SampleKind,
    speed: PathSpeed,
    /// The rotation from the body to z forward, y up, if it is not the identity.
    body_axes: Option<Quaternion>,
    rows: Box<SpanRows>,
}

/// The numbers of a block of spans.
#[derive(Default)]
struct SpanRows {
    /// The start and the end of spans, those of their intervals, and the range of parameters of their stretches.
    times: [LaneValues; 6],
    parameters: [LaneValues; SAMPLES],
    directions: [[LaneValues; 3]; SAMPLES],
    pieces: PieceLanes,
    rolls: [LaneValues; SAMPLES],
    sides: [[LaneValues; 3]; SAMPLES],
    by_axes: SpanSamples,
    values: SpanSamples,
}

impl<'a> Sampler<'a> {
    pub(crate) fn new(bodies: &'a [BodyOnPath], kind: SampleKind, follow: &Follow) -> Self {
        let body_axes = follow.body_axes().to_array();
        Self {
            bodies,
            kind,
            speed: follow.speed,
            body_axes: (body_axes != [0.0, 0.0, 0.0, 1.0]).then_some(body_axes),
            rows: Box::default(),
        }
    }

    /// The value on a stretch of a path at one time.
    pub(crate) fn value(&mut self, path: usize, stretch: usize, time: f64) -> [f64; 4] {
        let span = Span {
            path: path as u32,
            stretch: stretch as u32,
            from: time,
            to: time,
        };
        at(&self.sample(&[span])[START], 0)
    }

    /// The values on at most as many spans as there are lanes.
    pub(crate) fn sample(&mut self, spans: &[Span]) -> &SpanSamples {
        let (bodies, rows) = (self.bodies, &mut *self.rows);
        let of_spans = spans.iter().map(|span| span.path_and_stretch(bodies));
        for (lane, ((timed_path, stretch), span)) in of_spans.clone().zip(spans).enumerate() {
            if self.speed == PathSpeed::Keys {
                let [first, last] = timed_path.keys_of(stretch.interval);
                let numbers = [span.from, span.to, first, last, stretch.from, stretch.to];
                put(&mut rows.times, lane, numbers);
                continue;
            }
            let width = span.to - span.from;
            for (sample, (row, part)) in rows.parameters.iter_mut().zip(PARTS).enumerate() {
                let time = match sample {
                    END => span.to,
                    _ => span.from + width * part,
                };
                row[lane] = if timed_path.lengths.total() > 0.0 {
                    timed_path
                        .parameter(stretch.interval, time)
                        .clamp(stretch.from, stretch.to)
                } else {
                    // On a path without length, the body stays at its start.
                    stretch.from
                };
            }
        }
        if self.speed == PathSpeed::Keys {
            in_lanes(rows);
        }
        match self.kind {
            SampleKind::Vector => {
                for (lane, (timed_path, stretch)) in of_spans.enumerate() {
                    let curve = &timed_path.curves[stretch.interval];
                    for (value, row) in rows.values.iter_mut().zip(&rows.parameters) {
                        put(value, lane, curve.at(row[lane]).extend(0.0).to_array());
                    }
                }
            }
            SampleKind::Rotation => {
                find_directions(of_spans, &rows.parameters, &mut rows.directions, None);
                self.carried(spans);
                self.by_axes(spans);
            }
        }
        &self.rows.values
    }

    /// The rotations of frames that are not minimal.
    fn by_axes(&mut self, spans: &[Span]) {
        let SpanRows {
            parameters,
            directions,
            sides,
            by_axes,
            values,
            ..
        } = &mut *self.rows;
        let body = |span: &Span| &self.bodies[span.path as usize];
        let vector = |rows: &[LaneValues; 3], lane: usize| DVec3::from_array(at(rows, lane));
        let is_carried = |span: &Span| body(span).carried(span.stretch as usize).is_some();
        let others = (spans.iter().enumerate()).filter(|(_, span)| !is_carried(span));
        if others.clone().next().is_none() {
            return;
        }
        for (lane, span) in others.clone() {
            for (sample, side) in sides.iter_mut().enumerate() {
                let direction = vector(&directions[sample], lane);
                let side_vector =
                    body(span).side(span.stretch as usize, parameters[sample][lane], direction);
                put(side, lane, side_vector.to_array());
            }
        }
        let mut are_along = [0.0; MAX_LANES];
        in_lanes(&mut ByAxes {
            count: spans.len(),
            sides,
            directions,
            body_axes: self.body_axes,
            rotations: by_axes,
            are_along: &mut are_along,
        });
        for (lane, span) in others {
            for (sample, value) in values.iter_mut().enumerate() {
                let mut rotation = at(&by_axes[sample], lane);
                if are_along[lane] != 0.0 {
                    let [side, direction] =
                        [&sides[sample], &directions[sample]].map(|rows| vector(rows, lane));
                    rotation = body(span).rotation(side, direction).to_array();
                }
                put(value, lane, rotation);
            }
        }
    }

    /// The rotations of carried frames.
    fn carried(&mut self, spans: &[Span]) {
        let bodies = self.bodies;
        let SpanRows {
            parameters,
            directions,
            pieces,
            rolls,
            values,
            ..
        } = &mut *self.rows;
        let mut others: Vec<(usize, usize, &'a CarriedPiece)> = Vec::new();
        let (mut any, mut are_rolled) = (false, false);
        for (lane, span) in spans.iter().enumerate() {
            let body = &bodies[span.path as usize];
            let Some((all, added)) = body.carried(span.stretch as usize) else {
                continue;
            };
            any = true;
            let (is_spread, first) = (added.are_spread(), added.at(0.0));
            are_rolled |= is_spread || first != 0.0;
            let interval = body.stretches[span.stretch as usize].interval;
            for (roll, row) in rolls.iter_mut().zip(&*parameters) {
                roll[lane] = match is_spread {
                    true => added.at(body.timed_path.lengths.at(interval, row[lane])),
                    false => first,
                };
            }
            if let [only] = all {
                pieces.set(lane, only);
                continue;
            }
            let mut before = usize::MAX;
            for (sample, row) in parameters.iter().enumerate() {
                let after = all.partition_point(|piece| piece.from <= row[lane]);
                let piece = after.max(1) - 1;
                if piece != before {
                    others.push((sample, lane, &all[piece]));
                    before = piece;
                }
            }
        }
        if !any {
            return;
        }
        others.sort_by_key(|(sample, ..)| *sample);
        in_lanes(&mut Carried {
            count: spans.len(),
            pieces,
            others: &others,
            parameters,
            directions,
            rolls: are_rolled.then_some(&*rolls),
            body_axes: self.body_axes,
            rotations: values,
        });
    }
}

/// Finds the parameters of spans on paths whose timing is that of their keys.
impl InLanes for SpanRows {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (zero, one) = (L::Doubles::all(0.0), L::Doubles::all(1.0));
        for lane in (0..MAX_LANES).step_by(L::COUNT) {
            let [from, to, first, last, start, end] = load::<L::Doubles, 6, _>(&self.times, lane);
            let width = to - from;
            for (sample, (row, part)) in self.parameters.iter_mut().zip(PARTS).enumerate() {
                let time = match sample {
                    END => to,
                    _ => from + width * L::Doubles::all(part),
                };
                let t = ((time - first) / (last - first)).larger(zero).smaller(one);
                t.larger(start).smaller(end).store(&mut row[lane..]);
            }
        }
    }
}
