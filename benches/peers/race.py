#!/usr/bin/env python3
"""Tumble beside others: every program that `run.sh` built, in turns, on the keys of one file; prints the tables of
docs/figures.md, slowest first, or with --poses the table of docs/speed.md, or writes them there with --write."""

import argparse
import datetime
import json
import os
import pathlib
import platform
import re
import statistics
import subprocess
import sys

import numpy

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BEGIN, END = "<!-- written by benches/peers/run.sh -->", "<!-- to here -->"
WORKS = {
    "slerp": "Slerp, 4096 tracks × 26 uneven keys × 1200 frames",
    "smooth": "Smooth curves through the same keys",
    "one sample": "One sample of one track, ten thousand calls",
}
# Poses are requested at two kinds of times; each kind is a column.
POSES = {
    "one pose, slerp": "Slerp, or the library's curve between two keys",
    "one pose, smooth": "Smooth curves through the same keys",
}
TIMES = ("next time", "any time")
# The largest difference from the first row, for slerp: a contestant that differs by more does something else. Smooth
# curves are not the same.
SAME = 1e-3


def machine():
    model = re.search(r"model name\s*:\s*(.*)", pathlib.Path("/proc/cpuinfo").read_text())
    flags = pathlib.Path("/proc/cpuinfo").read_text()
    widest = next((name for flag, name in [("avx512f", "AVX-512"), ("avx2", "AVX2")] if flag in flags), "")
    model = model[1] if model else platform.processor()
    return f"{model}, {os.cpu_count()} cores, {widest}, Linux {platform.release().split('-')[0]}"


def distance(a, b):
    """The largest angle between the rotations of two rows."""
    dot = numpy.abs(numpy.sum(a.astype(float) * b.astype(float), axis=1))
    # The arc sine of the chord is exact for small angles.
    chord = numpy.minimum(numpy.linalg.norm(a - b, axis=1), numpy.linalg.norm(a + b, axis=1))
    return float(numpy.max(numpy.where(dot > 0.999, 2 * numpy.arcsin((chord / 2).clip(0, 1)) * 2, 2 * numpy.arccos(dot.clip(0, 1)))))


def run(command, rows):
    """The lines of a program, each a contestant or one that is missing."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))} failed:\n{done.stderr}")
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def times_as_long(one, reference):
    """How many times as long as another it takes: the median of the turns, because machines are shared."""
    return statistics.median(a / b for a, b in zip(one["turns"], reference["turns"]))


def poses(contestants):
    """The table of poses: times of one call, and how many times as long as the first row of Tumble it takes."""
    lines = []
    for work, title in POSES.items():
        rows = {}
        for one in contestants:
            of_work, _, times = one["work"].rpartition(", ")
            if of_work == work:
                rows.setdefault(one["name"], {})[times] = one
        if not rows:
            continue
        first = next(row for name, row in rows.items() if name.startswith("Tumble"))
        lines += [f"\n**{title}**\n", "| | bytes a key | next time, ns | any time, ns | largest error, rad |", "|---|---|---|---|---|"]
        for name, row in sorted(rows.items(), key=lambda row: -row[1][TIMES[0]]["ms"]):
            cells = []
            for times in TIMES:
                ratio = "" if row is first else f" ({times_as_long(row[times], first[times]):.2g} ×)"
                # Ten thousand calls in ms are tenths of a microsecond each.
                cells.append(f"{row[times]['ms'] * 100:.0f}{ratio}")
            errors = [one["error"] for one in row.values() if one.get("error") is not None]
            error = f"{max(errors):.0e}" if errors else ""
            lines.append(f"| {name} | {row[TIMES[0]]['bytes_per_key']:.3g} | {' | '.join(cells)} | {error} |")
    return lines


def table(contestants, rows):
    lines = []
    for work, title in WORKS.items():
        of_work = [one for one in contestants if one["work"] == work]
        if not of_work:
            continue
        ours = {one["threads"]: one for one in of_work if one["name"].startswith("Tumble")}
        best = ours.get("all") or ours["1"]
        reference = numpy.fromfile(rows / best["row"], "<f4").reshape(-1, 4) if work == "slerp" else None
        lines += [f"\n**{title}**\n"]
        is_of_calls = work.startswith("one ")
        unit = "µs a call" if is_of_calls else "ms"
        lines += [f"| | threads | {unit} | Tumble is faster by | largest difference, rad |", "|---|---|---|---|---|"]
        for one in sorted(of_work, key=lambda one: -one["ms"]):
            beside = ours.get(one["threads"], best)
            ratio = "" if one["name"].startswith("Tumble") else f"{times_as_long(one, beside):.2g} ×"
            difference = ""
            if reference is not None and not one["name"].startswith("Tumble"):
                row = numpy.fromfile(rows / one["row"], "<f4").reshape(-1, 4)
                found = distance(row, reference)
                if found > SAME:
                    sys.exit(f"{one['name']} differs by {found} rad: it does other work")
                difference = f"{found:.0e}"
            # Ten thousand calls in ms are tenths of a microsecond each.
            number = one["ms"] / 10 if is_of_calls else one["ms"]
            lines.append(f"| {one['name']} | {one['threads']} | {number:.3g} | {ratio} | {difference} |")
    return lines


parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
parser.add_argument("folder", type=pathlib.Path)
parser.add_argument("--rounds", type=int, default=5)
parser.add_argument("--write", action="store_true")
parser.add_argument("--poses", action="store_true", help="the programs give poses")
parser.add_argument("--missing", action="append", default=[], help="name: why")
parser.add_argument("--program", action="append", required=True, help="a command, its words divided by |")
arguments = parser.parse_args()

keys = arguments.folder / ("poses.bin" if arguments.poses else "keys.bin")
found, missing = {}, list(arguments.missing)
for iteration in range(arguments.rounds):
    for program in arguments.program:
        for line in run([*program.split("|"), keys, arguments.folder], arguments.folder):
            if "missing" in line:
                if iteration == 0:
                    missing.append(f"{line['missing']}: {line['why']}")
                continue
            key = (line["name"], line["work"], line["threads"])
            found.setdefault(key, []).append(line)
contestants = []
for lines in found.values():
    turns = [line["ms"] for line in lines]
    contestants.append({**lines[0], "ms": statistics.median(turns), "turns": turns})
spread = max(max(line["ms"] for line in lines) / min(line["ms"] for line in lines) for lines in found.values())
today = datetime.date.today().isoformat()
text = [
    f"Measured on {today}: {machine()}. Medians of {arguments.rounds} turns, also of the ratios; between turns a",
    f"row differs by up to {spread:.2g} ×. Slowest first.",
]
if arguments.poses:
    text += poses(contestants)
else:
    writing = next(one["ms"] for one in contestants if one["work"] == "none")
    text += [f"Writing the result's 79 MB alone takes {writing:.3g} ms.", *table(contestants, arguments.folder)]
text += ["", *(["Not there: " + "; ".join(missing) + "."] if missing else [])]
text = "\n".join(text)
print(text)
if arguments.write:
    path = ROOT / ("docs/speed.md" if arguments.poses else "docs/figures.md")
    page = path.read_text()
    before, rest = page.split(BEGIN)
    path.write_text(f"{before}{BEGIN}\n{text}\n{END}{rest.split(END)[1]}")
