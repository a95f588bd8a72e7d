"""What was found: differences with their sizes, and how well the rest agrees."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

Value = float | str | tuple[float, ...] | None

# In the order in which a reader wants them where they matter alike.
SUBJECTS = {
    "structure": "What is in one of them only",
    "places": "Where the joints are, at zero",
    "tool frame": "Frames that are fixed to a link",
    "armature": "Armature: the rotor's inertia as the joint feels it",
    "drive": "What drives the joints",
    "effort": "Largest force of a joint",
    "damping": "Damping of the joints",
    "dry friction": "Dry friction of the joints",
    "spring": "Springs in the joints",
    "limits": "Limits of the joints",
    "speed": "Largest speed of a joint",
    "mass": "Masses",
    "centre of mass": "Centres of mass",
    "inertia": "Inertias about the centre of mass",
    "shapes": "What touches",
    "contact": "How it touches",
    "settings": "Settings of the simulation",
    "further": "What else can change a motion",
    "engine": "What the engines do of themselves, measured on small models of their own",
}


@dataclass(frozen=True)
class Difference:
    """One figure that is not the same.

    Attributes:
        subject: A key of `SUBJECTS`.
        where: The joint, link or frame.
        figure: What of it.
        one, two: The values, SI units; None where a file does not say.
        unit: Theirs.
        size: How far they are apart, in `unit`; None where that is no number.
        share: How much it matters, from 0 to 1; of what, each comparing function says.
        effect: What it does, as far as that was computed.
        matters: Whether it makes the two descriptions differ; else it is said for the record.
        causes: The differences of the compiled models that it is a figure of, as `why.explain`
            names them; none where only a description tells of it.
        refused: Why the right cannot be brought to the left in it; "" where it can, or where only
            a description tells of it.
    """

    subject: str
    where: str
    figure: str
    one: Value
    two: Value
    unit: str
    size: float | None
    share: float
    effect: str = ""
    matters: bool = True
    causes: tuple[str, ...] = ()
    refused: str = ""


@dataclass(frozen=True)
class AgreedFigures:
    """Figures that are the same, within rounding.

    Attributes:
        subject: A key of `SUBJECTS`.
        count: How many.
        worst: The largest difference, in `unit`; where: whose that is.
        digits: To how many digits they agree; 17 is every bit of a float64.
    """

    subject: str
    count: int
    worst: float
    unit: str
    where: str
    digits: int


def digits_of(relative: float) -> int:
    """To how many decimal digits two numbers agree that are apart by this share."""
    if relative <= 0:
        return 17
    return max(0, min(17, math.floor(1 - math.log10(2 * relative))))


class Ledger:
    """Takes pairs of figures and sorts them into what differs and what agrees.

    Args:
        digits: Figures that agree to so many are rounded, not different.
    """

    def __init__(self, digits: int) -> None:
        self.tolerance = 0.5 * 10.0 ** (1 - digits)
        self.differences: list[Difference] = []
        self._equal: dict[str, list[tuple[float, float, str, str]]] = {}

    def differ(
        self,
        subject: str,
        where: str,
        figure: str,
        one: Value,
        two: Value,
        unit: str = "",
        size: float | None = None,
        share: float = 1.0,
        effect: str = "",
        matters: bool = True,
    ) -> None:
        """Enter a difference."""
        share = 1.0 if math.isnan(share) else min(max(share, 0.0), 1.0)
        one, two = ("unlimited" if each in (math.inf, -math.inf) else each for each in (one, two))
        self.differences.append(
            Difference(subject, where, figure, one, two, unit, size, share, effect, matters)
        )

    def agree(self, subject: str, where: str, size: float, relative: float, unit: str) -> None:
        """Enter an agreement."""
        self._equal.setdefault(subject, []).append((relative, size, unit, where))

    def same(
        self,
        subject: str,
        where: str,
        one: float | Sequence[float],
        two: float | Sequence[float],
        unit: str,
        scale: float = 0.0,
        slack: float = 1.0,
    ) -> float | None:
        """Whether two figures agree: None if so, which is entered; else how far apart they are.

        Args:
            subject: A key of `SUBJECTS`.
            where: Whose they are.
            one: A number, or several.
            two: As many.
            unit: Theirs.
            scale: What a difference is set against, if it is more than they are.
            slack: How many roundings may have come together.
        """
        a, b = np.atleast_1d(np.asarray(one, float)), np.atleast_1d(np.asarray(two, float))
        with np.errstate(invalid="ignore"):
            apart = np.where(a == b, 0.0, a - b)
        size = float(np.linalg.norm(apart))
        most = max(float(np.linalg.norm(a)), float(np.linalg.norm(b)), scale)
        relative = 0.0 if not size else math.inf if math.isinf(size) or not most else size / most
        if relative > self.tolerance * slack:
            return size
        self.agree(subject, where, size, relative, unit)
        return None

    def agreements(self) -> tuple[AgreedFigures, ...]:
        """How well the rest agrees, by subject and unit."""
        found = []
        for subject in SUBJECTS:
            by_unit: dict[str, list[tuple[float, float, str, str]]] = {}
            for each in self._equal.get(subject, []):
                by_unit.setdefault(each[2], []).append(each)
            for unit, entries in by_unit.items():
                relative = max(each[0] for each in entries)
                worst = max(entries, key=lambda each: each[1])
                found.append(
                    AgreedFigures(
                        subject, len(entries), worst[1], unit, worst[3], digits_of(relative)
                    )
                )
        return tuple(found)


def ordered(differences: Sequence[Difference]) -> tuple[Difference, ...]:
    """The differences, by subject; the subject with the weightiest one first."""
    weight: dict[str, float] = {}
    for each in differences:
        matter = each.share + each.matters
        weight[each.subject] = max(weight.get(each.subject, -1.0), matter)
    places = {subject: k for k, subject in enumerate(SUBJECTS)}
    return tuple(
        sorted(
            differences,
            key=lambda d: (
                -round(weight[d.subject], 3),
                places[d.subject],
                not d.matters,
                -round(d.share, 6),
            ),
        )
    )
