//! `tumble.Crowd`: many instances of a skeleton, each of which plays clips at its own time.

use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::crowd::{CrowdLayer, CrowdLibrary, CrowdStorage, CrowdValues, LayerBlend};
use tumble::{ComponentType, WrapMode};

use crate::arrays::{ArrayValues, ListArgument, doubles};
use crate::clip::Clip;
use crate::engine::{Engine, default_engine};
use crate::errors::{guarded, input, warn_of};
use crate::events::{ClipEvent, PassedEvent};
use crate::motions::{
    ChosenSkeleton, ListedClip, SharedSkeleton, fitted, of_crowd, of_pushed, order_assumption,
};
use crate::names::{one_of, option_named};
use crate::options::method_named;
use crate::output::{array_of, filled_bytes, quaternions_of};
use crate::run::stoppable;
use crate::samples::matrices;

/// The default number of ticks per second.
const TICKS: u32 = 705_600;

/// Evaluations with at least this many joints run in a thread that Ctrl-C can stop; smaller ones end sooner than that.
const MANY: usize = 1 << 20;

/// Many instances of a skeleton, each of which plays clips at a separate time and speed: poses for skinning.
///
/// `Crowd(clips, instances, *, layers=1, method="slerp", parents=None, offsets=None, masks=None,
/// inverse_bind=None, references=None, events=None, ticks_per_second=705600, storage="segments",
/// engine=None)`
///
/// `clips`: clips of one skeleton, whose joints are matched by name, by index only if no clip has names. The skeleton
/// is that of the first clip, or given by `parents` and `offsets` for its tracks; without `offsets` each clip keeps its
/// own. A clip that has parents but no offsets can only be evaluated as "rotations". `layers`: the number of layers of an instance, 1 to 4, each blended over the ones below. `masks`: lists of a weight from 0 to 1
/// for each joint, by which a layer's weight is multiplied. `inverse_bind`: (joints, 3, 4) or (joints, 4, 4), for the
/// values "skinning". `references`: {clip: (other clip, seconds)}, the reference pose for additive layers of a clip;
/// the default is the first pose of the clip. `events`: a list of `ClipEvent`, the moments that `passed_events`
/// reports. `storage`: "segments", or "compact" for a third to a sixth of the memory
/// where keys are close; poses have the same bits and take longer.
///
/// All instances follow one clock, which counts whole ticks: a clip in a loop gives the same bits in the
/// first second and a day later, on the CPU and every Vulkan device. At the start all play the first clip
/// and stand still.
///
/// >>> import numpy as np, tumble
/// >>> half = 0.5 ** 0.5
/// >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, half, half]]],
/// ...                    parents=[None], offsets=[[1, 0, 0]])
/// >>> crowd = tumble.Crowd([door], 3)
/// >>> crowd.set([0, 1, 2], 0, time=[0.0, 0.5, 1.0], wrap="hold")
/// >>> crowd.advance(1.0)
/// >>> crowd.evaluate("rotations")[2, 0].round(4)
/// array([0.    , 0.    , 0.7071, 0.7071], dtype=float32)
/// >>> crowd.evaluate().shape
/// (3, 1, 3, 4)
#[pyclass(frozen, weakref, module = "tumble")]
pub(crate) struct Crowd {
    crowd: Mutex<tumble::crowd::Crowd>,
    instances: usize,
    joints: usize,
    layers: usize,
    clips: usize,
    /// For each clip, the reason why it has no positions.
    unplaced: Option<String>,
}

/// A number for each of some instances: from one number for all, or from a list.
fn each(value: &Bound<'_, PyAny>, name: &str, count: usize) -> PyResult<Vec<f64>> {
    let ArrayValues { shape, values } = doubles(value, name)?;
    match (&*shape, &*values) {
        ([], &[one]) => Ok(vec![one; count]),
        (&[length], _) if length == count => Ok(values),
        _ => Err(input(format!(
            "{name}: the shape is {shape:?}; give one for all, or ({count},)"
        ))),
    }
}

/// An index for each of some instances, from one index for all, or from a list.
fn indices(value: &Bound<'_, PyAny>, name: &str, count: usize) -> PyResult<Vec<usize>> {
    let whole = |number: f64| match number >= 0.0 && number.fract() == 0.0 && number < 1e15 {
        true => Ok(number as usize),
        false => Err(input(format!("{name}: {number} is not an index"))),
    };
    each(value, name, count)?.into_iter().map(whole).collect()
}

fn values_named(name: &str) -> PyResult<CrowdValues> {
    option_named(name, "values")
}

impl Crowd {
    fn lock(&self) -> MutexGuard<'_, tumble::crowd::Crowd> {
        self.crowd.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Crowd {
    #[new]
    #[pyo3(signature = (
        clips, instances, *, layers=1, method="slerp", parents=None, offsets=None, masks=None,
        inverse_bind=None, references=None, events=None, ticks_per_second=TICKS, storage="segments",
        engine=None
    ), text_signature = "(clips, instances, *, layers=1, method='slerp', parents=None, offsets=None, masks=None, inverse_bind=None, references=None, events=None, ticks_per_second=705600, storage='segments', engine=None)")]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn new(
        py: Python<'_>,
        clips: ListArgument<Clip>,
        instances: usize,
        layers: usize,
        method: &str,
        parents: Option<ListArgument<Option<i64>>>,
        offsets: Option<&Bound<'_, PyAny>>,
        masks: Option<ListArgument<ListArgument<f32>>>,
        inverse_bind: Option<&Bound<'_, PyAny>>,
        references: Option<&Bound<'_, PyDict>>,
        events: Option<ListArgument<ClipEvent>>,
        ticks_per_second: u32,
        storage: &str,
        engine: Option<&Bound<'_, Engine>>,
    ) -> PyResult<Self> {
        let clips = clips.0;
        let Some(first) = clips.first() else {
            return Err(input("clips: give at least one"));
        };
        let method = method_named(method)?;
        let storage: CrowdStorage = option_named(storage, "storage")?;
        let tracks = first.motion.set.track_count();
        let chosen = match parents {
            Some(parents) => ChosenSkeleton::of_arrays(&parents.0, offsets, tracks)?,
            None if offsets.is_some() => return Err(input("offsets: give `parents` too")),
            None => ChosenSkeleton::First,
        };
        let Some(shared) = SharedSkeleton::new(&chosen, &clips)? else {
            return Err(input(
                "clips[0]: it has no skeleton; give `parents` and `offsets`",
            ));
        };
        warn_of(py, order_assumption(&clips).as_slice())?;
        let skeleton = shared.of_engine()?;
        let joints = skeleton.len();
        let unplaced = ListedClip::all(&clips).find_map(|listed| shared.unplaced(listed));
        let inverse_bind = inverse_bind.map(|value| matrices(value, joints));
        let inverse_bind = inverse_bind.transpose()?;
        let tick_of = |seconds: f64, name: &str| {
            let ticks = (seconds * f64::from(ticks_per_second)).round();
            match (0.0..=f64::from(u32::MAX)).contains(&ticks) {
                true => Ok(ticks as u32),
                false => Err(input(format!(
                    "{name}: {seconds} s; give a time from 0 to the clip's length"
                ))),
            }
        };
        let mut poses: Vec<(usize, usize, u32)> = Vec::new();
        for (clip, reference) in references.into_iter().flatten() {
            let (from, seconds): (usize, f64) = reference.extract()?;
            poses.push((clip.extract()?, from, tick_of(seconds, "references")?));
        }
        let events = events.map_or_else(Vec::new, |events| events.0);
        let moments = events.iter().enumerate().map(|(index, event)| {
            let tick = tick_of(event.time, &format!("events[{index}]"))?;
            Ok((event.clip, tick, event.name.clone()))
        });
        let moments: Vec<(usize, u32, String)> = moments.collect::<PyResult<_>>()?;
        let engine = match engine {
            Some(engine) => engine.get().engine_for(1)?,
            None => default_engine(py)?.get().engine_for(1)?,
        };
        let count = clips.len();
        let crowd = py.detach(|| {
            stoppable(|| {
                let made = CrowdLibrary::with_ticks(&skeleton, ticks_per_second);
                let mut library = made.map_err(of_crowd)?;
                library.set_storage(storage);
                for listed in ListedClip::all(&clips) {
                    let (tracks, of_rotations, of_vectors) = fitted(&shared, listed, method)?;
                    let pushed = library.push(&tracks, of_rotations, of_vectors);
                    pushed.map_err(|error| of_pushed(error, listed))?;
                }
                for (index, mask) in masks.iter().flat_map(|masks| &masks.0).enumerate() {
                    library
                        .push_mask(&mask.0)
                        .map_err(|error| input(format!("masks[{index}]: {error}")))?;
                }
                if let Some(matrices) = &inverse_bind {
                    let set = library.set_inverse_bind(matrices);
                    set.map_err(|error| input(format!("inverse_bind: {error}")))?;
                }
                for (clip, from, tick) in poses {
                    let set = library.set_reference(clip, from, tick);
                    set.map_err(|error| input(format!("references: {error}")))?;
                }
                for (index, (clip, tick, name)) in moments.into_iter().enumerate() {
                    let pushed = library.push_event(clip, tick, name);
                    pushed.map_err(|error| input(format!("events[{index}]: {error}")))?;
                }
                engine.crowd(&library, instances, layers).map_err(of_crowd)
            })
        })?;
        Ok(Self {
            crowd: Mutex::new(crowd),
            instances,
            joints,
            layers,
            clips: count,
            unplaced,
        })
    }

    /// Sets what instances play from now on.
    ///
    /// `instances`: their indices, (n,), or one. `clip`, `time` (seconds of the clip), `speed` and `weight`
    /// are one for all of them or (n,). `wrap`: "hold", "loop" or "mirror", outside of the clip. `weight`:
    /// how much of the layer is laid over those below, 0 to 1. `additive`: the clip's difference from its
    /// reference is added to those below. `mask`: the index of one, or None.
    ///
    /// >>> import tumble
    /// >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
    /// >>> tumble.Crowd([door], 100).set(range(100), 0, speed=0.5)
    #[pyo3(signature = (
        instances, clip, *, layer=0, time=None, speed=None, wrap=None, weight=None, additive=false, mask=None
    ), text_signature = "($self, instances, clip, *, layer=0, time=0.0, speed=1.0, wrap='loop', weight=1.0, additive=False, mask=None)")]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn set(
        &self,
        py: Python<'_>,
        instances: &Bound<'_, PyAny>,
        clip: &Bound<'_, PyAny>,
        layer: usize,
        time: Option<&Bound<'_, PyAny>>,
        speed: Option<&Bound<'_, PyAny>>,
        wrap: Option<&Bound<'_, PyAny>>,
        weight: Option<&Bound<'_, PyAny>>,
        additive: bool,
        mask: Option<usize>,
    ) -> PyResult<()> {
        let count = match &*doubles(instances, "instances")?.shape {
            [] => 1,
            [count] => *count,
            shape => {
                return Err(input(format!(
                    "instances: the shape is {shape:?}; give indices, (n,)"
                )));
            }
        };
        let numbers = |value: Option<&Bound<'_, PyAny>>, name: &str, rest: f64| match value {
            Some(value) => each(value, name, count),
            None => Ok(vec![rest; count]),
        };
        let instances = indices(instances, "instances", count)?;
        let clips = indices(clip, "clip", count)?;
        let times = numbers(time, "time", 0.0)?;
        let speeds = numbers(speed, "speed", 1.0)?;
        let weights = numbers(weight, "weight", 1.0)?;
        // Crowds cannot extrapolate, so this mode is not offered.
        let modes = WrapMode::ALL.map(|mode| (mode.name(), mode));
        let modes: Vec<_> = (modes.into_iter())
            .filter(|(_, mode)| *mode != WrapMode::Extrapolate)
            .collect();
        let wrap = wrap.map(|name| one_of(name, "wrap", &modes)).transpose()?;
        py.detach(|| {
            guarded(|| {
                let mut crowd = self.lock();
                let mut changes = Vec::with_capacity(count);
                for (index, &instance) in instances.iter().enumerate() {
                    let plays = CrowdLayer::new(clips[index])
                        .at(crowd.ticks_of(times[index]).map_err(of_crowd)?)
                        .with_speed(speeds[index] as f32)
                        .with_wrap(wrap.unwrap_or(WrapMode::Loop))
                        .with_weight(weights[index] as f32)
                        .with_blend(match additive {
                            true => LayerBlend::Additive,
                            false => LayerBlend::Over,
                        })
                        .with_mask(mask);
                    changes.push((instance, layer, plays));
                }
                crowd.set_all(&changes).map_err(of_crowd)
            })
        })
    }

    /// Moves the clock on, by the ticks nearest to some seconds.
    ///
    /// >>> import tumble
    /// >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
    /// >>> tumble.Crowd([door], 100).advance(1 / 60)
    fn advance(&self, py: Python<'_>, seconds: f64) -> PyResult<()> {
        py.detach(|| guarded(|| self.lock().advance(seconds).map_err(of_crowd)))
    }

    /// The events that the layers of all instances passed after the time `since` of the clock in ticks, up to now: a
    /// list of `PassedEvent`, in the order of their times, then of instances, layers and events.
    ///
    /// A layer passes an event when its time in the clip reaches that of the event, in either direction, and in a loop
    /// once in each round. One large step passes the same events as many small ones. The clips that the layers play now
    /// count: call this after `advance` and before `set`. Layers of weight 0 pass events, too.
    ///
    /// >>> import tumble
    /// >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
    /// >>> crowd = tumble.Crowd([door], 2, events=[tumble.ClipEvent(0, 0.5, "creaks")])
    /// >>> crowd.set([1], 0)
    /// >>> before = crowd.clock
    /// >>> crowd.advance(3.0)
    /// >>> for passed in crowd.passed_events(before):
    /// ...     print(crowd.events[passed.event].name, passed.instance, passed.clock / crowd.ticks_per_second)
    /// creaks 1 0.5
    /// creaks 1 2.5
    fn passed_events(&self, py: Python<'_>, since: u64) -> PyResult<Vec<PassedEvent>> {
        let passed = py.detach(|| guarded(|| self.lock().passed_events(since).map_err(of_crowd)));
        Ok(passed?.into_iter().map(PassedEvent::from).collect())
    }

    /// The poses of all instances at the clock's time: (instances, joints, 3, 4), for column vectors, the
    /// last column the translation; or of "rotations" (instances, joints, 4), x y z w.
    ///
    /// `values`: "model", "skinning" (times the inverse bind matrices), "local" (in the parents' frames), or
    /// "rotations" (in the parents' frames). `dtype`: "float32" or "float16".
    ///
    /// >>> import tumble
    /// >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
    /// >>> tumble.Crowd([door], 100).evaluate("local", dtype="float16").shape
    /// (100, 1, 3, 4)
    #[pyo3(signature = (values="model", *, dtype=None, out=None), text_signature = "($self, values='model', *, dtype='float32', out=None)")]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        values: &str,
        dtype: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let values = values_named(values)?;
        if let Some(reason) = self
            .unplaced
            .as_ref()
            .filter(|_| values != CrowdValues::Rotations)
        {
            return Err(input(format!("{reason}; or evaluate \"rotations\"")));
        }
        let component = match dtype {
            None => ComponentType::F32,
            Some(dtype) => quaternions_of(dtype)?.component_type(),
        };
        let is_half = match component {
            ComponentType::F32 => false,
            ComponentType::F16 => true,
            ComponentType::Snorm16 => {
                return Err(input("dtype: crowds return float32 or float16"));
            }
        };
        let shape: &[usize] = match values {
            CrowdValues::Rotations => &[self.instances, self.joints, 4],
            _ => &[self.instances, self.joints, 3, 4],
        };
        let array = array_of(py, component, shape, out, &[])?;
        let is_long = self.instances * self.joints >= MANY;
        filled_bytes(&array, |bytes| {
            let work = || {
                let mut crowd = self.lock();
                let evaluated = match is_half {
                    false => crowd.evaluate_into(values, bytemuck::cast_slice_mut(bytes)),
                    true => crowd.evaluate_half_into(values, bytemuck::cast_slice_mut(bytes)),
                };
                evaluated.map_err(of_crowd)
            };
            match is_long {
                true => stoppable(work),
                false => guarded(work),
            }
        })?;
        Ok(array)
    }

    /// The time in seconds of its clip that each instance plays in a layer: (instances,), float64.
    ///
    /// >>> import tumble
    /// >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
    /// >>> crowd = tumble.Crowd([door], 2)
    /// >>> crowd.set([0, 1], 0, time=[0.0, 1.75])
    /// >>> crowd.advance(0.5)
    /// >>> crowd.times()
    /// array([0.5 , 0.25])
    #[pyo3(signature = (layer=0))]
    fn times<'py>(&self, py: Python<'py>, layer: usize) -> PyResult<Bound<'py, PyAny>> {
        let found = py.detach(|| {
            let crowd = self.lock();
            let second = f64::from(crowd.library().ticks_per_second());
            let times = (0..self.instances).map(|instance| {
                let tick = crowd.tick(instance, layer).map_err(of_crowd)?;
                Ok(f64::from(tick) / second)
            });
            times.collect::<PyResult<Vec<f64>>>()
        })?;
        Ok(numpy::PyArray1::from_vec(py, found).into_any())
    }

    /// The events of the clips, in the order in which they were given; their times are rounded to ticks.
    #[getter]
    fn events(&self) -> Vec<ClipEvent> {
        let crowd = self.lock();
        let library = crowd.library();
        let second = f64::from(library.ticks_per_second());
        let events = library.events().iter().map(|event| ClipEvent {
            clip: event.clip,
            time: f64::from(event.tick) / second,
            name: event.name.clone(),
        });
        events.collect()
    }

    /// The clock's time in ticks.
    #[getter]
    fn clock(&self) -> u64 {
        self.lock().clock()
    }

    /// Ticks of the clock in a second.
    #[getter]
    fn ticks_per_second(&self) -> u32 {
        self.lock().library().ticks_per_second()
    }

    /// Number of instances.
    #[getter]
    fn instances(&self) -> usize {
        self.instances
    }

    /// Joints of the skeleton.
    #[getter]
    fn joints(&self) -> usize {
        self.joints
    }

    /// Layers of an instance.
    #[getter]
    fn layers(&self) -> usize {
        self.layers
    }

    /// Bytes of the clips divided by the number of their keys, on the CPU and on devices.
    ///
    /// >>> import numpy as np, tumble
    /// >>> keys = [[[0, np.sin(angle), 0, np.cos(angle)] for angle in np.arange(300) / 99]] * 20
    /// >>> walk = tumble.Clip(np.arange(300) / 30, keys, parents=[None] * 20)
    /// >>> tumble.Crowd([walk], 3, storage="compact").bytes_per_key < 20
    /// True
    #[getter]
    fn bytes_per_key(&self) -> f64 {
        self.lock().library().bytes_per_key()
    }

    fn __repr__(&self) -> String {
        format!(
            "Crowd({} clips, {} instances, {} joints)",
            self.clips, self.instances, self.joints
        )
    }
}
