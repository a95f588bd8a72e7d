"""One list of what two readings of a robot differ in, and how well the rest agrees.

Every figure has a key: the kind of its element, the element's name, and what of it, as compiled
models name them. By its key a figure that a reading tells of is the same as one in the list of two
compiled models, which `..why` explains a gap with.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from ...engines.records import ModelDifference
from ...measures.text import grouped
from ...page import Figures

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
    """A vector as a value of a difference."""
    return tuple(map(float, vector))


def digits_of(relative: float) -> int:
    """To how many decimal digits two numbers agree that are apart by this share."""
    if relative <= 0:
        return 17
    return max(0, min(17, math.floor(1 - math.log10(2 * relative))))


class Ledger:
    """Takes pairs of figures and sorts them into what differs and what agrees.

    Args:
        digits: Figures that agree to so many are rounded, not different.
        compiled: What the compiled models differ in, by key.
        complete: Whether these are all that can differ. A figure with a key that is not among them
            then only sums up others, and is left out.

    Attributes:
        tolerance: The relative difference up to which two figures are rounded.
        entered: Keys of what was entered as a difference.
    """

    def __init__(
        self, digits: int, compiled: Mapping[Key, Sequence[ModelDifference]], complete: bool
    ) -> None:
        self.tolerance = 0.5 * 10.0 ** (1 - digits)
        self.differences: list[Figures] = []
        self.entered = set[Key]()
        self.compiled, self.complete = compiled, complete
        self._equal: dict[tuple[str, str], list[tuple[float, float, str]]] = {}

    def differ(
        self,
        subject: str,
        where: str,
        figure: str,
        values: Sequence[Value],
        unit: str = "",
        size: float | None = None,
        *,
        share: float = 1.0,
        effect: str = "",
        matters: bool = True,
        keys: Sequence[Key] = (),
    ) -> None:
        """Enter a figure that is not the same.

        Args:
            subject: A key of `SUBJECTS`.
            where: The joint, link or frame.
            figure: What of it.
            values: `left` and `right` of the difference, SI units; None where a file does not say.
            unit: Theirs.
            size: How far they are apart, in `unit`; None where that is not a number.
            share: How much it matters, from 0 to 1; of what, each comparing function says.
            effect: What it does, as far as that was computed; "{share}" in it is its share.
            matters: Whether it makes the two readings differ; else it is said for the record.
            keys: Of these the difference has `causes`: the differences of the compiled models
                that it is a figure of, as `why.explain` names them, none where only a reading tells
                of it; and `refused`: why the right cannot be brought to the left in it, "" where
                it can, or where only a reading tells of it.
        """
        share = float(matters) * (1.0 if math.isnan(share) else min(max(share, 0.0), 1.0))
        left, right = ["unlimited" if v in (math.inf, -math.inf) else v for v in values]
        size = None if size is None or not math.isfinite(size) else size
        known = [difference for key in keys for difference in self.compiled.get(key, ())]
        if self.complete and keys and not known and keys[0][0] != "site":  # a link is a frame too
            return
        self.entered.update(keys)
        self.differences.append(
            Figures(
                subject=subject,
                where=where,
                figure=figure,
                left=left,
                right=right,
                unit=unit,
                size=size,
                share=share,
                effect=effect.format(share=share),
                matters=matters,
                causes=tuple(dict.fromkeys(difference.title for difference in known)),
                refused=next((row.refused for row in known if row.refused), ""),
            )
        )

    def measure(
        self,
        subject: str,
        where: str,
        figure: str,
        size: float,
        unit: str,
        scale: float,
        values: Sequence[Value] = (None, None),
        *,
        slack: float = 1.0,
        share: float = 1.0,
        effect: str = "",
        matters: bool = True,
        keys: Sequence[Key] = (),
    ) -> None:
        """Enter how far two things are apart, as a difference or as an agreement.

        Args:
            subject: A key of `SUBJECTS`.
            where: Whose it is.
            figure: What of it.
            size: How far.
            unit: Of size and values.
            scale: What it is set against.
            values: The two; None, if they say nothing to a reader.
            slack: How many roundings may have come together.
            share: How much a difference matters, from 0 to 1.
            effect: What it does.
            matters: Whether it makes the two readings differ.
            keys: What the compiled models call it.
        """
        relative = size / scale if scale and math.isfinite(size) else math.inf if size else 0.0
        if relative > self.tolerance * slack:
            self.differ(
                *(subject, where, figure, values, unit, size),
                share=share,
                effect=effect,
                matters=matters,
                keys=keys,
            )
        else:
            self._equal.setdefault((subject, unit), []).append((relative, size, where))

    def enter(
        self,
        subject: str,
        where: str,
        figure: str,
        values: Sequence[Value],
        unit: str = "",
        *,
        scale: float = 0.0,
        slack: float = 1.0,
        against: float = 0.0,
        share: float | None = None,
        effect: str = "",
        matters: bool = True,
        keys: Sequence[Key] = (),
    ) -> None:
        """Enter a figure of both, None where one does not say.

        Args:
            subject: A key of `SUBJECTS`.
            where: Whose it is.
            figure: What of it.
            values: Of both, each a number, several, or words.
            unit: Theirs.
            scale: What a difference is set against to be rounding, if it is more than they are.
            slack: How many roundings may have come together.
            against: What its share is of; 0: of the larger one.
            share: How much a difference matters, if that is something else.
            effect: What it does.
            matters: Whether it makes the two readings differ.
            keys: What the compiled models call it.
        """
        known = [value for value in values if value is not None]
        arrays = [np.atleast_1d(np.asarray(value)) for value in known]
        part = 1.0  # its share, unless that is given
        if len(known) < 2:
            if not any(known):
                return  # what is not said is no zero, but nothing lacks where the other has none
            size = abs(known[0]) if isinstance(known[0], float | int) else math.inf
            part = size / against if size and against else 1.0
            scale = 0.0
        elif arrays[0].dtype.kind == "U" or arrays[0].shape != arrays[1].shape:
            size, unit, scale = 0.0 if known[0] == known[1] else math.inf, "", 0.0
        else:
            with np.errstate(invalid="ignore"):
                apart = np.where(arrays[0] == arrays[1], 0.0, arrays[0] - arrays[1])
            size = float(np.abs(apart).max() if apart.size == 2 else np.linalg.norm(apart))
            most = max(float(np.linalg.norm(array)) for array in arrays)
            usual = max(float(np.ptp(array)) for array in arrays) if apart.size == 2 else most
            part = size / (against or usual) if 0 < most < math.inf else 1.0
            scale = max(most, scale)
        self.measure(
            *(subject, where, figure, size, unit, scale, values),
            slack=slack,
            share=part if share is None else share,
            effect=effect,
            matters=matters,
            keys=keys,
        )

    def agreements(self) -> Iterator[Figures]:
        """Figures that are the same, within rounding, by subject and unit.

        Returns:
            subject: A key of `SUBJECTS`.
            count: How many.
            worst: The largest difference, in `unit`; where: whose that is.
            digits: To how many digits they agree; 17 is every bit of a float64.
        """
        for (subject, unit), entries in sorted(
            self._equal.items(), key=lambda item: _ORDER.index(item[0][0])
        ):
            relative = max(entry[0] for entry in entries)
            _, size, where = max(entries, key=lambda entry: entry[1])
            yield Figures(
                subject=subject,
                count=len(entries),
                worst=size,
                unit=unit,
                where=where,
                digits=digits_of(relative),
            )

    def ordered(self) -> tuple[Figures, ...]:
        """The differences, by subject; the subject with the weightiest one first."""
        by_subject = grouped((row.subject, row.share + row.matters) for row in self.differences)
        weight = {subject: max(weights) for subject, weights in by_subject.items()}
        return tuple(
            sorted(
                self.differences,
                key=lambda row: (
                    -round(weight[row.subject], 3),
                    _ORDER.index(row.subject),
                    not row.matters,
                    -round(row.share, 6),
                ),
            )
        )
