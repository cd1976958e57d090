//! Preparation of the paths of a set: positions and rotations become segments, as those of other tracks.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::curve::options::{Axes, Quantity};
use crate::math::quaternion::round_quat;
use crate::method::bessel_overhauser::BESSEL_OVERHAUSER;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::ScalarQuantity;
use crate::path::body::BodyOnPath;
use crate::path::carry::RelativePieces;
use crate::path::fit::fit;
use crate::path::options::{Direction, Follow, FollowError, FollowWarning, PathFrame, Twist};
use crate::path::rolls::is_half_turn;
use crate::path::sample::{SampleKind, Sampler, Span};
use crate::path::stretch::{PathStretch, stretches};
use crate::path::timed_path::{TimedPath, diagonal};
use crate::prepare::clip_data::ClipData;
use crate::prepare::prepared::Prepared;
use crate::prepare::vectors::{self, VectorRequest};
use crate::threads::stop;
use crate::time::runs::NONE;
use crate::time::spans::SpanSource;
use crate::tracks::set::TrackSet;
use crate::tracks::set::vectors::{Channel, VectorTrack};

/// The maximum number of keys, in addition to those of one path, that are processed together: they fill the vector
/// lanes, and their numbers stay in a thread's cache.
const MAX_BATCH_KEYS: usize = 256;

/// Prepared positions and rotations, and warnings about them.
pub(crate) struct PreparedPaths {
    pub(crate) positions: ClipData,
    pub(crate) rotations: ClipData,
    pub(crate) warnings: Vec<FollowWarning>,
}

/// The largest gap of a closed path, as a fraction of its size.
const MAX_GAP: f64 = 1e-6;

impl PreparedPaths {
    /// Prepares the paths of all tracks of a set. A buffer of a device gets segments of at most `group_bytes`. Must
    /// be called on the engine's threads.
    pub(crate) fn new(
        set: &TrackSet,
        follow: &Follow,
        group_bytes: Option<usize>,
    ) -> Result<Self, FollowError> {
        follow.check()?;
        let rotations = Interpolation {
            ends: follow.ends,
            ..BESSEL_OVERHAUSER.into()
        };
        let positions = Interpolation {
            quantity: Quantity::Velocity(Axes::Parent),
            ..rotations
        };
        let stop = stop::current();
        let prepared = |tracks| {
            stop::during(stop.clone(), || {
                prepared(set, tracks, follow, [&positions, &rotations])
            })
        };
        let batches: Vec<_> = batches(set).into_par_iter().map(prepared).collect();
        // If several tracks have errors, that of the first track is returned.
        let batches = batches.into_iter().collect::<Result<Vec<_>, _>>()?;
        let batches = batches
            .into_iter()
            .map(|([a, b], batch_warnings)| ((a, b), batch_warnings));
        let ((of_positions, of_rotations), warnings): ((Vec<_>, Vec<_>), Vec<_>) = batches.unzip();
        let clip_data = |groups, interpolation| {
            let (tracks, span) = (set.track_count(), set.time_span());
            ClipData::of_groups(groups, tracks, span, interpolation, group_bytes)
        };
        Ok(Self {
            positions: clip_data(of_positions, positions),
            rotations: clip_data(of_rotations, rotations),
            warnings: warnings.concat(),
        })
    }
}

/// The tracks that are followed together.
fn batches(set: &TrackSet) -> Vec<Range<usize>> {
    let (mut all, mut keys) = (Vec::<Range<usize>>::new(), 0);
    for track in 0..set.track_count() {
        let path = set.vectors(Channel::Translation, track);
        keys += path.map_or(0, |path| path.keys.len());
        match all.last_mut() {
            Some(last) if keys <= MAX_BATCH_KEYS => last.end += 1,
            _ => {
                keys = 0;
                all.push(track..track + 1);
            }
        }
    }
    all
}

/// The path of a track, checked.
fn path_of<'a>(
    set: &'a TrackSet,
    track: usize,
    follow: &Follow,
) -> Result<&'a VectorTrack, FollowError> {
    let translations = set.vectors(Channel::Translation, track);
    let path = translations.ok_or(FollowError::NoPath { track })?;
    if follow.is_closed() {
        let keys = path.keys.iter().map(|key| key.as_dvec3());
        let (first, last) = (path.keys[0], path.keys[path.keys.len() - 1]);
        let gap = (last.as_dvec3() - first.as_dvec3()).length();
        if gap > MAX_GAP * diagonal(keys) {
            return Err(FollowError::OpenLoop { track, gap });
        }
    }
    Ok(path)
}

/// A body on the path of a track, whose rotations are not known yet.
fn body_on(
    path: &VectorTrack,
    set: &TrackSet,
    track: usize,
    follow: &Follow,
) -> Result<BodyOnPath, FollowError> {
    if follow.frame != PathFrame::Minimal && path.ups.iter().any(Option::is_some) {
        return Err(FollowError::UpsUnused { track });
    }
    let timed_path = TimedPath::new(path, follow);
    stop::check()?;
    // If the body itself is the target that all bodies face, it faces along its own path.
    let direction = match follow.direction {
        Direction::Track(target) if target == track => Direction::Tangent,
        direction => direction,
    };
    let target = match direction {
        Direction::Track(target) if target >= set.track_count() => {
            return Err(FollowError::Target { track, target });
        }
        Direction::Track(target) => {
            let path = path_of(set, target, follow)?;
            Some(Arc::new(TimedPath::new(path, follow)))
        }
        _ => None,
    };
    let stretches = stretches(&timed_path, direction, target.as_ref());
    stop::check()?;
    Ok(BodyOnPath::new(timed_path, stretches, follow))
}

/// The positions and rotations of some tracks, and warnings about them.
fn prepared(
    set: &TrackSet,
    tracks: Range<usize>,
    follow: &Follow,
    interpolations: [&Interpolation; 2],
) -> Result<([Prepared; 2], Vec<FollowWarning>), FollowError> {
    let (mut paths, mut bodies) = (Vec::new(), Vec::new());
    for track in tracks.clone() {
        let path = path_of(set, track, follow)?;
        bodies.push(body_on(path, set, track, follow)?);
        stop::check()?;
        paths.push(path);
    }
    let minimal = (bodies.iter()).filter(|_| follow.frame == PathFrame::Minimal);
    let carried = minimal.flat_map(|body| {
        body.stretches
            .iter()
            .map(|stretch| (&body.timed_path, stretch))
    });
    let relative_pieces = RelativePieces::new(&carried.collect::<Vec<_>>());
    stop::check()?;
    let (mut first_stretch, mut spans, mut warnings) = (0, Vec::new(), Vec::new());
    for (i, (path, body)) in paths.iter().zip(&mut bodies).enumerate() {
        let (track, count) = (tracks.start + i, body.stretches.len());
        body.find_rotations(follow, &path.ups, &relative_pieces, first_stretch);
        first_stretch += count;
        if count == 0 {
            warnings.push(FollowWarning::StandsStill { track });
        } else if is_half_turn(body.left_over) {
            warnings.push(FollowWarning::HalfTurn { track });
        }
        add_spans(&mut spans, body, i);
    }
    let adding = PathPreparation {
        first_track: tracks.start,
        paths: &paths,
        bodies: &bodies,
        spans: &spans,
        follow,
        interpolation: interpolations[0],
    };
    let [mut positions, mut rotations] = interpolations.map(Prepared::new);
    adding.add(&mut positions, SampleKind::Vector);
    stop::check()?;
    adding.add(&mut rotations, SampleKind::Rotation);
    stop::check()?;
    Ok(([positions, rotations], warnings))
}

/// The stretches of a path that are used: for a body that stands still only the first.
fn used(body: &BodyOnPath) -> &[PathStretch] {
    let all = &body.stretches[..];
    match body.timed_path.stands() {
        true => &all[..all.len().min(1)],
        false => all,
    }
}

/// Adds the spans of a path: its stretches, divided where the speed is not smooth.
fn add_spans(spans: &mut Vec<Span>, body: &BodyOnPath, path: usize) {
    let (timed_path, used) = (&body.timed_path, used(body));
    let (start, end) = timed_path.span();
    for (index, stretch) in used.iter().enumerate() {
        let is_last = index + 1 == used.len();
        let mut from = match timed_path.stands() {
            true => start,
            false => timed_path.time(stretch.interval, stretch.from),
        };
        let to = match is_last {
            true => end,
            false => timed_path.time(stretch.interval, stretch.to),
        };
        for joint in timed_path.joints(from..to).chain([to]) {
            if joint > from {
                spans.push(Span {
                    path: path as u32,
                    stretch: index as u32,
                    from,
                    to: joint,
                });
                from = joint;
            }
        }
    }
}

/// Adds the positions or the rotations of tracks.
struct PathPreparation<'a> {
    first_track: usize,
    /// The path of each track, and the body on it.
    paths: &'a [&'a VectorTrack],
    bodies: &'a [BodyOnPath],
    /// The spans of the first path, then those of the next.
    spans: &'a [Span],
    follow: &'a Follow,
    /// The interpolation of positions.
    interpolation: &'a Interpolation,
}

impl PathPreparation<'_> {
    fn add(&self, prepared: &mut Prepared, kind: SampleKind) {
        let follow = self.follow;
        let of_keys = VectorRequest {
            quantity: ScalarQuantity::Value,
            method: follow.method,
            interpolation: self.interpolation,
            group_bytes: None,
            only_for: None,
        };
        let is_fitted =
            |path: &BodyOnPath| kind == SampleKind::Rotation || path.timed_path.is_retimed();
        let of_fitted = |span: &Span| is_fitted(&self.bodies[span.path as usize]);
        let fitted_spans: Vec<Span> = self.spans.iter().copied().filter(of_fitted).collect();
        let mut sampler = Sampler::new(self.bodies, kind, follow);
        let fitted = fit(prepared, &fitted_spans, &mut sampler);
        let is_spread = follow.frame != PathFrame::Minimal || follow.twist == Twist::Spread;
        let repeats = follow.is_closed() && (kind == SampleKind::Vector || is_spread);
        let (mut pieces, mut next) = (&fitted.pieces[..], 0);
        for (path, body) in self.bodies.iter().enumerate() {
            let (track, times) = (self.first_track + path, &body.timed_path.times);
            if body.stretches.is_empty() || !is_fitted(body) {
                match kind {
                    // With the times of the keys, positions are already cubics.
                    SampleKind::Vector => {
                        vectors::add(prepared, track, self.paths[path], &of_keys);
                    }
                    // A body that never moves faces along +z.
                    SampleKind::Rotation => {
                        let values = [follow.body_axes().to_array(); 2];
                        add_part(prepared, track, times, &[], values, true);
                    }
                }
                continue;
            }
            let first = next;
            next = fitted_spans.partition_point(|span| span.path as usize <= path);
            let (spans, ends) = (&fitted_spans[first..next], &fitted.ends[first..next]);
            let (start, end) = body.timed_path.span();
            let last = used(body).len() - 1;
            // Usually a span begins at the start or ends at the end. Its value is known then.
            let starts = |span: &&Span| span.stretch == 0 && span.from == start;
            let arrives = |span: &&Span| span.stretch as usize == last && span.to == end;
            let first_value = match spans.first().filter(starts) {
                Some(_) => ends[0][0],
                None => sampler.value(path, 0, start),
            };
            let last_value = match spans.last().filter(arrives) {
                Some(_) => ends[ends.len() - 1][1],
                None => sampler.value(path, last, end),
            };
            let count = pieces.partition_point(|piece| (piece.0 as usize) < next);
            let (now, rest) = pieces.split_at(count);
            pieces = rest;
            let values = [first_value, last_value];
            add_part(prepared, track, times, now, values, repeats);
        }
    }
}

/// Adds a part: a track with keys at these times, and its pieces of spans. The first and last values are used outside
/// the keys; if the track repeats, the last one is equal to the first.
fn add_part(
    prepared: &mut Prepared,
    track: usize,
    times: &[f64],
    pieces: &[(u32, f64, SpanSource)],
    values: [[f64; 4]; 2],
    repeats: bool,
) {
    let [first, last] = values.map(round_quat);
    let before = prepared.constant(first);
    let after = match repeats {
        true => before,
        false => prepared.constant(last),
    };
    let from = prepared.spans.len();
    for &(_, start, source) in pieces {
        prepared.push_span(start, source, NONE);
    }
    if let Some(key) = prepared.spans.keys.get_mut(from) {
        *key = before;
    }
    let spans = from..prepared.spans.len();
    prepared.push_part(track, times, &(0..times.len() - 1), spans, [before, after]);
}
