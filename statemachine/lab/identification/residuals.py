"""Whether what a fit leaves is noise of the measurement, or an error of the model.

The noise of a joint is taken from the differences of successive residuals (J. von Neumann, 1941):
an error of the model changes slowly from frame to frame, and noise does not. It must also be no
more than a count of the servo and a reading at an uncertain time can make.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...interface import Array
from ..recordings.arm_recording import ArmRecording

QUANTILE = 1.96  # standard deviations of the normal distribution to each side, for 95 %
UNCERTAIN_TIME = 0.003  # standard deviation of when a frame was read [s]
_ABOVE_NOISE = 1.15  # residual of a joint, by its noise
_ABOVE_NOISE_HELD_OUT = 1.3  # the same of what was not fitted
_STILL = 0.7  # counts: a joint that hardly moves has an error of this size, and no noise


def root_mean_square(errors: Array) -> float:
    """Return the root mean square over all entries of errors, in their unit."""
    return float(np.sqrt(np.square(errors).mean()))


@dataclass(frozen=True, eq=False)
class Residuals:
    """What is left between fitted and measured angles.

    Attributes:
        rms: (n,) root mean square of each joint [rad].
        noise: (n,) the part of it that is noise [rad].
        most: (n,) the most that resolution and unmeasured time can make [rad].
        resolution: (n,) angle of a count [rad].
    """

    rms: Array
    noise: Array
    most: Array
    resolution: Array

    @classmethod
    def of(cls, errors: Array, recording: ArmRecording) -> Residuals:
        """Return what is left.

        Args:
            errors: (K, n) fitted angles less measured ones [rad].
            recording: That they are of; its last frames, if it has more.
        """
        state = recording.state[-len(errors) :]
        speed = np.gradient(state, 1.0 / recording.fps, axis=0)
        least = recording.resolution / math.sqrt(12.0)
        noise = np.sqrt(np.square(np.diff(errors, axis=0)).mean(axis=0) / 2.0)
        of_time = UNCERTAIN_TIME * np.sqrt(np.square(speed).mean(axis=0))
        return cls(
            rms=np.sqrt(np.square(errors).mean(axis=0)),
            noise=np.maximum(noise, least),
            most=np.hypot(recording.resolution, of_time),
            resolution=recording.resolution,
        )

    @property
    def overall(self) -> float:
        """Return the root mean square over all joints [rad]."""
        return root_mean_square(self.rms)

    @property
    def floor(self) -> float:
        """Return what the measurement alone leaves, over all joints [rad]."""
        return root_mean_square(np.minimum(self.noise, self.most))

    @property
    def at_floor(self) -> bool:
        """Tell whether nothing but noise is left, in any joint."""
        return self._is_noise(_ABOVE_NOISE)

    def holds(self, predicted: Array) -> bool:
        """Tell whether a model that was fitted elsewhere leaves no more than is to be expected.

        Args:
            predicted: (n,) standard deviation of its angles, by that of what was fitted [rad].
        """
        return self._is_noise(_ABOVE_NOISE_HELD_OUT, QUANTILE * predicted)

    def _is_noise(self, factor: float, beside: Array | float = 0.0) -> bool:
        """Tell whether no joint has more than so much of its noise, and another error beside it."""
        if not np.isfinite(self.rms).all():
            return False
        noise = np.hypot(factor * np.minimum(self.noise, self.most), beside)
        allowed = np.maximum(noise, _STILL * self.resolution)
        return bool((self.rms <= allowed).all())
