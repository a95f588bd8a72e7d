"""A policy walks: observe, act, advance; and what came of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .contract import Contract
from .network import Floats, Network
from .observation import SOUND, Fault, Seen, observe, rotation
from .robots import Robots

FALLEN = 0.17  # Height of the trunk [m] below which it has fallen; it stands at 0.29 m.
# A change of speed is a part of what is asked, or of these [m/s, m/s, rad/s], whichever is more.
LEAST = (0.3, 0.3, 0.5)
SETTLING = 2  # Periods of the clock that count for no speed.


@dataclass(frozen=True)
class Walked:
    """What came of n walks.

    `speeds` (n, 3), the mean forwards, sideways [m/s] and about [rad/s]; `error` (n, 3), the mean
    absolute error of the speeds over one period of the clock; `shaking` (n,), how much the trunk
    tilts, rocks and bounces; `effort` (n,), how much the actions change; `upright` (n,) [s], until
    the fall.
    """

    speeds: Floats
    error: Floats
    shaking: Floats
    effort: Floats
    upright: Floats


@dataclass(frozen=True)
class Policies:
    """Networks of one shape, which walk side by side."""

    networks: list[Network]

    def actions(self, observations: Floats) -> Floats:
        """Return the actions (n, 12) of n robots: as many of each network, network by network."""
        groups = observations.reshape(len(self.networks), -1, observations.shape[1])
        pairs = zip(self.networks, groups, strict=True)
        return np.concatenate([network.actions(group) for network, group in pairs])


def walk(
    contract: Contract,
    policies: Policies,
    robots: Robots,
    command: Floats,
    seconds: float,
    fault: Fault = SOUND,
) -> Walked:
    """Let n robots walk under their commands, (n, 3), until all fell or the seconds are over."""
    n = len(command)
    nstep = round(contract.decimation * fault.decimation)
    policy_dt = nstep * robots.timestep
    steps = round(seconds / policy_dt)
    last: Floats = np.zeros((n, len(contract.joint_names)))
    waiting: list[Floats] = [last] * fault.delay
    walking, upright = np.ones(n, dtype=bool), np.full(n, seconds)
    speeds, shaking, effort = np.full((steps, n, 3), np.nan), np.zeros(n), np.zeros(n)
    ctrl = np.zeros_like(last)
    for step in range(steps):
        qpos, qvel = robots.states()
        fell = walking & (qpos[:, 2] < FALLEN)
        upright[fell] = step * policy_dt
        walking &= ~fell
        if not walking.any():
            break
        # Who counts steps believes that each takes what the contract says.
        phase = 2 * np.pi * fault.clock * step * contract.policy_dt / contract.period
        seen = Seen(qpos, qvel, command, last, phase, robots.joints)
        actions = policies.actions(observe(contract, seen, fault))
        effort += walking * np.square(actions - last).mean(axis=1)
        waiting.append(actions)
        last = actions
        offset = fault.action * contract.action_scale * waiting.pop(0)
        ctrl[:, robots.joints] = contract.default + offset
        speeds[step, walking] = body_speeds(qpos, qvel)[walking]
        shaking += walking * _shaking(qpos, qvel)
        robots.advance(ctrl, nstep, walking)
    stride = round(contract.period / policy_dt)
    return Walked(
        speeds=_mean_speeds(speeds, stride),
        error=_errors(np.nan_to_num(speeds), command, stride),
        shaking=shaking / steps,
        effort=effort / steps,
        upright=upright,
    )


def change(sound: Walked, spoiled: Walked, command: Floats) -> Floats:
    """Return the largest change of a speed of n walks, (n,), as a part of what is asked, (n, 3)."""
    scale = np.maximum(np.abs(command), LEAST)
    return (np.abs(spoiled.speeds - sound.speeds) / scale).max(axis=1)


def body_speeds(qpos: Floats, qvel: Floats) -> Floats:
    """Return the speeds (n, 3) forwards, to the left [m/s] and about the trunk's z axis [rad/s]."""
    velocity = np.einsum("nji,nj->ni", rotation(qpos[:, 3:7]), qvel[:, :3])
    return np.stack([velocity[:, 0], velocity[:, 1], qvel[:, 5]], axis=1)


def _shaking(qpos: Floats, qvel: Floats) -> Floats:
    """Return how much n trunks tilt, rock and bounce, (n,)."""
    upwards = rotation(qpos[:, 3:7])[:, 2, :2]
    tilt, rocking = np.square(upwards).sum(axis=1), np.square(qvel[:, 3:5]).sum(axis=1)
    return 20 * tilt + 0.1 * rocking + np.square(qvel[:, 2])


def _mean_speeds(speeds: Floats, stride: int) -> Floats:
    """Return the means (n, 3) of speeds (steps, n, 3) after the start, and until the fall."""
    after = speeds[SETTLING * stride :]
    counted = np.isfinite(after).sum(axis=0)
    early = np.nan_to_num(speeds).mean(axis=0)
    return np.where(counted > 0, np.nansum(after, axis=0) / np.maximum(counted, 1), early)


def _errors(speeds: Floats, command: Floats, stride: int) -> Floats:
    """Return the mean absolute errors (n, 3) of the speeds' running means over one stride."""
    total = np.cumsum(np.concatenate([np.zeros_like(speeds[:1]), speeds]), axis=0)
    running = (total[stride:] - total[:-stride]) / stride
    return np.abs(running[SETTLING * stride :] - command).mean(axis=0)
