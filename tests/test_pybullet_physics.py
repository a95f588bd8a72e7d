"""Physics of the PyBullet backend on small models, against MuJoCo and closed forms."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import UnsupportedError

from .support.claims import assert_in, overlapping, refused, warnings_of
from .support.motions import after, opened, path, started
from .support.small_models import both, on_both

FLOOR = '<geom name="floor" type="plane" size="1 1 .1"/>'
pytestmark = pytest.mark.usefixtures("bullet")


def chain(joint: str, count: int = 3, height: float = 1.0) -> str:
    """Return capsules of 0.1 m and 0.1 kg in a row, each on a hinge."""
    text = ""
    for k in reversed(range(count)):
        pos = f"0 0 {height}" if k == 0 else ".1 0 0"
        text = (
            f'<body pos="{pos}"><joint name="j{k}" axis="0 1 0" {joint}/>'
            f'<geom type="capsule" size=".01" fromto="0 0 0 .1 0 0" mass=".1"/>{text}</body>'
        )
    return text


def apart(models: list[sm.Model], steps: int, qpos: float, ctrl: float = 0.0) -> float:
    """Return the largest difference of a joint's position on the way."""
    left, right = (path(model, steps, qpos=qpos, ctrl=ctrl) for model in models)
    return float(np.abs(left - right).max())


def driven(kind: str, joints: int = 3, gains: str = "") -> str:
    """Return an actuator on each of the first joints of a chain."""
    inside = "".join(f'<{kind} joint="j{k}" {gains}/>' for k in range(joints))
    return f"<actuator>{inside}</actuator>"


WIDTHLESS = 'range="-20 10" limited="true" damping=".01" solimplimit=".1 .9 0 .5 2"'
LIMITED = 'range="-20 30" limited="true" armature=".01" damping=".1"'
WEAK = 'actuatorfrcrange="-.1 .1" armature=".01"'
# A joint, the mass of a link, actuators, steps, qpos, ctrl, and how far apart the engines may be.
CHAINS = {
    # Without armature, friction of one joint moves the next: a plain sweep diverges here.
    "strong dry friction": ('frictionloss="1"', ".1", "", 300, 0.3, 0.0, 1e-9),
    # What counts as a change of friction is measured by the friction, not in N·m.
    "light joints": ('frictionloss=".0005"', ".001", "", 200, 0.3, 0.0, 1e-9),
    "lighter joints": ('frictionloss=".000005"', ".00001", "", 200, 0.3, 0.0, 1e-9),
    # Constraints feel the explicit inertia, velocities the implicit one.
    "limits under a servo": (
        LIMITED, ".1", driven("position", 3, 'kp="50" kv="5"'), 300, 0.0, 2.0, 1e-8,
    ),
    "limits without a width": (WIDTHLESS, ".1", "", 300, 0.0, 0.0, 1e-6),
    # MuJoCo's actuatorfrcrange, which is the effort of a URDF.
    "the force limit": (WEAK, ".1", driven("motor", 1, 'gear="3"'), 100, 0.0, -1.0, 1e-9),
    # Its kv is then no part of the implicit inertia: it would slow a joint that is held.
    "a servo beyond it": (
        WEAK, ".1", driven("position", 1, 'kp="50" kv="3"'), 300, 0.0, 1.5, 1e-9,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CHAINS)
def test_a_chain_moves_as_on_mujoco(tmp_path: Path, name: str) -> None:
    joint, mass, actuators, steps, qpos, ctrl, most = CHAINS[name]
    text = chain(joint).replace('mass=".1"', f'mass="{mass}"')
    assert apart(both(tmp_path, text, rest=actuators), steps, qpos, ctrl) < most


def test_a_limit_acts_from_its_margin_on(tmp_path: Path) -> None:
    text = chain('range="-20 30" limited="true" margin=".1" armature=".01" damping=".1"')
    models = both(tmp_path, text, rest=driven("motor"))
    assert apart(models, 300, 0.0, ctrl=0.5) < 1e-8
    assert apart([models[0], both(tmp_path, text.replace("margin", "user"))[1]], 300, 0.0) > 1e-3


@pytest.mark.parametrize("flag", ["", '<flag eulerdamp="disable"/>'])
def test_the_integrator_of_the_file(tmp_path: Path, flag: str) -> None:
    """Under Euler a servo's kv is explicit, and joint damping is not, or is."""
    parts = chain('armature=".02" damping=".05"'), driven("position", 3, 'kp="5" kv=".1"')
    option = f'<option timestep="0.005" integrator="Euler">{flag}</option>'
    models = both(tmp_path, *parts, option)
    assert apart(models, 200, 0.2) < 1e-9
    fast = both(tmp_path, *parts)[0].replace(timestep=0.005)
    assert apart([models[0], fast], 200, 0.2) > 1e-5


def test_friction_and_limits_in_forward(tmp_path: Path) -> None:
    found = []
    # Two of them beyond 30°.
    start: dict[str, Any] = {"qpos": (0.6, -0.2, 0.55), "qvel": (0.3, -0.4, 0.001)}
    for model in both(tmp_path, chain('frictionloss=".02" range="-20 30" limited="true"')):
        with opened(model, **start, derived=True) as (_, data):
            found.append([data.qacc, data.qfrc_limit, data.qfrc_friction, data.qfrc_bias])
    assert found[0][1].any()
    for theirs, ours in zip(*found, strict=True):
        assert np.abs(ours - theirs).max() < 1e-6 * max(1.0, float(np.abs(theirs).max()))


@pytest.mark.parametrize("armature", ["0 0 1", "0 0 .1", ".01 .01 .3"])
def test_light_joints_before_a_heavy_motor_rest_on_the_floor(tmp_path: Path, armature: str) -> None:
    """All of the armature as inertia of the last link would make the observer swing."""
    text = chain('damping=".02"', height=0.1)
    for k, value in enumerate(armature.split()):
        text = text.replace(f'name="j{k}"', f'name="j{k}" armature="{value}"')
    servos = driven("position", 3, 'kp="20" kv=".5"')
    model = both(tmp_path, FLOOR + text, servos)[1].replace(timestep=0.005)
    with opened(model, ctrl=0.8, nstep=1500) as (_, data):
        for _ in range(200):
            sm.step(model, data)
            assert np.abs(data.qvel).max() < 0.02


@pytest.mark.parametrize(
    "names",
    [
        '<joint name="joint_1" axis="0 1 0"/>{g}<body><joint axis="0 1 0"/>{g}</body>',
        '<joint name="b_fixed" axis="0 1 0"/>{g}<body name="b" pos="0 0 1">{g}</body>',
        '<joint name="s_fixed" axis="0 1 0"/>{g}<site name="s"/>',
        '<joint name="j"/><joint name="k" axis="1 0 0"/>{g}<body name="j_link">{g}</body>',
        '<joint axis="0 1 0"/>{g}<body name="body_1" pos="0 0 1">{g}</body>',
        '<joint name="{long}" axis="0 1 0"/>{g}<body name="{long}" pos="0 0 1">{g}</body>',
    ],
)
def test_names_that_a_urdf_would_have_twice(tmp_path: Path, names: str) -> None:
    """Two joints of one name end the process when PyBullet reads them."""
    inside = names.replace("{g}", '<geom size=".05"/>').replace("{long}", "n" * 5000)
    _, model = both(tmp_path, f"<body>{inside}</body>")
    assert np.isfinite(after(model, 3, qpos=0.3)).all()


def test_more_than_it_can_tell_of_is_refused(tmp_path: Path) -> None:
    refused((UnsupportedError, "so many parts", lambda: both(tmp_path, chain("", 125))))


def test_a_free_body_can_be_damped_later() -> None:
    damping = [0.0] * 6 + [0.5] * 6
    free, ours = on_both("so101/scene_box", contacts=False)
    damped = (model.replace(damping=damping) for model in (free, ours))
    fallen, *heights = (after(model, 100)[8] for model in (free, *damped))
    assert heights[0] == pytest.approx(heights[1], abs=1e-6)
    assert heights[0] > fallen + 0.1


def test_a_static_base_meets_what_its_joint_carries(tmp_path: Path) -> None:
    """MuJoCo lets a parent and its child pass, unless the parent is as good as the world."""
    body = (
        '<body name="base"><geom type="box" size=".5 .5 .05" pos="0 0 -.05"/>'
        '<body pos="0 0 .3"><joint axis="0 1 0"/>'
        '<geom type="capsule" size=".03" fromto=".1 0 0 .4 0 0"/></body></body>'
    )
    ends = []
    for model in both(tmp_path, body):
        with opened(model, nstep=1500) as (_, data):
            assert len(data.contacts), model.backend
            ends.append(data.qpos[0])
    assert ends[1] == pytest.approx(ends[0], abs=1e-3)


_CORNERS = " ".join(f"{x} {y} {z}" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1))
HULLS = f'''<asset>
  <mesh name="bare" vertex="{_CORNERS}" scale=".1 .1 .1"/>
  <mesh name="moved" vertex="{_CORNERS}" scale=".1 .1 .1" refpos=".3 .2 .1"
    refquat=".9 .1 .3 .2"/>
  <mesh name="cube" vertex="{_CORNERS}" scale=".05 .05 .05"/>
</asset>'''


@pytest.mark.parametrize(
    "geom",
    [
        'type="box" size=".05 .05 .05"',
        'type="cylinder" size=".05 .05"',
        'type="sphere" size=".05"',
        'type="mesh" mesh="cube"',
    ],
)
def test_everything_rests_at_its_own_height(tmp_path: Path, geom: str) -> None:
    """Round and pointed shapes come with a millimetre of their own unless told otherwise."""
    world = f'{FLOOR}<body pos="0 0 .052"><freejoint/><geom {geom}/></body>'
    assert after(both(tmp_path, world, HULLS)[1], 1000)[2] == pytest.approx(0.05, abs=5e-5)


@pytest.mark.parametrize(
    ("floor", "box", "slides"),
    [
        ('friction="1"', 'friction=".3"', False),  # the larger counts
        ('friction=".1" priority="1"', 'friction="1"', True),  # priority counts
        ('friction="1" condim="3"', 'friction="1" condim="1"', False),  # the larger counts
        ('friction="1" condim="1"', 'friction="1" condim="1"', True),
    ],
)
def test_friction_of_a_pair_is_the_models(
    tmp_path: Path, floor: str, box: str, slides: bool
) -> None:
    """On a floor that leans by atan(0.2): a box slides at g·(sin − µ·cos), or stays."""
    option = '<option timestep="0.002" gravity="1.96 0 -9.81" integrator="implicitfast"/>'
    body = (
        f'<geom type="plane" size="1 1 .1" {floor}/>'
        f'<body pos="0 0 .05"><freejoint/><geom type="box" size=".05 .05 .05" {box}/></body>'
    )
    friction = 0.1 if "priority" in floor else 0.0
    wanted = (1.96 - friction * 9.81) / 2 if slides else 0.0
    model = both(tmp_path, body, option=option)[1]
    assert after(model, 500)[0] == pytest.approx(wanted, abs=0.01)


def test_friction_that_no_product_gives_is_named(tmp_path: Path) -> None:
    """Three that meet each other have three pairs and three numbers; four have six pairs."""
    bodies = "".join(
        f'<body name="b{k}" pos="{k} 0 1"><freejoint/>'
        f'<geom size=".1" friction="{friction}" priority="{priority}"/></body>'
        for k, (friction, priority) in enumerate(((0.2, 3), (1.0, 2), (0.5, 1), (0.9, 0)))
    )
    _, text = warnings_of(lambda: both(tmp_path, bodies))
    # Each of the six pairs has three frictions: the first is named, all are counted.
    assert re.search(r"\d+ differ, such as friction of b0 and b1 is", text)
    assert text.count("friction of") == 1
    assert not warnings_of(lambda: sm.load("so101/scene_box", backend="pybullet"))[1]


@pytest.mark.parametrize("joint", ["freejoint", 'joint type="slide" axis="0 0 1"'])
@pytest.mark.parametrize("beside", ["", '<geom size=".01" contype="0" conaffinity="0"/>',
                                    '<geom size=".01"/>'])  # fmt: skip
@pytest.mark.parametrize(
    "geom",
    [
        'type="mesh" mesh="bare"',
        'type="mesh" mesh="bare" pos=".1 0 0" euler="30 20 10"',
        'type="mesh" mesh="moved"',
        'type="ellipsoid" size=".1 .15 .2"',
    ],
)
@pytest.mark.filterwarnings("ignore:PyBullet. ellipsoids")
@overlapping
def test_a_hull_is_as_large_as_its_shape(
    tmp_path: Path, geom: str, joint: str, beside: str
) -> None:
    """On a floor, the deepest contact lies where MuJoCo has it, wherever the geom is carried.

    PyBullet's margin of 1 mm would show; it takes it off where one hull is the whole base only.
    """
    body = f'{FLOOR}<body pos="0 0 .09"><{joint}/><geom {geom}/>{beside}</body>'
    depths = []
    for model in both(tmp_path, body, rest=HULLS):
        with opened(model, derived=True) as (_, data):
            depths.append(float(data.contacts.dist.min()))
    off = 0.0023 * 0.2 if "ellipsoid" in geom else 1e-6  # what an ellipsoid's warning says
    if "euler" in geom or "moved" in geom:  # on a corner, which is rounded; a face is exact
        off = 1e-3 * (3**0.5 - 1)
    assert depths[0] < -0.005
    assert depths[1] == pytest.approx(depths[0], abs=off)


def test_what_a_hull_is_not_is_said(tmp_path: Path) -> None:
    """How far an ellipsoid's hull is off at most; and what is thinner than the margin."""
    plate = HULLS.replace('scale=".1 .1 .1"/>', 'scale=".1 .1 .0005"/>')
    body = (
        '<body><freejoint/><geom name="egg" type="ellipsoid" size=".1 .15 .2"/></body>'
        f'{FLOOR}<body><freejoint/><geom name="plate" type="mesh" mesh="bare"/></body>'
    )
    assert_in(
        warnings_of(lambda: both(tmp_path, body, plate))[1],
        "0.45 mm off",
        "(egg)",
        "1 hulls",
        "0.75 mm",
        "(plate)",
    )


OVERLAP = """{floor}<body name="post" pos="0 0 .095"><joint name="turn" axis="0 0 1" damping=".1"/>
  <geom {shape}/><body name="arm" pos="0 0 .3"><joint name="lift" axis="0 1 0" damping=".1"/>
  <geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/></body></body>"""


@pytest.mark.parametrize(
    "shape", ['type="box" size=".1 .1 .1"', 'type="mesh" mesh="bare" euler="1 1 0"']
)
@overlapping
def test_a_contact_that_no_joint_can_yield_to_does_not_explode(tmp_path: Path, shape: str) -> None:
    """A post that turns about the vertical stands 5 mm deep in the floor: nothing can lift it."""
    ends = []
    for model in both(tmp_path, OVERLAP.format(floor=FLOOR, shape=shape), HULLS):
        with opened(model, qpos=(0, -1)) as (_, data):
            for _ in range(500):
                sm.step(model, data)
                assert np.abs(data.qvel).max() < 20
            ends.append(data.qpos.copy())
    assert np.ptp(ends, axis=0).max() < 0.1


def test_a_reset_forgets_what_the_links_of_one_arm_touched() -> None:
    """Thrown about until it meets itself, then reset: the same bits as a new Data."""
    model = sm.load("so101/scene_box", backend="pybullet")
    ends = []
    for wild in (False, True):
        with started(model) as data:
            if wild:
                data.qvel[:6] = 100
                sm.step(model, data, 200)
                sm.reset(model, data, keyframe=0)
            sm.step(model, data, 300)
            ends.append(data.qpos.copy())
    assert np.array_equal(*ends)


def test_a_joint_on_its_limit_is_no_slower(tmp_path: Path) -> None:
    """Counted, not timed: friction and limit of one joint are found in a few solutions."""
    from statemachine.backends.bullet import joint_dynamics

    model = sm.load("so101/scene", backend="pybullet")
    solved = []
    right = joint_dynamics.dense.factored
    with sm.make_data(model) as data, pytest.MonkeyPatch.context() as patch:
        data.ctrl[4] = 9.0  # beyond the joint's own range
        sm.step(model, data, 600)
        patch.setattr(joint_dynamics.dense, "factored", lambda m: solved.append(1) or right(m))
        sm.step(model, data, 100)
    assert 100 <= len(solved) - 2 * 100 <= 400  # two a step are of the mass matrices


@pytest.mark.parametrize(
    ("option", "word"),
    [
        ('<option integrator="RK4"/>', "RK4 acts as Euler"),
        ('<option integrator="implicit"/>', "implicit acts as implicitfast"),
        ('<option noslip_iterations="5"/>', "noslip_iterations"),
        ("", r"not 0\.05 for some"),  # a body of two frictions
    ],
)
def test_what_has_no_effect_is_named(tmp_path: Path, option: str, word: str) -> None:
    frictions = (
        '<geom type="plane" size="1 1 .1" friction=".05"/><body pos="0 0 .05"><freejoint/>'
        '<geom type="box" size=".05 .05 .05" friction=".05"/>'
        '<geom type="box" size=".05 .05 .05" pos="0 0 .1" friction="1"/></body>'
    )
    world = chain("") if option else frictions
    assert re.search(word, warnings_of(lambda: both(tmp_path, world, option=option))[1])
