//! Integers as JSON may write them: `1`, `1.0` or `1e0`.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, Error, Visitor};

/// An integer of 0 or more.
#[derive(Debug, Clone, Copy)]
pub(super) struct Whole<T>(pub(super) T);

impl<'de, T: TryFrom<u64>> Deserialize<'de> for Whole<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any<T>(PhantomData<T>);

        impl<T: TryFrom<u64>> Visitor<'_> for Any<T> {
            type Value = Whole<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a whole number from 0 on")
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<Whole<T>, E> {
                let fits = T::try_from(number).map(Whole);
                fits.map_err(|_| E::custom(format!("{number} is too large")))
            }

            fn visit_f64<E: Error>(self, number: f64) -> Result<Whole<T>, E> {
                // Up to this limit, f64 represents every whole number exactly.
                let limit = (1u64 << 53) as f64;
                if number.fract() == 0.0 && (0.0..=limit).contains(&number) {
                    return self.visit_u64(number as u64);
                }
                Err(E::custom(match number > limit {
                    true => format!("{number} is too large"),
                    false => format!("{number} is not a whole number from 0 on"),
                }))
            }
        }

        deserializer.deserialize_u64(Any(PhantomData))
    }
}

/// Deserializes a field.
pub(super) fn whole<'de, D: Deserializer<'de>, T: TryFrom<u64>>(from: D) -> Result<T, D::Error> {
    Whole::deserialize(from).map(|whole| whole.0)
}

/// Deserializes an optional field.
pub(super) fn optional<'de, D: Deserializer<'de>, T: TryFrom<u64>>(
    from: D,
) -> Result<Option<T>, D::Error> {
    let found = Option::<Whole<T>>::deserialize(from)?;
    Ok(found.map(|whole| whole.0))
}

/// Deserializes a list.
pub(super) fn list<'de, D: Deserializer<'de>, T: TryFrom<u64>>(
    from: D,
) -> Result<Vec<T>, D::Error> {
    let found = Vec::<Whole<T>>::deserialize(from)?;
    Ok(found.into_iter().map(|whole| whole.0).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_may_have_a_point_and_an_exponent() {
        let of = |text: &str| serde_json::from_str::<Whole<u32>>(text).map(|whole| whole.0);
        for (text, number) in [
            ("0", 0),
            ("1.0", 1),
            ("1e3", 1000),
            ("2.50e1", 25),
            ("0.0", 0),
            ("-0.0", 0),
        ] {
            assert_eq!(of(text).unwrap(), number, "{text}");
        }
        for text in [
            "1.5",
            "-1",
            "-1.0",
            "4294967296",
            "4294967296.0",
            "1e300",
            "\"1\"",
            "null",
        ] {
            assert!(of(text).is_err(), "{text}");
        }
    }
}
