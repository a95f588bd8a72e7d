"""One list of what two readings of a robot differ in, and how well the rest agrees.

Every figure has a key: the kind of its element, the element's name, and what of it, as compiled
models name them. By its key a figure that a reading tells of is the same as one in the list of two
compiled models, which `..why` explains a gap with.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...engines.records import ModelDifference
from ...measures.text import grouped

Value = float | str | tuple[float, ...] | None
Key = tuple[str, str, str]

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
}
_ORDER = tuple(SUBJECTS)


def plain(vector: Iterable[float]) -> tuple[float, ...]:
    """Return a vector as a value of a difference."""
    return tuple(float(entry) for entry in vector)


def digits_of(relative: float) -> int:
    """Return to how many decimal digits two numbers agree that are apart by this share."""
    if relative <= 0:
        return 17
    return max(0, min(17, math.floor(1 - math.log10(2 * relative))))


@dataclass(frozen=True)
class Figure:
    """A figure that two readings have, of an element of the robot.

    Attributes:
        subject: A key of `SUBJECTS`.
        where: The joint, link or frame.
        name: What of it.
        unit: SI unit; "" of a number without one, or of words.
        effect: What a difference does, as far as that was computed; "{share}" in it is its share.
        matters: Whether a difference makes the two readings differ; else it is said for the record.
        keys: What the compiled models call it.
    """

    subject: str
    where: str
    name: str
    unit: str = ""
    effect: str = ""
    matters: bool = True
    keys: Sequence[Key] = ()


@dataclass(frozen=True)
class ReadingDifference:
    """A figure that is not the same in two readings.

    Attributes:
        subject: A key of `SUBJECTS`.
        where: The joint, link or frame.
        figure: What of it.
        left, right: Its values in SI units; None where a file does not say.
        unit: Theirs.
        size: How far they are apart, in `unit`; None where that is not a number.
        share: How much it matters, from 0 to 1; of what, each comparing function says.
        effect: What it does, as far as that was computed.
        matters: Whether it makes the two readings differ; else it is said for the record.
        causes: The differences of the compiled models that it is a figure of, as `why.explain`
            names them; none where only a reading tells of it.
        refused: Why the right cannot be brought to the left in it; "" where it can, or where only a
            reading tells of it.
    """

    subject: str
    where: str
    figure: str
    left: Value
    right: Value
    unit: str
    size: float | None
    share: float
    effect: str
    matters: bool
    causes: tuple[str, ...]
    refused: str


@dataclass(frozen=True)
class ReadingAgreement:
    """Figures of a subject that are the same in two readings, within rounding.

    Attributes:
        subject: A key of `SUBJECTS`.
        count: How many they are.
        worst: The largest difference, in `unit`.
        unit: SI unit of the figures.
        where: The joint, link or frame of the largest difference.
        digits: To how many digits they agree; 17 is every bit of a float64.
    """

    subject: str
    count: int
    worst: float
    unit: str
    where: str
    digits: int


@dataclass(frozen=True)
class _Equal:
    """A figure that is the same within rounding.

    Attributes:
        relative: How far its values are apart, as a part of what they are set against.
        size: How far, in their unit.
        where: The joint, link or frame.
    """

    relative: float
    size: float
    where: str


@dataclass(frozen=True)
class _Distance:
    """How far two values are apart.

    Attributes:
        size: In their unit; infinite where that is not a number.
        scale: What it is set against to be rounding.
        share: How much it matters, from 0 to 1.
    """

    size: float
    scale: float = 0.0
    share: float = 1.0


class Ledger:
    """Takes pairs of figures and sorts them into what differs and what agrees.

    Attributes:
        tolerance: The relative difference up to which two figures are rounded.
        differences: What differs, in the order in which it was entered.
        entered: Keys of what was entered as a difference.
        compiled: What the compiled models differ in, by key.
        complete: Whether these are all that can differ.
    """

    def __init__(
        self, digits: int, compiled: Mapping[Key, Sequence[ModelDifference]], complete: bool
    ) -> None:
        """Begin an empty list.

        Args:
            digits: Figures that agree to so many are rounded, not different.
            compiled: What the compiled models differ in, by key.
            complete: Whether these are all that can differ. A figure with a key that is not among
                them then only sums up others, and is left out.
        """
        self.tolerance = 0.5 * 10.0 ** (1 - digits)
        self.differences: list[ReadingDifference] = []
        self.entered = set[Key]()
        self.compiled, self.complete = compiled, complete
        self._equal: dict[tuple[str, str], list[_Equal]] = {}

    def differ(
        self,
        figure: Figure,
        values: Sequence[Value],
        size: float | None = None,
        *,
        share: float = 1.0,
    ) -> None:
        """Enter a figure that is not the same.

        Args:
            figure: What it is.
            values: Of the left and of the right; None where a file does not say.
            size: How far they are apart, in the unit of the figure; None where that is not a
                number.
            share: How much it matters, from 0 to 1; of what, each comparing function says.
        """
        known = [row for key in figure.keys for row in self.compiled.get(key, ())]
        is_of_compiled = bool(figure.keys) and figure.keys[0][0] != "site"  # a link is a frame too
        if self.complete and is_of_compiled and not known:
            return
        self.entered.update(figure.keys)
        if size is not None and not math.isfinite(size):
            size = None
        share = _share(figure, share)
        left, right = (_without_infinity(value) for value in values)
        effect = figure.effect.format(share=share)
        causes = tuple(dict.fromkeys(row.title for row in known))
        refused = next((row.refused for row in known if row.refused), "")
        difference = ReadingDifference(
            subject=figure.subject,
            where=figure.where,
            figure=figure.name,
            left=left,
            right=right,
            unit=figure.unit,
            size=size,
            share=share,
            effect=effect,
            matters=figure.matters,
            causes=causes,
            refused=refused,
        )
        self.differences.append(difference)

    def measure(
        self,
        figure: Figure,
        size: float,
        scale: float,
        values: Sequence[Value] = (None, None),
        *,
        slack: float = 1.0,
        share: float = 1.0,
    ) -> None:
        """Enter how far two things are apart, as a difference or as an agreement.

        Args:
            figure: What it is.
            size: How far, in the unit of the figure.
            scale: What it is set against.
            values: The two; None, if they say nothing to a reader.
            slack: How many roundings may have come together.
            share: How much a difference matters, from 0 to 1.
        """
        relative = _relative(size, scale)
        if relative > self.tolerance * slack:
            self.differ(figure, values, size, share=share)
        else:
            equal = self._equal.setdefault((figure.subject, figure.unit), [])
            equal.append(_Equal(relative, size, figure.where))

    def enter(
        self,
        figure: Figure,
        values: Sequence[Value],
        *,
        scale: float = 0.0,
        slack: float = 1.0,
        against: float = 0.0,
        share: float | None = None,
    ) -> None:
        """Enter a figure of both, None where one does not say.

        Args:
            figure: What it is.
            values: Of both, each a number, several, or words.
            scale: What a difference is set against to be rounding, if it is more than they are.
            slack: How many roundings may have come together.
            against: What its share is of; 0: of the larger one.
            share: How much a difference matters, if that is something else.
        """
        known = [value for value in values if value is not None]
        if len(known) < 2 and not any(known):
            return  # what is not said is no zero, but nothing lacks where the other has none
        if len(known) < 2:
            apart = _of_one(known[0], against)
        elif _are_numbers(known[0], known[1]):
            apart = _of_numbers(known[0], known[1], against, scale)
        else:
            figure = replace(figure, unit="")
            apart = _Distance(0.0 if known[0] == known[1] else math.inf)
        share = apart.share if share is None else share
        self.measure(figure, apart.size, apart.scale, values, slack=slack, share=share)

    def agreements(self) -> Iterator[ReadingAgreement]:
        """Yield figures that are the same, within rounding, by subject and unit."""
        entries = sorted(self._equal.items(), key=lambda item: _ORDER.index(item[0][0]))
        for (subject, unit), equal in entries:
            relative = max(figure.relative for figure in equal)
            worst = max(equal, key=lambda figure: figure.size)
            yield ReadingAgreement(
                subject=subject,
                count=len(equal),
                worst=worst.size,
                unit=unit,
                where=worst.where,
                digits=digits_of(relative),
            )

    def ordered(self) -> tuple[ReadingDifference, ...]:
        """Return the differences, by subject; the subject with the weightiest one first."""
        by_subject = grouped((row.subject, row.share + row.matters) for row in self.differences)
        weight = {subject: max(weights) for subject, weights in by_subject.items()}

        def place(row: ReadingDifference) -> tuple[float, int, bool, float]:
            heaviest = -round(weight[row.subject], 3)
            return heaviest, _ORDER.index(row.subject), not row.matters, -round(row.share, 6)

        return tuple(sorted(self.differences, key=place))


def _share(figure: Figure, share: float) -> float:
    """Return how much a difference matters, from 0 to 1; 1 where that is not a number."""
    if not figure.matters:
        return 0.0
    if math.isnan(share):
        return 1.0
    return float(min(max(share, 0.0), 1.0))


def _without_infinity(value: Value) -> Value:
    return "unlimited" if value in (math.inf, -math.inf) else value


def _relative(size: float, scale: float) -> float:
    """Return a size as a part of what it is set against."""
    if not size:
        return 0.0
    if scale and math.isfinite(size):
        return size / scale
    return math.inf


def _are_numbers(left: Value, right: Value) -> bool:
    """Tell whether two values are as many numbers."""
    a, b = np.atleast_1d(np.asarray(left)), np.atleast_1d(np.asarray(right))
    return a.dtype.kind != "U" and a.shape == b.shape


def _of_one(value: Value, against: float) -> _Distance:
    """Return the distance where one side does not say.

    Args:
        value: That of the other.
        against: What the share is of; 0: of the value.
    """
    if not isinstance(value, float | int):
        return _Distance(math.inf)
    size = abs(value)
    return _Distance(size, share=size / against if size and against else 1.0)


def _of_numbers(left: Value, right: Value, against: float, scale: float) -> _Distance:
    """Return the distance of two numbers, or of as many.

    Args:
        left: Of the left.
        right: Of the right.
        against: What the share is of; 0: of the larger one.
        scale: What a difference is set against to be rounding, if it is more than they are.
    """
    a, b = (np.atleast_1d(np.asarray(value)) for value in (left, right))
    with np.errstate(invalid="ignore"):
        apart = np.where(a == b, 0.0, a - b)
    size = float(np.linalg.norm(apart))
    most = max(float(np.linalg.norm(a)), float(np.linalg.norm(b)))
    usual = most
    if apart.size == 2:  # a range
        size = float(np.abs(apart).max())
        usual = max(float(np.ptp(a)), float(np.ptp(b)))
    share = size / (against or usual) if 0 < most < math.inf else 1.0
    return _Distance(size, max(most, scale), share)
