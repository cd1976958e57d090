//! The textbook in f64, against which the engine's results are measured.
//!
//! **Why it is so.** An oracle must not share a mistake with the code that it checks. So nothing here
//! uses the engine, but for the keys as they come in (`tracks`) and the options of curves
//! (`curve::options`): no vector lanes, no fitted polynomials, no code of `math`. Formulas stand as the
//! papers have them, one rotation at a time, with `libm`'s sine and cosine. Slow, and accurate to about
//! 1e-15.
//!
//! **The way of the data.**
//!
//! 1. `ReferenceTrack`: a track's keys in f64, their signs aligned.
//! 2. [`Definition`]: how a method's curves follow from a track, one a method, found by the method's
//!    name. Most are a `HandleRule`: two control rotations a key. Those that need only two keys are in
//!    `two_keys`, those with other equations in `b_spline` and `c2`.
//! 3. `Segment`: the curve between two keys, as a formula: one of the few that several methods share, or
//!    any function of four quaternions, which stands beside its definition. Its velocity is the formula's
//!    where that is simple, else a difference of high order; its acceleration always is a difference.
//! 4. [`ReferenceCurve`]: one track's segments, evaluated at any time, at constant speed by
//!    `CurveLengths`.
//!
//! [`VectorCurve`] does the same for translations and scales in one file, and [`Follower`] moves a body
//! along such a curve; its frame is integrated by Runge and Kutta's method.
//!
//! Callers are `verify`, `tumble plot`, the reduction of keys, which tries curves
//! as they are defined, and the tests.

pub(crate) mod b_spline;
pub(crate) mod c2;
pub(crate) mod curve;
pub(crate) mod curve_lengths;
pub(crate) mod follow;
pub(crate) mod handles;
pub(crate) mod quaternion;
pub(crate) mod segment;
pub(crate) mod track;
pub(crate) mod two_keys;
pub(crate) mod vector;

pub use crate::reference::curve::{Definition, ReferenceCurve};
pub use crate::reference::follow::{
    Follower, FollowerDirection, FollowerFrame, FollowerSpeed, FollowerWalk, eased,
};
pub use crate::reference::quaternion::{
    angle_between, nlerp, slerp, slerp_from_end, slerp_from_end_left, slerp_from_start,
    slerp_from_start_left, squad,
};
pub use crate::reference::vector::VectorCurve;

/// The definitions of all methods.
const DEFINITIONS: &[&[Definition]] = &[
    two_keys::DEFINITIONS,
    handles::DEFINITIONS,
    &[b_spline::B_SPLINE, c2::C2],
];

/// The definition of the method of that name.
pub(crate) const fn definition(method: &str) -> Option<Definition> {
    let mut i = 0;
    while i < DEFINITIONS.len() {
        let mut j = 0;
        while j < DEFINITIONS[i].len() {
            let definition = DEFINITIONS[i][j];
            if is_same(definition.method.as_bytes(), method.as_bytes()) {
                return Some(definition);
            }
            j += 1;
        }
        i += 1;
    }
    None
}

/// Whether two names are the same; `==` is not there yet when constants are computed.
const fn is_same(a: &[u8], b: &[u8]) -> bool {
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}
