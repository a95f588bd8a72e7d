"""Leaving ctrl alone is also a command; and who holds the arm up."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..experiments import gravity
from ._words import degrees, page_of, signed, where
from .page import Page, Table, Text, Verdict

_PARTS = (
    ("gravity (−bias)", "bias"),
    ("servo", "actuator"),
    ("damping", "passive"),
    ("dry friction", "friction"),
    ("contact", "contact"),
    ("joint limit", "limit"),
)
# Below this a joint counts as being at rest [rad/s²] and a sum as zero [N·m].
_REST = 1e-3


def run(model: Any, options: Mapping[str, Any], progress: Any) -> gravity.Gravity:
    """Servos on, servos off."""
    return gravity.run(model, seconds=options["seconds"], joint=options["joint"], progress=progress)


def page(results: Mapping[str, gravity.Gravity]) -> Page:
    """The table of the course, and the balance of forces at its end."""
    first = next(iter(results.values()))
    columns = {
        f"{where(results, name)}servos {state}": droop
        for name, result in results.items()
        for state, droop in (("on", result.servos_on), ("off", result.servos_off))
    }
    digits = {name: 3 if name.endswith("on") else 2 for name in columns}
    end = float(first.servos_on.time[-1])
    blocks: list[Any] = [
        Text(
            "Nobody writes ctrl in either run; it stays at zero. To a position servo, zero is "
            "a target like any other, and it holds it. The second run has the servos off."
        ),
        Table(
            ("time", *columns),
            [
                (
                    f"{time:.2f} s",
                    *(degrees(run.angle[k], digits[name]) for name, run in columns.items()),
                )
                for k, time in enumerate(first.servos_on.time)
            ],
            title=f"{first.joint} under gravity",
        ),
        Table(
            ("who", *columns),
            [
                *(
                    (label, *(signed(_part(run, part)) for run in columns.values()))
                    for label, part in _PARTS
                ),
                ("sum", *(signed(run.forces.total) for run in columns.values())),
            ],
            title=f"Who holds {first.joint}, at {end:g} s [N·m]",
            emphasis=frozenset({len(_PARTS)}),
        ),
    ]
    for name, run in columns.items():
        blocks.append(Verdict(f"{name}: {_who(run)}", _balanced(run)))
    return page_of("You never wrote ctrl", results, blocks)


def _part(run: gravity.Droop, part: str) -> float | None:
    value = getattr(run.forces, part)
    return -value if part == "bias" and value is not None else value


def _balanced(run: gravity.Droop) -> bool:
    total = run.forces.total
    return total is None or abs(total) < _REST or abs(run.acceleration) > _REST


def _who(run: gravity.Droop) -> str:
    """The largest force against gravity, in words, with its share."""
    load = _part(run, "bias")
    others = {
        label: value
        for label, part in _PARTS[1:]
        if (value := _part(run, part)) is not None and load is not None and value * load < 0
    }
    if not others or load is None or abs(load) < _REST:
        return "nothing needs to hold the joint"
    label = max(others, key=lambda name: abs(others[name]))
    share = 100 * abs(others[label] / load)
    text = f"the {label} carries {abs(others[label]):.4f} N·m, {share:.1f} % of the load"
    if label == "contact":
        text += f" ({', '.join(run.touching)}; first touch at {run.first_contact:.2f} s)"
    return text
