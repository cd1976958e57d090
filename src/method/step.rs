//! The step method: each key is held until the next.

use crate::method::vector_method::VectorMethod;
use crate::method::{Continuity, Cost, CurveKind, Method, defaults};

/// Holds each key until the next: for things that switch and do not move.
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
