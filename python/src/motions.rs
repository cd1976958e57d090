//! The tables behind `tumble.MotionLibrary`: clips of one skeleton, sampled at many times at once.

pub(crate) mod frames;
pub(crate) mod robots;
pub(crate) mod scalars;

use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;

use glam::Vec3;
use numpy::{
    PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadwriteArrayDyn, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::crowd::{
    BodyTables, CrowdError, FrameStep, KeyPrecision, MotionBuilder, MotionClip, MotionStates,
    MotionTables, MotionWords,
};
use tumble::trees::{FrameWords, TreeFrames};
use tumble::{Channel, Device, EncodingOptions, Error, Method, Skeleton, VectorMethod, bytemuck};
use tumble_formats::motion::Motion;
use tumble_formats::sample::{ChannelMethods, MethodChoice};
use tumble_formats::skeleton::{ClipSkeleton, OffsetSource};

use crate::arrays::ListArgument;
use crate::build::NO_OFFSETS;
use crate::clip::{Clip, Source};
use crate::engine::Engine;
use crate::errors::{guarded, in_python, input, of_engine, warn_of};
use crate::evaluate::write_vectors;
use crate::options::method_named;
use crate::output::{encoding_named, filled};
use crate::run::stoppable;
use crate::samples::{joint_offsets, joint_parents};

/// Ticks per second: a frame of each usual rate is a whole number of ticks.
const TICKS: u32 = 705_600;

/// The largest factor on the ticks per second, for rates that need finer ticks: times are then rounded to 30 ns.
const FINEST: f64 = 24.0;

/// The longest clip in ticks.
const LONGEST: f64 = 2.1e9;

/// Calls with at least this many joints run in a thread that Ctrl-C can stop; smaller ones end sooner than that.
pub(crate) const MANY: usize = 1 << 21;

/// The clips of a motion library, prepared: what is sampled, and its arrays for files.
#[pyclass(frozen, weakref, module = "tumble._tumble")]
pub(crate) struct Motions {
    pub(crate) tables: Tables,
    spans: Py<PyArray2<u32>>,
    cells: Py<PyArray2<f32>>,
    /// For each clip, the reason why it has no positions; empty if it has. No entries if all clips have positions.
    #[pyo3(get)]
    unplaced: Vec<String>,
    /// The names of the joints; no entries in files that do not store them.
    #[pyo3(get)]
    joint_names: Vec<String>,
    /// The names of a robot's bodies; no entries for a skeleton.
    #[pyo3(get)]
    body_names: Vec<String>,
    /// The clips that were left out because they do not fit: their indices in the list, and the reasons.
    #[pyo3(get)]
    skipped: Vec<SkippedClip>,
}

/// The index of a clip in a list, and the reason why it was left out.
type SkippedClip = (usize, String);

/// The tables of a library.
pub(crate) enum Tables {
    /// Joints of a skeleton.
    Skeleton(MotionTables),
    /// Joints and bodies of a robot.
    Robot(BodyTables),
}

impl Tables {
    fn motions(&self) -> &MotionTables {
        match self {
            Self::Skeleton(tables) => tables,
            Self::Robot(tables) => tables.tables(),
        }
    }
}

/// The skeleton that the caller chose for all clips of a library or a crowd.
pub(crate) enum ChosenSkeleton {
    /// The skeleton of the first clip.
    First,
    /// The skeleton of another clip.
    Clip(Clip),
    /// Arrays, in the order of the tracks of the first clip; without offsets, each clip keeps its own.
    Arrays(Vec<Option<usize>>, Option<Vec<Vec3>>),
}

impl ChosenSkeleton {
    /// The skeleton in arrays, checked for the number of tracks.
    pub(crate) fn of_arrays(
        parents: &[Option<i64>],
        offsets: Option<&Bound<'_, PyAny>>,
        tracks: usize,
    ) -> PyResult<Self> {
        let parents = joint_parents(parents, tracks)?;
        let offsets = offsets.map(|value| joint_offsets(value, tracks));
        Ok(Self::Arrays(parents, offsets.transpose()?))
    }
}

/// A clip of a library's list.
#[derive(Clone, Copy)]
pub(crate) struct ListedClip<'a> {
    index: usize,
    clip: &'a Clip,
}

impl ListedClip<'_> {
    /// Reads the clips of a Python list.
    pub(crate) fn all(clips: &[Clip]) -> impl Iterator<Item = ListedClip<'_>> {
        let listed = clips.iter().enumerate();
        listed.map(|(index, clip)| ListedClip { index, clip })
    }
}

/// The clip's name in messages: the path of its file or, without a file, its index in the list.
impl fmt::Display for ListedClip<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.clip.source {
            Some(source) => write!(f, "{}", source.path.display()),
            None => write!(f, "clips[{}]", self.index),
        }
    }
}

/// The skeleton of a library or a crowd.
pub(crate) struct SharedSkeleton {
    skeleton: ClipSkeleton,
    offsets: OffsetSource,
    /// The file of the skeleton. Its clips need not have all joints, because the file has the rest poses of the others.
    file: Option<Arc<Source>>,
}

/// The name of the skeleton in messages.
const SKELETON: &str = "the skeleton";

impl SharedSkeleton {
    /// The chosen skeleton; `None` if it is to be that of a clip that has none. Animations of one file may move
    /// different joints of it: the skeleton of a clip is extended by the joints that other clips of its file have.
    pub(crate) fn new(chosen: &ChosenSkeleton, clips: &[Clip]) -> PyResult<Option<Self>> {
        let Some(first) = ListedClip::all(clips).next() else {
            return Err(input("clips: give at least one"));
        };
        let (clip, offsets) = match chosen {
            ChosenSkeleton::First => (first.clip, OffsetSource::Clip),
            ChosenSkeleton::Clip(clip) if clip.motion.lacks_offsets() => (clip, OffsetSource::Clip),
            ChosenSkeleton::Clip(clip) => (clip, OffsetSource::Skeleton),
            ChosenSkeleton::Arrays(parents, offsets) => {
                let at_zero = || vec![Vec3::ZERO; parents.len()];
                let positions = offsets.clone().unwrap_or_else(at_zero);
                let names = [SKELETON, &*first.to_string()];
                let made = ClipSkeleton::of_arrays(parents, &positions, &first.clip.motion, names);
                return Ok(Some(Self {
                    skeleton: made.map_err(|error| input(error.to_string()))?,
                    offsets: match offsets {
                        Some(_) => OffsetSource::Skeleton,
                        None => OffsetSource::Clip,
                    },
                    file: None,
                }));
            }
        };
        if clip.motion.skeleton.is_empty() {
            return Ok(None);
        }
        let mut shared = Self {
            skeleton: ClipSkeleton::of(&clip.motion),
            offsets,
            file: clip.source.clone(),
        };
        for listed in ListedClip::all(clips) {
            if shared.is_of_file(listed.clip) {
                let names = [SKELETON, &*listed.to_string()];
                let extended = shared.skeleton.extend(&listed.clip.motion, names);
                extended.map_err(|error| input(error.to_string()))?;
            }
        }
        Ok(Some(shared))
    }

    /// Whether a clip comes from the file of the skeleton, and was read with the same options.
    fn is_of_file(&self, clip: &Clip) -> bool {
        let (Some(file), Some(source)) = (&self.file, &clip.source) else {
            return false;
        };
        let is_same = Arc::ptr_eq(file, source)
            || file.path == source.path && file.adjustment.is_none() && source.adjustment.is_none();
        is_same && !clip.motion.skeleton.is_empty()
    }

    /// The skeleton in the form that the engine's library takes.
    pub(crate) fn of_engine(&self) -> PyResult<Skeleton> {
        let made = self.skeleton.of_engine();
        made.map_err(|error| input(format!("skeleton: {error}")))
    }

    /// The names of the joints.
    pub(crate) fn names(&self) -> &[String] {
        self.skeleton.names()
    }

    /// The tracks of a clip in the order of the joints.
    fn tracks<'a>(&self, listed: ListedClip<'a>) -> PyResult<Cow<'a, tumble::TrackSet>> {
        let (motion, name) = (&listed.clip.motion, listed.to_string());
        let matched = match self.is_of_file(listed.clip) {
            true => self.skeleton.some_pairs(motion, [SKELETON, &name]),
            false => self.skeleton.all_pairs(motion, [SKELETON, &name]),
        };
        let matched = matched.map_err(|error| input(error.to_string()))?;
        let fitted = (self.skeleton).tracks(motion, &matched, self.offsets, &name);
        fitted.map_err(|error| input(in_python(&error.to_string())))
    }

    /// The reason why the positions of a clip's joints are unknown; `None` if they are known.
    pub(crate) fn unplaced(&self, listed: ListedClip<'_>) -> Option<String> {
        if self.offsets == OffsetSource::Skeleton {
            return None;
        }
        let clip = listed.clip;
        let reason = match &clip.motion.no_world {
            Some(reason) => in_python(reason),
            None => {
                let has_children = (self.skeleton.joints().iter()).any(|it| it.parent.is_some());
                let is_unplaced = clip.motion.skeleton.is_empty() && has_children;
                let moves = |track| {
                    (clip.motion.set)
                        .vector_keys(Channel::Translation, track)
                        .is_some()
                };
                if !is_unplaced || (1..clip.motion.set.track_count()).any(moves) {
                    return None;
                }
                NO_OFFSETS.to_owned()
            }
        };
        Some(format!("{listed}: {reason}"))
    }
}

/// Warns that joints with equal names are matched by their order, if the clips come from several files.
pub(crate) fn order_assumption(clips: &[Clip]) -> Option<String> {
    let file = |clip: &Clip| clip.source.as_ref().map(|source| source.path.clone());
    let (first, others) = clips.split_first()?;
    if file(first).is_some() && others.iter().all(|clip| file(clip) == file(first)) {
        return None;
    }
    let mut listed = ListedClip::all(clips).filter(|_| !others.is_empty());
    listed.find_map(|it| it.clip.motion.order_assumption(&it.to_string()))
}

pub(crate) fn of_crowd(error: CrowdError) -> PyErr {
    match error {
        CrowdError::NoInverseBind => {
            input("the crowd has no inverse bind matrices; give `inverse_bind`")
        }
        error => of_engine(&Error::Crowd(error)),
    }
}

/// The tracks of a clip in the order of a library's joints, and their methods.
pub(crate) fn fitted<'a>(
    skeleton: &SharedSkeleton,
    listed: ListedClip<'a>,
    method: MethodChoice,
) -> PyResult<(Cow<'a, tumble::TrackSet>, Method, VectorMethod)> {
    let motion = &listed.clip.motion;
    let methods = ChannelMethods {
        method,
        ..ChannelMethods::AUTHORED
    };
    let (Some(of_rotations), Some(of_vectors)) =
        (methods.method_of(motion), methods.vector_method_of(motion))
    else {
        return Err(input(format!(
            "{listed}: its tracks have several methods; name one as `method`"
        )));
    };
    Ok((skeleton.tracks(listed)?, of_rotations, of_vectors))
}

/// A clip in the order of a library's joints.
fn motion_clip<'a>(
    skeleton: &SharedSkeleton,
    listed: ListedClip<'a>,
    method: MethodChoice,
) -> PyResult<MotionClip<'a>> {
    let (set, of_rotations, vectors) = fitted(skeleton, listed, method)?;
    check(&set).map_err(|error| input(format!("{listed}: {error}")))?;
    Ok(MotionClip {
        set,
        interpolation: of_rotations.into(),
        vectors,
    })
}

/// Splits clips into those that fit a library, and the indices of the others with the reasons.
fn fitting(
    skeleton: &SharedSkeleton,
    clips: Vec<Clip>,
    method: MethodChoice,
) -> PyResult<(Vec<Clip>, Vec<SkippedClip>)> {
    let mut skipped = Vec::new();
    for listed in ListedClip::all(&clips) {
        if let Err(error) = motion_clip(skeleton, listed, method) {
            let reason = Python::attach(|py| error.value(py).to_string());
            skipped.push((listed.index, reason));
        }
    }
    let mut index = 0..;
    let mut kept = clips;
    kept.retain(|_| {
        let index = index.next();
        !skipped.iter().any(|(skipped, _)| Some(*skipped) == index)
    });
    match kept.is_empty() {
        true => Err(none_fits(&skipped)),
        false => Ok((kept, skipped)),
    }
}

/// The exception for a library all of whose clips were left out.
fn none_fits(skipped: &[SkippedClip]) -> PyErr {
    input(format!(
        "no clip fits the library; the first: {}",
        skipped.first().map_or("", |(_, reason)| reason)
    ))
}

/// The ticks in a second for clips.
fn ticks_for<'a>(clips: impl IntoIterator<Item = &'a Motion>) -> u32 {
    let longest = clips.into_iter().map(length).fold(1e-3, f64::max);
    let whole = (LONGEST / longest / f64::from(TICKS)).floor().min(FINEST);
    match whole >= 1.0 {
        true => whole as u32 * TICKS,
        false => (LONGEST / longest).max(1.0) as u32,
    }
}

fn precision_of(packed: bool) -> KeyPrecision {
    match packed {
        true => KeyPrecision::Packed,
        false => KeyPrecision::Exact,
    }
}

/// The exception for a clip that does not fit the library.
pub(crate) fn of_pushed(error: CrowdError, listed: ListedClip<'_>) -> PyErr {
    match error {
        CrowdError::Stopped(_) => of_crowd(error),
        error => input(format!("{listed}: {error}")),
    }
}

/// Why a clip is not added to tables.
enum ClipFault {
    /// It cannot be made.
    NotMade(PyErr),
    /// It does not fit, or the work ended.
    NotPushed(CrowdError),
}

impl From<CrowdError> for ClipFault {
    fn from(error: CrowdError) -> Self {
        Self::NotPushed(error)
    }
}

/// Tables, with their spans and cells.
type BuiltTables = (MotionTables, Vec<[u32; 4]>, Vec<[f32; 4]>);

/// The tables of clips, each of which is made by `clip`.
fn built<'a, 'c>(
    skeleton: &Skeleton,
    (ticks_per_second, precision): (u32, KeyPrecision),
    clips: &[ListedClip<'c>],
    clip: impl Fn(usize, ListedClip<'c>) -> PyResult<MotionClip<'a>> + Sync,
) -> PyResult<BuiltTables> {
    let made = MotionBuilder::new(skeleton, ticks_per_second, precision);
    let mut builder = made.map_err(of_crowd)?;
    let engine = tumble::Engine::new(Device::Cpu).map_err(|it| of_engine(&it))?;
    let pushed = builder.push_all(&engine, clips.len(), |index| {
        clip(index, clips[index]).map_err(ClipFault::NotMade)
    });
    pushed.map_err(|(index, fault)| match fault {
        ClipFault::NotMade(error) => error,
        ClipFault::NotPushed(error) => of_pushed(error, clips[index]),
    })?;
    Ok(builder.finish())
}

#[pymethods]
impl Motions {
    /// Prepares clips by a method. All have the joints of `skeleton`, a clip or the arrays `(parents, offsets)`; `None`:
    /// those of the first clip. `skip`: clips that do not fit are left out. `packed`: keys of rotations take 8 bytes.
    #[staticmethod]
    #[pyo3(signature = (clips, skeleton, method, skip=false, packed=false))]
    fn of_clips(
        py: Python<'_>,
        clips: Vec<Clip>,
        skeleton: Option<&Bound<'_, PyAny>>,
        method: &str,
        skip: bool,
        packed: bool,
    ) -> PyResult<Self> {
        let method = method_named(method)?;
        let tracks = |clips: &[Clip]| {
            clips
                .first()
                .map_or(0, |clip| clip.motion.set.track_count())
        };
        let chosen = match skeleton {
            None => ChosenSkeleton::First,
            Some(clip) if clip.is_instance_of::<Clip>() => ChosenSkeleton::Clip(clip.extract()?),
            Some(arrays) => {
                let (parents, offsets): (ListArgument<Option<i64>>, Bound<'_, PyAny>) =
                    arrays.extract()?;
                ChosenSkeleton::of_arrays(&parents.0, Some(&offsets), tracks(&clips))?
            }
        };
        let Some(shared) = SharedSkeleton::new(&chosen, &clips)? else {
            return Err(input(
                "skeleton: the clip has no skeleton; give `skeleton`, a clip that has one, or (parents, offsets)",
            ));
        };
        let (clips, skipped) = match skip {
            true => fitting(&shared, clips, method)?,
            false => (clips, Vec::new()),
        };
        warn_of(py, order_assumption(&clips).as_slice())?;
        let reasons = ListedClip::all(&clips).map(|listed| shared.unplaced(listed));
        let reasons: Vec<_> = reasons.collect();
        let unplaced = match reasons.iter().any(Option::is_some) {
            true => reasons.into_iter().map(Option::unwrap_or_default).collect(),
            false => Vec::new(),
        };
        let joint_names = shared.names().to_vec();
        let prepared = py.detach(|| {
            stoppable(|| {
                let skeleton = shared.of_engine()?;
                let ticks = ticks_for(clips.iter().map(|clip| &*clip.motion));
                let listed: Vec<_> = ListedClip::all(&clips).collect();
                let options = (ticks, precision_of(packed));
                built(&skeleton, options, &listed, |_, listed| {
                    motion_clip(&shared, listed, method)
                })
            })
        })?;
        let (tables, spans, cells) = prepared;
        let prepared = (Tables::Skeleton(tables), spans, cells);
        Ok(Self {
            unplaced,
            skipped,
            ..Self::of_parts(py, prepared, joint_names)?
        })
    }

    /// The library with the arrays of `arrays`; `spans` and `cells` are not copied.
    #[staticmethod]
    fn of_arrays(arrays: &Bound<'_, PyDict>) -> PyResult<Self> {
        fn words<const N: usize>(
            arrays: &Bound<'_, PyDict>,
            name: &str,
        ) -> PyResult<Vec<[u32; N]>> {
            let array: PyReadonlyArray2<'_, u32> = array(arrays, name)?.extract()?;
            let chunks = array.as_slice()?.as_chunks();
            match chunks.1 {
                [] => Ok(chunks.0.to_vec()),
                _ => Err(of_crowd(CrowdError::BrokenTables)),
            }
        }
        let [sizes, ..] = words::<2>(arrays, "sizes")?[..] else {
            return Err(of_crowd(CrowdError::BrokenTables));
        };
        let of_tables = MotionWords {
            clips: words(arrays, "clips")?,
            bases: words(arrays, "bases")?,
            channels: words(arrays, "channels")?,
            links: words(arrays, "links")?,
            joint_count: sizes[0] as usize,
            ticks_per_second: sizes[1],
        };
        let spans = array(arrays, "spans")?.cast_into::<PyArray2<u32>>()?;
        let cells = array(arrays, "cells")?.cast_into::<PyArray2<f32>>()?;
        let tables = {
            let (spans, cells) = (spans.try_readonly()?, cells.try_readonly()?);
            let parts = (spans.as_slice()?.as_chunks(), cells.as_slice()?.as_chunks());
            if !(parts.0.1.is_empty() && parts.1.1.is_empty()) {
                return Err(of_crowd(CrowdError::BrokenTables));
            }
            let tables = || MotionTables::new(of_tables, (parts.0.0, parts.1.0)).map_err(of_crowd);
            let tables = spans.py().detach(|| stoppable(tables))?;
            match arrays.contains(TREE_FRAMES)? {
                false => Tables::Skeleton(tables),
                true => {
                    let bodies = words::<2>(arrays, TREE_BODIES)?;
                    let scalars = words::<1>(arrays, TREE_SCALARS)?;
                    let [[w_first], scalars @ ..] = &scalars[..] else {
                        return Err(of_crowd(CrowdError::BrokenTables));
                    };
                    let frames = TreeFrames::of_words(&FrameWords {
                        frames: words(arrays, TREE_FRAMES)?,
                        bodies,
                        scalars: scalars.as_flattened().to_vec(),
                        is_w_first: *w_first != 0,
                    });
                    Tables::Robot(BodyTables::new(tables, frames).map_err(of_crowd)?)
                }
            }
        };
        let texts = |name: &str| match arrays.get_item(name)? {
            Some(array) => array.call_method0("tolist")?.extract::<Vec<String>>(),
            None => Ok(Vec::new()),
        };
        Ok(Self {
            tables,
            spans: spans.unbind(),
            cells: cells.unbind(),
            unplaced: texts("unplaced")?,
            joint_names: texts("joint_names")?,
            body_names: texts("body_names")?,
            skipped: Vec::new(),
        })
    }

    /// Everything, as arrays; with `clips`, only of these clips, in this order.
    #[pyo3(signature = (clips=None))]
    fn arrays<'py>(
        &self,
        py: Python<'py>,
        clips: Option<ListArgument<usize>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let found = match clips {
            None => {
                let parts = [self.spans.bind(py).as_any(), self.cells.bind(py).as_any()];
                arrays_of(py, self.tables.motions().words(), parts)?
            }
            Some(ListArgument(clips)) => {
                let (tables, spans, cells) = self.with_parts(py, |tables, parts| {
                    guarded(|| tables.select(parts, &clips).map_err(of_crowd))
                })?;
                let (spans, cells) = (spans_array(py, spans)?, cells_array(py, cells)?);
                arrays_of(py, tables.words(), [spans.as_any(), cells.as_any()])?
            }
        };
        if let Tables::Robot(tables) = &self.tables {
            let words = tables.frames().words();
            put(&found, TREE_FRAMES, words.frames)?;
            put(&found, TREE_BODIES, words.bodies)?;
            let scalars = [u32::from(words.is_w_first)]
                .into_iter()
                .chain(words.scalars);
            put(&found, TREE_SCALARS, scalars.map(|word| [word]).collect())?;
        }
        Ok(found)
    }

    /// Number of clips.
    fn __len__(&self) -> usize {
        self.tables.motions().clip_count()
    }

    /// Number of ticks in a second.
    #[getter]
    fn ticks_per_second(&self) -> u32 {
        self.tables.motions().ticks_per_second()
    }

    /// Number of joints.
    #[getter]
    pub(crate) fn joints(&self) -> usize {
        self.tables.motions().joint_count()
    }

    /// The parent of each joint.
    #[getter]
    fn parents(&self) -> Vec<Option<usize>> {
        self.tables.motions().parents()
    }

    /// Fills arrays: rotations, positions, world rotations, velocities and angular velocities, each None
    /// where it is left out. `frames`: the rates and the lengths of all clips, if velocities are to be differences between
    /// two frames.
    #[allow(clippy::too_many_arguments, reason = "five arrays")]
    #[pyo3(signature = (
        engine, clip_ids, times, rotations, positions, world_rotations, velocities, angular_velocities, frames=None
    ))]
    fn sample(
        &self,
        py: Python<'_>,
        engine: &Bound<'_, Engine>,
        clip_ids: PyReadonlyArray1<'_, i64>,
        times: PyReadonlyArray1<'_, f64>,
        rotations: Option<&Bound<'_, PyArrayDyn<f32>>>,
        positions: Option<&Bound<'_, PyArrayDyn<f32>>>,
        world_rotations: Option<&Bound<'_, PyArrayDyn<f32>>>,
        velocities: Option<&Bound<'_, PyArrayDyn<f32>>>,
        angular_velocities: Option<&Bound<'_, PyArrayDyn<f32>>>,
        frames: Option<(PyReadonlyArray1<'_, f64>, PyReadonlyArray1<'_, f64>)>,
    ) -> PyResult<()> {
        let at = self.instances(&clip_ids, &times)?;
        let steps = match &frames {
            Some((rates, lengths)) => {
                let frames = (rates.as_slice()?, lengths.as_slice()?);
                Some(self.steps(&at, &times, frames)?)
            }
            None => None,
        };
        if positions.is_some() || velocities.is_some() {
            self.check_placed(&at)?;
        }
        let (spans, cells) = (
            self.spans.bind(py).try_readonly()?,
            self.cells.bind(py).try_readonly()?,
        );
        let tables = (
            spans.as_slice()?.as_chunks().0,
            cells.as_slice()?.as_chunks().0,
        );
        let mut outputs = [
            rotations,
            positions,
            world_rotations,
            velocities,
            angular_velocities,
        ]
        .into_iter()
        .map(|array| array.map(PyArrayMethods::try_readwrite).transpose())
        .collect::<Result<Vec<_>, _>>()
        .map_err(|error| input(format!("out: {error}")))?;
        let [r, p, w, v, a] = &mut outputs[..] else {
            return Ok(());
        };
        let motions = self.tables.motions();
        let joints = at.len() * motions.joint_count();
        let states = MotionStates {
            rotations: rows(r, joints)?,
            positions: rows(p, joints)?,
            world_rotations: rows(w, joints)?,
            velocities: rows(v, joints)?,
            angular_velocities: rows(a, joints)?,
        };
        let engine = engine.get().engine_for(1)?;
        let work = || {
            let sampled = match &steps {
                Some(steps) => motions.differences_into(&engine, tables, &at, steps, states),
                None => motions.sample_into(&engine, tables, &at, states),
            };
            sampled.map_err(of_crowd)
        };
        py.detach(|| match joints < MANY {
            true => guarded(work),
            false => stoppable(work),
        })
    }
}

impl Motions {
    /// The library of tables, all of whose clips have positions.
    fn of_parts(
        py: Python<'_>,
        (tables, spans, cells): (Tables, Vec<[u32; 4]>, Vec<[f32; 4]>),
        joint_names: Vec<String>,
    ) -> PyResult<Self> {
        Ok(Self {
            tables,
            spans: spans_array(py, spans)?.unbind(),
            cells: cells_array(py, cells)?.unbind(),
            unplaced: Vec::new(),
            joint_names,
            body_names: Vec::new(),
            skipped: Vec::new(),
        })
    }

    /// Runs work on the tables without the interpreter's lock.
    pub(crate) fn with_parts<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&MotionTables, (&[[u32; 4]], &[[f32; 4]])) -> PyResult<T> + Send,
    ) -> PyResult<T> {
        let spans = self.spans.bind(py).try_readonly()?;
        let cells = self.cells.bind(py).try_readonly()?;
        let spans = spans.as_slice()?.as_chunks().0;
        let cells = cells.as_slice()?.as_chunks().0;
        py.detach(|| work(self.tables.motions(), (spans, cells)))
    }

    /// Fails if positions are requested of a clip whose joints have none.
    pub(crate) fn check_placed(&self, at: &[(u32, u32)]) -> PyResult<()> {
        let reasons = at.iter().map(|&(clip, _)| self.unplaced.get(clip as usize));
        match reasons.flatten().find(|reason| !reason.is_empty()) {
            None => Ok(()),
            Some(reason) => Err(input(format!(
                "{reason}; or give `skeleton`, or `arrays` without positions and velocities"
            ))),
        }
    }

    /// The two frames around the time of each instance, for the rate of its clip.
    pub(crate) fn steps(
        &self,
        at: &[(u32, u32)],
        times: &PyReadonlyArray1<'_, f64>,
        (rates, lengths): (&[f64], &[f64]),
    ) -> PyResult<Vec<FrameStep>> {
        let per_second = f64::from(self.tables.motions().ticks_per_second());
        let step = |(&(clip, _), &time): (&(u32, u32), &f64)| {
            let (rate, length) = (rates[clip as usize], lengths[clip as usize]);
            // A time within a millionth of a frame counts as at the frame.
            let frame = (time.clamp(0.0, length) * rate + 1e-6).floor();
            let first = frame.min(((length * rate).round() - 1.0).max(0.0));
            FrameStep {
                ticks: [first, first + 1.0].map(|frame| (frame / rate * per_second).round() as u32),
                per_second: rate as f32,
            }
        };
        match rates.len() == self.tables.motions().clip_count() && lengths.len() == rates.len() {
            true => Ok(at.iter().zip(times.as_array()).map(step).collect()),
            false => Err(input("frames: give a rate and a length for each clip")),
        }
    }

    /// The clip and the tick of each instance; times outside of a clip are its ends.
    pub(crate) fn instances(
        &self,
        clip_ids: &PyReadonlyArray1<'_, i64>,
        times: &PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Vec<(u32, u32)>> {
        let (ids, times) = (clip_ids.as_array(), times.as_array());
        if ids.len() != times.len() {
            return Err(input(format!(
                "times: there are {} for {} clip_ids",
                times.len(),
                ids.len()
            )));
        }
        let per_second = f64::from(self.tables.motions().ticks_per_second());
        let one = |(index, (&clip, &time)): (usize, (&i64, &f64))| {
            let ticks = u32::try_from(clip).ok();
            let ticks =
                ticks.and_then(|clip| Some((clip, self.tables.motions().ticks(clip as usize)?)));
            let Some((clip, ticks)) = ticks else {
                let count = self.tables.motions().clip_count();
                return Err(input(format!(
                    "clip_ids[{index}]: there is no clip {clip}; there are {count}, from 0"
                )));
            };
            if time.is_nan() {
                return Err(input(format!("times[{index}]: it is not a number")));
            }
            let tick = (time * per_second).round().clamp(0.0, f64::from(ticks));
            Ok((clip, tick as u32))
        };
        ids.iter().zip(times.iter()).enumerate().map(one).collect()
    }
}

/// Fills an array with `rotations`, (…, 4), x y z w, in another representation: "rotvec" (…, 3), or that of an encoding,
/// such as "matrix" (…, 3, 3) or "6d" (…, 6). They are computed on the threads of the engine.
#[pyfunction]
pub(crate) fn represent(
    engine: &Bound<'_, Engine>,
    rotations: &Bound<'_, PyArrayDyn<f32>>,
    kind: &str,
    out: &Bound<'_, PyArrayDyn<f32>>,
) -> PyResult<()> {
    let engine = engine.get().engine_for(1)?;
    if kind == "rotvec" {
        return write_vectors(&engine, rotations, out);
    }
    let encoding = encoding_named(kind, EncodingOptions::default())?;
    let read = rotations.try_readonly()?;
    let quaternions = read.as_slice()?.as_chunks().0;
    filled(out, |numbers| {
        let encoded = engine.encode(quaternions, encoding, bytemuck::cast_slice_mut(numbers));
        encoded.map_err(|error| of_engine(&error))
    })
}

/// Moves the w of quaternions, (…, 4), before x y z.
#[pyfunction]
pub(crate) fn put_w_first(quaternions: &Bound<'_, PyArrayDyn<f32>>) -> PyResult<()> {
    filled(quaternions, |numbers| {
        let (quaternions, _) = numbers.as_chunks_mut();
        for quaternion in quaternions {
            let [x, y, z, w] = *quaternion;
            *quaternion = [w, x, y, z];
        }
        Ok(())
    })
}

/// The memory of an output as rows, one for each joint.
pub(crate) fn rows<'a, const N: usize>(
    of: &'a mut Option<PyReadwriteArrayDyn<'_, f32>>,
    joints: usize,
) -> PyResult<&'a mut [[f32; N]]> {
    let Some(array) = of else {
        return Ok(&mut []);
    };
    if array.shape().last() != Some(&N) || array.len() != N * joints {
        return Err(input(format!(
            "out: an array of shape {:?} for {joints} joints with {N} numbers each",
            array.shape()
        )));
    }
    Ok(array.as_slice_mut()?.as_chunks_mut().0)
}

fn spans_array(py: Python<'_>, spans: Vec<[u32; 4]>) -> PyResult<Bound<'_, PyArray2<u32>>> {
    let count = spans.len();
    PyArray1::from_vec(py, spans.into_flattened()).reshape([count, 4])
}

fn cells_array(py: Python<'_>, cells: Vec<[f32; 4]>) -> PyResult<Bound<'_, PyArray2<f32>>> {
    let count = cells.len();
    PyArray1::from_vec(py, cells.into_flattened()).reshape([count, 4])
}

/// Arrays in which a file has the tree of a robot: its frames, its bodies, and its scalars behind whether w is first.
const TREE_FRAMES: &str = "tree_frames";
const TREE_BODIES: &str = "tree_bodies";
const TREE_SCALARS: &str = "tree_scalars";

fn put<const N: usize>(
    found: &Bound<'_, PyDict>,
    name: &str,
    words: Vec<[u32; N]>,
) -> PyResult<()> {
    let count = words.len();
    let flat = PyArray1::from_vec(found.py(), words.into_flattened());
    found.set_item(name, flat.reshape([count, N])?)
}

/// Small tables, and the spans and cells that belong to them, as arrays by their names.
fn arrays_of<'py>(
    py: Python<'py>,
    words: MotionWords,
    [spans, cells]: [&Bound<'py, PyAny>; 2],
) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    put(&found, "clips", words.clips)?;
    put(&found, "bases", words.bases)?;
    put(&found, "channels", words.channels)?;
    put(&found, "links", words.links)?;
    let sizes = [words.joint_count as u32, words.ticks_per_second];
    put(&found, "sizes", vec![sizes])?;
    found.set_item("spans", spans)?;
    found.set_item("cells", cells)?;
    Ok(found)
}

fn array<'py>(arrays: &Bound<'py, PyDict>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    let found = arrays.get_item(name)?;
    found.ok_or_else(|| input(format!("not a motion library: there is no array `{name}`")))
}

fn length(motion: &Motion) -> f64 {
    motion
        .set
        .time_span()
        .map_or(0.0, |(first, last)| last - first)
}

/// Fails if a clip has scales, because positions along the skeleton would silently ignore them.
fn check(set: &tumble::TrackSet) -> Result<(), &'static str> {
    let has_scales = |track| set.vector_keys(Channel::Scale, track).is_some();
    match (0..set.track_count()).any(has_scales) {
        true => {
            Err("it has scale keys or joints that rest scaled, which a motion library cannot store")
        }
        false => Ok(()),
    }
}
