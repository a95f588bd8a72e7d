"""Pages of the documentation that are made from runs: path, conventions, comparisons.

`docs/conf.py` makes them.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from statemachine.atomic_files import replace_bytes
from statemachine.backends import load
from statemachine.course.lessons import LESSONS, Lesson
from statemachine.course.lessons.pictures import with_picture
from statemachine.course.lessons.session import page_of_lesson, take
from statemachine.course.notebook import markdown
from statemachine.errors import MissingEngineError
from statemachine.installed import PAIR, available
from statemachine.lab.compare import Request
from statemachine.lab.probes.conventions import page as conventions
from statemachine.lab.probes.conventions import probe, run_phrases
from statemachine.lab.questions import comparison
from statemachine.lab.questions.comparison import origin_of, title_of
from statemachine.lab.questions.film import drawn_picture
from statemachine.lab.questions.requests.gap import CompareRequest, answer
from statemachine.lab.runs.scenarios import scenario
from statemachine.lab.why import WhyRequest, explain
from statemachine.lab.why import page as why
from statemachine.measures.text import display_unit
from statemachine.show.blocks import Page, Text
from statemachine.show.pictures import Picture, RobotPicture, Traces


def make_path(
    folder: Path, backends: Sequence[str] | None = None, say: Callable[[str], None] = print
) -> list[Path]:
    """Run every lesson and write its page; a page that is already the same is left alone.

    Args:
        folder: Where the pages go.
        backends: Which to run on; by default MuJoCo and PyBullet, as far as they are installed.
        say: Told what is being run.

    Raises:
        MissingEngineError: A backend that was asked for, or matplotlib, is not installed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = backends or [name for name in PAIR if name in available()[0]]
    written = []
    for number, lesson in enumerate(LESSONS.values(), start=1):
        say(f"running the lesson {lesson.name} ...")
        page = _lesson_page(lesson, names)
        typed = f"statemachine lesson {lesson.name}"
        # The path is read in its order; what is beside it has no number.
        file = f"{number:02}-{lesson.name}" if lesson.on_path else lesson.name
        written.append(write_page(folder, file, page, typed))
    return written


def _lesson_page(lesson: Lesson, backends: Sequence[str]) -> Page:
    """Run a lesson on some backends, with all that it can show, and return its page."""
    models = {name: load(lesson.model, backend=name) for name in backends}
    options = dict.fromkeys(lesson.more, True)
    taken = {name: take(lesson, model, name, options) for name, model in models.items()}
    return with_picture(page_of_lesson(lesson, taken), lesson.name)


def make_reference(folder: Path) -> list[Path]:
    """Ask the installed engines for their conventions, run their calls, and write both down.

    Args:
        folder: Where the pages go.
    """
    folder.mkdir(parents=True, exist_ok=True)
    installed, _ = available()
    print("asking the engines ...")
    table = run_phrases(installed)
    pages = {
        "conventions": markdown(conventions.page(probe(installed)), lambda _: ""),
        "calls": markdown(conventions.calls_page(table), lambda _: ""),
        "cheat-sheet": conventions.cheat_sheet(table),
    }
    return [_save(folder / f"{name}.md", text.encode()) for name, text in pages.items()]


def make_comparisons(
    folder: Path, experiments: Sequence[str] = ("hold", "gravity", "box")
) -> list[Path]:
    """Write what `statemachine compare` says of the arm's experiments, and why.

    Args:
        folder: Where to; made if it is not there.
        experiments: Those that are run.

    Returns:
        The pages that were written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name in experiments:
        print(f"comparing: {name} ...")
        result = answer(CompareRequest(Request((name,))))
        (left, right), compared = result.run.traces, result.comparison
        page = comparison.page(result, details=True)
        page = replace(page, title=title_of(compared), origin=origin_of(compared))
        curves = {
            curve.name: (
                curve.time.tolist(),
                (curve.difference * display_unit(curve.unit)[0]).tolist(),
            )
            for curve in compared.curves
            if curve.kind == "joint"
        }
        apart = Traces("How far apart", "time [s]", "difference [°]", curves, log=True)
        page = replace(page, blocks=[apart, *page.blocks])
        written.append(write_page(folder, name, page, f"statemachine compare {name}"))
        if not (left.header.recorded or right.header.recorded):
            page = _why_as_they_come(name, (left.header.backend, right.header.backend))
            typed = f"statemachine compare {name} --backend mujoco --backend pybullet:engine --why"
            written.append(write_page(folder, f"{name}-why", page, typed))
    return written


def _why_as_they_come(name: str, backends: tuple[str, str]) -> Page:
    """Return the page that says why, for engines as they come."""
    asked = scenario(name)
    left = load(asked.model, backend=backends[0])
    right = load(asked.model, backend=backends[1], defaults="engine")
    page = why.page(explain(WhyRequest(left, right, asked)), details=True)
    return replace(
        page,
        title=f"{name}, engines as they come: why",
        blocks=[Text(f"{page.title}."), *page.blocks],
    )


def write_page(folder: Path, name: str, page: Page, typed: str) -> Path:
    """Write a page and its pictures, and return its file; what is already the same is left alone.

    Args:
        folder: Where they go.
        name: Of the file, without its suffix.
        page: The page.
        typed: The command that shows it in a terminal.
    """
    numbers = itertools.count(1)

    def picture(block: Picture) -> str:
        try:
            content, _ = drawn_picture(block)
        except MissingEngineError:
            if isinstance(block, RobotPicture):
                return ""  # the page has its words
            raise
        is_robot = isinstance(block, RobotPicture)
        file = f"{name}-robot.webp" if is_robot else f"{name}-{next(numbers)}.svg"
        _save(folder / file, content)
        return file

    heading, _, rest = markdown(page, picture).partition("\n\n")
    text = f"{heading}\n\nIn a terminal: `{typed}`\n\n{rest}"
    return _save(folder / f"{name}.md", text.encode())


def _save(path: Path, content: bytes) -> Path:
    """Write beside, then rename: a page is never half there."""
    if not path.exists() or path.read_bytes() != content:
        replace_bytes(path, content)
    return path
