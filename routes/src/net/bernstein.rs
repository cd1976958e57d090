//! Bernstein polynomials, and the derivatives of a surface at a point.

use glam::{DVec2, DVec3};

use crate::net::Net;

/// A point of a surface and its derivatives.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Derivatives {
    pub(super) point: DVec3,
    pub(super) u: DVec3,
    pub(super) v: DVec3,
    pub(super) uu: DVec3,
    pub(super) uv: DVec3,
    pub(super) vv: DVec3,
}

/// The polynomials of `count` control points at `t`, and their first and second derivatives.
fn polynomials(count: usize, t: f64) -> Vec<[f64; 3]> {
    let mut values = vec![[0.0; 3]; count];
    values[0][0] = 1.0;
    for degree in 1..count {
        let factor = degree as f64;
        for i in (0..=degree).rev() {
            let [lower, lower_1, _] = if i > 0 { values[i - 1] } else { [0.0; 3] };
            let [current, current_1, _] = if i < degree { values[i] } else { [0.0; 3] };
            values[i] = [
                (1.0 - t) * current + t * lower,
                factor * (lower - current),
                factor * (lower_1 - current_1),
            ];
        }
    }
    values
}

impl Net {
    pub(super) fn derivatives(&self, at: DVec2) -> Derivatives {
        let along_u = polynomials(self.rows, at.x);
        let along_v = polynomials(self.columns, at.y);
        let mut sum = Derivatives::default();
        for (row, u) in self.points.chunks_exact(self.columns).zip(&along_u) {
            for (&point, v) in row.iter().zip(&along_v) {
                sum.point += u[0] * v[0] * point;
                sum.u += u[1] * v[0] * point;
                sum.v += u[0] * v[1] * point;
                sum.uu += u[2] * v[0] * point;
                sum.uv += u[1] * v[1] * point;
                sum.vv += u[0] * v[2] * point;
            }
        }
        sum
    }
}
