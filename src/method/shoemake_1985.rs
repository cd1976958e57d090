//! Shoemake's construction, as published.

use crate::fit::exact::shape::DE_CASTELJAU;
use crate::method::shoemake::Bisector;
use crate::method::vector_method::VectorMethod;
use crate::method::{Cost, CurveKind, Keys, Method, SmoothCurves, defaults, ends};

/// Shoemake's published construction: the handle is at a third of the arc from the key to the bisector. It ignores
/// key times, so its velocity jumps at unevenly spaced keys.
pub const SHOEMAKE_1985: Method = Method {
    name: "shoemake-1985",
    summary: "Bezier curves of rotations as published; smooth through evenly spaced keys",
    formula: "a_i = slerp(q_i, Bisect(Double(q_{i-1}, q_i), q_{i+1}), 1/3), b_i = Double(a_i, q_i), de Casteljau",
    source: "Shoemake 1985, Animating rotation with quaternion curves, section 4.4",
    keeps_constant_velocity: Keys::Even,
    cost: Cost::new(530.0, 2.8),
    curves: &CURVES,
    ..defaults(VectorMethod::BesselOverhauser)
};

static CURVES: CurveKind = CurveKind::Smooth(SmoothCurves::new(
    &DE_CASTELJAU,
    ends::curves::<Bisector<3>>,
));
