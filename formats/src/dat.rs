//! The `.dat` keyframe format:
//!
//! ```text
//! # <boxes> <box length>
//! <time> <w> <x> <y> <z>  <w> <x> <y> <z> …
//! ```
//!
//! The header is followed by a line for each key: a time in seconds, and a quaternion for each box. The file is read
//! as a stream. Its memory grows with the lines that are read, never with a number that the file claims.

pub mod write;

use std::io::BufRead;
use std::path::Path;

use glam::{DQuat, Quat};

use crate::diagnostic::{Code, Diagnostic};
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions};
use crate::motion::Motion;
use crate::motion::keys::QUIET_NORM;
use crate::quaternion::{dot, nearest_unit};
use crate::source::Source;
use crate::text::blocks::Blocks;
use crate::text::lines::{Lines, tokens};
use crate::text::number;
use tumble::names::counted;
use tumble::{NORM_TOLERANCE, TrackSet};

/// The largest number of boxes of a file.
pub const MAX_BOXES: usize = 65_536;

/// Two rotations whose dot product is within this of 0 differ by 180°, up to the rounding of f32.
const HALF_TURN_PRODUCT: f64 = 1.0 / (1u64 << 21) as f64;

/// The `.dat` format: keyframes of boxes with shared times, as text.
pub static FORMAT: Format = Format {
    name: "dat",
    summary: "keyframes of a chain of boxes, as text",
    extensions: &[],
    probe: |_| false,
    numbers_in_line: None,
    is_text: true,
    numbers_repeated_names: false,
    guesses_time_unit: false,
    read: open_dat,
    read_bytes: |name, bytes, options| read_dat(name, &bytes[..], options),
    write: None,
    write_motion: Some(write::write_motion),
    features: &[
        Feature::SeveralTracks,
        Feature::Quaternions,
        Feature::Curves,
        Feature::BoxLength,
        Feature::UnevenTimes,
        Feature::Start,
    ],
    options: &[FormatOption::BoxLength],
};

/// Reads a `.dat` file; `-` is standard input.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
pub fn open_dat(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    Source::read_by(path, options.pipes, |name, reader| {
        read_dat(name, reader, options)
    })
}

/// Reads keyframes from the text of a `.dat` file; `name` is the input's name in messages.
///
/// # Errors
/// When the input is invalid; the first error is returned.
pub fn read_dat(
    name: &str,
    reader: impl BufRead,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    let mut lines = Lines::new(name, reader, options.limits)?;
    let header = read_header(&mut lines)?;
    let mut keys = DatKeys::new(header.boxes);
    while let Some(line) = lines.next()? {
        if line.trim_start().starts_with('#') {
            check_comment(&lines, &line)?;
        } else if line.trim().is_empty() {
            keys.blank.get_or_insert(lines.number);
        } else {
            keys.read_row(&mut lines, &line)?;
        }
        lines.reuse(line);
    }
    keys.finish(lines, header.box_length)
}

struct DatHeader {
    boxes: usize,
    box_length: f64,
}

fn read_header<R: BufRead>(lines: &mut Lines<R>) -> Result<DatHeader, Diagnostic> {
    let Some(line) = lines.next()? else {
        return Err(Diagnostic::empty(lines.file()));
    };
    let Some(body) = line.trim_start().strip_prefix('#') else {
        let message =
            "no header; the first line of a .dat file must be `# <boxes> <box length>`".to_owned();
        return Err(lines.refuse(1, Code::NoHeader, message));
    };
    let before = (line.len() - body.len()) as u64;
    let mut words = tokens(body).map(|(column, token)| (column + before, token));
    let short = |lines: &Lines<R>, missing: &str| {
        let message = format!("the header lacks {missing}; it is `# <boxes> <box length>`");
        lines.refuse(line.len() as u64 + 1, Code::HeaderShort, message)
    };
    let (column, boxes) = words
        .next()
        .ok_or_else(|| short(lines, "the number of boxes"))?;
    let boxes = parse_boxes(boxes).map_err(|message| lines.refuse(column, Code::Boxes, message))?;
    let (column, length) = words.next().ok_or_else(|| short(lines, "the box length"))?;
    let length = number::parse(length).map_err(|(_, message)| {
        let message = format!("box length: {message}");
        lines.refuse(column, Code::BoxLength, message)
    })?;
    let box_length = length.value;
    if box_length <= 0.0 {
        let message = format!("the box length is {box_length}; lengths are positive");
        lines.warn(column, Code::BoxLengthSign, message);
    }
    if let Some((column, word)) = words.next() {
        let message = format!("`{word}` after the header's two numbers; it is ignored");
        lines.warn(column, Code::HeaderWords, message);
    }
    Ok(DatHeader { boxes, box_length })
}

fn parse_boxes(token: &str) -> Result<usize, String> {
    let plain = !token.is_empty() && token.bytes().all(|b| b.is_ascii_digit());
    let boxes = token.parse::<usize>().ok().filter(|_| plain);
    match boxes {
        Some(boxes) if (1..=MAX_BOXES).contains(&boxes) => Ok(boxes),
        _ if plain => Err(format!("{token} boxes; there may be 1 to {MAX_BOXES}")),
        _ => Err(format!(
            "`{token}` is not a number of boxes; write a whole number from 1 to {MAX_BOXES} in digits"
        )),
    }
}

/// Refuses a comment that reads like a header.
fn check_comment<R: BufRead>(lines: &Lines<R>, line: &str) -> Result<(), Diagnostic> {
    let body = line.trim_start().trim_start_matches('#');
    let words: Vec<_> = tokens(body)
        .map(|(_, token)| number::parse(token))
        .collect();
    if words.len() == 2 && words.iter().all(Result::is_ok) {
        let message = "a second header; split the file, or delete this line";
        return Err(lines.refuse(1, Code::SecondHeader, message.to_owned()));
    }
    Ok(())
}

/// A line's numbers, one by one.
struct Row<'a, T> {
    tokens: T,
    line: &'a str,
}

impl<'a, T: Iterator<Item = (u64, &'a str)>> Row<'a, T> {
    fn new(line: &'a str, tokens: T) -> Self {
        Self { tokens, line }
    }

    /// Reads the next number, with its column.
    fn next<R: BufRead>(&mut self, lines: &mut Lines<R>) -> Result<(u64, f64), Diagnostic> {
        let Some((column, token)) = self.tokens.next() else {
            return Err(lines.refuse(self.line.len() as u64, Code::Columns, String::new()));
        };
        let number =
            number::parse(token).map_err(|(code, text)| lines.refuse(column, code, text))?;
        if number.vanished {
            let message = format!("`{token}` is too small for f32; it becomes 0");
            lines.warn(column, Code::Tiny, message);
        }
        Ok((column, number.value))
    }
}

/// The keys that were read until now.
struct DatKeys {
    times: Blocks<f64>,
    rows: Blocks<Quat>,
    /// The first blank line since the last key.
    blank: Option<u64>,
    /// Number of keys whose first component is near 0 and whose last one is near 1.
    w_last: u64,
    total: u64,
    previous: Vec<DQuat>,
}

impl DatKeys {
    fn new(count: usize) -> Self {
        Self {
            times: Blocks::new(1),
            rows: Blocks::new(count),
            blank: None,
            w_last: 0,
            total: 0,
            previous: Vec::new(),
        }
    }

    fn read_row<R: BufRead>(&mut self, lines: &mut Lines<R>, line: &str) -> Result<(), Diagnostic> {
        if let Some(blank) = self.blank.take() {
            let message = "a blank line between keys; it is ignored";
            lines.warn_line(blank, Code::BlankLine, message);
        }
        self.read_numbers(lines, line).or_else(|error| {
            // A wrong number of columns is reported first, because it explains more.
            self.check_columns(lines, line)?;
            Err(error)
        })
    }

    fn read_numbers<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
        line: &str,
    ) -> Result<(), Diagnostic> {
        let mut row = Row::new(line, tokens(line));
        let (_, time) = row.next(lines)?;
        self.check_time(lines, time)?;
        for index in 0..self.rows.width() {
            let (column, w) = row.next(lines)?;
            let (_, x) = row.next(lines)?;
            let (_, y) = row.next(lines)?;
            let (_, z) = row.next(lines)?;
            self.push(lines, column, index, DQuat::from_xyzw(x, y, z, w))?;
        }
        if row.tokens.next().is_some() {
            self.check_columns(lines, line)?;
        }
        self.times.push(time);
        Ok(())
    }

    fn check_columns<R: BufRead>(&self, lines: &Lines<R>, line: &str) -> Result<(), Diagnostic> {
        let boxes = self.rows.width();
        let expected = 1 + 4 * boxes;
        let (found, extra) = tokens(line).fold((0, None), |(found, extra), (column, _)| {
            let first_extra = if found == expected {
                Some(column)
            } else {
                extra
            };
            (found + 1, first_extra)
        });
        if found == expected {
            return Ok(());
        }
        let numbers = counted(found, "number");
        let message = format!("{numbers} where {expected} are expected: a time and 4 for each box");
        let column = extra.unwrap_or(line.trim_end().len() as u64 + 1);
        Err(lines.refuse(column, Code::Columns, message))
    }

    fn check_time<R: BufRead>(&self, lines: &mut Lines<R>, time: f64) -> Result<(), Diagnostic> {
        let Some(previous) = self.times.last() else {
            return Ok(());
        };
        if time <= previous {
            let relation = if time == previous {
                "repeats"
            } else {
                "is before"
            };
            let message = format!(
                "time {time} {relation} the previous time, {previous}; times must increase strictly"
            );
            return Err(lines.refuse(1, Code::TimeNotIncreasing, message));
        }
        let gap = time - previous;
        if !(1e-9..=1e9).contains(&gap) {
            let message = format!("{gap} s since the previous key; are the times seconds?");
            lines.warn(1, Code::Gap, message);
        }
        Ok(())
    }

    fn push<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
        column: u64,
        index: usize,
        key: DQuat,
    ) -> Result<(), Diagnostic> {
        let norm = dot(key, key).sqrt();
        let off = (norm - 1.0).abs();
        if off > NORM_TOLERANCE {
            let message = format!(
                "box {}: the quaternion has norm {norm:.6}; a rotation has norm 1 (±{NORM_TOLERANCE})",
                index + 1
            );
            return Err(lines.refuse(column, Code::Norm, message));
        }
        if off > QUIET_NORM {
            let message = format!(
                "box {}: the quaternion has norm {norm:.6}; it is normalised",
                index + 1
            );
            lines.warn(column, Code::NormOff, message);
        }
        // Counts keys that look like small rotations with w last: their last number is near 1 and their first near 0.
        self.total += 1;
        if key.z.abs() > 0.9 && key.w.abs() < 0.3 {
            self.w_last += 1;
        }
        let unit = nearest_unit(key);
        let exact = unit.as_dquat();
        match self.previous.get_mut(index) {
            Some(previous) => {
                if dot(*previous, exact).abs() <= HALF_TURN_PRODUCT {
                    let message = format!(
                        "box {} is rotated by exactly 180° from the previous key; the signs decide the direction",
                        index + 1
                    );
                    lines.warn(column, Code::HalfTurn, message);
                }
                *previous = exact;
            }
            None => self.previous.push(exact),
        }
        self.rows.push(unit);
        Ok(())
    }

    fn finish<R: BufRead>(
        self,
        mut lines: Lines<R>,
        box_length: f64,
    ) -> Result<Loaded, Diagnostic> {
        if self.times.rows() == 0 {
            let message = "no keys after the header; a key line is `time w x y z …`".to_owned();
            return Err(lines.refuse_end(Code::NoKeys, message));
        }
        lines.number = lines.number.saturating_sub(1);
        if self.times.rows() == 1 {
            lines.warn(1, Code::OneKey, "only one key; nothing moves");
        }
        if self.total >= 8 && self.w_last == self.total {
            let message = "in every quaternion the first number is near 0 and the last near 1: is w the last column? \
                           this format has w first";
            lines.warn(1, Code::Order, message);
        }
        let (times, keys) = (self.times.into_columns(), self.rows.into_columns());
        // The keys were checked above; this reports an error that the checks missed.
        let set = TrackSet::from_shared_times(times, keys)
            .map_err(|error| lines.refuse_whole(Code::Norm, error.to_string()))?;
        let clip = Motion {
            set,
            ..Motion::default()
        };
        Ok(Loaded {
            box_length: Some(box_length),
            ..Loaded::of(clip, lines.warnings)
        })
    }
}
