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
from dataclasses import dataclass, replace

import numpy as np

from ...errors import DivergedError, DivergedWarning
from ...interface import Array
from ...worlds import Worlds, make_worlds, record, reset
from ..recordings.arm_recording import ArmRecording
from .loaded_servos import LoadedServos
from .parameters import ArmParameters
from .play import behind_play

_STEPS = 240.0  # a second, at least; where the error of a step is taken away, twice as many, too
_REST = 2.0  # counts that a joint moves in the first frames of a recording that starts at rest
_FIRST_FRAMES = 4
_LOADED_RUNS = 2  # with what is lost to friction, which is computed of the run before
_AFTER_UNKNOWN = 0.5  # commands before a start in motion act on so long [s]


@dataclass(frozen=True, eq=False)
class ArmSimulation:
    """The commands of a recording, played into an arm with other parameters.

    Attributes:
        parameters: Of the arm.
        recording: What is played.
        signs: (n,) 1, or -1 for a joint whose angles are taken with the other sign.
        viscous_outside: As of `ArmParameters.options`.
        play: (n,) widths of the play between each joint and its encoder [rad], or (W, n) of each
            world, of which there may be more than of vectors; None for no play.
        gravity: (3,) in the axes of the base [m/s²]; None for that of the model.
        load_friction: Part of the force of each servo that its gears lose as friction, below 1.
    """

    parameters: ArmParameters
    recording: ArmRecording
    signs: Array
    viscous_outside: bool = False
    play: Array | None = None
    gravity: Array | None = None
    load_friction: float = 0.0

    @classmethod
    def of(cls, parameters: ArmParameters, recording: ArmRecording) -> ArmSimulation:
        """Return the simulation of a recording as it was read."""
        return cls(parameters, recording, np.ones(len(parameters.joints)))

    @classmethod
    def of_motion(cls, parameters: ArmParameters, action: Array, fps: float) -> ArmSimulation:
        """Return the simulation of commands (K, n) [rad] that start at rest."""
        at_rest = np.tile(action[:1], (len(action), 1))
        recording = ArmRecording(
            source="",
            episode=0,
            fps=fps,
            joints=parameters.joints,
            action=action,
            state=at_rest,
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
        return min(round(_AFTER_UNKNOWN * self.recording.fps), len(self.recording.state) // 2)

    @property
    def _moving_at_first(self) -> Array:
        """Tell of each joint (n,) whether it moves in the first frames."""
        first = self.state[:_FIRST_FRAMES]
        half = len(first) // 2
        moved = np.abs(first[half:].mean(axis=0) - first[:half].mean(axis=0))
        return moved > _REST * self.recording.resolution

    def angles(self, vector: Array) -> Array:
        """Return the angles (K, n) that would be measured [rad], without the error of a step.

        NaN where the simulation diverges.
        """
        return self.angles_of_each(vector[None])[0]

    def finite_angles(self, vector: Array) -> Array:
        """Return the same angles (K, n) [rad] where the simulation does not diverge.

        Raises:
            DivergedError: It does.
        """
        angles = self.angles(vector)
        if not np.isfinite(angles).all():
            raise DivergedError("the simulation of the recorded commands diverges")
        return angles

    def angles_of_each(self, vectors: Array, with_error: bool = False) -> Array:
        """Return the angles (W, K, n) for each of several vectors (W, P).

        Args:
            vectors: Of the parameters.
            with_error: Whether the error of a step stays in them, which takes a third of the time:
                enough for the way to a fit, and not for what is said of it.
        """
        once = self._played(vectors, self._steps)
        return once if with_error else 2.0 * self._played(vectors, 2 * self._steps) - once

    def angles_with_play(self, vector: Array, widths: Array) -> Array:
        """Return the angles (M, K, n) of one arm with play of each of some widths at all joints.

        Args:
            vector: (P,) of the parameters.
            widths: (M,) [rad].
        """
        return replace(self, play=widths[:, None]).angles_of_each(vector[None])

    def saturated(self, vector: Array) -> Array:
        """Return the part (n,) of the frames in which each servo is at its force limit."""
        limits = self.parameters.model.actuator_forcerange[self.parameters.servo]
        forces = np.abs(self._forces(vector))
        return np.mean(forces >= 0.999 * limits[:, 1], axis=0)

    @property
    def _steps(self) -> int:
        """Return the number of steps of a frame."""
        return math.ceil(_STEPS / self.recording.fps)

    def _played(self, vectors: Array, steps: int) -> Array:
        """Return the angles (W, K, n) with so many steps a frame, NaN of worlds that diverge."""
        parameters = self.parameters
        timestep = 1.0 / (self.recording.fps * steps)
        servos = LoadedServos(parameters, self.load_friction, timestep)
        model = servos.model.replace(timestep=timestep, integrator="euler", contacts=False)
        options = parameters.options(vectors, self.viscous_outside)
        if self.gravity is not None:
            options["gravity"] = np.tile(self.gravity, (len(vectors), 1))
        offsets = vectors[:, None, parameters.of_kind("offset")]
        told = np.repeat(self.action[:-1], steps, axis=0) - offsets
        with make_worlds(model, len(vectors), derived=(), **options) as worlds:
            history = self._moved(worlds, told, offsets)
            for _ in range(_LOADED_RUNS if self.load_friction else 0):
                lost = servos.lost(options, told, history)
                history = self._moved(worlds, told + lost, offsets)
        if self.play is not None:
            history = behind_play(history, self.play)
        delays = vectors[:, parameters.of_kind("delay")[0]]
        return _late(history, delays / timestep, steps, len(self.action)) + offsets

    def _moved(self, worlds: Worlds, told: Array, offsets: Array) -> Array:
        """Return the angles (W, 1 + T, n) at the start and after each step; NaN after divergence.

        Args:
            worlds: Of which each is reset before.
            told: (W, T, n) command of each step [rad].
            offsets: (W, 1, n) by which measured angles are larger [rad].
        """
        parameters = self.parameters
        reset(worlds)
        first = self.state[0] - offsets
        worlds.qpos[:, parameters.position] = first[:, 0]
        worlds.qvel[:, parameters.dof] = self.first_velocity
        commands = np.repeat(worlds.ctrl[:, None], told.shape[1], axis=1)
        commands[:, :, parameters.servo] = told
        with warnings.catch_warnings():
            # What diverges has no angles, and the fit leaves it again.
            warnings.simplefilter("ignore", DivergedWarning)
            positions = record(worlds, told.shape[1], ctrl=commands)["qpos"]
        history = np.concatenate([first, positions[:, :, parameters.position]], axis=1)
        history[sorted(worlds.diverged)] = np.nan
        return history

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


def _late(history: Array, delays: Array, steps: int, frames: int) -> Array:
    """Return what is measured at each frame, (W, K, n), which is late.

    Args:
        history: (W, 1 + steps * (K - 1), n) angles after each step.
        delays: (W,) in steps; before a delay is over, what is measured is where it began.
        steps: Of a frame.
        frames: K.
    """
    moments = np.maximum(steps * np.arange(frames) - delays[:, None], 0.0)
    before = np.minimum(moments.astype(int), history.shape[1] - 2)
    part = (moments - before)[:, :, None]
    worlds = np.arange(len(history))[:, None]
    return (1.0 - part) * history[worlds, before] + part * history[worlds, before + 1]
