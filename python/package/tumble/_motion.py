"""Motion libraries: many clips of one skeleton, sampled at many times at once."""

from __future__ import annotations

import glob as _glob
import os
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tumble._errors import InputError
from tumble._files import whole
from tumble._tumble import Clip, Engine, File, Motions, load, load_all

if TYPE_CHECKING:
    _Path: TypeAlias = str | os.PathLike[str]
    _Skeleton: TypeAlias = Clip | _Path | tuple[Sequence[int | None], ArrayLike]
    _Name: TypeAlias = Literal[
        "rotations", "positions", "world_rotations", "velocities", "angular_velocities"
    ]
_NAMES: tuple[_Name, ...] = (
    "rotations",
    "positions",
    "world_rotations",
    "velocities",
    "angular_velocities",
)
_WIDTHS = {name: 4 if name.endswith("rotations") else 3 for name in _NAMES}
# Where the arrays of a file start: a multiple of what any processor wants, and of a cache line.
_ALIGNED = 64
_VERSION = 1
# What every file has, beside what the extension module looks for.
_STORED = ("version", "method", "names", "lengths", "rates")


class _WithWeakReferences:
    __slots__ = ("__weakref__",)


@dataclass(slots=True, eq=False)
class MotionState(_WithWeakReferences):
    """What `MotionLibrary.sample` found; an array that was left out is None.

    float32, x y z w, seconds and radians:

    rotations: (N, joints, 4), in the parent's frame.
    positions: (N, joints, 3), in the world, along the skeleton.
    world_rotations: (N, joints, 4).
    velocities: (N, joints, 3), in the world.
    angular_velocities: (N, joints, 3), about the world's axes.

    >>> import tumble
    >>> tumble.MotionState().rotations is None
    True
    """

    rotations: NDArray[np.float32] | None = None
    positions: NDArray[np.float32] | None = None
    world_rotations: NDArray[np.float32] | None = None
    velocities: NDArray[np.float32] | None = None
    angular_velocities: NDArray[np.float32] | None = None

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MotionState):
            return NotImplemented
        pairs = [(getattr(self, name), getattr(other, name)) for name in _NAMES]
        return all(
            first is second or first is not None and second is not None and np.array_equal(first, second)
            for first, second in pairs
        )


class MotionLibrary:
    """Clips of one skeleton, of many lengths and rates, each instance at a time of its own.

    `clips`: a list of `Clip`s with the same joints, in any order: they are matched by name, by index only if no
    clip has names, and another name, number or parent is refused. `method`: by which they are interpolated, as that
    of `Engine.evaluate`. `skeleton`: a `Clip`, a file with one, or the parents and offsets of the tracks of the first
    clip; its offsets are then those of all clips. Without it the skeleton is that of the first clip, and each clip
    keeps its own offsets. Arrays have the joints in the order of the skeleton (`joint_names`).
    `names`: of the clips; else their own, or their files'. `engine`: whose threads work, else one that all calls share.

    A clip without offsets, such as an SMPL body without a model of its shape, has rotations only: its positions and
    velocities are refused.

    Times count from the first key of a clip, and are kept to at least 0.5 µs (30 ns for clips of up to
    two minutes); before 0 and behind the end of a clip its ends are held.

    >>> import numpy as np, tumble
    >>> half = 0.5 ** 0.5
    >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, half, half]]], name="door",
    ...                    parents=[None], offsets=[[1, 0, 0]])
    >>> library = tumble.MotionLibrary([door])
    >>> state = library.sample([0, 0, 0], [0.0, 1.0, 2.0])
    >>> state.rotations[1].round(4)
    array([[0.    , 0.    , 0.3827, 0.9239]], dtype=float32)
    >>> state.angular_velocities[:, 0, 2].round(4)
    array([0.7854, 0.7854, 0.7854], dtype=float32)
    """

    names: list[str]
    lengths: NDArray[np.float64]
    rates: NDArray[np.float64]

    def __init__(
        self,
        clips: Iterable[Clip],
        *,
        method: str = "slerp",
        skeleton: _Skeleton | None = None,
        names: Sequence[str] | None = None,
        engine: Engine | None = None,
    ) -> None:
        clips = list(clips)
        if not clips:
            raise InputError("clips: give at least one")
        if names is not None and len(names) != len(clips):
            raise InputError(f"names: there are {len(names)} for {len(clips)} clips")
        self.names = list(names) if names is not None else [_name(clip) for clip in clips]
        self.lengths = np.array([clip.duration for clip in clips])
        self.rates = np.array([_rate(clip) for clip in clips])
        self._motions = Motions.of_clips(clips, _skeleton_of(skeleton), method)
        self._engine = engine if engine is not None else Engine()
        self._method = method
        self._file: str | None = None

    @classmethod
    def load(
        cls,
        files: _Path | Iterable[_Path],
        *,
        skeleton: _Skeleton | None = None,
        method: str = "slerp",
        source_fps: float | str | None = None,
        override_fps: float | str | None = None,
        engine: Engine | None = None,
    ) -> MotionLibrary:
        """Reads motion files: a path, a pattern such as "amass/**/*.npz", or a list of them. Every clip of
        every file belongs to the library, in the order of the names. `source_fps`: of files without a rate.
        `override_fps`: of all files without times, whatever rate they state.

        >>> import tempfile, os, tumble
        >>> folder = tempfile.mkdtemp()
        >>> tumble.save(os.path.join(folder, "door.npz"), tumble.Clip(
        ...     [0.0, 1.0], [[0, 0, 0, 1], [0, 0, 1, 0]], names=["door"], parents=[None]), fps=30)
        >>> tumble.MotionLibrary.load(os.path.join(folder, "*.npz")).names
        ['door']
        """
        patterns = [files] if isinstance(files, str | os.PathLike) else list(files)
        paths: list[str] = []
        for pattern in (os.fspath(path) for path in patterns):
            found = sorted(_glob.glob(pattern, recursive=True)) if _glob.has_magic(pattern) else [pattern]
            if not found:
                raise FileNotFoundError(f"no file matches {pattern}")
            paths += found
        clips = [clip for file in load_all(paths, source_fps, override_fps) for clip in file.clips]
        return cls(clips, method=method, skeleton=skeleton, engine=engine)

    def sample(
        self,
        clip_ids: ArrayLike,
        times: ArrayLike,
        *,
        arrays: Sequence[_Name] = _NAMES,
        finite: bool = False,
        out: MotionState | None = None,
    ) -> MotionState:
        """The states of N instances: `clip_ids` and `times`, (N,), say which clip each plays and how many
        seconds after the clip's first key it stands. (`Clip` and `Engine` take the times of the keys.)

        `arrays`: the names of those to compute; rotations alone take a third of the time. `out`: a state
        whose arrays are filled again, those that it has. `finite`: velocities as differences of the two
        frames of the clip's rate around a time, as other motion libraries have them, instead of the exact
        derivatives.

        >>> import tumble
        >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
        >>> library = tumble.MotionLibrary([door])
        >>> library.sample([0], [0.5], arrays=["positions"]).positions.shape
        (1, 1, 3)
        """
        ids = np.ascontiguousarray(clip_ids)
        if ids.dtype.kind not in "iu" and ids.size:
            raise InputError(f"clip_ids: their type is {ids.dtype}; give whole numbers")
        ids = np.ascontiguousarray(ids, np.int64)
        moments = np.ascontiguousarray(times, np.float64)
        if ids.ndim != 1 or moments.shape != ids.shape:
            shapes = f"{ids.shape} and {moments.shape}"
            raise InputError(f"clip_ids and times: their shapes are {shapes}; give (N,) for both")
        if out is None:
            for name in arrays:
                if name not in _NAMES:
                    raise InputError(f"arrays: there is no `{name}`; there are {', '.join(_NAMES)}")
            joints = self._motions.joints
            made = {name: np.empty((len(ids), joints, _WIDTHS[name]), np.float32) for name in arrays}
            out = MotionState(**made)
        velocities, angular = out.velocities, out.angular_velocities
        is_finite = finite and not (velocities is None and angular is None)
        self._motions.sample(
            self._engine,
            ids,
            moments,
            out.rotations,
            out.positions,
            out.world_rotations,
            None if is_finite else velocities,
            None if is_finite else angular,
        )
        if is_finite:
            self._differences(ids, moments, out)
        return out

    def _differences(
        self, ids: NDArray[np.int64], times: NDArray[np.float64], out: MotionState
    ) -> None:
        rates, lengths = self.rates[ids], self.lengths[ids]
        if np.isnan(rates).any():
            name = self.names[int(ids[np.isnan(rates)][0])]
            raise InputError(f"finite: the clip {name} has no rate")
        first = np.floor(np.clip(times, 0.0, lengths) * rates + 1e-6)
        last = np.maximum(np.round(lengths * rates) - 1, 0)
        first = np.minimum(first, last)
        names: list[_Name] = ["positions", "world_rotations"]
        if out.velocities is None:
            names.remove("positions")
        before = self.sample(ids, first / rates, arrays=names)
        after = self.sample(ids, (first + 1) / rates, arrays=names)
        each = rates[:, None, None].astype(np.float32)
        if out.velocities is not None:
            assert before.positions is not None and after.positions is not None
            out.velocities[...] = (after.positions - before.positions) * each
        if out.angular_velocities is not None and after.world_rotations is not None:
            out.angular_velocities[...] = each * _rotation_vectors(before.world_rotations, after.world_rotations)

    def sample_times(self, clip_ids: ArrayLike, rng: np.random.Generator) -> NDArray[np.float64]:
        """A time within each of these clips, uniformly, in seconds after its first key.

        >>> import numpy as np, tumble
        >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
        >>> times = tumble.MotionLibrary([door]).sample_times([0, 0], np.random.default_rng(1))
        >>> ((0 <= times) & (times <= 2)).all()
        np.True_
        """
        times: NDArray[np.float64] = rng.uniform(0.0, self.lengths[np.asarray(clip_ids)])
        return times

    def save(self, path: _Path) -> None:
        """Writes the library into one file, whole or not at all: an NPZ archive, in which every array lies
        as in memory, so that `open` need not read it.

        >>> import tempfile, os, tumble
        >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
        >>> path = os.path.join(tempfile.mkdtemp(), "motions.npz")
        >>> tumble.MotionLibrary([door], names=["door"]).save(path)
        >>> tumble.MotionLibrary.open(path).names
        ['door']
        """
        with whole(path) as partial, zipfile.ZipFile(partial, "w", zipfile.ZIP_STORED) as archive:
            for name, array in self._arrays().items():
                _write(archive, name, array)

    @classmethod
    def open(
        cls, path: _Path, *, mmap: bool = True, engine: Engine | None = None
    ) -> MotionLibrary:
        """Opens what `save` wrote. With `mmap` the file is mapped: what is not sampled is not read, and
        several processes share its memory.

        >>> import tumble
        >>> tumble.MotionLibrary.open("missing.npz")
        Traceback (most recent call last):
        FileNotFoundError: [Errno 2] No such file or directory: 'missing.npz'
        """
        file = os.path.abspath(os.fspath(path))
        try:
            arrays = _mapped(file) if mmap else _read(file)
        except FileNotFoundError:
            raise FileNotFoundError(2, os.strerror(2), os.fspath(path)) from None
        except (zipfile.BadZipFile, ValueError, KeyError, EOFError) as error:
            raise InputError(f"{os.fspath(path)}: no motion library: {error}") from error
        return cls._of_arrays(arrays, engine, file if mmap else None)

    @classmethod
    def _of_arrays(
        cls, arrays: dict[str, Any], engine: Engine | None, file: str | None = None
    ) -> MotionLibrary:
        missing = [name for name in _STORED if name not in arrays]
        if missing or int(arrays["version"]) != _VERSION:
            raise InputError(f"{file or 'arrays'}: not a motion library of this version of tumble")
        self = cls.__new__(cls)
        self.names = [str(name) for name in arrays["names"]]
        self.lengths = np.asarray(arrays["lengths"])
        self.rates = np.asarray(arrays["rates"])
        self._method = str(arrays["method"])
        self._motions = Motions.of_arrays(arrays)
        self._engine = engine if engine is not None else Engine()
        self._file = file
        return self

    def _arrays(self) -> dict[str, Any]:
        about = {
            "version": np.array(_VERSION),
            "method": np.array(self._method),
            "names": np.array(self.names, dtype=np.str_),
            "lengths": self.lengths,
            "rates": self.rates,
            "joint_names": np.array(self.joint_names, dtype=np.str_),
            "unplaced": np.array(self._motions.unplaced, dtype=np.str_),
        }
        return {**about, **self._motions.arrays()}

    def __reduce__(self) -> tuple[Any, ...]:
        if self._file is not None:
            return _opened, (self._file, self._engine)
        return MotionLibrary._of_arrays, (self._arrays(), self._engine)

    def __len__(self) -> int:
        return len(self.names)

    @property
    def joints(self) -> int:
        """Joints of the skeleton."""
        return self._motions.joints

    @property
    def joint_names(self) -> list[str]:
        """The names of the joints, in the order of all arrays: those of the skeleton."""
        return self._motions.joint_names

    @property
    def method(self) -> str:
        """The method by which the clips are interpolated."""
        return self._method

    def __repr__(self) -> str:
        seconds = float(self.lengths.sum())
        return f"MotionLibrary({len(self)} clips, {self.joints} joints, {seconds:.6g} s)"


def _opened(file: str, engine: Engine) -> MotionLibrary:
    return MotionLibrary.open(file, engine=engine)


def _skeleton_of(
    skeleton: _Skeleton | None,
) -> Clip | tuple[Sequence[int | None], ArrayLike] | None:
    """A clip, or the parents and offsets of joints."""
    if skeleton is None or isinstance(skeleton, Clip | tuple):
        return skeleton
    return load(skeleton)[0]


def _name(clip: Clip) -> str:
    if clip.name is not None:
        return clip.name
    return os.path.splitext(os.path.basename(os.fspath(clip.path)))[0] if clip.path else ""


def _rate(clip: Clip) -> float:
    if clip.rate is not None:
        return float(clip.rate)
    times = clip.times(0) if len(clip) else np.empty(0)
    steps = np.diff(times)
    is_even = len(steps) > 0 and np.ptp(steps) <= 1e-6 * steps.mean()
    return float((len(times) - 1) / (times[-1] - times[0])) if is_even else float("nan")


def _rotation_vectors(
    before: NDArray[np.float32] | None, after: NDArray[np.float32] | None
) -> NDArray[np.float64]:
    """The rotation vectors, about the world's axes, from one rotation to the next."""
    assert before is not None and after is not None
    a, b = before.astype(np.float64), after.astype(np.float64)
    axis = b[..., 3:] * -a[..., :3] + a[..., 3:] * b[..., :3] - np.cross(b[..., :3], a[..., :3])
    cosine = (a * b).sum(axis=-1, keepdims=True)
    axis = np.where(cosine < 0, -axis, axis)
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, np.abs(cosine))
    vectors: NDArray[np.float64] = axis * np.where(
        sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0
    )
    return vectors


def _write(archive: zipfile.ZipFile, name: str, array: Any) -> None:
    """Adds an array whose numbers start at a multiple of a cache line."""
    array = np.ascontiguousarray(array) if array.ndim else array
    info = zipfile.ZipInfo(f"{name}.npy")
    # The local header, with the field for more than 4 GiB that `force_zip64` puts before ours; ours has
    # an identity and a length.
    assert archive.fp is not None
    start = archive.fp.tell() + 30 + len(info.filename) + 20 + 4
    info.extra = b"\xfe\xca" + (-start % _ALIGNED).to_bytes(2, "little") + bytes(-start % _ALIGNED)
    with archive.open(info, "w", force_zip64=True) as member:
        np.lib.format.write_array(member, array, allow_pickle=False)


def _read(path: str) -> dict[str, Any]:
    """The arrays of a file."""
    with np.load(path, allow_pickle=False) as archive:
        return dict(archive)


def _mapped(path: str) -> dict[str, Any]:
    """The arrays of a file that `_write` wrote, mapped where they are large. What NumPy has written again is read:
    its arrays may be compressed, and start anywhere."""
    found: dict[str, Any] = {}
    with zipfile.ZipFile(path) as archive, open(path, "rb") as file:
        for info in archive.infolist():
            name = info.filename.removesuffix(".npy")
            if name not in ("spans", "cells") or info.compress_type != zipfile.ZIP_STORED:
                with archive.open(info) as member:
                    found[name] = np.lib.format.read_array(member, allow_pickle=False)
                continue
            file.seek(info.header_offset)
            header = file.read(30)
            lengths = [int.from_bytes(header[at : at + 2], "little") for at in (26, 28)]
            file.seek(info.header_offset + 30 + sum(lengths))
            version = np.lib.format.read_magic(file)
            if version != (1, 0):
                raise ValueError("its arrays are of another version")
            shape, fortran, kind = np.lib.format.read_array_header_1_0(file)
            if fortran or kind not in (np.dtype("<u4"), np.dtype("<f4")):
                raise ValueError("its arrays are of another type")
            if file.tell() % kind.itemsize:
                found[name] = np.fromfile(file, kind, int(np.prod(shape))).reshape(shape)
            else:
                found[name] = np.memmap(path, kind, "r", file.tell(), shape)
    return found
