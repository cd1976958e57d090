//! Twin of `shaders/self_test.wgsl`: the same names, the same order.

use crate::shader::{Probe, Reply};
use crate::twin::arc_tangent::{arc_tangent, root};
use crate::twin::sine_cosine::sine_cosine;

/// The reply of a device that is exact.
pub(crate) fn reply(probe: Probe) -> Reply {
    let Probe { a, b, c, n } = probe;
    let sine_and_cosine = sine_cosine(c);
    Reply {
        contraction: a * b + c,
        reassociation: (a + b) - a,
        rounding: a + c,
        association: (a * b) * c,
        conversion: n as f32,
        cancellation: (a * c + b) - a * c,
        sine: sine_and_cosine.0,
        cosine: sine_and_cosine.1,
        root: root(a * a + c * c),
        arc_tangent: arc_tangent(a, c),
    }
}
