"""The code of a lesson as a program to be typed: it is written for a model, and not run."""

from __future__ import annotations

from ...backends.chosen import one_backend
from ...errors import BadInputError
from ...lab.runs.each_backend import load_on
from .request import LessonRequest
from .session import code_as_typed, fitted


def program_of(request: LessonRequest) -> str:
    """Return the code of a lesson, as a student types it.

    The model is loaded, for the code depends on it: it names one of its joints, for example.

    Args:
        request: The lesson, on one backend.

    Raises:
        BadInputError: Several backends are named, an option has no meaning for the model, or the
            lesson has no program.
        MissingEngineError: The engine is not installed here.
        StateMachineError: The model cannot be loaded.
    """
    backend = one_backend(request.backends, "lesson --code")
    name = request.model or request.lesson.model
    model = load_on(backend, name, request.menagerie)
    values = fitted(request.lesson, model, request.values)
    menagerie = None if request.menagerie is None else str(request.menagerie)
    code = code_as_typed(request.lesson, model, str(backend), values, name, menagerie)
    if not code.strip():
        raise BadInputError(
            f"the lesson {request.name} has no program: it asks about those of the other lessons, "
            "such as statemachine lesson forward --code"
        )
    return code
