//! Vectors that are polynomials of degree 3 in a parameter from 0 to 1, and their zeros.

use glam::DVec3;

/// The coefficients of 1, t, t², t³.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Polynomial(pub(crate) [DVec3; 4]);

/// The number of subintervals that are searched for zeros.
const GRID: u32 = 16;

impl Polynomial {
    pub(crate) fn at(&self, t: f64) -> DVec3 {
        let [c0, c1, c2, c3] = self.0;
        ((c3 * t + c2) * t + c1) * t + c0
    }

    pub(crate) fn derivative(&self) -> Self {
        let [_, c1, c2, c3] = self.0;
        Self([c1, c2 * 2.0, c3 * 3.0, DVec3::ZERO])
    }

    /// The largest magnitude of a coefficient's component.
    pub(crate) fn size(&self) -> f64 {
        let largest = |size: f64, c: &DVec3| size.max(c.abs().max_element());
        self.0.iter().fold(0.0, largest)
    }

    pub(crate) fn map(&self, f: impl Fn(DVec3) -> DVec3) -> Self {
        Self(self.0.map(f))
    }

    /// The cross product of two polynomials of degree 2 and 1: `P' × P''`, whose terms of degree 3 are zero.
    pub(crate) fn binormal(position: &Self) -> Self {
        let [_, c, b, a] = position.0;
        let (ab, ca, cb) = (a.cross(b), c.cross(a), c.cross(b));
        Self([cb * 2.0, ca * 6.0, ab * -6.0, DVec3::ZERO])
    }

    /// This polynomial divided by `t - zero`.
    fn divided(&self, zero: f64) -> Self {
        let [_, c1, c2, c3] = self.0;
        let q1 = c2 + c3 * zero;
        Self([c1 + q1 * zero, q1, c3, DVec3::ZERO])
    }

    /// The zeros from 0 to 1, within a tolerance, and the polynomial divided by all of them, which is, except for its
    /// sign, the direction on both sides of a zero.
    pub(crate) fn without_zeros(&self, tolerance: f64) -> (Vec<f64>, Self) {
        let mut rest = *self;
        let mut zeros = Vec::new();
        while zeros.len() < 3 {
            let Some(zero) = rest.zero(tolerance) else {
                break;
            };
            zeros.push(zero);
            rest = rest.divided(zero);
        }
        (zeros, rest)
    }

    /// The parameter from 0 to 1 at which the polynomial is shortest, if its length there is at most `tolerance`; both
    /// ends and the minima between them are compared.
    fn zero(&self, tolerance: f64) -> Option<f64> {
        // If all Bernstein coefficients are on one side of a plane, the curve is on this side, too.
        let [c0, c1, c2, c3] = self.0;
        let control = [
            c0,
            c0 + c1 / 3.0,
            c0 + (c1 * 2.0 + c2) / 3.0,
            c0 + c1 + c2 + c3,
        ];
        let middle = control.iter().sum::<DVec3>();
        let limit = tolerance * middle.length();
        if control.iter().all(|point| point.dot(middle) > limit) {
            return None;
        }
        let derivative = self.derivative();
        let rises = |t: f64| self.at(t).dot(derivative.at(t)) > 0.0;
        let [start, end] = [0.0, 1.0].map(|t| (t, self.at(t).length()));
        let (mut best, mut least) = if end.1 < start.1 { end } else { start };
        let mut before = rises(0.0);
        for i in 1..=GRID {
            let [mut low, mut high] = [i - 1, i].map(|i| f64::from(i) / f64::from(GRID));
            let after = rises(high);
            if !before && after {
                while high - low > 1e-16 {
                    let between = 0.5 * (low + high);
                    if between <= low || between >= high {
                        break;
                    }
                    if rises(between) {
                        high = between;
                    } else {
                        low = between;
                    }
                }
                if self.at(high).length() < least {
                    (best, least) = (high, self.at(high).length());
                }
            }
            before = after;
        }
        // A zero this near to an end is moved to the end.
        let snapped = [0.0, 1.0].into_iter().find(|end| (best - end).abs() < 1e-9);
        (least <= tolerance).then_some(snapped.unwrap_or(best))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a zero that is missed, and a quotient that is not the direction next to the zero.
    #[test]
    fn zeros_are_divided_out() {
        let direction = Polynomial([DVec3::X, DVec3::Y, DVec3::Z, DVec3::ZERO]);
        let times = |p: &Polynomial, zero: f64| {
            let [c0, c1, c2, _] = p.0;
            Polynomial([c0 * -zero, c0 - c1 * zero, c1 - c2 * zero, c2])
        };
        for zero in [0.0, 0.3, 0.77, 1.0] {
            let (zeros, rest) = times(&direction, zero).without_zeros(1e-12);
            assert!(
                zeros.len() == 1 && (zeros[0] - zero).abs() < 1e-9,
                "{zeros:?}"
            );
            assert!((rest.at(0.4) - direction.at(0.4)).length() < 1e-9);
        }
        let line = Polynomial([DVec3::X, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO]);
        let twice = times(&times(&line, 0.25), 0.25);
        let (zeros, _) = twice.without_zeros(1e-12);
        assert_eq!(zeros.len(), 2, "{zeros:?}");
        assert!(direction.without_zeros(1e-12).0.is_empty());
    }
}
