"""What a simulated arm does when it is told commands, frame by frame."""

from __future__ import annotations

import numpy as np

import statemachine as sm
from statemachine.interface import Array, Model

from .arm_truth import ArmTruth

FPS = 30
STEPS_PER_FRAME = 64  # of 1/1920 s, and twice as many: finer than what a fit takes
_SETTLING = 60  # frames for which it is told the first command before it is recorded


def arm_model(backend: str) -> Model:
    """Return the arm that is simulated.

    MuJoCo's semi-implicit Euler: implicitfast leaves the damping of a servo out of its implicit
    part while its force is at the limit, so that what comes out jumps with the parameters.
    """
    model = sm.load("so101", backend=backend).replace(contacts=False)
    return model.replace(integrator="euler") if backend == "mujoco" else model


def measured_angles(model: Model, truth: ArmTruth, action: Array) -> Array:
    """Return the recorded angles (K, n) [rad] at each frame, without noise.

    The arm rests under the first command until frame 0. Frame k is measured before command k is
    sent, and shows where the arm was one delay earlier. The error of the step, which is of first
    order and would pass for a delay of half a step, is taken away by Richardson's extrapolation.

    Args:
        model: Made by `arm_model`.
        truth: The arm's figures.
        action: (K, n) recorded commands [rad]; command k holds until the next.
    """
    arm = truth.applied_to(model)
    commands = truth.real(action)
    once = _seen(arm, commands, STEPS_PER_FRAME, truth)
    twice = _seen(arm, commands, 2 * STEPS_PER_FRAME, truth)
    return truth.recorded(2.0 * twice - once)


def _seen(arm: Model, commands: Array, steps: int, truth: ArmTruth) -> Array:
    """Return where the encoders saw the arm one delay before each frame, (K, n) [rad].

    An encoder behind play stays where it is until the joint has crossed the play, and is then
    half of it behind. While the arm settles, it starts in the middle.
    """
    timestep = 1.0 / (FPS * steps)
    stepped = arm.replace(timestep=timestep)
    with sm.make_data(stepped) as data:
        data.qpos[:] = commands[0]
        data.ctrl[:] = commands[0]
        seen, half = data.qpos.copy(), 0.5 * truth.play
        for _ in range(_SETTLING * steps):
            sm.step(stepped, data)
            seen = np.clip(seen, data.qpos - half, data.qpos + half)
        angles = [seen]
        for command in commands:
            data.ctrl[:] = command
            for _ in range(steps):
                sm.step(stepped, data)
                seen = np.clip(seen, data.qpos - half, data.qpos + half)
                angles.append(seen)
    times = np.arange(len(angles)) * timestep
    moments = np.arange(len(commands)) / FPS - truth.delay
    history = np.stack(angles)
    columns = [np.interp(moments, times, history[:, joint]) for joint in range(arm.nq)]
    return np.stack(columns, axis=1)
