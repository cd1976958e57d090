//! Spherical linear interpolation.

use crate::curve::options::Ends;
use crate::fit::double::intervals::{Intervals, Stretch, at, squared_extent};
use crate::fit::double::shape::Shape;
use crate::method::{Continuity, Cost, Curves, Keys, Method, Smooth, USUAL};
use crate::reference;
use crate::shader::Form;

/// Slerp: the shortest arc between neighbouring keys, at constant speed.
pub const SLERP: Method = Method {
    name: "slerp",
    summary: "constant angular velocity between keys; velocity jumps at each key",
    formula: "q(t) = q0 (q0⁻¹ q1)^t",
    source: "Shoemake 1985, Animating rotation with quaternion curves",
    continuity_on_even_keys: Continuity::C0,
    keeps_constant_velocity: Keys::Any,
    uses_neighbours: false,
    form: Form::Arc,
    cost: Cost::new(10.0, 1.7),
    reference: reference::given::SLERP,
    curves: &CURVES,
    ..USUAL
};

static CURVES: Curves = Curves::Arcs(Smooth::new(Shape::ROTATION_VECTOR, curves));

/// The formula `q0 exp(t log(q0⁻¹ q1))`, for quantities that need derivatives.
fn curves(intervals: &mut Intervals, stretches: &[Stretch], _: Ends) {
    for lane in stretches.iter().flat_map(Stretch::lanes) {
        let log = at(&intervals.logs, lane);
        intervals.set_numbers(lane, 0, &intervals.key(lane));
        intervals.set_numbers(lane, 4, &log);
        intervals.squared_extents[lane] = squared_extent([log, [0.0; 3], [0.0; 3]]);
    }
}
