//! Textbook formulas in f64, with which the engine's results are compared.
//!
//! **Independence.** The reference must not share a mistake with the code that it checks. Therefore it uses no code
//! of the engine except for the input keys (`tracks`) and the options of curves (`curve::options`): no vector lanes,
//! no fitted polynomials, no code of `math`. Formulas are written as in the papers, one rotation at a time, with
//! `libm`'s sine and cosine. The reference is slow, and accurate to about 1e-15.
//!
//! **Structure.**
//!
//! 1. `ReferenceTrack`: a track's keys in f64, with aligned signs.
//! 2. [`Definition`]: how a method computes the curves of a track. There is one for each method, which is found by
//!    the method's name. Many are a `HandleRule`: two control rotations for each key. Methods that need only two keys
//!    are in `two_keys`, methods with other equations in `b_spline` and `c2`.
//! 3. `Segment`: the curve between two keys as a formula: one of a few that several methods share, or any function of
//!    four quaternions, defined beside the method. Its velocity is the formula's if that is simple, otherwise a
//!    difference of high order; its acceleration is always a difference.
//! 4. [`ReferenceCurve`]: one track's segments, evaluated at any time; at constant speed by `CurveLengths`.
//!
//! [`VectorCurve`] has the curves of translations and scales. [`Follower`] moves a body along such a curve; its frame
//! is integrated by the Runge-Kutta method.
//!
//! The reference is used by `verify`, by `tumble plot`, by the reduction of keys, and by tests.

pub(crate) mod b_spline;
pub(crate) mod c2;
pub(crate) mod curve;
pub(crate) mod curve_lengths;
pub(crate) mod follow;
pub(crate) mod handles;
pub(crate) mod quaternion;
mod rotation_vector;
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

/// The definition of the method with this name.
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

/// Whether two names are the same; `==` cannot be used in constants.
const fn is_same(a: &[u8], b: &[u8]) -> bool {
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}
