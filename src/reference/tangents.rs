//! Keys with their signs aligned, and the handles of the cubic methods.

use glam::{DQuat, DVec3, Quat};

use crate::curve::options::Path;
use crate::reference::curve::Kind;
use crate::reference::quaternion::{
    exponential, inner, invert, logarithm, logarithm_or, multiply, normalise, slerp,
};
use crate::tracks::key_data::Tcb;

/// The sign of a dot product of smaller magnitude may be due to the rounding of f32 keys.
const SIGN_NOISE: f64 = 4.76837158203125e-7; // 2^-21

/// One track in f64.
pub(crate) struct Track {
    pub(crate) times: Vec<f64>,
    pub(crate) keys: Vec<DQuat>,
    pub(crate) velocities: Vec<DVec3>,
    pub(crate) tangents: Vec<[Quat; 2]>,
    pub(crate) tcb: Vec<Tcb>,
}

impl Track {
    pub(crate) fn new(path: Path, times: &[f64], keys: &[Quat]) -> Self {
        let keys: Vec<DQuat> = keys.iter().map(|key| normalise(key.as_dquat())).collect();
        let mut aligned: Vec<DQuat> = Vec::with_capacity(keys.len());
        for (i, &key) in keys.iter().enumerate() {
            let flipped = i > 0 && inner(keys[i - 1], aligned[i - 1]) < 0.0;
            let turns = i > 0 && path == Path::Shortest && inner(keys[i - 1], key) < -SIGN_NOISE;
            aligned.push(if flipped == turns { key } else { -key });
        }
        Self {
            times: times.to_vec(),
            tcb: vec![Tcb::default(); aligned.len()],
            keys: aligned,
            velocities: Vec::new(),
            tangents: Vec::new(),
        }
    }

    pub(crate) fn last(&self) -> usize {
        self.keys.len() - 1
    }

    /// `q_i⁻¹ q_{i+1}`.
    pub(crate) fn difference(&self, i: usize) -> DQuat {
        multiply(invert(self.keys[i]), self.keys[i + 1])
    }

    pub(crate) fn step(&self, i: usize) -> f64 {
        self.times[i + 1] - self.times[i]
    }

    /// The difference and the time step of the interval before key `i` or, if not `before`, after
    /// it; at its ends a closed track continues across the seam.
    fn side(&self, i: usize, before: bool) -> (DQuat, f64) {
        let interval = match (i, before) {
            (0, true) => self.last() - 1,
            (i, true) => i - 1,
            (i, false) if i == self.last() => 0,
            (i, false) => i,
        };
        (self.difference(interval), self.step(interval))
    }

    /// The incoming and the outgoing handle of key `i`: `b_i = q_i exp(-in)`,
    /// `a_i = q_i exp(out)`.
    pub(crate) fn handles(&self, kind: Kind, i: usize) -> (DVec3, DVec3) {
        let (before, h_before) = self.side(i, true);
        let (after, h_after) = self.side(i, false);
        let (l, r) = (logarithm(before), logarithm(after));
        let both = h_before + h_after;
        match kind {
            Kind::CatmullRom => {
                let sixth = logarithm_or(multiply(before, after), l + r) / 6.0;
                (sixth, sixth)
            }
            Kind::Squad => ((r - l) / 4.0, (l - r) / 4.0),
            Kind::Shoemake | Kind::Shoemake2 | Kind::Shoemake1985 => {
                let q = self.keys[i];
                let (p, next) = (multiply(q, invert(before)), multiply(q, after));
                let bisector = bisect(double(p, q), next, q);
                let a = match kind {
                    Kind::Shoemake => bisector,
                    Kind::Shoemake2 => bisect(q, bisector, q),
                    _ => slerp(q, bisector, 1.0 / 3.0),
                };
                let b = double(a, q);
                let to = |control: DQuat| logarithm(multiply(invert(q), control));
                (-to(b), to(a))
            }
            Kind::BesselOverhauserMean => {
                let mean = (l * (h_after / h_before) + r * (h_before / h_after)) / both;
                (mean * (h_before / 3.0), mean * (h_after / 3.0))
            }
            Kind::KochanekBartels => {
                let Tcb {
                    tension,
                    continuity,
                    bias,
                } = self.tcb[i];
                let tight = 1.0 - tension;
                // The names are those of Geier's documentation of `splines`.
                let a = tight * (1.0 + continuity) * (1.0 + bias);
                let b = tight * (1.0 - continuity) * (1.0 - bias);
                let c = tight * (1.0 - continuity) * (1.0 + bias);
                let d = tight * (1.0 + continuity) * (1.0 - bias);
                let (rate_in, rate_out) = (l / h_before, r / h_after);
                let mean =
                    |u: f64, v: f64| (u * h_after * rate_in + v * h_before * rate_out) / both;
                (mean(c, d) * h_before / 3.0, mean(a, b) * h_after / 3.0)
            }
            _ => {
                let (left, right) = (l * (h_after / h_before), r * (h_before / h_after));
                let product = multiply(exponential(left), exponential(right));
                let tangent = nearest_branch(product, left + right) / both;
                (tangent * (h_before / 3.0), tangent * (h_after / 3.0))
            }
        }
    }
}

/// `2 (p·q) q - p`: as far beyond `q` as `p` is before it (Shoemake 1985).
fn double(p: DQuat, q: DQuat) -> DQuat {
    q * (2.0 * inner(p, q)) - p
}

/// `(p + q)/|p + q|`; `or` if the sum is almost zero.
fn bisect(p: DQuat, q: DQuat, or: DQuat) -> DQuat {
    let sum = p + q;
    if inner(sum, sum).sqrt() > 1e-12 {
        normalise(sum)
    } else {
        or
    }
}

/// The logarithm of `q` nearest to `target` among all of its branches.
fn nearest_branch(q: DQuat, target: DVec3) -> DVec3 {
    let principal = logarithm_or(q, target);
    let axis = match principal.length() {
        length if length > 1e-9 => principal / length,
        _ => target.normalize_or_zero(),
    };
    let nearest = (target - principal).dot(axis) / std::f64::consts::TAU;
    principal + axis * (nearest.round() * std::f64::consts::TAU)
}
