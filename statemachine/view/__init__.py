"""A running simulation to look at and to touch, in a browser.

`session` is what is shown: without a clock and without a screen; `live_session` a simulation,
`trace_session` recorded traces, `controls` the sliders of the first. `live` is the loop that lets
it follow the clock, `viser_front` the page, the only module that knows viser, and `server` says
who may look at it.
"""

from __future__ import annotations

from .live import Live
from .live_session import LiveSession
from .session import Session
from .trace_session import TraceSession

__all__ = [
    "Live",
    "LiveSession",
    "Session",
    "TraceSession",
]
