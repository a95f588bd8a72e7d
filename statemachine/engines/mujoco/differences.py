"""All that two compiled models differ in and that can change a motion; and how to undo it.

What is compared is in the tables of `_fields`. Frames, inertias and shapes are compared in the
frame of the rigid part that they belong to: so fixed bodies, other frames of one solid, or an
inertia given by other axes are no difference. Each difference comes with the edits that bring the
second model to the first, in the second one's own terms.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable
from typing import Any

import numpy as np

from ...installed import require
from ..records import Counterparts, Edit, ModelDifference
from . import _fields as fields
from ._contact_pairs import ContactPairs
from ._drives import Drives
from ._elements import Elements
from ._entries import entries
from ._equalities import Equalities
from ._figures import plain, same
from ._geoms import Geoms
from ._places import Places
from ._sensors import sensors
from ._weights import Weights

__all__ = ["differences", "edited", "entries", "sensors"]

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
    one: Any, two: Any, pairs: Counterparts, *, world: bool = True
) -> tuple[ModelDifference, ...]:
    """All that two compiled models differ in and that can change a motion.

    Args:
        one: An mjModel.
        two: Another.
        pairs: What of one is what of the other.
        world: Whether gravity and the timestep are compared, too.
    """
    geoms = Geoms(one, two, pairs)
    return (
        *_options(one, two, world),
        *Weights(one, two, pairs).found(),
        *Places(one, two, pairs).found(),
        *geoms.found(),
        *Elements(one, two, pairs, geoms.geoms).found(),
        *Equalities(one, two, pairs, geoms.geoms).found(),
        *Drives(one, two, pairs, geoms.geoms).found(),
        *ContactPairs(one, two, pairs, geoms.geoms).found(),
        *_whole(one, two),
    )


def edited(raw: Any, edits: Iterable[Edit]) -> Any:
    """A copy of a compiled model with these edits, and all that follows from them.

    What the compiler computes once (inverse weights, masks of bodies) is computed again. The tree
    of boxes that sorts out pairs of geoms is not: it is switched off, which changes no contact.
    """
    mujoco = require("mujoco")
    made, own_scale = copy.copy(raw), _scale(raw) is None
    edits = list(edits)
    for name, index, value in edits:
        if "." in name:
            _set_option(made, name, index, value)
        else:
            getattr(made, name)[index] = value
    if any(name in _MOVES for name, _, _ in edits):
        made.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)
    _frames(made, edits)
    _masks(made)
    made.flg_adhesion = made.flg_adhesion or made.geom_adhesion.any()
    made.flg_surfacevel = made.flg_surfacevel or made.geom_surfacevel.any()
    mujoco.mj_setConst(made, mujoco.MjData(made))
    if own_scale and made.nv:
        made.stat.meaninertia = made.dof_M0.mean()
    return made


def _set_option(raw: Any, name: str, index: tuple[Any, ...], value: Any) -> None:
    holder, _, field = name.rpartition(".")
    owner = getattr(raw, holder)
    if index and np.ndim(getattr(owner, field)):
        getattr(owner, field)[index] = value
    elif index:  # a bit of a set of flags
        flags = int(getattr(owner, field))
        setattr(owner, field, flags | index[0] if value else flags & ~index[0])
    elif np.ndim(getattr(owner, field)):
        getattr(owner, field)[:] = value
    else:
        setattr(owner, field, value)


def _frames(raw: Any, edits: Iterable[Edit]) -> None:
    """What lay in another frame, and was not computed apart, may lie elsewhere now."""
    for name, index, _ in edits:
        if name in ("geom_pos", "geom_quat"):
            raw.geom_sameframe[index] = 0
        elif name in ("site_pos", "site_quat"):
            raw.site_sameframe[index] = 0
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


def _scale(raw: Any) -> float | None:
    """The mean inertia by which a solver decides to stop, where a file gives it; else None."""
    if not raw.nv:
        return None
    given = float(raw.stat.meaninertia)
    return None if np.isclose(given, raw.dof_M0.mean(), rtol=1e-9) else given


def _options(one: Any, two: Any, world: bool) -> list[ModelDifference]:
    found = []
    for subject, names in fields.OPTIONS.items():
        if not world and subject in ("gravity", "timestep"):
            continue
        if subject == "contact override" and not (_overrides(one) or _overrides(two)):
            continue
        values, edits = [], list[Edit]()
        for name in names:
            a, b = getattr(one.opt, name), getattr(two.opt, name)
            if not same(a, b):
                values.append((name, _told(name, a), _told(name, b)))
                edits.append((f"opt.{name}", (), copy.copy(a)))
        if values:
            unit = fields.OPTION_UNITS.get(subject, "")
            found.append(ModelDifference(subject, "option", "", tuple(values), unit, tuple(edits)))
    ours, theirs = _scale(one), _scale(two)
    if (ours is None) != (theirs is None) or not same(ours or 0.0, theirs or 0.0):
        value = one.stat.meaninertia
        values = (("meaninertia", float(value), float(two.stat.meaninertia)),)
        edits = (("stat.meaninertia", (), value),)
        found.append(ModelDifference("scale of the solver", "option", "", values, edits=edits))
    return found + _flags(one, two)


def _told(name: str, value: Any) -> Any:
    """The value of an option; of one that is chosen from a list its name there."""
    if name not in fields.CHOICES:
        return plain(value)
    chosen = getattr(require("mujoco"), fields.CHOICES[name])(int(value)).name
    return chosen.partition("_")[2].lower()


def _overrides(raw: Any) -> bool:
    return bool(raw.opt.enableflags & int(require("mujoco").mjtEnableBit.mjENBL_OVERRIDE))


def _flags(one: Any, two: Any) -> list[ModelDifference]:
    mujoco, found = require("mujoco"), []
    for field, bits in zip(fields.FLAGS, (mujoco.mjtDisableBit, mujoco.mjtEnableBit), strict=True):
        for name, bit in bits.__members__.items():
            number = int(bit)
            a, b = (bool(int(getattr(each.opt, field)) & number) for each in (one, two))
            if number.bit_count() != 1 or a == b or name in fields.IDLE_FLAGS:
                continue
            word = name.partition("_")[2].lower()
            on = field == "enableflags"
            values = ((word, _switch(a == on), _switch(b == on)),)
            edits: tuple[Edit, ...] = ((f"opt.{field}", (number,), a),)
            found.append(ModelDifference(word, "flag", "", values, edits=edits))
    return found


def _switch(on: bool) -> str:
    return "on" if on else "off"


def _whole(one: Any, two: Any) -> list[ModelDifference]:
    """What is compared as a whole and brought to nothing: deformable bodies, plugins."""
    found = []
    for subject, pattern in (("deformable bodies", "flex_"), ("plugins", "plugin")):
        names = [name for name in dir(one) if name.startswith(pattern)]
        names = [name for name in names if fields.known(name) == "whole"]
        differing = [n for n in names if not same(getattr(one, n), getattr(two, n))]
        if differing:
            counts = [int(getattr(raw, f"n{pattern.rstrip('_')}", 0)) for raw in (one, two)]
            values = (("count", counts[0], counts[1]),)
            why = "they are compared as a whole, and not brought over"
            found.append(ModelDifference(subject, "model", "", values, refused=why))
    return found
