//! `tumble.save`: clips into files, as `tumble eval` and `tumble convert` write them.

use std::collections::HashSet;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::{
    Encoding, Engine, Error, FrameRate, Interpolation, Layout, PerTrack, Quantity, SampleTimes,
    Stop,
};
use tumble_formats::diagnostic::Code;
use tumble_formats::end_frame::{
    EndFrame, EndFrameError, EndRows, FramesToEnd, RateFrames, SampledKind, SampledResult,
    sample_to_end,
};
use tumble_formats::format::{
    Document, Format, FormatOption, MotionOptions, Quantization, ResultShape, WriteError,
    WriteResults, left_behind,
};
use tumble_formats::keyed::{KeysError, keys_for};
use tumble_formats::kitti::write_frame_times;
use tumble_formats::motion::{Motion, SampledClip};
use tumble_formats::output::Output;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::sample::Samples;
use tumble_formats::{Diagnostic, Feature};

use crate::arrays::{ListArgument, Order};
use crate::clip::{Clip, Source};
use crate::engine::{default_engine, layout_named};
use crate::errors::{expected, input, of_engine, of_output, of_write, warn};
use crate::file::{File, format_named};
use crate::names::option_named;
use crate::options::{EvaluationKeywords, SampleChoice};
use crate::run::interruptible;

/// The number of rotations that are evaluated at once.
const CHUNK: usize = 1 << 20;

/// Writes clips to a file, atomically; the format is that of the file's ending.
///
/// `clips`: a `Clip`, the `File` of `load`, or a list of clips. With `fps` or `at`, clips are sampled as by
/// `Engine.evaluate`, with its options; without, the keys are written at their times.
///
/// A clip of a glTF or NPZ file that is saved in the same format is baked: everything else in the file is kept. An
/// `InputWarning` names what the clip's file contains and the new file does not, such as meshes and morph weights. NPY,
/// and CSV, Parquet and Arrow for clips without a skeleton, store only rotations, in the `order` ("xyzw" or "wxyz"; the
/// default of CSV is "wxyz") and `layout` of these options. The bytes are those that the program `tumble` writes.
///
/// * `overwrite`: replace an existing file; `False` raises an `OutputError` instead. (The program replaces files only
///   with `--overwrite`.)
/// * `sequence`: the axes of BVH's angles, such as "ZXY".
/// * `linear`: names of arrays in an NPZ file, with a number for each frame, to be interpolated linearly instead of
///   left out.
/// * `times_out`: for KITTI, which stores no times, a file for the times of the poses, one time in seconds per line.
/// * `end_frame`: the sample after the last frame of `fps` if a clip ends between two frames: "key", a sample at the
///   end; "hold", one more frame with the value of the end; "leave-out", nothing. By default formats with times get a
///   key and others a held frame; NPY gets nothing.
/// * `quantize`: store glTF rotations with 16 bits per component, within 6e-5 rad.
/// * `meshopt`: compress a new glTF file by `EXT_meshopt_compression`.
/// * `engine`: the engine that evaluates; by default one that all calls share.
///
/// `write` is the same function.
///
/// >>> import numpy as np, tempfile, os, tumble
/// >>> clip = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
/// >>> path = os.path.join(tempfile.mkdtemp(), "door.npy")
/// >>> tumble.save(path, clip, fps=30)
/// >>> np.load(path).shape
/// (1, 31, 4)
#[pyfunction]
#[pyo3(signature = (
    path, clips, /, *, format=None, sequence=None, linear=None, order=None, layout="track",
    end_frame=None, times_out=None, quantize=false, meshopt=false, overwrite=true, engine=None, **options
), text_signature = "(file, clips, /, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, format=None, sequence=None, linear=(), order=None, layout='track', end_frame=None, times_out=None, quantize=False, meshopt=False, overwrite=True, engine=None)")]
#[allow(clippy::too_many_arguments, reason = "keywords")]
pub(crate) fn save(
    py: Python<'_>,
    path: PathBuf,
    clips: &Bound<'_, PyAny>,
    format: Option<&str>,
    sequence: Option<&str>,
    linear: Option<ListArgument<String>>,
    order: Option<&str>,
    layout: &str,
    end_frame: Option<&str>,
    times_out: Option<PathBuf>,
    quantize: bool,
    meshopt: bool,
    overwrite: bool,
    engine: Option<&Bound<'_, crate::engine::Engine>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<()> {
    let request = EvaluationKeywords::new(options)?;
    let clips = clips_of(clips)?;
    let ending = path.extension().and_then(|ending| ending.to_str());
    let Some(name) = format.or(ending) else {
        return Err(input(
            "the name has no extension that determines the format; name one with `format`",
        ));
    };
    let sequence = sequence
        .map(str::parse)
        .transpose()
        .map_err(|error| input(format!("sequence: {error}")))?;
    let order = order.map(Order::named).transpose()?;
    let order = order.map(|order| match order {
        Order::Xyzw => ComponentOrder::Xyzw,
        Order::Wxyz => ComponentOrder::Wxyz,
    });
    let format = format_named(name)?;
    if times_out.is_some() && !format.takes(FormatOption::TimesApart) {
        return Err(input(format!(
            "times_out is for {}, whose times are in a separate file, and has no effect on {}; leave it out",
            Format::names_taking(FormatOption::TimesApart),
            format.name
        )));
    }
    if (quantize || meshopt) && !format.takes(FormatOption::Quantize) {
        let option = if quantize { "quantize" } else { "meshopt" };
        return Err(input(format!(
            "{option} is for glTF and has no effect on {}; leave it out",
            format.name
        )));
    }
    let job = Save {
        format,
        motion: MotionOptions {
            name: path.display().to_string(),
            format: name.to_lowercase(),
            sequence,
            linear: linear.map_or_else(Vec::new, |linear| linear.0),
            order,
            box_length: clips.first().and_then(Clip::box_length),
            times_apart: times_out.is_some(),
            quantize: quantize.then_some(match meshopt {
                true => Quantization::Filtered(32767),
                false => Quantization::Components,
            }),
            meshopt,
        },
        layout: layout_named(layout)?,
        end_frame: end_frame
            .map(|name| option_named(name, "end_frame"))
            .transpose()?,
        engine: match engine {
            Some(engine) => engine.clone().unbind(),
            None => default_engine(py)?.clone().unbind(),
        },
        request,
        clips,
        path,
    };
    let warnings = interruptible(py, move || {
        let sources = job.clips.iter();
        let sources = sources.filter_map(|clip| Some(clip.source.as_ref()?.path.clone()));
        let inputs: Vec<PathBuf> = sources.collect();
        let create = || Output::create(&job.path, overwrite, &inputs);
        let out = create().map_err(|error| of_output(&error))?;
        let times = times_out.map(|path| {
            let mut others = inputs.clone();
            others.push(job.path.clone());
            Output::create(&path, overwrite, &others).map_err(|error| of_output(&error))
        });
        let times = times.transpose()?;
        let stop = Stop::of_this_work();
        let mut out = Stoppable { out, stop };
        let mut of_times = Vec::new();
        let warnings = job.write(&mut out, &mut of_times)?;
        if out.stop.is_stopped() {
            return Err(of_engine(&Error::Stopped(tumble::StoppedError)));
        }
        out.out.commit().map_err(|error| of_output(&error))?;
        if let Some(mut times) = times {
            let written = times.write_all(&of_times);
            written.map_err(|error| of_write(&error.into()))?;
            times.commit().map_err(|error| of_output(&error))?;
        }
        Ok(warnings)
    })?;
    warn(py, &warnings)
}

/// A clip, the clips of a file, or a list of them.
pub(crate) fn clips_of(value: &Bound<'_, PyAny>) -> PyResult<Vec<Clip>> {
    if let Ok(clip) = value.cast::<Clip>() {
        return Ok(vec![clip.get().clone()]);
    }
    if let Ok(file) = value.cast::<File>() {
        return file.as_any().getattr("clips")?.extract();
    }
    let clips: ListArgument<Clip> = value.extract().map_err(|error| {
        expected(value.py(), error, || {
            let kind = value.get_type();
            format!("clips: a {kind}; give a Clip, a File or a list of clips")
        })
    })?;
    match clips.0.is_empty() {
        true => Err(input("clips: there is none to write")),
        false => Ok(clips.0),
    }
}

/// The clips to write, with the format, its options, and the times at which they are evaluated.
struct Save {
    format: &'static Format,
    motion: MotionOptions,
    layout: Layout,
    end_frame: Option<EndFrame>,
    engine: Py<crate::engine::Engine>,
    request: EvaluationKeywords,
    clips: Vec<Clip>,
    path: PathBuf,
}

/// The requested samples of a clip.
fn requested(
    clip: &Motion,
    request: &EvaluationKeywords,
    end_frame: EndFrame,
) -> PyResult<FramesToEnd> {
    let frames = request.frames(clip, None)?;
    let found = match *request.samples()? {
        SampleChoice::Rate(rate, _, end) => {
            let end = end.map(|end| clip.time_in_set(end));
            let end = request.outside().end(end, clip);
            FramesToEnd::new(clip, RateFrames { frames, rate, end }, end_frame)
        }
        _ => FramesToEnd::at(clip, frames),
    };
    found.map_err(|error| of_engine(&error))
}

fn of_end_frame(error: EndFrameError) -> PyErr {
    let remedy = match error {
        EndFrameError::NoFileOfTimes { .. } => {
            "give times_out, or end_frame=\"hold\" or \"leave-out\""
        }
        _ => "give end_frame=\"hold\" or \"leave-out\"",
    };
    input(format!("{error}; {remedy}"))
}

/// A writer that fails as soon as the work is stopped (Ctrl-C), so that writing ends.
struct Stoppable<W> {
    out: W,
    stop: Stop,
}

impl<W: Write> Write for Stoppable<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.stop.is_stopped() {
            true => Err(io::Error::other("interrupted")),
            false => self.out.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

impl Save {
    /// `times` gets the times of the samples, for formats that need them in a separate file.
    fn write(&self, out: &mut dyn Write, times: &mut Vec<u8>) -> PyResult<Vec<Diagnostic>> {
        let Some(samples) = &self.request.samples else {
            return match self.end_frame {
                Some(_) => Err(input(
                    "`end_frame` needs `fps`; without it, keys stay as they are",
                )),
                None => self.keys(out, times),
            };
        };
        if self.end_frame.is_some() && !matches!(samples, SampleChoice::Rate(..)) {
            return Err(input("`end_frame` needs `fps`; `at` lists all times"));
        }
        let motions: Vec<&Motion> = self.clips.iter().map(|clip| &*clip.motion).collect();
        if let Some(document) = self.document() {
            let SampleChoice::Rate(rate, None, None) = *samples else {
                return Err(input(
                    "in a copy of the file, animations keep their lengths; leave out `at`, `start` and \
                     `end`, or write another format",
                ));
            };
            return self.baked(&motions, &*document, rate, out);
        }
        if self.format.takes_motion(&motions) {
            return self.sampled(&motions, out, times);
        }
        let written = match (&*motions, &self.format.write) {
            ([motion], Some(write)) => self.rotations(motion, write, out),
            (_, None) => Err(input(format!(
                "{} is read, and not written",
                self.format.name
            ))),
            _ => Err(input(format!(
                "{} holds the rotations of one clip; there are {}",
                self.format.name,
                motions.len()
            ))),
        };
        written.map(|mut warnings| {
            warnings.extend(self.lost());
            warnings
        })
    }

    /// The warning that a format of rotations does not store the skeleton.
    fn lost(&self) -> Option<Diagnostic> {
        let hangs = |clip: &Clip| {
            let rest = |joint: &tumble_formats::motion::Joint| {
                joint.parent.is_some() || joint.rest.translation != glam::Vec3::ZERO
            };
            clip.motion.skeleton.iter().any(rest)
        };
        self.clips.iter().any(hangs).then(|| {
            let message = format!(
                "{} cannot store this, left out: the skeleton",
                self.format.name.to_uppercase()
            );
            Diagnostic::new(self.path.display().to_string(), Code::NoRoom, message)
        })
    }

    /// The file that all clips come from, if it can be written again.
    fn document(&self) -> Option<Arc<dyn Document>> {
        let document = |clip: &Clip| {
            let source = clip
                .source
                .as_ref()
                .filter(|source| source.adjustment.is_none())?;
            source.document.clone()
        };
        let first = document(self.clips.first()?)?;
        let mut clips = HashSet::new();
        let is_one = self.clips.iter().all(|clip| {
            let is_same = document(clip).is_some_and(|other| Arc::ptr_eq(&other, &first));
            is_same && clips.insert(clip.motion.index)
        });
        (is_one && first.writes(self.format)).then_some(first)
    }

    /// Warnings about contents of the clips' files that a file made of the clips does not have.
    fn left_behind(&self) -> Vec<Diagnostic> {
        let mut sources: Vec<(&Arc<dyn Document>, &Source)> = Vec::new();
        for source in self.clips.iter().filter_map(|clip| clip.source.as_ref()) {
            let document = source.document.as_ref();
            let is_new =
                |new: &&Arc<dyn Document>| !sources.iter().any(|(it, _)| Arc::ptr_eq(it, new));
            if let Some(document) = document.filter(is_new) {
                sources.push((document, source));
            }
        }
        let is_one = sources.len() == 1;
        let lost = sources.into_iter().filter_map(|(document, source)| {
            let why = match (source.adjustment, is_one) {
                (Some(adjustment), _) => adjustment.makes_new(),
                (None, true) => "some of its clips make",
                (None, false) => "clips of several files make",
            };
            let lost = left_behind(&**document, &source.warnings, self.format, Some(why))?;
            Some(Diagnostic::new(
                source.path.display().to_string(),
                Code::NoRoom,
                lost,
            ))
        });
        lost.collect()
    }

    /// Writes the keys at their times, without sampling.
    fn keys(&self, out: &mut dyn Write, times: &mut Vec<u8>) -> PyResult<Vec<Diagnostic>> {
        if !self.format.writes_clips() {
            return Err(input(format!(
                "{} holds samples, not keys; give `fps` or `at`",
                self.format.name
            )));
        }
        let sources = || self.clips.iter().filter_map(|clip| clip.source.as_ref());
        let is_changed = sources().any(|source| source.is_changed);
        // All clips of a file, unchanged: the whole file is copied.
        let is_whole = sources()
            .next()
            .is_some_and(|source| source.clips == self.clips.len());
        let document = self.document().filter(|_| is_whole || is_changed);
        if let Some(document) = document.as_ref().filter(|_| !is_changed) {
            let written = document.write(&[], &self.motion, &self.path, out);
            return written.map_err(|error| of_write(&error));
        }
        let keys = self.clips.iter().map(|clip| {
            let keys = keys_for(&clip.motion, self.format, document.is_some());
            keys.map_err(|error| match error {
                KeysError::Evaluating(error) => of_engine(&error),
                error => input(error.to_string()),
            })
        });
        let keys: Vec<(Samples, bool)> = keys.collect::<PyResult<_>>()?;
        // Formats of frames need a rate; others have the times.
        let has_times = self.format.supports(Feature::UnevenTimes);
        let rate = |clip: &Motion| match has_times {
            true => clip.rate,
            false => clip.rate.or_else(|| clip.rate_of_keys()),
        };
        let sampled =
            (self.clips.iter().zip(&keys)).map(|(clip, (keys, is_at_keys))| SampledClip {
                is_at_keys: *is_at_keys,
                ..keys.of(&clip.motion, rate(&clip.motion), &[])
            });
        let written = match document {
            Some(document) => {
                let indices = self.clips.iter().map(|clip| clip.motion.index);
                let clips: Vec<(usize, SampledClip<'_>)> = indices.zip(sampled).collect();
                document.write(&clips, &self.motion, &self.path, out)
            }
            None => {
                let sampled: Vec<SampledClip<'_>> = sampled.collect();
                self.write_clips(&sampled, out, times)
            }
        };
        written.map_err(|error| of_write(&error))
    }

    fn write_clips(
        &self,
        sampled: &[SampledClip<'_>],
        out: &mut dyn Write,
        times: &mut Vec<u8>,
    ) -> Result<Vec<Diagnostic>, WriteError> {
        let mut warnings = self.format.write_clips(sampled, &self.motion, out)?;
        warnings.extend(self.left_behind());
        if let ([sampled], true) = (sampled, self.motion.times_apart) {
            write_frame_times(sampled, times)?;
        }
        Ok(warnings)
    }

    /// Writes the clips' file again with other keys.
    fn baked(
        &self,
        clips: &[&Motion],
        document: &dyn Document,
        rate: FrameRate,
        out: &mut dyn Write,
    ) -> PyResult<Vec<Diagnostic>> {
        let end_frame = EndFrame::for_document(self.end_frame, document).map_err(of_end_frame)?;
        let frames = |clip: &&Motion| {
            let frames = document.frames(clip.index, rate);
            let frames = frames.map_err(|error| of_write(&error.into()))?;
            FramesToEnd::new(clip, frames, end_frame).map_err(|error| of_engine(&error))
        };
        let frames: Vec<FramesToEnd> = clips.iter().map(frames).collect::<PyResult<_>>()?;
        let held = self.held(&frames);
        let mut warnings = self.written(clips, &frames, |sampled| {
            let indices = clips.iter().map(|clip| clip.index);
            let clips: Vec<(usize, SampledClip<'_>)> =
                indices.zip(sampled.iter().cloned()).collect();
            document.write(&clips, &self.motion, &self.path, out)
        })?;
        warnings.extend(held);
        Ok(warnings)
    }

    /// The rule for the frame at the end of a clip, in a new file.
    fn end_frame_of(&self, kind: SampledKind) -> PyResult<EndFrame> {
        let result = SampledResult {
            format: self.format,
            times_apart: self.motion.times_apart,
            kind,
        };
        EndFrame::for_result(self.end_frame, result).map_err(of_end_frame)
    }

    /// The warning that a frame was added after the end of a clip, unless it was asked for.
    fn held(&self, frames: &[FramesToEnd]) -> Option<Diagnostic> {
        frames.iter().find_map(|frames| {
            let (end, rate) = frames.end.zip(frames.rate)?;
            let warning = end.warning(rate, frames.time_offset, &self.path.display().to_string());
            warning.filter(|_| self.end_frame.is_none())
        })
    }

    /// Writes clips to a new file.
    fn sampled(
        &self,
        clips: &[&Motion],
        out: &mut dyn Write,
        times: &mut Vec<u8>,
    ) -> PyResult<Vec<Diagnostic>> {
        let end_frame = self.end_frame_of(SampledKind::Clips)?;
        let frames = clips.iter();
        let frames = frames.map(|clip| requested(clip, &self.request, end_frame));
        let frames: Vec<FramesToEnd> = frames.collect::<PyResult<_>>()?;
        let held = self.held(&frames);
        let mut warnings = self.written(clips, &frames, |sampled| {
            self.write_clips(sampled, out, times)
        })?;
        warnings.extend(held);
        Ok(warnings)
    }

    fn written(
        &self,
        clips: &[&Motion],
        frames: &[FramesToEnd],
        write: impl FnOnce(&[SampledClip<'_>]) -> Result<Vec<Diagnostic>, WriteError>,
    ) -> PyResult<Vec<Diagnostic>> {
        let mut all = Vec::new();
        for (clip, frames) in clips.iter().zip(frames) {
            let engine = self
                .engine
                .get()
                .engine_for(clip.set.track_count() * frames.timeline.len())?;
            let methods = self.request.methods(Quantity::Rotation);
            let samples = sample_to_end(&methods, &engine, clip, &frames.frames, frames.end);
            all.push(samples.map_err(|error| of_engine(&error))?);
        }
        let notes = self.notes();
        let sampled: Vec<SampledClip<'_>> = (clips.iter().zip(&all).zip(frames))
            .map(|((clip, samples), frames)| samples.of(clip, frames.rate, &notes))
            .collect();
        write(&sampled).map_err(|error| of_write(&error))
    }

    fn notes(&self) -> Vec<(&'static str, String)> {
        let mut notes = vec![("method", self.request.method.name().to_owned())];
        if let Some(source) = self.clips.first().and_then(|clip| clip.source.as_ref()) {
            notes.push(("input", source.path.display().to_string()));
        }
        notes
    }

    /// Writes the rotations of one clip.
    fn rotations(
        &self,
        clip: &Motion,
        format: &WriteResults,
        out: &mut dyn Write,
    ) -> PyResult<Vec<Diagnostic>> {
        let end_frame = self.end_frame_of(SampledKind::Rotations)?;
        let all = requested(clip, &self.request, end_frame)?;
        let (frames, count) = (&all.frames, all.timeline.len());
        let timeline = match all.end {
            Some(_) => {
                let whole = FramesToEnd::at(clip, SampleTimes::at(all.times()));
                whole.map_err(|error| of_engine(&error))?.timeline
            }
            None => all.timeline.clone(),
        };
        let mut notes = vec![("method", self.request.method.name().to_owned())];
        notes.extend(all.rate.map(|rate| ("rate", rate.to_string())));
        let layout = format.layout.unwrap_or(self.layout);
        let shape = ResultShape {
            name: &self.motion.name,
            set: &clip.set,
            timeline: &timeline,
            time_offset: clip.time_offset,
            layout,
            order: self.motion.order,
            encoding: Encoding::F32,
            notes: &notes,
        };
        let of_io = |error: std::io::Error| of_write(&error.into());
        let mut writer = format.begin(out, &shape).map_err(of_io)?;
        let engine = self
            .engine
            .get()
            .engine_for(clip.set.track_count() * count)?;
        let methods = self.request.methods(Quantity::Rotation);
        let rows = |at: &SampleTimes| {
            let found = methods.rotations(&engine, clip, at, layout);
            found.map_err(|error| of_engine(&error))
        };
        let ends = all.end.map(|end| rows(&SampleTimes::at(vec![end.at])));
        let mut ends = EndRows::new(ends.transpose()?.unwrap_or_default(), layout, count);
        let mut write = |rows: &[glam::Quat]| writer.write(&ends.next(rows)).map_err(of_io);
        let interpolations = methods.interpolations(clip);
        stream(&engine, clip, interpolations, frames, layout, &mut write)?;
        writer.finish().map_err(of_io)?;
        Ok(Vec::new())
    }
}

/// Evaluates a clip in chunks into a writer.
fn stream(
    engine: &Engine,
    clip: &Motion,
    interpolations: PerTrack<Interpolation>,
    frames: &SampleTimes,
    layout: Layout,
    mut sink: impl FnMut(&[glam::Quat]) -> PyResult<()>,
) -> PyResult<()> {
    /// The error that ends a stream early.
    enum Ended {
        Evaluating(Error),
        Sink(PyErr),
    }
    impl From<Error> for Ended {
        fn from(error: Error) -> Self {
            Self::Evaluating(error)
        }
    }
    let row = match layout {
        Layout::TrackMajor => 1,
        Layout::FrameMajor => clip.set.track_count(),
    };
    let sink =
        |chunk: tumble::Chunk<'_>| sink(chunk.rotations().unwrap_or_default()).map_err(Ended::Sink);
    let streamed = engine
        .request(&clip.set, interpolations, frames)
        .layout(layout)
        .stream(CHUNK.max(row), sink);
    streamed.map_err(|ended| match ended {
        Ended::Evaluating(error) => of_engine(&error),
        Ended::Sink(error) => error,
    })
}
