//! Parquet: tables in columns, compressed page by page.

mod columns;
pub(crate) mod lerobot;
mod pages;
mod plain;
mod schema;
mod thrift;
mod write;

use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;

use arrow_schema::{DataType, Field, Schema};
use bytes::Bytes;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};

use crate::diagnostic::{Code, Diagnostic};
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions, WriteResults};
use crate::parquet::columns::ParquetFile;
use crate::parquet::lerobot::Info;
use crate::parquet::pages::check_pages;
use crate::parquet::schema::check_schema;
use crate::parquet::write::ParquetSink;
use crate::quaternion::ComponentOrder;
use crate::source::Source;
use crate::table::arrays::Gather;
use crate::table::clips::clips;
use crate::table::columns::{ColumnNeed, RequestedColumn, Table};
use crate::table::decoded;
use crate::table::long::{write_motion, write_poses, write_rotations};
use crate::table::plan::TablePlan;

/// The Parquet format.
pub static FORMAT: Format = Format {
    name: "parquet",
    summary: "a table in columns, a row for each key",
    extensions: &["pq"],
    probe: |start| start.starts_with(MAGIC),
    numbers_in_line: None,
    is_text: false,
    numbers_repeated_names: true,
    guesses_time_unit: true,
    read: open_parquet,
    read_bytes: read_parquet,
    write: Some(WriteResults {
        order: ComponentOrder::Xyzw,
        layout: None,
        // A lower bound. Measured: 0.9 bytes for constant rotations at the times of a rate, which compress best.
        rotation_bytes: |_| 0.25,
        rotations: |out, result| write_rotations(result, |table| ParquetSink::new(out, table)),
        poses: |poses, out| write_poses(poses, |table| ParquetSink::new(out, table)),
    }),
    write_motion: Some(|clips, options, out| {
        write_motion(clips, options.order, |table| ParquetSink::new(out, table))
            .map(|()| Vec::new())
    }),
    features: &Feature::OF_TABLES,
    options: &FormatOption::OF_TABLES,
};

const MAGIC: &[u8] = b"PAR1";

/// Length of the end of a file: the length of the metadata, and the magic number.
const TAIL: usize = 8;

/// Reads a Parquet file; `-` is standard input.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
pub fn open_parquet(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let source = Source::open(path, options.pipes)?;
    let name = source.name.clone();
    let info = Info::beside(path, options.limits);
    read(
        &name,
        source.into_bytes(options.limits.file)?,
        info.as_ref(),
        options,
    )
}

/// Reads the bytes of a Parquet file; `name` is the input's name in messages.
///
/// # Errors
/// When the input is invalid; the first error is returned.
pub fn read_parquet(
    name: &str,
    bytes: Vec<u8>,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    read(name, bytes, None, options)
}

fn read(
    name: &str,
    bytes: Vec<u8>,
    info: Option<&Info>,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    check_tail(name, &bytes)?;
    let bytes = Bytes::from(bytes);
    let (table, mut plan) = decoded(name, "a page", || read_table(name, bytes, options))?;
    if let Some(info) = info {
        info.name(&mut plan);
    }
    clips(&table, &plan, options)
}

/// Refuses bytes that do not end as Parquet files do, and schemas that cannot be decoded safely.
fn check_tail(name: &str, bytes: &[u8]) -> Result<(), Diagnostic> {
    let refuse = |message: String| Err(Diagnostic::new(name, Code::TableDamaged, message));
    if !bytes.starts_with(MAGIC) {
        return refuse("the file does not begin with PAR1; it is not Parquet".to_owned());
    }
    let Some((_, tail)) = bytes[MAGIC.len()..].split_last_chunk::<TAIL>() else {
        return refuse(format!("the file has {} bytes; it is cut", bytes.len()));
    };
    let [a, b, c, d, magic @ ..] = *tail;
    if magic != *MAGIC {
        return refuse(
            "the file does not end with PAR1; it is truncated, copy it again".to_owned(),
        );
    }
    let (length, limit) = (
        u32::from_le_bytes([a, b, c, d]),
        bytes.len() - MAGIC.len() - TAIL,
    );
    if length as usize > limit {
        return refuse(format!(
            "its metadata is said to have {length} bytes of {limit}; the file is damaged"
        ));
    }
    let end = bytes.len() - TAIL;
    check_schema(&bytes[end - length as usize..end])
        .or_else(|reason| refuse(format!("{reason}; the file is damaged, write it again")))
}

/// The error of a file that cannot be decoded.
fn damaged(name: &str, error: &dyn Display) -> Diagnostic {
    let message = format!("{error}; the file is damaged, or written in a way that is not read");
    Diagnostic::new(name, Code::TableDamaged, message)
}

fn read_table(
    name: &str,
    bytes: Bytes,
    options: &ReadOptions,
) -> Result<(Table, TablePlan), Diagnostic> {
    let damaged = |error: &dyn Display| damaged(name, error);
    // The types of Parquet itself are sufficient. The Arrow schema in the metadata is not read, because it may
    // contradict them.
    let without_arrow = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
    let loaded =
        ArrowReaderMetadata::load(&bytes, without_arrow).map_err(|error| damaged(&error))?;
    let fields = loaded.schema().fields();
    let names: Vec<String> = fields.iter().map(|field| field.name().clone()).collect();
    let mut plan = TablePlan::of(name, &names, options)?;
    let notes = loaded.metadata().file_metadata().key_value_metadata();
    let notes = notes.into_iter().flatten();
    plan.notes = notes
        .filter_map(|note| Some((note.key.clone(), note.value.clone()?)))
        .collect();
    let mut roots: Vec<usize> = plan.columns.iter().map(|column| column.index).collect();
    roots.sort_unstable();
    roots.dedup();
    check_pages(name, &bytes, loaded.metadata(), &roots, options.limits)?;

    // Texts stay in the dictionaries in which they are stored, because names repeat.
    let names = plan
        .columns
        .iter()
        .filter(|column| column.need == ColumnNeed::Name);
    let names: Vec<usize> = names.map(|column| column.index).collect();
    let with_dictionary = |(index, field): (usize, &Arc<Field>)| match field.data_type() {
        DataType::Utf8 if names.contains(&index) => {
            let words = DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8));
            Arc::new(field.as_ref().clone().with_data_type(words))
        }
        _ => Arc::clone(field),
    };
    let mut fields: Vec<Arc<Field>> = fields.iter().enumerate().map(with_dictionary).collect();
    // Only the Arrow schema distinguishes durations from other whole numbers.
    let is_time = |column: &&RequestedColumn| column.need == ColumnNeed::Time;
    if let Some(time) = plan.columns.iter().find(is_time)
        && *fields[time.index].data_type() == DataType::Int64
        && let Ok(other) =
            ArrowReaderMetadata::try_new(Arc::clone(loaded.metadata()), ArrowReaderOptions::new())
        && let Some(field) = other.schema().fields().get(time.index)
        && let DataType::Duration(_) = field.data_type()
    {
        let duration = fields[time.index].as_ref().clone();
        fields[time.index] = Arc::new(duration.with_data_type(field.data_type().clone()));
    }
    let requested = plan.columns.iter();
    let requested: Vec<(&RequestedColumn, &DataType)> = requested
        .map(|column| (column, fields[column.index].data_type()))
        .collect();
    // Types are refused before any column is decoded.
    let gather = Gather::new(name, requested.iter().copied())?;
    let with_schema = ArrowReaderOptions::new().with_schema(Arc::new(Schema::new(fields.clone())));
    let metadata = ArrowReaderMetadata::try_new(Arc::clone(loaded.metadata()), with_schema)
        .map_err(|error| damaged(&error))?;
    let file = ParquetFile {
        bytes,
        metadata,
        name,
    };
    // If columns are damaged or do not agree, they are read together: this finds the first error by row.
    let table = match file.read_apart(&requested) {
        Some(table) => table,
        None => file.read_together(&requested, gather)?,
    };
    Ok((table, plan))
}
