//! Evaluation directly from keys, for sets with fewer samples than keys: no segment is prepared, and for intervals
//! without samples only the times are read.

pub(crate) mod arcs;
pub(crate) mod cubics;
pub(crate) mod evaluate;

use crate::curve::options::KeySigns;
use crate::fit::tangent_weights::WeightRule;
use crate::prepare::preparation::SetRequest;
use crate::shader::{Form, LONGEST_STEP};
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

    /// The curves of a request that can be evaluated from keys: it has fewer samples than keys, and its curves are
    /// arcs, or cubics most of which have small angles. `None` for any other request.
    pub(crate) fn of(request: &SetRequest<'_>) -> Option<Self> {
        let (set, interpolation) = (request.set, request.interpolation);
        let are_fewer = request.len() < set.keys_of(request.tracks.clone());
        // On the path as authored an arc may exceed half a turn; it is then two segments.
        let arcs_are_short = interpolation.signs == KeySigns::Shortest || set.arcs_are_short();
        if !are_fewer || !arcs_are_short || !interpolation.wrap().are_held() {
            return None;
        }
        match interpolation.form() {
            Form::Arc => Some(Self::Arcs),
            Form::Polynomial if set.longest() <= 2 => {
                interpolation.is_steady_alone().then_some(Self::TwoKeys)
            }
            Form::Polynomial => {
                let weights = interpolation.plain()?.fast?.weights;
                has_small_steps(set).then_some(Self::Cubics(weights))
            }
        }
    }
}

/// Whether, of at most 64 keys, more than two thirds are within a small angle of the next. With fewer, preparing all
/// segments takes no longer. Only speed depends on this; the bits do not.
#[allow(clippy::disallowed_methods)] // as it says
fn has_small_steps(set: &TrackSet) -> bool {
    const PROBES: usize = 64;
    let (mut near, mut probes) = (0, 0);
    for probe in 0..PROBES {
        let (_, keys) = set.times_and_keys(probe * set.track_count() / PROBES);
        let index = keys.len() * probe / PROBES;
        if let [from, to, ..] = keys[index..] {
            probes += 1;
            near += usize::from(1.0 - from.dot(to).abs() <= 0.5 * LONGEST_STEP);
        }
    }
    3 * near > 2 * probes
}
