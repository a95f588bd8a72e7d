"""Closed forms of a soft contact: how deep it is, how fast it creeps, and what a bounce keeps.

The model is that of MuJoCo's manual, chapter Computation, sections Constraint model and
Parameters: a constraint accelerates by a1 = aref - R f, with aref = -b v - k d(r) r and
R = (1 - d) / d of the inverse mass that it feels, and no contact pulls.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from .case import GRAVITY

_DEEPEST = 0.1  # [m] within which a depth at rest is looked for


@dataclass(frozen=True)
class SoftContact:
    """What solref and solimp say of a contact; the values are those that MJCF starts with.

    Attributes:
        time_constant: First number of solref [s].
        damping_ratio: Second number of solref.
        least: Impedance d at the surface.
        most: Impedance d from `width` on.
        width: Depth from which the impedance is `most` [m].
    """

    time_constant: float = 0.02
    damping_ratio: float = 1.0
    least: float = 0.9
    most: float = 0.95
    width: float = 0.001

    def impedance(self, depth: float) -> float:
        """Return d(r) of a depth [m]: two parabolas that meet in the middle of the width."""
        share = min(depth / self.width, 1.0)
        rise = 2.0 * share**2 if share < 0.5 else 1.0 - 2.0 * (1.0 - share) ** 2
        return self.least + (self.most - self.least) * rise

    @property
    def damping(self) -> float:
        """Return the factor b of the speed [1/s]."""
        return 2.0 / (self.most * self.time_constant)

    @property
    def stiffness(self) -> float:
        """Return the factor k of the depth [1/s²]."""
        return 1.0 / (self.most * self.time_constant * self.damping_ratio) ** 2

    def depth_at_rest(self, load: float) -> float:
        """Return the depth r [m] at which k d r = (1 - d) / d · load.

        Args:
            load: Force that the contact carries times the inverse mass that it feels [m/s²].
        """

        def excess(depth: float) -> float:
            d = self.impedance(depth)
            return self.stiffness * d * depth - (1.0 - d) / d * load

        return _root(excess, 0.0, _DEEPEST)

    def creep_speed(self, load: float, pull: float) -> float:
        """Return the speed [m/s] at which a contact slips that sticks: R f / b.

        Args:
            load: Normal force times the inverse mass [m/s²].
            pull: Tangential force times the inverse mass [m/s²], within the cone.
        """
        d = self.impedance(self.depth_at_rest(load))
        return (1.0 - d) / d * pull / self.damping


def _root(of: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function is zero between two numbers at which its signs differ."""
    is_low_negative = of(low) < 0.0
    for _ in range(100):  # each halves the interval
        middle = (low + high) / 2.0
        if (of(middle) < 0.0) == is_low_negative:
            low = middle
        else:
            high = middle
    return (low + high) / 2.0


@dataclass(frozen=True)
class Spring:
    """A contact of constant stiffness and damping: a negative solref, and one impedance.

    Attributes:
        stiffness: K of x'' = -B v - K x [1/s²].
        damping: B [1/s].
        impedance: d, the same at each depth.
    """

    stiffness: float
    damping: float
    impedance: float

    @property
    def mjcf(self) -> str:
        """Return the attributes of a geom without friction that make it."""
        return (
            f'condim="1" solref="{-self.stiffness!r} {-self.damping!r}" '
            f'solimp="{self.impedance!r} {self.impedance!r} 0.001"'
        )

    @property
    def restitution(self) -> float:
        """Return the speed after a collision over that before, without gravity.

        The contact ends where its force does, before the spring is relaxed: it cannot pull.
        """
        decay, frequency = self._rates
        angle = math.atan2(2.0 * decay * frequency, frequency**2 - decay**2)
        return math.exp(-decay / frequency * (math.pi - angle))

    def bounce(self, height: float) -> float:
        """Return the height of the bounce over the height of the fall.

        In contact the ball moves as y'' + B y' + K y = 0 about the depth at rest
        (1 - d) g / K, until its acceleration is that of a free fall.

        Args:
            height: From which the ball falls from rest [m].
        """
        decay, frequency = self._rates
        rest = (1.0 - self.impedance) * GRAVITY / self.stiffness
        speed = -math.sqrt(2.0 * GRAVITY * height)
        sine = (speed + decay * rest) / frequency

        def position(time: float) -> float:
            wave = rest * math.cos(frequency * time) + sine * math.sin(frequency * time)
            return math.exp(-decay * time) * wave

        def velocity(time: float) -> float:
            slope = sine * math.cos(frequency * time) - rest * math.sin(frequency * time)
            return math.exp(-decay * time) * frequency * slope - decay * position(time)

        def force(time: float) -> float:
            return GRAVITY - self.damping * velocity(time) - self.stiffness * position(time)

        half = math.pi / frequency
        end = _root(force, 0.2 * half, half)
        return (position(end) - rest + velocity(end) ** 2 / (2.0 * GRAVITY)) / height

    @property
    def _rates(self) -> tuple[float, float]:
        """Return decay [1/s] and frequency [rad/s] of the damped spring."""
        decay = self.damping / 2.0
        return decay, math.sqrt(self.stiffness - decay**2)


def spring_of_restitution(restitution: float, stiffness: float, impedance: float) -> Spring:
    """Return the contact whose damping a nominal restitution gives, were it able to pull.

    Args:
        restitution: Speed after over speed before; half a period of the damped spring keeps it.
        stiffness: [1/s²].
        impedance: d.
    """
    decrement = -math.log(restitution)
    ratio = decrement / math.hypot(math.pi, decrement)
    return Spring(stiffness, 2.0 * ratio * math.sqrt(stiffness), impedance)
