"""The commands of a recording, played into many worlds that differ by the parameters.

Each frame is divided into whole steps of Euler's method. MuJoCo's `implicitfast` is not used: it
leaves the servo's `kv` out of its implicit matrix in the steps in which the force limit is reached,
so that angles jump by a part of a count where a parameter changes smoothly, and a fit ends in the
dents. Euler's method is smooth, and its error of first order is taken away by Richardson's
extrapolation from two step lengths.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np

from ...errors import DivergedWarning
from ...interface import Array
from ...worlds import make_worlds
from ...worlds import step as step_worlds
from ..recordings.arm_recording import ArmRecording
from .parameters import ArmParameters

COUNTS = 4096  # of a turn of the servos (Feetech STS3215)
_STABLE = 1.2  # rate of a servo by that of steps, below which half of them do for derivatives
_STEPS = 240.0  # a second; where the error of a step is taken away, twice as many, too
_REST = 2.0  # counts that a joint moves in the first frames of a recording that starts at rest
_FIRST_FRAMES = 4
_UNTOLD = 0.5  # time after a start in motion that the unknown commands before it act on [s]


@dataclass(frozen=True, eq=False)
class ArmSimulation:
    """The commands of a recording, played into an arm with other parameters.

    Attributes:
        parameters: Of the arm.
        recording: What is played.
        signs: (n,) 1, or -1 for a joint whose angles are taken with the other sign.
        viscous_outside: As of `ArmParameters.options`.
    """

    parameters: ArmParameters
    recording: ArmRecording
    signs: Array
    viscous_outside: bool = False

    @classmethod
    def of(cls, parameters: ArmParameters, recording: ArmRecording) -> ArmSimulation:
        """Return the simulation of a recording as it was read."""
        return cls(parameters, recording, np.ones(len(parameters.joints)))

    @classmethod
    def of_motion(cls, parameters: ArmParameters, action: Array, fps: float) -> ArmSimulation:
        """Return the simulation of commands (K, n) [rad] that start at rest."""
        at_rest = np.tile(action[:1], (len(action), 1))
        resolution = np.full(action.shape[1], math.tau / COUNTS)
        recording = ArmRecording(
            source="",
            episode=0,
            fps=fps,
            joints=parameters.joints,
            action=action,
            state=at_rest,
            resolution=resolution,
            units=(),
        )
        return cls.of(parameters, recording)

    @property
    def state(self) -> Array:
        """Return the measured angles (K, n) [rad]."""
        return self.recording.state * self.signs

    @property
    def action(self) -> Array:
        """Return the commanded angles (K, n) [rad]."""
        return self.recording.action * self.signs

    @property
    def first_velocity(self) -> Array:
        """Return the velocities (n,) that the recording starts with [rad/s]; zero at rest."""
        first = self.state[:_FIRST_FRAMES]
        slope = np.polyfit(np.arange(len(first)) / self.recording.fps, first, 1)[0]
        return np.where(self._moving_at_first, slope, 0.0)

    @property
    def first_frame(self) -> int:
        """Return the first frame that counts: 0 where the arm rests before it is told anything.

        Of a recording that starts in motion the commands before it are not known.
        """
        if not self._moving_at_first.any():
            return 0
        return min(round(_UNTOLD * self.recording.fps), len(self.recording.state) // 2)

    @property
    def _moving_at_first(self) -> Array:
        """Tell of each joint (n,) whether it moves in the first frames."""
        first = self.state[:_FIRST_FRAMES]
        return np.ptp(first, axis=0) > _REST * self.recording.resolution

    def angles(self, vector: Array) -> Array:
        """Return the angles (K, n) that would be measured [rad], without the error of a step.

        NaN where the simulation diverges.
        """
        once = self._played(vector[None], self._steps)[0]
        return 2.0 * self._played(vector[None], 2 * self._steps)[0] - once

    def angles_of_each(self, vectors: Array) -> Array:
        """Return the angles (W, K, n) for each of several vectors (W, P).

        They have the error of a step, which hardly matters for differences.
        """
        half = self._steps // 2
        rate = self.recording.fps * half
        is_stable = half > 0 and self._fastest_rate(vectors) < _STABLE * rate
        return self._played(vectors, half if is_stable else self._steps)

    def saturated(self, vector: Array) -> Array:
        """Return the part (n,) of the frames in which each servo is at its force limit."""
        limits = self.parameters.model.actuator_forcerange[self.parameters.servo]
        forces = np.abs(self._forces(vector))
        return np.mean(forces >= 0.999 * limits[:, 1], axis=0)

    def _fastest_rate(self, vectors: Array) -> float:
        """Return the fastest rate at which a servo moves its armature alone [1/s].

        The links add to that inertia, so it is a bound.
        """
        parameters = self.parameters
        figures = parameters.options(vectors)
        inertia = figures["armature"][:, parameters.dof]
        spring = np.sqrt(figures["kp"][:, parameters.servo] / inertia)
        viscous = figures["kv"][:, parameters.servo] / inertia
        return float(np.maximum(spring, viscous).max())

    @property
    def _steps(self) -> int:
        """Return the number of steps of a frame."""
        return max(1, round(_STEPS / self.recording.fps))

    def _played(self, vectors: Array, steps: int) -> Array:
        """Return the angles (W, K, n) with so many steps a frame.

        They are read so much earlier than a frame as the delay is, between two steps.
        """
        parameters = self.parameters
        offsets = vectors[:, parameters.of_kind("offset")]
        delays = vectors[:, parameters.of_kind("delay")[0]]
        action, state = self.action, self.state
        timestep = 1.0 / (self.recording.fps * steps)
        reading = _Reading.of(float(delays.mean()), timestep, steps)
        frames = len(action)
        before = np.empty((len(vectors), frames, len(parameters.joints)))
        after = np.empty_like(before)
        model = parameters.model.replace(timestep=timestep, integrator="euler", contacts=False)
        options = parameters.options(vectors, self.viscous_outside)
        with make_worlds(model, len(vectors), derived=(), **options) as worlds:
            worlds.qpos[:, parameters.position] = state[0] - offsets
            worlds.qvel[:, parameters.dof] = self.first_velocity
            before[:] = after[:] = worlds.qpos[:, None, parameters.position]
            with warnings.catch_warnings():
                # What diverges has no angles, and the fit leaves it again.
                warnings.simplefilter("ignore", DivergedWarning)
                for k in range(frames - reading.frames):
                    worlds.ctrl[:, parameters.servo] = action[k] - offsets
                    if reading.steps_before:
                        step_worlds(worlds, reading.steps_before)
                    before[:, k + reading.frames] = worlds.qpos[:, parameters.position]
                    step_worlds(worlds)
                    after[:, k + reading.frames] = worlds.qpos[:, parameters.position]
                    if reading.steps_after:
                        step_worlds(worlds, reading.steps_after)
            diverged = sorted(worlds.diverged)
        part = ((reading.delay - delays) / timestep)[:, None, None]
        angles = before + part * (after - before) + offsets[:, None, :]
        angles[diverged] = np.nan
        return angles

    def _forces(self, vector: Array) -> Array:
        """Return the servo forces before the limit (K, n), from angles and commands [N·m]."""
        parameters = self.parameters
        figures = parameters.options(vector[None], self.viscous_outside)
        offsets = vector[parameters.of_kind("offset")]
        delay = float(vector[parameters.of_kind("delay")[0]])
        angles = self.angles(vector) - offsets
        velocities = np.gradient(angles, 1.0 / self.recording.fps, axis=0)
        late = round(delay * self.recording.fps)
        action = np.vstack([np.repeat(self.action[:1], late, 0), self.action])[: len(angles)]
        kp = figures["kp"][0, parameters.servo]
        kv = figures["kv"][0, parameters.servo]
        return kp * (action - offsets - angles) - kv * velocities


@dataclass(frozen=True)
class _Reading:
    """When angles are read that are measured late: between two steps of a frame.

    Attributes:
        delay: Whole number of steps that is at least the delay [s].
        frames: Number of frames by which it is read before the frame that it is of.
        steps_before, steps_after: Steps of a frame before the one over which it is read, and after.
    """

    delay: float
    frames: int
    steps_before: int
    steps_after: int

    @classmethod
    def of(cls, delay: float, timestep: float, steps: int) -> _Reading:
        """Return when to read for a delay [s] and so many steps a frame."""
        late = max(1, math.ceil(delay / timestep - 1e-9))
        before = -late % steps
        return cls(late * timestep, (late + before) // steps, before, steps - before - 1)
