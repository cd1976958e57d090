//! Arithmetic operators for types that wrap numbers.

/// Implements operators of a type, generic over the parameters in brackets: each operator's result is an expression
/// of the operands, which the caller names. The last, if any, is the change of sign, for types that are not generic.
macro_rules! operators {
    (@one [$($generics:tt)*] $name:ty, $a:ident, $b:ident, $operator:ident, $apply:ident, $result:expr) => {
        impl<$($generics)*> std::ops::$operator for $name {
            type Output = Self;

            #[inline(always)]
            fn $apply(self, other: Self) -> Self {
                let ($a, $b) = (self, other);
                $result
            }
        }
    };
    ($generics:tt $name:ty, $a:ident, $b:ident: $($operator:ident $apply:ident => $result:expr;)+
     $(- => $negated:expr;)?) => {
        $(crate::math::operators::operators!(@one $generics $name, $a, $b, $operator, $apply, $result);)+
        $(impl std::ops::Neg for $name {
            type Output = Self;

            #[inline(always)]
            fn neg(self) -> Self {
                let $a = self;
                $negated
            }
        })?
    };
}
pub(crate) use operators;
