"""Cases of blocks on an incline: they stick or slide, and what the friction cone lets them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...interface.records import Array
from .case import FEW_TIMESTEPS, GRAVITY, Case, bounded, converges, exact, rounded, wrong
from .contact_tools import PYRAMIDAL, ROUND, net_force, on_engines, one, tilted_gravity
from .known_causes import DEPTH, HARD_FRICTION, SQUARE
from .run import Run, zero

FRICTION = 0.5
SLIDING = "Meriam, Kraige: Engineering Mechanics, Dynamics, 7th ed., articles 3/4 and 6/3"
_SETTLING = 0.5  # [s]
DIAGONAL = math.pi / 4.0  # between the two axes along which MuJoCo's pyramidal cone has its edges
# What the threshold is looked for between: frictions over the tangent of the incline.
_RATIOS = tuple(round(0.955 + 0.01 * k, 3) for k in range(10))
_SLID = 0.005  # [m] in a second: what sticks creeps 1.3 mm, what slides makes 10 mm or more
_COULOMB = "Meriam, Kraige: Engineering Mechanics, Statics, 7th ed., article 6/3"


@dataclass(frozen=True)
class Incline:
    """An incline that a block lies on: a plane, and gravity that leans.

    Attributes:
        steepness: Tangent of its angle over the friction.
        direction: Of the slope in the plane, from x to y [rad].
    """

    steepness: float
    direction: float = 0.0

    @property
    def angle(self) -> float:
        """Return the angle of the incline [rad]."""
        return math.atan(self.steepness * FRICTION)

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Return gravity in the axes of the plane [m/s²]."""
        return tilted_gravity(self.angle, self.direction)

    @property
    def downhill(self) -> Array:
        """Return the unit vector along the slope, (2,)."""
        return np.array([math.cos(self.direction), math.sin(self.direction)])

    def acceleration(self) -> float:
        """Return that of a block that slides [m/s²]; 0 for one that sticks."""
        pull, hold = math.sin(self.angle), FRICTION * math.cos(self.angle)
        return GRAVITY * max(pull - hold, 0.0)

    def slide(self, run: Run) -> float:
        """Return how far the block slid down in 2 s [m]."""
        run.advance(2.0)
        return float(self.downhill @ run.data.qpos[:2])

    def slid(self, time: float = 2.0) -> float:
        """Return how far it slides in a time [s] by the closed form [m]."""
        return self.acceleration() * time**2 / 2.0

    def creep(self, run: Run) -> float:
        """Return how far the block slid in the second second [m]."""
        run.advance(1.0)
        start = float(self.downhill @ run.data.qpos[:2])
        run.advance(1.0)
        return float(self.downhill @ run.data.qpos[:2]) - start

    def cone(self, run: Run) -> float:
        """Return the friction over the normal force of a sliding block, mean of half a second."""
        run.advance(_SETTLING)
        forces = run.sample(0.5, net_force).values[1:].sum(axis=0)
        return float(np.linalg.norm(forces[:2]) / forces[2])


STICKS = Incline(0.9)
_STICKS_DIAGONALLY = Incline(0.9, DIAGONAL)
_SLIDES = Incline(1.2)
_SLIDES_DIAGONALLY = Incline(1.2, DIAGONAL)


def block(friction: float = FRICTION) -> str:
    """Return a block of 1 kg on a plane, both of one friction."""
    return (
        f'<worldbody><geom type="plane" size="0 0 1" friction="{friction!r} 0 0"/>'
        '<body name="block" pos="0 0 0.05"><freejoint/>'
        f'<geom type="box" size="0.1 0.1 0.05" mass="1" friction="{friction!r} 0 0"/>'
        "</body></worldbody>"
    )


def _blocks() -> str:
    """Return a row of blocks that touch only the plane, each with a friction of its own."""
    tangent = math.tan(STICKS.angle)
    bodies: list[str] = []
    for k, ratio in enumerate(_RATIOS):
        bodies.append(
            f'<body pos="0 {0.3 * k:g} 0.05"><freejoint/>'
            f'<geom type="box" size="0.1 0.1 0.05" mass="1" friction="{ratio * tangent!r} 0 0" '
            'contype="2" conaffinity="1"/></body>'
        )
    plane = '<geom type="plane" size="0 0 1" friction="0 0 0" contype="1" conaffinity="2"/>'
    return f"<worldbody>{plane}{''.join(bodies)}</worldbody>"


def _threshold(run: Run) -> float:
    """Return the friction, over the tangent, between the last block that slides and the next."""
    run.advance(1.0)
    distances = run.data.qpos.reshape(-1, 7)[:, 0]
    slides = int((distances > _SLID).sum())
    return _RATIOS[0] + 0.01 * (slides - 0.5)


def _friction() -> float:
    return FRICTION


CASES: tuple[Case, ...] = (
    Case(
        name="block-sticks",
        group="contact",
        description=(
            "A block lies on an incline whose tangent is 0.9 of the friction; how far it "
            "slides in a second is measured."
        ),
        mjcf=block(),
        measure=STICKS.creep,
        truth=zero,
        unit="m",
        source=_COULOMB,
        expected=on_engines(
            mujoco=bounded(0.0012, "contact model"),
            pybullet=bounded(0.0005, "engine's own"),
            own=wrong(2.48, "engine's own"),
            motrix=bounded(3.1e-6, "contact model", HARD_FRICTION),
        ),
        gravity=STICKS.gravity,
        option=ROUND,
        tolerance=0.002,
        is_chaotic=True,
    ),
    Case(
        name="block-sticks-pyramidal",
        group="contact",
        description="As block-sticks, with MuJoCo's default cone, a pyramid.",
        mjcf=block(),
        measure=STICKS.creep,
        truth=zero,
        unit="m",
        source=_COULOMB,
        expected=on_engines(
            mujoco=bounded(0.0046, "contact model"),
            pybullet=bounded(0.0005, "engine's own"),
            own=wrong(2.48, "engine's own"),
            motrix=bounded(3.1e-6, "contact model", HARD_FRICTION),
        ),
        gravity=STICKS.gravity,
        option=PYRAMIDAL,
        tolerance=0.006,
        is_chaotic=True,
    ),
    Case(
        name="block-sticks-diagonal",
        group="contact",
        description="As block-sticks, with the slope along the diagonal of the axes.",
        mjcf=block(),
        measure=_STICKS_DIAGONALLY.creep,
        truth=zero,
        unit="m",
        source=_COULOMB,
        expected=on_engines(
            mujoco=bounded(0.0012, "contact model"),
            pybullet=bounded(0.0005, "engine's own"),
            own=wrong(2.48, "engine's own"),
            motrix=bounded(3.8e-6, "contact model", HARD_FRICTION),
        ),
        gravity=_STICKS_DIAGONALLY.gravity,
        option=ROUND,
        tolerance=0.002,
        is_chaotic=True,
    ),
    Case(
        name="block-sticks-diagonal-pyramidal",
        group="contact",
        description=("As block-sticks-diagonal, with MuJoCo's default cone, a pyramid."),
        mjcf=block(),
        measure=_STICKS_DIAGONALLY.creep,
        truth=zero,
        unit="m",
        source=_COULOMB,
        expected=on_engines(
            mujoco=wrong(1.3, "contact model"),
            pybullet=bounded(0.0005, "engine's own"),
            own=wrong(2.48, "engine's own"),
            motrix=bounded(3.8e-6, "contact model", HARD_FRICTION),
        ),
        gravity=_STICKS_DIAGONALLY.gravity,
        option=PYRAMIDAL,
        tolerance=0.006,
        is_chaotic=True,
    ),
    Case(
        name="friction-threshold",
        group="contact",
        description=(
            "Blocks of ten frictions lie on an incline; the friction between those that "
            "slide and those that stick is measured, over the tangent."
        ),
        mjcf=_blocks(),
        measure=_threshold,
        truth=one,
        unit="",
        source=_COULOMB,
        expected=on_engines(
            mujoco=exact(),
            pybullet=exact(),
            own=wrong(0.05, "engine's own"),
            motrix=exact(),
        ),
        gravity=STICKS.gravity,
        option=ROUND,
        tolerance=0.006,
        is_chaotic=True,
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="block-slides",
        group="contact",
        description=(
            "A block slides down an incline whose tangent is 1.2 of the friction; its way"
            " in 2 s is measured."
        ),
        mjcf=block(),
        measure=_SLIDES.slide,
        truth=_SLIDES.slid,
        truth_after=_SLIDES.slid,
        unit="m",
        source=SLIDING,
        expected=on_engines(
            mujoco=converges(0.9, 0.0021, "contact model"),
            pybullet=converges(1.0, 0.033),
            own=wrong(2.2, "engine's own"),
            rk4=converges(0.9, 1.3e-4, "contact model"),
            motrix=converges(0.8, 0.00264, "contact model", DEPTH),
        ),
        gravity=_SLIDES.gravity,
        option=ROUND,
        relative=True,
        tolerance=0.004,
    ),
    Case(
        name="block-slides-diagonal",
        group="contact",
        description="As block-slides, with the slope along the diagonal of the axes.",
        mjcf=block(),
        measure=_SLIDES_DIAGONALLY.slide,
        truth=_SLIDES_DIAGONALLY.slid,
        truth_after=_SLIDES_DIAGONALLY.slid,
        unit="m",
        source=SLIDING,
        expected=on_engines(
            mujoco=bounded(5e-4, "contact model"),
            pybullet=converges(1.0, 0.033),
            own=wrong(2.2, "engine's own"),
            discrete=converges(1.0, 0.0028, "contact model"),
            motrix=wrong(1.0, "contact model", note=SQUARE),
        ),
        gravity=_SLIDES_DIAGONALLY.gravity,
        option=ROUND,
        relative=True,
        tolerance=0.004,
    ),
    Case(
        name="block-slides-diagonal-pyramidal",
        group="contact",
        description=("As block-slides-diagonal, with MuJoCo's default cone, a pyramid."),
        mjcf=block(),
        measure=_SLIDES_DIAGONALLY.slide,
        truth=_SLIDES_DIAGONALLY.slid,
        truth_after=_SLIDES_DIAGONALLY.slid,
        unit="m",
        source=SLIDING,
        expected=on_engines(
            mujoco=wrong(1.48, "contact model"),
            pybullet=converges(1.0, 0.033),
            own=wrong(2.2, "engine's own"),
            motrix=wrong(1.0, "contact model", note=SQUARE),
        ),
        gravity=_SLIDES_DIAGONALLY.gravity,
        option=PYRAMIDAL,
        relative=True,
        tolerance=0.004,
    ),
    Case(
        name="friction-cone",
        group="contact",
        description=(
            "A block slides down an incline; the friction force over the normal force is measured."
        ),
        mjcf=block(),
        measure=_SLIDES.cone,
        truth=_friction,
        unit="",
        source=_COULOMB,
        expected=on_engines(
            mujoco=exact(),
            pybullet=converges(1.5, 0.0039),
            own=wrong(0.5, "engine's own"),
            motrix=rounded(),
        ),
        gravity=_SLIDES.gravity,
        option=ROUND,
        relative=True,
        tolerance=0.002,
    ),
    Case(
        name="friction-cone-diagonal-pyramidal",
        group="contact",
        description=(
            "As friction-cone, along the diagonal of the axes and with MuJoCo's default cone."
        ),
        mjcf=block(),
        measure=_SLIDES_DIAGONALLY.cone,
        truth=_friction,
        unit="",
        source=_COULOMB,
        expected=on_engines(
            mujoco=wrong(0.293, "contact model"),
            pybullet=converges(1.5, 0.0039),
            own=wrong(0.5, "engine's own"),
            motrix=wrong(0.2, "contact model", note=SQUARE),
        ),
        gravity=_SLIDES_DIAGONALLY.gravity,
        option=PYRAMIDAL,
        relative=True,
        tolerance=0.002,
    ),
)
