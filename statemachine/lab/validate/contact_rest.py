"""Cases of bodies at rest on others: forces by statics, and how deep soft contacts are."""

from __future__ import annotations

import math

import numpy as np

from .case import FEW_TIMESTEPS, GRAVITY, Case, bounded, exact, rounded, wrong
from .contact_tools import ROUND, forces_on, net_force, on_engines
from .known_causes import COLD_START, INVERSE_INERTIA, ORDER, ROCKING
from .run import Run, zero
from .soft_contact import SoftContact

LEFT, RIGHT = math.radians(30.0), math.radians(60.0)  # of the two planes of the groove
STACK = 5  # boxes
GRIP = 10.0  # [N] of each finger
_MASS = 2.0  # [kg] of what lies alone
_HALF = 0.05  # [m] of a box of the stack
_STATICS = "Meriam, Kraige: Engineering Mechanics, Statics, 7th ed., article 3/3"
_COULOMB = "Meriam, Kraige: Engineering Mechanics, Statics, 7th ed., article 6/3"
_NEWTON = "Goldstein, Poole, Safko: Classical Mechanics, 3rd ed., section 1.2"
_MANUAL = "MuJoCo's manual, chapter Computation, sections Constraint model and Parameters"
_FLOOR = '<geom type="plane" size="0 0 1"/>'
_LYING = (
    f'<worldbody>{_FLOOR}<body name="box" pos="0 0 0.05"><freejoint/>'
    f'<geom type="box" size="0.1 0.1 0.05" mass="{_MASS!r}"/></body></worldbody>'
)
_SPHERE = (
    f'<worldbody>{_FLOOR}<body name="sphere" pos="0 0 0.1"><freejoint/>'
    '<geom type="sphere" size="0.1" mass="1"/></body></worldbody>'
)


def _vertical_force(run: Run) -> float:
    """Return the force of the floor on what lies on it [N]."""
    run.advance(1.0)
    return float(net_force(run.data)[2])


def _weight() -> float:
    return _MASS * GRAVITY


def _depth(run: Run) -> float:
    run.advance(1.0)
    return 0.1 - float(run.data.qpos[2])


def depth() -> float:
    """Return how deep the contact of a sphere is, by solref and solimp [m]."""
    return SoftContact().depth_at_rest(GRAVITY)


def _stack() -> str:
    boxes: list[str] = []
    for k in range(STACK):
        boxes.append(
            f'<body pos="0 0 {_HALF + 2.0 * _HALF * k!r}"><freejoint/>'
            f'<geom type="box" size="{_HALF!r} {_HALF!r} {_HALF!r}" mass="1"/></body>'
        )
    return f"<worldbody>{_FLOOR}{''.join(boxes)}</worldbody>"


def _sag(run: Run) -> float:
    """Return how much deeper the uppermost box lies than boxes that are stiff [m]."""
    run.advance(1.0)
    top = float(run.data.qpos[7 * (STACK - 1) + 2])
    return _HALF + 2.0 * _HALF * (STACK - 1) - top


def sag() -> float:
    """Return the depths of all contacts of the stack, by solref and solimp [m].

    A corner carries a quarter of what lies above; the floor lets the contact feel one box's
    inverse mass, a box adds its own.
    """
    total = 0.0
    for k in range(STACK):
        inverse_mass = 1.0 if k == 0 else 2.0
        total += SoftContact().depth_at_rest(inverse_mass * (STACK - k) * GRAVITY / 4.0)
    return total


# Measured on 3.0.1, 3.3.7, 3.4.0, 3.5.0, 3.7.0, 3.9.0 and 4.0.0.
_HALF_OF_OVERLAP = wrong(
    0.791,
    "engine's own",
    note=(
        "Up to release 3.3.7 the distance of a contact between two boxes is half of their "
        "overlap, so that they sink twice as deep; from 3.4.0 on it is all of it."
    ),
)


_SAG_ON_ENGINES = on_engines(
    mujoco=exact(1e-5),
    pybullet=wrong(0.98, "contact model"),
    own=wrong(0.98, "contact model"),
    motrix=wrong(1.7, "contact model", note=INVERSE_INERTIA),
)
_SAG_ON_ENGINES |= {"mujoco==3.3.7 *": _HALF_OF_OVERLAP, "mujoco==3.0.1 *": _HALF_OF_OVERLAP}

# What is rounded is the place of the sphere, 0.1 m; what is measured, its depth.
_ROUNDED_PLACE = rounded(0.1 / depth())


def _weight_of_stack() -> float:
    return STACK * GRAVITY


def _groove() -> str:
    """Return a sphere between two planes without friction that meet along the y axis."""
    left = f"{math.cos(LEFT / 2.0)!r} 0 {math.sin(LEFT / 2.0)!r} 0"
    right = f"{math.cos(RIGHT / 2.0)!r} 0 {-math.sin(RIGHT / 2.0)!r} 0"
    normals = [[math.sin(LEFT), math.cos(LEFT)], [-math.sin(RIGHT), math.cos(RIGHT)]]
    x, z = np.linalg.solve(normals, [0.1, 0.1]).tolist()
    return (
        f'<worldbody><geom type="plane" size="0 0 1" quat="{left}" condim="1"/>'
        f'<geom type="plane" size="0 0 1" quat="{right}" condim="1"/>'
        f'<body name="sphere" pos="{x!r} 0 {z!r}"><freejoint/>'
        f'<geom type="sphere" size="0.1" mass="{_MASS!r}" condim="1"/></body></worldbody>'
    )


def _force_of_left(run: Run) -> float:
    """Return the force of the less steep plane [N]."""
    run.advance(1.0)
    return float(np.linalg.norm(forces_on(run.data, (0,)).sum(axis=0)))


def force_of_left() -> float:
    """Return m g sin β / sin(α + β), by Lami's theorem [N]."""
    return _MASS * GRAVITY * math.sin(RIGHT) / math.sin(LEFT + RIGHT)


def _finger(name: str, x: float, axis: int) -> str:
    return (
        f'<body name="{name}" pos="{x!r} 0 1"><joint name="{name}" type="slide" '
        f'axis="{axis} 0 0" damping="10"/><geom type="box" size="0.02 0.03 0.03" mass="0.2" '
        'friction="0.5 0 0"/></body>'
    )


_HELD = (
    f"<worldbody>{_finger('left', -0.07, 1)}{_finger('right', 0.07, -1)}"
    '<body name="box" pos="0 0 1"><freejoint/>'
    '<geom type="box" size="0.05 0.02 0.02" mass="0.5" friction="0.5 0 0"/></body></worldbody>'
    '<actuator><position name="left" joint="left" kp="1000" kv="20"/>'
    '<position name="right" joint="right" kp="1000" kv="20"/></actuator>'
)


def _slip(run: Run) -> float:
    """Return how far the box slips down in 1 s, once it is held [m]."""
    data = run.data
    data.ctrl[:] = GRIP / 1000.0
    run.advance(0.5)
    start = float(data.qpos[4])
    run.advance(1.0)
    return start - float(data.qpos[4])


def _two_towers() -> str:
    """Return two towers of two boxes; of one the file names the lower box first."""
    box = '<geom type="box" size="0.05 0.05 0.05" mass="{mass}"/>'
    bodies: list[str] = []
    for x, z, mass in ((0, 0.06, 1), (0, 0.17, 2), (5, 0.17, 2), (5, 0.06, 1)):
        bodies.append(f'<body pos="{x} 0 {z}"><freejoint/>{box.format(mass=mass)}</body>')
    return f"<worldbody>{_FLOOR}{''.join(bodies)}</worldbody>"


def _gap_of_towers(run: Run) -> float:
    """Return by how much the places in the two towers differ at most [m]."""
    run.advance(0.5)
    places = run.data.qpos.reshape(4, 7)[:, :3] - np.array([[0, 0, 0]] * 2 + [[5, 0, 0]] * 2)
    return float(np.abs(places[[0, 1]] - places[[3, 2]]).max())


CASES: tuple[Case, ...] = (
    Case(
        name="resting-force",
        group="contact",
        description="A box lies on a floor; the force of the floor is measured.",
        mjcf=_LYING,
        measure=_vertical_force,
        truth=_weight,
        unit="N",
        source=_STATICS,
        expected=on_engines(
            mujoco=exact(1e-6),
            pybullet=exact(1e-6),
            own=exact(1e-6),
            motrix=bounded(1.6e-4, "computed by our backend", COLD_START),
        ),
        relative=True,
        rounding=1e-6,
        tolerance=0.001,
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="contact-depth",
        group="contact",
        description=(
            "A sphere lies on a floor; how deep its soft contact is, by solref and "
            "solimp, is measured."
        ),
        mjcf=_SPHERE,
        measure=_depth,
        truth=depth,
        unit="m",
        source=_MANUAL,
        expected=on_engines(
            mujoco=exact(1e-6),
            pybullet=wrong(0.98, "contact model"),
            own=wrong(0.98, "contact model"),
            motrix=_ROUNDED_PLACE,
        ),
        relative=True,
        rounding=1e-6,
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="stack-force",
        group="contact",
        description=("Five boxes of 1 kg are stacked; the force of the floor is measured."),
        mjcf=_stack(),
        measure=_vertical_force,
        truth=_weight_of_stack,
        unit="N",
        source=_STATICS,
        expected=on_engines(
            mujoco=exact(1e-4),
            pybullet=exact(1e-4),
            own=exact(1e-4),
            motrix=wrong(0.06, "engine's own", note=ROCKING),
        ),
        option=ROUND,
        relative=True,
        rounding=1e-4,
        tolerance=0.002,
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="stack-sag",
        group="contact",
        description=(
            "Five boxes of 1 kg are stacked; how much lower the uppermost lies than stiff"
            " ones would is measured."
        ),
        mjcf=_stack(),
        measure=_sag,
        truth=sag,
        unit="m",
        source=_MANUAL,
        expected=_SAG_ON_ENGINES,
        option=ROUND,
        relative=True,
        rounding=1e-5,
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="groove-force",
        group="contact",
        description=(
            "A sphere lies between planes of 30 and 60 degrees; the force of the first is measured."
        ),
        mjcf=_groove(),
        measure=_force_of_left,
        truth=force_of_left,
        unit="N",
        source=_STATICS,
        expected=on_engines(
            mujoco=exact(1e-6),
            pybullet=exact(1e-6),
            own=exact(1e-6),
            motrix=rounded(),
        ),
        relative=True,
        rounding=1e-6,
        tolerance=0.001,
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="held-box",
        group="contact",
        description=(
            "Two fingers press a box with 10 N each, twice what friction needs; how "
            "far it slips in 1 s is measured."
        ),
        mjcf=_HELD,
        measure=_slip,
        truth=zero,
        unit="m",
        source=_COULOMB,
        expected=on_engines(
            mujoco=bounded(0.00325, "contact model"),
            pybullet=bounded(0.0005, "engine's own"),
            own=wrong(0.023, "engine's own"),
            motrix=rounded(),
        ),
        option=ROUND,
        tolerance=0.005,
        is_chaotic=True,
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="order-of-bodies",
        group="contact",
        description=(
            "Two towers of two boxes fall on a floor, of one the file names the lower box"
            " first; by how much they differ is measured."
        ),
        mjcf=_two_towers(),
        measure=_gap_of_towers,
        truth=zero,
        unit="m",
        source=_NEWTON,
        expected=on_engines(
            mujoco=exact(1e-6),
            pybullet=bounded(0.0005, "engine's own"),
            own=exact(1e-6),
            motrix=bounded(1.4e-5, "engine's own", ORDER),
        ),
        option=ROUND,
        rounding=1e-6,
        tolerance=0.001,
        is_chaotic=True,
        timesteps=FEW_TIMESTEPS,
    ),
)
