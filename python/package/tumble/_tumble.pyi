import os
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, Literal, Protocol, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Buffer

from tumble._notebook import View

__all__ = [
    "Chunk",
    "Chunks",
    "Clip",
    "Engine",
    "File",
    "Motions",
    "Plan",
    "Verification",
    "Worker",
    "__version__",
    "clip_of_state",
    "devices",
    "evaluate",
    "file_of_state",
    "inputs_of",
    "kernels_sha256",
    "load",
    "load_drivers",
    "merge",
    "methods",
    "page",
    "panic",
    "run",
    "save",
    "set_probe",
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
_Order: TypeAlias = Literal["xyzw", "wxyz"]
_Layout: TypeAlias = Literal["track", "frame"]
_Axes: TypeAlias = Literal["body", "parent", "world"]
_Wrap: TypeAlias = Literal["hold", "loop", "mirror", "extrapolate"]
_Single: TypeAlias = NDArray[np.float32]
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
_Way: TypeAlias = Literal["shortest", "as-authored"]
_Ends: TypeAlias = (
    Literal["parabolic", "natural", "clamped", "secant", "loop", "frozen"] | ArrayLike
)
_Speed: TypeAlias = Literal["as-keyed", "constant"]

@final
class Clip:
    def __new__(
        cls,
        times: _Arrays,
        keys: _Keys,
        *,
        order: _Order = "xyzw",
        name: str | None = None,
        names: Sequence[str] | None = None,
        parents: Sequence[int | None] | None = None,
        offsets: ArrayLike | None = None,
        translations: _Arrays | Sequence[_Array | None] | None = None,
        scales: _Arrays | Sequence[_Array | None] | None = None,
        velocities: _Arrays | Sequence[_Array | None] | None = None,
        tangents: _Arrays | Sequence[_Array | None] | None = None,
        tcb: _Arrays | Sequence[_Array | None] | None = None,
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
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single: ...
    @overload
    def evaluate(
        self,
        *,
        out: None = None,
        order: Literal["xyzw"] = "xyzw",
        layout: _Layout = "track",
        as_rotation: Literal[True],
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> Any: ...
    def plot(
        self,
        track: int | str | None = None,
        *,
        axes: Any = None,
        fps: _Rate | None = None,
        method: _Method | None = None,
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
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
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single: ...
    @overload
    def evaluate(
        self,
        clip: Clip,
        *,
        out: None = None,
        order: Literal["xyzw"] = "xyzw",
        layout: _Layout = "track",
        as_rotation: Literal[True],
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> Any: ...
    def velocity(
        self,
        clip: Clip,
        *,
        axes: _Axes = "body",
        out: _Single | None = None,
        layout: _Layout = "track",
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single: ...
    def acceleration(
        self,
        clip: Clip,
        *,
        axes: _Axes = "body",
        out: _Single | None = None,
        layout: _Layout = "track",
        fps: _Rate | None = None,
        at: _Arrays | None = None,
        times: _Arrays | None = None,
        start: float | None = None,
        end: float | None = None,
        method: _Method | None = None,
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single: ...
    def matrices(
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
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
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
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> _Single: ...
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
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
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
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
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
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
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
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
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
        path: _Way | None = None,
        ends: _Ends | None = None,
        speed: _Speed | None = None,
        before: _Wrap | None = None,
        after: _Wrap | None = None,
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
    @property
    def tracks(self) -> slice[int, int, None]: ...
    @property
    def frames(self) -> slice[int, int, None]: ...
    @property
    def rotations(self) -> _Single: ...

@final
class Verification:
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
    fps: _Rate | None = None,
    at: _Arrays | None = None,
    start: float | None = None,
    end: float | None = None,
    method: _Method | None = None,
    path: _Way | None = None,
    ends: _Ends | None = None,
    speed: _Speed | None = None,
    before: _Wrap | None = None,
    after: _Wrap | None = None,
    tension: float | None = None,
    continuity: float | None = None,
    bias: float | None = None,
) -> _Single: ...
@overload
def evaluate(
    times: _Arrays,
    keys: _Keys,
    *,
    out: None = None,
    order: _Order = "xyzw",
    layout: _Layout = "track",
    as_rotation: Literal[True],
    fps: _Rate | None = None,
    at: _Arrays | None = None,
    start: float | None = None,
    end: float | None = None,
    method: _Method | None = None,
    path: _Way | None = None,
    ends: _Ends | None = None,
    speed: _Speed | None = None,
    before: _Wrap | None = None,
    after: _Wrap | None = None,
    tension: float | None = None,
    continuity: float | None = None,
    bias: float | None = None,
) -> Any: ...
def load(
    path: _Path,
    *,
    format: str | None = None,
    source_fps: _Rate | None = None,
    source_times: _Path | None = None,
    map: str | None = None,
    time_unit: Literal["s", "ms", "us", "ns"] | None = None,
    duplicates: Literal["first", "last", "both"] | None = None,
    raw_times: bool = False,
    bridge_gaps: bool = False,
    keyframes: bool = False,
    offsets: ArrayLike | None = None,
    body_model: _Path | None = None,
    scale: float | Literal["metres"] | None = None,
    up: Literal["y", "z"] | None = None,
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
    path: _Way | None = None,
    ends: _Ends | None = None,
    speed: _Speed | None = None,
    before: _Wrap | None = None,
    after: _Wrap | None = None,
    tension: float | None = None,
    continuity: float | None = None,
    bias: float | None = None,
) -> None: ...
def devices() -> list[str]: ...
def clip_of_state(state: dict[str, Any]) -> Clip: ...
def file_of_state(
    path: _Path, clips: Sequence[Clip], refused: Sequence[str]
) -> File: ...
@final
class Motions:
    @staticmethod
    def of_clips(
        clips: Sequence[Clip],
        parents: Sequence[int],
        offsets: Sequence[Sequence[float]],
        method: str,
    ) -> Motions: ...
    @staticmethod
    def of_arrays(arrays: dict[str, Any]) -> Motions: ...
    def arrays(self) -> dict[str, Any]: ...
    @property
    def joints(self) -> int: ...
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
    ) -> None: ...

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

def inputs_of(line: Sequence[str]) -> list[str]: ...
def kernels_sha256() -> str: ...
def merge(folder: str) -> tuple[int, str]: ...
