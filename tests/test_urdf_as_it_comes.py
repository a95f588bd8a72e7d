"""A URDF with `defaults="engine"` on PyBullet is what `loadURDF` runs, beside the engine itself."""

from __future__ import annotations

import copy
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import EngineWarning, ModelError, UnsupportedError
from statemachine.installed import silence
from statemachine.lab.compare.sides import Request, Side
from statemachine.lab.compare.two_sides import run_sides
from statemachine.lab.model_differences import read
from statemachine.lab.runs.scenarios import SCENARIOS
from statemachine.lab.why import WhyRequest, explain
from statemachine.models import models_dir

from .support.claims import refused, warnings_of
from .support.files import written
from .support.motions import opened

pytestmark = pytest.mark.usefixtures("bullet")

STEPS = 240
STEP = {"timestep": 0.002}
GRAVITY = (0.3, -0.2, -9.81)
as_it_comes = partial(sm.load, backend="pybullet", defaults="engine", gravity=GRAVITY)


def inertial(
    mass: float = 1.0,
    xyz: str = "0 0 0",
    rpy: str = "0 0 0",
    moments: Sequence[float] = (0.01, 0.01, 0.01),
    products: Sequence[float] = (0.0, 0.0, 0.0),
) -> str:
    """Return the <inertial> of a link; products are ixy, ixz, iyz."""
    (ixx, iyy, izz), (ixy, ixz, iyz) = moments, products
    return (
        f'<inertial><origin xyz="{xyz}" rpy="{rpy}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" iyz="{iyz}" izz="{izz}"/>'
        "</inertial>"
    )


def link(name: str, inside: str = "") -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(
    name: str,
    parent: str,
    child: str,
    kind: str = "continuous",
    xyz: str = "0.3 0 0",
    axis: str = "0 1 0",
    more: str = "",
    rpy: str = "0 0 0",
) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>{more}</joint>'
    )


def robot(*parts: str) -> str:
    return f'<robot name="r">{"".join(parts)}</robot>'


def shape(kind: str, xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    return f'<collision><origin xyz="{xyz}" rpy="{rpy}"/><geometry><{kind}/></geometry></collision>'


BOX, BALL = 'box size="0.3 0.06 0.04"', 'sphere radius="0.05"'
LIMIT = '<limit lower="-0.4" upper="0.5" effort="2" velocity="1"/>'
WIDE = '<limit lower="-3" upper="3" effort="50" velocity="5"/>'

URDFS = {
    "links without inertial, at the end and on the way": robot(
        link("base", inertial(2)),
        link("upper", inertial(1.2, "0.15 0 0.01", "0 0 0.1", (0.002, 0.012, 0.012))),
        link("camera", shape(BALL)),
        link("fore", inertial(0.8, "0.12 0 0", moments=(0.001, 0.006, 0.006))),
        link("tool0"),
        link("tip"),
        joint("j1", "base", "upper", "revolute", "0 0 0.4", more=WIDE),
        joint("camera_fixed", "upper", "camera", "fixed", "0.1 0.05 0"),
        joint("j2", "upper", "fore", axis="0 0.6 0.8"),
        joint("tool", "fore", "tool0", "fixed", "0.2 0 0", rpy="0.1 0.2 0.3"),
        joint("tip_fixed", "tool0", "tip", "fixed", "0.05 0 0"),
    ),
    "inertias in other axes": robot(
        link("base", inertial(3, "0.1 0.2 0", "0.4 0.5 0.6")),
        link(
            "a",
            inertial(1, "0.1 0 0", "0.3 -0.2 0.5", (0.02, 0.03, 0.04), (0.004, -0.003, 0.002))
            + shape(BOX, "0.1 0 0", "0.2 0 0"),
        ),
        link("b", inertial(1, "0.1 0.02 0", "1 0 0", (0.02, 0.03, 0.04), (0.005, 0.001, 0))),
        joint("j", "base", "a"),
        joint("k", "a", "b", axis="0.6 0 0.8", rpy="0.3 0.2 0.1"),
    ),
    "several shapes on a link": robot(
        link("base"),
        link(
            "a",
            inertial(1.5, "0.1 0 0")
            + shape(BOX, "0.15 0 0")
            + shape(BALL, "0.3 0 0")
            + shape('cylinder radius="0.04" length="0.2"', "0.1 0 0.1", "0.3 0 0"),
        ),
        link("b", inertial(0.5) + shape('capsule radius="0.03" length="0.2"', "0 0 -0.1")),
        joint("j", "base", "a"),
        joint("k", "a", "b"),
    ),
    "slides": robot(
        link("base", inertial()),
        link("carriage", inertial(2)),
        link("lift", inertial(0.7, "0.02 0 0")),
        joint("x", "base", "carriage", "prismatic", axis="1 0 0.2", more=LIMIT),
        joint("z", "carriage", "lift", "prismatic", axis="0 0 1", more=WIDE),
    ),
    "damping, friction, effort and speed": robot(
        link("base", inertial()),
        link("a", inertial(4, "0.2 0 0")),
        link("b", inertial(2, "0.2 0 0")),
        joint(
            "j",
            "base",
            "a",
            "revolute",
            more='<limit lower="-0.1" upper="0.2" effort="0.1" velocity="0.05"/>'
            '<dynamics damping="0.7" friction="5"/>',
        ),
        joint("k", "a", "b", more='<dynamics damping="0.2" friction="0.3"/>'),
    ),
    "joints that follow": robot(
        link("base", inertial()),
        link("left", inertial(0.3, "0.1 0 0")),
        link("right", inertial(0.1, "0.1 0 0")),
        joint("l", "base", "left", "revolute", more=WIDE),
        joint(
            "r",
            "base",
            "right",
            "revolute",
            more=WIDE + '<mimic joint="l" multiplier="-1" offset="0.1"/>',
        ),
    ),
    "two arms that pass through each other": robot(
        link("base", inertial() + shape(BALL)),
        link("a", inertial(1, "0.1 0 0") + shape(BOX, "0.1 0 0")),
        link("b", inertial(1, "-0.1 0 0") + shape(BOX, "-0.1 0 0")),
        link("b2", inertial(1, "-0.1 0 0") + shape(BOX, "-0.15 0 0")),
        joint("j", "base", "a", xyz="-0.2 0 0.3"),
        joint("k", "base", "b", xyz="0.2 0 0.27"),
        joint("l", "b", "b2", xyz="-0.1 0 0"),
    ),
    "a chain that is written from its end": robot(
        joint("z", "c", "d"),
        joint("y", "b", "c", axis="1 0 0"),
        joint("x", "a", "b"),
        link("d", inertial(0.2, "0.1 0 0")),
        link("c", inertial(0.4, "0.1 0 0")),
        link("b", inertial(0.8, "0.1 0 0")),
        link("a", inertial(3)),
    ),
    "moving links with shapes and no inertial": robot(
        link("base"),
        link("a", shape(BOX, "0.15 0 0")),
        link("b", shape(BALL, "0.1 0 0")),
        joint("j", "base", "a"),
        joint("k", "a", "b", axis="0 0.8 0.6"),
    ),
    "static links kept": robot(
        '<mujoco><compiler fusestatic="false"/><option timestep="0.005" density="1.2"/></mujoco>',
        link("base", inertial()),
        link("a", inertial(1, "0.1 0 0")),
        link("frame"),
        joint("j", "base", "a"),
        joint("f", "a", "frame", "fixed"),
    ).replace('<link name="frame"></link>', link("frame", inertial(0.2))),
}
FLOATING = robot(
    link("odom"),
    link("body", inertial(2, "0.05 0 0.02", "0.1 0.2 0.3", (0.02, 0.03, 0.04)) + shape(BOX)),
    link("arm", inertial(0.5, "0.1 0 0")),
    joint("floats", "odom", "body", "floating", "0.1 0.2 1", rpy="0.2 0.1 0.4"),
    joint("j", "body", "arm"),
)


@contextmanager
def raw(path: Path, fixed: bool = True) -> Iterator[tuple[Any, int, int]]:
    """Provide PyBullet, a client of it, and what loadURDF made there of a file."""
    pb = pytest.importorskip("pybullet")
    client = pb.connect(pb.DIRECT)
    try:
        with silence():
            body = pb.loadURDF(str(path), useFixedBase=fixed, physicsClientId=client)
        pb.setGravity(*GRAVITY, physicsClientId=client)
        yield pb, client, body
    finally:
        pb.disconnect(client)


def joints_of(pb: Any, client: int, body: int) -> dict[str, float]:
    """Return the position of each joint that moves, by name."""
    infos = [pb.getJointInfo(body, i, client) for i in range(pb.getNumJoints(body, client))]
    return {
        info[1].decode(): pb.getJointState(body, info[0], client)[0]
        for info in infos
        if info[3] >= 0
    }


def motion_of(path: Path, limp: bool) -> np.ndarray:
    """Return positions (STEPS, n) by PyBullet, joints by the names' order; motors off or on."""
    rows = []
    with raw(path) as (pb, client, body):
        if limp:
            for i in range(pb.getNumJoints(body, client)):
                pb.setJointMotorControl2(
                    body, i, pb.VELOCITY_CONTROL, force=0, physicsClientId=client
                )
        for _ in range(STEPS):
            pb.stepSimulation(client)
            rows.append([place for _, place in sorted(joints_of(pb, client, body).items())])
    return np.array(rows)


def our_motion_of(path: Path, limp: bool) -> np.ndarray:
    """Return the same by a Model with the engine's defaults."""
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        return motion_of_a_model(as_it_comes(path), limp)


def motion_of_a_model(model: sm.Model, limp: bool) -> np.ndarray:
    """Return the same of one that is loaded."""
    order = sorted(range(model.njnt), key=lambda j: model.joint_names[j])
    rows = []
    with opened(model) as (_, data):
        if limp:
            pb: Any = pytest.importorskip("pybullet")
            for body, index, _ in data.raw.joints():
                pb.setJointMotorControl2(
                    body, index, pb.VELOCITY_CONTROL, force=0, physicsClientId=data.raw.client
                )
        for _ in range(STEPS):
            sm.step(model, data)
            rows.append(data.qpos[model.jnt_qposadr[order]])
    return np.array(rows)


@pytest.mark.parametrize("limp", [False, True])
@pytest.mark.parametrize("name", URDFS)
def test_a_file_moves_as_load_urdf_moves_it(tmp_path: Path, name: str, limp: bool) -> None:
    """Its motors hold every joint, or were switched off in both: then the inertias decide."""
    path = written(tmp_path / "robot.urdf", URDFS[name])
    theirs, ours = motion_of(path, limp), our_motion_of(path, limp)
    assert np.abs(ours - theirs).max() <= 1e-12
    assert not limp or np.abs(theirs).max() > 0.05


@pytest.mark.filterwarnings("ignore:PyBullet. it makes a fixed joint")
@pytest.mark.parametrize("root", ["odom", "world"])
def test_a_floating_joint_is_what_pybullet_makes_of_it(tmp_path: Path, root: str) -> None:
    """A fixed one: with what it hangs on, 1 kg, it falls, and of the name "world" it stands."""
    path = written(tmp_path / "robot.urdf", FLOATING.replace("odom", root))
    with raw(path, fixed=False) as (pb, client, body):
        for _ in range(STEPS):
            pb.stepSimulation(client)
        theirs = joints_of(pb, client, body)["j"]
        state = pb.getLinkState(body, 0, computeForwardKinematics=1, physicsClientId=client)
    with opened(as_it_comes(path)) as (model, data):
        sm.step(model, data, STEPS)
        adr = model.jnt_qposadr[model.joint_names.index("j")]
        assert data.qpos[adr] == pytest.approx(theirs, abs=1e-12)
        floats = model.jnt_qposadr[model.joint_names.index("floats")]
        # The engine tells where a link's frame is in single precision only.
        assert data.qpos[floats : floats + 3] == pytest.approx(state[4], abs=1e-6)
        assert (data.qpos[floats + 2] < -2) == (root == "odom")
        moved = np.abs(data.qvel[:6]).max()
        assert (moved > 1) == (root == "odom")


def test_a_standing_base_goes_where_it_is_put(tmp_path: Path) -> None:
    path = written(tmp_path / "robot.urdf", FLOATING.replace("odom", "world"))
    model, said = warnings_of(lambda: as_it_comes(path))
    assert said == "PyBullet: it makes a fixed joint of the floating floats"
    with opened(model) as (_, data):
        turned = np.array([1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5])
        data.qpos[:7], data.qvel[:6] = turned, 1.0
        sm.step(model, data, 3)
        assert np.array_equal(data.qpos[:7], turned)
        assert not data.qvel[:6].any()


def test_what_a_mimic_does_is_said(tmp_path: Path) -> None:
    path = written(tmp_path / "robot.urdf", URDFS["joints that follow"])
    _, said = warnings_of(lambda: as_it_comes(path))
    assert said == "PyBullet: <mimic> has no effect there: r moves by itself"


def test_our_own_arm_moves_as_load_urdf_moves_it() -> None:
    path = models_dir() / "so101" / "so101.urdf"
    assert np.abs(our_motion_of(path, True) - motion_of(path, True)).max() <= 1e-12


def test_the_bias_is_that_of_the_engines_own_masses(tmp_path: Path) -> None:
    """A base that weighs something, in axes of its own, turns no gravity; a tip weighs 1 kg."""
    path = written(tmp_path / "robot.urdf", URDFS["inertias in other axes"])
    mujoco = sm.load(path, gravity=GRAVITY)
    with opened(mujoco, nstep=0) as (_, data):
        sm.forward(mujoco, data)
        theirs = data.qfrc_bias.copy()
    with opened(as_it_comes(path), nstep=1) as (_, data):
        assert data.qfrc_bias == pytest.approx(theirs, rel=1e-9)


def test_the_description_is_of_what_runs(tmp_path: Path) -> None:
    path = written(tmp_path / "robot.urdf", next(iter(URDFS.values())))
    described = read(path, "pybullet").model
    with raw(path) as (pb, client, body):
        links = range(pb.getNumJoints(body, client))
        mass = sum(pb.getDynamicsInfo(body, i, client)[0] for i in links)
    assert described.compiled.body_mass.sum() == pytest.approx(mass)
    assert described.nq == described.nv == described.njnt  # it stands, as in a run


def test_a_file_with_meshes_must_stay_as_it_was(tmp_path: Path) -> None:
    corners = "0 0 0", "1 0 0", "0 1 0", "0 0 1"
    faces = "f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4"
    written(tmp_path / "part.obj", "\n".join([*(f"v {c}" for c in corners), *faces, ""]))
    mesh = '<collision><geometry><mesh filename="part.obj" scale="0.1 0.1 0.1"/></geometry>'
    text = robot(
        link("base"),
        link("a", inertial(1, "0.1 0 0") + mesh + "</collision>"),
        joint("j", "base", "a"),
    )
    path = written(tmp_path / "robot.urdf", text)
    assert np.abs(our_motion_of(path, True) - motion_of(path, True)).max() <= 1e-12
    model = as_it_comes(path)
    written(path, text.replace('value="1"', 'value="2"'))
    refused((ModelError, "load it again", lambda: sm.make_data(model)))


def test_what_pybullet_reads_otherwise_is_refused(tmp_path: Path) -> None:
    planar = robot(link("base"), link("a", inertial()), joint("p", "base", "a", "planar"))
    path = written(tmp_path / "planar.urdf", planar)
    many = [link(f"l{i}", inertial()) for i in range(130)]
    many += [joint(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(129)]
    long = written(tmp_path / "long.urdf", robot(*many))
    two = written(
        tmp_path / "two.urdf",
        robot(
            link("a", inertial()),
            link("b", inertial()),
            link("c", inertial()),
            joint("j", "a", "b"),
        ),
    )
    refused(
        (UnsupportedError, "planar joint", lambda: as_it_comes(path)),
        (UnsupportedError, "130 links", lambda: as_it_comes(long)),
        (ModelError, "2 roots", lambda: as_it_comes(two)),
    )


def test_an_mjcf_is_still_written_for_it() -> None:
    model = sm.load("so101", backend="pybullet", defaults="engine")
    assert all(text.startswith("<?xml") for text in model.raw.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "cause", "own"),
    [
        ("two arms that pass through each other", "self-collision", "off"),
        (
            "links without inertial, at the end and on the way",
            "inertias",
            "of shapes, 3 links 1 kg",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore::statemachine.errors.EngineWarning")
def test_what_the_engine_gives_of_its_own_explains_a_gap(
    tmp_path: Path, name: str, cause: str, own: str
) -> None:
    """Self-collision and 1 kg are settings; with all of them changed nothing of the gap stays."""
    path = written(tmp_path / "robot.urdf", URDFS[name])
    sides = sm.load(path, backend="pybullet", defaults="engine"), sm.load(path, backend="pybullet")
    found = explain(WhyRequest(*sides, SCENARIOS["gravity"], seconds=0.25, jobs=1))
    (row,) = (row for row in found.shares if row.name == cause)
    assert own in str(row.values)
    assert row.last is not None
    assert row.last > 0.01
    assert found.equalized_gap == pytest.approx(0, abs=1e-9)
    assert found.explained == pytest.approx(1)
    assert not found.located


def test_that_links_of_one_robot_touch_is_said(tmp_path: Path) -> None:
    """Only of a robot of which two links can, and only where the engine's users have it off."""
    arms = written(tmp_path / "robot.urdf", URDFS["two arms that pass through each other"])
    slides = written(tmp_path / "slides.urdf", URDFS["slides"])

    def said(path: Path, defaults: Any) -> str:
        with warnings.catch_warnings(action="ignore", category=EngineWarning):
            sides = Side(str(path), "mujoco"), Side(str(path), "pybullet", defaults, STEP)
            return " ".join(run_sides(Request(("gravity",), sides=sides, seconds=0.5)).notes)

    assert "the links of one robot can touch each other" in said(arms, "model")
    assert "touch each other" not in said(arms, "engine")
    assert "touch each other" not in said(slides, "model")


def test_an_edit_of_a_file_keeps_what_pybullet_gives_it(tmp_path: Path) -> None:
    """A mass that is edited counts by its difference, and the inertia of the shapes grows."""
    text = URDFS["several shapes on a link"]
    heavier = written(tmp_path / "heavier.urdf", text.replace('value="1.5"', 'value="2.5"'))
    model = as_it_comes(written(tmp_path / "robot.urdf", text))
    edited = copy.copy(model.compiled)
    edited.body_mass[edited.body("a").id] += 1.0
    ours = motion_of_a_model(model.with_compiled(edited), limp=True)
    theirs = motion_of(heavier, limp=True)
    assert np.abs(ours - theirs).max() < 1e-9
    assert np.abs(theirs - motion_of(model.path, limp=True)).max() > 1e-3
