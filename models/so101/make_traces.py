"""Record what the package brings of engines that may not be here: `make traces`.

Where PyBullet has no wheel its side of a comparison comes from these files, for every scenario of
`statemachine compare`; of an older release of MuJoCo `lesson hold` tells. A test records them anew
and compares.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import statemachine as sm
from statemachine import releases
from statemachine.backends import BackendChoice
from statemachine.course.lessons._older_release import OLDER
from statemachine.lab.recordings import Trace, record_scenario, write
from statemachine.lab.runs.scenarios import SCENARIOS

FOLDER = Path(__file__).resolve().parents[2] / "statemachine" / "lab" / "recordings" / "recorded"


# Name of the file: the scenario, the backend, and how it is loaded.
RUNS: dict[str, tuple[str, str, Any]] = {
    f"{name}.pybullet{suffix}": (name, "pybullet", defaults)
    for name in SCENARIOS
    for suffix, defaults in (("", "model"), (".engine", "engine"))
}
RUNS[f"hold.{OLDER}"] = "hold", OLDER, "model"


def recorded(run: str) -> Trace:
    """A trace by the name of its file, recorded now."""
    name, backend, defaults = RUNS[run]
    scenario = SCENARIOS[name]
    model = sm.load(scenario.model, backend=backend, defaults=defaults)
    typed = f"statemachine trace record {name} --backend {BackendChoice(backend, defaults)}"
    trace = record_scenario(scenario, model, defaults=defaults, command=typed)
    header = dataclasses.replace(trace.header, single_precision=True)
    return Trace(header, trace.columns)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    releases.add(OLDER)
    for run in RUNS:
        trace = recorded(run)
        path = write(trace, FOLDER / f"{run}.npz")
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB, {trace!r}")
