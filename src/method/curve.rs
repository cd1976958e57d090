//! What a method makes of one key interval, in f64.

use glam::{DQuat, DVec3};

use crate::numeric::{exp, norm3, product};

/// The rotation over one key interval, parameter `t` from 0 to 1.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Curve {
    /// The great circle between two rotations, at constant speed.
    Arc { from: DQuat, to: DQuat },
    /// `base · exp(v₁ B₁(t)) · exp(v₂ B₂(t)) · exp(v₃ B₃(t))`.
    Cumulative(Cumulative),
    /// The interval's first key, throughout.
    Hold,
}

/// The cumulative form (Kim, Kim, Shin 1995).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cumulative {
    pub(crate) base: DQuat,
    /// Half-rotation vectors.
    pub(crate) vectors: [DVec3; 3],
    pub(crate) basis: &'static Basis,
}

/// Three cumulative basis functions: coefficients of 1, t, t², t³.
pub(crate) type Basis = [[f64; 4]; 3];

/// Cumulative Bernstein: `1-(1-t)³`, `t²(3-2t)`, `t³`.
pub(crate) static BERNSTEIN: Basis = [
    [0.0, 3.0, -3.0, 1.0],
    [0.0, 0.0, 3.0, -2.0],
    [0.0, 0.0, 0.0, 1.0],
];

/// Cumulative uniform cubic B-spline: `(5+3t-3t²+t³)/6`, `(1+3t+3t²-2t³)/6`, `t³/6`.
pub(crate) static B_SPLINE: Basis = [
    [5.0 / 6.0, 0.5, -0.5, 1.0 / 6.0],
    [1.0 / 6.0, 0.5, 0.5, -1.0 / 3.0],
    [0.0, 0.0, 0.0, 1.0 / 6.0],
];

impl Cumulative {
    /// `B_j(t)`.
    pub(crate) fn weight(&self, j: usize, t: f64) -> f64 {
        let [c0, c1, c2, c3] = self.basis[j];
        ((c3 * t + c2) * t + c1) * t + c0
    }

    /// The rotation at `t`.
    pub(crate) fn rotation(&self, t: f64) -> DQuat {
        (0..3).fold(self.base, |q, j| {
            product(q, exp(self.vectors[j] * self.weight(j, t)))
        })
    }

    /// The largest half-angle by which any of the three rotations differs from its
    /// value at the middle, over the `piece`th of `pieces` equal parts.
    pub(crate) fn reach(&self, piece: usize, pieces: usize) -> f64 {
        let at = |part: f64| (piece as f64 + part) / pieces as f64;
        // The bases grow monotonically, so the extremes lie at the ends.
        (0..3)
            .map(|j| {
                let middle = self.weight(j, at(0.5));
                let before = middle - self.weight(j, at(0.0));
                let after = self.weight(j, at(1.0)) - middle;
                norm3(self.vectors[j]) * before.max(after)
            })
            .fold(0.0, f64::max)
    }
}
