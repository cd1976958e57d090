//! The methods of `tumble.Clip`.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tumble::names::counted;
use tumble::{Channel, Device, Engine, Layout};
use tumble_formats::join::{JoinError, join};
use tumble_formats::learning::{Mirror, mirrored};
use tumble_formats::motion::Motion;
use tumble_formats::retime::retime;
use tumble_formats::root_motion::{
    RootMotionOptions, RootMotionRule, keys_with_root_motion, root_joint, track_samples,
};
use tumble_formats::trim::trim;

use crate::arrays::{ListArgument, Order, number};
use crate::build::{ClipArguments, ClipKeys, KeysLayout, put_scalars, scalar_keys};
use crate::clip::Clip;
use crate::clip_shape::shaped;
use crate::engine::{default_engine, layout_named};
use crate::errors::{guarded, in_python, input, of_engine};
use crate::features::{axis_of, heading_source};
use crate::names::option_named;
use crate::options::frame_rate;
use crate::pickle::{is_same, state};
use crate::robot::Robot;
use crate::run::work;
use crate::sampler::Sampler;

impl PartialEq for Clip {
    /// Whether both have the same tracks, keys and skeleton, whatever files they come from.
    fn eq(&self, other: &Self) -> bool {
        is_same(&self.motion, &other.motion)
    }
}

#[pymethods]
impl Clip {
    #[new]
    #[pyo3(signature = (
        times, keys, *, order="xyzw", layout=None, name=None, names=None, parents=None, offsets=None,
        translations=None, scales=None, velocities=None, tangents=None, tcb=None, scalars=None
    ))]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn new(
        times: &Bound<'_, PyAny>,
        keys: &Bound<'_, PyAny>,
        order: &str,
        layout: Option<&str>,
        name: Option<String>,
        names: Option<ListArgument<String>>,
        parents: Option<ListArgument<Option<i64>>>,
        offsets: Option<&Bound<'_, PyAny>>,
        translations: Option<&Bound<'_, PyAny>>,
        scales: Option<&Bound<'_, PyAny>>,
        velocities: Option<&Bound<'_, PyAny>>,
        tangents: Option<&Bound<'_, PyAny>>,
        tcb: Option<&Bound<'_, PyAny>>,
        scalars: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        guarded(|| {
            let names = names.map(|names| names.0);
            let order = Order::named(order)?;
            let layout = layout.map(layout_named).transpose()?;
            let arrays = ClipKeys::new(
                times,
                keys,
                order,
                KeysLayout::Argument {
                    layout,
                    has_names: names.is_some(),
                },
            )?;
            let tracks = arrays.track_count();
            if let Some(names) = names.as_ref().filter(|names| names.len() != tracks) {
                return Err(input(format!(
                    "names: there are {} for {tracks} tracks",
                    names.len()
                )));
            }
            let arguments = ClipArguments {
                parents: parents.map(|parents| parents.0),
                offsets,
                translations,
                scales,
                velocities,
                tangents,
                tcb,
            };
            let layout = layout.unwrap_or(Layout::TrackMajor);
            let parts = arguments.read(tracks, names.as_deref(), layout)?;
            let scalars = scalar_keys(scalars)?;
            let motion = work(times.py(), arrays.key_count(), move || {
                let mut motion = arrays.clip(names.as_deref())?;
                parts.put_into(&mut motion, order)?;
                put_scalars(&mut motion, &scalars)?;
                motion.name = name;
                Ok(motion)
            })?;
            Ok(Self {
                motion: Arc::new(motion),
                source: None,
            })
        })
    }

    /// The clip's name, or None.
    #[getter]
    fn name(&self) -> Option<&str> {
        self.motion.name.as_deref()
    }

    /// The tracks' names; `box1`, `box2` … where there are none.
    #[getter]
    fn names(&self) -> Vec<String> {
        let tracks = 0..self.motion.set.track_count();
        tracks
            .map(|track| self.motion.set.track_name(track))
            .collect()
    }

    /// The index of the parent of each track, None for roots; None without a skeleton.
    #[getter]
    fn parents(&self) -> Option<Vec<Option<usize>>> {
        let skeleton = &self.motion.skeleton;
        (!skeleton.is_empty()).then(|| skeleton.iter().map(|joint| joint.parent).collect())
    }

    /// Where each track rests in its parent's frame, (tracks, 3); None without a skeleton.
    #[getter]
    fn offsets<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let skeleton = &self.motion.skeleton;
        let offsets = skeleton.iter().map(|joint| joint.rest.translation);
        if skeleton.is_empty() {
            return Ok(None);
        }
        if self.motion.origins.is_empty() {
            return vectors(py, offsets).map(Some);
        }
        let each = offsets.enumerate();
        let positions = each.map(|(track, offset)| self.motion.origin(track) + offset.as_dvec3());
        doubles(py, positions).map(Some)
    }

    /// The origin that was subtracted from the translations of each track, (tracks, 3), float64, so that f32
    /// is enough for the rest of positions such as those of maps; None where none was. Positions that the
    /// package returns or writes have it added again, in float64.
    #[getter]
    fn origins<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let tracks = 0..self.motion.set.track_count();
        match self.motion.origins.is_empty() {
            true => Ok(None),
            false => doubles(py, tracks.map(|track| self.motion.origin(track))).map(Some),
        }
    }

    /// The rate on whose frames all key times lie, a Fraction in frames per second, or None.
    #[getter]
    fn rate<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(rate) = self.motion.rate else {
            return Ok(None);
        };
        let fraction = py.import("fractions")?.getattr("Fraction")?;
        fraction.call1((rate.to_string(),)).map(Some)
    }

    /// The first and the last key time in seconds.
    #[getter]
    fn span(&self) -> (f64, f64) {
        self.motion.set.time_span().unwrap_or((0.0, 0.0))
    }

    /// Seconds from the first key to the last.
    #[getter]
    fn duration(&self) -> f64 {
        let (first, last) = self.span();
        last - first
    }

    /// How many keys all tracks have together.
    #[getter]
    fn key_count(&self) -> usize {
        self.motion.set.key_count()
    }

    /// The whole second from which the times of the clip are counted where the file's clock counts
    /// from 1970 or so; 0 for most files. `at`, `start` and `end` accept times of the file, too.
    #[getter]
    fn time_offset(&self) -> i64 {
        self.motion.time_offset
    }

    /// Whether rotations and translations are relative to the world instead of the parent.
    #[getter]
    fn is_world(&self) -> bool {
        self.motion.is_world
    }

    /// The file that it was read from, or None.
    #[getter]
    fn path(&self) -> Option<PathBuf> {
        Some(self.source.as_ref()?.path.clone())
    }

    /// A hash; clips that are equal (`==`) have the same.
    fn __hash__(&self) -> u64 {
        let set = &self.motion.set;
        let (first, last) = self.span();
        let mut hasher = DefaultHasher::new();
        (set.track_count(), set.key_count(), &self.motion.name).hash(&mut hasher);
        // Adding 0 changes -0 to +0, which is the same time.
        [first + 0.0, last + 0.0]
            .map(f64::to_bits)
            .hash(&mut hasher);
        hasher.finish()
    }

    /// The arrays of the clip, for pickles. Protocol 5 passes their memory on without a copy. The other contents of its file are not
    /// copied: a copy is saved as a clip without a file.
    fn __reduce_ex__<'py>(
        slf: &Bound<'py, Self>,
        _protocol: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        let again = py.import("tumble._tumble")?.getattr("clip_of_state")?;
        let state = guarded(|| state(py, slf.get()))?;
        PyTuple::new(py, [again, PyTuple::new(py, [state])?.into_any()])
    }

    /// Returns the clip itself: clips are immutable.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    /// The number of tracks.
    fn __len__(&self) -> usize {
        self.motion.set.track_count()
    }

    fn __repr__(&self) -> String {
        let set = &self.motion.set;
        let name = self.motion.name.as_deref();
        let name = name.map_or_else(String::new, |name| format!("{name:?}: "));
        let (first, last) = self.span();
        let rate = self.motion.rate;
        let rate = rate.map_or_else(String::new, |rate| format!(", {rate} fps"));
        format!(
            "Clip({name}{}, {}, {first} to {last} s{rate})",
            counted(set.track_count(), "track"),
            counted(set.key_count(), "key")
        )
    }

    /// The key times of a track, by its index or name: (keys,), float64 in seconds.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 0.5], [[0, 0, 0, 1], [1, 0, 0, 0]], names=["hip"])
    /// >>> clip.times("hip")
    /// array([0. , 0.5])
    fn times<'py>(
        &self,
        py: Python<'py>,
        track: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let track = self.track(track)?;
        Ok(PyArray1::from_slice(py, self.motion.set.track(track).times))
    }

    /// The keys of a track, by its index or name: (keys, 4), float32; `order` says what the
    /// components are.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 0.5], [[0, 0, 0, 1], [1, 0, 0, 0]])
    /// >>> clip.keys(0, order="wxyz")
    /// array([[1., 0., 0., 0.],
    ///        [0., 1., 0., 0.]], dtype=float32)
    #[pyo3(signature = (track, *, order="xyzw"))]
    fn keys<'py>(
        &self,
        py: Python<'py>,
        track: &Bound<'py, PyAny>,
        order: &str,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let order = Order::named(order)?;
        let track = self.track(track)?;
        let keys = self.motion.set.track(track).keys.iter();
        let numbers: Vec<f32> = keys.flat_map(|key| order.of_xyzw(key.to_array())).collect();
        let count = numbers.len() / 4;
        PyArray1::from_vec(py, numbers).reshape([count, 4])
    }

    /// The scalars, such as the angles of a robot's joints, by their names: the times of their keys in seconds (keys,),
    /// and their values (keys,), float32 (float64 where whole turns were taken off an angle).
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0], [[0, 0, 0, 1]], scalars={"knee": ([0.0, 1.0], [0.5, 0.25])})
    /// >>> clip.scalars["knee"][1]
    /// array([0.5 , 0.25], dtype=float32)
    #[getter]
    fn scalars<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (motion, all) = (&self.motion, PyDict::new(py));
        for index in 0..motion.set.scalar_count() {
            let Some(scalar) = motion.set.scalar(index) else {
                continue;
            };
            let offset = motion.time_offset as f64;
            let times: Vec<f64> = scalar.times.iter().map(|time| time + offset).collect();
            let origin = motion.scalar(index).origin;
            let values = match origin == 0.0 {
                true => PyArray1::from_slice(py, scalar.keys).into_any(),
                false => {
                    let values = scalar.keys.iter().map(|&key| f64::from(key) + origin);
                    PyArray1::from_vec(py, values.collect()).into_any()
                }
            };
            all.set_item(scalar.name, (PyArray1::from_vec(py, times), values))?;
        }
        Ok(all)
    }

    /// The translation keys of a track, by its index or name: their times (keys,) in seconds, and
    /// their values (keys, 3), float32 (float64 where the track has one of the `origins`), in the file's
    /// units; None for a track without.
    fn translations<'py>(
        &self,
        py: Python<'py>,
        track: &Bound<'py, PyAny>,
    ) -> PyResult<Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>> {
        self.vector_keys(py, Channel::Translation, track)
    }

    /// The scale keys of a track; otherwise as `translations`.
    fn scales<'py>(
        &self,
        py: Python<'py>,
        track: &Bound<'py, PyAny>,
    ) -> PyResult<Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>> {
        self.vector_keys(py, Channel::Scale, track)
    }

    /// How many frames the clip has at a rate, from its first key to its last.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [1, 0, 0, 0]])
    /// >>> clip.frames("30000/1001")
    /// 60
    fn frames(&self, fps: &Bound<'_, PyAny>) -> PyResult<usize> {
        let rate = crate::options::SampleChoice::Rate(frame_rate(fps)?, None, None);
        Ok(rate.resolved(&self.motion)?.1)
    }

    /// As `Engine.evaluate`, by an engine that is shared by all calls and chooses its device.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [1, 0, 0, 0]])
    /// >>> clip.evaluate(at=[0.0, 2.0], method="slerp")[0]
    /// array([[0., 0., 0., 1.],
    ///        [1., 0., 0., 0.]], dtype=float32)
    #[pyo3(signature = (*, out=None, order="xyzw", layout="track", as_rotation=false, dtype=None, device_array=false, **options), text_signature = "($self, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, out=None, order='xyzw', layout='track', as_rotation=False, dtype='float32', device_array=False)")]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn evaluate<'py>(
        slf: &Bound<'py, Self>,
        out: Option<&Bound<'py, PyAny>>,
        order: &str,
        layout: &str,
        as_rotation: bool,
        dtype: Option<&Bound<'py, PyAny>>,
        device_array: bool,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let engine = default_engine(slf.py())?;
        let engine = engine.get();
        engine.evaluate(
            slf,
            out,
            order,
            layout,
            as_rotation,
            dtype,
            device_array,
            options,
        )
    }

    /// The clip with some of its joints, `tracks`, by their names or indices, in this order. Their parents must be
    /// included, too, unless `collapse`: then the motion of a joint that is left out is not lost. Its child becomes a child of
    /// the nearest ancestor that is included, or a root, with the product of the rotations and translations in between, so that
    /// included joints have the same poses in the world at their keys. Such a joint has keys of translations if a joint in between
    /// turns, at the key times of all joints in the product.
    ///
    /// >>> import tumble
    /// >>> keys = [[[0, 0, 0, 1]], [[1, 0, 0, 0]], [[0, 0, 1, 0]]]
    /// >>> clip = tumble.Clip([0.0], keys, layout="track", names=["hip", "knee", "foot"], parents=[None, 0, 1],
    /// ...                    offsets=[[0, 0, 0], [0, 1, 0], [0, 1, 0]])
    /// >>> clip.select(["hip", "knee"]).names
    /// ['hip', 'knee']
    /// >>> collapsed = clip.select(["hip", "foot"], collapse=True)
    /// >>> collapsed.parents, collapsed.keys("foot"), collapsed.offsets[1]
    /// ([None, 0], array([[ 0., -1.,  0.,  0.]], dtype=float32), array([0., 0., 0.], dtype=float32))
    #[pyo3(signature = (tracks, *, collapse=false))]
    fn select(slf: &Bound<'_, Self>, tracks: &Bound<'_, PyAny>, collapse: bool) -> PyResult<Self> {
        let found = shaped(slf, None, Some(tracks), collapse, "authored")?;
        Ok(found.without_document())
    }

    /// The part of the clip from `start` to `end` (in seconds); without `start` from its first key, without `end` to
    /// its last. Keys keep their times and bits. A channel without a key at a cut gets one there, of its curve. Steps,
    /// lines and arcs stay the same; smooth curves change in the intervals next to the cuts.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 1.0, 2.0], [[0, 0, 0, 1], [1, 0, 0, 0], [0, 1, 0, 0]])
    /// >>> clip.cut(1.0, 2.0).times(0)
    /// array([1., 2.])
    #[pyo3(signature = (start=None, end=None))]
    fn cut(
        &self,
        py: Python<'_>,
        start: Option<&Bound<'_, PyAny>>,
        end: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let start = start.map(|it| number(it, "start", "seconds")).transpose()?;
        let end = end.map(|it| number(it, "end", "seconds")).transpose()?;
        let motion = self.motion.clone();
        let (start, end) = motion.range_in_set(start, end, self.span());
        let part = work(py, motion.key_count(), move || {
            let engine = Engine::new(Device::Cpu).map_err(|error| of_engine(&error))?;
            let part = trim(&motion, start, end, &engine);
            part.map_err(|error| input(in_python(&error.to_string())))
        })?;
        Ok(self.with_keys(part))
    }

    /// Returns the clip, played `speed` times as fast. The first key is moved to `start` (in seconds); without `start`,
    /// the key stays at its time. Keys keep their bits; velocities and tangents are multiplied by the speed.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [1, 0, 0, 0]])
    /// >>> clip.retime(speed=2.0, start=10.0).times(0)
    /// array([10. , 10.5])
    #[pyo3(signature = (*, speed=None, start=None))]
    fn retime(
        &self,
        py: Python<'_>,
        speed: Option<&Bound<'_, PyAny>>,
        start: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let speed = speed
            .map(|it| number(it, "speed", "a factor"))
            .transpose()?;
        let start = start.map(|it| number(it, "start", "seconds")).transpose()?;
        let motion = self.motion.clone();
        let retimed = work(py, motion.key_count(), move || {
            let retimed = retime(&motion, speed.unwrap_or(1.0), start);
            retimed.map_err(|error| input(error.to_string()))
        })?;
        Ok(self.with_keys(retimed))
    }

    /// The mirror image of the clip at the plane through the origin across `axis`, "x", "y" or "z", from left to right.
    /// Joints are exchanged with those of the same name on the other side (`features.mirror_pairs`), also if their axes at
    /// rest are no mirror images; the skeleton stays as it is. Keys keep their times. The signs of a robot's joints depend
    /// on their axes, which are those of `robot`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [0.6, 0, 0, 0.8]])
    /// >>> clip.mirrored("y") == clip, clip.mirrored("y").mirrored("y") == clip
    /// (False, True)
    #[pyo3(signature = (axis, *, robot=None))]
    fn mirrored(
        &self,
        py: Python<'_>,
        axis: &Bound<'_, PyAny>,
        robot: Option<&Bound<'_, Robot>>,
    ) -> PyResult<Self> {
        let axis = axis_of(axis)?;
        let tree = robot.map(|robot| robot.get().tree().clone());
        let motion = self.motion.clone();
        let mirrored = work(py, motion.key_count(), move || {
            let tree = tree.as_ref();
            let mirrored = mirrored(&motion, Mirror { axis, tree });
            mirrored.map_err(|error| input(error.to_string()))
        })?;
        Ok(self.with_keys(mirrored.0))
    }

    /// Several clips, one after another. Joints are matched by name, and have the order and the name of the first clip.
    /// `gap`: the seconds from the last key of a clip to the first key of the next; by default one frame, if the clips
    /// have a common rate. With `gap=0.0`, each clip must end in the pose in which the next one begins; the two poses
    /// become one key. All keys keep their bits, and those of the first clip their times. Clips that differ in their
    /// joints, offsets, scalars or interpolation are refused.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 1.0, 2.0], [[0, 0, 0, 1], [1, 0, 0, 0], [0, 1, 0, 0]])
    /// >>> tumble.Clip.concat([clip.cut(0.0, 1.0), clip.cut(1.0, 2.0)], gap=0.0) == clip
    /// True
    /// >>> tumble.Clip.concat([clip, clip]).times(0)
    /// array([0., 1., 2., 3., 4., 5.])
    #[staticmethod]
    #[pyo3(signature = (clips, *, gap=None))]
    fn concat(
        py: Python<'_>,
        clips: ListArgument<Self>,
        gap: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let gap = gap.map(|it| number(it, "gap", "seconds")).transpose()?;
        let motions: Vec<Arc<Motion>> = clips.0.into_iter().map(|clip| clip.motion).collect();
        let keys = motions.iter().map(|motion| motion.key_count()).sum();
        let joined = work(py, keys, move || {
            let motions: Vec<&Motion> = motions.iter().map(|motion| &**motion).collect();
            join(&motions, gap).map_err(|error| {
                let name = match error {
                    JoinError::NoGap | JoinError::Gap { .. } | JoinError::Apart { .. } => "gap",
                    _ => "clips",
                };
                input(format!("{name}: {error}"))
            })
        })?;
        Ok(Self {
            motion: Arc::new(joined),
            source: None,
        })
    }

    /// The clip without its motion over the ground (`rule` "in-place"), or with a joint, `root_motion`, that has it and
    /// carries the root ("extract"), at the key times of all tracks. `up` and `axis` are those of `features.heading`;
    /// `joint` names the root, by default the joint that moves and whose ancestors do not. Scalars keep their keys; cubic
    /// splines become lines.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1]] * 2, translations=[[0, 1, 0], [0, 1, 2]])
    /// >>> clip.root_motion("in-place").translations(0)[1]
    /// array([[0., 1., 0.],
    ///        [0., 1., 0.]], dtype=float32)
    /// >>> clip.root_motion("extract").parents
    /// [None, 0]
    #[pyo3(signature = (rule, *, up="y", axis=None, joint=None))]
    fn root_motion(
        &self,
        py: Python<'_>,
        rule: &str,
        up: &str,
        axis: Option<&Bound<'_, PyAny>>,
        joint: Option<String>,
    ) -> PyResult<Self> {
        let rule: RootMotionRule = option_named(rule, "rule")?;
        let options = RootMotionOptions {
            ground: option_named(up, "up")?,
            heading: heading_source(axis)?,
            joint,
        };
        let motion = self.motion.clone();
        let (treated, is_of_file) = work(py, motion.key_count(), move || {
            let refused = |error: &dyn std::fmt::Display| input(error.to_string());
            let engine = Engine::new(Device::Cpu).map_err(|error| refused(&error))?;
            let samples = track_samples(&motion, &engine).map_err(|error| refused(&error))?;
            let treated = keys_with_root_motion(&motion, &samples, &options, rule);
            let treated = treated.map_err(|error| refused(&error))?;
            // A file that is written again gets no new channels.
            let is_of_file = match rule {
                RootMotionRule::Keep => true,
                RootMotionRule::InPlace => {
                    let root = root_joint(&motion, &options).map_err(|error| refused(&error))?;
                    motion.root_has_keys(root)
                }
                RootMotionRule::Extract => false,
            };
            Ok((treated, is_of_file))
        })?;
        Ok(match is_of_file {
            true => self.with_keys(treated),
            false => Self {
                motion: Arc::new(treated),
                source: None,
            },
        })
    }

    /// A `Sampler`: it evaluates single rotations and poses, in loops that need one at a time, with the bits of
    /// `evaluate`. It prepares the clip once; the options are those of `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [1, 0, 0, 0]])
    /// >>> clip.sampler(method="slerp").pose(2.0)
    /// array([[1., 0., 0., 0.]], dtype=float32)
    #[pyo3(signature = (**options), text_signature = "($self, *, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None)")]
    fn sampler(slf: &Bound<'_, Self>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Sampler> {
        Sampler::of(slf, options)
    }

    /// Draws the components of a track over time, with its keys as dots, with matplotlib; returns the axes of
    /// matplotlib.
    ///
    /// `track` is an index or a name, by default the first track; `fps` is 120 by default; `axes` are those of
    /// matplotlib to draw on. The other options are those of `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [1, 0, 0, 0]])
    /// >>> axes = clip.plot(method="slerp")  # doctest: +SKIP
    #[pyo3(signature = (track=None, *, fps=None, axes=None, **options), text_signature = "($self, track=None, *, fps=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, axes=None)")]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        track: Option<&Bound<'py, PyAny>>,
        fps: Option<&Bound<'py, PyAny>>,
        axes: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let notebook = slf.py().import("tumble._notebook")?;
        notebook.call_method("plot", (slf, track, fps, axes), options)
    }

    /// The page of `tumble view`: the bones or boxes moving, to be looked at from any side. The last
    /// value of a notebook's cell is shown in its output; `save(path)` writes the page, `html` is
    /// its text.
    ///
    /// `methods`: the names of the methods to choose from, or "all". `height`: the height of the output in pixels.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [1, 0, 0, 0]])
    /// >>> page = clip.view(methods=["slerp"])
    /// >>> page.html.startswith("<!doctype html>")
    /// True
    #[pyo3(signature = (**options), text_signature = "($self, *, methods=None, fps=60, start=None, end=None, height=520)")]
    fn view<'py>(
        slf: &Bound<'py, Self>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let notebook = slf.py().import("tumble._notebook")?;
        notebook.call_method("view", (slf,), options)
    }
}

impl Clip {
    fn vector_keys<'py>(
        &self,
        py: Python<'py>,
        channel: Channel,
        track: &Bound<'py, PyAny>,
    ) -> PyResult<Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>> {
        let track = self.track(track)?;
        let Some(channel_keys) = self.motion.set.vector_keys(channel, track) else {
            return Ok(None);
        };
        let times = PyArray1::from_slice(py, channel_keys.times).into_any();
        let origin = self.motion.origin(track);
        if channel == Channel::Translation && origin != DVec3::ZERO {
            let positions = channel_keys.keys.iter().map(|key| origin + key.as_dvec3());
            return Ok(Some((times, doubles(py, positions)?)));
        }
        Ok(Some((
            times,
            vectors(py, channel_keys.keys.iter().copied())?,
        )))
    }
}

/// Vectors as an array (n, 3) of float64.
fn doubles(py: Python<'_>, of: impl Iterator<Item = DVec3>) -> PyResult<Bound<'_, PyAny>> {
    let numbers: Vec<f64> = of.flat_map(|vector| vector.to_array()).collect();
    let count = numbers.len() / 3;
    Ok(PyArray1::from_vec(py, numbers)
        .reshape([count, 3])?
        .into_any())
}

/// Vectors as an array (n, 3).
fn vectors(py: Python<'_>, of: impl Iterator<Item = Vec3>) -> PyResult<Bound<'_, PyAny>> {
    let numbers: Vec<f32> = of.flat_map(|vector| vector.to_array()).collect();
    let count = numbers.len() / 3;
    Ok(PyArray1::from_vec(py, numbers)
        .reshape([count, 3])?
        .into_any())
}
