"""Of which moment are the derived arrays of a Data, and how wrong are they by now?

    print(sm.freshness(model, data))  # a table: each array, of which moment, how far off

    with sm.watch_freshness(model, data, raise_on_stale=True):
        controller(model, data)  # the first stale read is an error that says what to do

A write marks nothing dirty, and a step leaves values of the state before it. Nothing is
recorded on the way, so that who does not ask pays nothing: `freshness` finds out afterwards,
by computing what the derived values would be now in another Data. `watch_freshness` counts.
"""

from __future__ import annotations

from .gaps import Gap
from .look import freshness
from .result import Freshness, Row, StaleRead
from .watch import Watch, watch_freshness

__all__ = ["Freshness", "Gap", "Row", "StaleRead", "Watch", "freshness", "watch_freshness"]
