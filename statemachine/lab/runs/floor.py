"""Whether a robot has a floor: something that it can touch, and that stays where it is."""

from __future__ import annotations

import numpy as np

from ...interface import JointType, Model
from .floating import free_joint_of_base
from .robot import carried_by

_PLANE, _HFIELD = 0, 1  # mjtGeom


def has_floor(model: Model) -> bool | None:
    """Tell whether a robot can touch something that is no part of it and does not fall.

    Beside a robot with a fixed base that is a plane or a height field: shapes of the world may be
    its own base.

    Returns:
        None where the shapes of the model are not known.
    """
    compiled = model.compiled
    if compiled is None:
        return None
    can_touch = (compiled.geom_contype != 0) | (compiled.geom_conaffinity != 0)
    can_touch[compiled.pair_geom1] = True
    can_touch[compiled.pair_geom2] = True
    falling = carried_by(model, model.jnt_bodyid[model.jnt_type == JointType.FREE].tolist())
    grounds = can_touch & ~np.isin(model.geom_bodyid, list(falling))
    if free_joint_of_base(model) is None:
        grounds &= np.isin(compiled.geom_type, (_PLANE, _HFIELD))
    return bool(grounds.any())
