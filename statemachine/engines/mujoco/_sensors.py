"""Sensors of two compiled models, on which nothing depends but a controller that reads them."""

from __future__ import annotations

from typing import Any

from ...installed import require
from ..records import Counterparts, Edit, ModelDifference
from ._element_pairs import ElementPairs
from ._figures import plain, same

_SET = ("sensor_cutoff",)  # what can be written into a compiled model
_BUILT = ("sensor_intprm", "sensor_delay", "sensor_interval", "sensor_history")
_OBJECTS = (("sensor_objtype", "sensor_objid"), ("sensor_reftype", "sensor_refid"))
_NOT = "a sensor is built by the compiler"


def sensors(one: Any, two: Any, pairs: Counterparts) -> list[ModelDifference]:
    """What the sensors of two compiled models differ in.

    Args:
        one: An mjModel.
        two: Another; its sensors of the same name are the counterparts.
        pairs: What of one is what of the other.
    """
    return _Sensors(one, two, pairs, ()).found()


class _Sensors(ElementPairs):
    """Sensors of two models, pair by pair."""

    def found(self) -> list[ModelDifference]:
        """All that differs."""
        raws = self._one, self._two
        ours, theirs = ({_name(raw, k): k for k in range(raw.nsensor)} for raw in raws)
        found = []
        for name, k in ours.items():
            if name in theirs:
                found += self._of_one(name, k, theirs[name])
            else:
                found.append(_extra(name, (name, None)))
        found += [_extra(name, (None, name)) for name in theirs if name not in ours]
        both = [
            [name for name in names if name in ours and name in theirs] for names in (ours, theirs)
        ]
        if both[0] != both[1]:
            values = (("order", ", ".join(both[0]), ", ".join(both[1])),)
            found.append(ModelDifference("order of sensordata", "sensor", "", values, refused=_NOT))
        return found

    def _of_one(self, name: str, a: int, b: int) -> list[ModelDifference]:
        one, two = self._one, self._two
        values: list[tuple[str, Any, Any]] = []
        kinds = _kind(one, a), _kind(two, b)
        if kinds[0] != kinds[1]:
            values.append(("type", kinds[0], kinds[1]))
        for types, ids in _OBJECTS:
            here, there = _object(one, types, ids, a), _object(two, types, ids, b)
            if not self._is_same(types, ids, a, b) and here != there:
                values.append((ids.removeprefix("sensor_"), here, there))
        values += _differing(one, two, _BUILT, a, b)
        found = []
        if values:
            found.append(ModelDifference("sensor", "sensor", name, tuple(values), refused=_NOT))
        written = _differing(one, two, _SET, a, b)
        if written:
            edits: tuple[Edit, ...] = tuple((field, (b,), getattr(one, field)[a]) for field in _SET)
            found.append(ModelDifference("cutoff", "sensor", name, tuple(written), edits=edits))
        return found

    def _is_same(self, types: str, ids: str, a: int, b: int) -> bool:
        """Whether what two sensors are of are counterparts, by whatever names."""
        kinds = [int(getattr(raw, types)[k]) for raw, k in ((self._one, a), (self._two, b))]
        objects = [int(getattr(raw, ids)[k]) for raw, k in ((self._one, a), (self._two, b))]
        kind = str(require("mujoco").mju_type2Str(kinds[0]) or "").removeprefix("x")
        known = self._ids.get(kind, {})
        return kinds[0] == kinds[1] and known.get(objects[0]) == objects[1]


def _differing(
    one: Any, two: Any, fields: tuple[str, ...], a: int, b: int
) -> list[tuple[str, Any, Any]]:
    pairs = [(name, getattr(one, name)[a], getattr(two, name)[b]) for name in fields]
    return [
        (name.removeprefix("sensor_"), plain(x), plain(y)) for name, x, y in pairs if not same(x, y)
    ]


def _kind(raw: Any, k: int) -> str:
    return require("mujoco").mjtSensor(int(raw.sensor_type[k])).name


def _name(raw: Any, k: int) -> str:
    return raw.sensor(k).name or f"sensor {k}"


def _object(raw: Any, types: str, ids: str, k: int) -> str:
    """What a sensor is of, as its kind and its name."""
    mujoco = require("mujoco")
    kind, number = int(getattr(raw, types)[k]), int(getattr(raw, ids)[k])
    if number < 0:
        return "none"
    word = mujoco.mju_type2Str(kind)
    return f"{word} {mujoco.mj_id2name(raw, kind, number) or number}"


def _extra(name: str, there: tuple[str | None, str | None]) -> ModelDifference:
    values = (("sensor", *there),)
    return ModelDifference("extra sensor", "sensor", name, values, refused=_NOT)
