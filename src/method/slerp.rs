//! Spherical linear interpolation.

use super::{Continuity, Curves, Ends, Form, Keys, Method};
use crate::reference;

/// Slerp: the shortest arc between neighbouring keys, at constant speed.
pub const SLERP: Method = Method {
    name: "slerp",
    summary: "constant angular velocity between keys; velocity jumps at each key",
    formula: "q(t) = q0 (q0⁻¹ q1)^t",
    source: "Shoemake 1985, Animating rotation with quaternion curves",
    continuity: Continuity::C0,
    continuity_on_even_keys: Continuity::C0,
    keeps_constant_velocity: Keys::Any,
    interpolates: true,
    symmetric: true,
    form: Form::Arc,
    ends: Ends::Parabolic,
    path: None,
    reference: reference::Kind::Slerp,
    curves: Curves::Arcs,
};
