"""What the actuators and sensors of two compiled models differ in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ...installed import require
from ..records import Counterparts, Edit, ModelDifference
from . import _fields as fields
from ._sides import Sides, name_of, plain, same, zeros

# mjtTrn: what an actuator acts on, and from which site it measures.
_DRIVES = {
    0: ("joint",),
    1: ("joint",),
    2: ("site", "site"),
    3: ("tendon",),
    4: ("site", "site"),
    5: ("body",),
}
# Where the law of an actuator's own state is another, these are one thing with it.
_OF_A_LAW = ("gains", "dynamics", "range of its activation", "length range")
_STILL = (
    *("actuator_gaintype", "actuator_gainprm", "actuator_biastype", "actuator_biasprm"),
    *("actuator_armature", "actuator_damping"),
)
_OBJECTS = (("sensor_objtype", "sensor_objid"), ("sensor_reftype", "sensor_refid"))


def drives(sides: Sides) -> Iterator[ModelDifference]:
    """Actuators, by their gains, ranges, laws and what they drive."""
    left, right = sides.left, sides.right
    owners = [np.repeat(np.arange(raw.nactuator), raw.actuator_ctrlnum) for raw in (left, right)]
    places = sides.pairs.actuators
    actuators = sorted({(int(owners[0][a]), int(owners[1][b])) for a, b in places})
    for a, b in actuators:
        yield from _laws(sides, a, b)
        yield from _delay(sides, a, b)
        targets = [_targets(sides, side, k) for side, k in enumerate((a, b))]
        if targets[0] != targets[1]:
            values = (("drives", _words(left, a), _words(right, b)),)
            why = "it drives another thing, or in another way"
            yield sides.tell("transmission", "actuator", a, values, refused=why)
    if left.opt.disableactuator or right.opt.disableactuator:
        yield from sides.rows("actuator", fields.GROUP, actuators)
    for a, b in places:
        name = name_of(left, "actuator", int(owners[0][a]))
        yield from sides.rows("actuator", fields.CONTROL, [(a, b)], name)
    yield from sides.extras("actuator", actuators, lambda raw, k: zeros(_STILL, raw, k))


def _laws(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """Rows of an actuator; together, where its own state moves by another law."""
    laws = _law(sides.left, a), _law(sides.right, b)
    sized = laws[0][1:] == laws[1][1:]
    rows = [row for row in fields.ACTUATOR if sized or row.when != "actuator_dyntype"]
    found = list(sides.rows("actuator", rows, [(a, b)]))
    values = (("dyntype", laws[0][0], laws[1][0]),)
    if not sized:
        why = "its own state has another size"
        found.append(sides.tell("law of its state", "actuator", a, values, refused=why))
    elif laws[0] != laws[1]:
        of_law = [each for each in found if each.subject in _OF_A_LAW]
        edits: list[Edit] = [("actuator_dyntype", (b,), laws[0][0])]
        edits += [edit for each in of_law for edit in each.edits]
        values += tuple(value for each in of_law for value in each.values)
        yield sides.tell("law", "actuator", a, values, "", edits)
        found = [each for each in found if each not in of_law]
    yield from found


def _law(raw: Any, k: int) -> tuple[int, ...]:
    """How an actuator's own state moves, how long it is, and which numbers of ctrl it takes."""
    number = int(raw.actuator_ctrlnum[k])
    spec = int(raw.actuator_ctrlspec[k]) if number > 1 else 0  # of one it follows from the gains
    return int(raw.actuator_dyntype[k]), int(raw.actuator_actnum[k]), number, spec


def _delay(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """A delay needs a memory of commands: without one it is taken away from the other."""
    left, right = sides.left, sides.right
    sizes = left.actuator_history[a], right.actuator_history[b]
    back = bool(sizes[0][0] and not sizes[1][0])
    yield from sides.rows("actuator", fields.DELAY, [(a, b)], back=back)
    if left.actuator_delay[a] and right.actuator_delay[b] and not same(*sizes):
        values = (("history", plain(sizes[0]), plain(sizes[1])),)
        why = "it keeps another number of commands, or reads between them in another way"
        yield sides.tell("memory of commands", "actuator", a, values, refused=why)


def _targets(sides: Sides, side: int, k: int) -> tuple[int, ...]:
    """What an actuator acts on, in ids of the second model."""
    raw = (sides.left, sides.right)[side]
    kind, ids = int(raw.actuator_trntype[k]), raw.actuator_trnid[k].tolist()
    for place, target in enumerate(_DRIVES.get(kind, ())):
        ids[place] = sides.there(side, target, ids[place])
    return kind, *ids


def _words(raw: Any, k: int) -> str:
    """What an actuator drives, and from which site it measures."""
    kind, ids = int(raw.actuator_trntype[k]), raw.actuator_trnid[k].tolist()
    word = require("mujoco").mjtTrn(kind).name.removeprefix("mjTRN_")
    targets = zip(_DRIVES.get(kind, ()), ids, strict=False)
    names = [name_of(raw, target, i) for target, i in targets if i >= 0]
    return f"{word.lower()} {', '.join(names)}"


def sensors(left: Any, right: Any, pairs: Counterparts) -> list[ModelDifference]:
    """What the sensors of two compiled models differ in, on which nothing but a controller depends.

    Args:
        left: An mjModel.
        right: Another; its sensors of the same name are the counterparts.
        pairs: What of one is what of the other.
    """
    why = "a sensor is built by the compiler"  # so only a cutoff can be brought over
    return [
        each if each.subject == "cutoff" else replace(each, edits=(), edits_one=(), refused=why)
        for each in _sensors(Sides(left, right, pairs))
    ]


def _sensors(sides: Sides) -> Iterator[ModelDifference]:
    left, right = sides.left, sides.right
    pairs = list(sides.by_name("sensor"))
    yield from sides.rows("sensor", fields.SENSOR, pairs)
    for a, b in pairs:
        values = []
        kinds = [int(raw.sensor_type[k]) for raw, k in ((left, a), (right, b))]
        if kinds[0] != kinds[1]:
            values.append(("type", *(require("mujoco").mjtSensor(kind).name for kind in kinds)))
        for types, ids in _OBJECTS:
            words = _object(left, types, ids, a), _object(right, types, ids, b)
            if words[0] != words[1] and not _is_same(sides, types, ids, a, b):
                values.append((ids.removeprefix("sensor_"), *words))
        if values:
            yield sides.tell("sensor", "sensor", a, values)
    yield from sides.extras("sensor", pairs, lambda raw, k: zeros(("sensor_cutoff",), raw, k))
    ours = [b for _, b in pairs]
    if ours != sorted(ours):
        orders = [", ".join(name_of(right, "sensor", b) for b in s) for s in (ours, sorted(ours))]
        yield ModelDifference("order of sensordata", "sensor", "", (("order", *orders),))


def _is_same(sides: Sides, types: str, ids: str, a: int, b: int) -> bool:
    """Whether what two sensors are of are counterparts, by whatever names."""
    (kind, here), (other, there) = (
        (int(getattr(raw, types)[k]), int(getattr(raw, ids)[k]))
        for raw, k in ((sides.left, a), (sides.right, b))
    )
    word = str(require("mujoco").mju_type2Str(kind) or "").removeprefix("x")
    return kind == other and sides.ids.get(word, {}).get(here) == there


def _object(raw: Any, types: str, ids: str, k: int) -> str:
    """What a sensor is of, as its kind and its name."""
    mujoco = require("mujoco")
    kind, number = int(getattr(raw, types)[k]), int(getattr(raw, ids)[k])
    if number < 0:
        return "none"
    return f"{mujoco.mju_type2Str(kind)} {mujoco.mj_id2name(raw, kind, number) or number}"
