//! A cubic in f64, and the part of it that is fitted.

use crate::branchless::{Quaternion, Vector, exp, product, scaled};
use crate::method::Basis;

/// A cubic in cumulative form: `base · exp(v₁ B₁(t)) · exp(v₂ B₂(t)) · exp(v₃ B₃(t))`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cubic {
    pub(super) base: Quaternion,
    /// Half-rotation vectors.
    pub(super) vectors: [Vector; 3],
    pub(super) basis: &'static Basis,
    pub(super) piece: Piece,
}

/// The part of an interval that is fitted: where it starts, and its length, in
/// sixteenths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    pub(super) from: u8,
    length: u8,
}

impl Piece {
    pub(super) const WHOLE: Self = Self {
        from: 0,
        length: 16,
    };

    /// Whether it is cut no further: half-angles of dozens of radians within one
    /// interval are computed on the host in f64, for every device.
    pub(super) fn is_finest(self) -> bool {
        self.length == 1
    }

    pub(super) fn halves(self) -> [Self; 2] {
        let length = self.length / 2;
        [self.from, self.from + length].map(|from| Self { from, length })
    }

    /// Where it starts, and its width, as parts of the whole.
    pub(super) fn extent(self) -> (f64, f64) {
        let part = |of: u8| f64::from(of) / f64::from(Self::WHOLE.length);
        (part(self.from), part(self.length))
    }
}

impl Cubic {
    /// The rotation at `t`, 0 to 1 over its piece, in f64.
    pub(crate) fn rotation(&self, t: f64) -> Quaternion {
        let (start, width) = self.piece.extent();
        let t = start + width * t;
        let mut q = self.base;
        for (&vector, [c0, c1, c2, c3]) in self.vectors.iter().zip(self.basis) {
            let weight = ((c3 * t + c2) * t + c1) * t + c0;
            q = product(q, exp(scaled(vector, weight)));
        }
        q
    }

    /// The same rotations with the other sign.
    pub(super) fn negate(&mut self) {
        self.base = self.base.map(|component| -component);
    }
}
