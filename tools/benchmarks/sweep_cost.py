"""What a cell of a sweep costs, and how many tasks loky and Dask hand out: `docs/sweeps.md`.

    python -m tools.benchmarks.sweep_cost

It needs what sweeps on many machines need: pip install -e '.[cluster]'.

Cells are measured in processor seconds, which other work on the machine changes little; rates of
tasks by the clock. It takes about two minutes.
"""

from __future__ import annotations

import datetime
import os
import platform
import tempfile
import time
import tracemalloc
import warnings
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import joblib

import statemachine as sm
from statemachine.lab.runs.robot import ARM_TARGET
from statemachine.lab.sweep import Sweep, prepare_sweep
from statemachine.lab.sweep.rows import CELLS, RowWriter, iter_cell_outcomes
from statemachine.lab.sweep.worker import Row, run_batch

YEAR = 365.25 * 86400
CELLS_OF_ALL = 10**9
TASKS, ROWS = 1000, 400


def empty(number: int) -> int:
    """Do nothing: a task whose cost is the scheduler's."""
    return number


def cells(what: str, backend: str, vary: tuple[str, ...], seeds: int) -> tuple[float, list[Row]]:
    """Return the processor time of a cell [s], and the rows, without the first ones, which load."""
    ready = prepare_sweep(Sweep(what, vary, (backend,), seeds=seeds))
    every = list(ready.cells(backend))
    run_batch(ready, every[:1], False)
    began = time.process_time()
    rows = run_batch(ready, every[1:], False)
    return (time.process_time() - began) / len(rows), rows


def bytes_of(rows: list[Row], moments: int) -> tuple[float, float, float]:
    """Return the size of a row on disk [bytes], and the times to write and to read one [s]."""
    ready = prepare_sweep(Sweep("hold", ("damping=0.5x,2x",), ("mujoco",), moments=moments))
    with tempfile.TemporaryDirectory() as folder:
        writer = RowWriter(Path(folder), ready.design.factors, {"request": {}})
        began = time.process_time()
        writer.add(rows)
        writer.flush()
        wrote = (time.process_time() - began) / len(rows)
        size = sum(part.stat().st_size for part in (Path(folder) / CELLS).rglob("*.parquet"))
        sum(1 for _ in iter_cell_outcomes(Path(folder)))  # the first time imports more
        began = time.process_time()
        found = sum(1 for _ in iter_cell_outcomes(Path(folder)))
        return size / len(rows), wrote, (time.process_time() - began) / found


def ids() -> tuple[float, float]:
    """Return the processor time to name a cell [s], and the memory to remember it [bytes]."""
    ready = prepare_sweep(Sweep("hold", ("damping=0.5x:2x:10000",), ("mujoco",)))
    began = time.process_time()
    number = sum(1 for _ in ready.cells("mujoco"))
    took = time.process_time() - began
    tracemalloc.start()
    known = {cell.id: "done" for cell in ready.cells("mujoco")}
    size, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return took / number, size / len(known)


def steps_alone(backend: str) -> float:
    """Return the processor time of the steps of `hold` [s], and of nothing else."""
    model = sm.load("so101/scene", backend=backend)
    with sm.make_data(model) as data:
        data.ctrl[:] = ARM_TARGET
        began = time.process_time()
        sm.step(model, data, 400)
        return time.process_time() - began


def rate(submit: Callable[..., Any], workers: int) -> float:
    """Measure empty tasks a second, with twice as many in the air as there are workers."""
    [future.result() for future in [submit(empty, k) for k in range(50)]]  # all workers are there
    waiting = deque(submit(empty, k) for k in range(2 * workers))
    began = time.perf_counter()
    for k in range(TASKS):
        waiting.popleft().result()
        waiting.append(submit(empty, k))
    return TASKS / (time.perf_counter() - began)


def main() -> None:
    """Print all of it."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    print(f"{datetime.date.today()}, {platform.machine()}, {os.cpu_count()} processors,")
    print(f"load {load:.1f}, Python {platform.python_version()}, joblib {joblib.__version__}")
    for backend in ("mujoco", "pybullet"):
        alone = min(steps_alone(backend) for _ in range(3))
        version = sm.load("so101/scene", backend=backend).engine_version
        print(f"the 400 steps of hold alone, {backend} {version}: {alone * 1e3:.1f} ms")
    for what in ("hold", "waves"):
        for backend in ("mujoco", "pybullet"):
            for label, vary, seeds in (
                ("one Model, many seeds", (), 9),
                ("a Model for each", ("damping=0.5x:2x:9",), 1),
            ):
                cost, rows = cells(what, backend, vary, seeds)
                years = cost * CELLS_OF_ALL / YEAR
                print(
                    f"{what:6} {backend:9} {label:22} {cost * 1e3:7.1f} ms a cell, "
                    f"{rows[0]['steps']} steps; 1e9 cells: {years:.1f} processor years"
                )
    _, kept = cells("hold", "mujoco", ("damping=0.5x,2x",), ROWS // 2)
    for moments in (20, 1):
        chosen = [
            {**row, **{name: row[name][-moments:] for name in row if name.startswith("sample_")}}
            for row in kept
        ]
        size, wrote, read = bytes_of([dict(row) for row in chosen], moments)
        print(
            f"{moments} moments: {size:.0f} bytes a row in a file of {len(chosen)}, "
            f"{wrote * 1e6:.0f} µs to write it, {read * 1e6:.1f} µs to read its id"
        )
    took, size = ids()
    print(f"{took * 1e6:.1f} µs to name a cell, {size:.0f} bytes to remember it")
    jobs = os.cpu_count() or 1
    with warnings.catch_warnings(action="ignore"):
        import distributed
        from joblib.externals.loky import ProcessPoolExecutor

        with ProcessPoolExecutor(max_workers=jobs) as pool:
            print(f"loky, {jobs} processes: {rate(pool.submit, jobs):.0f} tasks/s")

        with (
            distributed.LocalCluster(
                n_workers=jobs, threads_per_worker=1, dashboard_address=":0"
            ) as cluster,
            distributed.Client(cluster) as client,
        ):
            dask = partial(client.submit, pure=False)
            print(f"dask, {jobs} workers: {rate(dask, jobs):.0f} tasks/s")


if __name__ == "__main__":
    main()
