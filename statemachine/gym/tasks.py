"""The tasks: where an episode starts, what is observed, what is rewarded, when it ends.

All of it is computed on rows, one a world, by operations that take each row alone. So one Env
and many worlds get the same bits.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..backends import load
from ..errors import BadInputError, check_name
from ..interface import Array, Model, forward, make_data
from ..interface.options import as_count, as_vector
from ..page import Figures

TIP = "gripperframe"  # the site between the tips of the jaws
_BEYOND_RANGE = 0.5  # rad; joint limits are soft, and random commands go beyond by 0.06
_FASTEST = 1e3  # rad/s or m/s; random commands reach 20
_UNIT = 1 + 1e-9  # of a quaternion's number, which rounding may leave above 1
_FAR = 10.0  # m; how far away a point may be in an observation


# Where an episode starts, beyond the task's keyframe: qpos (nq,) or None; its target (3,).
EpisodeStart = tuple[Array | None, Array]


class Task(ABC):
    """A task on one backend.

    Attributes:
        name, id: As `ArmEnv` takes it, and as Gymnasium does.
        scene: Name of the model.
        keyframe: Where an episode starts; None for the default state.
        episode: Control steps after which it is truncated.
        near: A success is nearer than this [m].
        model: The Model.
        frame_skip: Timesteps of a control step.
        low, high: (k,) bounds of an observation.
    """

    name: ClassVar[str]
    id: ClassVar[str]
    scene: ClassVar[str]
    keyframe: ClassVar[str | None] = None
    episode: ClassVar[int]
    near: ClassVar[float]

    def __init__(self, backend: str, frame_skip: int) -> None:
        """Load the model.

        Raises:
            UnknownNameError: There is no such backend.
            MissingEngineError: Its engine is not installed here.
            BadInputError: `frame_skip` is not a whole number of at least 1.
        """
        self.frame_skip = as_count(frame_skip, "frame_skip")
        self.model: Model = load(self.scene, backend=backend)
        self.tip = self.model.site_id(TIP)
        low, high = self.model.actuator_ctrlrange.T
        self._middle, self._half = (low + high) / 2, (high - low) / 2
        self._poses = _Poses()
        self.low, self.high = self._bounds()

    def ctrl(self, action: ArrayLike, shape: tuple[int, ...]) -> Array:
        """Commands [rad] for actions of a shape (…, nu); beyond -1 to 1 the nearest counts.

        Raises:
            BadInputError: The shape is another one, or an entry is not finite.
        """
        return self._middle + self._half * np.clip(as_vector(action, shape, "action"), -1, 1)

    def action(self, ctrl: Array) -> NDArray[np.float32]:
        """The actions for commands [rad]."""
        return np.clip((ctrl - self._middle) / self._half, -1, 1).astype(np.float32)

    def observed(self, qpos: Array, qvel: Array, tip: Array, target: Array) -> Array:
        """Observations (n, k): qpos, qvel, fingertip, target, and the way to the target."""
        way = target - self.point(qpos, tip)
        return np.concatenate([qpos, qvel, tip, target, way], axis=1)

    def outside(self, observations: Array) -> NDArray[np.bool_]:
        """(n,) Which are not observations of this task: an engine has lost the scene there."""
        inside = (observations >= self.low) & (observations <= self.high)  # NaN is not
        return np.logical_not(inside.all(axis=1))

    @abstractmethod
    def point(self, qpos: Array, tip: Array) -> Array:
        """(n, 3) what is to come to the target, of rows of qpos (n, nq) and fingertips (n, 3)."""

    @abstractmethod
    def start(self, rng: np.random.Generator) -> EpisodeStart:
        """Draw an episode; the same numbers on every backend."""

    @abstractmethod
    def outcome(self, observations: Array) -> Figures:
        """What observations (n, k) are worth.

        Returns:
            distance: (n,) from the target [m].
            reward: (n,).
            success, terminated: (n,) whether it is so.
        """

    def _bounds(self) -> tuple[Array, Array]:
        model = self.model
        low, high = np.empty(model.nq), np.empty(model.nq)
        for joint, start in enumerate(model.jnt_qposadr.tolist()):
            if model.jnt_limited[joint]:
                low[start] = model.jnt_range[joint, 0] - _BEYOND_RANGE
                high[start] = model.jnt_range[joint, 1] + _BEYOND_RANGE
            else:  # the box
                high[start : start + 7] = [_FAR] * 3 + [_UNIT] * 4
                low[start : start + 7] = -high[start : start + 7]
        rest = np.concatenate([np.full(model.nv, _FASTEST), np.full(9, _FAR)])
        return np.concatenate([low, -rest]), np.concatenate([high, rest])


class Reach(Task):
    """Bring the fingertip to a point. The reward is minus the distance [m].

    The actions -1 and 1 are the ends of `ctrlrange`.
    """

    name = "reach"
    id = "statemachine/Reach-v0"
    scene = "so101/scene"
    episode = 100
    near = 0.01

    def point(self, qpos: Array, tip: Array) -> Array:
        """The fingertip."""
        return tip

    def start(self, rng: np.random.Generator) -> EpisodeStart:
        """Near the default pose; the target is the fingertip of another pose."""
        model = self.model
        qpos = rng.uniform(-0.05, 0.05, model.nq)
        low, high = model.jnt_range.T
        while True:
            pose = rng.uniform(low, high)
            pose[-1] = 0.0
            tip, _, touching = self._poses(pose)
            if not touching and tip[2] > 0.03:
                return qpos, tip

    def outcome(self, observations: Array) -> Figures:
        """It never ends before its time, as the fingertip is to stay there."""
        distance = _length(observations[:, -3:])
        never = np.zeros(len(distance), dtype=np.bool_)
        return Figures(
            distance=distance, reward=-distance, success=distance < self.near, terminated=never
        )


class HeldBox(Task):
    """Carry the box that the jaws hold to a point, and do not drop it.

    The reward is 1 for each step in which it is held, less the distance [m]. Without the 1,
    to drop it soon would pay. The action 0 is the command of the keyframe, which holds it; -1
    and 1 are `around` less and more.
    """

    name = "held_box"
    id = "statemachine/HeldBox-v0"
    scene = "so101/scene_box"
    keyframe = "held"
    episode = 150
    near = 0.02
    lost = 0.03  # m; where the jaws hold it, its middle is 9 mm from the fingertip
    spread = (0.6, 0.3, 0.3, 0.3, 0.0, 0.0)  # rad; of the targets' poses about the keyframe's
    around = (0.8, 0.5, 0.5, 0.5, 0.2, 0.1)  # rad; the last opens the jaws

    def __init__(self, backend: str, frame_skip: int) -> None:
        """Load the model, and find where in the jaws the box is."""
        super().__init__(backend, frame_skip)
        model = self.model
        self.box = int(model.jnt_qposadr[model.joint_id("box")])
        keyframe = model.keyframes[model.key_id("held")]
        self._middle, self._half = keyframe.ctrl, np.array(self.around)
        held = keyframe.qpos
        self._arm = held[: self.box]
        self._from = held[self.box : self.box + 3]
        tip, turn, _ = self._poses(self._arm)
        self._in_hand = turn.T @ (self._from - tip)

    def point(self, qpos: Array, tip: Array) -> Array:
        """The middle of the box."""
        return qpos[:, self.box : self.box + 3]

    def start(self, rng: np.random.Generator) -> EpisodeStart:
        """From the keyframe; the target is where the box would be in another pose."""
        spread, (low, high) = np.array(self.spread), self.model.jnt_range[: len(self.spread)].T
        while True:
            pose = np.clip(self._arm + rng.uniform(-spread, spread), low, high)
            tip, turn, touching = self._poses(pose)
            target = tip + turn @ self._in_hand
            far = np.linalg.norm(target - self._from)
            if not touching and target[2] > self._from[2] and far > 2 * self.near:
                return None, target

    def outcome(self, observations: Array) -> Figures:
        """It ends when the box is no longer between the jaws."""
        tip, way = observations[:, -9:-6], observations[:, -3:]
        away = observations[:, self.box : self.box + 3] - tip
        distance, dropped = _length(way), _length(away) > self.lost
        success = (distance < self.near) & ~dropped
        return Figures(
            distance=distance, reward=~dropped - distance, success=success, terminated=dropped
        )


TASKS: dict[str, type[Task]] = {task.name: task for task in (Reach, HeldBox)}


def refuse_unknown(given: Mapping[str, object], known: Sequence[str]) -> None:
    """Refuse an option that the environments do not have.

    Args:
        given: What was given beyond their options, by name.
        known: Names of their options.

    Raises:
        BadInputError: It is another model.
        UnknownNameError: It is another option.
    """
    if "model" in given:
        raise BadInputError(
            "the tasks are of the SO-101 with its scenes, and take no other model; write an Env of "
            "your own on sm.load, sm.reset and sm.step"
        )
    for name in given:
        check_name("option", name, known)


def make_task(name: str, backend: str, frame_skip: int) -> Task:
    """A task by its name.

    Raises:
        UnknownNameError: There is no such task or backend.
    """
    check_name("task", name, TASKS)
    return TASKS[name](backend, frame_skip)


class _Poses:
    """The fingertip of poses of the arm above the floor, by one engine for all backends."""

    def __init__(self) -> None:
        self._model = load(Reach.scene)
        self._data = make_data(self._model)
        self._tip = self._model.site_id(TIP)

    def __call__(self, qpos: Array) -> tuple[Array, Array, bool]:
        """Position (3,) and axes (3, 3) of the fingertip for the joints (6,); does it touch?"""
        self._data.qpos[:] = qpos
        forward(self._model, self._data)
        tip, turn = self._data.site_xpos[self._tip], self._data.site_xmat[self._tip]
        return tip.copy(), turn.reshape(3, 3).copy(), len(self._data.contacts) > 0


def _length(way: Array) -> Array:
    """(n,) of vectors (n, 3). A norm over an axis may sum in another order for other n."""
    return np.sqrt(way[:, 0] ** 2 + way[:, 1] ** 2 + way[:, 2] ** 2)
