"""The trees of bodies in one world of PyBullet's: which number there is what of the model."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import ModelError, UnsupportedError
from ...interface import JointType
from . import urdf
from .client import joint_infos, pb
from .plan import Plan

_SCALAR = (0, 1)  # PyBullet's kinds of a joint whose position is a number
_KINDS = {2: "spherical", 3: "planar"}


class Tree:
    """One mechanism in one world: a tree of bodies, or several that stand on the world together.

    Attributes:
        root: MuJoCo's id of its root, of several trees that of the first.
        body: PyBullet's id of it.
        free: Whether it floats: its first joint is then the root's free joint.
        driven: Whether `JointDynamics` drive it: it has joints, or more than gravity moves it.
        joints: PyBullet's indices of its joints, but for the free one.
        dofs: (n,) degrees of freedom: the six of a free joint, then those of the joints.
        base: How many of them are the free joint's.
        qpos, qvel: What of these arrays is the tree's: a slice where that is enough.
        links: PyBullet's index of each body's link; -1 is the base.
        parts: The same of each further solid of a body, by body and part.
        tips: PyBullet's index of each site's link, where it has one.
    """

    def __init__(self, plan: Plan, root: int, body: int, client: int) -> None:
        raw, names = plan.raw, plan.names
        self.root, self.body = root, body
        self.free = urdf.floats(raw, root)
        infos = joint_infos(client, body)
        indices = {info[12].decode(): info[0] for info in infos}
        bodies = plan.bodies(root)
        self.links = {b: indices.get(names.links[b], -1) for b in bodies}
        self.parts: dict[tuple[int, int], int] = {}
        for solid in plan.surfaces.solids:
            if solid.part and solid.body in self.links:
                link, *_ = names.part(solid.body, solid.part)
                self.parts[solid.body, solid.part] = indices.get(link, -1)
        sites = [s for s in range(raw.nsite) if root and raw.site_bodyid[s] in self.links]
        self.tips = {s: indices[names.tips[s]] for s in sites if names.tips[s] in indices}
        by_name = {names.joints[j]: j for b in bodies for j in urdf.axes(raw, b)}
        moving = [(info[0], by_name[info[1].decode()]) for info in infos if info[3] >= 0]
        self.joints = [index for index, _ in moving]
        self.driven = plan.driven(root)
        self.base = 6 * self.free
        first = int(raw.body_jntadr[root])
        ids = [joint for _, joint in moving]
        places = raw.jnt_qposadr[ids].astype(int)
        self.dofs = raw.jnt_dofadr[ids].astype(int)
        if self.free:
            places = np.r_[raw.jnt_qposadr[first] + np.arange(7), places]
            self.dofs = np.r_[raw.jnt_dofadr[first] + np.arange(6), self.dofs]
        self.qpos, self.qvel = _index(places), _index(self.dofs)


def _index(places: Any) -> Any:
    """Return indices of an array: a slice, which NumPy takes faster, where they follow one
    another.
    """
    if not len(places) or (np.diff(places) == 1).all():
        start = int(places[0]) if len(places) else 0
        return slice(start, start + len(places))
    return places


class FileTree(Tree):
    """The whole robot of a URDF that PyBullet read itself, which is one of its bodies.

    Attributes:
        bodies: (nlinks + 1) MuJoCo's body of each of PyBullet's links, the base last: links that a
            fixed joint holds are one body of MuJoCo's.
        carrier: PyBullet's link that the free joint moves; -1 where that is the base, or none.
        standing: The free joint that PyBullet makes a fixed one, with a base that does not move;
            -1 for none.
    """

    def __init__(self, plan: Plan, body: int, client: int) -> None:
        """Find the joints and links of a file by their names.

        Raises:
            UnsupportedError: It has a joint of which PyBullet has another idea.
            ModelError: PyBullet finds other joints in it than MuJoCo.
        """
        raw = plan.raw
        self.body, self.parts, self.tips = body, {}, {}
        infos = joint_infos(client, body)
        base = pb.getBodyInfo(body, client)[0].decode()
        numbers = {base: -1} | {info[12].decode(): info[0] for info in infos}
        known: dict[str, int] = {raw.body(b).name: b for b in range(1, raw.nbody)}
        self.links = {b: numbers[name] for name, b in known.items() if name in numbers}
        self.bodies: list[int] = [0] * (len(infos) + 1)
        self.bodies[-1] = known.get(base, 0)
        for info in infos:
            above = self.bodies[int(info[16])]
            name = info[12].decode()
            self.bodies[int(info[0])] = known.get(name, above)
        free = np.flatnonzero(raw.jnt_type == int(JointType.FREE)).tolist()
        strange = [_KINDS[info[2]] for info in infos if info[2] in _KINDS]
        if len(free) > 1:
            strange.append("several floating")
        if strange:
            raise UnsupportedError(
                f"PyBullet as it comes does not support what this model has: {strange[0]} joint",
                backend="pybullet",
                feature=f"{strange[0]} joint",
                reason="the engine reads it otherwise",
            )
        by_name = {raw.joint(j).name: j for j in range(raw.njnt) if j not in free}
        moving = [(info[0], info[1].decode()) for info in infos if info[2] in _SCALAR]
        if {name for _, name in moving} != set(by_name) or len(self.links) != raw.nbody - 1:
            raise ModelError(f"PyBullet finds other joints in {plan.file and plan.file.path.name}")
        self.joints = [index for index, _ in moving]
        ids = [by_name[name] for _, name in moving]
        moves = pb.getDynamicsInfo(body, -1, client)[0] > 0
        self.free = bool(free) and moves
        self.standing = free[0] if free and not moves else -1
        self.root = int(raw.jnt_bodyid[free[0]]) if free else 0
        self.carrier = self.links[self.root] if free else -1
        self.base = 6 * self.free
        places, dofs = raw.jnt_qposadr[ids].astype(int), raw.jnt_dofadr[ids].astype(int)
        if self.free:
            first = free[0]
            places = np.r_[raw.jnt_qposadr[first] + np.arange(7), places]
            dofs = np.r_[raw.jnt_dofadr[first] + np.arange(6), dofs]
        self.driven = bool(len(dofs))
        self.dofs = dofs
        self.qpos, self.qvel = _index(places), _index(dofs)
