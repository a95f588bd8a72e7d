"""Groups of figures: how each is computed, where it is kept, what has changed in it."""

from __future__ import annotations

import contextlib
import io
import json
import os
import platform
import tempfile
from collections.abc import Callable, Iterable
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np

from statemachine.cli import main as statemachine
from statemachine.cli import options_of_words
from statemachine.cli.common import BAD_INPUT, SAYS_NO
from statemachine.cli.lesson import request_of
from statemachine.cli.lesson_taken import take_lesson
from statemachine.errors import StateMachineError
from statemachine.installed import ENGINES, WITNESS, engine_version
from statemachine.show.as_json import dumps
from statemachine.show.page_text import text_of

from . import questions
from .cases import HERE, MODELS, PAIRS, ROOT, Case, of_model, of_pair
from .figures import Figures, curve, differences, of_output

KEPT = HERE / "figures"
# In `make test`.
QUICK = ("pair damping", "worlds")
# In `make reference` alone: robots and scenes that are asked the same as others, and take long.
ON_REQUEST = ("arm with a box", "reacher", "floating ant", "cheetah", "manipulator")
_BACKENDS = ("mujoco", "pybullet")
_WITHOUT_MARKS = {"lesson summary", "lesson time"}


def machine() -> dict[str, str]:
    """Return the wheels and the kind of processor that figures were made on, to be read."""
    features = np._core._multiarray_umath.__cpu_features__  # pyright: ignore[reportAttributeAccessIssue]
    vectors = [name for name in ("AVX2", "AVX512F", "AVX512_SPR", "ASIMD") if features.get(name)]
    kind = " ".join((platform.system(), platform.machine(), *vectors))
    engines = {name: engine_version(name) for name in ENGINES}
    others = {name: version(name) for name in ("numpy", "scipy", "pyarrow")}
    return {"processor": kind, "python": platform.python_version()[:4], **engines, **others}


def _of(case: Case) -> Figures:
    """Return the figures of a command, with its exit code."""
    shown = io.StringIO()
    with contextlib.redirect_stdout(shown), contextlib.redirect_stderr(io.StringIO()):
        try:
            code = statemachine(list(case.arguments))
        except SystemExit as end:
            code = end.code
    figures: Figures = {"exit code": code}
    if code != 2:
        figures |= of_output(shown.getvalue(), case.kind)
    if case.writes and Path(case.writes).exists():
        with np.load(case.writes) as arrays:
            figures |= {name: curve(arrays[name]) for name in arrays.files if name != "header"}
    return figures


def _of_lesson(case: Case) -> dict[str, Figures]:
    """Return the figures of a lesson's JSON, and the marks on the page of the same run."""
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            page, results = take_lesson(request_of(options_of_words(list(case.arguments))))
    except StateMachineError:
        of_json: Figures = {"exit code": BAD_INPUT}
        marks: Figures = {"exit code": BAD_INPUT}
    else:
        code = 0 if page.holds else SAYS_NO
        of_json = {"exit code": code, **of_output(dumps(results), case.kind)}
        marks = {"exit code": code, **of_output(text_of(page), "")}
    figures = {case.name: of_json}
    if case.name not in _WITHOUT_MARKS:
        figures[f"{case.name}, marks"] = marks
    return figures


def _commands(cases: Callable[..., Iterable[Case]], *of: str) -> dict[str, Figures]:
    figures: dict[str, Figures] = {}
    for case in cases(*of):
        figures |= _of_lesson(case) if case.is_lesson else {case.name: _of(case)}
    return figures


def _engines() -> dict[str, Figures]:
    """Return the figures of every convention, of the contract, and of a Data of each engine."""
    engines = [word for name in (*_BACKENDS, WITNESS) for word in ("--backend", name)]
    asked = {"conventions": _of(Case("", "conventions", ("conventions", *engines, "--json")))}
    for backend in _BACKENDS:
        asked[f"contract, {backend}"] = questions.contract(backend)
        asked[f"Data, {backend}"] = questions.one_data(backend)
    return asked


def _on_each(question: Callable[[str], Figures]) -> dict[str, Figures]:
    return {backend: question(backend) for backend in _BACKENDS}


def _sweep() -> dict[str, Figures]:
    """Return the figures of a small sweep and its summary."""
    vary = ("--vary", "timestep=0.002,0.005", "--vary", "damping=0.5x:2x:3", "--seeds", "2")
    sweep = ("sweep", "hold", *vary, "--seconds", "0.5", "--out", "cells", "--jobs", "1", "--json")
    report = ("sweep", "--report", "cells", "--json")
    return {"sweep": _of(Case("", "sweep", sweep)), "report": _of(Case("", "report", report))}


def _students() -> dict[str, Figures]:
    """Return the judge's verdict on each attempt, and on the solutions."""
    files = dict(questions.student_files(Path.cwd()))
    files["the solution"] = ROOT / "teaching" / "solutions" / "step_loop.py"
    return {
        name: _of(Case(name, "check", ("check", str(file), "--json")))
        for name, file in files.items()
    }


GROUPS: dict[str, Callable[[], dict[str, Figures]]] = {
    "engines": _engines,
    "worlds": partial(_on_each, questions.many_worlds),
    "tasks": partial(_on_each, questions.tasks),
    "sweep": _sweep,
    "students": _students,
    **{f"pair {name}": partial(_commands, of_pair, name) for name in PAIRS},
    **{name: partial(_commands, of_model, name) for name in MODELS},
}


def absent(group: str) -> bool:
    """Return whether a group is of a public model that is not beside this checkout."""
    path = MODELS.get(group)
    return isinstance(path, Path) and not path.exists()


def figures(group: str) -> dict[str, Figures]:
    """Compute the figures of a group in an empty folder."""
    here = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            return json.loads(json.dumps(GROUPS[group]()), parse_constant=str)  # NaN is not JSON
        finally:
            os.chdir(here)


def kept(group: str, folder: Path = KEPT) -> Path:
    """Return the file of a group's figures."""
    return folder / f"{group.replace(',', '').replace(' ', '_')}.json"


def changes(
    group: str, now: dict[str, Figures], folder: Path = KEPT, bits: bool = False
) -> list[str]:
    """Return what has changed in a group since its figures were written.

    Args:
        group: Name of the group.
        now: Its figures, computed now.
        folder: Where those before are kept.
        bits: Whether every bit is compared: those before are of this machine.
    """
    then = json.loads(kept(group, folder).read_text("utf-8"))
    return differences(then["figures"], now, group, bits)


def write(group: str, now: dict[str, Figures], folder: Path = KEPT) -> list[str]:
    """Write the figures of a group, computed now, into a folder; returns no changes."""
    folder.mkdir(parents=True, exist_ok=True)
    cases = [
        f"{json.dumps(case, ensure_ascii=False)}: {{\n"
        + ",\n".join(
            f" {json.dumps(key, ensure_ascii=False)}: {json.dumps(value, ensure_ascii=False)}"
            for key, value in found.items()
        )
        + "\n}"
        for case, found in now.items()
    ]
    text = f'{{"made on": {json.dumps(machine())},\n"figures": {{\n' + ",\n".join(cases) + "\n}}"
    place = kept(group, folder)
    place.with_suffix(".new").write_text(text + "\n", "utf-8")
    place.with_suffix(".new").replace(place)
    return []
