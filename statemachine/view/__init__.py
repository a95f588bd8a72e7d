"""A running simulation to look at and to touch, in a browser.

`session` is the simulation: commands in, frames out, without a clock and without a screen;
`recording` is the same of traces. `pace` is the clock, `live` the loop over all of them, and
`viser_front` the page, the only module that knows viser.
"""

from __future__ import annotations

from .frames import Control, EnginePose, Separation, Snapshot
from .pace import Pacer
from .session import LiveSession

__all__ = ["Control", "EnginePose", "LiveSession", "Pacer", "Separation", "Snapshot"]
