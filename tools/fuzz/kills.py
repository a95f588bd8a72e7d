"""Kill a process while it writes: the old file or the new one is there, whole."""

from __future__ import annotations

import csv
import os
import random
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import statemachine as sm
from statemachine.errors import MissingEngineError, TraceError
from statemachine.lab.recordings import RunStart, export_csv, read, record, write

from ._tally import ROOT, Tally, environment

TRIES = 100
_OLD = b"what was there before\n"
# Reads a trace, says that it begins, and writes it again and again.
WRITER = """
import sys
from statemachine.lab.recordings import export_csv, read, write
source, target = sys.argv[1:]
trace = read(source)
print("begins", flush=True)
while True:
    (export_csv if target.endswith(".csv") else write)(trace, target)
"""


def run(seed: int, tries: int) -> Tally:
    """Kill writers of each kind of file at random moments."""
    draw, tally = random.Random(seed), Tally()
    trace = record(sm.load("so101/scene_box"), seconds=0.2, start=RunStart(keyframe="held"))
    with tempfile.TemporaryDirectory() as name:
        source = write(trace, Path(name) / "source.npz")
        kinds = [".npz", ".csv"]
        with suppress(MissingEngineError):
            write(trace, Path(name) / "source.parquet")
            kinds.append(".parquet")
        for turn in range(tries):
            folder = Path(name) / str(turn)
            folder.mkdir()
            target = folder / f"o{draw.choice(kinds)}"
            for file in _files(target):
                file.write_bytes(_OLD)
            _kill(source, target, 0.1 * draw.random())
            tally.tried += 1
            problem = examine(target)
            for file in folder.iterdir():  # what is left for long the next write removes
                os.utime(file, (0, 0))
            if not problem:
                export_csv(trace, target) if target.suffix == ".csv" else write(trace, target)
                left = {file.name for file in folder.iterdir()} - {f.name for f in _files(target)}
                problem = f"left behind: {sorted(left)}" if left and os.name == "posix" else ""
            if problem:
                tally.failures.append(f"{target.suffix}: {problem}")
    return tally


def _files(target: Path) -> list[Path]:
    if target.suffix != ".csv":
        return [target]
    return [target, target.with_name(f"{target.stem}.contacts.csv")]


def _kill(source: Path, target: Path, after: float) -> None:
    """Start a writer, and kill it some time after it has begun."""
    words = [sys.executable, "-c", WRITER, str(source), str(target)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, cwd=ROOT, env=environment()) as writer:
        assert writer.stdout is not None
        writer.stdout.readline()
        time.sleep(after)
        writer.kill()


def examine(target: Path) -> str:
    """Return what is wrong with what is there, or ""."""
    main, *others = _files(target)
    if not main.exists():
        return "it is gone"
    ages = [_age(file) for file in (main, *others) if file.exists()]
    if "half" in ages:
        return "half a file"
    return "a file beside the companion of another" if len(set(ages)) > 1 else ""


def _age(file: Path) -> str:
    """Return whether a file is the old one, a new one, or neither."""
    content = file.read_bytes()
    if content == _OLD:
        return "old"
    if file.suffix == ".csv":
        widths = {len(row) for row in csv.reader(content.decode().splitlines())}
        return "new" if content.endswith(b"\n") and len(widths) == 1 else "half"
    try:
        read(file)
    except TraceError:
        return "half"
    return "new"
