"""The parts of a robot, by what drives and carries them: joints, bodies, contacts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

import numpy as np

from ..errors import BadInputError
from ..interface import Array, Contacts, JointType, Model
from ..interface.options import check_entries
from ..measures import ContactNames

ARM = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
_PLANE, _HFIELD = 0, 1  # mjtGeom


def is_the_arm(model: Model) -> bool:
    """Whether the robot is an SO-101, ours or another's: that what is driven has its names."""
    driven = model.actuator_jntid.tolist()
    return tuple(model.joint_names[joint] for joint in driven if joint >= 0) == ARM


def has_floor(model: Model) -> bool:
    """Whether a plane or a height field that can be touched stands still in the scene."""
    compiled = model.compiled
    if compiled is None:
        return False
    static = ~np.isin(model.geom_bodyid, list(carried_by(model, set(model.jnt_bodyid.tolist()))))
    touches = (compiled.geom_contype != 0) | (compiled.geom_conaffinity != 0)
    return bool((static & touches & np.isin(compiled.geom_type, (_PLANE, _HFIELD))).any())


def scalar_joint(model: Model, name: str) -> tuple[int, int]:
    """Addresses in qpos and qvel of a joint that must be a hinge or a slide."""
    joint = model.joint_id(name)
    if model.jnt_type[joint] not in (JointType.HINGE, JointType.SLIDE):
        raise BadInputError(f"joint {name!r} is neither a hinge nor a slide")
    return int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])


def command(model: Model, values: Iterable[float], name: str = "ctrl") -> Array:
    """A full ctrl (nu,) from values; the error says how many there should be, or which is none."""
    array = np.array(list(values), dtype=np.float64)
    if array.shape != (model.nu,):
        raise BadInputError(
            f"{name} wants {model.nu} numbers, one for each actuator; got {array.size}"
        )
    check_entries(array, name)
    return array


def carried_by(model: Model, bodies: Iterable[int]) -> frozenset[int]:
    """These bodies and all that hang on them."""
    carried = set(bodies)
    for body in range(1, model.nbody):  # parents come before children
        if int(model.body_parentid[body]) in carried:
            carried.add(body)
    return frozenset(carried)


def moved_by_actuators(model: Model) -> frozenset[int]:
    """The robot's moving part: what the actuated joints carry."""
    joints = [joint for joint in model.actuator_jntid.tolist() if joint >= 0]
    return carried_by(model, (int(model.jnt_bodyid[joint]) for joint in joints))


def trees_of_actuators(model: Model) -> frozenset[int]:
    """The whole robot: each tree of bodies of which an actuator drives a joint, its base included.

    Where actuators drive no joint (but a tendon, a site or a body), all trees that move.
    """
    joints = [joint for joint in model.actuator_jntid.tolist() if joint >= 0]
    bodies = {int(model.jnt_bodyid[joint]) for joint in joints or range(model.njnt)}
    for body in range(model.nbody - 1, 0, -1):  # parents come before children
        if body in bodies and model.body_parentid[body]:
            bodies.add(int(model.body_parentid[body]))
    return carried_by(model, bodies)


def touching(
    model: Model,
    contacts: Contacts,
    bodies: frozenset[int] | None = None,
    each_other: bool = False,
) -> tuple[str, ...]:
    """What of `bodies` touches what else, as "gripper on floor (fixed_tip)", each once.

    Without `bodies`, whatever touches; with `each_other`, also what of them touches one another.
    """
    geoms = contacts.geom
    if bodies is not None:
        inside = np.isin(model.geom_bodyid[geoms], list(bodies)).sum(axis=1)
        geoms = geoms[(inside == 1) | (each_other & (inside == 2))]
    names = ContactNames.of(model) if len(geoms) else None
    return tuple(dict.fromkeys(names.geoms(*pair) for pair in geoms.tolist())) if names else ()


def body_pairs(model: Model, contacts: Contacts) -> Counter[str]:
    """How many contacts each pair of bodies has, as {"gripper on box": 6}."""
    names = ContactNames.of(model)
    return Counter(names.pair(*geoms) for geoms in contacts.geom.tolist())
