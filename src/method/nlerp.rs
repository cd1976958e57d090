//! Normalised linear interpolation.

use crate::fit::double::handles::{BothSides, EndHandle, EndInterval, HandleRule, Handles};
use crate::fit::double::shape::Shape;
use crate::math::quaternion::{Real as _, Vector};
use crate::math::ranges::Algebra;
use crate::method::{Continuity, Cost, Curves, Keys, Method, Smooth, USUAL, ends};
use crate::reference;

/// Nlerp: the straight line between neighbouring keys, normalised. It follows the path of slerp at
/// another speed, slower near the keys: it is up to 8° from slerp where keys are 180° apart.
pub const NLERP: Method = Method {
    name: "nlerp",
    summary: "slerp's way at uneven speed, as many games have it",
    formula: "q(t) = ((1-t) q0 + t q1) / |(1-t) q0 + t q1|",
    source: "Blow 2004, Understanding slerp, then not using it",
    continuity: Continuity::C0,
    continuity_on_even_keys: Continuity::C0,
    keeps_constant_velocity: Keys::Never,
    uses_neighbours: false,
    cost: Cost::new(150.0, 2.8),
    reference: reference::given::NLERP,
    curves: &CURVES,
    ..USUAL
};

static CURVES: Curves = Curves::Smooth(Smooth::new(Shape::LINEAR, ends::controls::<Rule>));

/// All handles are 0; the formula does not use them.
struct Rule;

impl HandleRule for Rule {
    #[inline(always)]
    fn handles<A: Algebra>(_: &mut A, _: BothSides<A>) -> Handles<A::Number> {
        Handles {
            incoming: [A::Number::all(0.0); 3],
            outgoing: [A::Number::all(0.0); 3],
        }
    }

    fn end(_: EndInterval, _: EndHandle) -> Vector {
        [0.0; 3]
    }
}
