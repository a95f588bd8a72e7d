"""What one Env and many worlds share: what user functions read, and checks of what they return.

User functions are called once a world, on this world alone. So one Env and many worlds get the
same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike

from ..backends import load
from ..errors import BadInputError, shown
from ..installed import DEFAULT
from ..interface import Array, Data, Model, forward, make_data
from ..interface import reset as reset_data
from ..interface.checks import HUGE, as_count, as_numbers, as_switch, as_vector
from ..models import AnyPath

RENDER_MODES = ("rgb_array",)


class WorldView:
    """One world at one moment, as user functions read it.

    What is derived belongs to this moment: after the last timestep `forward` is called. Arrays are
    read-only and change with the next step: copy what is to be kept. Contacts are not here, as
    `Worlds` do not keep them.

    Attributes:
        model: The Model.
        goal: What `reset` drew for this episode, of any shape; empty where it drew none.
    """

    __slots__ = ("_read", "goal", "model")

    def __init__(self, model: Model, goal: Array, read: Callable[[str], Array]) -> None:
        """Take the functions that read the state.

        Args:
            model: The Model.
            goal: What `reset` drew.
            read: From the name of an array of a Data to this world's array.
        """
        self.model = model
        self.goal = goal
        self._read = read

    @property
    def time(self) -> float:
        """Return the simulated time since the episode began, or that of its keyframe and since
        [s].
        """
        return float(self._read("time"))

    @property
    def qpos(self) -> Array:
        """Return the positions (nq,) [rad or m]."""
        return self._read("qpos")

    @property
    def qvel(self) -> Array:
        """Return the velocities (nv,) [rad/s or m/s]."""
        return self._read("qvel")

    @property
    def ctrl(self) -> Array:
        """Return the commands (nu,) of the control step that ended now [unit of the actuator]."""
        return self._read("ctrl")

    @property
    def xpos(self) -> Array:
        """Return the origins (nbody, 3) of the bodies [m]."""
        return self._read("xpos")

    @property
    def xquat(self) -> Array:
        """Return the rotations (nbody, 4) of the bodies, wxyz."""
        return self._read("xquat")

    @property
    def site_xpos(self) -> Array:
        """Return the positions (nsite, 3) of the sites [m]."""
        return self._read("site_xpos")

    @property
    def site_xmat(self) -> Array:
        """Return the rotation matrices (nsite, 9) of the sites, row by row."""
        return self._read("site_xmat")

    @property
    def qacc(self) -> Array:
        """Return the accelerations (nv,) [rad/s² or m/s²]."""
        return self._read("qacc")

    @property
    def qfrc_bias(self) -> Array:
        """Return the Coriolis, centrifugal and gravity forces (nv,) [N·m or N]."""
        return self._read("qfrc_bias")

    @property
    def qfrc_actuator(self) -> Array:
        """Return the forces (nv,) of the actuators [N·m or N]."""
        return self._read("qfrc_actuator")

    @property
    def qfrc_passive(self) -> Array:
        """Return the forces (nv,) of springs and dampers [N·m or N]."""
        return self._read("qfrc_passive")

    @property
    def qfrc_constraint(self) -> Array:
        """Return the forces (nv,) of contacts, limits, friction and equalities [N·m or N]."""
        return self._read("qfrc_constraint")


@dataclass(frozen=True, eq=False)
class Start:
    """Where an episode starts, as `reset` draws it.

    Attributes:
        qpos: (nq,) positions [rad or m]; None for those of the keyframe or the default state.
        qvel: (nv,) velocities [rad/s or m/s]; None as above.
        goal: What the episode is about, such as the point to come to (3,) [m]; None for nothing.
    """

    qpos: ArrayLike | None = None
    qvel: ArrayLike | None = None
    goal: ArrayLike | None = None


Observe = Callable[[WorldView], ArrayLike]  # finite numbers, always of one shape
Reward = Callable[[WorldView], float]  # a finite number
Terminated = Callable[[WorldView], bool | np.bool_]  # whether the episode ends here
Info = Callable[[WorldView], dict[str, Any]]  # further facts, by name
Reset = Callable[[Model, np.random.Generator], Start]  # the seed decides it through the generator


def joint_state(world: WorldView) -> Array:
    """Return qpos and qvel (nq + nv,), one after the other."""
    return np.concatenate([world.qpos, world.qvel])


def unchanged_start(model: Model, rng: np.random.Generator) -> Start:
    """Return the keyframe or the default state itself, whatever the seed."""
    return Start()


def no_end(world: WorldView) -> bool:
    """Return False: the episode has no end but that of `max_episode_steps`."""
    return False


def no_facts(world: WorldView) -> dict[str, Any]:
    """Return no facts."""
    return {}


class Task:
    """What an environment is made of: a Model, user functions, and the spaces that follow.

    Attributes:
        model: The Model.
        reset, observe, reward, terminated, info: The user's functions.
        keyframe: Number of the keyframe that episodes start from; None for the default state.
        frame_skip: Timesteps of a control step.
        max_episode_steps: Control steps after which an episode is truncated; None for no end.
        observation_space: float64, the type of the state. Its bounds are those beyond which an
            engine calls a coordinate diverged.
        action_space: float32 (nu,), from -1 to 1, as in Gymnasium's recommendation.
        start_poses: xpos (nbody, 3) [m] and xquat (nbody, 4) where an episode started.
    """

    def __init__(
        self,
        model: Model | AnyPath,
        reward: Reward,
        observe: Observe,
        *,
        backend: str | None,
        reset: Reset,
        terminated: Terminated,
        info: Info,
        keyframe: int | str | None,
        frame_skip: int,
        max_episode_steps: int | None,
        ctrl_range: ArrayLike | None,
    ) -> None:
        """Load the model, and try each function once; the arguments are those of `make_env`."""
        functions = {
            "reward": reward,
            "observe": observe,
            "reset": reset,
            "terminated": terminated,
            "info": info,
        }
        for name, function in functions.items():
            if not callable(function):
                raise BadInputError(f"{name} must be a function; got {shown(function)}")
        self.reward, self.observe, self.reset = reward, observe, reset
        self.terminated, self.info = terminated, info
        self.frame_skip = as_count(frame_skip, "frame_skip")
        self.max_episode_steps = max_episode_steps
        if max_episode_steps is not None:
            self.max_episode_steps = as_count(max_episode_steps, "max_episode_steps")
        self.model = _loaded(model, backend)
        self.keyframe = None if keyframe is None else self.model.key_id(keyframe)
        low, high = _checked_ctrl_range(self.model, ctrl_range).T
        self._middle, self._half = (low + high) / 2, (high - low) / 2
        self.action_space = Box(-1, 1, (self.model.nu,), dtype=np.float32)
        with make_data(self.model) as data:
            goal = self.begin(data, np.random.default_rng(0))
            world = world_of(self.model, data, goal)
            shape = as_numbers(observe(world), "observe(world)").shape
            self.observation_space = Box(-HUGE, HUGE, shape, dtype=np.float64)
            if outside(self.observation(world)):
                raise BadInputError(
                    f"observe(world) must be within ±{HUGE:.0e} where an episode starts"
                )
            self.outcome(world)
            self.facts(world)
            self.start_poses = data.xpos.copy(), data.xquat.copy()

    @property
    def metadata(self) -> dict[str, Any]:
        """Return what Gymnasium is told: as many pictures a second as there are control steps."""
        fps = round(1 / (self.model.timestep * self.frame_skip))
        return {"render_modes": list(RENDER_MODES), "render_fps": max(fps, 1)}

    def ctrl(self, action: ArrayLike, shape: tuple[int, ...]) -> Array:
        """Return commands for actions of a shape (…, nu); beyond -1 to 1 the nearest counts.

        Raises:
            BadInputError: The shape is another one, or an entry is not finite.
        """
        return self._middle + self._half * np.clip(as_vector(action, shape, "action"), -1, 1)

    def drawn_start(self, rng: np.random.Generator) -> Start:
        """Draw where an episode starts, with every array of it checked and of its own.

        Raises:
            BadInputError: `reset` returned something else, a wrong shape, or what is not finite.
        """
        start = self.reset(self.model, rng)
        call = "reset(model, rng)"
        if not isinstance(start, Start):
            raise BadInputError(f"{call} must return a Start; got {shown(start)}")
        qpos, qvel, goal = start.qpos, start.qvel, np.empty(0)
        if qpos is not None:
            qpos = as_vector(qpos, (self.model.nq,), f"{call}.qpos")
        if qvel is not None:
            qvel = as_vector(qvel, (self.model.nv,), f"{call}.qvel")
        if start.goal is not None:
            goal = _finite(start.goal, f"{call}.goal")
        return Start(qpos, qvel, unwritable(goal))

    def begin(self, data: Data, rng: np.random.Generator) -> Array:
        """Start an episode in a Data, and return its goal."""
        start = self.drawn_start(rng)
        reset_data(self.model, data, keyframe=self.keyframe)
        if start.qpos is not None:
            data.qpos = start.qpos
        if start.qvel is not None:
            data.qvel = start.qvel
        forward(self.model, data)
        return np.asarray(start.goal)

    def observation(self, world: WorldView) -> Array:
        """Return what is observed of a world, in a new array.

        Raises:
            BadInputError: It is not finite, or of another shape than the first one.
        """
        call, shape = "observe(world)", self.observation_space.shape
        observation = _finite(self.observe(world), call)
        if observation.shape != shape:
            raise BadInputError(
                f"{call} must always have the shape of the first, {shape}; got {observation.shape}"
            )
        return observation

    def outcome(self, world: WorldView) -> tuple[float, bool]:
        """Return the reward of a world, and whether its episode ends there.

        Raises:
            BadInputError: The reward is not one finite number, or the end is no truth value.
        """
        reward = _finite(self.reward(world), "reward(world)")
        if reward.shape:
            raise BadInputError(f"reward(world) must be one number; got shape {reward.shape}")
        return float(reward), as_switch(self.terminated(world), "terminated(world)")

    def out_of_time(self, steps: int) -> bool:
        """Return whether an episode has had all its control steps."""
        return self.max_episode_steps is not None and steps >= self.max_episode_steps

    def facts(self, world: WorldView) -> dict[str, Any]:
        """Return the `info` of a world that did not diverge.

        Raises:
            BadInputError: `info` returned something else than a dictionary.
        """
        facts = self.info(world)
        if not isinstance(facts, dict):
            raise BadInputError(f"info(world) must return a dict; got {shown(facts)}")
        # What a WorldView gave is the Data's own, which goes on.
        own = {
            name: fact.copy() if isinstance(fact, np.ndarray) else fact
            for name, fact in facts.items()
        }
        return {**own, "diverged": False}


def outside(observation: Array) -> bool:
    """Return whether an observation is beyond what is called diverged."""
    return bool(np.abs(observation).max(initial=0.0) > HUGE)


def world_of(model: Model, data: Data, goal: Array) -> WorldView:
    """Return a WorldView that reads a Data."""
    return WorldView(model, goal, lambda name: unwritable(getattr(data, name)))


def unwritable(array: ArrayLike) -> Array:
    """Return a view that cannot be written through."""
    view = np.asarray(array).view()
    view.setflags(write=False)
    return view


def _finite(value: ArrayLike, name: str) -> Array:
    """Return finite float64 of whatever shape, in a new array."""
    array = as_numbers(value, name).astype(np.float64)
    if not np.isfinite(array).all():
        index = int(np.flatnonzero(~np.isfinite(array))[0])
        entry = f"{name}[{index}]" if array.ndim else name
        raise BadInputError(f"{entry} = {array.flat[index]} is not a finite number")
    return array


def _loaded(model: Model | AnyPath, backend: str | None) -> Model:
    if not isinstance(model, Model):
        return load(model, DEFAULT if backend is None else backend)
    if backend is not None:
        raise BadInputError(
            f"the Model is on {model.backend} already: leave backend= out, or give the model's file"
        )
    return model


def _checked_ctrl_range(model: Model, given: ArrayLike | None) -> Array:
    """Return the commands (nu, 2) that the actions -1 and 1 stand for."""
    if model.nu == 0:
        raise BadInputError(
            f"{model.path.name} has no actuators, so that there is nothing an action could do"
        )
    if given is not None:
        ctrl_range = as_vector(given, (model.nu, 2), "ctrl_range")
    else:
        ctrl_range = model.actuator_ctrlrange
    for name, (low, high) in zip(model.actuator_names, ctrl_range, strict=True):
        if not np.isfinite([low, high]).all():
            raise BadInputError(
                f"actuator {name!r} has no ctrlrange: give ctrl_range=, (nu, 2), the commands that "
                "the actions -1 and 1 stand for"
            )
        if not low < high:
            raise BadInputError(
                f"the commands of actuator {name!r} must go up from action -1 to 1; "
                f"got {low:g} and {high:g}"
            )
    return ctrl_range
