//! The curve between two keys, as in the papers.

use glam::{DQuat, DVec3};

use crate::curve::options::Ends;
use crate::reference::quaternion::{
    exponential, from_parts, invert, logarithm, multiply, rotated, slerp, vector,
};
use crate::reference::rotation_vector::{acceleration, velocity_matrix};
use crate::reference::track::ReferenceTrack;

/// A curve for `t` from 0 to 1.
#[derive(Clone, Copy)]
pub(crate) enum Segment {
    Constant(DQuat),
    Arc(DQuat, DQuat),
    /// `base Π exp(w_j B_j(t))` (Kim, Kim, Shin 1995).
    Product {
        base: DQuat,
        w: [DVec3; 3],
        basis: Basis,
    },
    /// Any formula of up to four quaternions, for example the two keys and two control rotations. Its velocity is a
    /// difference.
    Between(fn([DQuat; 4], f64) -> DQuat, [DQuat; 4]),
    /// `base exp(a t + b t² + c t³)`.
    RotationVector {
        base: DQuat,
        powers: [DVec3; 3],
    },
}

/// Cumulative basis functions.
#[derive(Clone, Copy)]
pub(crate) enum Basis {
    Bernstein,
    /// Cubic B-spline with these knots; the interval is between the third and the fourth.
    Knots([f64; 6]),
}

impl Basis {
    pub(crate) fn values(self, t: f64) -> [f64; 3] {
        match self {
            Self::Bernstein => {
                let rest = 1.0 - t;
                [1.0 - rest * rest * rest, t * t * (3.0 - 2.0 * t), t * t * t]
            }
            Self::Knots(knots) => {
                let [_, n1, n2, n3] = b_spline(knots, 3, knots[2] + t * (knots[3] - knots[2]));
                [n1 + n2 + n3, n2 + n3, n3]
            }
        }
    }

    pub(crate) fn derivatives(self, t: f64) -> [f64; 3] {
        match self {
            Self::Bernstein => [
                3.0 * (1.0 - t) * (1.0 - t),
                6.0 * t * (1.0 - t),
                3.0 * t * t,
            ],
            Self::Knots(knots) => {
                // N_j' = 3 (N_{j,2}/(u_{j+3}-u_j) - N_{j+1,2}/(u_{j+4}-u_{j+1})). A basis function is the sum of one N
                // and all later ones. In the derivative of this sum, all terms but one cancel.
                let length = knots[3] - knots[2];
                let [_, n1, n2, n3] = b_spline(knots, 2, knots[2] + t * length);
                let n = [n1, n2, n3];
                std::array::from_fn(|j| 3.0 * length * n[j] / (knots[j + 3] - knots[j]))
            }
        }
    }

    pub(crate) fn second_derivatives(self, t: f64) -> [f64; 3] {
        match self {
            Self::Bernstein => [6.0 * t - 6.0, 6.0 - 12.0 * t, 6.0 * t],
            Self::Knots(knots) => {
                // The rule of the first derivatives, applied to the functions of degree 2 in them:
                // N_{j,2}' = 2 (N_{j,1}/(u_{j+2}-u_j) - N_{j+1,1}/(u_{j+3}-u_{j+1})).
                let length = knots[3] - knots[2];
                let [_, n0, n1, n2] = b_spline(knots, 1, knots[2] + t * length);
                let n = [n0, n1, n2, 0.0];
                std::array::from_fn(|j| {
                    let part = |j: usize| match n[j] {
                        0.0 => 0.0,
                        n => n / (knots[j + 2] - knots[j]),
                    };
                    6.0 * length * length * (part(j) - part(j + 1)) / (knots[j + 3] - knots[j])
                })
            }
        }
    }
}

/// The `degree + 1` basis functions that are not zero between `knots[2]` and `knots[3]`, by the recursion of Cox and
/// de Boor. For a degree below 3 they are the last of the four numbers.
fn b_spline(knots: [f64; 6], degree: usize, u: f64) -> [f64; 4] {
    let mut n = [0.0, 0.0, 0.0, 1.0];
    for k in 1..=degree {
        let mut next = [0.0; 4];
        for j in 3 - k..4 {
            // N_j of degree k starts at knot j - 1, counted from the first of the six.
            let knot = |offset: usize| knots[(offset + j).saturating_sub(1)];
            if n[j] != 0.0 {
                next[j] += (u - knot(0)) / (knot(k) - knot(0)) * n[j];
            }
            if j < 3 && n[j + 1] != 0.0 {
                next[j] += (knot(k + 1) - u) / (knot(k + 1) - knot(1)) * n[j + 1];
            }
        }
        n = next;
    }
    n
}

/// The six knots around interval `i`. Outside the ends they continue with the length of the outermost interval or,
/// for a loop, with the intervals at the other end.
pub(crate) fn knots(times: &[f64], ends: Ends, i: usize) -> [f64; 6] {
    let count = times.len() as isize - 1;
    let step = |j: isize| {
        let j = match ends {
            Ends::Loop => j.rem_euclid(count),
            _ => j.clamp(0, count - 1),
        } as usize;
        times[j + 1] - times[j]
    };
    let i = i as isize;
    let mut knots = [0.0; 6];
    for j in 1..6 {
        knots[j] = knots[j - 1] + step(i - 3 + j as isize);
    }
    knots
}

/// The weights of the values and tangents of a cubic at a parameter, in the order value, tangent, value, tangent.
pub(crate) fn hermite(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        2.0 * t3 - 3.0 * t2 + 1.0,
        t3 - 2.0 * t2 + t,
        3.0 * t2 - 2.0 * t3,
        t3 - t2,
    ]
}

/// The cumulative cubic with these handles.
pub(crate) fn cumulative(track: &ReferenceTrack, i: usize, out: DVec3, incoming: DVec3) -> Segment {
    let a = multiply(track.keys[i], exponential(out));
    let b = multiply(track.keys[i + 1], exponential(-incoming));
    Segment::Product {
        base: track.keys[i],
        w: [out, logarithm(multiply(invert(a), b)), incoming],
        basis: Basis::Bernstein,
    }
}

impl Segment {
    pub(crate) fn rotation(self, t: f64) -> DQuat {
        match self {
            Self::Constant(key) => key,
            Self::Arc(from, to) => slerp(from, to, t),
            Self::Product { base, w, basis } => {
                let b = basis.values(t);
                (0..3).fold(base, |q, j| multiply(q, exponential(w[j] * b[j])))
            }
            Self::Between(formula, controls) => formula(controls, t),
            Self::RotationVector { base, powers } => {
                multiply(base, exponential(cubic(powers, t)[0]))
            }
        }
    }

    /// The angular velocity per unit of `t`, in the body frame.
    pub(crate) fn velocity(self, t: f64) -> DVec3 {
        match self {
            Self::Constant(_) => DVec3::ZERO,
            Self::Arc(from, to) => 2.0 * logarithm(multiply(invert(from), to)),
            Self::Product { w, basis, .. } => product_rates(w, basis, t).0,
            Self::Between(..) => {
                let slope = differences(|t| self.rotation(t), t);
                2.0 * vector(multiply(invert(self.rotation(t)), slope))
            }
            Self::RotationVector { powers, .. } => {
                let [v, v1, _] = cubic(powers, t);
                2.0 * (velocity_matrix(v) * v1)
            }
        }
    }

    /// The angular acceleration per unit of `t` squared, in the body frame.
    pub(crate) fn acceleration(self, t: f64) -> DVec3 {
        match self {
            Self::Constant(_) | Self::Arc(..) => DVec3::ZERO,
            Self::Product { w, basis, .. } => product_rates(w, basis, t).1,
            // Central differences of the velocity, also of the formula beyond its interval.
            Self::Between(..) => vector(differences(|t| from_parts(0.0, self.velocity(t)), t)),
            Self::RotationVector { powers, .. } => {
                let [v, v1, v2] = cubic(powers, t);
                acceleration(v, v1, v2)
            }
        }
    }
}

/// A rotation vector `a t + b t² + c t³`, and its first and second derivative.
fn cubic([a, b, c]: [DVec3; 3], t: f64) -> [DVec3; 3] {
    [
        a * t + b * (t * t) + c * (t * t * t),
        a + b * (2.0 * t) + c * (3.0 * t * t),
        b * 2.0 + c * (6.0 * t),
    ]
}

/// The angular velocity and acceleration of `Π exp(w_j B_j(t))` in the body frame, by the product rule: each factor
/// turns the frame, in which the factors before it move, with the angular velocity `2 w_j B_j'`.
fn product_rates(w: [DVec3; 3], basis: Basis, t: f64) -> (DVec3, DVec3) {
    let (values, slopes) = (basis.values(t), basis.derivatives(t));
    let bends = basis.second_derivatives(t);
    (0..3).fold((DVec3::ZERO, DVec3::ZERO), |(velocity, bend), j| {
        let back = invert(exponential(w[j] * values[j]));
        let (velocity, bend) = (rotated(velocity, back), rotated(bend, back));
        let added = 2.0 * w[j] * slopes[j];
        (
            velocity + added,
            bend - added.cross(velocity) + 2.0 * w[j] * bends[j],
        )
    })
}

/// The derivative by central differences of the eighth order.
fn differences(of: impl Fn(f64) -> DQuat, t: f64) -> DQuat {
    let (h, weights) = (0.0025, [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0]);
    let mut sum = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    for (k, weight) in (1..).map(f64::from).zip(weights) {
        sum += (of(t + k * h) - of(t - k * h)) * (weight / h);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches an index of a knot that is off by one.
    #[test]
    fn even_knots_give_the_uniform_basis() {
        let even = Basis::Knots([0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        for i in 0..=10 {
            let t = f64::from(i) / 10.0;
            let uniform = [
                (5.0 + 3.0 * t - 3.0 * t * t + t * t * t) / 6.0,
                (1.0 + 3.0 * t + 3.0 * t * t - 2.0 * t * t * t) / 6.0,
                t * t * t / 6.0,
            ];
            for (found, expected) in even.values(t).into_iter().zip(uniform) {
                assert!((found - expected).abs() < 1e-15);
            }
        }
    }
}
