//! Catmull-Rom: the tangent at a key is half of the step between its neighbours.

use super::ends::{self, Handles};
use super::keys::Keys;
use super::{Form, Method};
use crate::numeric::{log_toward, product};
use crate::reference;

/// Catmull-Rom on rotations, in cumulative form. It ignores the time steps: on
/// uneven keys its velocity jumps; [`BESSEL_OVERHAUSER`](super::BESSEL_OVERHAUSER)
/// is its cure.
pub const CATMULL_ROM: Method = Method {
    name: "catmull-rom",
    summary: "smooth through evenly spaced keys; its velocity jumps where they are uneven",
    formula: "a_i = q_i (q_{i-1}⁻¹ q_{i+1})^(1/6), b_i = q_i (q_{i-1}⁻¹ q_{i+1})^(-1/6)",
    source: "Kim, Kim, Shin 1995, A general construction scheme for unit quaternion curves",
    continuity: "C1 (uniform keys)",
    interpolates: true,
    form: Form::Cumulative,
    reference: reference::Kind::CatmullRom,
    curves: |keys, intervals, emit| ends::curves(keys, intervals, handles, emit),
};

fn handles(keys: &Keys, key: isize) -> Handles {
    // The two-step's half-angle may truly approach pi: its sign is never re-aligned.
    let two_step = product(keys.step(key - 1), keys.step(key));
    let toward = keys.log_step(key - 1) + keys.log_step(key);
    let handle = log_toward(two_step, toward) / 6.0;
    Handles {
        incoming: handle,
        outgoing: handle,
    }
}
