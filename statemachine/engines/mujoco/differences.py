"""All that two compiled models differ in and that can change a motion; and how to undo it.

What is compared is in the tables of `compared_fields`. Frames, inertias and shapes are compared
in the frame of the rigid part that they belong to: so fixed bodies, other frames of one solid, or
an inertia given by other axes are no difference. Each difference comes with the edits that bring
the second model to the first, in the second one's own terms.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...installed import require
from ...measures.text import grouped
from ..records import Counterparts, DifferingQuantity, Edit, ModelDifference, QuantityValue
from . import compared_fields as fields
from ._drives import drives
from ._elements import AS_GEOMS, as_geoms, contact_pairs, elements, equalities
from ._flexes import flexes
from ._geoms import Geoms
from ._parts import places, weights
from ._quantities import plain, quantity_of, same, word_in
from ._readable import patched_text
from ._sides import Sides

# After these the boxes around the geoms of a body are no longer where they were.
_MOVES = {
    "body_ipos",
    "body_iquat",
    "geom_pos",
    "geom_quat",
    "geom_size",
    "geom_margin",
    "geom_gap",
}


def differences(
    left: Any, right: Any, pairs: Counterparts, *, world: bool = True
) -> tuple[ModelDifference, ...]:
    """Return all that two compiled models differ in and that can change a motion.

    Args:
        left: An mjModel.
        right: Another.
        pairs: What of one is what of the other.
        world: Whether gravity and the timestep are compared, too.
    """
    sides = Sides(left, right, pairs)
    found = list(_options(left, right, world))
    for rows_of in _COMPARED:
        found += rows_of(sides)
    found += _whole(left, right)
    return tuple(found)


def _geoms(sides: Sides) -> Iterable[ModelDifference]:
    return Geoms(sides).differences()


# What is compared, in this order: geoms are in pairs before what refers to them.
_COMPARED = (weights, places, _geoms, elements, equalities, drives, contact_pairs, flexes)


def edited(raw: Any, edits: Iterable[Edit]) -> Any:
    """Return a copy of a compiled model with these edits, and all that follows from them.

    What the compiler computes once (inverse weights, masks of bodies) is computed again. The tree
    of boxes that sorts out pairs of geoms is not: it is switched off, which changes no contact.
    """
    from ...backends.edits import put

    mujoco = require("mujoco")
    model = copy.copy(raw)
    # After what is done to the geoms: what makes a pair as its geoms are then.
    edits = sorted(edits, key=lambda edit: edit[0] == AS_GEOMS)
    texts = [edit for edit in edits if edit[0] == "text_data"]
    if texts:
        model = patched_text(model, texts)
    for name, index, value in edits:
        if name == "text_data":
            continue
        for edit in as_geoms(model, *index) if name == AS_GEOMS else ((name, index, value),):
            put(model, edit[0], edit[2], edit[1])
    if any(name in _MOVES for name, _, _ in edits):
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)
    _frames(model, edits)
    _masks(model)
    model.flg_adhesion = model.flg_adhesion or model.geom_adhesion.any()
    model.flg_surfacevel = model.flg_surfacevel or model.geom_surfacevel.any()
    mujoco.mj_setConst(model, mujoco.MjData(model))
    # A copy looks up its elements by the names that they have now.
    renamed = any(name.startswith("name_") for name, _, _ in edits)
    return copy.copy(model) if renamed else model


def _read(raw: Any, edit: Edit) -> Any:
    """Return the value at the place of an edit."""
    from ...backends.edits import owner_of_field

    holder, field = owner_of_field(raw, edit[0])
    now = getattr(holder, field)
    if np.ndim(now):
        return np.array(now[edit[1]])
    return bool(now & edit[1][0]) if edit[1] else now


def _frames(raw: Any, edits: Iterable[Edit]) -> None:
    """Compute anew the frames that may have moved with what they were given in."""
    for name, index, _ in edits:
        if name in ("geom_pos", "geom_quat", "site_pos", "site_quat"):
            getattr(raw, f"{name[:4]}_sameframe")[index[0]] = 0
        elif name in ("body_ipos", "body_iquat") and not raw.body_simple[index[0]]:
            raw.body_sameframe[index[0]] = 0
            raw.geom_sameframe[raw.geom_bodyid == index[0]] = 0
            raw.site_sameframe[raw.site_bodyid == index[0]] = 0


def _masks(raw: Any) -> None:
    """Compute anew which masks a body can touch, from its geoms."""
    for mask in ("contype", "conaffinity"):
        body = np.zeros(raw.nbody, dtype=np.int64)
        np.bitwise_or.at(body, raw.geom_bodyid, getattr(raw, f"geom_{mask}"))
        getattr(raw, f"body_{mask}")[:] = body
    margin = np.zeros(raw.nbody)
    np.maximum.at(margin, raw.geom_bodyid, raw.geom_margin + raw.geom_gap)
    raw.body_margin[:] = margin


def _options(left: Any, right: Any, world: bool) -> Iterator[ModelDifference]:
    overrides = int(require("mujoco").mjtEnableBit.mjENBL_OVERRIDE)
    overridden = (left.opt.enableflags | right.opt.enableflags) & overrides
    ours, theirs = settings_of(left), settings_of(right)
    for subject, options in fields.OPTIONS.items():
        if not world and subject in ("gravity", "timestep"):
            continue
        if subject == "contact override" and not overridden:
            continue
        names = [name for name in options if not same(ours[name], theirs[name])]
        if names:
            values = tuple(
                quantity_of(f"opt.{name}", ours[name], theirs[name], _unit_of(name), name)
                for name in names
            )
            edits = tuple((f"opt.{name}", (), copy.copy(getattr(left.opt, name))) for name in names)
            yield ModelDifference(subject, "option", "", values, edits)
    for field, word, bit in _flag_bits():
        name = f"flag {word}"
        if ours[name] != theirs[name]:
            edits = ((f"opt.{field}", (bit,), bool(getattr(left.opt, field) & bit)),)
            value = DifferingQuantity(name, ours[name], theirs[name])
            yield ModelDifference(word, "flag", "", (value,), edits)


def _unit_of(option: str) -> str:
    """Return the SI unit of an option of the engine; "" without one."""
    return fields.OPTION_UNITS.get(option, "")


def settings_of(raw: Any) -> dict[str, Any]:
    """Return the options and flags of a compiled model by name; enumerations in words."""
    names = [name for group in fields.OPTIONS.values() for name in group]
    settings = {name: plain(getattr(raw.opt, name)) for name in names}
    for name, enumeration in fields.OPTION_CHOICES.items():
        settings[name] = word_in(enumeration, settings[name])
    for word, is_on in flags(raw).items():
        settings[f"flag {word}"] = "on" if is_on else "off"
    return settings


def flags(raw: Any) -> dict[str, bool]:
    """Return the flags of a compiled model that can change a motion: whether each is on."""
    states: dict[str, bool] = {}
    for field, word, bit in _flag_bits():
        raised = bool(getattr(raw.opt, field) & bit)
        states[word] = raised == (field == "enableflags")
    return states


def integrator(raw: Any) -> str:
    """Return the name of the integrator of a compiled model."""
    return settings_of(raw)["integrator"]


def _flag_bits() -> Iterator[tuple[str, str, int]]:
    """Yield the flags that can change a motion: their field, what they are called, their bit."""
    mujoco = require("mujoco")
    for field, bits in zip(fields.FLAGS, (mujoco.mjtDisableBit, mujoco.mjtEnableBit), strict=True):
        for name, bit in bits.__members__.items():
            if int(bit).bit_count() == 1 and "_" in name and name not in fields.IDLE_FLAGS:
                yield field, name.partition("_")[2].lower(), int(bit)


def _whole(left: Any, right: Any) -> Iterator[ModelDifference]:
    """Yield the differences that are compared as a whole, and only removed: plugins."""
    names = [name for name in dir(left) if name.startswith("plugin")]
    names = [name for name in names if fields.known(name) == "whole"]
    if not all(same(getattr(left, name), getattr(right, name)) for name in names):
        why = "they are compared as a whole, and not brought over"
        value = DifferingQuantity("count", int(left.nplugin), int(right.nplugin))
        yield ModelDifference("plugins", "model", "", (value,), refused=why)


_GAINS = ("actuator_gainprm", "actuator_biasprm")
# What these entries are of a position servo: its kp stands in two places, which are one entry.
_SERVO_GAINS = {"gainprm[0]": "kp", "biasprm[1]": "kp", "biasprm[2]": "kv"}
_ENDS, _EACH = ("lower end", "upper end"), ("{}[{}]",)
# Fields whose entries mean something one by one, and what each is called; a name with {} is of all.
_SPLIT: dict[str, Sequence[str]] = {
    "body_ipos": "xyz",
    "body_pos": "xyz",
    "jnt_pos": "xyz",
    "geom_pos": "xyz",
    "site_pos": "xyz",
    "geom_surfacevel": "xyz",
    "opt.gravity": "xyz",
    "opt.wind": "xyz",
    "opt.magnetic": "xyz",
    "jnt_range": _ENDS,
    "jnt_actfrcrange": _ENDS,
    "tendon_range": _ENDS,
    "tendon_actfrcrange": _ENDS,
    "actuator_ctrlrange": _ENDS,
    "actuator_forcerange": _ENDS,
    "actuator_actrange": _ENDS,
    "geom_size": _EACH,
    "geom_friction": _EACH,
    "pair_friction": _EACH,
    "actuator_gear": _EACH,
    "actuator_gainprm": _EACH,
    "actuator_biasprm": _EACH,
    "body_inertia": ("diaginertia[{1}]",),
}
# SI units of arrays whose quantities have names of their own.
_UNITS_OF_ARRAYS = {
    **{"ipos": "m", "pos": "m", "inertia": "kg m²"},
}
# A difference that sets one of these is a thing of one piece: the rest means something else then.
_KINDS = ("geom_type", "actuator_gaintype", "actuator_biastype", "actuator_dyntype", "body_iquat")


def entries(right: Any, difference: ModelDifference) -> tuple[ModelDifference, ...]:
    """Return a difference by its single entries, or itself where it is of one piece.

    Args:
        right: The compiled model that its edits are of.
        difference: One of `differences`.
    """
    if difference.only_read or difference.subject.startswith("extra "):
        return (difference,)
    if difference.edits_one or difference.refused:
        return (difference,)
    edits = [edit for edit in difference.edits if not same(edit[2], _read(right, edit))]
    if any(_is_of_one_piece(edit) for edit in edits):
        return (difference,)
    changes: list[tuple[str, _Entry]] = []
    is_servo = _changes_a_servo(right, edits)
    named = {value.quantity: value for value in difference.values}
    units = {name: value.unit for name, value in named.items()} | _UNITS_OF_ARRAYS
    for edit in edits:
        for entry in _by_entry(right, edit, units.get(_word(edit[0]), "")):
            name = _SERVO_GAINS.get(entry.name, "") if is_servo else ""
            if name in named:
                value = named[name]
                entry = replace(entry, left=value.left, right=value.right, unit=value.unit)  # noqa: PLW2901
            changes.append((name or entry.name, entry))
    parts = grouped(changes)
    if len(parts) < 2:
        return (difference,)
    return tuple(_part(difference, name, rows) for name, rows in parts.items())


def _is_of_one_piece(edit: Edit) -> bool:
    """Tell whether an edit is of something whose entries mean nothing one by one."""
    name, index, _ = edit
    if name in _KINDS or name.endswith("limited"):
        return True
    return any(isinstance(part, slice) for part in index)


def _changes_a_servo(right: Any, edits: Sequence[Edit]) -> bool:
    """Tell whether edits make one position servo of another."""
    gains = [edit for edit in edits if edit[0] in _GAINS]
    if len(gains) != 2:
        return False
    wanted = [edit[2] for edit in gains]
    now = [_read(right, edit) for edit in gains]
    return _is_servo(*wanted) and _is_servo(*now)


def _part(difference: ModelDifference, name: str, entries: Sequence[_Entry]) -> ModelDifference:
    """Return the part of a difference that is of one entry, which may stand in several places."""
    first = entries[0]
    value = DifferingQuantity(name, first.left, first.right, first.unit)
    return replace(
        difference,
        subject=f"{difference.subject} ({name})",
        values=(value,),
        edits=tuple(entry.edit for entry in entries),
    )


def _word(array: str) -> str:
    """Return what an array, or an option, is called without the kind of its element."""
    return array.removeprefix("opt.") if array.startswith("opt.") else fields.word_of(array)


@dataclass(frozen=True, eq=False)
class _Entry:
    """A single entry that an edit changes.

    Attributes:
        name: What it is called.
        left, right: Its value in each model.
        unit: Its SI unit.
        edit: What brings it over.
    """

    name: str
    left: QuantityValue
    right: QuantityValue
    unit: str
    edit: Edit


def _by_entry(right: Any, edit: Edit, unit: str) -> Iterator[_Entry]:
    """Yield the entries that an edit changes; `unit` is that of its array."""
    (name, index, value), old = edit, _read(right, edit)
    word, names = _word(name), _SPLIT.get(name)
    if name in ("body_quat", "geom_quat", "site_quat"):
        angle = 2 * float(np.arccos(np.clip(abs(np.dot(value, old)), 0.0, 1.0)))
        yield _Entry("turn", 0.0, angle, "rad", edit)
    elif names is None or not np.ndim(value):
        word += "".join(f"[{k}]" for k in index[1:2])
        yield _Entry(word, plain(value), plain(old), unit, edit)
    else:
        for k in range(len(value)):
            if not same(value[k], old[k]):
                called = names[0].format(word, k) if len(names) == 1 else names[k]
                left, other = float(value[k]), float(old[k])
                yield _Entry(called, left, other, unit, (name, (*index, k), left))


def _is_servo(gains: Any, biases: Any) -> bool:
    return bool(np.ndim(gains) and gains[0] == -biases[1] and not gains[1:].any() and not biases[0])
