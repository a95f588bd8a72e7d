"""Forward kinematics by Pinocchio: the independent witness.

Pinocchio reads the robot's file with its own parser and computes poses with its own
code. This module imports no backend, and no backend imports it, so that where the
two agree, neither has copied from the other.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .errors import BadInputError, ModelError, unknown_name
from .installed import require
from .interface import Array
from .interface.checks import as_vector, check_entries
from .models import resolve
from .rotations import matrix_from_quat, xyzw_from_wxyz
from .witness_file import read

Kind = Literal["site", "body"]


class Pose(NamedTuple):
    """World poses of one frame: `pos` (…, 3) [m] and `mat` (…, 3, 3)."""

    pos: Array
    mat: Array


class FrameDefinition(NamedTuple):
    """Where a file fixes a frame: `pos` (3,) [m], `mat` (3, 3), in the body's frame."""

    body: str
    pos: Array
    mat: Array


class Kinematics:
    """Poses and Jacobians of a robot, by Pinocchio.

    Args:
        model: An MJCF or URDF file, or the name of one of our models.
        joint_names: The joints in the order in which a qpos lists them; by default
            the order of an MJCF, which is MuJoCo's; of a URDF, Pinocchio's own, which
            is alphabetical along each chain.

    Attributes:
        joint_names: That order.
        nq, nv: Lengths of qpos and qvel, in MuJoCo's layout.

    Raises:
        MissingEngineError: Pinocchio is not installed here.
        ModelError: Pinocchio cannot read this file, or would misread it.
        BadInputError: `joint_names` are no names.
    """

    def __init__(
        self, model: str | os.PathLike[str], joint_names: Sequence[str] | None = None
    ) -> None:
        self._pin: Any = require("pinocchio")
        self.path: Path = resolve(model)
        self.version: str = self._pin.__version__
        self._model, in_file, self._misplaced = read(self._pin, self.path)
        self._data: Any = self._model.createData()
        self.joint_names: tuple[str, ...] = _names(in_file if joint_names is None else joint_names)
        self._segments = _segments(self._model, in_file, self.joint_names, self.path)
        self.nq: int = sum(segment.nq for segment in self._segments)
        self.nv: int = sum(segment.nv for segment in self._segments)

    def pose(self, qpos: ArrayLike, name: str, kind: Kind = "site") -> Pose:
        """World pose of a site or body: `pos` (3,), `mat` (3, 3).

        Args:
            qpos: (nq,) in MuJoCo's layout, quaternions wxyz.
            name: Of the site or body; of a URDF, a link.
            kind: "site" or "body".

        Raises:
            UnknownNameError: There is no such frame.
            BadInputError: `qpos` has the wrong shape or is not finite.
        """
        positions, matrices = self.poses(as_vector(qpos, (self.nq,), "qpos")[None], name, kind)
        return Pose(positions[0], matrices[0])

    def poses(self, qpos: ArrayLike, name: str, kind: Kind = "site") -> Pose:
        """World poses of a site or body: `pos` (N, 3), `mat` (N, 3, 3).

        Args:
            qpos: (N, nq) in MuJoCo's layout, quaternions wxyz.
            name: Of the site or body; of a URDF, a link.
            kind: "site" or "body".

        Raises:
            UnknownNameError: There is no such frame.
            BadInputError: `qpos` has the wrong shape or is not finite.
        """
        frame = self._frame(name, kind)
        configurations = self._configurations(qpos)
        positions = np.empty((len(configurations), 3))
        matrices = np.empty((len(configurations), 3, 3))
        model, data, compute = self._model, self._data, self._pin.framesForwardKinematics
        # Both are views of Pinocchio's memory, taken once: a third of the cost.
        pos, mat = data.oMf[frame].translation, data.oMf[frame].rotation
        for i, configuration in enumerate(configurations):
            compute(model, data, configuration)
            positions[i] = pos
            matrices[i] = mat
        return Pose(positions, matrices)

    def jacobian(self, qpos: ArrayLike, name: str, kind: Kind = "site") -> Array:
        """Jacobian (6, nv) of a site or body: d(linear, angular velocity)/d(qvel).

        World axes, at the frame's origin; columns in MuJoCo's layout, so that it
        equals `mj_jacSite`'s jacp over jacr.

        Args:
            qpos: (nq,) in MuJoCo's layout.
            name: Of the site or body.
            kind: "site" or "body".

        Raises:
            UnknownNameError: There is no such frame.
            BadInputError: `qpos` has the wrong shape or is not finite.
        """
        vector = as_vector(qpos, (self.nq,), "qpos")
        theirs: Array = self._pin.computeFrameJacobian(
            self._model,
            self._data,
            self._configurations(vector[None])[0],
            self._frame(name, kind),
            self._pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        ).reshape(6, self._model.nv)  # of one joint it comes as a vector
        ours = np.empty((6, self.nv))
        qadr = vadr = 0
        for segment in self._segments:
            columns = theirs[:, segment.idx_v : segment.idx_v + segment.nv]
            if segment.kind == "free":
                # Pinocchio's free velocity is in body axes, MuJoCo's linear part in world.
                turn = matrix_from_quat(_unit(vector[qadr + 3 : qadr + 7]))
                columns = np.hstack([columns[:, :3] @ turn.T, columns[:, 3:]])
            ours[:, vadr : vadr + segment.nv] = columns
            qadr, vadr = qadr + segment.nq, vadr + segment.nv
        return ours

    def definition(self, name: str, kind: Kind = "site") -> FrameDefinition:
        """How the file, as Pinocchio read it, fixes a frame to a body.

        Raises:
            UnknownNameError: There is no such frame.
        """
        frame = self._model.frames[self._frame(name, kind)]
        body = frame if kind == "body" else self._model.frames[frame.parentFrame]
        offset = body.placement.actInv(frame.placement)
        return FrameDefinition(body.name, np.array(offset.translation), np.array(offset.rotation))

    def _frame(self, name: str, kind: Kind) -> int:
        types = self._pin.FrameType
        wanted = {"site": types.OP_FRAME, "body": types.BODY}
        if kind not in tuple(wanted):
            raise unknown_name("kind of frame", kind, wanted)
        if kind == "site" and name in tuple(self._misplaced):
            raise ModelError(
                f"site {name!r} of {self.path.name} is placed by fromto, which Pinocchio's "
                "parser does not read"
            )
        # A joint and a body may share a name, so the name alone does not tell.
        known = [frame.name for frame in self._model.frames if frame.type == wanted[kind]]
        if name not in known:  # asked here: Pinocchio takes nothing but text
            raise unknown_name(f"{kind} in {self.path.name}", name, known)
        return self._model.getFrameId(name, wanted[kind])

    def _configurations(self, qpos: ArrayLike) -> Array:
        """(N, nq) in MuJoCo's layout to (N, nq) in Pinocchio's."""
        try:
            ours = np.asarray(qpos, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise BadInputError(f"qpos must be numbers of shape (N, {self.nq})") from error
        if ours.ndim != 2 or ours.shape[1] != self.nq:
            raise BadInputError(f"qpos wants shape (N, {self.nq}); got {ours.shape}")
        check_entries(ours, "qpos")
        theirs = np.empty((len(ours), self._model.nq))
        start = 0
        for segment in self._segments:
            part = ours[:, start : start + segment.nq]
            if segment.kind in ("free", "ball"):
                # Positions as they are, then the quaternion: wxyz here, xyzw there.
                quat = _unit(part[:, -4:])
                part = np.hstack([part[:, :-4], xyzw_from_wxyz(quat)])
            elif segment.kind == "unbounded":
                part = np.hstack([np.cos(part), np.sin(part)])
            theirs[:, segment.idx_q : segment.idx_q + part.shape[1]] = part
            start += segment.nq
        return theirs


class _Segment(NamedTuple):
    """One joint: its kind, its size in MuJoCo's layout, its place in Pinocchio's."""

    kind: str
    nq: int
    nv: int
    idx_q: int
    idx_v: int


def _segments(
    model: Any, in_file: Sequence[str], wanted: Sequence[str], path: Path
) -> list[_Segment]:
    """Pinocchio's joints as segments of a qpos whose joints come in the order `wanted`."""
    found: list[_Segment] = []
    for joint in list(model.joints)[1:]:
        name = joint.shortname()
        if name.endswith("FreeFlyer"):
            found.append(_Segment("free", 7, 6, joint.idx_q, joint.idx_v))
        elif name.endswith("Spherical"):
            found.append(_Segment("ball", 4, 3, joint.idx_q, joint.idx_v))
        elif (joint.nq, joint.nv) == (2, 1):
            found.append(_Segment("unbounded", 1, 1, joint.idx_q, joint.idx_v))
        elif joint.nq == joint.nv:  # one joint, or several of one body
            for k in range(joint.nq):
                found.append(_Segment("plain", 1, 1, joint.idx_q + k, joint.idx_v + k))
        else:
            raise ModelError(f"{path.name}: a joint of Pinocchio's kind {name} is not handled")
    if len(found) != len(in_file):
        raise ModelError(
            f"{path.name} has {len(in_file)} joints, and Pinocchio made {len(found)} of them"
        )
    if list(wanted) == list(in_file):
        return found
    by_name = dict(zip(in_file, found, strict=True))
    if sorted(by_name) != sorted(wanted):
        raise ModelError(
            f"{path.name} has other joints than asked for: {', '.join(in_file)} "
            f"against {', '.join(wanted)}"
        )
    return [by_name[name] for name in wanted]


def _names(given: Sequence[str]) -> tuple[str, ...]:
    listed = isinstance(given, Iterable) and not isinstance(given, str)
    names = tuple(given) if listed else ()
    if not listed or not all(isinstance(name, str) for name in names):
        raise BadInputError(f"joint_names must be a list of names; got {given!r}")
    return names


def _unit(quat: Array) -> Array:
    norm = np.linalg.norm(quat, axis=-1, keepdims=True)
    if not norm.all():
        raise BadInputError("a quaternion of qpos is zero: it names no rotation")
    return quat / norm
