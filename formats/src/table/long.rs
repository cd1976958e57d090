//! Results as a long table: a row for each rotation, `frame`, `time`, `track`, then its numbers.
//!
//! Rows are handed on in batches of [`BATCH`], so that a result of any length takes the memory of
//! one batch; a file depends on no window in which the result came.

use std::io;
use std::sync::Arc;

use arrow_array::types::Int32Type;
use arrow_array::{
    ArrayRef, DictionaryArray, Float16Array, Float32Array, Float64Array, Int16Array, Int32Array,
    Int64Array, RecordBatch, StringArray,
};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use glam::Quat;
use half::f16;
use tumble::{Encoding, Layout, Timeline, TrackSet};

use crate::format::{ResultShape, ResultWriter, WriteError};
use crate::motion::Sampled;
use crate::names::distinct_names;
use crate::npy::ComponentOrder;
use crate::poses::{Poses, TRANSFORM, WORLD};

/// Rows of a batch: 2 MB of rotations.
const BATCH: usize = 1 << 16;

/// What a table is to be, for a format that begins to write it.
pub(crate) struct Head {
    pub(crate) schema: SchemaRef,
    /// What made it: `("method", "slerp")`.
    pub(crate) notes: Vec<(String, String)>,
}

/// A format that takes the rows of a table.
pub(crate) trait Sink {
    fn write(&mut self, batch: &RecordBatch) -> io::Result<()>;

    /// Ends a part of the table that may be read by itself.
    fn end_part(&mut self) -> io::Result<()>;

    fn finish(self) -> io::Result<()>;
}

/// The columns of the batch that is being filled.
struct Batch {
    schema: SchemaRef,
    frames: Vec<i64>,
    times: Vec<f64>,
    tracks: Vec<i32>,
    numbers: Vec<Component>,
    /// The names of the tracks and of the clip, the same for every batch.
    track_names: ArrayRef,
    clip: Option<(i32, ArrayRef)>,
}

/// The numbers of one component of all rows.
enum Component {
    F32(Vec<f32>),
    F16(Vec<f16>),
    I16(Vec<i16>),
}

impl Component {
    fn of(encoding: Encoding) -> Self {
        match encoding {
            Encoding::F16 => Self::F16(Vec::new()),
            Encoding::Snorm16 => Self::I16(Vec::new()),
            _ => Self::F32(Vec::new()),
        }
    }

    fn data_type(&self) -> DataType {
        match self {
            Self::F32(_) => DataType::Float32,
            Self::F16(_) => DataType::Float16,
            Self::I16(_) => DataType::Int16,
        }
    }

    /// Takes a number of an encoding, in the machine's byte order.
    fn push(&mut self, bytes: &[u8]) {
        match self {
            Self::F32(list) => list.push(bytemuck::pod_read_unaligned(bytes)),
            Self::F16(list) => list.push(f16::from_bits(bytemuck::pod_read_unaligned(bytes))),
            Self::I16(list) => list.push(bytemuck::pod_read_unaligned(bytes)),
        }
    }

    fn take(&mut self) -> ArrayRef {
        match self {
            Self::F32(list) => Arc::new(Float32Array::from(std::mem::take(list))),
            Self::F16(list) => Arc::new(Float16Array::from(std::mem::take(list))),
            Self::I16(list) => Arc::new(Int16Array::from(std::mem::take(list))),
        }
    }
}

fn invalid(message: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, message.into())
}

/// A dictionary column's type.
fn names_type() -> DataType {
    DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8))
}

fn names(set: &TrackSet) -> ArrayRef {
    Arc::new(StringArray::from_iter_values(distinct_names(set)))
}

fn dictionary(codes: Vec<i32>, names: &ArrayRef) -> io::Result<ArrayRef> {
    let codes = Int32Array::from(codes);
    let array = DictionaryArray::<Int32Type>::try_new(codes, Arc::clone(names));
    Ok(Arc::new(array.map_err(io::Error::other)?))
}

impl Batch {
    /// For a table whose numbers are called so.
    fn new(
        components: impl IntoIterator<Item = (String, Component)>,
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
            Field::new("time", DataType::Float64, false),
            Field::new("track", names_type(), false),
        ];
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
            times: Vec::new(),
            tracks: Vec::new(),
            numbers,
            track_names,
            clip,
        })
    }

    fn row(&mut self, frame: usize, time: f64, track: usize) {
        self.frames.push(frame as i64);
        self.times.push(time);
        self.tracks.push(track as i32);
    }

    fn is_full(&self) -> bool {
        self.frames.len() >= BATCH
    }

    /// Hands on the rows that there are.
    fn flush(&mut self, sink: &mut impl Sink) -> io::Result<()> {
        if self.frames.is_empty() {
            return Ok(());
        }
        let rows = self.frames.len();
        let mut columns: Vec<ArrayRef> = vec![
            Arc::new(Int64Array::from(std::mem::take(&mut self.frames))),
            Arc::new(Float64Array::from(std::mem::take(&mut self.times))),
            dictionary(std::mem::take(&mut self.tracks), &self.track_names)?,
        ];
        if let Some((clip, names)) = &self.clip {
            columns.push(dictionary(vec![*clip; rows], names)?);
        }
        columns.extend(self.numbers.iter_mut().map(Component::take));
        let batch = RecordBatch::try_new(Arc::clone(&self.schema), columns);
        sink.write(&batch.map_err(io::Error::other)?)
    }
}

/// Begins a table of a result's rotations.
pub(crate) fn write_rotations<'a, S: Sink + 'a>(
    result: &ResultShape<'a>,
    begin: impl FnOnce(Head) -> io::Result<S>,
) -> io::Result<Box<dyn ResultWriter + 'a>> {
    let is_quaternion = matches!(
        result.encoding,
        Encoding::F32 | Encoding::F16 | Encoding::Snorm16
    );
    let mut components = result.encoding.components();
    let turned = is_quaternion && result.order == ComponentOrder::Wxyz;
    if turned {
        components.rotate_right(1);
    }
    let columns = components
        .into_iter()
        .map(|name| (name, Component::of(result.encoding)));
    let batch = Batch::new(columns, names(result.set), None)?;
    let notes = result
        .notes
        .iter()
        .map(|(key, value)| ((*key).to_owned(), value.clone()));
    let sink = begin(Head {
        schema: Arc::clone(&batch.schema),
        notes: notes.collect(),
    })?;
    Ok(Box::new(Rotations {
        sink,
        batch,
        timeline: result.timeline,
        layout: result.layout,
        encoding: result.encoding,
        turned,
        tracks: result.set.track_count(),
        written: 0,
    }))
}

/// Writes rotations as they come.
struct Rotations<'a, S> {
    sink: S,
    batch: Batch,
    timeline: &'a Timeline,
    layout: Layout,
    encoding: Encoding,
    /// Quaternions are to have w first.
    turned: bool,
    tracks: usize,
    written: usize,
}

impl<S: Sink> Rotations<'_, S> {
    fn all(&self) -> usize {
        self.tracks.saturating_mul(self.timeline.len())
    }
}

impl<S: Sink> ResultWriter for Rotations<'_, S> {
    fn write(&mut self, rotations: &[Quat]) -> io::Result<()> {
        if rotations.len() > self.all() - self.written {
            return Err(invalid("more rotations than the shape has"));
        }
        let bytes = self.encoding.bytes() / self.batch.numbers.len().max(1);
        let mut encoded = vec![0; self.encoding.bytes()];
        for q in rotations {
            let (track, frame) = match self.layout {
                Layout::TrackMajor => (
                    self.written / self.timeline.len(),
                    self.written % self.timeline.len(),
                ),
                Layout::FrameMajor => (self.written % self.tracks, self.written / self.tracks),
            };
            self.batch
                .row(frame, self.timeline.time(track, frame), track);
            let mut numbers = q.to_array();
            if self.turned {
                numbers.rotate_right(1);
            }
            self.encoding.encode(&[numbers], &mut encoded);
            for (list, number) in self.batch.numbers.iter_mut().zip(encoded.chunks(bytes)) {
                list.push(number);
            }
            self.written += 1;
            if self.batch.is_full() {
                self.batch.flush(&mut self.sink)?;
            }
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        let missing = self.all() - self.written;
        if missing > 0 {
            return Err(invalid(format!(
                "{missing} rotations of the shape are missing"
            )));
        }
        self.batch.flush(&mut self.sink)?;
        self.sink.finish()
    }
}

/// Writes poses, whose numbers are f32.
pub(crate) fn write_poses<S: Sink>(
    poses: &Poses<'_>,
    begin: impl FnOnce(Head) -> io::Result<S>,
) -> io::Result<()> {
    poses.check()?;
    let components = poses.components.iter();
    let columns = components.map(|name| ((*name).to_owned(), Component::F32(Vec::new())));
    let mut batch = Batch::new(columns, names(poses.set), None)?;
    let mut sink = begin(Head {
        schema: Arc::clone(&batch.schema),
        notes: Vec::new(),
    })?;
    let tracks = poses.set.track_count().max(1);
    for (place, pose) in poses
        .numbers
        .chunks(poses.components.len().max(1))
        .enumerate()
    {
        let (frame, track) = (place / tracks, place % tracks);
        batch.row(frame, poses.timeline.time(track, frame), track);
        push_all(&mut batch.numbers, pose);
        if batch.is_full() {
            batch.flush(&mut sink)?;
        }
    }
    batch.flush(&mut sink)?;
    sink.finish()
}

fn push_all(components: &mut [Component], numbers: &[f32]) {
    for (component, number) in components.iter_mut().zip(numbers) {
        component.push(bytemuck::bytes_of(number));
    }
}

/// Writes sampled clips, one after another. Several clips, and one that has a name, have it in the
/// column `clip`.
///
/// # Errors
/// When writing fails, or a clip's lists are not of one length.
pub(crate) fn write_motion<S: Sink>(
    clips: &[Sampled<'_>],
    begin: impl FnOnce(Head) -> io::Result<S>,
) -> Result<(), WriteError> {
    let has = |part: fn(&Sampled<'_>) -> bool| clips.iter().any(part);
    let (moved, scaled) = (
        has(|clip| !clip.translations.is_empty()),
        has(|clip| !clip.scales.is_empty()),
    );
    let is_world = has(|clip| clip.clip.is_world);
    let translation = if is_world {
        &WORLD[..3]
    } else {
        &TRANSFORM[..3]
    };
    let mut components: Vec<&str> = vec!["x", "y", "z", "w"];
    components.extend(translation.iter().filter(|_| moved));
    components.extend(TRANSFORM[7..].iter().filter(|_| scaled));
    let named = clips.len() > 1 || clips.iter().any(|clip| clip.clip.name.is_some());
    let clip_names = clips
        .iter()
        .enumerate()
        .map(|(i, clip)| match &clip.clip.name {
            Some(name) => name.clone(),
            None => format!("clip{i}"),
        });
    let clip_names: ArrayRef = Arc::new(StringArray::from_iter_values(clip_names));
    let (track_names, codes) = track_names(clips);
    let columns = components.iter();
    let columns = columns.map(|name| ((*name).to_owned(), Component::F32(Vec::new())));
    let mut batch = Batch::new(columns, track_names, named.then_some((0, clip_names)))?;
    let mut sink = begin(Head {
        schema: Arc::clone(&batch.schema),
        notes: notes(clips),
    })?;
    for (place, (sampled, codes)) in clips.iter().zip(&codes).enumerate() {
        if let Some((clip, _)) = &mut batch.clip {
            *clip = place as i32;
        }
        write_clip(sampled, codes, (moved, scaled), &mut batch, &mut sink)?;
        batch.flush(&mut sink)?;
        sink.end_part()?;
    }
    Ok(sink.finish()?)
}

/// The names of the tracks of all clips, each once, and which each track has.
fn track_names(clips: &[Sampled<'_>]) -> (ArrayRef, Vec<Vec<usize>>) {
    let mut place = std::collections::HashMap::new();
    let mut all = Vec::new();
    let mut codes = Vec::new();
    for sampled in clips {
        let own = distinct_names(&sampled.clip.set).into_iter().map(|name| {
            *place.entry(name.clone()).or_insert_with(|| {
                all.push(name);
                all.len() - 1
            })
        });
        codes.push(own.collect());
    }
    (Arc::new(StringArray::from_iter_values(all)), codes)
}

/// What is said of the clips; of each apart where there are several that differ.
fn notes(clips: &[Sampled<'_>]) -> Vec<(String, String)> {
    let mut notes: Vec<(String, String)> = Vec::new();
    for (place, sampled) in clips.iter().enumerate() {
        let rate = sampled.rate.map(|rate| ("rate", rate.to_string()));
        let own = sampled
            .notes
            .iter()
            .map(|(key, value)| (*key, value.clone()))
            .chain(rate);
        for (key, value) in own {
            match notes.iter().find(|(known, _)| known == key) {
                None => notes.push((key.to_owned(), value)),
                Some((_, known)) if *known == value => {}
                Some(_) => notes.push((format!("{key}.{place}"), value)),
            }
        }
    }
    notes
}

fn write_clip(
    sampled: &Sampled<'_>,
    codes: &[usize],
    (moved, scaled): (bool, bool),
    batch: &mut Batch,
    sink: &mut impl Sink,
) -> io::Result<()> {
    let tracks = sampled.clip.set.track_count();
    let all = sampled.times.len().saturating_mul(tracks);
    let fits = |length: usize| length == all || length == 0;
    if sampled.rotations.len() != all
        || !fits(sampled.translations.len())
        || !fits(sampled.scales.len())
    {
        return Err(invalid(
            "a clip's samples are not as many as its times and tracks",
        ));
    }
    for (place, q) in sampled.rotations.iter().enumerate() {
        let (frame, track) = (place / tracks, place % tracks);
        let time = sampled.times[frame] + sampled.clip.time_offset as f64;
        batch.row(frame, time, codes[track]);
        let mut numbers = q.to_array().to_vec();
        if moved {
            let translation = sampled.translations.get(place);
            numbers.extend(translation.copied().unwrap_or_default().to_array());
        }
        if scaled {
            let scale = sampled.scales.get(place);
            numbers.extend(scale.copied().unwrap_or(glam::Vec3::ONE).to_array());
        }
        push_all(&mut batch.numbers, &numbers);
        if batch.is_full() {
            batch.flush(sink)?;
        }
    }
    Ok(())
}
