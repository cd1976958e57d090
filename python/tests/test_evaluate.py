"""Results of evaluating, their shapes, and the memory that they lie in."""

from __future__ import annotations

import copy
import pickle
import warnings
from pathlib import Path

import numpy as np
import pytest
from conftest import unit
from scipy.spatial.transform import Rotation

import tumble

TIMES = np.array([0.0, 0.5, 1.25, 2.0])


@pytest.fixture
def clip(rng):
    return tumble.Clip(TIMES, unit(rng, 3, 4), names=["a", "b", "c"])


@pytest.fixture
def engine():
    return tumble.Engine("cpu")


def test_arrays_in_arrays_out(rng):
    keys = unit(rng, 3, 4)
    found = tumble.evaluate(TIMES, keys, fps=60, method="slerp")
    assert (found.shape, found.dtype) == ((3, 121, 4), np.float32)
    assert found.flags.c_contiguous and found.flags.writeable
    one = tumble.evaluate(TIMES, keys[1], fps=60, method="slerp")
    assert np.array_equal(one, found[1])
    assert np.array_equal(found[:, [0, 30, 75, 120]], keys), "keys are met bit for bit"


def test_times_may_be_of_any_type_and_shape(rng):
    keys = unit(rng, 3, 4)
    expected = tumble.evaluate(TIMES, keys, at=[0.25, 1.0])
    for times in [list(TIMES), TIMES.astype(np.float32), np.stack([TIMES] * 3), [TIMES] * 3]:
        assert np.array_equal(tumble.evaluate(times, keys, at=(0.25, 1.0)), expected)
    whole = tumble.evaluate([0, 1, 2, 3], keys, at=[1])
    assert np.array_equal(whole[:, 0], keys[:, 1])


def test_a_single_time_has_no_axis(clip, rng):
    at = clip.evaluate(at=0.7)
    assert at.shape == (3, 4)
    assert np.array_equal(at, clip.evaluate(at=[0.7])[:, 0])
    assert np.array_equal(at, clip.evaluate(at=np.float64(0.7)))
    assert np.array_equal(at, clip.evaluate(at=np.array(0.7)))
    assert tumble.evaluate(TIMES, unit(rng, 4), at=0.7).shape == (4,)


def test_a_time_list_for_each_track(clip, rng):
    at = rng.uniform(-0.5, 2.5, (3, 50))
    found = clip.evaluate(at=at, method="c2")
    assert found.shape == (3, 50, 4)
    for track in range(3):
        assert np.array_equal(found[track], clip.evaluate(at=at[track], method="c2")[track])
    lists = [at[0], at[1][:7], np.array([])]
    ragged = clip.evaluate(times=lists, method="c2")
    assert [part.shape for part in ragged] == [(50, 4), (7, 4), (0, 4)]
    assert np.array_equal(ragged[1], found[1][:7])
    assert np.shares_memory(ragged[0].base, ragged[1].base)


def test_a_sampler_has_the_bits_of_evaluate(clip, rng):
    at = np.concatenate([rng.uniform(-3, 5, 60), TIMES, np.linspace(0, 2, 40)])
    for method, after in [("slerp", "hold"), ("c2", "loop"), ("squad", "extrapolate")]:
        expected = clip.evaluate(at=at, method=method, after=after, layout="frame")
        sampler = clip.sampler(method=method, after=after)
        other = copy.copy(sampler)
        out = np.empty((3, 4), np.float32)
        for time, pose in zip(at, expected):
            assert sampler.pose(time, out=out) is out
            assert np.array_equal(out, pose)
            assert np.array_equal(other.sample("b", time), pose[1])
            swapped = other.pose(time, tracks=["c", 0], order="wxyz")
            assert np.array_equal(swapped, pose[[2, 0]][:, [3, 0, 1, 2]])
    assert (len(sampler), repr(sampler)) == (3, "Sampler(3 tracks)")


def test_a_sampler_refuses_what_it_cannot_do(clip):
    sampler = clip.sampler()
    for call, words in [
        (lambda: clip.sampler(fps=60), "its times later"),
        (lambda: clip.sampler(before="leave-out"), "leaves none out"),
        (lambda: sampler.pose(np.nan), "not finite"),
        (lambda: sampler.pose(0, out=np.empty((2, 4), np.float32)), r"the result's is \(3, 4\)"),
        (lambda: sampler.sample(3, 0), "there is no track 3"),
        (lambda: sampler.pose(0, tracks=["d"]), "there is no track `d`"),
        (lambda: sampler.sample(0, "now"), "give seconds"),
    ]:
        with pytest.raises((ValueError, LookupError, TypeError), match=words):
            call()


def test_a_sampler_takes_times_of_the_files_clock(rng):
    clip = tumble.Clip(1.7e9 + TIMES, unit(rng, 3, 4))
    sampler = clip.sampler(method="slerp")
    assert np.array_equal(sampler.pose(1.7e9 + 0.25), clip.evaluate(at=0.25, method="slerp"))
    assert np.array_equal(sampler.pose(0.25), sampler.pose(1.7e9 + 0.25))


def test_tracks_of_different_lengths(rng):
    keys = [unit(rng, 4), unit(rng, 2), unit(rng, 1)]
    times = [TIMES, TIMES[1:3], [0.1]]
    clip = tumble.Clip(times, keys)
    assert (len(clip), clip.key_count, clip.span) == (3, 7, (0.0, 2.0))
    found = clip.evaluate(fps=10)
    assert found.shape == (3, 21, 4)
    assert np.array_equal(found[2], np.broadcast_to(keys[2], (21, 4)))
    alone = tumble.evaluate(TIMES[1:3], keys[1], fps=10, start=0, end=2)
    assert np.array_equal(found[1], alone)


def test_orders_and_layouts(clip, rng):
    keys = unit(rng, 3, 4)
    xyzw = tumble.evaluate(TIMES, keys, fps=30)
    wxyz = tumble.evaluate(TIMES, np.roll(keys, 1, axis=-1), fps=30, order="wxyz")
    assert np.array_equal(np.roll(wxyz, -1, axis=-1), xyzw)
    frames = tumble.evaluate(TIMES, keys, fps=30, layout="frame")
    assert frames.flags.c_contiguous
    assert np.array_equal(frames.swapaxes(0, 1), xyzw)
    assert np.array_equal(clip.keys("b", order="wxyz"), np.roll(clip.keys(1), 1, axis=-1))


def test_results_go_where_they_are_told(clip, engine):
    expected = clip.evaluate(fps=60)
    out = np.empty_like(expected)
    assert engine.evaluate(clip, fps=60, out=out) is out
    assert np.array_equal(out, expected)
    # A part of a larger array, which is only aligned to 4 bytes.
    store = np.zeros(expected.size + 1, np.float32)
    part = store[1:].reshape(expected.shape)
    assert clip.evaluate(fps=60, out=part) is part and np.shares_memory(part, store)
    assert np.array_equal(part, expected) and store[0] == 0
    frames = np.empty((121, 3, 4), np.float32)
    clip.evaluate(fps=60, out=frames, layout="frame")
    assert np.array_equal(frames.swapaxes(0, 1), expected)
    velocities = np.empty((3, 121, 3), np.float32)
    assert engine.velocity(clip, fps=60, out=velocities) is velocities
    assert np.array_equal(velocities, engine.velocity(clip, fps=60))


def test_what_follows_from_rotations(clip, engine):
    found = clip.evaluate(fps=60).astype(np.float64).reshape(-1, 4)
    rotations = Rotation.from_quat(found)
    matrices = engine.matrices(clip, fps=60)
    assert matrices.shape == (3, 121, 3, 3)
    assert np.abs(matrices.reshape(-1, 3, 3) - rotations.as_matrix()).max() < 1e-6
    for sequence in ["XYZ", "zxy", "ZXZ"]:
        angles = engine.euler(clip, fps=60, sequence=sequence).reshape(-1, 3)
        again = Rotation.from_euler(sequence, angles, degrees=True)
        assert (rotations.inv() * again).magnitude().max() < 2e-6
        radians = engine.euler(clip, fps=60, sequence=sequence, degrees=False)
        assert np.allclose(np.degrees(radians).reshape(-1, 3), angles, atol=1e-4)
    step = 1e-4
    at = np.array([0.2, 0.9, 1.7])
    before, after = (clip.evaluate(at=at + s, method="c2").astype(np.float64) for s in (-step, step))
    difference = Rotation.from_quat(before.reshape(-1, 4)).inv() * Rotation.from_quat(after.reshape(-1, 4))
    body = engine.velocity(clip, at=at, method="c2").reshape(-1, 3)
    assert np.abs(difference.as_rotvec() / (2 * step) - body).max() < 5e-3
    here = Rotation.from_quat(clip.evaluate(at=at, method="c2").reshape(-1, 4))
    world = engine.velocity(clip, at=at, method="c2", axes="world").reshape(-1, 3)
    assert np.abs(here.apply(body) - world).max() < 1e-4
    acceleration = engine.acceleration(clip, at=at, method="c2").reshape(-1, 3)
    faster, slower = (
        engine.velocity(clip, at=at + s, method="c2").reshape(-1, 3) for s in (step, -step)
    )
    assert np.abs((faster - slower) / (2 * step) - acceleration).max() < 0.2


def test_poses_and_places_in_the_world(engine):
    half = np.float32(np.sqrt(0.5))
    keys = [[[0, 0, 0, 1], [0, 0, half, half]], [[0, 0, 0, 1], [0, 0, 0, 1]]]
    clip = tumble.Clip(
        [0.0, 1.0],
        keys,
        names=["hip", "knee"],
        parents=[None, 0],
        offsets=[[0, 0, 0], [2, 0, 0]],
        translations=[[[0, 0, 1], [0, 0, 3]], None],
    )
    assert clip.parents == [None, 0] and clip.offsets.tolist() == [[0, 0, 0], [2, 0, 0]]
    translations, rotations, scales = engine.poses(clip, fps=2, method="slerp")
    assert (translations.shape, rotations.shape, scales.shape) == ((2, 3, 3), (2, 3, 4), (2, 3, 3))
    assert translations[0].tolist() == [[0, 0, 1], [0, 0, 2], [0, 0, 3]]
    assert np.array_equal(rotations, clip.evaluate(fps=2, method="slerp"))
    assert (scales == 1).all()
    positions, world_rotations = engine.world(clip, fps=2, method="slerp")
    assert np.allclose(positions[1, -1], [0, 2, 3], atol=1e-6)
    assert np.allclose(world_rotations[1, -1], [0, 0, half, half], atol=1e-6)
    frames, _, _ = engine.poses(clip, fps=2, layout="frame", method="slerp")
    assert np.array_equal(frames.swapaxes(0, 1), translations)


def test_rotations_of_scipys_in_and_out(rng):
    keys = Rotation.random(8, rng=rng)
    expected = tumble.evaluate(np.arange(8), keys.as_quat(), fps=10)
    assert np.array_equal(tumble.evaluate(np.arange(8), keys, fps=10), expected)
    # SciPy's rotations are x y z w, whatever `order` says about arrays.
    assert np.array_equal(
        np.roll(tumble.evaluate(np.arange(8), keys, fps=10, order="wxyz"), -1, axis=-1), expected
    )
    found = tumble.evaluate(np.arange(8), keys, fps=10, as_rotation=True)
    assert isinstance(found, Rotation) and len(found) == 71
    several = tumble.evaluate(np.arange(8), [keys, keys.inv()], fps=10, as_rotation=True)
    assert [len(one) for one in several] == [71, 71]
    assert (several[0].inv() * found).magnitude().max() == 0


def test_data_beside_the_keys(rng):
    keys = unit(rng, 1, 3)
    still = tumble.Clip([0, 1, 2], keys, velocities=np.zeros((1, 3, 3)))
    engine = tumble.Engine("cpu")
    assert np.abs(engine.velocity(still, at=[0, 1, 2], method="hermite")).max() < 1e-4
    tight = tumble.Clip([0, 1, 2], keys, tcb=[[[1, 0, 0]] * 3])
    asked = tumble.Clip([0, 1, 2], keys).evaluate(fps=9, method="kochanek-bartels", tension=1)
    assert np.array_equal(tight.evaluate(fps=9, method="kochanek-bartels"), asked)
    flat = tumble.Clip([0, 1, 2], keys, tangents=np.zeros((1, 3, 2, 4)))
    assert flat.evaluate(fps=9, method="gltf-cubic").shape == (1, 19, 4)


def test_options_say_how(clip, engine):
    plain = clip.evaluate(fps=30, start=-1, end=4)
    for options in [
        {"method": "c2"},
        {"ends": "natural"},
        {"ends": [[1, 0, 0], [0, 2, 0]]},
        {"speed": "constant"},
        {"before": "extrapolate"},
        {"after": "mirror"},
    ]:
        other = clip.evaluate(fps=30, start=-1, end=4, **options)
        assert other.shape == plain.shape and not np.array_equal(other, plain), options
    loop = clip.evaluate(fps=30, start=0, end=4, after="loop")
    assert np.array_equal(loop[:, 0], loop[:, 60])


def test_streams_are_the_whole(clip, engine):
    for layout in ["track", "frame"]:
        whole = clip.evaluate(fps=1000, layout=layout)
        for chunk in [100, 2500, 1 << 20]:
            found = np.full_like(whole, np.nan)
            for part in engine.stream(clip, fps=1000, chunk=chunk, layout=layout):
                part_index = (part.tracks, part.frames)
                assert part.rotations.size // 4 <= chunk
                found[part_index if layout == "track" else part_index[::-1]] = part.rotations
            assert np.array_equal(found, whole)
    first = next(iter(engine.stream(clip, fps=1000, order="wxyz")))
    assert np.array_equal(np.roll(first.rotations, -1, axis=-1), clip.evaluate(fps=1000))


def test_streams_of_mixed_samplers_are_the_whole(tmp_path, engine):
    made = Path(__file__).parents[3] / "shared" / "data" / "gltf" / "interpolation_test.gltf"
    if not made.exists():
        pytest.skip(f"{made} is not there")
    for clip in tumble.load(made).clips:
        for layout in ["track", "frame"]:
            whole = clip.evaluate(fps=240, layout=layout)
            for chunk in [7, 300, 1 << 20]:
                found = np.full_like(whole, np.nan)
                for part in engine.stream(clip, fps=240, chunk=chunk, layout=layout):
                    part_index = (part.tracks, part.frames)
                    found[part_index if layout == "track" else part_index[::-1]] = part.rotations
                assert np.array_equal(found, whole)


def test_verification(clip, engine):
    found = engine.verify(clip, fps=25, method="c2")
    assert (found.verdict, found.passes) == ("reference-only", False)  # no device took part
    assert found.differing == 0 and found.rotations == 3 * 51
    assert engine.verify(clip, at=[], method="c2").verdict == "nothing"
    assert (found.method, found.device) == ("c2", None)
    assert 0 < found.rms_error <= found.max_error <= found.error_bound == 1e-6


def test_all_devices_have_the_same_bits(clip):
    expected = tumble.Engine("cpu").evaluate(clip, fps=240)
    for index, name in enumerate(tumble.devices()):
        engine = tumble.Engine(index)
        assert engine.device == name
        assert np.array_equal(engine.evaluate(clip, fps=240), expected)
        found = engine.verify(clip, fps=24)
        assert found.passes and found.verdict == "passed" and found.device == name


def test_every_method_is_there(clip):
    assert {"step", "slerp", "bessel-overhauser", "c2"} <= set(tumble.methods())
    for method in tumble.methods():
        assert np.isfinite(clip.evaluate(fps=30, method=method)).all()


def test_representations_help(clip):
    assert repr(clip) == "Clip(3 tracks, 12 keys, 0 to 2 s)"
    assert repr(tumble.Engine()) == "Engine('auto': CPU)"
    assert repr(tumble.Engine("cpu")) == "Engine('CPU')"


def skeletal(rng):
    keys = unit(rng, 4, 9)
    return tumble.Clip(np.arange(9.0), keys, parents=[2, 0, None, 1], offsets=np.ones((4, 3)))


@pytest.mark.parametrize("layout", ["track", "frame"])
def test_rates_in_the_world_are_those_of_the_world(layout, rng):
    clip, engine, step = skeletal(rng), tumble.Engine("cpu"), 1e-3
    at = np.arange(8) + 0.3
    how = dict(method="squad", layout=layout)

    def world(times):
        rotations = engine.world(clip, at=times, **how)[1].astype(float)
        return Rotation.from_quat(rotations.reshape(-1, 4))

    found = engine.velocity(clip, at=at, axes="world", **how)
    expected = (world(at + step) * world(at - step).inv()).as_rotvec() / (2 * step)
    assert np.abs(found.reshape(-1, 3) - expected).max() < 5e-3 * (1 + np.abs(expected).max())
    assert np.abs(found - engine.velocity(clip, at=at, axes="parent", **how)).max() > 0.1
    out = np.empty_like(found)
    assert engine.velocity(clip, at=at, axes="world", out=out, **how) is out
    assert np.array_equal(out, found)

    for times in ([at, at, at, at + 0.1], [at, at[:3], at, at[:0]]):
        with pytest.raises(tumble.InputError, match="same times"):
            engine.velocity(clip, times=times, axes="world", method="squad")

    found = engine.acceleration(clip, at=at, axes="world", **how)
    before, after = (engine.velocity(clip, at=at + by, axes="world", **how) for by in (-step, step))
    rate = (after.astype(float) - before) / (2 * step)
    assert np.abs(found - rate).max() < 1e-2 * (1 + np.abs(rate).max())


def test_keys_without_a_smooth_curve_are_told_once():
    keys = [Rotation.identity()]
    for axis in "xyzxy":
        keys.append(keys[-1] * Rotation.from_euler(axis, 1.0))
    keys = np.array([key.as_quat() for key in keys], np.float32)
    clip = tumble.Clip([0.0, 1.0, 2.0, 2.00001, 3.0, 4.0], keys, name="jerk")
    words = r'jerk:track 1: warning.W014.*at key 2, at 1 s.*use method="bessel-overhauser"'
    with pytest.warns(tumble.InputWarning, match=words) as warned:
        clip.evaluate(fps=10, method="c2")
    assert warned[0].message.code == "W014"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        clip.evaluate(fps=20, method="c2")
        clip.evaluate(fps=20, method="slerp")
    with pytest.warns(tumble.InputWarning, match="W014"):
        clip.evaluate(fps=10, method="c2", ends="natural")


def test_an_engine_keeps_files_where_it_is_told(tmp_path, monkeypatch):
    has_devices = bool(tumble.devices())  # what drivers say is remembered where the user's files are
    user, given = tmp_path / "user", tmp_path / "given"
    monkeypatch.setenv("TUMBLE_CACHE_DIR", str(user))
    for engine in (tumble.Engine("cpu", cache="off"), pickle.loads(pickle.dumps(tumble.Engine("cpu", cache=given)))):
        assert engine.device == "CPU"
    if not has_devices:
        return
    tumble.Engine(0, cache="off").warm(method="slerp")
    assert not user.exists() and not given.exists()
    tumble.Engine(0, cache=given).warm(method="slerp")
    assert not user.exists() and any(given.iterdir())


def test_times_outside_the_keys_are_left_out(clip, engine, tmp_path):
    both = dict(before="leave-out", after="leave-out")
    for options, times in [
        (dict(fps=4, start=-1, end=3, **both), np.arange(9) / 4),
        (dict(fps=4, start=-0.5, end=3, after="leave-out"), np.arange(-2, 9) / 4),
        (dict(fps=4, start=-0.25, end=2.25, before="leave-out", after="loop"), np.arange(10) / 4),
        (dict(at=[-0.1, 1.1, 2.0, 3.0], **both), [1.1, 2.0]),
        (dict(fps=4, **both), np.arange(9) / 4),
    ]:
        kept = dict(at=times, after=options["after"].replace("leave-out", "hold"))
        assert np.array_equal(engine.evaluate(clip, **options), engine.evaluate(clip, **kept)), options
        assert np.array_equal(engine.velocity(clip, **options), engine.velocity(clip, **kept))
        for found, expected in zip(engine.poses(clip, **options), engine.poses(clip, **kept)):
            assert np.array_equal(found, expected)
        for layout in ["track", "frame"]:
            chunks = [chunk.rotations for chunk in engine.stream(clip, layout=layout, **options)]
            assert np.array_equal(np.concatenate(chunks), engine.evaluate(clip, layout=layout, **kept))
        assert engine.verify(clip, **options).rotations == 3 * len(times)
        tumble.save(tmp_path / "kept.csv", clip, method="slerp", **options)
        assert tumble.load(tmp_path / "kept.csv").clip.times(0).tolist() == pytest.approx(times)
    assert engine.evaluate(clip, at=1.0, **both).shape == (3, 4)
    for at in [2.5, [-1.0, 2.5]]:
        words = "none of the requested times, .* to 2.5 s, lies between its keys, 0 to 2 s"
        with pytest.raises(tumble.InputError, match=words):
            engine.evaluate(clip, at=at, **both)
    for at in [[[0.0]] * 3, [[0.0, 1.0], [0.0], [0.0]]]:
        with pytest.raises(tumble.InputError, match='after="leave-out": .* give one list of times for all tracks'):
            engine.evaluate(clip, at=at, after="leave-out")
    with pytest.raises(tumble.InputError, match="before: there is no `leave`; there are hold, .*, leave-out"):
        engine.evaluate(clip, fps=4, before="leave")
    # The times of a clip with a clock stay on this clock, and the sample at the end of the clip is its last key.
    late = tumble.Clip(1e9 + TIMES + 0.125, clip.keys(0))
    found = engine.evaluate(late, fps=4, start=1e9, end=1e9 + 3, **both)
    assert np.array_equal(found, engine.evaluate(late, at=1e9 + np.arange(1, 9) / 4))
    tumble.save(tmp_path / "late.csv", late, fps=4, start=1e9, end=1e9 + 3, method="slerp", **both)
    kept = tumble.load(tmp_path / "late.csv").clip
    assert kept.span[1] + kept.time_offset == 1e9 + 2.125
