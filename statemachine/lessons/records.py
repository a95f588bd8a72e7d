"""What a lesson is: its entry in the table, its module, and the code that was run for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from ..page import Page


@dataclass(frozen=True)
class Option:
    """An option of a lesson: a flag of the command line, a key of `options`."""

    flag: str
    default: Any
    help: str
    kind: type = str
    choices: tuple[str, ...] | None = None
    many: bool = False

    @property
    def key(self) -> str:
        """Its key in `options`."""
        return self.flag.removeprefix("--").replace("-", "_")


@dataclass(frozen=True)
class Lesson:
    """An entry of the table of lessons."""

    name: str
    question: str
    model: str
    options: tuple[Option, ...] = ()
    station: bool = True  # of the path


@dataclass(frozen=True)
class Session:
    """Code as one types it, for the first of the engines, and what it printed on each."""

    code: str
    printed: Mapping[str, str]


class Module(Protocol):
    """What a lesson's module offers."""

    def run(self, model: Any, options: Mapping[str, Any], progress: Any) -> Any:
        """Compute the lesson's result on one backend."""
        ...

    def code(self, options: Mapping[str, Any], load: str) -> str:
        """The code as a student would type it; `load` is the call that loads the model."""
        ...

    def page(self, results: Mapping[str, Any], session: Session) -> Page:
        """Say what the results, by backend, mean; `session` is the code and what it printed."""
        ...
