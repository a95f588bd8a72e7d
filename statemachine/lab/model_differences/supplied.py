"""What a backend supplies in a run where its engine itself has something else, or nothing.

An engine is asked what it makes of a file. In a run a backend that emulates the contract computes
with figures of its own, so that such a difference does not act there.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace

from ...backends import load
from ...engines import raw_engine_of
from ...engines.description.reading import ModelReading
from ...errors import EngineWarning, StateMachineError
from ...interface import Model
from ...release_names import engine_of
from ..compare.matching import match_models
from ..why.causes import differences_of
from .reading import FileAsked
from .records import ListedDifference, ModelsComparison

# The promise of the contract that a subject of the list is a matter of, as `BEHAVIOURS` has it.
_PROMISES = {
    "armature": "armature",
    "drive": "position servo",
    "damping": "joint damping",
    "dry friction": "dry friction",
    "limits": "joint limits",
    "contact": "contacts",
}
_SUPPLIED = "in a run the backend supplies it"


def with_supplied(
    rows: Sequence[ListedDifference],
    asked: Sequence[FileAsked],
    readings: Sequence[ModelReading],
    names: Mapping[str, str],
) -> list[ListedDifference]:
    """Return differences; those that a backend supplies in a run are marked, and do not act.

    Args:
        rows: What the files, or what engines made of them, differ in.
        asked: What each side is.
        readings: Both sides.
        names: Which name on the left is which on the right.
    """
    runs = [_model_of_run(side) for side in asked]
    emulating = [model for model in runs if model is not None]
    if not emulating:
        return list(rows)
    left, right = (
        reading.model if model is None else model
        for model, reading in zip(runs, readings, strict=True)
    )
    in_a_run = {row.title for row in differences_of(left, right, match_models(left, right, names))}
    marked: list[ListedDifference] = []
    for row in rows:
        is_supplied = row.matters and bool(row.cause) and row.cause not in in_a_run
        if is_supplied and all(_supplies(model, row) for model in emulating):
            marked.append(replace(row, matters=False, supplied=True, effect=_SUPPLIED))
        else:
            marked.append(row)
    return marked


def _model_of_run(side: FileAsked) -> Model | None:
    """Return a side as a backend runs it that emulates the contract; None of another side."""
    if side.engine is None or side.as_it_comes:
        return None
    if not raw_engine_of(engine_of(side.engine)).emulated:
        return None
    try:
        with warnings.catch_warnings(action="ignore", category=EngineWarning):
            model = load(side.path, backend=side.engine)
    except StateMachineError:  # it has no such run
        return None
    return None if model.compiled is None else model


def _supplies(model: Model, row: ListedDifference) -> bool:
    """Tell whether a backend supplies a quantity, by its record of what it can do.

    What the engine does natively it does with its own figures, but for those that are options.
    """
    capabilities = model.capabilities
    if row.quantity in capabilities.options:
        return True
    promise = _PROMISES.get(row.subject)
    return promise is None or capabilities.behaviours[promise].support == "emulated"


def not_supplied(result: ModelsComparison) -> list[ListedDifference]:
    """Return the differences that no backend supplies in a run."""
    return [row for row in result.differences if not row.supplied]
