"""A lesson taken: its code runs once, as a student would run it, and the lesson looks on."""

from __future__ import annotations

import builtins
import io
import itertools
import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, redirect_stdout
from dataclasses import replace
from types import ModuleType
from typing import Any

import statemachine

from ..backends import backend_engine
from ..interface import Data, Model, make_data, step
from ..page import Code, Figures, Page, Printed
from ..probes.calls import record, recorded_engines, statements
from ..runs.drive import Progress, silent, steps_in
from ..runs.robot import is_the_arm, warn_of_start
from . import Lesson, module, template

Options = Mapping[str, Any]  # of a lesson, by key


class CodeRun(ExitStack):
    """The code of a lesson on one Model, to be run once.

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
        """What the code printed."""
        return self._out.getvalue()

    def lines(self, each_step: Callable[[Model, Data], object] | None = None) -> Iterator[str]:
        """Run the code; yields each statement after it was run.

        Args:
            each_step: Called for each timestep in place of `step`, which it calls. Then
                `sm.step(model, data, n)` is taken as n steps, which end in the same bits.

        Raises:
            Exception: Whatever the code raised.
        """

        def make(model: Model) -> Data:
            data = self.enter_context(make_data(model))
            self.worlds.append((model, data))
            return data

        def watched(model: Model, data: Data, nstep: int = 1) -> None:
            for _ in range(nstep):
                (each_step or step)(model, data)

        # The package as the code imports it: its Model is given, its steps are looked at.
        facade = ModuleType(statemachine.__name__)
        vars(facade).update(
            vars(statemachine),
            load=lambda *_args, **_options: self.model,
            make_data=make,
            step=watched if each_step else step,
        )

        def imported(name: str, *args: Any, **kwargs: Any) -> Any:
            return facade if name == statemachine.__name__ else __import__(name, *args, **kwargs)

        self.names |= {
            "__name__": "__main__",
            "__builtins__": {**vars(builtins), "__import__": imported},
        }
        for source, _, run in statements(self._code):
            with redirect_stdout(self._out):
                run(self.names)
            yield source

    def __call__(
        self, each_step: Callable[[Model, Data], object] | None = None
    ) -> Mapping[str, Any]:
        """Run the code as `lines` does; its variables."""
        for _ in self.lines(each_step):
            pass
        return self.names

    def follow(
        self, look: Callable[[Model, Data], Any], steps: int, progress: Progress
    ) -> list[Figures]:
        """Run the code; where each Data that it stepped went.

        Args:
            look: What to keep of a Data after each step. Its contacts are then those of the state
                that the step began from.
            steps: How many there are.
            progress: Told the fraction that is done.

        Returns:
            ctrl: (nu,) its command before the first step.
            time: (n+1) times of the states that it went through [s]; qpos: (nq,) in each.
            looks: (n) what was looked at after each step.
        """
        courses: dict[Data, Figures] = {}
        numbers = itertools.count()

        def note(data: Data) -> None:
            if data not in courses:
                warn_of_start(data.model, data)
                courses[data] = Figures(ctrl=data.ctrl.copy(), time=[], qpos=[], looks=[])
            courses[data].time.append(data.time)
            courses[data].qpos.append(data.qpos.copy())

        def each_step(model: Model, data: Data) -> None:
            note(data)
            step(model, data)
            courses[data].looks.append(look(model, data))
            if (number := next(numbers)) % 100 == 0:
                progress(number / steps)

        self(each_step)
        for _, data in self.worlds:
            note(data)
        return list(courses.values())


def take(
    lesson: Lesson,
    model: Model,
    backend: str,
    options: Options | None = None,
    name: str | None = None,
    menagerie: str | None = None,
    progress: Progress = silent,
    calls: bool = False,
) -> Figures:
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

    Returns:
        result: What its module measured, and its provenance.
        code: As it was typed; printed: what it printed.
        arm: Whether it was taken on an SO-101, which is what its text is about.
        calls: What the engine was made to do by it, if that was to be recorded and can be.
    """
    values = fitted(lesson, model, options or {})
    lesson_module = module(lesson.name)
    code = lesson_module.code(model, values, load_line(name or lesson.model, backend, menagerie))
    with CodeRun(code, model) as play:
        result = lesson_module.run(play, values, progress)
    engine = backend_engine(backend) or backend
    recorded = record(code, engine) if calls and engine in recorded_engines() else None
    return Figures(
        result=result, code=code, printed=play.printed, arm=is_the_arm(model), calls=recorded
    )


def fitted(lesson: Lesson, model: Model, options: Options) -> dict[str, Any]:
    """All options of a lesson; what is left open is what the Model suggests."""
    values = lesson.defaults | dict(options)
    fit = getattr(module(lesson.name), "fit", None)
    return fit(model, values) if fit else values


def page_of_lesson(lesson: Lesson, taken: Mapping[str, Figures]) -> Page:
    """The page of a lesson that was taken on one backend or several."""
    first, *others = taken
    code = taken[first].code
    if others:  # each ran with its own name there
        then = ", then ".join(f'"{name}"' for name in others)
        loads = re.compile(f'^.*backend="{re.escape(first)}".*$', re.MULTILINE)
        code = loads.sub(lambda line: f"{line[0]}  # then {then}", code)
    lesson_module = module(lesson.name)
    results = {name: run.result for name, run in taken.items()}
    slots = {name: vars(result) | lesson_module.slots(result) for name, result in results.items()}
    has_tables = hasattr(lesson_module, "tables")
    blocks = {
        "code": Code(code.splitlines()),
        "printed": Printed({name: run.printed for name, run in taken.items()}),
        **(lesson_module.tables(results, results[first]) if has_tables else {}),
    }
    page = template.page(lesson.name, results, slots, blocks, prose=taken[first].arm)
    asked = (
        lesson.question if taken[first].arm else "code and figures; its text is about the SO-101"
    )
    return replace(page, title=f"{lesson.name}: {asked}")


def stepping_loop(model: Model, marks: Sequence[float], seconds: float) -> tuple[str, str]:
    """The head of a loop that steps from mark to mark, and what it gives `step` as nstep.

    Args:
        model: Its timestep counts.
        marks: Times at which the loop stops [s]; seconds: the last.
        seconds: See marks.
    """
    total = steps_in(model, seconds)
    ends = sorted({0, total, *(k for t in marks if 0 < (k := round(t / model.timestep)) < total)})
    counts = [end - start for start, end in itertools.pairwise(ends)]
    if len(set(counts)) == 1:
        return f"for _ in range({len(counts)}):", str(counts[0])
    return f"for n in ({', '.join(map(str, counts))}):", "n"


def load_line(model: str, backend: str, menagerie: str | None = None) -> str:
    """The call that loads a model, as one types it."""
    name, engine = (json.dumps(text, ensure_ascii=False) for text in (model, backend))
    folder = f", menagerie={menagerie!r}" if menagerie else ""
    return f"sm.load({name}, backend={engine}{folder})"
