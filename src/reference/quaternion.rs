//! Quaternion algebra as in textbooks: `q = [w; v]`, Hamilton's product.

use glam::{DQuat, DVec3};

/// The vector part.
pub(crate) fn vector(q: DQuat) -> DVec3 {
    DVec3::new(q.x, q.y, q.z)
}

pub(crate) fn from_parts(w: f64, v: DVec3) -> DQuat {
    DQuat::from_xyzw(v.x, v.y, v.z, w)
}

/// `a b = [a_w b_w - a_v·b_v; a_w b_v + b_w a_v + a_v × b_v]`.
pub(crate) fn multiply(a: DQuat, b: DQuat) -> DQuat {
    let (u, v) = (vector(a), vector(b));
    from_parts(a.w * b.w - u.dot(v), a.w * v + b.w * u + u.cross(v))
}

/// The inverse of a unit quaternion.
pub(crate) fn invert(q: DQuat) -> DQuat {
    from_parts(q.w, -vector(q))
}

/// `q v q⁻¹` for a unit quaternion.
pub(crate) fn rotated(v: DVec3, q: DQuat) -> DVec3 {
    vector(multiply(multiply(q, from_parts(0.0, v)), invert(q)))
}

pub(crate) fn inner(a: DQuat, b: DQuat) -> f64 {
    a.w * b.w + vector(a).dot(vector(b))
}

pub(crate) fn normalise(q: DQuat) -> DQuat {
    q * inner(q, q).sqrt().recip()
}

/// `exp(a) = [cos|a|; sin|a| a/|a|]`.
pub(crate) fn exponential(a: DVec3) -> DQuat {
    match a.length() {
        0.0 => DQuat::IDENTITY,
        angle => from_parts(libm::cos(angle), a * (libm::sin(angle) / angle)),
    }
}

/// `log q = v/|v| atan2(|v|, w)`: half of the rotation vector, with a length from 0 to pi. At -1 the direction is
/// undefined, and that of `or` is used.
pub(crate) fn logarithm_or(q: DQuat, or: DVec3) -> DVec3 {
    let v = vector(q);
    let sine = v.length();
    if sine > 0.0 {
        v / sine * libm::atan2(sine, q.w)
    } else if q.w < 0.0 {
        or.normalize_or_zero() * std::f64::consts::PI
    } else {
        DVec3::ZERO
    }
}

/// As [`logarithm_or`], with an undefined direction at -1.
pub(crate) fn logarithm(q: DQuat) -> DVec3 {
    logarithm_or(q, DVec3::ZERO)
}

/// `q^s = exp(s log q)`.
pub(crate) fn power(q: DQuat, s: f64) -> DQuat {
    exponential(logarithm(q) * s)
}

/// Slerp, geometric formula: `sin((1-t)θ)/sin θ a + sin(tθ)/sin θ b`, `cos θ = a·b` (Shoemake 1985). The signs define
/// the arc; no sign is changed.
#[must_use]
pub fn slerp(a: DQuat, b: DQuat, t: f64) -> DQuat {
    let chord = |q: DQuat| inner(q, q).sqrt();
    let angle = 2.0 * libm::atan2(chord(b - a), chord(b + a));
    if angle < 1e-8 {
        // The limit of both weights for small angles: within f64 rounding, the arc is a straight line.
        return normalise(a * (1.0 - t) + b * t);
    }
    let sine = libm::sin(angle);
    let part = |t: f64| libm::sin(t * angle) / sine;
    normalise(a * part(1.0 - t) + b * part(t))
}

/// Slerp as `a (a⁻¹ b)^t`.
#[must_use]
pub fn slerp_from_start(a: DQuat, b: DQuat, t: f64) -> DQuat {
    multiply(a, power(multiply(invert(a), b), t))
}

/// Slerp as `(b a⁻¹)^t a`.
#[must_use]
pub fn slerp_from_start_left(a: DQuat, b: DQuat, t: f64) -> DQuat {
    multiply(power(multiply(b, invert(a)), t), a)
}

/// Slerp as `b (b⁻¹ a)^(1-t)`.
#[must_use]
pub fn slerp_from_end(a: DQuat, b: DQuat, t: f64) -> DQuat {
    multiply(b, power(multiply(invert(b), a), 1.0 - t))
}

/// Slerp as `(a b⁻¹)^(1-t) b`.
#[must_use]
pub fn slerp_from_end_left(a: DQuat, b: DQuat, t: f64) -> DQuat {
    multiply(power(multiply(a, invert(b)), 1.0 - t), b)
}

/// Spherical quadrangle: `slerp(slerp(q0, q1; t), slerp(s0, s1; t); 2t(1-t))` (Shoemake 1987). No sign is changed.
#[must_use]
pub fn squad([q0, s0, s1, q1]: [DQuat; 4], t: f64) -> DQuat {
    slerp(slerp(q0, q1, t), slerp(s0, s1, t), 2.0 * t * (1.0 - t))
}

/// Normalised linear interpolation. No sign is changed.
#[must_use]
pub fn nlerp(a: DQuat, b: DQuat, t: f64) -> DQuat {
    normalise(a * (1.0 - t) + b * t)
}

/// The angle in radians (0 to pi) between two rotations, accurate for very small angles too. The norms may differ
/// from 1; `q` and `-q` are the same rotation.
#[must_use]
pub fn angle_between(a: DQuat, b: DQuat) -> f64 {
    let (a, b) = (normalise(a), normalise(b));
    let (difference, sum) = ((a - b).length(), (a + b).length());
    4.0 * libm::atan2(difference.min(sum), difference.max(sum))
}
