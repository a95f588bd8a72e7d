"""Differences in the settings of the simulation."""

from __future__ import annotations

import numpy as np

from ...description.records import Setting
from ...description.tree import GroupTree
from .ledger import Ledger


def compare(book: Ledger, one: GroupTree, two: GroupTree, notes: list[str]) -> None:
    """Settings of the simulation; where a format has none, what the other would change."""
    ours, theirs = one.robot.settings, two.robot.settings
    if ours is None and theirs is None:
        return
    if ours is None or theirs is None:
        said, usual = (
            (two.robot, two.robot.defaults) if ours is None else (one.robot, one.robot.defaults)
        )
        for name, value in (said.settings or {}).items():
            if value != usual.get(name):
                pair = (None, value) if ours is None else (value, None)
                share = _share(name, value, usual.get(name))
                effect = f"{said.reader.split()[0]} would take {_said(usual.get(name))}"
                book.differ("settings", "", name, *pair, _unit(name), None, share, effect)
        which = one.robot if ours is None else two.robot
        notes.append(
            f"a {which.format} says nothing of timestep, gravity and solver: the engine that loads "
            "it decides (--backends shows what it takes)"
        )
        return
    for name in (each for each in ours if each in theirs):  # not a set: its order is chance
        a, b = ours[name], theirs[name]
        if isinstance(a, str) or isinstance(b, str) or a is None or b is None:
            if a != b:
                book.differ("settings", "", name, a, b)
            else:
                book.agree("settings", name, 0.0, 0.0, "")
            continue
        size = book.same("settings", name, a, b, _unit(name))
        if size is not None:
            book.differ("settings", "", name, a, b, _unit(name), size, _share(name, a, b))
    for which, mine, other in (("left", ours, theirs), ("right", theirs, ours)):
        alone = sorted(mine.keys() - other.keys())
        if alone:
            notes.append(f"only the engine of the {which} has the settings {', '.join(alone)}")


def _unit(name: str) -> str:
    return {"timestep": "s", "gravity": "m/s²", "wind": "m/s"}.get(name, "")


def _said(value: Setting) -> str:
    if isinstance(value, tuple):
        return " ".join(f"{each:g}" for each in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def _share(name: str, one: Setting, two: Setting) -> float:
    """Of gravity and the timestep, how much of it; of the solver's settings at most a fifth."""
    share = _relative(one, two)
    return share if name in ("gravity", "timestep") else min(share, 0.2)


def _relative(one: Setting, two: Setting) -> float:
    if isinstance(one, str) or isinstance(two, str) or one is None or two is None:
        return 0.2
    a, b = np.atleast_1d(one), np.atleast_1d(two)
    most = max(float(np.linalg.norm(a)), float(np.linalg.norm(b)))
    return float(np.linalg.norm(a - b)) / most if most else 0.0
