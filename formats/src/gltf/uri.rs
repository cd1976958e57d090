//! Reads the URIs of buffers and images: data in the URI, or other files.

use std::path::PathBuf;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

/// Padding is optional, because writers differ in it.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Whether the URI contains the data.
pub(super) fn is_data(uri: &str) -> bool {
    scheme(uri).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data"))
}

/// The bytes of a data URI (RFC 2397).
///
/// # Errors
/// The error as text.
pub(super) fn data(uri: &str) -> Result<Vec<u8>, String> {
    let Some((kind, data)) = uri.split_once(',') else {
        return Err("the data URI has no comma before its data".to_owned());
    };
    let encoding = kind.rsplit([':', ';']).next().unwrap_or_default();
    if !encoding.eq_ignore_ascii_case("base64") {
        return percent_decoded(data);
    }
    let decoded = match data.contains('%') {
        true => BASE64.decode(percent_decoded(data)?),
        false => BASE64.decode(data),
    };
    decoded.map_err(|error| format!("the data URI is not base64: {error}"))
}

/// A data URI of these bytes.
pub(super) fn of_bytes(bytes: &[u8]) -> String {
    format!(
        "data:application/octet-stream;base64,{}",
        BASE64.encode(bytes)
    )
}

/// The path of the file that a URI names, relative to the folder of the file with the URI, and within it.
///
/// # Errors
/// Why the URI is refused: it leads out of the folder, or does not name a file.
pub(super) fn relative(uri: &str) -> Result<PathBuf, String> {
    if let Some(scheme) = scheme(uri) {
        return Err(format!(
            "`{uri}` is not followed, for it begins with `{scheme}:`; put the file into the folder of this one"
        ));
    }
    let text = String::from_utf8(percent_decoded(uri)?)
        .map_err(|_| format!("`{uri}` is not UTF-8 once decoded"))?;
    if text.starts_with('/') {
        return Err(format!(
            "`{uri}` is an absolute path, which is not followed; put the file into the folder of this one"
        ));
    }
    if text.contains(['\\', '\0']) || scheme(&text).is_some() {
        return Err(format!(
            "`{uri}` is not a relative path; its parts are divided by `/`"
        ));
    }
    let mut path = PathBuf::new();
    for part in text.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                if !path.pop() {
                    return Err(format!(
                        "`{uri}` leads out of the file's folder and is not followed; put the file \
                         into this folder"
                    ));
                }
            }
            _ => path.push(part),
        }
    }
    match path.as_os_str().is_empty() {
        true => Err(format!("`{uri}` names no file")),
        false => Ok(path),
    }
}

/// The text before the first colon, if it is the scheme of a URI (or the letter of a drive).
fn scheme(uri: &str) -> Option<&str> {
    let (scheme, _) = uri.split_once(':')?;
    let is_part = |b: u8| b.is_ascii_alphanumeric() || b"+-.".contains(&b);
    let begins = scheme.starts_with(|c: char| c.is_ascii_alphabetic());
    (begins && scheme.bytes().all(is_part)).then_some(scheme)
}

/// Decodes percent escapes: `%41` is `A`.
fn percent_decoded(text: &str) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        rest = after;
        if first != b'%' {
            bytes.push(first);
            continue;
        }
        let digit = |at: usize| char::from(*after.get(at)?).to_digit(16);
        let (Some(high), Some(low)) = (digit(0), digit(1)) else {
            let offset = text.len() - after.len() - 1;
            return Err(format!(
                "the `%` at byte {offset} of the URI has no two hexadecimal digits"
            ));
        };
        bytes.push((high * 16 + low) as u8);
        rest = &after[2..];
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_within_the_folder() {
        for (uri, path) in [
            ("walk.bin", "walk.bin"),
            ("bin%20files/./my%20keys.bin", "bin files/my keys.bin"),
            ("a/b/../c%C3%A9.bin", "a/cé.bin"),
        ] {
            assert_eq!(relative(uri), Ok(path.into()), "{uri}");
        }
        for uri in [
            "../walk.bin",
            "a/../../walk.bin",
            "%2e%2e/walk.bin",
            "/etc/passwd",
            "%2fetc/passwd",
            "http://example.com/walk.bin",
            "file:///etc/passwd",
            "C:/walk.bin",
            "C%3a/walk.bin",
            "..\\walk.bin",
            "a%00b",
            "%zz",
            "%4",
            "%ff",
            "",
            ".",
            "a/..",
        ] {
            assert!(relative(uri).is_err(), "{uri}");
        }
    }

    #[test]
    fn data_uris_are_decoded_in_either_encoding() {
        assert_eq!(data("data:a/b;base64,AQI=").unwrap(), [1, 2]);
        assert_eq!(data("data:;BASE64,AQI").unwrap(), [1, 2]);
        assert_eq!(data("data:;base64,%41QI%3d").unwrap(), [1, 2]);
        assert_eq!(data("data:,a%00b").unwrap(), *b"a\0b");
        assert!(data("data:;base64").is_err());
        assert!(data("data:;base64,!").is_err());
        assert_eq!(data(&of_bytes(b"\xff\0")).unwrap(), *b"\xff\0");
        assert!(is_data("DATA:,x") && !is_data("database.bin"));
    }
}
