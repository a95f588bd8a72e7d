"""What a gap is measured in only where it is asked for: one axis of a base, or an outcome."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from ...interface import Array
from ..compare.outcomes import OF_POLICY, OUTCOMES, WORK, is_of_policy, outcomes_of_run
from ..recordings import Trace

# One run, as the quantities that runs are compared by: for each moment k numbers (n, k), in the
# unit of the quantity.
Curves = dict[str, Array]
AXES = ("base x", "base y", "base z")  # the place of a floating base in world axes
# What runs tell without forces, which those of a search for causes do not record.
ASKED_OUTCOMES = tuple(name for name in OUTCOMES if name != WORK)
ASKED = (*AXES, *ASKED_OUTCOMES)


def further_asked(run: Trace) -> tuple[str, ...]:
    """Return what the runs of a robot that floats may be asked for."""
    of_policy = is_of_policy(run)
    return tuple(name for name in ASKED if of_policy or name not in OF_POLICY)


def kinds_asked(
    words: str | None, runs: Sequence[Trace], until: float, *, floats: bool
) -> dict[str, str]:
    """Return the kind of a quantity by its name; {} where it is none of these, or a run has none.

    Args:
        words: Its name.
        runs: The runs of both sides.
        until: What of them counts [s from the start].
        floats: Whether the base of both floats.
    """
    if words is None:
        return {}
    if words in AXES and floats:
        return {words: "base"}
    if words in ASKED_OUTCOMES and all(words in outcomes_of_run(run, until) for run in runs):
        return {words: OUTCOMES[words]}
    return {}


def curves_asked(
    names: Collection[str], run: Trace, qpos: Array, base: int | None, until: float
) -> Curves:
    """Return those of some quantities; an outcome is one number of a run, at each moment.

    Args:
        names: Of the quantities, others among them.
        run: The run.
        qpos: (n, nq) its positions at the moments that count.
        base: Where in qpos the pose of its floating base begins; None of a fixed one.
        until: The last of these moments [s from the start].
    """
    curves: Curves = {}
    for axis, name in enumerate(AXES):
        if name in names and base is not None:
            curves[name] = qpos[:, [base + axis]]
    asked = [name for name in ASKED_OUTCOMES if name in names]
    outcomes = outcomes_of_run(run, until) if asked else {}
    for name in asked:
        value = outcomes.get(name)
        # A robot that did not fall had not when the comparison ended.
        curves[name] = np.full((len(qpos), 1), until if value is None else value)
    return curves
