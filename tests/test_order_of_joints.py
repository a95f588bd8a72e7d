"""Joints of one body turn it one after the other; what an actuator drives in a parent's frame."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from statemachine.lab.model_differences import ListedDifference, ModelsComparison
from statemachine.lab.runs.scenarios import SCENARIOS

from .support.explained import explained
from .support.files import written
from .support.processes import Cli
from .support.two_files import causes_of_texts, compared_texts

ORDER = "order of the joints a, b of p"  # the cause
X_HINGE = '<joint name="a" axis="1 0 0"/>'
Y_HINGE = '<joint name="b" axis="0 1 0"/>'
Z_HINGE = '<joint name="c" axis="0 0 1"/>'
Z_HINGE_BESIDE = '<joint name="d" axis="0 0 1" pos="0.1 0 0"/>'
Z_HINGE_ABOVE = '<joint name="e" axis="0 0 1" pos="0 0 0.1"/>'
X_SLIDE = '<joint name="f" type="slide" axis="1 0 0"/>'
Y_SLIDE = '<joint name="g" type="slide" axis="0 1 0"/>'
Z_SLIDE = '<joint name="h" type="slide" axis="0 0 1"/>'
CHILD = """
<body name="child" pos="0 0 0.5">
  <joint name="wrist" axis="0 1 0" pos="0 0 0.1"/>
  <geom size="0.05" pos="0 0 0.2"/>
</body>
"""


def _model(joints: tuple[str, ...], child: str = "", actuators: str = "") -> str:
    shape = '<geom size="0.1" pos="0.2 0 0.3"/>'
    body = f'<body name="p">{"".join(joints)}{shape}{child}</body>'
    world = f"<worldbody>{body}</worldbody>"
    return f"<mujoco>{world}<actuator>{actuators}</actuator></mujoco>"


def _orders(comparison: ModelsComparison) -> list[ListedDifference]:
    return [row for row in comparison.differences if row.cause.startswith("order of the joints")]


def _poses_of_p(text: str, positions: dict[str, float]) -> np.ndarray:
    """Return where MuJoCo puts a body: its place and its turn, (12,)."""
    raw = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(raw)
    for name, position in positions.items():
        data.joint(name).qpos = position
    mujoco.mj_kinematics(raw, data)
    return np.concatenate([data.body("p").xpos, data.body("p").xmat])


def _largest_gap_of_poses(left: str, right: str) -> float:
    """Return how far apart MuJoCo puts the body at the same positions of its joints."""
    raw = mujoco.MjModel.from_xml_string(left)
    names = [raw.joint(k).name for k in range(raw.njnt)]
    random = np.random.default_rng(0)
    largest = 0.0
    for _ in range(20):
        positions = dict(zip(names, random.uniform(-1, 1, len(names)), strict=True))
        gap = np.abs(_poses_of_p(left, positions) - _poses_of_p(right, positions)).max()
        largest = max(largest, float(gap))
    return largest


@pytest.mark.parametrize(
    ("joints", "order"),
    [
        ((X_HINGE, Y_HINGE), (1, 0)),
        ((Z_HINGE, Z_HINGE_BESIDE), (1, 0)),
        ((Z_HINGE, Z_HINGE_ABOVE), (1, 0)),
        ((Z_HINGE, Z_SLIDE), (1, 0)),
        ((Z_HINGE_BESIDE, Z_SLIDE), (1, 0)),
        ((Z_HINGE, X_SLIDE), (1, 0)),
        ((X_SLIDE, Y_SLIDE), (1, 0)),
        ((X_SLIDE, Y_SLIDE, Z_HINGE), (1, 0, 2)),
        ((X_SLIDE, Y_SLIDE, Z_HINGE), (2, 0, 1)),
        ((X_HINGE, Y_HINGE, Z_HINGE), (0, 2, 1)),
        ((X_HINGE, Z_SLIDE, Y_SLIDE), (0, 2, 1)),
    ],
)
def test_an_order_of_joints_is_told_where_mujoco_moves_the_body_otherwise(tmp_path, joints, order):
    left, right = _model(joints), _model(tuple(joints[k] for k in order))
    moves_otherwise = _largest_gap_of_poses(left, right) > 1e-9
    comparison = compared_texts(tmp_path, left, right)
    assert bool(_orders(comparison)) == moves_otherwise
    gap = comparison.posed
    assert (max(gap.distance, gap.angle) > 1e-6) == moves_otherwise


def test_the_row_says_which_joint_hangs_on_which(tmp_path):
    left, right = _model((X_HINGE, Y_HINGE)), _model((Y_HINGE, X_HINGE))
    (row,) = _orders(compared_texts(tmp_path, left, right))
    assert (row.subject, row.element, row.matters) == ("structure", "b", True)
    assert [str(side).split()[::3] for side in (row.left, row.right)] == [["b", "a"], ["a", "b"]]
    assert row.cause == ORDER


def test_only_the_joints_that_changed_places_are_told(tmp_path):
    left = _model((X_HINGE, Y_HINGE, Z_HINGE))
    right = _model((X_HINGE, Z_HINGE, Y_HINGE))
    (row,) = _orders(compared_texts(tmp_path, left, right))
    assert [str(side).split()[::3] for side in (row.left, row.right)] == [["c", "b"], ["b", "c"]]


def test_files_whose_joints_come_in_another_order_differ(here: Cli, tmp_path):
    written(tmp_path / "left.xml", _model((X_HINGE, Y_HINGE)))
    written(tmp_path / "right.xml", _model((Y_HINGE, X_HINGE)))
    assert here("compare", "--models", "left.xml", "right.xml").returncode == 1


@pytest.mark.parametrize("wrist", ["wrist", "by_another_name"])
def test_what_hangs_on_the_body_still_hangs_on_it(tmp_path, wrist):
    left = _model((X_HINGE, Y_HINGE), CHILD)
    right = _model((Y_HINGE, X_HINGE), CHILD.replace("wrist", wrist))
    comparison = compared_texts(tmp_path, left, right)
    causes = {row.cause for row in comparison.differences if row.cause}
    assert causes == {ORDER}


SERVOS = (
    '<position name="A" joint="a" kp="50" kv="3"/><position name="B" joint="b" kp="50" kv="3"/>'
)


@pytest.mark.slow
def test_why_names_the_order_as_what_cannot_be_made_the_same(tmp_path):
    left = _model((X_HINGE, Y_HINGE), actuators=SERVOS)
    right = _model((Y_HINGE, X_HINGE), actuators=SERVOS)
    result = explained(tmp_path, left, right, scenario=SCENARIOS["waves"])
    refused = [share.name for share in result.shares if share.share is None]
    assert ORDER in refused
    assert not any(name.startswith("parent") for name in refused)
    assert (result.explained, result.unexplained) == (0, 1)


MOTOR = '<motor name="m" {reference}="{joint}" gear="{gear}"/>'
BALL = '<joint name="q" type="ball"/>'


def _motor(joint: str, name: str, reference: str) -> str:
    gear = "0.3 0.2 0.1" if joint == BALL else "0.3"
    return _model((joint,), actuators=MOTOR.format(reference=reference, joint=name, gear=gear))


def _motion(text: str) -> np.ndarray:
    """Return qpos at 300 steps of MuJoCo's, (300, nq), with a command that swings."""
    raw = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(raw)
    rows: list[np.ndarray] = []
    for _ in range(300):
        data.ctrl[:] = np.sin(7 * data.time)
        mujoco.mj_step(raw, data)
        rows.append(data.qpos.copy())
    return np.array(rows)


@pytest.mark.parametrize(("joint", "name"), [(X_HINGE, "a"), (X_SLIDE, "f"), (BALL, "q")])
def test_a_motor_in_the_parents_frame_differs_only_where_mujoco_moves_otherwise(
    tmp_path, joint, name
):
    left, right = (_motor(joint, name, reference) for reference in ("joint", "jointinparent"))
    is_one_motion = bool((_motion(left) == _motion(right)).all())
    assert is_one_motion == (joint != BALL)
    titles = [row.title for row in causes_of_texts(tmp_path, left, right)]
    assert titles == ([] if is_one_motion else ["transmission of m"])
