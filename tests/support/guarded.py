"""A guard of a student's process that is asked here, and hears nothing of this process."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from statemachine.course.grading.inside.guard import Guard

Event = Callable[[str, tuple[Any, ...]], None]


class Guarded:
    """A guard, and what it told.

    Attributes:
        file: The student's.
        folder: In which it lies.
        work: The folder in which its process may write.
        other: A folder that is neither.
        event: Tells the guard of an audit event, as Python would.
        told: The kinds and texts that it reported.
    """

    def __init__(
        self, patch: pytest.MonkeyPatch, root: Path, *, alone: bool = False, faults: bool = False
    ) -> None:
        root = root.resolve()
        self.folder, self.work, self.other = root / "mine", root / "work", root / "mine-too"
        for folder in (self.folder, self.work, self.other):
            folder.mkdir()
        self.file = self.folder / "answer.py"
        self.file.touch()
        self.told: list[tuple[str, str]] = []
        self._patch = patch
        hooks: list[Event] = []
        keep_starts_of_programs(patch)
        patch.setattr(sys, "addaudithook", hooks.append)
        Guard(
            self.file,
            self.folder,
            self.work,
            lambda kind, text: self.told.append((kind, text)),
            is_only_guard=alone,
            faults=faults,
        )
        [self.event] = hooks

    @property
    def read(self) -> list[str]:
        """Return the files of which it told that they are read."""
        return [text for kind, text in self.told if kind == "reads"]

    @property
    def forbidden(self) -> list[str]:
        """Return what it told as forbidden."""
        return [text for kind, text in self.told if kind == "forbidden"]

    def by_student(self, event: str, *arguments: object, line: int = 1) -> None:
        """Tell the guard of an event that a line of the student's file is the reason of."""
        self.run("event(name, arguments)", event, arguments, "\n" * (line - 1))

    def run(self, code: str, event: str, arguments: tuple[object, ...], before: str = "") -> None:
        """Run code as the student's, in which `event`, `name` and `arguments` are known."""
        names = {"__name__": "answer", "event": self.event, "name": event, "arguments": arguments}
        exec(compile(before + code, str(self.file), "exec"), names)

    def by_file(self, file: Path, event: str, *arguments: object, genuine: bool = True) -> None:
        """Tell the guard of an event of another file's code, of a module that is there or not."""
        module = ModuleType("somebody")
        if genuine:
            self._patch.setitem(sys.modules, "somebody", module)
        names = vars(module)
        names |= {"event": self.event, "name": event, "arguments": arguments}
        exec(compile("event(name, arguments)", str(file), "exec"), names)


def keep_starts_of_programs(patch: pytest.MonkeyPatch) -> None:
    """Give back at the end of a test the functions that a guard replaces."""
    import _posixsubprocess

    for module in (_posixsubprocess, subprocess):
        for name in ("fork_exec", "_fork_exec"):
            if hasattr(module, name):
                patch.setattr(module, name, getattr(module, name))
