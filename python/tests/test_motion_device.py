"""Motion libraries whose clips lie on a Vulkan device: the CPU's bits, as arrays of the device."""

from __future__ import annotations

import multiprocessing
import os
import pickle

import numpy as np
import pytest
from conftest import unit

import tumble

PARENTS = [None, 0, 1, 1, 0]
OFFSETS = np.arange(15).reshape(5, 3) / 10
NAMES = ("rotations", "positions", "world_rotations", "velocities", "angular_velocities")


@pytest.fixture(scope="module", params=[name for name in tumble.devices() if name != "CPU"])
def device(request) -> tumble.Engine:
    return tumble.Engine(request.param)


@pytest.fixture
def clips(rng) -> list[tumble.Clip]:
    def clip(frames: int, rate: int) -> tumble.Clip:
        root = np.cumsum(0.05 * rng.normal(size=(frames, 3)), axis=0)
        keys = unit(rng, 5, frames)
        moved = [root, None, None, None, None]
        times = np.arange(frames) / rate
        return tumble.Clip(times, keys, layout="track", parents=PARENTS, offsets=OFFSETS, translations=moved)

    return [clip(40, 30), clip(7, 24), clip(2, 10)]


def bits(array) -> np.ndarray:
    """The bits of an array of a device, which NumPy has by DLPack."""
    shared = np.from_dlpack(array)
    assert np.array_equal(shared.view(np.uint32), array.numpy().view(np.uint32))
    assert np.asarray(array).tobytes() == array.numpy().tobytes() and np.asarray(array, np.float64).dtype == np.float64
    return shared.view(np.uint32)


@pytest.mark.parametrize("options", [{}, {"packed": True}, {"method": "bessel-overhauser"}], ids=str)
def test_arrays_of_a_device_have_the_bits_of_the_cpu(device, clips, rng, options):
    cpu, library = (tumble.MotionLibrary(clips, device=where, **options) for where in (None, device))
    assert (cpu.device, library.device) == ("CPU", device.device) and f"on {device.device}" in repr(library)
    ids, at = cpu.draw(100, rng)
    for shapes in [(ids, at), (ids[:3, None], at[None, :4]), (1, 0.5), (ids[:0], at[:0])]:
        for finite in (False, True):
            expected, found = (one.sample(*shapes, finite=finite) for one in (cpu, library))
            for name in NAMES:
                array = getattr(found, name)
                assert isinstance(array, tumble.DeviceArray) and array.dtype == np.float32
                assert array.shape == getattr(expected, name).shape
                assert (bits(array) == getattr(expected, name).view(np.uint32)).all(), name
    assert found == expected == found
    for kind in ("matrix", "6d"):
        arrays = ["world_rotations", "positions", "rotations"]
        expected, found = (one.sample(ids, at, arrays=arrays, rotations=kind) for one in (cpu, library))
        for name in arrays:
            array = getattr(found, name)
            assert array.shape == getattr(expected, name).shape
            assert (bits(array) == getattr(expected, name).view(np.uint32)).all(), (name, kind)
    one = library.sample_windows(ids, at, 3, fps=30, arrays=["positions"])
    same = cpu.sample_windows(ids, at, 3, fps=30, arrays=["positions"])
    assert one.velocities is None and (bits(one.positions) == same.positions.view(np.uint32)).all()
    # Times of a device are copied.
    moments = library.sample(ids, at, arrays=["positions"]).positions
    expected, found = (one.sample(0, times) for one, times in ((cpu, moments.numpy()), (library, moments)))
    assert expected == found and found.rotations.shape == (100, 5, 3, 5, 4)


def test_arrays_outlive_their_library_and_are_those_of_one_memory(device, clips):
    library = tumble.MotionLibrary(clips, device=device)
    state = library.sample([0, 1], [0.1, 0.2])
    expected = tumble.MotionLibrary(clips).sample([0, 1], [0.1, 0.2])
    shared = np.from_dlpack(state.positions)
    copy = np.from_dlpack(state.positions, copy=True)
    assert state.positions.__dlpack_device__() == (1, 0) and state.positions.waited_by == "host"
    assert not hasattr(state.positions, "__cuda_array_interface__") and "device='cpu'" in repr(state.positions)
    assert shared.ctypes.data == np.from_dlpack(state.positions).ctypes.data != copy.ctypes.data
    assert all(np.from_dlpack(getattr(state, name)).ctypes.data % 64 == 0 for name in NAMES)
    with pytest.raises(BufferError, match="dl_device"):
        state.positions.__dlpack__(dl_device=(2, 0))
    del library, state
    assert np.array_equal(shared, expected.positions) and np.array_equal(copy, shared)


def test_copies_and_shards_are_on_the_device_and_forked_processes_say_that_they_are_not(device, clips, tmp_path):
    library = tumble.MotionLibrary(clips, device=device)
    library.save(tmp_path / "motions.npz")
    opened = tumble.MotionLibrary.open(tmp_path / "motions.npz", device=device)
    expected = library.sample([2, 0], [0.1, 0.2])
    for other in (opened, pickle.loads(pickle.dumps(opened)), pickle.loads(pickle.dumps(library))):
        assert other.device == device.device and other.sample([2, 0], [0.1, 0.2]) == expected
    assert opened.shard(1, 2).sample(0, 0.1).positions.shape == (5, 3)
    if not hasattr(os, "fork"):
        return

    def child(pipe):
        try:
            library.sample([0], [0.1])
            pipe.send("sampled")
        except tumble.DeviceError as error:
            pipe.send(str(error))

    here, there = multiprocessing.Pipe()
    process = multiprocessing.get_context("fork").Process(target=child, args=(there,))
    process.start()
    assert here.poll(20) and "fork" in here.recv()
    process.join(20)


def test_what_a_device_cannot_do_is_refused(device, clips):
    library = tumble.MotionLibrary(clips, device=device)
    heading = {"heading": "twist", "up": "y"}
    for options in ({"order": "wxyz"}, {"rotations": "rotvec"}, {"out": library.sample(0, 0)}, heading):
        with pytest.raises(tumble.InputError, match="convert on the device"):
            library.sample(0, 0, **options)
    with pytest.raises(tumble.InputError, match="without `device`"):
        library.with_mirrored("x", pairs=range(5))
    for arguments, message in [(([3], [0.0]), "there is no clip 3"), (([0], [np.nan]), "not a number")]:
        with pytest.raises(tumble.InputError, match=message):
            library.sample(*arguments)
    with pytest.raises(tumble.InputError, match="no `speeds`"):
        library.sample(0, 0, arrays=["speeds"])
    with pytest.raises(tumble.InputError, match="the engine's device is CPU"):
        tumble.MotionLibrary(clips, device=tumble.Engine("cpu"))
    with pytest.raises(tumble.DeviceError, match="a motion library needs [0-9]+ bytes; the memory budget of the engine is 1000 bytes, of which half"):
        tumble.MotionLibrary(clips, device=tumble.Engine(device.device, memory=1000))
    assert isinstance(tumble.MotionLibrary(clips, device="cpu").sample(0, 0).positions, np.ndarray)
