"""Pairs of models whose causes are known, and pairs that say the same otherwise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .explained import (
    ARM,
    equality,
    hills,
    ledge,
    lowered,
    mesh,
    servo,
    with_changes,
)

Game = tuple[str, str, dict[str, float]]


def at_70_to_30(seed: int) -> Game:
    """Return two servos under weights that differ by 70 and 30 parts: one sags by their sum."""
    size = np.random.default_rng(seed).uniform(0.2, 0.6)
    left, right = servo(), servo(1.0 + 0.7 * size, 1.0 + 0.3 * size)
    parts = {"mass of slider": 0.7, "mass of load": 0.3, "gap": 9.81 * size / 200}
    return left, right.replace(_kv(right), _kv(left)), parts


def that_interact(seed: int) -> Game:
    """Return two servos that differ in weight and in gain: one sags by weight over gain."""
    random = np.random.default_rng(seed)
    mass, kp = random.uniform(2, 3), random.uniform(80, 140)

    def gap(m: float, k: float) -> float:
        return 9.81 * abs((m + 1) / k - 2 / 200)

    whole = gap(mass, kp)
    heavier = ((whole - gap(1, kp)) + gap(mass, 200)) / 2 / whole
    left, right = servo(), servo(mass, 1.0, kp)
    parts = {"mass of slider": heavier, "gains of slider": 1 - heavier, "gap": whole}
    return left, right.replace(_kv(right), _kv(left)), parts


def _kv(text: str) -> str:
    start = text.index('kv="')
    return text[start : text.index('"', start + 4) + 1]


SAME = {
    "fullinertia": [
        (
            'pos="0 0 -0.08" diaginertia="0.001 0.001 0.0002"',
            'pos="0 0 -0.08" fullinertia="0.001 0.001 0.0002 0 0 0"',
        )
    ],
    "turned inertia": [
        (
            'pos="0 0 -0.08" diaginertia="0.001 0.001 0.0002"',
            'pos="0 0 -0.08" quat="0.5 0.5 0.5 0.5" diaginertia="0.001 0.0002 0.001"',
        )
    ],
    "degrees": [
        ('<compiler angle="radian"/>', '<compiler angle="degree"/>'),
        ('range="-2 2"', f'range="{np.degrees(-2):.15g} {np.degrees(2):.15g}"'),
    ],
    "inlined defaults": [
        ('<default><geom density="0"/></default>', ""),
        ('name="upper_shape"', 'name="upper_shape" density="0"'),
        ('name="lower_shape"', 'name="lower_shape" density="0"'),
    ],
    "fixed body": [
        ('<geom name="lower_shape"', '<body name="shell"><geom name="lower_shape"'),
        ('fromto="0 0 0 0 0 -0.15"/>', 'fromto="0 0 0 0 0 -0.15"/></body>'),
    ],
    "mass in a fixed body": [
        (
            '<inertial mass="0.3" pos="0 0 -0.08" diaginertia="0.001 0.001 0.0002"/>',
            '<inertial mass="1e-9" pos="0 0 -0.08" diaginertia="1e-9 1e-9 1e-9"/><body '
            'name="core" pos="0 0 -0.08"><inertial mass="0.299999999" pos="0 0 0" '
            'diaginertia="0.000999999 0.000999999 0.000199999"/></body>',
        )
    ],
    "what shows it": [
        ('name="floor"', 'name="floor" rgba="1 0 0 1" group="3"'),
        ("<worldbody>", '<worldbody><light pos="0 0 3"/><camera name="a" pos="0 0 3"/>'),
    ],
    "shape that touches nothing": [
        (
            '<site name="tip"',
            '<geom name="look" size="0.1" contype="0" conaffinity="0"/><site name="tip"',
        )
    ],
    "renamed": [('name="lower"', 'name="forearm"'), ('name="upper"', 'name="arm"')],
    "permuted bodies": [],
    "permuted actuators": [],
}


def with_actuators_swapped(text: str) -> str:
    """Return the model with the two actuators in the other order."""
    lines = [f'<position name="{n}" joint="{n}" kp="20" kv="1"/>' for n in ("shoulder", "elbow")]
    return text.replace(lines[0], "@").replace(lines[1], lines[0]).replace("@", lines[1])


def said_otherwise(name: str) -> str:
    """Return the arm in other words."""
    right = with_changes(ARM, SAME[name])
    if name == "permuted bodies":  # and with them the order of qpos
        start, end = right.index('<body name="ball"'), right.index('<body name="weight"')
        ball = right[start:end]
        right = right.replace(ball, "").replace('<body name="upper"', f'{ball}<body name="upper"')
        right = right.replace('qpos="0 0  0.6 0 0.2 1 0 0 0  0"', 'qpos="0.6 0 0.2 1 0 0 0 0 0 0"')
    return with_actuators_swapped(right) if name == "permuted actuators" else right


Sides = Callable[[], tuple[str, str]]

# Two sides that say the same in other words, by what is other.
EQUIVALENT: dict[str, Sides] = {
    "mesh in another order": lambda: (mesh(), mesh(order=1)),
    "connect swapped": lambda: (
        equality('<connect body1="lower" body2="ball" anchor="0 0 -0.1"/>'),
        equality('<connect body1="ball" body2="lower" anchor="-0.6 0 0"/>'),
    ),
    "weld swapped": lambda: (
        equality('<weld body1="lower" body2="ball" anchor="-0.3 0 0.05"/>'),
        equality('<weld body1="ball" body2="lower" anchor="0.3 0 -0.05"/>'),
    ),
    "weld in another frame": lambda: (
        equality('<weld body1="ball" body2="lower" anchor="0 0 -0.1"/>'),
        lowered(equality('<weld body1="ball" body2="lower" anchor="0 0 -0.05"/>')),
    ),
    "connect in another frame": lambda: (
        equality('<connect body1="lower" body2="ball" anchor="0 0 -0.1"/>'),
        lowered(equality('<connect body1="ball" body2="lower" anchor="-0.6 0 0"/>')),
    ),
    "mocap body fixed": lambda: (ledge('mocap="true"'), ledge("")),
}

# Two sides with one cause, by what differs: the sides, and the cause.
OTHER_SHAPES: dict[str, tuple[Sides, str]] = {
    "a larger mesh": (lambda: (mesh(), mesh(size=0.055)), "shape of ball_shape"),
    "a mesh with noise": (lambda: (mesh(), mesh(noise=1e-4)), "shape of ball_shape"),
    "another height field": (lambda: (hills(), hills(2.0)), "heights of floor"),
    "a weld the other way round": (
        lambda: (
            equality('<weld name="w" body1="lower" body2="ball" anchor="-0.3 0 0.05"/>'),
            equality('<weld name="w" body1="ball" body2="lower" anchor="0.35 0 -0.05"/>'),
        ),
        "parameters of w",
    ),
}


EXTRA = (
    '<site name="tip"',
    '<body name="more"><joint name="more" axis="1 0 0" damping="0.01"/><inertial mass="0.2" '
    'pos="0 0.05 0" diaginertia="0.001 0.001 0.001"/></body><site name="tip"',
)


# A mocap body that leads a floating one, a tendon around a shape that touches nothing, a fixed
# body, an actuator with a state of its own; what is changed on the right, the cause, the quantity.
LED = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body name="post" pos="0 0 1"><site name="high" pos="0.05 0 0"/></body>
    <body name="upper" pos="0 0 0.7">
      <inertial mass="0.5" pos="0 0 -0.1" diaginertia="0.003 0.003 0.001"/>
      <joint name="shoulder" axis="0 1 0" damping="0.3" stiffness="0 1" springref="0.1"/>
      <geom name="pulley" size="0.03" pos="0 0 -0.05" contype="0" conaffinity="0" mass="0"/>
      <site name="side" pos="0.04 0 -0.05"/>
      <body name="core" pos="0 0 -0.05">
        <inertial mass="0.2" pos="0 0 0" diaginertia="0.001 0.001 0.001"/>
      </body>
      <body name="lower" pos="0 0 -0.2">
        <inertial mass="0.3" pos="0 0 -0.1" diaginertia="0.002 0.002 0.0005"/>
        <joint name="elbow" axis="0 1 0" damping="0.05"/>
        <site name="low" pos="0.03 0 -0.1"/>
      </body>
    </body>
    <body name="leader" mocap="true" pos="0.4 0 0.5"/>
    <body name="led" pos="0.4 0 0.5">
      <freejoint name="led"/>
      <inertial mass="0.2" pos="0 0 0" diaginertia="0.001 0.001 0.001"/>
    </body>
  </worldbody>
  <equality><weld name="leash" body1="leader" body2="led"/></equality>
  <tendon>
    <spatial name="cord" stiffness="0 20" damping="1" springlength="0.2">
      <site site="high"/><geom geom="pulley" sidesite="side"/><site site="low"/>
    </spatial>
  </tendon>
  <actuator>
    <motor name="shoulder" joint="shoulder" group="1"/>
    <general name="elbow" joint="elbow" dyntype="integrator" gainprm="2" biastype="affine"
             biasprm="0 -2 -0.1"/>
  </actuator>
  <keyframe>
    <key name="home" qpos="0.2 0.1 0.4 0 0.5 1 0 0 0" act="0.1" ctrl="0.1 0.2" mpos="0.4 0 0.5"/>
  </keyframe>
</mujoco>
"""


_WEIGHT = '<body name="core" gravcomp="1"'


CORE = '<body name="core"'


_MOTOR = '<motor name="shoulder"'


_OFF = ("<option", '<option actuatorgroupdisable="1"')


EASILY_MISSED = {
    "wrapped shape": ([], [('pos="0 0 -0.05" c', 'pos="0.01 0 -0.05" c')], "place of pulley"),
    "rest, only nonlinear": (
        [],
        [('springref="0.1"', 'springref="0.4"')],
        "rest of the spring of shoulder",
    ),
    "slack, only nonlinear": (
        [],
        [('springlength="0.2"', 'springlength="0.3"')],
        "slack length of cord",
    ),
    "weight off a fixed body": ([], [(CORE, _WEIGHT)], "weight taken off of core"),
    "less weight off it": (
        [(CORE, _WEIGHT)],
        [('gravcomp="1"', 'gravcomp="0.5"')],
        "weight taken off of core",
    ),
    "group that is off": ([_OFF], [('group="1"', 'group="0"')], "group of shoulder"),
    "delay on the left": (
        [(_MOTOR, f'{_MOTOR} delay="0.01" nsample="10"')],
        [(' delay="0.01" nsample="10"', "")],
        "delay of shoulder",
    ),
    "flow around a shape": (
        [("<option", '<option density="1.2" viscosity="0.1"')],
        [('name="pulley"', 'name="pulley" fluidshape="ellipsoid"')],
        "shape of pulley",
    ),
    "ctrl of the keyframe": ([], [('ctrl="0.1', 'ctrl="0.5')], "ctrl of the start"),
    "act of the keyframe": ([], [('act="0.1"', 'act="0.4"')], "activations of the start"),
    "mocap of the keyframe": (
        [],
        [('mpos="0.4', 'mpos="0.5')],
        "mocap places of the start",
        "led",
    ),
}
