"""`python -m tumble.distributed`: the command line of `tumble eval` for a cluster."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import sys
import time
from types import FrameType

from tumble import _tumble
from tumble.distributed import DistributedError, Progress, Report, _check, _driver
from tumble.distributed._job import DIFFERENCE, USAGE, bytes_of, is_url, local

HELP = """\
Evaluate a directory of clips on a Ray cluster; the results have the same bytes as those of `tumble eval` on one machine

Usage: python -m tumble.distributed LIBRARY OUT [OPTIONS] [OPTIONS OF `tumble eval`]
       python -m tumble.distributed --check OUT

LIBRARY and OUT are directories with the same path on every machine, or URLs such as s3://bucket/clips.

Options:
      --resume               Skip results that are complete and were made from the same input with the same options
      --overwrite            Replace all results
      --address ADDRESS      The Ray cluster; `auto`: that of this machine, or a new one for this run [default: auto]
      --device DEVICE        auto (the processors), cpu, or vulkan (a graphics card for each worker, if
                             the cluster has cards) [default: auto]
      --shard-bytes SIZE     The largest total size of the inputs in a shard [default: 32MiB]
      --worker-memory SIZE   The memory that a task reserves on its machine [default: none]
      --into files|parquet   Write a file for each clip, or a Parquet file for each shard [default: files]
      --check OUT            Check results against their manifest, in object stores too, as `tumble check --results-only`
      --json                 Print the report as JSON on standard output
  -h, --help                 Print this help; `tumble eval --help` has the other options

Examples:
  python -m tumble.distributed clips out --fps 60 -m slerp
  python -m tumble.distributed s3://bucket/clips s3://bucket/out --resume --into parquet

Exit codes are those of `tumble`: 0 success, 2 the command line is wrong, 3 some inputs failed, 4 all inputs
failed, 6 a device failed, 7 output could not be written, 8 --check found a difference, 129 to 131 and 143 stopped
by a signal (--resume continues).
"""

VALUES = {
    "--address": "auto",
    "--device": "auto",
    "--shard-bytes": "32MiB",
    "--worker-memory": "",
    "--into": "files",
}
FLAGS = ("--resume", "--overwrite", "--json")
# Options of the program that have another form here, or do not exist.
REFUSED = ("-o", "--output", "--out", "--files-from", "--shard", "--pipes")
FILES = ("--times", "--offsets")


def main(arguments: list[str]) -> int:
    if not arguments or "-h" in arguments or "--help" in arguments:
        print(HELP, end="")
        return 0 if arguments else USAGE
    try:
        if arguments[0] == "--check" and len(arguments) == 2:
            return _check_all(local(arguments[1]))
        return _run(arguments)
    except DistributedError as error:
        _say(str(error) if str(error).startswith("error:") else f"error: {error}")
        return error.exit_code
    except KeyboardInterrupt as stopped:
        code = stopped.args[0] if stopped.args else 130
        _say("stopped; shards that are done are kept: --resume continues")
        return int(code)


def _run(arguments: list[str]) -> int:
    _stop_on_signals()
    values, flags, line = _split(arguments)
    if values["--into"] not in ("files", "parquet"):
        raise DistributedError(f"--into {values['--into']}: give files or parquet", USAGE)
    try:
        paths = _tumble.inputs_of(line)
    except ValueError as error:
        code, message = error.args
        raise DistributedError(message.rstrip(), code) from None
    if len(paths) != 2:
        message = f"give LIBRARY and OUT, two in all; there are {len(paths)}"
        raise DistributedError(message, USAGE)
    watch = _Watch()
    report = _driver.evaluate(
        line,
        local(paths[0]),
        local(paths[1]),
        address=values["--address"],
        device=values["--device"],
        shard_bytes=values["--shard-bytes"],
        worker_memory=bytes_of(values["--worker-memory"]) if values["--worker-memory"] else None,
        into=values["--into"],
        resume="--resume" in flags,
        overwrite="--overwrite" in flags,
        progress=watch,
        # Ray sets its own signal handlers when it starts a node.
        begin=_stop_on_signals,
    )
    watch.end()
    _tell(report)
    if "--json" in flags:
        fields = {**dataclasses.asdict(report), "exit_code": report.exit_code}
        print(json.dumps(fields, indent=2))
    return report.exit_code


def _check_all(out: str) -> int:
    if not is_url(out):
        return _tumble.run(["tumble", "check", out])
    checked = _check.check(out)
    for fault in checked.faults:
        _say(f"error: {fault}")
    if checked.faults:
        _say(f"error: {len(checked.faults)} of {checked.results} results differ; --resume makes them again")
        return DIFFERENCE
    if checked.unfinished:
        _say(
            f"error: {len(checked.unfinished)} inputs failed or have no result yet (the first: "
            f"{checked.unfinished[0]}); --resume makes them again"
        )
        return DIFFERENCE
    print(f"{checked.results} results, unchanged since they were written")
    if checked.shards is None:
        return 0
    done, shards = checked.shards
    _say(f"error: {out}: {done} of {shards} shards are done; --resume continues")
    return DIFFERENCE


def _stop_on_signals() -> None:
    signal.signal(signal.SIGTERM, _terminate)


def _terminate(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt(128 + number)


def _split(arguments: list[str]) -> tuple[dict[str, str], set[str], list[str]]:
    """Options of this command, and the rest, which is `tumble eval`'s."""
    values, flags, line = dict(VALUES), set(), []
    rest = iter(arguments)
    for argument in rest:
        name, equals, value = argument.partition("=")
        if name in REFUSED:
            raise DistributedError(f"{name} is not for many machines; leave it out", USAGE)
        if name in FLAGS and not equals:
            flags.add(name)
        elif name in VALUES or name in FILES:
            if not equals:
                following = next(rest, None)
                if following is None:
                    raise DistributedError(f"{name}: its value is missing", USAGE)
                value = following
            if name in FILES:
                line.append(f"{name}={os.path.abspath(value)}")
            else:
                values[name] = value
        else:
            line.append(argument)
    return values, flags, line


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _tell(report: Report) -> None:
    for refused in report.failed:
        _say(refused.message)
    for machine in report.refused_machines:
        _say(f"warning: took no part, since its wheel is another: {machine}")
    rate = report.rotations / max(report.seconds, 1e-9)
    _say(
        f"{report.made} made, {report.skipped} kept, {len(report.failed)} failed of "
        f"{report.inputs} inputs in {report.shards} shards; {report.rotations:.3g} rotations, "
        f"{rate:.3g} a second, {report.workers} workers, {report.seconds:.1f} s"
    )


class _Watch:
    """One line that is rewritten in a terminal, or a line every ten seconds in a log."""

    def __init__(self) -> None:
        self._is_terminal = sys.stderr.isatty()
        self._reported_at = time.monotonic()

    def __call__(self, progress: Progress) -> None:
        now = time.monotonic()
        if now - self._reported_at < (0.5 if self._is_terminal else 10):
            return
        self._reported_at = now
        left = progress.seconds_left
        rate = progress.rotations / max(progress.seconds, 1e-9)
        text = (
            f"{progress.inputs_done} of {progress.inputs} clips, {rate:.3g} rotations a second, "
            f"{progress.workers} workers, {progress.failed} failed"
        )
        text += "" if left is None else f", {left:.0f} s left"
        if self._is_terminal:
            print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
        else:
            _say(text)

    def end(self) -> None:
        if self._is_terminal:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
