"""What to ask after a comparison: a command that can be typed."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ...installed import DEFAULT, PAIR
from ...measures import QUANTITIES
from ..compare.instead import Instead
from ..compare.labels import typed_option
from ..compare.sides import Request, Side
from ..runs.scenarios import SCENARIOS
from .compared_names import name_of
from .finding import Finding

PROGRAM = "statemachine"
_WIDTH = 74  # characters of a line of a command, behind its indent
_LINES = 2  # of a command on a first screen
_OTHER = "waves"  # moves whatever has an actuator

# What the command is for: it tells which difference causes the gap; the same until before a run
# ended; which stage of one step differs, which chance cannot hide; it runs something that moves
# more; "nothing": there is no command to type.
Purpose = Literal["why", "why until then", "one step", "move more", "move at all", "nothing"]


@dataclass(frozen=True)
class NextCommand:
    """What to type next.

    Attributes:
        purpose: What it is for.
        words: The command, word by word; empty for none.
        added: Those of its words that the command of this comparison has not.
    """

    purpose: Purpose
    words: tuple[str, ...] = ()
    added: tuple[str, ...] = ()

    @property
    def is_long(self) -> bool:
        """Whether it is of more lines than a first screen has room for."""
        return len(self.lines) > _LINES

    @property
    def lines(self) -> list[str]:
        """The command in lines, as a shell takes it."""
        return wrapped(self.words)

    @property
    def text(self) -> str:
        """The command, in lines."""
        return "\n".join(self.lines)

    @property
    def added_text(self) -> str:
        """What is typed behind the command of this comparison."""
        return shlex.join(self.added)


def wrapped(words: Sequence[str]) -> list[str]:
    """Return a command in lines of at most 74 characters, where no word is longer."""
    lines = [""]
    for word in map(shlex.quote, words):
        if lines[-1] and len(lines[-1]) + 1 + len(word) + 2 > _WIDTH:
            lines[-1] += " \\"
            lines.append(f"  {word}")
        else:
            lines[-1] = f"{lines[-1]} {word}" if lines[-1] else word
    return lines


def next_command(request: Request, finding: Finding, instead: Instead | None) -> NextCommand:
    """Return what to type after a comparison.

    Args:
        request: What was run.
        finding: What came of it.
        instead: What moves the model where nothing moved; None where that was not looked for.
    """
    match finding.outcome:
        case "nothing moved":
            return _moving(request, instead)
        case "ended":
            return _until_then(request, finding)
        case "agrees":
            return _more(request, finding)
    can_step = not request.is_traces or bool(request.sides)
    moves = QUANTITIES[finding.lead.kind].moves
    if can_step and (finding.rounding.verdict in ("as much", "no bound") or not moves):
        return _added(request, "one step", "--one-step")
    if not moves:
        return NextCommand("nothing")
    return _added(request, "why", "--why", "--quantity", name_of(finding.lead.name))


def _moving(request: Request, instead: Instead | None) -> NextCommand:
    """Return an experiment that moves what this one does not."""
    if instead is None or not instead.experiment or request.is_traces:
        return NextCommand("nothing")
    return _instead(request, "move at all", instead.experiment)


def _until_then(request: Request, finding: Finding) -> NextCommand:
    """Return the search for causes until before the first run ended."""
    end = min(early_end.time for early_end in finding.ended)
    seconds = math.floor(900 * end) / 1000
    if request.is_traces or seconds <= 0:
        return NextCommand("nothing")
    shorter = replace(request, seconds=seconds)
    words = (*command_words(shorter), "--why")
    return NextCommand("why until then", words, ("--seconds", f"{seconds}", "--why"))


def _more(request: Request, finding: Finding) -> NextCommand:
    """Return an experiment that moves more, where this is one of ours."""
    what = request.what[0]
    if what not in SCENARIOS or what == _OTHER or finding.open_loop == "differs":
        return NextCommand("nothing")
    return _instead(request, "move more", _OTHER)


def _instead(request: Request, purpose: Purpose, experiment: str) -> NextCommand:
    """Return the command of a comparison with another experiment, for its own time."""
    other = replace(request, what=(experiment,), every=1, seconds=None)
    return NextCommand(purpose, command_words(other))


def _added(request: Request, purpose: Purpose, *added: str) -> NextCommand:
    """Return the command of a comparison with further words."""
    return NextCommand(purpose, (*command_words(request), *added), added)


def command_words(request: Request) -> tuple[str, ...]:
    """Return the command that runs both sides, word by word, as `compare` reads it."""
    words = [PROGRAM, "compare", *map(str, request.what)]
    if request.sides:
        words += _words_of_sides(request)
    else:
        words += _words_without_sides(request)
    for flag, value, usual in (
        ("--menagerie", request.menagerie, None),
        ("--seconds", request.seconds, None),
        ("--seed", request.seed, 0),
        ("--every", request.every, 1),
        ("--keyframe", request.keyframe, None),
    ):
        if value != usual:
            words += [flag, f"{value}"]
    return tuple(words)


def _words_without_sides(request: Request) -> list[str]:
    """Return the model, its options and the backends, those that are not the usual ones."""
    words: list[str] = []
    if request.model:
        words.append(request.model)
    for name, value in request.options.items():
        if name == "timestep":
            words += ["--timestep", f"{value}"]
        else:
            words.append(typed_option(name, value))
    if tuple(request.backends) != PAIR:
        # Of one trace one backend is typed: where it is played.
        backends = request.backends[:1] if request.is_traces else request.backends
        for backend in backends:
            words += ["--backend", backend]
    return words


def _words_of_sides(request: Request) -> list[str]:
    """Return both sides, which of their names are one, and which parts one has of the other."""
    words: list[str] = []
    for side in request.sides:
        words += _words_of_side(side)
    for name, value in request.options.items():
        if name == "timestep":
            words += ["--timestep", f"{value}"]
    for left, right in request.names.items():
        words += ["--map", f"{left}={right}"]
    for side, giver in zip(request.sides, ("right", "left"), strict=True):
        parts = () if side.taken is None else side.taken.parts
        for part in parts:
            words += [f"--{part}", giver]
    return words


def _words_of_side(side: Side) -> list[str]:
    """Return a side as it is typed."""
    backend = str(side.chosen_backend())
    model = side.model if backend == DEFAULT else f"{side.model}@{backend}"
    return [model, *(typed_option(name, value) for name, value in side.options.items())]
