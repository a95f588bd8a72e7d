"""One question, answered on each of several backends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from ...backends import BackendChoice
from ...backends.chosen import ALL, chosen_backends
from ...errors import MissingEngineError, ModelError, StateMachineError, UnsupportedError
from ...interface import Model
from ...models import AnyPath
from .drive import Progress
from .reporter import Reporter

R = TypeVar("R")  # what is computed on a backend


def load_on(backend: BackendChoice, model: AnyPath, menagerie: AnyPath | None) -> Model:
    """Load a model on a backend, as `load_to_run` does."""
    return backend.load_to_run(model, menagerie=menagerie)


def on_each_backend(
    backends: Sequence[str],
    what: str,
    model: AnyPath,
    menagerie: AnyPath | None,
    compute: Callable[[Model, str, Progress], R],
    reporter: Reporter,
    load: Callable[[BackendChoice, AnyPath, AnyPath | None], Model] = load_on,
) -> dict[str, R]:
    """Return results by backend; of "all", one whose engine is missing is noted and left out.

    Args:
        backends: As of `backends.chosen.chosen_backends`.
        what: What is computed, for the progress.
        model: A model's name or file.
        menagerie: A menagerie folder to look the name up in.
        compute: Called with the Model, the backend as it is typed, and what is told the fraction
            that is done.
        reporter: Told how it gets on.
        load: Loads the model on a backend, given the menagerie folder.

    Raises:
        MissingEngineError: An engine that is named is missing, or all are.
        StateMachineError: As `load` does, or `compute`.
    """
    results: dict[str, R] = {}
    missing: dict[str, StateMachineError] = {}  # by its text: several may say the same
    for backend in dict.fromkeys(chosen_backends(backends)):
        try:
            loaded = load(backend, model, menagerie)
        except (MissingEngineError, ModelError, UnsupportedError) as error:
            if ALL not in backends:
                raise
            missing[str(error)] = error
            continue
        with reporter.stage(f"{what} on {backend}") as progress:
            results[str(backend)] = compute(loaded, str(backend), progress)
    note_missing([*missing.values()], bool(results), reporter)
    return results


def note_missing(missing: Sequence[StateMachineError], others: bool, reporter: Reporter) -> None:
    """Note what is missing of all that was asked for.

    Args:
        missing: An error for each.
        others: Whether there are others; if not, the last error is raised.
        reporter: Told each of the others.

    Raises:
        StateMachineError: Nothing is there.
    """
    noted = missing if others else missing[:-1]
    for error in noted:
        reporter.note(f"left out: {error}")
    if not others:
        raise missing[-1]
