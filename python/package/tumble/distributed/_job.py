"""The messages between the driver and its workers."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import Any

import tumble
from tumble import _tumble

# The JSON object of a shard's outcome, or of an input that failed.
Entry = dict[str, Any]

USAGE, SOME_INPUTS, ALL_INPUTS, DEVICE, OUTPUT, DIFFERENCE = 2, 3, 4, 6, 7, 8


class DistributedError(tumble.Error, RuntimeError):
    """A library could not be evaluated: `exit_code` is that of the program.

    >>> from tumble.distributed import DistributedError
    >>> DistributedError("no machine has this wheel", 2).exit_code
    2
    """

    exit_code: int

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.exit_code = exit_code

    def __reduce__(self) -> tuple[type[DistributedError], tuple[str, int]]:
        return type(self), (str(self), self.exit_code)


@dataclass(frozen=True)
class Job:
    """The part of a task that is the same for all shards of a library."""

    line: tuple[str, ...]
    """Options of `tumble eval`, without inputs, output and device."""
    plan: str
    shards: int
    library: str
    """As it was given."""
    out: str
    """An absolute path, or a URL."""
    folder: str
    """Where relative names of inputs begin."""
    into: str
    resume: bool
    device: str
    has_gpu: bool
    """A worker has a graphics card of its own."""
    wheel: tuple[str, str]
    """The kernels' hash and the version: equal bytes where they are equal."""


@dataclass(frozen=True)
class Input:
    """Where an input is, and where it lies below the library."""

    path: str
    below: str


@dataclass(frozen=True)
class Task:
    """A shard, or some of its inputs, tried out."""

    shard: int
    inputs: tuple[Input, ...]
    is_trial: bool = False
    """Nothing is kept: does it end its worker?"""
    device: str | None = None
    """In the place of the job's."""
    refused: tuple[tuple[str, str], ...] = ()
    """Inputs that are left out, and why."""


def bytes_of(size: int | str) -> int:
    """Bytes, of a number of them or of text such as 2GiB."""
    units = {"": 1, "KIB": 1 << 10, "MIB": 1 << 20, "GIB": 1 << 30, "TIB": 1 << 40}
    found = re.fullmatch(r"\s*(\d+)\s*([kmgt]ib)?\s*", str(size), re.IGNORECASE)
    if found is None or int(found[1]) == 0:
        message = f"invalid size `{size}`: expected bytes, or a number with a unit, such as 256MiB"
        raise DistributedError(message, USAGE)
    return int(found[1]) * units[(found[2] or "").upper()]


def wheel() -> tuple[str, str]:
    """The hash of the kernels and the version with which this process computes."""
    return _tumble.kernels_sha256(), tumble.__version__


def refusal(path: str, message: str) -> Entry:
    """An input without a result, as the program reports it."""
    return {"input": path, "code": ALL_INPUTS, "message": message}


def is_url(name: str) -> bool:
    return "://" in name and not name.startswith("file://")


def local(name: str | os.PathLike[str]) -> str:
    """A path as it is given; that of a `file://` URL."""
    text = os.fspath(name)
    return text.removeprefix("file://")
