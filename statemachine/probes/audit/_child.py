"""The fresh process: it is told what to run, runs it and writes the answer."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path

from ...engines.auditing import Driver
from ...interface import Model, State
from .interface_driver import Answer, InterfaceDriver, Traces
from .points import points


def answer(
    model: Model, seed: int, steps: int, states: dict[str, State], kinds: tuple[type[Driver], ...]
) -> Answer:
    """All runs from the start, and a future of each State."""
    runs: Traces = {}
    futures = {}
    # A point without a State is one at which somebody diverged.
    places = [point for point in points(model, seed)[0] if point.name in states]
    for driver in (kind(model, seed) for kind in kinds):
        for point in places:
            if not driver.lacks(point):
                runs[driver.layer, point.name] = driver.run(point, steps).future
            if isinstance(driver, InterfaceDriver):
                futures[point.name] = driver.future(point, states[point.name], steps)
    return runs, futures


if __name__ == "__main__":
    Path(sys.argv[1]).write_bytes(pickle.dumps(answer(*pickle.load(sys.stdin.buffer))))
