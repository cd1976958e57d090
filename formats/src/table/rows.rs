//! Collects rows of a long table in batches, for formats that need batches.
//!
//! A result of any length takes the memory of one batch, and the file does not depend on the windows of the result.

use std::io;
use std::sync::Arc;

use arrow_array::types::Int32Type;
use arrow_array::{
    ArrayRef, DictionaryArray, Float16Array, Float32Array, Float64Array, Int16Array, Int32Array,
    Int64Array, RecordBatch, StringArray, TimestampNanosecondArray,
};
use arrow_schema::{DataType, Field, Schema, SchemaRef, TimeUnit};
use half::f16;
use tumble::{ComponentType, Encoding, TrackSet};

use crate::decimal::is_clock;
use crate::names::distinct_names;

/// Number of rows of a batch: 2 MB of rotations.
const BATCH: usize = 1 << 16;

/// The description of a table for a format that begins to write it.
pub(crate) struct Head {
    pub(crate) schema: SchemaRef,
    /// How the table was made: `("method", "slerp")`.
    pub(crate) notes: Vec<(String, String)>,
}

/// A format that writes the rows of a table.
pub(crate) trait RowSink {
    fn write(&mut self, batch: &RecordBatch) -> io::Result<()>;

    /// Ends a part of the table that can be read by itself.
    fn end_part(&mut self) -> io::Result<()>;

    fn finish(self) -> io::Result<()>;
}

/// The columns of the batch that is being filled.
pub(crate) struct Batch {
    pub(crate) schema: SchemaRef,
    frames: Vec<i64>,
    times: TimeColumn,
    tracks: Vec<i32>,
    pub(crate) numbers: Vec<ComponentColumn>,
    /// The names of all tracks, the same for every batch.
    track_names: ArrayRef,
    /// The clip of the following rows, and the names of all clips.
    pub(crate) clip: Option<(i32, ArrayRef)>,
}

/// The times of all rows.
pub(crate) enum TimeColumn {
    /// Seconds.
    Seconds(Vec<f64>),
    /// Nanoseconds since 1970, for clips that count from a whole second: f64 would round them to 0.24 µs.
    Stamps(Vec<i64>),
}

impl TimeColumn {
    /// For clips that count from these whole seconds.
    pub(crate) fn of(offsets: impl IntoIterator<Item = i64>) -> Self {
        /// 285 years in seconds: an i64 of nanoseconds overflows after 292 years.
        const MAX_OFFSET: u64 = 9_000_000_000;
        let mut counts = false;
        for offset in offsets {
            if offset.unsigned_abs() > MAX_OFFSET {
                return Self::Seconds(Vec::new());
            }
            counts |= is_clock(offset);
        }
        match counts {
            true => Self::Stamps(Vec::new()),
            false => Self::Seconds(Vec::new()),
        }
    }

    fn data_type(&self) -> DataType {
        match self {
            Self::Seconds(_) => DataType::Float64,
            Self::Stamps(_) => DataType::Timestamp(TimeUnit::Nanosecond, None),
        }
    }

    /// Appends seconds after a whole second.
    fn push(&mut self, whole: i64, time: f64) {
        match self {
            Self::Seconds(list) => list.push(whole as f64 + time),
            Self::Stamps(list) => {
                let whole = whole.saturating_mul(1_000_000_000);
                list.push(whole.saturating_add((time * 1e9).round() as i64));
            }
        }
    }

    fn take(&mut self) -> ArrayRef {
        match self {
            Self::Seconds(list) => Arc::new(Float64Array::from(std::mem::take(list))),
            Self::Stamps(list) => Arc::new(TimestampNanosecondArray::from(std::mem::take(list))),
        }
    }
}

/// The numbers of one component of all rows.
pub(crate) enum ComponentColumn {
    F64(Vec<f64>),
    F32(Vec<f32>),
    F16(Vec<f16>),
    I16(Vec<i16>),
}

impl ComponentColumn {
    pub(crate) fn of(encoding: Encoding) -> Self {
        match encoding.component_type() {
            ComponentType::F16 => Self::F16(Vec::new()),
            ComponentType::Snorm16 => Self::I16(Vec::new()),
            ComponentType::F32 => Self::F32(Vec::new()),
        }
    }

    pub(crate) fn data_type(&self) -> DataType {
        match self {
            Self::F64(_) => DataType::Float64,
            Self::F32(_) => DataType::Float32,
            Self::F16(_) => DataType::Float16,
            Self::I16(_) => DataType::Int16,
        }
    }

    /// For coordinates: f64 if some have an origin.
    pub(crate) fn of_positions(has_origins: bool) -> Self {
        match has_origins {
            true => Self::F64(Vec::new()),
            false => Self::F32(Vec::new()),
        }
    }

    /// Appends a number, which is an f32 unless the column is f64.
    pub(crate) fn push_number(&mut self, number: f64) {
        match self {
            Self::F64(list) => list.push(number),
            other => other.push(bytemuck::bytes_of(&(number as f32))),
        }
    }

    /// Appends a number of an encoding, in the machine's byte order.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        match self {
            Self::F64(list) => list.push(bytemuck::pod_read_unaligned(bytes)),
            Self::F32(list) => list.push(bytemuck::pod_read_unaligned(bytes)),
            Self::F16(list) => list.push(f16::from_bits(bytemuck::pod_read_unaligned(bytes))),
            Self::I16(list) => list.push(bytemuck::pod_read_unaligned(bytes)),
        }
    }

    fn take(&mut self) -> ArrayRef {
        match self {
            Self::F64(list) => Arc::new(Float64Array::from(std::mem::take(list))),
            Self::F32(list) => Arc::new(Float32Array::from(std::mem::take(list))),
            Self::F16(list) => Arc::new(Float16Array::from(std::mem::take(list))),
            Self::I16(list) => Arc::new(Int16Array::from(std::mem::take(list))),
        }
    }
}

pub(crate) fn invalid(message: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, message.into())
}

/// The type of a dictionary column.
fn names_type() -> DataType {
    DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8))
}

pub(crate) fn names(set: &TrackSet) -> ArrayRef {
    Arc::new(StringArray::from_iter_values(distinct_names(set)))
}

fn dictionary(codes: Vec<i32>, names: &ArrayRef) -> io::Result<ArrayRef> {
    let codes = Int32Array::from(codes);
    let array = DictionaryArray::<Int32Type>::try_new(codes, Arc::clone(names));
    Ok(Arc::new(array.map_err(io::Error::other)?))
}

impl Batch {
    /// For a table with components of these names.
    pub(crate) fn new(
        components: impl IntoIterator<Item = (String, ComponentColumn)>,
        times: TimeColumn,
        track_names: ArrayRef,
        clip: Option<(i32, ArrayRef)>,
    ) -> io::Result<Self> {
        if i32::try_from(track_names.len()).is_err() {
            return Err(invalid(format!(
                "{} tracks are more than 2^31",
                track_names.len()
            )));
        }
        let mut fields = vec![
            Field::new("frame", DataType::Int64, false),
            Field::new("time", times.data_type(), false),
        ];
        // A table of scalars alone has no tracks.
        if !track_names.is_empty() {
            fields.push(Field::new("track", names_type(), false));
        }
        if clip.is_some() {
            fields.push(Field::new("clip", names_type(), false));
        }
        let mut numbers = Vec::new();
        for (name, component) in components {
            fields.push(Field::new(name, component.data_type(), false));
            numbers.push(component);
        }
        Ok(Self {
            schema: Arc::new(Schema::new(fields)),
            frames: Vec::new(),
            times,
            tracks: Vec::new(),
            numbers,
            track_names,
            clip,
        })
    }

    /// Begins a row; its time is in seconds after a whole second.
    pub(crate) fn row(&mut self, frame: usize, whole_seconds: i64, time: f64, track: usize) {
        self.frames.push(frame as i64);
        self.times.push(whole_seconds, time);
        self.tracks.push(track as i32);
    }

    pub(crate) fn is_full(&self) -> bool {
        self.frames.len() >= BATCH
    }

    /// Passes the collected rows to `sink`.
    pub(crate) fn flush(&mut self, sink: &mut impl RowSink) -> io::Result<()> {
        if self.frames.is_empty() {
            return Ok(());
        }
        let rows = self.frames.len();
        let mut columns: Vec<ArrayRef> = vec![
            Arc::new(Int64Array::from(std::mem::take(&mut self.frames))),
            self.times.take(),
        ];
        let tracks = std::mem::take(&mut self.tracks);
        if !self.track_names.is_empty() {
            columns.push(dictionary(tracks, &self.track_names)?);
        }
        if let Some((clip, names)) = &self.clip {
            columns.push(dictionary(vec![*clip; rows], names)?);
        }
        columns.extend(self.numbers.iter_mut().map(ComponentColumn::take));
        let batch = RecordBatch::try_new(Arc::clone(&self.schema), columns);
        sink.write(&batch.map_err(io::Error::other)?)
    }
}
