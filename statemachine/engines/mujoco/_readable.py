"""What two compiled models keep for whoever reads it, and the engine does not use.

It is the user data of elements (`user=` in an MJCF), and what stands in `<custom>`: numeric, text,
tuple. No motion depends on it, unless a function that commands reads it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...backends.controls import ctrl_owners
from ...errors import ModelError
from ...installed import require
from ...interface import Array
from ..description.shapes import one_to_one
from ..records import Counterparts, DifferingQuantity, Edit, ModelDifference, QuantityValue
from ._geoms import Geoms
from ._sides import NOBODY, Pairs, Sides, name_of

# By the kind of an element: the array of its user data, and the field that is its width.
_USER = {
    "body": ("body_user", "nuser_body"),
    "joint": ("jnt_user", "nuser_jnt"),
    "geom": ("geom_user", "nuser_geom"),
    "site": ("site_user", "nuser_site"),
    "camera": ("cam_user", "nuser_cam"),
    "tendon": ("tendon_user", "nuser_tendon"),
    "actuator": ("actuator_user", "nuser_actuator"),
    "sensor": ("sensor_user", "nuser_sensor"),
}
_CUSTOM = ("numeric", "text", "tuple")
_BUILT = "it is built by the compiler, and cannot be added or taken away"
_ANOTHER_SIZE = "it has another size there"


def readable(left: Any, right: Any, pairs: Counterparts) -> list[ModelDifference]:
    """List what two compiled models differ in that only a function of the user's can read.

    Args:
        left: An mjModel.
        right: Another.
        pairs: What of one is what of the other; cameras, sensors and custom data are matched by
            name.
    """
    sides = Sides(left, right, pairs)
    elements = _pairs_of_elements(sides)
    rows: list[ModelDifference] = []
    for kind, (array, width) in _USER.items():
        if getattr(left, width) or getattr(right, width):
            rows += _user_data(sides, kind, array, width, elements[kind])
    for kind in _CUSTOM:
        rows += _custom(sides, kind)
    return rows


def _pairs_of_elements(sides: Sides) -> dict[str, Pairs]:
    """Return pairs of ids by kind of element; of geoms those that touch nothing, too."""
    geoms = one_to_one(sides.by_name("geom"), Geoms(sides).pairs)
    pairs = {
        "body": sorted(sides.ids["body"].items()),
        "joint": sides.pairs.joints,
        "geom": sorted(geoms.items()),
        "site": sides.pairs.sites,
        "actuator": _pairs_of_actuators(sides),
    }
    for kind in ("camera", "tendon", "sensor"):
        pairs[kind] = list(sides.by_name(kind))
    return pairs


def _pairs_of_actuators(sides: Sides) -> Pairs:
    """Return pairs of ids of actuators: of those that take two places in ctrl that are one."""
    ours, theirs = ctrl_owners(sides.left), ctrl_owners(sides.right)
    return sorted({(int(ours[a]), int(theirs[b])) for a, b in sides.pairs.actuators})


def shown_elements(left: Any, right: Any, pairs: Counterparts) -> dict[str, list[tuple[int, int]]]:
    """Return pairs of ids of geoms, tendons and actuators, and of places in sensordata."""
    sides = Sides(left, right, pairs)
    elements = _pairs_of_elements(sides)
    places: list[tuple[int, int]] = []
    for a, b in elements["sensor"]:
        size = int(left.sensor_dim[a])
        if size == right.sensor_dim[b]:
            ours, theirs = int(left.sensor_adr[a]), int(right.sensor_adr[b])
            places += [(ours + k, theirs + k) for k in range(size)]
    shown = {kind: list(elements[kind]) for kind in ("geom", "tendon", "actuator")}
    return shown | {"sensordata": places}


def _user_data(
    sides: Sides, kind: str, array: str, width: str, pairs: Pairs
) -> Iterator[ModelDifference]:
    """Compare the user data of elements; what a file does not give is zero, as in the engine."""
    ours, theirs = (getattr(raw, array) for raw in sides.raws)
    longest = max(ours.shape[1], theirs.shape[1])
    for a, b in pairs:
        left, right = _filled(ours[a], longest), _filled(theirs[b], longest)
        if np.array_equal(left, right):
            continue
        edits: tuple[Edit, ...] = ()
        refused = ""
        room = theirs.shape[1]
        if left[room:].any():
            refused = f"the right keeps {room} numbers of each element ({width}), the left more"
        else:
            edits = ((array, (b,), left[:room]),)
        yield ModelDifference(
            "user data",
            kind,
            name_of(sides.left, kind, a),
            (DifferingQuantity("user", _plain(left), _plain(right)),),
            edits=edits,
            refused=refused,
            only_read=True,
        )


def _filled(values: Array, length: int) -> Array:
    """Return numbers (k,) with zeros behind them, (length,)."""
    return np.concatenate([values, np.zeros(length - len(values))])


def _plain(values: Array) -> float | tuple[float, ...]:
    """Return one number as a number, and several as a tuple."""
    return float(values[0]) if len(values) == 1 else tuple(values.tolist())


@dataclass(frozen=True)
class _Entry:
    """What one element of `<custom>` has.

    Attributes:
        value: For a reader.
        edits: What writes it into the arrays of another model where it has as much room.
        room: How much it takes.
    """

    value: QuantityValue
    edits: tuple[Edit, ...]
    room: int


def _custom(sides: Sides, kind: str) -> Iterator[ModelDifference]:
    """Compare the elements of one kind of `<custom>`, by name."""
    entry_of = {"numeric": _numeric, "text": _text, "tuple": _tuple}[kind]
    ours, theirs = _names_of_custom(sides.left, kind), _names_of_custom(sides.right, kind)
    for a, name in enumerate(ours):
        if name not in theirs:
            yield _extra(kind, name, ("there", None))
            continue
        b = theirs.index(name)
        left, right = entry_of(sides, 0, a, b), entry_of(sides, 1, b, b)
        if left.value == right.value:
            continue
        fits = left.room == right.room
        yield ModelDifference(
            f"{kind} data",
            kind,
            name,
            (DifferingQuantity("data", left.value, right.value),),
            edits=left.edits if fits else (),
            refused="" if fits else _ANOTHER_SIZE,
            only_read=True,
        )
    for name in theirs:
        if name not in ours:
            yield _extra(kind, name, (None, "there"))


def _names_of_custom(raw: Any, kind: str) -> list[str]:
    """Return the names of all elements of a kind of `<custom>`, in their order."""
    mujoco = require("mujoco")
    object_type = getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
    count = getattr(raw, f"n{kind}")
    return [mujoco.mj_id2name(raw, int(object_type), k) or f"{kind} {k}" for k in range(count)]


def _extra(kind: str, name: str, sides: tuple[str | None, str | None]) -> ModelDifference:
    """Tell that only one model has an element of `<custom>`."""
    values = (DifferingQuantity(kind, *sides),)
    return ModelDifference(f"extra {kind}", kind, name, values, refused=_BUILT, only_read=True)


def _numeric(sides: Sides, side: int, k: int, there: int) -> _Entry:
    raw = sides.raws[side]
    start, size = int(raw.numeric_adr[k]), int(raw.numeric_size[k])
    data = np.array(raw.numeric_data[start : start + size])
    target = int(sides.right.numeric_adr[there])
    return _Entry(_plain(data), (("numeric_data", (slice(target, target + size),), data),), size)


def _text(sides: Sides, side: int, k: int, there: int) -> _Entry:
    raw = sides.raws[side]
    start, size = int(raw.text_adr[k]), int(raw.text_size[k])
    data = bytes(raw.text_data)[start : start + size]
    target = int(sides.right.text_adr[there])
    text = data.rstrip(b"\0").decode(errors="replace")
    return _Entry(text, (("text_data", (slice(target, target + size),), data),), size)


def _tuple(sides: Sides, side: int, k: int, there: int) -> _Entry:
    """Return what a tuple refers to: objects of the second model, and a number with each."""
    raw, mujoco = sides.raws[side], require("mujoco")
    start, size = int(raw.tuple_adr[k]), int(raw.tuple_size[k])
    objects: list[tuple[str, int, float]] = []
    words: list[str] = []
    for at in range(start, start + size):
        kind = str(mujoco.mju_type2Str(int(raw.tuple_objtype[at])) or "")
        number, prm = int(raw.tuple_objid[at]), float(raw.tuple_objprm[at])
        known = kind in sides.ids
        objects.append((kind, sides.there(side, kind, number) if known else number, prm))
        name = mujoco.mj_id2name(raw, int(raw.tuple_objtype[at]), number) or number
        words.append(f"{kind} {name} {prm:g}")
    lost = any(number == NOBODY for _, number, _ in objects)
    target = int(sides.right.tuple_adr[there])
    place = slice(target, target + size)
    numbers = [number for _, number, _ in objects]
    source = slice(start, start + size)
    types, values = np.array(raw.tuple_objtype[source]), np.array(raw.tuple_objprm[source])
    edits: tuple[Edit, ...] = (
        ("tuple_objtype", (place,), types),
        ("tuple_objid", (place,), np.array(numbers, dtype=int)),
        ("tuple_objprm", (place,), values),
    )
    # What refers to something that the second model does not have fits nowhere.
    return _Entry(", ".join(words), edits, -1 if lost else size)


def patched_text(raw: Any, edits: Iterable[Edit]) -> Any:
    """Return a compiled model whose texts were edited: in Python they are read-only.

    The model is saved, its texts are replaced by others of the same length, and it is read again.
    The same bytes may stand elsewhere in it. Behind the texts are only names and numbers, so that
    the last place counts of which the model that is read has the wanted texts.

    Raises:
        ModelError: The texts are not found.
    """
    from ...backends.compiled.binary_models import from_binary, saved

    before = bytes(raw.text_data)
    edited = bytearray(before)
    for _, (place,), value in edits:
        edited[place] = value
    after = bytes(edited)
    content = saved(raw).tobytes()
    at = content.rfind(before)
    while at >= 0:
        patched = from_binary(content[:at] + after + content[at + len(before) :])
        if bytes(patched.text_data) == after:
            return patched
        at = content.rfind(before, 0, at + len(before) - 1)
    raise ModelError("the texts of this compiled model cannot be replaced")
