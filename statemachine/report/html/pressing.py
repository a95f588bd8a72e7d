"""Who presses on what in the end, and how hard: of each side's own rows, not of common moments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...compare import Comparison
from ...compare.agreement import SETTLED
from ...compare.series import world_forces
from ...comparison.text import figure, quantity, short_time
from ...traces import Trace


@dataclass(frozen=True)
class Pressing:
    """What one side's contacts do.

    Attributes:
        force: By "gripper on floor", the mean normal force over the end [N]; those that press.
        total: The same of the length of the whole force, friction and all.
        last: When anything last touches [s]; None if nothing ever does.
        lasts: Whether something touches at the last row.
        deepest: The deepest overlap [m]; deep_at: when [s]; deep: of what.
    """

    force: dict[str, float]
    last: float | None
    lasts: bool
    deepest: float
    deep_at: float
    deep: str
    total: dict[str, float]


def pressing(trace: Trace, until: float) -> Pressing | None:
    """What the contacts of a side do, up to a moment; None if they were not recorded."""
    if "contact_row" not in trace:
        return None
    elapsed = trace.time - trace.time[0]
    inside = elapsed[trace["contact_row"]] <= until + 1e-9
    rows = trace["contact_row"][inside]
    if not len(rows):
        return Pressing({}, None, False, 0.0, 0.0, "", {})
    pairs = np.empty(len(trace["contact_row"]), dtype=object)
    for pair, places in trace.contact_pairs.items():
        pairs[places] = pair
    pairs = pairs[inside]
    normal = trace["contact_force"][inside][:, 0]
    end = np.flatnonzero((elapsed >= (1 - SETTLED) * until - 1e-9) & (elapsed <= until + 1e-9))
    late = np.isin(rows, end) & np.isfinite(normal)
    force = {
        str(pair): float(normal[late & (pairs == pair)].sum()) / len(end)
        for pair in dict.fromkeys(pairs[late].tolist())
    }
    force = {pair: value for pair, value in force.items() if value > 0}
    pushes = world_forces(trace)[inside]
    total = {}
    for pair in force:
        sums, chosen = np.zeros((len(trace), 3)), late & (pairs == pair)
        np.add.at(sums, rows[chosen], pushes[chosen])
        total[pair] = float(np.linalg.norm(sums[end], axis=1).mean())
    distance = np.nan_to_num(trace["contact_dist"][inside])
    worst = int(np.argmin(distance))
    return Pressing(
        force=dict(sorted(force.items(), key=lambda each: -each[1])),
        last=float(elapsed[rows[-1]]),
        lasts=bool(rows[-1] == end[-1]),
        deepest=max(0.0, -float(distance[worst])),
        deep_at=float(elapsed[rows[worst]]),
        deep=str(pairs[worst]),
        total=total,
    )


def pressing_words(comparison: Comparison, traces: Sequence[Trace]) -> tuple[list[str], list[str]]:
    """Paragraphs: what never touches; then what presses in the end, and the deepest overlap."""
    found = [pressing(trace, comparison.until) for trace in traces]
    one, two = found
    if one is None or two is None or (one.last is None and two.last is None):
        return [], []
    labels = comparison.one.backend, comparison.two.backend
    if labels[0] == labels[1]:
        labels = f"{labels[0]} (first)", f"{labels[1]} (second)"
    never = []
    for side, other, label in ((one, two, labels[0]), (two, one, labels[1])):
        if side.last is None:
            what = other.deep.partition(" on ")
            never.append(f"On {label} {what[0]} never touches {what[2]} in this run.")
    over = f"Over the last {SETTLED * comparison.until:.3g} s"
    each = [_end(side, label) for side, label in zip((one, two), labels, strict=True)]
    said = [f"{over}, on average: {'; '.join(each)}."]
    deep = [
        f"{quantity(side.deepest, 'm')} on {label} ({side.deep}, at {short_time(side.deep_at)})"
        for side, label in zip((one, two), labels, strict=True)
        if side.deepest > 0
    ]
    if deep:
        said.append(f"The deepest that one shape is in another: {', '.join(deep)}.")
    return never, [" ".join(said)]


def _end(side: Pressing, label: str) -> str:
    if side.last is None:
        return f"on {label} nothing touches at all"
    if not side.lasts and not side.force:
        return f"on {label} nothing touches after {short_time(side.last)}"
    if not side.force:
        return f"on {label} what touches presses with no force"
    listed = [
        f"{'and ' if k else ''}{pair.replace(' on ', ' presses on ', 1)} with {figure(value)} N "
        f"(with friction {figure(side.total[pair])} N)"
        for k, (pair, value) in enumerate(list(side.force.items())[:3])
    ]
    return f"on {label} {' '.join(listed)}"
