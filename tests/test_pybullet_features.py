"""What of a model PyBullet lacks is refused by name, warned of by name, or computed right."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import UnsupportedError
from statemachine.models import resolve

from .support.claims import refused, warnings_of
from .support.files import written
from .support.small_models import ARM_URDF, BOX_URDF, FEATURED, largest_gap, on_both

pytestmark = pytest.mark.usefixtures("bullet")
FLOOR = '<geom name="floor" type="plane" size="2 2 .1"/>'
BALL = '<body pos="1 0 .5"><joint type="ball" name="ball"/><geom size=".1"/></body>'
PID = '<pid name="p" joint="a" kp="20" kv="2"/>'


def warned(folder: Path, changes: dict[str, str], **options: Any) -> tuple[list[sm.Model], str]:
    """Return the model on both engines, and what their loads warned of."""
    parts = {**dict.fromkeys(("more", "geom", "joint", "actuator"), ""), **changes}
    parts = {"option": 'integrator="implicitfast"', **parts, "more": FLOOR + parts["more"]}
    file = written(folder / "model.xml", FEATURED.format(**parts))
    return warnings_of(lambda: on_both(file, **options))


def apart(models: list[sm.Model]) -> float:
    """Return the largest gap of positions [rad] over 400 steps of random commands."""
    with sm.make_data(models[0]) as left, sm.make_data(models[1]) as right:
        return largest_gap(models, (left, right), steps=400, every=40)


# Each with what is refused or warned of; nothing where it is computed.
@pytest.mark.parametrize(
    ("changes", "how", "says"),
    [
        ({}, "right", ""),
        (
            {"option": 'integrator="discrete"'},
            "warned",
            "discrete acts as implicitfast",
        ),
        (
            {"joint": 'stiffness="5" springyield="9"'},
            "warned",
            "springyield has no effect (b 0.157)",
        ),
        ({"joint": 'stiffness="5 .2"'}, "refused", "nonlinear spring: joint b"),
        ({"joint": 'damping=".1 .2"'}, "refused", "nonlinear damping: joint b"),
        ({"joint": 'actuatorfrcrange="-.1 .1"'}, "right", ""),
        ({"geom": 'surfacevel=".5 0 0"'}, "warned", "surfacevel has no effect (upper 0.5)"),
        ({"geom": 'margin=".001"'}, "warned", "(the largest: 1 mm, upper)"),
        (
            {"geom": 'solref=".02 .1" priority="1"'},
            "warned",
            "73 %",
        ),
        ({"geom": 'solref="-1000 -1"'}, "warned", "95 %"),
        ({"geom": 'solref=".1 1" solimp=".5 .6 .01"'}, "told", "solimp of their own have upper"),
        ({"actuator": PID}, "refused", "actuator gain: actuator p"),
        (
            {"actuator": PID.replace("kv", 'ki="1" kv')},
            "refused",
            "actuator p has a state",
        ),
        (
            {"more": BALL, "actuator": '<orientation name="o" joint="ball" kp="20"/>'},
            "refused",
            "actuator transmission: actuator o",
        ),
        (
            {"actuator": '<motor name="m" joint="a" damping="1"/>'},
            "refused",
            "damping: actuator m",
        ),
        (
            {"actuator": '<motor name="m" joint="a" armature="1"/>'},
            "refused",
            "damping: actuator m",
        ),
        (
            {"actuator": '<damper name="d" joint="a" kv="2" ctrlrange="0 1"/>'},
            "refused",
            "actuator gain: actuator d",
        ),
    ],
)
def test_nothing_is_lost_in_silence(
    tmp_path: Path, changes: dict[str, str], how: str, says: str
) -> None:
    if how == "refused":
        refused((UnsupportedError, re.escape(says), lambda: warned(tmp_path, changes)))
        return
    models, text = warned(tmp_path, changes)
    note = models[1].capabilities.behaviours["contacts"].note
    if how == "warned":
        assert says in text
    else:
        assert not text
        assert apart(models) < 1e-6
    assert ("of their own have upper" in note) == ("solref" in changes.get("geom", ""))
    if how == "told":
        assert says in note


def test_contact_settings_are_not_spoken_of_without_contacts(tmp_path: Path) -> None:
    geom = {"geom": 'solref=".02 .1" priority="1" surfacevel=".5 0 0"'}
    models, text = warned(tmp_path, geom, contacts=False)
    assert not text
    assert "of their own" not in models[1].capabilities.behaviours["contacts"].note


@pytest.mark.parametrize("actuator", [PID, '<damper name="d" joint="a" kv="2" ctrlrange="0 1"/>'])
def test_an_actuator_that_is_off_is_not_refused(tmp_path: Path, actuator: str) -> None:
    """All of them by an option, or those of a group by the file: the servo keeps its ctrl."""
    models, _ = warned(tmp_path, {"actuator": actuator}, actuation=False)
    assert models[0].nu == models[1].nu
    assert apart(models) < 1e-6
    grouped = {
        "actuator": actuator.replace("name=", 'group="3" name='),
        "option": 'integrator="implicitfast" actuatorgroupdisable="3"',
    }
    models, _ = warned(tmp_path, grouped)
    assert models[1].actuator_names[-1] == "servo"
    assert apart(models) < 1e-6


# What PyBullet does, that our backend relies on: when the engine changes, these notice. Raw


@pytest.fixture
def pb() -> Any:
    """Return the engine, imported without its banner."""
    return pytest.importorskip("pybullet")


@pytest.fixture
def client(pb: Any) -> Iterator[int]:
    number = pb.connect(pb.DIRECT)
    yield number
    pb.disconnect(number)


Load = Callable[..., int]


@pytest.fixture
def load(pb: Any, client: int, tmp_path: Path) -> Load:
    """Load a URDF text with the inertias that it states."""

    return lambda text, fixed=True, name="x.urdf": pb.loadURDF(
        str(written(tmp_path / name, text)),
        useFixedBase=fixed,
        flags=pb.URDF_USE_INERTIA_FROM_FILE,
        physicsClientId=client,
    )


@pytest.mark.parametrize("more", [{}, {"maxJointVelocity": 1e9}])
def test_a_call_that_sets_the_largest_speed_ignores_damping(
    pb: Any, client: int, load: Load, more: dict[str, float]
) -> None:
    """One changeDynamics with both leaves the URDF's joint damping on: ours has none to leave."""
    body = load(ARM_URDF.format(dynamics='<dynamics damping="3" friction="0"/>'))
    pb.setJointMotorControl2(body, 0, pb.VELOCITY_CONTROL, force=0, physicsClientId=client)
    still = dict.fromkeys(("linearDamping", "angularDamping", "jointDamping"), 0)
    pb.changeDynamics(body, 0, **still, **more, physicsClientId=client)
    pb.resetJointState(body, 0, 0, 1.0, client)
    pb.stepSimulation(client)
    assert (pb.getJointState(body, 0, client)[1] == 1.0) is not bool(more)


def test_link_frames_are_single_and_centres_of_mass_double(pb: Any, client: int) -> None:
    """At the arm's fingertip, over random poses: why sites are links without mass."""
    from statemachine.backends.bullet.plan import Plan
    from statemachine.backends.bullet.world import World

    raw = mujoco.MjModel.from_xml_path(str(resolve("so101")))
    data, world = mujoco.MjData(raw), World(Plan(raw), "ghost")
    (tree,) = world.trees
    gaps, link = [], tree.tips[raw.site("gripperframe").id]
    for pose in np.random.default_rng(0).uniform(*raw.jnt_range.T, size=(20, raw.nq)):
        data.qpos[:] = pose
        mujoco.mj_kinematics(raw, data)
        world.put(data.qpos, np.zeros(raw.nv))
        state = pb.getLinkState(
            tree.body, link, computeForwardKinematics=1, physicsClientId=world.client
        )
        gaps.append(np.abs(np.array([state[0], state[4]]) - data.site("gripperframe").xpos))
    world.close()
    centre, frame = np.max(gaps, axis=(0, 2))
    assert centre < 1e-14
    assert 1e-10 < frame < 1e-6


def test_inverse_dynamics_turns_gravity_with_a_base_that_has_mass(
    pb: Any, client: int, load: Load
) -> None:
    """Hence the emulated arm stands on a link without mass."""
    turned = ARM_URDF.format(dynamics="").replace(
        '<link name="world"/>',
        '<link name="world"><inertial><origin xyz="0 0 0" rpy="0 1.5707963 0"/><mass value="1"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="2" iyz="0" izz="3"/></inertial></link>',
    )
    torques = []
    for name, text in (("a.urdf", ARM_URDF.format(dynamics="")), ("b.urdf", turned)):
        body = load(text, name=name)
        pb.setGravity(0, 0, -9.81, client)
        torques.append(
            pb.calculateInverseDynamics(body, [0.0], [0.0], [0.0], physicsClientId=client)[0]
        )
    assert abs(torques[0]) == pytest.approx(1.962, abs=1e-3)
    assert abs(torques[1]) < 0.1


def test_a_box_on_a_plane_is_found_one_corner_at_a_time(pb: Any, client: int, load: Load) -> None:
    """Hence a reset tilts what is free, so that it stands on all its corners at once."""
    shape = pb.createCollisionShape(pb.GEOM_PLANE, physicsClientId=client)
    pb.createMultiBody(0, shape, physicsClientId=client)
    body = load(BOX_URDF.replace('0.3"/>', '0"/>'), fixed=False)
    pb.resetBasePositionAndOrientation(body, (0, 0, 0.2), (0, 0, 0, 1), client)
    pb.performCollisionDetection(client)
    assert len(pb.getContactPoints(physicsClientId=client)) == 1
    for x, y in ((5e-4, 5e-4), (5e-4, -5e-4), (-5e-4, -5e-4), (-5e-4, 5e-4)):
        pb.resetBasePositionAndOrientation(body, (0, 0, 0.2), (x, y, 0, 1), client)
        pb.performCollisionDetection(client)
    assert len(pb.getContactPoints(physicsClientId=client)) == 4


def test_a_body_turns_rightly_up_to_45_degrees_a_step(pb: Any, client: int, load: Load) -> None:
    body = load(BOX_URDF.replace('rpy="0 0 0.3"', 'rpy="0 0 0"'), fixed=False)
    pb.setTimeStep(0.02, client)
    pb.changeDynamics(body, -1, linearDamping=0, angularDamping=0, physicsClientId=client)
    turned = []
    for rate in (39.0, 60.0):  # 0.78 and 1.2 rad a step
        pb.resetBasePositionAndOrientation(body, (0, 0, 0), (0, 0, 0, 1), client)
        pb.resetBaseVelocity(body, (0, 0, 0), (0, 0, rate), client)
        pb.stepSimulation(client)
        _, _, z, w = pb.getBasePositionAndOrientation(body, client)[1]
        turned.append(2 * np.arctan2(z, w))
    assert turned[0] == pytest.approx(0.78, abs=1e-9)
    assert turned[1] < 1.19
