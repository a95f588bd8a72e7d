"""Bring the arm's fingertip to a point: python -m examples.reach [backend]."""

from __future__ import annotations

from typing import Any

import numpy as np

import statemachine as sm
from examples.arm import TIP, Array, Policy, fingertip, random_policy, scripted_policy, show
from statemachine.gym import Start, WorldView

NEAR = 0.01  # m; a success is nearer


def way(world: WorldView) -> Array:
    """Return the way (3,) from the fingertip to the target [m]."""
    return world.goal - world.site_xpos[world.model.site_id(TIP)]


def observe(world: WorldView) -> Array:
    """Return qpos, qvel, the fingertip, the target, and the way to it (21,)."""
    tip = world.site_xpos[world.model.site_id(TIP)]
    return np.concatenate([world.qpos, world.qvel, tip, world.goal, way(world)])


def reward(world: WorldView) -> float:
    """Return minus the distance [m]. There is no end before its time: the tip is to stay there."""
    return -float(np.linalg.norm(way(world)))


def info(world: WorldView) -> dict[str, Any]:
    """Return the distance [m], and whether it is a success."""
    distance = float(np.linalg.norm(way(world)))
    return {"distance": distance, "is_success": distance < NEAR}


def reset(model: sm.Model, rng: np.random.Generator) -> Start:
    """Start near the default pose; the target is the fingertip of another pose."""
    qpos = rng.uniform(-0.05, 0.05, model.nq)
    low, high = model.jnt_range.T
    while True:
        pose = rng.uniform(low, high)
        pose[-1] = 0.0
        tip, _, touching = fingertip(pose)
        if not touching and tip[2] > 0.03:
            return Start(qpos=qpos, goal=tip)


def task(backend: str = "mujoco") -> dict[str, Any]:
    """Return the arguments of `make_env` and `make_vec`: 100 steps at 50 a second."""
    return {
        "model": sm.load("so101/scene", backend=backend),
        "reward": reward,
        "observe": observe,
        "reset": reset,
        "info": info,
        "frame_skip": 4,
        "max_episode_steps": 100,
    }


def policies(model: sm.Model) -> dict[str, Policy]:
    """Return the two policies to begin with, by name."""
    scripted = scripted_policy(model.actuator_ctrlrange, jaws=0.0, fastest=0.12)
    return {"random": random_policy(model.nu, seed=0), "scripted": scripted}


if __name__ == "__main__":
    show("reach", task, policies)
