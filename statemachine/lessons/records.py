"""What a lesson is: its entry in the table, and its options."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


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
    """An entry of the table of lessons; `on_path`: whether the guided path has it."""

    name: str
    question: str
    model: str
    options: tuple[Option, ...] = ()
    on_path: bool = True

    @property
    def whole(self) -> dict[str, Any]:
        """The options that show all of it."""
        return {option.key: True for option in self.options if option.more}
