//! Twin of `shaders/canary.wgsl`: the same names, the same order.

use super::arc_tangent::{arc_tangent, root};
use super::sine_cosine::sine_cosine;
use crate::segment::{Probe, Reply};

/// What an exact device replies.
pub(crate) fn reply(probe: Probe) -> Reply {
    let Probe { a, b, c, n } = probe;
    let turn = sine_cosine(c);
    Reply {
        contraction: a * b + c,
        reassociation: (a + b) - a,
        rounding: a + c,
        association: (a * b) * c,
        conversion: n as f32,
        cancellation: (a * c + b) - a * c,
        sine: turn.0,
        cosine: turn.1,
        root: root(a * a + c * c),
        arc_tangent: arc_tangent(a, c),
    }
}
