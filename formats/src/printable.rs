//! Escapes texts of other programs before they are displayed: names, paths, headers, lists.
//!
//! A terminal executes control characters. An escape sequence in the name of a joint moves the cursor. A line end in a
//! file's name begins a line that looks like a verdict. A direction mark reverses the words after it. Such characters
//! are displayed as escapes, for example `\u{1b}`.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

/// Whether a character has an effect instead of a shape: controls (C0, DEL, C1), line ends, and marks that change the
/// direction of writing or are invisible; or is none. Joiners, which words of many languages need, are not among them.
fn is_active(character: char) -> bool {
    character.is_control()
        || matches!(character,
            '\u{61c}' | '\u{180e}' | '\u{200b}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
        || is_no_character(character)
}

/// Whether Unicode reserves the number for programs themselves. XML refuses U+FFFE and U+FFFF, and so do readers of
/// SVG.
fn is_no_character(character: char) -> bool {
    matches!(character, '\u{fdd0}'..='\u{fdef}') || u32::from(character) & 0xfffe == 0xfffe
}

/// The text with such characters escaped: `\n`, `\t`, `\u{1b}`. Most texts are returned unchanged.
#[must_use]
pub fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |_| false)
}

/// As [`printable`], for several lines: line feeds are kept.
#[must_use]
pub fn printable_lines(text: &str) -> Cow<'_, str> {
    escaped(text, |character| character == '\n')
}

/// A path as printable text. Bytes that are not UTF-8 are escaped too (`\xff`), so that paths that differ in them
/// look different.
#[must_use]
pub fn printable_path(path: &Path) -> String {
    let mut shown = String::new();
    for chunk in path.as_os_str().as_encoded_bytes().utf8_chunks() {
        shown.push_str(&printable(chunk.valid()));
        for byte in chunk.invalid() {
            let _ = write!(shown, "\\x{byte:02x}");
        }
    }
    shown
}

fn escaped(text: &str, is_kept: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.chars().any(|c| is_active(c) && !is_kept(c)) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for character in text.chars() {
        match character {
            _ if !is_active(character) || is_kept(character) => shown.push(character),
            '\n' => shown.push_str("\\n"),
            '\r' => shown.push_str("\\r"),
            '\t' => shown.push_str("\\t"),
            _ => {
                let _ = write!(shown, "\\u{{{:x}}}", u32::from(character));
            }
        }
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_written_out() {
        for (text, shown) in [
            ("hips", "hips"),
            ("Ärmel 左腕 क्षि 👩\u{200d}🚀", "Ärmel 左腕 क्षि 👩\u{200d}🚀"),
            ("\x1b]0;title\x07", "\\u{1b}]0;title\\u{7}"),
            ("a\nb.npy: all is well", "a\\nb.npy: all is well"),
            ("\u{9b}2J", "\\u{9b}2J"),
            ("\u{202e}gpj.exe", "\\u{202e}gpj.exe"),
            ("a\r\tb\u{7f}", "a\\r\\tb\\u{7f}"),
            (
                "a\u{fffe}b\u{ffff}\u{1ffff}",
                "a\\u{fffe}b\\u{ffff}\\u{1ffff}",
            ),
            ("\u{fdd0}\u{fffd}", "\\u{fdd0}\u{fffd}"),
        ] {
            assert_eq!(printable(text), shown);
        }
        assert_eq!(printable_lines("a\n\x1bb\n"), "a\n\\u{1b}b\n");
    }

    #[cfg(unix)]
    #[test]
    fn paths_that_are_no_text_stay_apart() {
        use std::os::unix::ffi::OsStrExt;
        let path = |bytes: &[u8]| printable_path(Path::new(std::ffi::OsStr::from_bytes(bytes)));
        assert_eq!(path(b"a\xff.dat"), "a\\xff.dat");
        assert_ne!(path(b"a\xff.dat"), path(b"a\xfe.dat"));
        assert_eq!(path(b"walks/a\n.dat"), "walks/a\\n.dat");
    }
}
