//! Bodies that follow paths: which way they face on curves through points, and when they are where.
//! Their rotations are sampled in f64 and fitted by the polynomials that serve all smooth curves.

pub(crate) mod carry;
pub(crate) mod fit;
pub(crate) mod frames;
pub(crate) mod lanes;
pub(crate) mod lengths;
pub(crate) mod options;
pub(crate) mod polynomial;
pub(crate) mod prepare;
pub(crate) mod rolls;
pub(crate) mod route;
pub(crate) mod sample;
pub(crate) mod schedule;
