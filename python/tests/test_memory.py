"""Nothing is copied, nothing is kept."""

from __future__ import annotations

import gc
import hashlib
import resource
import subprocess
import sys
import textwrap

import numpy as np
import pytest
from conftest import unit

import tumble


def run(script, *arguments):
    """Runs a script in a process of its own; gives what it prints."""
    command = [sys.executable, "-c", textwrap.dedent(script), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_an_output_costs_no_memory_beside_it():
    grown = run(
        """
        import resource, numpy as np, tumble
        keys = np.zeros((64, 4, 4), np.float32)
        keys[..., 3] = 1
        clip = tumble.Clip([0.0, 1.0, 2.0, 3.0], keys)
        engine = tumble.Engine("cpu")
        out = np.zeros((64, 30001, 4), np.float32)
        out[...] = 1  # 31 MB, all of it there
        engine.evaluate(clip, fps=10, method="slerp")
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for method in ["slerp", "c2"]:
            assert engine.evaluate(clip, fps=10000, out=out, method=method) is out
            engine.evaluate(clip, fps=10000, out=out, method=method, order="wxyz")
        print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
        """
    )
    assert int(grown) < 6 * 1024, f"{grown} KiB beside an output of 31 MB"


def test_ten_thousand_poses_leave_nothing(rng):
    clip = tumble.Clip(np.linspace(0, 2, 8), unit(rng, 24, 8))
    engine = tumble.Engine()
    at = rng.uniform(0, 2, 10_000)

    def all_of_them(at):
        for time in at:
            engine.evaluate(clip, at=time)
            engine.matrices(clip, at=time)

    def size():
        gc.collect()
        with open("/proc/self/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * resource.getpagesize()

    if not sys.platform.startswith("linux"):
        pytest.skip("memory is read from /proc")
    all_of_them(at[:1000])
    before = size()
    all_of_them(at)
    assert size() - before < 1 << 20


def test_results_are_arrays_for_everyone(rng):
    found = tumble.evaluate([0.0, 1.0], list(unit(rng, 2, 2)), fps=10)
    assert type(found) is np.ndarray
    assert np.shares_memory(np.from_dlpack(found), found)
    assert memoryview(found).nbytes == found.nbytes == 2 * 11 * 16
    assert np.shares_memory(np.asarray(found), found)


def test_torch_takes_and_gives(rng):
    torch = pytest.importorskip("torch")
    keys = unit(rng, 2, 3)
    expected = tumble.evaluate([0.0, 1.0, 2.0], keys, fps=10)
    found = tumble.evaluate(torch.tensor([0.0, 1.0, 2.0]), torch.from_numpy(keys), fps=10)
    assert np.array_equal(found, expected)
    assert torch.from_dlpack(expected).data_ptr() == expected.ctypes.data


def test_jax_takes_and_gives(rng):
    jax = pytest.importorskip("jax")
    keys = unit(rng, 2, 3)
    expected = tumble.evaluate([0.0, 1.0, 2.0], keys, fps=10)
    found = tumble.evaluate(jax.numpy.asarray([0.0, 1.0, 2.0]), jax.numpy.asarray(keys), fps=10)
    assert np.array_equal(found, expected)
    assert np.array_equal(np.asarray(jax.numpy.asarray(expected)), expected)


def test_the_same_bits_every_time(rng):
    clip = tumble.Clip(np.linspace(0, 20, 26), unit(rng, 64, 26))

    def digest(**options):
        return hashlib.sha256(np.ascontiguousarray(clip.evaluate(fps=60, **options))).hexdigest()

    for method in ["slerp", "bessel-overhauser", "c2"]:
        assert len({digest(method=method) for _ in range(3)}) == 1
        frames = clip.evaluate(fps=60, method=method, layout="frame").swapaxes(0, 1)
        assert hashlib.sha256(np.ascontiguousarray(frames)).hexdigest() == digest(method=method)
