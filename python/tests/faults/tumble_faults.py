"""Faults of machines, for the tests: Ray calls these as a worker starts."""

from __future__ import annotations

import os
import signal

from tumble import _tumble
from tumble.distributed import _worker


def prepare() -> None:
    """Installs the faults; every worker of the tests' connection begins with it."""
    kill_on_the_clip_that_says_so()
    another_wheel()


def kill_on_the_clip_that_says_so() -> None:
    """An input that ends whatever process evaluates it."""

    class Worker:
        def __init__(self, line, threads):
            self._worker = _tumble.Worker(line, threads)

        def __getattr__(self, name):
            return getattr(self._worker, name)

        def run(self, folder, shard, of, plan, inputs, *, record):
            if any("kills-its-worker" in path for path, _ in inputs):
                os.kill(os.getpid(), signal.SIGKILL)
            return self._worker.run(folder, shard, of, plan, inputs, record=record)

    class Module:
        def __getattr__(self, name):
            return Worker if name == "Worker" else getattr(_tumble, name)

    _worker._tumble = Module()


def another_wheel() -> None:
    """A machine whose kernels are others."""
    if "TUMBLE_FAULT_WHEEL" in os.environ:
        _worker.wheel = lambda: ("0" * 64, "0.0.0")
