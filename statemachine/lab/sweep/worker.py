"""What a worker does: cells one after the other, each to a row, with the Models kept between.

A cell is a point of the design, a seed and a backend. Whatever happens in it, it gives a row.
"""

from __future__ import annotations

import faulthandler
import functools
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from types import FrameType
from typing import Any, TypeVar

import numpy as np

from ... import __version__
from ...backends import on_default, parse_backend
from ...errors import BadInputError, StateMachineError, TimedOutError, one_line
from ...installed import DEFAULT, silence
from ...interface import Array, Data, Model, forward, make_data, reset
from ...interface.options import OptionValue
from ...interface.records import READ_OPTIONS
from ...interface.sites import usual_site
from ...measures import ContactNames
from ...measures.text import listed
from ...models import resolve
from ...processes.parallel import silence_child
from ..recordings.energies import energies
from ..runs.controllers import function_file
from ..runs.drive import check_length, drive, number_of_steps
from ..runs.provenance import model_digest
from ..runs.scenarios import Scenario
from .design import Value, Vary, digest
from .outcomes import Outcomes
from .request import PreparedSweep, Sweep, SweepCell, options_at, spread_start, start_at
from .rows import DONE, FAILED, finite_or_none

T = TypeVar("T")
Row = dict[str, Any]

_LOADING_SECONDS = 60.0  # seconds that an engine and a model may take at least
_GRACE_SECONDS = (
    10.0  # seconds beyond a time-out, after which a process that still hangs ends itself
)
_MAX_CACHED_MODELS = 16  # of the latest Models
_CLOCK_STEPS = 64  # steps after which the clock is looked at
_ENGINE_LOCK = threading.Lock()  # a Dask worker may have several threads, and an engine must not


def run_batch(ready: PreparedSweep, cells: Sequence[SweepCell], is_dedicated: bool) -> list[Row]:
    """Run cells; every one gives a row, whatever happens in it.

    Args:
        ready: The sweep.
        cells: To run, in this order.
        is_dedicated: Whether this process is there for nothing else: it may then be kept silent,
            and ended.
    """
    if is_dedicated:
        _prepare_process()
    with _ENGINE_LOCK, warnings.catch_warnings(), silence():
        warnings.simplefilter("ignore")  # the driver has loaded the same models, and passed them on
        return [_row(ready, cell, is_dedicated) for cell in cells]


@functools.cache
def _prepare_process() -> None:
    """Prepare this process once: its output is discarded, and it ends when its driver does."""
    silence_child()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where it was not kept from it already


def row_of(ready: PreparedSweep, cell: SweepCell, error: BaseException | None = None) -> Row:
    """Return what every row of a cell has, and of one that failed what happened."""
    row: Row = {
        "cell": cell.id,
        "point": cell.point,
        "seed": cell.seed,
        "backend": cell.backend,
        "status": DONE if error is None else FAILED,
        "library_version": __version__,
    }
    for vary, value in zip(ready.design.factors, cell.values, strict=True):
        row[vary.column] = value
    if error is not None:
        kind = type(error).__name__
        row["error_class"] = kind
        row["error"] = one_line(error) or kind
    return row


def _row(ready: PreparedSweep, cell: SweepCell, is_dedicated: bool) -> Row:
    began, limit = time.perf_counter(), ready.sweep.timeout
    row: Row = {}
    failure: BaseException | None = None
    try:
        with _time_limit(max(limit, _LOADING_SECONDS), is_dedicated):
            model, options, scenario = _model(ready, cell, row)
        with _time_limit(limit, is_dedicated):
            _run(ready, cell, model, options, scenario, row)
    except _OutOfTimeError:
        failure = _timeout_error(limit)
    except Exception as error:  # of any kind: it belongs into the row
        failure = error
    return {**row, **row_of(ready, cell, failure), "wall_seconds": time.perf_counter() - began}


class _OutOfTimeError(BaseException):
    """The time is up: raised wherever the process is; nobody takes it for an error of theirs."""


@contextmanager
def _time_limit(seconds: float, is_dedicated: bool) -> Iterator[None]:
    """Raise `_OutOfTimeError` in what takes too long; end a process that does not even raise it.

    A run looks at the clock itself. This is for what does not come back from the user's function
    or from the engine; it needs a process of its own, whose signals are nobody else's.
    """
    if not is_dedicated:
        yield
        return
    timer = hasattr(signal, "setitimer")  # not on Windows: there a process only ends

    def end(_number: int, _frame: FrameType | None) -> None:
        raise _OutOfTimeError

    if timer:
        signal.signal(signal.SIGALRM, end)
        signal.setitimer(signal.ITIMER_REAL, seconds)
    faulthandler.dump_traceback_later(seconds + _GRACE_SECONDS, exit=True, file=sys.__stderr__ or 2)
    try:
        yield
    finally:
        if timer:
            signal.setitimer(signal.ITIMER_REAL, 0)
        faulthandler.cancel_dump_traceback_later()


def _timeout_error(seconds: float) -> TimedOutError:
    return TimedOutError(f"not at its end after {seconds:g} s on the clock")


def _model(
    ready: PreparedSweep, cell: SweepCell, row: Row
) -> tuple[Model, dict[str, OptionValue], Scenario]:
    """Return the Model of a cell, the options that it was made with, and what is done on it.

    Raises:
        BadInputError: The model or the function is another one than that of the sweep.
    """
    sweep, wrong = ready.sweep, "is not the file of the sweep: it changed, or is another here"
    if not _is_unchanged(ready):
        raise BadInputError(f"{function_file(sweep.what).name} {wrong}")
    chosen: dict[str, Value] = {"seed": cell.seed} if "seed" in ready.parameters else {}
    chosen |= {vary.name: value for vary, value in ready.settings(cell, "parameter")}
    scenario = sweep.scenario(chosen)
    name = _model_name(ready, cell)
    varied = ready.settings(cell, "option")
    # A switch may be what lets an engine take the file at all: `load` is told.
    first: dict[str, OptionValue] = dict(scenario.options)
    rest: list[tuple[Vary, Value]] = []
    for vary, value in varied:
        if isinstance(value, bool) or vary.name in READ_OPTIONS:
            first[vary.name] = value
        else:
            rest.append((vary, value))
    key = repr((name, ready.files[name], cell.backend, first, sweep))

    def loaded() -> tuple[Model, Scenario]:
        if not _is_unchanged(ready, name):
            raise BadInputError(f"{name} {wrong}")
        base = load_model_of_sweep(sweep, ready.places[name], cell.backend, first)
        return base, scenario.on(base)

    base, on_robot = _cached(key, loaded)
    row["engine_version"] = base.engine_version
    # The user's own is the same on every robot, and has the parameters of this cell.
    scenario = scenario if scenario.is_user_function else on_robot
    if not (options := options_at(base, rest)):
        return base, first, scenario
    key += repr([(v.label, v.times, value) for v, value in rest])
    model = _cached(key, lambda: base.replace(**options))
    return model, {**first, **options}, scenario


def _model_name(ready: PreparedSweep, cell: SweepCell) -> str:
    """Return the name of a cell's model: of several that are varied, or the only one."""
    for _, value in ready.settings(cell, "model"):
        return str(value)
    return next(iter(ready.files))


def load_model_of_sweep(
    sweep: Sweep, place: str, backend: str, options: Mapping[str, OptionValue]
) -> Model:
    """Load a model of a sweep as all of its cells do."""
    return parse_backend(backend).load_to_run(place, menagerie=sweep.menagerie, **options)


_MODEL_CACHE: dict[str, Any] = {}


def _cached(key: str, make: Callable[[], T]) -> T:
    """Return the cached result of `make` for a key; an error is a result too."""
    try:
        result: Any = _MODEL_CACHE.pop(key) if key in _MODEL_CACHE else make()
    except Exception as error:
        result = error
    _MODEL_CACHE[key] = result  # the last one, so that the first is the one longest not asked for
    if len(_MODEL_CACHE) > _MAX_CACHED_MODELS:
        del _MODEL_CACHE[next(iter(_MODEL_CACHE))]
    if isinstance(result, Exception):
        raise result.with_traceback(None)
    return result


def _cached_on_default(model: Model) -> Model:
    """Return `on_default` of a Model, whose file is read for the first cell only."""
    here = model.backend == DEFAULT
    return model if here else _cached(f"{model.path} on {DEFAULT}", lambda: on_default(model))


_REUSABLE_DATA: dict[int, Data] = {}  # by the id of its Model, which it keeps


@contextmanager
def _reused_data(model: Model) -> Iterator[Data]:
    """Yield a Data that an earlier cell used, if there is one: making one costs more than `reset`.

    Not for a user's function, which may have changed what `reset` does not set back.
    """
    data = _REUSABLE_DATA.pop(id(model), None) or make_data(model)
    try:
        yield data
    except BaseException:
        data.close()
        raise
    _REUSABLE_DATA[id(model)] = data
    if len(_REUSABLE_DATA) > _MAX_CACHED_MODELS:
        _REUSABLE_DATA.pop(next(iter(_REUSABLE_DATA))).close()


def _run(
    ready: PreparedSweep,
    cell: SweepCell,
    model: Model,
    options: Mapping[str, OptionValue],
    scenario: Scenario,
    row: Row,
) -> None:
    """Run a cell and fill its row, with what is known until it fails as well.

    Raises:
        StateMachineError: The run fails: it diverges, takes too long, has bad input.
    """
    sweep, deadline = ready.sweep, time.monotonic() + ready.sweep.timeout
    check_length(model, scenario.seconds)
    total = number_of_steps(model, scenario.seconds)
    controller = scenario.controller(model, cell.seed)
    moments = np.round(np.arange(1, sweep.moments + 1) * total / sweep.moments).astype(int)
    sampled = set(moments[moments > 0].tolist())
    row["sample_time"], samples = [], list[Array]()
    speed, fastest = np.zeros(model.nv), np.zeros(model.nv)
    with make_data(model) if ready.function else _reused_data(model) as data:
        reset(model, data, scenario.keyframe)
        qpos, qvel = data.qpos, data.qvel  # the same arrays for the whole life of the Data
        starts = start_at(model, ready.settings(cell, "state"))
        for values, start in zip((qpos, qvel), starts, strict=True):
            values[list(start)] = list(start.values())
        qpos[:] = spread_start(model, qpos, ready.spread, cell.seed)
        at_start = qpos.copy(), qvel.copy()
        outcomes = Outcomes(model, qpos)
        try:
            for k, (began, now) in enumerate(pairwise(drive(model, data, controller, total)), 1):
                row["steps"] = k
                np.maximum(fastest, np.abs(qvel, out=speed), out=fastest)
                outcomes.look(data)
                if "touch" not in row and len(contacts := data.contacts):
                    # As derived arrays are: of the state in which the step began.
                    row["first_touch"] = began
                    names = ContactNames.of(model)
                    pairs = {names.pair(*geoms) for geoms in contacts.geom.tolist()}
                    row["touch"] = ", ".join(sorted(pairs))
                if k in sampled:
                    samples.append(qpos.copy())
                    row["sample_time"].append(float(now))
                if not k % _CLOCK_STEPS and time.monotonic() > deadline:
                    raise _timeout_error(sweep.timeout)
        finally:
            row["max_qvel"] = float(np.nan_to_num(fastest).max(initial=0.0))
            row["qpos"], row["qvel"] = qpos.tolist(), qvel.tolist()
            row["time"] = float(data.time)
            row |= outcomes.columns(qpos)
            row["sample_qpos"] = [sample.tolist() for sample in samples]
        states = np.array([at_start[0], qpos]), np.array([at_start[1], qvel])
        row["sample_tip"] = tips = _tip_positions(model, data, samples)
        row["tip"] = tips[-1] if tips else None
    defaults = parse_backend(cell.backend).defaults
    both, _ = energies(
        model, defaults, *states, options.get("gravity"), _cached_on_default, _reused_data
    )
    row["energy_start"], row["energy"] = map(finite_or_none, both.sum(axis=1))


def _tip_positions(model: Model, data: Data, samples: list[Array]) -> list[list[float]] | None:
    """Return positions of the usual site (3,) [m] in world axes, one for each sample of qpos.

    `data` of the run that ended serves to compute them; None where there is no such site.
    """
    site = usual_site(model.site_names, model.moving_sites)
    if site is None:
        return None
    tips = []
    reset(model, data)
    for qpos in samples:
        data.qpos = qpos
        forward(model, data)
        tips.append(data.site_xpos[site].tolist())
    return tips


def digest_of(function: str) -> str:
    """Return a digest of the user's file."""
    return digest(function_file(function).read_text(encoding="utf-8", errors="replace"))


def _is_unchanged(ready: PreparedSweep, model: str = "") -> bool:
    """Return whether a model's file, or else the user's, is the one of the sweep."""
    try:
        if model:
            file = resolve(ready.places[model], ready.sweep.menagerie)
            return model_digest(file) == ready.files[model]
        return not ready.function or digest_of(ready.sweep.what) == ready.function
    except (StateMachineError, OSError):
        return False


def environment_difference(ready: PreparedSweep, version: str) -> str:
    """Return how this machine differs from the driver of a sweep; "" if it does not.

    Args:
        ready: The sweep.
        version: Of the driver's library.
    """
    wrong = [] if version == __version__ else ["statemachine"]
    wrong += [name for name in ready.files if not _is_unchanged(ready, name)]
    return listed(wrong if _is_unchanged(ready) else [*wrong, ready.sweep.what])
