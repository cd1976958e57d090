//! Results in pieces.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PySlice, PyTuple};
use tumble::{Encoding, Engine, Interpolation, Layout, PerTrack, Quantity, SampleTimes};
use tumble_formats::motion::Motion;

use crate::arrays::{Order, numpy};
use crate::errors::{input, of_engine};
use crate::options::EvaluationKeywords;
use crate::output::{array, filled};
use crate::run::{Job, stoppable};
use crate::values::{Pickled, Value, pickled};

/// An iterator of `Chunk`s; see `Engine.stream`.
#[pyclass(frozen, weakref, module = "tumble")]
pub(crate) struct Chunks {
    engine: Engine,
    motion: Arc<Motion>,
    samples: usize,
    order: Order,
    layout: Layout,
    frames: SampleTimes,
    source: ChunkSource,
    /// The largest number of rows and columns of a chunk; rows are tracks or frames, depending on the layout.
    each: (usize, usize),
    /// The row and the column where the next chunk starts.
    next: Mutex<(usize, usize)>,
}

/// How the rotations of a chunk are computed.
enum ChunkSource {
    /// The tracks are prepared anew for each chunk.
    Tracks(Box<PerTrack<Interpolation>>),
    /// The tracks have been prepared once, before the first chunk.
    Prepared(tumble::Clip),
}

/// A part of a result, contiguous in the whole.
#[pyclass(frozen, weakref, module = "tumble")]
pub(crate) struct Chunk {
    tracks: Range<usize>,
    frames: Range<usize>,
    rotations: Py<PyArrayDyn<f32>>,
}

impl Value for Chunk {
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let ranges = [&self.tracks, &self.frames].map(|range| (range.start, range.end));
        let [tracks, frames] = ranges;
        (tracks, frames, &self.rotations).into_pyobject(py)
    }

    fn of_state(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let (tracks, frames, rotations): ((usize, usize), (usize, usize), _) = state.extract()?;
        Ok(Self {
            tracks: tracks.0..tracks.1,
            frames: frames.0..frames.1,
            rotations,
        })
    }
}

impl Chunks {
    pub(crate) fn new(
        engine: Engine,
        motion: &Arc<Motion>,
        request: &EvaluationKeywords,
        chunk: usize,
        (order, layout): (Order, Layout),
    ) -> PyResult<Self> {
        let (frames, samples) = request.resolved(motion)?;
        if chunk == 0 {
            return Err(input(
                "chunk: give the number of rotations of a piece, over 0",
            ));
        }
        let columns = match layout {
            Layout::TrackMajor => samples,
            Layout::FrameMajor => motion.set.track_count(),
        };
        let each = ((chunk / columns.max(1)).max(1), columns.min(chunk));
        let is_prepared = layout == Layout::FrameMajor || each.1 < columns;
        let interpolations = request.methods(Quantity::Rotation).interpolations(motion);
        let source = match is_prepared {
            false => ChunkSource::Tracks(Box::new(interpolations)),
            true => {
                let clip = engine.upload(&motion.set, interpolations);
                ChunkSource::Prepared(clip.map_err(|error| of_engine(&error))?)
            }
        };
        Ok(Self {
            engine,
            motion: Arc::clone(motion),
            samples,
            order,
            layout,
            frames,
            source,
            each,
            next: Mutex::new((0, 0)),
        })
    }

    /// The tracks and frames of the next chunk; `None` after the last.
    fn advance(&self) -> Option<(Range<usize>, Range<usize>)> {
        let tracks = self.motion.set.track_count();
        let (rows, columns) = match self.layout {
            Layout::TrackMajor => (tracks, self.samples),
            Layout::FrameMajor => (self.samples, tracks),
        };
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        let (row, column) = *next;
        if row >= rows || columns == 0 {
            return None;
        }
        let part = (
            row..rows.min(row + self.each.0),
            column..columns.min(column + self.each.1),
        );
        *next = match part.1.end < columns {
            true => (row, part.1.end),
            false => (part.0.end, 0),
        };
        Some(match self.layout {
            Layout::TrackMajor => part,
            Layout::FrameMajor => (part.1, part.0),
        })
    }
}

#[pymethods]
impl Chunks {
    fn __iter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Chunk>> {
        let Some((tracks, frames)) = self.advance() else {
            return Ok(None);
        };
        let shape = match self.layout {
            Layout::TrackMajor => [tracks.len(), frames.len(), 4],
            Layout::FrameMajor => [frames.len(), tracks.len(), 4],
        };
        let array = array(py, &shape, None, &[])?;
        let part = (tracks.clone(), frames.clone());
        filled(&array, |numbers| {
            stoppable(|| {
                let bytes = bytemuck::cast_slice_mut(&mut *numbers);
                match &self.source {
                    ChunkSource::Tracks(interpolations) => Job {
                        engine: &self.engine,
                        set: &self.motion.set,
                        interpolations,
                        frames: &self.frames,
                        samples: self.samples,
                        layout: self.layout,
                        encoding: Encoding::F32,
                    }
                    .tracks(part.0, bytes)?,
                    ChunkSource::Prepared(clip) => {
                        let request = clip.request(&self.frames).layout(self.layout);
                        let request = request.tracks(part.0).samples(part.1);
                        (request.evaluate_into(bytes)).map_err(|error| of_engine(&error))?;
                    }
                }
                if self.order == Order::Wxyz {
                    for quaternion in numbers.as_chunks_mut().0 {
                        *quaternion = self.order.of_xyzw(*quaternion);
                    }
                }
                Ok(())
            })
        })?;
        debug_assert_eq!(array.shape(), shape);
        Ok(Some(Chunk {
            tracks,
            frames,
            rotations: array.unbind(),
        }))
    }

    fn __repr__(&self) -> String {
        let (tracks, samples) = (self.motion.set.track_count(), self.samples);
        format!("Chunks({tracks} tracks × {samples} frames)")
    }
}

#[pymethods]
impl Chunk {
    /// Its tracks, a slice of all.
    #[getter]
    fn tracks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        slice(py, &self.tracks)
    }

    /// Its frames, a slice of all.
    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        slice(py, &self.frames)
    }

    /// The rotations: float32, (tracks, frames, 4), or (frames, tracks, 4) if that is the layout.
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f32>> {
        self.rotations.bind(py).clone()
    }

    /// Whether the other has the same rotations of the same tracks and frames.
    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(other) = other.cast::<Self>() else {
            return Ok(false);
        };
        let other = other.get();
        let has_same_samples = (&self.tracks, &self.frames) == (&other.tracks, &other.frames);
        let equal = intern!(py, "array_equal");
        Ok(has_same_samples
            && numpy(py)?
                .call_method1(equal, (&self.rotations, &other.rotations))?
                .is_truthy()?)
    }

    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        format!("Chunk(tracks {:?}, frames {:?})", self.tracks, self.frames)
    }
}

fn slice<'py>(py: Python<'py>, range: &Range<usize>) -> PyResult<Bound<'py, PyAny>> {
    let class = py.get_type::<PySlice>();
    class.call1((range.start, range.end))
}
