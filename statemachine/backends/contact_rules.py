"""MuJoCo's rules of contact: whether two geoms meet, and with which parameters.

They are those of its manual, chapter Computation, section Collision, and chapter Modeling,
section Contact parameters. A pair of geoms that a file names itself is not asked here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..interface import Array
from .compiled.flags import DisableFlag

if TYPE_CHECKING:
    from .compiled.types import MjModel


def bodies_meet(raw: MjModel, a: int, b: int) -> bool:
    """Tell whether geoms of two bodies may touch.

    They may not within one rigid piece, nor as parent and child, nor where they are excluded.
    """
    left, right = int(raw.body_weldid[a]), int(raw.body_weldid[b])
    if left == right or ((min(a, b) << 16) + max(a, b)) in raw.exclude_signature:
        return False
    if raw.opt.disableflags & DisableFlag.FILTERPARENT:
        return True
    up: Any = raw.body_weldid[raw.body_parentid[[left, right]]]
    return not ((up[0] == right and right) or (up[1] == left and left))


def masks_meet(raw: MjModel, a: int, b: int) -> bool:
    """Tell whether the masks of two geoms let them touch."""
    return bool((raw.geom_contype[[a, b]] & raw.geom_conaffinity[[b, a]]).any())


def mixed(raw: MjModel, a: int, b: int) -> tuple[int, Array, Array, Array]:
    """Return the parameters of a contact of two geoms.

    Returns:
        condim; sliding, spinning and rolling friction (3,); solref (2,); solimp (5,).
    """
    pair = [a, b] if raw.geom_priority[a] >= raw.geom_priority[b] else [b, a]
    condim, friction = raw.geom_condim[pair], raw.geom_friction[pair]
    solref, solimp = raw.geom_solref[pair], raw.geom_solimp[pair]
    if raw.geom_priority[pair[0]] > raw.geom_priority[pair[1]]:
        return int(condim[0]), friction[0], solref[0], solimp[0]
    weights = raw.geom_solmix[pair].clip(1e-15)
    share = float(weights[0] / weights.sum())
    between = share * solref[0] + (1 - share) * solref[1]
    # Negated, they are stiffness and damping, and are not mixed.
    direct = not (solref[:, 0] > 0).all()
    return (
        int(condim.max()),
        friction.max(axis=0),
        solref.min(axis=0) if direct else between,
        share * solimp[0] + (1 - share) * solimp[1],
    )
