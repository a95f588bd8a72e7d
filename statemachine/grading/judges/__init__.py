"""The judges, one file for each function of the exercise.

A judge is a module with

- `worlds(scenes)`: the worlds to call the function on, the course's own first;
- `right(worlds)`: what is right on each, worked out by us;
- `judge(answer, world, right)`: what is wrong with what it did there, a line each, or, in one text,
  what is right. It raises FaultError where there is nothing to look at.
"""

from __future__ import annotations

import importlib
from typing import Any

# By the functions of the student's file, in the order in which they stand there.
JUDGES = {
    "demo_gravity": ".gravity",
    "demo_state": ".state",
    "demo_forward": ".forward",
    "demo_replay": ".replay",
}


def judge_of(function: str) -> Any:
    """The judge of a function of `JUDGES`."""
    return importlib.import_module(JUDGES[function], __name__)
