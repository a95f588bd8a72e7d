"""What a lesson is: its entry in the table, its module, and the code that was run for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from ..page import Page


@dataclass(frozen=True)
class Option:
    """An option of a lesson: a flag of the command line, a key of `options`.

    Attributes:
        more: Whether it shows more of the lesson; JSON and documentation show all.
    """

    flag: str
    default: Any
    help: str
    kind: type = str
    choices: tuple[str, ...] | None = None
    many: bool = False
    more: bool = False

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

    @property
    def whole(self) -> dict[str, Any]:
        """The options that show all of it."""
        return {option.key: True for option in self.options if option.more}


@dataclass(frozen=True)
class Session:
    """Code as one types it, for the first of the engines, and what it printed on each."""

    code: str
    printed: Mapping[str, str]


class Module(Protocol):
    """What a lesson's module offers, in the order in which one reads it.

    One whose options depend on the robot also has `fit(model, options)`, which gives them back
    with nothing left open; `code` and `run` are called with these.
    """

    def code(self, model: Any, options: Mapping[str, Any], load: str) -> str:
        """What is typed: the code for this Model; `load` is the call that loads it.

        Raises:
            StateMachineError: The Model has not what the lesson is about, or an option is wrong.
        """
        ...

    def run(self, play: Any, options: Mapping[str, Any], progress: Any) -> Any:
        """What is run: `play` (a `session.CodeRun`) is called once, and is the code's own run.

        What else the lesson compares that run with is run here, too.
        """
        ...

    def page(self, results: Mapping[str, Any], session: Session) -> Page:
        """What is said: the results by backend; `session` is the code and what it printed."""
        ...
