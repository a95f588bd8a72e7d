"""Numbers by which a compiled model says of what kind an element is: MuJoCo's enumerations.

Those of actuators stand in `actuators`, what a model's options say in `flags`.
"""

from __future__ import annotations

from enum import IntEnum

import mujoco


class GeomKind(IntEnum):
    """Shapes of geoms: `geom_type`."""

    PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
    HFIELD = int(mujoco.mjtGeom.mjGEOM_HFIELD)
    SPHERE = int(mujoco.mjtGeom.mjGEOM_SPHERE)
    CAPSULE = int(mujoco.mjtGeom.mjGEOM_CAPSULE)
    ELLIPSOID = int(mujoco.mjtGeom.mjGEOM_ELLIPSOID)
    CYLINDER = int(mujoco.mjtGeom.mjGEOM_CYLINDER)
    BOX = int(mujoco.mjtGeom.mjGEOM_BOX)
    MESH = int(mujoco.mjtGeom.mjGEOM_MESH)
    SDF = int(mujoco.mjtGeom.mjGEOM_SDF)


class EqualityKind(IntEnum):
    """Kinds of equality constraints: `eq_type`."""

    CONNECT = int(mujoco.mjtEq.mjEQ_CONNECT)
    WELD = int(mujoco.mjtEq.mjEQ_WELD)
    JOINT = int(mujoco.mjtEq.mjEQ_JOINT)
    TENDON = int(mujoco.mjtEq.mjEQ_TENDON)
    FLEX = int(mujoco.mjtEq.mjEQ_FLEX)
    FLEX_VERT = int(mujoco.mjtEq.mjEQ_FLEXVERT)
    FLEX_STRAIN = int(mujoco.mjtEq.mjEQ_FLEXSTRAIN)
    DISTANCE = int(mujoco.mjtEq.mjEQ_DISTANCE)


class WrapKind(IntEnum):
    """What a tendon goes over: `wrap_type`."""

    JOINT = int(mujoco.mjtWrap.mjWRAP_JOINT)
    PULLEY = int(mujoco.mjtWrap.mjWRAP_PULLEY)
    SITE = int(mujoco.mjtWrap.mjWRAP_SITE)
    SPHERE = int(mujoco.mjtWrap.mjWRAP_SPHERE)
    CYLINDER = int(mujoco.mjtWrap.mjWRAP_CYLINDER)


SITE = int(mujoco.mjtObj.mjOBJ_SITE)  # among the kinds of elements: `eq_objtype`
SMALLEST = float(mujoco.mjMINVAL)  # what MuJoCo divides by at least
