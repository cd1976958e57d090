"""Other processes: forked, spawned, interrupted; and objects that are passed to them."""

from __future__ import annotations

import copy
import multiprocessing
import os
import pickle
import subprocess
import sys
import threading
import weakref

import numpy as np
import pytest
from conftest import unit

import tumble

# A test that takes longer is stopped [s].
LIMIT = 60


@pytest.fixture
def clip(rng):
    return tumble.Clip(
        np.linspace(0, 2, 20),
        unit(rng, 3, 20),
        name="wave",
        names=["hip", "knee", "foot"],
        parents=[None, 0, 1],
        offsets=rng.normal(size=(3, 3)),
        translations=[rng.normal(size=(20, 3)), None, None],
        velocities=rng.normal(size=(3, 20, 3)),
        tcb=rng.normal(size=(3, 20, 3)),
    )


def everything(clip, engine, path):
    """The results of every kind of call."""
    found = [
        engine.evaluate(clip, fps=30),
        engine.evaluate(clip, fps=30, layout="frame", method="c2"),
        engine.velocity(clip, fps=10, axes="world"),
        engine.matrices(clip, at=[0.5]),
        *engine.poses(clip, fps=10),
        *engine.world(clip, fps=10),
        *(chunk.rotations for chunk in engine.stream(clip, fps=30, chunk=40)),
        clip.evaluate(at=0.3),
        tumble.evaluate([0.0, 1.0], clip.keys(0)[:2], fps=9),
    ]
    assert engine.verify(clip, fps=10).verdict == "reference-only"
    tumble.save(path, clip, fps=30)
    found.append(tumble.load(path).clip.evaluate(fps=60))
    library = tumble.MotionLibrary([clip])
    found.append(library.sample([0] * 100, np.linspace(0, 2, 100)).positions)
    return [array.tobytes() for array in found]


def work(arguments):
    clip, engine, folder = arguments
    path = os.path.join(folder, f"{os.getpid()}.npz")
    return everything(clip, engine, path)


@pytest.mark.parametrize("method", multiprocessing.get_all_start_methods())
def test_pools_give_what_this_process_gives(method, clip, tmp_path):
    """After every kind of call in this process; as a loader of data with two workers has it."""
    engine = tumble.Engine("cpu", threads=2)
    expected = everything(clip, engine, tmp_path / "own.npz")
    context = multiprocessing.get_context(method)
    pool = context.Pool(2)
    try:
        arguments = [(clip, engine, str(tmp_path))] * 3
        found = pool.map_async(work, arguments).get(LIMIT)
    finally:
        pool.terminate()
    assert found == [expected] * 3


@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows does not fork")
def test_a_child_that_is_forked_meanwhile_works(clip, tmp_path):
    """Another thread evaluates at the moment of the fork."""
    engine = tumble.Engine("cpu")
    is_done = threading.Event()

    def busy():
        while not is_done.is_set():
            engine.evaluate(clip, fps=2000, method="c2")

    thread = threading.Thread(target=busy)
    thread.start()
    try:
        for _ in range(5):
            context = multiprocessing.get_context("fork")
            child = context.Process(target=work, args=((clip, engine, str(tmp_path)),))
            child.start()
            child.join(LIMIT)
            hung = child.exitcode is None
            if hung:
                child.kill()
            assert not hung and child.exitcode == 0
    finally:
        is_done.set()
        thread.join()


VULKAN = """
import os, sys, tumble
if not tumble.devices():
    print("no device"); sys.exit()
engine = tumble.Engine("vulkan", allow_inexact=True)
clip = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
before = engine.evaluate(clip, fps=3).tobytes()
child = os.fork()
if child == 0:
    refused = 0
    for call in (lambda: engine.evaluate(clip, fps=3), lambda: tumble.Engine("vulkan")):
        try:
            call()
        except tumble.DeviceError as error:
            refused += "forked" in str(error)
    same = tumble.Engine("cpu").evaluate(clip, fps=3).tobytes() == before
    del engine
    os._exit(0 if refused == 2 and same else 1)
print("child", os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
print("same", engine.evaluate(clip, fps=3).tobytes() == before)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows does not fork")
def test_vulkan_is_refused_in_a_forked_child():
    done = subprocess.run(
        [sys.executable, "-c", VULKAN], capture_output=True, text=True, timeout=LIMIT
    )
    if done.stdout == "no device\n":
        assert "CI" not in os.environ, "CI must have a Vulkan device"
        pytest.skip("no Vulkan device: nothing was refused")
    assert done.stdout == "child 0\nsame True\n", done.stderr


def copies(value):
    yield copy.copy(value)
    yield copy.deepcopy(value)
    for protocol in (2, pickle.HIGHEST_PROTOCOL):
        yield pickle.loads(pickle.dumps(value, protocol))


def test_clips_are_pickled_whole(clip, tmp_path, shared):
    clips = [clip, tumble.Clip([0.0], [[0, 0, 0, 1]]), tumble.load(shared / "gltf/Fox.glb")["Run"]]
    clips += [tumble.load(path).clips[0] for path in sorted(shared.glob("bvh/*.bvh"))[:1]]
    for original in clips:
        for other in copies(original):
            assert other == original and hash(other) == hash(original)
            assert (other.names, other.parents, other.rate) == (original.names, original.parents, original.rate)
            assert (other.path, other.span, repr(other)) == (original.path, original.span, repr(original))
            for method in ("hermite", "kochanek-bartels"):
                try:
                    expected = original.evaluate(fps=30, method=method)
                except tumble.InputError:
                    continue
                assert np.array_equal(other.evaluate(fps=30, method=method), expected)
            for array, expected in zip(
                tumble.Engine("cpu").poses(other, fps=30), tumble.Engine("cpu").poses(original, fps=30)
            ):
                assert np.array_equal(array, expected)


def test_pickles_of_earlier_versions_are_read(tmp_path):
    """They have no entries for properties that clips did not have then."""
    path = tmp_path / "walk.npz"
    np.savez(path, poses=np.zeros((4, 66)), trans=np.zeros((4, 3)), mocap_framerate=30.0)
    clip = tumble.load(path).clip
    (state,) = clip.__reduce_ex__(5)[1]
    for entry in ("up", "betas", "gender", "scalars"):
        del state[entry]
        assert tumble._tumble.clip_of_state(state) == clip
    # The direction that points up is stored since.
    turned = tumble.load(path, up="y").clip
    (state,) = turned.__reduce_ex__(5)[1]
    assert state.pop("up") is not None and tumble._tumble.clip_of_state(state) != turned


def test_clips_that_differ_are_not_the_same(clip, rng):
    times, keys = np.linspace(0, 2, 20), unit(rng, 3, 20)
    plain = tumble.Clip(times, keys)
    others = [
        tumble.Clip(times + 1e-9, keys),
        tumble.Clip(times, -keys),
        tumble.Clip(times, keys, name="x"),
        tumble.Clip(times, keys, names=["a", "b", "c"]),
        tumble.Clip(times, keys, parents=[None, 0, 0]),
        tumble.Clip(times, keys, velocities=np.ones((3, 20, 3))),
        tumble.Clip(times, keys, translations=np.ones((3, 20, 3))),
        tumble.Clip(times, keys[:2]),
        clip,
        None,
    ]
    assert plain == tumble.Clip(times, keys)
    assert not [other for other in others if plain == other]
    assert len({plain, tumble.Clip(times, keys), clip}) == 2


def test_large_clips_go_out_of_band(rng):
    clip = tumble.Clip(np.arange(5000.0), unit(rng, 24, 5000))
    buffers: list[pickle.PickleBuffer] = []
    small = pickle.dumps(clip, protocol=5, buffer_callback=buffers.append)
    keys = 24 * 5000 * 16
    assert len(small) < 10_000
    assert keys <= sum(buffer.raw().nbytes for buffer in buffers) < 1.1 * keys
    assert pickle.loads(small, buffers=buffers) == clip


def test_files_and_engines_are_pickled(clip, tmp_path):
    path = tmp_path / "wave.glb"
    tumble.save(path, clip)
    file = tumble.load(path)
    for other in copies(file):
        assert (other.names, other.path, other.clips) == (file.names, file.path, file.clips)
    # Equal files have equal clips in different folders, and files that cannot be read have the same messages.
    elsewhere = tmp_path / "folder" / "wave.glb"
    elsewhere.parent.mkdir()
    elsewhere.write_bytes(path.read_bytes())
    assert tumble.load(elsewhere) == file and hash(tumble.load(elsewhere)) == hash(file)
    tumble.save(elsewhere, tumble.Clip([0.0, 1.0], clip.keys(0)[:2], name="wave"), overwrite=True)
    assert tumble.load(elsewhere) != file
    engine = tumble.Engine("cpu", threads=2)
    expected = engine.evaluate(clip, fps=30)
    for again in copies(engine):
        assert repr(again) == repr(engine)
        assert np.array_equal(again.evaluate(clip, fps=30), expected)
    with pytest.raises(tumble.InputError, match="another version"):
        tumble._tumble.clip_of_state({})


def values(clip):
    """Results of every class."""
    corners = [[0, 0, 0], [4, 0, 0], [4, 0, 4], [0, 0, 4]]
    surface = tumble.Surface(corners, [[0, 3, 2, 1]])
    grid = np.stack(np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], indexing="ij"), axis=-1)
    net = tumble.Surface.net(np.insert(grid, 1, 0.5, axis=-1))
    route = surface.route([1, 0, 1], [3, 0, 2])
    [walk] = tumble.walk([route], speed=1.0, radius=0.1)
    engine = tumble.Engine("cpu")
    errors = tumble.path_errors(clip, clip, track=0, align="yaw", rpe="1s")
    difference = tumble.compare(clip, clip)
    arrays = tumble.compare(clip.keys(0), clip.keys(0))
    return [
        surface,
        net,
        route,
        walk,
        errors,
        errors.ape_rotation,
        difference,
        difference.rotation,
        arrays,
        arrays.difference,
        engine.verify(clip, fps=10),
        tumble.reduce(clip),
        next(engine.stream(clip, fps=10)),
        tumble.MotionLibrary([clip]).sample([0], [0.5]),
    ]


def test_results_are_pickled_and_equal(clip):
    first, again = values(clip), values(clip)
    for index, value in enumerate(first):
        for other in [again[index], *copies(value)]:
            assert type(other) is type(value) and other == value and not other != value, value
            assert repr(other) == repr(value)
        assert not [other for at, other in enumerate(first) if at != index and other == value]
        assert value != None and value != "text"  # noqa: E711
    surface, net, route, walk, *_ = (pickle.loads(pickle.dumps(value)) for value in first)
    assert surface.route([1, 0, 1], [3, 0, 2]) == route
    assert net.route([0, 0.5, 0], [2, 0.5, 2]) == first[1].route([0, 0.5, 0], [2, 0.5, 2])
    assert tumble.walk([route], speed=1.0, radius=0.1) == [walk]
    for state in ((), ("x", 1, 2), (1, 2)):
        with pytest.raises((tumble.InputError, TypeError)):
            tumble._tumble.value_of_state("Spread", state)


def test_everything_takes_weak_references(clip, tmp_path):
    tumble.save(tmp_path / "a.npz", clip)
    engine = tumble.Engine("cpu")
    library = tumble.MotionLibrary([clip])
    others = [clip, engine, tumble.load(tmp_path / "a.npz"), library, library._motions]
    others += [tumble.Crowd([clip], 2), clip.sampler(), engine.stream(clip, fps=10)]
    others += [clip.view(methods=["slerp"], fps=5)]
    for value in [*values(clip), *others]:
        assert weakref.ref(value)() is value
