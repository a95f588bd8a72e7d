"""How a sweep hands out its cells: to workers that run them here, one batch after the other."""

from __future__ import annotations

import itertools
import json
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from statemachine.errors import BadInputError, MissingEngineError, ModelError
from statemachine.lab.sweep import PreparedSweep, Sweep, prepare_sweep, read_cells, run_sweep
from statemachine.lab.sweep import worker as sweep_worker

from .support.files import written
from .support.small_models import mjcf

pytest.importorskip("pyarrow")
pytest.importorskip("joblib")

DRIVER = sys.modules["statemachine.lab.sweep"]
PREPARE = sys.modules["statemachine.lab.sweep.prepare"]
ADDRESS = "tcp://nowhere:1"
PENDULUM = '<body><joint name="j" axis="0 1 0"/><geom size=".05" pos="0 0 -.3" mass="1"/></body>'
MOTOR = '<actuator><motor name="m" joint="j"/></actuator>'
FUNCTIONS = """
import os, time

def still(model, data, gain=1.0):
    return [gain * 0.001] * model.nu

def fails(model, data, gain=1.0):
    if gain == 2 and not os.path.exists(os.path.join(os.path.dirname(__file__), "mended")):
        raise RuntimeError("not yet")

def hangs(model, data, gain=1.0):
    while True:
        pass

def sleeps(model, data, gain=1.0):
    time.sleep(0.05)
"""


def of_function(folder: Path, name: str, *vary: str, **others: Any) -> Sweep:
    """Return a sweep of a function of the user's, of ten steps of a pendulum."""
    file = written(folder / "policy.py", FUNCTIONS)
    model = str(written(folder / "pendulum.xml", mjcf(PENDULUM, MOTOR)))
    usual: dict[str, Any] = {"backends": ("mujoco",), "seconds": 0.02, "model": model}
    return Sweep(f"{file}:{name}", vary=vary, **usual | others)


class Workers:
    """Workers that run what they get at once, in this process.

    Attributes:
        batches: The gains of the cells of each batch, in the order in which they were submitted.
        dedicated: Whether each was submitted to a process of the driver's own.
        lost: Gains of cells with which a process ends.
        jobs: How many processes of its own the driver asked for.
    """

    def __init__(self) -> None:
        self.batches: list[list[Any]] = []
        self.dedicated: list[bool] = []
        self.lost: set[Any] = set()
        self.ends_dedicated = False
        self.jobs: list[int] = []

    def submit(self, function: Any, ready: PreparedSweep, batch: Sequence[Any]) -> Future[Any]:
        """Run a batch, which is not to silence or to end this process."""
        gains = [value for cell in batch for value in cell.values]
        is_dedicated = function.keywords["is_dedicated"]
        self.batches.append(gains)
        self.dedicated.append(is_dedicated)
        future: Future[Any] = Future()
        if self.lost & set(gains) and (self.ends_dedicated or not is_dedicated):
            future.set_exception(RuntimeError("the process ended"))
        else:
            future.set_result(function.func(ready, batch, is_dedicated=False))
        return future

    @contextmanager
    def processes(self, jobs: int) -> Iterator[list[Callable[..., Future[Any]]]]:
        """Yield the workers of this machine."""
        self.jobs.append(jobs)
        yield [self.submit] * jobs


class Cluster:
    """The client of a scheduler whose workers run what they get in this process."""

    def __init__(self, workers: Workers) -> None:
        self.workers = workers
        self.status = "running"
        self.threads = {"one": 1, "two": 2}
        self.answers: dict[str, Any] | None = None
        self.asked: list[tuple[Any, ...]] = []
        self.closed = 0
        self.is_late = False
        self.error: Exception | None = None

    def connect(self, address: str, **options: Any) -> Cluster:
        """Return this client, as the package's class does."""
        if self.error is not None:
            raise self.error
        self.asked.append((address, options["set_as_default"]))
        return self

    def wait_for_workers(self, count: int, timeout: float) -> None:
        """Wait in vain, where workers are late."""
        self.asked.append((count, timeout))
        if self.is_late:
            raise TimeoutError

    def run(self, function: Any, *arguments: Any, on_error: str) -> dict[str, Any]:
        """Call a function on each worker."""
        assert on_error == "return"
        if self.answers is not None:
            return self.answers
        return {name: function(*arguments) for name in self.threads}

    def nthreads(self) -> dict[str, int]:
        """Return the threads of each worker."""
        return self.threads

    def get_executor(self, pure: bool) -> Any:
        """Return what submits to the workers."""
        assert not pure  # a batch is run each time
        return self.workers

    def close(self, timeout: float) -> None:
        """Close it; what goes wrong then is nobody's concern."""
        self.closed += 1
        raise OSError


@pytest.fixture
def workers(monkeypatch: pytest.MonkeyPatch) -> Workers:
    """Return the workers of the driver, which are no processes."""
    workers = Workers()
    monkeypatch.setattr(DRIVER, "worker_processes", workers.processes)
    return workers


@pytest.fixture
def cluster(workers: Workers, monkeypatch: pytest.MonkeyPatch) -> Cluster:
    """Return the client of a scheduler."""
    cluster = Cluster(workers)
    package = SimpleNamespace(Client=cluster.connect)
    monkeypatch.setattr(DRIVER, "require_extra", lambda *_: package)
    return cluster


def gains(folder: Path) -> list[Any]:
    """Return the gains of all rows of a dataset, the smallest first."""
    return sorted(read_cells(folder).column("vary.gain").to_pylist())


# On this machine.


def test_every_cell_is_run_once(workers: Workers, tmp_path: Path) -> None:
    summary = run_sweep(of_function(tmp_path, "still", "gain=1:7:7"), tmp_path / "out", jobs=2)
    assert gains(tmp_path / "out") == [1, 2, 3, 4, 5, 6, 7]
    assert sorted(itertools.chain(*workers.batches)) == [1, 2, 3, 4, 5, 6, 7]
    assert (summary.cells, summary.done, summary.ran, summary.missing) == (7, 7, 7, 0)
    assert (workers.jobs, set(workers.dedicated)) == ([2], {True})


@pytest.mark.parametrize(("cells", "jobs", "most"), [(12, 1, 3), (12, 2, 2), (5, 2, 1), (9, 1, 3)])
def test_there_are_four_batches_for_each_job_at_least(
    cells: int, jobs: int, most: int, workers: Workers, tmp_path: Path
) -> None:
    run_sweep(of_function(tmp_path, "still", f"gain=1:9:{cells}"), tmp_path / "out", jobs=jobs)
    assert max(map(len, workers.batches)) == most
    assert sum(map(len, workers.batches)) == cells


def test_a_sweep_that_is_done_is_not_run_again(workers: Workers, tmp_path: Path) -> None:
    sweep = of_function(tmp_path, "still", "gain=1,2")
    run_sweep(sweep, tmp_path / "out", jobs=1)
    workers.batches.clear()
    summary = run_sweep(sweep, tmp_path / "out", jobs=1)
    assert workers.batches == []
    assert (summary.done, summary.ran) == (2, 0)


def test_the_fraction_that_is_done_is_told(workers: Workers, tmp_path: Path) -> None:
    told: list[float] = []
    run_sweep(
        of_function(tmp_path, "still", "gain=1,2,3,4"),
        tmp_path / "out",
        jobs=1,
        progress=told.append,
    )
    assert told == pytest.approx([0.25, 0.5, 0.75, 1.0])


def test_a_cell_that_failed_is_run_again_where_that_is_asked(
    workers: Workers, tmp_path: Path
) -> None:
    sweep, out = of_function(tmp_path, "fails", "gain=1,2,3"), tmp_path / "out"
    summary = run_sweep(sweep, out, jobs=1)
    assert (summary.done, summary.failed) == (2, {"BadInputError": 1})
    (tmp_path / "mended").touch()
    assert run_sweep(sweep, out, jobs=1).ran == 0
    summary = run_sweep(sweep, out, jobs=1, retry_failed=True)
    assert (summary.ran, summary.done, summary.failed) == (1, 3, {})
    assert gains(out) == [1, 2, 3]


def test_the_cells_of_a_batch_that_is_lost_are_run_again_one_by_one(
    workers: Workers, tmp_path: Path
) -> None:
    workers.lost, workers.ends_dedicated = {2}, True
    sweep, out = of_function(tmp_path, "still", "gain=1:8:8"), tmp_path / "out"
    summary = run_sweep(sweep, out, jobs=1)
    # Two cells a batch; of the first one is lost, and it ends the process a second time.
    assert [batch for batch in workers.batches if len(batch) == 1] == [[1], [2]]
    assert (summary.done, summary.failed) == (7, {"WorkerEndedError": 1})
    assert gains(out) == [1, 2, 3, 4, 5, 6, 7, 8]


# A folder that grows.


def test_a_design_may_grow_where_that_is_asked(workers: Workers, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_sweep(of_function(tmp_path, "still", "gain=1,2"), out, jobs=1)
    larger = of_function(tmp_path, "still", "gain=1,2,3", seeds=2)
    with pytest.raises(BadInputError):
        run_sweep(larger, out, jobs=1)
    summary = run_sweep(larger, out, jobs=1, extend=True)
    assert (summary.ran, summary.done) == (4, 6)
    assert gains(out) == [1, 1, 2, 2, 3, 3]


@pytest.mark.parametrize(("vary", "foreign"), [("gain=1,4", 2), ("gain=5,6", 3), ("gain=1,2", 1)])
def test_a_design_that_lacks_cells_that_are_there_is_refused(
    vary: str, foreign: int, workers: Workers, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    run_sweep(of_function(tmp_path, "still", "gain=1,2,3"), out, jobs=1)
    with pytest.raises(BadInputError, match=f" {foreign} cells "):
        run_sweep(of_function(tmp_path, "still", vary), out, jobs=1, extend=True)
    assert gains(out) == [1, 2, 3]


# On the workers of a scheduler.


def test_workers_of_a_scheduler_give_the_dataset_of_this_machine(
    cluster: Cluster, tmp_path: Path
) -> None:
    sweep = of_function(tmp_path, "still", "gain=1:5:5")
    summary = run_sweep(sweep, tmp_path / "there", scheduler=ADDRESS)
    assert (summary.done, summary.ran, summary.missing) == (5, 5, 0)
    assert set(cluster.workers.dedicated) == {False}
    run_sweep(sweep, tmp_path / "here", jobs=1)
    there, here = (
        read_cells(tmp_path / name).drop_columns(["wall_seconds"]) for name in ("there", "here")
    )
    assert there.equals(here)


def test_batches_are_for_all_threads_of_a_cluster(cluster: Cluster, tmp_path: Path) -> None:
    sweep = of_function(tmp_path, "still", "gain=1:9:18")
    run_sweep(sweep, tmp_path / "out", scheduler=ADDRESS)
    assert max(map(len, cluster.workers.batches)) == 2  # of four batches for each of three threads


def test_what_a_worker_of_a_cluster_does_not_survive_is_run_here(
    cluster: Cluster, tmp_path: Path
) -> None:
    cluster.workers.lost = {2}
    sweep = of_function(tmp_path, "still", "gain=1,2,3")
    summary = run_sweep(sweep, tmp_path / "out", scheduler=ADDRESS)
    runs = list(zip(cluster.workers.batches, cluster.workers.dedicated, strict=True))
    assert [batch for batch, is_dedicated in runs if is_dedicated] == [[2]]
    assert (summary.done, summary.failed, cluster.workers.jobs) == (3, {}, [1])


def test_where_the_scheduler_went_away_what_was_done_is_kept(
    cluster: Cluster, tmp_path: Path
) -> None:
    cluster.workers.lost, cluster.status = {2}, "closed"
    sweep = of_function(tmp_path, "still", "gain=1,2,3")
    with pytest.raises(BadInputError):
        run_sweep(sweep, tmp_path / "out", scheduler=ADDRESS)
    assert not any(cluster.workers.dedicated)
    assert cluster.closed == 1


def test_a_scheduler_is_asked_for_its_workers_and_closed(cluster: Cluster, tmp_path: Path) -> None:
    run_sweep(of_function(tmp_path, "still"), tmp_path / "out", scheduler=ADDRESS)
    assert cluster.asked == [(ADDRESS, False), (1, 10.0)]
    assert cluster.closed == 1


def test_workers_that_are_late_may_be_there_all_the_same(cluster: Cluster, tmp_path: Path) -> None:
    cluster.is_late = True
    summary = run_sweep(of_function(tmp_path, "still"), tmp_path / "out", scheduler=ADDRESS)
    assert summary.done == 1


@pytest.mark.parametrize(
    ("answers", "says"),
    [
        ({}, ADDRESS),
        ({"one": "", "two": "statemachine"}, "two"),
        ({"one": ImportError("no such module"), "two": ""}, "no such module"),
    ],
)
def test_a_cluster_that_cannot_run_the_sweep_is_refused(
    answers: dict[str, Any], says: str, cluster: Cluster, tmp_path: Path
) -> None:
    cluster.answers = answers
    with pytest.raises(BadInputError, match=says):
        run_sweep(of_function(tmp_path, "still"), tmp_path / "out", scheduler=ADDRESS)
    assert (cluster.workers.batches, cluster.closed) == ([], 1)


@pytest.mark.parametrize("error", [OSError, ValueError, TimeoutError])
def test_a_scheduler_that_does_not_answer_is_named(
    error: type[Exception], cluster: Cluster, tmp_path: Path
) -> None:
    cluster.error = error()
    with pytest.raises(BadInputError, match=f"{ADDRESS} .{error.__name__}"):
        run_sweep(of_function(tmp_path, "still"), tmp_path / "out", scheduler=ADDRESS)


# A worker that is a process of its own.


def in_a_fork(call: Callable[[], Any]) -> Any:
    """Return what a call returns in a child of this process, as JSON has it."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        try:
            os.write(writing, json.dumps(call()).encode())
        finally:
            os._exit(0)
    os.close(writing)
    with os.fdopen(reading, encoding="utf-8") as file:
        text = file.read()
    os.waitpid(child, 0)
    return json.loads(text)


def run_dedicated(sweep: Sweep) -> list[Any]:
    """Return what a process of its own does with the cells of a sweep."""
    ready = prepare_sweep(sweep)
    cells = [cell for name in ready.backends for cell in ready.cells(name)]
    alarms: list[list[float]] = []
    ends: list[Any] = []
    silenced: list[int] = []

    def silence() -> None:
        silenced.append(1)

    def call() -> Any:
        set_timer = signal.setitimer

        def timed(which: int, seconds: float) -> Any:
            alarms.append([which, seconds])
            return set_timer(which, seconds)

        sweep_worker.silence_child = silence
        signal.setitimer = timed  # pyright: ignore
        handler = sweep_worker.faulthandler
        handler.dump_traceback_later = lambda s, exit, file: ends.append([s, exit])  # pyright: ignore
        handler.cancel_dump_traceback_later = lambda: ends.append("cancelled")
        sweep_worker.run_batch(ready, cells[:1], is_dedicated=True)
        [row] = sweep_worker.run_batch(ready, cells[:1], is_dedicated=True)
        is_ignored = signal.getsignal(signal.SIGINT) == signal.SIG_IGN
        return [row["status"], row.get("error_class"), alarms, ends, len(silenced), is_ignored]

    return in_a_fork(call)


forks = pytest.mark.skipif(sys.platform == "win32", reason="no forks, and no such signals")


@forks
def test_a_function_that_does_not_come_back_is_ended_when_its_time_is_up(tmp_path: Path) -> None:
    status, error, *_ = run_dedicated(of_function(tmp_path, "hangs", timeout=0.2))
    assert (status, error) == ("failed", "TimedOutError")


@forks
def test_an_alarm_is_set_for_loading_and_for_the_run_and_taken_back(tmp_path: Path) -> None:
    status, _, alarms, ends, _, _ = run_dedicated(of_function(tmp_path, "sleeps", timeout=90.0))
    assert status == "done"
    once = [[signal.ITIMER_REAL, 90.0], [signal.ITIMER_REAL, 0]] * 2
    assert alarms == once * 2
    assert ends == [[100.0, True], "cancelled"] * 4


@forks
def test_loading_has_a_minute_at_least(tmp_path: Path) -> None:
    _, _, alarms, ends, _, _ = run_dedicated(of_function(tmp_path, "still", timeout=5.0))
    assert [seconds for _, seconds in alarms[:4]] == [60.0, 0, 5.0, 0]
    assert ends[:4] == [[70.0, True], "cancelled", [15.0, True], "cancelled"]


@forks
def test_a_process_is_made_silent_once_and_hears_no_interrupt(tmp_path: Path) -> None:
    *_, silenced, is_ignored = run_dedicated(of_function(tmp_path, "still"))
    assert (silenced, is_ignored) == (1, True)


@forks
def test_a_worker_that_shares_its_process_sets_no_alarm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ready = prepare_sweep(of_function(tmp_path, "still"))
    alarms: list[Any] = []
    monkeypatch.setattr(signal, "setitimer", lambda *alarm: alarms.append(alarm))
    handler = signal.getsignal(signal.SIGINT)
    [row] = sweep_worker.run_batch(ready, list(ready.cells("mujoco")), is_dedicated=False)
    assert (row["status"], alarms) == ("done", [])
    assert signal.getsignal(signal.SIGINT) == handler


# What is checked before anything runs.


@pytest.mark.parametrize(("samples", "is_told"), [(3, True), (4, False), (6, True), (8, False)])
def test_a_number_of_samples_that_is_no_power_of_two_is_told(samples: int, is_told: bool) -> None:
    sweep = Sweep("hold", ("damping=0.5x:2x",), ("mujoco",), samples=samples)
    told = [note for note in prepare_sweep(sweep).notes if note.startswith(f"{samples} samples")]
    assert len(told) == is_told


@pytest.mark.parametrize(("seeds", "is_told"), [(10_000, False), (10_001, True), (10**8, True)])
def test_many_cells_are_told(seeds: int, is_told: bool) -> None:
    notes = prepare_sweep(Sweep("hold", (), ("mujoco",), seeds=seeds)).notes
    assert (f"{seeds:,} cells" in notes) is is_told


def test_more_cells_than_can_be_remembered_are_refused() -> None:
    with pytest.raises(BadInputError, match="100,000,000"):
        prepare_sweep(Sweep("hold", (), ("mujoco",), seeds=10**8 + 1))


def without(monkeypatch: pytest.MonkeyPatch, missing: str, error: Exception) -> list[str]:
    """Let a backend refuse every model; return the backends that are asked, as they are."""
    load, asked = PREPARE.load_model_of_sweep, list[str]()

    def loaded(sweep: Sweep, place: str, backend: str, options: Any) -> Any:
        asked.append(backend)
        if backend == missing:
            raise error
        return load(sweep, place, backend, options)

    monkeypatch.setattr(PREPARE, "load_model_of_sweep", loaded)
    return asked


def test_of_all_engines_one_that_is_missing_is_left_out_and_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = without(monkeypatch, "pybullet", MissingEngineError("it is not installed"))
    ready = prepare_sweep(Sweep("hold", ("model=so101/scene,so101/scene_box",), ("all",)))
    assert "mujoco" in ready.backends
    assert "pybullet" not in ready.backends
    assert asked.count("pybullet") == 1
    assert asked.count("mujoco") == 2
    assert len([note for note in ready.notes if "it is not installed" in note]) == 1


def test_an_engine_that_is_asked_for_must_be_here(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "pybullet", MissingEngineError("it is not installed"))
    with pytest.raises(MissingEngineError, match="it is not installed"):
        prepare_sweep(Sweep("hold", (), ("mujoco", "pybullet")))


def test_an_engine_that_refuses_a_model_stays_and_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "pybullet", ModelError("no such joint"))
    ready = prepare_sweep(Sweep("hold", (), ("mujoco", "pybullet", "mujoco")))
    assert ready.backends == ("mujoco", "pybullet")
    assert len([note for note in ready.notes if "no such joint" in note]) == 1


def test_what_every_engine_refuses_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "mujoco", ModelError("no such joint"))
    with pytest.raises(ModelError, match="no such joint"):
        prepare_sweep(Sweep("hold", (), ("mujoco",)))
