//! Texts as cells of a table.

use std::borrow::Cow;

/// A text as a cell. Spreadsheets interpret cells that begin with `=`, `+`, `-` or `@` as formulas, which may run
/// programs; some also behind a blank that is not displayed, or in the full-width form of East Asian keyboards. Such
/// cells, and texts that look like escaped cells, get a leading quote, which spreadsheets do not display. NUL, which no
/// reader of text takes, becomes `_`. This is not for numbers.
pub(crate) fn text_cell(text: &str) -> Cow<'_, str> {
    let text = without_nul(text);
    match is_formula(text.trim_start_matches(QUOTE)) {
        true => Cow::Owned(format!("{QUOTE}{text}")),
        false => text,
    }
}

/// A text in which NUL is `_`.
pub(crate) fn without_nul(text: &str) -> Cow<'_, str> {
    match text.contains('\0') {
        true => Cow::Owned(text.replace('\0', "_")),
        false => Cow::Borrowed(text),
    }
}

/// The text of a cell that [`text_cell`] wrote.
pub(crate) fn cell_text(cell: &str) -> &str {
    match cell.strip_prefix(QUOTE) {
        Some(text) if is_formula(text.trim_start_matches(QUOTE)) => text,
        _ => cell,
    }
}

const QUOTE: char = '\'';

fn is_formula(text: &str) -> bool {
    let signs = ['=', '+', '-', '@', '＝', '＋', '－', '＠'];
    text.starts_with(signs) || text.starts_with(['\t', '\r', '\n'])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cell_of_text_is_a_formula_and_each_says_what_it_was() {
        for (text, cell) in [
            ("hip.x", "hip.x"),
            ("=cmd|' /C calc'!A0.x", "'=cmd|' /C calc'!A0.x"),
            ("-hand.w", "'-hand.w"),
            ("@SUM(A1).y", "'@SUM(A1).y"),
            ("+1", "'+1"),
            ("\t=1", "'\t=1"),
            ("\n=1", "'\n=1"),
            ("＝1+1", "'＝1+1"),
            ("＠SUM(A1)", "'＠SUM(A1)"),
            ("'=1", "''=1"),
            ("''-", "'''-"),
            ("'tis", "'tis"),
            ("", ""),
        ] {
            assert_eq!((&*text_cell(text), cell_text(cell)), (cell, text));
        }
        assert_eq!(text_cell("left\0arm"), "left_arm");
    }
}
