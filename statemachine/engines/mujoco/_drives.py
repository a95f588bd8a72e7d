"""What the actuators and sensors of two compiled models differ in."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ...backends.controls import ctrl_owners
from ...installed import require
from ..records import Counterparts, DifferingQuantity, Edit, ModelDifference
from ._sides import Sides, name_of, plain, quantity_of, same, word_in, zeros

ORDER_OF_SENSORS = "order of sensordata"
# mjtTrn: what an actuator acts on, and from which site it measures.
_DRIVES = {
    0: ("joint",),
    1: ("joint",),
    2: ("site", "site"),
    3: ("tendon",),
    4: ("site", "site"),
    5: ("body",),
}
_SO3 = 6  # mjtTrn: of a ball joint, or of a site in the frame of another
# Where the law of an actuator's own state is another, these are one thing with it.
_OF_A_LAW = ("gains", "dynamics", "range of its activation", "length range")
_STILL = (
    *("actuator_gaintype", "actuator_gainprm", "actuator_biastype", "actuator_biasprm"),
    *("actuator_armature", "actuator_damping"),
)


def drives(sides: Sides) -> Iterator[ModelDifference]:
    """Actuators, by their gains, ranges, laws and what they drive."""
    left, right = sides.raws
    owners = ctrl_owners(left), ctrl_owners(right)
    places = sides.pairs.actuators
    actuators = sorted({(int(owners[0][a]), int(owners[1][b])) for a, b in places})
    for a, b in actuators:
        yield from _laws(sides, a, b)
        yield from _delay(sides, a, b)
        targets = [_targets(sides, side, k) for side, k in enumerate((a, b))]
        if targets[0][0] != targets[1][0]:
            values = (DifferingQuantity("drives", *(words for _, words in targets)),)
            yield sides.tell(
                "transmission",
                "actuator",
                a,
                values,
                refused="it drives another thing, or in another way",
            )
    if left.opt.disableactuator or right.opt.disableactuator:
        yield from sides.rows("actuator", actuators, "group")
    for a, b in places:
        name = name_of(left, "actuator", int(owners[0][a]))
        yield from sides.rows("actuator", [(a, b)], "control", name)
    yield from sides.extras("actuator", actuators, lambda raw, k: zeros(_STILL, raw, k))


def _laws(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """Rows of an actuator; together, where its own state moves by another law."""
    laws = _law(sides.left, a), _law(sides.right, b)
    sized = laws[0][1:] == laws[1][1:]
    rows = list(sides.rows("actuator", [(a, b)]))
    values = (quantity_of("actuator_dyntype", laws[0][0], laws[1][0]),)
    if not sized:
        why = "its own state has another size"
        rows = [row for row in rows if row.subject != "dynamics"]
        rows.append(sides.tell("law of its state", "actuator", a, values, refused=why))
    elif laws[0] != laws[1]:
        of_law = [row for row in rows if row.subject in _OF_A_LAW]
        edits: list[Edit] = [("actuator_dyntype", (b,), laws[0][0])]
        edits += [edit for row in of_law for edit in row.edits]
        values += tuple(value for row in of_law for value in row.values)
        yield sides.tell("law", "actuator", a, values, edits)
        rows = [row for row in rows if row not in of_law]
    yield from rows


def _law(raw: Any, k: int) -> tuple[int, ...]:
    """How an actuator's own state moves, how long it is, and which numbers of ctrl it takes."""
    number = int(raw.actuator_ctrlnum[k])
    spec = int(raw.actuator_ctrlspec[k]) if number > 1 else 0  # of one it follows from the gains
    return int(raw.actuator_dyntype[k]), int(raw.actuator_actnum[k]), number, spec


def _delay(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """A delay needs a memory of commands: without one it is taken away from the other."""
    left, right = sides.raws
    sizes = left.actuator_history[a], right.actuator_history[b]
    back = bool(sizes[0][0] and not sizes[1][0])
    yield from sides.rows("actuator", [(a, b)], "delay", back=back)
    if left.actuator_delay[a] and right.actuator_delay[b] and not same(*sizes):
        values = (DifferingQuantity("history", plain(sizes[0]), plain(sizes[1])),)
        yield sides.tell(
            "memory of commands",
            "actuator",
            a,
            values,
            refused="it keeps another number of commands, or reads between them in another way",
        )


def _targets(sides: Sides, side: int, k: int) -> tuple[tuple[int, ...], str]:
    """What an actuator acts on and from which site it measures: ids of the second model, words."""
    raw = sides.raws[side]
    kind, ids = int(raw.actuator_trntype[k]), raw.actuator_trnid[k].tolist()
    if kind == _SO3:
        kinds = ("joint",) if ids[1] < 0 else ("site", "site")
    else:
        kinds = _DRIVES.get(kind, ())
    targets = list(zip(kinds, ids, strict=False))
    names = [name_of(raw, target, i) for target, i in targets if i >= 0]
    word = word_in("mjtTrn", kind)
    ids[: len(targets)] = [sides.there(side, target, i) for target, i in targets]
    return (kind, *ids), f"{word} {', '.join(names)}"


def sensors(left: Any, right: Any, pairs: Counterparts) -> list[ModelDifference]:
    """What the sensors of two compiled models differ in, on which nothing but a controller depends.

    Args:
        left: An mjModel.
        right: Another; its sensors of the same name are the counterparts.
        pairs: What of one is what of the other.
    """
    why = "a sensor is built by the compiler"  # so only a cutoff can be brought over
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
    """What a sensor is of: its kind, its id, and both in words."""
    mujoco = require("mujoco")
    kind, number = (int(getattr(raw, f"sensor_{end}{part}")[k]) for part in ("type", "id"))
    word = str(mujoco.mju_type2Str(kind) or "")
    named = f"{word} {mujoco.mj_id2name(raw, kind, number) or number}"
    return word, number, named if number >= 0 else "none"
