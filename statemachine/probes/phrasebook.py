"""Which call does what on each engine: a table whose every cell is run before it is shown.

The cells of one engine, one after the other, are a program; its room's `phrases` has
them by concept. After each, a check looks at the engine for what the concept
says. An engine without a cell for a concept is not asked.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from ..engines import room
from ..engines.measured import Phrases
from ..page import Figures
from ..silence import silence
from .conventions import check_engine, versions

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


def run(
    engines: Sequence[str], progress: Callable[[float], None] = lambda _fraction: None
) -> Figures:
    """Run every cell of some engines.

    Args:
        engines: Keys of `installed.ENGINES`.
        progress: Told the fraction that is done.

    Returns:
        versions: That were asked.
        engines: The phrases of each; see `_phrase`.

    Raises:
        MissingEngineError: An engine is not installed here.
        UnknownNameError: There is no such engine.
    """
    phrases: dict[str, tuple[Figures, ...]] = {}
    for done, engine in enumerate(engines):
        check_engine(engine)
        own = room(engine).phrases()
        concepts = [concept for concept in CONCEPTS if concept in own.cells]
        said = []
        for count in range(1, len(concepts) + 1):
            said.append(_phrase(own, concepts[:count]))
            progress((done + count / len(concepts)) / len(engines))
        phrases[engine] = tuple(said)
    return Figures(versions=versions(engines), engines=phrases)


def _phrase(own: Phrases, concepts: Sequence[str]) -> Figures:
    """Run the cells up to the last concept, so that its check may do what it likes.

    Returns:
        concept: The last one; code: what was typed for it.
        works: Whether it ran, and the concept happened; said: what was wrong.
    """
    cell = own.cells[concepts[-1]]
    said = ""
    with tempfile.TemporaryDirectory() as folder, silence():
        file = Path(folder) / own.file[0]
        file.write_text(own.file[1], encoding="utf-8")
        names: dict[str, Any] = {"file": str(file)}
        try:
            for concept in concepts:
                exec(own.cells[concept].code, names)
            if not cell.happened(SimpleNamespace(**names)):
                said = "it ran, and what it should do did not happen"
        except Exception as error:  # whatever an engine raises is the finding
            said = f"{type(error).__name__}: {error}"
        finally:
            own.close(SimpleNamespace(**names))
    return Figures(concept=concepts[-1], code=cell.code, works=not said, said=said)
