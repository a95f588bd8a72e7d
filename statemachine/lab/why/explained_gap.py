"""The gap that is explained: in which quantity, and whether there is one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...errors import unknown_name
from ...interface import Model
from ...measures import RUN_FLOORS, Deviation
from ..compare.chaos import against_floor
from ..runs.robot import actuated_bodies
from .gap import Measure, size_of, touched_at_start
from .request import WhyRequest
from .trials import Trials
from .verdict import gap_state


@dataclass(frozen=True)
class ExplainedGap:
    """The gap that is explained.

    Attributes:
        quantity: What it is measured in.
        measure: Which figure of it.
        first: The gap in each quantity, as the sides come.
        size: The one that is explained, in the unit of the quantity, as are those below.
        floor: The chaos floor; 0 if it was not looked for.
        negligible: Gaps below this are taken for rounding.
        tolerance: A gap that does not matter.
    """

    quantity: str
    measure: Measure
    first: Mapping[str, Deviation]
    size: float
    floor: float
    negligible: float
    tolerance: float

    @property
    def is_divided(self) -> bool:
        """Tell whether there is a gap to divide among causes."""
        state = gap_state(self.size, self.negligible, self.tolerance, self.floor)
        return state == "beyond"


def named_quantity(trials: Trials, words: str | None) -> str | None:
    """Return the quantity that is asked for; None if none is.

    Raises:
        UnknownNameError: There is no such quantity.
    """
    if words is None:
        return None
    quantity = trials.ruler.quantity_of(words)
    if quantity not in trials.ruler.units:
        further = trials.ruler.further_quantities
        known = (*trials.ruler.units, *further, *trials.traces[0].header.joint_labels)
        choices = dict.fromkeys(name.replace(",", "") for name in known)
        raise unknown_name("quantity", quantity, choices)
    return quantity


def explained_gap(
    trials: Trials, request: WhyRequest, quantity: str | None, first: Mapping[str, Deviation]
) -> ExplainedGap:
    """Return the gap that is explained, with its chaos floor; no run is made for it.

    Args:
        trials: The runs, the perturbed ones among them, as far as they were made.
        request: The question.
        quantity: The one that is asked for; None if none is.
        first: The gap in each quantity, as the sides come.
    """
    measure = request.measure
    floors: Mapping[str, float] = {}
    if request.uncertain is not None:
        floors = trials.floor(measure)
    if quantity is None:
        quantity = _quantity(trials, first, floors, measure, request.left)
    return ExplainedGap(
        quantity=quantity,
        measure=measure,
        first=first,
        size=size_of(first[quantity], measure),
        floor=floors.get(quantity, 0.0),
        negligible=RUN_FLOORS[trials.ruler.units[quantity]],
        tolerance=trials.ruler.tolerance(quantity),
    )


def _quantity(
    trials: Trials,
    first: Mapping[str, Deviation],
    floors: Mapping[str, float],
    measure: Measure,
    model: Model,
) -> str:
    """Choose the quantity that a gap is explained in.

    It is the pose of the base of a robot that floats, or a body that is held, relative to the tip,
    where that is beyond its tolerance. Else it is the one that is farthest beyond, among those that
    are more than rounding and chaos make of a run: a coordinate, as `compare` names it, if one is.
    Where none is beyond, it is the first.
    """
    ruler = trials.ruler
    robot = frozenset(model.body_names[body] for body in actuated_bodies(model))
    preferred = ruler.default_quantity(touched_at_start(trials.traces[0], robot))
    sizes = {name: size_of(gap, measure) for name, gap in first.items()}
    above = {
        name: size / ruler.tolerance(name)
        for name, size in sizes.items()
        if size > RUN_FLOORS[ruler.units[name]]
    }
    beyond = above
    for chance in ("beyond", "cannot be told"):
        clear = {
            name: off
            for name, off in above.items()
            if against_floor(sizes[name], floors.get(name, 0.0)) == chance
        }
        if clear:
            beyond = clear
            break
    if preferred not in ruler.coordinates and beyond.get(preferred, 0.0) > 1:
        return preferred
    of_base = {name: beyond[name] for name in ruler.of_base if beyond.get(name, 0.0) > 1}
    if of_base:
        return max(of_base, key=of_base.__getitem__)
    coordinates = {name: beyond[name] for name in ruler.coordinates if beyond.get(name, 0.0) > 1}
    most = max(coordinates or beyond, key=beyond.__getitem__, default=preferred)
    if preferred in beyond and beyond[most] <= 1:
        return preferred
    return most
