//! Prepares the paths of a set: positions and rotations become segments, as those of other tracks.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use crate::curve::options::{Axes, Quantity};
use crate::math::canonical::round_quat;
use crate::method::bessel_overhauser::BESSEL_OVERHAUSER;
use crate::method::interpolation::Interpolation;
use crate::method::vector_curve::Curves;
use crate::path::carry::Uncarried;
use crate::path::fit::fit;
use crate::path::frames::Frames;
use crate::path::options::{
    Direction, Follow, FollowError, FollowWarning, Frame, PathSpeed, Twist,
};
use crate::path::polynomial::Polynomial;
use crate::path::route::{Route, Stretch, stretches};
use crate::path::sample::{Kind, Sampler, Span};
use crate::path::schedule::Schedule;
use crate::prepare::clip_data::ClipData;
use crate::prepare::prepared::Prepared;
use crate::prepare::vectors;
use crate::time::spans::{NONE, Source};
use crate::tracks::set::TrackSet;
use crate::tracks::vectors::{Channel, VectorTrack};

/// The number of paths that are prepared as one piece of work.
const BATCH: usize = 64;

/// The most keys, beside those of one path, that are followed together: as many as fill the vector
/// lanes, and whose numbers stay in a thread's cache.
const TOGETHER: usize = 256;

/// Prepared positions and rotations, and what is unusual about them.
pub(crate) struct PreparedPaths {
    pub(crate) positions: ClipData,
    pub(crate) rotations: ClipData,
    pub(crate) warnings: Vec<FollowWarning>,
}

/// The largest gap of a closed path, as a part of its size.
const GAP: f64 = 1e-6;

impl PreparedPaths {
    /// Prepares the paths of all tracks of a set. Segments of at most `group_bytes` go into one
    /// buffer of a device.
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
        let firsts: Vec<usize> = (0..set.track_count()).step_by(BATCH).collect();
        let batch = |first: usize| {
            let mut own = [&positions, &rotations].map(Prepared::new);
            let mut warnings = Vec::new();
            let mut tracks = first..set.track_count().min(first + BATCH);
            while !tracks.is_empty() {
                let some = tracks.start..tracks.start + few(set, tracks.clone());
                tracks.start = some.end;
                add(&mut own, set, some, follow, &positions, &mut warnings)?;
            }
            Ok((own, warnings))
        };
        let batches: Result<Vec<_>, FollowError> = firsts.into_par_iter().map(batch).collect();
        let (mut groups, mut warnings) = ([Vec::new(), Vec::new()], Vec::new());
        for ([own_positions, own_rotations], own_warnings) in batches? {
            groups[0].push(own_positions);
            groups[1].push(own_rotations);
            warnings.extend(own_warnings);
        }
        let [of_positions, of_rotations] = groups;
        Ok(Self {
            positions: ClipData::of_groups(of_positions, set, positions, group_bytes),
            rotations: ClipData::of_groups(of_rotations, set, rotations, group_bytes),
            warnings,
        })
    }
}

/// How many of some tracks, the first among them, have at most as many keys as are followed together.
fn few(set: &TrackSet, tracks: Range<usize>) -> usize {
    let mut keys = 0;
    let fit = tracks.skip(1).take_while(|&track| {
        let path = set.vectors(Channel::Translation, track);
        keys += path.map_or(0, |path| path.keys.len());
        keys <= TOGETHER
    });
    1 + fit.count()
}

/// The path of a track, checked.
fn path_of<'a>(
    set: &'a TrackSet,
    track: usize,
    follow: &Follow,
) -> Result<&'a VectorTrack, FollowError> {
    let own = set.vectors(Channel::Translation, track);
    let path = own.ok_or(FollowError::NoPath { track })?;
    if follow.is_closed() {
        let (first, last) = (
            path.keys[0].as_dvec3(),
            path.keys[path.keys.len() - 1].as_dvec3(),
        );
        let keys = || path.keys.iter().map(|key| key.as_dvec3());
        let least = keys().fold(DVec3::INFINITY, DVec3::min);
        let most = keys().fold(DVec3::NEG_INFINITY, DVec3::max);
        let gap = (last - first).length();
        if gap > GAP * (most - least).length() {
            return Err(FollowError::OpenLoop { track, gap });
        }
    }
    Ok(path)
}

/// The curves of a path.
fn route(path: &VectorTrack, follow: &Follow) -> Route {
    let curves = Curves::new(path, follow.method, follow.ends);
    let polynomials = (0..path.keys.len() - 1).map(|i| Polynomial(curves.of(i).powers()));
    let spreads =
        follow.is_closed() && follow.twist == Twist::Spread && follow.frame == Frame::Minimal;
    let needs_lengths = spreads
        || follow.speed != PathSpeed::Keys
        || matches!(follow.direction, Direction::Ahead(_))
        || path.ups.iter().any(Option::is_some);
    let mut route = Route::new(
        path.keys[0].as_dvec3(),
        polynomials.collect(),
        Schedule::new(follow.speed, &path.times),
        follow.is_closed(),
    );
    if needs_lengths {
        route.measure();
    }
    route
}

/// The path of a track, with its stretches; without any if it stands still.
struct Checked<'a> {
    track: usize,
    path: &'a VectorTrack,
    route: Route,
    stretches: Option<Vec<Stretch>>,
}

impl<'a> Checked<'a> {
    fn new(set: &'a TrackSet, track: usize, follow: &Follow) -> Result<Self, FollowError> {
        let path = path_of(set, track, follow)?;
        if follow.frame != Frame::Minimal && path.ups.iter().any(Option::is_some) {
            return Err(FollowError::UpsUnused { track });
        }
        let route = route(path, follow);
        // The body that others look at looks along its own path.
        let direction = match follow.direction {
            Direction::Track(target) if target == track => Direction::Tangent,
            direction => direction,
        };
        let target = match direction {
            Direction::Track(target) if target >= set.track_count() => {
                return Err(FollowError::Target { track, target });
            }
            Direction::Track(target) => Some(self::route(path_of(set, target, follow)?, follow)),
            _ => None,
        };
        let stretches = stretches(&route, direction, target.as_ref(), follow.speed);
        Ok(Self {
            track,
            path,
            route,
            stretches,
        })
    }
}

/// A track, and the place of its path among those that move, with the number of its spans.
struct Walk<'a> {
    track: usize,
    path: &'a VectorTrack,
    moving: Option<(usize, usize)>,
}

/// Adds the positions and rotations of some tracks.
fn add(
    prepared: &mut [Prepared; 2],
    set: &TrackSet,
    tracks: Range<usize>,
    follow: &Follow,
    interpolation: &Interpolation,
    warnings: &mut Vec<FollowWarning>,
) -> Result<(), FollowError> {
    let checked = tracks.map(|track| Checked::new(set, track, follow));
    let checked = checked.collect::<Result<Vec<_>, _>>()?;
    let minimal = (checked.iter()).filter(|_| follow.frame == Frame::Minimal);
    let carried: Vec<(&Route, &Stretch)> = minimal
        .flat_map(|own| (own.stretches.iter().flatten()).map(|stretch| (&own.route, stretch)))
        .collect();
    let uncarried = Uncarried::new(&carried);
    let mut next = 0;
    let (mut walks, mut paths, mut spans) = (Vec::new(), Vec::new(), Vec::new());
    for own in checked {
        let Checked { track, path, .. } = own;
        let mut moving = None;
        if let Some(stretches) = own.stretches {
            let given = (&uncarried, &mut next);
            let frames = Frames::new(
                (own.route, stretches),
                follow,
                &path.ups,
                track,
                given,
                warnings,
            );
            let first = spans.len();
            add_spans(&mut spans, &frames, paths.len(), follow);
            moving = Some((paths.len(), spans.len() - first));
            paths.push(frames);
        } else {
            warnings.push(FollowWarning::StandsStill { track });
        }
        walks.push(Walk {
            track,
            path,
            moving,
        });
    }
    let [positions, rotations] = prepared;
    let adding = Adding {
        walks: &walks,
        paths: &paths,
        follow,
        interpolation,
    };
    adding.add(positions, &spans, Kind::Vector);
    adding.add(rotations, &spans, Kind::Rotation);
    Ok(())
}

/// Whether a body is where its speed says, and not where its keys do.
fn is_retimed(route: &Route, follow: &Follow) -> bool {
    follow.speed != PathSpeed::Keys && route.lengths.total() > 0.0
}

/// Whether a body stands on its path, of which it may turn all the same.
fn stands(route: &Route, follow: &Follow) -> bool {
    follow.speed != PathSpeed::Keys && !is_retimed(route, follow)
}

/// How many of a path's stretches are used.
fn count_used(frames: &Frames, follow: &Follow) -> usize {
    match stands(&frames.route, follow) {
        true => 1,
        false => frames.stretches.len(),
    }
}

/// Adds the spans of a path: those of its stretches, cut where the speed is not smooth.
fn add_spans(spans: &mut Vec<Span>, frames: &Frames, path: usize, follow: &Follow) {
    let Frames {
        route, stretches, ..
    } = frames;
    let (start, end) = route.schedule.span();
    let (stands, count) = (stands(route, follow), count_used(frames, follow));
    for (stretch, own) in stretches[..count].iter().enumerate() {
        let time = |t: f64| (route.schedule).time(&route.lengths, own.interval, t);
        let is_last = stretch + 1 == count;
        let mut from = if stands { start } else { time(own.from) };
        let to = if is_last { end } else { time(own.to) };
        for joint in route.schedule.joints(from..to).chain([to]) {
            if joint > from {
                spans.push(Span {
                    path: path as u32,
                    stretch: stretch as u32,
                    from,
                    to: joint,
                });
                from = joint;
            }
        }
    }
}

/// Adds the positions or the rotations of tracks.
struct Adding<'a> {
    walks: &'a [Walk<'a>],
    paths: &'a [Frames],
    follow: &'a Follow,
    /// That of positions.
    interpolation: &'a Interpolation,
}

impl Adding<'_> {
    fn add(&self, prepared: &mut Prepared, spans: &[Span], kind: Kind) {
        let follow = self.follow;
        let is_fitted =
            |path: usize| kind == Kind::Rotation || is_retimed(&self.paths[path].route, follow);
        let own = spans.iter().copied();
        let own: Vec<Span> = own.filter(|span| is_fitted(span.path as usize)).collect();
        let mut sampler = Sampler::new(self.paths, kind, follow);
        let fitted = fit(prepared, &own, &mut sampler);
        let is_spread = follow.frame != Frame::Minimal || follow.twist == Twist::Spread;
        let repeats = follow.is_closed() && (kind == Kind::Vector || is_spread);
        let (mut pieces, mut next) = (&fitted.pieces[..], 0);
        for walk in self.walks {
            let Some((path, count)) = walk.moving.filter(|moving| is_fitted(moving.0)) else {
                match kind {
                    // Positions at the times of the keys are cubics already.
                    Kind::Vector => vectors::add(
                        prepared,
                        walk.track,
                        walk.path,
                        follow.method,
                        self.interpolation,
                    ),
                    // A body that never moves looks along +z.
                    Kind::Rotation => walk.add(prepared, &[], [follow.body().to_array(); 2], true),
                }
                continue;
            };
            let frames = &self.paths[path];
            let (start, end) = frames.route.schedule.span();
            let last = count_used(frames, follow) - 1;
            let mut value = |stretch: usize, time: f64| {
                // Most often a span begins or ends there.
                let places = next..next + count;
                for place in [places.clone().next(), places.last()].into_iter().flatten() {
                    let span = own[place];
                    let times = [span.from, span.to].into_iter();
                    for (at, value) in times.zip(fitted.ends[place]) {
                        if span.stretch as usize == stretch && at == time {
                            return value;
                        }
                    }
                }
                sampler.value(path, stretch, time)
            };
            let values = [value(0, start), value(last, end)];
            next += count;
            let (now, rest) =
                pieces.split_at(pieces.partition_point(|piece| (piece.0 as usize) < next));
            pieces = rest;
            walk.add(prepared, now, values, repeats);
        }
    }
}

impl Walk<'_> {
    /// Adds a part with these pieces of spans. The first and last values are held outside its times;
    /// if it repeats, the last is the first.
    fn add(
        &self,
        prepared: &mut Prepared,
        pieces: &[(u32, f64, Source)],
        values: [[f64; 4]; 2],
        repeats: bool,
    ) {
        let [first, last] = values.map(round_quat);
        let before = prepared.constant(first);
        let after = if repeats {
            before
        } else {
            prepared.constant(last)
        };
        let from = prepared.spans.len();
        for &(_, start, source) in pieces {
            prepared.push_span(start, source, NONE);
        }
        if let Some(key) = prepared.spans.keys.get_mut(from) {
            *key = before;
        }
        let (times, spans) = (&self.path.times, from..prepared.spans.len());
        let intervals = 0..times.len() - 1;
        prepared.push_part(self.track, times, &intervals, spans, [before, after]);
    }
}

#[cfg(test)]
mod tests;
