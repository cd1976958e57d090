//! Results larger than memory: a chunk at a time, evaluated while the one before it
//! is used.

use std::ops::Range;
use std::sync::mpsc::sync_channel;
use std::thread;

use glam::{Quat, Vec4};

use crate::clip::Clip;
use crate::curve::options::Quantity;
use crate::engine::Engine;
use crate::error::Error;
use crate::evaluate::pieces::{Pieces, segment_bytes};
use crate::method::interpolation::Interpolation;
use crate::output::buffer::OutputBuffer;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::batch::Batch;
use crate::prepare::clip_data::{ClipData, Wanted};
use crate::prepare::request::Request;
use crate::threads::{self, OutOfThreads};
use crate::time::frames::Frames;
use crate::tracks::set::TrackSet;

/// A contiguous part of a result. Chunks come in the order of the whole result in memory, without
/// gaps.
#[derive(Debug)]
#[non_exhaustive]
pub struct Chunk<'a> {
    /// Where it starts in the whole result, in rotations.
    pub start: usize,
    /// Its tracks.
    pub tracks: Range<usize>,
    /// Its samples.
    pub samples: Range<usize>,
    /// The values of these tracks and samples, `[track][sample]` or `[sample][track]` as the layout
    /// says: `x y z w` of rotations, `x y z 0` of velocities and accelerations. They are aligned to
    /// 16 bytes.
    pub rows: &'a [[f32; 4]],
    quantity: Quantity,
}

impl<'a> Chunk<'a> {
    fn new(window: Window, quats: &'a [Quat], quantity: Quantity) -> Self {
        Self {
            start: window.start,
            tracks: window.tracks,
            samples: window.samples,
            rows: bytemuck::cast_slice(quats),
            quantity,
        }
    }

    /// The rotations; `None` if these are velocities or accelerations.
    #[must_use]
    pub fn rotations(&self) -> Option<&'a [Quat]> {
        let quats = bytemuck::try_cast_slice(self.rows).ok();
        quats.filter(|_| self.quantity == Quantity::Rotation)
    }

    /// The velocities or accelerations, each followed by 0; `None` if these are rotations.
    #[must_use]
    pub fn rates(&self) -> Option<&'a [Vec4]> {
        let vectors = bytemuck::try_cast_slice(self.rows).ok();
        vectors.filter(|_| self.quantity != Quantity::Rotation)
    }
}

/// Segments that are prepared before the first chunk, where the engine's options have no limit; more are prepared
/// piece by piece.
const SEGMENT_BYTES: usize = 256 << 20;

/// Buffers that are used in turn: one is filled, one is read, one waits.
const BUFFERS: usize = 3;

impl Clip {
    /// Evaluates in chunks of about `chunk` rotations (at least one row of the layout
    /// is best); `sink` uses one while others are evaluated. The rotations are those
    /// of [`Clip::evaluate_as`]; memory is that of three chunks.
    ///
    /// ```
    /// # use glam::{Quat, Vec4};
    /// # use tumble::{Device, Engine, Error, Frames, Layout, TrackSet, method};
    /// # let mut set = TrackSet::new();
    /// # set.push("", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_x(1.0)]).unwrap();
    /// # let clip = Engine::new(Device::Cpu)?.upload(&set, method::SLERP)?;
    /// let mut largest: f32 = 0.0;
    /// clip.stream(&Frames::fps(60), Layout::FrameMajor, 1 << 20, |chunk| {
    ///     largest = chunk.rows.iter().map(|[x, ..]| *x).fold(largest, f32::max);
    ///     Ok::<(), Error>(())
    /// })?;
    /// # assert_eq!(largest, (0.5f32).sin());
    /// # Ok::<(), Error>(())
    /// ```
    ///
    /// # Errors
    /// The first error of `sink`; or when the frames do not fit the clip, or the
    /// device fails.
    pub fn stream<E: From<Error>>(
        &self,
        frames: &Frames,
        layout: Layout,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let timeline = self.timeline(frames).map_err(Error::from)?;
        let whole = Window::whole(self.track_count(), timeline.len(), layout);
        let timeline = self.uploaded.folded(&timeline).map_err(Error::from)?;
        let fill = |window: &Window, output: &mut [Quat]| {
            let bytes = bytemuck::cast_slice_mut(output);
            Ok((self.uploaded).evaluate_into(&timeline, window, Encoding::F32, bytes)?)
        };
        run(whole.cut(chunk), self.quantity(), fill, sink)
    }
}

impl Engine {
    /// As [`Clip::stream`], from a set: with [`Layout::TrackMajor`] only the tracks of
    /// a chunk are prepared at a time. Frame by frame, and where a chunk is less than a track, all are
    /// prepared at once if that takes no more than
    /// [`EngineOptions::memory`](crate::gpu::options::EngineOptions::memory), or 256 MiB where that has no limit;
    /// else those that a chunk needs are.
    ///
    /// # Errors
    /// As [`Clip::stream`] and [`Engine::upload`].
    pub fn stream<E: From<Error>>(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &Frames,
        layout: Layout,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let interpolation = interpolation.into();
        let timeline = frames
            .resolve(set.track_count(), set.time_span())
            .map_err(Error::from)?;
        if layout == Layout::FrameMajor || timeline.len() > chunk {
            // A chunk has some samples of many tracks, or some of one track: every chunk needs
            // segments that others need too, so all are prepared at once, unless that takes too much.
            let limit = self.backend.budget().unwrap_or(SEGMENT_BYTES);
            if segment_bytes(set, &interpolation) > limit {
                ClipData::unprepared(set, interpolation).map_err(Error::from)?;
                let pieces = Pieces {
                    backend: &self.backend,
                    set,
                    interpolation: &interpolation,
                    timeline: &timeline,
                    encoding: Encoding::F32,
                    limit,
                };
                let whole = Window::whole(set.track_count(), timeline.len(), layout);
                let fill = |window: &Window, output: &mut [Quat]| {
                    Ok(pieces.evaluate_into(window, bytemuck::cast_slice_mut(output))?)
                };
                return run(whole.cut(chunk), interpolation.quantity, fill, sink);
            }
            let wanted = Wanted {
                only_for: Some(&timeline),
                ..Wanted::all(set)
            };
            let clip = self.upload_wanted(set, interpolation, wanted)?;
            return clip.stream(frames, layout, chunk, sink);
        }
        let whole = Window::whole(set.track_count(), timeline.len(), layout);
        let fill = |window: &Window, output: &mut [Quat]| {
            let request = Request {
                tracks: window.tracks.clone(),
                ..Request::whole(set, &interpolation, &timeline)
            };
            Ok((self.backend).evaluate_tracks(&request, layout, output)?)
        };
        run(whole.cut(chunk), interpolation.quantity, fill, sink)
    }
}

/// Results in pieces that the caller asks for, each into memory of its own choice: for iterators,
/// and for those who want to stop in between.
impl Engine {
    /// Some tracks of a result, `[track][sample]`, into the caller's memory. Only they are prepared;
    /// the frames are those of the whole set. The bytes are those of [`Clip::evaluate_encoded`];
    /// memory that is aligned to 16 bytes is filled without a copy.
    ///
    /// ```
    /// # use glam::{Quat, Vec4};
    /// # use tumble::{Device, Encoding, Engine, Error, Frames, TrackSet, method};
    /// # let mut set = TrackSet::new();
    /// # let keys = [Quat::IDENTITY, Quat::from_rotation_x(1.0)];
    /// # set.push("", &[0.0, 1.0], &keys).unwrap();
    /// # set.push("", &[0.0, 1.0], &keys).unwrap();
    /// let engine = Engine::new(Device::Cpu)?;
    /// let mut second = [[0.0_f32; 4]; 61];
    /// let bytes = bytemuck::cast_slice_mut(&mut second);
    /// let frames = Frames::fps(60);
    /// engine.evaluate_tracks_into(&set, method::SLERP, &frames, 1..2, Encoding::F32, bytes)?;
    /// assert_eq!(Quat::from_array(second[60]), keys[1]);
    /// # Ok::<(), Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Engine::evaluate`]; also when there are no such tracks, `output` has not exactly the
    /// bytes of the result, or the encoding is for rotations and these are none.
    pub fn evaluate_tracks_into(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &Frames,
        tracks: Range<usize>,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        let interpolation = interpolation.into();
        let whole = (tracks, Layout::TrackMajor);
        self.encode_into(set, interpolation, frames, whole, encoding, output)
    }

    /// All tracks of a set, encoded, in the given layout, into the caller's memory: what
    /// [`Engine::upload`] and [`Clip::request`] give, but only what the samples need is
    /// prepared. Memory that is aligned to 16 bytes is filled without a copy.
    ///
    /// # Errors
    /// As [`Engine::evaluate`]; also when `output` has not exactly the bytes of the result, or the
    /// encoding is for rotations and these are none.
    pub fn evaluate_encoded_into(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &Frames,
        layout: Layout,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        let whole = (0..set.track_count(), layout);
        self.encode_into(set, interpolation.into(), frames, whole, encoding, output)
    }

    fn encode_into(
        &self,
        set: &TrackSet,
        interpolation: Interpolation,
        frames: &Frames,
        (tracks, layout): (Range<usize>, Layout),
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        encoding.check(interpolation.quantity)?;
        let timeline = frames.resolve(set.track_count(), set.time_span())?;
        let part = Window::of(tracks.clone(), 0..timeline.len(), layout);
        part.check(set.track_count(), timeline.len(), encoding, output)?;
        if output.is_empty() {
            return Ok(());
        }
        if encoding == Encoding::F32
            && let Ok(quats) = bytemuck::try_cast_slice_mut(&mut *output)
        {
            let request = Request {
                tracks,
                ..Request::whole(set, &interpolation, &timeline)
            };
            return Ok((self.backend).evaluate_tracks(&request, layout, quats)?);
        }
        let request = Request {
            tracks: tracks.clone(),
            ..Request::whole(set, &interpolation, &timeline)
        };
        if self.backend.route(&request, layout).is_of_few() {
            // Few are evaluated, whatever they take when they are encoded.
            let mut quats = OutputBuffer::new(part.len())?;
            (self.backend).evaluate_tracks(&request, layout, &mut quats)?;
            encoding.encode_all(bytemuck::cast_slice(&quats), output);
            return Ok(());
        }
        if let Some(limit) = self.backend.budget() {
            let pieces = Pieces {
                backend: &self.backend,
                set,
                interpolation: &interpolation,
                timeline: &timeline,
                encoding,
                limit,
            };
            ClipData::unprepared(set, interpolation)?;
            return Ok(pieces.evaluate_into(&part, output)?);
        }
        let timeline = timeline.of_tracks(tracks.clone());
        let wanted = Wanted {
            batch: Batch::Tracks(tracks.clone()),
            only_for: Some(&timeline),
            ..Wanted::all(set)
        };
        let clip = self.upload_wanted(set, interpolation, wanted)?;
        let whole = Window::whole(tracks.len(), timeline.len(), layout);
        clip.encode_window_into(&timeline, &whole, encoding, output)
    }
}

impl Window {
    /// Refuses a window that a result has not, and memory of another size than the window's.
    pub(crate) fn check(
        &self,
        tracks: usize,
        samples: usize,
        encoding: Encoding,
        output: &[u8],
    ) -> Result<(), Error> {
        self.check_within(tracks, samples)?;
        match (output.len(), self.len().saturating_mul(encoding.bytes())) {
            (given, needed) if given == needed => Ok(()),
            (given, needed) => Err(Error::OutputBytes { given, needed }),
        }
    }

    /// Refuses a window that a result of so many tracks and samples has not.
    pub(crate) fn check_within(&self, tracks: usize, samples: usize) -> Result<(), Error> {
        let lies_in = |part: &Range<usize>, whole| part.start <= part.end && part.end <= whole;
        if !lies_in(&self.tracks, tracks) || !lies_in(&self.samples, samples) {
            return Err(Error::NoSuchPart {
                part: (self.tracks.clone(), self.samples.clone()),
                whole: (tracks, samples),
            });
        }
        Ok(())
    }
}

/// Fills windows on a thread of their own; hands them to `sink` on this one.
fn run<E: From<Error>>(
    mut windows: impl Iterator<Item = Window> + Send,
    quantity: Quantity,
    fill: impl Fn(&Window, &mut [Quat]) -> Result<(), Error> + Send,
    mut sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let first = [windows.next(), windows.next()];
    let fill_one = move |window: Window, used: OutputBuffer| -> Result<_, Error> {
        let mut rotations = match used.len() < window.len() {
            true => OutputBuffer::new(window.len())?,
            false => used,
        };
        fill(&window, &mut rotations[..window.len()])?;
        Ok((window, rotations))
    };
    // One chunk has nothing to overlap with.
    if let [Some(window), None] = first {
        let none = OutputBuffer::new(0).map_err(Error::from)?;
        let (window, rotations) = fill_one(window, none)?;
        return sink(Chunk::new(window, &rotations, quantity));
    }
    let mut windows = first.into_iter().flatten().chain(windows);
    // One of the engine's threads must not wait for a thread that needs them: all of them may be here.
    if threads::is_worker() || !threads::HAS_THREADS {
        let mut used = OutputBuffer::new(0).map_err(Error::from)?;
        return windows.try_for_each(|window| {
            let none = OutputBuffer::new(0).map_err(Error::from)?;
            let (window, rotations) = fill_one(window, std::mem::replace(&mut used, none))?;
            let count = window.len();
            sink(Chunk::new(window, &rotations[..count], quantity))?;
            used = rotations;
            Ok(())
        });
    }
    thread::scope(|scope| {
        let (give_back, empty) = sync_channel::<OutputBuffer>(BUFFERS);
        let (hand_over, filled) = sync_channel(BUFFERS);
        for _ in 0..BUFFERS {
            let _ = give_back.send(OutputBuffer::new(0).map_err(Error::from)?); // it has room
        }
        // It stops after an error, or when the receiver is gone.
        let fill_all = move || {
            windows.try_for_each(|window| {
                let filled = fill_one(window, empty.recv().ok()?);
                let is_filled = filled.is_ok();
                hand_over.send(filled).ok().filter(|()| is_filled)
            })
        };
        thread::Builder::new()
            .spawn_scoped(scope, fill_all)
            .map_err(|error| Error::Threads(OutOfThreads::of_one(&error)))?;
        for result in filled {
            let (window, rotations) = result?;
            let count = window.len();
            sink(Chunk::new(window, &rotations[..count], quantity))?;
            let _ = give_back.send(rotations); // nobody needs it after the last
        }
        Ok(())
    })
}
