//! Samples spans of followed paths in f64: positions and rotations at the places from which they are
//! fitted, a span in each vector lane.

use glam::DVec3;

use crate::fit::double::fit::MOST;
use crate::fit::double::intervals::{at, load, put};
use crate::fit::nodes::FULL_NODES;
use crate::math::quaternion::{Quaternion, Real};
use crate::path::carry::Piece;
use crate::path::frames::Frames;
use crate::path::lanes::{ByAxes, Carried, Pieces, Row, find_directions};
use crate::path::options::{Follow, PathSpeed};
use crate::path::route::{Route, Stretch};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::{Doubles, Lanes};

/// Pairs of nodes.
pub(crate) const PAIRS: usize = 5;

/// The places of a span's samples: its nodes, pair by pair, then its middle and its ends.
pub(crate) const MIDDLE: usize = 2 * PAIRS;
pub(crate) const START: usize = MIDDLE + 1;
pub(crate) const END: usize = MIDDLE + 2;
const PLACES: usize = MIDDLE + 3;

/// Where the places lie, as parts of the span.
const PARTS: [f64; PLACES] = {
    let mut parts = [0.0; PLACES];
    let mut k = 0;
    while k < PAIRS {
        let node = FULL_NODES.at[k] as f64;
        (parts[2 * k], parts[2 * k + 1]) = (0.5 - node, 0.5 + node);
        k += 1;
    }
    (parts[MIDDLE], parts[START], parts[END]) = (0.5, 0.0, 1.0);
    parts
};

/// What is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Unit quaternions of either sign.
    Rotation,
    /// Vectors of any length.
    Vector,
}

/// A part of a path's time, from one time to another, on one stretch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    /// The path's place in a list of frames.
    pub(crate) path: u32,
    pub(crate) stretch: u32,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl Span {
    /// Its route and its stretch among those of some paths.
    fn place<'a>(&self, paths: &'a [Frames]) -> (&'a Route, &'a Stretch) {
        let own = &paths[self.path as usize];
        (&own.route, &own.stretches[self.stretch as usize])
    }
}

/// Values at the places of spans, a row for each of their four components.
pub(crate) type Samples = [[Row; 4]; PLACES];

/// Samples spans of some paths; its memory is kept for the next ones.
pub(crate) struct Sampler<'a> {
    pub(crate) paths: &'a [Frames],
    pub(crate) kind: Kind,
    speed: PathSpeed,
    /// The rotation from the body to z forward, y up, if it is not the identity.
    body: Option<Quaternion>,
    rows: Box<Rows>,
}

/// The numbers of a block of spans.
#[derive(Default)]
struct Rows {
    /// The times at which spans start and end, those of their intervals' keys, and the parameters between
    /// which their stretches lie.
    times: [Row; 6],
    places: [Row; PLACES],
    ways: [[Row; 3]; PLACES],
    pieces: Pieces,
    rolls: [Row; PLACES],
    sides: [[Row; 3]; PLACES],
    by_axes: Samples,
    values: Samples,
}

impl<'a> Sampler<'a> {
    pub(crate) fn new(paths: &'a [Frames], kind: Kind, follow: &Follow) -> Self {
        let body = follow.body().to_array();
        Self {
            paths,
            kind,
            speed: follow.speed,
            body: (body != [0.0, 0.0, 0.0, 1.0]).then_some(body),
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
    pub(crate) fn sample(&mut self, spans: &[Span]) -> &Samples {
        let (paths, rows) = (self.paths, &mut *self.rows);
        let of_spans = spans.iter().map(|span| span.place(paths));
        for (lane, ((route, own), span)) in of_spans.clone().zip(spans).enumerate() {
            if self.speed == PathSpeed::Keys {
                let [first, last] = route.keys_of(own.interval);
                let numbers = [span.from, span.to, first, last, own.from, own.to];
                put(&mut rows.times, lane, numbers);
                continue;
            }
            let width = span.to - span.from;
            for (place, (row, part)) in rows.places.iter_mut().zip(PARTS).enumerate() {
                let time = match place {
                    END => span.to,
                    _ => span.from + width * part,
                };
                row[lane] = if route.lengths.total() > 0.0 {
                    route.parameter(own.interval, time).clamp(own.from, own.to)
                } else {
                    // A path without length is stood on.
                    own.from
                };
            }
        }
        if self.speed == PathSpeed::Keys {
            in_lanes(rows);
        }
        match self.kind {
            Kind::Vector => {
                for (lane, (route, own)) in of_spans.enumerate() {
                    let curve = &route.curves[own.interval];
                    for (value, place) in rows.values.iter_mut().zip(&rows.places) {
                        put(value, lane, curve.at(place[lane]).extend(0.0).to_array());
                    }
                }
            }
            Kind::Rotation => {
                find_directions(of_spans, &rows.places, &mut rows.ways, None);
                self.carried(spans);
                self.by_axes(spans);
            }
        }
        &self.rows.values
    }

    /// The rotations of the other frames.
    fn by_axes(&mut self, spans: &[Span]) {
        let Rows {
            places,
            ways,
            sides,
            by_axes,
            values,
            ..
        } = &mut *self.rows;
        let frames = |span: &Span| &self.paths[span.path as usize];
        let vector = |rows: &[Row; 3], lane: usize| DVec3::from_array(at(rows, lane));
        let is_carried = |span: &Span| frames(span).carried(span.stretch as usize).is_some();
        let others = (spans.iter().enumerate()).filter(|(_, span)| !is_carried(span));
        if others.clone().next().is_none() {
            return;
        }
        for (lane, span) in others.clone() {
            for (place, side) in sides.iter_mut().enumerate() {
                let way = vector(&ways[place], lane);
                let own = frames(span).side(span.stretch as usize, places[place][lane], way);
                put(side, lane, own.to_array());
            }
        }
        let mut are_along = [0.0; MOST];
        in_lanes(&mut ByAxes {
            count: spans.len(),
            sides,
            ways,
            body: self.body,
            rotations: by_axes,
            are_along: &mut are_along,
        });
        for (lane, span) in others {
            for (place, value) in values.iter_mut().enumerate() {
                let mut rotation = at(&by_axes[place], lane);
                if are_along[lane] != 0.0 {
                    let [side, way] = [&sides[place], &ways[place]].map(|own| vector(own, lane));
                    rotation = frames(span).rotation(side, way).to_array();
                }
                put(value, lane, rotation);
            }
        }
    }

    /// The rotations of carried frames.
    fn carried(&mut self, spans: &[Span]) {
        let paths = self.paths;
        let Rows {
            places,
            ways,
            pieces,
            rolls,
            values,
            ..
        } = &mut *self.rows;
        let mut others: Vec<(usize, usize, &'a Piece)> = Vec::new();
        let (mut any, mut are_rolled) = (false, false);
        for (lane, span) in spans.iter().enumerate() {
            let own = &paths[span.path as usize];
            let Some((all, added)) = own.carried(span.stretch as usize) else {
                continue;
            };
            any = true;
            let (is_spread, first) = (added.are_spread(), added.at(0.0));
            are_rolled |= is_spread || first != 0.0;
            let interval = own.stretches[span.stretch as usize].interval;
            for (roll, place) in rolls.iter_mut().zip(&*places) {
                roll[lane] = match is_spread {
                    true => added.at(own.route.lengths.at(interval, place[lane])),
                    false => first,
                };
            }
            if let [only] = all {
                pieces.set(lane, only);
                continue;
            }
            let mut before = usize::MAX;
            for (place, row) in places.iter().enumerate() {
                let after = all.partition_point(|piece| piece.from <= row[lane]);
                let piece = after.max(1) - 1;
                if piece != before {
                    others.push((place, lane, &all[piece]));
                    before = piece;
                }
            }
        }
        if !any {
            return;
        }
        others.sort_by_key(|(place, ..)| *place);
        in_lanes(&mut Carried {
            count: spans.len(),
            pieces,
            others: &others,
            places,
            ways,
            rolls: are_rolled.then_some(&*rolls),
            body: self.body,
            rotations: values,
        });
    }
}

/// Finds the places of spans on paths that are as their keys say.
impl InLanes for Rows {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (zero, one) = (L::Doubles::all(0.0), L::Doubles::all(1.0));
        for lane in (0..MOST).step_by(L::COUNT) {
            let [from, to, first, last, start, end] = load::<L::Doubles, 6, _>(&self.times, lane);
            let width = to - from;
            for (place, (row, part)) in self.places.iter_mut().zip(PARTS).enumerate() {
                let time = match place {
                    END => to,
                    _ => from + width * L::Doubles::all(part),
                };
                let t = ((time - first) / (last - first)).larger(zero).smaller(one);
                t.larger(start).smaller(end).store(&mut row[lane..]);
            }
        }
    }
}
