//! Samples straight from keys, where a set has fewer samples than keys: nothing is prepared,
//! and intervals without a sample cost nothing but the look at their times.

pub(crate) mod arcs;
pub(crate) mod cubics;
pub(crate) mod evaluate;
pub(crate) mod pieces;
pub(crate) mod upload;

use crate::curve::options::Path;
use crate::fit::tangent_weights::WeightRule;
use crate::method::interpolation::Interpolation;
use crate::shader::{Form, LONGEST_STEP};
use crate::time::frames::Timeline;
use crate::tracks::set::TrackSet;

/// What stands for a sample that the keys beside it do not give, because its curve turns too
/// far for the small-angle series: no rotation is 0. It is worked out by way of segments.
pub(crate) const UNRESOLVED: [f32; 4] = [0.0; 4];

/// The curves that follow from a sample's keys alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum KeyCurve {
    /// Arcs between two keys.
    Arcs,
    /// Tracks of two keys, which smooth methods join at constant velocity.
    TwoKeys,
    /// Cubics between four keys.
    Cubics(WeightRule),
}

impl KeyCurve {
    /// The curves of a set, where it has fewer samples than keys, and nothing but arcs between
    /// its keys, or cubics most of which turn through small angles.
    pub(crate) fn of_set(
        set: &TrackSet,
        interpolation: &Interpolation,
        timeline: &Timeline,
    ) -> Option<Self> {
        let are_fewer = timeline.len() * set.track_count() < set.key_count();
        // As authored an arc may be of more than half a turn, and is then two segments.
        let arcs_are_short = interpolation.path == Path::Shortest || set.arcs_are_short();
        if !are_fewer || !arcs_are_short || !interpolation.wrap().are_held() {
            return None;
        }
        match interpolation.form() {
            Form::Arc => Some(Self::Arcs),
            Form::Polynomial if set.longest() <= 2 => {
                interpolation.is_steady_alone().then_some(Self::TwoKeys)
            }
            Form::Polynomial => {
                let weights = interpolation.small_angle_weights()?;
                turns_little(set).then_some(Self::Cubics(weights))
            }
        }
    }
}

/// Whether two thirds of some keys looked at are near those before them: with fewer, to
/// prepare all of them takes no longer. Nothing but time depends on it.
fn turns_little(set: &TrackSet) -> bool {
    const LOOKS: usize = 64;
    let (mut near, mut looks) = (0, 0);
    for look in 0..LOOKS {
        let (_, keys) = set.times_and_keys(look * set.track_count() / LOOKS);
        let place = keys.len() * look / LOOKS;
        if let [from, to, ..] = keys[place..] {
            looks += 1;
            near += usize::from(1.0 - from.dot(to).abs() <= 0.5 * LONGEST_STEP);
        }
    }
    3 * near > 2 * looks
}
