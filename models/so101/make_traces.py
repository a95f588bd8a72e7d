"""Record on PyBullet every scenario of `statemachine compare`: `make traces`.

Where PyBullet has no wheel its side of a comparison comes from these files, which are
part of the package. A test records them anew and compares.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Literal

import statemachine as sm
from statemachine.experiments.scenarios import SCENARIOS
from statemachine.traces import Trace, record_scenario, write

FOLDER = Path(__file__).resolve().parents[2] / "statemachine" / "traces" / "recorded"
DEFAULTS: tuple[Literal["model", "engine"], ...] = ("model", "engine")


def traces() -> dict[str, Trace]:
    """Every trace by the name of its file."""
    found = {}
    for name, scenario in SCENARIOS.items():
        for defaults in DEFAULTS:
            model = sm.load(scenario.model, backend="pybullet", defaults=defaults)
            typed = f"statemachine trace record {name} --backend pybullet"
            typed += " --defaults engine" if defaults == "engine" else ""
            trace = record_scenario(scenario, model, defaults=defaults, command=typed)
            header = dataclasses.replace(trace.header, single=True)
            suffix = ".engine" if defaults == "engine" else ""
            found[f"{name}.pybullet{suffix}"] = Trace(header, trace.columns)
    return found


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, trace in traces().items():
        path = write(trace, FOLDER / f"{name}.npz")
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB, {trace!r}")
