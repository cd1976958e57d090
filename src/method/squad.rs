//! Spherical quadrangle interpolation.

use crate::curve::formula::{Formula, NUMBERS, quaternion, slerp};
use crate::fit::exact::fit::Shape;
use crate::fit::exact::handles::{BothSides, EndHandle, HandlePair, HandleRule};
use crate::fit::exact::shape::shape_of;
use crate::math::dual::Scalar;
use crate::math::quaternion::{Real as _, Vector, scaled, sum};
use crate::math::ranges::Algebra;
use crate::method::vector_method::VectorMethod;
use crate::method::{Cost, CurveKind, Keys, Method, SmoothCurves, defaults, ends};

/// Squad: spherical quadrangle interpolation. It ignores key times, so its velocity jumps at unevenly spaced keys.
pub const SQUAD: Method = Method {
    name: "squad",
    summary: "smooth through evenly spaced keys; common in engines",
    formula: "slerp(slerp(q0, q1; t), slerp(s0, s1; t); 2t(1-t)), s_i = q_i exp(-(log(q_i⁻¹ q_{i+1}) + log(q_i⁻¹ q_{i-1}))/4)",
    source: "Shoemake 1987, Quaternion calculus and fast animation",
    keeps_constant_velocity: Keys::Even,
    cost: Cost::new(300.0, 2.9),
    curves: &CURVES,
    ..defaults(VectorMethod::BesselOverhauser)
};

static SHAPE: Shape = shape_of::<Squad>(16);

/// Spherical quadrangle interpolation (Shoemake 1987):
/// `slerp(slerp(q0, q1; t), slerp(s0, s1; t); 2t(1-t))`.
///
/// Numbers: `q0`, `s0`, `s1`, `q1`. Their signs define the arcs.
struct Squad;

impl Formula for Squad {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let along = slerp(quaternion(numbers, 0), quaternion(numbers, 12), t);
        let beside = slerp(quaternion(numbers, 4), quaternion(numbers, 8), t);
        let weight = S::all(2.0) * t * (S::all(1.0) - t);
        slerp(along, beside, weight)
    }
}

static CURVES: CurveKind = CurveKind::Smooth(SmoothCurves::new(&SHAPE, ends::curves::<SquadRule>));

/// `s_i = q_i exp(outgoing) = q_i exp(-incoming)`.
struct SquadRule;

impl HandleRule for SquadRule {
    #[inline(always)]
    fn handles<A: Algebra>(_: &mut A, [before, after]: BothSides<A>) -> HandlePair<A::Number> {
        let bend = sum(after.log, scaled(before.log, A::Number::all(-1.0)));
        HandlePair {
            incoming: scaled(bend, A::Number::all(0.25)),
            outgoing: scaled(bend, A::Number::all(-0.25)),
        }
    }

    /// The derivative of a squad is `log + 2 outgoing` at its start and `log + 2 incoming` at its
    /// end, as half-rotation vectors per interval.
    fn end(log: Vector, other: Vector, handle: EndHandle) -> Vector {
        match handle {
            EndHandle::Velocity(vector) => scaled(sum(vector, scaled(log, -1.0)), 0.5),
            EndHandle::Parabolic => scaled(other, -1.0),
            EndHandle::Natural(_) => scaled(other, -0.5),
        }
    }
}
