"""`statemachine lesson`: the guided path, and each lesson alone."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import dropwhile
from pathlib import Path
from typing import Any

from ..errors import BadInputError, MissingEngineError, refuse
from ..lessons import BESIDE, LESSONS, PATH, Lesson
from ..page import Heading
from ._common import (
    LESSON_BACKEND,
    MISSING,
    PROGRAM,
    SAYS_NO,
    Row,
    add_table,
    chosen_backends,
    complain,
    json_of,
    menagerie,
    on_each_backend,
    show,
)


def add(parser: argparse.ArgumentParser) -> None:
    """Its options, and a parser for each lesson."""
    parser.description = "Without a name: the lessons of the path, one after the other."
    parser.epilog = "In a terminal each lesson asks for a prediction before it shows the answer."
    add_table(
        parser,
        *_shared(),
        (
            "--from",
            "LESSON",
            "of the whole path: where to begin, if not at the first",
            {"dest": "start", "choices": [lesson.name for lesson in PATH]},
        ),
    )
    parser.set_defaults(run=run_path)
    named = parser.add_subparsers(metavar="name")
    for lesson in LESSONS.values():
        _add_lesson(named, lesson)


def _shared() -> Iterator[Row]:
    """Options that come before a lesson's name or after it; the later one counts."""
    yield from (LESSON_BACKEND, *menagerie(), json_of())
    yield "--calls", "", "show which of the engine's own functions the code made it run"
    yield "--no-questions", "", "do not ask for predictions, do not wait"
    yield "--record", "FILE", "keep your predictions in this file, with a score, to hand in"


def _add_lesson(named: Any, lesson: Lesson) -> None:
    parser = named.add_parser(lesson.name, help=lesson.question, description=lesson.question)
    rows: list[Row] = [(*row, {"default": argparse.SUPPRESS}) for row in _shared()]
    rows += lesson.options
    if lesson.plots:
        rows.append(("--plot", "FILE", "write its pictures: .svg, .png or .pdf"))
    model = f"the model (default {lesson.model})"
    add_table(parser, *rows, ("--model", "NAME|FILE", model, {"default": lesson.model}))
    parser.set_defaults(run=run, lesson=lesson, plot=None)


_OVERVIEW = f"""\
A physics simulator is a state machine that you advance.

  {PROGRAM} lesson           the guided path: ten lessons, about 35 minutes

Each of the ten alone, as in `{PROGRAM} lesson state`:
{{lessons}}
then your turn:
  {PROGRAM} check exercises/step_loop.py   four functions to write, judged
  {PROGRAM} compare hold --why             where two engines differ, and why
  {PROGRAM} doctor                         what this machine has, what to do
All commands: {PROGRAM} --help"""


def overview(_options: argparse.Namespace) -> int:
    """List what there is."""
    lessons = [f"  {lesson.name:<11}{lesson.question}" for lesson in (*PATH, *BESIDE)]
    lessons.insert(len(PATH), "and beside the path:")
    print(_OVERVIEW.format(lessons="\n".join(lessons)))
    return 0


def run(options: argparse.Namespace) -> int:
    """One lesson, on one backend or all."""
    lesson: Lesson = options.lesson
    refuse(
        (
            options.start is not None,
            f"--from begins the whole path, and {lesson.name} is one lesson of it: type "
            f"{PROGRAM} lesson --from {options.start}, or {PROGRAM} lesson {lesson.name}",
        ),
    )
    values = {key: getattr(options, key) for key in lesson.defaults}
    reader = _reader(options, lesson)
    page, results = _compute(options, lesson, options.model, values)
    if options.plot is not None:
        from ..report.figures import write_pictures

        size = write_pictures(page.blocks, Path(options.plot))
        print(f"wrote {options.plot} ({size / 1e3:.0f} kB)", file=sys.stderr)
    if any(values[part] for part in lesson.more) and not options.json:
        shown = dropwhile(lambda block: not isinstance(block, Heading), page.blocks)
        page = replace(page, blocks=list(shown))
    names = list(LESSONS)
    later = names[names.index(lesson.name) + 1 :]
    following = f"{PROGRAM} lesson {later[0]}" if later else "python exercises/step_loop.py"
    from ..report.quiz import Stopped

    try:
        return show(page, results, options.json, f"Next: {following}", reader)
    except Stopped:
        return 0
    finally:
        if options.record:
            print(reader.summary)


_NEXT = f"""\
Where to go next:
  {PROGRAM} lesson questions              six questions: check yourself
  {PROGRAM} lesson worlds                 many worlds of one Model
  python exercises/step_loop.py              four functions for you to write
  {PROGRAM} check exercises/step_loop.py  what they do, judged
  {PROGRAM} lesson gravity --backend all  on all engines, side by side
  {PROGRAM} compare hold --why            where two engines differ, and why
  {PROGRAM} --help                        every command
"""


def run_path(options: argparse.Namespace) -> int:
    """All lessons of the path, one after the other."""
    from ..measures.text import command
    from ..report import terminal
    from ..report.as_json import dumps
    from ..report.quiz import Stopped

    reader = _reader(options, PATH[0])
    code, everything = 0, {}
    names = [lesson.name for lesson in PATH]
    first = names.index(options.start) if options.start else 0
    lesson = PATH[first]
    try:
        for number, lesson in enumerate(PATH[first:], start=first + 1):
            if reader and number > first + 1:
                reader.go_on(f"lesson {number}: {lesson.question}")
            if reader:
                reader.lesson = lesson.name
            page, everything[lesson.name] = _compute(options, lesson, lesson.model, lesson.defaults)
            code = code if page.holds else SAYS_NO
            if not options.json:
                terminal.show(
                    replace(page, title=f"{number} of {len(PATH)}, {page.title}"), "", reader
                )
        if options.json:
            print(dumps(everything))
        elif code == 0:
            with suppress(Stopped):
                code = _last_page(options, reader)
    except (Stopped, KeyboardInterrupt) as stop:
        if reader:
            again = command(
                [PROGRAM, "lesson", "--from", lesson.name],
                *(("--backend", word, None) for word in options.backend or ()),
                ("--record", options.record, None),
            )
            print(f"\nGo on later with: {again}")
        if isinstance(stop, KeyboardInterrupt):
            raise
    finally:
        if options.record:
            print(reader.summary)
    return code


def _last_page(options: argparse.Namespace, reader: Any) -> int:
    """The fingertip of all engines against the witness, and where to go next."""
    from ..lessons.certificate import page
    from ..lessons.fingertip import certify
    from ..report import terminal

    code, every = 0, argparse.Namespace(backend=["all"], menagerie=options.menagerie)
    if reader:
        reader.go_on("the last page: the fingertip, checked by another library")
    try:
        results = on_each_backend(
            every, "fingertip", "so101", lambda model, _, report: certify(model, progress=report)
        )
        certificate = page(results)
        code = 0 if certificate.holds else SAYS_NO
        terminal.show(replace(certificate, title=f"The last page: {certificate.title}"), "", reader)
    except MissingEngineError as error:  # nobody can compute it here
        complain(error, MISSING)
    (reader.read if reader else sys.stdout.write)(_NEXT)
    if reader:
        reader.show()
    return code


def _compute(
    options: argparse.Namespace, lesson: Lesson, model: str, values: dict[str, Any]
) -> tuple[Any, dict[str, Any]]:
    """The page of a lesson, and the results that it was made from, by backend."""
    from ..lessons.pictures import with_picture
    from ..lessons.session import page_of_lesson, take

    for backend in chosen_backends(options.backend):
        if backend.defaults == "engine":
            raise BadInputError(
                f"lessons are about engines that keep the contract: type --backend {backend.name}"
            )
    if options.json:
        values |= dict.fromkeys(lesson.more, True)
    taken = on_each_backend(
        options,
        lesson.name,
        model,
        lambda loaded, backend, report: take(
            lesson, loaded, backend, values, model, options.menagerie, report, options.calls
        ),
    )
    page = page_of_lesson(lesson, taken)
    if model == lesson.model and values == lesson.defaults:
        page = with_picture(page, lesson.name)
    if not options.calls:
        return page, {name: run.result for name, run in taken.items()}
    from ..report import conventions

    recordings = {name: t.calls for name, t in taken.items() if t.calls and t.calls.statements}
    recorded = conventions.recorded_calls(recordings) if recordings else ()
    silent = [conventions.not_asked(name) for name, run in taken.items() if run.calls is None]
    page = replace(page, blocks=[*page.blocks, *recorded, *silent])
    return page, {name: {"result": t.result, "calls": t.calls} for name, t in taken.items()}


def _reader(options: argparse.Namespace, lesson: Lesson) -> Any:
    """Who answers the questions of a lesson; None where nobody would."""
    from ..report.quiz import Reader, can_ask

    asked = can_ask() and not (options.json or options.no_questions)
    if options.record is None:
        return Reader(lesson.name) if asked else None
    if not asked:
        raise BadInputError("--record keeps what you predict: it needs a terminal that asks")
    from ..report.quiz import RecordedReader

    return RecordedReader(Path(options.record), lesson.name)
