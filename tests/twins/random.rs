//! Random inputs, always the same ones: ordinary values, and hostile ones among them.

use fastrand::Rng;

use crate::math::canonical::canonical;
use crate::shader::{
    FLUSHED_BITS, GIMBAL, KEY_AT_END, KEY_INNER, KEY_UNKNOWN, LEAST_NORMAL, PI, TINY_BITS,
    TangentWeights,
};

pub(super) struct Random(Rng);

impl Random {
    pub(super) fn new() -> Self {
        Self(Rng::with_seed(1))
    }

    /// True once in `times`.
    pub(super) fn once_in(&mut self, times: u32) -> bool {
        self.0.u32(..times) == 0
    }

    pub(super) fn below(&mut self, end: u32) -> u32 {
        self.0.u32(..end)
    }

    pub(super) fn word(&mut self) -> u32 {
        self.0.u32(..)
    }

    fn signed(&mut self, magnitude: f32) -> f32 {
        if self.0.bool() { -magnitude } else { magnitude }
    }

    fn uniform(&mut self) -> f32 {
        2.0 * self.0.f32() - 1.0
    }

    /// Of a magnitude between two powers of 2, each as often as the others.
    fn scaled(&mut self, powers: std::ops::Range<i32>) -> f32 {
        let magnitude = (1.0 + self.0.f64()) * 2.0f64.powi(self.0.i32(powers));
        self.signed(magnitude as f32)
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
        let border = borders[self.0.usize(..borders.len())];
        let near = [border.next_down(), border, border.next_up()];
        let near = near[self.0.usize(..3)];
        self.signed(near)
    }

    /// From -1 to 1, or hostile: near a border, tiny or subnormal.
    pub(super) fn number(&mut self) -> f32 {
        match self.0.u32(..10) {
            0 => self.border(),
            1 => self.scaled(-149..-20),
            2 => self.scaled(-20..0),
            _ => self.uniform(),
        }
    }

    /// As [`Random::number`], or of any magnitude whatsoever, but finite.
    pub(super) fn finite(&mut self) -> f32 {
        match self.once_in(4) {
            true => self.scaled(-149..127),
            false => self.number(),
        }
    }

    pub(super) fn positive(&mut self) -> f32 {
        self.finite().abs()
    }

    /// A vector of ordinary length; rarely a hostile or a huge one.
    pub(super) fn vector<const N: usize>(&mut self) -> [f32; N] {
        match self.0.u32(..12) {
            0 => std::array::from_fn(|_| self.finite()),
            1 => std::array::from_fn(|_| self.number()),
            2 => {
                let scale = self.scaled(-70..20).abs();
                std::array::from_fn(|_| scale * self.uniform())
            }
            _ => std::array::from_fn(|_| self.uniform()),
        }
    }

    /// A unit quaternion; some have components that are 0 or tiny.
    pub(super) fn unit(&mut self) -> [f32; 4] {
        loop {
            let raw: [f64; 4] = std::array::from_fn(|_| match self.0.u32(..8) {
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

    /// A unit quaternion at an angle of about `angle` in R⁴ from another.
    pub(super) fn near(&mut self, q: [f32; 4], angle: f32) -> [f32; 4] {
        let toward = self.unit();
        let moved: [f64; 4] =
            std::array::from_fn(|c| f64::from(q[c]) + f64::from(angle) * f64::from(toward[c]));
        let length = moved.iter().map(|c| c * c).sum::<f64>().sqrt();
        moved.map(|c| canonical((c / length) as f32))
    }

    /// Two keys that are at most about pi/2 apart in R⁴, some equal and some hardly apart.
    pub(super) fn pair(&mut self) -> [[f32; 4]; 2] {
        let from = self.unit();
        match self.0.u32(..8) {
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

    /// A rotation as it is stored: a unit quaternion, or one that is not quite.
    pub(super) fn rotation(&mut self) -> [f32; 4] {
        match self.0.u32(..8) {
            0 => std::array::from_fn(|_| canonical(self.number())),
            1 => {
                let off = 1.0 + self.uniform() * 1e-6;
                self.unit().map(|c| canonical(c * off))
            }
            2 => {
                let identity = [0.0, 0.0, 0.0, self.signed(1.0)];
                let angle = self.scaled(-60..0).abs();
                self.near(identity, angle)
            }
            // Half of a gimbal lock: two of the components of one angle are small.
            3 => {
                let [x, _, z, w] = self.unit();
                let off = self.scaled(-30..-20);
                [x, w + off, z, w]
            }
            _ => self.unit(),
        }
    }

    /// The parameter of a sample, from -1/2 to 1/2.
    pub(super) fn parameter(&mut self) -> f32 {
        match self.0.u32(..8) {
            0 => self.signed(0.5),
            1 => 0.0,
            2 => self.scaled(-40..-2),
            _ => 0.5 * self.uniform(),
        }
    }

    /// Four keys around an interval. Some are equal, most are near enough for the small-angle
    /// series, some at its limits, and some beyond.
    pub(super) fn four_keys(&mut self) -> [[f32; 4]; 4] {
        let angle = match self.0.u32(..8) {
            0 => 0.0,
            1 => self.scaled(-40..-6).abs(),
            2 => 0.0583 + 2e-4 * self.uniform(), // the longest chord
            3 => 0.4 * self.0.f32(),
            _ => 0.03 * self.0.f32(),
        };
        let first = self.unit();
        let second = self.near(first, angle);
        let spread = if self.once_in(2) { 1.0 } else { self.0.f32() };
        let third = self.near(second, angle * spread);
        [first, second, third, self.near(third, angle)]
    }

    pub(super) fn weights(&mut self) -> TangentWeights {
        let kinds = [KEY_INNER, KEY_INNER, KEY_INNER, KEY_AT_END, KEY_UNKNOWN];
        let size = if self.once_in(8) { 8.0 } else { 1.0 };
        TangentWeights {
            before: size * self.uniform(),
            after: size * self.uniform(),
            outgoing: 0.33 * self.0.f32(),
            kind: kinds[self.0.usize(..kinds.len())],
        }
    }
}
