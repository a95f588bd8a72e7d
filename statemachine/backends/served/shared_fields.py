"""The numeric fields of a compiled model that another release of MuJoCo may have, too.

By them a compiled model of the installed release takes over what an engine read in a file.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from ...interface.records import Arrays
from ..edits import put
from . import release_child as child
from .release_parts import owner_of_field

# Arrays that no motion depends on, and what each release computes of the others in its own way.
_OWN = (
    *("bvh", "cam", "hfield_path", "light", "mat_", "mesh_path", "name", "sensor", "skin", "tex"),
    *("paths", "efm", "B_", "D_", "M_", "mapM", "mapD", "flg_", "ten_J", "dof_length"),
    *("actuator_history", "sensor_history", "flexedge_invweight0"),
)
# What is large and laid out in each release's own way: nobody sends it to another.
_UNSENT = ("flex", "mesh", "oct")
FLAGS = {"opt.disableflags": mujoco.mjtDisableBit, "opt.enableflags": mujoco.mjtEnableBit}


def take_over(raw: mujoco.MjModel, fields: Arrays) -> set[str]:
    """Write the numbers that an engine read into a compiled model; the fields that both have.

    Args:
        raw: The compiled model of the installed release.
        fields: What the engine read, by name.
    """
    shared = set[str]()
    for name in field_names(raw):
        now = np.asarray(field_of(raw, name))
        if name not in fields or fields[name].shape != now.shape:
            continue
        shared.add(name)
        if not name.endswith("type") and not np.array_equal(fields[name], now):
            put(raw, name, fields[name] if now.ndim else fields[name].item())
    return shared


def take_over_flags(raw: mujoco.MjModel, name: str, set_there: list[str]) -> None:
    """Set the flags of a compiled model that are set in an engine.

    Args:
        raw: The compiled model of the installed release.
        name: Of `FLAGS`.
        set_there: Names of the flags that are set in the engine.
    """
    kinds, bits = FLAGS[name].__members__, 0
    for flag in set_there:
        for own in child.SPLIT.get(flag, (flag,)):
            if own in kinds:
                bits += int(kinds[own])
    setattr(*owner_of_field(raw, name), bits)


def field_names(raw: mujoco.MjModel, without: tuple[str, ...] = _UNSENT) -> Iterator[str]:
    """Yield the names of the numeric fields of a compiled model that releases may have in
    common.
    """
    for name in dir(raw):
        sent = not name.startswith(("_", *_OWN, *without))
        if sent and isinstance(getattr(raw, name), np.ndarray):
            yield name
    for holder in ("opt", "stat"):
        names = {f"{holder}.{name}" for name in dir(getattr(raw, holder)) if name[0] != "_"}
        yield from sorted(names - FLAGS.keys())


def field_of(raw: mujoco.MjModel, name: str) -> Any:
    return getattr(*owner_of_field(raw, name))
