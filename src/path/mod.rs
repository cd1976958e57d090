//! Bodies that follow paths: their directions on curves through points, and their speed.
//!
//! **Principle.** A pose on a path depends on the whole path before it. A rotation-minimising frame is an integral, a
//! constant speed needs arc lengths, and a closed path distributes the roll that remains at its end. A kernel cannot
//! compute this sample by sample. Therefore everything is sampled once in f64 on the host and fitted by polynomials
//! ([`fit`]), as all other smooth curves are. Devices then evaluate positions and rotations as those of any clip, with
//! the same bits, at any frame rate.
//!
//! **Steps**, for about 256 keys of one or more tracks at a time ([`prepare`]):
//!
//! 1. [`TimedPath`](timed_path::TimedPath): the cubics through a track's points, their slopes with the
//!    zeros divided out ([`polynomial`]), arc lengths where they are needed ([`lengths`]), and the
//!    relation between time and the parameter of an interval ([`speed`]).
//! 2. [`PathStretch`](stretch::PathStretch): each interval is divided where the direction jumps or the motion is not
//!    smooth. On a stretch the direction is one smooth function ([`Heading`](stretch::Heading)).
//! 3. [`RelativePieces`](carry::RelativePieces), for the minimal frame: stretches of all paths are divided into
//!    pieces in which the roll is a polynomial of degree 11, one piece in each vector lane ([`lanes`]). This takes
//!    most of the time, and does not depend on the rotation at the start.
//! 4. [`BodyOnPath`](body::BodyOnPath): the rotations along one path. Minimal frames are carried from piece to piece;
//!    fixed frames and Frenet's follow from a side vector. [`rolls`] are angles about the direction that are added,
//!    distributed over the length.
//! 5. [`Span`](sample::Span): a part of a path's time on one stretch. [`sample`] evaluates position or rotation at
//!    its 13 nodes, one span in each lane; [`fit()`](fit::fit) converts them to polynomials and divides a span into
//!    two if its polynomial does not fit.
//!
//! The results are two [`ClipData`](crate::prepare::clip_data::ClipData), positions and rotations, and warnings.
//! Tests compare them with [`reference::follow`](crate::reference::follow), which integrates the differential
//! equation with small steps.

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
