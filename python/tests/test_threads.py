"""Threads and panics; Ctrl-C is with the processes."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest
from conftest import unit

import tumble


@pytest.fixture
def long(rng):
    """A call that takes some tenths of a second, and does all of it in one piece."""
    clip = tumble.Clip(np.arange(120.0), unit(rng, 8, 120))
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

    def work(index):
        found[index] = engine.evaluate(clip, fps=60)

    threads = [threading.Thread(target=work, args=(index,)) for index in range(len(found))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(one, expected) for one in found)


def test_one_output_is_not_written_by_two(long, rng):
    clip = tumble.Clip(np.arange(120.0), unit(rng, 8, 120))
    engine = tumble.Engine("cpu", threads=1)
    out = np.zeros((8, 239, 4), np.float32)

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


def test_a_panic_is_an_exception_that_asks_for_a_report():
    with pytest.raises(RuntimeError, match=r"asked for; this is a bug in tumble .* please report"):
        tumble._tumble.panic()
