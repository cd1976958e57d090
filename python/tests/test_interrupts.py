"""Ctrl-C at random moments of every call that may take a tenth of a second.

A child process makes the calls, and another one sends the signals: a thread of the first could only send them
while the interpreter's lock is free. `SOAK=1` sends 100 to each call, else one is sent.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap

import pytest

SIGNALS = 100 if os.environ.get("SOAK") else 1

# The calls, by their names: the code, and the file that it writes, if any.
CALLS: dict[str, tuple[str, str | None]] = {
    "load with warnings": ("tumble.load(warns)", None),
    "load a refused file": ("refused(lambda: tumble.load(broken))", None),
    "load": ("tumble.load(large)", None),
    "load with times apart": ("refused(lambda: tumble.load(warns, source_times=times_file))", None),
    "make a clip": ("tumble.Clip(seconds, keys, names=names, parents=clip.parents, translations=moves)", None),
    "make a refused clip": ("refused(lambda: tumble.Clip([1, 0], [[0, 0, 0, 1]] * 2))", None),
    "arguments that run Python": ("tumble.Clip(Slow(), [[0, 0, 0, 1]] * 2, names=Slow('ab')[:1])", None),
    "an index that runs Python": ("clip.times(SlowIndex())", None),
    "a number that runs Python": ("clip.evaluate(at=0.5, tension=SlowIndex(), method='kochanek-bartels')", None),
    "memory that is shared": ("engine.evaluate(clip, at=[0.5], out=out)", None),
    "pickle a clip": ("pickle.loads(pickle.dumps(clip, 5))", None),
    "save": ("tumble.save('out.bvh', clip, fps=20, method='c2')", "out.bvh"),
    "save keys": ("tumble.save('keys.npz', clip)", "keys.npz"),
    "save with a warning": ("tumble.save('out.csv', clip, fps=5)", "out.csv"),
    "evaluate": ("engine.evaluate(clip, fps=60, method='c2')", None),
    "evaluate frames": ("engine.evaluate(clip, fps=60, layout='frame', method='c2')", None),
    "evaluate at constant speed": ("engine.evaluate(clip, fps=60, method='squad', speed='constant')", None),
    "evaluate lists of times": ("engine.evaluate(clip, at=[line[:n] for n in range(1, 25)])", None),
    "evaluate with a warning": ("tumble.evaluate(jumps_at, jumps, fps=5, method='c2')", None),
    "evaluate one long track": ("engine.evaluate(long, fps=1, speed='constant')", None),
    "velocity": ("engine.velocity(clip, fps=60, method='c2')", None),
    "velocity in the world": ("engine.velocity(clip, fps=60, axes='world')", None),
    "acceleration": ("engine.acceleration(clip, fps=60, axes='world')", None),
    "matrices": ("engine.matrices(clip, at=clip.times(0) + 0.001, method='shoemake')", None),
    "rotation vectors": ("engine.rotation_vectors(clip, fps=60)", None),
    "euler": ("engine.euler(clip, fps=60)", None),
    "poses": ("engine.poses(clip, fps=60, method='c2')", None),
    "world": ("engine.world(clip, fps=60, method='c2')", None),
    "verify": ("engine.verify(clip, fps=10, method='c2')", None),
    "stream": ("list(engine.stream(clip, fps=120, method='c2', layout='frame'))", None),
    "batch": ("engine.batch(rows, fps=60, method='c2')", None),
    "smooth": ("engine.smooth(keys, kernel='box:3', passes=500)", None),
    "smooth a clip": ("engine.smooth(clip, low_pass=6)", None),
    "blend": ("engine.blend([keys, keys, keys])", None),
    "mix": ("engine.mix(keys, keys, 0.5)", None),
    "add": ("engine.add(keys, keys, weight=0.5)", None),
    "local_to_model": ("engine.local_to_model(keys, clip.parents)", None),
    "reduce": ("tumble.reduce(clip, tolerance=0.01)", None),
    "compare": ("tumble.compare(clip, moved, world=True)", None),
    "compare arrays": ("tumble.compare(keys, keys)", None),
    "path_errors": ("tumble.path_errors(path, path, align='sim3', rpe='1s')", None),
    "follow": ("engine.follow(clip.times(0), keys[..., :3], fps=60, speed='constant')", None),
    "surface": ("tumble.Surface(points, corners)", None),
    "route": ("surface.route([0, 0, 0], [9, 0, 9])", None),
    "routes with warnings": ("surface.routes(np.full((9, 3), 0.1), np.full((9, 3), [8, 5, 8]))", None),
    "walk": ("tumble.walk(ways, speed=1.0, radius=0.01)", None),
    "library": ("tumble.MotionLibrary([clip, clip])", None),
    "library of files": ("tumble.MotionLibrary.load([warns] * 20)", None),
    "sample a library": ("library.sample(ids, ids * 0.01)", None),
    "save a library": ("library.save('library.npz')", "library.npz"),
    "open a library": ("tumble.MotionLibrary.open(stored, mmap=False)", None),
    "crowd": ("tumble.Crowd([clip], 1000)", None),
    "advance a crowd": ("(crowd.advance(1 / 60), crowd.evaluate('model'))", None),
    "set a crowd": ("crowd.set(range(20_000), 0, time=np.linspace(0, 9, 20_000))", None),
    "devices": ("tumble.devices()", None),
    "page": ("clip_of_page.view(methods='slerp', fps=30).save('page.html')", "page.html"),
    "plan": ("tumble._tumble.Plan(command, folder, None, 'shards', '1M', 'files')", None),
    "shard": ("worker.run('shards', 1, 1, 'plan', inputs, record=False)", None),
    "merge": ("tumble._tumble.merge('merged')", None),
}

# Calls that would take minutes: they are always interrupted.
ENDLESS = ["evaluate at constant speed", "evaluate one long track"]

SENDER = """
import os, sys, time
for line in sys.stdin:
    process, delay = line.split()
    time.sleep(float(delay))
    os.kill(int(process), 2)
    print(time.monotonic(), flush=True)
"""

CHILD = """
import collections, faulthandler, gc, json, os, pickle, random, shutil, signal, subprocess, sys, time, warnings
import numpy as np, tumble

calls, endless, count, sender = json.loads(sys.argv[1]), json.loads(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
is_soak = count > 1
signal.signal(signal.SIGINT, signal.default_int_handler)
warnings.simplefilter("always")
warnings.showwarning = lambda *_: None
rng = np.random.default_rng(1)

class Slow(list):
    # Python code converts it to an array.
    def __init__(self, of=(0.0, 1.0)):
        super().__init__(of)
    def __array__(self, dtype=None, copy=None):
        return np.array([sum(range(2000)) * 0.0, 1.0])
    def __len__(self):
        return sum(1 for _ in range(1000)) and super().__len__()

class SlowIndex:
    def __index__(self):
        return sum(range(2000)) * 0
    def __float__(self):
        return sum(range(2000)) * 0.0

def refused(call):
    try:
        call()
    except tumble.InputError:
        return
    raise AssertionError("not refused")

tracks, frames = 24, 6000
keys = np.ones((tracks, frames, 4), np.float32)
keys[..., :3] = rng.normal(size=(tracks, frames, 3)) * 0.3
keys /= np.linalg.norm(keys, axis=-1, keepdims=True)
seconds, names = np.arange(frames) / 30, [f"joint{n}" for n in range(tracks)]
moves = rng.normal(size=(tracks, frames, 3))
clip = tumble.Clip(seconds, keys, parents=[None, *range(tracks - 1)], offsets=np.ones((tracks, 3)))
moved = tumble.Clip(seconds + 1e-4, keys, parents=clip.parents, offsets=clip.offsets)
long = tumble.Clip(np.arange(tracks * frames) / 30, keys.reshape(-1, 4))
clip_of_page = tumble.Clip(seconds[:300], keys[:, :300], parents=clip.parents, offsets=clip.offsets)
path = tumble.Clip(seconds, keys[:1], translations=moves[:1])
jumps_at = np.arange(400.0)
jumps = rng.normal(size=(4, 400, 4))
jumps /= np.linalg.norm(jumps, axis=-1, keepdims=True)
engine = tumble.Engine("cpu")
out = np.empty((tracks, 1, 4), np.float32)
line = np.linspace(0, 9, 100)
index = np.arange(10_000).reshape(100, 100)
x, z = np.meshgrid(line, line, indexing="ij")
corners = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)
points = np.stack([x, np.sin(3 * x) * np.cos(2 * z), z], -1).reshape(-1, 3)
surface = tumble.Surface(points, corners)
plane = tumble.Surface([[0, 0, 0], [9, 0, 0], [9, 0, 9], [0, 0, 9]], [[0, 1, 2, 3]])
ways = plane.routes(np.tile([0.0, 0, 1], (20, 1)), np.tile([9.0, 0, 1], (20, 1)))
try:
    import pyarrow
    rows = pyarrow.table({"times": [seconds.tolist()] * 4, "keys": [keys[0].ravel().tolist()] * 4})
except ImportError:
    del calls["batch"]
warns, broken, large, times_file = "warns.npz", "broken.bvh", "large.bvh", "times.txt"
np.savez(warns, poses=np.zeros((31, 156)), trans=np.zeros((31, 3)), mocap_framerate=30.0, other=np.zeros(7))
open(broken, "w").write("HIERARCHY nothing")
open(times_file, "w").write("x")
tumble.save(large, clip)
library = tumble.MotionLibrary([clip])
stored = "stored.npz"
library.save(stored)
ids = np.zeros(5000, np.int64)
crowd = tumble.Crowd([clip], 20_000)
folder = "inputs"
os.mkdir(folder)
os.mkdir("shards")
for n in range(8):
    tumble.save(f"{folder}/{n}.npz", clip_of_page)
inputs = [(f"{folder}/{n}.npz", f"{n}.npz") for n in range(8)]
command = ["--device", "cpu", "-m", "c2", "--fps", "60", folder]
worker = tumble._tumble.Worker(command, 1)
os.makedirs("merged")
tumble._tumble.Plan(command, folder, None, "merged", "1M", "files").claim("merged")

sending = subprocess.Popen([sys.executable, "-S", "-c", sender], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                           text=True, start_new_session=True)
chance = random.Random(7)
expected = {}  # the bytes of the files
for name, (call, output) in calls.items():
    work = eval("lambda: " + call)
    faulthandler.dump_traceback_later(100 + 20 * count, exit=True)  # a call that hangs
    longest_delay = 0.1
    if output or (is_soak and name not in endless):
        started = time.monotonic()
        work()
        longest_delay = min(1.2 * (time.monotonic() - started), 0.5)
    if output:
        expected[output] = open(output, "rb").read()
    found, longest = collections.Counter(), 0.0
    for _ in range(count):
        if output:
            os.unlink(output)
        before = set(os.listdir())
        delay = chance.uniform(0, longest_delay + 0.002)
        try:
            sending.stdin.write(f"{os.getpid()} {delay}\\n")
            sending.stdin.flush()
            deadline = time.monotonic() + delay + 15
            while time.monotonic() < deadline:  # a call that ends sooner is made again
                work()
                # The system may deliver the signal to another thread. Up to Python 3.12, the main thread then notices
                # it only when it takes the interpreter's lock. In a loop of calls that keep the lock, this never
                # happens.
                time.sleep(0)
            ended = time.monotonic()
            found["swallowed"] += 1
        except KeyboardInterrupt:
            ended = time.monotonic()
            found["KeyboardInterrupt"] += 1
        except BaseException as error:
            ended = time.monotonic()
            found[f"{type(error).__name__}: {error}"[:200]] += 1
        try:
            sent = sending.stdout.readline()
        except KeyboardInterrupt:  # the call had ended by itself
            found["after the call"] += 1
            sent = sending.stdout.readline()
        longest = max(longest, ended - float(sent))
        # Wait until the files that were left are removed.
        for _ in range(500):
            left = set(os.listdir()) - before - {output}
            if not left:
                break
            time.sleep(0.01)
        if left:
            found[f"left {sorted(left)}"] += 1
        if output and os.path.exists(output):
            data = open(output, "rb").read()
            if data != expected[output]:
                found["half a file"] += 1
        elif output:
            open(output, "wb").close()
    print(json.dumps([name, dict(found), round(longest_delay, 4), round(longest, 4)]), flush=True)
faulthandler.cancel_dump_traceback_later()
print(json.dumps(["still", {}, engine.evaluate(clip, at=0.5).shape[0], 0]))
"""


@pytest.mark.skipif(os.name != "posix", reason="signals are sent as on Unix")
def test_ctrl_c_at_any_moment_is_a_keyboard_interrupt(tmp_path):
    arguments = [json.dumps(CALLS), json.dumps(ENDLESS), str(SIGNALS), SENDER]
    command = [sys.executable, "-c", textwrap.dedent(CHILD), *arguments]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300 + 90 * SIGNALS, cwd=tmp_path
    )
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    print(*lines, sep="\n")
    assert lines and lines[-1][:3] == ["still", {}, 24], done.stdout + done.stderr
    for name, found, _, longest in lines[:-1]:
        assert found == {"KeyboardInterrupt": SIGNALS}, (name, found, done.stderr)
        # The machine may be busy; a call that is not interrupted takes many seconds.
        assert longest < 5, (name, longest)
