"""The fixtures and functions that the tests share."""

from __future__ import annotations

import pathlib
import signal
import sys

import numpy as np
import pytest

# Background processes of a shell ignore Ctrl-C, and so do their child processes. The tests send it, so it is enabled.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = pathlib.Path(__file__).parents[2]
SHARED = ROOT.parent / "shared" / "data"


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240917)


@pytest.fixture
def shared() -> pathlib.Path:
    """Sample files beside the project, for reading."""
    if not SHARED.is_dir():
        print(f"{SHARED} is not there: tests of its files compare nothing", file=sys.stderr)
        pytest.skip("no sample files")
    return SHARED


def unit(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Random unit quaternions, float32, x y z w."""
    keys = rng.normal(size=(*shape, 4))
    keys /= np.linalg.norm(keys, axis=-1, keepdims=True)
    return keys.astype(np.float32)
