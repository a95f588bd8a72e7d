"""What two models differ in and `Model.replace` equalizes: the right is given the left's."""

from __future__ import annotations

from collections.abc import Iterator, Set
from typing import Any

import numpy as np

from ...engines.records import DifferingQuantity, ModelDifference
from ...interface import Model

# What the right is given of the left by `Model.replace`, by the name of its cause: each option and
# the attribute of a Model that has its value. This is the timestep, which a compiled model has no
# substeps of, and all that is known where there is no compiled model.
_OPTIONS = {
    "timestep": {"timestep": "timestep", "substeps": "substeps"},
    "gravity": {"gravity": "gravity"},
    "armature": {"armature": "dof_armature"},
    "damping": {"damping": "dof_damping"},
    "dry friction": {"frictionloss": "dof_frictionloss"},
}
# The timestep where a function is called by the step, so that its period differs, too.
TIMESTEP_AND_PERIOD = "timestep, and the period of the function with it"
# SI unit of each option that has one.
_OPTION_UNITS = {"timestep": "s", "gravity": "m/s²"}


def differences_by_option(
    left: Model, right: Model, periods_differ: bool = False
) -> Iterator[ModelDifference]:
    """Yield what differs and is equalized by `Model.replace`.

    Args:
        left: The Model that the other is brought to.
        right: The other.
        periods_differ: Whether a function is called more often on one side: with the timestep its
            period is made the same, too.
    """
    both_compiled = left.compiled is not None and right.compiled is not None
    for name, options in _OPTIONS.items():
        if both_compiled and name != "timestep":
            continue
        values: list[DifferingQuantity] = []
        for option, attribute in options.items():
            left_value, right_value = getattr(left, attribute), getattr(right, attribute)
            if not np.array_equal(left_value, right_value):
                values.append(_quantity_of_option(option, left_value, right_value))
        if values and options.keys() <= set(right.capabilities.options):
            subject = TIMESTEP_AND_PERIOD if name == "timestep" and periods_differ else name
            yield ModelDifference(subject, "option", "", tuple(values))


def options_that_equalize(names: Set[str], left: Model) -> dict[str, Any]:
    """Return the options of `Model.replace` that equalize some causes, by their names."""
    options: dict[str, Any] = {}
    for name in sorted(names):
        known = "timestep" if name == TIMESTEP_AND_PERIOD else name
        for option, attribute in _OPTIONS[known].items():
            options[option] = getattr(left, attribute)
    return options


def _quantity_of_option(option: str, left: Any, right: Any) -> DifferingQuantity:
    """Return an option of `Model.replace` as a quantity: a number, or an array of some."""
    if np.ndim(left):
        left, right = tuple(np.asarray(left).tolist()), tuple(np.asarray(right).tolist())
    return DifferingQuantity(option, left, right, _OPTION_UNITS.get(option, ""))
