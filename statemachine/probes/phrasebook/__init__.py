"""Which call does what on each engine: a table whose every cell is run before it is shown.

The cells of one engine, one after the other, are a program; `CELLS` of the engine's module
has them by concept. After each, a check looks at the engine for what the concept says.
"""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...installed import engine_version, require
from ...silence import silence

# In the order in which a program has them.
CONCEPTS = (
    "load",
    "state",
    "command",
    "step",
    "recompute",
    "read a site",
    "reset",
    "save",
    "many worlds",
)
# The numbers in the cells.
ANGLE, TORQUE = 0.4, 1.0  # rad, N·m


@dataclass(frozen=True)
class Cell:
    """What is typed for a concept, and whether it happened.

    Attributes:
        code: Lines of Python, after those of the concepts before.
        happened: Looks at the names that the lines left behind; may change the world.
    """

    code: str
    happened: Callable[[Any], bool]


@dataclass(frozen=True)
class Call:
    """A cell that was run.

    Attributes:
        concept: One of `CONCEPTS`.
        code: What was typed.
        works: Whether it ran, and the concept happened.
        said: What was wrong.
    """

    concept: str
    code: str
    works: bool
    said: str


@dataclass(frozen=True)
class Calls:
    """The calls of each engine, and the versions that took them."""

    versions: dict[str, str]
    engines: dict[str, tuple[Call, ...]]


def run(
    engines: Sequence[str], progress: Callable[[float], None] = lambda _fraction: None
) -> Calls:
    """Run every cell of some engines.

    Args:
        engines: Keys of `engines.ENGINES`.
        progress: Told the fraction that is done.

    Raises:
        MissingEngineError: An engine is not installed here.
        UnknownNameError: There is no such engine.
    """
    found: dict[str, tuple[Call, ...]] = {}
    for done, engine in enumerate(engines):
        require(engine)
        module = importlib.import_module(f".{engine}_calls", __name__)
        calls = []
        for k, concept in enumerate(CONCEPTS):
            progress((done + k / len(CONCEPTS)) / len(engines))
            calls.append(_call(module, concept))
        found[engine] = tuple(calls)
    return Calls({engine: engine_version(engine) for engine in engines}, found)


def _call(module: Any, concept: str) -> Call:
    """Run the cells up to one from the start, so that a check may do what it likes."""
    names: dict[str, Any] = {}
    cell: Cell = module.CELLS[concept]
    said = ""
    with tempfile.TemporaryDirectory() as folder, silence():
        file = Path(folder) / module.FILE[0]
        file.write_text(module.FILE[1], encoding="utf-8")
        names["file"] = str(file)
        try:
            for each in CONCEPTS[: CONCEPTS.index(concept) + 1]:
                exec(module.CELLS[each].code, names)
            if not cell.happened(SimpleNamespace(**names)):
                said = "it ran, and what it should do did not happen"
        except Exception as error:  # whatever an engine raises is the finding
            said = f"{type(error).__name__}: {error}"
        finally:
            module.close(SimpleNamespace(**names))
    return Call(concept, cell.code, not said, said)


def near(one: Any, other: Any, error: float) -> bool:
    """Whether numbers, or arrays of them, are that near each other."""
    return bool(np.all(np.abs(np.subtract(one, other)) <= error))
