"""Pairs of models with known causes, for the tests of `explain`; made by editing a model's text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import statemachine as sm
from statemachine.lab.runs.drive import Controller
from statemachine.lab.runs.scenarios import Scenario
from statemachine.lab.why import Explanation, WhyRequest, explain

from .files import written

# Two links on servos above a floor, a ball on the floor, and a weight on a spring.
ARM = """
<mujoco model="arm">
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <default><geom density="0"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="2 2 0.1"/>
    <body name="upper" pos="0 0 0.5">
      <inertial mass="0.5" pos="0 0 -0.1" diaginertia="0.003 0.003 0.0004"/>
      <joint name="shoulder" axis="0 1 0" damping="0.1" armature="0.01" range="-2 2"
             limited="true" frictionloss="0.01"/>
      <geom name="upper_shape" type="capsule" size="0.02" fromto="0 0 0 0 0 -0.2"/>
      <body name="lower" pos="0 0 -0.2">
        <inertial mass="0.3" pos="0 0 -0.08" diaginertia="0.001 0.001 0.0002"/>
        <joint name="elbow" axis="0 1 0" damping="0.1" armature="0.01"/>
        <geom name="lower_shape" type="capsule" size="0.02" fromto="0 0 0 0 0 -0.15"/>
        <site name="tip" pos="0 0 -0.15"/>
      </body>
    </body>
    <body name="ball" pos="0.6 0 0.2">
      <freejoint name="ball"/>
      <inertial mass="0.2" pos="0 0 0" diaginertia="0.0004 0.0004 0.0004"/>
      <geom name="ball_shape" size="0.05" friction="0.8 0.005 0.0001"/>
    </body>
    <body name="weight" pos="-0.6 0 0.3">
      <joint name="spring" type="slide" axis="0 0 1" stiffness="40" springref="0.05" damping="1"/>
      <geom name="weight_shape" type="box" size="0.03 0.03 0.03" mass="0.5"/>
    </body>
  </worldbody>
  <actuator>
    <position name="shoulder" joint="shoulder" kp="20" kv="1"/>
    <position name="elbow" joint="elbow" kp="20" kv="1"/>
  </actuator>
  <keyframe><key name="home" qpos="0 0  0.6 0 0.2 1 0 0 0  0" ctrl="0 0"/></keyframe>
</mujoco>
"""


@dataclass(frozen=True)
class Case:
    """What is changed in the text of the right side, and what it is to be called.

    Attributes:
        old, new: A piece of the text and what stands in its place.
        cause: What the explanation calls it.
        quantity: What shows it.
    """

    old: str
    new: str
    cause: str
    quantity: str = "joints"


def _swing(time: float) -> tuple[float, float]:
    return (0.8, -0.5) if time < 0.5 else (-0.3, 0.6)


def _controller(model: sm.Model, _seed: int) -> Controller:
    places = [model.actuator_names.index(name) for name in ("shoulder", "elbow")]

    def controller(_model: sm.Model, data: sm.Data) -> list[float]:
        ctrl = [0.0] * model.nu
        for place, value in zip(places, _swing(data.time), strict=True):
            ctrl[place] = value
        return ctrl

    return controller


SWING = Scenario(
    *("swing", "The servos are told two poses.", "", 1.0, _controller),
    *("", lambda _model: None),
    is_user_function=True,
)
HOME = replace(SWING, keyframe="home")
STILL = replace(SWING, controller=lambda _model, _seed: lambda _model, _data: [0.0])


def explained(
    folder: Path, left: str, right: str, *, engines: tuple[str, str] = ("mujoco", "mujoco"), **more
) -> Explanation:
    """Explain why two texts of models differ."""
    models = [
        sm.load(written(folder / f"{side}.xml", text), backend=engine)
        for side, text, engine in zip(("left", "right"), (left, right), engines, strict=True)
    ]
    return explain(WhyRequest(models[0], models[1], more.pop("scenario", SWING), **more))


def shares(found: Explanation) -> dict[str, float]:
    """Return the part of each cause; of one without any it is not a number."""
    return {row.name: float("nan") if row.share is None else row.share for row in found.shares}


def is_equalized(found: Explanation) -> bool:
    """Tell whether nothing is left where all causes are equalized."""
    return found.equalized_gap is not None and found.equalized_gap <= 1e-9 * found.gap + 1e-12


def with_changes(text: str, changes: Iterable[tuple[str, str]]) -> str:
    """Apply changes to a text, each of a piece that is there once."""
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def changed(text: str, *cases: Case) -> str:
    """Apply the changes of cases to a text."""
    return with_changes(text, ((case.old, case.new) for case in cases))


_SHOULDER = '<position name="shoulder" joint="shoulder" kp="20" kv="1"'
_OPTION = '<option timestep="0.002" integrator="implicitfast"'
_JOINT = 'axis="0 1 0" damping="0.1" armature="0.01" range'
_BALL = 'name="ball_shape"'
_ELBOW = 'name="elbow" axis="0 1 0"'
_LOWER = '<body name="lower" pos="0 0 -0.2"'
FLOOR = '<geom name="floor" type="plane" size="2 2 0.1"/>'


def _more(old: str, more: str, cause: str, quantity: str = "joints") -> Case:
    """Add something behind a piece of the text."""
    return Case(old, f"{old} {more}", cause, quantity)


def _before(old: str, more: str, cause: str, quantity: str = "joints") -> Case:
    """Add something before a piece of the text."""
    return Case(old, f"{more}{old}", cause, quantity)


def _in(tag: str, inner: str, cause: str, quantity: str = "joints") -> Case:
    """Add a section before that of the actuators."""
    return _before("<actuator>", f"<{tag}>{inner}</{tag}>", cause, quantity)


ALONE = {
    "mass": Case('mass="0.3"', 'mass="0.36"', "mass of lower"),
    "centre of mass": Case('pos="0 0 -0.08"', 'pos="0 0 -0.09"', "centre of mass of lower"),
    "inertia": Case('"0.001 0.001 0.0002"', '"0.001 0.0011 0.0002"', "inertia of lower"),
    "place": Case(_LOWER, _LOWER.replace("0 0", "0.01 0"), "place of lower"),
    "tilted body": _more(_LOWER, 'euler="0 0.02 0"', "place of lower"),
    "axis": Case(_ELBOW, _ELBOW.replace("0 1", "0.2 1"), "axis of elbow"),
    "anchor": _more(_ELBOW, 'pos="0.005 0 0"', "anchor of elbow"),
    "range": Case('range="-2 2"', 'range="-2 0.4"', "range of shoulder"),
    "damping": Case(_JOINT, _JOINT.replace("0.1", "0.2"), "damping of shoulder"),
    "armature": Case(_JOINT, _JOINT.replace("0.01", "0.03"), "armature of shoulder"),
    "dry friction": Case('frictionloss="0.01"', 'frictionloss="0.1"', "dry friction of shoulder"),
    "spring": Case('stiffness="40"', 'stiffness="50"', "spring of spring", "slides"),
    "rest": Case('springref="0.05"', 'springref="0.06"', "rest of the spring of spring", "slides"),
    "gains": Case(_SHOULDER, _SHOULDER.replace('"20"', '"24"'), "gains of shoulder"),
    "gear": _more(_SHOULDER, 'gear="1.1"', "gear of shoulder"),
    "force range": _more(_SHOULDER, 'forcerange="-2 2"', "force range of shoulder"),
    "range of ctrl": _more(_SHOULDER, 'ctrlrange="-0.5 0.5"', "range of ctrl of shoulder"),
    "force limit": _more('limited="true"', 'actuatorfrcrange="-2 2"', "force limit of shoulder"),
    "delay": _more(_SHOULDER, 'delay="0.01" nsample="16"', "delay of shoulder"),
    "gravity": _more(_OPTION, 'gravity="0 0 -9"', "gravity"),
    "timestep": Case('timestep="0.002"', 'timestep="0.01"', "timestep"),
    "integrator": Case('integrator="implicitfast"', 'integrator="RK4"', "integrator"),
    "medium": _more(_OPTION, 'density="200" viscosity="0.5"', "medium"),
    "damper": Case(f"{_OPTION}/>", f'{_OPTION}><flag damper="disable"/></option>', "damper"),
    "no spring": Case(
        f"{_OPTION}/>", f'{_OPTION}><flag spring="disable"/></option>', "spring", "slides"
    ),
    "servos off": Case(
        f"{_OPTION}/>", f'{_OPTION}><flag actuation="disable"/></option>', "actuation"
    ),
    "contacts off": Case(
        f"{_OPTION}/>", f'{_OPTION}><flag contact="disable"/></option>', "contact", "ball"
    ),
    "weight": _more('<body name="upper"', 'gravcomp="1"', "weight taken off of upper"),
    "geom moved": _more(_BALL, 'pos="0.003 0 0"', "place of ball_shape", "ball"),
    "size": Case(f'{_BALL} size="0.05"', f'{_BALL} size="0.055"', "shape of ball_shape", "ball"),
    "type": Case(
        f'{_BALL} size="0.05"',
        f'{_BALL} type="box" size="0.05 0.05 0.06"',
        "shape of ball_shape",
        "ball",
    ),
    "filter": _more(_BALL, 'contype="2" conaffinity="2"', "filter of ball_shape", "ball"),
    "softness": _more(_BALL, 'solref="0.05 1"', "softness of ball_shape", "ball"),
    "margin": _more(_BALL, 'margin="0.02"', "margin of ball_shape", "ball"),
    "floor": _more('name="floor"', 'pos="0 0 0.02"', "place of floor", "ball"),
    "extra shape": _before(
        '<body name="ball"',
        '<geom name="box" type="box" pos="0.6 0 0.02" size="0.1 0.1 0.02"/>',
        "extra shape of box",
        "ball",
    ),
    "exclude": _in(
        "contact", '<exclude body1="world" body2="ball"/>', "extra exclude of exclude 0", "ball"
    ),
    "pair": _in(
        "contact",
        '<pair geom1="floor" geom2="ball_shape" solref="0.08 1"/>',
        "extra pair of pair 0",
        "ball",
    ),
    "equality": _in(
        "equality",
        '<joint name="tie" joint1="shoulder" joint2="elbow"/>',
        "extra equality of tie",
    ),
    "tendon": _in(
        "tendon",
        '<fixed name="band" stiffness="5" springlength="0.1">'
        '<joint joint="elbow" coef="1"/></fixed>',
        "extra tendon of band",
    ),
    "actuator": _before(
        '<position name="elbow"',
        '<position name="wind" joint="shoulder" kp="1"/>',
        "extra actuator of wind",
    ),
    "start": Case('qpos="0 0  0.6 0 0.2', 'qpos="0.1 0  0.6 0 0.2', "start"),
}

SERVO = """
<mujoco model="servo">
  <option timestep="0.005" integrator="implicitfast"/>
  <worldbody>
    <body name="slider">
      <joint name="slider" type="slide" axis="0 0 1"/>
      <inertial mass="{mass}" pos="0 0 0" diaginertia="0.01 0.01 0.01"/>
      <body name="load" pos="0 0 0.1">
        <joint name="bend" axis="0 1 0" stiffness="20" damping="2"/>
        <inertial mass="{load}" pos="0 0 0" diaginertia="0.01 0.01 0.01"/>
      </body>
    </body>
  </worldbody>
  <actuator><position name="slider" joint="slider" kp="{kp}" kv="{kv}"/></actuator>
</mujoco>
"""


def servo(mass: float = 1.0, load: float = 1.0, kp: float = 200.0) -> str:
    """Return a slide that a servo holds against its weight: it sags by (mass + load) g / kp."""
    return SERVO.format(mass=mass, load=load, kp=kp, kv=2 * (kp * (mass + load)) ** 0.5)


def mesh(**more: Any) -> str:
    """Return the arm with a ball that is a mesh; `more` as for `_asset`."""
    return ARM.replace("<worldbody>", f"<asset>{_asset('m', **more)}</asset><worldbody>").replace(
        f'{_BALL} size="0.05"', f'{_BALL} type="mesh" mesh="m"'
    )


def balls(*meshes: str, **assets: dict[str, Any]) -> str:
    """Return the arm with two balls that are meshes.

    Args:
        meshes: The name of the mesh of each ball.
        assets: The meshes by name, as for `_asset`.
    """
    text = "".join(_asset(name, **more) for name, more in assets.items())
    text = ARM.replace("<worldbody>", f"<asset>{text}</asset><worldbody>")
    start, end = text.index('<body name="ball"'), text.index('<body name="weight"')
    ball = text[start:end]
    again = ball.replace('"ball', '"again').replace("0.6 0 0.2", "0.9 0 0.2")
    for name, of in zip(("ball", "again"), meshes, strict=True):
        shape = f'name="{name}_shape"'
        ball, again = (
            each.replace(f'{shape} size="0.05"', f'{shape} type="mesh" mesh="{of}"')
            for each in (ball, again)
        )
    places = "0.6 0 0.2 1 0 0 0"
    return (text[:start] + ball + again + text[end:]).replace(
        f'"0 0  {places}', f'"0 0  {places} {places.replace("0.6", "0.9")}'
    )


def _asset(
    name: str, size: float = 0.05, order: int | None = None, corners: int = 20, noise: float = 0
) -> str:
    """Return a mesh whose corners on a sphere are drawn by a seed, in an order of choice."""
    random = np.random.default_rng(0)
    points = random.normal(size=(corners, 3))
    points *= size / np.linalg.norm(points, axis=1)[:, None]
    points += noise * random.normal(size=points.shape)
    if order is not None:
        points = np.random.default_rng(order).permutation(points)
    return f'<mesh name="{name}" vertex="{" ".join(map(repr, points.ravel().tolist()))}"/>'


def hills(wave: float = 1.0, points: int = 9) -> str:
    """Return the arm above a height field instead of a floor."""
    text = " ".join(f"{each:.4f}" for each in np.abs(np.sin(wave * np.arange(points * points))))
    asset = (
        f'<asset><hfield name="h" nrow="{points}" ncol="{points}" size="2 2 0.05 0.1" '
        f'elevation="{text}"/></asset><worldbody>'
    )
    floor = '<geom name="floor" type="hfield" hfield="h"/>'
    return with_changes(ARM, [("<worldbody>", asset), (FLOOR, floor)])


def equality(text: str) -> str:
    """Return the arm with an equality."""
    return ARM.replace("<actuator>", f"<equality>{text}</equality><actuator>")


def ledge(words: str) -> str:
    """Return the arm with a ledge under the ball, of a body that does not move."""
    body = (
        f'<body name="ledge" pos="0.6 0 0.02" {words}><geom name="ledge" type="box" '
        'size="0.1 0.1 0.02"/></body><body name="ball"'
    )
    return ARM.replace('<body name="ball"', body)


def lowered(text: str) -> str:
    """Return the same arm with the frame of its second link put 5 cm down on it."""
    return with_changes(
        text,
        [
            (f"{_LOWER}>", '<body name="lower" pos="0 0 -0.25">'),
            ('<inertial mass="0.3" pos="0 0 -0.08"', '<inertial mass="0.3" pos="0 0 -0.03"'),
            (_ELBOW, f'{_ELBOW} pos="0 0 0.05"'),
            ('fromto="0 0 0 0 0 -0.15"', 'fromto="0 0 0.05 0 0 -0.1"'),
            ('name="tip" pos="0 0 -0.15"', 'name="tip" pos="0 0 -0.1"'),
        ],
    )
