//! The cumulative uniform cubic B-spline.

use std::ops::Range;

use glam::{DQuat, DVec3};

use super::curve::{self, Cumulative, Curve};
use super::keys::Keys;
use super::{Ends, Form, Method};
use crate::numeric::{exp, product};
use crate::reference;

/// The cumulative cubic B-spline: the smoothest, but it only nears its keys. The
/// key times must be even for the curve to be smooth in time.
pub const B_SPLINE: Method = Method {
    name: "b-spline",
    summary: "continuous angular acceleration; passes near its keys, not through them",
    formula: "q(t) = q_{i-1} Π exp(C_j(t) log(q_{i+j-2}⁻¹ q_{i+j-1})), j = 1, 2, 3",
    source: "Kim, Kim, Shin 1995, A general construction scheme for unit quaternion curves",
    continuity: "C2 (uniform keys)",
    interpolates: false,
    form: Form::Cumulative,
    reference: reference::Kind::BSpline,
    curves,
};

fn curves(keys: &Keys, intervals: Range<usize>, emit: &mut dyn FnMut(Curve)) {
    let last = keys.intervals() - 1;
    for i in intervals {
        if matches!(keys.ends, Ends::Frozen) && last > 0 && (i == 0 || i == last) {
            emit(Curve::Hold);
            continue;
        }
        let before = step_vector(keys, i as isize - 1);
        let vectors = [
            before,
            step_vector(keys, i as isize),
            step_vector(keys, i as isize + 1),
        ];
        let base = product(keys.rotations[i], exp(-before));
        emit(Curve::Cumulative(Cumulative {
            base,
            vectors,
            basis: &curve::B_SPLINE,
        }));
    }
}

/// Each iteration shrinks the error by a third of the step's half-angle or more.
const END_ITERATIONS: usize = 48;

/// `exp(a) v exp(-a)`.
fn rotate(a: DVec3, v: DVec3) -> DVec3 {
    let turned = product(
        product(exp(a), DQuat::from_xyzw(v.x, v.y, v.z, 0.0)),
        exp(-a),
    );
    DVec3::new(turned.x, turned.y, turned.z)
}

/// The half-rotation vector of interval `i`; before the first and after the last
/// key the ends say what it is.
fn step_vector(keys: &Keys, i: isize) -> DVec3 {
    let last = keys.intervals() as isize - 1;
    let inner = i.clamp(0, last);
    if i == inner || matches!(keys.ends, Ends::Loop) {
        return keys.log_step(i);
    }
    let at_end = keys.log_step(inner);
    if last == 0 {
        return at_end; // two keys: constant velocity
    }
    match keys.ends {
        Ends::Parabolic => at_end * 2.0 - keys.log_step(if i < 0 { 1 } else { last - 1 }),
        Ends::Clamped { start, .. } if i < 0 => {
            // B₁' = B₂' = 1/2 and B₂ = 1/6 at t = 0.
            rotate(at_end / 6.0, start * keys.duration(inner) - at_end)
        }
        Ends::Clamped { end, .. } => {
            // B₂' = B₃' = 1/2 and B₃ = 1/6 at t = 1: the unknown also turns the frame.
            let target = end * keys.duration(inner);
            (0..END_ITERATIONS).fold(target - at_end, |step, _| {
                target - rotate(-step / 6.0, at_end)
            })
        }
        Ends::Natural | Ends::Loop | Ends::Frozen => at_end,
    }
}
