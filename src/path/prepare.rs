//! Prepares the paths of a set: positions and rotations become segments, as those of other tracks.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::curve::options::{Axes, Quantity};
use crate::fit::double::fit::MOST;
use crate::math::canonical::round_quat;
use crate::method::bessel_overhauser::BESSEL_OVERHAUSER;
use crate::method::interpolation::Interpolation;
use crate::method::vector_curve::Curves;
use crate::path::fit::{Kind, Sample, Span, fit, value_at};
use crate::path::frames::Frames;
use crate::path::lanes::Row;
use crate::path::options::{
    Direction, Follow, FollowError, FollowWarning, Frame, PathSpeed, Twist,
};
use crate::path::polynomial::Polynomial;
use crate::path::route::{Route, stretches};
use crate::path::schedule::Schedule;
use crate::prepare::clip_data::ClipData;
use crate::prepare::prepared::Prepared;
use crate::prepare::vectors;
use crate::time::spans::{NONE, Part};
use crate::tracks::set::TrackSet;
use crate::tracks::vectors::{Channel, VectorTrack};

/// The number of paths that are prepared as one piece of work.
const BATCH: usize = 64;

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
            for track in first..set.track_count().min(first + BATCH) {
                add(&mut own, set, track, follow, &positions, &mut warnings)?;
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
        || follow.frame == Frame::Frenet
        || follow.speed != PathSpeed::Keys
        || matches!(follow.direction, Direction::Ahead(_))
        || path.ups.iter().any(Option::is_some);
    Route::new(
        path.keys[0].as_dvec3(),
        polynomials.collect(),
        Schedule::new(follow.speed, &path.times),
        follow.is_closed(),
        needs_lengths,
    )
}

/// Adds the positions and rotations of one track.
fn add(
    [positions, rotations]: &mut [Prepared; 2],
    set: &TrackSet,
    track: usize,
    follow: &Follow,
    interpolation: &Interpolation,
    warnings: &mut Vec<FollowWarning>,
) -> Result<(), FollowError> {
    let path = path_of(set, track, follow)?;
    if follow.frame != Frame::Minimal && path.ups.iter().any(Option::is_some) {
        return Err(FollowError::UpsUnused { track });
    }
    let own = route(path, follow);
    // The body that others look at looks along its own path.
    let direction = match follow.direction {
        Direction::Track(target) if target == track => Direction::Tangent,
        direction => direction,
    };
    let target = match direction {
        Direction::Track(target) if target >= set.track_count() => {
            return Err(FollowError::Target { track, target });
        }
        Direction::Track(target) => Some(route(path_of(set, target, follow)?, follow)),
        _ => None,
    };
    let is_retimed = follow.speed != PathSpeed::Keys && own.lengths.total() > 0.0;
    if !is_retimed {
        vectors::add(
            positions,
            track,
            Some(path),
            Vec3::ZERO,
            follow.method,
            interpolation,
        );
    }
    let (found, own) = match stretches(&own, direction, target.as_ref(), follow.speed) {
        Some(found) => (found, own),
        None => {
            warnings.push(FollowWarning::StandsStill { track });
            if is_retimed {
                vectors::add(
                    positions,
                    track,
                    Some(path),
                    Vec3::ZERO,
                    follow.method,
                    interpolation,
                );
            }
            add_still(rotations, track, path, follow);
            return Ok(());
        }
    };
    let ups: Vec<Option<DVec3>> = path.ups.iter().map(|up| up.map(Vec3::as_dvec3)).collect();
    let frames = Frames::new(own, found, follow, &ups, track, warnings);
    let route = &frames.route;
    let mut spans: Vec<Span> = Vec::with_capacity(frames.stretches.len());
    let (start, end) = route.schedule.span();
    let stands = follow.speed != PathSpeed::Keys && !is_retimed;
    for (stretch, own) in frames.stretches.iter().enumerate() {
        let [from, to] = match stands {
            true => [start, end],
            false => {
                [own.from, own.to].map(|t| route.schedule.time(&route.lengths, own.interval, t))
            }
        };
        let to = if stretch + 1 == frames.stretches.len() {
            end
        } else {
            to
        };
        let mut from = from;
        for joint in route.schedule.joints(from..to).chain([to]) {
            if joint > from {
                spans.push(Span {
                    stretch,
                    from,
                    to: joint,
                });
                from = joint;
            }
        }
        if stands {
            break;
        }
    }
    let places = |stretch: usize, times: &Row| {
        let own = &frames.stretches[stretch];
        // Lanes that are left repeat the time before: finding a place by its length is dear.
        let mut known = (f64::NAN, own.from);
        times.map(|time| {
            if !stands && time != known.0 {
                let t = route.schedule.parameter(&route.lengths, own.interval, time);
                known = (time, t.clamp(own.from, own.to));
            }
            known.1
        })
    };
    if is_retimed {
        let sample = |stretch: usize, times: &Row| {
            let curve = &route.curves[frames.stretches[stretch].interval];
            let all = places(stretch, times).map(|t| curve.at(t));
            [0, 1, 2, 3].map(|c| all.map(|own| if c < 3 { own[c] } else { 0.0 }))
        };
        let ends = [(0, start), (frames.stretches.len() - 1, end)];
        let part = Ends::new(
            track,
            path,
            ends.map(|(stretch, time)| value_at(&sample, stretch, time)),
        );
        part.add(positions, &spans, Kind::Vector, &sample, follow.is_closed());
    }
    let sample = |stretch: usize, times: &Row| frames.rotations(stretch, &places(stretch, times));
    let last = if stands {
        0
    } else {
        frames.stretches.len() - 1
    };
    let ends = [(0, start), (last, end)].map(|(stretch, time)| value_at(&sample, stretch, time));
    let ends = Ends::new(track, path, ends);
    let repeats =
        follow.is_closed() && (follow.frame != Frame::Minimal || follow.twist == Twist::Spread);
    ends.add(rotations, &spans, Kind::Rotation, &sample, repeats);
    Ok(())
}

/// Adds the rotation of a body that never moves: it looks along +z.
fn add_still(rotations: &mut Prepared, track: usize, path: &VectorTrack, follow: &Follow) {
    let value = follow.body().to_array();
    let ends = Ends::new(track, path, [value; 2]);
    let sample = |_: usize, _: &Row| value.map(|c| [c; MOST]);
    ends.add(rotations, &[], Kind::Rotation, &sample, true);
}

/// A track's first and last values, which are held outside its times.
struct Ends<'a> {
    track: usize,
    path: &'a VectorTrack,
    values: [[f64; 4]; 2],
}

impl<'a> Ends<'a> {
    fn new(track: usize, path: &'a VectorTrack, values: [[f64; 4]; 2]) -> Self {
        Self {
            track,
            path,
            values,
        }
    }

    /// Adds the track's spans as a part. If it repeats, the last value is the first.
    fn add(
        &self,
        prepared: &mut Prepared,
        spans: &[Span],
        kind: Kind,
        sample: &Sample<'_>,
        repeats: bool,
    ) {
        let [first, last] = self.values.map(round_quat);
        let before = prepared.constant(first);
        let after = if repeats {
            before
        } else {
            prepared.constant(last)
        };
        let from = prepared.spans.len();
        fit(prepared, spans, kind, sample);
        if let Some(key) = prepared.spans.keys.get_mut(from) {
            *key = before;
        }
        prepared.parts.push(Part {
            track: self.track as u32,
            first_key: 0,
            spans: from..prepared.spans.len(),
            end: self.path.times[self.path.times.len() - 1],
            before,
            after,
            beyond: None,
        });
        debug_assert!(before != NONE);
    }
}
