"""Ways to make a parameter of a case wrong, while its truth stays."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace

from statemachine.lab.validate.case import Case
from statemachine.lab.validate.run import Run

Change = Callable[[Case], Case]  # returns the same Case where it has no such parameter
Edit = Callable[[list[float]], list[float]]  # of the numbers of an attribute


def scaled(factor: float, first: int = 0, count: int | None = None) -> Edit:
    """Return the edit that multiplies some numbers of an attribute.

    Args:
        factor: By what.
        first: Index of the first of them.
        count: How many; None for all that follow.
    """

    def edit(numbers: list[float]) -> list[float]:
        end = len(numbers) if count is None else first + count
        return [number * factor if first <= k < end else number for k, number in enumerate(numbers)]

    return edit


def reordered(*order: int) -> Edit:
    """Return the edit that puts the numbers of an attribute into another order."""

    def edit(numbers: list[float]) -> list[float]:
        return [numbers[k] for k in order]

    return edit


def moved(distance: float) -> Edit:
    """Return the edit that moves a place along x by a distance [m]."""

    def edit(numbers: list[float]) -> list[float]:
        return [numbers[0] + distance, *numbers[1:]]

    return edit


def leaning(angle: float) -> Edit:
    """Return the edit that turns a vector about y by a small angle [rad]."""

    def edit(numbers: list[float]) -> list[float]:
        x, y, z = numbers
        return [
            x * math.cos(angle) - z * math.sin(angle),
            y,
            x * math.sin(angle) + z * math.cos(angle),
        ]

    return edit


def attribute(tags: str, name: str, edit: Edit, only_first: bool = False) -> Change:
    """Return the change of an attribute of all elements of some tags.

    Args:
        tags: Separated by spaces.
        name: Of the attribute.
        edit: Of its numbers.
        only_first: Whether only the first element that has it is changed.
    """

    def change(case: Case) -> Case:
        root = ET.fromstring(f"<root>{case.mjcf}</root>")
        changed = False
        for element in root.iter():
            if element.tag not in tags.split() or name not in element.attrib:
                continue
            numbers = [float(word) for word in element.attrib[name].split()]
            element.attrib[name] = " ".join(repr(number) for number in edit(numbers))
            changed = True
            if only_first:
                break
        if not changed:
            return case
        return _with_mjcf(case, root)

    return change


def _with_mjcf(case: Case, root: ET.Element) -> Case:
    """Return the case with what stands in an element as its MJCF."""
    return replace(case, mjcf="".join(ET.tostring(part, encoding="unicode") for part in root))


def without(tags: str, names: str) -> Change:
    """Return the change that leaves attributes out of all elements of some tags.

    Args:
        tags: Separated by spaces.
        names: Of the attributes, separated by spaces.
    """

    def change(case: Case) -> Case:
        root = ET.fromstring(f"<root>{case.mjcf}</root>")
        changed = False
        for element in root.iter():
            for name in names.split() if element.tag in tags.split() else ():
                changed = element.attrib.pop(name, None) is not None or changed
        if not changed:
            return case
        return _with_mjcf(case, root)

    return change


def written(tags: str, name: str, value: str) -> Change:
    """Return the change that writes an attribute into all elements of some tags."""

    def change(case: Case) -> Case:
        root = ET.fromstring(f"<root>{case.mjcf}</root>")
        elements = [element for element in root.iter() if element.tag in tags.split()]
        for element in elements:
            element.attrib[name] = value
        return _with_mjcf(case, root) if elements else case

    return change


def gravity(edit: Edit) -> Change:
    """Return the change of gravity."""

    def change(case: Case) -> Case:
        x, y, z = edit(list(case.gravity))
        return replace(case, gravity=(x, y, z)) if (x, y, z) != case.gravity else case

    return change


def option(old: str, new: str) -> Change:
    """Return the change of a piece of <option>."""

    def change(case: Case) -> Case:
        if old not in case.option:
            return case
        return replace(case, option=case.option.replace(old, new))

    return change


class MistimedRun(Run):
    """A run whose steps are longer than it believes.

    Attributes:
        factor: Length of a step over what it believes.
    """

    def __init__(self, run: Run, factor: float) -> None:
        super().__init__(run.model, run.data)
        self.factor = factor

    @property
    def timestep(self) -> float:
        """Length of a step, as it believes [s]."""
        return self.model.timestep / self.factor


def timestep(factor: float) -> Change:
    """Return the change that makes each step longer by a factor than the case believes."""

    def change(case: Case) -> Case:
        def measure(run: Run) -> float:
            return case.measure(MistimedRun(run, factor))

        longer = tuple(length * factor for length in case.timesteps)
        discrete = {}
        for integrator, truth in case.discrete.items():
            discrete[integrator] = _of_shorter(truth, factor)
        return replace(case, measure=measure, timesteps=longer, discrete=discrete)

    return change


def _of_shorter(truth: Callable[[float], float], factor: float) -> Callable[[float], float]:
    """Return a discrete truth of the timestep that the case believes."""
    return lambda length: truth(length / factor)
