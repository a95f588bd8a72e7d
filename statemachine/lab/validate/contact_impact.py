"""Cases of impact: two bodies collide, a ball bounces."""

from __future__ import annotations

import math

from ...interface import Data
from .case import GRAVITY, Case, converges, exact, exact_steps, rounded, wrong
from .contact_steps import Step, each_step, on_spring
from .contact_tools import on_engines
from .known_causes import IMPLICIT_DAMPING
from .run import Run, zero
from .soft_contact import spring_of_restitution

HEIGHT = 0.5  # [m] from which the ball falls
MASSES = (1.0, 3.0)  # [kg] of the two that collide
VELOCITIES = (0.2, -0.1)  # [m/s]
SPRING = spring_of_restitution(0.5, stiffness=1e5, impedance=0.99)
SOFT = spring_of_restitution(0.5, stiffness=400.0, impedance=0.99)  # half a period: 160 ms
_IMPULSE = "Meriam, Kraige: Engineering Mechanics, Dynamics, 7th ed., article 3/12"
_POESCHEL = (
    "Schwager, Pöschel: Coefficient of restitution and linear-dashpot model revisited, Granular "
    "Matter 9 (2007)"
)
_RADIUS = 0.1  # [m]
_GAP = 0.02  # [m] between the two that collide, at the start
_FALL = math.sqrt(2.0 * HEIGHT / GRAVITY)  # [s]
_AT = _RADIUS + _GAP / 2.0  # [m] of each of the two, from the middle between them
_TWO = (
    f'<worldbody><body name="light" pos="{-_AT!r} 0 0"><freejoint/>'
    f'<geom type="sphere" size="{_RADIUS!r}" mass="{MASSES[0]!r}" {SOFT.mjcf}/></body>'
    f'<body name="heavy" pos="{_AT!r} 0 0"><freejoint/>'
    f'<geom type="sphere" size="{_RADIUS!r}" mass="{MASSES[1]!r}" {SOFT.mjcf}/></body></worldbody>'
)
_BALL = (
    f'<worldbody><geom type="plane" size="0 0 1" {SPRING.mjcf}/>'
    f'<body name="ball" pos="0 0 {HEIGHT + _RADIUS!r}"><freejoint/><geom type="sphere" '
    f'size="{_RADIUS!r}" mass="1" {SPRING.mjcf}/></body></worldbody>'
)


def _collide(run: Run) -> None:
    """Let the two collide; nothing else acts."""
    run.data.qvel[0], run.data.qvel[6] = VELOCITIES
    run.advance(1.0)


def _momentum(run: Run) -> float:
    _collide(run)
    light, heavy = run.data.qvel[0], run.data.qvel[6]
    return float(MASSES[0] * light + MASSES[1] * heavy)


def momentum() -> float:
    """Return the momentum before the collision [kg·m/s]."""
    return MASSES[0] * VELOCITIES[0] + MASSES[1] * VELOCITIES[1]


def _restitution(run: Run) -> float:
    """Return the speed at which the two part over that at which they met."""
    _collide(run)
    parting = float(run.data.qvel[6] - run.data.qvel[0])
    return parting / (VELOCITIES[0] - VELOCITIES[1])


def _stepwise_restitution(step: Step, h: float) -> float:
    """Return the same of steps of the length h [s], by the distance between the two."""
    approach = VELOCITIES[0] - VELOCITIES[1]
    place, speed = _GAP, -approach
    for _ in range(round(1.0 / h)):
        place, speed = step(on_spring(SOFT, 0.0), place, speed, h)
    return speed / approach


def _restitution_of_spring() -> float:
    return SOFT.restitution


def _height(data: Data) -> float:
    return float(data.qpos[2]) - _RADIUS


def _bounce(run: Run) -> float:
    """Return the height of the first bounce over that of the fall."""
    run.advance(1.15 * _FALL)
    heights = run.sample(1.7 * _FALL, _height).values
    return float(heights.max()) / HEIGHT


def _stepwise_bounce(step: Step, h: float) -> float:
    """Return the same of steps of the length h [s]."""
    place, speed = HEIGHT, 0.0
    heights: list[float] = []
    skipped = round(1.15 * _FALL / h)
    for k in range(skipped + round(1.7 * _FALL / h)):
        place, speed = step(on_spring(SPRING, GRAVITY), place, speed, h)
        if k >= skipped:
            heights.append(place)
    return max(heights) / HEIGHT


def _bounce_of_spring() -> float:
    return SPRING.bounce(HEIGHT)


def _gain(run: Run) -> float:
    """Return by how much the ball rises above its start [m]; 0 if it does not."""
    heights = run.sample(2.0, _height).values
    return max(float(heights[1:].max()) - HEIGHT, 0.0)


CASES: tuple[Case, ...] = (
    Case(
        name="collision-momentum",
        group="contact",
        description=(
            "Two spheres of 1 kg and 3 kg collide head on; their momentum afterwards is measured."
        ),
        mjcf=_TWO,
        measure=_momentum,
        truth=momentum,
        unit="kg·m/s",
        source=_IMPULSE,
        expected=on_engines(
            mujoco=exact(),
            pybullet=exact(),
            own=wrong(0.037, "engine's own"),
            motrix=rounded(),
        ),
        gravity=(0.0, 0.0, 0.0),
        relative=True,
    ),
    Case(
        name="collision-restitution",
        group="contact",
        description=(
            "Two spheres collide whose contact is a damped spring that cannot pull; the "
            "speed at which they part is measured, over that at which they met."
        ),
        mjcf=_TWO,
        measure=_restitution,
        truth=_restitution_of_spring,
        unit="",
        source=_POESCHEL,
        expected=on_engines(
            mujoco=exact_steps(4e-4, None),
            pybullet=wrong(0.54, "computed by our backend"),
            own=wrong(0.54, "engine's own"),
            rk4=exact_steps(0.0016),
            discrete=converges(0.8, 0.024),
            motrix=converges(1.0, 0.0028, "discretisation", IMPLICIT_DAMPING),
        ),
        gravity=(0.0, 0.0, 0.0),
        tolerance=0.004,
        discrete=each_step(_stepwise_restitution),
        timesteps=(0.002, 0.001, 0.0005, 0.00025),
    ),
    Case(
        name="bounce",
        group="contact",
        description=(
            "A ball falls from 0.5 m on a damped spring that cannot pull, of nominal "
            "restitution 0.5; the height to which it rises is measured, over that of its "
            "fall."
        ),
        mjcf=_BALL,
        measure=_bounce,
        truth=_bounce_of_spring,
        unit="",
        source=_POESCHEL,
        expected=on_engines(
            mujoco=exact_steps(1.39),
            pybullet=wrong(0.301, "computed by our backend"),
            own=wrong(0.2982, "engine's own"),
            rk4=exact_steps(0.094),
            discrete=wrong(0.2, "discretisation"),
            motrix=converges(1.5, 0.107, "discretisation", IMPLICIT_DAMPING),
        ),
        discrete=each_step(_stepwise_bounce),
        timesteps=(0.005, 0.002, 0.001, 0.0005, 0.00025),
    ),
    Case(
        name="bounce-gain",
        group="contact",
        description=(
            "The ball of the case bounce; by how much it rises above its start within 2 s"
            " is measured."
        ),
        mjcf=_BALL,
        measure=_gain,
        truth=zero,
        unit="m",
        source="Goldstein, Poole, Safko: Classical Mechanics, 3rd ed., section 1.1",
        expected=on_engines(
            mujoco=wrong(3.42, "discretisation"),
            pybullet=exact(),
            own=exact(),
            rk4=exact(),
            discrete=exact(),
            motrix=exact(),
        ),
    ),
)
