"""Motion libraries: many clips of one skeleton, sampled at many times at once."""

from __future__ import annotations

import ctypes
import glob as _glob
import numbers
import operator
import os
import pathlib
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeAlias, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tumble._errors import InputError
from tumble._files import whole
from tumble._tumble import (
    Clip,
    DeviceArray,
    DeviceMotions,
    Engine,
    File,
    Motions,
    Robot,
    joint_partners,
    load,
    load_all,
    mirror_pairs,
    put_w_first,
    reframe,
    represent,
    robot_motions,
    sample_bodies,
    scalar_motions,
    shaped,
)

if TYPE_CHECKING:
    _Path: TypeAlias = str | os.PathLike[str]
    _Skeleton: TypeAlias = Clip | _Path | tuple[Sequence[int | None], ArrayLike]
    _OnError: TypeAlias = Literal["refuse", "skip"]
    _JointName: TypeAlias = Literal[
        "rotations", "positions", "world_rotations", "velocities", "angular_velocities"
    ]
    _ScalarName: TypeAlias = Literal["dofs", "dof_velocities", "contacts"]
    _BodyName: TypeAlias = Literal[
        "joint_pos", "joint_vel", "body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w"
    ]
    _Name: TypeAlias = _JointName | _ScalarName | _BodyName
    from typing_extensions import TypeVar as _TypeVar

    # The type of the arrays in results: NumPy's, or that of a library whose arrays are on a device.
    _A = _TypeVar("_A", default=NDArray[np.float32])
else:
    _A = TypeVar("_A")
# The arrays of joints.
_NAMES: tuple[_JointName, ...] = (
    "rotations",
    "positions",
    "world_rotations",
    "velocities",
    "angular_velocities",
)
# The arrays of scalars.
_SCALARS: tuple[_ScalarName, ...] = ("dofs", "dof_velocities", "contacts")
# The arrays of a robot, as those of `Engine.bodies`.
_BODIES: tuple[_BodyName, ...] = (
    "joint_pos",
    "joint_vel",
    "body_pos_w",
    "body_quat_w",
    "body_lin_vel_w",
    "body_ang_vel_w",
)
_ALL: tuple[_Name, ...] = (*_NAMES, *_SCALARS, *_BODIES)
# The shape of a rotation in each representation.
_SHAPES: dict[str, tuple[int, ...]] = {"quaternion": (4,), "matrix": (3, 3), "6d": (6,), "rotvec": (3,)}
# Arrays in a file start at a multiple of this [bytes]: the alignment of every processor, and a cache line.
_ALIGNED = 64
# The latest version of the file format; files with mirrored clips have it.
_VERSION = 3
# Members of every file, in addition to those that the extension module requires.
_STORED = ("version", "method", "names", "lengths", "rates")


class _WithWeakReferences(Generic[_A]):
    __slots__ = ("__weakref__",)


@dataclass(slots=True, eq=False)
class MotionState(_WithWeakReferences[_A]):
    """The result of `MotionLibrary.sample`; an array that was left out is None.

    float32, x y z w, seconds and radians:

    rotations: (…, joints, 4), in the parent's frame.
    positions: (…, joints, 3), in the world, along the skeleton.
    world_rotations: (…, joints, 4).
    velocities: (…, joints, 3), in the world.
    angular_velocities: (…, joints, 3), about the world's axes.
    dofs: (…, dofs), the scalars of the clips (`MotionLibrary.dof_names`), such as the angles of a robot's joints.
    dof_velocities: (…, dofs), their derivatives.
    contacts: (…, contacts), the scalars that are contacts (`MotionLibrary.contact_names`), 0 or 1.

    Of a library with `robot`, the arrays of `Engine.bodies` instead:

    joint_pos, joint_vel: (…, joints), the values of hinges and slides, and their derivatives.
    body_pos_w, body_lin_vel_w, body_ang_vel_w: (…, bodies, 3), in the world, about its axes.
    body_quat_w: (…, bodies, 4), in the order of the library.

    Arrays of a library on a device are `DeviceArray`s.

    >>> import tumble
    >>> tumble.MotionState().rotations is None
    True
    """

    rotations: _A | None = None
    positions: _A | None = None
    world_rotations: _A | None = None
    velocities: _A | None = None
    angular_velocities: _A | None = None
    dofs: _A | None = None
    dof_velocities: _A | None = None
    contacts: _A | None = None
    joint_pos: _A | None = None
    joint_vel: _A | None = None
    body_pos_w: _A | None = None
    body_quat_w: _A | None = None
    body_lin_vel_w: _A | None = None
    body_ang_vel_w: _A | None = None

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MotionState):
            return NotImplemented
        pairs = [(getattr(self, name), getattr(other, name)) for name in _ALL]
        return all(
            first is second
            or first is not None
            and second is not None
            and np.array_equal(_on_host(first), _on_host(second))
            for first, second in pairs
        )


if TYPE_CHECKING:
    _S = TypeVar("_S", bound=MotionState[Any])
    _Device: TypeAlias = str | int | Engine
    _Array: TypeAlias = NDArray[np.float32]
    _Representation: TypeAlias = Literal["quaternion", "matrix", "6d", "rotvec"]
    _Heading: TypeAlias = Literal["twist", "x", "y", "z"]
    _Ground: TypeAlias = Literal["y", "z"]
    _Axis: TypeAlias = Literal["x", "y", "z"]
    _Order: TypeAlias = Literal["xyzw", "wxyz"]
    _BodyOrder: TypeAlias = Literal["depth-first", "breadth-first"]
    _Siblings: TypeAlias = Literal["file", "body-name", "joint-name"]
    _VelocityAt: TypeAlias = Literal["origin", "mass"]
    _Progress: TypeAlias = Callable[[int, int], object] | Any

    class _OfRobot(MotionState[_A]):
        """A state that may be that of a robot."""

        joint_pos: Any
        joint_vel: Any
        body_pos_w: Any
        body_quat_w: Any
        body_lin_vel_w: Any
        body_ang_vel_w: Any

    class _Whole(_OfRobot[_A]):
        """A state of which no array of joints was left out."""

        rotations: _A
        positions: _A
        world_rotations: _A
        velocities: _A
        angular_velocities: _A

    class _Some(_OfRobot[_A]):
        """A state with the arrays that were asked for; which, types do not say."""

        rotations: Any
        positions: Any
        world_rotations: Any
        velocities: Any
        angular_velocities: Any
        dofs: Any
        dof_velocities: Any
        contacts: Any

    class _Rotations(_Some[_A]):
        rotations: _A

    class _Positions(_Some[_A]):
        positions: _A

    class _WorldRotations(_Some[_A]):
        world_rotations: _A

    class _Velocities(_Some[_A]):
        velocities: _A

    class _AngularVelocities(_Some[_A]):
        angular_velocities: _A


@dataclass(frozen=True, slots=True)
class Skipped:
    """A file or a clip that a `MotionLibrary` left out.

    path: its file; empty for a clip that was not read from one.
    clip: the name of the clip; None if the whole file could not be read.
    code: of the fault, such as "E306"; None if the clip does not fit the skeleton.
    message: why.

    >>> import tumble
    >>> tumble.Skipped("a.npz", None, "E001", "a.npz: error[E001]: cannot be opened").code
    'E001'
    """

    path: str
    clip: str | None
    code: str | None
    message: str


@dataclass(frozen=True, slots=True)
class _Mirrored:
    """Which clips of a library are mirrored, the index of the axis from left to right, and the partner of each joint."""

    clips: NDArray[np.bool_]
    axis: int
    pairs: list[int]

    def arrays(self) -> dict[str, Any]:
        """Everything, as arrays of a file."""
        pairs = np.array(self.pairs, np.int64)
        return {"mirrored": self.clips, "mirror_axis": np.array(self.axis), "mirror_pairs": pairs}

    @classmethod
    def of_arrays(cls, arrays: dict[str, Any], clips: int, parents: list[int | None]) -> _Mirrored | None:
        if "mirrored" not in arrays:
            return None
        mask, axis, pairs = (np.asarray(arrays.get(name, ())) for name in ("mirrored", "mirror_axis", "mirror_pairs"))
        if mask.dtype != np.bool_ or mask.shape != (clips,) or axis.shape or axis not in (0, 1, 2) or pairs.dtype.kind != "i":
            raise InputError(f"arrays: mirrored is not that of {clips} clips")
        return cls(mask, int(axis), joint_partners([], parents, pairs.clip(min=0).tolist()))


@dataclass(slots=True)
class _Scalars:
    """Scalars as coordinates of bodies: their tables, names, and the coordinate that each is; or why there are none."""

    motions: Motions | None
    names: list[str]
    columns: list[int]
    reason: str | None = None

    def arrays(self, kind: str, clips: Sequence[int] | None) -> dict[str, Any]:
        """Everything, as arrays of a file."""
        if self.motions is None:
            return {}
        arrays = self.motions.arrays(clips) | {
            "names": np.array(self.names, dtype=np.str_),
            "columns": np.array(self.columns, np.int64),
        }
        return {f"{kind}_{name}": array for name, array in arrays.items()}

    @classmethod
    def of_arrays(cls, kind: str, arrays: dict[str, Any]) -> _Scalars:
        prefix = f"{kind}_"
        own = {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
        if not own:
            return cls(None, [], [])
        motions = Motions.of_arrays(own)
        names, columns = [str(name) for name in own["names"]], np.asarray(own["columns"], np.int64)
        if columns.shape != (len(names),) or ((columns < 0) | (columns >= 3 * motions.joints)).any():
            raise InputError(f"arrays: the columns of the {kind} are not those of {len(names)} scalars")
        return cls(motions, names, columns.tolist())


class MotionLibrary(Generic[_A]):
    """Clips of one skeleton, of any lengths and rates, which can be sampled at any times.

    * `clips`: a list of `Clip`s with the same joints, in any order. Joints are matched by name, or by index if no
      clip has names. A clip with another name, number or parent of joints is refused.
    * `method`: the interpolation method, with the same names as in `Engine.evaluate`.
    * `skeleton`: a `Clip`, a file with one, or the parents and offsets of the tracks of the first clip; its offsets
      are then those of all clips. Without it the skeleton is that of the first clip, and each clip keeps its own
      offsets. Arrays have the joints in the order of the skeleton (`joint_names`).
    * `names`: the names of the clips; by default the names that they have, or those of their files.
    * `engine`: its threads are used; by default those of an engine that all calls share.
    * `on_error`: "refuse", or "skip": clips that do not fit the skeleton are left out, and `skipped` lists them.
    * `packed`: with slerp, keys of rotations take 8 bytes instead of 16; rotations are then within 1e-5 rad of the
      exact ones, each relative to its parent.
    * `device`: a Vulkan device, by the name that `Engine` takes, or an engine on one. The clips are then in its
      memory, and `sample` returns `DeviceArray`s, with the CPU's bits. A library that needs more memory than the
      device has is refused. "cpu" is the same as no device.

    A clip without offsets, such as an SMPL body without a model of its shape, has rotations only: its positions and
    velocities are refused.

    Scalars that all clips have, such as the angles of a robot's joints, are sampled, too: `dof_names`, and `contact_names`
    for those that are contacts, which are steps. The other scalars are interpolated by `method`, lines for slerp.

    `robot`: the `Robot` that moves. The clips then need no skeleton: their scalars are its joints, and their tracks its root
    and its balls, matched by name; a track called `root`, too, is the root. Joints that the robot does not have are refused,
    and those that a clip does not have rest, which a warning says. `sample` has the arrays of `Engine.bodies`:
    `joint_pos`, `joint_vel`, `body_pos_w`, `body_quat_w`, `body_lin_vel_w`, `body_ang_vel_w`. `order` is that of
    `body_quat_w`, "wxyz" or "xyzw"; there is no default, because programs differ. `body_order`, `siblings` and
    `velocity_at`: as of `Engine.bodies`. Bodies are computed in float32, with the same bits on every device.

    `paths`: the path of the file of each clip; empty for a clip that was not read from one.

    Times count from the first key of a clip, and are stored with an error of at most 0.5 µs (30 ns for clips of up to two
    minutes); before 0 and after its end, a clip keeps its first and last pose.

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
    paths: list[str]
    lengths: NDArray[np.float64]
    rates: NDArray[np.float64]
    skipped: list[Skipped]
    _skipped_indices: list[int]

    @overload
    def __init__(
        self: MotionLibrary[_Array],
        clips: Iterable[Clip],
        *,
        method: str = ...,
        skeleton: _Skeleton | None = ...,
        names: Sequence[str] | None = ...,
        engine: Engine | None = ...,
        on_error: _OnError = ...,
        packed: bool = ...,
        robot: Robot | None = ...,
        order: _Order | None = ...,
        body_order: _BodyOrder | None = ...,
        siblings: _Siblings | None = ...,
        velocity_at: _VelocityAt | None = ...,
        device: Literal["cpu"] | None = ...,
    ) -> None: ...

    @overload
    def __init__(
        self: MotionLibrary[DeviceArray],
        clips: Iterable[Clip],
        *,
        method: str = ...,
        skeleton: _Skeleton | None = ...,
        names: Sequence[str] | None = ...,
        engine: Engine | None = ...,
        on_error: _OnError = ...,
        packed: bool = ...,
        robot: Robot | None = ...,
        order: _Order | None = ...,
        body_order: _BodyOrder | None = ...,
        siblings: _Siblings | None = ...,
        velocity_at: _VelocityAt | None = ...,
        device: _Device,
    ) -> None: ...

    def __init__(
        self,
        clips: Iterable[Clip],
        *,
        method: str = "slerp",
        skeleton: _Skeleton | None = None,
        names: Sequence[str] | None = None,
        engine: Engine | None = None,
        on_error: _OnError = "refuse",
        packed: bool = False,
        robot: Robot | None = None,
        order: _Order | None = None,
        body_order: _BodyOrder | None = None,
        siblings: _Siblings | None = None,
        velocity_at: _VelocityAt | None = None,
        device: _Device | None = None,
    ) -> None:
        clips = list(clips)
        skip = _skips(on_error)
        if not clips:
            raise InputError("clips: give at least one")
        if names is not None and len(names) != len(clips):
            raise InputError(f"names: there are {len(names)} for {len(clips)} clips")
        all_names = list(names) if names is not None else [_name(clip) for clip in clips]
        of_robot = {"order": order, "body_order": body_order, "siblings": siblings, "velocity_at": velocity_at}
        if robot is None:
            if named := [name for name, value in of_robot.items() if value is not None]:
                raise InputError(f"{', '.join(named)}: of a robot's bodies; give `robot`, too")
            self._motions = Motions.of_clips(clips, _skeleton_of(skeleton), method, skip, packed)
        else:
            if skeleton is not None:
                raise InputError("skeleton and robot: the robot has the bodies; give one of the two")
            if order is None:
                raise InputError(
                    'order: give "wxyz" or "xyzw", the order of body_quat_w; there is no default, because programs differ'
                )
            self._motions = robot_motions(
                clips,
                robot,
                method,
                order=order,
                body_order=body_order or "depth-first",
                siblings=siblings or "file",
                velocity_at=velocity_at or "origin",
                skip=skip,
                packed=packed,
            )
        left_out = dict(self._motions.skipped)
        self.skipped = [
            Skipped(os.fspath(clips[index].path or ""), all_names[index], None, message)
            for index, message in left_out.items()
        ]
        kept = [index for index in range(len(clips)) if index not in left_out]
        self.names = [all_names[index] for index in kept]
        self.paths = [os.fspath(clips[index].path or "") for index in kept]
        # The numbers by which shards divide clips: the index of a clip in the list, or of its file among all files.
        self._shard_indices = np.array(kept, np.int64)
        self._skipped_indices = list(left_out)
        self.lengths = np.array([clips[index].duration for index in kept])
        self.rates = np.array([_rate(clips[index]) for index in kept])
        self._engine = engine if engine is not None else Engine()
        self._method = method
        ticks = self._motions.ticks_per_second
        used = [clips[index] for index in kept]
        self._scalars = {
            kind: _Scalars(*scalar_motions(used, method, ticks, contacts=kind == "contacts"))
            if robot is None
            else _Scalars(None, [], [], "it has a robot, whose joints are in joint_pos and joint_vel")
            for kind in ("dofs", "contacts")
        }
        self._file: str | None = None
        self._only: NDArray[np.int64] | None = None
        # The indices of the clips in the library's file.
        self._in_file: NDArray[np.int64] | None = None
        self._mirrored: _Mirrored | None = None
        self._put_on(device)

    @overload
    @classmethod
    def load(
        cls,
        files: _Path | Iterable[_Path],
        *,
        skeleton: _Skeleton | None = ...,
        method: str = ...,
        engine: Engine | None = ...,
        on_error: _OnError = ...,
        packed: bool = ...,
        fps: float | str | Fraction | None = ...,
        tracks: Sequence[str] | Sequence[int] | None = ...,
        collapse: bool = ...,
        progress: _Progress | None = ...,
        shard: tuple[int, int] | None = ...,
        robot: Robot | None = ...,
        order: _Order | None = ...,
        body_order: _BodyOrder | None = ...,
        siblings: _Siblings | None = ...,
        velocity_at: _VelocityAt | None = ...,
        device: Literal["cpu"] | None = ...,
        **options: Any,
    ) -> MotionLibrary[_Array]: ...

    @overload
    @classmethod
    def load(
        cls,
        files: _Path | Iterable[_Path],
        *,
        skeleton: _Skeleton | None = ...,
        method: str = ...,
        engine: Engine | None = ...,
        on_error: _OnError = ...,
        packed: bool = ...,
        fps: float | str | Fraction | None = ...,
        tracks: Sequence[str] | Sequence[int] | None = ...,
        collapse: bool = ...,
        progress: _Progress | None = ...,
        shard: tuple[int, int] | None = ...,
        robot: Robot | None = ...,
        order: _Order | None = ...,
        body_order: _BodyOrder | None = ...,
        siblings: _Siblings | None = ...,
        velocity_at: _VelocityAt | None = ...,
        device: _Device,
        **options: Any,
    ) -> MotionLibrary[DeviceArray]: ...

    @classmethod
    def load(
        cls,
        files: _Path | Iterable[_Path],
        *,
        skeleton: _Skeleton | None = None,
        method: str = "slerp",
        engine: Engine | None = None,
        on_error: _OnError = "refuse",
        packed: bool = False,
        fps: float | str | Fraction | None = None,
        tracks: Sequence[str] | Sequence[int] | None = None,
        collapse: bool = False,
        progress: _Progress | None = None,
        shard: tuple[int, int] | None = None,
        robot: Robot | None = None,
        order: _Order | None = None,
        body_order: _BodyOrder | None = None,
        siblings: _Siblings | None = None,
        velocity_at: _VelocityAt | None = None,
        device: _Device | None = None,
        **options: Any,
    ) -> MotionLibrary[Any]:
        """Reads motion files: a path, a pattern such as "amass/**/*.npz", or a list of them, on all threads. Every clip
        of every file belongs to the library, in the order of the file names.

        * `fps`: clips are sampled at this rate by `method`; an incomplete frame at the end is left out.
        * `tracks`: the names or the indices of joints, in the order of the results. Their parents must be included,
          too, unless `collapse` is set. Numbers of other joints that are not finite are no errors.
        * `collapse`: the motion of joints that are left out is added to their children, as in `Clip.select`, at the
          frames of `fps`.
        * `shard`: read only the files for one of several processes, as (rank, processes): the library is then
          `load(…).shard(rank, processes)`. For the order of the joints, the first file of all is read, too, unless
          `skeleton` has it.
        * `options`: the keywords of `tumble.load`, for each file, such as `source_fps`, `up`, `scale`, `offsets`,
          `body_model` and `map`. With `tracks`, `offsets` has a row for each selected joint, in the order of `tracks`,
          or a row for each joint of the file, in the order of the file; the number of rows decides which. Or `offsets`
          is a dict by names. With `collapse`, it has all joints of the file.
        * `on_error`: "refuse" ends at the first file that cannot be read. "skip" leaves out such files, and clips that
          do not fit the skeleton, and lists them in `skipped`. Files of AMASS without a motion (`shape.npz`,
          `*_stagei.npz`) are left out, too.
        * `progress`: a bar such as `tqdm.tqdm` or an instance of it, or a function, which is called with the number of
          files read so far and of all.
        * `packed`, `device`, `robot` and the parameters for robots: as for the class.

        >>> import tempfile, os, tumble
        >>> folder = tempfile.mkdtemp()
        >>> tumble.save(os.path.join(folder, "door.npz"), tumble.Clip(
        ...     [0.0, 1.0], [[0, 0, 0, 1], [0, 0, 1, 0]], names=["door"], parents=[None]), fps=30)
        >>> tumble.MotionLibrary.load(os.path.join(folder, "*.npz"), fps=10).rates
        array([10.])
        """
        patterns = [files] if isinstance(files, str | os.PathLike) else list(files)
        paths: list[str] = []
        for pattern in (os.fspath(path) for path in patterns):
            found = sorted(_glob.glob(pattern, recursive=True)) if _glob.has_magic(pattern) else [pattern]
            if not found:
                raise FileNotFoundError(f"no file matches {pattern}")
            paths += found
        rank, processes = (0, 1) if shard is None else _rank(shard)
        share = list(_share(len(paths), rank, processes))
        skip = _skips(on_error)

        def read(
            indices: list[int], step: Callable[[int, int], object] | None = None
        ) -> tuple[list[tuple[int, Clip]], list[tuple[int, Skipped]]]:
            """The clips of files, and the files that were skipped, each with the index of the file."""
            files, faults = load_all(
                [paths[index] for index in indices],
                options,
                skip=skip,
                progress=step,
                fps=fps,
                tracks=tracks,
                collapse=collapse,
                method=method,
            )
            at_fault = [(os.fspath(path), code, message) for path, code, message in faults]
            clips: list[tuple[int, Clip]] = []
            left_out: list[tuple[int, Skipped]] = []
            rest = iter(files)
            for index in indices:
                # Files were read in this order.
                if at_fault and at_fault[0][0] == os.fspath(pathlib.Path(paths[index])):
                    path, code, message = at_fault.pop(0)
                    left_out.append((index, Skipped(path, None, code, message)))
                else:
                    clips += [(index, clip) for clip in next(rest).clips]
            return clips, left_out

        with _bar(progress, len(share)) as step:
            clips, skipped = read(share, step)
        if not clips:
            if skipped:
                raise InputError(f"no file could be read; the first: {skipped[0][1].message}")
            if shard is not None:
                raise InputError(f"shard: none of the {len(paths)} files is for process {rank} of {processes}")
        # The joints have the order of the first clip of all files, also in processes that do not read this clip.
        before: list[tuple[int, Clip]] = []
        if skeleton is None and robot is None:
            for index in range(clips[0][0] if clips else 0):
                if index % processes != rank and not before:
                    before = read([index])[0]
        if skeleton is not None and not isinstance(skeleton, tuple):
            skeleton = shaped(_clip_of(skeleton), tracks=tracks, collapse=collapse, method=method)
        every = before + clips
        of_robot: dict[str, Any] = {
            "robot": robot,
            "order": order,
            "body_order": body_order,
            "siblings": siblings,
            "velocity_at": velocity_at,
        }
        made: MotionLibrary[Any] = cls(
            [clip for _, clip in every],
            method=method,
            skeleton=skeleton,
            engine=engine,
            on_error=on_error,
            packed=packed,
            device=device,
            **of_robot,
        )
        file_of = np.array([index for index, _ in every], np.int64)
        del before, clips, every
        _return_memory()
        made._shard_indices = file_of[made._shard_indices]
        made.skipped = [one for _, one in skipped] + made.skipped
        made._skipped_indices = [index for index, _ in skipped] + [int(file_of[index]) for index in made._skipped_indices]
        return made if shard is None else made.shard(rank, processes)

    def _put_on(self, device: _Device | None) -> None:
        """Copies the clips to a device."""
        self._device: Engine | None = None
        if isinstance(device, str) and device.lower() == "auto":
            raise InputError(
                'device: with "auto", results could be arrays of NumPy\'s or DeviceArrays; give "cpu", "vulkan", or a name '
                "or an index in tumble.devices()"
            )
        if device is None or (isinstance(device, str) and device.lower() == "cpu"):
            return
        if self._mirrored is not None:
            raise InputError("device: mirror images are computed on the CPU; open the library without `device`")
        self._device = device if isinstance(device, Engine) else Engine(device)
        self._on_device = DeviceMotions(self._motions, self._device)

    @property
    def device(self) -> str:
        """The name of the device on which the clips lie: "CPU", or that of a Vulkan device.

        >>> import tumble
        >>> tumble.MotionLibrary([tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])]).device
        'CPU'
        """
        return "CPU" if self._device is None else self._device.device

    def shard(self, rank: int, processes: int) -> MotionLibrary[_A]:
        """The clips for one of several processes; each clip belongs to one process. The clips of a library that was loaded are
        divided by their files, as `load` with `shard` divides them. The memory is shared, not copied; `save` and pickles
        contain the clips of the shard alone.

        >>> import tumble
        >>> doors = [tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None], name=name) for name in "abc"]
        >>> tumble.MotionLibrary(doors).shard(0, 2).names
        ['a', 'c']
        """
        rank, processes = _rank((rank, processes))
        share = np.flatnonzero(self._shard_indices % processes == rank)
        if not share.size:
            raise InputError(f"shard: none of the {len(self)} clips is for process {rank} of {processes}")
        part = self._part(share)
        part._shard_indices = part._shard_indices // processes
        skipped = [(index, one) for index, one in zip(self._skipped_indices, self.skipped) if index % processes == rank]
        part.skipped = [one for _, one in skipped]
        part._skipped_indices = [index // processes for index, _ in skipped]
        return part

    def with_mirrored(self, axis: _Axis, *, pairs: Sequence[int] | None = None) -> MotionLibrary[_A]:
        """These clips, and behind them the mirror image of each, in the same order: the image of clip `i` is clip
        `len(library) + i`. The memory is shared, not copied. States are mirrored when they are sampled, as
        `features.mirrored_positions` and `features.mirrored_rotations` mirror them: at the plane through the origin across
        `axis`, "x", "y" or "z", the axis from left to right. `pairs`: the partner of each joint on the other side, by default
        by the words for sides in the names (`features.mirror_pairs`). Joints have to be arranged symmetrically in the tree, and
        their axes at rest have to be mirror images, as those of SMPL and BVH are; for other skeletons, make clips by
        `Clip.mirrored`. So do for clips with scalars such as a robot's angles, which are refused here. Contacts change their
        sides by their names.

        >>> import tumble
        >>> half = 0.5 ** 0.5
        >>> wave = tumble.Clip([0.0], [[[0, 0, 0, 1]], [[half, half, 0, 0]], [[0, 0, 0, 1]]], layout="track",
        ...                    name="wave", names=["spine", "left_arm", "right_arm"], parents=[None, 0, 0])
        >>> both = tumble.MotionLibrary([wave]).with_mirrored("x")
        >>> both.names, both.sample(1, 0.0, arrays=["rotations"]).rotations[2].round(2)
        (['wave', 'wave (mirrored)'], array([ 0.71, -0.71, -0.  ,  0.  ], dtype=float32))
        """
        axes = ("x", "y", "z")
        if axis not in axes:
            raise InputError(f"axis: there is no `{axis}`; there are {', '.join(axes)}")
        if self._device is not None:
            raise InputError("with_mirrored: mirror images are computed on the CPU; use a library without `device`")
        if self._bodies:
            raise InputError("with_mirrored: the library has a robot; mirror its clips with `Clip.mirrored`, and make a library of both")
        if self._mirrored is not None:
            raise InputError("with_mirrored: the library has mirror images already")
        if self.dof_names:
            raise InputError(
                f"with_mirrored: the library has scalars ({self.dof_names[0]}), whose signs depend on the axes of a robot's"
                " joints; add clips that `Clip.mirrored(axis, robot=…)` makes"
            )
        partners = joint_partners(self.joint_names, self._motions.parents, None if pairs is None else list(pairs))
        both = self._part(np.tile(np.arange(len(self)), 2))
        are_mirrored = np.arange(2 * len(self)) >= len(self)
        return both._mark(_Mirrored(are_mirrored, axes.index(axis), partners))

    def _mark(self, mirrored: _Mirrored) -> MotionLibrary[_A]:
        """Marks clips as mirror images."""
        self._mirrored = mirrored
        self.names = [f"{name} (mirrored)" if image else name for name, image in zip(self.names, mirrored.clips)]
        return self

    def _part(self, clips: NDArray[np.int64]) -> MotionLibrary[_A]:
        """Some clips, by their indices, in the same memory."""
        part: MotionLibrary[_A] = MotionLibrary.__new__(MotionLibrary)
        part.__dict__.update(self.__dict__)
        part.names = [self.names[index] for index in clips]
        part.paths = [self.paths[index] for index in clips]
        part.lengths, part.rates, part._shard_indices = self.lengths[clips], self.rates[clips], self._shard_indices[clips]
        part._only = self._ids(clips)
        part._in_file = clips if self._in_file is None else self._in_file[clips]
        if self._mirrored is not None:
            part._mirrored = replace(self._mirrored, clips=self._mirrored.clips[clips])
        return part

    def _ids(self, ids: NDArray[np.int64]) -> NDArray[np.int64]:
        """The indices among all clips in memory."""
        if self._only is None:
            return ids
        unknown = ids[(ids < 0) | (ids >= len(self._only))]
        if unknown.size:
            raise InputError(f"clip_ids: there is no clip {unknown[0]}; there are {len(self._only)}, from 0")
        return self._only[ids]

    def _each(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """A number for each clip in memory, of those of this library."""
        if self._only is None:
            return values
        every = np.full(len(self._motions), np.nan)
        every[self._only] = values
        return every

    @overload
    def sample(
        self,
        clip_ids: ArrayLike,
        times: ArrayLike,
        *,
        arrays: None = ...,
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _Whole[_A]: ...

    @overload
    def sample(
        self,
        clip_ids: ArrayLike,
        times: ArrayLike,
        *,
        arrays: Sequence[Literal["rotations"]],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _Rotations[_A]: ...

    @overload
    def sample(
        self,
        clip_ids: ArrayLike,
        times: ArrayLike,
        *,
        arrays: Sequence[Literal["positions"]],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _Positions[_A]: ...

    @overload
    def sample(
        self,
        clip_ids: ArrayLike,
        times: ArrayLike,
        *,
        arrays: Sequence[Literal["world_rotations"]],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _WorldRotations[_A]: ...

    @overload
    def sample(
        self,
        clip_ids: ArrayLike,
        times: ArrayLike,
        *,
        arrays: Sequence[Literal["velocities"]],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _Velocities[_A]: ...

    @overload
    def sample(
        self,
        clip_ids: ArrayLike,
        times: ArrayLike,
        *,
        arrays: Sequence[Literal["angular_velocities"]],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _AngularVelocities[_A]: ...

    @overload
    def sample(
        self,
        clip_ids: ArrayLike,
        times: ArrayLike,
        *,
        arrays: Sequence[_Name],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _Some[_A]: ...

    @overload
    def sample(
        self,
        clip_ids: ArrayLike,
        times: ArrayLike,
        *,
        arrays: None = ...,
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: _S,
    ) -> _S: ...

    def sample(
        self,
        clip_ids: ArrayLike,
        times: ArrayLike,
        *,
        arrays: Sequence[_Name] | None = None,
        finite: bool = False,
        order: _Order | None = None,
        rotations: _Representation = "quaternion",
        heading: _Heading | None = None,
        up: _Ground | None = None,
        out: MotionState[Any] | None = None,
    ) -> MotionState[Any]:
        """The states of instances: `clip_ids` has the clip of each instance, and `times` its time, in seconds after the clip's
        first key. (`Clip` and `Engine` use the times of the keys.) Both have the shape of the result, (N,) for example, or
        shapes that broadcast to it, such as (N, 1) and (N, 10), or a number and (N,). Before the first key of a clip, and after
        its last one, the pose is that of this key, and the velocities are those at this key, not 0. (`Engine.velocity` and
        scalars of an `Engine` give 0 there.)

        * `arrays`: the names of the arrays to compute, by default all; fewer arrays take less time.
        * `out`: a state; the arrays that it has are filled again.
        * `finite`: velocities as differences of the two frames of the clip's rate around a time, as other motion
          libraries have them, instead of the exact derivatives.
        * `order`: the order of the components of quaternions, by default "xyzw"; that of a library with `robot` was
          stated when it was made.
        * `rotations`: how both arrays of rotations are stored: "quaternion" (…, 4), "matrix" (…, 3, 3) for column
          vectors, "6d" (…, 6), the first two columns of the matrix (`six-columns` of docs/features.md), or "rotvec"
          (…, 3), axis times angle.
        * `heading`: states in the heading frame of the root, the first joint without a parent, instead of the world.
          The frame is on the ground below the root, and has its heading: "twist", or that of its axis "x", "y" or "z",
          as `features.heading`. Positions, velocities and rotations in the world, and the `rotations` of roots, are
          expressed in the frame; the root is in place, as `features.root_motion` computes it. Velocities stay those of
          the world: the frame does not move.
        * `up`: the axis that points up, "y" or "z", which `heading` needs.

        A library on a device returns new `DeviceArray`s, with `rotations` "quaternion", "matrix" or "6d"; `out`, `order`
        and `heading` are for the CPU alone. `clip_ids` and `times` are read by the host; arrays of a device are copied to it
        first.

        >>> import tumble
        >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
        >>> library = tumble.MotionLibrary([door])
        >>> library.sample([0], [0.5], arrays=["positions"]).positions.shape
        (1, 1, 3)
        >>> library.sample(0, [0.5, 1.0], rotations="6d").rotations.shape
        (2, 1, 6)
        >>> library.sample(0, 0.5, arrays=["rotations"], heading="twist", up="z").rotations[0, 3]
        np.float32(1.0)
        """
        keywords: dict[str, Any] = {
            "arrays": arrays,
            "finite": finite,
            "order": order,
            "rotations": rotations,
            "out": out,
        }
        return self._sampled(clip_ids, times, frames=(heading, up, 1), **keywords)

    def _sampled(
        self,
        clip_ids: ArrayLike,
        times: ArrayLike,
        *,
        arrays: Sequence[_Name] | None,
        finite: bool,
        order: _Order,
        rotations: _Representation,
        frames: tuple[str | None, str | None, int],
        out: MotionState[Any] | None,
    ) -> MotionState[Any]:
        """The states of instances. `frames`: the heading, the axis that points up, and how many states after one another have
        the heading frame of the first of them."""
        heading, up, window = frames
        if (heading is None) != (up is None):
            raise InputError('heading and up: give both, such as heading="twist", up="z", or neither')
        ids, moments = _indices("clip_ids", clip_ids), _numbers("times", times, "seconds")
        try:
            shape = np.broadcast_shapes(ids.shape, moments.shape)
        except ValueError:
            shapes = f"{ids.shape} and {moments.shape}"
            raise InputError(f"clip_ids and times: their shapes are {shapes}; give shapes that broadcast") from None
        listed = np.ascontiguousarray(np.broadcast_to(ids, shape), np.int64).reshape(-1)
        ids = self._ids(listed)
        moments = np.ascontiguousarray(np.broadcast_to(moments, shape)).reshape(-1)
        if self._bodies:
            each: dict[str, tuple[int, ...]] = {name: (self.joints,) for name in _BODIES if name.startswith("joint")}
            each |= {
                name: (self._bodies, 4 if name == "body_quat_w" else 3) for name in _BODIES if name.startswith("body")
            }
            if order is not None or rotations != "quaternion" or heading is not None:
                raise InputError(
                    "order, rotations and heading: a library with `robot` has bodies in the world, and body_quat_w has quaternions"
                    " in the order that was given to the library; leave them out"
                )
        else:
            order = "xyzw" if order is None else order
            each = {name: (self._motions.joints, *of) for name, of in _shapes_of(order, rotations).items()}
            each |= {name: (len(self._scalars[_kind(name)].names),) for name in _SCALARS}
        if isinstance(arrays, str):
            raise TypeError(f'arrays: {arrays!r} is one name; give a list, such as ["{arrays}"]')
        for name in arrays if arrays is not None else ():
            self._check_name(name)
        every: tuple[str, ...] = _BODIES if self._bodies else _NAMES
        if self._device is not None:
            if out is not None or order not in (None, "xyzw") or rotations == "rotvec" or heading is not None:
                raise InputError(
                    "out, order, heading and rotvec: a library on a device makes new arrays in the world, of quaternions"
                    " x y z w, matrices or 6d; leave them out, and convert on the device, or use a library without `device`"
                )
            names = every if arrays is None else tuple(arrays)
            return self._sampled_on_device(ids, moments, shape, names, rotations, finite)
        if out is None:
            if not self._bodies:
                every = (*every, *(name for name in _SCALARS if self._scalars[_kind(name)].names))
            asked = every if arrays is None else arrays
            out = MotionState(**{name: _aligned((*shape, *each[name])) for name in asked})
        elif not isinstance(out, MotionState):
            raise TypeError(f"out: it is of the type {type(out).__name__}; give a MotionState, such as a result of `sample`")
        elif arrays is not None:
            raise InputError("arrays and out: the arrays of `out` are those that are filled; give one of the two")
        else:
            for name in _ALL:
                if getattr(out, name) is not None:
                    self._check_name(name)
            _check_out(out, shape, each)
        filled = _flat(out, len(shape))
        if self._bodies:
            self._fill_bodies(ids, moments, finite, filled)
            return out
        # Quaternions that are needed but not requested, or requested in another representation.
        quaternions = {
            name: _aligned((ids.size, self._motions.joints, 4))
            for name in ("rotations", "world_rotations")
            if getattr(filled, name) is not None and rotations != "quaternion"
        }
        if heading is not None and filled.rotations is None and filled.world_rotations is None:
            quaternions["rotations"] = _aligned((ids.size, self._motions.joints, 4))
        found = replace(filled, **quaternions)
        self._fill(ids, moments, finite, found)
        self._reframe(found, listed, None if heading is None else (str(up), heading, self._motions.parents, window))
        for of, array in ((found.rotations, filled.rotations), (found.world_rotations, filled.world_rotations)):
            if of is not None and array is not None and of is not array:
                represent(self._engine, of, rotations, array)
        if order == "wxyz":
            for array in (out.rotations, out.world_rotations):
                if array is not None:
                    put_w_first(array)
        self._fill_scalars(ids, moments, finite, filled)
        if self._mirrored is not None and filled.contacts is not None:
            of_mirrored = self._mirrored.clips[listed]
            sides = np.array(mirror_pairs(self.contact_names), np.int64)
            filled.contacts[of_mirrored] = filled.contacts[of_mirrored][:, sides]
        return out

    def _reframe(
        self,
        state: MotionState,
        clip_ids: NDArray[np.int64],
        heading: tuple[str, str, list[int | None], int] | None,
    ) -> None:
        """States of mirrored clips become mirror images; then all are expressed in heading frames."""
        mirror = None
        if self._mirrored is not None:
            mirror = (self._mirrored.clips[clip_ids], self._mirrored.axis, self._mirrored.pairs)
        if mirror is not None or heading is not None:
            arrays = (state.rotations, state.positions, state.world_rotations, state.velocities, state.angular_velocities)
            reframe(arrays, self._motions.joints, mirror, heading)

    def _check_name(self, name: str) -> None:
        """Refuses arrays that a library does not have."""
        if name not in _ALL:
            raise InputError(f"arrays: there is no `{name}`; there are {', '.join(_BODIES if self._bodies else _ALL)}")
        if name in _BODIES and not self._bodies:
            raise InputError(f"arrays: {name} is of a robot; make the library with `robot`")
        if self._bodies and name not in _BODIES:
            raise InputError(f"arrays: the library has a robot, and no {name}; there are {', '.join(_BODIES)}")
        if name not in _SCALARS:
            return
        kind = _kind(name)
        if self._device is not None:
            raise InputError(f"arrays: {name} are sampled on the CPU; use a library without `device` for them")
        if not self._scalars[kind].names:
            reason = self._scalars[kind].reason
            raise InputError(f"arrays: the library has no {name}" + (f": {reason}" if reason else ""))

    def _fill_bodies(
        self, ids: NDArray[np.int64], moments: NDArray[np.float64], finite: bool, out: MotionState
    ) -> None:
        """Fills the arrays of a robot, (N, …)."""
        arrays = [getattr(out, name) for name in _BODIES]
        moves = any(array is not None for name, array in zip(_BODIES, arrays) if _is_velocity(name))
        columns = [None if array is None else array.reshape(*array.shape, 1) if array.ndim == 2 else array for array in arrays]
        sample_bodies(self._motions, self._engine, ids, moments, columns, self._frames(ids) if finite and moves else None)

    def _fill_scalars(
        self, ids: NDArray[np.int64], moments: NDArray[np.float64], finite: bool, out: MotionState
    ) -> None:
        """Fills the arrays of scalars, (N, scalars)."""
        for kind, values, rates in (("dofs", out.dofs, out.dof_velocities), ("contacts", out.contacts, None)):
            scalars = self._scalars[kind]
            if scalars.motions is None or values is None and rates is None:
                continue
            at, speeds = (
                None if array is None else np.empty((ids.size, scalars.motions.joints, 3), np.float32)
                for array in (values, rates)
            )
            frames = self._frames(ids) if finite and speeds is not None else None
            scalars.motions.sample(self._engine, ids, moments, None, at, None, speeds, None, frames)
            for array, found in ((values, at), (rates, speeds)):
                if array is not None and found is not None:
                    np.take(found.reshape(ids.size, -1), scalars.columns, axis=1, out=array, mode="clip")

    def _frames(self, ids: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The rates and lengths of the clips in memory, for differences between frames."""
        rates = self._each(self.rates)
        known = ids[(ids >= 0) & (ids < len(rates))]
        unknown = known[np.isnan(rates[known])]
        if unknown.size:
            index = int(unknown[0]) if self._only is None else int(np.flatnonzero(self._only == unknown[0])[0])
            name = self.paths[index] or self.names[index]
            raise InputError(f"finite: clip {index} ({name}) has no rate; load it with `fps`")
        return rates, self._each(self.lengths)

    def _sampled_on_device(
        self,
        ids: NDArray[np.int64],
        moments: NDArray[np.float64],
        shape: tuple[int, ...],
        names: Sequence[str],
        rotations: str,
        finite: bool,
    ) -> MotionState[DeviceArray]:
        """The arrays with these names, in memory of the device."""
        frames = self._frames(ids) if finite and any(_is_velocity(name) for name in names) else None
        names = list(dict.fromkeys(names))
        found = self._on_device.sample(ids, moments, shape, names, rotations, frames)
        return MotionState(**dict(zip(names, found, strict=True)))

    def _fill(
        self, ids: NDArray[np.int64], moments: NDArray[np.float64], finite: bool, out: MotionState
    ) -> None:
        """Fills the arrays of instances, (N,)."""
        frames = None
        if finite and not (out.velocities is None and out.angular_velocities is None):
            frames = self._frames(ids)
        self._motions.sample(
            self._engine,
            ids,
            moments,
            out.rotations,
            out.positions,
            out.world_rotations,
            out.velocities,
            out.angular_velocities,
            frames,
        )

    @overload
    def sample_windows(
        self,
        clip_ids: ArrayLike,
        starts: ArrayLike,
        count: int,
        fps: float,
        *,
        arrays: None = ...,
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _Whole[_A]: ...

    @overload
    def sample_windows(
        self,
        clip_ids: ArrayLike,
        starts: ArrayLike,
        count: int,
        fps: float,
        *,
        arrays: Sequence[Literal["rotations"]],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _Rotations[_A]: ...

    @overload
    def sample_windows(
        self,
        clip_ids: ArrayLike,
        starts: ArrayLike,
        count: int,
        fps: float,
        *,
        arrays: Sequence[Literal["positions"]],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _Positions[_A]: ...

    @overload
    def sample_windows(
        self,
        clip_ids: ArrayLike,
        starts: ArrayLike,
        count: int,
        fps: float,
        *,
        arrays: Sequence[Literal["world_rotations"]],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _WorldRotations[_A]: ...

    @overload
    def sample_windows(
        self,
        clip_ids: ArrayLike,
        starts: ArrayLike,
        count: int,
        fps: float,
        *,
        arrays: Sequence[Literal["velocities"]],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _Velocities[_A]: ...

    @overload
    def sample_windows(
        self,
        clip_ids: ArrayLike,
        starts: ArrayLike,
        count: int,
        fps: float,
        *,
        arrays: Sequence[Literal["angular_velocities"]],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _AngularVelocities[_A]: ...

    @overload
    def sample_windows(
        self,
        clip_ids: ArrayLike,
        starts: ArrayLike,
        count: int,
        fps: float,
        *,
        arrays: Sequence[_Name],
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: None = ...,
    ) -> _Some[_A]: ...

    @overload
    def sample_windows(
        self,
        clip_ids: ArrayLike,
        starts: ArrayLike,
        count: int,
        fps: float,
        *,
        arrays: None = ...,
        finite: bool = ...,
        order: _Order | None = ...,
        rotations: _Representation = ...,
        heading: _Heading | None = ...,
        up: _Ground | None = ...,
        out: _S,
    ) -> _S: ...

    def sample_windows(
        self,
        clip_ids: ArrayLike,
        starts: ArrayLike,
        count: int,
        fps: float,
        *,
        arrays: Sequence[_Name] | None = None,
        finite: bool = False,
        order: _Order | None = None,
        rotations: _Representation = "quaternion",
        heading: _Heading | None = None,
        up: _Ground | None = None,
        out: MotionState[Any] | None = None,
    ) -> MotionState[Any]:
        """`count` states of each instance, from the time `starts` on, `fps` a second: arrays (…, count, joints, …) for
        `clip_ids` and `starts` of the shape (…). Other keywords are those of `sample`. With `heading`, all states of a window
        are in the heading frame of its first state. For the frame of each state, use `sample`.

        >>> import tumble
        >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
        >>> library = tumble.MotionLibrary([door])
        >>> library.sample_windows([0, 0, 0], [0.0, 0.5, 1.0], 10, fps=30).rotations.shape
        (3, 10, 1, 4)
        """
        count, rate = _count("count", count, "a number of states"), _number("fps", fps, "frames a second")
        if not rate > 0:
            raise InputError(f"fps: {fps} is no rate greater than 0")
        ids, first = _indices("clip_ids", clip_ids)[..., None], _numbers("starts", starts, "seconds")[..., None]
        times = first + np.arange(count) / rate
        keywords: dict[str, Any] = {
            "arrays": arrays,
            "finite": finite,
            "order": order,
            "rotations": rotations,
            "out": out,
        }
        return self._sampled(ids, times, frames=(heading, up, count), **keywords)

    def draw(
        self,
        count: int,
        rng: np.random.Generator,
        *,
        weights: ArrayLike | None = None,
        window: float = 0.0,
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Random clips and times: `clip_ids` and `times`, (count,), for `sample`. The probability of a clip is proportional to
        its entry in `weights`, by default to its length, so that every moment is equally likely. Times are uniform within a
        clip. The same state of `rng` gives the same result.

        `window`: the seconds that have to follow each time in its clip, for `sample_windows`: (frames - 1) / fps. Clips that
        are shorter are not drawn, and by default the probability of a clip is proportional to the times that are left.

        >>> import numpy as np, tumble
        >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
        >>> ids, times = tumble.MotionLibrary([door]).draw(4, np.random.default_rng(1))
        >>> ids
        array([0, 0, 0, 0])
        """
        count, seconds = _count("count", count, "a number of clips"), _number("window", window, "seconds")
        if seconds < 0:
            raise InputError(f"window: {window!r} is no number of seconds from 0 on")
        _check_generator(rng)
        left = self.lengths - seconds
        each = np.maximum(left, 0.0) if weights is None else _numbers("weights", weights, "numbers")
        if each.shape != (len(self),) or not np.isfinite(each).all() or (each < 0).any():
            raise InputError(f"weights: give a number of 0 or more for each of the {len(self)} clips")
        fits = left >= 0
        if not fits.any():
            longest = self.lengths.max(initial=0.0)
            raise InputError(f"window: no clip lasts {window} s; the longest lasts {longest} s")
        each = np.where(fits, each, 0.0)
        total = each.sum()
        if total == 0 and weights is not None:
            raise InputError("weights: they are 0 for all clips that can be drawn")
        # If all clips have only one key, their length is 0, and all are equally likely.
        chances = each / total if total > 0 else fits / fits.sum()
        ids = rng.choice(len(self), size=count, p=chances).astype(np.int64)
        return ids, rng.uniform(0.0, np.maximum(left[ids], 0.0))

    @property
    def nbytes(self) -> int:
        """The bytes of the prepared clips: with slerp 16 per key of a joint (8 if `packed`), with smooth methods 192; and
        for each frame of a clip 16 for its time and 16 for the position of the root (more if that is a cubic). A library on
        a device has as many there, and keeps those of the host for `save` and for copies.

        >>> import numpy as np, tumble
        >>> keys = np.tile([0.0, 0.0, 0.0, 1.0], (22, 3000, 1))
        >>> long = tumble.Clip(np.arange(3000) / 30, keys, layout="track", parents=[None] + list(range(21)))
        >>> [tumble.MotionLibrary([long], packed=packed).nbytes // (22 * 3000) for packed in (False, True)]
        [16, 8]
        """
        tables = [self._motions, *(scalars.motions for scalars in self._scalars.values() if scalars.motions is not None)]
        return sum(array.nbytes for motions in tables for array in motions.arrays().values())

    def sample_times(self, clip_ids: ArrayLike, rng: np.random.Generator) -> NDArray[np.float64]:
        """A time within each of these clips, uniformly, in seconds after its first key.

        >>> import numpy as np, tumble
        >>> door = tumble.Clip([0.0, 2.0], [[[0, 0, 0, 1], [0, 0, 1, 0]]], parents=[None])
        >>> times = tumble.MotionLibrary([door]).sample_times([0, 0], np.random.default_rng(1))
        >>> ((0 <= times) & (times <= 2)).all()
        np.True_
        """
        _check_generator(rng)
        ids = _indices("clip_ids", clip_ids)
        unknown = ids[(ids < 0) | (ids >= len(self))]
        if unknown.size:
            raise InputError(f"clip_ids: there is no clip {unknown[0]}; there are {len(self)}, from 0")
        times: NDArray[np.float64] = rng.uniform(0.0, self.lengths[ids])
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

    @overload
    @classmethod
    def open(  # type: ignore[overload-overlap]
        cls, path: _Path, *, mmap: bool = ..., engine: Engine | None = ..., device: Literal["cpu"] | None = ...
    ) -> MotionLibrary[_Array]: ...

    @overload
    @classmethod
    def open(
        cls, path: _Path, *, mmap: bool = ..., engine: Engine | None = ..., device: _Device
    ) -> MotionLibrary[DeviceArray]: ...

    @classmethod
    def open(
        cls, path: _Path, *, mmap: bool = True, engine: Engine | None = None, device: _Device | None = None
    ) -> MotionLibrary[Any]:
        """Opens a file of `save`. With `mmap` the file is mapped: motions that are not sampled are not read, and
        several processes share its memory. `device`: as of the class; the file is copied to it.

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
        return cls._of_arrays(arrays, engine, file if mmap else None, device)

    @classmethod
    def _of_arrays(
        cls,
        arrays: dict[str, Any],
        engine: Engine | None,
        file: str | None = None,
        device: _Device | None = None,
    ) -> MotionLibrary[Any]:
        missing = [name for name in _STORED if name not in arrays]
        if missing or int(arrays["version"]) not in range(1, _VERSION + 1):
            raise InputError(f"{file or 'arrays'}: not a motion library of this version of tumble")
        self: MotionLibrary[Any] = cls.__new__(cls)
        self.names = [str(name) for name in arrays["names"]]
        clips = len(self.names)
        self.paths = [str(path) for path in arrays["paths"]] if "paths" in arrays else [""] * clips
        self._shard_indices = np.asarray(arrays["shard_indices"] if "shard_indices" in arrays else np.arange(clips), np.int64)
        if len(self.paths) != clips or self._shard_indices.shape != (clips,):
            raise InputError(f"{file or 'arrays'}: its paths or shard indices are not those of {clips} clips")
        self.lengths = np.asarray(arrays["lengths"])
        self.rates = np.asarray(arrays["rates"])
        self._method = str(arrays["method"])
        self._motions = Motions.of_arrays(arrays)
        self._scalars = {kind: _Scalars.of_arrays(kind, arrays) for kind in ("dofs", "contacts")}
        if any(one.motions is not None and len(one.motions) != len(self._motions) for one in self._scalars.values()):
            raise InputError(f"{file or 'arrays'}: its scalars are not those of {len(self._motions)} clips")
        self._engine = engine if engine is not None else Engine()
        self._file = file
        self.skipped = []
        self._skipped_indices = []
        self._only = _indices("only", arrays["only"]) if "only" in arrays else None
        self._in_file = None
        self._mirrored = _Mirrored.of_arrays(arrays, clips, self._motions.parents)
        if self._only is not None and self._only.shape != (clips,) or self._mirrored is not None and self._only is None:
            raise InputError(f"{file or 'arrays'}: its indices are not those of {clips} clips")
        self._put_on(device)
        return self

    def _arrays(self) -> dict[str, Any]:
        about = {
            "version": np.array(_VERSION if self._mirrored is not None else _VERSION - 1),
            "method": np.array(self._method),
            "names": np.array(self.names, dtype=np.str_),
            "paths": np.array(self.paths, dtype=np.str_),
            "shard_indices": self._shard_indices,
            "lengths": self.lengths,
            "rates": self.rates,
            "joint_names": np.array(self.joint_names, dtype=np.str_),
        }
        unplaced, only = self._motions.unplaced, None if self._only is None else self._only.tolist()
        if self._mirrored is not None and self._only is not None:
            # A clip and its mirror image have the same memory.
            kept, about["only"] = np.unique(self._only, return_inverse=True)
            only = kept.tolist()
            about |= self._mirrored.arrays()
        if only is not None and unplaced:
            unplaced = [unplaced[index] for index in only]
        about["unplaced"] = np.array(unplaced, dtype=np.str_)
        if self._bodies:
            about["body_names"] = np.array(self.body_names, dtype=np.str_)
        for kind, scalars in self._scalars.items():
            about |= scalars.arrays(kind, only)
        return {**about, **self._motions.arrays(only)}

    def __reduce__(self) -> tuple[Any, ...]:
        if self._file is not None:
            # The file has the indices of all clips.
            state = (None, None) if self._in_file is None else (self._shard_indices, self._mirrored)
            return _opened, (self._file, self._engine, self._in_file, self._device, *state)
        return MotionLibrary._of_arrays, (self._arrays(), self._engine, None, self._device)

    def __len__(self) -> int:
        return len(self.names)

    @property
    def joints(self) -> int:
        """Joints of the skeleton, or the hinges and slides of the robot."""
        return len(self.joint_names) if self._bodies else self._motions.joints

    @property
    def joint_names(self) -> list[str]:
        """The names of the joints, in the order of all arrays: those of the skeleton, or of the robot's `joint_pos`."""
        return self._motions.joint_names

    @property
    def body_names(self) -> list[str]:
        """The names of the robot's bodies, in the order of all arrays; empty without a robot."""
        return self._motions.body_names

    @property
    def _bodies(self) -> int:
        return len(self._motions.body_names)

    @property
    def dof_names(self) -> list[str]:
        """The names of the scalars in `dofs` and `dof_velocities`, in their order.

        >>> import tumble
        >>> arm = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1]] * 2, parents=[None], scalars={"elbow": ([0.0, 1.0], [0.0, 2.0])})
        >>> library = tumble.MotionLibrary([arm])
        >>> library.dof_names, library.sample(0, 0.25, arrays=["dofs"]).dofs
        (['elbow'], array([0.5], dtype=float32))
        """
        return list(self._scalars["dofs"].names)

    @property
    def contact_names(self) -> list[str]:
        """The names of the scalars in `contacts`, in their order."""
        return list(self._scalars["contacts"].names)

    @property
    def method(self) -> str:
        """The method by which the clips are interpolated."""
        return self._method

    def __repr__(self) -> str:
        seconds = float(self.lengths.sum())
        device = "" if self._device is None else f", on {self.device}"
        return f"MotionLibrary({len(self)} clips, {self.joints} joints, {seconds:.6g} s{device})"


def _return_memory() -> None:
    """Returns freed memory to the system. The files of a library take several times its memory while they are read, and the
    allocator of glibc would keep it."""
    try:
        trim = ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):
        return  # another allocator
    trim(0)


def _skips(on_error: str) -> bool:
    if on_error not in ("refuse", "skip"):
        raise InputError(f"on_error: there is no `{on_error}`; there are refuse, skip")
    return on_error == "skip"


def _on_host(values: Any) -> NDArray[Any]:
    """Numbers as an array of NumPy's; those of a device are copied."""
    if isinstance(values, DeviceArray):
        return values.numpy()
    kind = getattr(values, "__dlpack_device__", lambda: (1, 0))()[0]
    if not isinstance(values, np.ndarray) and kind not in (1, 3):
        # Tensors of PyTorch have `cpu`, arrays of CuPy `get`; JAX copies by itself.
        copy = getattr(values, "cpu", None) or getattr(values, "get", None)
        values = copy() if copy is not None else values
    return np.asarray(values)


def _aligned(shape: tuple[int, ...]) -> NDArray[np.float32]:
    """An array that begins at a cache line, which JAX takes without a copy."""
    size = int(np.prod(shape)) * 4
    memory = np.empty(size + _ALIGNED, np.uint8)
    first = -memory.ctypes.data % _ALIGNED
    return memory[first : first + size].view(np.float32).reshape(shape)


def _shapes_of(order: str, rotations: str) -> dict[str, tuple[int, ...]]:
    """The shape of a joint's numbers in each array."""
    if order not in ("xyzw", "wxyz"):
        raise InputError(f"order: there is no `{order}`; there are xyzw, wxyz")
    if rotations not in _SHAPES:
        raise InputError(f"rotations: there is no `{rotations}`; there are {', '.join(_SHAPES)}")
    if order == "wxyz" and rotations != "quaternion":
        raise InputError(f'order="wxyz" is of quaternions; leave it out with rotations="{rotations}"')
    return {name: _SHAPES[rotations] if name.endswith("rotations") else (3,) for name in _NAMES}


def _is_velocity(name: str) -> bool:
    return name.endswith("velocities") or "_vel" in name and not name.startswith("dof")


def _kind(name: str) -> str:
    """The scalars of an array."""
    return "contacts" if name == "contacts" else "dofs"


def _check_out(out: MotionState, shape: tuple[int, ...], each: dict[str, tuple[int, ...]]) -> None:
    """Refuses arrays of another shape, type or order in memory than results have."""
    for name in _ALL:
        array = getattr(out, name)
        if array is None:
            continue
        expected = (*shape, *each[name])
        if not isinstance(array, np.ndarray):
            raise InputError(f"out: its {name} are of the type {type(array).__name__}; give an array of NumPy")
        if array.dtype != np.float32 or array.shape != expected:
            raise InputError(f"out: its {name} are {array.dtype} {array.shape}; the result's are float32 {expected}")
        if not array.flags.c_contiguous:
            raise InputError(f"out: the numbers of its {name} are not contiguous (C order)")
        if not array.flags.writeable:
            raise InputError(f"out: its {name} are read-only")


def _flat(state: MotionState, axes: int) -> MotionState:
    """The same memory with one axis of instances."""
    arrays = {name: getattr(state, name) for name in _ALL}
    instances = {name: array for name, array in arrays.items() if array is not None}
    return MotionState(
        **{name: array.reshape(int(np.prod(array.shape[:axes])), *array.shape[axes:]) for name, array in instances.items()}
    )


def _opened(
    file: str,
    engine: Engine,
    in_file: NDArray[np.int64] | None = None,
    device: Engine | None = None,
    shard_indices: NDArray[np.int64] | None = None,
    mirrored: _Mirrored | None = None,
) -> MotionLibrary[Any]:
    library: MotionLibrary[Any] = MotionLibrary.open(file, engine=engine, device=device)
    if in_file is not None:
        library = library._part(in_file)
    if mirrored is not None and library._mirrored is None:
        library._mark(mirrored)
    if shard_indices is not None:
        library._shard_indices = shard_indices
    return library


def _rank(shard: object) -> tuple[int, int]:
    """The rank of a process, and the number of processes."""
    if not isinstance(shard, tuple | list) or len(shard) != 2:
        raise TypeError(f"shard: {shard!r}; give (rank, processes)")
    rank, processes = (_count("shard", number, "(rank, processes)") for number in shard)
    if not rank < processes:
        raise InputError(f"shard: {rank} of {processes}; give a rank from 0 and below the number of processes")
    return rank, processes


def _share(count: int, rank: int, processes: int) -> range:
    """The indices that are the share of a process."""
    return range(rank, count, processes)


def _is_number(value: object) -> bool:
    """Whether it is a real number: no truth value, and no duration of NumPy's."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool | np.bool_ | np.timedelta64)


def _count(label: str, value: object, meaning: str) -> int:
    """A whole number from 0 on."""
    if not _is_number(value) or not hasattr(value, "__index__"):
        raise TypeError(f"{label}: {value!r}; give {meaning}, as a whole number from 0 on")
    number = operator.index(value)
    if number < 0:
        raise InputError(f"{label}: {number}; give {meaning}, as a whole number from 0 on")
    return number


def _number(label: str, value: object, unit: str) -> float:
    """A finite number."""
    if not _is_number(value):
        raise TypeError(f"{label}: {value!r}; give {unit}, as a number")
    number = float(value)  # type: ignore[arg-type]
    if not np.isfinite(number):
        raise InputError(f"{label}: {number} is not finite")
    return number


def _numbers(label: str, values: object, unit: str) -> NDArray[np.float64]:
    """Numbers of any shape. What converts to numbers, but means something else, is refused: truth values, durations and
    dates, texts."""
    array = _on_host(values)
    if array.dtype.kind == "O" and all(_is_number(value) for value in array.flat):
        array = array.astype(np.float64)
    if array.dtype.kind not in "fiu":
        hint = ", such as durations / np.timedelta64(1, 's')" if array.dtype.kind == "m" else ""
        raise TypeError(f"{label}: their type is {array.dtype}{_first(array)}; give {unit}, as numbers{hint}")
    return array.astype(np.float64, copy=False)


def _first(array: NDArray[Any]) -> str:
    return f", such as {array.flat[0]!r}" if array.size else ""


def _indices(label: str, values: object) -> NDArray[np.int64]:
    """Whole numbers of any shape."""
    array = _on_host(values)
    if not array.size and array.dtype.kind == "f":
        array = array.astype(np.int64)
    if array.dtype.kind == "b":
        raise InputError(f"{label}: a mask of truth values; give whole numbers, such as np.flatnonzero(mask)")
    if array.dtype.kind not in "iu":
        raise InputError(f"{label}: their type is {array.dtype}{_first(array)}; give whole numbers")
    if array.dtype.kind == "u" and array.size and array.max() > np.iinfo(np.int64).max:
        raise InputError(f"{label}: there is no clip {array.max()}")
    return array.astype(np.int64, copy=False)


def _check_generator(rng: object) -> None:
    if not isinstance(rng, np.random.Generator):
        raise TypeError(f"rng: it is of the type {type(rng).__name__}; give a generator, such as np.random.default_rng(1)")


@contextmanager
def _bar(progress: Any, total: int) -> Iterator[Callable[[int, int], object] | None]:
    """What is called with the number of files that were read, and of all. A class is one of bars: an instance of it is
    made, and closed at the end."""
    if progress is None or not hasattr(progress, "update"):
        yield progress
        return
    bar = progress(total=total) if isinstance(progress, type) else progress
    if bar is progress and getattr(bar, "total", total) is None:
        bar.total = total
    last = 0

    def step(done: int, _: int) -> None:
        nonlocal last
        bar.update(done - last)
        last = done

    try:
        yield step
    finally:
        if bar is not progress:
            bar.close()


def _skeleton_of(
    skeleton: _Skeleton | None,
) -> Clip | tuple[Sequence[int | None], ArrayLike] | None:
    """A clip, or the parents and offsets of joints."""
    if skeleton is None or isinstance(skeleton, tuple):
        return skeleton
    return _clip_of(skeleton)


def _clip_of(skeleton: Clip | _Path) -> Clip:
    return skeleton if isinstance(skeleton, Clip) else load(skeleton)[0]


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
    """The arrays of a file that `_write` wrote, mapped where they are large. A file that NumPy has written is read:
    its arrays may be compressed, and start anywhere."""
    found: dict[str, Any] = {}
    with zipfile.ZipFile(path) as archive, open(path, "rb") as file:
        for info in archive.infolist():
            name = info.filename.removesuffix(".npy")
            if not name.endswith(("spans", "cells")) or info.compress_type != zipfile.ZIP_STORED:
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
