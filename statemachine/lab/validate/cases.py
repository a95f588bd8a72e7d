"""All cases of the battery, by name; a file of a group lists its own."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from fnmatch import fnmatchcase

from ...errors import UnknownNameError, shown
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


GROUPS = tuple(dict.fromkeys(case.group for case in CASES.values()))


def cases_of(words: Sequence[str]) -> list[Case]:
    """Return the cases that words name, in the order of the battery.

    Args:
        words: Names of cases or of groups, or patterns such as sphere-*; empty for all.

    Raises:
        UnknownNameError: A word names no case.
    """
    if not words:
        return list(CASES.values())
    names: set[str] = set()
    for word in words:
        of_word = [case.name for case in CASES.values() if _is_named(case, word)]
        if not of_word:
            raise _unknown_case(word)
        names.update(of_word)
    return [case for case in CASES.values() if case.name in names]


def _is_named(case: Case, word: str) -> bool:
    """Tell whether a word names a case, its group, or is a pattern of its name."""
    return word in (case.name, case.group) or fnmatchcase(case.name, word)


def _unknown_case(word: str) -> UnknownNameError:
    """Return the error for a word that names no case: the nearest names, and the groups."""
    nearest = get_close_matches(word, (*CASES, *GROUPS), 3, 0.5)
    hint = f". Did you mean {', '.join(map(repr, nearest))}?" if nearest else ""
    message = f"no case named {shown(word)}; groups: {', '.join(GROUPS)}{hint}"
    return UnknownNameError(message, kind="case", name=word, known=(*CASES, *GROUPS))
