"""Files in and out, and the program."""

from __future__ import annotations

import hashlib
import base64
import json
import pathlib
import subprocess
import sys
import warnings

import numpy as np
import pytest
from conftest import ROOT, unit

import tumble

PENDULUM = ROOT / "data" / "pendulum.dat"


def program(*arguments, code=0):
    """Runs `python -m tumble`; gives what it prints."""
    command = [sys.executable, "-m", "tumble", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == code, done.stderr
    return done


def digest(data):
    return hashlib.sha256(data).hexdigest()


@pytest.mark.parametrize("method", ["slerp", "bessel-overhauser", "c2"])
def test_the_same_bits_as_the_program(tmp_path, method):
    out = tmp_path / "program.npy"
    program("eval", PENDULUM, "-m", method, "--fps", "30000/1001", "-o", out)
    clip = tumble.load(PENDULUM).clip
    found = clip.evaluate(fps="30000/1001", method=method)
    assert digest(found.tobytes()) == digest(np.load(out).tobytes())
    saved = tmp_path / "own.npy"
    tumble.save(saved, clip, fps="30000/1001", method=method)
    assert saved.read_bytes() == out.read_bytes()


@pytest.mark.parametrize("ending", ["npy", "csv", "npz", "bvh", "parquet", "arrow", "glb"])
def test_every_format_as_the_program_writes_it(tmp_path, ending):
    theirs, ours = tmp_path / f"theirs.{ending}", tmp_path / f"ours.{ending}"
    program("eval", PENDULUM, "--fps", "30", "-o", theirs)
    tumble.save(ours, tumble.load(PENDULUM), fps=30)
    if ending in ("npy", "csv", "bvh"):
        assert ours.read_bytes() == theirs.read_bytes()
    if ending != "npy":
        a, b = tumble.load(ours).clip, tumble.load(theirs).clip
        assert len(a) == len(b) == 4 and a.key_count == b.key_count
        assert all(np.array_equal(a.keys(i), b.keys(i)) for i in range(4))


def test_clips_come_back_from_every_format(tmp_path, rng):
    clip = tumble.Clip(
        np.arange(5) / 30,
        unit(rng, 3, 5),
        name="walk",
        names=["hip", "knee", "foot"],
        parents=[None, 0, 1],
        offsets=[[0, 1, 0], [0, -0.5, 0], [0, -0.5, 0]],
    )
    for ending in ["glb", "gltf", "bvh", "npz", "parquet", "arrow", "csv"]:
        path = tmp_path / f"walk.{ending}"
        tumble.write(path, clip)
        again = tumble.read(path).clip
        assert [name for name in again.names if name in clip.names] == clip.names, ending
        for name in clip.names:
            cosine = (clip.keys(name) * again.keys(name)).sum(axis=-1)
            assert np.abs(np.abs(cosine) - 1).max() < 1e-6, (ending, name)
            assert np.allclose(again.times(name), clip.times(name)), ending
    one = tumble.Clip([0.0, 0.1], unit(rng, 2), translations=[[[0, 0, 0], [1, 2, 3]]])
    tumble.save(tmp_path / "camera.tum", one)
    times, positions = tumble.load(tmp_path / "camera.tum").clip.translations(0)
    assert times.tolist() == [0.0, 0.1] and positions[1].tolist() == [1, 2, 3]


def test_files_are_mappings(shared):
    fox = tumble.load(shared / "gltf" / "Fox.glb")
    assert fox.names == ["Survey", "Walk", "Run"] and len(fox) == 3
    run = fox["Run"]
    assert fox[2].name == fox[-1].name == run.name == "Run" and "Run" in fox
    assert [clip.name for clip in fox] == fox.names
    assert run.rate is None and len(run) == len(run.names)
    with pytest.raises(tumble.InputError, match="Survey, Walk, Run"):
        fox.clip
    with pytest.raises(KeyError, match="Survey, Walk, Run"):
        fox["Jump"]
    with pytest.raises(IndexError):
        fox[3]
    assert run.evaluate(fps=60).shape == (len(run), run.frames(60), 4)
    positions, _ = tumble.Engine().world(run, fps=60)
    assert np.isfinite(positions).all()


def test_positions_of_maps_keep_their_digits(tmp_path):
    file = tmp_path / "map.tum"
    file.write_text("0 458074.604 5429380.172 162.5 0 0 0 1\n1 458074.614 5429380.182 162.5 0 0 0 1\n")
    clip = tumble.load(file).clip
    assert clip.origins.tolist() == [[458075.0, 5429380.0, 163.0]]
    positions, rotations = tumble.Engine("cpu").world(clip, fps=10)
    assert (positions.dtype, rotations.dtype) == (np.float64, np.float32)
    expected = np.linspace([458074.604, 5429380.172, 162.5], [458074.614, 5429380.182, 162.5], 11)
    assert np.abs(positions[0] - expected).max() < 1e-6
    # Arrays are stored in the same way.
    times, keys = clip.translations(0)
    made = tumble.Clip(times, [np.tile([0, 0, 0, 1], (2, 1))], translations=[keys])
    assert made.origins.tolist() == clip.origins.tolist()
    translations, _, _ = tumble.Engine("cpu").poses(made, at=[0.5])
    assert np.abs(translations[0, 0] - expected[5]).max() < 1e-6
    tumble.save(tmp_path / "out.npz", made, fps=10)
    assert np.load(tmp_path / "out.npz")["translations"].dtype == np.float64
    assert tumble.Clip([0.0], [[[0, 0, 0, 1]]]).origins is None


def test_a_file_that_is_missing_is_not_found(tmp_path):
    with pytest.raises(FileNotFoundError, match="missing.glb: error.E001") as found:
        tumble.load(tmp_path / "missing.glb")
    assert isinstance(found.value, tumble.InputError) and found.value.code == "E001"
    with pytest.raises(tumble.InputError, match="is a directory") as found:
        tumble.load(tmp_path)
    assert not isinstance(found.value, FileNotFoundError)


@pytest.mark.parametrize("track", ["track", "joint", "body"])
@pytest.mark.parametrize("clip", ["clip", "clip_id", "motion_id"])
def test_columns_that_tell_apart_are_known(track, clip, tmp_path):
    rows = ["time,qw,qx,qy,qz," + f"{track},{clip}"]
    for name in ("walk", "run"):
        for joint in ("hip", "knee"):
            rows += [f"{time},1,0,0,0,{joint},{name}" for time in (0.0, 0.5)]
    (tmp_path / "long.csv").write_text("\n".join(rows) + "\n")
    file = tumble.load(tmp_path / "long.csv")
    assert file.names == ["walk", "run"] and file["run"].names == ["hip", "knee"]


def test_messages_name_keywords(tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("stamp,x,y,z,w\n0,0,0,0,1\n")
    with pytest.raises(tumble.InputError, match='name the time column with map="time=NAME", or give source_fps=FPS'):
        tumble.load(path)
    path.write_text("time,x,y,z,w\n0,0,0,0,1\n0,1,0,0,0\n")
    with pytest.raises(tumble.InputError, match='duplicates="first" or "last" keeps one'):
        tumble.load(path)
    np.savez(tmp_path / "own.npz", foo=np.zeros((10, 4)))
    with pytest.raises(tumble.InputError, match='say what they are with map="rotations=ARRAY:wxyz,time=ARRAY"'):
        tumble.load(tmp_path / "own.npz")


def test_a_list_of_more_numbers_is_not_cut_without_a_word(tmp_path):
    arrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path = tmp_path / "state.parquet"
    state = [[0.0] * 3 + [0, 0, 0, 1.0] + [0.5] * 13] * 5
    parquet.write_table(arrow.table({"time": np.arange(5.0), "state": state}), path)
    with pytest.raises(tumble.InputError, match=r"has 20 numbers, and 4 are needed; say which"):
        tumble.load(path, map="hand=state")
    clip = tumble.load(path, map="hand=state[3:7]").clip
    assert np.array_equal(clip.keys("hand")[0], [0, 0, 0, 1])


def test_bodies_get_their_offsets(tmp_path):
    path = tmp_path / "walk.npz"
    poses = np.zeros((5, 3 * 22))
    np.savez(path, poses=poses, trans=np.zeros((5, 3)), mocap_framerate=np.float64(30))
    offsets = np.arange(66.0).reshape(22, 3)
    clip = tumble.load(path, offsets=offsets).clip
    assert np.array_equal(clip.offsets[1:], offsets[1:].astype(np.float32))
    with pytest.raises(tumble.InputError, match="offsets: the shape is"):
        tumble.load(path, offsets=[1, 2, 3])
    with pytest.raises(tumble.InputError, match="offsets: .*walk.npz"):
        tumble.load(path, offsets=offsets[:3])


def test_a_skeleton_that_is_left_out_is_told(tmp_path):
    keys = np.tile([0, 0, 0, 1], (2, 3, 1))
    clip = tumble.Clip([0.0, 1.0, 2.0], keys, parents=[None, 0])
    with pytest.warns(tumble.InputWarning, match="left out: the skeleton"):
        tumble.save(tmp_path / "x.npy", clip, fps=30)


def test_tables_with_gaps_are_bridged_on_request(tmp_path):
    file = tmp_path / "gaps.csv"
    file.write_text("time,x,y,z,w\n0,0,0,0,1\n1,,,,\n2,0,0,0.6,0.8\n")
    with pytest.raises(tumble.InputError, match="bridge_gaps=True"):
        tumble.load(file)
    with pytest.warns(tumble.InputWarning, match="W401"):
        clip = tumble.load(file, bridge_gaps=True).clip
    assert clip.times(0).tolist() == [0.0, 2.0]


def test_baked_files_are_those_of_the_program(shared, tmp_path):
    source = shared / "gltf" / "Fox.glb"
    program("eval", source, "--fps", "60", "-o", tmp_path / "program.glb")
    tumble.save(tmp_path / "own.glb", tumble.load(source), fps=60)
    assert (tmp_path / "own.glb").read_bytes() == (tmp_path / "program.glb").read_bytes()


def test_channels_of_different_samplers(shared):
    mixed = tumble.load(shared / "gltf" / "interpolation_test.gltf")
    for clip in mixed:
        found = clip.evaluate(fps=30)
        assert found.shape == (len(clip), clip.frames(30), 4)
        _, rotations, _ = tumble.Engine().poses(clip, fps=30)
        assert np.abs(np.abs((found * rotations).sum(axis=-1)) - 1).max() < 1e-6
        assert tumble.Engine("cpu").verify(clip, fps=30).verdict == "reference-only"


def test_all_sample_files_are_read_or_refused_with_a_reason(shared):
    read, refused = 0, 0
    for path in sorted(shared.rglob("*")):
        if path.suffix not in {".glb", ".gltf", ".bvh", ".npz", ".parquet", ".arrow", ".txt"}:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", tumble.InputWarning)
            try:
                clips = list(tumble.load(path))
            except tumble.InputError as error:
                assert error.code and error.code in str(error) and error.file == str(path)
                refused += 1
                continue
        for clip in clips:
            assert np.isfinite(clip.evaluate(at=clip.span)).all()
        read += 1
    assert read > 60 and refused > 20


def test_errors_have_codes_and_places(tmp_path):
    path = tmp_path / "bad.dat"
    path.write_text("# 1 3.0\n0 1 0 0 0\n1 1 0 nan 0\n")
    with pytest.raises(tumble.InputError) as caught:
        tumble.load(path)
    error = caught.value
    assert (error.code, error.file, error.line, error.column) == ("E022", str(path), 3, 7)
    assert str(error).startswith(f"{path}:3:7: error[E022]")
    said = program("info", path, code=4).stderr
    assert str(error) in said
    glb = tmp_path / "bad.gltf"
    glb.write_text(json.dumps({"asset": {"version": "2.0"}, "animations": [{"channels": 3}]}))
    with pytest.raises(tumble.InputError) as caught:
        tumble.load(glb)
    assert caught.value.pointer and caught.value.pointer.startswith("/animations/0")
    assert caught.value.line is None


def test_warnings_are_warnings(tmp_path):
    path = tmp_path / "odd.dat"
    path.write_bytes(b"\xef\xbb\xbf# 1 3.0\n0 1 0 0 0\n1 0.9 0 0 0\n")
    with pytest.warns(tumble.InputWarning) as caught:
        tumble.load(path)
    codes = {warning.message.code for warning in caught}
    assert "W001" in codes
    with warnings.catch_warnings():
        warnings.simplefilter("error", tumble.InputWarning)
        with pytest.raises(tumble.InputWarning):
            tumble.load(path)


def test_arrays_that_are_not_read_are_named(tmp_path, rng):
    path = tmp_path / "walk.npz"
    walk = {"poses": rng.normal(size=(3, 72)), "mocap_framerate": np.array(30.0)}
    usual = {"dmpls": np.zeros((3, 8)), "betas": np.zeros(10), "gender": np.array("male")}
    np.savez(path, **walk, **usual, gaze=np.zeros((3, 2)))
    with pytest.warns(tumble.InputWarning, match="not read: `gaze`; ") as caught:
        tumble.load(path)
    assert [warning.message.code for warning in caught] == ["W306"]
    assert caught[0].filename == __file__
    np.savez(path, **walk, **usual)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tumble.load(path)


def test_a_call_warns_once_of_a_kind_at_the_line_that_made_it(tmp_path, rng):
    """A library of many files, whose `load` calls another function of the package."""
    for index in range(10):
        np.savez(tmp_path / f"{index}.npz", poses=np.zeros((3, 72)), fps=30.0, gaze=np.zeros(2))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        tumble.MotionLibrary.load(str(tmp_path / "*.npz"))
    [warning] = [warning for warning in caught if "W306" in str(warning.message)]
    assert warning.filename == __file__ and warning.message.code == "W306"
    lines = str(warning.message).splitlines()
    assert len(lines) == 9 and lines[-1] == "and 2 more of this kind"
    assert all(f"{index}.npz: warning[W306]: not read: `gaze`" in line for index, line in enumerate(lines[:8]))


def test_archives_that_numpy_writes_again_are_read(tmp_path, rng):
    turns = unit(rng, 2, 5)
    clip = tumble.Clip(np.arange(5) / 30, turns, names=["hip", "knee"], parents=[None, 0], offsets=[[0, 1, 0]] * 2)
    tumble.save(tmp_path / "clip.npz", clip)
    library = tumble.MotionLibrary([clip], names=["walk"])
    library.save(tmp_path / "library.npz")
    expected = library.sample([0, 0], [0.01, 0.1])
    for write in (np.savez, np.savez_compressed):
        for name in ("clip", "library"):
            with np.load(tmp_path / f"{name}.npz") as archive:
                write(tmp_path / f"{name}-again.npz", **archive)
        again = tumble.load(tmp_path / "clip-again.npz").clip
        assert again == tumble.load(tmp_path / "clip.npz").clip
        for mmap in (True, False):
            opened = tumble.MotionLibrary.open(tmp_path / "library-again.npz", mmap=mmap)
            assert opened.names == ["walk"] and opened.sample([0, 0], [0.01, 0.1]) == expected


def scene(path):
    """A glTF of two animations with a mesh, a camera, weights and a pointer beside what moves."""
    numbers = [0.0, 1.0, 0, 0, 0, 1, 0, 0, 1, 0, 0.0, 0.5, 0, 0, 0, 1, 0, 0, 0, 1, 0]
    data = np.array(numbers, np.float32).tobytes()
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    views = [(0, 8), (8, 32), (40, 8), (48, 36)]
    kinds = [("SCALAR", 2), ("VEC4", 2), ("SCALAR", 2), ("VEC3", 3)]
    pointer = {"KHR_animation_pointer": {"pointer": "/cameras/0/perspective/yfov"}}
    turning = {"sampler": 0, "target": {"node": 0, "path": "rotation"}}
    others = [
        {"sampler": 1, "target": {"node": 0, "path": "weights"}},
        {"sampler": 1, "target": {"path": "pointer", "extensions": pointer}},
    ]
    samplers = [{"input": 0, "output": 1}, {"input": 0, "output": 2}]
    part = {"attributes": {"POSITION": 3}, "targets": [{"POSITION": 3}]}
    path.write_text(json.dumps({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_animation_pointer"],
        "buffers": [{"uri": uri, "byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": size} for at, size in views],
        "accessors": [
            {"bufferView": view, "componentType": 5126, "type": kind, "count": count}
            for view, (kind, count) in enumerate(kinds)
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "meshes": [{"primitives": [part], "weights": [0]}],
        "nodes": [{"name": "head", "mesh": 0, "camera": 0}],
        "animations": [
            {"name": "Nod", "channels": [turning, *others], "samplers": samplers},
            {"name": "Turn", "channels": [turning], "samplers": samplers},
        ],
    }))


def test_one_of_several_clips_has_to_be_chosen(tmp_path):
    path = tmp_path / "scene.gltf"
    scene(path)
    file = tumble.load(path)
    with pytest.raises(tumble.InputError) as caught:
        file.clip  # noqa: B018
    words = 'has 2 clips: Nod, Turn; choose one by its name or index: `file["Nod"]` or `file[0]`'
    assert str(caught.value) == f"{path}: {words}"
    assert file["Nod"].keys("head").shape == file[0].keys("head").shape
    with pytest.raises(KeyError, match="there is no clip `Nodd`; there are Nod, Turn; did you mean `Nod`"):
        file["Nodd"]


BESIDE = "meshes, cameras, extensionsUsed, channels of `pointer`"


def test_what_a_file_holds_beside_its_clips_is_named_where_it_is_left_out(tmp_path):
    path = tmp_path / "scene.gltf"
    scene(path)
    file = tumble.load(path)

    def said(name, clips, **options):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            tumble.save(tmp_path / name, clips, **options)
        return [line for it in caught for line in str(it.message).splitlines()]

    for options in [{}, {"fps": 30}]:
        found = said("nod.bvh", file["Nod"], **options)
        ours = [text for text in found if text.startswith(str(path))]
        assert len(ours) == 1, found
        assert ours[0].endswith(f"warning[W208]: bvh cannot store this, left out: {BESIDE}")
    # The program prints the same words.
    printed = program("convert", path, "--animation", "Nod", "-o", tmp_path / "printed.bvh").stderr
    assert f"bvh cannot store this, left out: {BESIDE}" in printed
    # A file that is written in its format keeps everything; a result with only one of the clips is a new file.
    assert said("all.glb", file) == [] and said("baked.glb", file["Nod"], fps=30) == []
    assert len(tumble.load(tmp_path / "baked.glb")) == 2
    # A new file has no mesh whose weights could be animated.
    lost = "GLB cannot store this, left out: the scalars"
    found = said("one.glb", file["Nod"])
    assert [text.split("]: ")[1] for text in found] == [
        lost,
        f"some of its clips make a new file; not copied: {BESIDE}"
    ]
    scaled = tumble.load(path, scale=2)
    found = said("scaled.glb", scaled)
    assert [text.split("]: ")[1] for text in found] == [
        lost,
        f"other units or axes make a new file; not copied: {BESIDE}"
    ]
    other = tmp_path / "other.gltf"
    scene(other)
    found = said("both.glb", [file["Nod"], tumble.load(other)["Turn"]])
    assert found.pop(0) == f"{tmp_path / 'both.glb'}: warning[W208]: {lost}"
    assert [text.split(";")[0] for text in found] == [
        f"{path}: warning[W208]: clips of several files make a new file",
        f"{other}: warning[W208]: clips of several files make a new file",
    ]


def test_other_keys_go_into_the_file_of_a_clip(tmp_path):
    path = tmp_path / "scene.gltf"
    scene(path)
    clip = tumble.load(path)["Turn"]
    calm = tumble.Engine("cpu").smooth(clip, fps=30)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tumble.save(tmp_path / "calm.gltf", calm)
    again = json.loads((tmp_path / "calm.gltf").read_text())
    assert "meshes" in again and len(again["animations"][0]["channels"]) == 3
    found = tumble.load(tmp_path / "calm.gltf")
    assert np.array_equal(found["Turn"].keys(0), calm.keys(0)) and len(found["Nod"].keys(0)) == 2
    # A clip that was read with other offsets is written with these, instead of the file's bytes.
    walk = tmp_path / "walk.npz"
    np.savez(walk, poses=np.zeros((4, 66)), trans=np.zeros((4, 3)), mocap_framerate=30.0)
    offsets = np.arange(66.0).reshape(22, 3)
    placed = tumble.load(walk, offsets=offsets)
    for suffix in ["npz", "glb"]:
        tumble.save(tmp_path / f"placed.{suffix}", placed)
        assert np.array_equal(tumble.load(tmp_path / f"placed.{suffix}").clip.offsets, placed.clip.offsets)
    # Offsets in the file are replaced, also in a result of the same format, with a warning.
    with pytest.warns(tumble.InputWarning, match=r"offsets of 2\d joints in the file are replaced"):
        far = tumble.load(tmp_path / "placed.glb", offsets=2 * offsets)
    tumble.save(tmp_path / "far.glb", far)
    assert np.array_equal(tumble.load(tmp_path / "far.glb").clip.offsets[1:], 2 * placed.clip.offsets[1:])


def test_outputs_that_cannot_be_written(tmp_path, rng):
    clip = tumble.Clip([0.0, 1.0], unit(rng, 2))
    with pytest.raises(tumble.OutputError) as caught:
        tumble.save(tmp_path / "none" / "a.npz", clip)
    assert isinstance(caught.value, OSError) and "does not exist" in str(caught.value)
    path = tmp_path / "a.npz"
    tumble.save(path, clip)
    tumble.save(path, clip)
    with pytest.raises(tumble.OutputError, match="exists"):
        tumble.save(path, clip, overwrite=False)
    with pytest.raises(tumble.OutputError, match="is the input"):
        tumble.save(path, tumble.load(path))
    for wrong in ["a.txt", "a"]:
        with pytest.raises(tumble.InputError, match="format"):
            tumble.save(tmp_path / wrong, clip)
    with pytest.raises(tumble.InputError, match="give `fps`"):
        tumble.save(tmp_path / "a.npy", clip)
    with pytest.raises(TypeError):
        tumble.save(path, 3)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["a.npz"]


def test_what_files_do_not_say(tmp_path, rng):
    keys = unit(rng, 6)
    path = tmp_path / "keys.npz"
    np.savez(path, q=np.roll(keys, 1, axis=-1), t=np.arange(6) / 50)
    with pytest.raises(tumble.InputError) as caught:
        tumble.load(path)
    assert caught.value.code == "E310"
    clip = tumble.load(path, map="rotations=q:wxyz,time=t").clip
    assert np.array_equal(clip.keys(0), keys)
    assert clip.rate == 50
    for wrong in [dict(format="doc"), dict(up="x"), dict(scale=0), dict(time_unit="h")]:
        with pytest.raises(tumble.InputError):
            tumble.load(path, **wrong)


def test_units_and_axes(shared):
    path = shared / "bvh" / "example.bvh"
    plain, scaled = tumble.load(path).clip, tumble.load(path, scale=0.01).clip
    assert np.allclose(scaled.offsets, plain.offsets * 0.01)
    rotated = tumble.load(path, up="z").clip
    before, _ = tumble.Engine().world(plain, at=0.0)
    after, _ = tumble.Engine().world(rotated, at=0.0)
    assert np.allclose(after, before[..., [0, 2, 1]] * [1, -1, 1], atol=1e-4)


def test_python_minus_m_is_the_program():
    assert program("--version").stdout == f"tumble {tumble.__version__}\n"
    assert "slerp" in program("methods").stdout
    assert "Usage: tumble" in program("eval", code=2).stderr
    assert "nowhere.dat" in program("info", "nowhere.dat", code=4).stderr
    # The process that loads the drivers also runs Python.
    named = program("devices").stdout
    assert all(name in named for name in tumble.devices())


def test_the_script_is_the_program():
    script = pathlib.Path(sys.executable).with_name("tumble")
    done = subprocess.run([script, "--version"], capture_output=True, text=True, timeout=60)
    assert done.stdout == f"tumble {tumble.__version__}\n"


def test_times_since_1970_may_be_asked_for(tmp_path):
    file = tmp_path / "keys.csv"
    file.write_text("t,x,y,z,w\n1700000000.25,0,0,0,1\n1700000000.75,0,0,0.6,0.8\n1700000001.25,0,0,1,0\n")
    clip = tumble.load(file).clip
    assert clip.time_offset == 1_700_000_000
    counted = clip.evaluate(at=[0.5, 0.75], method="slerp")
    assert np.array_equal(clip.evaluate(at=[1700000000.5, 1700000000.75], method="slerp"), counted)
    assert np.array_equal(counted[0, 1], np.float32([0, 0, 0.6, 0.8]))
    part = clip.evaluate(fps=4, start=0.5, end=1, method="slerp")
    of_file = clip.evaluate(fps=4, start=1700000000.5, end=1700000001, method="slerp")
    assert np.array_equal(part, of_file)
    times = tmp_path / "out.csv"
    tumble.save(times, clip, at=[1700000000.5], method="slerp")
    assert times.read_text().splitlines()[1].startswith("0,1700000000.5,")


def test_trajectories_have_their_times_apart(tmp_path, rng):
    times = np.cumsum(rng.uniform(0.05, 0.2, 20))
    clip = tumble.Clip(times, unit(rng, 20))
    path, apart = tmp_path / "path.kitti", tmp_path / "times.txt"
    with pytest.raises(tumble.InputError, match="times_out"):
        tumble.save(path, clip)
    tumble.save(path, clip, times_out=apart)
    found = tumble.load(path, source_times=apart).clip
    assert np.allclose(np.loadtxt(apart), times, atol=1e-9)
    assert np.allclose(np.abs((found.keys(0) * clip.keys(0)).sum(-1)), 1, atol=1e-6)
    with pytest.raises(tumble.InputError, match="both say when"):
        tumble.load(path, source_times=apart, source_fps=10)
    with pytest.raises(tumble.InputError, match="times_out is for kitti"):
        tumble.save(tmp_path / "path.tum", clip, times_out=apart)
    tumble.save(tmp_path / "path.euroc", clip)
    assert tumble.load(tmp_path / "path.euroc").clip.key_count == 20


def test_a_small_gltf_is_near(tmp_path, rng):
    clip = tumble.Clip(np.arange(200) / 30, unit(rng, 200))
    sizes = []
    for options in [{}, {"quantize": True}, {"quantize": True, "meshopt": True}]:
        path = tmp_path / "clip.glb"
        tumble.save(path, clip, **options)
        sizes.append(path.stat().st_size)
        dots = np.abs((tumble.load(path).clip.keys(0) * clip.keys(0)).sum(-1))
        assert np.all(dots > 1 - 1e-6)
    assert sizes[1] < sizes[0] and sizes[2] < sizes[0]
    with pytest.raises(tumble.InputError, match="quantize is for glTF"):
        tumble.save(tmp_path / "clip.bvh", clip, quantize=True)


@pytest.mark.parametrize("name", ["walk.parquet", "walk.arrow", "walk.npz", "walk.glb"])
def test_parents_and_offsets_come_back(tmp_path, rng, name, recwarn):
    keys = unit(rng, 3, 5)
    offsets = np.float32([[0, 1, 0], [0.1, -0.4, 0], [0, -0.4, 0]])
    clip = tumble.Clip(np.arange(5) / 30, keys, names=["hip", "knee", "foot"], parents=[None, 0, 1], offsets=offsets)
    tumble.save(tmp_path / name, clip)
    again = tumble.load(tmp_path / name).clip
    assert (again.names, again.parents) == (clip.names, clip.parents)
    assert np.array_equal(again.offsets, offsets)
    # The rows of a table may be in another order. A warning says that glTF connects keys by lines.
    messages = [str(warning.message) for warning in recwarn if issubclass(warning.category, tumble.InputWarning)]
    assert ["W208" in message for message in messages] == [True] * (name == "walk.glb")
    tumble.save(tmp_path / f"baked-{name}", clip, fps=60)
    assert tumble.load(tmp_path / f"baked-{name}").clip.parents == clip.parents


def test_csv_says_what_it_has_no_room_for(tmp_path, rng):
    clip = tumble.Clip([0.0, 1.0], unit(rng, 2, 2), layout="track", parents=[None, 0], offsets=np.ones((2, 3)))
    with pytest.warns(tumble.InputWarning, match="CSV cannot store this, left out: the skeleton"):
        tumble.save(tmp_path / "walk.csv", clip)
    assert tumble.load(tmp_path / "walk.csv").clip.parents is None


def test_clips_of_a_table_keep_skeletons_of_their_own(tmp_path, rng):
    clips = [
        tumble.Clip([0.0, 1.0], unit(rng, 2, 2), name=name, names=["a", "b"], parents=parents, offsets=np.ones((2, 3)))
        for name, parents in [("one", [None, 0]), ("other", [1, None])]
    ]
    tumble.save(tmp_path / "two.parquet", clips)
    assert [clip.parents for clip in tumble.load(tmp_path / "two.parquet")] == [[None, 0], [1, None]]


def test_columns_that_are_left_out_are_said(tmp_path):
    (tmp_path / "a.csv").write_text("time,x,y,z,w,note\n0,0,0,0,1,a\n1,0,0,0,1,b\n", encoding="utf-8")
    with pytest.warns(tumble.InputWarning, match="left out: `note`; if they are keys, name them with map"):
        tumble.load(tmp_path / "a.csv")
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    states = [[0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0, 9.0]] * 2
    table = pa.table({"timestamp": [0.0, 1.0], "state": states, "reward": [0.0, 0.0], "index": [0, 1]})
    parquet.write_table(table, tmp_path / "a.parquet")
    with pytest.warns(tumble.InputWarning, match=r": `reward`, `state\[0:3\]`, `state\[7:8\]`; if they are keys, name them with map"):
        tumble.load(tmp_path / "a.parquet", map="hand=state[3:7]")
    with pytest.warns(tumble.InputWarning, match=r": `reward`, `state\[7:8\]`; if they are keys, name them with map"):
        tumble.load(tmp_path / "a.parquet", map="hand=state[3:7],hand.translation=state[0:3]")


@pytest.mark.parametrize(
    ("name", "end_frame", "frames", "last"),
    [
        ("out.npz", None, 35, 1.125),
        ("out.glb", None, 35, 1.125),
        ("out.csv", None, 35, 1.125),
        ("out.dat", None, 35, 1.125),
        ("out.bvh", "hold", 35, 34 / 30),
        ("out.bvh", "leave-out", 34, 33 / 30),
        ("out.csv", "hold", 35, 34 / 30),
    ],
)
def test_clips_keep_their_end(tmp_path, name, end_frame, frames, last):
    door = [[0, 0, 0, 1], [0, 0, 0.6, 0.8], [0, 0, 0, 1]]
    clip = tumble.Clip([0.0, 0.5, 1.125], door, names=["door"])
    path = tmp_path / name
    tumble.save(path, clip, fps=30, method="slerp", end_frame=end_frame)
    found = tumble.load(path).clip
    assert found.duration == pytest.approx(last, abs=1e-7)
    assert found.key_count == frames
    if end_frame != "leave-out":
        assert found.evaluate(at=[found.duration])[0, 0] == pytest.approx([0, 0, 0, 1], abs=1e-6)


@pytest.mark.parametrize(
    ("end_frame", "frames", "last"),
    [(None, 35, 1.125), ("key", 35, 1.125), ("hold", 35, 34 / 30), ("leave-out", 34, 33 / 30)],
)
def test_a_kept_file_ends_as_it_is_asked_to(tmp_path, end_frame, frames, last):
    door = [[0, 0, 0, 1], [0, 0, 0.6, 0.8], [0, 0, 0, 1]]
    tumble.save(tmp_path / "door.glb", tumble.Clip([0.0, 0.5, 1.125], door, names=["door"]))
    tumble.save(tmp_path / "out.glb", tumble.load(tmp_path / "door.glb"), fps=30, end_frame=end_frame)
    found = tumble.load(tmp_path / "out.glb").clip
    assert found.key_count == frames
    assert found.duration == pytest.approx(last, abs=1e-7)


def test_an_end_that_is_held_is_told(tmp_path):
    clip = tumble.Clip([0.0, 1.125], [[0, 0, 0, 1], [0, 0, 0.6, 0.8]])
    with pytest.warns(tumble.InputWarning, match="W210"):
        tumble.save(tmp_path / "out.bvh", clip, fps=30)
    tumble.save(tmp_path / "out.npy", clip, fps=30)
    assert np.load(tmp_path / "out.npy").shape == (1, 34, 4)
    tumble.save(tmp_path / "out.npy", clip, fps=30, end_frame="hold")
    assert np.load(tmp_path / "out.npy").shape == (1, 35, 4)
    with pytest.raises(ValueError, match="no times; give end_frame"):
        tumble.save(tmp_path / "out.bvh", clip, fps=30, end_frame="key")
    with pytest.raises(ValueError, match="`end_frame` needs `fps`"):
        tumble.save(tmp_path / "out.glb", clip, end_frame="key")
