"""The fresh process: it reads a job, does it and writes the answer."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path

from .drivers import drivers
from .drivers.interface_driver import InterfaceDriver
from .elsewhere import Answer, Job, Traces
from .points import points


def answer(job: Job) -> Answer:
    """All runs from the start, and a future of each State."""
    runs: Traces = {}
    futures = {}
    places, _ = points(job.model, job.seed)
    for driver in drivers(job.model, job.seed):
        # A point without a State is one at which somebody diverged.
        for point in places:
            name = point.name
            if name not in job.states or driver.lacks(point):
                continue
            runs[driver.layer, name] = driver.run(point, job.steps).future
            if isinstance(driver, InterfaceDriver):
                futures[name] = driver.future(point, job.states[name], job.steps)
    return Answer(runs, futures)


def main(asked: str, answered: str) -> None:
    """Read the one file, write the other."""
    job = pickle.loads(Path(asked).read_bytes())
    Path(answered).write_bytes(pickle.dumps(answer(job)))


if __name__ == "__main__":
    main(*sys.argv[1:])
