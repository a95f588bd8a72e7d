"""A running simulation to look at and to touch, in a browser.

`session` is what is shown, a simulation or recorded traces: without a clock and without a screen.
`live` is the loop that lets it follow the clock, `viser_front` the page, the only module that
knows viser, and `server` says who may look at it.
"""

from __future__ import annotations

from .live import Live
from .session import LiveSession, Session, TraceSession

__all__ = [
    "Live",
    "LiveSession",
    "Session",
    "TraceSession",
]
