//! Methods that set one field of options. Structs that may get more fields are non-exhaustive, so that other crates
//! write `Smoothing::new(kernel).with_passes(2)` in place of a literal.

/// Defines a method for each listed field of a type, which returns the value with this field changed. Optional fields
/// are listed as `Option<T>`, and their methods take `T` too.
macro_rules! with_fields {
    ($type:ident: $($method:ident($field:ident: $($kind:tt)+)),+ $(,)?) => {
        impl $type {
            $($crate::names::fields::with_fields!(@method $type, $method, $field, $($kind)+);)+
        }
    };
    (@method $type:ident, $method:ident, $field:ident, Option<$kind:ty>) => {
        #[doc = concat!("The same with another [`", stringify!($field), "`](Self::", stringify!($field), ").")]
        #[must_use]
        pub fn $method(mut self, $field: impl Into<Option<$kind>>) -> Self {
            self.$field = $field.into();
            self
        }
    };
    (@method $type:ident, $method:ident, $field:ident, $kind:ty) => {
        #[doc = concat!("The same with another [`", stringify!($field), "`](Self::", stringify!($field), ").")]
        #[must_use]
        pub fn $method(mut self, $field: $kind) -> Self {
            self.$field = $field;
            self
        }
    };
}

pub(crate) use with_fields;
