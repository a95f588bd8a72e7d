"""Two policies to begin with, and how an episode goes under one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..interface import Array
from ..kinematics import Kinematics
from ..page import Figures
from .tasks import TIP, HeldBox, Task
from .vector import ArmVectorEnv

Policy = Callable[[Array], NDArray[np.float32]]  # actions (n, nu) for observations (n, k)

_DAMPING = 0.05  # m; of the least squares: near a singular pose the step stays small
_REST = 0.02  # how much of the way back to the middle pose, where the target leaves a choice


def random_policy(task: Task, seed: int | None = None) -> Policy:
    """Actions from the whole range, each entry by itself."""
    rng = np.random.default_rng(seed)

    def policy(observations: Array) -> NDArray[np.float32]:
        return rng.uniform(-1, 1, (len(observations), task.model.nu)).astype(np.float32)

    return policy


def scripted_policy(task: Task) -> Policy:
    """Each step a part of the way, by damped least squares on the fingertip's Jacobian.

    dq = Jᵀ (J Jᵀ + λ² 1)⁻¹ way (Nakamura and Hanafusa 1986; Wampler 1986). The Jacobian is the
    witness's, so that no engine's own numbers favour it.

    Raises:
        MissingEngineError: Pinocchio is not installed here.
    """
    witness, model = Kinematics("so101"), task.model
    carries = isinstance(task, HeldBox)
    fastest = 0.03 if carries else 0.12  # rad a control step
    jaws = task.ctrl(np.zeros(model.nu), (model.nu,))[-1] if carries else 0.0
    low, high = model.actuator_ctrlrange.T

    def policy(observations: Array) -> NDArray[np.float32]:
        ctrl = np.empty((len(observations), model.nu))
        for row, seen in enumerate(observations):
            arm, way = seen[: witness.nq], seen[-3:]
            jacobian = witness.jacobian(arm, TIP)[:3, :-1]
            inverse = jacobian.T @ np.linalg.inv(jacobian @ jacobian.T + _DAMPING**2 * np.eye(3))
            free = np.eye(len(arm) - 1) - inverse @ jacobian
            step = inverse @ way - _REST * free @ arm[:-1]
            step *= min(1.0, fastest / max(np.abs(step).max(), 1e-12))
            ctrl[row] = np.clip(np.append(arm[:-1] + step, jaws), low, high)
        return task.action(ctrl)

    return policy


def play(envs: ArmVectorEnv, policy: Policy, seed: int) -> Figures:
    """Play one episode in each world, world i with seed + i.

    Args:
        envs: With an end to its episodes.
        policy: From observations to actions.
        seed: Of the first world.

    Returns:
        returned: (n,) the sum of the rewards.
        distance: (n,) to the target at the end [m].
        success: (n,) whether that is a success.
        steps: (n,) control steps.
        diverged: (n,) whether the simulation broke down.
    """
    n = envs.num_envs
    seen, infos = envs.reset(seed=seed)
    going = np.ones(n, dtype=np.bool_)
    returned, distance = np.zeros(n), infos["distance"].copy()
    success, diverged = infos["is_success"].copy(), np.zeros(n, dtype=np.bool_)
    steps = np.zeros(n, dtype=np.int64)
    while going.any():
        seen, rewards, terminated, truncated, infos = envs.step(policy(seen))
        final = infos.get("final_info", infos)
        returned[going] += rewards[going]
        steps += going
        for array, name in (
            (distance, "distance"),
            (success, "is_success"),
            (diverged, "diverged"),
        ):
            np.copyto(array, infos[name], where=going)
            if final is not infos:
                np.copyto(array, final[name], where=going & final[f"_{name}"])
        going &= ~(terminated | truncated)
    return Figures(
        returned=returned, distance=distance, success=success, steps=steps, diverged=diverged
    )
