//! Reads keys from CSV with a header: in the wide layout that Tumble writes, or in a long layout.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;

use ::csv::{ByteRecord, Reader, ReaderBuilder};

use crate::budget::Budget;
use crate::csv::capture::{CaptureHeading, has_no_number};
use crate::decimal::{Decimal, decimal_count};
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::dialect;
use crate::format::{Loaded, ReadOptions, TimeUnit};
use crate::source::Source;
use crate::table::clips::clips;
use crate::table::columns::{Column, ColumnNeed, ColumnNumbers, ColumnValues, Table};
use crate::table::plan::{TablePlan, TimeSource};
use crate::text::cell::cell_text;
use crate::text::lines::refuse_lone_returns;
use crate::text::{last_number, number};
use crate::warnings::Warnings;

/// Reads a CSV file; `-` is standard input.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
pub fn open_csv(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let source = Source::open(path, options.pipes)?;
    let name = source.name.clone();
    read_csv(&name, source.into_bytes(options.limits.file)?, options)
}

/// Reads the bytes of a CSV file; `name` is the input's name in messages.
///
/// # Errors
/// When the input is invalid; the first error is returned.
pub fn read_csv(name: &str, bytes: Vec<u8>, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let mut warnings = Warnings::new(name);
    let start = check_encoding(name, &bytes, &mut warnings)?;
    if let Some((line, column)) = last_number::cut(&bytes[start..]) {
        warnings.warn(Code::MaybeCut, || {
            let location = Location::Text { line, column };
            (Some(location), last_number::MESSAGE.to_owned())
        });
    }
    if options.map.is_none()
        && let Some(mut loaded) = dialect::text::read(name, &bytes[start..], options)?
    {
        loaded.warnings.splice(0..0, warnings.into_list());
        return Ok(loaded);
    }
    if options.source_order.is_some() {
        let message = "the columns have names, which state the order; --source-order is for files without names";
        return Err(Diagnostic::new(name, Code::Map, message));
    }
    let mut sheet = Sheet {
        name,
        bytes: &bytes[start..],
        time_power: options.time_unit.map_or(0, TimeUnit::power),
        allows_gaps: options.bridge_gaps || options.tracks.is_some(),
    };
    let mut reader = sheet.reader();
    let mut header = ByteRecord::new();
    if !sheet.next(&mut reader, &mut header)? {
        let message = "the file is empty; its first line names the columns";
        return Err(Diagnostic::new(name, Code::Empty, message));
    }
    let next = || {
        let mut row = ByteRecord::new();
        Ok(sheet.next(&mut reader, &mut row)?.then_some(row))
    };
    let capture = CaptureHeading::read(name, &header, next)?;
    let names: Vec<String> = match &capture {
        Some(capture) => capture.names.clone(),
        None => header
            .iter()
            .map(|cell| cell_text(String::from_utf8_lossy(cell).trim()).to_owned())
            .collect(),
    };
    let stated = ReadOptions {
        source_rate: (options.source_rate).or(capture.as_ref().and_then(|it| it.rate)),
        ..options.clone()
    };
    let options = &stated;
    let mut plan = TablePlan::of(name, &names, options)
        .map_err(|refusal| sheet.with_names_below(&mut reader, refusal))?;
    let mut columns = Vec::with_capacity(plan.columns.len());
    for requested in &plan.columns {
        let values = match requested.need {
            ColumnNeed::Number => ColumnValues::Numbers(ColumnNumbers::F64(Vec::new())),
            // Whole numbers, until a cell with a fraction is read.
            ColumnNeed::Whole | ColumnNeed::Time => {
                ColumnValues::Numbers(ColumnNumbers::Whole(Vec::new()))
            }
            ColumnNeed::Name => ColumnValues::Words {
                codes: Vec::new(),
                words: Vec::new(),
            },
            ColumnNeed::List => {
                let message = format!("`{}` is one number; CSV has no lists", requested.name);
                return Err(sheet.refuse(
                    sheet.cell(&header, requested.index),
                    Code::ColumnType,
                    message,
                ));
            }
        };
        columns.push(Column {
            name: requested.name.clone(),
            index: requested.index,
            values,
            null: None,
        });
    }
    let mut known: Vec<HashMap<String, u32>> = vec![HashMap::new(); columns.len()];
    let mut record = ByteRecord::new();
    // Where each row begins, and how many lines are before it.
    let mut starts = Vec::new();
    let budget = Budget::of(bytes.len(), options.limits);
    while sheet.next(&mut reader, &mut record)? {
        // Another table may follow in the same file.
        if capture.is_some() && has_no_number(&record) {
            if record.iter().any(|cell| !cell.trim_ascii().is_empty()) {
                let location = sheet.cell(&record, 0);
                warnings.warn(Code::ColumnsLeftOut, || {
                    let message = "another table begins here; only the first of the file is read";
                    (Some(location), message)
                });
                break;
            }
            continue;
        }
        sheet.check_width(&record, &names)?;
        // Memory for a number of each column and for the location of the row.
        let charged = budget.take(columns.len() + 1, size_of::<f64>());
        charged.map_err(|error| Diagnostic::new(name, Code::Memory, error.to_string()))?;
        if starts.is_empty()
            && let TimeSource::Times(time) = plan.time_source
            && let index = plan.columns[time].index
            && let text = as_text(record.get(index).unwrap_or_default().trim_ascii())
            && let Ok(first) = text.parse::<f64>()
        {
            plan.time_unit = TimeUnit::or_of_first(plan.time_unit, first, |unit| {
                let location = sheet.cell(&record, index);
                warnings.warn(Code::TimeUnit, || (Some(location), unit.assumed(text)));
            });
            sheet.time_power = plan.time_unit.map_or(0, TimeUnit::power);
        }
        let outputs = columns.iter_mut().zip(&mut known).zip(&plan.columns);
        for ((column, known), requested) in outputs {
            let cell = TextCell {
                sheet: &sheet,
                text: record.get(requested.index).unwrap_or_default().trim_ascii(),
                column: requested.index,
                record: &record,
            };
            if cell.text.is_empty() {
                column.null.get_or_insert(starts.len());
            }
            cell.read(&mut column.values, requested.need, known, &mut warnings)?;
        }
        starts.push(start_of(&record));
    }
    let table = Table {
        file: name.to_owned(),
        columns,
        rows: starts.len(),
        text: Some(Box::new(move |column, row| {
            cell_location(&bytes[start..], starts[row], column)
        })),
    };
    let mut loaded = clips(&table, &plan, options)?;
    loaded.space = loaded.space.or(capture.map(|capture| capture.space));
    let mut all = warnings.into_list();
    all.append(&mut loaded.warnings);
    loaded.warnings = all;
    Ok(loaded)
}

/// Refuses bytes that are not text, and returns the offset of the text, after a byte-order mark.
fn check_encoding(name: &str, bytes: &[u8], warnings: &mut Warnings) -> Result<usize, Diagnostic> {
    let refuse = |message: &str| Err(Diagnostic::new(name, Code::Encoding, message));
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return refuse("this is UTF-16; save it as UTF-8 or ASCII");
    }
    if bytes.contains(&0) {
        return refuse("there is a NUL byte; this is not a text file");
    }
    refuse_lone_returns(name, bytes, Some(b'"'))?;
    if bytes.starts_with(b"\xef\xbb\xbf") {
        warnings.warn(Code::ByteOrderMark, || {
            let location = Location::Text { line: 1, column: 1 };
            (Some(location), "a byte-order mark; it is ignored")
        });
        return Ok(3);
    }
    Ok(0)
}

/// The text of a table.
struct Sheet<'a> {
    name: &'a str,
    bytes: &'a [u8],
    /// The power of ten of the unit of times, in seconds.
    time_power: i32,
    /// Whether numbers that are missing or `NaN` become NaN: their keys, or their tracks, may be left out.
    allows_gaps: bool,
}

impl<'a> Sheet<'a> {
    fn reader(&self) -> Reader<&'a [u8]> {
        let mut builder = ReaderBuilder::new();
        builder
            .has_headers(false)
            .flexible(true)
            .from_reader(self.bytes)
    }

    fn refuse(&self, location: Location, code: Code, message: impl Into<String>) -> Diagnostic {
        let mut refusal = Diagnostic::new(self.name, code, message);
        refusal.location = Some(location);
        refusal
    }

    /// Reads the next row; blank lines are skipped.
    fn next(
        &self,
        reader: &mut Reader<&[u8]>,
        record: &mut ByteRecord,
    ) -> Result<bool, Diagnostic> {
        let read = reader.read_byte_record(record);
        read.map_err(|error| {
            Diagnostic::new(self.name, Code::Open, format!("cannot be read: {error}"))
        })
    }

    /// Refuses a row of another number of cells than there are names. A comma at the end of a line makes an empty
    /// cell, in rows or in the names.
    fn check_width(&self, record: &ByteRecord, names: &[String]) -> Result<(), Diagnostic> {
        let (width, found) = (names.len(), record.len());
        let is_last_empty = |cell: Option<&[u8]>| cell.is_some_and(|it| it.trim_ascii().is_empty());
        let is_whole = found == width
            || found == width + 1 && is_last_empty(record.get(width))
            || found + 1 == width && names.last().is_some_and(String::is_empty);
        if is_whole {
            return Ok(());
        }
        let location = self.cell(record, width.min(found));
        // In `0,5,1,25` the commas may be decimal (0.5 and 1.25): then the two parts of a number are in separate cells.
        let is_digits = |cell: &[u8]| cell.iter().all(|it| it.is_ascii_digit() || *it == b'-');
        let hint = match found > width && record.iter().all(is_digits) {
            true => "; if numbers have decimal commas, write them with points",
            false => "",
        };
        let message = format!(
            "{found} cells where the header has {width}; every row has as many as the header{hint}"
        );
        Err(self.refuse(location, Code::Columns, message))
    }

    /// The refusal of a first row without the names of columns; if a later row has them, as in the tables of motion
    /// capture systems, it says so.
    fn with_names_below(&self, reader: &mut Reader<&[u8]>, mut refusal: Diagnostic) -> Diagnostic {
        /// How many rows may be before the names.
        const MAX_ROWS: usize = 32;
        if refusal.code != Code::NoTimes {
            return refusal;
        }
        let mut record = ByteRecord::new();
        for _ in 0..MAX_ROWS {
            if !matches!(self.next(reader, &mut record), Ok(true)) {
                break;
            }
            let cells: Vec<Cow<'_, str>> =
                record.iter().map(|it| as_text(it.trim_ascii())).collect();
            let named = |start: &str| {
                let mut all = cells.iter();
                all.find(|cell| cell.to_lowercase().starts_with(start))
            };
            let (time, frame) = (named("time"), named("frame"));
            let has_numbers = cells.iter().any(|cell| cell.parse::<f64>().is_ok());
            if has_numbers || cells.len() < 5 || time.or(frame).is_none() {
                continue;
            }
            let location = self.cell(&record, 0);
            let mut after = ByteRecord::new();
            let has_units =
                matches!(self.next(reader, &mut after), Ok(true)) && has_no_number(&after);
            let units = if has_units {
                ", and the one of units after it,"
            } else {
                ""
            };
            let remedy = match (time, frame) {
                (Some(time), _) => format!("--map 'time={time}'"),
                (None, frame) => format!(
                    "--map 'frame_index={}' and --source-fps",
                    frame.map_or("", |it| it)
                ),
            };
            let shown: Vec<String> = cells
                .iter()
                .take(8)
                .map(|cell| format!("`{cell}`"))
                .collect();
            refusal.message = format!(
                "the names of the columns are in this line ({}, …), below others: delete the lines before it{units} \
                 and give {remedy}",
                shown.join(", ")
            );
            refusal.location = Some(location);
            break;
        }
        refusal
    }

    /// The location of a cell of a record.
    fn cell(&self, record: &ByteRecord, column: usize) -> Location {
        cell_location(self.bytes, start_of(record), column)
    }
}

/// The offset of a record, and the number of lines before it.
fn start_of(record: &ByteRecord) -> (usize, u64) {
    let position = record.position();
    position.map_or((0, 0), |at| {
        (at.byte() as usize, at.line().saturating_sub(1))
    })
}

/// The location of a cell of the record that begins at `start`; the end of the record if it has no such cell.
fn cell_location(bytes: &[u8], (start, lines): (usize, u64), column: usize) -> Location {
    let ends = |byte: &u8| matches!(byte, b'\r' | b'\n');
    let rest = bytes.get(start..).unwrap_or_default();
    // The end of the previous record; blank lines may follow.
    let mut at = start + rest.iter().take_while(|byte| ends(byte)).count();
    let (mut commas, mut quoted) = (0, false);
    while let Some(&byte) = bytes.get(at) {
        let is_blank = matches!(byte, b' ' | b'\t');
        if commas == column && !quoted && !is_blank || !quoted && ends(&byte) {
            break;
        }
        match byte {
            b'"' => quoted = !quoted,
            b',' if !quoted => commas += 1,
            _ => {}
        }
        at += 1;
    }
    let before = bytes.get(start..at).unwrap_or_default();
    let line_ends = before.iter().filter(|&&byte| byte == b'\n').count() as u64;
    let line_start = bytes[..at].iter().rposition(|&byte| byte == b'\n');
    let line = &bytes[line_start.map_or(0, |end| end + 1)..at];
    let is_character = |byte: &&u8| **byte & 0xc0 != 0x80;
    Location::Text {
        line: lines + line_ends + 1,
        column: line.iter().filter(is_character).count() as u64 + 1,
    }
}

/// The result of `String::from_utf8_lossy`, which is several times slower for valid text.
fn as_text(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => String::from_utf8_lossy(bytes),
    }
}

/// A cell of a requested column.
struct TextCell<'a> {
    sheet: &'a Sheet<'a>,
    /// The text without surrounding blanks.
    text: &'a [u8],
    column: usize,
    record: &'a ByteRecord,
}

impl TextCell<'_> {
    fn refuse(&self, code: Code, message: String) -> Diagnostic {
        let location = self.sheet.cell(self.record, self.column);
        self.sheet.refuse(location, code, message)
    }

    /// Appends the value of the cell.
    fn read(
        &self,
        values: &mut ColumnValues,
        need: ColumnNeed,
        known: &mut HashMap<String, u32>,
        warnings: &mut Warnings,
    ) -> Result<(), Diagnostic> {
        // An empty cell is stored as a placeholder. The column is refused later because of it.
        if need == ColumnNeed::Number
            && self.sheet.allows_gaps
            && (self.text.is_empty() || number::is_nan(&as_text(self.text)))
            && let ColumnValues::Numbers(ColumnNumbers::F64(numbers)) = values
        {
            numbers.push(f64::NAN);
            return Ok(());
        }
        let text = match (self.text, need) {
            (b"", ColumnNeed::Number | ColumnNeed::Whole | ColumnNeed::Time) => b"0",
            (text, _) => text,
        };
        match values {
            ColumnValues::Words { codes, words } => {
                let word = as_text(text);
                let code = known.get(&*word).copied().unwrap_or_else(|| {
                    words.push(word.to_string());
                    let code = words.len() as u32 - 1;
                    known.insert(word.into_owned(), code);
                    code
                });
                codes.push(code);
            }
            ColumnValues::Numbers(ColumnNumbers::Whole(numbers)) => {
                let plain = text
                    .iter()
                    .all(|byte| byte.is_ascii_digit() || *byte == b'-');
                let whole = std::str::from_utf8(text).ok().filter(|_| plain);
                match whole.and_then(|text| text.parse().ok()) {
                    Some(number) => numbers.push(number),
                    None if need == ColumnNeed::Time => {
                        let power = self.sheet.time_power;
                        let times = numbers.iter().map(|&number| Decimal::whole(number, power));
                        let times: Option<Vec<Decimal>> = times.collect();
                        let mut times = times.ok_or_else(|| self.out_of_range(text))?;
                        let mut decimals = power.unsigned_abs();
                        self.time(text, &mut times, &mut decimals, warnings)?;
                        *values = ColumnValues::Decimals(times, decimals);
                    }
                    None => {
                        let text = String::from_utf8_lossy(text);
                        let message = format!("`{text}` is not a whole number");
                        return Err(self.refuse(Code::Number, message));
                    }
                }
            }
            ColumnValues::Numbers(ColumnNumbers::F64(numbers)) => {
                numbers.push(self.number(text, warnings)?);
            }
            ColumnValues::Decimals(times, decimals) => {
                self.time(text, times, decimals, warnings)?;
            }
            // CSV never has columns of these types.
            ColumnValues::Numbers(ColumnNumbers::F32(_))
            | ColumnValues::Stamps(..)
            | ColumnValues::Lists { .. } => {}
        }
        Ok(())
    }

    /// Appends a time with all of its digits.
    fn time(
        &self,
        text: &[u8],
        times: &mut Vec<Decimal>,
        decimals: &mut u32,
        warnings: &mut Warnings,
    ) -> Result<(), Diagnostic> {
        self.number(text, warnings)?;
        let (token, power) = (as_text(text), self.sheet.time_power);
        let time = Decimal::parse_in(&token, power).ok_or_else(|| self.out_of_range(text))?;
        times.push(time);
        *decimals = (*decimals).max(decimal_count(&token, power));
        Ok(())
    }

    fn out_of_range(&self, text: &[u8]) -> Diagnostic {
        let text = as_text(text);
        let message = format!(
            "the time {text} is beyond 1e14 s; --time-unit ms, us or ns states another unit than seconds"
        );
        self.refuse(Code::Time, message)
    }

    fn number(&self, text: &[u8], warnings: &mut Warnings) -> Result<f64, Diagnostic> {
        let text = as_text(text);
        let number = number::parse(&text).map_err(|(code, message)| {
            let remedy = match code {
                Code::NotFinite => ", or leave it out with --bridge-gaps",
                _ => "",
            };
            self.refuse(code, message + remedy)
        })?;
        if number.vanished {
            warnings.warn(Code::Tiny, || {
                let location = self.sheet.cell(self.record, self.column);
                (
                    Some(location),
                    format!("`{text}` is too small for f32; it becomes 0"),
                )
            });
        }
        Ok(number.value)
    }
}
