//! Keys from CSV: wide as it is written here, or long, with a header.

use std::collections::HashMap;
use std::path::Path;

use ::csv::{ByteRecord, Reader, ReaderBuilder};

use crate::diagnostic::{Code, Diagnostic, Place};
use crate::format::{Loaded, ReadOptions};
use crate::source::Source;
use crate::table::clips::clips;
use crate::table::columns::{Column, Numbers, Table, Values};
use crate::table::plan::{Need, Plan};
use crate::text::number;
use crate::warnings::Warnings;

/// Reads a file; `-` is standard input.
///
/// # Errors
/// The first fault that refuses the file.
pub fn open_csv(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let source = Source::open(path, options.pipes)?;
    let name = source.name.clone();
    read_csv(&name, source.into_bytes(options.limits.file)?, options)
}

/// Reads the bytes of a file; `name` is what messages call it.
///
/// # Errors
/// The first fault that refuses the file.
pub fn read_csv(name: &str, bytes: Vec<u8>, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let mut warnings = Warnings::new(name);
    let start = check_encoding(name, &bytes, &mut warnings)?;
    let sheet = Sheet {
        name,
        bytes: &bytes[start..],
    };
    let mut reader = sheet.reader();
    let mut header = ByteRecord::new();
    if !sheet.next(&mut reader, &mut header)? {
        let message = "the file is empty; its first line names the columns";
        return Err(Diagnostic::new(name, Code::Empty, message));
    }
    let names = header
        .iter()
        .map(|cell| String::from_utf8_lossy(cell).trim().to_owned());
    let names: Vec<String> = names.collect();
    let plan = Plan::of(name, &names, options)?;
    let mut columns = Vec::with_capacity(plan.wanted.len());
    for wanted in &plan.wanted {
        let values = match wanted.need {
            Need::Number => Values::Numbers(Numbers::F64(Vec::new())),
            // Whole until a cell is not.
            Need::Whole | Need::Time => Values::Numbers(Numbers::Whole(Vec::new())),
            Need::Name => Values::Words {
                codes: Vec::new(),
                words: Vec::new(),
            },
            Need::List => {
                let message = format!("`{}` is one number; CSV has no lists", wanted.name);
                return Err(sheet.refuse(sheet.place(wanted.index, 0), Code::ColumnType, message));
            }
        };
        columns.push(Column {
            name: wanted.name.clone(),
            index: wanted.index,
            values,
            null: None,
        });
    }
    let mut known: Vec<HashMap<String, u32>> = vec![HashMap::new(); columns.len()];
    let mut record = ByteRecord::new();
    let mut rows = 0;
    while sheet.next(&mut reader, &mut record)? {
        sheet.check_width(&record, names.len())?;
        let own = columns.iter_mut().zip(&mut known).zip(&plan.wanted);
        for ((column, known), wanted) in own {
            let cell = Cell {
                sheet: &sheet,
                text: record.get(wanted.index).unwrap_or_default().trim_ascii(),
                column: wanted.index,
                row: rows,
            };
            if cell.text.is_empty() {
                column.null.get_or_insert(rows);
            }
            cell.read(&mut column.values, wanted.need, known, &mut warnings)?;
        }
        rows += 1;
    }
    let owned = name.to_owned();
    let table = Table {
        file: name.to_owned(),
        columns,
        rows,
        text: Some(Box::new(move |column, row| {
            let sheet = Sheet {
                name: &owned,
                bytes: &bytes[start..],
            };
            sheet.place(column, row)
        })),
    };
    let mut loaded = clips(&table, &plan, options)?;
    let mut all = warnings.into_list();
    all.append(&mut loaded.warnings);
    loaded.warnings = all;
    Ok(loaded)
}

/// Refuses what is no text, and gives where the text begins: behind a byte-order mark.
fn check_encoding(name: &str, bytes: &[u8], warnings: &mut Warnings) -> Result<usize, Diagnostic> {
    let refuse = |message: &str| Err(Diagnostic::new(name, Code::Encoding, message));
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return refuse("this is UTF-16; save it as UTF-8 or ASCII");
    }
    if bytes.contains(&0) {
        return refuse("there is a NUL byte; this is no text file");
    }
    if bytes.starts_with(b"\xef\xbb\xbf") {
        warnings.warn(Code::ByteOrderMark, || {
            let place = Place::Text { line: 1, column: 1 };
            (Some(place), "a byte-order mark; it is skipped")
        });
        return Ok(3);
    }
    Ok(0)
}

/// The text of a table.
struct Sheet<'a> {
    name: &'a str,
    bytes: &'a [u8],
}

impl Sheet<'_> {
    fn reader(&self) -> Reader<&[u8]> {
        let mut builder = ReaderBuilder::new();
        builder
            .has_headers(false)
            .flexible(true)
            .from_reader(self.bytes)
    }

    fn refuse(&self, place: Place, code: Code, message: impl Into<String>) -> Diagnostic {
        let mut refusal = Diagnostic::new(self.name, code, message);
        refusal.place = Some(place);
        refusal
    }

    /// Reads the next row; blank lines are none.
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

    fn check_width(&self, record: &ByteRecord, width: usize) -> Result<(), Diagnostic> {
        if record.len() == width {
            return Ok(());
        }
        let place = self.cell(record, width.min(record.len()));
        let message = format!(
            "{} cells where the header has {width}; every row has as many as the header",
            record.len()
        );
        Err(self.refuse(place, Code::Columns, message))
    }

    /// Where a cell of a row is; rows count from 0 behind the header. The text is read again: a
    /// place is asked for at most once for each kind of message.
    fn place(&self, column: usize, row: usize) -> Place {
        let mut reader = self.reader();
        let mut record = ByteRecord::new();
        for _ in 0..=row + 1 {
            let read = reader.read_byte_record(&mut record);
            if !read.unwrap_or(false) {
                break;
            }
        }
        self.cell(&record, column)
    }

    /// Where a cell of a record begins; behind its end, where it has no such cell.
    fn cell(&self, record: &ByteRecord, column: usize) -> Place {
        let start = record
            .position()
            .map_or(0, |position| position.byte() as usize);
        // The record begins where the one before ended, perhaps with blank lines.
        let ends = |byte: &u8| matches!(byte, b'\r' | b'\n');
        let rest = self.bytes.get(start..).unwrap_or_default();
        let mut at = start + rest.iter().take_while(|byte| ends(byte)).count();
        let (mut commas, mut quoted) = (0, false);
        while let Some(&byte) = self.bytes.get(at) {
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
        let before = &self.bytes[..at];
        let line_start = before
            .iter()
            .rposition(|&byte| byte == b'\n')
            .map_or(0, |end| end + 1);
        let is_character = |byte: &&u8| **byte & 0xc0 != 0x80;
        Place::Text {
            line: before.iter().filter(|&&byte| byte == b'\n').count() as u64 + 1,
            column: before[line_start..].iter().filter(is_character).count() as u64 + 1,
        }
    }
}

/// One cell of a column that is wanted.
struct Cell<'a> {
    sheet: &'a Sheet<'a>,
    /// Without the blanks around it.
    text: &'a [u8],
    column: usize,
    row: usize,
}

impl Cell<'_> {
    fn refuse(&self, code: Code, message: String) -> Diagnostic {
        let place = self.sheet.place(self.column, self.row);
        self.sheet.refuse(place, code, message)
    }

    /// Appends what the cell says.
    fn read(
        &self,
        values: &mut Values,
        need: Need,
        known: &mut HashMap<String, u32>,
        warnings: &mut Warnings,
    ) -> Result<(), Diagnostic> {
        // A cell without a value holds a place; its column is refused for it.
        let text = match (self.text, need) {
            (b"", Need::Number | Need::Whole | Need::Time) => b"0",
            (text, _) => text,
        };
        match values {
            Values::Words { codes, words } => {
                let word = String::from_utf8_lossy(text);
                let code = known.get(&*word).copied().unwrap_or_else(|| {
                    words.push(word.to_string());
                    let code = words.len() as u32 - 1;
                    known.insert(word.into_owned(), code);
                    code
                });
                codes.push(code);
            }
            Values::Numbers(Numbers::Whole(numbers)) => {
                let plain = text
                    .iter()
                    .all(|byte| byte.is_ascii_digit() || *byte == b'-');
                let whole = std::str::from_utf8(text).ok().filter(|_| plain);
                match whole.and_then(|text| text.parse().ok()) {
                    Some(number) => numbers.push(number),
                    None if need == Need::Time => {
                        let mut floats: Vec<f64> =
                            numbers.iter().map(|&number| number as f64).collect();
                        floats.push(self.number(text, warnings)?);
                        *values = Values::Numbers(Numbers::F64(floats));
                    }
                    None => {
                        let text = String::from_utf8_lossy(text);
                        let message = format!("`{text}` is not a whole number");
                        return Err(self.refuse(Code::Number, message));
                    }
                }
            }
            Values::Numbers(Numbers::F64(numbers)) => numbers.push(self.number(text, warnings)?),
            // Text has no other columns.
            Values::Numbers(Numbers::F32(_)) | Values::Stamps(..) | Values::Lists { .. } => {}
        }
        Ok(())
    }

    fn number(&self, text: &[u8], warnings: &mut Warnings) -> Result<f64, Diagnostic> {
        let text = String::from_utf8_lossy(text);
        let number = number::parse(&text).map_err(|(code, message)| self.refuse(code, message))?;
        if number.vanished {
            warnings.warn(Code::Tiny, || {
                let place = self.sheet.place(self.column, self.row);
                (
                    Some(place),
                    format!("`{text}` is too small for f32; it becomes 0"),
                )
            });
        }
        Ok(number.value)
    }
}
