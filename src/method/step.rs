//! The step method: each key is held until the next one.

use crate::method::vector_method::VectorMethod;
use crate::method::{Continuity, Cost, CurveKind, Method, defaults};

/// Step: each key is held until the next one, for states that switch.
pub const STEP: Method = Method {
    name: "step",
    summary: "holds each key until the next; for switched values",
    formula: "q(t) = q0",
    source: "glTF 2.0, section 3.11, STEP",
    continuity: Continuity::Jumps,
    continuity_on_even_keys: Continuity::Jumps,
    symmetric: false,
    uses_neighbours: false,
    cost: Cost::new(3.4, 0.87),
    curves: &CurveKind::Steps,
    ..defaults(VectorMethod::Step)
};
