"""What PyBullet does, that our backend relies on: when the engine changes, these notice.

Everything here is the raw engine; nothing goes through our adapter, except the worlds that
it builds, which are looked at with PyBullet's own functions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from statemachine.models import resolve

from .conftest import need_engine, written
from .small_models import ARM_URDF, BOX_URDF


@pytest.fixture
def pb() -> Any:
    """The engine, imported without its banner."""
    need_engine("pybullet")
    import pybullet

    return pybullet


@pytest.fixture
def client(pb: Any) -> Iterator[int]:
    number = pb.connect(pb.DIRECT)
    yield number
    pb.disconnect(number)


Load = Callable[..., int]


@pytest.fixture
def load(pb: Any, client: int, tmp_path: Path) -> Load:
    """Load a URDF text with the inertias that it states."""

    def run(text: str, fixed: bool = True, name: str = "x.urdf", **more: Any) -> int:
        file = written(tmp_path / name, text)
        return pb.loadURDF(
            str(file),
            useFixedBase=fixed,
            flags=pb.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=client,
            **more,
        )

    return run


@pytest.mark.parametrize("more", [{}, {"maxJointVelocity": 1e9}])
def test_a_call_that_sets_the_largest_speed_ignores_damping(
    pb: Any, client: int, load: Load, more: dict[str, float]
) -> None:
    """One changeDynamics with both leaves the URDF's joint damping on: ours has none to leave."""
    body = load(ARM_URDF.format(dynamics='<dynamics damping="3" friction="0"/>'))
    pb.setJointMotorControl2(body, 0, pb.VELOCITY_CONTROL, force=0, physicsClientId=client)
    still = {"linearDamping": 0, "angularDamping": 0, "jointDamping": 0}
    pb.changeDynamics(body, 0, **still, **more, physicsClientId=client)
    pb.resetJointState(body, 0, 0, 1.0, client)
    pb.stepSimulation(client)
    assert (pb.getJointState(body, 0, client)[1] == 1.0) is not bool(more)


def test_link_frames_are_single_and_centres_of_mass_double(pb: Any, client: int) -> None:
    """At the arm's fingertip, over random poses: why sites are links without mass."""
    from statemachine.backends._bullet_plan import Plan
    from statemachine.backends._bullet_world import World

    raw = mujoco.MjModel.from_xml_path(str(resolve("so101")))
    data, world = mujoco.MjData(raw), World(Plan(raw), "ghost")
    (tree,) = world.trees
    random, frame, centre = np.random.default_rng(0), 0.0, 0.0
    for _ in range(20):
        data.qpos[:] = random.uniform(*raw.jnt_range.T)
        mujoco.mj_kinematics(raw, data)
        world.put(data.qpos, np.zeros(raw.nv))
        link = tree.tips[raw.site("gripperframe").id]
        state = pb.getLinkState(
            tree.body, link, computeForwardKinematics=1, physicsClientId=world.client
        )
        tip = data.site("gripperframe").xpos
        centre = max(centre, float(np.abs(np.subtract(state[0], tip)).max()))
        frame = max(frame, float(np.abs(np.subtract(state[4], tip)).max()))
    world.close()
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
    for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1)):
        tilted = np.array([x * 5e-4, y * 5e-4, 0, 1])
        pb.resetBasePositionAndOrientation(body, (0, 0, 0.2), tilted.tolist(), client)
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
