import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, ClassVar, Literal, Protocol, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray
from typing_extensions import Buffer

from tumble._notebook import View

__all__ = [
    "ArrayDifference",
    "ChannelDifference",
    "Chunk",
    "Chunks",
    "Clip",
    "ClipDifference",
    "Crowd",
    "DeviceArray",
    "DeviceMotions",
    "Engine",
    "File",
    "JointDifference",
    "Motions",
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
    "represent",
    "retarget",
    "root_after_loops",
    "root_motion",
    "rotations_of_six",
    "run",
    "save",
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
    def name(self) -> str | None: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def parents(self) -> list[int | None] | None: ...
    @property
    def offsets(self) -> _Places | None: ...
    @property
    def origins(self) -> NDArray[np.float64] | None: ...
    @property
    def scalars(self) -> dict[str, tuple[NDArray[np.float64], _Places]]: ...
    @property
    def rate(self) -> Fraction | None: ...
    @property
    def span(self) -> tuple[float, float]: ...
    @property
    def duration(self) -> float: ...
    @property
    def key_count(self) -> int: ...
    @property
    def time_offset(self) -> int: ...
    @property
    def is_world(self) -> bool: ...
    @property
    def path(self) -> os.PathLike[str] | None: ...
    def __len__(self) -> int: ...
    def times(self, track: int | str) -> NDArray[np.float64]: ...
    def keys(self, track: int | str, *, order: _Order = "xyzw") -> _Single: ...
    def translations(
        self, track: int | str
    ) -> tuple[NDArray[np.float64], _Places] | None: ...
    def scales(
        self, track: int | str
    ) -> tuple[NDArray[np.float64], _Single] | None: ...
    def frames(self, fps: _Rate) -> int: ...
    # Lists of times of different lengths give a list of arrays, and `as_rotation` gives SciPy's.
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
    ) -> _Single: ...
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
    def select(self, tracks: Sequence[str] | Sequence[int], *, collapse: bool = False) -> Clip: ...
    def cut(self, start: float | None = None, end: float | None = None) -> Clip: ...
    def retime(self, *, speed: float | None = None, start: float | None = None) -> Clip: ...
    @staticmethod
    def concat(clips: Sequence[Clip], *, gap: float | None = None) -> Clip: ...
    def root_motion(
        self,
        rule: Literal["keep", "in-place", "extract"],
        *,
        up: _Ground = "y",
        axis: _Axis | None = None,
        joint: str | None = None,
    ) -> Clip: ...
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
    ) -> Sampler: ...
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
    ) -> Any: ...
    def view(
        self,
        *,
        methods: str | Sequence[str] | None = None,
        fps: _Rate = 60,
        start: float | None = None,
        end: float | None = None,
        height: int = 520,
    ) -> View: ...

@final
class Engine:
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
    def device(self) -> str: ...
    def __copy__(self) -> Engine: ...
    def __deepcopy__(self, _memo: Any, /) -> Engine: ...
    def warm(self, *, method: str = "bessel-overhauser") -> None: ...
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
    ) -> _Single: ...
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
    ) -> dict[str, _Single]: ...
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
    ) -> _Single: ...
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
    ) -> _Single: ...
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
    ) -> _Single: ...
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
    ) -> _Single: ...
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
    ) -> _Single: ...
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
    ) -> _Single: ...
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
    ) -> _Single: ...
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
    ) -> NDArray[Any]: ...
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
    ) -> tuple[_Places, _Single, _Single]: ...
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
    ) -> tuple[_Places, _Single]: ...
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
    ) -> Clip: ...
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
    ) -> _Single: ...
    def mix(
        self,
        first: _Keys,
        second: _Keys,
        weight: ArrayLike,
        *,
        order: _Order = "xyzw",
        out: _Single | None = None,
    ) -> _Single: ...
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
    ) -> _Single: ...
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
    ) -> _Single: ...
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
        speed: Literal["keys", "constant"] | tuple[float, float] = "keys",
        forward: str = "z",
        upward: str = "y",
        layout: _Layout = "track",
        order: _Order = "xyzw",
    ) -> tuple[_Places, _Single]: ...
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
    ) -> Chunks: ...
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
    ) -> Any: ...
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
    ) -> Verification: ...

@final
class Chunks:
    def __iter__(self) -> Chunks: ...
    def __next__(self) -> Chunk: ...

@final
class Chunk:
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def tracks(self) -> slice[int, int, None]: ...
    @property
    def frames(self) -> slice[int, int, None]: ...
    @property
    def rotations(self) -> _Single: ...

@final
class Verification:
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def method(self) -> str: ...
    @property
    def device(self) -> str | None: ...
    @property
    def rotations(self) -> int: ...
    @property
    def differing(self) -> int: ...
    @property
    def max_error(self) -> float: ...
    @property
    def rms_error(self) -> float: ...
    @property
    def max_norm_error(self) -> float: ...
    @property
    def error_bound(self) -> float: ...
    @property
    def passes(self) -> bool: ...
    @property
    def verdict(self) -> Literal["passed", "reference-only", "nothing", "failed"]: ...

@final
class File:
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def clips(self) -> list[Clip]: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def clip(self) -> Clip: ...
    @property
    def path(self) -> os.PathLike[str]: ...
    @property
    def refused(self) -> list[str]: ...
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
) -> _Single: ...
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
) -> File: ...
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
) -> None: ...
def devices() -> list[str]: ...
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
def put_w_first(quaternions: _Single) -> None: ...
def represent(engine: Engine, rotations: _Single, kind: str, out: _Single) -> None: ...
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
) -> tuple[Clip, dict[str, Any]]: ...
def positions_of_humanml3d(features: _Array) -> _Double: ...
def encodings() -> dict[str, str]: ...
def methods() -> dict[str, str]: ...
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
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def mean(self) -> float: ...
    @property
    def rms(self) -> float: ...
    @property
    def largest(self) -> float: ...

@final
class ArrayDifference:
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def numbers(self) -> int: ...
    @property
    def differing(self) -> int: ...
    @property
    def difference(self) -> Spread: ...
    @property
    def largest_at(self) -> list[int]: ...
    @property
    def rotation(self) -> Spread | None: ...
    @property
    def largest_rotation_at(self) -> list[int] | None: ...

@final
class ChannelDifference:
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def mean(self) -> float: ...
    @property
    def rms(self) -> float: ...
    @property
    def largest(self) -> float: ...
    @property
    def track(self) -> str: ...
    @property
    def time(self) -> float: ...
    @property
    def frame(self) -> float | None: ...

@final
class JointDifference:
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def track(self) -> str: ...
    @property
    def rotation(self) -> ChannelDifference: ...
    @property
    def translation(self) -> ChannelDifference | None: ...
    @property
    def scale(self) -> ChannelDifference | None: ...

@final
class ClipDifference:
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def tracks(self) -> int: ...
    @property
    def missing(self) -> tuple[list[str], list[str]]: ...
    @property
    def samples(self) -> int: ...
    @property
    def span(self) -> tuple[float, float]: ...
    @property
    def identical(self) -> int: ...
    @property
    def rotation(self) -> ChannelDifference: ...
    @property
    def translation(self) -> ChannelDifference | None: ...
    @property
    def scale(self) -> ChannelDifference | None: ...
    @property
    def joints(self) -> list[JointDifference]: ...

@final
class PathStatistics:
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def rmse(self) -> float: ...
    @property
    def mean(self) -> float: ...
    @property
    def median(self) -> float: ...
    @property
    def std(self) -> float: ...
    @property
    def min(self) -> float: ...
    @property
    def max(self) -> float: ...

@final
class PathErrors:
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def times_of(self) -> int: ...
    @property
    def poses(self) -> int: ...
    @property
    def outside(self) -> int: ...
    @property
    def in_gaps(self) -> int: ...
    @property
    def span(self) -> tuple[float, float]: ...
    @property
    def scale(self) -> float: ...
    @property
    def rotation(self) -> list[float]: ...
    @property
    def translation(self) -> list[float]: ...
    @property
    def ape_translation(self) -> PathStatistics: ...
    @property
    def ape_rotation(self) -> PathStatistics: ...
    @property
    def rpe_translation(self) -> PathStatistics | None: ...
    @property
    def rpe_rotation(self) -> PathStatistics | None: ...
    @property
    def rpe_count(self) -> int: ...

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
) -> ClipDifference: ...
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
) -> PathErrors: ...

@final
class Reduction:
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def clip(self) -> Clip: ...
    @property
    def keys_before(self) -> int: ...
    @property
    def keys_after(self) -> int: ...
    @property
    def times(self) -> _Double: ...
    @property
    def angles(self) -> _Double: ...
    @property
    def distances(self) -> _Double: ...
    @property
    def bounds(self) -> tuple[float, float]: ...

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
) -> Reduction: ...

@final
class DeviceArray:
    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def waited_by(self) -> Literal["stream", "host"]: ...
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
    def numpy(self) -> NDArray[Any]: ...

@final
class Sampler:
    @property
    def bytes_per_key(self) -> float: ...
    def __len__(self) -> int: ...
    def __copy__(self) -> Sampler: ...
    def __deepcopy__(self, memo: Any, /) -> Sampler: ...
    def sample(
        self, track: int | str, time: float, *, order: _Order = "xyzw"
    ) -> _Single: ...
    def pose(
        self,
        time: float,
        *,
        tracks: Sequence[int | str] | None = None,
        out: _Single | None = None,
        order: _Order = "xyzw",
    ) -> _Single: ...

@final
class Crowd:
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
        ticks_per_second: int = 705600,
        engine: Engine | None = None,
    ) -> Crowd: ...
    @property
    def instances(self) -> int: ...
    @property
    def joints(self) -> int: ...
    @property
    def layers(self) -> int: ...
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
    ) -> None: ...
    def advance(self, seconds: float) -> None: ...
    @overload
    def evaluate(
        self,
        values: _Values = "model",
        *,
        dtype: Literal["float32"] = "float32",
        out: _Single | None = None,
    ) -> _Single: ...
    @overload
    def evaluate(
        self,
        values: _Values = "model",
        *,
        dtype: DTypeLike,
        out: NDArray[Any] | None = None,
    ) -> NDArray[Any]: ...
    def times(self, layer: int = 0) -> _Double: ...

@final
class Surface:
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __new__(
        cls, vertices: ArrayLike, faces: ArrayLike, *, weld: float = 0.0
    ) -> Surface: ...
    @classmethod
    def net(cls, points: ArrayLike) -> Surface: ...
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
    ) -> Route: ...
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
    ) -> list[Route | None]: ...

_BodyOrder: TypeAlias = Literal["depth-first", "breadth-first"]
_Siblings: TypeAlias = Literal["file", "body-name", "joint-name"]
_VelocityPoint: TypeAlias = Literal["origin", "mass"]

@final
class Robot:
    @classmethod
    def load(cls, path: _Path) -> Robot: ...
    @property
    def name(self) -> str: ...
    @property
    def joint_names(self) -> list[str]: ...
    @property
    def root_names(self) -> list[str]: ...
    @property
    def ball_names(self) -> list[str]: ...
    @property
    def limits(self) -> _Double: ...
    def body_names(
        self, body_order: _BodyOrder = "depth-first", *, siblings: _Siblings = "file"
    ) -> list[str]: ...
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
    ) -> dict[str, _Double]: ...

@final
class Route:
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def points(self) -> _Double: ...
    @property
    def normals(self) -> _Double | None: ...
    @property
    def length(self) -> float: ...
    @property
    def off(self) -> tuple[float, float]: ...

@final
class Walk:
    def __eq__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    @property
    def times(self) -> _Double: ...
    @property
    def points(self) -> _Double: ...
    @property
    def normals(self) -> _Double | None: ...

def walk(
    routes: Sequence[Route],
    *,
    speed: ArrayLike,
    radius: ArrayLike,
    start: ArrayLike = 0.0,
    movers: Sequence[tuple[ArrayLike, ArrayLike, float]] = (),
) -> list[Walk | None]: ...
