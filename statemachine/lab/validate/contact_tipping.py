"""Cases of blocks that stand on an edge: they tip over, or rock back and forth."""

from __future__ import annotations

import math

import numpy as np

from ...interface import Data
from ...interface.records import Array
from .case import FEW_TIMESTEPS, GRAVITY, Case, bounded, converges, exact, wrong
from .contact_tools import ROUND, on_engines, one, tilted_gravity
from .known_causes import CORNERS
from .run import Run, Samples, zero, zero_crossings

SLOPE = 0.3  # [rad] of the incline on which blocks stand
WIDTH, HEIGHT = 0.05, 0.15  # [m] half those of the block that rocks
RELEASE = 0.6  # angle at which it is released over that at which it balances
# Width over height of the blocks on the incline, over the tangent of its angle.
RATIOS = tuple(round(0.9525 + 0.005 * k, 4) for k in range(20))
_TIPPING = "Meriam, Kraige: Engineering Mechanics, Statics, 7th ed., article 6/3"
_HOUSNER = (
    "Housner: The behavior of inverted pendulum structures during earthquakes, Bulletin of the "
    "Seismological Society of America 53 (1963)"
)
_TALL = 0.1  # [m] half their height


def _row() -> str:
    """Return a row of blocks on an incline, one as wide as it has to be, others a bit off."""
    blocks: list[str] = []
    for k, ratio in enumerate(RATIOS):
        width = _TALL * math.tan(SLOPE) * ratio
        blocks.append(
            f'<body pos="0 {0.3 * k:g} {_TALL!r}"><freejoint/><geom type="box" '
            f'size="{width!r} 0.05 {_TALL!r}" mass="1" contype="2" conaffinity="1"/></body>'
        )
    plane = '<geom type="plane" size="0 0 1" contype="1" conaffinity="2"/>'
    return f"<worldbody>{plane}{''.join(blocks)}</worldbody>"


def _threshold(run: Run) -> float:
    """Return the ratio between the last block that falls and the first that stands."""
    run.advance(1.0)
    quats = run.data.qpos.reshape(-1, 7)[:, 3:]
    upright = 1.0 - 2.0 * (quats[:, 1] ** 2 + quats[:, 2] ** 2)
    falls = int((upright < 0.9).sum())
    return RATIOS[0] + 0.005 * (falls - 0.5)


def balance_angle() -> float:
    """Return the angle at which the block balances on its edge [rad]."""
    return math.atan2(WIDTH, HEIGHT)


def frequency() -> float:
    """Return the parameter p of the rocking block, √(3 g / 4 R) [rad/s]."""
    return math.sqrt(0.75 * GRAVITY / math.hypot(WIDTH, HEIGHT))


def rocking_time() -> float:
    """Return how long the block takes from its release until it stands [s].

    About its edge it moves as a pendulum near its upper end, whose time is an elliptic integral.
    """
    from scipy.special import ellipkinc

    start = (1.0 - RELEASE) * balance_angle()  # from the balance
    modulus = math.cos(start / 2.0)
    at_end = math.asin(min(math.cos(balance_angle() / 2.0) / modulus, 1.0))
    quarter = float(ellipkinc(math.pi / 2.0, modulus**2))
    return (quarter - float(ellipkinc(at_end, modulus**2))) / frequency()


def rebound_angle() -> float:
    """Return how far the block rocks to the other side, over the angle of balance.

    The impact keeps the angular momentum about the new edge, 1 - 3/2 sin² α of it.
    """
    balance = balance_angle()
    kept = (1.0 - 1.5 * math.sin(balance) ** 2) ** 2
    drop = math.cos((1.0 - RELEASE) * balance) - math.cos(balance)
    return 1.0 - math.acos(kept * drop + math.cos(balance)) / balance


def _start() -> tuple[float, float, float]:
    """Return the place of its middle (x, z) [m] and its angle [rad] when it is released."""
    angle = RELEASE * balance_angle()
    cosine, sine = math.cos(angle), math.sin(angle)
    return HEIGHT * sine - WIDTH * cosine, HEIGHT * cosine + WIDTH * sine, angle


def _leaning() -> str:
    x, z, angle = _start()
    quat = f"{math.cos(angle / 2.0)!r} 0 {math.sin(angle / 2.0)!r} 0"
    return (
        '<worldbody><geom type="plane" size="0 0 1"/>'
        f'<body name="block" pos="{x!r} 0 {z!r}" quat="{quat}"><freejoint/>'
        f'<geom type="box" size="{WIDTH!r} 0.05 {HEIGHT!r}" mass="1"/></body></worldbody>'
    )


def _angle(data: Data) -> float:
    """Return the angle of the block about y [rad]."""
    return 2.0 * math.atan2(float(data.qpos[5]), float(data.qpos[3]))


def _angle_and_energy(data: Data) -> Array:
    """Return the angle [rad] and the energy [J], (2,); its mass is 1 kg."""
    velocity = np.array(data.qvel)
    inertia = (WIDTH**2 + HEIGHT**2) / 3.0
    kinetic = velocity[:3] @ velocity[:3] + inertia * velocity[4] ** 2
    return np.array([_angle(data), GRAVITY * float(data.qpos[2]) + kinetic / 2.0])


def _time_to_stand(run: Run) -> float:
    samples = run.sample(1.5 * rocking_time(), _angle)
    crossings = zero_crossings(samples, rising=False)
    return float(crossings[0]) if len(crossings) else math.inf


def _energy_error(run: Run) -> float:
    """Return by how much the energy of the fall changes at most, over what the fall frees."""
    energies = run.sample(0.9 * rocking_time(), _angle_and_energy).values[:, 1]
    freed = GRAVITY * (_start()[1] - HEIGHT)
    return float(np.abs(energies - energies[0]).max()) / freed


def _rebound(run: Run) -> float:
    samples: Samples = run.sample(4.0 * rocking_time(), _angle)
    return -float(samples.values.min()) / balance_angle()


CASES: tuple[Case, ...] = (
    Case(
        name="tipping-threshold",
        group="contact",
        description=(
            "Blocks of twenty widths stand on an incline; the width between those that "
            "tip over and those that stand is measured, over that of the closed form."
        ),
        mjcf=_row(),
        measure=_threshold,
        truth=one,
        unit="",
        source=_TIPPING,
        expected=on_engines(
            mujoco=bounded(0.03, "contact model"),
            pybullet=exact(),
            own=wrong(0.05, "engine's own"),
            motrix=wrong(0.046, "contact model", note=CORNERS),
        ),
        gravity=tilted_gravity(SLOPE),
        option=ROUND,
        tolerance=0.04,
        is_chaotic=True,
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="rocking-time",
        group="contact",
        description=(
            "A block leans on an edge by 0.6 of the angle of its balance; the time until "
            "it stands is measured."
        ),
        mjcf=_leaning(),
        measure=_time_to_stand,
        truth=rocking_time,
        unit="s",
        source=_HOUSNER,
        expected=on_engines(
            mujoco=converges(0.6, 0.0122),
            pybullet=converges(0.9, 0.0107),
            own=converges(0.7, 0.0094),
            rk4=bounded(0.0014, "contact model"),
            motrix=converges(1.1, 0.0098),
        ),
        option=ROUND,
        relative=True,
        tolerance=0.005,
    ),
    Case(
        name="rocking-energy",
        group="contact",
        description=(
            "The block of the case rocking-time; by how much its energy changes at most, "
            "of that which it frees, is measured."
        ),
        mjcf=_leaning(),
        measure=_energy_error,
        truth=zero,
        unit="",
        source=_HOUSNER,
        expected=on_engines(
            mujoco=bounded(0.081, "contact model"),
            pybullet=converges(0.6, 0.027),
            own=converges(0.6, 0.031),
            motrix=bounded(0.0875, "contact model", CORNERS),
        ),
        option=ROUND,
        tolerance=0.09,
    ),
    Case(
        name="rocking-rebound",
        group="contact",
        description=(
            "The block of the case rocking-time; how far it rocks to the other side is "
            "measured, over the angle of its balance."
        ),
        mjcf=_leaning(),
        measure=_rebound,
        truth=rebound_angle,
        unit="",
        source=_HOUSNER,
        expected=on_engines(
            mujoco=bounded(0.031, "contact model"),
            pybullet=bounded(0.013, "engine's own"),
            own=wrong(0.221, "engine's own"),
            motrix=bounded(0.0163, "contact model", CORNERS),
        ),
        option=ROUND,
        relative=True,
        tolerance=0.05,
        is_chaotic=True,
        timesteps=FEW_TIMESTEPS,
    ),
)
