"""The command that asks something of two sides again, to be typed with other options."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...installed import DEFAULT, PAIR
from ...measures.command_lines import folded_command
from ..policy.command import typed_speeds
from .labels import typed_option
from .python_call import python_call
from .sides import Request, Side
from .what import without_folders

_SOME_FOLDER = "DIR"
_EVERY = "--every"


@dataclass(frozen=True)
class TypedCommand:
    """A command of `compare`, without the question that is asked.

    Attributes:
        words: As they are typed, each by itself.
        question: The words that ask what was asked, such as "--why".
        run: What is asked by a call of Python, where it cannot be typed; None where it can.
    """

    words: tuple[str, ...]
    question: tuple[str, ...] = ()
    run: Request | None = None

    def calling_every(self, period: str) -> TypedCommand:
        """Return the same command with another period of the function, such as "5ms"."""
        if self.run is not None:
            return replace(self, run=replace(self.run, every=period))
        words = list(self.words)
        if _EVERY in words:
            place = words.index(_EVERY)
            del words[place : place + 2]
        return replace(self, words=(*words, _EVERY, period))

    def without_option_of_right(self, option: str) -> TypedCommand:
        """Return the same command without an option of the right side, such as "kp=40"."""
        if self.run is not None:
            left, right = self.run.sides
            name = option.partition("=")[0]
            options = {key: value for key, value in right.options.items() if key != name}
            sides = left, replace(right, options=options)
            return replace(self, run=replace(self.run, sides=sides))
        words = list(self.words)
        place = len(words) - 1 - words[::-1].index(option)  # the left may have the same words
        del words[place]
        return replace(self, words=tuple(words))

    def lines(self, *further: str) -> str:
        """Return the command as one types it, as of `folded_command`.

        Args:
            *further: Words that follow: the question, and its options.
        """
        if self.run is not None:
            return python_call(self.run, *further)
        return folded_command((*self.words, *further))


def typed_command(
    run: Request, question: Sequence[str] = (), *, folders: bool = True
) -> TypedCommand:
    """Return the command that runs something on two sides, or opens two traces.

    Args:
        run: What is run.
        question: The words that ask what was asked.
        folders: Whether paths have their folders; on a page that is handed on they have none.
    """
    if not run.is_typed:
        return TypedCommand((), tuple(question), run)
    words = ["statemachine", "compare"]
    if folders:
        words += map(str, run.what)
        words += [run.model] if run.model else []
    else:
        words += run.words
    for side in run.sides:
        words += _words_of_side(side, folders)
    for name, value in run.options.items():
        if name == "timestep":
            words += ["--timestep", f"{value}"]
        else:
            words.append(typed_option(name, value))
    if not run.sides and tuple(run.backends) != PAIR:
        for backend in run.backends:
            words += ["--backend", backend]
    words += _words_of_run(run, folders)
    return TypedCommand(tuple(words), tuple(question))


def _words_of_side(side: Side, folders: bool) -> list[str]:
    """Return a side as one types it; what runs on the usual engine does not name it."""
    backend = str(side.chosen_backend())
    model = side.model if folders else without_folders(side.model)
    if backend != DEFAULT:
        model = f"{model}@{backend}"
    return [model, *(typed_option(name, value) for name, value in side.options.items())]


def _words_of_run(run: Request, folders: bool) -> list[str]:
    """Return the options that say how something is run."""
    words: list[str] = []
    if run.menagerie is not None:
        words += ["--menagerie", str(run.menagerie) if folders else _SOME_FOLDER]
    if run.seconds is not None:
        words += ["--seconds", f"{run.seconds:g}"]
    if run.seed:
        words += ["--seed", str(run.seed)]
    if run.every != 1:
        words += [_EVERY, str(run.every)]
    if run.contract is not None:
        words += ["--contract", run.contract if folders else without_folders(run.contract)]
    if run.command is not None:
        words.append(f"--command={typed_speeds(run.command)}")
    if run.keyframe is not None:
        words += ["--keyframe", run.keyframe]
    for left, right in run.names.items():
        words += ["--map", f"{left}={right}"]
    words += _words_of_parts(run.sides)
    return words


def _words_of_parts(sides: Sequence[Side]) -> list[str]:
    """Return the options by which one side has parts of the other's file."""
    words: list[str] = []
    for side, source in zip(sides, ("right", "left"), strict=False):
        if side.replaced_parts is not None:
            for part in side.replaced_parts.parts:
                words += [f"--{part}", source]
    return words
