"""What both tasks of the SO-101 arm share: its fingertip, two policies, and how episodes go.

An observation ends with the way to the target (3,) [m], and begins with the arm's joints.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import statemachine as sm
from statemachine.errors import StateMachineError
from statemachine.gym import RobotVectorEnv, make_vec

Array = NDArray[np.float64]
Policy = Callable[[Array], NDArray[np.float32]]  # actions (n, nu) for observations (n, k)

TIP = "gripperframe"  # the site between the tips of the jaws
_DAMPING = 0.05  # m; of the least squares: near a singular pose the step stays small
_REST = 0.02  # how much of the way back to the middle pose, where the target leaves a choice


@cache
def _above_the_floor() -> tuple[sm.Model, sm.Data]:
    model = sm.load("so101/scene")
    return model, sm.make_data(model)


def fingertip(pose: Array) -> tuple[Array, Array, bool]:
    """Return the fingertip in a pose: position (3,) [m], axes (3, 3), and whether the arm touches.

    MuJoCo computes it for all backends, so that a seed draws the same targets on each.

    Args:
        pose: (6,) angles of the joints [rad].
    """
    model, data = _above_the_floor()
    data.qpos[:] = pose
    sm.forward(model, data)
    tip = model.site_id(TIP)
    axes = data.site_xmat[tip].reshape(3, 3)
    return data.site_xpos[tip].copy(), axes.copy(), len(data.contacts) > 0


def random_policy(nu: int, seed: int) -> Policy:
    """Return a policy that draws each entry of an action (nu,) from its whole range."""
    rng = np.random.default_rng(seed)

    def policy(observations: Array) -> NDArray[np.float32]:
        return rng.uniform(-1, 1, (len(observations), nu)).astype(np.float32)

    return policy


def scripted_policy(ctrl_range: Array, jaws: float, fastest: float) -> Policy:
    """Return a policy that goes a part of the way each step, by damped least squares.

    dq = Jᵀ (J Jᵀ + λ² 1)⁻¹ way (Nakamura and Hanafusa 1986; Wampler 1986), where J is the
    fingertip's Jacobian by Pinocchio, so that no engine's own numbers favour it.

    Args:
        ctrl_range: (6, 2) the commands that the actions -1 and 1 stand for [rad].
        jaws: What the jaws are told [rad].
        fastest: What a joint may move in a control step [rad].
    """
    arm = sm.Kinematics("so101")
    middle, half = ctrl_range.mean(axis=1), (ctrl_range[:, 1] - ctrl_range[:, 0]) / 2

    def command(observation: Array) -> Array:
        joints, way = observation[: arm.nq], observation[-3:]
        jacobian = arm.jacobian(joints, TIP)[:3, :-1]
        inverse = jacobian.T @ np.linalg.inv(jacobian @ jacobian.T + _DAMPING**2 * np.eye(3))
        free = np.eye(len(joints) - 1) - inverse @ jacobian
        step = inverse @ way - _REST * free @ joints[:-1]
        step *= min(1.0, fastest / max(np.abs(step).max(), 1e-12))
        return np.append(joints[:-1] + step, jaws)

    def policy(observations: Array) -> NDArray[np.float32]:
        ctrl = np.stack([command(observation) for observation in observations])
        return np.clip((ctrl - middle) / half, -1, 1).astype(np.float32)

    return policy


@dataclass(frozen=True)
class Episodes:
    """How n episodes went.

    Attributes:
        returned: (n,) sum of the rewards.
        distance: (n,) from the target at the end [m].
        steps: (n,) control steps.
    """

    returned: Array
    distance: Array
    steps: NDArray[np.int64]

    def __str__(self) -> str:
        near = int((self.distance < 0.01).sum())
        return (
            f"{near:2} of {len(self.steps)} end within 1 cm, {self.steps.mean():5.1f} steps, "
            f"reward {self.returned.mean():7.2f}"
        )


def play(envs: RobotVectorEnv, policy: Policy, seed: int) -> Episodes:
    """Play one episode in each world, world i with seed + i."""
    observations, _ = envs.reset(seed=seed)
    going = np.ones(envs.num_envs, dtype=np.bool_)
    returned, distance = np.zeros(envs.num_envs), np.zeros(envs.num_envs)
    steps = np.zeros(envs.num_envs, dtype=np.int64)
    while going.any():
        observations, rewards, terminated, truncated, _ = envs.step(policy(observations))
        returned[going] += rewards[going]
        distance[going] = np.linalg.norm(observations[going, -3:], axis=1)
        steps += going
        going &= ~(terminated | truncated)
    return Episodes(returned, distance, steps)


def show(
    name: str,
    task: Callable[[str], dict[str, Any]],
    policies: Callable[[sm.Model], dict[str, Policy]],
) -> None:
    """Play 16 episodes of a task with each of its policies, and print a line of them.

    Args:
        name: Of the task.
        task: Returns the arguments of `make_vec` on a backend, which is that of the command line.
        policies: Returns the policies for a model, by name.
    """
    parser = argparse.ArgumentParser(description=f"Play 16 episodes of the task: {name}.")
    parser.add_argument("backend", nargs="?", default="mujoco", help="the engine (mujoco)")
    backend = parser.parse_args().backend
    try:
        envs = make_vec(num_envs=16, **task(backend))
        for kind, policy in policies(envs.model).items():
            print(f"{name} on {backend}, {kind}: {play(envs, policy, seed=0)}")
        envs.close()
    except StateMachineError as error:  # a backend that is not there, or not known
        parser.error(str(error))
