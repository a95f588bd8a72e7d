"""Pages of the documentation that are made from runs: the path, and the conventions."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from ..backends import backend_names, load
from ..engines import available
from ..errors import MissingEngineError
from ..lessons import LESSONS
from ..lessons.session import page_of_lesson, take
from ..page import Page, Picture, Verdict
from ..probes import phrasebook
from ..probes.conventions import probe
from . import conventions
from .figures import svg
from .markdown import block_as_markdown, markdown


def make_path(
    folder: Path, backends: Sequence[str] | None = None, say: Callable[[str], None] = print
) -> list[Path]:
    """Run every station and write its page; a page that is already the same is left alone.

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
        say(f"running the station {lesson.name} ...")
        taken = {}
        for backend in backends or backend_names():
            try:
                model = load(lesson.model, backend=backend)
            except MissingEngineError:
                if backends:
                    raise
                continue
            taken[backend] = take(lesson, model, backend)
        page = page_of_lesson(lesson, taken)
        written.append(_write(folder, f"{number:02}-{lesson.name}", page, lesson.question))
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
        "calls": _phrases(conventions.calls_page(table), table),
    }
    for name, text in pages.items():
        _save(folder / f"{name}.md", text)
    return [folder / f"{name}.md" for name in pages]


def _phrases(page: Page, table: phrasebook.Calls) -> str:
    """A heading for each concept, and what to type on each engine."""
    parts = [f"# {page.title}", f"*{page.origin}*"]
    parts += [block_as_markdown(b, lambda _: "") for b in page.blocks if isinstance(b, Verdict)]
    for concept in phrasebook.CONCEPTS:
        parts.append(f"## {concept[0].upper()}{concept[1:]}")
        for engine, calls in table.engines.items():
            (call,) = (each for each in calls if each.concept == concept)
            mark = "✓" if call.works else "✗"
            parts.append(f"{engine} {mark}\n\n```python\n{call.code}\n```")
    return "\n\n".join(parts) + "\n"


def _write(folder: Path, name: str, page: Page, question: str) -> Path:
    pictures: list[str] = []

    def picture(block: Picture) -> str:
        file = f"{name}-{len(pictures) + 1}.svg"
        pictures.append(file)
        _save(folder / file, svg(block))
        return file

    text = markdown(page, picture)
    heading, _, rest = text.partition("\n\n")
    run = f"In a terminal: `statemachine lesson {name.partition('-')[2]}`"
    path = folder / f"{name}.md"
    _save(path, f"{heading}\n\n**{question}** {run}\n\n{rest}")
    return path


def _save(path: Path, text: str) -> None:
    """Write beside, then rename: a page is never half there."""
    if path.exists() and path.read_text(encoding="utf-8") == text:
        return
    beside = path.with_name(path.name + ".part")
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, path)
