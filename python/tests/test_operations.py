"""Operations on samples and clips other than evaluating them, compared with NumPy, SciPy and the program."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys

import numpy as np
import pytest
from conftest import unit
from scipy.spatial.transform import Rotation, Slerp

import tumble

TIMES = np.array([0.0, 0.5, 1.25, 2.0])


@pytest.fixture
def clip(rng):
    return tumble.Clip(TIMES, unit(rng, 3, 4), names=["a", "b", "c"])


@pytest.fixture
def engine():
    return tumble.Engine("cpu")


def program(*arguments, cwd, code=0):
    command = [sys.executable, "-m", "tumble", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=cwd)
    assert done.returncode == code, done.stderr
    return done.stdout


def angle(a, b):
    """Radians between rotations, (…, 4)."""
    a, b = np.float64(a), np.float64(b)
    return 2 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))


# Representations


def test_axes_and_angles_are_those_of_scipy(clip, engine):
    q = engine.evaluate(clip, fps=30)
    found = engine.axis_angle(clip, fps=30, degrees=False)
    assert (found.shape, found.dtype) == (q.shape, np.float32)
    expected = Rotation.from_quat(q.reshape(-1, 4)).as_matrix()
    vectors = (found[..., :3] * found[..., 3:]).reshape(-1, 3)
    assert np.abs(Rotation.from_rotvec(vectors).as_matrix() - expected).max() < 2e-6
    degrees = engine.axis_angle(clip, fps=30, layout="frame")
    assert np.array_equal(degrees[..., :3], found.swapaxes(0, 1)[..., :3])
    assert np.allclose(np.deg2rad(degrees[..., 3]), found[..., 3].T, rtol=1e-6)


def test_rotation_vectors_are_those_of_scipy(clip, engine):
    q = engine.evaluate(clip, fps=30)
    found = engine.rotation_vectors(clip, fps=30)
    assert (found.shape, found.dtype) == ((3, 61, 3), np.float32)
    expected = Rotation.from_quat(q.reshape(-1, 4)).as_rotvec().reshape(found.shape)
    assert np.abs(found - expected).max() < 1e-6
    out = np.empty((61, 3, 3), np.float32)
    assert engine.rotation_vectors(clip, fps=30, layout="frame", out=out) is out
    assert np.array_equal(out, found.swapaxes(0, 1))
    assert np.array_equal(engine.rotation_vectors(clip, at=0.5), engine.rotation_vectors(clip, at=[0.5])[:, 0])
    lists = engine.rotation_vectors(clip, at=[[0.1], [0.2, 0.3], []])
    assert [one.shape for one in lists] == [(1, 3), (2, 3), (0, 3)]
    assert np.array_equal(lists[1], engine.rotation_vectors(clip, at=[0.2, 0.3])[1])
    still = tumble.Clip([0.0], [[[0, 0, 0, 1]], [[0, 0, 0, -1]], [[1, 0, 0, 0]], [[0, 0.6, 0, -0.8]]])
    vectors = engine.rotation_vectors(still, at=0.0, signs="as-authored")
    expected = [[0, 0, 0], [0, 0, 0], [np.pi, 0, 0], [0, -2 * np.arctan2(0.6, 0.8), 0]]
    assert np.allclose(vectors, expected, atol=1e-7)
    with pytest.raises(tumble.InputError, match=r"out: its shape is \(3, 61, 4\); the result's is \(3, 61, 3\)"):
        engine.rotation_vectors(clip, fps=30, out=np.empty((3, 61, 4), np.float32))


@pytest.mark.parametrize("encoding", tumble.encodings())
def test_every_encoding_has_the_bytes_of_the_program(clip, engine, tmp_path, encoding):
    tumble.save(tmp_path / "clip.npz", clip)
    clip = tumble.load(tmp_path / "clip.npz").clip
    found = engine.encoded(clip, encoding, fps=30, method="slerp")
    is_quaternion = encoding in ("f32", "f16", "snorm16")
    output = ["--encoding", encoding] if is_quaternion else ["--quantity", encoding]
    program(
        "eval", "clip.npz", *output, "--method", "slerp", "--fps", 30, "-o", "out.npy", cwd=tmp_path
    )
    expected = np.load(tmp_path / "out.npy")
    assert found.dtype == expected.dtype and np.array_equal(found, expected)
    out = np.empty_like(found)
    assert engine.encoded(clip, encoding, fps=30, method="slerp", out=out) is out
    assert np.array_equal(out, found)
    by_frame = engine.encoded(clip, encoding, fps=30, method="slerp", layout="frame")
    assert np.array_equal(by_frame, found.swapaxes(0, 1))


def test_encodings_have_one_name_each(clip, engine):
    options = dict(fps=30, method="slerp")
    for encoding, named in [
        ("f32", engine.evaluate(clip, **options)),
        ("f16", engine.evaluate(clip, dtype="float16", **options)),
        ("snorm16", engine.evaluate(clip, dtype="int16", **options)),
        ("matrix", engine.matrices(clip, **options)),
        ("matrix-3x4", engine.matrices(clip, columns=4, **options)),
    ]:
        assert np.array_equal(engine.encoded(clip, encoding, **options), named), encoding
    columns = engine.matrices(clip, **options)[..., :2].swapaxes(2, 3)
    assert np.array_equal(engine.encoded(clip, "6d", **options), columns.reshape(*columns.shape[:2], 6))
    by_columns = engine.encoded(clip, "matrix-3x4", major="column", **options)
    assert np.array_equal(by_columns, engine.matrices(clip, columns=4, **options).swapaxes(2, 3))
    for degrees in [True, False]:
        found = engine.encoded(clip, "axis-angle", degrees=degrees, **options)
        assert np.array_equal(found, engine.axis_angle(clip, degrees=degrees, **options))
        found = engine.encoded(clip, "euler", sequence="zxz", degrees=degrees, **options)
        assert np.array_equal(found, engine.euler(clip, sequence="zxz", degrees=degrees, **options))
    # `degrees` converts angles only.
    found = engine.encoded(clip, "f16", degrees=False, **options)
    assert np.array_equal(found, engine.encoded(clip, "f16", **options))
    for wrong in ["vector", "f64"]:
        with pytest.raises(tumble.InputError, match=f"there is no `{wrong}`; there are f32, f16, snorm16, axis-angle, "):
            engine.encoded(clip, wrong, **options)
    with pytest.raises(tumble.InputError, match="major: there is no `rows`; there are row, column"):
        engine.encoded(clip, "matrix", major="rows", **options)
    with pytest.raises(tumble.InputError, match="sequence: `XXY` is not a sequence"):
        engine.encoded(clip, "euler", sequence="XXY", **options)
    with pytest.raises(tumble.InputError, match="device_array: angles on the card are in degrees"):
        engine.encoded(clip, "euler", degrees=False, device_array=True, **options)


def test_matrices_of_four_columns_do_not_move(clip, engine):
    rotations = engine.matrices(clip, fps=30)
    found = engine.matrices(clip, fps=30, columns=4)
    assert found.shape == (3, 61, 3, 4)
    assert np.array_equal(found[..., :3], rotations) and not found[..., 3].any()
    with pytest.raises(tumble.InputError, match="columns: expected 3 or 4, not 5"):
        engine.matrices(clip, fps=30, columns=5)


@pytest.mark.parametrize("layout", ["track", "frame"])
@pytest.mark.parametrize("order", ["xyzw", "wxyz"])
def test_halves_and_whole_numbers_are_the_rounded_floats(clip, engine, layout, order):
    options = dict(fps=30, layout=layout, order=order)
    q = engine.evaluate(clip, **options)
    half = engine.evaluate(clip, dtype="float16", **options)
    assert half.dtype == np.float16 and np.array_equal(half, q.astype(np.float16))
    short = engine.evaluate(clip, dtype=np.int16, **options)
    assert short.dtype == np.int16
    assert np.abs(short - np.float64(q) * 32767).max() <= 0.5
    out = np.empty_like(half)
    assert engine.evaluate(clip, dtype=np.float16, out=out, **options) is out
    assert np.array_equal(out, half)


def test_halves_of_channels_with_methods_of_their_own(rng, tmp_path, engine):
    clip = tumble.Clip(TIMES, unit(rng, 2, 4), translations=[np.zeros((4, 3)), None])
    path = tmp_path / "clip.glb"
    tumble.save(path, clip)
    again = tumble.load(path).clip
    for at in [0.3, [0.1, 0.7], [[0.1], [0.2]]]:
        q = engine.evaluate(again, at=at)
        assert np.array_equal(engine.evaluate(again, at=at, dtype="f2"), q.astype(np.float16))
    lists = engine.evaluate(clip, at=[[0.1], [0.2, 0.3]], dtype="f2")
    assert [one.shape for one in lists] == [(1, 4), (2, 4)] and lists[1].dtype == np.float16


def test_types_that_there_are_not(clip, engine):
    with pytest.raises(tumble.InputError, match="no rotations in float64; there are float32"):
        engine.evaluate(clip, fps=30, dtype=np.float64)
    with pytest.raises(TypeError):
        engine.evaluate(clip, fps=30, dtype="nonsense")
    with pytest.raises(tumble.InputError, match="leave out `order`, `dtype` and `out`"):
        engine.evaluate(clip, fps=30, dtype="float16", as_rotation=True)
    with pytest.raises(tumble.InputError, match="type is float32; results are float16"):
        engine.evaluate(clip, at=[0.0], dtype="float16", out=np.empty((3, 1, 4), np.float32))


# Samples to samples


def test_smoothed_vectors_are_those_of_a_convolution(rng, engine):
    noise = rng.normal(size=(2, 50, 3))
    found = engine.smooth(noise, kernel="linear")
    assert (found.shape, found.dtype) == (noise.shape, np.float32)
    expected = noise.copy()
    expected[:, 1:-1] = 0.25 * noise[:, :-2] + 0.5 * noise[:, 1:-1] + 0.25 * noise[:, 2:]
    assert np.abs(found - expected).max() < 1e-6
    assert np.array_equal(found, engine.smooth(noise.swapaxes(0, 1), kernel="linear", layout="frame").swapaxes(0, 1))
    assert np.array_equal(found[0], engine.smooth(noise[0], kernel="linear"))
    out = np.empty(noise.shape, np.float32)
    assert engine.smooth(noise, kernel="linear", out=out) is out
    twice = engine.smooth(noise, kernel="linear", passes=2)
    assert np.abs(twice - engine.smooth(found, kernel="linear")).max() < 1e-6


def test_rotations_that_stand_still_keep_their_bits_and_noise_goes(rng, engine):
    still = np.repeat(unit(rng, 1), 60, axis=0)
    assert np.array_equal(engine.smooth(still), still)
    noisy = (Rotation.from_rotvec(0.1 * rng.normal(size=(60, 3))) * Rotation.from_quat(still)).as_quat()
    smooth = engine.smooth(noisy, kernel="gaussian:4")
    assert angle(smooth, still).mean() < 0.4 * angle(noisy, still).mean()
    wxyz = engine.smooth(np.roll(noisy, 1, axis=-1), kernel="gaussian:4", order="wxyz")
    assert np.array_equal(np.roll(wxyz, -1, axis=-1), smooth)
    assert np.array_equal(engine.smooth(Rotation.from_quat(noisy), kernel="gaussian:4"), smooth)


def test_a_low_pass_halves_the_power_at_its_frequency(engine):
    times = np.arange(2400) / 120
    wave = np.sin(2 * np.pi * 5 * times)[:, None] * [1.0, 0.0, 0.0]
    found = engine.smooth(wave, low_pass=5, fps=120)[600:1800]
    assert abs(found.max() - np.sqrt(0.5)) < 2e-3
    with pytest.raises(tumble.InputError, match="no frequencies above 60 Hz"):
        engine.smooth(wave, low_pass=60, fps=120)


def test_smooth_has_the_bits_of_the_program(rng, engine, tmp_path):
    keys = unit(rng, 2, 60)
    clip = tumble.Clip(np.arange(60) / 30, keys)
    tumble.save(tmp_path / "keys.npz", clip)
    program("smooth", "keys.npz", "--kernel", "box:3", "-o", "out.npy", cwd=tmp_path)
    found = engine.smooth(engine.evaluate(clip, at=np.arange(60) / 30), kernel="box:3")
    expected = np.load(tmp_path / "out.npy")
    assert np.array_equal(np.abs((found * expected).sum(axis=-1)).round(6), np.ones((2, 60)))
    assert angle(found, np.where((found * expected).sum(axis=-1, keepdims=True) < 0, -expected, expected)).max() == 0


def test_a_clip_is_smoothed_with_all_that_it_has(rng, engine, tmp_path):
    noisy, times = unit(rng, 3, 60), np.arange(60) / 30
    clip = tumble.Clip(
        times, noisy, name="walk", names=["hips", "knee", "foot"], parents=[None, 0, 1],
        offsets=[[0, 1, 0], [0, -0.4, 0], [0, -0.4, 0]],
        translations=[rng.normal(size=(60, 3)), None, None], scales=[None, np.full((60, 3), 2.0), None],
    )
    calm = engine.smooth(clip, kernel="box:3")
    assert isinstance(calm, tumble.Clip)
    assert (calm.name, calm.names, calm.parents) == (clip.name, clip.names, clip.parents)
    assert np.array_equal(calm.offsets, clip.offsets)
    # The same bits as smoothed arrays, at the keys.
    found = engine.smooth(engine.evaluate(clip, at=times), kernel="box:3")
    for joint in range(3):
        assert np.array_equal(calm.times(joint), times)
        assert np.array_equal(np.abs(calm.keys(joint)), np.abs(found[joint]))
    (_, moved), (_, scaled) = calm.translations(0), calm.scales(1)
    assert np.array_equal(moved, engine.smooth(clip.translations(0)[1], kernel="box:3"))
    assert calm.translations(1) is None and (scaled == 2).all() and calm.scales(0) is None
    # The same result as the program's, also at a rate.
    tumble.save(tmp_path / "keys.npz", clip)
    program("smooth", "keys.npz", "--low-pass", "4", "--fps", "60", "-o", "calm.npz", cwd=tmp_path)
    theirs = tumble.load(tmp_path / "calm.npz").clip
    ours = engine.smooth(clip, low_pass=4, fps=60)
    for joint in range(3):
        assert np.array_equal(ours.keys(joint), theirs.keys(joint))
    assert np.array_equal(ours.translations(0)[1], theirs.translations(0)[1])
    # Keys at uneven times must be sampled.
    uneven = tumble.Clip([0.0, 1.0, 3.0], noisy[0, :3])
    with pytest.raises(tumble.InputError, match="not evenly spaced.*give `fps`"):
        engine.smooth(uneven)
    assert len(engine.smooth(uneven, fps=10).keys(0)) == 31
    for options in [{"layout": "frame"}, {"order": "wxyz"}, {"out": np.empty((3, 60, 4), "f4")}]:
        with pytest.raises(tumble.InputError, match="a smoothed clip is a clip"):
            engine.smooth(clip, **options)
    with pytest.raises(tumble.InputError, match="low_pass"):
        engine.smooth(clip, low_pass=40)


def test_what_cannot_be_smoothed(rng, engine):
    q = unit(rng, 9)
    for options, message in [
        (dict(kernel="median:3"), "kernel: unknown kernel `median:3`"),
        (dict(kernel="box:2", low_pass=3.0, fps=60), "exclude each other"),
        (dict(low_pass=3.0), "low_pass: give `fps` too"),
        (dict(fps=60), "it goes with `low_pass`"),
        (dict(ends="open"), "ends: there is no `open`"),
        (dict(passes=100_000), "100000 passes are too many"),
    ]:
        with pytest.raises(tumble.InputError, match=message):
            engine.smooth(q, **options)
    with pytest.raises(tumble.InputError, match=r"samples\[1\]|value 1"):
        engine.smooth([[0.0, 0, 0, 1], [0, 0, 0, 2]])
    with pytest.raises(tumble.InputError, match="samples"):
        engine.smooth(np.zeros((2, 2, 2, 2, 4)) + 0.5)


def test_a_mix_is_a_slerp(rng, engine):
    first, second = unit(rng, 5, 7), unit(rng, 5, 7)
    found = engine.mix(first, second, 0.3)
    for a, b, mixed in zip(first.reshape(-1, 4), second.reshape(-1, 4), found.reshape(-1, 4)):
        expected = Slerp([0, 1], Rotation.from_quat([a, b]))(0.3)
        assert (Rotation.from_quat(mixed) * expected.inv()).magnitude() < 1e-6
    assert np.array_equal(engine.mix(first, second, 0.0), first)
    with pytest.raises(tumble.InputError, match="weight"):
        engine.mix(first, second, 1.5)
    with pytest.raises(tumble.InputError, match="second: its shape is"):
        engine.mix(first, second[:4], 0.5)


def test_weights_may_differ_between_frames(rng, engine):
    """The bits are those of one weight after another."""
    first, second, third = unit(rng, 5, 7), unit(rng, 5, 7), unit(rng, 7)
    weights = np.linspace(0, 1, 7)
    mixed = engine.mix(first, second, weights)
    blended = engine.blend([first, second, third], [1.0, weights, weights[::-1] ** 2])
    for frame, weight in enumerate(weights):
        alone = [keys[..., frame, :] for keys in (first, second, third)]
        assert np.array_equal(mixed[:, frame], engine.mix(*alone[:2], weight))
        alone[2] = np.tile(alone[2], (5, 1))
        one = engine.blend(alone, [1.0, weight, weights[6 - frame] ** 2])
        assert np.array_equal(blended[:, frame], one)
    tracks = engine.mix(first, second, weights[:5, None])
    assert np.array_equal(tracks[2], engine.mix(first[2], second[2], weights[2]))
    all_weights = rng.uniform(size=(2, 5, 7))
    assert np.array_equal(engine.blend([first, second], all_weights), engine.blend([first, second], list(all_weights)))
    # On threads, too.
    many = np.tile(first, (600, 1, 1, 1))
    assert np.array_equal(engine.mix(many, second, weights), np.broadcast_to(mixed, many.shape))
    assert engine.mix(first[:, :1], second, 0.5).shape == (5, 7, 4)
    for call, words in [
        (lambda: engine.mix(first, second, [0.5, 1.5, 0, 0, 0, 0, 0]), "weight.*1.5"),
        (lambda: engine.mix(first, second, [0.5, 0.5]), r"weight: its shape is \[2\]"),
        (lambda: engine.blend([first, second], [weights, weights * np.nan]), "weight"),
        (lambda: engine.blend([first, second], [weights]), "weights: there are 1 for 2 layers"),
    ]:
        with pytest.raises(tumble.InputError, match=words):
            call()
    with pytest.raises(TypeError, match="a number or an array for each layer"):
        engine.blend([first, second], 0.5)


def test_a_blend_is_a_sum_with_signs(rng, engine):
    layers, weights = unit(rng, 3, 5, 7), [1.0, 2.0, 0.5]
    found = engine.blend(list(layers), weights)
    signs = np.sign((layers * layers[0]).sum(axis=-1, keepdims=True))
    expected = (np.float64(layers) * signs * np.reshape(weights, (3, 1, 1, 1))).sum(axis=0)
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    assert np.abs(found - expected).max() < 1e-6
    assert np.array_equal(engine.blend(layers, weights), found), "an array is a list of its rows"
    assert np.array_equal(engine.blend(layers), engine.blend(layers, [1, 1, 1]))
    with pytest.raises(tumble.InputError, match="weights: there are 2 for 3 layers"):
        engine.blend(layers, [1, 2])
    with pytest.raises(tumble.InputError, match="no layer|give at least|layer"):
        engine.blend([])
    with pytest.raises(tumble.InputError, match="overwritten"):
        engine.blend([layers[0], layers[1]], out=layers[0])


@pytest.mark.parametrize("layout", ["track", "frame"])
def test_what_is_added_is_the_difference_from_its_reference(rng, engine, layout):
    base, layer, reference = unit(rng, 3, 7), unit(rng, 3, 7), unit(rng, 3)
    lay = (lambda a: a.swapaxes(0, 1)) if layout == "frame" else (lambda a: a)
    found = lay(engine.add(lay(base), lay(layer), reference=reference, weight=0.4, layout=layout))
    of = Rotation.from_quat
    for track in range(3):
        difference = (of(reference[track]).inv() * of(layer[track])).as_rotvec()
        expected = of(base[track]) * Rotation.from_rotvec(0.4 * difference)
        assert (of(found[track]) * expected.inv()).magnitude().max() < 2e-6
    with pytest.raises(tumble.InputError, match=r"reference: its shape is \[2, 4\]; give \(3, 4\)"):
        engine.add(lay(base), lay(layer), reference=reference[:2], layout=layout)


def test_model_matrices_are_products_along_the_skeleton(rng, engine):
    tracks, frames = 4, 5
    q, moved = unit(rng, tracks, frames), rng.normal(size=(tracks, frames, 3))
    scales, offsets = rng.uniform(0.5, 2, size=(tracks, frames, 3)), rng.normal(size=(tracks, 3))
    parents = [None, 0, 1, 0]
    bind = rng.normal(size=(tracks, 4, 4))
    bind[:, 3] = [0, 0, 0, 1]
    translations = [moved[0], None, moved[2], None]
    found = engine.local_to_model(
        q, parents, offsets, translations=translations, scales=scales, inverse_bind=bind
    )
    assert (found.shape, found.dtype) == ((tracks, frames, 3, 4), np.float32)
    for frame in range(frames):
        models = {}
        for track in range(tracks):
            local = np.eye(4)
            local[:3, :3] = Rotation.from_quat(q[track, frame]).as_matrix() * scales[track, frame]
            moves = translations[track] is not None
            local[:3, 3] = moved[track, frame] if moves else offsets[track]
            above = np.eye(4) if parents[track] is None else models[parents[track]]
            models[track] = above @ local
            expected = (models[track] @ bind[track])[:3]
            assert np.abs(found[track, frame] - expected).max() < 1e-4
    one = engine.local_to_model(q[:, 0], parents, offsets)
    assert np.array_equal(one, engine.local_to_model(q[:, :1], parents, offsets)[:, 0])
    swapped = engine.local_to_model(q.swapaxes(0, 1), parents, offsets, layout="frame")
    assert np.array_equal(swapped[0], one)
    for arguments, message in [
        (([None, 0],), "parents: there are 2 for 4 tracks"),
        (([None, 0, 1, 9],), "parents: "),
        (([1, 0, None, None],), "parents: "),
        ((parents, offsets[:2]), "offsets: the shape is"),
    ]:
        with pytest.raises(tumble.InputError, match=message):
            engine.local_to_model(q, *arguments)


def test_the_world_of_a_clip_is_where_its_model_matrices_put_it(rng, engine):
    q, offsets = unit(rng, 3, 4), rng.normal(size=(3, 3))
    clip = tumble.Clip(TIMES, q, parents=[None, 0, 1], offsets=offsets)
    positions, _ = engine.world(clip, fps=10)
    model = engine.local_to_model(engine.evaluate(clip, fps=10), clip.parents, clip.offsets)
    assert np.abs(model[..., 3] - positions).max() < 1e-5


# Bodies on paths


def test_bodies_follow_as_in_the_program(rng, engine, tmp_path):
    times, points = np.array([0.0, 1.0, 2.5, 4.0]), rng.normal(size=(4, 3)).astype(np.float32)
    np.savetxt(tmp_path / "way.csv", np.c_[times, points], delimiter=",", header="t,x,y,z", comments="", fmt="%.9g")
    line = ["follow", "way.csv", "--fps", 30, "--device", "cpu", "-o", "out.npy"]
    program(*line, "--path-frame", "fixed", "--direction", "ahead:0.5", "--body-forward", "x", cwd=tmp_path)
    positions, rotations = engine.follow(times, points, fps=30, frame="fixed", ahead=0.5, forward="x")
    expected = np.load(tmp_path / "out.npy")
    assert np.array_equal(np.c_[positions, rotations], expected[:, 0])
    assert np.array_equal(positions[[0, 30, 75, 120]], points), "points are met bit for bit"


def test_forms_of_paths(rng, engine):
    times, points = np.arange(5.0), rng.normal(size=(2, 5, 3))
    both = engine.follow(times, points, fps=10)
    assert [array.shape for array in both] == [(2, 41, 3), (2, 41, 4)]
    for track in range(2):
        one = engine.follow(times, points[track], fps=10)
        assert all(np.array_equal(a, b[track]) for a, b in zip(one, both))
    lists = engine.follow([times, times], list(points), fps=10, layout="frame", order="wxyz")
    assert np.array_equal(lists[1].swapaxes(0, 1)[..., [1, 2, 3, 0]], both[1])
    for speed in ("keys", "as-keyed"):  # the short name, and that of the program
        assert all(map(np.array_equal, engine.follow(times, points, fps=10, speed=speed), both))
    at = engine.follow(times, points[0], at=2.0)
    assert [array.shape for array in at] == [(3,), (4,)]
    steady, _ = engine.follow(None, points[0], rate=2.0, method="linear", fps=100, speed="constant")
    steps = np.linalg.norm(np.diff(steady, axis=0), axis=-1)
    assert abs(np.median(steps) - 0.02) < 1e-4
    distant, _ = engine.follow(times, points[0] + 4e6, fps=10)
    assert distant.dtype == np.float64 and np.abs(distant - 4e6 - both[0][0]).max() < 1e-6
    target = engine.follow(times, points, fps=10, look_at=1)[1][0]
    forward = Rotation.from_quat(target).apply([0, 0, 1])
    direction = both[0][1] - both[0][0]
    assert np.abs(forward - direction / np.linalg.norm(direction, axis=-1, keepdims=True)).max() < 1e-4


def test_what_cannot_be_followed(rng, engine):
    times, points = np.arange(5.0), rng.normal(size=(5, 3))
    for (when, where), options, message in [
        ((None, points), {}, "times: a path without times needs `duration` in seconds"),
        ((times, points), dict(rate=1.0), "leave out `duration` and `rate`"),
        ((None, points), dict(rate=1.0, duration=2.0), "exclude each other"),
        ((None, points), dict(rate=-1.0), "rate: -1 is not a number greater than 0"),
        ((times[:4], points), {}, r"points\[0\]: there are 5, with 4 times"),
        ((times, points[:, :2]), {}, "points: the shape is"),
        ((times[::-1], points), {}, "time"),
        ((times, points), dict(frame="flat"), "frame: there is no `flat`"),
        ((times, points), dict(forward="u"), "forward: "),
        ((times, points), dict(method="slerp"), "method: "),
        ((times, points), dict(ends="loop"), "repeat the first point"),
        ((times, points), dict(ahead=-1.0), "ahead"),
        ((times, np.full((5, 3), np.nan)), {}, "not finite"),
    ]:
        with pytest.raises(tumble.InputError, match=message):
            engine.follow(when, where, fps=10, **options)
    with pytest.raises(tumble.InputError, match="give `fps`"):
        engine.follow(times, points)
    with pytest.warns(tumble.InputWarning, match="does not move"):
        engine.follow(times[:2], np.zeros((2, 3)), fps=10)


# Routes


def hill(n=24):
    x, z = np.meshgrid(np.linspace(0, 9, n), np.linspace(0, 9, n), indexing="ij")
    y = np.sin(x) * np.cos(z)
    index = np.arange(n * n).reshape(n, n)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.stack([np.stack([a, c, b], -1), np.stack([a, d, c], -1)], 2).reshape(-1, 3)
    return np.stack([x, y, z], -1).reshape(-1, 3), faces


def test_routes_are_those_of_the_program(tmp_path):
    vertices, faces = hill()
    with open(tmp_path / "hill.obj", "w", encoding="utf-8") as file:
        file.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in vertices.tolist())
        file.writelines(f"f {a} {b} {c}\n" for a, b, c in (faces + 1).tolist())
    surface = tumble.Surface(vertices, faces)
    for by in ["exact", "plane", "edges", "greedy"]:
        line = ["route", "hill.obj", "--start-point", "1,0,1", "--end-point", "8,0,7", "--by", by, "-o", "way.csv"]
        program(*line, "--overwrite", cwd=tmp_path)
        expected = np.loadtxt(tmp_path / "way.csv", delimiter=",", skiprows=1)
        with pytest.warns(tumble.InputWarning, match="start: it is .* away from the surface"):
            route = surface.route([1, 0, 1], [8, 0, 7], by=by)
        assert np.array_equal(np.c_[route.points, route.normals], expected)
        assert abs(np.linalg.norm(np.diff(route.points, axis=0), axis=1).sum() - route.length) < 1e-9


def test_ways_keep_clear_and_walkers_wait(engine):
    plane = tumble.Surface([[0, 0, 0], [0, 0, 8], [8, 0, 8], [8, 0, 0]], [[0, 1, 2, 3]])
    box = [[3, -1, 3], [3, -1, 5], [5, -1, 5], [5, -1, 3], [3, 1, 3], [3, 1, 5], [5, 1, 5], [5, 1, 3]]
    sides = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    rocks = tumble.Surface(box, sides)
    straight = plane.route([1, 0, 4], [7, 0, 4])
    around = plane.route([1, 0, 4], [7, 0, 4], avoid=rocks, clearance=0.5, finest=0.1)
    assert straight.length == 6 and 6.3 < around.length < 8
    middle = around.points[(around.points[:, 0] > 3) & (around.points[:, 0] < 5)]
    assert (np.abs(middle[:, 2] - 4) >= 1.5 - 1e-9).all()
    with pytest.raises(tumble.InputError, match="not on free ground"):
        plane.route([1, 0, 4], [3, 0, 4], avoid=rocks, clearance=0.5, finest=0.1)
    with pytest.warns(tumble.InputWarning, match="route 1: .*not on free ground"):
        found = plane.routes([[1, 0, 4]] * 2, [[7, 0, 4], [3, 0, 4]], avoid=rocks, clearance=0.5)
    assert found[1] is None and found[0] is not None
    with pytest.raises(tumble.InputError, match="clearance: .*give it too"):
        plane.route([1, 0, 4], [7, 0, 4], clearance=0.5)

    routes = plane.routes([[1, 0, 4], [4, 0, 1]], [[7, 0, 4], [4, 0, 7]])
    first, second = tumble.walk(routes, speed=1.0, radius=0.25)
    assert first.times[-1] == 6 and second.times[-1] > 6.2
    at = np.linspace(0, 7, 701)
    positions = [np.stack([np.interp(at, w.times, w.points[:, k]) for k in range(3)], -1) for w in (first, second)]
    assert np.linalg.norm(positions[0] - positions[1], axis=-1).min() > 0.5 - 1e-6
    mover = ([0.0, 10.0], [[1, 0, 4], [1, 0, 4]], 0.5)
    with pytest.warns(tumble.InputWarning, match=r"routes\[0\]"):
        assert tumble.walk(routes[:1], speed=1.0, radius=0.25, movers=[mover])[0] is None
    # A body moves along the route.
    positions, _ = engine.follow(first.times, first.points, ups=first.normals, fps=10, method="linear")
    assert np.abs(positions[:, 0] - np.linspace(1, 7, 61)).max() < 1e-5


def test_surfaces_that_are_none():
    for vertices, faces, message in [
        ([[0, 0, 0]], [[0, 1, 2]], "vertex 1"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2.5]], "faces: 2.5 is not an index"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, -2]], "faces: -2 is not an index"),
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], "vertices: the last axis"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], "no area|no faces"),
    ]:
        with pytest.raises(tumble.InputError, match=message):
            tumble.Surface(vertices, faces)
    plane = tumble.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(tumble.InputError, match="by: there is no `swim`"):
        plane.route([0, 0, 0], [1, 0, 0], by="swim")
    with pytest.raises(tumble.InputError, match="by: there is no `exact` for nets"):
        points = np.stack(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0]), -1)[:, :, 0]
        tumble.Surface.net(points).route([0, 0, 0], [1, 1, 0], by="exact")


# Clips


def test_reduced_clips_stay_within_their_bounds(rng, engine, tmp_path):
    times = np.arange(121) / 60
    rotation_vectors = np.sin(times[:, None, None] * rng.uniform(1, 4, size=(3, 3)) + rng.normal(size=(3, 3)))
    keys = Rotation.from_rotvec(rotation_vectors.reshape(-1, 3)).as_quat().reshape(121, 3, 4).swapaxes(0, 1)
    clip = tumble.Clip(times, keys, parents=[None, 0, 1], offsets=[[0, 0, 0], [0, 1, 0], [0, 1, 0]])
    found = tumble.reduce(clip, tolerance=0.5, engine=engine)
    assert found.keys_before == 363 and found.keys_after < 250
    assert found.angles.shape == found.times.shape == (121,) and found.bounds[0] == 0.5
    assert 0.1 < found.angles.max() <= 0.5 and (found.distances <= found.bounds[1]).all()
    compared = tumble.compare(clip, found.clip, world=True, at=times, engine=engine)
    assert abs(compared.rotation.largest - found.angles.max()) < 1e-3
    together = tumble.reduce(clip, tolerance=0.5, together=True)
    assert len({tuple(together.clip.times(track)) for track in range(3)}) == 1
    tumble.save(tmp_path / "clip.glb", clip)
    line = ["reduce", "clip.glb", "--tolerance", "0.5deg", "-o", "small.glb", "--json"]
    said = json.loads(program(*line, cwd=tmp_path))[0]
    assert (said["keys_before"], said["keys_after"]) == (found.keys_before, found.keys_after)
    assert abs(said["angle"]["largest"] - found.angles.max()) < 1e-9
    smaller = tumble.reduce(clip, tolerance=0.5, curve="bessel-overhauser", fps=30)
    assert smaller.times.shape == (61,)
    with pytest.raises(tumble.InputError, match="curve: there is no `round`"):
        tumble.reduce(clip, curve="round")
    with pytest.raises(tumble.InputError, match="tolerance|-1"):
        tumble.reduce(clip, tolerance=-1.0)


def test_clips_are_compared_as_the_program_does(rng, tmp_path):
    keys = unit(rng, 2, 4)
    other = (Rotation.from_euler("z", 10, degrees=True) * Rotation.from_quat(keys.reshape(-1, 4))).as_quat()
    names = ["hip", "knee"]
    first = tumble.Clip(TIMES, keys, names=names)
    second = tumble.Clip(TIMES, other.reshape(2, 4, 4)[::-1], names=names[::-1])
    found = tumble.compare(first, second)
    assert found.tracks == 2 and found.span == (0.0, 2.0) and found.missing == ([], [])
    assert abs(found.rotation.largest - 10) < 1e-3 and abs(found.rotation.mean - 10) < 1e-3
    assert found.translation is None and found.identical == 0
    for name, clip in [("a.glb", first), ("b.glb", second)]:
        tumble.save(tmp_path / name, clip)
    said = json.loads(program("compare", "a.glb", "b.glb", "--json", cwd=tmp_path))["clips"][0]
    again = tumble.compare(tumble.load(tmp_path / "a.glb").clip, tumble.load(tmp_path / "b.glb").clip)
    assert said["rotation"]["largest"] == again.rotation.largest
    assert said["rotation"]["time"] == again.rotation.time and said["samples"] == again.samples
    assert said["joints"][0]["track"] in names and len(said["joints"]) == len(again.joints) == 2
    for joint in said["joints"]:
        (found,) = [other for other in again.joints if other.track == joint["track"]]
        assert found.rotation.largest == joint["rotation"]["largest"]
        assert found.rotation.frame == joint["rotation"]["frame"] and found.translation is None
    with pytest.raises(tumble.InputError, match="times from 3 to 4 s are requested, but both have only times from 0 to 2 s"):
        tumble.compare(first, second, fps=60, start=3, end=4)
    with pytest.raises(tumble.InputError, match="times from 9 to 9 s are requested"):
        tumble.compare(first, second, at=[9.0])
    assert tumble.compare(first, second, at=[1.0, 9.0]).samples == 1
    same = tumble.compare(first, first, fps=60, start=0.5)
    assert same.identical == same.tracks * same.samples == 2 * 91
    longer = tumble.Clip(TIMES * 2, keys, names=names)
    with pytest.warns(tumble.InputWarning, match="compared from 0 to 2 s"):
        tumble.compare(first, longer)
    with pytest.raises(tumble.InputError, match="the inputs have no common time"):
        tumble.compare(first, tumble.Clip(TIMES + 9, keys, names=names))
    with pytest.raises(tumble.InputError, match="have 2 and 3 tracks, none of the same name$"):
        tumble.compare(first, tumble.Clip(TIMES, unit(rng, 3, 4), names=["x", "y", "z"]))


def test_arrays_are_compared_by_numbers_and_angles(rng):
    a = unit(rng, 3, 5)
    found = tumble.compare(a, a)
    assert found.differing == 0 and found.rotation.largest == 0 and found.numbers == 60
    b = a.copy()
    b[1, 2] = [-b[1, 2, 1], b[1, 2, 0], -b[1, 2, 3], b[1, 2, 2]]
    found = tumble.compare(a, b)
    assert found.largest_rotation_at == [1, 2] and abs(found.rotation.largest - 180) < 1e-3
    assert np.isclose(found.difference.largest, np.abs(a - b).max())
    assert tumble.compare([1.0, np.nan], [1.0, np.nan]).differing == 0
    with pytest.raises(tumble.InputError, match=r"first has the shape \[2\] and second has \[3\]"):
        tumble.compare([1, 2], [1, 2, 3])
    with pytest.raises(tumble.InputError, match="two clips, or two arrays"):
        tumble.compare(a, tumble.Clip(TIMES, unit(rng, 4)))


def test_path_errors_are_those_of_the_program(rng, tmp_path):
    times = np.arange(60) / 10
    path = np.cumsum(rng.normal(size=(60, 3)), axis=0)
    keys = unit(rng, 60)
    alignment = Rotation.from_euler("xyz", [20, -30, 70], degrees=True)
    moved = 1.5 * alignment.apply(path) + [1, 2, 3] + 0.05 * rng.normal(size=(60, 3))
    rotated = (alignment * Rotation.from_quat(keys)).as_quat()
    for name, where, q in [("truth.tum", path, keys), ("estimate.tum", moved, rotated)]:
        np.savetxt(tmp_path / name, np.c_[times, where, q], fmt="%.9f")
    line = ["compare", "truth.tum", "estimate.tum", "--align", "sim3", "--ape", "--rpe", "1s", "--json"]
    said = json.loads(program(*line, cwd=tmp_path))["trajectory"]
    clips = [tumble.load(tmp_path / name).clip for name in ("truth.tum", "estimate.tum")]
    found = tumble.path_errors(*clips, align="sim3", rpe="1s")
    assert found.poses == said["poses"] == 60 and found.rpe_count == said["rpe"]["count"]
    assert found.scale == said["alignment"]["scale"] and abs(found.scale - 1 / 1.5) < 0.01
    for name, errors in [("ape", (found.ape_translation, found.ape_rotation)), ("rpe", (found.rpe_translation, found.rpe_rotation))]:
        for kind, numbers in zip(["translation", "rotation"], errors):
            for field in ["rmse", "mean", "median", "std", "min", "max"]:
                assert getattr(numbers, field) == said[name][kind][field]
    assert tumble.path_errors(*clips).rpe_rotation is None
    few = tumble.Clip(times[::10], keys[::10], translations=[path[::10]])
    for associate in ["interpolated", "nearest:0.01"]:
        found = tumble.path_errors(clips[0], few, associate=associate)
        assert (found.times_of, found.poses) == (1, 6) and found.ape_translation.max < 1e-6
    line = tumble.Clip(TIMES, unit(rng, 4), translations=[np.outer(TIMES, [1, 0, 0])])
    with pytest.warns(tumble.InputWarning, match="lie on a straight line"):
        assert tumble.path_errors(line, line, align="se3").rotation[3] > 1 - 1e-9
    for options, message in [
        (dict(align="se4"), "align: there is no `se4`; there are none, position"),
        (dict(rpe="fast"), "rpe: `fast` is not a step"),
        (dict(rpe="1000s"), "rpe is longer than the whole path"),
        (dict(max_gap=-1), "max_gap: -1"),
        (dict(associate="near"), "associate: `near` is neither `interpolated` nor `nearest:0.01`"),
        (dict(associate="nearest:1", max_gap=1), "max_gap: is for interpolated poses"),
    ]:
        with pytest.raises(tumble.InputError, match=message):
            tumble.path_errors(*clips, **options)
    two = tumble.Clip(TIMES, unit(rng, 2, 4), names=["a", "b"])
    with pytest.raises(tumble.InputError, match="reference: has 2 tracks"):
        tumble.path_errors(two, two)
    with pytest.raises(tumble.InputError, match="has no positions"):
        tumble.path_errors(two, two, track="b")
    two = tumble.Clip(TIMES, unit(rng, 2, 4), names=["a", "b"], translations=np.zeros((2, 4, 3)))
    assert tumble.path_errors(two, two, track="b").ape_rotation.max < 1e-4


# Crowds


@pytest.fixture
def walks(rng):
    parents, offsets = [None, 0, 1], [[0, 0, 0], [0, -1, 0], [0, -1, 0]]
    lengths = [5, 9]
    return [
        tumble.Clip(np.arange(n) / 4, unit(rng, 3, n), parents=parents, offsets=offsets) for n in lengths
    ]


def test_crowds_are_their_clips_at_their_times(walks, engine):
    crowd = tumble.Crowd(walks, 6, engine=engine)
    times = np.array([0.0, 0.3, 0.9, 1.3, 0.2, 1.9])
    clips = np.array([0, 0, 0, 1, 1, 1])
    crowd.set(range(6), clips, time=times, wrap="hold")
    rotations = crowd.evaluate("rotations")
    model = crowd.evaluate()
    assert rotations.shape == (6, 3, 4) and model.shape == (6, 3, 3, 4)
    for instance in range(6):
        clip = walks[clips[instance]]
        expected = engine.evaluate(clip, at=[times[instance]], method="slerp")[:, 0]
        assert angle(rotations[instance], expected * np.sign((rotations[instance] * expected).sum(-1, keepdims=True))).max() < 1e-5
        placed = engine.local_to_model(rotations[instance], clip.parents, clip.offsets)
        assert np.abs(model[instance] - placed).max() < 1e-5
    half = crowd.evaluate(dtype=np.float16)
    assert half.dtype == np.float16 and np.array_equal(half, model.astype(np.float16))
    out = np.empty_like(model)
    assert crowd.evaluate(out=out) is out and np.array_equal(out, model)
    crowd.set([2], 0, time=0.9, speed=-1.0, wrap="loop")
    crowd.advance(1.0)
    assert np.allclose(crowd.times()[[0, 2]], [1.0, 0.9], atol=1e-5)


def test_layers_masks_and_skinning(walks, engine, rng):
    bind = np.tile(np.eye(4), (3, 1, 1))
    bind[:, :3, 3] = rng.normal(size=(3, 3))
    crowd = tumble.Crowd(
        walks, 2, layers=2, masks=[[0, 1, 1]], inverse_bind=bind, references={1: (0, 0.5)}, engine=engine
    )
    crowd.set([0, 1], 0, time=0.5)
    alone = crowd.evaluate("rotations")
    crowd.set([1], 1, layer=1, time=0.25, weight=1.0, mask=0)
    mixed = crowd.evaluate("rotations")
    assert np.array_equal(mixed[0], alone[0]) and np.array_equal(mixed[1, 0], alone[1, 0])
    over = engine.evaluate(walks[1], at=[0.25], method="slerp")[1:, 0]
    assert angle(mixed[1, 1:], over * np.sign((mixed[1, 1:] * over).sum(-1, keepdims=True))).max() < 1e-3
    skinned, model = crowd.evaluate("skinning"), crowd.evaluate("model")
    expected = model[..., :3] @ bind[:, :3, :3].astype(np.float32)
    assert np.abs(skinned[..., :3] - expected).max() < 1e-6
    for call, message in [
        (lambda: crowd.set([7], 0), "no instance 7|instance"),
        (lambda: crowd.set([0], 5), "no clip 5|clip"),
        (lambda: crowd.set([0], 0.5), "clip: 0.5 is not an index"),
        (lambda: crowd.set([0, 1], 0, time=[1.0, 2.0, 3.0]), r"time: the shape is \[3\]"),
        (lambda: crowd.set([0], 0, layer=1, weight=2.0), "weights are 0 to 1"),
        (lambda: crowd.set([0], 0, wrap="extrapolate"), "wrap: there is no"),
        (lambda: crowd.advance(-1.0), "-1 s"),
        (lambda: crowd.evaluate("angles"), "values: there is no `angles`"),
        (lambda: crowd.evaluate(dtype="int16"), "float32 or float16"),
        (lambda: tumble.Crowd(walks, 1).evaluate("skinning"), "give `inverse_bind`"),
        (lambda: tumble.Crowd([], 1), "clips: give at least one"),
        (lambda: tumble.Crowd([tumble.Clip(TIMES, unit(rng, 4))], 1), r"clips\[0\]: it has no skeleton"),
    ]:
        with pytest.raises(tumble.InputError, match=message):
            call()


def test_events_are_passed_when_their_ticks_are_reached(walks, engine):
    events = [tumble.ClipEvent(0, 0.25, "left"), tumble.ClipEvent(1, 1.0, "right"), tumble.ClipEvent(0, 0.75)]
    crowd = tumble.Crowd(walks, 3, layers=2, events=events, ticks_per_second=1000, engine=engine)
    assert crowd.events == events and crowd.ticks_per_second == 1000
    crowd.set([0, 2], 0, time=[0.0, 0.7])
    crowd.set([1], 1, layer=1, weight=0.5, speed=2.0)
    crowd.advance(0.1)
    before = crowd.clock
    assert [(p.clock, p.instance, p.event) for p in crowd.passed_events(0)] == [(50, 2, 2)] and before == 100
    crowd.advance(0.5)
    whole = crowd.passed_events(before)
    found = [(passed.clock, passed.instance, passed.layer, passed.event, passed.weight) for passed in whole]
    # Instance 2 begins its loop of one second again at 300.
    assert found == [(250, 0, 0, 0, 1.0), (500, 1, 1, 1, 0.5), (550, 2, 0, 0, 1.0)]
    parts = tumble.Crowd(walks, 3, layers=2, events=events, ticks_per_second=1000, engine=engine)
    parts.set([0, 2], 0, time=[0.0, 0.7])
    parts.set([1], 1, layer=1, weight=0.5, speed=2.0)
    many = []
    for step in range(60):
        since = parts.clock
        parts.advance(0.01)
        many += [passed for passed in parts.passed_events(since) if step >= 10]
    assert many == whole
    assert pickle.loads(pickle.dumps((events, whole))) == (events, whole)
    for call, message in [
        (lambda: crowd.passed_events(601), "events since 601 ticks, but the clock is at 600"),
        (lambda: tumble.Crowd(walks, 1, events=[tumble.ClipEvent(0, 1.5)]), r"events\[0\]: the event is at tick 1058400"),
        (lambda: tumble.Crowd(walks, 1, events=[tumble.ClipEvent(7, 0.0)]), r"events\[0\]: there is no clip 7"),
        (lambda: tumble.Crowd(walks, 1, events=[tumble.ClipEvent(0, np.nan)]), r"events\[0\]: NaN s; give a time from 0"),
        (lambda: tumble.Crowd(walks, 1, references={1: (0, -0.5)}), r"references: -0.5 s; give a time from 0"),
    ]:
        with pytest.raises(tumble.InputError, match=message):
            call()


# All at once.


def test_every_device_gives_the_same_bits(rng, walks):
    devices = [name for name in tumble.devices() if not name.startswith("CPU")]
    if not devices:
        print("there is no Vulkan device: nothing is compared", file=sys.stderr)
        pytest.skip("no Vulkan device")
    found = []
    for engine in [tumble.Engine("cpu"), tumble.Engine("vulkan")]:
        generator = np.random.default_rng(3)
        a, b = unit(generator, 5, 300), unit(generator, 5, 300)
        crowd = tumble.Crowd(walks, 64, engine=engine)
        crowd.set(range(64), generator.integers(0, 2, 64), time=generator.uniform(0, 1, 64))
        found.append([
            engine.smooth(a), engine.mix(a, b, 0.3), engine.blend([a, b], [1, 2]), engine.add(a, b, weight=0.5),
            engine.local_to_model(a, [None, 0, 1, 2, 3]), *engine.follow(np.arange(9), generator.normal(size=(9, 3)), fps=30),
            crowd.evaluate(), crowd.evaluate("rotations"),
        ])
    for one, other in zip(*found):
        assert one.tobytes() == other.tobytes()
