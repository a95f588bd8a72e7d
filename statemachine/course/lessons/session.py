"""A lesson taken: its code runs once, as a student would run it, and the lesson looks on."""

from __future__ import annotations

import builtins
import io
import itertools
import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, redirect_stdout
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import statemachine

from ...backends import backend_engine
from ...interface import Array, Data, Model, make_data, step
from ...lab.probes.code_statements import statements
from ...lab.runs.drive import Progress, no_progress, number_of_steps
from ...lab.runs.robot import is_so101, warn_of_start
from ...show.blocks import Block, Code, Items, Page, Printed, Question, Text
from ...show.each_engine import blocks_of_engines
from ...show.engine_tables import origin
from ...show.labels import TableLabels
from . import Lesson, module
from .frame import LessonFrame, ShownEngines

if TYPE_CHECKING:
    from ...lab.probes.calls import Recording
    from ...show.engine_tables import HasProvenance
    from ...show.pictures import Diagram

_SAY = TableLabels(__name__, "session_labels.md.j2")
Options = Mapping[str, Any]  # of a lesson, by key
L = TypeVar("L")  # what is looked at after a step
R_co = TypeVar("R_co", covariant=True)  # the result of a lesson


@dataclass
class Course(Generic[L]):
    """Course of a Data through the n steps of a run.

    Attributes:
        ctrl: (nu,) Command before the first step [unit of the actuator].
        time: (n + 1) Times of the states that it went through [s].
        qpos: (n + 1) Positions (nq,) in each of these states [rad or m].
        looks: (n) What was looked at after each step.
    """

    ctrl: Array
    time: list[float] = field(default_factory=list)
    qpos: list[Array] = field(default_factory=list)
    looks: list[L] = field(default_factory=list)

    def add_state(self, data: Data) -> None:
        """Add the state that the Data is in."""
        self.time.append(data.time)
        self.qpos.append(data.qpos.copy())


class CodeRun(ExitStack):
    """Code of a lesson on one Model, to be run once.

        with CodeRun(code, model) as play:
            play()
            play.worlds[0]  # the first Data that the code made; open until the end of the block

    Attributes:
        model: The Model that its `sm.load` returns.
        worlds: Each Data that it made, in their order, with its Model.
        names: Its variables.
        printed: What it printed.
    """

    def __init__(self, code: str, model: Model) -> None:
        super().__init__()
        self.model = model
        self.worlds: list[tuple[Model, Data]] = []
        self.names: dict[str, Any] = {}
        self._code = code
        self._out = io.StringIO()

    @property
    def printed(self) -> str:
        """Return what the code printed."""
        return self._out.getvalue()

    def lines(self, each_step: Callable[[Model, Data], object] | None = None) -> Iterator[str]:
        """Run the code, and yield each statement after it was run.

        Args:
            each_step: Called for each timestep in place of `step`, which it calls. Then
                `sm.step(model, data, n)` is taken as n steps, which end in the same bits.

        Raises:
            Exception: Whatever the code raised.
        """
        facade = self._facade(each_step)

        def imported(name: str, *args: Any, **kwargs: Any) -> Any:
            return facade if name == statemachine.__name__ else __import__(name, *args, **kwargs)

        self.names["__name__"] = "__main__"
        self.names["__builtins__"] = {**vars(builtins), "__import__": imported}
        for source, _, run in statements(self._code):
            with redirect_stdout(self._out):
                run(self.names)
            yield source

    def _facade(self, each_step: Callable[[Model, Data], object] | None) -> ModuleType:
        """Return the package as the code imports it: its Model is given, its steps are looked at.

        Args:
            each_step: See `lines`.
        """

        def load(*_args: Any, **_options: Any) -> Model:
            return self.model

        def make(model: Model) -> Data:
            data = self.enter_context(make_data(model))
            self.worlds.append((model, data))
            return data

        def step_one_by_one(model: Model, data: Data, nstep: int = 1) -> None:
            for _ in range(nstep):
                (each_step or step)(model, data)

        facade = ModuleType(statemachine.__name__)
        vars(facade).update(vars(statemachine), load=load, make_data=make, step=step)
        if each_step is not None:
            vars(facade).update(step=step_one_by_one)
        return facade

    def __call__(
        self, each_step: Callable[[Model, Data], object] | None = None
    ) -> Mapping[str, Any]:
        """Run the code as `lines` does, and return its variables."""
        for _ in self.lines(each_step):
            pass
        return self.names

    def follow(
        self, look: Callable[[Model, Data], L], steps: int, progress: Progress
    ) -> list[Course[L]]:
        """Run the code, and return the course of each Data that it stepped.

        Args:
            look: Returns what to keep of a Data after each step. Its contacts are then those of the
                state that the step began from.
            steps: Number of steps of all Data together.
            progress: Told the fraction that is done.
        """
        courses: dict[Data, Course[L]] = {}
        numbers = itertools.count()

        def course_of(data: Data) -> Course[L]:
            if data not in courses:
                warn_of_start(data.model, data)
                courses[data] = Course(data.ctrl.copy())
            return courses[data]

        def each_step(model: Model, data: Data) -> None:
            course = course_of(data)
            course.add_state(data)
            step(model, data)
            course.looks.append(look(model, data))
            number = next(numbers)
            if number % 100 == 0:
                progress(number / steps)

        self(each_step)
        for _, data in self.worlds:
            course_of(data).add_state(data)
        return list(courses.values())


class LessonModule(Protocol[R_co]):
    """Module of a lesson whose result is of one class."""

    def code(self, model: Model, options: Options, load: str) -> str:
        """Write what a student types for a Model, where `load` is the call that loads it."""
        ...

    def run(self, play: CodeRun, options: Options, progress: Progress) -> R_co:
        """Run that code once, look on, and return what was measured."""
        ...


@dataclass(frozen=True)
class LessonRun:
    """Lesson that was taken on one backend.

    Attributes:
        result: What its module measured, a dataclass of that module.
        code: Its code as it was typed.
        printed: What the code printed.
        arm: Whether it was taken on what its text is about, the SO-101 but for a few lessons.
        calls: What the code made the engine do; None where that was not asked for, or where the
            engine's room cannot tell.
        diagram: What its module draws of the model; None where it draws nothing.
    """

    result: HasProvenance
    code: str
    printed: str
    arm: bool
    calls: Recording | None = None
    diagram: Diagram | None = None


def take(
    lesson: Lesson,
    model: Model,
    backend: str,
    options: Options | None = None,
    name: str | None = None,
    menagerie: str | None = None,
    progress: Progress = no_progress,
    calls: bool = False,
) -> LessonRun:
    """Run the code of a lesson, and what else the lesson looks at.

    Args:
        lesson: An entry of the table of lessons.
        model: The Model to run it on.
        backend: What `load` was given for it.
        options: Values of the lesson's options by key; by default its own.
        name: What `load` was given as the model, if not the lesson's.
        menagerie: What it was given as that.
        progress: Told the fraction that is done.
        calls: Whether to run the code once more, recording what it makes the engine do, if the
            engine's room can tell.
    """
    values = fitted(lesson, model, options or {})
    lesson_module = module(lesson.name)
    code = code_as_typed(lesson, model, backend, values, name or lesson.model, menagerie)
    with CodeRun(code, model) as play:
        result = lesson_module.run(play, values, progress)
    recording = _recorded(code, backend) if calls else None
    draw = getattr(lesson_module, "diagram", None)
    diagram = draw(model) if draw else None
    return LessonRun(
        result=result,
        code=code,
        printed=play.printed,
        arm=is_so101(model) or not lesson.model.startswith("so101/"),
        calls=recording,
        diagram=diagram,
    )


def code_as_typed(
    lesson: Lesson, model: Model, backend: str, values: Options, name: str, menagerie: str | None
) -> str:
    """Return the code of a lesson, as a student types it.

    Args:
        lesson: An entry of the table of lessons.
        model: The Model that it is written for.
        backend: What `load` is given for it.
        values: All options of the lesson by key, see `fitted`.
        name: What `load` is given as the model.
        menagerie: What it is given as that.
    """
    return module(lesson.name).code(model, values, load_line(name, backend, menagerie))


def _recorded(code: str, backend: str) -> Recording | None:
    """Record what some code makes an engine do, if the engine's room can tell."""
    from ...lab.probes.calls import (  # here, for it is much, and few ask for it
        record,
        recorded_engines,
    )

    engine = backend_engine(backend) or backend
    return record(code, engine) if engine in recorded_engines() else None


def fitted(lesson: Lesson, model: Model, options: Options) -> dict[str, Any]:
    """Return all options of a lesson; what is left open is what the Model suggests."""
    values = lesson.defaults | dict(options)
    fit = getattr(module(lesson.name), "fit", None)
    return fit(model, values) if fit else values


def page_of_lesson(lesson: Lesson, taken: Mapping[str, LessonRun]) -> Page:
    """Return the page of a lesson that was taken on one backend or several."""
    results = {name: run.result for name, run in taken.items()}
    is_on_arm = next(iter(taken.values())).arm
    blocks = blocks_of_engines(module(f"{lesson.name}_page").contents(results, _frame(taken)))
    heading = lesson.question
    if not is_on_arm:
        about_the_arm = (Text, Items, Question)
        blocks = [block for block in blocks if not isinstance(block, about_the_arm)]
        heading = _SAY("other_robot")
    return Page(f"{lesson.name}: {heading}", origin(results), blocks)


def _frame(taken: Mapping[str, LessonRun]) -> LessonFrame:
    """Return what the page shows of the code that ran."""
    diagram: Sequence[Block] = ()
    if any(run.diagram is not None for run in taken.values()):
        from .diagrams import told_apart  # here, for most lessons have none

        diagram = told_apart({name: run.diagram for name, run in taken.items()})
    return LessonFrame(
        code=Code(_code_shown(taken).splitlines()),
        printed=Printed({name: run.printed for name, run in taken.items()}),
        diagram=diagram,
        engines=ShownEngines.among(taken),
    )


def _code_shown(taken: Mapping[str, LessonRun]) -> str:
    """Return the code of the first backend, with the names of the others beside its `load`."""
    first, *others = taken
    code = taken[first].code
    if not others:
        return code
    then = ", then ".join(f'"{name}"' for name in others)
    loads = re.compile(f'^.*backend="{re.escape(first)}".*$', re.MULTILINE)
    return loads.sub(lambda line: f"{line[0]}  # then {then}", code)


def stepping_loop(model: Model, marks: Sequence[float], seconds: float) -> tuple[str, str]:
    """Return the head of a loop that steps from mark to mark, and what it gives `step` as nstep.

    Args:
        model: Its timestep counts.
        marks: Times at which the loop stops [s].
        seconds: The last of these times [s].
    """
    total = number_of_steps(model, seconds)
    ends = {0, total}
    for time in marks:
        end = round(time / model.timestep)
        if 0 < end < total:
            ends.add(end)
    counts = [end - start for start, end in itertools.pairwise(sorted(ends))]
    if len(set(counts)) == 1:
        return f"for _ in range({len(counts)}):", str(counts[0])
    return f"for n in ({', '.join(map(str, counts))}):", "n"


def load_line(model: str, backend: str, menagerie: str | None = None) -> str:
    """Return the call that loads a model, as one types it."""
    name, engine = (json.dumps(text, ensure_ascii=False) for text in (model, backend))
    folder = f", menagerie={menagerie!r}" if menagerie else ""
    return f"sm.load({name}, backend={engine}{folder})"
