//! Spherical linear interpolation.

use super::{Curves, Form, Method};
use crate::reference;

/// Slerp: the shortest arc between neighbouring keys, at constant speed.
pub const SLERP: Method = Method {
    name: "slerp",
    summary: "constant angular velocity between keys; velocity jumps at each key",
    formula: "q(t) = q0 (q0⁻¹ q1)^t",
    source: "Shoemake 1985, Animating rotation with quaternion curves",
    continuity: "C0",
    interpolates: true,
    form: Form::Arc,
    reference: reference::Kind::Slerp,
    curves: Curves::Arcs,
};
