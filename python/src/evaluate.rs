//! Results of clips: rotations, quantities derived from them, and whole poses.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use glam::{DQuat, DVec3};
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyList, PySlice};
use tumble::method::C2;
use tumble::{
    ComponentType, Encoding, Engine, Interpolation, Layout, Method, Quantity, SampleTimes,
};
use tumble_cli::host;
use tumble_formats::Diagnostic;
use tumble_formats::motion::Motion;

use crate::arrays::Order;
use crate::device_array::DeviceArray;
use crate::engine::MIN_DEVICE_ROTATIONS;
use crate::errors::{device, guarded, input, of_engine, warn};
use crate::options::{EvaluationKeywords, SampleChoice};
use crate::output::{array, array_of, filled, filled_bytes};
use crate::run::{Job, check_signals, interruptible};

/// The quantity that is evaluated of a clip, its encoding, and its layout in memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutputForm {
    pub(crate) quantity: Quantity,
    pub(crate) encoding: Encoding,
    pub(crate) layout: Layout,
    pub(crate) order: Order,
    pub(crate) as_rotation: bool,
    /// Whether the result stays in the memory of the card that computes it.
    pub(crate) on_card: bool,
    /// Whether rates are relative to the world, with the motion of all parents, instead of relative to the parent.
    pub(crate) in_world: bool,
    /// Whether angles are in radians instead of degrees.
    pub(crate) radians: bool,
    /// Whether quaternions become rotation vectors, three numbers.
    pub(crate) as_vectors: bool,
    /// Whether the result has no axis of tracks, because there is a single track.
    pub(crate) is_one_track: bool,
}

impl OutputForm {
    /// Whether values are velocities or accelerations, three numbers.
    pub(crate) fn of_rates(
        quantity: Quantity,
        in_world: bool,
        layout: Layout,
        on_card: bool,
    ) -> Self {
        Self {
            quantity,
            in_world,
            encoding: Encoding::Vector,
            layout,
            on_card,
            ..Self::default()
        }
    }
}

impl Default for OutputForm {
    /// Rotations, x y z w, `[track][frame]`.
    fn default() -> Self {
        Self {
            quantity: Quantity::Rotation,
            encoding: Encoding::F32,
            layout: Layout::TrackMajor,
            order: Order::Xyzw,
            as_rotation: false,
            on_card: false,
            in_world: false,
            radians: false,
            as_vectors: false,
            is_one_track: false,
        }
    }
}

/// A clip that is evaluated on an engine, at some times of each track.
#[derive(Clone, Copy)]
struct Work<'a> {
    engine: &'a Engine,
    clip: &'a Motion,
    request: &'a EvaluationKeywords,
    frames: &'a SampleTimes,
    /// The number of samples of a track.
    count: usize,
}

impl OutputForm {
    /// Evaluates a clip into a NumPy array.
    pub(crate) fn of<'py>(
        &self,
        py: Python<'py>,
        engine: impl FnOnce(usize) -> PyResult<Engine>,
        clip: &Arc<Motion>,
        request: &EvaluationKeywords,
        out: Option<&Bound<'py, PyAny>>,
        inputs: &[&Bound<'py, PyAny>],
    ) -> PyResult<Bound<'py, PyAny>> {
        match self.as_vectors {
            true => self.vectors(py, engine, clip, request, out, inputs),
            false => self.numbers(py, engine, clip, request, out, inputs),
        }
    }

    /// As [`Self::of`], of a form that the engine evaluates.
    fn numbers<'py>(
        &self,
        py: Python<'py>,
        engine: impl FnOnce(usize) -> PyResult<Engine>,
        clip: &Arc<Motion>,
        request: &EvaluationKeywords,
        out: Option<&Bound<'py, PyAny>>,
        inputs: &[&Bound<'py, PyAny>],
    ) -> PyResult<Bound<'py, PyAny>> {
        let samples = request.samples()?;
        let has_form = self.order != Order::Xyzw || self.encoding != Encoding::F32;
        if self.as_rotation && (has_form || out.is_some()) {
            return Err(input(
                "as_rotation: SciPy's rotations have their own memory and order; leave out \
                 `order`, `dtype` and `out`",
            ));
        }
        let tracks = clip.set.track_count();
        let along_skeleton = self.in_world && !clip.is_world && !clip.skeleton.is_empty();
        if self.on_card {
            self.check_on_card(samples, out.is_some(), along_skeleton)?;
        }
        if along_skeleton && matches!(samples, SampleChoice::Each { .. } | SampleChoice::Ragged(_))
        {
            return Err(input(
                "axes=\"world\": the velocity of a joint in the world depends on its parents at the same times; give \
                 one list of times for all tracks, or use the parent's axes",
            ));
        }
        if let SampleChoice::Ragged(lists) = samples {
            if out.is_some() || self.layout == Layout::FrameMajor || lists.len() != tracks {
                return Err(input(format!(
                    "at: lists of different lengths for {} tracks of {tracks}; their results are \
                     a list of arrays, without `out` and `layout`",
                    lists.len()
                )));
            }
            return self.ragged(py, engine, clip, request, lists);
        }
        let (frames, count) = request.resolved(clip)?;
        let shape = self.shape(samples, tracks, count, self.encoding.shape());
        if self.on_card {
            let engine = engine((tracks * count).max(MIN_DEVICE_ROTATIONS))?;
            let work = Work {
                engine: &engine,
                clip,
                request,
                frames: &frames,
                count,
            };
            let array = self.card_array(py, work, shape)?;
            warn(py, &curve_warnings(py, clip, request, count)?)?;
            return Ok(array.into_any());
        }
        let array = array_of(py, self.encoding.component_type(), &shape, out, inputs)?;
        let engine = engine(tracks * count)?;
        filled_bytes(&array, |bytes| {
            guarded(|| {
                let work = Work {
                    engine: &engine,
                    clip,
                    request,
                    frames: &frames,
                    count,
                };
                self.fill(work, bytes)?;
                if along_skeleton {
                    self.along_skeleton(work, bytemuck::cast_slice_mut(bytes))?;
                }
                Ok(())
            })
        })?;
        warn(py, &curve_warnings(py, clip, request, count)?)?;
        match self.as_rotation {
            true => self.rotation(&array, self.is_one_track),
            false => Ok(array),
        }
    }

    /// The axes of a result whose values have the shape `each`.
    fn shape(
        &self,
        samples: &SampleChoice,
        tracks: usize,
        count: usize,
        each: &[usize],
    ) -> Vec<usize> {
        let is_one_time = matches!(samples, SampleChoice::Shared { is_one: true, .. });
        let axes = match self.layout {
            Layout::TrackMajor => [(tracks, self.is_one_track), (count, is_one_time)],
            Layout::FrameMajor => [(count, is_one_time), (tracks, self.is_one_track)],
        };
        let kept = axes.into_iter().filter(|axis| !axis.1).map(|axis| axis.0);
        kept.chain(each.iter().copied()).collect()
    }

    /// Rotation vectors, of quaternions that are evaluated first.
    fn vectors<'py>(
        &self,
        py: Python<'py>,
        engine: impl FnOnce(usize) -> PyResult<Engine>,
        clip: &Arc<Motion>,
        request: &EvaluationKeywords,
        out: Option<&Bound<'py, PyAny>>,
        inputs: &[&Bound<'py, PyAny>],
    ) -> PyResult<Bound<'py, PyAny>> {
        let rotations = Self {
            as_vectors: false,
            ..*self
        };
        let samples = request.samples()?;
        if let SampleChoice::Ragged(lists) = samples {
            let engine = engine(lists.iter().map(Vec::len).sum())?;
            let lists =
                rotations.numbers(py, |_| Ok(engine.clone()), clip, request, out, inputs)?;
            let results = PyList::empty(py);
            for list in lists.try_iter()? {
                let list = list?.cast_into::<PyArrayDyn<f32>>()?;
                let array = array(py, &[list.shape()[0], 3], None, &[])?;
                write_vectors(&engine, &list, &array)?;
                results.append(array)?;
            }
            return Ok(results.into_any());
        }
        let (_, count) = request.resolved(clip)?;
        let shape = self.shape(samples, clip.set.track_count(), count, &[3]);
        let array = array(py, &shape, out, inputs)?;
        let engine = engine(clip.set.track_count() * count)?;
        let found = rotations.numbers(py, |_| Ok(engine.clone()), clip, request, None, &[])?;
        write_vectors(&engine, &found.cast_into()?, &array)?;
        Ok(array.into_any())
    }

    /// Fails for results that the host computes after the engine, or that need memory of the host.
    fn check_on_card(
        &self,
        samples: &SampleChoice,
        has_out: bool,
        along_skeleton: bool,
    ) -> PyResult<()> {
        let refused = match samples {
            SampleChoice::Ragged(_) => {
                "lists of times of different lengths give a list of arrays of NumPy's"
            }
            _ if has_out => "`out` is memory of the host's; leave it out",
            _ if self.as_rotation => {
                "rotations of SciPy's are on the host; leave out `as_rotation`"
            }
            _ if self.order != Order::Xyzw => {
                "results on the card are x y z w; reorder them there, as q[..., [3, 0, 1, 2]]"
            }
            _ if self.radians && !self.encoding.angles().is_empty() => {
                "angles on the card are in degrees; leave out `degrees`, and convert them there"
            }
            _ if along_skeleton => {
                "velocities in the world are computed on the host; use the axes of the body or its parent"
            }
            _ => return Ok(()),
        };
        Err(input(format!("device_array: {refused}")))
    }

    /// Evaluates a clip into memory of the device, without a copy to the host.
    fn card_array<'py>(
        &self,
        py: Python<'py>,
        work: Work<'_>,
        shape: Vec<usize>,
    ) -> PyResult<Bound<'py, DeviceArray>> {
        if work.engine.device_info().is_none() {
            return Err(device(
                "device_array: this engine evaluates on the CPU, whose results are arrays of NumPy's; open a Vulkan \
                 device that is an NVIDIA card, such as tumble.Engine(\"vulkan\") or one of tumble.devices(), or \
                 leave out `device_array`",
            ));
        }
        let interpolations = work
            .request
            .methods(self.quantity)
            .interpolations(work.clip);
        if interpolations
            .uniform(work.clip.set.track_count())
            .is_none()
        {
            return Err(input(
                "device_array: the file states different methods for its tracks, and such results are combined on the \
                 host; name one `method` for all",
            ));
        }
        let array = py.detach(|| {
            guarded(|| {
                let job = Job {
                    engine: work.engine,
                    set: &work.clip.set,
                    interpolations: &interpolations,
                    frames: work.frames,
                    samples: work.count,
                    layout: self.layout,
                    encoding: self.encoding,
                };
                DeviceArray::new(job.export()?, shape, self.encoding.component_type())
            })
        })?;
        Bound::new(py, array)
    }

    fn fill(&self, work: Work<'_>, bytes: &mut [u8]) -> PyResult<()> {
        let job = Job {
            engine: work.engine,
            set: &work.clip.set,
            interpolations: &work
                .request
                .methods(self.quantity)
                .interpolations(work.clip),
            frames: work.frames,
            samples: work.count,
            layout: self.layout,
            encoding: self.encoding,
        };
        job.write(bytes)?;
        self.finish(bytes);
        Ok(())
    }

    /// Converts rates relative to the parents to rates relative to the world.
    fn along_skeleton(&self, work: Work<'_>, numbers: &mut [f32]) -> PyResult<()> {
        let Work { clip, count, .. } = work;
        let tracks = clip.set.track_count();
        let other = |quantity, encoding: Encoding| -> PyResult<Vec<f32>> {
            let other = Self {
                quantity,
                encoding,
                ..*self
            };
            let mut found = vec![0.0; tracks * count * encoding.components().len()];
            other.fill(work, bytemuck::cast_slice_mut(&mut found))?;
            Ok(found)
        };
        let rotations = other(Quantity::Rotation, Encoding::F32)?;
        let velocities = match self.quantity {
            Quantity::Acceleration(axes) => other(Quantity::Velocity(axes), Encoding::Vector)?,
            _ => Vec::new(),
        };
        let order = parents_first(clip)?;
        // The world rotation of each track and, for accelerations, its angular velocity.
        let mut world = vec![(DQuat::IDENTITY, DVec3::ZERO); tracks];
        for sample in 0..count {
            if sample % 256 == 255 {
                check_signals()?;
            }
            for &track in &order {
                let index = self.layout.index(track, sample, tracks, count).unwrap_or(0);
                let three = |of: &[f32]| {
                    DVec3::from_slice(&[0, 1, 2].map(|at| f64::from(of[3 * index + at])))
                };
                let local = [0, 1, 2, 3].map(|at| f64::from(rotations[4 * index + at]));
                let rate = three(numbers);
                let Some(parent) = clip.skeleton[track].parent else {
                    let velocity = if velocities.is_empty() {
                        rate
                    } else {
                        three(&velocities)
                    };
                    world[track] = (DQuat::from_array(local), velocity);
                    continue;
                };
                let (above, carried) = world[parent];
                let above_rate = |of: &[f32]| {
                    let index = self
                        .layout
                        .index(parent, sample, tracks, count)
                        .unwrap_or(0);
                    DVec3::from_slice(&[0, 1, 2].map(|at| f64::from(of[3 * index + at])))
                };
                let rate_in_world = above * rate;
                let mut found = above_rate(numbers) + rate_in_world;
                let mut velocity = carried + rate_in_world;
                if !velocities.is_empty() {
                    let relative = above * three(&velocities);
                    found += carried.cross(relative);
                    velocity = carried + relative;
                }
                let rotation = (above * DQuat::from_array(local)).normalize();
                world[track] = (rotation, velocity);
                let found = found.as_vec3().to_array();
                numbers[3 * index..3 * index + 3].copy_from_slice(&found);
            }
        }
        Ok(())
    }

    /// Changes that the engine does not make: the other order of components, and radians.
    fn finish(&self, bytes: &mut [u8]) {
        if self.order == Order::Wxyz {
            match self.encoding.component_type() {
                ComponentType::F32 => self.reorder::<f32>(bytes),
                ComponentType::F16 | ComponentType::Snorm16 => self.reorder::<u16>(bytes),
            }
        }
        let angles = self.encoding.angles();
        if !self.radians || angles.is_empty() {
            return;
        }
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(bytes);
        for value in numbers.chunks_exact_mut(self.encoding.components().len()) {
            for angle in &mut value[angles.clone()] {
                *angle = f64::from(*angle).to_radians() as f32;
            }
        }
    }

    fn reorder<T: bytemuck::Pod>(&self, bytes: &mut [u8]) {
        let numbers: &mut [T] = bytemuck::cast_slice_mut(bytes);
        for quaternion in numbers.as_chunks_mut().0 {
            *quaternion = self.order.of_xyzw(*quaternion);
        }
    }

    /// A list of times for each track, of any lengths: a list of arrays, parts of one.
    fn ragged<'py>(
        &self,
        py: Python<'py>,
        engine: impl FnOnce(usize) -> PyResult<Engine>,
        clip: &Arc<Motion>,
        request: &EvaluationKeywords,
        lists: &[Vec<f64>],
    ) -> PyResult<Bound<'py, PyAny>> {
        let count: usize = lists.iter().map(Vec::len).sum();
        let size = self.encoding.bytes();
        let shape = [&[count], self.encoding.shape()].concat();
        let array = array_of(py, self.encoding.component_type(), &shape, None, &[])?;
        let engine = engine(count)?;
        filled_bytes(&array, |bytes| {
            guarded(|| {
                let mut bytes = bytes;
                for (track, list) in lists.iter().enumerate() {
                    if track % 256 == 255 {
                        check_signals()?;
                    }
                    let (of_track, rest) = bytes.split_at_mut(list.len() * size);
                    bytes = rest;
                    let one = track_of(clip, track)?;
                    let samples = SampleChoice::Shared {
                        times: list.as_slice().into(),
                        is_one: false,
                    };
                    let frames = samples.frames(&one, None)?;
                    let work = Work {
                        engine: &engine,
                        clip: &one,
                        request,
                        frames: &frames,
                        count: list.len(),
                    };
                    self.fill(work, of_track)?;
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

    /// SciPy's `Rotation` objects: one for a single track, otherwise a list with one for each track.
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

/// Stores the rotation vectors of quaternions.
pub(crate) fn write_vectors(
    engine: &Engine,
    quaternions: &Bound<'_, PyArrayDyn<f32>>,
    vectors: &Bound<'_, PyArrayDyn<f32>>,
) -> PyResult<()> {
    let quaternions = quaternions.readonly();
    let quaternions = quaternions.as_slice()?.as_chunks().0;
    filled(vectors, |vectors| {
        let stored = engine.rotation_vectors_into(quaternions, vectors);
        stored.map_err(|error| of_engine(&error))
    })
}

/// The tracks of a clip, parents before their children.
fn parents_first(clip: &Motion) -> PyResult<Vec<usize>> {
    let tracks = clip.skeleton.len();
    let (mut order, mut known) = (Vec::with_capacity(tracks), vec![false; tracks]);
    while order.len() < tracks {
        let before = order.len();
        for track in 0..tracks {
            let is_next = match clip.skeleton[track].parent {
                None => true,
                Some(parent) => known.get(parent).copied().unwrap_or(false),
            };
            if !known[track] && is_next {
                known[track] = true;
                order.push(track);
            }
        }
        if order.len() == before {
            return Err(input("parents: the parents of some tracks form a cycle"));
        }
    }
    Ok(order)
}

/// Clips whose curves were checked for being as smooth as their method promises, and how they were
/// interpolated: the check takes as long as preparing them, and is done once.
static CHECKED_CURVES: Mutex<VecDeque<(Weak<Motion>, Interpolation)>> = Mutex::new(VecDeque::new());

/// The number of checked clips that are remembered.
const MAX_CHECKED_CURVES: usize = 256;

/// Samples for which a track is prepared as a whole: fewer keys than so many times these.
const KEYS_OF_A_SAMPLE: usize = 2048;

/// Where the curves of a clip are less smooth than their method promises, where no warning was given
/// yet. Requests for few samples of many keys are not checked.
pub(crate) fn curve_warnings(
    py: Python<'_>,
    clip: &Arc<Motion>,
    request: &EvaluationKeywords,
    samples: usize,
) -> PyResult<Vec<Diagnostic>> {
    let rotations = samples.saturating_mul(clip.set.track_count());
    let has_warnings = |method: &Method| method.name == C2.name;
    let method = request.method.0.filter(has_warnings);
    let is_sparse = rotations.saturating_mul(KEYS_OF_A_SAMPLE) < clip.set.key_count();
    let (Some(method), false) = (method, is_sparse) else {
        return Ok(Vec::new());
    };
    let interpolation = request.methods(Quantity::Rotation).options.with(method);
    let mut known = CHECKED_CURVES
        .lock()
        .unwrap_or_else(PoisonError::into_inner);
    let this = Arc::downgrade(clip);
    if known
        .iter()
        .any(|(other, how)| other.ptr_eq(&this) && *how == interpolation)
    {
        return Ok(Vec::new());
    }
    known.truncate(MAX_CHECKED_CURVES - 1);
    known.push_front((this, interpolation));
    drop(known);
    let name = clip.name.clone().unwrap_or_else(|| "clip".to_owned());
    let clip = Arc::clone(clip);
    let find_warning = move || Ok(host::curve_warning(&name, &clip, &interpolation));
    let found = match clip_is_short(rotations) {
        true => py.detach(|| guarded(find_warning))?,
        false => interruptible(py, find_warning)?,
    };
    Ok(found.into_iter().collect())
}

/// Whether checking a clip for so many rotations takes no longer than starting a thread.
fn clip_is_short(rotations: usize) -> bool {
    rotations < 4096
}

/// A clip with one track of another clip and its channels.
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
