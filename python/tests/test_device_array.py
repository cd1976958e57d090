"""Results that stay on a card, on a CUDA driver that is none (`stub_cuda.c`), which maps the memory that the system's
Vulkan devices export, with and without timeline semaphores (`stub_vulkan.c`). What needs a card is in
`card_dlpack.py`, which is run by hand."""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys

import pytest

HERE = pathlib.Path(__file__).parent

# The code with which each process begins.
COMMON = """
import ctypes, gc, os, re, sys
import numpy as np
import tumble
from conftest import unit

rng = np.random.default_rng(7)
times, keys = np.arange(40) / 20, unit(rng, 5, 40)
clip = tumble.Clip(times, keys)
expected = tumble.Engine("cpu").evaluate(clip, fps=300, method="bessel-overhauser")

def engines():
    for name in tumble.devices():
        if "CPU" != name:
            yield tumble.Engine(name)

def evaluate(engine, **options):
    return engine.evaluate(clip, fps=300, method="bessel-overhauser", device_array=True, **options)

def refused(work, *words, error=tumble.DeviceError):
    try:
        work()
    except error as found:
        missing = [word for word in words if word not in str(found)]
        assert not missing, f"{missing} not in: {found}"
    else:
        raise AssertionError(f"not refused: {words}")

def exporting(of_all=False):
    # The last of them is enough for most tests.
    found = []
    for engine in list(engines())[0 if of_all else -1:]:
        try:
            evaluate(engine)
        except tumble.DeviceError as error:
            if "cannot share the memory of results with other APIs" in str(error):
                continue
        found.append(engine)
    return found
"""


@pytest.fixture(scope="module")
def driver(tmp_path_factory):
    """Builds the driver, whole or without a function."""
    folder = tmp_path_factory.mktemp("cuda")

    def build(name: str, *options: str, semaphores: bool = False) -> dict[str, str]:
        (folder / name).mkdir()

        def library(source: str, *options: str) -> None:
            command = ["cc", "-shared", "-fPIC", "-Wall", "-Werror", *options, str(HERE / source), "-ldl"]
            subprocess.run(command, check=True, timeout=60)

        library("stub_cuda.c", *options, "-o", str(folder / name / "libcuda.so.1"))
        variables = {"LD_LIBRARY_PATH": str(folder / name), "STUB_CUDA_LOG": str(folder / name / "log")}
        if semaphores:
            # The loader under test loads another loader of the same name, which must not replace it.
            options = ("-Wl,-soname,libvulkan.so.1", "-Wl,-z,nodelete")
            library("stub_vulkan.c", *options, "-o", str(folder / name / "libvulkan.so.1"))
            known = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=True)
            line = next(line for line in known.stdout.splitlines() if "libvulkan.so.1 " in line)
            variables["REAL_LOADER"] = line.split("=> ")[1]
        return variables

    if sys.platform != "linux":
        pytest.skip("memory is exported as files on Linux alone")
    return build


def run(script: str, variables: dict[str, str]) -> None:
    variables = {**os.environ, **variables, "PYTHONPATH": str(HERE)}
    command = [sys.executable, "-c", COMMON + script]
    done = subprocess.run(command, env=variables, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr


def test_where_there_is_no_card_it_is_said_why():
    script = """
cpu = tumble.Engine("cpu")
refused(lambda: evaluate(cpu), "on the CPU", "open a Vulkan device", "leave out `device_array`")
refused(lambda: evaluate(cpu, order="wxyz"), "x y z w", "q[..., [3, 0, 1, 2]]", error=tumble.InputError)
refused(lambda: evaluate(cpu, as_rotation=True), "as_rotation", error=tumble.InputError)
refused(lambda: evaluate(cpu, out=expected), "`out`", error=tumble.InputError)
ragged = lambda: cpu.evaluate(clip, at=[[0], [0, 1], [0], [0], [0]], device_array=True)
refused(ragged, "lists of times", error=tumble.InputError)
assert exporting()
for engine in exporting():
    refused(lambda: evaluate(engine), "no CUDA driver", "libcuda.so.1", "without device_array=True")
    assert np.array_equal(engine.evaluate(clip, fps=300, method="bessel-overhauser"), expected)
"""
    run(script, {})


def test_a_driver_that_is_too_old_is_refused(driver):
    script = """
for engine in exporting():
    refused(lambda: evaluate(engine), "no function cuWaitExternalSemaphoresAsync", "CUDA 11.2")
"""
    run(script, driver("old", "-DWITHOUT_WAIT"))


def test_every_call_that_fails_is_named_and_leaves_nothing(driver):
    script = """
cuda = ctypes.CDLL("libcuda.so.1")
alive = lambda: ctypes.c_int.in_dll(cuda, "stub_alive").value
files = lambda: len(os.listdir("/proc/self/fd"))
all = exporting()
first = all[0]
for engine in all:
    refused(lambda: evaluate(engine), "CUDA has no device that is", "it sees none", "CUDA_VISIBLE_DEVICES")
    other = "00000000-1111-2222-3333-444444444444"
    os.environ["STUB_CUDA_UUIDS"] = other
    refused(lambda: evaluate(engine), "CUDA has no device that is", f"it sees {other}")
    try:
        evaluate(engine)
    except tumble.DeviceError as error:
        uuid = re.search("UUID ([0-9a-f-]+)", str(error))[1]
    os.environ["STUB_CUDA_UUIDS"] = f"{other},{uuid}"
    if engine is first:
        os.environ["STUB_CUDA_FAIL"] = "cuDevicePrimaryCtxRetain"
        refused(lambda: evaluate(engine), "cuDevicePrimaryCtxRetain failed: CUDA_ERROR_UNKNOWN (999)")
        del os.environ["STUB_CUDA_FAIL"]
    opened = files()
    log = os.environ["STUB_CUDA_LOG"]
    open(log, "w").close()
    made = evaluate(engine)
    assert "cuImportExternalSemaphore" in open(log).read()
    made = None
    assert alive() == 0
    calls = ["cuInit", "cuDeviceGetCount", "cuDeviceGet", "cuDeviceGetUuid", "cuCtxPushCurrent",
             "cuImportExternalMemory", "cuExternalMemoryGetMappedBuffer"]
    for call in calls:
        os.environ["STUB_CUDA_FAIL"] = call + {"cuCtxPushCurrent": "_v2"}.get(call, "")
        refused(lambda: evaluate(engine), f"{call} failed: CUDA_ERROR_UNKNOWN (999)")
        assert alive() == 0, call
        del os.environ["STUB_CUDA_FAIL"]
        assert np.array_equal(evaluate(engine).numpy(), expected)
        assert (alive(), files()) == (0, opened), call
    # Without the semaphore the host waits.
    os.environ["STUB_CUDA_FAIL"] = "cuImportExternalSemaphore"
    array = evaluate(engine)
    del os.environ["STUB_CUDA_FAIL"]
    assert array.waited_by == "host" and np.array_equal(array.numpy(), expected)
    del array
    assert (alive(), files()) == (0, opened)
    array = evaluate(engine)
    for call, work in [("cuMemcpyDtoH", array.numpy),
                       ("cuWaitExternalSemaphoresAsync", array.__dlpack__),
                       ("cuWaitExternalSemaphoresAsync", lambda: array.__cuda_array_interface__)]:
        os.environ["STUB_CUDA_FAIL"] = call + {"cuMemcpyDtoH": "_v2"}.get(call, "")
        refused(work, f"{call} failed")
        del os.environ["STUB_CUDA_FAIL"]
    assert np.array_equal(array.numpy(), expected)
    del array
    assert (alive(), files()) == (0, opened)

    # After a device is lost, its memory is not read, and no stream waits for a semaphore that will not be signalled.
    array = evaluate(engine)
    array.numpy()
    os.environ["STUB_VULKAN_LOST"] = "1"
    refused(array.numpy, "vkWaitSemaphores failed: ERROR_DEVICE_LOST")
    refused(array.__dlpack__, "vkGetSemaphoreCounterValue failed: ERROR_DEVICE_LOST")
    refused(lambda: array.__cuda_array_interface__, "ERROR_DEVICE_LOST")
    before = alive()
    del array
    assert alive() == before
    del os.environ["STUB_VULKAN_LOST"]
    assert np.array_equal(evaluate(engine).numpy(), expected)
    assert alive() == before
    del os.environ["STUB_CUDA_UUIDS"]
"""
    run(script, driver("failing", semaphores=True))


@pytest.mark.parametrize("semaphores", [False, True])
def test_motion_libraries_leave_their_arrays_on_the_card_that_cuda_has(driver, semaphores):
    script = """
cuda = ctypes.CDLL("libcuda.so.1")
alive = lambda: ctypes.c_int.in_dll(cuda, "stub_alive").value
body = tumble.Clip(times, keys, layout="track", parents=[None, 0, 1, 1, 0], offsets=rng.normal(size=(5, 3)))
NAMES = ["rotations", "positions", "world_rotations", "velocities", "angular_velocities"]
ids, at = np.zeros(70, int), rng.uniform(0, 2, 70)
for engine in exporting():
    # CUDA does not have the device: memory of the host.
    state = tumble.MotionLibrary([body], device=engine).sample(0, 0.5)
    assert state.positions.__dlpack_device__() == (1, 0) and alive() == 0
    try:
        evaluate(engine)
    except tumble.DeviceError as error:
        os.environ["STUB_CUDA_UUIDS"] = re.search("UUID ([0-9a-f-]+)", str(error))[1]
    cpu, library = (tumble.MotionLibrary([body], device=device) for device in (None, engine))
    assert alive() == 0
    for finite in (False, True):
        expected, state = (one.sample(ids, at, finite=finite) for one in (cpu, library))
        # All arrays are in one memory, each at an aligned address.
        assert alive() == 2 + expects_semaphores and state.velocities.waited_by == ("stream" if expects_semaphores else "host")
        for name in NAMES:
            found, same = getattr(state, name), getattr(expected, name)
            assert found.__dlpack_device__() == (2, 0) and found.numpy().tobytes() == same.tobytes(), name
            address = found.__cuda_array_interface__["data"][0]
            assert address % 256 == 0 and ctypes.string_at(address, same.nbytes) == same.tobytes()
        del found
        positions = state.positions
        del state
        assert alive() == 2 + expects_semaphores and positions.numpy().tobytes() == expected.positions.tobytes()
        del positions
    assert alive() == 0
    del os.environ["STUB_CUDA_UUIDS"]
"""
    run(f"expects_semaphores = {semaphores}\n" + script, driver(f"library{semaphores}", semaphores=semaphores))


# The structures of DLPack's header, and the calls of a consumer.
CONSUMER = """
class Tensor(ctypes.Structure):
    _fields_ = [("data", ctypes.c_void_p), ("kind", ctypes.c_int32), ("ordinal", ctypes.c_int32),
                ("axes", ctypes.c_int32), ("code", ctypes.c_uint8), ("bits", ctypes.c_uint8),
                ("lanes", ctypes.c_uint16), ("shape", ctypes.POINTER(ctypes.c_int64)),
                ("strides", ctypes.POINTER(ctypes.c_int64)), ("offset", ctypes.c_uint64)]

class Managed(ctypes.Structure):
    pass

Delete = ctypes.CFUNCTYPE(None, ctypes.c_void_p)
Managed._fields_ = [("tensor", Tensor), ("context", ctypes.c_void_p), ("delete", Delete)]

class Versioned(ctypes.Structure):
    _fields_ = [("major", ctypes.c_uint32), ("minor", ctypes.c_uint32), ("context", ctypes.c_void_p),
                ("delete", Delete), ("flags", ctypes.c_uint64), ("tensor", Tensor)]

python = ctypes.pythonapi
python.PyCapsule_GetPointer.restype = ctypes.c_void_p
python.PyCapsule_GetPointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
python.PyCapsule_GetName.restype = ctypes.c_char_p
python.PyCapsule_GetName.argtypes = [ctypes.py_object]
python.PyCapsule_SetName.argtypes = [ctypes.py_object, ctypes.c_char_p]
USED = {b"dltensor": b"used_dltensor", b"dltensor_versioned": b"used_dltensor_versioned"}

def consumed(capsule):
    name = python.PyCapsule_GetName(capsule)
    kind = Versioned if name == b"dltensor_versioned" else Managed
    pointer = python.PyCapsule_GetPointer(capsule, name)
    managed = kind.from_address(pointer)
    python.PyCapsule_SetName(capsule, USED[name])
    return managed, lambda: managed.delete(pointer)

def contents(tensor):
    shape = tensor.shape[:tensor.axes]
    strides = tensor.strides[:tensor.axes]
    assert strides == [int(np.prod(shape[axis + 1:])) for axis in range(tensor.axes)]
    kind = {(2, 32): np.float32, (2, 16): np.float16, (0, 16): np.int16}[tensor.code, tensor.bits]
    assert tensor.lanes == 1 and tensor.offset == 0
    size = int(np.prod(shape)) * np.dtype(kind).itemsize
    return np.frombuffer(ctypes.string_at(tensor.data, size), kind).reshape(shape)
"""


@pytest.mark.parametrize("semaphores", [False, True])
def test_arrays_are_handed_on_and_live_as_long_as_somebody_has_them(driver, semaphores):
    script = """
cuda = ctypes.CDLL("libcuda.so.1")
alive = lambda: ctypes.c_int.in_dll(cuda, "stub_alive").value
log = os.environ["STUB_CUDA_LOG"]

def calls():
    with open(log) as file:
        found = file.read().split("\\n")[:-1]
    open(log, "w").close()
    return found

names = [engine.device for engine in exporting(of_all=not expects_semaphores)]
for name in names:
    engine = tumble.Engine(name)
    os.environ["STUB_CUDA_UUIDS"] = ""
    try:
        evaluate(engine)
    except tumble.DeviceError as error:
        uuid = re.search("UUID ([0-9a-f-]+)", str(error))[1]
    os.environ["STUB_CUDA_UUIDS"] = f"00000000-1111-2222-3333-444444444444,{uuid}"
    calls()
    array = evaluate(engine)
    made = calls()
    semaphores = sum("cuImportExternalSemaphore" in call for call in made)
    assert alive() == 2 + semaphores, made
    assert semaphores == expects_semaphores and array.waited_by == ("stream" if semaphores else "host")
    assert (array.shape, array.dtype, len(array)) == (expected.shape, np.float32, 5)
    assert repr(array) == f"DeviceArray(shape={expected.shape}, dtype=float32, device='cuda:1')"
    assert array.__dlpack_device__() == (2, 1)
    assert array.numpy().tobytes() == expected.tobytes()
    assert array.numpy().dtype == np.float32

    # The stream that imports the array waits for the engine, by the device's semaphore if the device exports one.
    def waits(**options):
        calls()
        array.__dlpack__(**options)
        return [call.split()[1] for call in calls() if call.startswith("cuWaitExternalSemaphoresAsync")]

    assert waits() == waits(stream=None) == waits(stream=1) == ["1"] * semaphores
    assert waits(stream=2) == ["2"] * semaphores
    assert waits(stream=0x7f00) == [str(0x7f00)] * semaphores
    assert waits(stream=-1) == []
    refused(lambda: waits(stream=0), "stream: 0 is ambiguous", error=BufferError)
    refused(lambda: waits(stream=-2), "there is no stream -2", error=BufferError)

    # The form of the capsule, and the device, that are requested.
    form = lambda **options: python.PyCapsule_GetName(array.__dlpack__(**options))
    assert form() == form(max_version=None) == form(max_version=(0, 8)) == b"dltensor"
    assert form(max_version=(1, 0)) == form(max_version=(1, 3)) == b"dltensor_versioned"
    assert form(dl_device=(2, 1), copy=False, stream=1) == b"dltensor"
    refused(lambda: form(dl_device=(2, 0)), "on (2, 1)", error=BufferError)
    refused(lambda: form(dl_device=(1, 0), copy=False), "on (2, 1)", error=BufferError)
    refused(lambda: form(copy=True), "without a copy", error=BufferError)
    host, delete = consumed(array.__dlpack__(dl_device=(1, 0)))
    assert host.tensor.kind == 1 and contents(host.tensor).tobytes() == expected.tobytes()
    delete()

    interface = array.__cuda_array_interface__
    address = interface["data"][0]
    assert interface == {"shape": expected.shape, "typestr": "<f4", "data": (address, False), "version": 3,
                         "strides": None, "stream": 1}
    assert ctypes.string_at(address, expected.nbytes) == expected.tobytes()

    # Capsules that are never consumed, and capsules that are consumed, before and after the array is freed.
    for options in [{}, {"max_version": (1, 0)}]:
        array.__dlpack__(**options)
        one, delete_one = consumed(array.__dlpack__(**options))
        assert (one.tensor.kind, one.tensor.ordinal, one.tensor.data) == (2, 1, address)
        if options:
            assert (one.major, one.minor, one.flags) == (1, 0, 0)
        assert contents(one.tensor).tobytes() == expected.tobytes()
        delete_one()
    unused = array.__dlpack__()
    one, delete_one = consumed(array.__dlpack__())
    two, delete_two = consumed(array.__dlpack__(max_version=(1, 1)))
    before = alive()
    del array
    delete_two()
    assert alive() == before
    assert contents(one.tensor).tobytes() == expected.tobytes()
    calls()
    delete_one()
    assert alive() == before  # the capsule that was not consumed has it
    del unused
    assert alive() == 0
    given_back = [call.split()[0] for call in calls()]
    order = ["cuCtxPushCurrent_v2", "cuCtxSynchronize", "cuMemFree_v2"]
    order += ["cuDestroyExternalSemaphore"] * semaphores
    order += ["cuDestroyExternalMemory", "cuCtxPopCurrent_v2"]
    assert given_back == order, given_back

    # Its address was not requested, so no other work is waited for.
    evaluate(engine)
    assert not any("cuCtxSynchronize" in call for call in calls())

    # Other forms, and the shapes that NumPy's arrays have.
    for options in [dict(fps=300, layout="frame"), dict(fps=300, dtype="float16"), dict(fps=300, dtype="int16"),
                    dict(at=0.7), dict(at=[0.1, 1.9, 0.2], before="loop"), dict(at=rng.uniform(0, 2, (5, 7)))]:
        host = engine.evaluate(clip, method="c2", **options)
        found = engine.evaluate(clip, method="c2", device_array=True, **options)
        assert (found.shape, found.dtype) == (host.shape, host.dtype)
        assert found.numpy().tobytes() == host.tobytes(), options
        _, delete = consumed(found.__dlpack__())
        delete()
    del found

    # In several windows, the last of which go on after the call.
    if semaphores:
        options = dict(fps=300_000, method="slerp")
        host = tumble.Engine("cpu").evaluate(clip, **options)
        first, second = (engine.evaluate(clip, device_array=True, **options) for _ in range(2))
        assert second.numpy().tobytes() == first.numpy().tobytes() == host.tobytes()
        del first, second

    # Many arrays, whose memory is reused; and the engine is freed first.
    for round in range(50):
        held = [consumed(evaluate(engine).__dlpack__(stream=0x10 + round)) for _ in range(2)]
        for managed, delete in held:
            delete()
    assert alive() == 0
    last, delete = consumed(evaluate(engine).__dlpack__())
    array = evaluate(engine)
    del engine
    gc.collect()
    assert array.numpy().tobytes() == expected.tobytes()  # which waits for all before it
    assert contents(last.tensor).tobytes() == expected.tobytes()
    delete()
    del array
    assert alive() == 0

# A forked process has no driver, and must not call it.
array = evaluate(tumble.Engine(names[-1]))
child = os.fork()
if not child:
    try:
        refused(array.numpy, "forked")
        refused(array.__dlpack__, "forked")
        del array
        os._exit(0)
    finally:
        os._exit(1)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
del array
assert alive() == 0
"""
    variables = driver(f"whole{semaphores}", semaphores=semaphores)
    pathlib.Path(variables["STUB_CUDA_LOG"]).touch()
    run(f"{CONSUMER}\nexpects_semaphores = {semaphores}\n{script}", variables)
