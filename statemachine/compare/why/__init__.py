"""Why two sides differ: one explanation for files, engines and settings.

- `explain`: the question, and its answer as a record
- `causes`: what differs, and the line of the file that says it
- `settings`: what an engine as it comes sets, and what can be left out
- `trials`: the runs, each made once; `gap`: what they are measured by, and what touches first
- `shapley`: shares of a gap among causes, and where the rest comes from
- `verdict`: what is answered, and whether that answers the question
"""

from __future__ import annotations

from .explain import Explanation, explain
from .shapley import ADDS_UP
from .verdict import UNEXPLAINED, GapVerdict

__all__ = [
    "ADDS_UP",
    "UNEXPLAINED",
    "Explanation",
    "GapVerdict",
    "explain",
]
