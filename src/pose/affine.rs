//! The types of affine matrices that callers pass.

use glam::Affine3A;

/// Three rows of four numbers, for column vectors; the last column is the translation.
pub(crate) type AffineRows = [[f32; 4]; 3];

/// A type of affine matrices that callers pass: [`Affine3A`], or three rows of four numbers for column vectors, as in
/// results. The last column is the translation.
pub trait AffineMatrix: Copy + sealed::Sealed {
    /// The rows of the matrix.
    #[doc(hidden)]
    fn rows(self) -> [[f32; 4]; 3];
}

impl AffineMatrix for Affine3A {
    fn rows(self) -> AffineRows {
        let [x, y, z, moved] = self.to_cols_array_2d();
        std::array::from_fn(|i| [x[i], y[i], z[i], moved[i]])
    }
}

impl AffineMatrix for [[f32; 4]; 3] {
    fn rows(self) -> AffineRows {
        self
    }
}

mod sealed {
    pub trait Sealed {}

    impl Sealed for glam::Affine3A {}
    impl Sealed for [[f32; 4]; 3] {}
}
