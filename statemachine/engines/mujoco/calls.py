"""What the recorder must know of MuJoCo: an MjData and an MjModel show all that is in them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...backends import mujoco_backend
from ...interface import DERIVED, INPUTS, Data, Model
from ..call_watch import CallWatch, CallWords, Contents, WatchedObject, entries, named_values

_OURS = ("time", *INPUTS, *DERIVED)
# What comes before the rest in a list of what changed.
_FIRST = (*_OURS, "contact", "ncon", "act", "sensordata", "qacc_warmstart", "xmat", "geom_xpos")
# How MuJoCo manages its memory, and clocks: no part of any result.
_LEFT_OUT = {"narena", "nbuffer", "parena", "pbase", "pstack", "signature", "threadpool", "timer"}
_CONTACT = ("dist", "pos", "frame", "geom")
_LARGE = 1 << 16  # bytes


class _Object(WatchedObject):
    """An MjData or MjModel.

    Attributes:
        raw: Whether the variable that leads here is the engine's own object.
    """

    raw = False

    def spelled(self, field: str) -> str:
        ours = field.partition("[")[0] in _OURS and isinstance(self, _MjData)
        return f"{self.title}.{field}" if ours or self.raw else f"{self.title}.raw.{field}"


class _MjData(_Object):
    _fields: tuple[str, ...] = ()

    def contents(self, thoroughly: bool) -> Contents:
        data = self.thing
        _MjData._fields = _MjData._fields or _fields(data)
        contents = {name: _bytes(getattr(data, name)) for name in _MjData._fields}
        contacts = data.contact
        contents["contact"] = b"".join(getattr(contacts, part).tobytes() for part in _CONTACT)
        return contents

    def entry(self, field: str, before: bytes, after: bytes) -> str:
        value = getattr(self.thing, field)
        flat = isinstance(value, np.ndarray) and value.ndim == 1
        return entries(field, before, after, value.itemsize) if flat else field


class _MjModel(_Object):
    def __init__(self, kind: str, thing: Any) -> None:
        super().__init__(kind, thing)
        self._sizes = {
            name: value.nbytes
            for name in dir(type(thing))
            if isinstance(value := getattr(thing, name), np.ndarray)
        }
        self._options = [name for name in dir(thing.opt) if not name.startswith("_")]

    def contents(self, thoroughly: bool) -> Contents:
        model, options = self.thing, self.thing.opt
        contents = {f"opt.{name}": _bytes(getattr(options, name)) for name in self._options}
        for name, size in self._sizes.items():
            if thoroughly or size <= _LARGE:
                contents[name] = getattr(model, name).tobytes()
        return contents


def _bytes(value: Any) -> bytes:
    return np.asarray(value).tobytes()


def _fields(data: Any) -> tuple[str, ...]:
    """Return the names of the numbers and arrays of an MjData, those of the interface first."""
    names = [
        name
        for name in dir(type(data))
        if not name.startswith(("_", "maxuse_"))
        and name not in _LEFT_OUT
        and isinstance(getattr(data, name), (np.ndarray, int, float))
    ]
    order = [name for name in _FIRST if name in names]
    return (*order, *(name for name in names if name not in order))


class MujocoWatch(CallWatch):
    """A watch on MuJoCo."""

    words = CallWords(
        shown="the arrays, counts and options of MjData and MjModel",
        step="mj_step",
    )

    def __init__(self) -> None:
        self.module = mujoco_backend.mujoco
        self._kinds = self.module.MjModel, self.module.MjData
        self._known: dict[int, _Object] = {}

    def functions(self) -> Iterator[tuple[Any, str, str]]:
        yield from super().functions()
        for owner in (self.module.MjModel, self.module.MjData, self.module.MjSpec):
            for name, value in vars(owner).items():
                public = not name.startswith("_") or name in _SPECIAL
                if public and type(value).__name__ in _METHODS:
                    method = f"{owner.__name__}.{name}"
                    yield owner, name, method.removesuffix(".__init__")

    def concerned(self, function: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        if function in ("MjModel", "MjData", "MjSpec"):  # the first is not an object yet
            args = args[1:]
        things = (thing for thing in (*args, *kwargs.values()) if isinstance(thing, self._kinds))
        objects = [self._watched(thing) for thing in things]
        return sorted(objects, key=lambda watched: isinstance(watched, _MjModel))

    def created(self, function: str, args: Sequence[Any], result: Any) -> WatchedObject | None:
        thing = args[0] if function in ("MjModel", "MjData") else result
        return self._watched(thing) if isinstance(thing, self._kinds) else None

    def _watched(self, thing: Any) -> _Object:
        known = self._known.get(id(thing))
        if known is None or known.thing is not thing:
            kind = _MjModel if isinstance(thing, self.module.MjModel) else _MjData
            known = self._known[id(thing)] = kind(f"an {type(thing).__name__}", thing)
        return known

    def name(self, namespace: Mapping[str, Any]) -> None:
        for label, value in named_values(namespace):
            leads = [(label, value, True)]
            if isinstance(value, (Model, Data)):
                model = value if isinstance(value, Model) else value.model
                where = label if model is value else f"{label}.model"
                leads = [
                    (where, model.raw, False),
                    (f"the description of {where}", model.compiled, True),
                ]
            if isinstance(value, Data):  # of a closed one there is none
                leads.append((label, getattr(value, "_raw", None), False))
            for text, thing, raw in leads:
                if isinstance(thing, self._kinds):
                    watched = self._watched(thing)
                    watched.raw = watched.raw if watched.named else raw
                    watched.note_variable(text)

    def live_objects(self) -> Sequence[WatchedObject]:
        self._known = {key: known for key, known in self._known.items() if known.thing is not None}
        return list(self._known.values())


_METHODS = ("instancemethod", "staticmethod", "function")
_SPECIAL = ("__init__", "__copy__", "__deepcopy__")
