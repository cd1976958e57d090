//! Writes tables as Parquet, compressed by zstd, with a group of rows for each part of a table.

use std::io::{self, Write};

use arrow_array::RecordBatch;
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::schema::types::ColumnPath;

use crate::table::rows::{Head, RowSink};

/// Number of rows of a group, which is compressed in memory before it is written: up to 30 MB of rotations.
const GROUP: usize = 1 << 20;

/// Writes Parquet while rows arrive.
pub(crate) struct ParquetSink<'a> {
    out: &'a mut dyn Write,
    /// Writes to memory, which is emptied after each group, because the crate needs a writer that can be sent to
    /// another thread.
    writer: ArrowWriter<Vec<u8>>,
}

impl<'a> ParquetSink<'a> {
    pub(crate) fn new(out: &'a mut dyn Write, head: Head) -> io::Result<Self> {
        let notes = head
            .notes
            .into_iter()
            .map(|(key, value)| KeyValue::new(key, value));
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_max_row_group_row_count(Some(GROUP))
            .set_key_value_metadata(Some(notes.collect()))
            .set_statistics_enabled(EnabledStatistics::Chunk)
            // Numbers of rotations hardly repeat, so a dictionary would not help. Names repeat.
            .set_dictionary_enabled(false)
            .set_column_dictionary_enabled(ColumnPath::from("track"), true)
            .set_column_dictionary_enabled(ColumnPath::from("clip"), true);
        let writer = ArrowWriter::try_new(Vec::new(), head.schema, Some(properties.build()));
        Ok(Self {
            out,
            writer: writer.map_err(io_error)?,
        })
    }

    /// Writes the bytes that are ready.
    fn drain(&mut self) -> io::Result<()> {
        self.writer.sync()?;
        let buffer = self.writer.inner_mut();
        self.out.write_all(buffer)?;
        buffer.clear();
        Ok(())
    }
}

impl RowSink for ParquetSink<'_> {
    fn write(&mut self, batch: &RecordBatch) -> io::Result<()> {
        self.writer.write(batch).map_err(io_error)?;
        self.drain()
    }

    fn end_part(&mut self) -> io::Result<()> {
        self.writer.flush().map_err(io_error)?;
        self.drain()
    }

    fn finish(mut self) -> io::Result<()> {
        self.writer.finish().map_err(io_error)?;
        self.drain()?;
        self.out.flush()
    }
}

fn io_error(error: ParquetError) -> io::Error {
    io::Error::other(error)
}
