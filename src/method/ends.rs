//! Interpolating cubics: handles at the keys become cumulative curves.
//!
//! A handle is the half-rotation vector from a key to its control rotation:
//! `a_i = q_i exp(out_i)` after the key, `b_i = q_i exp(-in_i)` before it. A method
//! says what the handles of an inner key are; this says what happens at the ends
//! and puts the curve together.

use std::ops::Range;

use glam::DVec3;

use super::Ends;
use super::curve::{BERNSTEIN, Cumulative, Curve};
use super::keys::Keys;
use crate::numeric::{exp, log, product, step};

/// The handles of a key: towards the interval before it and the one after it.
#[derive(Clone, Copy)]
pub(super) struct Handles {
    pub(super) incoming: DVec3,
    pub(super) outgoing: DVec3,
}

/// The curves of `intervals`, for a method whose handles at key `i` follow from
/// the intervals before and after it.
pub(super) fn curves(
    keys: &Keys,
    intervals: Range<usize>,
    handles: impl Fn(&Keys, isize) -> Handles,
    emit: &mut dyn FnMut(Curve),
) {
    let last = keys.intervals() - 1;
    if last == 0 {
        return emit(slerp(keys));
    }
    let looped = matches!(keys.ends, Ends::Loop);
    let mut at_start = handles_or_none(keys, intervals.start, looped, &handles);
    for i in intervals {
        let at_end = handles_or_none(keys, i + 1, looped, &handles);
        emit(match (at_start, at_end) {
            (Some(start), Some(end)) => between(keys, i, start.outgoing, end.incoming),
            (None, Some(end)) => first(keys, end.incoming),
            (Some(start), None) => last_interval(keys, last, start.outgoing),
            (None, None) => slerp(keys),
        });
        at_start = at_end;
    }
}

fn handles_or_none(
    keys: &Keys,
    key: usize,
    looped: bool,
    handles: &impl Fn(&Keys, isize) -> Handles,
) -> Option<Handles> {
    let inner = 0 < key && key < keys.intervals();
    (inner || looped).then(|| handles(keys, key as isize))
}

/// Two keys: the handles of constant velocity.
fn slerp(keys: &Keys) -> Curve {
    let third = keys.log_step(0) / 3.0;
    cumulative(keys, 0, [third; 3])
}

fn between(keys: &Keys, i: usize, outgoing: DVec3, incoming: DVec3) -> Curve {
    // w₂ = log(a⁻¹ b), a = q_i exp(out), b = q_{i+1} exp(-in).
    let whole = keys.step(i as isize);
    let middle = product(product(exp(-outgoing), whole), exp(-incoming));
    cumulative(keys, i, [outgoing, log(middle), incoming])
}

fn cumulative(keys: &Keys, i: usize, vectors: [DVec3; 3]) -> Curve {
    Curve::Cumulative(Cumulative {
        base: keys.rotations[i],
        vectors,
        basis: &BERNSTEIN,
    })
}

fn first(keys: &Keys, incoming: DVec3) -> Curve {
    match keys.ends {
        Ends::Frozen => Curve::Hold,
        Ends::Clamped { start, .. } => between(keys, 0, start * (keys.duration(0) / 6.0), incoming),
        Ends::Natural => {
            // No acceleration: a lies half way between the key and b.
            let end = product(keys.rotations[1], exp(-incoming));
            let half = log(step(keys.rotations[0], end)) / 2.0;
            cumulative(keys, 0, [half, half, incoming])
        }
        Ends::Parabolic | Ends::Loop => {
            between(keys, 0, keys.log_step(0) * (2.0 / 3.0) - incoming, incoming)
        }
    }
}

fn last_interval(keys: &Keys, last: usize, outgoing: DVec3) -> Curve {
    match keys.ends {
        Ends::Frozen => Curve::Hold,
        Ends::Clamped { end, .. } => between(
            keys,
            last,
            outgoing,
            end * (keys.duration(last as isize) / 6.0),
        ),
        Ends::Natural => {
            let start = product(keys.rotations[last], exp(outgoing));
            let half = log(step(start, keys.rotations[last + 1])) / 2.0;
            cumulative(keys, last, [outgoing, half, half])
        }
        Ends::Parabolic | Ends::Loop => {
            let incoming = keys.log_step(last as isize) * (2.0 / 3.0) - outgoing;
            between(keys, last, outgoing, incoming)
        }
    }
}
