"""All cases of the battery, by name; a file of a group lists its own."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import check_name
from . import contact, joints, limits, loops, motion, pendulums, rotation, tops
from .case import Case

# A file of cases is added here.
_FILES = (
    motion.CASES,
    pendulums.CASES,
    rotation.CASES,
    tops.CASES,
    joints.CASES,
    limits.CASES,
    loops.CASES,
    contact.CASES,
)
CASES: dict[str, Case] = {case.name: case for cases in _FILES for case in cases}


def case_names() -> list[str]:
    """Return what --case takes: the names of the cases and of their groups."""
    groups = dict.fromkeys(case.group for case in CASES.values())
    return [*CASES, *groups]


def cases_of(words: Sequence[str]) -> list[Case]:
    """Return the cases that words name, in the order of the battery.

    Args:
        words: Names of cases or of groups; empty for all.

    Raises:
        UnknownNameError: There is no such case or group.
    """
    for word in words:
        check_name("case", word, case_names())
    if not words:
        return list(CASES.values())
    return [case for case in CASES.values() if case.name in words or case.group in words]
