//! Finds decimal commas in FBX files of text. Some programs write numbers in the system's format; since commas also
//! separate numbers, half of each number would be read as the next one.

use crate::diagnostic::{Code, Diagnostic, Location};

/// A list whose length is written before it: `KeyValueFloat: *2 {`.
struct List<'a> {
    name: &'a str,
    length: usize,
    line: u64,
    found: usize,
    has_points: bool,
}

/// Refuses a file of text in which a list has more numbers than it states, and none of them has a decimal point.
pub(super) fn refuse(name: &str, bytes: &[u8]) -> Result<(), Diagnostic> {
    let is_text = !bytes[..bytes.len().min(1024)].contains(&0);
    let Some(text) = is_text.then(|| String::from_utf8_lossy(bytes)) else {
        return Ok(());
    };
    let mut open: Option<List<'_>> = None;
    for (line, number) in text.lines().zip(1..) {
        if let Some(list) = &mut open {
            let (numbers, is_end) = match line.split_once('}') {
                Some((numbers, _)) => (numbers, true),
                None => (line, false),
            };
            let numbers = numbers.trim().trim_start_matches("a:");
            let numbers = numbers
                .split(',')
                .filter(|number| !number.trim().is_empty());
            list.found += numbers.count();
            list.has_points |= line.contains('.');
            if !is_end {
                continue;
            }
            if list.found > list.length && !list.has_points {
                let message = format!(
                    "`{}` has {} numbers and states {}: these are decimal commas; set the system's number format to decimal \
                     points, and export the file again",
                    list.name, list.found, list.length
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
        let begun = line.split_once(": *").and_then(|(name, rest)| {
            let length = rest.trim_end().strip_suffix('{')?.trim_end();
            Some((name.trim(), length.parse().ok()?))
        });
        open = begun.map(|(name, length)| List {
            name,
            length,
            line: number,
            found: 0,
            has_points: false,
        });
    }
    Ok(())
}
