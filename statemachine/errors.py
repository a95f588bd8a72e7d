"""Every deliberate error of the library.

Each says in one sentence what happened, what was expected and what to type,
is also the builtin that fits, and carries its facts as attributes. All of them
survive a pickle, so that they can cross a process boundary.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable
from typing import Any

_LONGEST = 2000  # characters of a message


def cut(message: str) -> str:
    """Return a message, without its middle where names in a file made it too long to be read."""
    if len(message) <= _LONGEST:
        return message
    half = (_LONGEST - 5) // 2
    return f"{message[:half]} […] {message[-half:]}"


class StateMachineError(Exception):
    """Base of every error that this library raises on purpose."""

    def __init__(self, message: str, **facts: Any) -> None:
        super().__init__(cut(message))
        # BaseException pickles (class, args, __dict__): facts travel with it.
        self.__dict__.update(facts)

    def __str__(self) -> str:  # KeyError would print the repr of the message
        return str(self.args[0])


class UnknownNameError(StateMachineError, KeyError):
    """No backend, model, joint, keyframe … has this name or number."""

    kind: str
    name: object
    known: tuple[str, ...]


class MissingEngineError(StateMachineError, ImportError):
    """An engine is not installed here, or is installed and does not load."""

    engine: str


class ModelFileError(StateMachineError, FileNotFoundError):
    """A model's file is not there, or is not a file."""


class ModelError(StateMachineError, ValueError):
    """A model's file is there, and an engine cannot make a Model of it."""


class BadInputError(StateMachineError, ValueError):
    """A value has the wrong shape, kind or size, or is not finite."""


class EndedEarlyError(BadInputError, ArithmeticError):
    """A run ended before its time, and what was asked for needs all of it."""

    ended: str


class ForeignDataError(StateMachineError, ValueError):
    """A Data was handed to a Model that did not make it."""


class ForeignStateError(StateMachineError, ValueError):
    """A State has another layout than the Data it is to be put into."""


class ClosedDataError(StateMachineError, RuntimeError):
    """A Data was used after `close`."""


class BusyDataError(StateMachineError, RuntimeError):
    """A Data was used while another thread was using it."""


class DivergedError(StateMachineError, ArithmeticError):
    """A coordinate stopped being finite while the engine stepped.

    `index` is None where the engine did not tell which entry was the first.
    """

    time: float
    quantity: str
    index: int | None


class TimedOutError(StateMachineError, TimeoutError):
    """A run took longer than it was given."""


class WorkerEndedError(StateMachineError, RuntimeError):
    """The process that ran something ended before it was done."""


class EngineError(StateMachineError, RuntimeError):
    """An engine gave up in the middle of a step; the Data is of no use any more."""


class UnsupportedError(StateMachineError, NotImplementedError):
    """A backend cannot do what was asked, and says so.

    `features` has every one that a model was refused for; `feature` is the first.
    """

    backend: str
    feature: str
    reason: str
    features: tuple[str, ...] = ()


class TraceError(StateMachineError, ValueError):
    """A file is not a trace, or a trace does not fit what is asked of it."""


class ReadOnlyError(StateMachineError, AttributeError):
    """Something derived or constant was assigned to, or an input was made read-only."""


class StaleReadError(StateMachineError, RuntimeError):
    """Something derived was read that is not of now, where that was to be an error."""

    name: str
    steps: int | None
    writes: int | None
    gaps: tuple[Any, ...]


class EngineWarning(UserWarning):
    """A warning that an engine gave, brought up into Python."""

    def __init__(self, message: str) -> None:
        super().__init__(cut(message))


class DivergedWarning(UserWarning):
    """Some of many worlds diverged and are left out from now on."""


def check_name(kind: str, name: object, known: Iterable[str]) -> None:
    """Raise UnknownNameError for a name that is not known."""
    if not isinstance(name, str) or name not in known:
        raise unknown_name(kind, name, known)


def one_line(words: object) -> str:
    """Return a text in one line."""
    return " ".join(str(words).split())


def printable(words: object) -> str:
    """Return words in one line, with nothing in it that a terminal would do instead of show.

    A name in them may come from a file that somebody else made.
    """
    return "".join(c if c.isprintable() else "?" for c in one_line(words))


def shown(value: object) -> str:
    """Return a value as it is shown on one line of a message."""
    text = " ".join("".join(c if c.isprintable() else " " for c in repr(value)).split())
    return text if len(text) <= 200 else f"{text[:197]}..."


def did_you_mean(
    name: object, known: Iterable[str], cutoff: float = 0.5, show: Callable[[str], str] = str
) -> str:
    """Return the end of a message about a mistyped name: the nearest known one, or nothing."""
    close = difflib.get_close_matches(name if isinstance(name, str) else "", known, 1, cutoff)
    return f". Did you mean {show(close[0])}?" if close else ""


def unknown_name(kind: str, name: object, known: Iterable[str]) -> UnknownNameError:
    """Return the error for a mistyped name: the known ones, and the nearest spelling."""
    names = tuple(known)
    listed = ", ".join(names) if names else "none"
    hint = did_you_mean(name, names, show=repr)
    message = f"no {kind} named {shown(name)}; known: {listed}{hint}"
    return UnknownNameError(message, kind=kind, name=name, known=names)
