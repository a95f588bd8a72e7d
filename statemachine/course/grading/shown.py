"""What a student's process is shown of this machine: Python, this package less what knows answers.

Of the package it is shown the rooms that its public interface stands on (`PUBLIC`) and, of
`grading`, what runs in that process. No lesson, no judge, no report, and nothing beside the package
but its models: neither the course's solutions nor what others handed in.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from ...backends import backend_module
from ...engines import raw_engine_of
from ...installed import DEFAULT, ENGINES
from ...models import models_dir
from ...processes.places import View, python_view
from .inside.guard import ROOMS

_PACKAGE = Path(__file__).resolve().parents[2]
_INSIDE = ("__init__.py", "inside")  # of `grading`
_FOR_TESTS = ("pytest", "_pytest", "pluggy", "iniconfig", "packaging", "pygments")
_FAULTS = "faults"  # of `grading`: what puts a fault into an arm, for tests


@cache
def _of_machine(backend: str, _python_path: str | None) -> View:
    """Return what every process on a backend is shown; it is the same for all of a class."""
    rooms = [_PACKAGE / "__init__.py"]
    compiled = _PACKAGE / "__pycache__"
    rooms += compiled.glob("__init__.*.pyc")
    for name in ROOMS:
        rooms += compiled.glob(f"{name}.*.pyc")
        rooms += [place for place in (_PACKAGE / name, _PACKAGE / f"{name}.py") if place.exists()]
    course = _PACKAGE / "course"
    rooms += [course / "__init__.py", *(course / "grading" / name for name in _INSIDE)]
    return python_view(modules_of(backend)).with_more([*rooms, models_dir()])


def modules_of(backend: str) -> tuple[str, ...]:
    """Return the modules without which nothing runs on a backend, wherever they are installed."""
    names = ["numpy", ENGINES[DEFAULT].module]
    if backend in ENGINES:
        names.append(ENGINES[backend].module)
    for module in (backend_module(backend), type(raw_engine_of(backend)).__module__):
        package = module.partition(".")[0]
        if package != _PACKAGE.name:  # of which `_of_machine` says what is shown
            names.append(package)
    return (*names, *_FOR_TESTS)


def view_of(backend: str, student_folders: Iterable[Path], faults: bool = False) -> View:
    """Return what a student's process on a backend is shown.

    Args:
        backend: On which it runs.
        student_folders: Folders of what the student handed in, and of nobody else's.
        faults: Whether it runs tests on arms with faults, and so needs what makes these.
    """
    more = [_PACKAGE / "course" / "grading" / _FAULTS] if faults else []
    machine = _of_machine(backend, os.environ.get("PYTHONPATH"))
    return machine.with_more([*student_folders, *more])
