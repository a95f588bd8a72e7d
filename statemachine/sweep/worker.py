"""What a worker does: cells one after the other, each to a row, with the Models kept between."""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import threading
import time
import warnings
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any, TypeVar

from .. import __version__
from ..backends import load
from ..errors import BadInputError, StateMachineError
from ..interface import Model
from ..measures.text import listed
from ..models import resolve
from ..runs.controllers import function_file
from ..runs.provenance import model_digest
from ..runs.scenarios import Scenario
from ..silence import silence
from .cell import DONE, FAILED, CellRules, SweepCell, run_cell, timed_out
from .design import digest
from .settings import options_at

T = TypeVar("T")
Row = dict[str, Any]

_TO_LOAD = 60.0  # seconds that an engine and a model may take at least
_GRACE = 10.0  # seconds beyond a time-out, after which a process that still hangs ends itself
_WATCH = 1.0  # seconds between two looks at whether the driver is still there
_ONE_AT_A_TIME = threading.Lock()  # a Dask worker may have several threads, and an engine must not


def run_batch(rules: CellRules, cells: Sequence[SweepCell], own: bool) -> list[Row]:
    """Run cells; every one gives a row, whatever happens in it.

    Args:
        rules: Of the sweep.
        cells: To run, in this order.
        own: Whether this process is there for nothing else: it may then be kept silent, and ended.
    """
    if own:
        _settle()
    with _ONE_AT_A_TIME, warnings.catch_warnings(), silence():
        warnings.simplefilter("ignore")  # the driver has loaded the same models, and passed them on
        return [_row(rules, cell, own) for cell in cells]


def failed_row(cell: SweepCell, error: Exception) -> Row:
    """The row of a cell that gave none."""
    return {
        **_named(cell),
        "status": FAILED,
        "error_class": type(error).__name__,
        "error": " ".join(str(error).split()) or type(error).__name__,
    }


def _named(cell: SweepCell) -> Row:
    """What every row of a cell has."""
    return {
        "cell": cell.id,
        "point": cell.point,
        "seed": cell.seed,
        "backend": cell.backend,
        "values": cell.values,
        "library_version": __version__,
    }


def _row(rules: CellRules, cell: SweepCell, own: bool) -> Row:
    began = time.perf_counter()
    row: Row = {}
    try:
        if rules.function and digest_of(rules.what) != rules.function:
            name = function_file(rules.what).name
            raise BadInputError(f"{name} is not the file of the sweep: it changed")
        with _limited(max(rules.timeout, _TO_LOAD), own):
            model, options, doing = _model(rules, cell, rules.scenario_of(cell), row)
        with _limited(rules.timeout, own):
            run_cell(rules, cell, model, options, doing, row)
        told: Row = {**_named(cell), "status": DONE}
    except _OutOfTimeError:
        told = failed_row(cell, timed_out(rules.timeout))
    except Exception as error:  # of any kind: it belongs into the row
        told = failed_row(cell, error)
    return {**row, **told, "wall_seconds": time.perf_counter() - began}


def digest_of(function: str) -> str:
    """A digest of the user's file."""
    return digest(function_file(function).read_text(encoding="utf-8", errors="replace"))


def _model(
    rules: CellRules, cell: SweepCell, doing: Scenario, row: Row
) -> tuple[Model, dict[str, Any], Scenario]:
    """The Model of a cell, the options that it was made with, and what is done on it."""
    name = rules.model_of(cell)
    varied = [(v, value) for v, value in rules.settings(cell, "option") if value is not None]
    # A switch may be what lets an engine take the file at all: `load` is told.
    first = {**doing.options, **{v.name: value for v, value in varied if isinstance(value, bool)}}
    rest = [(v, value) for v, value in varied if not isinstance(value, bool)]
    key = (name, rules.menagerie, rules.files[name], cell.backend, rules.defaults, repr(first))
    base = _loaded.get(key, lambda: _load(rules, name, cell.backend, first))
    row["engine_version"] = base.engine_version
    if not doing.own:  # the user's own is the same on every robot
        doing = _on_robot.get((*key, rules.what), lambda: doing.on(base))
    options = options_at(base, rest)
    if not options:
        return base, first, doing
    typed = repr([(v.label, v.times, value) for v, value in rest])
    model = _replaced.get((*key, typed), lambda: base.replace(**options))
    return model, {**first, **options}, doing


def _load(rules: CellRules, name: str, backend: str, options: dict[str, Any]) -> Model:
    place = rules.places[name]
    if model_digest(resolve(place, rules.menagerie)) != rules.files[name]:
        raise BadInputError(f"{name} is not the file of the sweep: it changed, or is another here")
    return load(
        place, backend=backend, defaults=rules.defaults, menagerie=rules.menagerie, **options
    )


class _Kept:
    """The results of calls by key, the latest of them; an error is a result too."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._of: OrderedDict[Any, Any] = OrderedDict()

    def get(self, key: Any, make: Callable[[], T]) -> T:
        """What was made for a key, or is made now."""
        if key not in self._of:
            try:
                self._of[key] = make()
            except Exception as error:
                self._of[key] = error.with_traceback(None)
            while len(self._of) > self._most:
                self._of.popitem(last=False)
        self._of.move_to_end(key)
        found = self._of[key]
        if isinstance(found, Exception):
            raise found.with_traceback(None)
        return found


_loaded, _on_robot, _replaced = _Kept(8), _Kept(8), _Kept(4)


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


_settled = False


def _settle() -> None:
    """Once in a process of our own: nothing it prints is shown, and it ends with its driver."""
    global _settled  # noqa: PLW0603
    if _settled:
        return
    _settled = True
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where it was not kept from it already
    driver = os.getppid()

    def watch() -> None:
        while os.getppid() == driver:
            time.sleep(_WATCH)
        os._exit(1)

    if os.name != "nt":
        threading.Thread(target=watch, daemon=True).start()


def differing(rules: CellRules, version: str) -> str:
    """What this machine has otherwise than the driver of a sweep; "" if nothing.

    Args:
        rules: Of the sweep.
        version: Of the driver's library.
    """
    wrong = [] if version == __version__ else ["statemachine"]
    wrong += [name for name in rules.files if not _is_here(rules, name)]
    if rules.function and not (
        function_file(rules.what).is_file() and digest_of(rules.what) == rules.function
    ):
        wrong.append(rules.what)
    return listed(wrong)


def _is_here(rules: CellRules, name: str) -> bool:
    """Whether the file of a model is that of the sweep."""
    try:
        return model_digest(resolve(rules.places[name], rules.menagerie)) == rules.files[name]
    except (StateMachineError, OSError):
        return False
