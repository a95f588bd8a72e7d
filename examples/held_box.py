"""Carry the box that the jaws hold to a point: python -m examples.held_box [backend]."""

from __future__ import annotations

from typing import Any

import numpy as np

import statemachine as sm
from examples.arm import TIP, Array, Policy, fingertip, random_policy, scripted_policy, show
from statemachine.gym import Start, WorldView
from statemachine.interface import Keyframe

NEAR = 0.02  # m; a success is nearer
DROPPED = 0.03  # m; where the jaws hold it, the middle of the box is 9 mm from the fingertip
# Of the targets' poses about the pose that holds the box, and of the commands about its command:
# an action of 0 holds it, the last number opens and closes the jaws [rad].
SPREAD = np.array([0.6, 0.3, 0.3, 0.3, 0.0, 0.0])
AROUND = np.array([0.8, 0.5, 0.5, 0.5, 0.2, 0.1])
BOX = slice(6, 9)  # of qpos: after the six joints of the arm comes the box


def held(model: sm.Model) -> Keyframe:
    """Return the keyframe in which the jaws hold the box."""
    return model.keyframes[model.key_id("held")]


def way(world: WorldView) -> Array:
    """Return the way (3,) from the middle of the box to the target [m]."""
    return world.goal - world.qpos[BOX]


def observe(world: WorldView) -> Array:
    """Return qpos, qvel, the fingertip, the target, and the way to it (34,)."""
    tip = world.site_xpos[world.model.site_id(TIP)]
    return np.concatenate([world.qpos, world.qvel, tip, world.goal, way(world)])


def dropped(world: WorldView) -> bool:
    """Return whether the box is no longer between the jaws."""
    tip = world.site_xpos[world.model.site_id(TIP)]
    return bool(np.linalg.norm(world.qpos[BOX] - tip) > DROPPED)


def reward(world: WorldView) -> float:
    """Return 1 for a step in which the box is held, less the distance [m].

    Without the 1, to drop it soon would pay.
    """
    holds = not dropped(world)
    return float(holds) - float(np.linalg.norm(way(world)))


def info(world: WorldView) -> dict[str, Any]:
    """Return the distance [m], and whether it is a success."""
    distance = float(np.linalg.norm(way(world)))
    return {"distance": distance, "is_success": distance < NEAR and not dropped(world)}


def reset(model: sm.Model, rng: np.random.Generator) -> Start:
    """Start from the keyframe; the target is where the box would be in another pose."""
    pose_held, box = held(model).qpos[:6], held(model).qpos[BOX]
    low, high = model.jnt_range[:6].T
    tip, axes, _ = fingertip(pose_held)
    in_hand = axes.T @ (box - tip)
    while True:
        pose = np.clip(pose_held + rng.uniform(-SPREAD, SPREAD), low, high)
        tip, axes, touching = fingertip(pose)
        target = tip + axes @ in_hand
        far = np.linalg.norm(target - box)
        if not touching and target[2] > box[2] and far > 2 * NEAR:
            return Start(goal=target)


def ctrl_range(model: sm.Model) -> Array:
    """Return the commands (6, 2) that the actions -1 and 1 stand for [rad]."""
    ctrl = held(model).ctrl
    return np.stack([ctrl - AROUND, ctrl + AROUND], axis=1)


def task(backend: str = "mujoco") -> dict[str, Any]:
    """Return the arguments of `make_env` and `make_vec`: 150 steps at 50 a second."""
    model = sm.load("so101/scene_box", backend=backend)
    return {
        "model": model,
        "reward": reward,
        "observe": observe,
        "reset": reset,
        "terminated": dropped,
        "info": info,
        "keyframe": "held",
        "frame_skip": 4,
        "max_episode_steps": 150,
        "ctrl_range": ctrl_range(model),
    }


def policies(model: sm.Model) -> dict[str, Policy]:
    """Return the two policies to begin with, by name."""
    jaws = float(held(model).ctrl[-1])
    scripted = scripted_policy(ctrl_range(model), jaws, fastest=0.03)
    return {"random": random_policy(model.nu, seed=0), "scripted": scripted}


if __name__ == "__main__":
    show("held box", task, policies)
