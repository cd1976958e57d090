//! The names of options' values: one list for each option, which programs and bindings read, write and print.

pub(crate) mod fields;

/// No value of an option has this name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no {option} `{name}`; there are {}{}", known.join(", "), hint(name, known))]
#[non_exhaustive]
pub struct UnknownNameError {
    /// The option: `layout`, `method`.
    pub option: &'static str,
    /// The unknown name.
    pub name: String,
    /// The names of the option's values.
    pub known: Vec<&'static str>,
}

/// Names that other programs and libraries use for the values of options: for each value, these names. A name applies
/// only to options that have the value, so a name may be in several rows.
const OTHER_NAMES: [(&str, &[&str]); 22] = [
    ("slerp", &["linear", "lerp", "line", "lines"]),
    ("linear", &["lerp", "slerp", "line", "lines"]),
    (
        "step",
        &[
            "constant", "stepped", "hold", "discrete", "nearest", "previous",
        ],
    ),
    ("nlerp", &["normalized-lerp", "normalised-lerp"]),
    ("gltf-cubic", &["cubicspline", "cubic-spline"]),
    (
        "bessel-overhauser",
        &["cubic", "smooth", "spline", "auto", "bezier", "overhauser"],
    ),
    ("c2", &["natural", "natural-cubic", "cubic-c2"]),
    ("catmull-rom", &["catmull", "cardinal"]),
    ("kochanek-bartels", &["tcb", "kb"]),
    ("b-spline", &["bspline", "basis-spline"]),
    ("hold", &["clamp", "clamped", "constant", "once"]),
    ("loop", &["repeat", "cycle", "cyclic", "wrap", "periodic"]),
    ("mirror", &["pingpong", "ping-pong", "bounce", "oscillate"]),
    ("extrapolate", &["linear", "continue"]),
    ("row", &["c", "row-major"]),
    ("column", &["f", "fortran", "column-major"]),
    ("f16", &["half", "float16"]),
    ("f32", &["float", "single", "float32"]),
    ("snorm16", &["int16", "i16"]),
    ("body", &["local"]),
    ("parent", &["global"]),
    ("track", &["joint", "track-major", "bone"]),
];

/// A number with its noun, for messages: `1 track`, `4 tracks`, `4 entries`.
#[doc(hidden)]
#[must_use]
pub fn counted(number: usize, noun: &str) -> String {
    match (number, noun.strip_suffix("ry")) {
        (1, _) => format!("1 {noun}"),
        (_, Some(stem)) => format!("{number} {stem}ries"),
        _ => format!("{number} {noun}s"),
    }
}

/// The known name of a value that others call `name`. Case does not matter, and spaces and `_` are `-`.
#[doc(hidden)]
pub fn by_meaning<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.trim().to_lowercase().replace(['_', ' '], "-");
    let is_called = |value: &str| {
        let mut rows = OTHER_NAMES.iter();
        rows.any(|(known, others)| *known == value && others.contains(&&*name))
    };
    known.into_iter().find(|value| is_called(value))
}

/// The end of a message about an unknown name: the name that was probably meant.
fn hint(name: &str, known: &[&'static str]) -> String {
    let meant = by_meaning(name, known.iter().copied());
    meant.map_or_else(String::new, |meant| format!("; did you mean `{meant}`?"))
}

/// The value of an option with this name.
///
/// # Errors
/// When no value has this name.
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

/// Defines the names of an option's variants: `ALL`, `name`, `Display` and `FromStr`. A variant with data specifies
/// its value in `ALL`: `Clamped = Self::AT_REST => "clamped"`. The packages of this workspace use the macro too.
#[doc(hidden)]
#[macro_export]
macro_rules! names {
    ($type:ident, $option:literal, $($variant:ident $(= $value:expr)? => $name:literal),+ $(,)?) => {
        impl $type {
            /// Every value, in the order of lists in help and messages.
            pub const ALL: [Self; [$($name),+].len()] =
                [$($crate::names!(@value $variant $(= $value)?)),+];

            /// The name that programs use.
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
