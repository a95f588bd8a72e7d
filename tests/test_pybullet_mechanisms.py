"""Trees that stand on the world and are tied to one another: PyBullet has them as one robot."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import UnsupportedError

from .support.claims import refused
from .support.files import written
from .support.motions import opened, path
from .support.small_models import both, forward_at_one_state, largest_gap, loaded, on_both

pytestmark = pytest.mark.usefixtures("bullet")

# Left: 0.05 kg at 0.03 m; right: 0.08 kg at 0.02 m, and turns by FACTOR times as much.
LEFT, RIGHT, FACTOR = (0.05, 0.03, 2e-5), (0.08, 0.02, 3e-5), -1.5
GRAVITY = 9.81


def _link(name: str, mass: float, height: float, moment: float) -> str:
    return (
        f'<link name="{name}"><inertial><origin xyz="0 0 {height}"/><mass value="{mass}"/>'
        f'<inertia ixx="{moment}" ixy="0" ixz="0" iyy="{moment}" iyz="0" izz="5e-6"/></inertial>'
        "</link>"
    )


def _finger(name: str, place: str, mimic: str = "") -> str:
    return (
        f'<joint name="{name}_j" type="continuous"><parent link="palm"/><child link="{name}"/>'
        f'<origin xyz="{place}"/><axis xyz="0 1 0"/>{mimic}</joint>'
    )


GRIPPER = (
    f'<robot name="grip">{_link("palm", 0.5, 0.0, 1e-3)}{_link("left", *LEFT)}'
    f"{_link('right', *RIGHT)}{_finger('left', '0.02 0 0.05')}"
    + _finger(
        "right", "-0.02 0 0.05", f'<mimic joint="left_j" multiplier="{FACTOR}" offset="0.02"/>'
    )
    + "</robot>"
)


def closed_form(angle: float, speed: float, seconds: float, steps: int) -> tuple[float, float]:
    """Return angle and speed of the left finger, where the right one follows without any slack.

    One degree of freedom: J = J₁ + k²·J₂, and τ = m₁·g·l₁·sin θ + k·m₂·g·l₂·sin(k·θ + c), by
    Lagrange's equation; integrated by the classical method of Runge and Kutta.
    """
    (m1, l1, i1), (m2, l2, i2), k, offset = LEFT, RIGHT, FACTOR, 0.02
    inertia = i1 + m1 * l1**2 + k**2 * (i2 + m2 * l2**2)

    def rate(at: np.ndarray) -> np.ndarray:
        torque = m1 * l1 * math.sin(at[0]) + k * m2 * l2 * math.sin(k * at[0] + offset)
        return np.array([at[1], GRAVITY * torque / inertia])

    state, h = np.array([angle, speed]), seconds / steps
    for _ in range(steps):
        k1 = rate(state)
        k2 = rate(state + h / 2 * k1)
        k3 = rate(state + h / 2 * k2)
        k4 = rate(state + h * k3)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return float(state[0]), float(state[1])


def test_two_fingers_on_a_palm_of_the_world_are_one_degree_of_freedom(tmp_path: Path) -> None:
    """2e-4 rad off were measured, of 0.41 rad, with steps of 0.05 ms; MuJoCo is as far off."""
    file = written(tmp_path / "grip.urdf", GRIPPER)
    start = 0.3
    wanted, _ = closed_form(start, 0.0, 0.1, 2000)
    ends = []
    for model in on_both(file, timestep=5e-5):
        qpos = np.zeros(2)
        left, right = model.joint_id("left_j"), model.joint_id("right_j")
        qpos[left], qpos[right] = start, FACTOR * start + 0.02
        with opened(model, qpos=qpos, nstep=2000) as (_, data):
            ends.append([data.qpos[left], data.qpos[right]])
    assert abs(wanted - start) > 0.3, "it moves far"
    for left, right in ends:
        assert left == pytest.approx(wanted, abs=3e-4)
        assert right == pytest.approx(FACTOR * left + 0.02, abs=3e-4)
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)


def _side(side: str, sign: int) -> str:
    """Return one side of a gripper as the Robotiq 85 is built: two knuckles and a finger tip."""
    parts = [_link(f"{side}_{part}", 0.03, 0.02, 1e-5) for part in ("outer", "inner", "tip")]
    for part, parent, factor in (("outer", "palm", 1), ("inner", "palm", 1), ("tip", "outer", -1)):
        name = f"{side}_{part}"
        above = parent if parent == "palm" else f"{side}_{parent}"
        mimic = f'<mimic joint="left_outer_j" multiplier="{factor * sign}"/>'
        if name == "left_outer":
            mimic = ""
        shift = {"outer": 0.03, "inner": 0.01, "tip": 0.0}[part]
        parts.append(
            f'<joint name="{name}_j" type="continuous"><parent link="{above}"/>'
            f'<child link="{name}"/><origin xyz="{sign * shift} 0 0.04"/><axis xyz="1 0 0"/>'
            f"{mimic}</joint>"
        )
    return "".join(parts)


ROBOTIQ = (
    f'<robot name="r">{_link("palm", 0.5, 0.0, 1e-3)}{_side("left", 1)}{_side("right", -1)}</robot>'
)


@pytest.mark.parametrize(
    ("text", "trees"), [(GRIPPER, 2), (ROBOTIQ, 4)], ids=["two fingers", "like a Robotiq 85"]
)
def test_a_urdf_gripper_moves_as_plain_mujoco(tmp_path: Path, text: str, trees: int) -> None:
    file = written(tmp_path / "grip.urdf", text)
    raw = mujoco.MjModel.from_xml_path(str(file))
    assert np.unique(raw.body_treeid[raw.body_treeid >= 0]).size == trees, "MuJoCo's trees"
    start = np.full(raw.nq, 0.2)
    for eq in range(raw.neq):  # where the couplings hold
        start[raw.eq_obj1id[eq]] = raw.eq_data[eq, 0] + raw.eq_data[eq, 1] * 0.2
    plain = mujoco.MjData(raw)
    plain.qpos[:] = start
    rows = []
    for _ in range(300):
        mujoco.mj_step(raw, plain)
        rows.append(plain.qpos.copy())
    model = sm.load(file, backend="pybullet")
    assert len(model.raw) == 2, "the world, and one robot"
    ours = path(model, 300, qpos=start)
    assert np.abs(ours[1:] - rows).max() < 1e-9
    assert np.ptp(rows, axis=0).max() > 0.1


FINGER = (
    '<body name="{name}" pos="{pos}"><joint name="{name}" {joint} {more}/>'
    '<inertial pos=".01 .02 .03" mass="{mass}" diaginertia="2e-4 3e-4 2.5e-4"/>'
    '<site name="{name}" pos="0 .01 .06"/><geom name="{name}" type="box" size=".01 .01 .03" '
    'pos="{pad}"/>{inside}</body>'
)


def _body(name: str, joint: str, x: float, mass: float = 0.1, more: str = "") -> str:
    """Return a finger in MJCF."""
    pads = {"pad": "0 0 .03", "inside": ""}
    return FINGER.format(
        name=name, pos=f"{x} 0 .1", joint=joint, mass=mass, more=f'damping=".02" {more}', **pads
    )


HINGES = _body("l", 'axis="0 1 0"', 0.1) + _body("r", 'axis="0 1 .2"', -0.1, 0.2)
SLIDES = _body("l", 'type="slide" axis="1 0 0"', 0.1, more='armature=".05"') + _body(
    "r", 'type="slide" axis="-1 0 0"', -0.1, 0.2
)
PEDESTAL = f'<body name="palm" pos="0 0 .3" euler="20 30 10"><geom size=".02"/>{HINGES}</body>'
SUM = '<joint joint="l" coef="1"/><joint joint="r" coef="-.7"/></fixed>'
DRIVE = '<actuator><position joint="l" kp="2" kv=".1" ctrlrange="-1 1"/></actuator>'
MIMIC = '<equality><joint joint1="r" joint2="l" polycoef="0 -1 0 0 0"/></equality>'
TIED = {
    "mimic": (HINGES, MIMIC),
    "curve": (HINGES, MIMIC.replace("0 -1 0", ".1 .5 .2")),
    "Franka's hand": (
        SLIDES,
        f'<tendon><fixed name="split">{SUM}</tendon><equality><joint joint1="l" joint2="r"/>'
        '</equality><actuator><general tendon="split" biastype="affine" gainprm="30" '
        'biasprm="0 -100 -10" forcerange="-20 20"/></actuator>',
    ),
    "spring": (HINGES, f'<tendon><fixed stiffness="3" damping=".02">{SUM}</tendon>'),
    "tendons": (
        HINGES,
        f'<tendon><fixed name="a">{SUM}<fixed name="b"><joint joint="r" coef="1"/></fixed></tendon>'
        '<equality><tendon tendon1="a" tendon2="b"/></equality>',
    ),
    "path": (
        HINGES,
        '<tendon><spatial stiffness="90" damping="3" springlength="0 .1"><site site="l"/>'
        '<site site="r"/></spatial></tendon>',
    ),
    "loop": (HINGES, '<equality><connect body1="l" body2="r" anchor="-.1 0 .1"/></equality>'),
    "weld": (HINGES, '<equality><weld body1="l" body2="r" solref=".05 1"/></equality>'),
    "three": (
        HINGES + _body("t", 'axis="0 1 0"', 0.3),
        '<equality><joint joint1="r" joint2="l"/><joint joint1="t" joint2="r"/></equality>',
    ),
    "to the world": (HINGES, '<equality><connect body1="l" anchor="0 0 .1"/></equality>'),
}  # fmt: skip


@pytest.mark.parametrize("integrator", ["implicitfast", "Euler"])
@pytest.mark.parametrize("tie", TIED)
def test_trees_that_are_tied_move_as_on_mujoco(tmp_path: Path, tie: str, integrator: str) -> None:
    world, rest = TIED[tie]
    option = f'<option timestep="0.002" integrator="{integrator}"/>'
    if "<actuator>" not in rest:
        rest += DRIVE
    models = both(tmp_path, world, rest, option, contacts=False)
    with sm.make_data(models[0]) as left, sm.make_data(models[1]) as right:
        assert largest_gap(models, (left, right), steps=300, every=20) < 1e-6
        forward_at_one_state(models, (left, right))
        for name in ("xpos", "site_xpos", "site_xmat", "qfrc_bias", "qfrc_actuator", "qacc"):
            ours, theirs = getattr(right, name), getattr(left, name)
            assert np.abs(ours - theirs).max() < 1e-5 * max(1.0, np.abs(theirs).max()), name


def test_without_its_coupling_a_finger_falls_alone(tmp_path: Path) -> None:
    """A test of the tests above: without the coupling the right finger falls alone."""
    world, rest = TIED["mimic"]
    ends = []
    for text in (rest, ""):
        model = loaded(tmp_path, world, text, backend="pybullet", contacts=False)
        ends.append(path(model, 300, qpos=[0.2, -0.2])[-1])
    assert np.abs(ends[0] - ends[1]).max() > 0.1


def test_trees_that_nothing_ties_stay_bodies_of_their_own(tmp_path: Path) -> None:
    """Only what is tied is written as one robot; a length that is measured ties nothing."""
    measured = f"<tendon><fixed>{SUM}</tendon>"
    counts = [
        len(loaded(tmp_path, HINGES, rest, backend="pybullet").raw)
        for rest in ("", measured, MIMIC)
    ]
    assert counts == [3, 3, 2]  # with the world itself


def test_a_tie_to_what_stands_of_another_tree(tmp_path: Path) -> None:
    """The pedestal of the second arm does not move: only the first arm has the constraint."""
    world = HINGES.replace('name="r"', 'name="arm"', 1).replace(' joint="r"', "")
    pedestal = f'<body name="post" pos=".3 0 .1"><geom size=".02"/>{_body("q", "", 0.1)}</body>'
    rest = '<equality><connect body1="l" body2="post" anchor="0 0 .05"/></equality>' + DRIVE
    models = both(tmp_path, world + pedestal, rest, contacts=False)
    with sm.make_data(models[0]) as left, sm.make_data(models[1]) as right:
        assert largest_gap(models, (left, right), steps=200, every=20) < 1e-6


def test_fingers_close_on_a_box_and_hold_it(tmp_path: Path) -> None:
    """The second finger presses by the coupling alone; both hold 0.1 kg against gravity."""
    box = (
        '<body name="box" pos="0 0 .13"><freejoint/><geom type="box" size=".03 .03 .03" mass=".1"/>'
    )
    drive = '<actuator><position joint="l" kp="400" kv="20" ctrlrange="-1 1"/></actuator>'
    rest = '<equality><joint joint1="r" joint2="l"/></equality>' + drive
    for model in both(tmp_path, SLIDES + box + "</body>", rest):
        with opened(model, qpos=[-0.055, -0.055, 0, 0, 0.13, 1, 0, 0, 0]) as (_, data):
            data.ctrl[:] = -0.08
            sm.step(model, data, 500)
            assert data.qpos[4] == pytest.approx(0.13, abs=0.01)
            names = {model.compiled.geom(int(g)).name for g in np.ravel(data.contacts.geom)}
            assert {"l", "r"} <= names
            assert data.qpos[0] == pytest.approx(data.qpos[1], abs=2e-3)


def test_a_state_of_a_gripper_is_restored_bit_by_bit(tmp_path: Path) -> None:
    world, rest = TIED["mimic"]
    model = loaded(tmp_path, world, rest + DRIVE, backend="pybullet")
    with sm.make_data(model) as data:
        data.ctrl[:] = 0.4
        sm.step(model, data, 30)
        state = sm.get_state(model, data)
        ends = []
        for _ in range(2):
            sm.set_state(model, data, state)
            sm.step(model, data, 50)
            ends.append(data.qpos.copy())
    assert np.array_equal(*ends)


FLOATING = {
    "joints of one that floats": (
        '<body name="craft"><freejoint/><geom size=".1"/><body name="arm"><joint name="elbow"/>'
        '<geom size=".1"/></body></body><body name="post" pos="1 0 0"><joint name="hinge"/>'
        '<geom size=".1"/></body>',
        '<equality><joint joint1="elbow" joint2="hinge"/></equality>',
        "equality between trees",
        ("joint elbow", "joint hinge", "craft floats", 'active="false"'),
    ),
    "two that float": (
        '<body name="one"><freejoint/><geom size=".1"/></body><body name="two" pos="1 0 0">'
        '<freejoint/><geom size=".1"/></body>',
        '<equality><weld body1="one" body2="two"/></equality>',
        "equality between trees",
        ("body one", "body two", "one, two float"),
    ),
    "a tendon": (
        '<body name="craft"><freejoint/><geom size=".1"/><site name="a"/></body>'
        '<body name="post" pos="1 0 0"><joint/><geom size=".1"/><site name="b"/></body>',
        '<tendon><spatial name="rope" range="0 2"><site site="a"/><site site="b"/></spatial>'
        "</tendon>",
        "tendon between trees",
        ("tendon rope", "body craft", "body post", "craft floats"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", FLOATING)
def test_what_ties_a_robot_that_floats_is_refused_by_the_names_of_its_ends(
    tmp_path: Path, case: str
) -> None:
    world, rest, feature, words = FLOATING[case]
    error = refused(
        (UnsupportedError, "", lambda: loaded(tmp_path, world, rest, backend="pybullet"))
    )
    assert error.features == (feature,)
    text = str(error)
    assert all(word in text for word in words), text
    assert "number" not in text


def test_a_coupling_that_is_switched_off_ties_nothing(tmp_path: Path) -> None:
    world, rest, *_ = FLOATING["two that float"]
    off = rest.replace("<weld", '<weld active="false"')
    assert loaded(tmp_path, world, off, backend="pybullet").nv == 12
