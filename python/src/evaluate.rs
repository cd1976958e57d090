//! Results of clips: rotations, what follows from them, and whole poses.

use std::sync::Arc;

use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyList, PySlice};
use tumble::method::SLERP;
use tumble::{Encoding, Engine, Frames, Interpolation, Layout, Method, Quantity, TrackSet};
use tumble_formats::motion::Motion;
use tumble_formats::sample::ChannelMethods;

use crate::arrays::Order;
use crate::errors::{guarded, input, of_engine};
use crate::options::{Request, Samples};
use crate::output::{array, filled};
use crate::run::{Job, check_signals};

/// What is made of a clip, and how it lies in memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Result {
    pub(crate) quantity: Quantity,
    pub(crate) encoding: Encoding,
    pub(crate) layout: Layout,
    pub(crate) order: Order,
    pub(crate) as_rotation: bool,
    /// Euler angles in radians instead of degrees.
    pub(crate) radians: bool,
    /// The only track has no axis.
    pub(crate) is_one_track: bool,
}

impl Default for Result {
    /// Rotations, x y z w, `[track][frame]`.
    fn default() -> Self {
        Self {
            quantity: Quantity::Rotation,
            encoding: Encoding::F32,
            layout: Layout::TrackMajor,
            order: Order::Xyzw,
            as_rotation: false,
            radians: false,
            is_one_track: false,
        }
    }
}

/// Tracks that one method interpolates; `None` for all of them.
type Group = (Method, Option<Vec<usize>>);

/// The tracks of a clip by their methods.
fn groups(clip: &Motion, method: Option<Method>) -> Vec<Group> {
    let methods = ChannelMethods {
        method,
        with: &Interpolation::from,
    };
    match methods.method_of(clip) {
        Some(method) => vec![(method, None)],
        None => methods
            .groups_of(clip)
            .into_iter()
            .map(|(method, tracks)| (method, Some(tracks)))
            .collect(),
    }
}

impl Result {
    /// Evaluates a clip into an array of NumPy's.
    pub(crate) fn of<'py>(
        &self,
        py: Python<'py>,
        engine: impl FnOnce(usize) -> PyResult<Engine>,
        clip: &Arc<Motion>,
        request: &Request,
        out: Option<&Bound<'py, PyAny>>,
        inputs: &[&Bound<'py, PyAny>],
    ) -> PyResult<Bound<'py, PyAny>> {
        let samples = request.samples()?;
        if self.as_rotation && (self.order != Order::Xyzw || out.is_some()) {
            return Err(input(
                "as_rotation: SciPy's rotations have memory and an order of their own; leave out \
                 `order` and `out`",
            ));
        }
        let tracks = clip.set.track_count();
        if let Samples::Ragged(lists) = samples {
            if out.is_some() || self.layout == Layout::FrameMajor || lists.len() != tracks {
                return Err(input(format!(
                    "at: lists of different lengths for {} tracks of {tracks}; their results are \
                     a list of arrays, without `out` and `layout`",
                    lists.len()
                )));
            }
            return self.ragged(py, engine, clip, request, lists);
        }
        let (frames, count) = samples.resolved(&clip.set)?;
        let is_one_time = matches!(samples, Samples::Shared { is_one: true, .. });
        let mut shape = Vec::with_capacity(4);
        let axes = match self.layout {
            Layout::TrackMajor => [(tracks, self.is_one_track), (count, is_one_time)],
            Layout::FrameMajor => [(count, is_one_time), (tracks, self.is_one_track)],
        };
        shape.extend(axes.into_iter().filter(|axis| !axis.1).map(|axis| axis.0));
        shape.extend_from_slice(self.encoding.shape());
        let array = array(py, &shape, out, inputs)?;
        let engine = engine(tracks * count)?;
        filled(&array, |numbers| {
            guarded(|| self.fill(&engine, clip, request, samples, &frames, count, numbers))
        })?;
        match self.as_rotation {
            true => self.rotation(array.as_any(), self.is_one_track),
            false => Ok(array.into_any()),
        }
    }

    #[allow(clippy::too_many_arguments, reason = "what a result is made of")]
    fn fill(
        &self,
        engine: &Engine,
        clip: &Motion,
        request: &Request,
        samples: &Samples,
        frames: &Frames,
        count: usize,
        numbers: &mut [f32],
    ) -> PyResult<()> {
        let with = request.with(self.quantity);
        let job = Job {
            engine,
            set: &clip.set,
            interpolation: with(SLERP),
            frames,
            samples: count,
            layout: self.layout,
            encoding: self.encoding,
        };
        let tracks = clip.set.track_count();
        let own = self.encoding.components().len();
        for (method, group) in groups(clip, request.method) {
            let Some(group) = group else {
                let job = Job {
                    interpolation: with(method),
                    ..job
                };
                job.write(bytemuck::cast_slice_mut(numbers))?;
                continue;
            };
            // Tracks of other methods lie between these.
            let set = clip.set.select(group.iter().copied()).map_err(of_tracks)?;
            let frames = samples.frames(&clip.set, Some(&group))?;
            let mut found = vec![0.0_f32; group.len() * count * own];
            let job = Job {
                set: &set,
                frames: &frames,
                interpolation: with(method),
                ..job
            };
            job.write(bytemuck::cast_slice_mut(&mut found))?;
            for (place, &track) in group.iter().enumerate() {
                for sample in 0..count {
                    let from = self.layout.index(place, sample, group.len(), count);
                    let to = self.layout.index(track, sample, tracks, count);
                    let (Some(from), Some(to)) = (from, to) else {
                        continue;
                    };
                    let (from, to) = (from * own, to * own);
                    numbers[to..to + own].copy_from_slice(&found[from..from + own]);
                }
            }
        }
        self.finish(numbers);
        Ok(())
    }

    /// What the engine does not do: the other order of components, and radians.
    fn finish(&self, numbers: &mut [f32]) {
        if self.order == Order::Wxyz {
            for quaternion in numbers.as_chunks_mut().0 {
                *quaternion = self.order.of_xyzw(*quaternion);
            }
        }
        if self.radians {
            for angle in numbers {
                *angle = f64::from(*angle).to_radians() as f32;
            }
        }
    }

    /// A list of times for each track, of any lengths: a list of arrays, parts of one.
    fn ragged<'py>(
        &self,
        py: Python<'py>,
        engine: impl FnOnce(usize) -> PyResult<Engine>,
        clip: &Arc<Motion>,
        request: &Request,
        lists: &[Vec<f64>],
    ) -> PyResult<Bound<'py, PyAny>> {
        let count: usize = lists.iter().map(Vec::len).sum();
        let own: usize = self.encoding.shape().iter().product();
        let shape = [&[count], self.encoding.shape()].concat();
        let array = array(py, &shape, None, &[])?;
        let engine = engine(count)?;
        filled(&array, |numbers| {
            guarded(|| {
                let mut numbers = numbers;
                for (track, list) in lists.iter().enumerate() {
                    if track % 256 == 255 {
                        check_signals()?;
                    }
                    let (numbers_of_track, rest) = numbers.split_at_mut(list.len() * own);
                    numbers = rest;
                    let one = track_of(clip, track)?;
                    let samples = Samples::Shared {
                        times: list.as_slice().into(),
                        is_one: false,
                    };
                    let frames = samples.frames(&one.set, None)?;
                    self.fill(
                        &engine,
                        &one,
                        request,
                        &samples,
                        &frames,
                        list.len(),
                        numbers_of_track,
                    )?;
                }
                Ok(())
            })
        })?;
        let results = PyList::empty(py);
        let mut start = 0;
        for list in lists {
            let end = start + list.len();
            let part = array.get_item(PySlice::new(py, start as isize, end as isize, 1))?;
            results.append(match self.as_rotation {
                true => self.rotation(&part, true)?,
                false => part,
            })?;
            start = end;
        }
        Ok(results.into_any())
    }

    /// Rotations of `SciPy`'s: one object for one track, else a list of them.
    fn rotation<'py>(
        &self,
        array: &Bound<'py, PyAny>,
        is_one: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = array.py();
        let class = py
            .import("scipy.spatial.transform")?
            .getattr(intern!(py, "Rotation"))?;
        let make = |of: &Bound<'py, PyAny>| class.call_method1(intern!(py, "from_quat"), (of,));
        if is_one {
            return make(array);
        }
        let by_track = match self.layout {
            Layout::TrackMajor => array.clone(),
            Layout::FrameMajor => array.call_method1("swapaxes", (0, 1))?,
        };
        let list = PyList::empty(py);
        for track in by_track.try_iter()? {
            list.append(make(&track?)?)?;
        }
        Ok(list.into_any())
    }
}

/// One track of a clip, with its channels.
fn track_of(clip: &Motion, track: usize) -> PyResult<Motion> {
    Ok(Motion {
        set: clip.set.select([track]).map_err(of_tracks)?,
        channels: clip.channels.get(track).copied().into_iter().collect(),
        skeleton: Vec::new(),
        ..Motion::default()
    })
}

fn of_tracks(error: tumble::TrackError) -> PyErr {
    of_engine(&error.into())
}

/// The one set and method of a clip whose tracks are all interpolated alike.
pub(crate) fn uniform(clip: &Motion, request: &Request) -> Option<Method> {
    match groups(clip, request.method)[..] {
        [(method, None)] => Some(method),
        _ => None,
    }
}

/// The tracks of one method as a set, and their places in the clip; `None` where these are all.
pub(crate) type OwnSet = (Method, TrackSet, Option<Vec<usize>>);

/// The sets of a clip by their methods.
pub(crate) fn sets(clip: &Motion, request: &Request) -> PyResult<Vec<OwnSet>> {
    groups(clip, request.method)
        .into_iter()
        .map(|(method, group)| match group {
            None => Ok((method, clip.set.clone(), None)),
            Some(tracks) => {
                let set = clip.set.select(tracks.iter().copied()).map_err(of_tracks)?;
                Ok((method, set, Some(tracks)))
            }
        })
        .collect()
}
