//! Arrow IPC, as a file (Feather 2) and as a stream.

mod messages;
mod write;

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use arrow_buffer::Buffer;
use arrow_ipc::convert::try_fb_to_schema;
use arrow_ipc::reader::{read_dictionary, read_record_batch};

use crate::arrow::messages::{MessageBody, Messages};
use crate::arrow::write::ArrowSink;
use crate::diagnostic::{Code, Diagnostic};
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions, WriteResults};
use crate::quaternion::ComponentOrder;
use crate::source::Source;
use crate::table::arrays::{Gather, chosen};
use crate::table::clips::clips;
use crate::table::columns::Table;
use crate::table::decoded;
use crate::table::long::{write_motion, write_poses, write_rotations};
use crate::table::plan::TablePlan;

/// The Arrow IPC format: files and streams.
pub static FORMAT: Format = Format {
    name: "arrow",
    summary: "an Arrow table, a row for each key",
    extensions: &["arrows", "feather", "ipc"],
    probe: |start| start.starts_with(messages::MAGIC) || messages::is_stream(start),
    numbers_in_line: None,
    is_text: false,
    numbers_repeated_names: true,
    guesses_time_unit: true,
    read: open_arrow,
    read_bytes: read_arrow,
    write: Some(WriteResults {
        order: ComponentOrder::Xyzw,
        layout: None,
        // A row also contains the frame, the time and the track.
        rotation_bytes: |encoding| encoding.bytes() as f64 + 20.0,
        rotations: |out, result| write_rotations(result, |table| ArrowSink::new(out, table)),
        poses: |poses, out| write_poses(poses, |table| ArrowSink::new(out, table)),
    }),
    write_motion: Some(|clips, options, out| {
        write_motion(clips, options.order, |table| ArrowSink::new(out, table)).map(|()| Vec::new())
    }),
    features: &Feature::OF_TABLES,
    options: &FormatOption::OF_TABLES,
};

/// Reads an Arrow IPC file or stream; `-` is standard input.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
pub fn open_arrow(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let source = Source::open(path, options.pipes)?;
    let name = source.name.clone();
    read_arrow(&name, source.into_bytes(options.limits.file)?, options)
}

/// Reads the bytes of an Arrow IPC file or stream; `name` is the input's name in messages.
///
/// # Errors
/// When the input is invalid; the first error is returned.
pub fn read_arrow(name: &str, bytes: Vec<u8>, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let (table, plan) = decoded(name, "a batch", || read_table(name, bytes, options))?;
    clips(&table, &plan, options)
}

fn read_table(
    name: &str,
    bytes: Vec<u8>,
    options: &ReadOptions,
) -> Result<(Table, TablePlan), Diagnostic> {
    let damaged = |error: &dyn std::fmt::Display| {
        let message = format!("{error}; the file is damaged, or written in a way that is not read");
        Diagnostic::new(name, Code::TableDamaged, message)
    };
    let bytes = Buffer::from_vec(bytes);
    let mut messages = Messages::of(name, &bytes, options.limits)?;
    let ipc_schema = messages.schema()?;
    let schema = try_fb_to_schema(ipc_schema).map_err(|error| damaged(&error))?;
    let names: Vec<String> = schema
        .fields()
        .iter()
        .map(|field| field.name().clone())
        .collect();
    let mut plan = TablePlan::of(name, &names, options)?;
    let notes = schema.metadata().iter();
    plan.notes = notes
        .map(|(key, value)| (key.clone(), value.clone()))
        .collect();
    let types = plan
        .columns
        .iter()
        .map(|column| (column, schema.field(column.index).data_type()));
    let mut gather = Gather::new(name, types)?;
    // Decode only the requested columns, and only their dictionaries. Their types are known to be simple.
    let mut projection: Vec<usize> = plan.columns.iter().map(|column| column.index).collect();
    projection.sort_unstable();
    projection.dedup();
    let requested_dictionaries: Vec<i64> = ipc_schema
        .fields()
        .into_iter()
        .flat_map(|fields| projection.iter().map(move |&index| fields.get(index)))
        .filter_map(|field| Some(field.dictionary()?.id()))
        .collect();
    let indices = plan.columns.iter();
    let indices: Vec<usize> = indices
        .map(|column| projection.partition_point(|&index| index < column.index))
        .collect();
    let schema = Arc::new(schema);
    let mut dictionaries = HashMap::new();
    while let Some(message) = messages.next()? {
        let version = message.version;
        match message.body {
            MessageBody::Dictionary(batch) if requested_dictionaries.contains(&batch.id()) => {
                read_dictionary(&message.data, batch, &schema, &mut dictionaries, &version)
                    .map_err(|error| damaged(&error))?;
            }
            MessageBody::Dictionary(_) => {}
            MessageBody::Rows(batch) => {
                let batch = read_record_batch(
                    &message.data,
                    batch,
                    Arc::clone(&schema),
                    &dictionaries,
                    Some(&projection),
                    &version,
                )
                .map_err(|error| damaged(&error))?;
                let columns =
                    chosen(&batch, &indices).ok_or_else(|| damaged(&"a column is not there"))?;
                gather.push(&columns, batch.num_rows())?;
            }
        }
    }
    Ok((gather.finish()?, plan))
}
