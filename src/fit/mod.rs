//! Turns key intervals into the coefficients of segments, many intervals at once in vector lanes.
//! The methods are built on this folder; it knows none of them. `prepare` applies methods to
//! tracks.
//!
//! # Two ways
//!
//! A segment is a polynomial in f32 for each component of a rotation. It is found in one of two ways:
//!
//! - [`exact`], in f64, serves every method, angle and quantity. A curve is evaluated by its formula at
//!   Chebyshev nodes; the polynomial through these values is kept if its last coefficients show that it
//!   is near enough, else the curve is cut in two.
//! - [`fast`], in f32, serves rotations by methods whose curve follows from four keys. Small angles
//!   are a series, longer curves a Hermite fit of the whole or of two halves. On motion capture it takes
//!   a sixth of the time (`dense`: 444 → 67 ms). It says of each lane whether its numbers are valid;
//!   the others go the exact way.
//!
//! Which of the two an interval takes depends on its keys and on the options alone, never on the vector
//! width or on what else is in its block: every machine finds the same bits.
//!
//! # Types
//!
//! | type | what it is |
//! |---|---|
//! | [`block::Intervals`] | up to 128 key intervals, one a lane, and what is computed of them in f64 |
//! | [`block::TrackStretch`] | which lanes are consecutive intervals of which track |
//! | [`tangent_weights::KeyWeights`] | how the steps on both sides of a key count in its tangent |
//! | [`fast::handles::HandlesF32`] | steps, handles and curves of the same intervals in f32 |
//! | [`exact::fit::Shape`] | a formula, and how its curves are sampled |
//! | [`exact::fit::FitBlock`] | up to 128 curves of one shape that wait to be fitted |
//! | [`exact::cut::Cutter`] | curves that one polynomial does not fit |
//! | [`exact::fit::IntervalCurve`] | one curve by its formula, in f64 |
//! | [`nodes::Nodes`] | where curves are sampled, and how powers follow from the samples |
//!
//! # From a key to its stored curve
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
//! A block has a row for each number of an interval, [`block::ROW_LEN`] lanes long, so that a vector is one
//! load whatever its width. On either side of a stretch lies the neighbouring interval as context: passes
//! read a lane before and after theirs, and none asks where a track ends. All rows take about 50 KB.
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
