"""What makes a page of a comparison again, as it stands on the page: without folders."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from ...measures import QUANTITIES
from ..compare.perturbed import Uncertainty
from ..compare.python_call import python_call
from ..compare.typed_command import typed_command
from .requests.causes import ExplainRequest, words_of_why
from .requests.gap import CompareRequest

# How a size in an SI unit is typed: its factor, and the unit.
_TYPED_UNITS = {"rad": (math.degrees(1.0), "deg"), "m": (1000.0, "mm")}


def page_command(
    request: CompareRequest, causes: ExplainRequest | None, file: Path, insists: bool = False
) -> str:
    """Return what makes a page again: a command, in lines, or a call of Python.

    Args:
        request: How far apart two runs are.
        causes: What is asked of causes; None where they are not looked for.
        file: The page.
        insists: Whether causes are the answer in the terminal, too: --why is typed.
    """
    if request.run.is_typed:
        words_of_causes = _words_of_causes(causes)
        if causes is not None and insists:
            words_of_causes = words_of_why(causes)
        words = [*_words_of(request), *words_of_causes, "--html", file.name]
        return typed_command(request.run, folders=False).lines(*words)
    arguments: list[str] = []
    if request.tolerances:
        arguments.append(f"tolerances={dict(request.tolerances)!r}")
    if request.uncertainty is None:
        arguments.append("chaos=False")
    else:
        sizes = tuple(_words_of_uncertainty(request.uncertainty))
        arguments += [f"uncertainty={sizes!r}"] if sizes else []
    call = python_call(request.run, further=arguments, folders=False)
    why = "" if causes is not None else ", why=False"
    return f"lab.write({call}, {file.name!r}{why})"


def _words_of(request: CompareRequest) -> list[str]:
    """Return the options that say how two runs are compared."""
    words: list[str] = []
    for kind, size in request.tolerances.items():
        words += ["--tolerance", f"{kind.replace(' ', '-')}={_typed(size, QUANTITIES[kind].unit)}"]
    if request.uncertainty is None:
        words.append("--no-chaos")
    else:
        for size in _words_of_uncertainty(request.uncertainty):
            words += ["--uncertainty", size]
    return words


def _words_of_causes(request: ExplainRequest | None) -> list[str]:
    """Return the options that say what is asked of causes."""
    if request is None:
        return ["--no-why"]
    return [] if request.quantity is None else ["--quantity", request.quantity]


def _words_of_uncertainty(uncertainty: Uncertainty) -> Iterator[str]:
    """Yield what is not known of a start, as one types it."""
    if uncertainty.length:
        yield _typed(uncertainty.length, "m")
    if uncertainty.angle:
        yield _typed(uncertainty.angle, "rad")


def _typed(size: float, unit: str) -> str:
    """Return a size in an SI unit as one types it: "0.5deg", "2mm"."""
    factor, typed_unit = _TYPED_UNITS.get(unit, (1.0, unit))
    return f"{size * factor:.12g}{typed_unit}"
