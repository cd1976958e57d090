//! Rolls that are added to a frame, distributed over the length of its path.

use std::f64::consts::{PI, TAU};

/// Angles at lengths, joined by the cubics of Bessel and Overhauser.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rolls(Vec<[f64; 3]>);

impl Rolls {
    /// Makes the curve through these points: lengths, which do not decrease, and angles.
    pub(crate) fn through(points: &[(f64, f64)]) -> Self {
        let mut keys: Vec<(f64, f64)> = Vec::with_capacity(points.len());
        for &point in points {
            match keys.last_mut() {
                Some(last) if point.0 <= last.0 => *last = point,
                _ => keys.push(point),
            }
        }
        let last = keys.len().saturating_sub(1);
        let secant = |i: usize| (keys[i + 1].1 - keys[i].1) / (keys[i + 1].0 - keys[i].0);
        let inner = |i: usize| {
            let (l, r) = (keys[i].0 - keys[i - 1].0, keys[i + 1].0 - keys[i].0);
            (secant(i - 1) * r + secant(i) * l) / (l + r)
        };
        let slope = |i: usize| match i {
            _ if last == 0 => 0.0,
            _ if last == 1 => secant(0),
            0 => 2.0 * secant(0) - inner(1),
            i if i == last => 2.0 * secant(last - 1) - inner(last - 1),
            i => inner(i),
        };
        let row = |i: usize| [keys[i].0, keys[i].1, slope(i)];
        Self((0..keys.len()).map(row).collect())
    }

    /// Whether the roll varies along the path.
    pub(crate) fn are_spread(&self) -> bool {
        self.0.len() > 1
    }

    /// The angle at a length.
    pub(crate) fn at(&self, length: f64) -> f64 {
        let after = self.0.partition_point(|key| key[0] <= length).max(1);
        match (self.0.get(after - 1), self.0.get(after)) {
            (Some(&[a, p, m]), Some(&[b, q, n])) => {
                let h = b - a;
                let t = (length - a) / h;
                let rest = 1.0 - t;
                let ends = p * (1.0 + 2.0 * t) * rest * rest + q * t * t * (3.0 - 2.0 * t);
                ends + h * (m * t * rest * rest - n * t * t * rest)
            }
            (Some(&[_, angle, _]), None) => angle,
            _ => 0.0,
        }
    }
}

/// An angle from -π to π.
pub(crate) fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// The angle, plus a multiple of 360°, that is nearest to another.
pub(crate) fn unwrapped(angle: f64, near: f64) -> f64 {
    near + wrapped(angle - near)
}

/// Whether an angle is 180°, so that it could be removed in either direction.
pub(crate) fn is_half_turn(angle: f64) -> bool {
    wrapped(angle).abs() > PI - 1e-6
}
