"""Of which moment are the derived arrays of a Data, and how wrong are they by now?

    print(sm.freshness(model, data))  # a table: each array, of which moment, how far off

A write marks nothing dirty, and a step leaves values of the state before it. Nothing is
recorded on the way, so that who does not ask pays nothing: `freshness` finds out afterwards,
by computing what the derived values would be now in another Data.

`watch_freshness` counts writes and steps, and finds stale reads as they happen. It changes the
class of the Data to a subclass for a while, so that every name for it is watched, and nothing is
left in the way of who does not watch.
"""

from __future__ import annotations

import sys
from contextlib import closing, nullcontext
from types import ModuleType
from typing import cast

from ..interface import Contacts, Data, Model, get_state
from ..measures.quantities import derived_arrays
from .age import Scratch, age_of
from .rows import Freshness, Row, notes_on, row
from .watch import StaleRead, Watch

__all__ = ["Freshness", "Row", "StaleRead", "Watch", "freshness", "watch_freshness"]


def freshness(model: Model, data: Data) -> Freshness:
    """Return, of each derived array of `data`, which moment it belongs to and how wrong it is by
    now.

    It needs no preparation and changes nothing: what the arrays would be now is computed in
    another Data. An array is of now if `forward` would leave every number of it as it is.
    Otherwise it is one step old if its poses are those of qpos − h·qvel; how many writes ago
    only `watch_freshness` can tell.

    Args:
        model: The Model that made `data`.
        data: Read, and not touched.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BadInputError: An input is not finite.
        DivergedError: The Data diverged earlier.
        ClosedDataError: `data` is closed.
    """
    state = get_state(model, data)
    watch = getattr(type(data), "_watch", None)
    with nullcontext() if watch is None else watch.uncounted():
        held = derived_arrays(data)
    if watch is not None:
        now, age = watch.scratch.now(state), watch.age()
    else:
        with closing(Scratch(model)) as scratch:
            now, age = scratch.now(state), age_of(model, state, held, scratch)
    touching = any(len(cast("Contacts", values["contacts"])) for values in (held, now))
    rows = tuple(row(model, name, age, held[name], now[name]) for name in held)
    return Freshness(
        backend=model.backend,
        engine_version=model.engine_version,
        model=model.path.stem,
        time=state.time,
        rows=rows,
        written=age.written,
        notes=tuple(notes_on(model, rows, age, touching)),
    )


def watch_freshness(model: Model, data: Data, raise_on_stale: bool = False) -> Watch:
    """Watch a Data: count writes and steps, and note or refuse stale reads.

    For example::

        with sm.watch_freshness(model, data) as watch:
            controller(model, data)
        print(watch)  # which line read what, how often, of which moment, how far off

    Every name for the Data is watched, in whatever object. Not seen are reads through
    `data.raw` and through an array that was kept from an earlier read; steps of `data.raw`
    count as writes. Two writes through an array that was kept may count as one.

    Args:
        model: The Model that made `data`.
        data: To be watched from `with` until its end.
        raise_on_stale: Whether a read of what is not of now raises StaleReadError. An array
            that would come out of `forward` as it is, is of now, whatever was written.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BadInputError: It is watched already, or an input is not finite.
        DivergedError: The Data diverged earlier.
        ClosedDataError: `data` is closed.
    """
    return Watch(model, data, raise_on_stale)


class _Callable(ModuleType):
    """This module, which may be called as the function of its name.

    Whoever imports from it has `sm.freshness` be the module: that is how Python imports one.
    """

    def __call__(self, model: Model, data: Data) -> Freshness:
        return freshness(model, data)


sys.modules[__name__].__class__ = _Callable
