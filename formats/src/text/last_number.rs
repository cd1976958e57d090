//! Text that was cut within its last number: the rest may still be a number, with fewer digits than were written.

/// How many of the last lines are compared: numbers in their shortest form have fewer digits than this many others by
/// chance in 3 of 100 files, and only files without a line end at their end count.
const LINES: usize = 32;

/// The least number of lines to compare.
const LEAST: usize = 3;

/// The message, which is the same in all formats.
pub(crate) const MESSAGE: &str = "the file ends in the middle of a line, and its last number has fewer digits than those \
                                  above it; is the file cut?";

/// The numbers of decimals of the last numbers on the last lines.
#[derive(Default)]
pub(crate) struct LastNumbers {
    decimals: [usize; LINES],
    count: usize,
}

impl LastNumbers {
    /// Adds a line that has an end.
    pub(crate) fn add(&mut self, line: &[u8]) {
        if let Some((_, decimals)) = last_number(line) {
            self.decimals[self.count % LINES] = decimals;
            self.count += 1;
        }
    }

    /// The column, from 1, of the last number on the last line, which has no end, if it may be cut.
    pub(crate) fn cut(&self, line: &[u8]) -> Option<u64> {
        let (start, decimals) = last_number(line)?;
        let all = &self.decimals[..self.count.min(LINES)];
        let is_shorter = all.len() >= LEAST && all.iter().all(|&other| decimals < other);
        // In a rotation such as `0 0 0 1` all numbers are short, so the last one is not cut. If it was cut, the numbers
        // before it have more digits.
        let is_short = |end: usize| {
            let before = last_number(without_separators(&line[..end]))?;
            (before.1 <= decimals).then_some(before.0)
        };
        let are_all_short = is_short(start).and_then(is_short).is_some();
        (is_shorter && !are_all_short).then_some(start as u64 + 1)
    }
}

fn without_separators(mut line: &[u8]) -> &[u8] {
    while let [rest @ .., b' ' | b'\t' | b',' | b';'] = line {
        line = rest;
    }
    line
}

/// Where the last number of some text is, if it may be cut: its line from 1, and its column.
pub(crate) fn cut(text: &[u8]) -> Option<(u64, u64)> {
    let mut lines = text.rsplit(|&byte| byte == b'\n');
    let last = lines.next()?;
    let mut numbers = LastNumbers::default();
    lines.take(LINES).for_each(|line| numbers.add(line));
    let column = numbers.cut(last)?;
    let above = text.iter().filter(|&&byte| byte == b'\n').count();
    Some((above as u64 + 1, column))
}

/// The start of the number at the end of a line, and its number of digits after the point, including the digits of an
/// exponent.
fn last_number(line: &[u8]) -> Option<(usize, usize)> {
    let line = line.strip_suffix(b"\r").unwrap_or(line);
    let is_comment = line.trim_ascii_start().starts_with(b"#");
    let is_between = |byte: &u8| matches!(byte, b' ' | b'\t' | b',' | b';');
    let start = line.iter().rposition(is_between).map_or(0, |at| at + 1);
    let number = &line[start..];
    // Numbers are not parsed here, because this runs for every line; the readers refuse text that is not a number.
    let is_part = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
    let is_number =
        !is_comment && number.iter().all(is_part) && number.iter().any(u8::is_ascii_digit);
    let after_point = number.iter().skip_while(|&&byte| byte != b'.').skip(1);
    let decimals = after_point.filter(|byte| byte.is_ascii_digit()).count();
    is_number.then_some((start, decimals))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_number_is_shorter_than_those_above() {
        let whole = "0 1.2500\n1 -0.5000\n2 0.3333\n3 0.1234";
        assert_eq!(cut(whole.as_bytes()), None);
        assert_eq!(cut(&whole.as_bytes()[..whole.len() - 2]), Some((4, 3)));
        assert_eq!(cut(&whole.as_bytes()[..whole.len() - 5]), Some((4, 3)));
        let exponents =
            "1.5e+00 1.631700e+01\n1.6e+00 1.641700e+01\n1.7e+00 1.651700e+01\n1.8e+00 1.661700e+0";
        assert_eq!(cut(exponents.as_bytes()), Some((4, 9)));
        assert_eq!(cut(format!("{exponents}1").as_bytes()), None);
        for good in [
            "0,1.5\n1,2\n2,3\n3,4",
            "# 0.1\n1.5\n# 2",
            "0 0.98 0.1 0.25\n1 0.97 0.2 0.75\n2 0.96 0.3 0.35\n3 0 0 1",
            "",
            "1.25\n1.5",
            "a 0.1\nb 0.2\nc 0.3\nd 1.\n",
        ] {
            assert_eq!(cut(good.as_bytes()), None, "{good}");
        }
    }
}
