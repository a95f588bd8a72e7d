"""What a simulated arm does when it is told commands, frame by frame."""

from __future__ import annotations

import numpy as np

import statemachine as sm
from statemachine.interface import Array, Model

from .arm_truth import ArmTruth

FPS = 30
STEPS_PER_FRAME = 64  # of 1/1920 s: finer than what a fit takes
_TIMESTEP = 1.0 / (FPS * STEPS_PER_FRAME)
_SETTLING = 60  # frames for which it is told the first command before it is recorded


def arm_model(backend: str) -> Model:
    """Return the arm that is simulated, with the fine step.

    MuJoCo's semi-implicit Euler: implicitfast leaves the damping of a servo out of its implicit
    part while its force is at the limit, so that what comes out jumps with the parameters.
    """
    model = sm.load("so101", backend=backend)
    if backend == "mujoco":
        return model.replace(timestep=_TIMESTEP, contacts=False, integrator="euler")
    return model.replace(timestep=_TIMESTEP, contacts=False)


def measured_angles(model: Model, truth: ArmTruth, action: Array) -> Array:
    """Return the recorded angles (K, n) [rad] at each frame, without noise.

    The arm rests under the first command until frame 0. Frame k is measured before command k is
    sent, and shows where the arm was one delay earlier.

    Args:
        model: Made by `arm_model`.
        truth: The arm's figures.
        action: (K, n) recorded commands [rad]; command k holds until the next.
    """
    arm = truth.applied_to(model)
    commands = truth.real(action)
    with sm.make_data(arm) as data:
        data.qpos[:] = commands[0]
        data.ctrl[:] = commands[0]
        sm.step(arm, data, _SETTLING * STEPS_PER_FRAME)
        angles = [data.qpos.copy()]
        for command in commands:
            data.ctrl[:] = command
            for _ in range(STEPS_PER_FRAME):
                sm.step(arm, data)
                angles.append(data.qpos.copy())
    times = np.arange(len(angles)) * _TIMESTEP
    seen = np.arange(len(commands)) / FPS - truth.delay
    history = np.stack(angles)
    columns = [np.interp(seen, times, history[:, joint]) for joint in range(history.shape[1])]
    return truth.recorded(np.stack(columns, axis=1))
