//! Random inputs for kernels, the same in every run: ordinary values, and extreme ones among them. The checks of
//! kernels on devices use them, and the tests of the twins.

use fastrand::Rng;
use glam::Vec4;

use crate::math::canonical::canonical;
use crate::math::quaternion::sine_cosine;
use crate::shader::{
    FLUSHED_BITS, GIMBAL, KEY_AT_END, KEY_INNER, KEY_UNKNOWN, LEAST_NORMAL, LONGEST_STEP,
    LONGEST_TANGENT_PART, PI, TINY_BITS, TangentWeights,
};

/// An angle in R⁴ between two keys, well within the range of the small-angle series.
const ORDINARY_STEP: f32 = 0.02;

/// The largest number that the host is assumed to pass to kernels.
const LARGEST_CANONICAL: f32 = 1.0e12;

pub(crate) struct Random {
    rng: Rng,
    /// Whether numbers are as the host passes them to kernels: 0 or at least 2^-64 in magnitude, not very large, and
    /// rotations of norm 1.
    are_canonical: bool,
}

impl Random {
    /// A generator of all finite numbers.
    #[cfg(test)]
    pub(crate) fn new() -> Self {
        Self {
            rng: Rng::with_seed(1),
            are_canonical: false,
        }
    }

    /// A generator of numbers as the host passes them to kernels.
    pub(crate) fn canonical() -> Self {
        Self {
            rng: Rng::with_seed(1),
            are_canonical: true,
        }
    }

    /// True once in `times`.
    pub(crate) fn once_in(&mut self, times: u32) -> bool {
        self.rng.u32(..times) == 0
    }

    pub(crate) fn below(&mut self, end: u32) -> u32 {
        self.rng.u32(..end)
    }

    pub(crate) fn word(&mut self) -> u32 {
        self.rng.u32(..)
    }

    fn signed(&mut self, magnitude: f32) -> f32 {
        if self.rng.bool() {
            -magnitude
        } else {
            magnitude
        }
    }

    fn uniform(&mut self) -> f32 {
        2.0 * self.rng.f32() - 1.0
    }

    /// A number whose magnitude is between two powers of 2, with equally probable exponents.
    fn scaled(&mut self, powers: std::ops::Range<i32>) -> f32 {
        let exponent = (1023 + self.rng.i32(powers)) as u64;
        let magnitude = (1.0 + self.rng.f64()) * f64::from_bits(exponent << 52);
        let number = self.signed(magnitude as f32);
        self.allowed(number)
    }

    fn allowed(&mut self, number: f32) -> f32 {
        match self.are_canonical {
            true if number.abs() > LARGEST_CANONICAL => self.uniform(),
            true => canonical(number),
            false => number,
        }
    }

    /// A number at which a shader branches, or the one before or after it.
    fn border(&mut self) -> f32 {
        let borders = [
            0.0,
            f32::from_bits(TINY_BITS),
            f32::from_bits(FLUSHED_BITS),
            f32::from_bits(LEAST_NORMAL),
            GIMBAL,
            0.5,
            1.0,
            PI,
            f32::MIN_POSITIVE,
        ];
        let border = borders[self.rng.usize(..borders.len())];
        let near = [border.next_down(), border, border.next_up()];
        let near = near[self.rng.usize(..3)];
        let near = self.signed(near);
        self.allowed(near)
    }

    /// A number from -1 to 1, or an extreme one: near a border, very small or subnormal.
    pub(crate) fn number(&mut self) -> f32 {
        match self.rng.u32(..10) {
            0 => self.border(),
            1 => self.scaled(-149..-20),
            2 => self.scaled(-20..0),
            _ => self.uniform(),
        }
    }

    /// As [`Random::number`], or a finite number of any magnitude.
    pub(crate) fn finite(&mut self) -> f32 {
        match self.once_in(4) {
            true => self.scaled(-149..127),
            false => self.number(),
        }
    }

    #[cfg(test)]
    pub(crate) fn positive(&mut self) -> f32 {
        self.finite().abs()
    }

    /// A vector of ordinary length, or rarely an extreme or a very long one.
    pub(crate) fn vector<const N: usize>(&mut self) -> [f32; N] {
        match self.rng.u32(..12) {
            0 => std::array::from_fn(|_| self.finite()),
            1 => std::array::from_fn(|_| self.number()),
            2 => {
                let scale = self.scaled(-70..20).abs();
                std::array::from_fn(|_| scale * self.uniform())
            }
            _ => std::array::from_fn(|_| self.uniform()),
        }
    }

    /// A unit quaternion; some have components that are 0 or very small.
    pub(crate) fn unit(&mut self) -> [f32; 4] {
        loop {
            let raw: [f64; 4] = std::array::from_fn(|_| match self.rng.u32(..8) {
                0 => self.scaled(-70..-10).into(),
                1 => 0.0,
                _ => self.uniform().into(),
            });
            let length = raw.iter().map(|c| c * c).sum::<f64>().sqrt();
            if length > 1e-25 {
                return raw.map(|c| canonical((c / length) as f32));
            }
        }
    }

    /// A unit quaternion at an angle in R⁴ from another.
    pub(crate) fn near(&mut self, q: [f32; 4], angle: f32) -> [f32; 4] {
        let (q, toward) = (Vec4::from(q).as_dvec4(), Vec4::from(self.unit()).as_dvec4());
        let across = (toward - q * toward.dot(q)).normalize_or_zero();
        let (sine, cosine) = sine_cosine(f64::from(angle));
        let moved = q * cosine + across * sine;
        moved.to_array().map(|c| canonical(c as f32))
    }

    /// Two keys that are at most about pi/2 apart in R⁴; some are equal or almost equal.
    pub(crate) fn pair(&mut self) -> [[f32; 4]; 2] {
        let from = self.unit();
        match self.rng.u32(..8) {
            0 => [from, from],
            1 => [from, from.map(|c| -c)],
            2 | 3 => {
                let angle = self.scaled(-40..0).abs();
                [from, self.near(from, angle)]
            }
            _ => {
                let to = self.unit();
                let dot: f32 = (0..4).map(|c| from[c] * to[c]).sum();
                [from, if dot < 0.0 { to.map(|c| -c) } else { to }]
            }
        }
    }

    /// A rotation as it is stored: a unit quaternion, or one whose norm is not exactly 1.
    pub(crate) fn rotation(&mut self) -> [f32; 4] {
        match self.rng.u32(..8) {
            0 if !self.are_canonical => std::array::from_fn(|_| canonical(self.number())),
            1 => {
                let off = 1.0 + self.uniform() * 1e-6;
                self.unit().map(|c| canonical(c * off))
            }
            2 => {
                let identity = [0.0, 0.0, 0.0, self.signed(1.0)];
                let angle = self.scaled(-60..0).abs();
                self.near(identity, angle)
            }
            // Close to a gimbal lock: two components of one angle are small.
            3 => {
                let [x, _, z, w] = self.unit();
                let off = self.scaled(-30..-20);
                [x, w + off, z, w]
            }
            _ => self.unit(),
        }
    }

    /// The parameter of a sample, from -1/2 to 1/2.
    pub(crate) fn parameter(&mut self) -> f32 {
        match self.rng.u32(..8) {
            0 => self.signed(0.5),
            1 => 0.0,
            2 => self.scaled(-40..-2),
            _ => 0.5 * self.uniform(),
        }
    }

    /// An angle in R⁴ between two keys: usually within the small-angle series, otherwise at one of its limits or
    /// outside.
    pub(crate) fn step(&mut self) -> f32 {
        match self.rng.u32(..12) {
            0 => 0.0,
            1 => self.scaled(-40..-6).abs(),
            2 => LONGEST_STEP.sqrt() * (1.0 + 1e-3 * self.uniform()),
            3 | 4 => 0.03 + 0.03 * self.rng.f32(), // the extents on both sides of the limit
            5 => 0.4 * self.rng.f32(),
            6 => ORDINARY_STEP * (1.0 + 1e-3 * self.uniform()),
            _ => 0.03 * self.rng.f32(),
        }
    }

    /// Four keys around an interval.
    #[cfg(test)]
    pub(crate) fn four_keys(&mut self) -> [[f32; 4]; 4] {
        let mut key = self.unit();
        let same = self.once_in(2).then(|| self.step());
        [0; 4].map(|_| {
            let current = key;
            let step = same.unwrap_or_else(|| self.step());
            key = self.near(key, step);
            current
        })
    }

    /// The weight of a step in a tangent; one in four makes an [`ORDINARY_STEP`] as long as the small-angle series
    /// allows.
    fn weight(&mut self) -> f32 {
        let limit = LONGEST_TANGENT_PART.sqrt() / ORDINARY_STEP;
        match self.rng.u32(..4) {
            0 => limit * (1.0 + 1e-3 * self.uniform()),
            1 => 2.0 * limit * self.uniform(),
            _ => self.uniform(),
        }
    }

    /// The tangent weights at a key.
    pub(crate) fn weights(&mut self) -> TangentWeights {
        let kinds = [KEY_INNER, KEY_INNER, KEY_INNER, KEY_AT_END, KEY_UNKNOWN];
        // If keys are at even times, both steps have the same weight.
        let even = self.once_in(4).then_some(0.5);
        let limit = if self.once_in(2) { 0.33 } else { 0.05 };
        TangentWeights {
            before: even.unwrap_or_else(|| self.weight()),
            after: even.unwrap_or_else(|| self.weight()),
            outgoing: limit * self.rng.f32(),
            kind: kinds[self.rng.usize(..kinds.len())],
        }
    }
}
