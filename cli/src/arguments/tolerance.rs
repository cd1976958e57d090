//! How far two motions may be apart.

/// A number from 0.
pub(crate) fn not_negative(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() && number >= 0.0 => Ok(number),
        _ => Err("expected a finite number of 0 or more".to_owned()),
    }
}

/// An angle in degrees: `0.1deg`, `0.1` or `0.002rad`.
pub(crate) fn degrees(text: &str) -> Result<f64, String> {
    let (number, factor) = match (text.strip_suffix("deg"), text.strip_suffix("rad")) {
        (Some(number), _) => (number, 1.0),
        (None, Some(number)) => (number, 1f64.to_degrees()),
        (None, None) => (text.strip_suffix('°').unwrap_or(text), 1.0),
    };
    Ok(not_negative(number)? * factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_have_units() {
        assert_eq!(degrees("0.1deg"), Ok(0.1));
        assert_eq!(degrees("0.1"), Ok(0.1));
        assert_eq!(degrees("0.1°"), Ok(0.1));
        assert!((degrees("0.5rad").unwrap() - 28.647_889_756_541_16).abs() < 1e-12);
        for wrong in ["", "deg", "-1", "nan", "inf", "1 grad"] {
            assert!(degrees(wrong).is_err(), "{wrong}");
        }
    }
}
