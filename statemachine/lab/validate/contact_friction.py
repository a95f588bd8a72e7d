"""Cases of friction on a plane: a block that is pushed stops, and what sticks creeps."""

from __future__ import annotations

import math

import numpy as np

from ...interface import Data
from .case import GRAVITY, Case, bounded, converges, exact, exact_steps, wrong
from .contact_incline import DIAGONAL, FRICTION, SLIDING, STICKS, Incline, block
from .contact_steps import skid
from .contact_tools import PYRAMIDAL, ROUND, on_engines
from .known_causes import DEPTH, HARD_FRICTION, SQUARE
from .run import Run
from .soft_contact import SoftContact

SPEED = 2.0  # [m/s] of the block that is pushed
_SETTLING = 0.5  # [s]
_MANUAL = "MuJoCo's manual, chapter Computation, sections Constraint model and Parameters"


def _pushed_along(direction: float, run: Run) -> float:
    """Return how far a block slides that is pushed in a direction [rad], until it rests [m]."""
    run.advance(_SETTLING)
    data = run.data
    start = np.array(data.qpos[:2])
    data.qvel[:2] = SPEED * math.cos(direction), SPEED * math.sin(direction)
    run.advance(1.0)
    return float(np.linalg.norm(data.qpos[:2] - start))


def _stopped(run: Run) -> float:
    return _pushed_along(0.0, run)


def _stopped_diagonally(run: Run) -> float:
    return _pushed_along(DIAGONAL, run)


def stopping_distance() -> float:
    """Return v² / (2 μ g) [m]."""
    return SPEED**2 / (2.0 * FRICTION * GRAVITY)


_ON_SLIDES = (
    f'<worldbody><geom type="plane" size="0 0 1" friction="{FRICTION!r} 0 0"/>'
    '<body name="block" pos="0 0 0.1"><joint type="slide" axis="1 0 0"/>'
    '<joint type="slide" axis="0 1 0"/><joint type="slide" axis="0 0 1"/>'
    f'<geom type="sphere" size="0.1" mass="1" friction="{FRICTION!r} 0 0"/></body></worldbody>'
)


def _position(data: Data) -> float:
    return float(data.qpos[0])


def _creep_speed(run: Run) -> float:
    run.advance(1.0)
    start = _position(run.data)
    time = run.advance(1.0)
    return (_position(run.data) - start) / time


def creep_speed() -> float:
    """Return the speed at which a block creeps that MuJoCo's manual gives [m/s]."""
    pull, load = GRAVITY * math.sin(STICKS.angle), GRAVITY * math.cos(STICKS.angle)
    return SoftContact().creep_speed(load, pull)


_SKID_TIME = 0.5  # [s]
_SKIDS = Incline(1.2)
_LOAD, _PULL = GRAVITY * math.cos(_SKIDS.angle), GRAVITY * math.sin(_SKIDS.angle)


def _skidded(run: Run) -> float:
    run.advance(_SKID_TIME)
    return _position(run.data)


def _skid(time: float = _SKID_TIME) -> float:
    return _SKIDS.slid(time)


CASES: tuple[Case, ...] = (
    Case(
        name="block-stops",
        group="contact",
        description=(
            "A block is pushed at 2 m/s along an axis of the plane; its way until it "
            "rests is measured."
        ),
        mjcf=block(),
        measure=_stopped,
        truth=stopping_distance,
        unit="m",
        source=SLIDING,
        expected=on_engines(
            mujoco=converges(0.9, 0.012),
            pybullet=converges(0.7, 0.006),
            own=wrong(0.9, "engine's own"),
            rk4=bounded(0.001, "contact model"),
            motrix=converges(1.0, 0.0124),
        ),
        option=ROUND,
        relative=True,
        tolerance=0.007,
    ),
    Case(
        name="block-stops-diagonal-pyramidal",
        group="contact",
        description=(
            "As block-stops, along the diagonal of the axes and with MuJoCo's default cone."
        ),
        mjcf=block(),
        measure=_stopped_diagonally,
        truth=stopping_distance,
        unit="m",
        source=SLIDING,
        expected=on_engines(
            mujoco=wrong(0.415, "contact model"),
            pybullet=converges(0.8, 0.0084),
            own=wrong(0.9, "engine's own"),
            motrix=wrong(0.306, "contact model", note=SQUARE),
        ),
        option=PYRAMIDAL,
        relative=True,
        tolerance=0.009,
    ),
    Case(
        name="creep-of-solref",
        group="contact",
        description=(
            "A sphere that cannot turn lies on an incline of 0.9 of the friction; the "
            "speed at which the soft contact lets it creep is measured."
        ),
        mjcf=_ON_SLIDES,
        measure=_creep_speed,
        truth=creep_speed,
        unit="m/s",
        source=_MANUAL,
        expected=on_engines(
            mujoco=exact(1e-7),
            pybullet=wrong(1.0, "contact model"),
            own=wrong(1.0, "contact model"),
            discrete=converges(1.5, 0.04),
            motrix=wrong(1.0, "contact model", note=HARD_FRICTION),
        ),
        gravity=STICKS.gravity,
        option=ROUND,
        relative=True,
        rounding=1e-7,
    ),
    Case(
        name="sphere-skids",
        group="contact",
        description=(
            "A sphere that cannot turn skids down an incline of 1.2 of the friction; its "
            "way in half a second is measured."
        ),
        mjcf=_ON_SLIDES,
        measure=_skidded,
        truth=_skid,
        truth_after=_skid,
        unit="m",
        source=SLIDING,
        expected=on_engines(
            mujoco=exact_steps(0.00083),
            pybullet=converges(1.0, 0.00113),
            own=wrong(0.106, "engine's own"),
            rk4=converges(1.5, 1.4e-5, "contact model"),
            discrete=converges(1.0, 0.00102),
            motrix=converges(0.7, 0.00122, "contact model", DEPTH),
        ),
        gravity=_SKIDS.gravity,
        option=ROUND,
        discrete=skid(SoftContact(), FRICTION, (_LOAD, _PULL), _SKID_TIME),
        tolerance=0.001,
    ),
)
