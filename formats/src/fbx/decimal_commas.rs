//! Finds decimal commas in FBX files of text. Some programs write numbers in the system's format; since commas also
//! separate numbers, half of each number would be read as the next one.

use crate::diagnostic::{Code, Diagnostic, Location};

/// A list whose length is written before it: `KeyValueFloat: *2 {`.
struct List<'a> {
    name: &'a [u8],
    length: usize,
    line: u64,
    found: usize,
    has_points: bool,
}

/// Refuses a file of text in which a list has more numbers than it states, and none of them has a decimal point.
pub(super) fn refuse(name: &str, bytes: &[u8]) -> Result<(), Diagnostic> {
    if bytes[..bytes.len().min(1024)].contains(&0) {
        return Ok(());
    }
    let mut open: Option<List<'_>> = None;
    for (line, number) in bytes.split(|&byte| byte == b'\n').zip(1..) {
        if let Some(list) = &mut open {
            let end = line.iter().position(|&byte| byte == b'}');
            let numbers = line[..end.unwrap_or(line.len())].trim_ascii();
            let numbers = numbers.strip_prefix(b"a:").unwrap_or(numbers);
            let numbers = numbers
                .split(|&byte| byte == b',')
                .filter(|number| !number.trim_ascii().is_empty());
            list.found += numbers.count();
            list.has_points |= line.contains(&b'.');
            if end.is_none() {
                continue;
            }
            if list.found > list.length && !list.has_points {
                let message = format!(
                    "`{}` has {} numbers and states {}: these are decimal commas; set the system's number format to decimal \
                     points, and export the file again",
                    String::from_utf8_lossy(list.name),
                    list.found,
                    list.length
                );
                let location = Location::Text {
                    line: list.line,
                    column: 1,
                };
                return Err(Diagnostic {
                    location: Some(location),
                    ..Diagnostic::new(name, Code::FbxDamaged, message)
                });
            }
            open = None;
            continue;
        }
        open = begun(line).map(|(name, length)| List {
            name,
            length,
            line: number,
            found: 0,
            has_points: false,
        });
    }
    Ok(())
}

/// The name and the length of a list that begins on this line.
fn begun(line: &[u8]) -> Option<(&[u8], usize)> {
    const MARK: &[u8] = b": *";
    let at = line.windows(MARK.len()).position(|part| part == MARK)?;
    let length = line[at + MARK.len()..]
        .trim_ascii_end()
        .strip_suffix(b"{")?;
    let length = std::str::from_utf8(length.trim_ascii_end()).ok()?;
    Some((line[..at].trim_ascii(), length.parse().ok()?))
}
