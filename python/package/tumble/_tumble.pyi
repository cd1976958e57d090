import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, ClassVar, Literal, Protocol, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray
from typing_extensions import Buffer

from tumble._notebook import View

# The names for users are those in `tumble/__init__.py`. The others are used by the package's modules and tests.
__all__ = [
    "ArrayDifference",
    "ChannelDifference",
    "Chunk",
    "Chunks",
    "Clip",
    "ClipDifference",
    "ClipEvent",
    "Crowd",
    "DeviceArray",
    "DeviceMotions",
    "Engine",
    "File",
    "JointDifference",
    "Motions",
    "PassedEvent",
    "PathErrors",
    "PathStatistics",
    "Plan",
    "Record",
    "Reduction",
    "Robot",
    "Route",
    "Sampler",
    "Spread",
    "Surface",
    "Verification",
    "Walk",
    "Worker",
    "__version__",
    "clip_of_state",
    "compare",
    "contacts",
    "devices",
    "encodings",
    "evaluate",
    "file_of_state",
    "heading",
    "humanml3d",
    "input_sha256",
    "inputs_of",
    "kernels_sha256",
    "joint_partners",
    "load",
    "load_all",
    "load_drivers",
    "manifest_by_input",
    "manifest_results",
    "manifest_unfinished",
    "merge",
    "methods",
    "mirror_pairs",
    "mirrored_positions",
    "mirrored_rotations",
    "page",
    "panic",
    "path_errors",
    "positions_of_humanml3d",
    "put_w_first",
    "reduce",
    "referred_files",
    "reframe",
    "represent",
    "retarget",
    "robot_motions",
    "root_after_loops",
    "root_motion",
    "rotations_of_six",
    "run",
    "save",
    "sample_bodies",
    "scalar_motions",
    "set_probe",
    "shaped",
    "six",
    "value_of_state",
    "walk",
]
__version__: str

class _Rotation(Protocol):
    """`scipy.spatial.transform.Rotation`."""

    def as_quat(self) -> Any: ...

class _DLPack(Protocol):
    def __dlpack__(self) -> Any: ...
    def __dlpack_device__(self) -> tuple[int, int]: ...

_Array: TypeAlias = ArrayLike | Buffer | _DLPack
_Arrays: TypeAlias = _Array | Sequence[_Array]
_Keys: TypeAlias = _Arrays | _Rotation | Sequence[_Rotation]
_Rate: TypeAlias = float | str | Fraction | np.integer[Any] | np.floating[Any]
_Path: TypeAlias = str | os.PathLike[str]

# Names of options: written by `UPDATE_EXPECTED=1 cargo test -p tumble-cli --test all stubs::`
_Align: TypeAlias = Literal["none", "position", "yaw", "se3", "sim3"]
_Axes: TypeAlias = Literal["body", "parent", "world"]
_Curve: TypeAlias = Literal["linear", "bessel-overhauser", "cubic"]
_Encoding: TypeAlias = Literal[
    "f32",
    "f16",
    "snorm16",
    "axis-angle",
    "matrix",
    "matrix-3x4",
    "6d",
    "euler",
]
_EndFrame: TypeAlias = Literal["key", "hold", "leave-out"]
_Frame: TypeAlias = Literal["minimal", "fixed", "frenet"]
_Layout: TypeAlias = Literal["track", "frame"]
_Major: TypeAlias = Literal["row", "column"]
_NamedEnds: TypeAlias = Literal["parabolic", "natural", "clamped", "secant", "loop", "frozen"]
_Order: TypeAlias = Literal["xyzw", "wxyz"]
_Outside: TypeAlias = Literal["hold", "loop", "mirror", "extrapolate", "leave-out"]
_SmoothingEnds: TypeAlias = Literal["keep", "parabolic", "loop"]
_Speed: TypeAlias = Literal["as-keyed", "constant"]
_TimeUnit: TypeAlias = Literal["s", "ms", "us", "ns"]
_Twist: TypeAlias = Literal["spread", "free"]
_UpAxis: TypeAlias = Literal["y", "z"]
_Values: TypeAlias = Literal["rotations", "local", "model", "skinning"]
_VectorMethod: TypeAlias = Literal[
    "step",
    "linear",
    "catmull-rom",
    "bessel-overhauser",
    "gltf-cubic",
    "c2",
    "b-spline",
]
_KeySigns: TypeAlias = Literal["shortest", "as-authored"]
# End of names.

_Single: TypeAlias = NDArray[np.float32]
_Double: TypeAlias = NDArray[np.float64]
# Double where positions count from an origin.
_Places: TypeAlias = NDArray[np.float32] | NDArray[np.float64]

_Method: TypeAlias = Literal[
    "authored",
    "b-spline",
    "bessel-overhauser",
    "bessel-overhauser-mean",
    "c2",
    "catmull-rom",
    "gltf-cubic",
    "hermite",
    "kochanek-bartels",
    "nlerp",
    "shoemake",
    "shoemake-1985",
    "shoemake-2",
    "slerp",
    "squad",
    "step",
]
_Ends: TypeAlias = _NamedEnds | ArrayLike
_Up: TypeAlias = tuple[float, float, float] | Sequence[float] | NDArray[Any]

@final
class Clip:
    """Tracks of rotation keys, with names, a skeleton, translations and scales where there are any."""
    def __new__(
        cls,
        times: _Arrays,
        keys: _Keys,
        *,
        order: _Order = "xyzw",
        layout: _Layout | None = None,
        name: str | None = None,
        names: Sequence[str] | None = None,
        parents: Sequence[int | None] | None = None,
        offsets: ArrayLike | None = None,
        translations: _Arrays | Sequence[_Array | None] | None = None,
        scales: _Arrays | Sequence[_Array | None] | None = None,
        velocities: _Arrays | Sequence[_Array | None] | None = None,
        tangents: _Arrays | Sequence[_Array | None] | None = None,
        tcb: _Arrays | Sequence[_Array | None] | None = None,
        scalars: dict[str, tuple[ArrayLike, ArrayLike]] | None = None,
    ) -> Clip: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Clip: ...
    def __deepcopy__(self, _memo: Any, /) -> Clip: ...
    @property
    def name(self) -> str | None:
        """The clip's name, or None."""
    @property
    def names(self) -> list[str]:
        """The tracks' names; `box1`, `box2` … where there are none."""
    @property
    def parents(self) -> list[int | None] | None:
        """The index of the parent of each track, None for roots; None without a skeleton."""
    @property
    def offsets(self) -> _Places | None:
        """Where each track rests in its parent's frame, (tracks, 3); None without a skeleton."""
    @property
    def origins(self) -> NDArray[np.float64] | None:
        """The origin that was subtracted from the translations of each track, (tracks, 3), float64, so that f32
        is enough for the rest of positions such as those of maps; None where none was. Positions that the
        package returns or writes have it added again, in float64."""
    @property
    def scalars(self) -> dict[str, tuple[NDArray[np.float64], _Places]]:
        """The scalars, such as the angles of a robot's joints, by their names: the times of their keys in seconds (keys,),
        and their values (keys,), float32 (float64 where whole turns were taken off an angle)."""
    @property
    def rate(self) -> Fraction | None:
        """The rate on whose frames all key times lie, a Fraction in frames per second, or None."""
    @property
    def span(self) -> tuple[float, float]:
        """The first and the last key time in seconds."""
    @property
    def duration(self) -> float:
        """Seconds from the first key to the last."""
    @property
    def key_count(self) -> int:
        """How many keys all tracks have together."""
    @property
    def time_offset(self) -> int:
        """The whole second from which the times of the clip are counted where the file's clock counts
        from 1970 or so; 0 for most files. `at`, `start` and `end` accept times of the file, too."""
    @property
    def is_world(self) -> bool:
        """Whether rotations and translations are relative to the world instead of the parent."""
    @property
    def path(self) -> os.PathLike[str] | None:
        """The file that it was read from, or None."""
    def __len__(self) -> int: ...
    def times(self, track: int | str) -> NDArray[np.float64]:
        """The key times of a track, by its index or name: (keys,), float64 in seconds."""
    def keys(self, track: int | str, *, order: _Order = "xyzw") -> _Single:
        """The keys of a track, by its index or name: (keys, 4), float32; `order` says what the
        components are."""
    def translations(
        self, track: int | str
    ) -> tuple[NDArray[np.float64], _Places] | None:
        """The translation keys of a track, by its index or name: their times (keys,) in seconds, and
        their values (keys, 3), float32 (float64 where the track has one of the `origins`), in the file's
        units; None for a track without."""
    def scales(
        self, track: int | str
    ) -> tuple[NDArray[np.float64], _Single] | None:
        """The scale keys of a track; otherwise as `translations`."""
    def frames(self, fps: _Rate) -> int:
        """How many frames the clip has at a rate, from its first key to its last."""
    # With lists of times of different lengths, the result is a list of arrays; with `as_rotation`, it is a
    # `scipy.spatial.transform.Rotation`.
    @overload
    def evaluate(
        self,
        *,
        out: _Single | None = None,
        order: _Order = "xyzw",
        layout: _Layout = "track",
        as_rotation: Literal[False] = False,
        dtype: Literal["float32"] = "float32",
        device_array: Literal[False] = False,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single:
        """As `Engine.evaluate`, by an engine that is shared by all calls and chooses its device."""
    @overload
    def evaluate(
        self,
        *,
        out: NDArray[Any] | None = None,
        order: _Order = "xyzw",
        layout: _Layout = "track",
        as_rotation: Literal[False] = False,
        dtype: DTypeLike,
        device_array: Literal[False] = False,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> NDArray[Any]: ...
    @overload
    def evaluate(
        self,
        *,
        out: None = None,
        order: Literal["xyzw"] = "xyzw",
        layout: _Layout = "track",
        as_rotation: Literal[True],
        dtype: Literal["float32"] = "float32",
        device_array: Literal[False] = False,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> Any: ...
    @overload
    def evaluate(
        self,
        *,
        out: None = None,
        order: Literal["xyzw"] = "xyzw",
        layout: _Layout = "track",
        as_rotation: Literal[False] = False,
        dtype: DTypeLike = "float32",
        device_array: Literal[True],
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> DeviceArray: ...
    def select(self, tracks: Sequence[str] | Sequence[int], *, collapse: bool = False) -> Clip:
        """The clip with some of its joints, `tracks`, by their names or indices, in this order. Their parents must be
        included, too, unless `collapse`: then the motion of a joint that is left out is not lost. Its child becomes a child of
        the nearest ancestor that is included, or a root, with the product of the rotations and translations in between, so that
        included joints have the same poses in the world at their keys. Such a joint has keys of translations if a joint in between
        turns, at the key times of all joints in the product."""
    def cut(self, start: float | None = None, end: float | None = None) -> Clip:
        """The part of the clip from `start` to `end` (in seconds); without `start` from its first key, without `end` to
        its last. Keys keep their times and bits. A channel without a key at a cut gets one there, of its curve. Steps,
        lines and arcs stay the same; smooth curves change in the intervals next to the cuts."""
    def retime(self, *, speed: float | None = None, start: float | None = None) -> Clip:
        """Returns the clip, played `speed` times as fast. The first key is moved to `start` (in seconds); without `start`,
        the key stays at its time. Keys keep their bits; velocities and tangents are multiplied by the speed."""
    def mirrored(self, axis: _Axis, *, robot: Robot | None = None) -> Clip:
        """The mirror image of the clip at the plane through the origin across `axis`, "x", "y" or "z", from left to right.
        Joints are exchanged with those of the same name on the other side (`features.mirror_pairs`), also if their axes at
        rest are no mirror images; the skeleton stays as it is. Keys keep their times. The signs of a robot's joints depend
        on their axes, which are those of `robot`."""
    @staticmethod
    def concat(clips: Sequence[Clip], *, gap: float | None = None) -> Clip:
        """Several clips, one after another. Joints are matched by name, and have the order and the name of the first clip.
        `gap`: the seconds from the last key of a clip to the first key of the next; by default one frame, if the clips
        have a common rate. With `gap=0.0`, each clip must end in the pose in which the next one begins; the two poses
        become one key. All keys keep their bits, and those of the first clip their times. Clips that differ in their
        joints, offsets, scalars or interpolation are refused."""
    def root_motion(
        self,
        rule: Literal["keep", "in-place", "extract"],
        *,
        up: _Ground = "y",
        axis: _Axis | None = None,
        joint: str | None = None,
    ) -> Clip:
        """The clip without its motion over the ground (`rule` "in-place"), or with a joint, `root_motion`, that has it and
        carries the root ("extract"), at the key times of all tracks. `up` and `axis` are those of `features.heading`;
        `joint` names the root, by default the joint that moves and whose ancestors do not. Scalars keep their keys; cubic
        splines become lines."""
    def sampler(
        self,
        *,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> Sampler:
        """A `Sampler`: it evaluates single rotations and poses, in loops that need one at a time, with the bits of
        `evaluate`. It prepares the clip once; the options are those of `evaluate`."""
    def plot(
        self,
        track: int | str | None = None,
        *,
        axes: Any = None,
        fps: _Rate | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> Any:
        """Draws the components of a track over time, with its keys as dots, with matplotlib; returns the axes of
        matplotlib."""
    def view(
        self,
        *,
        methods: str | Sequence[str] | None = None,
        fps: _Rate = 60,
        start: float | None = None,
        end: float | None = None,
        height: int = 520,
    ) -> View:
        """The page of `tumble view`: the bones or boxes moving, to be looked at from any side. The last
        value of a notebook's cell is shown in its output; `save(path)` writes the page, `html` is
        its text."""

@final
class Engine:
    """Evaluates clips on one device, which stays open."""
    def __new__(
        cls,
        device: str | int | None = None,
        *,
        memory: int | None = None,
        threads: int | None = None,
        allow_inexact: bool = False,
        cache: _Path | None = None,
    ) -> Engine: ...
    @property
    def device(self) -> str:
        """The name of the device. With "auto", it is the device for small calls."""
    def __copy__(self) -> Engine: ...
    def __deepcopy__(self, _memo: Any, /) -> Engine: ...
    def warm(self, *, method: str = "bessel-overhauser") -> None:
        """Compiles the kernels of a method on a Vulkan device in advance. Otherwise they are compiled by the first call that
        needs them; this takes milliseconds, with some drivers seconds. On the CPU this does nothing."""
    @overload
    def evaluate(
        self,
        clip: Clip,
        *,
        out: _Single | None = None,
        order: _Order = "xyzw",
        layout: _Layout = "track",
        as_rotation: Literal[False] = False,
        dtype: Literal["float32"] = "float32",
        device_array: Literal[False] = False,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single:
        """The rotation of every track at every sample, written by the engine into NumPy's memory:
        float32, (tracks, frames, 4), unit quaternions."""
    @overload
    def evaluate(
        self,
        clip: Clip,
        *,
        out: NDArray[Any] | None = None,
        order: _Order = "xyzw",
        layout: _Layout = "track",
        as_rotation: Literal[False] = False,
        dtype: DTypeLike,
        device_array: Literal[False] = False,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> NDArray[Any]: ...
    @overload
    def evaluate(
        self,
        clip: Clip,
        *,
        out: None = None,
        order: Literal["xyzw"] = "xyzw",
        layout: _Layout = "track",
        as_rotation: Literal[True],
        dtype: Literal["float32"] = "float32",
        device_array: Literal[False] = False,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> Any: ...
    @overload
    def evaluate(
        self,
        clip: Clip,
        *,
        out: None = None,
        order: Literal["xyzw"] = "xyzw",
        layout: _Layout = "track",
        as_rotation: Literal[False] = False,
        dtype: DTypeLike = "float32",
        device_array: Literal[True],
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> DeviceArray: ...
    def bodies(
        self,
        robot: Robot,
        joint_pos: _Array,
        root_pos: _Array | None = None,
        root_quat: _Array | _Rotation | None = None,
        *,
        order: _Order,
        source_fps: _Rate | None = None,
        source_times: _Array | None = None,
        joint_names: Sequence[str] | None = None,
        body_order: _BodyOrder = "depth-first",
        siblings: _Siblings = "file",
        velocity_at: _VelocityPoint = "origin",
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> dict[str, _Single]:
        """The joints and bodies of a robot at samples of a motion: a dict of float32 arrays with the names of mjlab's
        files, `joint_pos` and `joint_vel` (frames, joints), `body_pos_w` (frames, bodies, 3), `body_quat_w` (…, 4),
        `body_lin_vel_w` and `body_ang_vel_w` (…, 3), in the world."""
    def scalars(
        self,
        clip: Clip,
        *,
        quantity: Literal["value", "velocity", "acceleration"] = "value",
        names: Sequence[str] | None = None,
        layout: _Layout = "track",
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single:
        """The scalars of a clip, such as the angles of a robot's joints, at every sample: float32, (scalars, frames), with
        `layout="frame"` (frames, scalars). `quantity`: "value", "velocity" (per second: the derivative of the curve) or
        "acceleration". `names` chooses scalars, in this order; the default are all, in the order of `clip.scalars`. Other
        keywords are those of `evaluate`."""
    @overload
    def velocity(
        self,
        clip: Clip,
        *,
        axes: _Axes = "body",
        out: _Single | None = None,
        layout: _Layout = "track",
        device_array: Literal[False] = False,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single:
        """The angular velocity of every track at every sample: float32, (tracks, frames, 3) in rad/s, about the axes of
        the "body" or of its "parent". With "world" it is the angular velocity of the joint in the world, along the
        skeleton, about the world's axes. For a track without a parent, "parent" and "world" are the same. All other
        keywords are as in `evaluate`."""
    @overload
    def velocity(
        self,
        clip: Clip,
        *,
        axes: _Axes = "body",
        out: None = None,
        layout: _Layout = "track",
        device_array: Literal[True],
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> DeviceArray: ...
    @overload
    def acceleration(
        self,
        clip: Clip,
        *,
        axes: _Axes = "body",
        out: _Single | None = None,
        layout: _Layout = "track",
        device_array: Literal[False] = False,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single:
        """The angular acceleration in rad/s²; otherwise as `velocity`."""
    @overload
    def acceleration(
        self,
        clip: Clip,
        *,
        axes: _Axes = "body",
        out: None = None,
        layout: _Layout = "track",
        device_array: Literal[True],
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> DeviceArray: ...
    @overload
    def matrices(
        self,
        clip: Clip,
        *,
        columns: Literal[3, 4] = 3,
        out: _Single | None = None,
        layout: _Layout = "track",
        device_array: Literal[False] = False,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single:
        """The rotations as matrices for column vectors: float32, (tracks, frames, 3, 3), or with `columns=4`
        (tracks, frames, 3, 4), whose last column, the translation, is 0. Other keywords are those of `evaluate`."""
    @overload
    def matrices(
        self,
        clip: Clip,
        *,
        columns: Literal[3, 4] = 3,
        out: None = None,
        layout: _Layout = "track",
        device_array: Literal[True],
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> DeviceArray: ...
    def axis_angle(
        self,
        clip: Clip,
        *,
        degrees: bool = True,
        out: _Single | None = None,
        layout: _Layout = "track",
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single:
        """The rotations as axes and angles: float32, (tracks, frames, 4), x y z of the axis, a unit vector, and
        the angle, 0 to 360 degrees, or radians. Other keywords are those of `evaluate`."""
    def euler(
        self,
        clip: Clip,
        *,
        sequence: str = "XYZ",
        degrees: bool = True,
        out: _Single | None = None,
        layout: _Layout = "track",
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single:
        """The rotations as Euler angles: float32, (tracks, frames, 3), degrees or radians. `sequence`
        is as SciPy has it: "XYZ" about turned axes (intrinsic), "xyz" about fixed ones (extrinsic).
        Other keywords are those of `evaluate`."""
    def rotation_vectors(
        self,
        clip: Clip,
        *,
        out: _Single | None = None,
        layout: _Layout = "track",
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single:
        """The rotations as rotation vectors: float32, (tracks, frames, 3), the axis times the angle in radians, at most
        pi, as SciPy's `as_rotvec` and the poses of SMPL. Other keywords are those of `evaluate`."""
    @overload
    def encoded(
        self,
        clip: Clip,
        encoding: _Encoding,
        *,
        major: _Major = "row",
        sequence: str = "XYZ",
        degrees: bool = True,
        out: NDArray[Any] | None = None,
        layout: _Layout = "track",
        device_array: Literal[False] = False,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> NDArray[Any]:
        """The rotations in the representation of that name: "f32", "f16", "snorm16", "axis-angle", "matrix", "matrix-3x4",
        "euler" … (`tumble.encodings()`), an array (tracks, frames, …). Every device gives the same bits."""
    @overload
    def encoded(
        self,
        clip: Clip,
        encoding: _Encoding,
        *,
        major: _Major = "row",
        sequence: str = "XYZ",
        degrees: bool = True,
        out: None = None,
        layout: _Layout = "track",
        device_array: Literal[True],
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> DeviceArray: ...
    def poses(
        self,
        clip: Clip,
        *,
        layout: _Layout = "track",
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> tuple[_Places, _Single, _Single]:
        """Whole poses relative to the parents: translations (tracks, frames, 3), rotations
        (tracks, frames, 4), x y z w, each with the sign that continues the one before it, and scales
        (tracks, frames, 3), float32; translations are float64 where the clip has `origins`. Keywords are those of `evaluate`."""
    def world(
        self,
        clip: Clip,
        *,
        layout: _Layout = "track",
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> tuple[_Places, _Single]:
        """Where the joints of a skeleton are in the world: positions (tracks, frames, 3) and rotations
        (tracks, frames, 4), x y z w, float32; positions are float64 where the clip has `origins`. Keywords are
        those of `evaluate`."""
    @overload
    def smooth(
        self,
        samples: Clip,
        *,
        kernel: str | None = None,
        low_pass: float | None = None,
        fps: _Rate | None = None,
        passes: int = 1,
        ends: _SmoothingEnds = "keep",
        layout: Literal["track"] = "track",
        order: Literal["xyzw"] = "xyzw",
        out: None = None,
    ) -> Clip:
        """Smooths samples. Returns a float32 array of the same shape, or a clip if `samples` is a `Clip`."""
    @overload
    def smooth(
        self,
        samples: _Keys,
        *,
        kernel: str | None = None,
        low_pass: float | None = None,
        fps: _Rate | None = None,
        passes: int = 1,
        ends: _SmoothingEnds = "keep",
        layout: _Layout = "track",
        order: _Order = "xyzw",
        out: _Single | None = None,
    ) -> _Single: ...
    def blend(
        self,
        layers: Sequence[_Keys] | NDArray[Any],
        weights: ArrayLike | Sequence[ArrayLike] | None = None,
        *,
        order: _Order = "xyzw",
        out: _Single | None = None,
    ) -> _Single:
        """Layers of rotations blended into one: the weighted sum of each rotation, normalised, every layer with
        the sign that is nearer to the first one's. Weights need not add up to 1. Arrays have no names, so tracks are
        combined by index: bring those of clips into one order by `Clip.names` first."""
    def mix(
        self,
        first: _Keys,
        second: _Keys,
        weight: ArrayLike,
        *,
        order: _Order = "xyzw",
        out: _Single | None = None,
    ) -> _Single:
        """Slerp, the shorter way, from every rotation of the first array (…, 4) to that of the second, by a `weight`
        from 0 to 1, or an array of weights, (…), such as one for each frame. The shapes broadcast. Tracks are combined by
        index, as in `blend`."""
    def add(
        self,
        base: _Keys,
        layer: _Keys,
        *,
        reference: _Keys | None = None,
        weight: float = 1.0,
        layout: _Layout = "track",
        order: _Order = "xyzw",
        out: _Single | None = None,
    ) -> _Single:
        """A layer of rotations added to a base: `base · (reference⁻¹ layer)^weight`."""
    def local_to_model(
        self,
        rotations: _Keys,
        parents: Sequence[int | None],
        offsets: ArrayLike | None = None,
        *,
        translations: _Arrays | Sequence[_Array | None] | None = None,
        scales: _Arrays | Sequence[_Array | None] | None = None,
        inverse_bind: ArrayLike | None = None,
        layout: _Layout = "track",
        order: _Order = "xyzw",
    ) -> _Single:
        """The matrices of a skeleton's joints in the model, from its roots down: `M = M_parent T R S`, and `M B`
        with inverse bind matrices `B`, as vertices are skinned with. float32, (tracks, frames, 3, 4), for column
        vectors, the last column the translation; a view."""
    def follow(
        self,
        times: _Arrays | None,
        points: _Arrays,
        *,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        duration: float | None = None,
        rate: float | None = None,
        ups: _Arrays | None = None,
        method: _VectorMethod = "bessel-overhauser",
        ends: _Ends = "parabolic",
        ahead: float | None = None,
        look_at: int | ArrayLike | None = None,
        frame: _Frame = "minimal",
        up: _Up = (0.0, 1.0, 0.0),
        twist: _Twist = "spread",
        speed: Literal["as-keyed", "keys", "constant"] | tuple[float, float] = "keys",
        forward: str = "z",
        upward: str = "y",
        layout: _Layout = "track",
        order: _Order = "xyzw",
    ) -> tuple[_Places, _Single]:
        """Bodies on paths: the position of each at every sample, and the rotation from its axes to the world's."""
    def stream(
        self,
        clip: Clip,
        *,
        chunk: int = 1048576,
        order: _Order = "xyzw",
        layout: _Layout = "track",
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> Chunks:
        """The rotations in pieces of about `chunk` rotations, for results larger than memory: an
        iterator of `Chunk`s, in the order of the whole result. Other keywords are those of
        `evaluate`."""
    def batch(
        self,
        rows: Any,
        *,
        order: _Order = "xyzw",
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> Any:
        """Clips as rows of a record batch, in and out by Arrow: for Spark, Daft and Ray Data. `rows`, of pyarrow's or with
        Arrow's C interface, have `times`, a list of seconds, and `keys`, a list of 4 numbers for each time of each track.
        They are replaced by `tracks`, `frames` and `rotations`, track after track; other columns are kept. Keywords are
        those of `evaluate`. No row's result depends on the others."""
    def verify(
        self,
        clip: Clip,
        *,
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        signs: _KeySigns | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Outside | None = None,
        after: _Outside | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> Verification:
        """Compares the device with the CPU, bit by bit, and both with a reference in float64 that
        shares no code with them. Keywords are those of `evaluate`."""

@final
class Chunks:
    """An iterator of `Chunk`s; see `Engine.stream`."""
    def __iter__(self) -> Chunks: ...
    def __next__(self) -> Chunk: ...

@final
class Chunk:
    """A part of a result, contiguous in the whole."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def tracks(self) -> slice[int, int, None]:
        """Its tracks, a slice of all."""
    @property
    def frames(self) -> slice[int, int, None]:
        """Its frames, a slice of all."""
    @property
    def rotations(self) -> _Single:
        """The rotations: float32, (tracks, frames, 4), or (frames, tracks, 4) if that is the layout."""

@final
class Verification:
    """The result of `Engine.verify`."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def method(self) -> str:
        """The method; "authored" where tracks have different methods."""
    @property
    def device(self) -> str | None:
        """The Vulkan device; None on the CPU, where nothing is compared between devices."""
    @property
    def rotations(self) -> int:
        """Rotations compared."""
    @property
    def differing(self) -> int:
        """Rotations whose bits differ between the device and the CPU."""
    @property
    def max_error(self) -> float:
        """The largest angle between a result and the reference in rad."""
    @property
    def rms_error(self) -> float:
        """The root mean square of that angle in rad."""
    @property
    def max_norm_error(self) -> float:
        """The largest distance of a norm from 1."""
    @property
    def error_bound(self) -> float:
        """The largest `max_error` that is allowed in rad."""
    @property
    def passes(self) -> bool:
        """Whether a Vulkan device was compared with the CPU, all bits agree and all errors are within
        their bounds, those of velocities, matrices and other outputs included."""
    @property
    def verdict(self) -> Literal["passed", "reference-only", "nothing", "failed"]:
        """"passed", "reference-only" (the CPU is near the reference, and no device took part), "nothing"
        (there was no sample) or "failed"."""

@final
class File:
    """The clips of a file, by their indices or names."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def clips(self) -> list[Clip]:
        """The clips, in the file's order."""
    @property
    def names(self) -> list[str]:
        """The clips' names; their indices where they have none."""
    @property
    def clip(self) -> Clip:
        """The only clip; an error where there are several."""
    @property
    def path(self) -> os.PathLike[str]:
        """The path of the file."""
    @property
    def refused(self) -> list[str]:
        """Why other clips of the file could not be read."""
    def __copy__(self) -> File: ...
    def __deepcopy__(self, _memo: Any, /) -> File: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[Clip]: ...
    def __contains__(self, name: str, /) -> bool: ...
    def __getitem__(self, key: int | str, /) -> Clip: ...

@overload
def evaluate(
    times: _Arrays,
    keys: _Keys,
    *,
    out: _Single | None = None,
    order: _Order = "xyzw",
    layout: _Layout = "track",
    as_rotation: Literal[False] = False,
    dtype: Literal["float32"] = "float32",
    device_array: Literal[False] = False,
    fps: _Rate | None = None,
    at: _Arrays | None = None,
    start: float | None = None,
    end: float | None = None,
    method: _Method | None = None,
    signs: _KeySigns | None = None,
    ends: _Ends | None = None,
    speed: _Speed | None = None,
    before: _Outside | None = None,
    after: _Outside | None = None,
    tension: float | None = None,
    continuity: float | None = None,
    bias: float | None = None,
) -> _Single:
    """Interpolates keys: `Clip(times, keys, order=order)`, evaluated by a shared engine."""
@overload
def evaluate(
    times: _Arrays,
    keys: _Keys,
    *,
    out: NDArray[Any] | None = None,
    order: _Order = "xyzw",
    layout: _Layout = "track",
    as_rotation: Literal[False] = False,
    dtype: DTypeLike,
    device_array: Literal[False] = False,
    fps: _Rate | None = None,
    at: _Arrays | None = None,
    start: float | None = None,
    end: float | None = None,
    method: _Method | None = None,
    signs: _KeySigns | None = None,
    ends: _Ends | None = None,
    speed: _Speed | None = None,
    before: _Outside | None = None,
    after: _Outside | None = None,
    tension: float | None = None,
    continuity: float | None = None,
    bias: float | None = None,
) -> NDArray[Any]: ...
@overload
def evaluate(
    times: _Arrays,
    keys: _Keys,
    *,
    out: None = None,
    order: _Order = "xyzw",
    layout: _Layout = "track",
    as_rotation: Literal[True],
    dtype: Literal["float32"] = "float32",
    device_array: Literal[False] = False,
    fps: _Rate | None = None,
    at: _Arrays | None = None,
    start: float | None = None,
    end: float | None = None,
    method: _Method | None = None,
    signs: _KeySigns | None = None,
    ends: _Ends | None = None,
    speed: _Speed | None = None,
    before: _Outside | None = None,
    after: _Outside | None = None,
    tension: float | None = None,
    continuity: float | None = None,
    bias: float | None = None,
) -> Any: ...
@overload
def evaluate(
    times: _Arrays,
    keys: _Keys,
    *,
    out: None = None,
    order: Literal["xyzw"] = "xyzw",
    layout: _Layout = "track",
    as_rotation: Literal[False] = False,
    dtype: DTypeLike = "float32",
    device_array: Literal[True],
    fps: _Rate | None = None,
    at: _Arrays | None = None,
    start: float | None = None,
    end: float | None = None,
    method: _Method | None = None,
    signs: _KeySigns | None = None,
    ends: _Ends | None = None,
    speed: _Speed | None = None,
    before: _Outside | None = None,
    after: _Outside | None = None,
    tension: float | None = None,
    continuity: float | None = None,
    bias: float | None = None,
) -> DeviceArray: ...
def load(
    path: _Path,
    *,
    format: str | None = None,
    source_fps: _Rate | None = None,
    override_fps: _Rate | None = None,
    source_times: _Path | None = None,
    map: str | None = None,
    time_unit: _TimeUnit | None = None,
    source_order: _Order | None = None,
    duplicates: Literal["first", "last", "both"] | None = None,
    raw_times: bool = False,
    bridge_gaps: bool = False,
    keyframes: bool = False,
    offsets: ArrayLike | Mapping[str, ArrayLike] | None = None,
    body_model: _Path | None = None,
    scale: float | Literal["metres"] | None = None,
    up: _UpAxis | None = None,
) -> File:
    """Reads a motion file of any format (docs/formats.md lists them). An invalid file raises an `InputError` with the
    position of the error; oddities are reported as `InputWarning`."""
def save(
    file: _Path,
    clips: Clip | File | Sequence[Clip],
    /,
    *,
    format: str | None = None,
    sequence: str | None = None,
    linear: Sequence[str] = ...,
    order: _Order | None = None,
    layout: _Layout = "track",
    end_frame: _EndFrame | None = None,
    times_out: _Path | None = None,
    quantize: bool = False,
    meshopt: bool = False,
    overwrite: bool = True,
    engine: Engine | None = None,
    fps: _Rate | None = None,
    at: _Arrays | None = None,
    times: _Arrays | None = None,
    start: float | None = None,
    end: float | None = None,
    method: _Method | None = None,
    signs: _KeySigns | None = None,
    ends: _Ends | None = None,
    speed: _Speed | None = None,
    before: _Outside | None = None,
    after: _Outside | None = None,
    tension: float | None = None,
    continuity: float | None = None,
    bias: float | None = None,
) -> None:
    """Writes clips to a file, atomically; the format is that of the file's ending."""
def devices() -> list[str]:
    """The names of the Vulkan devices, in the order of their indices; empty where there is no Vulkan."""
def load_all(
    paths: Sequence[_Path],
    keywords: dict[str, Any],
    *,
    skip: bool = False,
    progress: Callable[[int, int], object] | None = None,
    fps: float | str | Fraction | None = None,
    tracks: Sequence[str] | Sequence[int] | None = None,
    collapse: bool = False,
    method: str = "slerp",
) -> tuple[list[File], list[tuple[str, str | None, str]]]: ...
def shaped(
    clip: Clip,
    *,
    fps: float | str | Fraction | None = None,
    tracks: Sequence[str] | Sequence[int] | None = None,
    collapse: bool = False,
    method: str = "slerp",
) -> Clip: ...
def scalar_motions(
    clips: Sequence[Clip], method: str, ticks_per_second: int, *, contacts: bool
) -> tuple[Motions | None, list[str], list[int], str | None]: ...
def robot_motions(
    clips: Sequence[Clip],
    robot: Robot,
    method: str,
    *,
    order: str,
    body_order: str,
    siblings: str,
    velocity_at: str,
    skip: bool = False,
    packed: bool = False,
) -> Motions: ...
def sample_bodies(
    motions: Motions,
    engine: Engine,
    clip_ids: NDArray[np.int64],
    times: NDArray[np.float64],
    outputs: Sequence[_Single | None],
    frames: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> None: ...
def put_w_first(quaternions: _Single) -> None: ...
def represent(engine: Engine, rotations: _Single, kind: str, out: _Single) -> None: ...
def joint_partners(
    names: Sequence[str], parents: Sequence[int | None], pairs: Sequence[int] | None
) -> list[int]: ...
def reframe(
    arrays: tuple[_Single | None, _Single | None, _Single | None, _Single | None, _Single | None],
    joints: int,
    mirror: tuple[NDArray[np.bool_], int, Sequence[int]] | None,
    heading: tuple[str, str, Sequence[int | None], int] | None,
) -> None: ...
def clip_of_state(state: dict[str, Any]) -> Clip: ...
def file_of_state(
    path: _Path, clips: Sequence[Clip], refused: Sequence[str]
) -> File: ...
def value_of_state(name: str, state: tuple[Any, ...]) -> Any: ...
@final
class Motions:
    @staticmethod
    def of_clips(
        clips: Sequence[Clip],
        skeleton: Clip | tuple[Sequence[int | None], ArrayLike] | None,
        method: str,
        skip: bool = False,
        packed: bool = False,
    ) -> Motions: ...
    def __len__(self) -> int: ...
    @staticmethod
    def of_arrays(arrays: dict[str, Any]) -> Motions: ...
    def arrays(self, clips: Sequence[int] | None = None) -> dict[str, Any]: ...
    @property
    def ticks_per_second(self) -> int: ...
    @property
    def joints(self) -> int: ...
    @property
    def joint_names(self) -> list[str]: ...
    @property
    def parents(self) -> list[int | None]: ...
    @property
    def body_names(self) -> list[str]: ...
    @property
    def unplaced(self) -> list[str]: ...
    @property
    def skipped(self) -> list[tuple[int, str]]: ...
    def sample(
        self,
        engine: Engine,
        clip_ids: NDArray[np.int64],
        times: NDArray[np.float64],
        rotations: _Single | None,
        positions: _Single | None,
        world_rotations: _Single | None,
        velocities: _Single | None,
        angular_velocities: _Single | None,
        frames: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
    ) -> None: ...

@final
class DeviceMotions:
    def __new__(cls, motions: Motions, engine: Engine) -> DeviceMotions: ...
    @property
    def nbytes(self) -> int: ...
    def sample(
        self,
        clip_ids: NDArray[np.int64],
        times: NDArray[np.float64],
        shape: Sequence[int],
        names: Sequence[str],
        rotations: str,
        frames: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
    ) -> list[DeviceArray]: ...

_Six: TypeAlias = Literal["six-columns", "six-rows", "six-interleaved"]
_Axis: TypeAlias = Literal["x", "y", "z"]
_Ground: TypeAlias = Literal["y", "z"]

def six(quaternions: _Array, kind: _Six, *, order: _Order) -> _Double: ...
def rotations_of_six(numbers: _Array, kind: _Six, *, order: _Order) -> _Double: ...
def heading(
    quaternions: _Array, *, order: _Order, up: _Ground, axis: _Axis | None = None
) -> _Double: ...
def contacts(
    positions: _Array,
    velocities: _Array,
    *,
    up: _Ground,
    height: float,
    speed: float,
    window: int | None = None,
) -> NDArray[np.bool_]: ...
def root_motion(
    positions: _Array,
    quaternions: _Array,
    *,
    order: _Order,
    up: _Ground,
    axis: _Axis | None = None,
) -> tuple[_Double, _Double, _Double, _Double]: ...
def root_after_loops(
    positions: _Array, headings: _Array, loops: int, *, up: _Ground
) -> tuple[_Double, _Double]: ...
def mirror_pairs(names: Sequence[str]) -> list[int]: ...
def mirrored_positions(
    positions: _Array, *, axis: _Axis, pairs: Sequence[int] | None = None
) -> _Double: ...
def mirrored_rotations(
    quaternions: _Array, *, order: _Order, axis: _Axis, pairs: Sequence[int] | None = None
) -> _Double: ...
def humanml3d(positions: _Array, *, threshold: float = 0.002) -> _Double: ...
def retarget(
    clip: Clip,
    target: Clip,
    *,
    bones: dict[str, str] | None = None,
    rest: Literal["auto", "same", "directions"] = "auto",
    rest_frame: int | None = None,
    scale: Literal["hips", "legs"] | float = "hips",
    axes: _Array | None = None,
) -> tuple[Clip, dict[str, Any]]:
    """Carries a motion over to another skeleton; returns the clip and a report."""
def positions_of_humanml3d(features: _Array) -> _Double: ...
def encodings() -> dict[str, str]:
    """The names of the representations of rotations (`Engine.encoded`), each with a short description."""
def methods() -> dict[str, str]:
    """The names of the methods, each with a short description."""
def load_drivers() -> None: ...
def page(clips: Clip | File | Sequence[Clip], options: Sequence[str]) -> str: ...
def panic() -> None: ...
def run(arguments: Sequence[str]) -> int: ...
def set_probe(command: Sequence[str]) -> None: ...
@final
class Plan:
    def __new__(
        cls,
        line: Sequence[str],
        library: str,
        listed: Sequence[tuple[str, int]] | None,
        folder: str,
        shard_bytes: str,
        into: str,
    ) -> Plan: ...
    @property
    def id(self) -> str: ...
    @property
    def inputs(self) -> int: ...
    @property
    def options(self) -> str: ...
    def __len__(self) -> int: ...
    def claim(self, folder: str) -> None: ...
    def inputs_of(self, shard: int) -> list[tuple[str, str]]: ...
    def names_of(self, shard: int) -> list[str]: ...

@final
class Worker:
    def __new__(cls, line: Sequence[str], threads: int | None) -> Worker: ...
    @property
    def device(self) -> str: ...
    @property
    def options(self) -> str: ...
    def key_of(self, below: str) -> str: ...
    def run(
        self,
        folder: str,
        shard: int,
        of: int,
        plan: str,
        inputs: Sequence[tuple[str, str]],
        *,
        record: bool,
    ) -> tuple[int, str]: ...

@final
class Record:
    def __new__(
        cls, shard: int, of: int, plan: str, inputs: int, lines: Sequence[str]
    ) -> Record: ...
    @staticmethod
    def parse(text: str) -> Record | None: ...
    @staticmethod
    def name_of(shard: int) -> str: ...
    @property
    def is_whole(self) -> bool: ...
    @property
    def plan(self) -> str: ...
    @plan.setter
    def plan(self, plan: str) -> None: ...
    def results(self) -> list[tuple[str, str, int]]: ...
    def refuse(self, input: str, message: str) -> None: ...
    def is_made_from(self, inputs: Mapping[str, str], options: str) -> bool: ...
    def join(
        self,
        name: str,
        *,
        sha256: str,
        bytes: int,
        library: str,
        inputs_sha256: str,
        into: str,
    ) -> None: ...
    def text(self) -> str: ...

def manifest_results(text: str) -> list[tuple[str, str, int]]: ...
def manifest_by_input(text: str) -> dict[str, list[str]]: ...
def manifest_unfinished(text: str, records: list[str]) -> list[str]: ...
def referred_files(path: str) -> list[str]: ...
def input_sha256(path: str) -> str | None: ...
def inputs_of(line: Sequence[str]) -> list[str]: ...
def kernels_sha256() -> str: ...
def merge(folder: str) -> tuple[int, str]: ...

@final
class Spread:
    """The mean, the root mean square and the largest of many differences."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def mean(self) -> float:
        """The mean."""
    @property
    def rms(self) -> float:
        """The root of the mean square."""
    @property
    def largest(self) -> float:
        """The largest."""

@final
class ArrayDifference:
    """How far two arrays of one shape are apart."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def numbers(self) -> int:
        """The number of numbers that are compared."""
    @property
    def differing(self) -> int:
        """The number of numbers that differ."""
    @property
    def not_finite(self) -> int:
        """The number of numbers that are NaN or infinite in only one of the arrays; not in `difference`."""
    @property
    def difference(self) -> Spread:
        """The differences of numbers."""
    @property
    def largest_at(self) -> list[int]:
        """The indices of the largest difference."""
    @property
    def rotation(self) -> Spread | None:
        """The angles in degrees, if the arrays contain rotations (four numbers each); otherwise None."""
    @property
    def largest_rotation_at(self) -> list[int] | None:
        """The indices of the rotation with the largest angle; None if there are no rotations."""

@final
class ChannelDifference:
    """The differences of a channel of two clips."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def mean(self) -> float:
        """The mean difference."""
    @property
    def rms(self) -> float:
        """The root of the mean square of the differences."""
    @property
    def largest(self) -> float:
        """The largest difference."""
    @property
    def track(self) -> str:
        """The name of the track with the largest difference."""
    @property
    def time(self) -> float:
        """The time of the largest difference in seconds, on the clock of the first clip."""
    @property
    def frame(self) -> float | None:
        """The frame of the largest difference, counted in the first clip from 0 at its first key; None if it has no rate."""

@final
class JointDifference:
    """The differences of one track of two clips."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def track(self) -> str:
        """The name of the track."""
    @property
    def rotation(self) -> ChannelDifference:
        """The differences of rotations in degrees."""
    @property
    def translation(self) -> ChannelDifference | None:
        """The differences of translations, as lengths; None if neither clip has translations."""
    @property
    def scale(self) -> ChannelDifference | None:
        """The differences of scales, as lengths; None if neither clip has scales."""

@final
class ClipDifference:
    """How far two clips are apart."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def tracks(self) -> int:
        """The number of tracks that both clips have."""
    @property
    def missing(self) -> tuple[list[str], list[str]]:
        """The names of the tracks that only one clip has: a list for the first clip, and one for the second."""
    @property
    def samples(self) -> int:
        """The number of samples of each track."""
    @property
    def span(self) -> tuple[float, float]:
        """The first and the last time in seconds."""
    @property
    def identical(self) -> int:
        """The number of rotations whose bits are the same."""
    @property
    def rotation(self) -> ChannelDifference | None:
        """The differences of rotations in degrees; None if the clips have only scalars in common."""
    @property
    def translation(self) -> ChannelDifference | None:
        """The differences of translations, as lengths; None if neither clip has translations."""
    @property
    def scale(self) -> ChannelDifference | None:
        """The differences of scales, as lengths; None if neither clip has scales."""
    @property
    def joints(self) -> list[JointDifference]:
        """The differences of each track, in the order of the first clip."""
    @property
    def scalars(self) -> list[ChannelDifference]:
        """The differences of each scalar that both clips have: angles in degrees, others as they are."""
    @property
    def missing_scalars(self) -> tuple[list[str], list[str]]:
        """The names of the scalars that only one clip has: a list for the first clip, and one for the second."""

@final
class PathStatistics:
    """The statistics of errors of one kind, by the names of `evo`."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def rmse(self) -> float:
        """The root of the mean square."""
    @property
    def mean(self) -> float:
        """The mean."""
    @property
    def median(self) -> float:
        """The median."""
    @property
    def std(self) -> float:
        """The standard deviation."""
    @property
    def min(self) -> float:
        """The smallest."""
    @property
    def max(self) -> float:
        """The largest."""

@final
class PathErrors:
    """How far an estimated path is from its reference."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def times_of(self) -> int:
        """The index of the clip whose poses are compared, 0 or 1: the clip with fewer poses."""
    @property
    def poses(self) -> int:
        """The number of poses that are compared."""
    @property
    def outside(self) -> int:
        """The number of poses that are not compared because they are outside the times of the other clip."""
    @property
    def in_gaps(self) -> int:
        """The number of poses that are not compared because they are in gaps of the other clip."""
    @property
    def span(self) -> tuple[float, float]:
        """First and last time in seconds."""
    @property
    def scale(self) -> float:
        """The scale of the alignment. The alignment scales the estimate, then rotates it, then translates it."""
    @property
    def rotation(self) -> list[float]:
        """The rotation of the alignment, x y z w."""
    @property
    def translation(self) -> list[float]:
        """The translation of the alignment."""
    @property
    def ape_translation(self) -> PathStatistics:
        """Absolute errors of the positions, lengths."""
    @property
    def ape_rotation(self) -> PathStatistics:
        """Absolute errors of the rotations in degrees."""
    @property
    def rpe_translation(self) -> PathStatistics | None:
        """Relative errors of the positions, lengths; None without `rpe`."""
    @property
    def rpe_rotation(self) -> PathStatistics | None:
        """Relative errors of the rotations in degrees; None without `rpe`."""
    @property
    def rpe_count(self) -> int:
        """The number of steps for which relative errors are computed."""

@overload
def compare(
    first: Clip,
    second: Clip,
    *,
    fps: _Rate | None = None,
    at: _Array | None = None,
    start: float | None = None,
    end: float | None = None,
    world: bool = False,
    engine: Engine | None = None,
) -> ClipDifference:
    """Compares two clips, or two arrays: the largest and the mean difference, and where it is."""
@overload
def compare(
    first: _Array,
    second: _Array,
    *,
    fps: None = None,
    at: None = None,
    start: None = None,
    end: None = None,
    world: Literal[False] = False,
    engine: None = None,
) -> ArrayDifference: ...
def path_errors(
    reference: Clip,
    estimate: Clip,
    *,
    align: _Align = "none",
    rpe: str | None = None,
    associate: str = "interpolated",
    max_gap: float | None = None,
    track: int | str | None = None,
    engine: Engine | None = None,
) -> PathErrors:
    """The errors of an estimated trajectory against its reference, as in benchmarks of odometry and SLAM. The
    numbers are the same as those of the program `evo`."""

@final
class Reduction:
    """A clip with few keys, and how far it is from its samples."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def clip(self) -> Clip:
        """The clip with few keys."""
    @property
    def keys_before(self) -> int:
        """Keys of all channels before."""
    @property
    def keys_after(self) -> int:
        """Keys of all channels that are left."""
    @property
    def times(self) -> _Double:
        """The times of the samples in seconds, (samples,)."""
    @property
    def angles(self) -> _Double:
        """The largest angle of all joints at each sample in degrees: (samples,)."""
    @property
    def distances(self) -> _Double:
        """The largest distance of all joints at each sample, (samples,)."""
    @property
    def bounds(self) -> tuple[float, float]:
        """The bounds that hold: an angle in degrees, and a distance."""

def reduce(
    clip: Clip,
    *,
    tolerance: float = 0.1,
    distance: float | None = None,
    shell: float = 0.0,
    curve: _Curve = "linear",
    together: bool = False,
    fps: _Rate | None = None,
    engine: Engine | None = None,
) -> Reduction:
    """Removes keys from a clip. The curves of the remaining keys are within a tolerance of all samples."""

@final
class DeviceArray:
    """A result in the memory of a device, made by `Engine.evaluate(…, device_array=True)` on an NVIDIA card, or by a
    `MotionLibrary(…, device=…)`: `torch.from_dlpack`, `cupy.from_dlpack` and `jax.dlpack.from_dlpack` import it without a
    copy, and so do libraries that use `__cuda_array_interface__`. The card may still be writing the result. The stream
    that imports it waits for the card; your Python code does not. All imported tensors share its memory, which is freed
    after the last of them."""
    @property
    def shape(self) -> tuple[int, ...]:
        """The shape, as of a NumPy array."""
    @property
    def dtype(self) -> np.dtype[Any]:
        """The type of the numbers, NumPy's."""
    @property
    def waited_by(self) -> Literal["stream", "host"]:
        """How readers are ordered after the device's writing: "stream" if the stream that takes the array waits for it,
        "host" if the host has waited already: for results in memory of the host, and if the Vulkan device exports no
        semaphore or CUDA takes none."""
    @property
    def __cuda_array_interface__(self) -> dict[str, Any]: ...
    def __dlpack__(
        self,
        *,
        stream: int | None = None,
        max_version: tuple[int, int] | None = None,
        dl_device: tuple[int, int] | None = None,
        copy: bool | None = None,
    ) -> Any: ...
    def __dlpack_device__(self) -> tuple[int, int]: ...
    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]: ...
    def __len__(self) -> int: ...
    def numpy(self) -> NDArray[Any]:
        """Copies the result to the host: a NumPy array of the same shape and type."""

@final
class Sampler:
    """Evaluates a clip at one time after another, for loops that need one pose at a time. Made by `Clip.sampler`."""
    @property
    def bytes_per_key(self) -> float:
        """The memory that the clip takes for each key, in bytes: if the clip keeps segments, 64 or more for arcs (slerp),
        and 144 to 208 or more for polynomials; if the clip keeps its keys instead, 16 or more."""
    def __len__(self) -> int: ...
    def __copy__(self) -> Sampler: ...
    def __deepcopy__(self, memo: Any, /) -> Sampler: ...
    def sample(
        self, track: int | str, time: float, *, order: _Order = "xyzw"
    ) -> _Single:
        """The rotation of a track, by its index or name, at a time in seconds: float32, (4,), a unit quaternion.
        `order`: "xyzw" or "wxyz"."""
    def pose(
        self,
        time: float,
        *,
        tracks: Sequence[int | str] | None = None,
        out: _Single | None = None,
        order: _Order = "xyzw",
    ) -> _Single:
        """The rotations at a time in seconds: float32, (tracks, 4), unit quaternions."""

@final
class ClipEvent:
    """A moment of a clip of a crowd, such as a step or the throw of a ball: for `Crowd(events=)`."""
    def __new__(cls, clip: int, time: float, name: str = "") -> ClipEvent: ...
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def clip(self) -> int:
        """The index of the clip in the crowd."""
    @property
    def time(self) -> float:
        """The time in seconds from the clip's first key."""
    @property
    def name(self) -> str:
        """The name."""

@final
class PassedEvent:
    """An event that a layer of an instance passed: of `Crowd.passed_events`."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def clock(self) -> int:
        """The clock's time in ticks at which the layer reached the event."""
    @property
    def instance(self) -> int:
        """The instance."""
    @property
    def layer(self) -> int:
        """The layer."""
    @property
    def event(self) -> int:
        """The event's index in `Crowd.events`."""
    @property
    def weight(self) -> float:
        """The weight of the layer now, from 0 to 1."""

@final
class Crowd:
    """Many instances of a skeleton, each of which plays clips at a separate time and speed: poses for skinning."""
    def __new__(
        cls,
        clips: Sequence[Clip],
        instances: int,
        *,
        layers: int = 1,
        method: _Method = "slerp",
        parents: Sequence[int | None] | None = None,
        offsets: ArrayLike | None = None,
        masks: Sequence[Sequence[float]] | None = None,
        inverse_bind: ArrayLike | None = None,
        references: dict[int, tuple[int, float]] | None = None,
        events: Sequence[ClipEvent] | None = None,
        ticks_per_second: int = 705600,
        storage: Literal["segments", "compact"] = "segments",
        engine: Engine | None = None,
    ) -> Crowd: ...
    @property
    def events(self) -> list[ClipEvent]:
        """The events of the clips, in the order in which they were given; their times are rounded to ticks."""
    @property
    def clock(self) -> int:
        """The clock's time in ticks."""
    @property
    def ticks_per_second(self) -> int:
        """Ticks of the clock in a second."""
    @property
    def bytes_per_key(self) -> float:
        """Bytes of the clips divided by the number of their keys, on the CPU and on devices."""
    @property
    def instances(self) -> int:
        """Number of instances."""
    @property
    def joints(self) -> int:
        """Joints of the skeleton."""
    @property
    def layers(self) -> int:
        """Layers of an instance."""
    def set(
        self,
        instances: ArrayLike,
        clip: ArrayLike,
        *,
        layer: int = 0,
        time: ArrayLike = 0.0,
        speed: ArrayLike = 1.0,
        wrap: Literal["hold", "loop", "mirror"] = "loop",
        weight: ArrayLike = 1.0,
        additive: bool = False,
        mask: int | None = None,
    ) -> None:
        """Sets what instances play from now on."""
    def advance(self, seconds: float) -> None:
        """Moves the clock on, by the ticks nearest to some seconds."""
    def passed_events(self, since: int) -> list[PassedEvent]:
        """The events that the layers of all instances passed after the time `since` of the clock in ticks, up to now: a
        list of `PassedEvent`, in the order of their times, then of instances, layers and events."""
    @overload
    def evaluate(
        self,
        values: _Values = "model",
        *,
        dtype: Literal["float32"] = "float32",
        out: _Single | None = None,
    ) -> _Single:
        """The poses of all instances at the clock's time: (instances, joints, 3, 4), for column vectors, the
        last column the translation; or of "rotations" (instances, joints, 4), x y z w."""
    @overload
    def evaluate(
        self,
        values: _Values = "model",
        *,
        dtype: DTypeLike,
        out: NDArray[Any] | None = None,
    ) -> NDArray[Any]: ...
    def times(self, layer: int = 0) -> _Double:
        """The time in seconds of its clip that each instance plays in a layer: (instances,), float64."""

@final
class Surface:
    """A surface, on which routes are found: a mesh, or a net of Bézier control points."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __new__(
        cls, vertices: ArrayLike, faces: ArrayLike, *, weld: float = 0.0
    ) -> Surface: ...
    @classmethod
    def net(cls, points: ArrayLike) -> Surface:
        """A Bézier surface of control points (m, n, 3)."""
    def route(
        self,
        start: ArrayLike,
        goal: ArrayLike,
        *,
        by: str | None = None,
        avoid: Surface | None = None,
        clearance: float = 0.0,
        finest: float | None = None,
        max_slope: float | None = None,
        up: _Up = (0.0, 1.0, 0.0),
    ) -> Route:
        """The route between the points of the surface that are nearest to `start` and `goal`."""
    def routes(
        self,
        starts: ArrayLike,
        goals: ArrayLike,
        *,
        by: str | None = None,
        avoid: Surface | None = None,
        clearance: float = 0.0,
        finest: float | None = None,
        max_slope: float | None = None,
        up: _Up = (0.0, 1.0, 0.0),
    ) -> list[Route | None]:
        """The routes of many pairs, `starts` and `goals` (n, 3), on all cores: a list with a `Route` for each, and
        None where there is none, of which an `InputWarning` says why. Otherwise as `route`."""

_BodyOrder: TypeAlias = Literal["depth-first", "breadth-first"]
_Siblings: TypeAlias = Literal["file", "body-name", "joint-name"]
_VelocityPoint: TypeAlias = Literal["origin", "mass"]
_FixedBodies: TypeAlias = Literal["keep", "merge"]

@final
class Robot:
    """A robot: its bodies (links) and joints, from an MJCF or URDF file."""
    @classmethod
    def load(cls, path: _Path, fixed_bodies: _FixedBodies = "keep") -> Robot:
        """Reads a robot from an MJCF or URDF file. `fixed_bodies`: "merge" makes bodies without joints parts of the bodies
        that they are fixed to, as simulators do with URDF; "keep" keeps them."""
    @property
    def name(self) -> str:
        """Its name; empty if the file has none."""
    @property
    def joint_names(self) -> list[str]:
        """The hinges and slides that have a value, in the order of `joint_pos`."""
    @property
    def root_names(self) -> list[str]:
        """The free joints, in the order of `root_pos` and `root_quat`."""
    @property
    def ball_names(self) -> list[str]:
        """The ball joints, in the order of `ball_quat`."""
    @property
    def limits(self) -> _Double:
        """The smallest and the largest value of each joint of `joint_names`, float64 (joints, 2); infinite without limits."""
    def body_names(
        self, body_order: _BodyOrder = "depth-first", *, siblings: _Siblings = "file"
    ) -> list[str]:
        """The names of the bodies, "depth-first" (mjlab) or "breadth-first" (Isaac); `siblings`: bodies with the
        same parent as in the "file", or by "body-name" or "joint-name"."""
    def forward(
        self,
        joint_pos: _Array,
        root_pos: _Array | None = None,
        root_quat: _Array | None = None,
        *,
        order: _Order,
        joint_vel: _Array | None = None,
        root_lin_vel: _Array | None = None,
        root_ang_vel: _Array | None = None,
        ball_quat: _Array | None = None,
        ball_vel: _Array | None = None,
        body_order: _BodyOrder = "depth-first",
        siblings: _Siblings = "file",
        velocity_at: _VelocityPoint = "origin",
    ) -> dict[str, _Double]:
        """The bodies of configurations, by forward kinematics in float64."""

@final
class Route:
    """A route over a surface: straight from each point to the next."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def points(self) -> _Double:
        """The points from the start to the goal, (n, 3), float64, connected by straight lines; a single point if start and
        goal are the same."""
    @property
    def normals(self) -> _Double | None:
        """The unit normal of the surface at each point, (n, 3), 0 where those of its faces cancel out; None
        where the surface has one side."""
    @property
    def length(self) -> float:
        """The length over the surface."""
    @property
    def off(self) -> tuple[float, float]:
        """How far start and goal were from the surface."""

@final
class Walk:
    """The positions of a walker at times: straight from each point to the next."""
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def times(self) -> _Double:
        """When it is at each point in seconds, (n,). Two with the same point are a wait between them."""
    @property
    def points(self) -> _Double:
        """Where it is, (n, 3), float64."""
    @property
    def normals(self) -> _Double | None:
        """The unit normal of the surface at each point, (n, 3); None where it has one side."""

def walk(
    routes: Sequence[Route],
    *,
    speed: ArrayLike,
    radius: ArrayLike,
    start: ArrayLike = 0.0,
    movers: Sequence[tuple[ArrayLike, ArrayLike, float]] = (),
) -> list[Walk | None]:
    """Plans walkers on routes, one after another. Each waits on its route where this is necessary, for moving obstacles
    and for the walkers before it. Returns a list with a `Walk` for each, or None for a walker that cannot pass, with
    an `InputWarning` that says why."""
