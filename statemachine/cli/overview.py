"""`statemachine` alone: the four commands to begin with."""

from __future__ import annotations

import argparse

from ..course.lessons import PATH
from ..program import as_called

_OVERVIEW = """\
A physics simulator is a state machine that you advance.

The guided path: {count} lessons, about 35 minutes
    statemachine lesson
Functions for you to write, judged by what they do
    statemachine check exercises/step_loop.py
Where two engines differ, and by how much
    statemachine compare hold
What this machine has, and what to do
    statemachine doctor

All lessons: statemachine lesson --help
All commands: statemachine --help
"""


def overview(_options: argparse.Namespace) -> int:
    """Say what there is to begin with."""
    print(as_called(_OVERVIEW.format(count=len(PATH))), end="")
    return 0
