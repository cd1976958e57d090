//! Spherical linear interpolation.

use crate::curve::formula::RotationVectorNumbers;
use crate::curve::options::Ends;
use crate::fit::block::{Intervals, TrackStretch, at, squared_extent};
use crate::fit::exact::shape::ROTATION_VECTOR;
use crate::method::vector_method::VectorMethod;
use crate::method::{Continuity, Cost, CurveKind, Keys, Method, SmoothCurves, defaults};
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
    curves: &CURVES,
    ..defaults(VectorMethod::Linear)
};

static CURVES: CurveKind = CurveKind::Arcs(SmoothCurves::new(&ROTATION_VECTOR, curves));

/// The formula `q0 exp(t log(q0⁻¹ q1))`, for quantities that need derivatives.
fn curves(intervals: &mut Intervals, stretches: &[TrackStretch], _: Ends) {
    for lane in stretches.iter().flat_map(TrackStretch::lanes) {
        let log = at(&intervals.logs, lane);
        let numbers = RotationVectorNumbers {
            base: intervals.key(lane),
            linear: log,
            ..RotationVectorNumbers::default()
        };
        intervals.set_curve(lane, numbers);
        intervals.squared_extents[lane] = squared_extent([log, [0.0; 3], [0.0; 3]]);
    }
}
