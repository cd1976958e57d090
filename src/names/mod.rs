//! The names of options' values: one list for each option, from which programs and bindings read, write and list
//! them.

/// No value of an option has that name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no {option} `{name}`; there are {}", known.join(", "))]
#[non_exhaustive]
pub struct UnknownNameError {
    /// The option: `layout`, `method`.
    pub option: &'static str,
    /// The name that none of its values has.
    pub name: String,
    /// The names of its values.
    pub known: Vec<&'static str>,
}

/// The value of that name among all values of an option.
///
/// # Errors
/// When none has it.
#[doc(hidden)]
pub fn named<T: Copy>(
    option: &'static str,
    all: &[T],
    name_of: fn(T) -> &'static str,
    name: &str,
) -> Result<T, UnknownNameError> {
    let found = all.iter().find(|&&value| name_of(value) == name);
    found.copied().ok_or_else(|| UnknownNameError {
        option,
        name: name.to_owned(),
        known: all.iter().map(|&value| name_of(value)).collect(),
    })
}

/// Gives the variants of an option their names: `ALL`, `name`, `Display` and `FromStr`. A variant with data names
/// the value that stands for it: `Clamped = Self::AT_REST => "clamped"`. The packages of this workspace use it too.
#[doc(hidden)]
#[macro_export]
macro_rules! names {
    ($type:ident, $option:literal, $($variant:ident $(= $value:expr)? => $name:literal),+ $(,)?) => {
        impl $type {
            /// Every value, in the order in which help and messages list them.
            pub const ALL: [Self; [$($name),+].len()] =
                [$($crate::names!(@value $variant $(= $value)?)),+];

            /// The name by which programs call it.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant { .. } => $name,)+
                }
            }
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.name())
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::names::UnknownNameError;

            fn from_str(name: &str) -> Result<Self, Self::Err> {
                $crate::names::named($option, &Self::ALL, Self::name, name)
            }
        }
    };
    (@value $variant:ident) => { Self::$variant };
    (@value $variant:ident = $value:expr) => { $value };
}

pub(crate) use names;
