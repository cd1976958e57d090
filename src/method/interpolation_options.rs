//! The options of an [`Interpolation`] besides its method.

use crate::curve::options::{Ends, KeySigns, Quantity, Speed};
use crate::method::Method;
use crate::method::interpolation::Interpolation;
use crate::names::UnknownNameError;
use crate::names::fields::with_fields;
use crate::time::wrap::WrapMode;
use crate::tracks::set::key_data::Tcb;

/// The options of an [`Interpolation`], before it is known by which method a track is interpolated.
///
/// ```
/// use tumble::{Ends, Interpolation, InterpolationOptions, Speed, method};
/// let options = InterpolationOptions::default().with_speed(Speed::Constant);
/// assert_eq!(options.with(method::C2).ends, Ends::Secant); // the default of the method
/// assert_eq!(InterpolationOptions::default().with(method::C2), Interpolation::from(method::C2));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct InterpolationOptions {
    /// Which sign of each key is used; `None`: [`KeySigns::Shortest`]. [`GLTF_CUBIC`](crate::method::GLTF_CUBIC)
    /// ignores this option in tracks with tangents.
    pub signs: Option<KeySigns>,
    /// The curve at the first and at the last key; `None`: the default of the method.
    pub ends: Option<Ends>,
    /// Tension, continuity and bias for [`KOCHANEK_BARTELS`](crate::method::KOCHANEK_BARTELS).
    pub tcb: Tcb,
    /// The quantity to evaluate: the rotation, its velocity or its acceleration.
    pub quantity: Quantity,
    /// The speed on the curve.
    pub speed: Speed,
    /// The wrap mode before a track's first key.
    pub before: WrapMode,
    /// The wrap mode after a track's last key.
    pub after: WrapMode,
}

/// The value of an option, as programs and bindings get it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum OptionValue<'a> {
    /// The name of a value, or a number as text.
    Text(&'a str),
    /// A number.
    Number(f64),
}

/// Why an option cannot be set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OptionValueError {
    /// The option has no value of this name.
    #[error(transparent)]
    Name(#[from] UnknownNameError),
    /// The option is a number, and the text is not a number.
    #[error("{option} is `{text}`, which is not a number")]
    NotNumber {
        /// The name of the option.
        option: &'static str,
        /// The text.
        text: String,
    },
    /// The option has names, and the value is a number.
    #[error("{option} is the number {number}; give a name")]
    NotName {
        /// The name of the option.
        option: &'static str,
        /// The number.
        number: f64,
    },
}

/// An option by its name: how it is set in [`InterpolationOptions`], and its value there.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct InterpolationOption {
    /// The name that programs and bindings use.
    pub name: &'static str,
    /// Whether its values are numbers; otherwise they have names.
    pub is_number: bool,
    set: fn(&mut InterpolationOptions, OptionValue<'_>) -> Result<(), OptionValueError>,
    get: fn(&InterpolationOptions) -> Option<String>,
}

/// The row of an option whose values have names.
macro_rules! named {
    ($name:literal, $field:ident, |$value:ident| $stored:expr, |$options:ident| $get:expr) => {
        InterpolationOption {
            name: $name,
            is_number: false,
            set: |options, value| {
                let $value = match value {
                    OptionValue::Text(name) => name.parse()?,
                    OptionValue::Number(number) => {
                        return Err(OptionValueError::NotName {
                            option: $name,
                            number,
                        });
                    }
                };
                options.$field = $stored;
                Ok(())
            },
            get: |$options| $get,
        }
    };
}

/// The row of a number for Kochanek-Bartels.
macro_rules! number {
    ($name:literal, $field:ident) => {
        InterpolationOption {
            name: $name,
            is_number: true,
            set: |options, value| {
                options.tcb.$field = match value {
                    OptionValue::Number(number) => number,
                    OptionValue::Text(text) => {
                        text.parse().map_err(|_| OptionValueError::NotNumber {
                            option: $name,
                            text: text.to_owned(),
                        })?
                    }
                };
                Ok(())
            },
            get: |options| {
                let number = options.tcb.$field;
                (number != 0.0).then(|| number.to_string())
            },
        }
    };
}

impl InterpolationOption {
    /// Every option but the quantity, in the order of lists in help and signatures.
    pub const ALL: [Self; 8] = [
        named!("signs", signs, |signs| Some(signs), |options| {
            options.signs.map(|signs| signs.to_string())
        }),
        named!("ends", ends, |ends| Some(ends), |options| {
            options.ends.map(|ends| ends.to_string())
        }),
        named!("speed", speed, |speed| speed, |options| {
            Some(options.speed.to_string())
        }),
        named!("before", before, |mode| mode, |options| {
            Some(options.before.to_string())
        }),
        named!("after", after, |mode| mode, |options| {
            Some(options.after.to_string())
        }),
        number!("tension", tension),
        number!("continuity", continuity),
        number!("bias", bias),
    ];

    /// The option of this name. `path` is the name that `signs` had before.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let name = if name == "path" { "signs" } else { name };
        Self::ALL.into_iter().find(|option| option.name == name)
    }

    /// Sets the option.
    ///
    /// # Errors
    /// When the option has no such value.
    pub fn set(
        self,
        options: &mut InterpolationOptions,
        value: OptionValue<'_>,
    ) -> Result<(), OptionValueError> {
        (self.set)(options, value)
    }

    /// The text by which the option is set to the value that it has; `None` if it depends on the method, and for
    /// a number that is 0.
    #[must_use]
    pub fn get(self, options: &InterpolationOptions) -> Option<String> {
        (self.get)(options)
    }
}

impl std::fmt::Debug for InterpolationOption {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("InterpolationOption")
            .field(&self.name)
            .finish()
    }
}

impl Default for InterpolationOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}

with_fields! {
    InterpolationOptions:
    with_signs(signs: Option<KeySigns>),
    with_ends(ends: Option<Ends>),
    with_tcb(tcb: Tcb),
    with_quantity(quantity: Quantity),
    with_speed(speed: Speed),
    with_before(before: WrapMode),
    with_after(after: WrapMode),
}

impl InterpolationOptions {
    /// The options of a [`Method`] that is given alone.
    pub const DEFAULT: Self = Self {
        signs: None,
        ends: None,
        tcb: Tcb {
            tension: 0.0,
            continuity: 0.0,
            bias: 0.0,
        },
        quantity: Quantity::Rotation,
        speed: Speed::AsKeyed,
        before: WrapMode::Hold,
        after: WrapMode::Hold,
    };

    /// The interpolation by a method: it has the options that the method takes, and the method's defaults for those
    /// that are not set.
    #[must_use]
    pub fn with(&self, method: Method) -> Interpolation {
        Interpolation {
            method,
            signs: self.signs.unwrap_or_default(),
            ends: self.ends.unwrap_or(method.ends),
            tcb: self.tcb,
            quantity: self.quantity,
            speed: self.speed,
            before: self.before,
            after: self.after,
        }
    }
}

impl From<Method> for Interpolation {
    fn from(method: Method) -> Self {
        InterpolationOptions::DEFAULT.with(method)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::{KOCHANEK_BARTELS, METHODS};

    #[test]
    fn every_option_is_set_by_its_name_and_read_again() {
        let values = [
            "as-authored",
            "natural",
            "constant",
            "loop",
            "mirror",
            "0.5",
            "-1",
            "0.25",
        ];
        let before = InterpolationOption::named("path").unwrap();
        assert_eq!(before.name, "signs");
        let mut options = InterpolationOptions::default();
        for (option, value) in InterpolationOption::ALL.into_iter().zip(values) {
            assert_eq!(
                InterpolationOption::named(option.name).unwrap().name,
                option.name
            );
            option.set(&mut options, OptionValue::Text(value)).unwrap();
            assert_eq!(option.get(&options).as_deref(), Some(value));
            let number = option.set(&mut options, OptionValue::Number(2.0));
            assert_eq!(number.is_ok(), option.is_number, "{}", option.name);
            let unknown = option.set(&mut options, OptionValue::Text("slurp"));
            assert!(unknown.unwrap_err().to_string().contains("`slurp`"));
        }
        let found = options.with(KOCHANEK_BARTELS);
        assert_eq!(
            (found.signs, found.ends),
            (KeySigns::AsAuthored, Ends::Natural)
        );
        assert_eq!(
            (found.before, found.after),
            (WrapMode::Loop, WrapMode::Mirror)
        );
        assert_eq!(found.speed, Speed::Constant);
        assert_eq!(
            [found.tcb.tension, found.tcb.continuity, found.tcb.bias],
            [2.0; 3]
        );
    }

    #[test]
    fn what_is_not_set_depends_on_the_method() {
        for method in METHODS {
            let found = InterpolationOptions::default().with(method);
            assert_eq!(found.ends, method.ends);
            assert_eq!(found.signs, KeySigns::Shortest);
            assert_eq!(found, Interpolation::from(method));
        }
    }
}
