//! Conversion of key intervals to the coefficients of segments, many intervals at once in vector lanes. This module
//! does not depend on the methods, which are defined with it. `prepare` applies methods to tracks.
//!
//! # Two kinds of fitting
//!
//! A segment is a polynomial in f32 for each component of a rotation. It is computed in one of two ways:
//!
//! - [`exact`], in f64, works for every method, angle and quantity. A curve is evaluated by its formula at Chebyshev
//!   nodes. If the last coefficients of the polynomial through these values show that it is near enough, it is kept;
//!   otherwise the curve is divided into two.
//! - [`fast`], in f32, works for rotations by methods whose curves depend on four keys. Small angles are a series,
//!   longer curves a Hermite fit of the whole curve or of two halves. For motion capture it takes a sixth of the time
//!   (`dense`: 444 → 67 ms). It marks the lanes whose numbers are not valid; these are fitted by [`exact`].
//!
//! The choice for an interval depends only on its keys and on the options, never on the vector width or on other
//! intervals of its block: every machine computes the same bits.
//!
//! # Types
//!
//! | type | what it is |
//! |---|---|
//! | [`block::Intervals`] | up to 128 key intervals, one a lane, and their f64 intermediate results |
//! | [`block::TrackStretch`] | which lanes are consecutive intervals of which track |
//! | [`tangent_weights::KeyWeights`] | how the steps on both sides of a key count in its tangent |
//! | [`fast::handles::HandlesF32`] | steps, handles and curves of the same intervals in f32 |
//! | [`exact::fit::Shape`] | a formula, and how its curves are sampled |
//! | [`exact::fit::FitBlock`] | up to 128 curves of one shape that wait to be fitted |
//! | [`exact::cut::Cutter`] | curves that one polynomial does not fit |
//! | [`exact::fit::IntervalCurve`] | one curve by its formula, in f64 |
//! | [`nodes::Nodes`] | where curves are sampled, and how powers follow from the samples |
//!
//! # Steps
//!
//! ```text
//! keys ─► Intervals ─┬─ fast: steps ─► small angles: a series ──────────────────► segment
//!                    │          └───► handles ─► Hermite fit ───────────────────► segment
//!                    │                      └ out of range ┐
//!                    └─ exact: steps ─► handles ─► numbers ┴► FitBlock ─► powers ─► segment
//!                                                               └ does not fit ─► Cutter
//! ```
//!
//! # Memory
//!
//! A block has a row for each number of an interval, [`block::ROW_LEN`] lanes long, so that a vector of any width is
//! one load. The neighbouring intervals are next to a stretch as context: passes read a lane before and after theirs,
//! and need not know where a track ends. All rows take about 50 KB.
//!
//! ```text
//! lane        0        1 2 … n        n+1      n+2      n+3 … m        m+1
//!             context  first track    context  context  second track   context
//! from        x y z w of the key at the interval's start
//! steps[c]    component c of the step, f64
//! numbers[i]  number i of the curve's formula, f64
//! ```

pub(crate) mod block;
pub(crate) mod constant_velocity;
pub(crate) mod exact;
pub(crate) mod fast;
pub(crate) mod motion;
pub(crate) mod nodes;
pub(crate) mod tangent_weights;
