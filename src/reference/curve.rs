//! The rotation, the angular velocity and the angular acceleration of one track at any time.

use std::fmt;

use glam::{DQuat, DVec3, Quat};

use crate::curve::options::{Ends, KeySigns};
use crate::reference::curve_lengths::CurveLengths;
use crate::reference::segment::Segment;
use crate::reference::track::ReferenceTrack;
use crate::tracks::set as tracks;
use crate::tracks::set::key_data::Tcb;

/// The textbook definition of a method: how the curve of a track is computed from its keys. There is one for every
/// method.
#[derive(Clone, Copy)]
pub struct Definition {
    /// The name of the method.
    pub(super) method: &'static str,
    /// The curve of every interval of a track.
    pub(super) segments: fn(&ReferenceTrack, Ends) -> Vec<Segment>,
}

impl fmt::Debug for Definition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Definition").field(&self.method).finish()
    }
}

impl Definition {
    /// The definition of the method with this name.
    pub(crate) const fn new(
        method: &'static str,
        segments: fn(&ReferenceTrack, Ends) -> Vec<Segment>,
    ) -> Self {
        Self { method, segments }
    }
}

/// The curve of one track.
pub struct ReferenceCurve {
    track: ReferenceTrack,
    segments: Vec<Segment>,
    /// The arc lengths of the curve, if it has constant speed.
    lengths: Option<CurveLengths>,
}

impl fmt::Debug for ReferenceCurve {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ReferenceCurve")
            .field("segment_count", &self.segments.len())
            .finish_non_exhaustive()
    }
}

impl ReferenceCurve {
    /// Makes the curve through (or near) `keys` at `times` (seconds), for keys without additional data. Keys are
    /// normalised in f64. With [`Ends::Loop`], the last key must equal the first.
    #[must_use]
    pub fn new(
        definition: Definition,
        signs: KeySigns,
        ends: Ends,
        times: &[f64],
        keys: &[Quat],
    ) -> Self {
        Self::build(definition, ends, ReferenceTrack::new(signs, times, keys))
    }

    /// The curve of a track with all data of its keys. `tcb` applies to every key if the track has no values for each
    /// key.
    pub(crate) fn of_track(
        definition: Definition,
        signs: KeySigns,
        ends: Ends,
        tcb: Tcb,
        track: tracks::Track<'_>,
    ) -> Self {
        let mut reference_track = ReferenceTrack::new(signs, track.times, track.keys);
        reference_track.velocities = track.velocities.to_vec();
        reference_track.tangents = track.tangents.to_vec();
        reference_track.tcb = match track.tcb {
            [] => vec![tcb; track.keys.len()],
            values => values.to_vec(),
        };
        Self::build(definition, ends, reference_track)
    }

    /// The same curve with constant angular speed; a step curve does not change.
    pub(crate) fn at_constant_speed(mut self) -> Self {
        let lengths = CurveLengths::new(&self.segments);
        self.lengths = (lengths.total() > 0.0).then_some(lengths);
        self
    }

    fn build(definition: Definition, ends: Ends, track: ReferenceTrack) -> Self {
        Self {
            segments: (definition.segments)(&track, ends),
            track,
            lengths: None,
        }
    }

    /// The rotation at a time in seconds. Before the first key and after the last it is the value there.
    #[must_use]
    pub fn rotation(&self, time: f64) -> DQuat {
        let last = self.track.last();
        if last == 0 {
            return self.track.keys[0];
        }
        if time >= self.track.times[last] {
            return match self.segments[last - 1] {
                Segment::Constant(_) => self.track.keys[last],
                segment => segment.rotation(1.0),
            };
        }
        let (i, t) = self.locate(time.max(self.track.times[0]));
        self.segments[i].rotation(t)
    }

    /// The angular velocity in the body frame in radians per second; zero outside the keys. At a key it is that of the
    /// later segment.
    #[must_use]
    pub fn velocity(&self, time: f64) -> DVec3 {
        let Some((i, t)) = self.inside(time) else {
            return DVec3::ZERO;
        };
        match &self.lengths {
            Some(lengths) => {
                // At rest, at the start or end of a segment, there is no direction; use the direction slightly
                // inside.
                let moving = t.clamp(1e-6, 1.0 - 1e-6);
                let direction = self.segments[i].velocity(moving).normalize_or_zero();
                direction * (lengths.total() / self.duration())
            }
            None => self.segment_velocity(i, t),
        }
    }

    /// The angular acceleration in the body frame in radians per second squared; zero outside the keys. At a key it is
    /// that of the later segment.
    #[must_use]
    pub fn acceleration(&self, time: f64) -> DVec3 {
        let Some((i, t)) = self.inside(time) else {
            return DVec3::ZERO;
        };
        let Some(lengths) = &self.lengths else {
            return self.segment_acceleration(i, t);
        };
        // At constant speed only the direction of the velocity changes.
        let speed = lengths.total() / self.duration();
        let (velocity, bend) = (
            self.segments[i].velocity(t),
            self.segments[i].acceleration(t),
        );
        let direction = velocity.normalize_or_zero();
        let rate = speed / velocity.length();
        (bend - direction * bend.dot(direction)) * rate * rate
    }

    /// The angular velocity at parameter `t` (0 to 1) of segment `i`; at a key, both sides can be evaluated.
    #[must_use]
    pub fn segment_velocity(&self, i: usize, t: f64) -> DVec3 {
        self.segments[i].velocity(t) / self.track.step(i)
    }

    /// The angular acceleration at parameter `t` of segment `i`, as [`ReferenceCurve::segment_velocity`].
    #[must_use]
    pub fn segment_acceleration(&self, i: usize, t: f64) -> DVec3 {
        let step = self.track.step(i);
        self.segments[i].acceleration(t) / (step * step)
    }

    fn inside(&self, time: f64) -> Option<(usize, f64)> {
        let times = &self.track.times;
        let last = self.track.last();
        (last > 0 && (times[0]..=times[last]).contains(&time)).then(|| self.locate(time))
    }

    /// Seconds from the first key to the last.
    fn duration(&self) -> f64 {
        self.track.times[self.track.last()] - self.track.times[0]
    }

    fn locate(&self, time: f64) -> (usize, f64) {
        let times = &self.track.times;
        if let Some(lengths) = &self.lengths {
            let part = (time - times[0]) / self.duration();
            return lengths.locate(&self.segments, part.clamp(0.0, 1.0));
        }
        let after = times.partition_point(|&key| key <= time);
        let i = after.saturating_sub(1).min(self.track.last() - 1);
        (i, (time - times[i]) / self.track.step(i))
    }
}
