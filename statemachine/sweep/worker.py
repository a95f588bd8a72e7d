"""What a worker does: cells one after the other, each to a row, with the Models kept between."""

from __future__ import annotations

import faulthandler
import functools
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any, TypeVar

from .. import __version__
from ..backends import load
from ..errors import BadInputError, StateMachineError
from ..interface import Model
from ..measures.text import listed
from ..models import resolve
from ..processes import end_with_parent
from ..runs.controllers import function_file
from ..runs.provenance import model_digest
from ..runs.scenarios import Scenario
from ..silence import silence
from .cell import run_cell, timed_out
from .design import digest
from .request import PreparedSweep, Sweep, SweepCell
from .rows import DONE, FAILED
from .settings import options_at

T = TypeVar("T")
Row = dict[str, Any]

_TO_LOAD = 60.0  # seconds that an engine and a model may take at least
_GRACE = 10.0  # seconds beyond a time-out, after which a process that still hangs ends itself
_KEPT = 8  # of the latest Models
_ONE_AT_A_TIME = threading.Lock()  # a Dask worker may have several threads, and an engine must not


def run_batch(ready: PreparedSweep, cells: Sequence[SweepCell], own: bool) -> list[Row]:
    """Run cells; every one gives a row, whatever happens in it.

    Args:
        ready: The sweep.
        cells: To run, in this order.
        own: Whether this process is there for nothing else: it may then be kept silent, and ended.
    """
    if own:
        _settle()
    with _ONE_AT_A_TIME, warnings.catch_warnings(), silence():
        warnings.simplefilter("ignore")  # the driver has loaded the same models, and passed them on
        return [_row(ready, cell, own) for cell in cells]


def row_of(ready: PreparedSweep, cell: SweepCell, error: BaseException | None = None) -> Row:
    """What every row of a cell has, and of one that failed what happened."""
    columns = [vary.column for vary in ready.design.factors]
    failed = {} if error is None else {
        "error_class": type(error).__name__,
        "error": " ".join(str(error).split()) or type(error).__name__,
    }  # fmt: skip
    return {
        "cell": cell.id,
        "point": cell.point,
        "seed": cell.seed,
        "backend": cell.backend,
        "status": FAILED if failed else DONE,
        "library_version": __version__,
        **dict(zip(columns, cell.values, strict=True)),
        **failed,
    }


def _row(ready: PreparedSweep, cell: SweepCell, own: bool) -> Row:
    began = time.perf_counter()
    row: Row = {}
    failure: BaseException | None = None
    limit = ready.sweep.timeout
    try:
        if ready.function and digest_of(ready.sweep.what) != ready.function:
            name = function_file(ready.sweep.what).name
            raise BadInputError(f"{name} is not the file of the sweep: it changed")
        with _limited(max(limit, _TO_LOAD), own):
            model, options, doing = _model(ready, cell, row)
        with _limited(limit, own):
            run_cell(ready, cell, model, options, doing, row)
    except _OutOfTimeError:
        failure = timed_out(limit)
    except Exception as error:  # of any kind: it belongs into the row
        failure = error
    return {**row, **row_of(ready, cell, failure), "wall_seconds": time.perf_counter() - began}


def digest_of(function: str) -> str:
    """A digest of the user's file."""
    return digest(function_file(function).read_text(encoding="utf-8", errors="replace"))


def _model(
    ready: PreparedSweep, cell: SweepCell, row: Row
) -> tuple[Model, dict[str, Any], Scenario]:
    """The Model of a cell, the options that it was made with, and what is done on it."""
    sweep = ready.sweep
    seeded = {"seed": cell.seed} if "seed" in ready.parameters else {}
    chosen = {vary.name: value for vary, value in ready.settings(cell, "parameter")}
    doing = sweep.scenario({**seeded, **chosen})
    name = next((value for _, value in ready.settings(cell, "model")), next(iter(ready.files)))
    varied = [(v, value) for v, value in ready.settings(cell, "option") if value is not None]
    # A switch may be what lets an engine take the file at all: `load` is told.
    first = {**doing.options, **{v.name: value for v, value in varied if isinstance(value, bool)}}
    rest = [(v, value) for v, value in varied if not isinstance(value, bool)]
    key = repr((name, ready.files[name], cell.backend, first, sweep))

    def loaded() -> tuple[Model, Scenario]:
        if not _is_here(ready, name):
            raise BadInputError(
                f"{name} is not the file of the sweep: it changed, or is another here"
            )
        base = load_of(sweep, ready.places[name], cell.backend, first)
        return base, doing.on(base)

    base, on_robot = _kept(_LOADED, key, loaded)
    row["engine_version"] = base.engine_version
    doing = doing if doing.own else on_robot  # the user's own is the same on every robot
    if not (options := options_at(base, rest)):
        return base, first, doing
    typed = repr([(v.label, v.times, value) for v, value in rest])
    model = _kept(_REPLACED, key + typed, lambda: base.replace(**options))
    return model, {**first, **options}, doing


def load_of(sweep: Sweep, place: str, backend: str, options: Mapping[str, Any]) -> Model:
    """A model of a sweep as all of its cells load it."""
    defaults, menagerie = sweep.defaults, sweep.menagerie
    return load(place, backend=backend, defaults=defaults, menagerie=menagerie, **options)


_LOADED: dict[str, Any] = {}
_REPLACED: dict[str, Any] = {}


def _kept(results: dict[str, Any], key: str, make: Callable[[], T]) -> T:
    """What was made for a key, or is made now; an error is a result too."""
    if key not in results:
        if len(results) == _KEPT:
            del results[next(iter(results))]
        try:
            results[key] = make()
        except Exception as error:
            results[key] = error
    if isinstance(results[key], Exception):
        raise results[key].with_traceback(None)
    return results[key]


class _OutOfTimeError(BaseException):
    """The time is up: raised wherever the process is; nobody takes it for an error of theirs."""


@contextmanager
def _limited(seconds: float, own: bool) -> Iterator[None]:
    """Raise `_OutOfTimeError` in what takes too long; end a process that does not even raise it.

    A run looks at the clock itself. This is for what does not come back from the user's function
    or from the engine; it needs a process of its own, whose signals are nobody else's.
    """
    if not own or not hasattr(signal, "setitimer"):
        yield
        return

    def end(_number: int, _frame: FrameType | None) -> None:
        raise _OutOfTimeError

    signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    assert sys.stderr is not None
    faulthandler.dump_traceback_later(seconds + _GRACE, exit=True, file=sys.__stderr__ or 2)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        faulthandler.cancel_dump_traceback_later()


@functools.cache
def _settle() -> None:
    """Once in a process of our own: nothing it prints is shown, and it ends with its driver."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where it was not kept from it already
    end_with_parent()


def differing(ready: PreparedSweep, version: str) -> str:
    """What this machine has otherwise than the driver of a sweep; "" if nothing.

    Args:
        ready: The sweep.
        version: Of the driver's library.
    """
    wrong = [] if version == __version__ else ["statemachine"]
    wrong += [name for name in ready.files if not _is_here(ready, name)]
    if ready.function and not (
        function_file(ready.sweep.what).is_file() and digest_of(ready.sweep.what) == ready.function
    ):
        wrong.append(ready.sweep.what)
    return listed(wrong)


def _is_here(ready: PreparedSweep, name: str) -> bool:
    """Whether the file of a model is that of the sweep."""
    try:
        return model_digest(resolve(ready.places[name], ready.sweep.menagerie)) == ready.files[name]
    except (StateMachineError, OSError):
        return False
