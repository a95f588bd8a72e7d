"""All that two compiled models differ in and that can change a motion; and how to undo it.

What is compared is in the tables of `_fields`. Frames, inertias and shapes are compared in the
frame of the rigid part that they belong to: so fixed bodies, other frames of one solid, or an
inertia given by other axes are no difference. Each difference comes with the edits that bring the
second model to the first, in the second one's own terms.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...installed import require
from ..records import Counterparts, Edit, ModelDifference
from . import _fields as fields
from ._drives import drives, sensors
from ._elements import AS_GEOMS, as_geoms, contact_pairs, elements, equalities
from ._geoms import Geoms
from ._parts import places, weights
from ._sides import Sides, plain, same

__all__ = ["differences", "edited", "entries", "sensors", "settings_of"]

# After these the boxes around the geoms of a body are no longer where they were.
_MOVES = {
    *("body_ipos", "body_iquat", "geom_pos", "geom_quat", "geom_size"),
    *("geom_margin", "geom_gap"),
}


def differences(
    left: Any, right: Any, pairs: Counterparts, *, world: bool = True
) -> tuple[ModelDifference, ...]:
    """All that two compiled models differ in and that can change a motion.

    Args:
        left: An mjModel.
        right: Another.
        pairs: What of one is what of the other.
        world: Whether gravity and the timestep are compared, too.
    """
    sides = Sides(left, right, pairs)
    geoms = Geoms(sides)
    return (
        *_options(left, right, world),
        *weights(sides),
        *places(sides),
        *geoms.found(),
        *elements(sides),
        *equalities(sides),
        *drives(sides),
        *contact_pairs(sides),
        *_whole(left, right),
    )


def edited(raw: Any, edits: Iterable[Edit]) -> Any:
    """A copy of a compiled model with these edits, and all that follows from them.

    What the compiler computes once (inverse weights, masks of bodies) is computed again. The tree
    of boxes that sorts out pairs of geoms is not: it is switched off, which changes no contact.
    """
    from ...backends._edits import put

    mujoco = require("mujoco")
    model = copy.copy(raw)
    # After what is done to the geoms: what makes a pair as its geoms are then.
    edits = sorted(edits, key=lambda edit: edit[0] == AS_GEOMS)
    for name, index, value in edits:
        for edit in as_geoms(model, *index) if name == AS_GEOMS else ((name, index, value),):
            put(model, edit[0], edit[2], edit[1])
    if any(name in _MOVES for name, _, _ in edits):
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)
    _frames(model, edits)
    _masks(model)
    model.flg_adhesion = model.flg_adhesion or model.geom_adhesion.any()
    model.flg_surfacevel = model.flg_surfacevel or model.geom_surfacevel.any()
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def _read(raw: Any, edit: Edit) -> Any:
    """What stands where an edit goes."""
    from ...backends._edits import held

    holder, field = held(raw, edit[0])
    now = getattr(holder, field)
    if np.ndim(now):
        return np.array(now[edit[1]])
    return bool(now & edit[1][0]) if edit[1] else now


def _frames(raw: Any, edits: Iterable[Edit]) -> None:
    """What lay in another frame, and was not computed apart, may lie elsewhere now."""
    for name, index, _ in edits:
        if name in ("geom_pos", "geom_quat", "site_pos", "site_quat"):
            getattr(raw, f"{name[:4]}_sameframe")[index] = 0
        elif name in ("body_ipos", "body_iquat") and not raw.body_simple[index[0]]:
            raw.body_sameframe[index] = 0
            raw.geom_sameframe[raw.geom_bodyid == index[0]] = 0
            raw.site_sameframe[raw.site_bodyid == index[0]] = 0


def _masks(raw: Any) -> None:
    """What a body can touch, from its geoms."""
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
    for subject, names in fields.OPTIONS.items():
        idle = (not world and subject in ("gravity", "timestep")) or (
            subject == "contact override" and not overridden
        )
        both = [(name, getattr(left.opt, name), getattr(right.opt, name)) for name in names]
        differ = [] if idle else [row for row in both if not same(*row[1:])]
        if differ:
            values = tuple((name, _told(name, a), _told(name, b)) for name, a, b in differ)
            edits = tuple((f"opt.{name}", (), copy.copy(a)) for name, a, _ in differ)
            unit = fields.OPTION_UNITS.get(subject, "")
            yield ModelDifference(subject, "option", "", values, unit, edits)
    for field, word, bit in _flag_bits():
        switches = [_switch(raw, field, bit) for raw in (left, right)]
        if switches[0] != switches[1]:
            values = ((f"flag {word}", *switches),)
            edits = ((f"opt.{field}", (bit,), bool(getattr(left.opt, field) & bit)),)
            yield ModelDifference(word, "flag", "", values, edits=edits)


def settings_of(raw: Any) -> dict[str, Any]:
    """The options and flags of a compiled model by name, as they are told."""
    names = [name for group in fields.OPTIONS.values() for name in group]
    options = {name: _told(name, getattr(raw.opt, name)) for name in names}
    flags = {f"flag {word}": _switch(raw, field, bit) for field, word, bit in _flag_bits()}
    return options | flags


def _told(name: str, value: Any) -> Any:
    """The value of an option; of one that is chosen from a list its name there."""
    if name not in fields.CHOICES:
        return plain(value)
    chosen = getattr(require("mujoco"), fields.CHOICES[name])(int(value)).name
    return chosen.partition("_")[2].lower()


def _flag_bits() -> Iterator[tuple[str, str, int]]:
    """The flags that can change a motion: their field, what they are called, their bit."""
    mujoco = require("mujoco")
    for field, bits in zip(fields.FLAGS, (mujoco.mjtDisableBit, mujoco.mjtEnableBit), strict=True):
        for name, bit in bits.__members__.items():
            if int(bit).bit_count() == 1 and "_" in name and name not in fields.IDLE_FLAGS:
                yield field, name.partition("_")[2].lower(), int(bit)


def _switch(raw: Any, field: str, bit: int) -> str:
    raised = bool(int(getattr(raw.opt, field)) & bit)
    return "on" if raised == (field == "enableflags") else "off"


def _whole(left: Any, right: Any) -> Iterator[ModelDifference]:
    """What is compared as a whole and brought to nothing: deformable bodies, plugins."""
    for subject, pattern in (("deformable bodies", "flex_"), ("plugins", "plugin")):
        names = [n for n in dir(left) if n.startswith(pattern) and fields.known(n) == "whole"]
        if not all(same(getattr(left, n), getattr(right, n)) for n in names):
            counts = [int(getattr(raw, f"n{pattern.rstrip('_')}", 0)) for raw in (left, right)]
            why = "they are compared as a whole, and not brought over"
            yield ModelDifference(subject, "model", "", (("count", *counts),), refused=why)


# Fields whose entries mean something one by one, and what each is called; a name with {} is of all.
_AXES, _ENDS, _NUMBERED = ("x", "y", "z"), ("lower end", "upper end"), ("{}[{}]",)
_SPLIT: dict[str, Sequence[str]] = {
    **dict.fromkeys(
        (
            *("body_ipos", "body_pos", "jnt_pos", "geom_pos", "site_pos", "geom_surfacevel"),
            *("opt.gravity", "opt.wind", "opt.magnetic"),
        ),
        _AXES,
    ),
    **dict.fromkeys(
        (
            *("jnt_range", "jnt_actfrcrange", "tendon_range", "tendon_actfrcrange"),
            *("actuator_ctrlrange", "actuator_forcerange", "actuator_actrange"),
        ),
        _ENDS,
    ),
    **dict.fromkeys(
        ("body_inertia", "geom_size", "geom_friction", "pair_friction", "actuator_gear"), _NUMBERED
    ),
    **dict.fromkeys(("actuator_gainprm", "actuator_biasprm"), _NUMBERED),
}
_CALLED = {"body_inertia": "diaginertia"}
# A difference that sets one of these is a thing of one piece: the rest means something else then.
_KINDS = ("geom_type", "actuator_gaintype", "actuator_biastype", "actuator_dyntype", "body_iquat")
_GAINS, _KP = ("actuator_gainprm", "actuator_biasprm"), ("gainprm[0]", "biasprm[1]")
_TURNS = ("body_quat", "geom_quat", "site_quat")


def entries(right: Any, difference: ModelDifference) -> tuple[ModelDifference, ...]:
    """A difference by its single entries, or itself where it is of one piece.

    Args:
        right: The compiled model that its edits are of.
        difference: One of `differences`.
    """
    if difference.edits_one or difference.refused or difference.subject.startswith("extra "):
        return (difference,)
    edits = [edit for edit in difference.edits if not same(edit[2], _read(right, edit))]
    if any(
        name in _KINDS or name.endswith("limited") or any(isinstance(part, slice) for part in index)
        for name, index, _ in edits
    ):
        return (difference,)
    # The gain of a servo stands in two places, which are one entry.
    gains = [edit for edit in edits if edit[0] in _GAINS]
    both = [[edit[2] for edit in gains], [_read(right, edit) for edit in gains]]
    servo = len(gains) == 2 and all(_is_servo(*arrays) for arrays in both)
    parts: dict[str, ModelDifference] = {}
    for word, left, other, unit, edit in (row for part in edits for row in _by_entry(right, part)):
        called = "kp" if servo and word in _KP else word
        known = parts.get(called)
        parts[called] = replace(
            known or difference,
            subject=f"{difference.subject} ({called})",
            values=known.values if known else ((called, left, other),),
            unit=unit or difference.unit,
            edits=(*(known.edits if known else ()), edit),
        )
    return tuple(parts.values()) if len(parts) > 1 else (difference,)


def _by_entry(right: Any, edit: Edit) -> Iterator[tuple[str, Any, Any, str, Edit]]:
    """What an entry is called, both values, its unit if that is another, what brings it over."""
    (name, index, value), old = edit, _read(right, edit)
    kind, _, rest = name.partition("." if name.startswith("opt.") else "_")
    word = _CALLED.get(name, rest or kind)
    names = _SPLIT.get(name)
    if name in _TURNS:
        angle = 2 * float(np.arccos(np.clip(abs(np.dot(value, old)), 0.0, 1.0)))
        yield "turn", 0.0, angle, "rad", edit
    elif names is None or not np.ndim(value):
        word += "".join(f"[{k}]" for k in index[1:2])
        yield word, plain(value), plain(old), "", edit
    else:
        for k in range(len(value)):
            if not same(value[k], old[k]):
                called = names[0].format(word, k) if names is _NUMBERED else names[k]
                left, other = float(value[k]), float(old[k])
                yield called, left, other, "", (name, (*index, k), left)


def _is_servo(gains: Any, biases: Any) -> bool:
    return bool(np.ndim(gains) and gains[0] == -biases[1] and not gains[1:].any() and not biases[0])
