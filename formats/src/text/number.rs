//! Numbers as `.dat` files have them, strictly: what is not plainly a decimal
//! number is refused with a hint at what it looks like.

use crate::diagnostic::Code;

/// No number needs more characters.
const MAX_LENGTH: usize = 64;

/// A number that is kept, perhaps as 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Number {
    pub(crate) value: f64,
    /// It was not 0 but is too small for f32.
    pub(crate) vanished: bool,
    /// Digits that it is written with.
    pub(crate) digits: usize,
}

/// Why a token is no number: code and message.
pub(crate) type Refusal = (Code, String);

/// Reads one token.
pub(crate) fn parse(token: &str) -> Result<Number, Refusal> {
    if token.len() > MAX_LENGTH {
        let start: String = token.chars().take(16).collect();
        let message = format!(
            "`{start}…` has {} characters; a number has at most {MAX_LENGTH}",
            token.chars().count()
        );
        return Err((Code::TokenTooLong, message));
    }
    let Decimal { digits, zero } = decimal(token).ok_or_else(|| refuse(token))?;
    // Rust's parser takes exactly this grammar, correctly rounded.
    let value: f64 = token.parse().map_err(|_| refuse(token))?;
    if value.abs() > f64::from(f32::MAX) {
        let message =
            format!("`{token}` is too large; the largest f32 is 3.4e38, check the exponent");
        return Err((Code::TooLarge, message));
    }
    let vanished = value.abs() < f64::from(f32::MIN_POSITIVE) && !zero;
    let value = if vanished { 0.0 } else { value };
    Ok(Number {
        value,
        vanished,
        digits,
    })
}

/// What a decimal number is made of.
#[derive(Clone, Copy)]
struct Decimal {
    /// All of them, the exponent's too.
    digits: usize,
    /// No digit of the mantissa is another than 0.
    zero: bool,
}

/// `[+-] digits [. digits] [e [+-] digits]`, with a digit on either side of the
/// point; nothing for what is no such number.
fn decimal(token: &str) -> Option<Decimal> {
    let signed = |bytes: &[u8], at: usize| usize::from(matches!(bytes.get(at), Some(b'+' | b'-')));
    let bytes = token.as_bytes();
    let mut at = signed(bytes, 0);
    let (mut digits, mut zero, mut point) = (0, true, false);
    while let Some(&byte) = bytes.get(at) {
        match byte {
            b'0'..=b'9' => {
                digits += 1;
                zero &= byte == b'0';
            }
            b'.' if !point => point = true,
            _ => break,
        }
        at += 1;
    }
    if digits == 0 {
        return None;
    }
    if let Some(b'e' | b'E') = bytes.get(at) {
        at += 1;
        at += signed(bytes, at);
        let exponent = &bytes[at..];
        if exponent.is_empty() || !exponent.iter().all(u8::is_ascii_digit) {
            return None;
        }
        digits += exponent.len();
        at = bytes.len();
    }
    (at == bytes.len()).then_some(Decimal { digits, zero })
}

fn is_decimal(token: &str) -> bool {
    decimal(token).is_some()
}

fn refuse(token: &str) -> Refusal {
    let lower = token.to_ascii_lowercase();
    let bare = lower.trim_start_matches(['+', '-']);
    let words = ["nan", "inf", "infinity", "ind", "qnan", "snan"];
    if words.contains(&bare) || bare.contains('#') || bare.starts_with("nan(") {
        let message = format!("`{token}` is not finite; remove or repair this key");
        return (Code::NotFinite, message);
    }
    let hint = if bare.starts_with("0x") {
        "hexadecimal is not read; write it in decimal"
    } else if token.contains(',') {
        "use a point for decimals and blanks between columns"
    } else if token.contains('_') {
        "remove the underscores"
    } else if is_decimal(token.trim_end_matches(['f', 'F', 'l', 'L'])) {
        "remove the suffix"
    } else if is_decimal(&lower.replacen('d', "e", 1)) {
        "write the exponent with e"
    } else if is_glued(&lower) {
        "two numbers seem glued together; put a blank between them"
    } else {
        "numbers look like -1.25 or 3.4e-5"
    };
    (Code::Number, format!("`{token}` is not a number; {hint}"))
}

/// A sign in the middle that no exponent explains, or a second point.
fn is_glued(lower: &str) -> bool {
    let signs = lower
        .char_indices()
        .skip(1)
        .filter(|&(i, c)| matches!(c, '+' | '-') && !lower[..i].ends_with('e'));
    let numeric = lower
        .bytes()
        .all(|b| b.is_ascii_digit() || b"+-.e".contains(&b));
    numeric && (signs.count() > 0 || lower.matches('.').count() > 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordinary_and_odd_numbers_are_read() {
        for (token, value) in [
            ("+1", 1.0),
            (".5", 0.5),
            ("5.", 5.0),
            ("00001", 1.0),
            ("-0", 0.0),
            ("-1.25E-3", -0.00125),
            ("0e999", 0.0),
        ] {
            let number = parse(token).unwrap();
            assert_eq!((number.value, number.vanished), (value, false), "{token}");
        }
        for token in ["1e-400", "1e-39", "-1.4e-45"] {
            let number = parse(token).unwrap();
            assert_eq!((number.value, number.vanished), (0.0, true), "{token}");
        }
    }

    #[test]
    fn what_is_no_number_is_refused_with_a_hint() {
        for (token, code, hint) in [
            ("nan", Code::NotFinite, "not finite"),
            ("-inf", Code::NotFinite, "not finite"),
            ("1.#QNAN", Code::NotFinite, "not finite"),
            ("1e400", Code::TooLarge, "too large"),
            ("1e39", Code::TooLarge, "too large"),
            ("0x1p3", Code::Number, "hexadecimal"),
            ("1_000", Code::Number, "underscores"),
            ("1.5f", Code::Number, "suffix"),
            ("1d5", Code::Number, "with e"),
            ("0,5", Code::Number, "point"),
            ("0.0-7.5", Code::Number, "glued"),
            ("1.2.3", Code::Number, "glued"),
            (".", Code::Number, "look like"),
            ("1e", Code::Number, "look like"),
            ("abc", Code::Number, "look like"),
        ] {
            let (found, message) = parse(token).unwrap_err();
            assert_eq!(found, code, "{token}");
            assert!(message.contains(hint), "{token}: {message}");
        }
        assert_eq!(parse(&"1".repeat(65)).unwrap_err().0, Code::TokenTooLong);
    }
}
