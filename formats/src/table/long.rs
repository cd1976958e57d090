//! Writes results as a long table: a row for each rotation, with `frame`, `time`, `track` and its numbers.

use std::collections::HashMap;
use std::io;
use std::sync::Arc;

use arrow_array::{ArrayRef, StringArray};
use glam::{DVec3, Quat, Vec3};
use tumble::{Channel, Encoding, Layout, Timeline};

use crate::format::{ResultShape, ResultWriter, WriteError};
use crate::motion::keyed::{at, track_times};
use crate::motion::poses::{Poses, TRANSFORM, WORLD};
use crate::motion::signs::continue_signs;
use crate::motion::{Motion, SampledClip};
use crate::names::distinct_names;
use crate::quaternion::ComponentOrder;
use crate::table::rows::{Batch, ComponentColumn, Head, RowSink, TimeColumn, invalid, names};
use crate::table::{scalars, skeleton};

/// Begins the table of a result's rotations.
pub(crate) fn write_rotations<'a, S: RowSink + 'a>(
    result: &ResultShape<'a>,
    begin: impl FnOnce(Head) -> io::Result<S>,
) -> io::Result<Box<dyn ResultWriter + 'a>> {
    let is_quaternion = result.encoding.is_quaternion();
    let mut components = result.encoding.components().to_vec();
    let is_w_first = is_quaternion && result.order == Some(ComponentOrder::Wxyz);
    if is_w_first {
        components.rotate_right(1);
    }
    let columns = components
        .into_iter()
        .map(|name| (name.to_owned(), ComponentColumn::of(result.encoding)));
    let batch = Batch::new(
        columns,
        TimeColumn::of([result.time_offset]),
        names(result.set),
        None,
    )?;
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
        time_offset: result.time_offset,
        layout: result.layout,
        encoding: result.encoding,
        is_w_first,
        tracks: result.set.track_count(),
        written: 0,
    }))
}

/// Writes rotations while they arrive.
struct Rotations<'a, S> {
    sink: S,
    batch: Batch,
    timeline: &'a Timeline,
    time_offset: i64,
    layout: Layout,
    encoding: Encoding,
    /// Whether w is the first component of quaternions.
    is_w_first: bool,
    tracks: usize,
    written: usize,
}

impl<S: RowSink> Rotations<'_, S> {
    fn all(&self) -> usize {
        self.tracks.saturating_mul(self.timeline.len())
    }
}

impl<S: RowSink> ResultWriter for Rotations<'_, S> {
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
            let time = self.timeline.time(track, frame).unwrap_or(f64::NAN);
            self.batch.row(frame, self.time_offset, time, track);
            let mut numbers = q.to_array();
            if self.is_w_first {
                numbers.rotate_right(1);
            }
            let stored = self.encoding.encode(&[numbers], &mut encoded);
            stored.map_err(io::Error::other)?;
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
                "{missing} rotations of the result were not written"
            )));
        }
        self.batch.flush(&mut self.sink)?;
        self.sink.finish()
    }
}

/// Writes poses with f32 numbers; positions with an origin are f64.
pub(crate) fn write_poses<S: RowSink>(
    poses: &Poses<'_>,
    begin: impl FnOnce(Head) -> io::Result<S>,
) -> io::Result<()> {
    poses.check()?;
    let components = poses.components.iter();
    let columns = components.enumerate().map(|(index, name)| {
        let is_wide = index < 3 && poses.has_origins();
        ((*name).to_owned(), ComponentColumn::of_positions(is_wide))
    });
    let mut batch = Batch::new(
        columns,
        TimeColumn::of([poses.time_offset]),
        names(poses.set),
        None,
    )?;
    let mut sink = begin(Head {
        schema: Arc::clone(&batch.schema),
        notes: Vec::new(),
    })?;
    let tracks = poses.set.track_count().max(1);
    for (index, pose) in poses
        .numbers
        .chunks(poses.components.len().max(1))
        .enumerate()
    {
        let (frame, track) = (index / tracks, index % tracks);
        let time = poses.timeline.time(track, frame).unwrap_or(f64::NAN);
        batch.row(frame, poses.time_offset, time, track);
        let origin = poses.origin(track);
        for (i, (column, &number)) in batch.numbers.iter_mut().zip(pose).enumerate() {
            let moved = if i < 3 { origin[i] } else { 0.0 };
            column.push_number(f64::from(number) + moved);
        }
        if batch.is_full() {
            batch.flush(&mut sink)?;
        }
    }
    batch.flush(&mut sink)?;
    sink.finish()
}

/// Writes sampled clips, one after another. Several clips, or one with a name, have it in the column `clip`.
///
/// # Errors
/// When writing fails, or when the lengths of a clip's lists do not fit.
pub(crate) fn write_motion<S: RowSink>(
    clips: &[SampledClip<'_>],
    order: Option<ComponentOrder>,
    begin: impl FnOnce(Head) -> io::Result<S>,
) -> Result<(), WriteError> {
    let has = |part: fn(&SampledClip<'_>) -> bool| clips.iter().any(part);
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
    let is_w_first = order == Some(ComponentOrder::Wxyz);
    let mut components: Vec<&str> = match is_w_first {
        true => vec!["w", "x", "y", "z"],
        false => vec!["x", "y", "z", "w"],
    };
    components.extend(translation.iter().filter(|_| moved));
    components.extend(TRANSFORM[7..].iter().filter(|_| scaled));
    let trackless = |clip: &SampledClip<'_>| clip.clip.set.track_count() == 0;
    if clips.iter().all(trackless) {
        components.clear();
    } else if clips.iter().any(trackless) {
        let message =
            "one clip has only scalars, others have tracks; write each to a separate file";
        return Err(invalid(message).into());
    }
    let scalars = scalar_columns(clips);
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
    let has_origins = clips.iter().any(SampledClip::has_origins);
    let columns = components.iter().map(|&name| {
        let is_wide = has_origins && translation.contains(&name);
        (name.to_owned(), ComponentColumn::of_positions(is_wide))
    });
    let columns = columns.chain(
        scalars
            .iter()
            .map(|(name, is_wide)| (name.clone(), ComponentColumn::of_positions(*is_wide))),
    );
    let mut batch = Batch::new(
        columns,
        TimeColumn::of(clips.iter().map(|clip| clip.clip.time_offset)),
        track_names,
        named.then_some((0, clip_names)),
    )?;
    let mut sink = begin(Head {
        schema: Arc::clone(&batch.schema),
        notes: notes(clips),
    })?;
    for (index, (sampled, codes)) in clips.iter().zip(&codes).enumerate() {
        if let Some((clip, _)) = &mut batch.clip {
            *clip = index as i32;
        }
        write_clip(
            sampled,
            codes,
            ClipColumns {
                is_w_first,
                has_translations: moved,
                has_scales: scaled,
                scalars: scalars_of(sampled, &scalars),
            },
            &mut batch,
            &mut sink,
        )?;
        batch.flush(&mut sink)?;
        sink.end_part()?;
    }
    Ok(sink.finish()?)
}

/// The names of the tracks of all clips, each once, and the index of the name of each track.
fn track_names(clips: &[SampledClip<'_>]) -> (ArrayRef, Vec<Vec<usize>>) {
    let mut code_of = HashMap::new();
    let mut all = Vec::new();
    let mut codes = Vec::new();
    for sampled in clips {
        let clip_codes = distinct_names(&sampled.clip.set).into_iter().map(|name| {
            *code_of.entry(name.clone()).or_insert_with(|| {
                all.push(name);
                all.len() - 1
            })
        });
        codes.push(clip_codes.collect());
    }
    (Arc::new(StringArray::from_iter_values(all)), codes)
}

/// The notes on the clips; those of several clips are separate if they differ.
fn notes(clips: &[SampledClip<'_>]) -> Vec<(String, String)> {
    let mut notes: Vec<(String, String)> = Vec::new();
    for (index, sampled) in clips.iter().enumerate() {
        let rate = sampled.rate.map(|rate| ("rate", rate.to_string()));
        let skeleton = skeleton::note_of(sampled);
        let clip_notes = sampled
            .notes
            .iter()
            .map(|(key, value)| (*key, value.clone()))
            .chain(rate)
            .chain(skeleton)
            .chain(scalars::note_of(sampled.clip));
        for (key, value) in clip_notes {
            match notes.iter().find(|(known, _)| known == key) {
                None => notes.push((key.to_owned(), value)),
                Some((_, known)) if *known == value => {}
                Some(_) => notes.push((format!("{key}.{index}"), value)),
            }
        }
    }
    notes
}

/// The columns of the scalars of all clips, each once, and whether one of them has an origin.
fn scalar_columns(clips: &[SampledClip<'_>]) -> Vec<(String, bool)> {
    let mut all: Vec<(String, bool)> = Vec::new();
    for sampled in clips {
        for (index, keys) in sampled.clip.scalar_keys().enumerate() {
            let scalar = sampled.clip.scalar(index);
            let (name, is_wide) = (scalar.kind.column(keys.name), scalar.origin != 0.0);
            match all.iter_mut().find(|(known, _)| *known == name) {
                Some((_, known)) => *known |= is_wide,
                None => all.push((name, is_wide)),
            }
        }
    }
    all
}

/// For each column of scalars, the index of the clip's scalar; `None` if the clip has no scalar of this name and kind.
fn scalars_of(sampled: &SampledClip<'_>, columns: &[(String, bool)]) -> Vec<Option<usize>> {
    let named = sampled.clip.scalar_keys().enumerate();
    let named = named.map(|(index, keys)| sampled.clip.scalar(index).kind.column(keys.name));
    let named: Vec<String> = named.collect();
    let column = |(name, _): &(String, bool)| named.iter().position(|known| known == name);
    columns.iter().map(column).collect()
}

/// The columns that a table of clips has.
struct ClipColumns {
    is_w_first: bool,
    has_translations: bool,
    has_scales: bool,
    /// The clip's scalar of each column of scalars.
    scalars: Vec<Option<usize>>,
}

/// The numbers of one row.
struct RowNumbers {
    rotation: Quat,
    translation: DVec3,
    scale: Vec3,
    /// NaN if the clip has none.
    scalars: Vec<f64>,
}

impl ClipColumns {
    /// Appends the numbers of a row, and, in the columns after them, the scalars of a sample.
    fn push(&self, row: &RowNumbers, batch: &mut Batch) {
        let mut numbers = row.rotation.to_array().map(f64::from).to_vec();
        if self.is_w_first {
            numbers.rotate_right(1);
        }
        if self.has_translations {
            numbers.extend(row.translation.to_array());
        }
        if self.has_scales {
            numbers.extend(row.scale.to_array().map(f64::from));
        }
        numbers.extend(&row.scalars);
        for (column, number) in batch.numbers.iter_mut().zip(numbers) {
            column.push_number(number);
        }
    }
}

/// Writes the samples of a clip, or its keys if it has them at separate times for each track.
fn write_clip(
    sampled: &SampledClip<'_>,
    codes: &[usize],
    columns: ClipColumns,
    batch: &mut Batch,
    sink: &mut impl RowSink,
) -> io::Result<()> {
    let clip = sampled.clip;
    let tracks = clip.set.track_count();
    let lists = (0..tracks).map(|track| track_times(clip, track));
    if sampled.is_at_keys
        && let Some(lists) = lists.collect::<Option<Vec<&[f64]>>>()
    {
        for (track, times) in lists.into_iter().enumerate() {
            write_track(clip, track, times, codes[track], &columns, batch, sink)?;
        }
        return Ok(());
    }
    sampled.checked_len()?;
    let scalars = |frame: usize| -> Vec<f64> {
        let value = |index: usize| sampled.scalar_value(frame, index);
        columns
            .scalars
            .iter()
            .map(|scalar| scalar.map_or(f64::NAN, value))
            .collect()
    };
    if tracks == 0 {
        for (frame, &time) in sampled.times.iter().enumerate() {
            batch.row(frame, clip.time_offset, time, 0);
            let numbers = batch.numbers.iter_mut().zip(scalars(frame));
            numbers.for_each(|(column, number)| column.push_number(number));
            if batch.is_full() {
                batch.flush(sink)?;
            }
        }
        return Ok(());
    }
    let mut of_frame = (usize::MAX, Vec::new());
    for (index, &rotation) in sampled.rotations.iter().enumerate() {
        let (frame, track) = (index / tracks, index % tracks);
        if of_frame.0 != frame {
            of_frame = (frame, scalars(frame));
        }
        batch.row(frame, clip.time_offset, sampled.times[frame], codes[track]);
        let relative = sampled.translations.get(index).copied().unwrap_or_default();
        let row = RowNumbers {
            rotation,
            translation: clip.origin(track) + relative.as_dvec3(),
            scale: sampled.scales.get(index).copied().unwrap_or(Vec3::ONE),
            scalars: of_frame.1,
        };
        columns.push(&row, batch);
        of_frame.1 = row.scalars;
        if batch.is_full() {
            batch.flush(sink)?;
        }
    }
    Ok(())
}

/// Writes the keys of one track, all of whose channels have these times.
fn write_track(
    clip: &Motion,
    track: usize,
    times: &[f64],
    code: usize,
    columns: &ClipColumns,
    batch: &mut Batch,
    sink: &mut impl RowSink,
) -> io::Result<()> {
    let mut rotations = clip.set.track(track).keys.to_vec();
    continue_signs(&mut rotations, 1);
    let vector = |channel, key: usize| {
        let keys = clip.set.vector_keys(channel, track);
        keys.and_then(|keys| at(keys.keys, key))
            .unwrap_or_else(|| clip.rest(channel, track))
    };
    for (key, &time) in times.iter().enumerate() {
        batch.row(key, clip.time_offset, time, code);
        let row = RowNumbers {
            rotation: at(&rotations, key).unwrap_or(Quat::IDENTITY),
            translation: clip.origin(track) + vector(Channel::Translation, key).as_dvec3(),
            scale: vector(Channel::Scale, key),
            // No clip with scalars is written here: such clips are written as samples. Scalars of other clips are
            // missing in this one.
            scalars: vec![f64::NAN; columns.scalars.len()],
        };
        columns.push(&row, batch);
        if batch.is_full() {
            batch.flush(sink)?;
        }
    }
    Ok(())
}
