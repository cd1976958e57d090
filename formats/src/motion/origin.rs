//! Origins keep the digits of positions at a large distance from 0, such as those of maps (UTM) and of the Earth
//! (ECEF). Kernels get f32 positions relative to an origin near them; writers add the origin in f64.

use glam::{DVec3, Vec3};

/// Coordinates that stay below this have no origin: f32 rounds them by 1.2e-4 at most.
pub(crate) const SMALL: f64 = 2048.0;

/// If one coordinate needs an origin, the others get one too, except those below this.
const SMALL_BESIDE: f64 = 16.0;

/// Beyond this a coordinate is no position, and f64 holds no whole numbers of its size any more.
const LARGE: f64 = 9_007_199_254_740_992.0;

/// A coordinate gets an origin only if f32 is this many times finer relative to the origin than relative to 0.
const GAIN: f64 = 4.0;

/// The box that points fill.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    fn of(points: impl Iterator<Item = DVec3>) -> Option<Self> {
        let one = points.map(|point| Self {
            low: point,
            high: point,
        });
        one.reduce(|a, b| Self {
            low: a.low.min(b.low),
            high: a.high.max(b.high),
        })
    }
}

/// The origin for some points. Each of its coordinates is a whole number, so that f64 subtracts and adds it exactly.
/// A coordinate of the origin is 0 where f32 is about as exact without it.
#[must_use]
pub fn origin_of(points: impl Iterator<Item = DVec3>) -> DVec3 {
    let Some(Bounds { low, high }) = Bounds::of(points) else {
        return DVec3::ZERO;
    };
    let largest = low.abs().max(high.abs());
    // If one axis needs an origin, the other axes get one if it improves their accuracy, such as the heights.
    let smallest = match largest.max_element() >= SMALL {
        true => SMALL_BESIDE,
        false => return DVec3::ZERO,
    };
    let axis = |axis: usize| {
        let is_gain = 0.5 * (high[axis] - low[axis]) * GAIN <= largest[axis];
        if is_gain && (smallest..=LARGE).contains(&largest[axis]) {
            f64::midpoint(low[axis], high[axis]).round()
        } else {
            0.0
        }
    };
    DVec3::new(axis(0), axis(1), axis(2))
}

/// The origin for a track that rests at a position. Most joints rest near their parents: a joint with a parent has an
/// origin only if f32 alone would lose digits.
pub(crate) fn origin_at_rest(parent: Option<usize>, position: DVec3) -> DVec3 {
    match parent {
        Some(_) if position.as_vec3().as_dvec3() == position => DVec3::ZERO,
        _ => origin_of([position].into_iter()),
    }
}

/// The origin of some points, and the points relative to it.
#[must_use]
pub fn relative(points: &[DVec3]) -> (DVec3, Vec<Vec3>) {
    let origin = origin_of(points.iter().copied());
    let points = points.iter().map(|&point| (point - origin).as_vec3());
    (origin, points.collect())
}

/// The text of a coordinate, the sum of `origin` and `relative`, with the fewest decimals that distinguish it from
/// the neighbouring f32 values of `relative`. Subnormal numbers are written as 0, as they are also read.
#[must_use]
pub fn coordinate(origin: f64, relative: f32) -> String {
    /// More decimals than f64 has for coordinates that need an origin.
    const MAX_DECIMALS: usize = 12;
    let relative = if relative.is_normal() { relative } else { 0.0 };
    let digits = relative.to_string();
    if origin == 0.0 {
        return digits;
    }
    let sum = origin + f64::from(relative);
    if origin.fract() != 0.0 {
        return sum.to_string();
    }
    let decimals = digits
        .split_once('.')
        .map_or(0, |(_, decimals)| decimals.len());
    format!("{sum:.*}", decimals.min(MAX_DECIMALS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_have_an_origin_where_f32_is_too_coarse() {
        for (low, high, origin) in [
            (-1.5, 3.0, 0.0),
            (0.91, 0.93, 0.0),
            (2000.0, 2001.0, 0.0),
            (5_400_000.0, 5_400_000.02, 5_400_000.0),
            (-5_400_000.75, -5_400_000.25, -5_400_001.0),
            // The range is as large as the distance: an origin would gain nothing.
            (0.0, 1e6, 0.0),
            (1e20, 1e20, 0.0),
            (2048.0, 2048.5, 2048.0),
            (f64::NAN, f64::NAN, 0.0),
            (f64::INFINITY, f64::INFINITY, 0.0),
        ] {
            let points = [DVec3::new(low, 0.0, 1.0), DVec3::new(high, 0.0, 1.0)];
            let found = origin_of(points.into_iter());
            assert_eq!(found, DVec3::new(origin, 0.0, 0.0), "{low} to {high}");
        }
        assert_eq!(origin_of(std::iter::empty()), DVec3::ZERO);
    }

    #[test]
    fn digits_are_those_of_the_file() {
        for (text, origin) in [
            ("5400000.01", 5_400_000.0),
            ("-5400000.01", -5_400_000.0),
            ("5399999.9", 5_400_000.0),
            ("5400000", 5_400_000.0),
            ("0.1", 0.0),
        ] {
            let number: f64 = text.parse().unwrap();
            assert_eq!(coordinate(origin, (number - origin) as f32), text);
        }
        assert_eq!(coordinate(0.0, 1e-42), "0");
        assert_eq!(coordinate(2500.5, 0.25), "2500.75");
    }

    /// Positions of maps are read back within 1e-9 relative, or within the rounding of half of their extent to f32 and
    /// its shortest digits.
    #[test]
    fn nothing_of_a_map_is_lost() {
        let mut state = 1u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for extent in [0.02, 1.0, 300.0, 20_000.0] {
            let points: Vec<DVec3> = (0..500)
                .map(|_| {
                    DVec3::new(500_000.0, 5_400_000.0, 40.0)
                        + extent * DVec3::new(random(), random(), 0.0)
                })
                .collect();
            let (origin, offsets) = relative(&points);
            assert_eq!(origin.z, 40.0);
            for (point, offset) in points.iter().zip(&offsets) {
                for axis in 0..3 {
                    let text = coordinate(origin[axis], offset[axis]);
                    let bound = (1e-9 * point[axis]).max(extent * f64::from(f32::EPSILON) / 2.0);
                    let off = text.parse::<f64>().unwrap() - point[axis];
                    assert!(off.abs() <= bound, "{extent}: {text} {point}");
                }
            }
        }
    }
}
