"""Two texts of models, written beside each other and compared."""

from __future__ import annotations

from pathlib import Path

import statemachine as sm
from statemachine.engines.records import ModelDifference
from statemachine.lab.compare.matching import match_models
from statemachine.lab.model_differences import ListedDifference, ModelsComparison, compare
from statemachine.lab.why.causes import differences_of

from .files import written


def written_sides(folder: Path, left: str, right: str, suffix: str = "xml") -> tuple[Path, Path]:
    """Write two texts as left and right; return their files."""
    return written(folder / f"left.{suffix}", left), written(folder / f"right.{suffix}", right)


def compared_texts(folder: Path, left: str, right: str, suffix: str = "xml") -> ModelsComparison:
    """Return what two texts of models differ in, as `compare --models` has it."""
    return compare(*written_sides(folder, left, right, suffix))


def differences_that_matter(folder: Path, left: str, right: str) -> list[ListedDifference]:
    """Return the differences of two texts of which a motion depends."""
    return [row for row in compared_texts(folder, left, right).differences if row.matters]


def causes_of_texts(folder: Path, left: str, right: str) -> tuple[ModelDifference, ...]:
    """Return what two texts of models differ in, as `compare --why` has it."""
    one, two = (sm.load(path) for path in written_sides(folder, left, right))
    return differences_of(one, two, match_models(one, two))
