//! Parses numbers as in `.dat` files, strictly: an error contains a hint if the text looks like something else than a
//! decimal number.

use crate::diagnostic::Code;

/// The largest length of a number in characters.
const MAX_LENGTH: usize = 64;

/// A parsed number, which may have become 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Number {
    pub(crate) value: f64,
    /// Whether it is not 0 but too small for f32.
    pub(crate) vanished: bool,
}

/// Why a token is not a number: code and message.
pub(crate) type Refusal = (Code, String);

/// Whether a token is NaN, as languages print it: `nan`, `NaN`, `-nan`.
pub(crate) fn is_nan(token: &str) -> bool {
    let digits = token.strip_prefix(['-', '+']).unwrap_or(token);
    digits.eq_ignore_ascii_case("nan")
}

/// Parses one token.
pub(crate) fn parse(token: &str) -> Result<Number, Refusal> {
    if token.len() > MAX_LENGTH {
        let start: String = token.chars().take(16).collect();
        let message = format!(
            "`{start}…` has {} characters; a number has at most {MAX_LENGTH}",
            token.chars().count()
        );
        return Err((Code::TokenTooLong, message));
    }
    let decimal = decimal(token).ok_or_else(|| refuse(token))?;
    if let Some(value) = decimal.exact_quotient() {
        let value = if token.starts_with('-') {
            -value
        } else {
            value
        };
        return Ok(Number {
            value,
            vanished: false, // 22 decimals do not underflow f32
        });
    }
    // Rust's parser takes exactly this grammar, correctly rounded.
    let value: f64 = token.parse().map_err(|_| refuse(token))?;
    if value.abs() > f64::from(f32::MAX) {
        let message =
            format!("`{token}` is too large; the largest f32 is 3.4e38, check the exponent");
        return Err((Code::TooLarge, message));
    }
    let vanished = value.abs() < f64::from(f32::MIN_POSITIVE) && !decimal.zero;
    let value = if vanished { 0.0 } else { value };
    Ok(Number { value, vanished })
}

/// The parts of a decimal number.
#[derive(Clone, Copy)]
struct DecimalParts {
    /// Whether the mantissa is 0.
    zero: bool,
    /// The digits of the mantissa as an integer, if there are 19 or fewer.
    mantissa: u64,
    /// How many of these digits are after the point.
    decimals: usize,
    /// Whether there are more than 19, or an exponent.
    is_long: bool,
}

/// Powers of ten that are exact in f64.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

impl DecimalParts {
    /// The number's magnitude, if one division computes it. If both operands are exact in f64, the quotient is
    /// correctly rounded (Clinger, *How to Read Floating Point Numbers Accurately*, 1990). This takes a third of the
    /// time of a general parser.
    fn exact_quotient(self) -> Option<f64> {
        let power = POWERS.get(self.decimals)?;
        let exact = !self.is_long && self.mantissa <= 1 << f64::MANTISSA_DIGITS;
        exact.then(|| self.mantissa as f64 / power)
    }
}

/// Parses `[+-] digits [. digits] [e [+-] digits]`, with a digit on either side of the point; `None` for other texts.
fn decimal(token: &str) -> Option<DecimalParts> {
    let signed = |bytes: &[u8], at: usize| usize::from(matches!(bytes.get(at), Some(b'+' | b'-')));
    let bytes = token.as_bytes();
    let mut at = signed(bytes, 0);
    let (mut digits, mut mantissa, mut zero, mut point) = (0, 0u64, true, None);
    while let Some(&byte) = bytes.get(at) {
        match byte {
            b'0'..=b'9' => {
                digits += 1;
                zero &= byte == b'0';
                // Wraps after 19 digits; longer numbers do not use it.
                mantissa = mantissa
                    .wrapping_mul(10)
                    .wrapping_add(u64::from(byte - b'0'));
            }
            b'.' if point.is_none() => point = Some(digits),
            _ => break,
        }
        at += 1;
    }
    if digits == 0 {
        return None;
    }
    let decimals = digits - point.unwrap_or(digits);
    let mut is_long = digits > 19;
    if let Some(b'e' | b'E') = bytes.get(at) {
        at += 1;
        at += signed(bytes, at);
        let exponent = &bytes[at..];
        if exponent.is_empty() || !exponent.iter().all(u8::is_ascii_digit) {
            return None;
        }
        at = bytes.len();
        is_long = true;
    }
    (at == bytes.len()).then_some(DecimalParts {
        zero,
        mantissa,
        decimals,
        is_long,
    })
}

fn is_decimal(token: &str) -> bool {
    decimal(token).is_some()
}

fn refuse(token: &str) -> Refusal {
    let lower = token.to_ascii_lowercase();
    let bare = lower.trim_start_matches(['+', '-']);
    let words = ["nan", "inf", "infinity", "ind", "qnan", "snan"];
    if words.contains(&bare) || bare.contains('#') || bare.starts_with("nan(") {
        let message = format!("`{token}` is not finite; write a finite number");
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

/// Whether a text has a sign in the middle that is not an exponent's, or a second point.
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

    /// The fast path and Rust's parser give the same bits, on both sides of the limit of the fast path.
    #[test]
    fn short_decimals_have_the_bits_of_the_parser() {
        let mut state = 1u64;
        let mut short = 0;
        for round in 0..200_000u32 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let digits = (state >> 11).to_string();
            let (start, end) = (round as usize % 20, digits.len());
            let digits = &digits[..end.min(1 + (state % 20) as usize)];
            let (whole, decimals) = digits.split_at(start.min(digits.len()));
            let zeros = "0".repeat((state % 3 * (state >> 7 & 7)) as usize);
            let sign = ["", "-", "+"][(state >> 3) as usize % 3];
            let token = format!("{sign}{whole}.{zeros}{decimals}");
            short += usize::from(decimal(&token).unwrap().exact_quotient().is_some());
            let expected: f64 = token.parse().unwrap();
            assert_eq!(
                parse(&token).unwrap().value.to_bits(),
                expected.to_bits(),
                "{token}"
            );
        }
        assert!((100_000..199_000).contains(&short), "{short}");
        for token in [
            "-0",
            "0.0",
            "-.0",
            "9007199254740992",
            "9007199254740993",
            "1e-3",
        ] {
            let expected: f64 = token.parse().unwrap();
            assert_eq!(
                parse(token).unwrap().value.to_bits(),
                expected.to_bits(),
                "{token}"
            );
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
