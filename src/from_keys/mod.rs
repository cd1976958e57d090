//! Evaluation directly from keys, for sets with few samples between keys: no segment is prepared, and for intervals
//! without samples only the times are read.

pub(crate) mod arcs;
pub(crate) mod cubics;
pub(crate) mod evaluate;
pub(crate) mod intervals;
pub(crate) mod kept;

use glam::Vec4;

use crate::curve::options::KeySigns;
use crate::fit::tangent_weights::WeightRule;
use crate::math::quaternion::dot;
use crate::method::interpolation::Interpolation;
use crate::prepare::preparation::SetRequest;
use crate::shader::{Form, LONGEST_STEP, SMALL_SQUARED_EXTENT};
use crate::tracks::set::TrackSet;

/// The value of a sample whose curve rotates too far for the small-angle series; no rotation is 0. Such samples are
/// then evaluated by segments.
pub(crate) const UNRESOLVED: [f32; 4] = [0.0; 4];

/// Curves that can be evaluated from the keys around a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum KeyCurve {
    /// Arcs between two keys.
    Arcs,
    /// Tracks of two keys, which smooth methods interpolate with constant velocity.
    TwoKeys,
    /// Cubics between four keys.
    Cubics(WeightRule),
}

impl KeyCurve {
    /// The number of keys that a sample needs on each side, in addition to the two of its interval.
    pub(crate) fn beside(self) -> usize {
        usize::from(matches!(self, Self::Cubics(_)))
    }

    /// The curves of a request that can be evaluated from keys: it has fewer samples than `limit` times its keys, and
    /// its curves are arcs, or cubics most of which have small angles. `None` for any other request.
    pub(crate) fn of(request: &SetRequest<'_>, limit: usize) -> Option<Self> {
        let (set, interpolation) = (request.set, request.interpolation);
        let keys = set.keys_of(request.tracks.clone());
        let are_fewer = request.len() < keys;
        if !are_fewer && !is_below(request, keys, limit) {
            return None;
        }
        Self::of_set(set, interpolation).filter(|curve| match curve {
            Self::Cubics(_) if are_fewer => has_small_steps(set),
            Self::Cubics(_) => has_small_curves(set, request.len() / keys),
            _ => true,
        })
    }

    /// The curves of a set that can be evaluated from keys; cubics only where they have small angles.
    fn of_set(set: &TrackSet, interpolation: &Interpolation) -> Option<Self> {
        // With signs as authored, an arc may exceed half a turn. Then it is two segments, which this route does not have.
        let arcs_are_short = interpolation.signs == KeySigns::Shortest || set.arcs_are_short();
        if !arcs_are_short || !interpolation.wrap().are_held() {
            return None;
        }
        match interpolation.form() {
            Form::Arc => Some(Self::Arcs),
            Form::Polynomial if set.longest() <= 2 => {
                interpolation.is_steady_alone().then_some(Self::TwoKeys)
            }
            Form::Polynomial => Some(Self::Cubics(interpolation.plain()?.fast?.weights)),
        }
    }
}

/// The mean number of keys of a track from which intervals fill vectors.
const MANY_KEYS: usize = 16;

/// Whether tracks have many keys and fewer samples than `limit` times these.
fn is_below(request: &SetRequest<'_>, keys: usize, limit: usize) -> bool {
    keys >= MANY_KEYS * request.tracks.len() && request.len() < keys.saturating_mul(limit)
}

/// Whether more than two thirds of the keys are within a small angle of the next. With fewer, preparing all segments
/// takes no longer.
fn has_small_steps(set: &TrackSet) -> bool {
    let (small, probes) = probed(set, |[step]| square(step) <= LONGEST_STEP);
    3 * small > 2 * probes
}

/// Whether nearly all curves between keys rotate so little that the small-angle series can be used, if the tangents are
/// means of steps. Each of the other curves must be prepared, with its neighbours, which takes several times as long as
/// the series; and its samples are evaluated twice, which matters if a key has several samples.
fn has_small_curves(set: &TrackSet, samples_of_a_key: usize) -> bool {
    let is_small = |steps: [Vec4; 3]| {
        let [before, step, after] = steps;
        let vectors = [before + step, 4.0 * step - before - after, step + after];
        let squared_extent: f32 = vectors.map(square).iter().sum();
        let longest = steps.map(square).into_iter().fold(0.0, f32::max);
        squared_extent <= 36.0 * SMALL_SQUARED_EXTENT && longest <= LONGEST_STEP
    };
    let (small, probes) = probed(set, is_small);
    let of_large = if samples_of_a_key < 4 { 5 } else { 20 };
    of_large * (probes - small) < probes
}

fn square(vector: Vec4) -> f32 {
    dot(vector.to_array(), vector.to_array())
}

/// Probes the keys at up to 64 places. Returns the number of places at which the steps between neighbouring keys are
/// small, and the number of places. Only speed depends on this; the bits do not.
fn probed<const STEPS: usize>(
    set: &TrackSet,
    is_small: impl Fn([Vec4; STEPS]) -> bool,
) -> (usize, usize) {
    const PROBES: usize = 64;
    let (mut small, mut probes) = (0, 0);
    for probe in 0..PROBES {
        let (_, keys) = set.times_and_keys(probe * set.track_count() / PROBES);
        let index = keys.len() * probe / PROBES;
        if let Some(keys) = keys.get(index..=index + STEPS) {
            let mut from = Vec4::from(keys[0]);
            let steps = std::array::from_fn(|i| {
                let to = Vec4::from(keys[i + 1]);
                let to = if dot(from.to_array(), to.to_array()) < 0.0 {
                    -to
                } else {
                    to
                };
                to - std::mem::replace(&mut from, to)
            });
            probes += 1;
            small += usize::from(is_small(steps));
        }
    }
    (small, probes)
}
