//! The arithmetic operators of the vector types.

/// Implements the operators of a struct of one vector with the given functions, which the macro
/// `$run` calls.
macro_rules! operators {
    ($name:ident: $run:ident, $add:path, $sub:path, $mul:path, $xor:path) => {
        impl std::ops::Add for $name {
            type Output = Self;

            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self($run!($add(self.0, other.0)))
            }
        }

        impl std::ops::Sub for $name {
            type Output = Self;

            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self($run!($sub(self.0, other.0)))
            }
        }

        impl std::ops::Mul for $name {
            type Output = Self;

            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                Self($run!($mul(self.0, other.0)))
            }
        }

        impl std::ops::Neg for $name {
            type Output = Self;

            #[inline(always)]
            fn neg(self) -> Self {
                let sign = Self::all(-0.0);
                Self($run!($xor(self.0, sign.0)))
            }
        }
    };
}
pub(crate) use operators;
