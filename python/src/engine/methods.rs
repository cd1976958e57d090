//! The methods of `tumble.Engine`.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};
use tumble::method::BESSEL_OVERHAUSER;
use tumble::{
    Axes, Device, Encoding, EncodingOptions, Interpolation, Layout, MatrixOrder, Quantity,
};
use tumble_cli::host;

use crate::arrays::{ListArgument, Order, whole_number};
use crate::clip::Clip;
use crate::engine::{
    Engine, EngineArguments, MIN_DEVICE_ROTATIONS, axes_named, layout_named, of_host,
    sequence_named,
};
use crate::errors::{guarded, input, of_engine};
use crate::evaluate::OutputForm;
use crate::follow;
use crate::names::{option_named, option_of};
use crate::options::{EvaluationKeywords, method_named, request_arrays, samples_of};
use crate::output::{encoding_named, quaternions_of};
use crate::poses;
use crate::robot::{self, BodyNames, JointKeys, Robot};
use crate::run::{interruptible, stoppable};
use crate::samples;
use crate::scalars;
use crate::stream::Chunks;
use crate::verify::Verification;

#[pymethods]
impl Engine {
    #[new]
    #[pyo3(signature = (device=None, *, memory=None, threads=None, allow_inexact=false, cache=None))]
    pub(crate) fn new(
        py: Python<'_>,
        device: Option<&Bound<'_, PyAny>>,
        memory: Option<&Bound<'_, PyAny>>,
        threads: Option<&Bound<'_, PyAny>>,
        allow_inexact: bool,
        cache: Option<PathBuf>,
    ) -> PyResult<Self> {
        let name = match device {
            None => "auto".to_owned(),
            Some(name) if name.is_instance_of::<PyString>() => name.extract()?,
            Some(index) => {
                let meaning = "the name of a device, or its index";
                whole_number::<u64>(index, "device", meaning)?.to_string()
            }
        };
        let memory = memory
            .map(|it| whole_number(it, "memory", "bytes"))
            .transpose()?;
        let threads = threads
            .map(|it| whole_number(it, "threads", "a number of threads"))
            .transpose()?;
        let is_auto = name.eq_ignore_ascii_case("auto");
        let arguments = EngineArguments {
            device: name.clone(),
            memory,
            threads,
            allow_inexact,
            cache,
        };
        let options = arguments.options();
        let engine = match is_auto {
            true => py.detach(|| {
                guarded(|| {
                    let engine = tumble::Engine::with_options(Device::Cpu, &options);
                    engine.map_err(|error| of_engine(&error))
                })
            })?,
            // Opening a device may take seconds, so Ctrl-C must be able to interrupt it.
            false => interruptible(py, move || {
                host::open(&name, &options).map_err(|failure| of_host(&failure))
            })?,
        };
        Ok(Self {
            engine,
            by_cost: is_auto.then(OnceLock::new),
            arguments,
        })
    }

    /// The name of the device. With "auto", it is the device for small calls.
    #[getter]
    fn device(&self) -> &str {
        self.engine.device_name()
    }

    /// Copies are engines of their own with the same options, opened where they are used: in another
    /// process that is its device of that name.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        let arguments = &slf.get().arguments;
        let options = PyDict::new(py);
        options.set_item("memory", arguments.memory)?;
        options.set_item("threads", arguments.threads)?;
        options.set_item("allow_inexact", arguments.allow_inexact)?;
        options.set_item(
            "cache",
            arguments.cache.as_ref().map(|path| path.as_os_str()),
        )?;
        let class = py.get_type::<Self>();
        let again = py.import("functools")?.getattr("partial")?;
        let again = again.call((class, &arguments.device), Some(&options))?;
        PyTuple::new(py, [again, PyTuple::empty(py).into_any()])
    }

    /// Returns the engine itself: engines are immutable and may be shared.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __repr__(&self) -> String {
        match &self.by_cost {
            None => format!("Engine('{}')", self.engine.device_name()),
            Some(large) => match large.get() {
                Some((_, large)) => format!(
                    "Engine('auto': CPU; {} for large calls)",
                    large.device_name()
                ),
                None => "Engine('auto': CPU)".to_owned(),
            },
        }
    }

    /// The rotation of every track at every sample, written by the engine into NumPy's memory:
    /// float32, (tracks, frames, 4), unit quaternions.
    ///
    /// Which samples are evaluated:
    ///
    /// * `fps`: the frames of this rate (use "30000/1001", not 29.97), with `start` and `end` in seconds; by default
    ///   from the first key to the last.
    /// * `at` (or `times`): times in seconds instead, in any order: one list for all tracks, (tracks, frames), or a
    ///   list with an array for each track. A single time gives a result without the axis of frames; lists of different
    ///   lengths give a list of arrays.
    ///
    /// The form of the result:
    ///
    /// * `out`: a C-contiguous array of the result's type and shape, which is filled and returned.
    /// * `order`: the order of the result's components, "xyzw" or "wxyz".
    /// * `layout`: "frame" gives (frames, tracks, 4).
    /// * `as_rotation`: a `Rotation` of SciPy's for each track.
    /// * `dtype`: "float16" has half the size, within 2.5e-4 of each component; "int16", to be divided by 32767, within
    ///   1.6e-5.
    /// * `device_array`: the result stays on the NVIDIA card that makes it, as a `DeviceArray` that torch, CuPy and JAX
    ///   take without a copy. Raises `DeviceError` if this is not possible.
    ///
    /// The interpolation:
    ///
    /// * `method`: "authored" is the interpolation that the file states for each channel. If the file states none, it
    ///   is slerp for BVH and bessel-overhauser for other formats. See `tumble.methods()`.
    /// * `signs`: "shortest" or "as-authored".
    /// * `ends`: "parabolic", "natural", "clamped", "secant", "loop", "frozen", or angular velocities (2, 3) in rad/s.
    /// * `speed`: "as-keyed" or "constant".
    /// * `before` and `after`: "hold", "loop", "mirror", "extrapolate" or "leave-out" (no samples there).
    /// * `tension`, `continuity` and `bias`.
    ///
    /// >>> import numpy as np, tumble
    /// >>> clip = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
    /// >>> out = np.empty((1, 25, 4), np.float32)
    /// >>> tumble.Engine().evaluate(clip, fps=24, method="slerp", out=out) is out
    /// True
    #[pyo3(signature = (clip, *, out=None, order="xyzw", layout="track", as_rotation=false, dtype=None, device_array=false, **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, out=None, order='xyzw', layout='track', as_rotation=False, dtype='float32', device_array=False)")]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    pub(crate) fn evaluate<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        out: Option<&Bound<'py, PyAny>>,
        order: &str,
        layout: &str,
        as_rotation: bool,
        dtype: Option<&Bound<'py, PyAny>>,
        device_array: bool,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let result = OutputForm {
            encoding: dtype.map_or(Ok(Encoding::F32), quaternions_of)?,
            order: Order::named(order)?,
            layout: layout_named(layout)?,
            as_rotation,
            on_card: device_array,
            ..OutputForm::default()
        };
        self.result(clip, &result, out, options)
    }

    /// The joints and bodies of a robot at samples of a motion: a dict of float32 arrays with the names of mjlab's
    /// files, `joint_pos` and `joint_vel` (frames, joints), `body_pos_w` (frames, bodies, 3), `body_quat_w` (…, 4),
    /// `body_lin_vel_w` and `body_ang_vel_w` (…, 3), in the world.
    ///
    /// `joint_pos`: (keys, joints), for `joint_names`, by default those of the robot. `root_pos`, `root_quat`: (keys,
    /// 3) and (keys, 4), the pose of the free joint, or of the first body of a robot without one. Keys are at
    /// `source_fps`, or at `source_times` in seconds.
    /// `order`: "wxyz" or "xyzw", of keys and results; it has no default, because files differ. `body_order`,
    /// `siblings` and `velocity_at` are those of `Robot.forward`. Samples and `method` are those of `evaluate`.
    ///
    /// Joints are interpolated, and bodies follow from them. Velocities are derivatives of the curves. Angles of
    /// hinges without limits are unwrapped first. Joints without keys stay where the file has them, and joints that
    /// leave their limits are reported, both as warnings.
    ///
    /// >>> import pathlib, tempfile, tumble
    /// >>> path = pathlib.Path(tempfile.mkdtemp(), "arm.urdf")
    /// >>> _ = path.write_text('<robot name="arm"><link name="base"/><link name="hand"/>'
    /// ...     '<joint name="elbow" type="continuous"><parent link="base"/><child link="hand"/>'
    /// ...     '<axis xyz="0 0 1"/></joint></robot>')
    /// >>> robot = tumble.Robot.load(path)
    /// >>> found = tumble.Engine("cpu").bodies(robot, [[3.0], [3.5]], order="wxyz", source_fps=2, fps=4)
    /// >>> found["joint_pos"].ravel()
    /// array([3.  , 3.25, 3.5 ], dtype=float32)
    #[pyo3(signature = (robot, joint_pos, root_pos=None, root_quat=None, *, order, source_fps=None, source_times=None, joint_names=None, body_order="depth-first", siblings="file", velocity_at="origin", **options), text_signature = "($self, robot, joint_pos, root_pos=None, root_quat=None, *, order, source_fps=None, source_times=None, joint_names=None, body_order='depth-first', siblings='file', velocity_at='origin', fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None)")]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn bodies<'py>(
        &self,
        robot: &Bound<'py, Robot>,
        joint_pos: &Bound<'py, PyAny>,
        root_pos: Option<&Bound<'py, PyAny>>,
        root_quat: Option<&Bound<'py, PyAny>>,
        order: &str,
        source_fps: Option<&Bound<'py, PyAny>>,
        source_times: Option<&Bound<'py, PyAny>>,
        joint_names: Option<ListArgument<String>>,
        body_order: &str,
        siblings: &str,
        velocity_at: &str,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let keys = JointKeys {
            joint_pos,
            root_pos,
            root_quat,
            joint_names: joint_names.map(|names| names.0),
            source_fps,
            source_times,
        };
        let names = BodyNames {
            order,
            body_order,
            siblings,
            velocity_at,
        };
        robot::bodies(self, robot, &keys, &names, options)
    }

    /// The scalars of a clip, such as the angles of a robot's joints, at every sample: float32, (scalars, frames), with
    /// `layout="frame"` (frames, scalars). `quantity`: "value", "velocity" (per second: the derivative of the curve) or
    /// "acceleration". `names` chooses scalars, in this order; the default are all, in the order of `clip.scalars`. Other
    /// keywords are those of `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0], [[0, 0, 0, 1]], scalars={"knee": ([0.0, 1.0], [0.5, 0.25])})
    /// >>> tumble.Engine().scalars(clip, fps=2, method="slerp")
    /// array([[0.5  , 0.375, 0.25 ]], dtype=float32)
    #[pyo3(signature = (clip, *, quantity="value", names=None, layout="track", **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, quantity='value', names=None, layout='track')")]
    fn scalars<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        quantity: &str,
        names: Option<ListArgument<String>>,
        layout: &str,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let quantity = option_of(PyString::new(clip.py(), quantity).as_any(), "quantity")?;
        let names = names.map(|names| names.0);
        scalars::evaluate(
            self,
            clip,
            (quantity, names, layout_named(layout)?),
            options,
        )
    }

    /// The angular velocity of every track at every sample: float32, (tracks, frames, 3) in rad/s, about the axes of
    /// the "body" or of its "parent". With "world" it is the angular velocity of the joint in the world, along the
    /// skeleton, about the world's axes. For a track without a parent, "parent" and "world" are the same. All other
    /// keywords are as in `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
    /// >>> tumble.Engine().velocity(clip, at=[1.0], method="slerp").round(4)
    /// array([[[0.    , 0.    , 1.5708]]], dtype=float32)
    #[pyo3(signature = (clip, *, axes="body", out=None, layout="track", device_array=false, **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, axes='body', out=None, layout='track', device_array=False)")]
    fn velocity<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        axes: &str,
        out: Option<&Bound<'py, PyAny>>,
        layout: &str,
        device_array: bool,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (axes, in_world) = axes_named(axes)?;
        let quantity = Quantity::Velocity(axes);
        let layout = layout_named(layout)?;
        let result = OutputForm::of_rates(quantity, in_world, layout, device_array);
        self.result(clip, &result, out, options)
    }

    /// The angular acceleration in rad/s²; otherwise as `velocity`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
    /// >>> tumble.Engine().acceleration(clip, at=[1.0], method="slerp").shape
    /// (1, 1, 3)
    #[pyo3(signature = (clip, *, axes="body", out=None, layout="track", device_array=false, **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, axes='body', out=None, layout='track', device_array=False)")]
    fn acceleration<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        axes: &str,
        out: Option<&Bound<'py, PyAny>>,
        layout: &str,
        device_array: bool,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (axes, in_world) = axes_named(axes)?;
        let quantity = Quantity::Acceleration(axes);
        let layout = layout_named(layout)?;
        let result = OutputForm::of_rates(quantity, in_world, layout, device_array);
        self.result(clip, &result, out, options)
    }

    /// The rotations as matrices for column vectors: float32, (tracks, frames, 3, 3), or with `columns=4`
    /// (tracks, frames, 3, 4), whose last column, the translation, is 0. Other keywords are those of `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
    /// >>> tumble.Engine().matrices(clip, at=2.0)[0].round(3)
    /// array([[-1.,  0.,  0.],
    ///        [ 0., -1.,  0.],
    ///        [ 0.,  0.,  1.]], dtype=float32)
    #[pyo3(signature = (clip, *, columns=3, out=None, layout="track", device_array=false, **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, columns=3, out=None, layout='track', device_array=False)")]
    fn matrices<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        columns: u32,
        out: Option<&Bound<'py, PyAny>>,
        layout: &str,
        device_array: bool,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let result = OutputForm {
            encoding: match columns {
                3 => Encoding::Matrix3x3(MatrixOrder::RowMajor),
                4 => Encoding::Matrix3x4(MatrixOrder::RowMajor),
                _ => return Err(input(format!("columns: expected 3 or 4, not {columns}"))),
            },
            layout: layout_named(layout)?,
            on_card: device_array,
            ..OutputForm::default()
        };
        self.result(clip, &result, out, options)
    }

    /// The rotations as axes and angles: float32, (tracks, frames, 4), x y z of the axis, a unit vector, and
    /// the angle, 0 to 360 degrees, or radians. Other keywords are those of `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
    /// >>> tumble.Engine().axis_angle(clip, at=1.0, method="slerp").round(3)
    /// array([[ 0.,  0.,  1., 90.]], dtype=float32)
    #[pyo3(signature = (clip, *, degrees=true, out=None, layout="track", **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, degrees=True, out=None, layout='track')")]
    fn axis_angle<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        degrees: bool,
        out: Option<&Bound<'py, PyAny>>,
        layout: &str,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let result = OutputForm {
            encoding: Encoding::AxisAngle,
            radians: !degrees,
            layout: layout_named(layout)?,
            ..OutputForm::default()
        };
        self.result(clip, &result, out, options)
    }

    /// The rotations as Euler angles: float32, (tracks, frames, 3), degrees or radians. `sequence`
    /// is as SciPy has it: "XYZ" about turned axes (intrinsic), "xyz" about fixed ones (extrinsic).
    /// Other keywords are those of `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
    /// >>> tumble.Engine().euler(clip, at=1.0, sequence="ZXY", method="slerp").round(3)
    /// array([[90.,  0.,  0.]], dtype=float32)
    #[pyo3(signature = (clip, *, sequence="XYZ", degrees=true, out=None, layout="track", **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, sequence='XYZ', degrees=True, out=None, layout='track')")]
    fn euler<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        sequence: &str,
        degrees: bool,
        out: Option<&Bound<'py, PyAny>>,
        layout: &str,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let result = OutputForm {
            encoding: Encoding::Euler(sequence_named(sequence)?),
            radians: !degrees,
            layout: layout_named(layout)?,
            ..OutputForm::default()
        };
        self.result(clip, &result, out, options)
    }

    /// The rotations as rotation vectors: float32, (tracks, frames, 3), the axis times the angle in radians, at most
    /// pi, as SciPy's `as_rotvec` and the poses of SMPL. Other keywords are those of `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
    /// >>> tumble.Engine().rotation_vectors(clip, at=1.0, method="slerp").round(4)
    /// array([[0.    , 0.    , 1.5708]], dtype=float32)
    #[pyo3(signature = (clip, *, out=None, layout="track", **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, out=None, layout='track')")]
    fn rotation_vectors<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        out: Option<&Bound<'py, PyAny>>,
        layout: &str,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let result = OutputForm {
            as_vectors: true,
            layout: layout_named(layout)?,
            ..OutputForm::default()
        };
        self.result(clip, &result, out, options)
    }

    /// The rotations in the representation of that name: "f32", "f16", "snorm16", "axis-angle", "matrix", "matrix-3x4",
    /// "euler" … (`tumble.encodings()`), an array (tracks, frames, …). Every device gives the same bits.
    ///
    /// `major`: "row" or "column", the order of matrices. `sequence`: the axes of Euler angles. `degrees=False`: angles
    /// in radians. `device_array` and the other keywords are those of `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
    /// >>> tumble.Engine().encoded(clip, "matrix-3x4", fps=30, major="column").shape
    /// (1, 61, 4, 3)
    /// >>> tumble.Engine().encoded(clip, "axis-angle", at=1.0, method="slerp").round(3)
    /// array([[ 0.,  0.,  1., 90.]], dtype=float32)
    #[pyo3(signature = (clip, encoding, *, major="row", sequence="XYZ", degrees=true, out=None, layout="track", device_array=false, **options), text_signature = "($self, clip, encoding, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, major='row', sequence='XYZ', degrees=True, out=None, layout='track', device_array=False)")]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn encoded<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        encoding: &str,
        major: &str,
        sequence: &str,
        degrees: bool,
        out: Option<&Bound<'py, PyAny>>,
        layout: &str,
        device_array: bool,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let with = EncodingOptions::default()
            .with_order(option_named(major, "major")?)
            .with_sequence(sequence_named(sequence)?);
        let result = OutputForm {
            encoding: encoding_named(encoding, with)?,
            radians: !degrees,
            layout: layout_named(layout)?,
            on_card: device_array,
            ..OutputForm::default()
        };
        self.result(clip, &result, out, options)
    }

    /// Whole poses relative to the parents: translations (tracks, frames, 3), rotations
    /// (tracks, frames, 4), x y z w, each with the sign that continues the one before it, and scales
    /// (tracks, frames, 3), float32; translations are float64 where the clip has `origins`. Keywords are those of `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [0, 0, 1, 0]],
    /// ...                    translations=[[[0, 0, 0], [4, 0, 0]]])
    /// >>> translations, rotations, scales = tumble.Engine().poses(clip, fps=1, method="slerp")
    /// >>> translations[0]
    /// array([[0., 0., 0.],
    ///        [2., 0., 0.],
    ///        [4., 0., 0.]], dtype=float32)
    #[pyo3(signature = (clip, *, layout="track", **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, layout='track')")]
    fn poses<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        layout: &str,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        poses::local(self, clip, layout_named(layout)?, options)
    }

    /// Where the joints of a skeleton are in the world: positions (tracks, frames, 3) and rotations
    /// (tracks, frames, 4), x y z w, float32; positions are float64 where the clip has `origins`. Keywords are
    /// those of `evaluate`.
    ///
    /// >>> import tumble
    /// >>> half = 0.5 ** 0.5
    /// >>> clip = tumble.Clip([0.0], [[[0, 0, half, half]], [[0, 0, 0, 1]]],
    /// ...                    parents=[None, 0], offsets=[[0, 0, 0], [1, 0, 0]])
    /// >>> positions, rotations = tumble.Engine().world(clip, at=[0.0])
    /// >>> positions[1, 0].round(3)
    /// array([0., 1., 0.], dtype=float32)
    #[pyo3(signature = (clip, *, layout="track", **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, layout='track')")]
    fn world<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        layout: &str,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        poses::in_world(self, clip, layout_named(layout)?, options)
    }

    /// Smooths samples. Returns a float32 array of the same shape, or a clip if `samples` is a `Clip`.
    ///
    /// `samples`: evenly spaced rotations (frames, 4) or (tracks, frames, 4), or vectors with 3 components; with
    /// `layout="frame"` (frames, tracks, …). Kernels act on the steps from sample to sample, so that constant samples
    /// keep their bits and uniform motion is unchanged. `kernel`: "linear", "cubic", "box:S" and "tent:S" (S samples to
    /// either side), "gaussian:S" (standard deviation; the default is "gaussian:2") or "savitzky-golay:RADIUS:ORDER".
    /// `low_pass`: a frequency in Hz, with `fps`, the rate of the samples. The kernel is the Gaussian that halves the
    /// power of motion at this frequency. `ends`: "keep", "parabolic" (of "cubic") or "loop" (the last repeats the
    /// first).
    ///
    /// A `Clip` keeps its names, its skeleton, scales and steps; its rotations and translations are smoothed, at its keys
    /// or, where these are not even, at the frames of `fps`. If it is saved in the format of its file, all other content of
    /// the file is kept.
    ///
    /// >>> import numpy as np, tumble
    /// >>> noise = np.random.default_rng(1).normal(size=(100, 3))
    /// >>> tumble.Engine("cpu").smooth(noise, kernel="gaussian:3").std() < 0.5 * noise.std()
    /// np.True_
    #[pyo3(signature = (
        samples, *, kernel=None, low_pass=None, fps=None, passes=1, ends="keep", layout="track", order="xyzw", out=None
    ), text_signature = "($self, samples, *, kernel=None, low_pass=None, fps=None, passes=1, ends='keep', layout='track', order='xyzw', out=None)")]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn smooth<'py>(
        &self,
        samples: &Bound<'py, PyAny>,
        kernel: Option<&str>,
        low_pass: Option<f64>,
        fps: Option<&Bound<'py, PyAny>>,
        passes: u32,
        ends: &str,
        layout: &str,
        order: &str,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let options = samples::Smooth {
            kernel,
            low_pass,
            fps,
            passes,
            ends,
        };
        let form = (layout_named(layout)?, Order::named(order)?);
        if let Ok(clip) = samples.cast::<Clip>() {
            if out.is_some() || form != (Layout::TrackMajor, Order::Xyzw) {
                return Err(input(
                    "a smoothed clip is a clip; leave out `layout`, `order` and `out`",
                ));
            }
            let clip = samples::smooth_clip(self, clip, &options)?;
            return Ok(Bound::new(samples.py(), clip)?.into_any());
        }
        samples::smooth(self, samples, &options, form, out)
    }

    /// Layers of rotations blended into one: the weighted sum of each rotation, normalised, every layer with
    /// the sign that is nearer to the first one's. Weights need not add up to 1. Arrays have no names, so tracks are
    /// combined by index: bring those of clips into one order by `Clip.names` first.
    ///
    /// `layers`: a list of arrays (…, 4), whose shapes broadcast to that of the result; `weights`: for each a number, by default
    /// 1, or an array of numbers, (…), such as one for each frame.
    ///
    /// >>> import tumble
    /// >>> tumble.Engine("cpu").blend([[[0, 0, 0, 1]], [[0, 0, 1, 0]]], [3, 3]).round(4)
    /// array([[0.    , 0.    , 0.7071, 0.7071]], dtype=float32)
    #[pyo3(signature = (layers, weights=None, *, order="xyzw", out=None))]
    fn blend<'py>(
        &self,
        layers: &Bound<'py, PyAny>,
        weights: Option<&Bound<'py, PyAny>>,
        order: &str,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let weights = samples::weights(weights)?;
        samples::blend(self, layers, weights, Order::named(order)?, out)
    }

    /// Slerp, the shorter way, from every rotation of the first array (…, 4) to that of the second, by a `weight`
    /// from 0 to 1, or an array of weights, (…), such as one for each frame. The shapes broadcast. Tracks are combined by
    /// index, as in `blend`.
    ///
    /// >>> import tumble
    /// >>> tumble.Engine("cpu").mix([0, 0, 0, 1], [0, 0, 1, 0], 0.5).round(4)
    /// array([0.    , 0.    , 0.7071, 0.7071], dtype=float32)
    /// >>> tumble.Engine("cpu").mix([0, 0, 0, 1], [0, 0, 1, 0], [0.0, 0.5]).shape
    /// (2, 4)
    #[pyo3(signature = (first, second, weight, *, order="xyzw", out=None))]
    fn mix<'py>(
        &self,
        first: &Bound<'py, PyAny>,
        second: &Bound<'py, PyAny>,
        weight: &Bound<'py, PyAny>,
        order: &str,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        samples::mix(self, [first, second], weight, Order::named(order)?, out)
    }

    /// A layer of rotations added to a base: `base · (reference⁻¹ layer)^weight`.
    ///
    /// `base` and `layer`: (frames, 4), (tracks, frames, 4), or as `layout` says. `reference`: a rotation for each track,
    /// (tracks, 4), or one, (4,); without it, the layer itself is added. `weight`: 0 to 1. Tracks are combined by index, as
    /// in `blend`.
    ///
    /// >>> import tumble
    /// >>> half = 0.5 ** 0.5
    /// >>> tumble.Engine("cpu").add([[0, 0, half, half]], [[0, 0, 1, 0]], weight=0.5).round(4) + 0.0
    /// array([[0., 0., 1., 0.]], dtype=float32)
    #[pyo3(signature = (base, layer, *, reference=None, weight=1.0, layout="track", order="xyzw", out=None))]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn add<'py>(
        &self,
        base: &Bound<'py, PyAny>,
        layer: &Bound<'py, PyAny>,
        reference: Option<&Bound<'py, PyAny>>,
        weight: f32,
        layout: &str,
        order: &str,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let form = (layout_named(layout)?, Order::named(order)?);
        samples::add(self, [base, layer], reference, weight, form, out)
    }

    /// The matrices of a skeleton's joints in the model, from its roots down: `M = M_parent T R S`, and `M B`
    /// with inverse bind matrices `B`, as vertices are skinned with. float32, (tracks, frames, 3, 4), for column
    /// vectors, the last column the translation; a view.
    ///
    /// * `rotations`: (tracks, frames, 4), or (tracks, 4) for one pose.
    /// * `parents`: the index of each track's parent, None or -1 for a root.
    /// * `offsets`: (tracks, 3).
    /// * `translations`: replace the offsets. They have the shape of the rotations with 3 components instead of 4, or
    ///   are a list with (frames, 3) or None for each track.
    /// * `scales`: in the same form as translations.
    /// * `inverse_bind`: (tracks, 3, 4) or (tracks, 4, 4).
    ///
    /// >>> import tumble
    /// >>> half = 0.5 ** 0.5
    /// >>> pose = [[0, 0, half, half], [0, 0, 0, 1]]
    /// >>> tumble.Engine("cpu").local_to_model(pose, [None, 0], [[0, 0, 0], [2, 0, 0]])[1].round(3) + 0.0
    /// array([[ 0., -1.,  0.,  0.],
    ///        [ 1.,  0.,  0.,  2.],
    ///        [ 0.,  0.,  1.,  0.]], dtype=float32)
    #[pyo3(signature = (
        rotations, parents, offsets=None, *, translations=None, scales=None, inverse_bind=None, layout="track",
        order="xyzw"
    ))]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn local_to_model<'py>(
        &self,
        rotations: &Bound<'py, PyAny>,
        parents: ListArgument<Option<i64>>,
        offsets: Option<&Bound<'py, PyAny>>,
        translations: Option<&Bound<'py, PyAny>>,
        scales: Option<&Bound<'py, PyAny>>,
        inverse_bind: Option<&Bound<'py, PyAny>>,
        layout: &str,
        order: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let poses = samples::ModelPoses {
            rotations,
            parents: parents.0,
            offsets,
            translations,
            scales,
            inverse_bind,
        };
        poses.local_to_model(self, (layout_named(layout)?, Order::named(order)?))
    }

    /// Bodies on paths: the position of each at every sample, and the rotation from its axes to the world's.
    ///
    /// * `points`: (points, 3), (tracks, points, 3), or a list with an array for each track.
    /// * `times`: seconds of the points; or None with `duration` in seconds or with `rate`, the distance covered in a
    ///   second.
    /// * `ups`: upward directions at the points, in the same form as `points`.
    /// * `method`: the curve through the points.
    /// * `ahead`: the body faces the point this far ahead instead of along the path; `look_at`: it faces a point, or
    ///   the track with this index.
    /// * `frame`: how the body is rotated about its direction, "minimal", "fixed" or "frenet", with the upward
    ///   direction `up` at the start or everywhere.
    /// * `twist`: whether the rotation that remains after a closed path (`ends="loop"`) is spread ("spread") or stays
    ///   ("free").
    /// * `speed`: "keys" or "as-keyed" (the default: the key times), "constant", or a pair of fractions of the
    ///   duration: over the first one the speed grows from 0, over the second one it falls to 0.
    /// * `forward` and `upward`: axes of the body, such as "-x".
    ///
    /// Gives positions (tracks, frames, 3), float32 (float64 far from 0), and rotations (tracks, frames, 4).
    ///
    /// >>> import tumble
    /// >>> positions, rotations = tumble.Engine("cpu").follow(
    /// ...     [0.0, 1.0, 3.0], [[0, 0, 0], [4, 0, 1], [8, 1, 0]], fps=1)
    /// >>> positions[1], rotations.shape
    /// (array([4., 0., 1.], dtype=float32), (4, 4))
    #[pyo3(signature = (
        times, points, *, fps=None, at=None, start=None, end=None, duration=None, rate=None, ups=None,
        method="bessel-overhauser", ends=None, ahead=None, look_at=None, frame=None,
        up=[0.0, 1.0, 0.0], twist=None, speed=None, forward="z", upward="y", layout="track", order="xyzw"
    ), text_signature = "($self, times, points, *, fps=None, at=None, start=None, end=None, duration=None, rate=None, ups=None, method='bessel-overhauser', ends='parabolic', ahead=None, look_at=None, frame='minimal', up=(0.0, 1.0, 0.0), twist='spread', speed='keys', forward='z', upward='y', layout='track', order='xyzw')")]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn follow<'py>(
        &self,
        times: Option<&Bound<'py, PyAny>>,
        points: &Bound<'py, PyAny>,
        fps: Option<&Bound<'py, PyAny>>,
        at: Option<Bound<'py, PyAny>>,
        start: Option<f64>,
        end: Option<f64>,
        duration: Option<f64>,
        rate: Option<f64>,
        ups: Option<&Bound<'py, PyAny>>,
        method: &str,
        ends: Option<&Bound<'py, PyAny>>,
        ahead: Option<f64>,
        look_at: Option<&Bound<'py, PyAny>>,
        frame: Option<&Bound<'py, PyAny>>,
        up: [f64; 3],
        twist: Option<&Bound<'py, PyAny>>,
        speed: Option<&Bound<'py, PyAny>>,
        forward: &str,
        upward: &str,
        layout: &str,
        order: &str,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let options = follow::FollowOptions {
            duration,
            rate,
            ups,
            method,
            ends,
            ahead,
            look_at,
            frame,
            up,
            twist,
            speed,
            forward,
            upward,
        };
        let samples = samples_of(fps, at, start, end)?;
        let form = (layout_named(layout)?, Order::named(order)?);
        follow::follow(self, (times, points), &options, samples, form)
    }

    /// The rotations in pieces of about `chunk` rotations, for results larger than memory: an
    /// iterator of `Chunk`s, in the order of the whole result. Other keywords are those of
    /// `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 9.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
    /// >>> for chunk in tumble.Engine().stream(clip, fps=1, chunk=4):
    /// ...     print(chunk.tracks, chunk.frames, chunk.rotations.shape)
    /// slice(0, 1, None) slice(0, 4, None) (1, 4, 4)
    /// slice(0, 1, None) slice(4, 8, None) (1, 4, 4)
    /// slice(0, 1, None) slice(8, 10, None) (1, 2, 4)
    #[pyo3(signature = (clip, *, chunk=1_048_576, order="xyzw", layout="track", **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, chunk=1048576, order='xyzw', layout='track')")]
    fn stream(
        &self,
        clip: &Bound<'_, Clip>,
        chunk: usize,
        order: &str,
        layout: &str,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Chunks> {
        let request = EvaluationKeywords::new(options)?;
        let form = (Order::named(order)?, layout_named(layout)?);
        let motion = &clip.get().motion;
        let engine = self.engine_for(chunk)?;
        clip.py()
            .detach(|| stoppable(|| Chunks::new(engine, motion, &request, chunk, form)))
    }

    /// Clips as rows of a record batch, in and out by Arrow: for Spark, Daft and Ray Data. `rows`, of pyarrow's or with
    /// Arrow's C interface, have `times`, a list of seconds, and `keys`, a list of 4 numbers for each time of each track.
    /// They are replaced by `tracks`, `frames` and `rotations`, track after track; other columns are kept. Keywords are
    /// those of `evaluate`. No row's result depends on the others.
    ///
    /// >>> import pyarrow, tumble
    /// >>> rows = pyarrow.table({"times": [[0.0, 1.0]], "keys": [[0, 0, 0, 1, 1, 0, 0, 0]]})
    /// >>> tumble.Engine("cpu").batch(rows, fps=2, method="slerp")["frames"].to_pylist()
    /// [3]
    #[pyo3(signature = (rows, *, order="xyzw", **options), text_signature = "($self, rows, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None, order='xyzw')")]
    fn batch<'py>(
        slf: &Bound<'py, Self>,
        rows: &Bound<'py, PyAny>,
        order: &str,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let keywords = options.map_or_else(|| Ok(PyDict::new(slf.py())), PyDictMethods::copy)?;
        keywords.set_item("order", order)?;
        let arrow = slf.py().import("tumble._arrow")?;
        arrow.call_method("batch", (slf, rows), Some(&keywords))
    }

    /// Compiles the kernels of a method on a Vulkan device in advance. Otherwise they are compiled by the first call that
    /// needs them; this takes milliseconds, with some drivers seconds. On the CPU this does nothing.
    ///
    /// >>> import tumble
    /// >>> tumble.Engine("cpu").warm(method="slerp")
    #[pyo3(signature = (*, method="bessel-overhauser"))]
    fn warm(&self, py: Python<'_>, method: &str) -> PyResult<()> {
        let method = method_named(method)?.0.unwrap_or(BESSEL_OVERHAUSER);
        let engine = self.engine_for(MIN_DEVICE_ROTATIONS)?;
        interruptible(py, move || {
            let kinds = [
                (Quantity::Rotation, Encoding::F32),
                (Quantity::Velocity(Axes::Body), Encoding::Vector),
            ];
            for (quantity, encoding) in kinds {
                let interpolation = Interpolation::from(method).with_quantity(quantity);
                let warmed = engine.warm(interpolation, encoding);
                warmed.map_err(|error| of_engine(&error))?;
            }
            Ok(())
        })
    }

    /// Compares the device with the CPU, bit by bit, and both with a reference in float64 that
    /// shares no code with them. Keywords are those of `evaluate`.
    ///
    /// >>> import tumble
    /// >>> clip = tumble.Clip([0.0, 2.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
    /// >>> found = tumble.Engine("cpu").verify(clip, fps=25, method="slerp")
    /// >>> found.differing, found.max_error < 6e-7
    /// (0, True)
    #[pyo3(signature = (clip, **options), text_signature = "($self, clip, *, fps=None, at=None, times=None, start=None, end=None, method=None, signs=None, ends=None, speed=None, before=None, after=None, tension=None, continuity=None, bias=None)")]
    fn verify(
        &self,
        clip: &Bound<'_, Clip>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Verification> {
        let request = EvaluationKeywords::new(options)?;
        let motion = &clip.get().motion;
        let (_, count) = request.resolved(motion)?;
        let engine = self.engine_for(motion.set.track_count() * count)?;
        let motion = Arc::clone(motion);
        interruptible(clip.py(), move || {
            Verification::of(&engine, &motion, &request)
        })
    }
}

impl Engine {
    fn result<'py>(
        &self,
        clip: &Bound<'py, Clip>,
        result: &OutputForm,
        out: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        guarded(|| {
            let request = EvaluationKeywords::new(options)?;
            let engine = |rotations| self.engine_for(rotations);
            let inputs = request_arrays(options)?;
            let inputs: Vec<_> = inputs.iter().collect();
            result.of(
                clip.py(),
                engine,
                &clip.get().motion,
                &request,
                out,
                &inputs,
            )
        })
    }
}
