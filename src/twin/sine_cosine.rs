//! Sine and cosine of `shaders/math/sine_cosine.wgsl`.

pub(crate) use crate::twin::functions::{
    SineCosm1QuarterBegun, sine_cosine, sine_cosm1, sine_cosm1_quarter, sine_cosm1_quarter_begin,
    sine_cosm1_quarter_end,
};

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

    use super::*;

    /// Catches a wrong digit in a coefficient. A comparison of bits cannot catch it, because both twins use the same
    /// coefficient.
    #[test]
    fn sine_and_cosine_are_as_accurate_as_stated() {
        let short: fn(f32) -> (f32, f32) = |angle| {
            let (sine, cosine_minus_one) = sine_cosm1_quarter(angle, angle * angle);
            (sine, cosine_minus_one + 1.0)
        };
        for (range, bound, pair) in [(FRAC_PI_4, 7e-8, short), (FRAC_PI_2, 1.2e-7, sine_cosine)] {
            let mut worst = 0.0f64;
            for i in -100_000..=100_000 {
                let angle = i as f32 * (range / 100_000.0);
                let (sine, cosine) = pair(angle);
                let exact = f64::from(angle).sin_cos();
                worst = worst.max((f64::from(sine) - exact.0).abs());
                worst = worst.max((f64::from(cosine) - exact.1).abs());
            }
            assert!(worst < bound, "{worst} over ±{range}");
        }
    }
}
