"""What a room knows of its engine's calls: its functions, and what calls change.

`probes.calls` replaces the functions by ones that count and look. A `CallWatch` imports the
engine's backend: what that takes from the engine must be the engine's own, and not a wrapper that
nobody takes away again.
"""

from __future__ import annotations

import dataclasses
import types
import weakref
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..interface import Model

_FUNCTIONS = (types.BuiltinFunctionType, types.FunctionType)
Contents = dict[str, bytes]  # all that is in something, by name
# What stands in a list of what changed for something that was not there before, or is no more.
NEW, CLOSED = "new", "closed"


@dataclass(frozen=True)
class CallWords:
    """What a page says of the calls of an engine.

    Attributes:
        shown: What is looked at before and after each call.
        step: How the names of the functions that step begin.
        note: What else a reader should know; "" for nothing.
        roles: What it says of a world of our own, by the words that are in its label; "{}" is
            how often it was stepped.
        helpers: Other engines that a backend calls too, each with a sentence; "{}" is how
            often their own step was called.
    """

    shown: str
    step: str
    note: str = ""
    roles: Mapping[str, str] = dataclasses.field(default_factory=dict)
    helpers: Mapping[str, str] = dataclasses.field(default_factory=dict)


class WatchedObject(ABC):
    """Something that calls can change: an object, held weakly so that it lives no longer.

    Attributes:
        kind: What it is, for one that has no label.
        label: How it is called for a reader; empty until a variable leads to it.
        named: Whether a variable of the code leads to it.
    """

    def __init__(self, kind: str, thing: Any) -> None:
        self.kind, self.label, self.named = kind, "", False
        self._seen: Contents | None = None
        self._reference = weakref.ref(thing)

    @property
    def thing(self) -> Any:
        """Return the object; None if it no longer exists."""
        return self._reference()

    @property
    def is_gone(self) -> bool:
        """Tell whether the object no longer exists."""
        return self.thing is None

    def note_variable(self, label: str) -> None:
        """Note that a variable leads here; the first that does gives the label."""
        if not self.named:
            self.label, self.named = label, True

    @property
    def title(self) -> str:
        """Return the object's label, or its kind where no variable ever led to it."""
        return (
            self.label
            or f"{self.kind} {'that is gone again' if self.is_gone else 'without a name'}"
        )

    def look_again(self, thoroughly: bool = False) -> dict[str, str]:
        """Return what differs from the last look: fields, and which of their entries; `CLOSED`
        if gone.
        """
        if self.is_gone:
            return {CLOSED: CLOSED}
        before, now = self._seen, self.contents(thoroughly)
        self._seen = {**(before or {}), **now}
        changed = [] if before is None else self.differing(before, now)
        return {
            name: self.entry(name, (before or {}).get(name, b""), now[name]) for name in changed
        }

    @abstractmethod
    def contents(self, thoroughly: bool) -> Contents:
        """Return the contents of an existing object; large ones only if the look is to be
        thorough.
        """

    @abstractmethod
    def spelled(self, field: str) -> str:
        """Return a field as code would spell it."""

    def differing(self, before: Contents, now: Contents) -> list[str]:
        """Return the fields of both looks that differ."""
        return [field for field, value in now.items() if before.get(field, value) != value]

    def is_outdated(self) -> bool:
        """Tell whether all derived values became outdated since this was last asked."""
        return False

    def entry(self, field: str, before: bytes, after: bytes) -> str:
        """Return a field, or which entries of it differ."""
        return field


class CallWatch(ABC):
    """What the recorder must know of an engine.

    Attributes:
        words: What a page says of its calls.
        module: The engine.
    """

    words: CallWords
    module: Any

    def functions(self) -> Iterator[tuple[Any, str, str]]:
        """Yield the owner and attribute of every function to be replaced, and its name for a
        reader.
        """
        for name, value in vars(self.module).items():
            if isinstance(value, _FUNCTIONS) and not name.startswith("_"):
                yield self.module, name, name

    @abstractmethod
    def concerned(self, function: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        """Return the objects that a call is about, the foremost first; None where it concerns
        none of ours.
        """

    @abstractmethod
    def created(self, function: str, args: Sequence[Any], result: Any) -> WatchedObject | None:
        """Return the object that a call has made."""

    @abstractmethod
    def name(self, namespace: Mapping[str, Any]) -> None:
        """Label the objects that variables lead to, where nothing led to one before."""

    @abstractmethod
    def live_objects(self) -> Sequence[WatchedObject]:
        """Return the objects that still exist."""


def entries(field: str, before: bytes, after: bytes, size: int) -> str:
    """Return which entries of a flat array of items of a size differ: "qpos[1]", "ctrl[0:2]"."""
    if len(before) != len(after):
        return field
    was, now = (np.frombuffer(contents, np.uint8).reshape(-1, size) for contents in (before, after))
    differ = np.flatnonzero((was != now).any(axis=1)).tolist()
    first, end = differ[0], differ[-1] + 1
    if len(differ) == len(now) or len(differ) != end - first:
        return field
    return f"{field}[{first}]" if end == first + 1 else f"{field}[{first}:{end}]"


def named_values(namespace: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Yield the names and values, Models first; what is in a list, tuple or dict too."""
    variables: list[tuple[str, Any]] = []
    for name, value in namespace.items():
        if not name.startswith("__"):
            items = dict(enumerate(value)) if isinstance(value, (list, tuple)) else value
            inside = items.items() if isinstance(items, dict) else ()
            variables += [(name, value), *((f"{name}[{key!r}]", item) for key, item in inside)]
    return sorted(variables, key=lambda pair: not isinstance(pair[1], Model))
