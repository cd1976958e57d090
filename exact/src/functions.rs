//! Functions of f32 that have the same bits in WGSL on every driver and in Rust.
//!
//! They consist of additions, subtractions, multiplications, comparisons and operations on the bits, in the same order in
//! both languages. [`WGSL`] is the text for shaders; pass the module that contains it through [`exact`](crate::exact). The Rust
//! functions are written from that text by the compiler of the engine's shaders, operation by operation.
//!
//! Arguments and results below 2^-50 in magnitude should be [`flushed`], because drivers differ in how they treat
//! subnormal numbers. The errors are the largest that a test finds over the stated range.

use crate::generated;

/// The functions of this module as WGSL, with the constants that they need. Append it to your shader.
///
/// `sine_cosine` returns `vec2f(sine, cosine)`.
pub const WGSL: &str = include_str!("../functions.wgsl");

/// Sine and cosine of an angle in radians, for |angle| ≤ pi/2, within 1.2e-7.
#[must_use]
pub fn sine_cosine(angle: f32) -> (f32, f32) {
    generated::sine_cosine(angle)
}

/// 1/x for x from 2^-50 to 2^50, within 2 units in the last place.
#[must_use]
pub fn reciprocal(x: f32) -> f32 {
    generated::reciprocal(x)
}

/// 1/√x for x from 2^-50 to 2^50, within a relative error of 2e-7.
#[must_use]
pub fn reciprocal_root(x: f32) -> f32 {
    generated::reciprocal_root(x)
}

/// √x for x = 0 and for x from 2^-50 to 2^50, within 1 unit in the last place.
#[must_use]
pub fn root(x: f32) -> f32 {
    generated::root(x)
}

/// The angle of the point (x, y) in radians, from -pi to pi, within 2e-7; 0 for (0, 0). Both are 0 or from 2^-50 to 2^50 in
/// magnitude.
#[must_use]
pub fn arc_tangent(y: f32, x: f32) -> f32 {
    generated::arc_tangent(y, x)
}

/// 0 if the magnitude of x is below 2^-50, else x.
#[must_use]
pub fn flushed(x: f32) -> f32 {
    generated::flushed(x)
}

/// The magnitude of x.
#[must_use]
pub fn magnitude(x: f32) -> f32 {
    generated::magnitude(x)
}

/// The numbers of the generated functions. The engine also uses vectors of numbers, in addition to f32.
pub(crate) trait Number:
    Copy + std::ops::Add<Output = Self> + std::ops::Sub<Output = Self> + std::ops::Mul<Output = Self>
{
    fn all(value: f32) -> Self;

    /// Magnitudes below a positive limit become +0.
    fn zero_below(self, limit: f32) -> Self;

    /// The number whose bits are `seed` minus the bits of this one shifted to the right.
    fn guess(self, seed: u32, shift: u32) -> Self;
}

impl Number for f32 {
    fn all(value: f32) -> Self {
        value
    }

    fn zero_below(self, limit: f32) -> Self {
        let magnitude = self.to_bits() & 0x7fff_ffff;
        if magnitude < limit.to_bits() {
            0.0
        } else {
            self
        }
    }

    fn guess(self, seed: u32, shift: u32) -> Self {
        Self::from_bits(seed.wrapping_sub(self.to_bits() >> shift))
    }
}
