//! Bodies that follow paths: in which direction they face on curves through points, and when they are
//! where.
//!
//! **Why it is so.** A pose on a path depends on all of the path before it: a rotation-minimising frame
//! is an integral, a constant speed needs arc lengths, and a closed path spreads what is left over at its
//! end. No kernel can do that sample by sample. So everything is sampled once in f64 on the host and
//! fitted by the polynomials ([`fit`]) that serve all other smooth curves: devices then evaluate
//! positions and rotations as those of any clip, with the same bits, at any frame rate.
//!
//! **The way of the data**, for about 256 keys of one or more tracks at a time ([`prepare`]):
//!
//! 1. [`TimedPath`](timed_path::TimedPath): the cubics through a track's points, their slopes with the
//!    zeros divided out ([`polynomial`]), arc lengths where they are needed ([`lengths`]), and the
//!    relation between time and the parameter of an interval ([`speed`]).
//! 2. [`PathStretch`](stretch::PathStretch): each interval is cut where the direction jumps or the motion
//!    is not smooth. On a stretch the direction is one smooth function ([`Heading`](stretch::Heading)).
//! 3. [`RelativePieces`](carry::RelativePieces), for the minimal frame: stretches of all paths are cut into
//!    pieces in which the roll is a polynomial of degree 11, a piece in each vector lane ([`lanes`]). This
//!    is the costly part, and does not depend on the rotation at the start.
//! 4. [`BodyOnPath`](body::BodyOnPath): the rotations along one path. Minimal frames are carried from
//!    piece to piece, fixed and Frenet's ones follow from a side vector; [`rolls`] are angles about the
//!    direction that are added, spread over the length.
//! 5. [`Span`](sample::Span): a part of a path's time on one stretch. [`sample`] evaluates position or
//!    rotation at its 13 nodes, a span in each lane; [`fit()`](fit::fit) makes polynomials of them and cuts a span
//!    in two where one does not fit.
//!
//! The result are two [`ClipData`](crate::prepare::clip_data::ClipData), positions and rotations, and
//! warnings. The oracle for all this is [`reference::follow`](crate::reference::follow), by differential
//! equation and small steps.

pub(crate) mod body;
pub(crate) mod carried_piece;
pub(crate) mod carry;
pub(crate) mod fit;
pub(crate) mod lanes;
pub(crate) mod lengths;
pub(crate) mod options;
pub(crate) mod polynomial;
pub(crate) mod prepare;
pub(crate) mod rolls;
pub(crate) mod sample;
pub(crate) mod speed;
pub(crate) mod stretch;
pub(crate) mod timed_path;
