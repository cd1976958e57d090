//! Bases of cubics in cumulative form (Kim, Kim, Shin 1995):
//! `base · exp(v₁ B₁(t)) · exp(v₂ B₂(t)) · exp(v₃ B₃(t))`, `t` from 0 to 1 over an
//! interval.

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
