"""A compiled MuJoCo model as a description: defaults, includes and units are settled in it.

An MJCF is what MuJoCo makes of it, so its own compiler reads it. A URDF that was given to
MuJoCo can be described from here too, to see what the import kept.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...description.meshes import volume_of
from ...description.records import (
    CollisionShape,
    Inertial,
    Link,
    NamedFrame,
    Robot,
    RobotJoint,
    Setting,
    moved,
)
from ...installed import require
from ...interface import Array
from ...rotations import Placement, matrix_from_quat
from . import _description_drives as drives

_JOINTS = ("free", "ball", "slide", "hinge")  # mjtJoint, in its order
_NUMBERS = (  # of the options, those that change what is computed
    "timestep",
    "gravity",
    "impratio",
    "iterations",
    "tolerance",
    "ls_iterations",
    "ls_tolerance",
    "noslip_iterations",
    "ccd_iterations",
    "density",
    "viscosity",
    "wind",
    "magnetic",
)
_CONTACT = ("condim", "priority", "solref", "solimp", "solmix", "margin", "gap")


def description_of(raw: Any, name: str, reader: str, form: str) -> Robot:
    """The description in a compiled model.

    Args:
        raw: An mjModel.
        name: Of the file.
        reader: What compiled it.
        form: The format of the file.
    """
    mujoco = require("mujoco")
    links: list[Link] = []
    bottom: dict[int, str] = {}
    names = _names(raw.nbody, raw.body, "body")
    for body in range(raw.nbody):
        links += _links(mujoco, raw, body, names[body], bottom)
        bottom[body] = names[body]
    actuators = tuple(drives.actuator(mujoco, raw, i) for i in range(raw.nactuator))
    empty = _empty(mujoco)
    return Robot(
        name=name,
        reader=reader,
        format=form,
        links=tuple(links),
        frames=tuple(
            NamedFrame(
                site or f"site {i}",
                bottom[int(raw.site_bodyid[i])],
                _place(raw.site_pos[i], raw.site_quat[i]),
            )
            for i, site in enumerate(raw.site(i).name for i in range(raw.nsite))
        ),
        actuators=actuators,
        settings=_settings(mujoco, raw),
        defaults=_settings(mujoco, empty),
        touch=_touch(empty, 0),
        rooted=True,
        notes=tuple(_notes(raw)),
    )


def _empty(mujoco: Any) -> Any:
    """What the engine takes where a file says nothing."""
    return mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom type='sphere' size='1'/></worldbody></mujoco>"
    )


def _names(count: int, of: Any, kind: str) -> list[str]:
    return [of(i).name or f"{kind} {i}" for i in range(count)]


def _place(pos: Array, quat: Array) -> Placement:
    return Placement(np.array(pos), matrix_from_quat(quat))


def _links(mujoco: Any, raw: Any, body: int, name: str, bottom: dict[int, str]) -> list[Link]:
    """A body as a link; one with several joints as a chain, of which it is the last."""
    place = _place(raw.body_pos[body], raw.body_quat[body])
    if not body:
        shapes = _shapes(mujoco, raw, body)
        return [Link(name, "", place, None, None, shapes)]
    parent, links = bottom[int(raw.body_parentid[body])], []
    first, count = int(raw.body_jntadr[body]), int(raw.body_jntnum[body])
    inertial = _inertial(raw, body)
    for joint in range(first, first + count):
        moves = _joint(raw, joint, name)
        start = place @ moved(moves, -float(raw.qpos0[raw.jnt_qposadr[joint]]))
        last = joint == first + count - 1
        label = name if last else f"{name}, above {raw.joint(joint + 1).name or joint + 1}"
        links.append(
            Link(
                label,
                parent,
                start,
                moves,
                inertial if last else None,
                _shapes(mujoco, raw, body) if last else (),
            )
        )
        parent, place = label, Placement(np.zeros(3), np.eye(3))
    if not count:
        links = [Link(name, parent, place, None, inertial, _shapes(mujoco, raw, body))]
    return links


def _inertial(raw: Any, body: int) -> Inertial | None:
    frame = matrix_from_quat(raw.body_iquat[body])
    tensor = frame @ np.diag(raw.body_inertia[body]) @ frame.T
    return Inertial(float(raw.body_mass[body]), np.array(raw.body_ipos[body]), tensor)


def _joint(raw: Any, joint: int, body: str) -> RobotJoint:
    dof, kind = int(raw.jnt_dofadr[joint]), _JOINTS[int(raw.jnt_type[joint])]
    spring = int(raw.jnt_qposadr[joint])
    scalar = kind in ("slide", "hinge")
    return RobotJoint(
        name=raw.joint(joint).name or _unnamed(raw, joint, body),
        kind=kind,
        axis=np.array(raw.jnt_axis[joint]),
        anchor=np.array(raw.jnt_pos[joint]),
        limits=drives.limited(raw.jnt_range[joint], raw.jnt_limited[joint]),
        velocity=None,
        effort=drives.effort(raw, joint) if scalar else None,
        armature=float(raw.dof_armature[dof]),
        damping=float(raw.dof_damping[dof]),
        friction=float(raw.dof_frictionloss[dof]),
        stiffness=float(raw.jnt_stiffness[joint]),
        rest=float(raw.qpos_spring[spring]) if scalar else None,
        follows=_follows(raw, joint),
    )


def _unnamed(raw: Any, joint: int, body: str) -> str:
    """What a joint without a name is called; a body may have several."""
    carries = int(raw.jnt_bodyid[joint])
    first, count = int(raw.body_jntadr[carries]), int(raw.body_jntnum[carries])
    return f"the joint of {body}" if count == 1 else f"joint {joint - first + 1} of {body}"


def _follows(raw: Any, joint: int) -> tuple[str, float, float] | None:
    """Of an equality between two joints, if it is linear."""
    for i in range(raw.neq):
        if raw.eq_type[i] == 2 and raw.eq_obj1id[i] == joint and raw.eq_obj2id[i] >= 0:
            offset, factor, *rest = map(float, raw.eq_data[i, :5])
            if raw.eq_active0[i] and not any(rest):
                return raw.joint(int(raw.eq_obj2id[i])).name, factor, offset
    return None


def _shapes(mujoco: Any, raw: Any, body: int) -> tuple[CollisionShape, ...]:
    start = int(raw.body_geomadr[body])
    geoms = range(start, start + int(raw.body_geomnum[body]))
    return tuple(
        _shape(mujoco, raw, g) for g in geoms if raw.geom_contype[g] or raw.geom_conaffinity[g]
    )


def _shape(mujoco: Any, raw: Any, geom: int) -> CollisionShape:
    kind = mujoco.mjtGeom(int(raw.geom_type[geom])).name.removeprefix("mjGEOM_").lower()
    counts = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}
    size = tuple(map(float, raw.geom_size[geom][: counts.get(kind, 0)]))
    points = triangles = None
    if kind == "mesh":
        mesh = int(raw.geom_dataid[geom])
        first, faces = int(raw.mesh_vertadr[mesh]), int(raw.mesh_faceadr[mesh])
        points = np.array(raw.mesh_vert[first : first + raw.mesh_vertnum[mesh]], dtype=np.float64)
        triangles = points[raw.mesh_face[faces : faces + raw.mesh_facenum[mesh]]]
    touch = _touch(raw, geom)
    return CollisionShape(
        kind=kind,
        place=_place(raw.geom_pos[geom], raw.geom_quat[geom]),
        size=size,
        points=points,
        volume=volume_of(kind, size, triangles),
        name=raw.geom(geom).name,
        friction=touch.pop("friction"),
        contact=touch,
    )


def _touch(raw: Any, geom: int) -> dict[str, tuple[float, ...]]:
    """Settings of a geom's contacts."""
    return {
        name: tuple(map(float, np.atleast_1d(getattr(raw, f"geom_{name}")[geom])))
        for name in ("friction", *_CONTACT)
    }


def _settings(mujoco: Any, raw: Any) -> dict[str, Setting]:
    found: dict[str, Setting] = {}
    for name in _NUMBERS:
        value = getattr(raw.opt, name)
        found[name] = float(value) if np.ndim(value) == 0 else tuple(map(float, value))
    for name, words in (
        ("integrator", mujoco.mjtIntegrator),
        ("cone", mujoco.mjtCone),
        ("solver", mujoco.mjtSolver),
    ):
        found[name] = words(int(getattr(raw.opt, name))).name.rpartition("_")[2].lower()
    found["turned off"] = _flags(mujoco.mjtDisableBit, raw.opt.disableflags)
    found["turned on"] = _flags(mujoco.mjtEnableBit, raw.opt.enableflags)
    return found


def _flags(bits: Any, value: int) -> str:
    names = [
        name.partition("_")[2].lower()
        for name, bit in bits.__members__.items()
        if int(bit).bit_count() == 1 and int(bit) & int(value)
    ]
    return ", ".join(names) or "nothing"


def _notes(raw: Any) -> list[str]:
    """What no other format has a word for."""
    linear = sum(_follows(raw, joint) is not None for joint in range(raw.njnt))
    counted = {
        "further equality constraints": raw.neq - linear,
        "tendons": raw.ntendon,
        "contact pairs of its own": raw.npair,
        "pairs without contact": raw.nexclude,
        "bodies freed of weight (gravcomp)": np.count_nonzero(raw.body_gravcomp),
    }
    said = [f"{count} {what}" for what, count in counted.items() if count]
    notes = [f"it has {', '.join(said)}"] if said else []
    return notes + [text for i in range(raw.nactuator) if (text := drives.beyond(raw, i))]
