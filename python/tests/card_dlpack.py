"""Results that stay on an NVIDIA card, in torch, CuPy and JAX: run by hand where there is one.

    python python/tests/card_dlpack.py [DEVICE]

DEVICE is a name of `tumble.devices()` [vulkan]. The bits are those of the CPU in every library, on the default stream
and on others, 200 times over, with the memory of the card before and after; then it is timed beside the way over the
host. A table comes last; the exit code is 0 only if all bits are equal. Every step has a limit, after which the
process ends with a trace.
"""

from __future__ import annotations

import faulthandler
import gc
import os
import statistics
import sys
import time
import traceback

import numpy as np

import tumble

os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")

LIMIT = 25  # seconds of a step
ROUNDS = 200
rows: list[tuple[str, str]] = []
failures = 0


def step(name):
    """Runs a check at once, and notes what it says or how it fails."""

    def run(check):
        global failures
        faulthandler.dump_traceback_later(LIMIT, exit=True)
        start = time.perf_counter()
        try:
            said = check()
        except ImportError as error:
            said = f"not installed ({error})"
        except Exception as error:
            failures += 1
            said = f"FAILED: {type(error).__name__}: {error}"
            traceback.print_exc()
        faulthandler.cancel_dump_traceback_later()
        took = time.perf_counter() - start
        rows.append((name, f"{said} [{took:.1f} s]"))
        print(f"{name}: {rows[-1][1]}", flush=True)

    return run


def clip(tracks: int, keys: int) -> tumble.Clip:
    rng = np.random.default_rng(tracks + keys)
    rotations = rng.normal(size=(tracks, keys, 4))
    rotations /= np.linalg.norm(rotations, axis=-1, keepdims=True)
    return tumble.Clip(np.arange(keys) / 30, rotations.astype(np.float32))


cpu = tumble.Engine("cpu")
print("devices:", tumble.devices(), flush=True)
engine = tumble.Engine(sys.argv[1] if len(sys.argv) > 1 else "vulkan")
print("evaluates on:", engine.device, flush=True)

small, large = clip(24, 300), clip(512, 60)
# The calls to compare: the method of the engine, the clip and the arguments.
REQUESTS = [
    ("evaluate", small, dict(fps=120, method="slerp")),
    ("evaluate", small, dict(fps=120, method="bessel-overhauser", layout="frame")),
    ("evaluate", small, dict(fps=120, method="c2", dtype="float16")),
    ("evaluate", small, dict(fps=120, method="squad", dtype="int16")),
    ("evaluate", small, dict(at=[0.1, 3.7, 0.2, 9.1], method="slerp", before="loop")),
    ("evaluate", small, dict(at=2.5, method="bessel-overhauser")),
    ("velocity", small, dict(fps=120, method="bessel-overhauser")),
    ("matrices", small, dict(fps=120, method="slerp", columns=4)),
    ("evaluate", large, dict(fps=4000, method="bessel-overhauser")),  # 64 MB, two windows
]


def on_card(request):
    kind, clip, options = request
    return getattr(engine, kind)(clip, device_array=True, **options)


expected = [getattr(cpu, kind)(clip, **options) for kind, clip, options in REQUESTS]


def compared(host_of):
    """Compares what a library has of each request."""
    total = 0
    for request, numbers in zip(REQUESTS, expected):
        found = host_of(on_card(request))
        assert found.shape == numbers.shape, (request, found.shape, numbers.shape)
        assert found.dtype == numbers.dtype, (request, found.dtype)
        assert found.tobytes() == numbers.tobytes(), (request, "other bits")
        total += numbers.nbytes
    return f"{len(REQUESTS)} results, {total / 1e6:.0f} MB, all bits equal"


@step("numpy()")
def _():
    waited_by = on_card(REQUESTS[0]).waited_by
    return f"waited by the {waited_by}; " + compared(lambda array: array.numpy())


@step("numpy.from_dlpack(device='cpu')")
def _():
    return compared(lambda array: np.from_dlpack(array, device="cpu"))


@step("torch.from_dlpack")
def _():
    import torch

    def host_of(array):
        tensor = torch.from_dlpack(array)
        assert tensor.is_cuda and tuple(tensor.shape) == array.shape
        del array
        gc.collect()
        return tensor.cpu().numpy()

    return compared(host_of)


@step("torch, another stream")
def _():
    import torch

    stream = torch.cuda.Stream()

    def host_of(array):
        with torch.cuda.stream(stream):
            tensor = torch.from_dlpack(array).clone()
        stream.synchronize()
        return tensor.cpu().numpy()

    return compared(host_of)


@step("torch, __cuda_array_interface__")
def _():
    import torch

    return compared(lambda array: torch.as_tensor(array, device="cuda").cpu().numpy())


@step("cupy.from_dlpack")
def _():
    import cupy

    return compared(lambda array: cupy.asnumpy(cupy.from_dlpack(array)))


@step("cupy, another stream")
def _():
    import cupy

    def host_of(array):
        stream = cupy.cuda.Stream(non_blocking=True)
        with stream:
            return cupy.asnumpy(cupy.from_dlpack(array).copy(), stream=stream)

    return compared(host_of)


@step("cupy.asarray")
def _():
    import cupy

    return compared(lambda array: cupy.asnumpy(cupy.asarray(array)))


@step("jax.dlpack.from_dlpack")
def _():
    import jax

    return compared(lambda array: np.asarray(jax.dlpack.from_dlpack(array)))


@step("written before it is read")
def _():
    """Sums on the card at once, while the engine may still be writing, with nothing of the host in between."""
    import torch

    truth = torch.from_numpy(expected[-1].view(np.int32)).cuda()
    streams = [torch.cuda.default_stream(), torch.cuda.Stream(), torch.cuda.Stream()]
    for stream in streams:
        stream.wait_stream(torch.cuda.default_stream())
    kept = []
    for round in range(12):
        with torch.cuda.stream(streams[round % 3]):
            tensor = torch.from_dlpack(on_card(REQUESTS[-1]))
            kept.append((tensor, (tensor.view(torch.int32) != truth).sum()))
    torch.cuda.synchronize()
    differing = sum(count.item() for _, count in kept)
    assert differing == 0, f"{differing} numbers differ"
    return "12 results of 64 MB on three streams, all bits equal"


@step(f"{ROUNDS} times")
def _():
    import torch

    truth = torch.from_numpy(expected[0].view(np.int32)).cuda()
    streams = [torch.cuda.default_stream(), torch.cuda.Stream()]
    streams[1].wait_stream(streams[0])

    def rounds(count):
        differing = 0
        for round in range(count):
            stream = streams[round % 2]
            with torch.cuda.stream(stream):
                array = on_card(REQUESTS[0])
                tensor = torch.from_dlpack(array)
                if round % 3:
                    del array
                differing += (tensor.view(torch.int32) != truth).sum().item()
            array = tensor = None
            if round % 10 == 0:
                gc.collect()
        torch.cuda.synchronize()
        return differing

    assert rounds(20) == 0
    gc.collect()
    torch.cuda.empty_cache()
    before, _ = torch.cuda.mem_get_info()
    files = len(os.listdir("/proc/self/fd"))
    assert rounds(ROUNDS) == 0, "other bits"
    gc.collect()
    torch.cuda.empty_cache()
    after, _ = torch.cuda.mem_get_info()
    lost = (before - after) / 1e6
    opened = len(os.listdir("/proc/self/fd")) - files
    assert lost < 8 and opened <= 0, f"{lost:.1f} MB and {opened} files are not given back"
    return f"all bits equal, {lost:.1f} MB and {opened} files kept"


@step("who goes first")
def _():
    import torch

    other = tumble.Engine(engine.device)
    array = other.evaluate(large, fps=4000, method="bessel-overhauser", device_array=True)
    del other
    gc.collect()
    tensor = torch.from_dlpack(array)
    del array
    gc.collect()
    assert tensor.cpu().numpy().tobytes() == expected[-1].tobytes()
    unread = on_card(REQUESTS[-1])
    del unread, tensor
    capsule = on_card(REQUESTS[-1]).__dlpack__()
    del capsule
    return "engine, array, tensor; arrays and capsules that nobody reads"


def milliseconds(work, rounds=7):
    import torch

    work()
    found = []
    for _ in range(rounds):
        torch.cuda.synchronize()
        start = time.perf_counter()
        kept = work()
        torch.cuda.synchronize()
        found.append(1e3 * (time.perf_counter() - start))
        del kept
    return statistics.median(found)


for title, request in [("small", REQUESTS[0]), ("large", REQUESTS[-1])]:

    @step(f"time, {title}")
    def _(request=request):
        import torch

        kind, clip, options = request
        evaluated = getattr(engine, kind)
        host = evaluated(clip, **options)
        on_host = milliseconds(lambda: evaluated(clip, **options))
        over_host = milliseconds(lambda: torch.from_numpy(evaluated(clip, **options)).cuda())
        straight = milliseconds(lambda: torch.from_dlpack(on_card(request)))
        copy_alone = milliseconds(lambda: torch.from_numpy(host).cuda())
        dropping = []
        for _ in range(7):
            tensor = torch.from_dlpack(on_card(request))
            torch.cuda.synchronize()
            start = time.perf_counter()
            del tensor
            dropping.append(1e3 * (time.perf_counter() - start))
        array = on_card(request)
        imported = milliseconds(lambda: torch.from_dlpack(array))
        return (
            f"{host.nbytes / 1e6:.1f} MB: evaluate + from_dlpack {straight:.2f} ms, evaluate to host + cuda() "
            f"{over_host:.2f} ms (evaluate alone {on_host:.2f}, copy alone {copy_alone:.2f}); from_dlpack alone "
            f"{imported:.3f} ms, giving the memory back {statistics.median(dropping):.3f} ms"
        )


print("\n" + "-" * 100)
width = max(len(name) for name, _ in rows)
for name, said in rows:
    print(f"{name:{width}}  {said}")
has_torch = any(name == "torch.from_dlpack" and "equal" in said for name, said in rows)
print("ALL BITS ARE EQUAL" if not failures and has_torch else f"{failures} FAILED")
sys.exit(0 if not failures and has_torch else 1)
