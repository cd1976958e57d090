"""A library over a Ray cluster on this machine, whose workers, nodes and drivers are killed: in the end
the bytes are those of one process.

The counts are small here. `KILLS=100 NODES=20 DRIVERS=10 CLIPS=2000` and the like make them large.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import json
import os
import pathlib
import random
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request

import numpy as np
import pytest
from conftest import ROOT, unit

import tumble
import tumble.distributed
from tumble.distributed import DistributedError, _driver, _job, _stores, evaluate
from tumble.distributed.__main__ import main as cluster_program

if sys.platform != "linux":
    pytest.skip("processes are found and killed as Linux has them", allow_module_level=True)
# Ray is among the tests' requirements; where it has no wheel for a Python, CI is to say so.
ray = importlib.import_module("ray") if "CI" in os.environ else pytest.importorskip("ray")
Cluster = importlib.import_module("ray.cluster_utils").Cluster

CLIPS = int(os.environ.get("CLIPS", "160"))
KILLS = int(os.environ.get("KILLS", "2"))
NODES = int(os.environ.get("NODES", "1"))
DRIVERS = int(os.environ.get("DRIVERS", "2"))

TOOLS = pathlib.Path(sys.executable).parent
FAULTS = pathlib.Path(__file__).parent / "faults"
# Ray's dashboard, log monitor and autoscaler are not needed.
QUIET = {
    "include_dashboard": False, "include_log_monitor": False, "no_monitor": True, "object_store_memory": 80 << 20
}
# About eight clips.
SHARD = "64KiB"


def tumble_program(*arguments, code=0, **options):
    """`python -m tumble` with these arguments."""
    command = [sys.executable, "-m", "tumble", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, **options)
    assert done.returncode == code, done.stdout + done.stderr
    return done


def write_clip(path, rng, tracks=4, keys=24):
    """A clip as text."""
    rotations = unit(rng, keys, tracks)[..., [3, 0, 1, 2]].reshape(keys, -1)
    times = np.cumsum(rng.uniform(0.02, 0.1, keys))
    rows = [" ".join(f"{x:.7g}" for x in [time, *rotation]) for time, rotation in zip(times, rotations, strict=True)]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"# {tracks} 1\n" + "\n".join(rows) + "\n", encoding="utf-8")


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """Clips in folders, and their results by one process."""
    folder = tmp_path_factory.mktemp("library")
    rng = np.random.default_rng(11)
    for i in range(CLIPS):
        write_clip(folder / "clips" / f"{i % 7}" / f"{i:05}.dat", rng)
    tumble_program("eval", "clips", "-o", "one", "--fps", "240", "--device", "cpu", cwd=folder)
    return folder


class Machines:
    """A head and a node, of one processor each."""

    def __init__(self):
        self.cluster = Cluster(
            initialize_head=True, head_node_args={"num_cpus": 1, **QUIET}, connect=False
        )
        self.nodes = [self.add()]

    def add(self, **environment):
        options = {"num_cpus": 1, "object_store_memory": 80 << 20}
        return self.cluster.add_node(**options, env_vars=environment or None)

    def lose(self):
        """Every process of a node ends at once."""
        self.cluster.remove_node(self.nodes.pop(0), allow_graceful=False)

    @property
    def address(self):
        return self.cluster.address


@pytest.fixture(scope="module")
def machines():
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        # Workers import modules from here, which make them start with a fault.
        patch.setenv("PYTHONPATH", str(FAULTS), prepend=os.pathsep)
        found = Machines()
        yield found
        ray.shutdown()
        found.cluster.shutdown()


@pytest.fixture
def connected(machines):
    """A driver's connection to the machines, which all calls of this process use: another one would start workers anew."""
    connect(machines)


def connect(machines):
    if not ray.is_initialized():
        hook = {"worker_process_setup_hook": "tumble_faults.prepare"}
        ray.init(address=machines.address, log_to_driver=False, runtime_env=hook)


def tree(folder):
    """Every file below a folder, with its bytes."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in pathlib.Path(folder).rglob("*")
        if path.is_file()
    }


def assert_equal(folder, other):
    """`diff -r` finds nothing."""
    done = subprocess.run(["diff", "-rq", str(folder), str(other)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:]


def command(library, out, *more, fps="240", shard=SHARD):
    line = [sys.executable, "-m", "tumble.distributed", str(library), str(out)]
    return [*line, "--fps", fps, "--shard-bytes", shard, *more]


def workers():
    """The processes of Ray's that have a task of ours."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError):
            if b"ray::tumble" in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
    return found


def test_the_bytes_are_those_of_one_process(connected, library, monkeypatch):
    monkeypatch.chdir(library)
    reported = []
    report = evaluate("clips", "ray", fps=240, shard_bytes=SHARD, progress=reported.append)
    assert (report.made, report.skipped, report.failed) == (CLIPS, 0, [])
    assert report.results == CLIPS and report.exit_code == 0
    assert report.shards > 8 and report.workers == 2
    frames = sum(int(np.load(path, mmap_mode="r").shape[1]) for path in pathlib.Path("one").rglob("*.npy"))
    assert report.rotations == 4 * frames
    assert reported[-1].inputs_done == CLIPS and reported[-1].seconds_left == 0
    assert_equal("one", "ray")
    tumble_program("check", "ray")
    resumed = tumble_program("eval", "clips", "-o", "ray", "--fps", "240", "--resume")
    assert f"{CLIPS} results kept" in resumed.stderr
    again = evaluate("clips", "ray", fps=240, shard_bytes=SHARD)
    assert (again.made, again.skipped) == (0, CLIPS)
    assert_equal("one", "ray")
    with pytest.raises(DistributedError, match="exists") as refused:
        evaluate("clips", "ray", fps=240, resume=False)
    assert refused.value.exit_code == 2


def test_command_lines_that_are_refused(machines, library, monkeypatch, capsys):
    monkeypatch.chdir(library)
    before = signal.getsignal(signal.SIGTERM)
    for line, words in [
        (["clips"], "give LIBRARY and OUT"),
        (["clips", "x", "--fps", "none"], "--fps"),
        (["clips", "x", "-o", "y"], "leave it out"),
        (["nowhere", "x"], "nowhere"),
        (["clips", "x", "--into", "csv"], "give files or parquet"),
    ]:
        assert cluster_program([*line, "--address", machines.address]) in (2, 4), line
        assert words in capsys.readouterr().err, line
    signal.signal(signal.SIGTERM, before)


def test_parts_by_xargs_are_merged(library):
    line = "seq 5 | xargs -P2 -I{} %s -m tumble eval clips -o xargs --fps 240 --device cpu --shard {}/5 --shard-bytes %s"
    subprocess.run(line % (sys.executable, SHARD), shell=True, check=True, cwd=library, capture_output=True)
    check = tumble_program("check", "xargs", cwd=library, code=8)
    assert "tumble merge" in check.stderr
    tumble_program("merge", "xargs", cwd=library)
    assert_equal(library / "one", library / "xargs")


def test_workers_are_killed(connected, library):
    """While they work, one after another, and no pause is long."""
    out = library / "killed"
    chance = random.Random(3)
    kills, ended = 0, threading.Event()

    def kill():
        nonlocal kills
        while kills < KILLS and not ended.wait(chance.uniform(0.05, 0.2)):
            for worker in workers()[:1]:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(worker, signal.SIGKILL)
                    kills += 1

    rounds = 0
    while kills < KILLS and rounds < 4 * KILLS:
        rounds += 1
        shutil.rmtree(out, ignore_errors=True)
        ended.clear()
        thread = threading.Thread(target=kill)
        thread.start()
        report = evaluate(library / "clips", out, fps=240, shard_bytes="8KiB")
        ended.set()
        thread.join()
        # If the end of a shard was not reported, its record is found later.
        assert (report.made + report.skipped, report.failed) == (CLIPS, [])
    assert kills >= KILLS
    rename_inputs(out, f"{library}/", "")
    assert_equal(library / "one", out)


def rename_inputs(out, before, after):
    """The manifest has inputs as they were given."""
    manifest = out / "manifest.jsonl"
    manifest.write_text(manifest.read_text().replace(f'"input":"{before}', f'"input":"{after}'))


def test_nodes_are_lost(machines, connected, library):
    """In the middle, with all their processes."""
    for round in range(NODES):
        if not machines.nodes:
            machines.nodes.append(machines.add())
        out = library / f"nodes{round}"
        losing = threading.Thread(target=machines.lose)
        begun = []

        def lose(progress, losing=losing, begun=begun):
            if not begun and progress.inputs_done > CLIPS // 8:
                begun.append(progress.inputs_done)
                losing.start()

        report = evaluate(library / "clips", out, fps=240, shard_bytes="8KiB", progress=lose)
        losing.join()
        assert begun[0] < CLIPS, "it was lost in the middle"
        # If the end of a shard was not reported, its record is found later.
        assert (report.made + report.skipped, report.failed) == (CLIPS, [])
        rename_inputs(out, f"{library}/", "")
        assert_equal(library / "one", out)


def test_a_node_that_is_added_works(machines, connected, library, tmp_path):
    """All others have other work to do."""

    @ray.remote(num_cpus=1)
    def occupy(path):
        pathlib.Path(path).touch()
        time.sleep(600)

    held = [tmp_path / f"held{i}" for i in range(1 + len(machines.nodes))]
    holding = [occupy.remote(str(path)) for path in held]
    while not all(path.exists() for path in held):
        time.sleep(0.05)
    reports = []
    evaluating = threading.Thread(
        target=lambda: reports.append(evaluate(library / "clips", tmp_path / "out", fps=240))
    )
    evaluating.start()
    machines.nodes.append(machines.add())
    evaluating.join(60)
    assert (reports[0].made, reports[0].workers) == (CLIPS, 1)
    for reference in holding:
        ray.cancel(reference, force=True)
    rename_inputs(tmp_path / "out", f"{library}/", "")
    assert_equal(library / "one", tmp_path / "out")


def test_drivers_are_killed(machines, library):
    out = library / "drivers"
    stopped = 0
    # One clip per shard, so that the driver is busy long enough to be stopped.
    more = ["--resume", "--address", machines.address]
    line = command("clips", "drivers", *more, shard="1KiB")
    rounds = 0
    while stopped < DRIVERS and rounds < 10 * DRIVERS:
        rounds += 1
        stop = [signal.SIGKILL, signal.SIGINT, signal.SIGTERM][stopped % 3]
        driver = subprocess.Popen(line, cwd=library, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 60
        done = len(list(out.glob("manifest.d/*.jsonl")))
        while time.monotonic() < deadline and driver.poll() is None:
            if len(list(out.glob("manifest.d/*.jsonl"))) > done:
                break
            time.sleep(0.005)
        driver.send_signal(stop)
        words = driver.communicate(timeout=60)[1]
        stopped += driver.returncode != 0
        if driver.returncode == 0:
            shutil.rmtree(out)  # it was quicker
        if stop != signal.SIGKILL and driver.returncode != 0:
            assert driver.returncode == 128 + stop, words
            assert "--resume continues" in words
        if (out / "manifest.d").is_dir():
            check = tumble_program("check", out, code=8)
            assert "shards are done" in check.stderr
    assert stopped == DRIVERS
    done = subprocess.run([*line, "--json"], cwd=library, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    # Ray may print a line about a lost node before the report.
    report = json.loads(done.stdout[done.stdout.index("{\n") :])
    assert (report["made"] + report["skipped"], report["exit_code"]) == (CLIPS, 0)
    assert f"{report['made']} made, {report['skipped']} kept, 0 failed" in done.stderr
    assert_equal(library / "one", out)


def test_ctrl_c_in_a_program_of_ones_own(machines, connected, library, tmp_path):
    """The connection stays, and tasks that were submitted run to their end; a later call does the rest."""
    out = tmp_path / "out"
    chance = random.Random(4)
    interrupted = rounds = 0
    while not interrupted and rounds < 10:
        rounds += 1
        begun, is_done = threading.Event(), False

        def interrupt(begun=begun, delay=chance.uniform(0, 0.2)):
            begun.wait(60)
            time.sleep(delay)
            os.kill(os.getpid(), signal.SIGINT)

        sender = threading.Thread(target=interrupt)
        sender.start()
        with contextlib.suppress(KeyboardInterrupt):
            evaluate(
                library / "clips", out, fps=240, shard_bytes="8KiB", progress=lambda _, begun=begun: begun.set()
            )
            is_done = True
            begun.set()
            sender.join()
            time.sleep(10)  # the signal ends this, too
        sender.join()
        interrupted += not is_done
        if is_done:
            shutil.rmtree(out)
    assert interrupted
    # If a task ended after the results are merged, the record of its shard would be left.
    ray.shutdown()
    connect(machines)
    report = evaluate(library / "clips", out, fps=240, shard_bytes="8KiB")
    assert (report.made + report.skipped, report.failed) == (CLIPS, [])
    rename_inputs(out, f"{library}/", "")
    assert_equal(library / "one", out)


def test_inputs_that_fail_are_named(connected, library, tmp_path, monkeypatch):
    """One kills its worker, one is refused, one is too large; all others are done."""
    # Each retry starts a worker, which takes seconds.
    monkeypatch.setattr(_driver, "_RETRIES", 1)
    clips = tmp_path / "clips"
    for path in sorted((library / "clips").rglob("*.dat"))[:3]:
        (clips / path.parent.name).mkdir(parents=True, exist_ok=True)
        shutil.copy(path, clips / path.parent.name / path.name)
    (clips / "bad.dat").write_text("# 2 3\n0 1 0 0\n")
    long = "# 1 1\n0 1 0 0 0\n1e14 0 1 0 0\n"
    (clips / "long.dat").write_text(long)
    shutil.copy(clips / "0" / "00000.dat", clips / "kills-its-worker.dat")
    report = evaluate(clips, tmp_path / "out", fps=240)
    failed = {pathlib.Path(refusal.input).name: refusal.message for refusal in report.failed}
    assert set(failed) == {"bad.dat", "long.dat", "kills-its-worker.dat"}
    assert "ends the process" in failed["kills-its-worker.dat"]
    assert report.exit_code == 3 and report.results == 3
    assert sorted(tree(tmp_path / "out")) == sorted(
        [f"{path.parent.name}/{path.stem}.npy" for path in clips.rglob("0*.dat")] + ["manifest.jsonl"]
    )
    tumble_program("check", tmp_path / "out", code=8)


def test_an_output_that_is_refused(library, tmp_path):
    (tmp_path / "file").write_text("no directory")
    with pytest.raises(DistributedError) as refused:
        evaluate(library / "clips", tmp_path / "file" / "out")
    assert refused.value.exit_code == 7


def test_a_machine_with_another_wheel_takes_no_part(machines, connected, library, tmp_path):
    other = machines.add(TUMBLE_FAULT_WHEEL="1")
    try:
        report = evaluate(library / "clips", tmp_path / "out", fps=240, shard_bytes="8KiB")
    finally:
        machines.cluster.remove_node(other)
    assert len(report.refused_machines) == 1
    assert "kernels 000000000000" in report.refused_machines[0]
    rename_inputs(tmp_path / "out", f"{library}/", "")
    assert_equal(library / "one", tmp_path / "out")


def test_vulkan_writes_the_same_bytes(connected, library, tmp_path):
    """Where a run on the CPU was stopped, lavapipe goes on."""
    assert tumble.devices(), "lavapipe is there"
    shutil.copytree(library / "one", tmp_path / "out")
    for path in sorted((tmp_path / "out").rglob("*.npy"))[::2]:
        path.unlink()
    report = evaluate(library / "clips", tmp_path / "out", fps=240, device="vulkan", shard_bytes=SHARD)
    assert (report.made, report.skipped) == (CLIPS // 2, CLIPS // 2)
    resumed, other = tree(tmp_path / "out"), tree(library / "one")
    manifests = [files.pop("manifest.jsonl").decode().splitlines() for files in (resumed, other)]
    assert resumed == other
    devices = {json.loads(line)["device"] for line in manifests[0]}
    assert len(devices) == 2 and "CPU" in devices
    for lines in zip(*manifests, strict=True):
        first, second = (json.loads(line) for line in lines)
        for entry in (first, second):
            del entry["device"], entry["input"]
        assert first == second


def test_rows_of_parquet(connected, library, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    out = tmp_path / "rows"
    evaluate(
        library / "clips",
        out,
        fps=240,
        into="parquet",
        shard_bytes=SHARD,
        worker_memory="64MiB",
    )
    rows = {}
    for path in sorted(out.glob("part-*.parquet")):
        for row in parquet.read_table(path).to_pylist():
            assert row["clip"] not in rows, "twice"
            rows[row["clip"]] = row
    results = {path.relative_to(library / "one"): path for path in (library / "one").rglob("*.npy")}
    assert set(rows) == {str(name.with_suffix("")) for name in results}
    for name, path in results.items():
        row, whole = rows[str(name.with_suffix(""))], np.load(path)
        rotations = np.asarray(row["rotations"], np.float32).reshape(row["tracks"], row["frames"], 4)
        assert np.array_equal(rotations.view(np.uint32), whole.view(np.uint32))
        assert row["sha256"] == hashlib.sha256(whole.tobytes()).hexdigest()
    tumble_program("check", out)
    before = tree(out)
    again = evaluate(library / "clips", out, fps=240, into="parquet", shard_bytes=SHARD)
    assert (again.made, again.skipped) == (0, CLIPS)
    assert tree(out) == before


@pytest.fixture
def bucket(monkeypatch):
    """An S3 server, and the URL of a bucket of its."""
    pytest.importorskip("moto")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    server = subprocess.Popen(
        [TOOLS / "moto_server", "-H", "127.0.0.1", "-p", str(port)],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )
    address = f"http://127.0.0.1:{port}"
    try:
        for _ in range(200):
            with contextlib.suppress(OSError):
                urllib.request.urlopen(urllib.request.Request(f"{address}/clips", method="PUT"))
                break
            time.sleep(0.05)
        yield lambda name: (
            f"s3://key:secret@clips/{name}?scheme=http&region=us-east-1&endpoint_override=127.0.0.1:{port}"
        )
    finally:
        server.terminate()
        server.wait()


def test_object_stores(connected, library, bucket, tmp_path, capsys):
    """From a bucket into a bucket, with a kill; then from files, and into files."""
    clips = sorted((library / "clips").rglob("*.dat"))[:30]
    source = _stores.store(bucket("library"))
    for path in clips:
        source.put(str(path), f"{path.parent.name}/{path.name}")
    url, out = bucket("library"), bucket("out")

    def kill():
        deadline = time.monotonic() + 20
        while time.monotonic() < deadline:
            for worker in workers()[:1]:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(worker, signal.SIGKILL)
                    return
            time.sleep(0.02)

    killer = threading.Thread(target=kill)
    killer.start()
    options = {"fps": 240, "shard_bytes": SHARD}
    report = evaluate(url, out, **options)
    killer.join()
    assert (report.made, report.failed) == (30, [])
    there = _stores.store(out)
    found = {name: there.read(name) for name in there.list()}
    manifest = found.pop("manifest.jsonl").decode().splitlines()
    one = tree(library / "one")
    assert found == {name: one[name] for name in found} and len(found) == 30
    entries = [json.loads(line) for line in manifest]
    base = url.split("?")[0]
    assert {entry["input"] for entry in entries} == {
        f"{base}/{path.parent.name}/{path.name}" for path in clips
    }
    for entry in entries:
        assert entry["output_sha256"] == hashlib.sha256(found[entry["output"]]).hexdigest()
    again = evaluate(url, out, **options)
    assert (again.made, again.skipped) == (0, 30)

    assert cluster_program(["--check", out]) == 0
    (tmp_path / "flipped").write_bytes(b"other bits")
    name = entries[0]["output"]
    there.put(str(tmp_path / "flipped"), name)
    assert cluster_program(["--check", out]) == 8
    assert f"{name}: its bits have changed" in capsys.readouterr().err
    repaired = evaluate(url, out, **options)
    assert repaired.made > 0 and there.read(name) == one[name]
    assert cluster_program(["--check", out]) == 0

    evaluate(url, tmp_path / "local", **options)
    tumble_program("check", "--results-only", tmp_path / "local")
    local = tree(tmp_path / "local")
    assert local.pop("manifest.jsonl").decode().splitlines() == manifest
    assert local == found


def test_a_driver_stops_where_no_machine_may_take_part(monkeypatch, library, tmp_path, connected):
    monkeypatch.setattr(_driver, "wheel", lambda: ("f" * 64, tumble.__version__))
    with pytest.raises(DistributedError, match="no machine has the same version"):
        evaluate(library / "clips", tmp_path / "out")


def test_sizes_are_numbers_or_text():
    bytes_of = _job.bytes_of
    assert [bytes_of(size) for size in (7, "8", "2 GiB", "3mib")] == [7, 8, 2 << 30, 3 << 20]
    for size in "lots", "0", "-1", "2 GB", "":
        with pytest.raises(DistributedError, match="invalid size"):
            bytes_of(size)


def test_objects_stay_in_their_directory():
    _stores.check_names("s3://b/clips", ["a.dat", "walks/b..c.dat", "walks/.hidden/d.dat"])
    for name in "../a.dat", "walks/../../a.dat", "a/./b.dat", "a//b.dat", "/etc/a.dat", "a\\..\\b.dat":
        with pytest.raises(DistributedError, match="rename the object") as refused:
            _stores.check_names("s3://b/clips", ["a.dat", name])
        assert name in str(refused.value)


def test_a_device_goes_by_its_uuid():
    listed = json.loads(tumble_program("devices", "--json").stdout)["devices"]
    assert listed, "lavapipe is there"
    for device in listed:
        assert tumble.Engine(f"uuid:{device['uuid']}").device == device["name"]
    with pytest.raises(tumble.InputError, match="there is no device"):
        tumble.Engine("uuid:00")


def test_records_are_the_programs():
    from tumble import _tumble

    entry = dict.fromkeys(
        ["output_sha256", "input", "input_sha256", "options", "kernels_sha256", "tumble", "device"], "x"
    )
    names = "a\u2028b", "é"
    lines = [
        json.dumps({"output": name, "output_bytes": 3, **entry}, ensure_ascii=False) + "\n"
        for name in names
    ]
    record = _tumble.Record(1, 2, "plan", 2, lines)
    assert record.results() == [(name, "x", 3) for name in names]
    record.plan = "another"
    read = _tumble.Record.parse(record.text())
    assert read is not None and read.is_whole and read.plan == "another"
    assert read.results() == record.results()
    cut = _tumble.Record.parse(record.text()[:-1])
    assert cut is not None and not cut.is_whole
    assert _tumble.Record.parse("") is None
    assert _tumble.Record.name_of(7) == "manifest.d/00007.jsonl"
    assert _tumble.manifest_results("".join(lines)) == sorted(record.results())
    assert set(_tumble.manifest_by_input("".join(lines))) == set(names)


def test_examples_in_docstrings():
    import doctest

    for module in (tumble.distributed, _job):
        assert doctest.testmod(module).failed == 0
    assert (ROOT / "docs" / "distributed.md").is_file()
