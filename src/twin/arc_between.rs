//! The middle of an arc and its tangent there, of `shaders/from_keys/arc_between.wgsl`.

pub(crate) use crate::twin::functions::arc_between;

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// Catches a wrong digit in a coefficient. A comparison of bits cannot catch it, because both twins use the same
    /// coefficient.
    #[test]
    fn middles_and_tangents_are_as_accurate_as_stated() {
        for step in 0..=10_000 {
            let angle = f64::from(step) / 10_000.0 * FRAC_PI_2;
            let (sine, cosine) = angle.sin_cos();
            let end = [sine as f32, 0.0, 0.0, cosine as f32];
            let (middle, tangent) = arc_between([0.0, 0.0, 0.0, 1.0], end);
            let (sine, cosine) = (angle * 0.5).sin_cos();
            let expected = [sine, cosine, cosine * angle, -sine * angle];
            let found = [middle[0], middle[3], tangent[0], tangent[3]];
            for (found, expected) in found.into_iter().zip(expected) {
                let error = (f64::from(found) - expected).abs();
                assert!(error < 2.5e-7, "{error} at {angle}: {found}, {expected}");
            }
        }
    }
}
