"""Pages of the documentation that are made from runs: path, conventions, comparisons."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from ..backends import backend_names, load
from ..compare import Request, compare, run_sides, series, witness
from ..compare.why import explain
from ..errors import MissingEngineError
from ..installed import available
from ..lessons import LESSONS
from ..lessons.pictures import with_picture
from ..lessons.session import page_of_lesson, take
from ..measures.text import reading
from ..page import Page, Picture, RobotPicture, Text, Traces
from ..probes import phrasebook
from ..probes.conventions import probe
from ..runs.scenarios import scenario
from ..runs.whole import replace_bytes
from . import compare as comparison
from . import conventions, why
from .cheat_sheet import cheat_sheet
from .markdown import markdown
from .robot_pictures import drawn_picture


def make_path(
    folder: Path, backends: Sequence[str] | None = None, say: Callable[[str], None] = print
) -> list[Path]:
    """Run every lesson and write its page; a page that is already the same is left alone.

    Args:
        folder: Where the pages go.
        backends: Which to run on; by default all that are installed.
        say: Told what is being run.

    Raises:
        MissingEngineError: A backend that was asked for, or matplotlib, is not installed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for number, lesson in enumerate(LESSONS.values(), start=1):
        say(f"running the lesson {lesson.name} ...")
        taken = {}
        for backend in backends or backend_names():
            try:
                model = load(lesson.model, backend=backend)
            except MissingEngineError:
                if backends:
                    raise
                continue
            taken[backend] = take(lesson, model, backend, dict.fromkeys(lesson.more, True))
        page = with_picture(page_of_lesson(lesson, taken), lesson.name)
        name, typed = f"{number:02}-{lesson.name}", f"statemachine lesson {lesson.name}"
        written.append(_write(folder, name, page, lesson.question, typed))
    return written


def make_reference(folder: Path, say: Callable[[str], None] = print) -> list[Path]:
    """Ask the installed engines for their conventions, run their calls, and write both down.

    Args:
        folder: Where the pages go.
        say: Told what is being run.
    """
    folder.mkdir(parents=True, exist_ok=True)
    installed, _ = available()
    say("asking the engines ...")
    asked = conventions.page(probe(installed))
    table = phrasebook.run(installed)
    pages = {
        "conventions": markdown(asked, lambda _: ""),
        "calls": markdown(conventions.calls_page(table), lambda _: ""),
        "cheat-sheet": cheat_sheet(table),
    }
    for name, text in pages.items():
        _save(folder / f"{name}.md", text.encode())
    return [folder / f"{name}.md" for name in pages]


def make_comparisons(folder: Path, say: Callable[[str], None] = print) -> list[Path]:
    """Write what `statemachine compare` says of the arm's experiments, and why.

    Args:
        folder: Where to; made if it is not there.
        say: Told what is being made.

    Returns:
        The pages that were written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    found = []
    for name in ("hold", "gravity", "box"):
        say(f"comparing: {name} ...")
        run = run_sides(Request((name,)))
        one, two = run.traces
        page = comparison.page(
            compare(one, two), one, two, said=run.said, witness=witness(one, two)
        )
        curves = {
            curve.name: (curve.time.tolist(), (curve.difference * reading(curve.unit)[0]).tolist())
            for curve in series(one, two)
            if curve.kind == "joint"
        }
        apart = Traces("How far apart", "time [s]", "difference [°]", curves, log=True)
        page = replace(page, blocks=[page.blocks[0], apart, *page.blocks[1:]])
        found.append(_write(folder, name, page, "", f"statemachine compare {name}"))
        if not (one.header.recorded or two.header.recorded):
            found.append(_explain(folder, name, (one.header.backend, two.header.backend)))
    return found


def _explain(folder: Path, name: str, backends: tuple[str, str]) -> Path:
    """The page that says why, for engines as they come."""
    asked = scenario(name)
    models = [load(asked.model, backend=backend, defaults="engine") for backend in backends]
    page = why.page(explain(models[0], models[1], asked))
    title = f"{name}, engines as they come: why"
    page = replace(page, title=title, blocks=[Text(f"{page.title}."), *page.blocks])
    return _write(
        folder, f"{name}-why", page, "", f"statemachine compare {name} --why --defaults engine"
    )


def _write(folder: Path, name: str, page: Page, question: str, typed: str) -> Path:
    pictures: list[str] = []

    def picture(block: Picture) -> str:
        robot = isinstance(block, RobotPicture)
        try:
            content, _ = drawn_picture(block)
        except MissingEngineError:
            if robot:
                return ""  # the page has its words
            raise
        file = f"{name}-robot.webp" if robot else f"{name}-{len(pictures) + 1}.svg"
        pictures.extend([] if robot else [file])
        _save(folder / file, content)
        return file

    text = markdown(page, picture)
    heading, _, rest = text.partition("\n\n")
    lead = f"**{question}** " if question else ""
    path = folder / f"{name}.md"
    _save(path, f"{heading}\n\n{lead}In a terminal: `{typed}`\n\n{rest}".encode())
    return path


def _save(path: Path, content: bytes) -> None:
    """Write beside, then rename: a page is never half there."""
    if path.exists() and path.read_bytes() == content:
        return
    replace_bytes(path, content)
