"""The fresh process: it reads a job, does it and writes the answer."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path

from .elsewhere import ChildRuns, Job, Traces
from .interface_driver import InterfaceDriver
from .points import points


def answer(job: Job) -> ChildRuns:
    """All runs from the start, and a future of each State."""
    runs: Traces = {}
    futures = {}
    places, _ = points(job.model, job.seed)
    for driver in (kind(job.model, job.seed) for kind in job.drivers):
        # A point without a State is one at which somebody diverged.
        for point in places:
            name = point.name
            if name not in job.states or driver.lacks(point):
                continue
            runs[driver.layer, name] = driver.run(point, job.steps).future
            if isinstance(driver, InterfaceDriver):
                futures[name] = driver.future(point, job.states[name], job.steps)
    return ChildRuns(runs, futures)


def main(asked: str, answered: str) -> None:
    """Read the one file, write the other."""
    job = pickle.loads(Path(asked).read_bytes())
    Path(answered).write_bytes(pickle.dumps(answer(job)))


if __name__ == "__main__":
    main(*sys.argv[1:])
