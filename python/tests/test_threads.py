"""Threads, Ctrl-C, and panics."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest
from conftest import unit

import tumble


@pytest.fixture
def long(rng):
    """A call that takes about a second, and does all of it in one piece."""
    clip = tumble.Clip(np.arange(400.0), unit(rng, 8, 400))
    engine = tumble.Engine("cpu", threads=1)

    def work():
        engine.evaluate(clip, fps=2, method="c2", speed="constant")

    return work


def test_other_threads_run_while_one_evaluates(long):
    """Counts in this thread; with the lock held, nothing would be counted."""
    worker = threading.Thread(target=long)
    started = time.perf_counter()
    worker.start()
    gaps, last, counted = [], time.perf_counter(), 0
    while worker.is_alive():
        counted += 1
        time.sleep(0)
        gaps.append(time.perf_counter() - last)
        last = time.perf_counter()
    took = time.perf_counter() - started
    assert took > 0.1, "too short to see anything"
    assert counted > 1000
    assert max(gaps) < 0.5 * took, f"the lock was held for {max(gaps):.3f} of {took:.3f} s"


def test_two_threads_evaluate_at_once(rng):
    clip = tumble.Clip(np.linspace(0, 20, 26), unit(rng, 200, 26))
    engine = tumble.Engine()
    expected = clip.evaluate(fps=60)
    found = [None] * 8

    def work(place):
        found[place] = engine.evaluate(clip, fps=60)

    threads = [threading.Thread(target=work, args=(place,)) for place in range(len(found))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(one, expected) for one in found)


def test_one_output_is_not_written_by_two(long, rng):
    clip = tumble.Clip(np.arange(400.0), unit(rng, 8, 400))
    engine = tumble.Engine("cpu", threads=1)
    out = np.zeros((8, 799, 4), np.float32)

    def work():
        engine.evaluate(clip, fps=2, method="c2", speed="constant", out=out)

    worker = threading.Thread(target=work)
    worker.start()
    refused = 0
    while worker.is_alive():
        try:
            engine.evaluate(clip, fps=2, out=out)
        except tumble.InputError as error:
            assert "another call" in str(error)
            refused += 1
        time.sleep(0.01)
    assert refused > 0


EVALUATE = """
    times = np.arange(2000.0)
    keys = np.random.default_rng(1).normal(size=(200, 2000, 4))
    keys /= np.linalg.norm(keys, axis=-1, keepdims=True)
    clip = tumble.Clip(times, keys)
    # Minutes of work.
    def long():
        clip.evaluate(fps=1000, method="c2", speed="constant", end=10.0)
"""

POSES = """
    keys = np.zeros((60, 2, 4))
    keys[..., 3] = 1.0
    clip = tumble.Clip([0.0, 600.0], keys)
    # Some seconds of work in one piece, again and again.
    def long():
        while True:
            tumble.Engine("cpu").poses(clip, fps=1000)
"""


@pytest.mark.skipif(os.name != "posix", reason="signals are sent as on Unix")
@pytest.mark.parametrize("work", [EVALUATE, POSES])
def test_ctrl_c_ends_long_work(work):
    script = f"""
import signal, sys, numpy as np, tumble
# Shells start what runs in the background with the signal ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
{textwrap.dedent(work)}
print("ready", flush=True)
try:
    long()
except KeyboardInterrupt:
    print("interrupted", flush=True)
    print(clip.evaluate(at=0.0).shape[-1], flush=True)
"""
    command = [sys.executable, "-c", script]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        # A child that does not hear the signal ends, and the test fails instead of waiting.
        late = threading.Timer(90, child.kill)
        late.start()
        assert child.stdout.readline() == "ready\n"
        time.sleep(0.5)
        sent = time.perf_counter()
        child.send_signal(signal.SIGINT)
        assert child.stdout.readline() == "interrupted\n"
        waited = time.perf_counter() - sent
        assert child.stdout.readline() == "4\n", "the clip can be used again"
        assert child.wait(timeout=60) == 0
        late.cancel()
    assert waited < 20, f"{waited:.1f} s after Ctrl-C"


def test_a_panic_is_an_exception_that_asks_for_a_report():
    with pytest.raises(RuntimeError, match=r"asked for; this is a bug in tumble .* please report"):
        tumble._tumble.panic()
