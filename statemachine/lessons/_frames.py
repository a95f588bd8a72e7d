"""Which places of a robot a certificate is about, and the poses that it is made at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import BadInputError, check_name
from ..interface import Array, JointType, Model, make_data
from ..kinematics import Kind
from ..runs.robot import carried_by
from ..witness import labels
from ._robot import FINGERTIP

_WIDE = 100.0  # a range beyond this [m or rad] is no limit


class Tip(NamedTuple):
    """A site or a body.

    Attributes:
        name: Its name, or "body 7" where it has none.
        kind: "site" or "body".
        number: Its id on the engine.
        body: Id of the body that it is, or that carries it.
        named: Whether the file names it.
    """

    name: str
    kind: Kind
    number: int
    body: int
    named: bool


def tips_of(model: Model, name: str | None) -> list[Tip]:
    """What to certify.

    Args:
        model: The robot.
        name: A site, or a body; without one, the site gripperframe where there is one, else
            every body that joints move and that carries no other.

    Raises:
        UnknownNameError: There is no such site or body.
        BadInputError: No name is given, and nothing moves.
    """
    sites = labels("site", model.site_names)
    bodies = labels("body", model.body_names)
    wanted = FINGERTIP if name is None and FINGERTIP in sites else name
    if wanted is None:
        parents = set(model.body_parentid.tolist())
        moved = carried_by(model, model.jnt_bodyid.tolist())
        leaves = [body for body in sorted(moved) if body not in parents]
        if not leaves:
            raise BadInputError(f"nothing in {model.path.name} is moved by a joint: name a --site")
        return [Tip(bodies[k], "body", k, k, bool(model.body_names[k])) for k in leaves]
    if wanted in sites:
        site = sites.index(wanted)
        named = bool(model.site_names[site])
        return [Tip(wanted, "site", site, int(model.site_bodyid[site]), named)]
    check_name("site or body", wanted, [*sites, *bodies])
    body = bodies.index(wanted)
    return [Tip(wanted, "body", body, body, bool(model.body_names[body]))]


def random_qpos(model: Model, joints: Sequence[int], count: int, seed: int) -> Array:
    """(count, nq): the default pose, then uniform within limits; without, ±π rad and ±1 m.

    Args:
        model: The robot.
        joints: Ids of those that move; the others stay where they are.
        count: How many.
        seed: Of the random poses.
    """
    random = np.random.default_rng(seed)
    with make_data(model) as data:
        start = data.qpos.copy()
    drawn = np.tile(start, (count, 1))
    count -= 1
    for joint in joints:
        place, kind = int(model.jnt_qposadr[joint]), JointType(int(model.jnt_type[joint]))
        if kind in (JointType.HINGE, JointType.SLIDE):
            low, high = model.jnt_range[joint]
            if not model.jnt_limited[joint] or high - low > _WIDE:
                high = np.pi if kind == JointType.HINGE else 1.0
                low = -high
            drawn[1:, place] = random.uniform(low, high, count)
            continue
        if kind == JointType.FREE:
            drawn[1:, place : place + 3] = random.uniform(-1, 1, (count, 3))
            place += 3
        quat = random.normal(size=(count, 4))
        drawn[1:, place : place + 4] = quat / np.linalg.norm(quat, axis=1, keepdims=True)
    return drawn


def slots(model: Model, joints: Sequence[int]) -> list[int]:
    """Slots of qpos that belong to these joints, in their order."""
    starts, kinds = model.jnt_qposadr.tolist(), model.jnt_type.tolist()
    return [starts[j] + k for j in joints for k in range(JointType(kinds[j]).nq)]
