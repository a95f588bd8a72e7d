"""Forward kinematics by Pinocchio: the independent witness.

Pinocchio reads the robot's file with its own parser and computes poses with its own
code. This module imports no backend, and no backend imports it, so that where the
two agree, neither has copied from the other. Where it cannot read a file, it computes
from a compiled model's numbers: other code, and the same reading of the file.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .errors import BadInputError, ModelError, check_name
from .installed import require
from .interface import Array, JointType, Model
from .interface.checks import as_numbers, as_vector
from .model_files import checked_path
from .models import AnyPath
from .rotations import Placement, matrix_from_quat, xyzw_from_wxyz
from .witness import RobotReading, Segment, read_file, read_numbers

Kind = Literal["site", "body"]
_TYPES = {"free": JointType.FREE, "ball": JointType.BALL, "slide": JointType.SLIDE}


class FrameDefinition(NamedTuple):
    """Where a file fixes a frame: `pos` (3,) [m], `mat` (3, 3), in the body's frame."""

    body: str
    pos: Array
    mat: Array


class Kinematics:
    """Poses and Jacobians of a robot, by Pinocchio.

    Of a file, Pinocchio's parser is given the bodies, joints and sites: nothing else has a
    part in where they are.

    Args:
        model: An MJCF or URDF file, or the name of one of our models.
        joint_names: The joints in the order in which a qpos lists them; by default
            the order of an MJCF, which is MuJoCo's; of a URDF, Pinocchio's own, which
            is alphabetical along each chain.

    Attributes:
        joint_names: That order; "" for a joint without a name.
        joint_types: What each of these joints is.
        body_names, site_names: What `pose` knows. One without a name is called "body 7" or
            "site 3", by its place in MuJoCo's order; of a URDF, bodies are links.
        nq, nv: Lengths of qpos and qvel, in MuJoCo's layout.
        grade: "own reading" of the file, or "same reading" as the engine's.
        prepared: What was done to the file's text before Pinocchio read it.

    Raises:
        MissingEngineError: Pinocchio is not installed here.
        ModelError: Pinocchio cannot read this file, or would misread it.
        BadInputError: `joint_names` are not names.
    """

    def __init__(self, model: AnyPath, joint_names: Sequence[str] | None = None) -> None:
        pin, path = require("pinocchio"), checked_path(model)
        self._hold(pin, path, read_file(pin, path), joint_names)

    @classmethod
    def same_reading(cls, model: Model) -> Kinematics:
        """Return the poses by Pinocchio from the numbers that a Model was compiled to.

        This checks the code that computes. A misreading of the file is in the numbers, and
        cannot be seen.

        Raises:
            MissingEngineError: Pinocchio is not installed here.
            ModelError: The Model's backend does not start from a compiled model.
        """
        pin, compiled = require("pinocchio"), model.compiled
        if compiled is None:
            raise ModelError(f"{model.backend} does not start from a compiled model")
        names = (model.body_names, model.joint_names, model.site_names)
        kinematics = cls.__new__(cls)
        kinematics._hold(pin, model.path, read_numbers(pin, compiled, *names), None)
        return kinematics

    def _hold(
        self, pin: Any, path: Path, read: RobotReading, joint_names: Sequence[str] | None
    ) -> None:
        self._pin: Any = pin
        self.path: Path = path
        self.version: str = pin.__version__
        self._model: Any = read.model
        self._data: Any = self._model.createData()
        self._frames: dict[Kind, dict[str, int]] = {"site": read.sites, "body": read.bodies}
        self.grade: str = read.grade
        self.prepared: tuple[str, ...] = read.prepared
        self.body_names: tuple[str, ...] = tuple(read.bodies)
        self.site_names: tuple[str, ...] = tuple(read.sites)
        in_file = [segment.name for segment in read.joints]
        self.joint_names: tuple[str, ...] = _names(in_file if joint_names is None else joint_names)
        self._segments = _in_order(read, self.joint_names, path)
        self.joint_types: tuple[JointType, ...] = tuple(
            _TYPES.get(segment.kind, JointType.HINGE) for segment in self._segments
        )
        self.nq: int = sum(segment.nq for segment in self._segments)
        self.nv: int = sum(segment.nv for segment in self._segments)

    @property
    def zero_qpos(self) -> Array:
        """Return qpos (nq,) with every joint at zero; quaternions are the identity."""
        qpos = np.zeros(self.nq)
        for joint, start in zip(self.joint_types, self.qpos_starts, strict=True):
            if joint in (JointType.FREE, JointType.BALL):
                qpos[start + joint.nq - 4] = 1.0
        return qpos

    @property
    def qpos_starts(self) -> tuple[int, ...]:
        """Return where in qpos each joint starts, as `jnt_qposadr` of a Model."""
        ends = itertools.accumulate((joint.nq for joint in self.joint_types), initial=0)
        return tuple(ends)[:-1]

    @property
    def qvel_starts(self) -> tuple[int, ...]:
        """Return where in qvel each joint starts, as `jnt_dofadr` of a Model."""
        ends = itertools.accumulate((joint.nv for joint in self.joint_types), initial=0)
        return tuple(ends)[:-1]

    def pose(self, qpos: ArrayLike, name: str, kind: Kind = "site") -> Placement:
        """Return the world pose of a site or body: `pos` (3,) [m], `mat` (3, 3).

        Args:
            qpos: (nq,) in MuJoCo's layout, quaternions wxyz.
            name: Of the site or body; of a URDF, a link.
            kind: "site" or "body".

        Raises:
            UnknownNameError: There is no such frame.
            BadInputError: `qpos` has the wrong shape or is not finite.
        """
        positions, matrices = self.poses(as_vector(qpos, (self.nq,), "qpos")[None], name, kind)
        return Placement(positions[0], matrices[0])

    def poses(self, qpos: ArrayLike, name: str, kind: Kind = "site") -> Placement:
        """Return the world poses of a site or body: `pos` (N, 3) [m], `mat` (N, 3, 3).

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
        return Placement(positions, matrices)

    def jacobian(self, qpos: ArrayLike, name: str, kind: Kind = "site") -> Array:
        """Return the Jacobian (6, nv) of a site or body: d(linear, angular velocity)/d(qvel).

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
        """Return how a frame is fixed to a body, as the witness has read it.

        Raises:
            UnknownNameError: There is no such frame.
        """
        number = self._frame(name, kind)
        owners = {frame: own for own, frame in self._frames["body"].items()}
        owner = number
        while owner not in owners:  # a fixed joint may be between a site and its body
            owner = self._model.frames[owner].parentFrame
        placement = self._model.frames[number].placement
        offset = self._model.frames[owner].placement.actInv(placement)
        return FrameDefinition(
            owners[owner], np.array(offset.translation), np.array(offset.rotation)
        )

    def _frame(self, name: str, kind: Kind) -> int:
        check_name("kind of frame", kind, self._frames)
        known = self._frames[kind]
        check_name(f"{kind} in {self.path.name}", name, known)
        return known[name]

    def _configurations(self, qpos: ArrayLike) -> Array:
        """Return positions in Pinocchio's layout (N, nq), of positions in MuJoCo's (N, nq)."""
        ours = as_numbers(qpos, "qpos")
        ours = as_vector(ours, (*ours.shape[:1], self.nq), "qpos")
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
            else:
                part = part - segment.ref
            theirs[:, segment.idx_q : segment.idx_q + part.shape[1]] = part
            start += segment.nq
        return theirs


def shared_joints(kinematics: Kinematics, names: Sequence[str]) -> list[int]:
    """Return the joints of an engine's Model that the witness has, too, by their numbers.

    Args:
        kinematics: The witness.
        names: The engine's joints, "" for one without a name. Joints that only the engine
            has (of a free box) are left out.

    Raises:
        BadInputError: The witness has joints that are not among them, or that cannot be
            told apart.
    """
    own = kinematics.joint_names
    if own == tuple(names):
        return list(range(len(own)))
    lacking = sorted(set(own) - set(names))
    if not all(own):
        raise BadInputError(
            f"{kinematics.path.name} has joints without a name: they cannot be matched"
        )
    if lacking:
        raise BadInputError(f"the engine lacks joints of the witness: {', '.join(lacking)}")
    return [number for number, name in enumerate(names) if name in own]


def _in_order(read: RobotReading, wanted: Sequence[str], path: Path) -> list[Segment]:
    """Return the joints as segments of a qpos that lists them in the order `wanted`."""
    in_file = [segment.name for segment in read.joints]
    if list(wanted) == in_file:
        return list(read.joints)
    if sorted(in_file) != sorted(wanted) or len(set(in_file)) != len(in_file):
        raise ModelError(
            f"{path.name} has other joints than asked for: {', '.join(in_file)} "
            f"against {', '.join(wanted)}"
        )
    by_name = {segment.name: segment for segment in read.joints}
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
