//! Spherical quadrangle interpolation.

use crate::fit::exact::handles::{BothSides, EndHandle, HandlePair, HandleRule};
use crate::fit::exact::shape::Shape;
use crate::math::quaternion::{Real as _, Vector, scaled, sum};
use crate::math::ranges::Algebra;
use crate::method::vector_method::VectorMethod;
use crate::method::{Cost, CurveKind, Keys, Method, SmoothCurves, defaults, ends};
use crate::reference;

/// Squad. It ignores the time steps, so its velocity jumps on uneven keys.
pub const SQUAD: Method = Method {
    name: "squad",
    summary: "smooth through evenly spaced keys, as many engines have it",
    formula: "slerp(slerp(q0, q1; t), slerp(s0, s1; t); 2t(1-t)), s_i = q_i exp(-(log(q_i⁻¹ q_{i+1}) + log(q_i⁻¹ q_{i-1}))/4)",
    source: "Shoemake 1987, Quaternion calculus and fast animation",
    keeps_constant_velocity: Keys::Even,
    cost: Cost::new(300.0, 2.9),
    reference: reference::handles::SQUAD,
    curves: &CURVES,
    ..defaults(VectorMethod::BesselOverhauser)
};

static CURVES: CurveKind =
    CurveKind::Smooth(SmoothCurves::new(Shape::SQUAD, ends::curves::<SquadRule>));

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
