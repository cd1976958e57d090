"""The package's documentation is true: docstrings, README, guide, and types."""

from __future__ import annotations

import doctest
import importlib.util
import inspect
import os
import pathlib
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT, SHARED

import tumble

# The folder of the package, which also has its stubs.
PACKAGE = pathlib.Path(tumble.__file__).parent


def documented():
    """Everything that is public, by its full name."""
    yield "tumble", tumble
    for name in tumble.__all__:
        value = getattr(tumble, name)
        yield f"tumble.{name}", value
        if inspect.isclass(value):
            for part, member in vars(value).items():
                if isinstance(member, staticmethod):
                    member = member.__func__
                if not part.startswith("_") and getattr(member, "__doc__", None):
                    yield f"tumble.{name}.{part}", member


ALL = dict(documented())


@pytest.mark.parametrize("name", ALL)
def test_examples_in_docstrings(name, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    test = doctest.DocTestParser().get_doctest(inspect.getdoc(ALL[name]), {}, name, name, 0)
    output = []
    failed, _ = doctest.DocTestRunner().run(test, out=output.append)
    assert not failed, "".join(output)


def test_everything_public_is_documented_with_an_example():
    for name in tumble.__all__:
        assert inspect.getdoc(getattr(tumble, name)), name
    results = ["ArrayDifference", "ChannelDifference", "ClipDifference", "PathErrors"]
    results += ["JointDifference", "PathStatistics", "Reduction", "Route", "Spread", "Walk"]
    results += ["Chunk", "Chunks", "PassedEvent", "Verification"]
    exempt = {f"tumble.{name}" for name in results}
    for name, value in ALL.items():
        is_callable = inspect.isclass(value) or callable(value)
        if is_callable and name not in exempt:
            small = {"translations", "scales"}
            assert ">>>" in value.__doc__ or name.split(".")[-1] in small, name


@pytest.mark.parametrize("document", ["README.md", "python/README.md", "docs/python.md", "docs/robots.md", "docs/features.md", "docs/start.md", "docs/training.md"])
def test_examples_in_documents(document, monkeypatch, tmp_path):
    """Their blocks of Python run one after another, in a folder with a file of each kind. Those for torch run where it
    is installed."""
    text = (ROOT / document).read_text(encoding="utf-8")
    kinds = "(?: torch)?" if importlib.util.find_spec("torch") else ""
    blocks = re.findall(rf"^```python{kinds}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert blocks
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(5)
    poses = 0.1 * rng.normal(size=(40, 3 * 22))
    np.savez("walk.npz", poses=poses, trans=np.zeros((40, 3)), mocap_framerate=np.float64(120))
    pathlib.Path("amass").mkdir()
    for index in range(3):
        many = np.cumsum(0.02 * rng.normal(size=(200, 3 * 52)), axis=0)
        np.savez(f"amass/{index}.npz", poses=many, trans=np.zeros((200, 3)), mocap_framerate=np.float64(120))
    np.savez("amass/shape.npz", betas=np.zeros(16), gender="neutral")
    np.save("offsets.npy", 0.1 * rng.normal(size=(52, 3)))
    pathlib.Path("robot.xml").write_text(ROBOT)
    for file in ("data/walk.bvh", "data/arm.xml"):
        pathlib.Path(file).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / file, file)
    still = np.tile([1.0, 0, 0, 0], (31, 1))
    np.savez("keys.npz", joint_pos=rng.normal(size=(31, 1)), root_pos=np.zeros((31, 3)), root_quat=still)
    if SHARED.is_dir():
        shutil.copy(SHARED / "gltf" / "Fox.glb", "fox.glb")
    else:
        keys = rng.normal(size=(3, 5, 4))
        keys /= np.linalg.norm(keys, axis=-1, keepdims=True)
        tumble.save("fox.glb", tumble.Clip(np.arange(5) / 24, keys, name="Run"))
    if shutil.which("true"):
        pytest.importorskip("matplotlib").use("Agg")
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, document, "exec"), names)


def test_the_reference_is_that_of_the_package():
    """docs/python-reference.md; `UPDATE_EXPECTED=1` writes it."""
    script = [sys.executable, ROOT / "scripts" / "python_reference.py"]
    written = subprocess.run(script, capture_output=True, check=True).stdout.decode()
    page = ROOT / "docs" / "python-reference.md"
    if "UPDATE_EXPECTED" in os.environ:
        page.write_text(written, encoding="utf-8")
    assert written == page.read_text(encoding="utf-8"), "UPDATE_EXPECTED=1 writes docs/python-reference.md"


def test_the_stubs_have_the_docstrings():
    """Editors show the texts of the stubs. `UPDATE_EXPECTED=1` writes them."""
    path = ROOT / "scripts" / "python_stub_docs.py"
    specification = importlib.util.spec_from_file_location("python_stub_docs", path)
    script = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(script)
    found = script.STUBS.read_text(encoding="utf-8")
    expected = script.with_docs(found, script.first_paragraph)
    if "UPDATE_EXPECTED" in os.environ:
        script.STUBS.write_text(expected, encoding="utf-8")
        found = expected
    assert found == expected, "UPDATE_EXPECTED=1 writes the texts of the stubs"
    assert found.count('"""') > 300
    # A text that differs is found.
    changed = script.with_docs(found, lambda name: "Another text." if name == "load" else None)
    assert changed != found and 'def load(' in changed and '"""Another text."""' in changed


ROBOT = """<mujoco><worldbody><body name="pelvis"><freejoint name="root"/>
<body name="shin"><joint name="knee"/></body></body></worldbody></mujoco>"""


def mypy(*arguments, cwd):
    environment = {**os.environ, "MYPY_CACHE_DIR": os.devnull}
    command = [sys.executable, "-m", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=cwd, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr


def test_types_are_those_of_the_stubs(tmp_path):
    # Most of the time is spent reading the types of other packages; the checks below reuse these.
    settings = tmp_path / "mypy.ini"
    settings.write_text("[mypy]\n[mypy-numpy.*,scipy.*,matplotlib.*,pyarrow.*]\nfollow_imports = skip\nfollow_imports_for_stubs = True\n")
    mypy("mypy.stubtest", "tumble", "--mypy-config-file", str(settings), cwd=tmp_path)


def test_the_package_and_its_users_pass_strict_checks(tmp_path):
    (tmp_path / "user.py").write_text(USER, encoding="utf-8")
    page = (ROOT / "docs" / "training.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    (tmp_path / "trainer.py").write_text("\n".join(blocks), encoding="utf-8")
    mypy("mypy", "--strict", "-p", "tumble", "-m", "user", "-m", "trainer", cwd=tmp_path)


USER = '''
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

import tumble

engine = tumble.Engine("cpu")
clip = tumble.Clip([0.0, 1.0], np.zeros((2, 2, 4)), names=["a", "b"], order="wxyz")
found: NDArray[np.float32] = engine.evaluate(clip, fps="30000/1001", method="slerp")
found = engine.velocity(clip, at=np.linspace(0, 1, 9), axes="world", out=found)
found = tumble.evaluate([0.0, 1.0], [[0, 0, 0, 1], [0, 0, 1, 0]], fps=Fraction(24), start=0.5)
found = clip.evaluate(times=[[0.0, 0.5], [0.0, 1.0]])
rate: Fraction | None = clip.rate
for chunk in engine.stream(clip, fps=24, chunk=1000):
    found = chunk.rotations
for one in tumble.load("walk.glb", source_fps=30):
    tumble.save("walk.npz", one, fps=60, sequence="ZXY")
try:
    halves = engine.evaluate(clip, fps=24, dtype=np.float16)
    found = engine.rotation_vectors(clip, fps=24, out=engine.encoded(clip, "euler", fps=24, sequence="ZXY"))
    kept: tumble.DeviceArray = engine.encoded(clip, "matrix-3x4", fps=24, major="column", device_array=True)
    found = engine.smooth(engine.blend([found, found], [1, 2]), low_pass=6, fps=24)
    found = engine.add(engine.mix(found, found, 0.5), found, reference=[0, 0, 0, 1])
    found = engine.local_to_model(found, [None, 0], np.zeros((2, 3)), scales=[None, found])
    positions, found = engine.follow(None, [[0, 0, 0], [1, 0, 0]], duration=1, fps=24, ends="natural")
    rotation = tumble.compare(clip, tumble.reduce(clip, curve="cubic").clip).rotation
    angle: float = rotation.largest if rotation is not None else 0.0
    differing: int = tumble.compare(found, found).differing
    scale: float = tumble.path_errors(clip, clip, align="sim3", rpe="1s").scale
    crowd = tumble.Crowd([clip], 100, parents=[None, None])
    crowd.set(np.arange(100), 0, time=np.linspace(0, 1, 100), wrap="mirror")
    found = crowd.evaluate("rotations")
    surface = tumble.Surface(np.zeros((3, 3)), [[0, 1, 2]])
    ways = [way for way in surface.routes([[0, 0, 0]], [[1, 0, 0]], by="edges") if way is not None]
    walks: list[tumble.Walk | None] = tumble.walk(ways, speed=1, radius=0.25)
    tumble.load("walk.glb")["Run"].view(fps=30).save("run.html")
    library = tumble.MotionLibrary.load("amass/*.npz", fps=30, tracks=range(22), on_error="skip", packed=True)
    ids, at = library.draw(512, np.random.default_rng(1))
    state = library.sample(ids, at)
    found = state.positions[0]
    found = library.sample(ids, at, out=state).world_rotations[..., 0, :]
    found = library.sample(ids, at, arrays=["rotations"], rotations="6d").rotations[0]
    found = library.sample_windows(ids, at, 10, fps=30).velocities[:, 0]
    found = library.shard(0, 2).sample(0, 0.5, arrays=["positions", "velocities"]).velocities
    other: tumble.MotionLibrary = tumble.MotionLibrary([clip], device="cpu")
    on_card = tumble.MotionLibrary.open("motions.npz", device="vulkan")
    kept = on_card.sample(ids, at, finite=True).positions
    kept = on_card.shard(0, 2).sample_windows(ids, at, 10, fps=30, arrays=["rotations"]).rotations
    kept = tumble.MotionLibrary.load("amass/*.npz", device=engine).sample(0, 0.5).angular_velocities
except tumble.InputError as error:
    print(error.code, error.line, error.pointer)
'''
