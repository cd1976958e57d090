//! Writes tables as uncompressed Arrow IPC files, which can be mapped into memory.

use std::collections::HashMap;
use std::io::{self, Write};

use arrow_array::RecordBatch;
use arrow_ipc::writer::FileWriter;
use arrow_schema::{ArrowError, Schema};

use crate::table::rows::{Head, RowSink};

/// Writes an Arrow file while rows arrive.
pub(crate) struct ArrowSink<'a>(FileWriter<&'a mut dyn Write>);

impl<'a> ArrowSink<'a> {
    pub(crate) fn new(out: &'a mut dyn Write, head: Head) -> io::Result<Self> {
        let notes: HashMap<String, String> = head.notes.into_iter().collect();
        let schema = Schema::new_with_metadata(head.schema.fields().clone(), notes);
        let writer = FileWriter::try_new(out, &schema);
        Ok(Self(writer.map_err(io_error)?))
    }
}

impl RowSink for ArrowSink<'_> {
    fn write(&mut self, batch: &RecordBatch) -> io::Result<()> {
        self.0.write(batch).map_err(io_error)
    }

    /// Each batch can be read by itself.
    fn end_part(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn finish(mut self) -> io::Result<()> {
        self.0.finish().map_err(io_error)
    }
}

/// Converts an error and keeps the system's error in it, for example that of a broken pipe.
fn io_error(error: ArrowError) -> io::Error {
    match error {
        ArrowError::IoError(_, error) => error,
        other => io::Error::other(other),
    }
}
