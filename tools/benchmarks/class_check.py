"""How long a class of 41 takes: `python -m tools.benchmarks.class_check`.

It is judged once anew, and once more where nothing has changed. What the processors did is told
beside the clock: on a busy machine the clock says more of the others.
"""

from __future__ import annotations

import datetime
import importlib
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

GOALS = {"anew": 60.0, "nothing changed": 10.0}  # [s] on two idle processors


def measured(folder: Path, kept_in: Path) -> tuple[float, float]:
    """Return what one `statemachine check` takes on the clock, and of processors [s]."""
    before, began = os.times(), time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "statemachine", "check", str(folder), "--jobs", "2"],
        env={**os.environ, "STATEMACHINE_JUDGED": str(kept_in)},
        stdout=subprocess.DEVNULL,
        check=False,  # some of it cannot be judged
    )
    took, after = time.perf_counter() - began, os.times()
    user = after.children_user - before.children_user
    return took, user + after.children_system - before.children_system


def main() -> None:
    """Print all of it."""
    students = importlib.import_module("tests.support.class_of_students")
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    print(f"{datetime.date.today()}, {platform.machine()}, {os.cpu_count()} processors,")
    print(f"load {load:.1f}, Python {platform.python_version()}, a class of {students.SIZE}")
    print(f"{'':17}{'clock':>8}{'processors':>12}{'half of that':>14}{'goal':>8}")
    with tempfile.TemporaryDirectory() as place:
        folder = students.write_class(Path(place) / "class")
        for what, goal in GOALS.items():
            clock, computed = measured(folder, Path(place) / "judged")
            print(
                f"{what:17}{clock:6.1f} s{computed:10.1f} s{computed / 2:12.1f} s{goal:6.0f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
