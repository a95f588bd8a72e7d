"""Which lesson is taken, on what, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ...backends.chosen import chosen_backends
from ...errors import BadInputError, check_name
from ...installed import DEFAULT
from ...interface import Model
from ...lab.runs.drive import Progress
from ...lab.runs.each_backend import on_each_backend
from ...lab.runs.reporter import QUIET, Reporter
from ...models import AnyPath
from . import LESSONS, Lesson, check_lesson
from .session import LessonRun, take

LessonValue = bool | int | float | str | Sequence[float] | None  # of a lesson's option


@dataclass(frozen=True)
class LessonRequest:
    """Lesson that is to be taken.

    Attributes:
        name: A key of `LESSONS`.
        model: A name or a file of a model; None for the lesson's own.
        backends: As `parse_backend` reads them, each with the contract of this library; "all" for
            those that are installed.
        menagerie: A menagerie folder to look the model's name up in.
        options: Values of the lesson's options by key; those that are left out are its own.
        calls: Whether to record which of the engine's own functions its code makes run.
    """

    name: str
    model: str | None = None
    backends: tuple[str, ...] = (DEFAULT,)
    menagerie: AnyPath | None = None
    options: Mapping[str, LessonValue] = field(default_factory=dict[str, LessonValue])
    calls: bool = False

    def __post_init__(self) -> None:
        check_lesson(self.name)
        for key in self.options:
            check_name(f"option of the lesson {self.name}", key, self.lesson.defaults)
        for backend in chosen_backends(self.backends):
            if backend.defaults == "engine":
                raise BadInputError(
                    "lessons are about engines that keep the contract: type --backend "
                    f"{backend.name}"
                )

    @property
    def lesson(self) -> Lesson:
        """Return the lesson."""
        return LESSONS[self.name]

    @property
    def values(self) -> dict[str, LessonValue]:
        """Return all options of the lesson, by key."""
        return {**self.lesson.defaults, **self.options}

    @property
    def shows_parts(self) -> bool:
        """Tell whether an option asks for parts of the lesson alone."""
        return any(self.values[part] for part in self.lesson.more)

    @property
    def is_plain(self) -> bool:
        """Tell whether it is taken on its own model, and with its own options."""
        on_its_own = self.model is None or self.model == self.lesson.model
        return on_its_own and self.values == self.lesson.defaults


def answer(request: LessonRequest, reporter: Reporter = QUIET) -> dict[str, LessonRun]:
    """Take a lesson on each backend, and return what came of it by backend.

    Raises:
        MissingEngineError: An engine that is named is not installed here, or none is.
        BadInputError: An option has no meaning for the model.
        StateMachineError: The model cannot be loaded.
    """
    lesson, values = request.lesson, request.values
    model = request.model or lesson.model

    def compute(loaded: Model, backend: str, progress: Progress) -> LessonRun:
        menagerie = None if request.menagerie is None else str(request.menagerie)
        return take(lesson, loaded, backend, values, model, menagerie, progress, request.calls)

    return on_each_backend(
        request.backends, lesson.name, model, request.menagerie, compute, reporter
    )
