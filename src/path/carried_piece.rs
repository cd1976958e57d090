//! A piece of a stretch along which a frame is carried. Its roll ψ ([`carry`](crate::path::carry)) is a polynomial
//! through Chebyshev nodes.

use std::f64::consts::PI;
use std::sync::LazyLock;

use glam::{DQuat, DVec3};

use crate::math::quaternion::sine_cosine;

/// The number of Chebyshev nodes of a piece; the integrand of ψ is the polynomial through them.
pub(crate) const NODES: usize = 11;

/// The Chebyshev nodes cos(π (k + ½) / 11), and the polynomials there: cos(j π (k + ½) / 11) for node
/// k and degree j.
pub(crate) struct Chebyshev {
    pub(crate) nodes: [f64; NODES],
    pub(crate) cosines: [[f64; NODES]; NODES],
}

pub(crate) static CHEBYSHEV: LazyLock<Chebyshev> = LazyLock::new(|| {
    let cosine =
        |j: usize, k: usize| sine_cosine(PI * j as f64 * (k as f64 + 0.5) / NODES as f64).1;
    Chebyshev {
        nodes: std::array::from_fn(|k| cosine(1, k)),
        cosines: std::array::from_fn(|k| std::array::from_fn(|j| cosine(j, k))),
    }
});

/// The indices of a piece's middle and ends among its samples, after those of the nodes.
pub(crate) const MIDDLE: usize = NODES;
pub(crate) const FROM: usize = NODES + 1;
pub(crate) const TO: usize = NODES + 2;
pub(crate) const SAMPLES: usize = NODES + 3;

/// A piece of a stretch.
#[derive(Debug, Clone)]
pub(crate) struct CarriedPiece {
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// The direction and the rotation at the middle.
    pub(crate) middle: DVec3,
    pub(crate) base: DQuat,
    /// Chebyshev coefficients of ψ.
    pub(crate) roll: [f64; NODES + 1],
}
