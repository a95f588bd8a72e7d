"""What the sensors of two compiled models differ in."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ...installed import require
from ..records import Counterparts, DifferingQuantity, Edit, ModelDifference
from ._quantities import word_in
from ._sides import Sides, name_of, zeros

ORDER_OF_SENSORS = "order of sensordata"


def sensors(left: Any, right: Any, pairs: Counterparts) -> list[ModelDifference]:
    """Return the differences of the sensors of two compiled models, which only a controller reads.

    Args:
        left: An mjModel.
        right: Another; its sensors of the same name are the counterparts.
        pairs: What of one is what of the other.
    """
    why = "a sensor is built by the compiler"  # so only a cutoff can be equalized
    rows: list[ModelDifference] = []
    for row in _sensors(Sides(left, right, pairs)):
        able = row.subject in ("cutoff", ORDER_OF_SENSORS)
        able_row = row if able else replace(row, edits=(), edits_one=(), refused=why)
        rows.append(replace(able_row, only_read=True))
    return rows


def _sensors(sides: Sides) -> Iterator[ModelDifference]:
    left, right = sides.left, sides.right
    pairs = list(sides.by_name("sensor"))
    yield from sides.rows("sensor", pairs)
    for a, b in pairs:
        kinds = [
            word_in("mjtSensor", int(raw.sensor_type[k])) for raw, k in ((left, a), (right, b))
        ]
        values = [DifferingQuantity("type", *kinds)] if kinds[0] != kinds[1] else []
        for end in ("obj", "ref"):
            ours, theirs = _object(left, end, a), _object(right, end, b)
            # They may be counterparts, by whatever names.
            there = sides.ids.get(ours[0].removeprefix("x"), {}).get(ours[1])
            if ours[2] != theirs[2] and (ours[0], there) != theirs[:2]:
                values.append(DifferingQuantity(f"{end}id", ours[2], theirs[2]))
        if values:
            yield sides.tell("sensor", "sensor", a, values)
    yield from sides.extras("sensor", pairs, lambda raw, k: zeros(("sensor_cutoff",), raw, k))
    ours = [b for _, b in pairs]
    if ours != sorted(ours):
        orders = _named(right, ours), _named(right, sorted(ours))
        refused = ""
        if not len(ours) == left.nsensor == right.nsensor:
            refused = "one of the sides has other sensors, too, which have places among them"
        yield ModelDifference(
            ORDER_OF_SENSORS,
            "sensor",
            "",
            (DifferingQuantity("order", *orders),),
            edits=() if refused else _reordered_sensors(right, ours),
            refused=refused,
        )


def _named(raw: Any, sensors: Iterable[int]) -> str:
    """Return the names of sensors, in their order."""
    return ", ".join(name_of(raw, "sensor", sensor) for sensor in sensors)


def _reordered_sensors(raw: Any, order: list[int]) -> tuple[Edit, ...]:
    """Return edits that put the sensors of a compiled model in another order.

    Args:
        raw: An mjModel.
        order: Of each place in the new order the id that its sensor has now.
    """
    whole = slice(None)
    edits: list[Edit] = []
    for name in dir(raw):
        array = getattr(raw, name) if name.startswith("sensor_") else None
        if isinstance(array, np.ndarray) and len(array) == raw.nsensor and name != "sensor_adr":
            edits.append((name, (whole,), np.array(array[order])))
    sizes = raw.sensor_dim[order]
    edits.append(("sensor_adr", (whole,), np.cumsum([0, *sizes[:-1]])))
    edits.append(("name_sensoradr", (whole,), np.array(raw.name_sensoradr[order])))
    return (*edits, ("names_map", (whole,), _reordered_names(raw, order)))


def _reordered_names(raw: Any, order: list[int]) -> Any:
    """Return the table (nnames_map,) by which names are looked up, for sensors in another order.

    Its entries are ids of elements of all kinds. Those of sensors are told by that a sensor is not
    found any more when its entry is gone.
    """
    mujoco = require("mujoco")
    kind = int(mujoco.mjtObj.mjOBJ_SENSOR)
    probe, table = copy.copy(raw), np.array(raw.names_map)
    place_of = {now: place for place, now in enumerate(order)}
    for at, entry in enumerate(raw.names_map.tolist()):
        name = raw.sensor(entry).name if 0 <= entry < raw.nsensor else ""
        if name:
            probe.names_map[at] = -1
            if mujoco.mj_name2id(probe, kind, name) != entry:
                table[at] = place_of[entry]
            probe.names_map[at] = entry
    return table


def _object(raw: Any, end: str, k: int) -> tuple[str, int, str]:
    """Return the object of a sensor: its kind, its id, and both in words."""
    mujoco = require("mujoco")
    kind, number = (int(getattr(raw, f"sensor_{end}{part}")[k]) for part in ("type", "id"))
    word = str(mujoco.mju_type2Str(kind) or "")
    named = f"{word} {mujoco.mj_id2name(raw, kind, number) or number}"
    return word, number, named if number >= 0 else "none"
