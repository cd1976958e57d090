"""Motion libraries."""

from __future__ import annotations

import importlib.util
import multiprocessing
import pickle
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT, unit
from scipy.spatial.transform import Rotation, Slerp

import tumble

JOINTS = 7
PARENTS = [None, 0, 1, 1, 0, 4, 5]


def smooth(rng, frames):
    """Rotations that turn a little from frame to frame."""
    steps = Rotation.from_rotvec(0.1 * rng.normal(size=(frames, 3)))
    keys = [Rotation.random(random_state=rng)]
    for step in steps[1:]:
        keys.append(keys[-1] * step)
    return np.array([key.as_quat() for key in keys], np.float32)


@pytest.fixture
def clips(rng):
    def clip(frames, rate):
        keys = np.stack([smooth(rng, frames) for _ in range(JOINTS)])
        root = np.cumsum(0.05 * rng.normal(size=(frames, 3)), axis=0)
        return tumble.Clip(
            3.0 + np.arange(frames) / rate,
            keys,
            layout="track",
            name=f"{frames} at {rate}",
            parents=PARENTS,
            offsets=OFFSETS,
            translations=[root, *[None] * (JOINTS - 1)],
        )

    return [clip(40, 30), clip(7, 24), clip(200, 120), clip(2, 10)]


def wave(frames, rate):
    """A clip that swings."""
    angles = np.sin(np.arange(frames)[None, :, None] / rate + np.arange(JOINTS)[:, None, None])
    keys = Rotation.from_rotvec((angles * [0.3, 0.5, 0.7]).reshape(-1, 3)).as_quat()
    return tumble.Clip(
        np.arange(frames) / rate,
        keys.reshape(JOINTS, frames, 4),
        layout="track",
        names=[f"joint{index}" for index in range(JOINTS)],
        parents=PARENTS,
        offsets=OFFSETS,
    )


OFFSETS = np.random.default_rng(3).normal(size=(JOINTS, 3))


def test_states_are_those_of_the_engine(clips, rng):
    library = tumble.MotionLibrary(clips)
    engine = tumble.Engine("cpu")
    ids = rng.integers(0, len(clips), 60)
    times = library.sample_times(ids, rng)
    times[:4] = [0.0, library.lengths[ids[1]], -5.0, 1e9]
    state = library.sample(ids, times)
    for instance, (clip, time) in enumerate(zip(ids, times)):
        played = clips[clip]
        at = np.clip(3.0 + time, *played.span)
        expected = engine.evaluate(played, at=at, method="slerp")
        signs = np.sign((expected * state.rotations[instance]).sum(-1, keepdims=True))
        np.testing.assert_allclose(state.rotations[instance] * signs, expected, atol=2e-6)
        positions, world = engine.world(played, at=[at], method="slerp")
        np.testing.assert_allclose(state.positions[instance], positions[:, 0], atol=2e-5)
        signs = np.sign((world[:, 0] * state.world_rotations[instance]).sum(-1, keepdims=True))
        np.testing.assert_allclose(state.world_rotations[instance] * signs, world[:, 0], atol=5e-6)
        rates = engine.velocity(played, at=[at], method="slerp", axes="world")[:, 0]
        if 0 < time < library.lengths[clip]:
            np.testing.assert_allclose(state.angular_velocities[instance], rates, atol=2e-3)
    assert state.rotations.dtype == np.float32 and state.positions.shape == (60, JOINTS, 3)


@pytest.mark.parametrize("method", ["slerp", "bessel-overhauser", "c2"])
def test_velocities_are_those_of_differences(clips, rng, method):
    library = tumble.MotionLibrary(clips, method=method)
    ids = np.full(200, 2)
    # Times inside frames, because rates of slerp jump at frames.
    times = (rng.integers(0, 190, 200) + rng.uniform(0.1, 0.9, 200)) / 120
    state, step = library.sample(ids, times), 2e-4
    before, after = library.sample(ids, times - step), library.sample(ids, times + step)
    rate = (after.positions - before.positions) / (2 * step)
    np.testing.assert_allclose(state.velocities, rate, rtol=1e-2, atol=0.1)
    a, b = (Rotation.from_quat(state.world_rotations.reshape(-1, 4)) for state in (before, after))
    expected = (b * a.inv()).as_rotvec().reshape(200, JOINTS, 3) / (2 * step)
    np.testing.assert_allclose(state.angular_velocities, expected, rtol=1e-2, atol=0.1)


def test_finite_differences_are_those_of_two_frames(clips):
    library = tumble.MotionLibrary(clips)
    state = library.sample([0, 0], [5.5 / 30, 100.0], finite=True)
    frames = library.sample([0] * 4, np.array([5, 6, 38, 39]) / 30)
    expected = 30 * (frames.positions[1::2] - frames.positions[::2])
    np.testing.assert_allclose(state.velocities, expected, atol=1e-3)
    world = Rotation.from_quat(frames.world_rotations[1].astype(float))
    world = world * Rotation.from_quat(frames.world_rotations[0].astype(float)).inv()
    np.testing.assert_allclose(state.angular_velocities[0], 30 * world.as_rotvec(), atol=1e-3)
    exact = library.sample([0, 0], [5.5 / 30, 100.0])
    assert np.array_equal(state.positions, exact.positions)


def test_outputs_are_used_again_and_left_out(clips, rng):
    library = tumble.MotionLibrary(clips)
    ids, times = rng.integers(0, 4, 300), rng.uniform(0, 1, 300)
    whole = library.sample(ids, times)
    some = library.sample(ids, times, arrays=["velocities", "rotations"])
    assert some.positions is None and np.array_equal(some.velocities, whole.velocities)
    assert np.array_equal(some.rotations, whole.rotations)
    memory = some.rotations
    again = library.sample(ids[::-1], times[::-1], out=some)
    assert again is some and some.rotations is memory
    assert np.array_equal(memory, whole.rotations[::-1])
    assert library.sample([], []).positions.shape == (0, JOINTS, 3)


def test_wrong_arguments_are_refused(clips, rng):
    library = tumble.MotionLibrary(clips)
    for arguments, words in [
        (([4], [0.0]), "there is no clip 4; there are 4"),
        (([-1], [0.0]), "there is no clip -1"),
        (([0], [np.nan]), r"times\[0\]"),
        (([0, 1], [0.0, 0.5, 1.0]), "shapes"),
        (([0.5], [0.0]), "whole numbers"),
    ]:
        with pytest.raises(tumble.InputError, match=words):
            library.sample(*arguments)
    with pytest.raises(tumble.InputError, match="there is no `speeds`"):
        library.sample([0], [0.0], arrays=["speeds"])
    with pytest.raises(tumble.InputError, match="out"):
        library.sample([0, 0], [0.0, 0.0], out=library.sample([0], [0.0]))
    read_only = library.sample([0], [0.0])
    read_only.rotations.flags.writeable = False
    with pytest.raises(tumble.InputError, match="out"):
        library.sample([0], [0.0], out=read_only)
    with pytest.raises(tumble.InputError, match="give at least one"):
        tumble.MotionLibrary([])
    other = tumble.Clip([0.0, 1.0], unit(rng, 2, 2), layout="track")
    with pytest.raises(tumble.InputError, match="2 tracks; the skeleton has 7"):
        tumble.MotionLibrary([clips[0], other])
    with pytest.raises(tumble.InputError, match="no skeleton"):
        tumble.MotionLibrary([other])
    scaled = tumble.Clip([0.0, 1.0], unit(rng, 1, 2), parents=[None], scales=np.ones((1, 2, 3)))
    with pytest.raises(tumble.InputError, match="scale keys"):
        tumble.MotionLibrary([scaled])


def test_a_library_is_kept_in_a_file(clips, rng, tmp_path):
    library = tumble.MotionLibrary(clips, method="bessel-overhauser")
    path = tmp_path / "motions.npz"
    library.save(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["motions.npz"]
    ids, times = rng.integers(0, 4, 100), rng.uniform(0, 1, 100)
    expected = library.sample(ids, times)
    assert np.load(path)["cells"].shape[1] == 4, "NumPy reads it"
    again = [tumble.MotionLibrary.open(path, mmap=mmap) for mmap in (True, False)]
    again += [pickle.loads(pickle.dumps(copied)) for copied in (library, *again)]
    for copied in again:
        found = copied.sample(ids, times)
        for name in ("rotations", "positions", "world_rotations", "velocities"):
            assert np.array_equal(getattr(found, name), getattr(expected, name))
        assert copied.names == library.names and np.array_equal(copied.lengths, library.lengths)
        assert (copied.method, repr(copied)) == ("bessel-overhauser", repr(library))
    many = tumble.MotionLibrary(100 * clips[3:])
    many.save(tmp_path / "many.npz")
    assert len(pickle.dumps(tumble.MotionLibrary.open(tmp_path / "many.npz"))) < 500
    mapped = again[0]._motions.arrays()["cells"]
    assert isinstance(mapped, np.memmap) and mapped.ctypes.data % 64 == 0


def test_broken_files_are_refused(clips, tmp_path):
    library = tumble.MotionLibrary(clips[:2])
    path = tmp_path / "motions.npz"
    library.save(path)
    whole = path.read_bytes()
    broken = tmp_path / "broken.npz"
    for size in [0, 10, 1000, len(whole) // 2, len(whole) - 1]:
        broken.write_bytes(whole[:size])
        with pytest.raises(tumble.InputError):
            tumble.MotionLibrary.open(broken)
    np.savez(broken, version=1)
    with pytest.raises(tumble.InputError):
        tumble.MotionLibrary.open(broken)
    np.savez(broken, x=1)
    with pytest.raises(tumble.InputError, match="not a motion library"):
        tumble.MotionLibrary.open(broken)


def sampled(arguments):
    library, ids, times = arguments
    return library.sample(ids, times).positions.tobytes()


def test_workers_share_a_file(clips, rng, tmp_path):
    tumble.MotionLibrary(clips).save(tmp_path / "motions.npz")
    library = tumble.MotionLibrary.open(tmp_path / "motions.npz")
    ids, times = rng.integers(0, 4, 100), rng.uniform(0, 1, 100)
    pool = multiprocessing.get_context("spawn").Pool(1)
    try:
        found = pool.map_async(sampled, [(library, ids, times)]).get(60)
    finally:
        pool.terminate()
    assert found == [sampled((library, ids, times))]


def test_libraries_are_read_from_files(clips, tmp_path):
    for index, clip in enumerate(clips[:3]):
        rate = [30, 24, 120][index]
        tumble.save(tmp_path / f"{index}.bvh", clip, fps=rate, method="slerp")
    library = tumble.MotionLibrary.load(tmp_path / "*.bvh")
    assert (library.names, len(library), library.joints) == (["0", "1", "2"], 3, JOINTS)
    np.testing.assert_allclose(library.lengths, [39 / 30, 6 / 24, 199 / 120], atol=1e-4)
    np.testing.assert_allclose(library.rates, [30, 24, 120], rtol=1e-4)
    skeleton = tmp_path / "0.bvh"
    files = [tmp_path / "1.bvh", tmp_path / "2.bvh"]
    assert len(tumble.MotionLibrary.load(files, skeleton=skeleton)) == 2
    with pytest.raises(FileNotFoundError):
        tumble.MotionLibrary.load(tmp_path / "*.glb")
    with pytest.raises(FileNotFoundError):
        tumble.MotionLibrary.load(tmp_path / "missing.bvh")


def test_nothing_grows_over_many_steps(clips, rng):
    import resource

    library = tumble.MotionLibrary(clips)
    ids, times = rng.integers(0, 4, 50), rng.uniform(0, 1, 50)
    out = library.sample(ids, times)
    for _ in range(500):
        library.sample(ids, times, out=out)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(5000):
        library.sample(ids, times, out=out)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 2048, f"{grown} KiB more"


def test_slerp_is_scipys(rng):
    keys = smooth(rng, 30)
    clip = tumble.Clip(np.arange(30.0), keys[None], parents=[None])
    times = rng.uniform(0, 29, 100)
    found = tumble.MotionLibrary([clip]).sample([0] * 100, times).rotations[:, 0]
    expected = Slerp(np.arange(30.0), Rotation.from_quat(keys))(times)
    angle = (Rotation.from_quat(found.astype(float)).inv() * expected).magnitude()
    assert angle.max() < 6e-7


def test_the_example_gives_the_bits_of_every_machine():
    """At every vector width, on every machine: the sum was recorded on x86-64."""
    spec = importlib.util.spec_from_file_location("steps", ROOT / "python/examples/steps.py")
    steps = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(steps)
    seconds, bits = steps.run(steps.invented(clips=20), steps=3, environments=256)
    assert seconds > 0
    assert bits == "7aafc96c4c49c8ba12a89bd337d66bba94f459afd9729e80d1b84921093d423d"


def test_the_way_of_a_trainer_gives_the_same_bits_everywhere(tmp_path):
    command = [sys.executable, str(ROOT / "python/examples/training.py")]
    command += ["--files", "20", "--steps", "5", "--environments", "256"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("all have the same bits\n") and "the same bits: True" in done.stdout


def test_source_fps_is_for_files_that_state_no_rate(tmp_path):
    n = 31
    body = {"poses": np.zeros((n, 156)), "trans": np.zeros((n, 3))}
    stated, silent = tmp_path / "stated.npz", tmp_path / "silent.npz"
    np.savez(stated, **body, mocap_framerate=30.0)
    np.savez(silent, **body)
    with pytest.warns(tumble.InputWarning, match="states 30 frames a second, which is used"):
        library = tumble.MotionLibrary.load([stated, silent], source_fps=120)
    assert library.lengths.tolist() == [1.0, 0.25]
    with pytest.warns(tumble.InputWarning, match="override_fps it is read at 120"):
        library = tumble.MotionLibrary.load([stated, silent], override_fps=120)
    assert library.lengths.tolist() == [0.25, 0.25]


def test_override_fps_is_for_files_without_times(tmp_path):
    clip = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1], [0, 0, 1, 0]])
    tumble.save(tmp_path / "door.glb", clip)
    with pytest.raises(ValueError, match="override_fps has no effect on glb; it is for bvh"):
        tumble.load(tmp_path / "door.glb", override_fps=30)
    with pytest.raises(ValueError, match="source_fps and override_fps both say"):
        tumble.load(tmp_path / "door.glb", source_fps=30, override_fps=30)


def test_ids_and_times_of_any_shapes_broadcast():
    library = tumble.MotionLibrary([wave(40, 30), wave(70, 30)])
    rng = np.random.default_rng(11)
    ids, times = rng.integers(0, 2, (5, 1)), rng.uniform(0, 2, (1, 7))
    found = library.sample(ids, times)
    flat = library.sample(np.broadcast_to(ids, (5, 7)).ravel(), np.broadcast_to(times, (5, 7)).ravel())
    for name in ("rotations", "positions", "world_rotations", "velocities", "angular_velocities"):
        array, expected = getattr(found, name), getattr(flat, name)
        assert array.shape == (5, 7, *expected.shape[1:])
        np.testing.assert_array_equal(array.reshape(expected.shape), expected)
        assert array.ctypes.data % 64 == 0
    one = library.sample(1, 0.5)
    np.testing.assert_array_equal(one.rotations, library.sample([1], [0.5]).rotations[0])
    again = library.sample(ids, times + 1, out=found)
    assert again is found
    np.testing.assert_array_equal(found.positions, library.sample(ids, times + 1).positions)
    swapped = library.sample(ids, times, order="wxyz")
    np.testing.assert_array_equal(np.roll(swapped.rotations, -1, -1), library.sample(ids, times).rotations)
    for finite in (False, True):
        windows = library.sample_windows([0, 1], [0.2, 0.4], 6, 30, finite=finite)
        each = library.sample([0, 1], [0.2 + 3 / 30, 0.4 + 3 / 30], finite=finite)
        np.testing.assert_array_equal(windows.velocities[:, 3], each.velocities)
    with pytest.raises(tumble.InputError, match=r"shapes are \(2,\) and \(3,\)"):
        library.sample([0, 1], [0.0, 0.1, 0.2])
    with pytest.raises(tumble.InputError, match="there is no `zyx`"):
        library.sample(0, 0.0, order="zyx")
    with pytest.raises(tumble.InputError, match="rate greater than 0"):
        library.sample_windows([0], [0.0], 3, 0)


def test_clips_are_drawn_by_their_lengths():
    library = tumble.MotionLibrary([wave(31, 30), wave(91, 30)])
    ids, times = library.draw(4000, np.random.default_rng(3))
    assert abs((ids == 1).mean() - 0.75) < 0.03
    assert ((times >= 0) & (times <= library.lengths[ids])).all()
    np.testing.assert_array_equal(library.draw(4000, np.random.default_rng(3))[1], times)
    assert (library.draw(9, np.random.default_rng(3), weights=[1, 0])[0] == 0).all()
    with pytest.raises(tumble.InputError, match="for each of the 2 clips"):
        library.draw(1, np.random.default_rng(3), weights=[1])
    with pytest.raises(tumble.InputError, match="they are 0"):
        library.draw(1, np.random.default_rng(3), weights=[0, 0])
    with pytest.raises(tumble.InputError, match="there is no clip -1; there are 2"):
        library.sample_times([-1], np.random.default_rng(3))
    assert library.nbytes > 48 * 31


def test_windows_that_are_drawn_end_in_their_clips():
    library = tumble.MotionLibrary([wave(31, 30), wave(91, 30)])
    ids, times = library.draw(4000, np.random.default_rng(3), window=0.5)
    assert (times >= 0).all() and (times + 0.5 <= library.lengths[ids]).all()
    assert abs((ids == 1).mean() - 2.5 / 3) < 0.03
    assert (library.draw(99, np.random.default_rng(3), window=2)[0] == 1).all()
    for window, match in [(4, "no clip lasts 4 s; the longest lasts 3.0 s"), (-1, "no number of seconds")]:
        with pytest.raises(tumble.InputError, match=match):
            library.draw(1, np.random.default_rng(3), window=window)


def test_what_does_not_fit_is_left_out_and_listed(tmp_path):
    for index, count in enumerate((40, 50)):
        tumble.save(tmp_path / f"{index}.npz", wave(count, 30), fps=30, method="slerp")
    other = tumble.Clip(np.arange(3) / 30, np.tile([0, 0, 0, 1.0], (1, 3, 1)), names=["tail"], parents=[None], offsets=[[0, 0, 0]])
    tumble.save(tmp_path / "2.npz", other, fps=30, method="slerp")
    (tmp_path / "3.npz").write_bytes(b"PK nothing")
    pattern = str(tmp_path / "*.npz")
    with pytest.raises(tumble.InputError, match="3.npz"):
        tumble.MotionLibrary.load(pattern)
    steps = []
    library = tumble.MotionLibrary.load(pattern, on_error="skip", progress=lambda done, total: steps.append((done, total)))
    assert steps == [(4, 4)]
    assert library.names == ["0", "1"]
    assert len(library.lengths) == len(library.rates) == 2
    broken, tail = library.skipped
    assert broken.path.endswith("3.npz") and broken.code.startswith("E") and broken.clip is None
    assert tail.path.endswith("2.npz") and "has a joint `joint0`" in tail.message
    np.testing.assert_array_equal(
        library.sample([1], [0.3]).rotations, tumble.MotionLibrary.load(str(tmp_path / "[01].npz")).sample([1], [0.3]).rotations
    )
    with pytest.raises(TypeError, match="there is no keyword `source_fsp`.*did you mean `source_fps`"):
        tumble.MotionLibrary.load(pattern, source_fsp=30)
    with pytest.raises(tumble.InputError, match="there are refuse, skip"):
        tumble.MotionLibrary.load(pattern, on_error="ignore")
    with pytest.raises(tumble.InputError, match="no file could be read"):
        tumble.MotionLibrary.load(str(tmp_path / "3.npz"), on_error="skip")


def body(path, frames, rate=120.0, seed=0):
    """A file as AMASS has it: 52 joints."""
    rng = np.random.default_rng(seed)
    poses = np.cumsum(0.02 * rng.normal(size=(frames, 3 * 52)), axis=0)
    trans = np.cumsum(0.01 * rng.normal(size=(frames, 3)), axis=0)
    np.savez(path, poses=poses, trans=trans, betas=np.zeros(16), gender="neutral", mocap_framerate=rate)
    return poses.reshape(frames, 52, 3), trans


def test_a_folder_of_amass_is_shaped_while_it_is_read(tmp_path):
    poses, trans = body(tmp_path / "a_poses.npz", 121)
    body(tmp_path / "b_poses.npz", 50, rate=60.0, seed=1)
    np.savez(tmp_path / "shape.npz", betas=np.zeros(16), gender="neutral")
    latent = {"markers_latent": np.zeros((60, 3)), "markers_latent_vids": np.array({"a": 1}, dtype=object)}
    np.savez(tmp_path / "neutral_stagei.npz", betas=np.zeros(16), gender="neutral", **latent)
    tracks = ["pelvis", "spine1", "left_hip", "right_hip", "left_knee"]
    library = tumble.MotionLibrary.load(
        tmp_path / "*.npz", fps=30, tracks=tracks, offsets=np.ones((52, 3)), on_error="skip"
    )
    assert library.names == ["a_poses", "b_poses"] and library.joint_names == tracks
    assert library.rates.tolist() == [30.0, 30.0]
    np.testing.assert_allclose(library.lengths, [1.0, 24 / 30], atol=1e-12)
    assert [(left.path.split("/")[-1], left.code) for left in library.skipped] == [
        ("neutral_stagei.npz", "E320"),
        ("shape.npz", "E320"),
    ]
    assert "no clip" in library.skipped[0].message
    # Every fourth frame, only of the named joints.
    times = np.arange(31) / 30
    found = library.sample(0, times)
    for joint, source in enumerate([0, 3, 1, 2, 4]):
        expected = Rotation.from_rotvec(poses[::4, source])
        turned = Rotation.from_quat(found.rotations[:, joint].astype(float))
        assert (turned.inv() * expected).magnitude().max() < 1e-6
    # The position of the pelvis is `trans` plus the pelvis offset of the body.
    np.testing.assert_allclose(found.positions[:, 0], trans[::4] + 1, atol=1e-5)
    by_index = tumble.MotionLibrary.load(
        tmp_path / "a_poses.npz", fps=30, tracks=[0, 3, 1, 2, 4], offsets=np.ones((52, 3))
    )
    np.testing.assert_array_equal(by_index.sample(0, times).positions, found.positions)
    for wrong, words in [
        ({"tracks": ["pelvis", "left_knee"]}, "`left_knee` is a child of `left_hip`, which is left out"),
        ({"tracks": ["pelvis", "left_hand"]}, "a_poses.npz: tracks: there is no joint `left_hand`"),
        ({"tracks": [0, 99]}, "there is no joint 99; there are 52"),
        ({"tracks": [0, 0]}, "the joint 0 stands twice"),
        ({"tracks": "pelvis"}, "give a list"),
        ({"tracks": []}, "at least one"),
        ({"fps": 0}, "fps"),
    ]:
        with pytest.raises(ValueError, match=words):
            tumble.MotionLibrary.load(tmp_path / "a_poses.npz", **wrong)
    with pytest.raises(tumble.InputError, match="E320"):
        tumble.MotionLibrary.load(tmp_path / "*.npz")
    unchanged = tumble.MotionLibrary.load(tmp_path / "a_poses.npz", fps=120)
    np.testing.assert_array_equal(
        unchanged.sample(0, 0.51, arrays=["rotations"]).rotations,
        tumble.MotionLibrary.load(tmp_path / "a_poses.npz").sample(0, 0.51, arrays=["rotations"]).rotations,
    )


class Bar:
    """What tqdm has."""

    made: list = []

    def __init__(self, total=None):
        self.total, self.steps, self.closed = total, [], False
        Bar.made.append(self)

    def update(self, count):
        self.steps.append(count)

    def close(self):
        self.closed = True


def test_progress_is_shown_by_bars_and_functions(tmp_path):
    for index in range(70):
        tumble.save(tmp_path / f"{index:02}.npz", wave(3, 30), fps=30, method="slerp")
    pattern = tmp_path / "*.npz"
    tumble.MotionLibrary.load(pattern, progress=Bar)
    [bar] = Bar.made
    assert (bar.total, bar.steps, bar.closed) == (70, [64, 6], True)
    shown = Bar()
    tumble.MotionLibrary.load(pattern, progress=shown)
    assert (shown.total, sum(shown.steps), shown.closed) == (70, 70, False)
    for index, path in enumerate(sorted(tmp_path.iterdir())):
        if index:
            path.unlink()


def test_shards_share_all_clips(tmp_path):
    library = tumble.MotionLibrary([wave(count, 30) for count in (10, 20, 30, 40, 50)], names=list("abcde"))
    parts = [library.shard(rank, 2) for rank in range(2)]
    assert [part.names for part in parts] == [["a", "c", "e"], ["b", "d"]]
    again = parts[1].shard(1, 2)
    assert again.names == ["d"]
    np.testing.assert_array_equal(again.sample(0, 0.7).rotations, library.sample(3, 0.7).rotations)
    np.testing.assert_array_equal(again.sample(0, 0.7, finite=True).velocities, library.sample(3, 0.7, finite=True).velocities)
    again.save(tmp_path / "part.npz")
    opened = tumble.MotionLibrary.open(tmp_path / "part.npz")
    library.save(tmp_path / "whole.npz")
    mapped = tumble.MotionLibrary.open(tmp_path / "whole.npz").shard(1, 2).shard(1, 2)
    for copied in (opened, mapped, *(pickle.loads(pickle.dumps(part)) for part in (again, opened, mapped))):
        assert copied.names == ["d"]
        np.testing.assert_array_equal(copied.sample(0, 0.7).positions, library.sample(3, 0.7).positions)
    with pytest.raises(tumble.InputError, match="there is no clip 2; there are 2"):
        parts[1].sample([0, 2], 0.0)
    with pytest.raises(tumble.InputError, match="rank from 0"):
        library.shard(2, 2)
    files = [tmp_path / f"{name}.bvh" for name in "abc"]
    for path in files:
        tumble.save(path, wave(9, 30), fps=30, method="slerp")
    assert tumble.MotionLibrary.load(files, shard=(1, 2)).names == ["b"]


def test_rotations_have_the_representation_that_is_asked_for(clips, rng):
    library = tumble.MotionLibrary(clips)
    ids, times = rng.integers(0, 4, (5, 6)), rng.uniform(0, 1, (5, 6))
    plain = library.sample(ids, times)
    matrices = library.sample(ids, times, rotations="matrix")
    six = library.sample(ids, times, rotations="6d", arrays=["rotations", "world_rotations"])
    vectors = library.sample(ids, times, rotations="rotvec")
    for name in ("rotations", "world_rotations"):
        expected = Rotation.from_quat(getattr(plain, name).reshape(-1, 4).astype(float))
        found = getattr(matrices, name)
        np.testing.assert_allclose(found.reshape(-1, 3, 3), expected.as_matrix(), atol=1e-6)
        columns = found[..., :2].swapaxes(-1, -2).reshape(5, 6, JOINTS, 6)
        np.testing.assert_array_equal(getattr(six, name), columns)
        np.testing.assert_allclose(getattr(vectors, name).reshape(-1, 3), expected.as_rotvec(), atol=2e-6)
    # The bits of the engine, on any number of threads.
    many = np.tile(plain.rotations.reshape(-1, 4), (4, 1))
    clip = tumble.Clip(np.arange(len(many)), many)
    at, exact = clip.times(0), vectors.rotations.reshape(-1, 3)
    for threads in (1, 2):
        found = tumble.Engine("cpu", threads=threads).rotation_vectors(clip, at=at, signs="as-authored")[0]
        np.testing.assert_array_equal(found, np.tile(exact, (4, 1)))
    first = library.sample(ids, times, order="wxyz", arrays=["world_rotations"]).world_rotations
    np.testing.assert_array_equal(first, plain.world_rotations[..., [3, 0, 1, 2]])
    np.testing.assert_array_equal(matrices.positions, plain.positions)
    assert six.positions is None and matrices.rotations.ctypes.data % 64 == 0
    memory = six.rotations
    again = library.sample(ids, times + 0.1, rotations="6d", out=six)
    assert again.rotations is memory
    np.testing.assert_array_equal(memory, library.sample(ids, times + 0.1, rotations="6d").rotations)
    for keywords, words in [
        ({"rotations": "euler"}, "there is no `euler`; there are quaternion, matrix, 6d, rotvec"),
        ({"rotations": "6d", "order": "wxyz"}, "is of quaternions"),
        ({"out": plain, "arrays": ["rotations"]}, "give one of the two"),
        ({"out": six}, r"its rotations are float32 \(5, 6, 7, 6\); the result's are float32 \(5, 6, 7, 4\)"),
        ({"out": tumble.MotionState(velocities=np.zeros((5, 6, 7, 3)))}, r"its velocities are float64 .* float32"),
        ({"out": tumble.MotionState(positions=[[0.0]])}, "its positions are of the type list"),
        ({"out": tumble.MotionState(positions=np.zeros((5, 6, 7, 6), np.float32)[..., ::2])}, "the numbers of its positions are not contiguous"),
    ]:
        with pytest.raises(tumble.InputError, match=words):
            library.sample(ids, times, **keywords)


ARRAYS = ("rotations", "positions", "world_rotations", "velocities", "angular_velocities")


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("heading", ["twist", "x", "z"])
def test_poses_in_heading_frames_are_those_of_root_motion(clips, rng, heading, up):
    library = tumble.MotionLibrary(clips)
    ids, times = library.draw(50, rng)
    plain = library.sample(ids, times)
    found = library.sample(ids, times, heading=heading, up=up)
    axis = None if heading == "twist" else heading
    features = tumble.features
    headings = features.heading(plain.world_rotations[:, 0], order="xyzw", up=up, axis=axis)
    vector = np.eye(3)["xyz".index(up)]
    back = Rotation.from_rotvec(-headings[:, None] * vector)
    place = plain.positions[:, 0] * (1 - vector)
    for joint in range(JOINTS):
        for name, origin in [("positions", place), ("velocities", 0), ("angular_velocities", 0)]:
            expected = back.apply(getattr(plain, name)[:, joint] - origin)
            largest = np.abs(getattr(plain, name)).max()
            np.testing.assert_allclose(getattr(found, name)[:, joint], expected, rtol=0, atol=2e-7 * largest)
        q = found.world_rotations[:, joint].astype(float)
        apart = Rotation.from_quat(q).inv() * back * Rotation.from_quat(plain.world_rotations[:, joint].astype(float))
        assert apart.magnitude().max() < 5e-7
    # The root is in place, as `root_motion` leaves it; each pose is a motion of its own.
    for index in range(5):
        at, turned = plain.positions[index : index + 1, 0], plain.world_rotations[index : index + 1, 0]
        _, _, still, upright = features.root_motion(at, turned, order="xyzw", up=up, axis=axis)
        np.testing.assert_allclose(found.positions[index, 0], still[0], rtol=0, atol=1e-6)
        np.testing.assert_allclose(found.rotations[index, 0], upright[0], rtol=0, atol=2e-7)
    np.testing.assert_array_equal(found.rotations[:, 1:], plain.rotations[:, 1:])
    np.testing.assert_array_equal(found.rotations[:, 0], found.world_rotations[:, 0])
    # Alone, and in other representations and orders.
    keywords = {"heading": heading, "up": up}
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(library.sample(ids, times, arrays=[name], **keywords), name), getattr(found, name))
    six = library.sample(ids, times, rotations="6d", **keywords)
    np.testing.assert_allclose(
        six.world_rotations, features.six(found.world_rotations, "six-columns", order="xyzw"), atol=1e-6
    )
    np.testing.assert_array_equal(six.positions, found.positions)
    first = library.sample(ids, times, order="wxyz", **keywords)
    np.testing.assert_array_equal(first.world_rotations, found.world_rotations[..., [3, 0, 1, 2]])
    # A window is in the frame of its first state.
    window = library.sample_windows(ids, times, 4, fps=30, **keywords)
    np.testing.assert_array_equal(window.positions[:, 0], found.positions)
    in_world = library.sample_windows(ids, times, 4, fps=30)
    expected = back.apply(in_world.positions[:, 3, 2] - place)
    np.testing.assert_allclose(window.positions[:, 3, 2], expected, rtol=0, atol=1e-6)


def test_headings_need_the_axis_that_points_up(clips):
    library = tumble.MotionLibrary(clips)
    for keywords, words in [
        ({"heading": "x"}, "give both"),
        ({"up": "y"}, "give both"),
        ({"heading": "left", "up": "y"}, "heading: there is no `left`; there are twist, x, y, z"),
        ({"heading": "x", "up": "x"}, "up: there is no `x`; there are y, z"),
    ]:
        with pytest.raises(tumble.InputError, match=words):
            library.sample(0, 0.0, **keywords)


SIDES = ["hips", "spine", "left_arm", "right_arm", "left_leg", "right_leg", "head"]
TREE = [None, 0, 1, 1, 0, 0, 1]


@pytest.fixture
def bodies(rng):
    def clip(name, frames, rate):
        keys = np.stack([smooth(rng, frames) for _ in SIDES])
        root = np.cumsum(0.05 * rng.normal(size=(frames, 3)), axis=0)
        offsets = rng.normal(size=(7, 3))
        offsets[[3, 5]] = offsets[[2, 4]] * [-1, 1, 1]
        offsets[[0, 1, 6], 0] = 0
        return tumble.Clip(np.arange(frames) / rate, keys, layout="track", name=name, names=SIDES, parents=TREE, offsets=offsets,
                           translations=[root, *[None] * 6])

    return [clip(*each) for each in [("walk", 40, 30), ("jump", 9, 24), ("turn", 100, 60)]]


def test_mirrored_clips_follow_the_others_and_are_those_of_features(bodies, rng, tmp_path):
    library = tumble.MotionLibrary(bodies)
    both = library.with_mirrored("x")
    assert both.names == ["walk", "jump", "turn", "walk (mirrored)", "jump (mirrored)", "turn (mirrored)"]
    assert len(both) == 6 and both.nbytes == library.nbytes and len(library) == 3
    ids, times = both.draw(60, rng)
    assert (ids < 3).any() and (ids >= 3).any()
    found, plain = both.sample(ids, times), library.sample(ids % 3, times)
    pairs, features = tumble.features.mirror_pairs(SIDES), tumble.features
    image = ids >= 3
    for name in ARRAYS:
        of, was = getattr(found, name), getattr(plain, name)
        np.testing.assert_array_equal(of[~image], was[~image])
        if name.endswith("rotations"):
            # The function normalises quaternions.
            expected = features.mirrored_rotations(was[image], order="xyzw", axis="x", pairs=pairs)
            np.testing.assert_allclose(of[image], expected, rtol=0, atol=2e-7)
            expected = was[image][:, pairs] * np.float32([1, -1, -1, 1])
        else:
            expected = features.mirrored_positions(was[image], axis="x", pairs=pairs)
        # Angular velocities are mirrored as the vectors of rotations.
        np.testing.assert_array_equal(of[image], -expected if name == "angular_velocities" else expected)
    # The state is whole: the positions are those of the mirrored rotations along the skeleton.
    turned = Rotation.from_quat(found.world_rotations[:, 1].astype(float)) * Rotation.from_quat(found.rotations[:, 3].astype(float))
    apart = turned.inv() * Rotation.from_quat(found.world_rotations[:, 3].astype(float))
    assert apart.magnitude().max() < 1e-6
    twice = features.mirrored_positions(found.positions[image], axis="x", pairs=pairs)
    np.testing.assert_array_equal(twice, plain.positions[image])
    # Differences, windows, representations and heading frames.
    window = both.sample_windows(ids, times, 3, fps=30, finite=True, arrays=["velocities"]).velocities
    was = library.sample_windows(ids % 3, times, 3, fps=30, finite=True, arrays=["velocities"]).velocities
    np.testing.assert_array_equal(window[image], features.mirrored_positions(was[image], axis="x", pairs=pairs))
    framed = both.sample(ids, times, heading="twist", up="y", rotations="6d")
    assert np.abs(framed.positions[:, 0, [0, 2]]).max() < 1e-6
    # Copies, shards and files.
    part = both.shard(1, 2)
    assert part.names == ["jump", "jump (mirrored)"]
    np.testing.assert_array_equal(part.sample(1, 0.1).positions, both.sample(4, 0.1).positions)
    both.save(tmp_path / "both.npz")
    library.save(tmp_path / "one.npz")
    assert (tmp_path / "both.npz").stat().st_size < (tmp_path / "one.npz").stat().st_size + 4000
    opened = tumble.MotionLibrary.open(tmp_path / "both.npz")
    doubled = tumble.MotionLibrary.open(tmp_path / "one.npz").with_mirrored("x")
    for other in (opened, doubled, pickle.loads(pickle.dumps(both)), pickle.loads(pickle.dumps(opened)), pickle.loads(pickle.dumps(doubled))):
        assert other.names == both.names and other.sample(ids, times) == found
    for whole in (opened, doubled):
        for other in (whole.shard(1, 2), pickle.loads(pickle.dumps(whole.shard(1, 2)))):
            assert other.names == part.names and other.sample([0, 1], 0.1) == part.sample([0, 1], 0.1)
    with pytest.raises(tumble.InputError, match="computed on the CPU"):
        opened._put_on("vulkan")


def test_what_has_no_mirror_image_is_refused(bodies, clips):
    library = tumble.MotionLibrary(bodies)
    for options, words in [
        ({"axis": "w"}, "there is no `w`"),
        ({"axis": "x", "pairs": [0, 1]}, "give 7 indices"),
        ({"axis": "x", "pairs": [1, 2, 0, 3, 4, 5, 6]}, "partner of its partner"),
        ({"axis": "x", "pairs": [0, 1, 4, 3, 2, 5, 6]}, r"joint 2 \(left_arm\) and its partner, joint 4 \(left_leg\), do not have"),
    ]:
        with pytest.raises(tumble.InputError, match=words):
            library.with_mirrored(**options)
    with pytest.raises(tumble.InputError, match="mirror images already"):
        library.with_mirrored("x").with_mirrored("x")
    with pytest.raises(tumble.InputError, match="no joint has a name with a side"):
        tumble.MotionLibrary(clips).with_mirrored("x")
    lost = tumble.Clip([0.0], [[[0, 0, 0, 1]]] * 2, layout="track", names=["hips", "left_arm"], parents=[None, 0], offsets=np.eye(3)[:2])
    with pytest.raises(tumble.InputError, match=r"joint 1 \(left_arm\) has no partner"):
        tumble.MotionLibrary([lost]).with_mirrored("x")
    robot = tumble.Clip([0.0, 1.0], [[0, 0, 0, 1]] * 2, parents=[None], scalars={"knee": ([0.0, 1.0], [0.0, 1.0])})
    with pytest.raises(tumble.InputError, match="knee"):
        tumble.MotionLibrary([robot]).with_mirrored("x", pairs=[0])


def test_packed_libraries_are_small_and_within_their_bound(rng, tmp_path):
    frames = 400
    keys = np.stack([smooth(rng, frames) for _ in range(22)])
    root = np.cumsum(0.05 * rng.normal(size=(frames, 3)), axis=0)
    clip = tumble.Clip(
        np.arange(frames) / 120, keys, layout="track", parents=[None, *range(21)], offsets=rng.normal(size=(22, 3)),
        translations=[root, *[None] * 21],
    )
    exact, packed = tumble.MotionLibrary([clip]), tumble.MotionLibrary([clip], packed=True)
    assert exact.nbytes <= 19 * 22 * frames and packed.nbytes <= 12 * 22 * frames
    times = rng.uniform(0, exact.lengths[0], 500)
    found, expected = packed.sample(0, times), exact.sample(0, times)
    assert not np.array_equal(found.rotations, expected.rotations)
    pairs = [Rotation.from_quat(state.rotations.reshape(-1, 4).astype(float)) for state in (found, expected)]
    assert (pairs[0].inv() * pairs[1]).magnitude().max() < 1e-5
    np.testing.assert_allclose(found.angular_velocities, expected.angular_velocities, atol=22 * 2e-5 * 120)
    packed.save(tmp_path / "packed.npz")
    again = tumble.MotionLibrary.open(tmp_path / "packed.npz")
    np.testing.assert_array_equal(again.sample(0, times).velocities, found.velocities)
    assert (tmp_path / "packed.npz").stat().st_size < 12 * 22 * frames


def test_offsets_are_those_of_the_selected_joints_or_of_all(tmp_path):
    body(tmp_path / "a_poses.npz", 13)
    path = tmp_path / "a_poses.npz"
    offsets = np.random.default_rng(8).normal(size=(52, 3))
    names = tumble.load(path).clip.names
    tracks = ["left_hip", "pelvis", "left_knee"]
    rows = [names.index(name) for name in tracks]
    by_file = tumble.MotionLibrary.load(path, tracks=tracks, offsets=offsets).sample(0, [0.0, 0.05])
    by_name = dict(zip(names, offsets.tolist()))
    for given in (offsets[rows], by_name, {name: by_name[name] for name in tracks}):
        found = tumble.MotionLibrary.load(path, tracks=tracks, offsets=given).sample(0, [0.0, 0.05])
        np.testing.assert_array_equal(found.positions, by_file.positions)
    turned = Rotation.from_quat(by_file.world_rotations[:, 1].astype(float)).apply(offsets[rows[0]])
    np.testing.assert_allclose(by_file.positions[:, 0], by_file.positions[:, 1] + turned, atol=1e-5)
    for given, words in [
        (offsets[:5], "offsets: .*a_poses.npz: 5 offsets for 3 of 52 joints"),
        ({"pelvis": [0, 0, 0], "left_hip": [0, 0, 0]}, "offsets: .*left_knee"),
        ({**by_name, "left_hop": [0, 0, 0]}, "there is no joint `left_hop`; .*did you mean `left_hip`"),
    ]:
        with pytest.raises(tumble.InputError, match=words):
            tumble.MotionLibrary.load(path, tracks=tracks, offsets=given)
    backwards = list(range(51, -1, -1))
    with pytest.raises(tumble.InputError, match="all 52 joints in another order than the file"):
        tumble.MotionLibrary.load(path, tracks=backwards, offsets=offsets)
    again = tumble.MotionLibrary.load(path, tracks=backwards, offsets=by_name).sample(0, [0.0, 0.05])
    whole = tumble.MotionLibrary.load(path, tracks=range(52), offsets=offsets).sample(0, [0.0, 0.05])
    np.testing.assert_allclose(again.positions[:, ::-1], whole.positions, atol=1e-6)


def test_joints_that_are_left_out_may_be_broken(tmp_path):
    poses, trans = body(tmp_path / "good.npz", 20)
    poses[7, 30] = np.nan
    broken = poses.reshape(20, -1)
    np.savez(tmp_path / "broken.npz", poses=broken, trans=trans, gender="neutral", mocap_framerate=120.0)
    tracks = ["pelvis", "left_hip", "left_knee"]
    with pytest.raises(tumble.InputError, match=r"poses.*\[7"):
        tumble.MotionLibrary.load(tmp_path / "broken.npz", offsets=np.ones((52, 3)))
    libraries = [
        tumble.MotionLibrary.load(tmp_path / name, tracks=chosen, offsets=np.ones((52, 3)), fps=60)
        for name in ("good.npz", "broken.npz")
        for chosen in (tracks, [0, 1, 4])
    ]
    states = [library.sample(0, [0.0, 0.06, 0.1]) for library in libraries]
    assert all(state == states[0] for state in states)
    trans[3, 1] = np.inf
    np.savez(tmp_path / "root.npz", poses=broken, trans=trans, gender="neutral", mocap_framerate=120.0)
    with pytest.raises(tumble.InputError, match="trans.*not finite"):
        tumble.MotionLibrary.load(tmp_path / "root.npz", tracks=tracks, offsets=np.ones((3, 3)))


def with_a_broken_number(path):
    """Puts NaN into a key of the last joint of a file of `wave`."""
    if path.suffix == ".glb":
        key = tumble.load(path).clip.keys(JOINTS - 1)[5].tobytes()
        path.write_bytes(path.read_bytes().replace(key, np.full(4, np.nan, np.float32).tobytes()))
    elif path.suffix == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = pq.read_table(path)
        index = table.schema.get_field_index("w")
        last = [name == f"joint{JOINTS - 1}" for name in table["track"].to_pylist()]
        numbers = np.where(last, np.nan, table["w"].to_numpy())
        pq.write_table(table.set_column(index, table.schema.field(index), pa.array(numbers, table["w"].type)), path)
    else:
        # The last number of a row is one of the last joint.
        separator = "," if path.suffix == ".csv" else " "
        path.write_text(path.read_text().rstrip().rsplit(separator, 1)[0] + f"{separator}nan\n")


@pytest.mark.parametrize("suffix", ["bvh", "glb", "csv", "parquet"])
def test_joints_that_are_left_out_may_be_broken_in_files_of_every_kind(suffix, tmp_path):
    good, broken = tmp_path / f"good.{suffix}", tmp_path / f"broken.{suffix}"
    for path in (good, broken):
        tumble.save(path, wave(12, 30), fps=30, method="slerp")
    with_a_broken_number(broken)
    tracks = [f"joint{joint}" for joint in (0, 1, 4, 3)]
    options = {"skeleton": wave(3, 30)} if suffix in ("csv", "parquet") else {}
    states = [tumble.MotionLibrary.load(path, tracks=tracks, **options).sample(0, [0.0, 0.2, 0.3]) for path in (good, broken)]
    assert states[0] == states[1]
    with pytest.raises(tumble.InputError, match="not finite|NaN"):
        tumble.MotionLibrary.load(broken, **options)
    with pytest.raises(tumble.InputError, match="not finite|NaN"):
        tumble.MotionLibrary.load(broken, tracks=range(JOINTS), **options)


def test_joints_that_collapse_leave_the_others_where_they_are(tmp_path):
    """Wrists without elbows, and so on: the same poses in the world at every frame."""
    path = tmp_path / "a.npz"
    poses, trans = body(path, 49)
    offsets = np.random.default_rng(9).normal(scale=0.3, size=(52, 3))
    file = tumble.load(path, offsets=offsets).clip
    tracks = ["left_knee", "pelvis", "left_wrist", "head"]
    rows = [file.names.index(name) for name in tracks]
    poses[7, 45] = np.nan  # a finger
    np.savez(path, poses=poses.reshape(49, -1), trans=trans, gender="neutral", mocap_framerate=120.0)
    for fps, times in [(30, np.arange(13) / 30), (None, np.arange(49) / 120)]:
        some = tumble.MotionLibrary.load(path, fps=fps, tracks=tracks, offsets=offsets, collapse=True)
        assert some.joint_names == tracks
        found = some.sample(0, times)
        expected = tumble.MotionLibrary([file]).sample(0, times)
        np.testing.assert_allclose(found.positions, expected.positions[:, rows], atol=2e-6)
        turned = [Rotation.from_quat(q.reshape(-1, 4)) for q in (found.world_rotations, expected.world_rotations[:, rows])]
        assert (turned[0].inv() * turned[1]).magnitude().max() < 2e-6
    clip = file.select(tracks, collapse=True)
    assert (clip.names, clip.parents) == (tracks, [1, None, 1, 1]) and clip.rate == 120
    positions = tumble.Engine("cpu").world(clip, at=file.times(0))[0]
    np.testing.assert_allclose(positions, tumble.Engine("cpu").world(file, at=file.times(0))[0][rows], atol=2e-6)
    # The knee hangs at the hip, which turns; the pelvis is as before.
    assert clip.translations("left_knee") is not None
    np.testing.assert_array_equal(clip.keys("pelvis"), file.keys("pelvis"))
    assert file.select(["pelvis", "left_hip"], collapse=True) == file.select(["pelvis", "left_hip"])
    # Without the pelvis, joints are in the world.
    alone = file.select(["left_wrist", "head"], collapse=True)
    assert alone.parents == [None, None]
    np.testing.assert_allclose(alone.translations(1)[1], positions[3], atol=2e-6)
    by_name = dict(zip(file.names, offsets.tolist()))
    named = tumble.MotionLibrary.load(path, fps=30, tracks=tracks, offsets=by_name, collapse=True)
    np.testing.assert_allclose(named.sample(0, 0.1).positions, expected.positions[12, rows], atol=2e-6)
    unplaced = tumble.MotionLibrary.load(path, fps=30, tracks=tracks, collapse=True)
    turns = unplaced.sample(0, 0.1, arrays=["world_rotations"]).world_rotations
    np.testing.assert_allclose(np.abs((turns * expected.world_rotations[12, rows]).sum(-1)), 1, atol=1e-6)
    for wrong, words in [
        ({"offsets": offsets[:4], "tracks": tracks}, "4 offsets for 52 joints; with `collapse` give one for each joint of the file"),
        ({}, "collapse: without `tracks` no joint is left out"),
    ]:
        with pytest.raises(tumble.InputError, match=words):
            tumble.MotionLibrary.load(path, collapse=True, **wrong)


def test_a_shard_is_the_same_however_it_is_made(tmp_path):
    """The files of a process, and no others, in the order of joints of all."""
    counts = [20, 30, 40, 50, 60]
    for index, count in enumerate(counts):
        tumble.save(tmp_path / f"{index}.npz", wave(count, 30), fps=30, method="slerp")
    (tmp_path / "1.npz").write_bytes(b"PK nothing")
    # Its joints have another order.
    first = wave(20, 30)
    order = [4, 0, 1, 2, 3, 5, 6]
    shuffled = tumble.Clip(
        first.times(0),
        np.stack([first.keys(joint) for joint in order]),
        layout="track",
        names=[first.names[joint] for joint in order],
        parents=[None if PARENTS[joint] is None else order.index(PARENTS[joint]) for joint in order],
        offsets=OFFSETS[order],
    )
    tumble.save(tmp_path / "0.npz", shuffled, fps=30, method="slerp")
    pattern = str(tmp_path / "*.npz")
    whole = tumble.MotionLibrary.load(pattern, on_error="skip")
    assert [path.rsplit("/")[-1] for path in whole.paths] == ["0.npz", "2.npz", "3.npz", "4.npz"]
    whole.save(tmp_path / "whole.motions")
    opened = tumble.MotionLibrary.open(tmp_path / "whole.motions")
    for rank, names in [(0, ["0", "2", "4"]), (1, ["3"])]:
        parts = [
            whole.shard(rank, 2),
            tumble.MotionLibrary.load(pattern, on_error="skip", shard=(rank, 2)),
            opened.shard(rank, 2),
            pickle.loads(pickle.dumps(opened)).shard(rank, 2),
            pickle.loads(pickle.dumps(opened.shard(rank, 2))),
            pickle.loads(pickle.dumps(whole.shard(rank, 2))),
        ]
        parts[0].save(tmp_path / "part.motions")
        parts.append(tumble.MotionLibrary.open(tmp_path / "part.motions"))
        ids, times = np.arange(len(names)), np.linspace(0.1, 0.6, len(names))
        for part in parts:
            assert part.names == names and part.joint_names == whole.joint_names
            assert [path.rsplit("/")[-1] for path in part.paths] == [f"{name}.npz" for name in names]
            assert part.sample(ids, times) == parts[0].sample(ids, times)
            if rank == 0:
                assert part.shard(0, 2).names == ["0", "4"] and part.shard(1, 2).names == ["2"]
        skipped = [[one.path.rsplit("/")[-1] for one in part.skipped] for part in parts[:2]]
        assert skipped == [["1.npz"] if rank == 1 else []] * 2
    for made in (lambda: whole.shard(8, 9), lambda: tumble.MotionLibrary.load(pattern, shard=(8, 9))):
        with pytest.raises(tumble.InputError, match="shard: none of the"):
            made()


def test_a_shard_is_written_without_the_other_clips(tmp_path):
    library = tumble.MotionLibrary([wave(count, 30) for count in (500, 20, 600)], names=list("abc"))
    part = library.shard(1, 3)
    for packed in (False, True):
        whole = tumble.MotionLibrary([wave(count, 30) for count in (500, 20, 600)], packed=packed)
        small = whole.shard(1, 3)
        small.save(tmp_path / "small.npz")
        whole.save(tmp_path / "whole.npz")
        assert (tmp_path / "small.npz").stat().st_size < (tmp_path / "whole.npz").stat().st_size / 4
        assert len(pickle.dumps(small)) < len(pickle.dumps(whole)) / 4
        again = tumble.MotionLibrary.open(tmp_path / "small.npz")
        assert again.sample(0, [0.1, 0.4]) == whole.sample(1, [0.1, 0.4])
        assert again.nbytes < whole.nbytes / 10
    unplaced = tumble.Clip(np.arange(3) / 30, np.tile([0, 0, 0, 1.0], (2, 3, 1)), layout="track", parents=[None, 0])
    mixed = tumble.MotionLibrary([unplaced, tumble.Clip([0.0, 1.0], np.tile([0, 0, 0, 1.0], (2, 2, 1)), layout="track", parents=[None, 0], offsets=[[0, 0, 0], [1, 0, 0]])])
    placed = pickle.loads(pickle.dumps(mixed.shard(1, 2)))
    assert placed.sample(0, 0.5).positions[1].tolist() == [1, 0, 0]
    with pytest.raises(tumble.InputError, match="offsets"):
        pickle.loads(pickle.dumps(mixed.shard(0, 2))).sample(0, 0.5)
    assert part.names == ["b"]


def test_numbers_of_another_meaning_are_refused():
    library = tumble.MotionLibrary([wave(31, 30), wave(91, 30)], names=["short", "long"])
    rng = np.random.default_rng(3)
    uneven = tumble.MotionLibrary([tumble.Clip([0.0, 0.1, 0.7], np.tile([0, 0, 0, 1.0], (1, 3, 1)), parents=[None])], names=["uneven"])
    mask = np.array([True, False])
    for call, error, words in [
        (lambda: library.sample(mask, 0.0), ValueError, "clip_ids: a mask .* np.flatnonzero"),
        (lambda: library.sample_times(mask, rng), ValueError, "clip_ids: a mask"),
        (lambda: library.sample_times([0.5], rng), ValueError, "clip_ids: their type is float64, such as .*0.5"),
        (lambda: library.sample_windows(mask, 0.0, 3, 30), ValueError, "clip_ids: a mask"),
        (lambda: library.sample(np.array([2**63], np.uint64), 0.0), ValueError, "there is no clip 9223372036854775808"),
        (lambda: library.sample(0, np.array([1], "timedelta64[s]")), TypeError, "times: .* give seconds, as numbers, such as durations"),
        (lambda: library.sample(0, np.datetime64("2020-01-01")), TypeError, "times: their type is datetime64"),
        (lambda: library.sample(0, mask), TypeError, "times: their type is bool"),
        (lambda: library.sample(0, ["0.5"]), TypeError, "times: their type is <U3, such as .*0.5"),
        (lambda: library.sample(0, None), TypeError, "times: their type is object, such as None"),
        (lambda: library.sample(0, [1j]), TypeError, "times: their type is complex128"),
        (lambda: library.sample_windows(0, mask, 3, 30), TypeError, "starts: their type is bool"),
        (lambda: library.sample_windows(0, 0.0, 2.5, 30), TypeError, "count: 2.5; give a number of states"),
        (lambda: library.sample_windows(0, 0.0, True, 30), TypeError, "count: True"),
        (lambda: library.sample_windows(0, 0.0, -1, 30), ValueError, "count: -1"),
        (lambda: library.sample_windows(0, 0.0, 3, "30"), TypeError, "fps: '30'; give frames a second"),
        (lambda: library.sample_windows(0, 0.0, 3, np.inf), ValueError, "fps: inf is not finite"),
        (lambda: library.draw(2.5, rng), TypeError, "count: 2.5; give a number of clips"),
        (lambda: library.draw(2, rng, window=np.timedelta64(1, "s")), TypeError, "window: "),
        (lambda: library.draw(2, rng, weights="ab"), TypeError, "weights: their type is <U2"),
        (lambda: library.draw(2, 5), TypeError, "rng: it is of the type int; give a generator"),
        (lambda: library.shard(True, 2), TypeError, "shard: True"),
        (lambda: library.shard(0.5, 2), TypeError, "shard: 0.5"),
        (lambda: tumble.MotionLibrary.load("x.npz", shard=2), TypeError, r"shard: 2; give \(rank, processes\)"),
        (lambda: library.sample(0, 0.0, arrays="rotations"), TypeError, r'give a list, such as \["rotations"\]'),
        (lambda: library.sample(0, 0.0, out=np.zeros(3)), TypeError, "out: it is of the type ndarray; give a MotionState"),
        (lambda: uneven.sample(0, 0.0, finite=True), ValueError, r"finite: clip 0 \(uneven\) has no rate"),
        (lambda: tumble.MotionLibrary([wave(3, 30)], device="auto"), ValueError, 'device: with "auto"'),
        (lambda: tumble.MotionLibrary([wave(3, 30)], device=True), TypeError, "device: True"),
        (lambda: tumble.MotionLibrary([wave(3, 30)], device=1.0), TypeError, "device: 1.0"),
        (lambda: tumble.Engine("cpu", memory=2.5), TypeError, "memory: 2.5: give bytes"),
        (lambda: tumble.Engine("cpu", memory=-1), ValueError, "memory: -1"),
        (lambda: tumble.Engine("cpu", threads=True), TypeError, "threads: True"),
    ]:
        with pytest.raises(error, match=words):
            call()
    from fractions import Fraction

    found = library.sample([0], [Fraction(1, 2)])
    assert found == library.sample(np.array([0], np.uint8), np.float32(0.5)[None])
    assert library.sample_windows(0, 0.0, np.int64(3), Fraction(30)) == library.sample_windows([0][0], 0, 3, 30)


def arm(frames, rate, names=("shoulder", "elbow", "wrist", "grip"), seed=0, start=0.0):
    """A robot whose gripper has other key times than its joints."""
    rng = np.random.default_rng(seed)
    times = start + np.arange(frames) / rate
    scalars = {name: (times, np.cumsum(0.1 * rng.normal(size=frames))) for name in names}
    scalars[names[-1]] = (times[::3], rng.normal(size=len(times[::3])))
    keys = np.stack([smooth(rng, frames)])
    return tumble.Clip(times, keys, parents=[None], layout="track", offsets=[[0, 0, 0]], scalars=scalars)


def test_scalars_are_columns_of_a_library(tmp_path, rng):
    clips = [arm(31, 30), arm(91, 30, seed=1, start=2.0)]
    for method in ("slerp", "bessel-overhauser"):
        library = tumble.MotionLibrary(clips, method=method)
        assert library.dof_names == ["shoulder", "elbow", "wrist", "grip"] and library.contact_names == []
        ids = rng.integers(0, 2, (3, 5))
        times = rng.uniform(-0.1, 1.1, (3, 5)) * library.lengths[ids]
        state = library.sample(ids, times)
        assert state.dofs.shape == (3, 5, 4) and state.contacts is None
        for at in np.ndindex(3, 5):
            clip = clips[ids[at]]
            first, last = clip.span
            time = np.clip(first + times[at], first, last)
            expected = tumble.Engine("cpu").scalars(clip, at=[time], method=method)
            np.testing.assert_allclose(state.dofs[at], expected[:, 0], atol=2e-6)
        step = 1e-3
        inside = library.sample_windows([0, 1], [0.404, 0.411], 3, 1 / step, arrays=["dofs", "dof_velocities"])
        rate = (inside.dofs[:, 2] - inside.dofs[:, 0]) / (2 * step)
        np.testing.assert_allclose(inside.dof_velocities[:, 1], rate, atol=0.01)
        only = library.sample(ids, times, arrays=["dofs"])
        assert only.rotations is None and np.array_equal(only.dofs, state.dofs)
        memory = only.dofs
        assert library.sample(ids, times + 0.1, out=only).dofs is memory
        assert not np.array_equal(memory, state.dofs)
        library.save(tmp_path / "arm.npz")
        opened = tumble.MotionLibrary.open(tmp_path / "arm.npz")
        assert opened.dof_names == library.dof_names and opened.sample(ids, times) == state
        for part in (library.shard(1, 2), opened.shard(1, 2), pickle.loads(pickle.dumps(library.shard(1, 2)))):
            assert part.sample(0, [0.5, 2.1]) == library.sample(1, [0.5, 2.1])
    finite = tumble.MotionLibrary(clips).sample(0, 0.51, finite=True)
    frames = tumble.MotionLibrary(clips).sample(0, np.array([15, 16]) / 30)
    np.testing.assert_allclose(finite.dof_velocities, 30 * (frames.dofs[1] - frames.dofs[0]), atol=1e-4)


def test_contacts_of_files_are_steps(tmp_path):
    rows = ["time,qx,qy,qz,qw,knee.scalar_angle,foot.scalar_contact"]
    rows += [f"{0.1 * frame},0,0,0,1,{0.2 * frame},{frame % 2}" for frame in range(6)]
    (tmp_path / "walk.csv").write_text("\n".join(rows) + "\n")
    library = tumble.MotionLibrary.load(tmp_path / "walk.csv", skeleton=([None], [[0, 0, 0]]))
    assert (library.dof_names, library.contact_names) == (["knee"], ["foot"])
    state = library.sample(0, [0.05, 0.1, 0.19, 0.2, 0.5])
    assert state.contacts[:, 0].tolist() == [0, 1, 1, 0, 1]
    np.testing.assert_allclose(state.dofs[:, 0], [0.1, 0.2, 0.38, 0.4, 1.0], atol=1e-6)


def test_scalars_that_only_some_clips_have_are_no_columns():
    other = arm(20, 30, names=("shoulder", "elbow", "ankle", "grip"))
    library = tumble.MotionLibrary([arm(31, 30), other])
    assert library.dof_names == [] and library.sample(0, 0.5).dofs is None
    with pytest.raises(tumble.InputError, match=r"the library has no dofs: clips\[1\] has no scalar `wrist`"):
        library.sample(0, 0.5, arrays=["dofs"])
    with pytest.raises(tumble.InputError, match="the library has no contacts$"):
        library.sample(0, 0.5, out=tumble.MotionState(contacts=np.zeros((1,), np.float32)))
    # By name, in the order of the first clip.
    shuffled = arm(20, 30, names=("elbow", "wrist", "shoulder", "grip"), seed=3)
    both = tumble.MotionLibrary([arm(31, 30), shuffled]).sample(1, 0.5)
    alone = tumble.MotionLibrary([shuffled]).sample(0, 0.5)
    np.testing.assert_array_equal(both.dofs, alone.dofs[[2, 0, 1, 3]])


def test_the_table_of_loaders_is_what_the_script_prints():
    done = subprocess.run(
        [sys.executable, str(ROOT / "python/examples/loaders.py")], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    page = (ROOT / "docs/loaders.md").read_text(encoding="utf-8")
    table = page.split("<!-- python/examples/loaders.py -->\n")[1].split("<!-- end -->")[0]
    assert table == done.stdout
