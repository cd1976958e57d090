//! Bessel-Overhauser: the tangent at a key is that of the parabola through it and
//! its two neighbours.

use super::ends::{self, Handles};
use super::keys::Keys;
use super::{Form, Method};
use crate::numeric::{exp, log_near, product};
use crate::reference;

/// Bessel-Overhauser on rotations: smooth in time for any spacing of keys, and
/// equal to [`CATMULL_ROM`](super::CATMULL_ROM) for even ones.
pub const BESSEL_OVERHAUSER: Method = Method {
    name: "bessel-overhauser",
    summary: "smooth through keys at any spacing; equals catmull-rom on even spacing",
    formula: "t_i = ((s⁻)^h_i (s⁺)^h_{i-1})^(1/(h_{i-1}+h_i)), a_i = q_i t_i^(h_i/3), b_i = q_i t_i^(-h_{i-1}/3)",
    source: "Overhauser 1968; on rotations in the form of Kim, Kim, Shin 1995",
    continuity: "C1",
    interpolates: true,
    form: Form::Cumulative,
    reference: reference::Kind::BesselOverhauser,
    curves: |keys, intervals, emit| ends::curves(keys, intervals, handles, emit),
};

fn handles(keys: &Keys, key: isize) -> Handles {
    let before = keys.duration(key - 1);
    let after = keys.duration(key);
    // The slope of each side, weighted by the other side's step, left one first:
    // only so does it equal Catmull-Rom on uniform keys.
    let left = keys.log_step(key - 1) * (after / before);
    let right = keys.log_step(key) * (before / after);
    // The product's logarithm wraps: on its principal branch a long tangent would
    // point backwards.
    let tangent = log_near(product(exp(left), exp(right)), left + right) / (before + after);
    Handles {
        incoming: tangent * (before / 3.0),
        outgoing: tangent * (after / 3.0),
    }
}
