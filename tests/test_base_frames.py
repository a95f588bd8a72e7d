"""A base whose frame stands elsewhere on the same solid in the other file: it is told."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from statemachine.lab.compare import Request, Side
from statemachine.lab.compare.bases import load_sides
from statemachine.lab.questions.comparison import page
from statemachine.lab.questions.requests import causes, gap
from statemachine.lab.why import page as why
from statemachine.show.blocks import Text

from .support.files import written

SHIFT, TURN = np.array([0.02, 0.0, -0.05]), 0.3  # m; rad, about z


def hopper(shift: np.ndarray, turn: float) -> str:
    """Return a body with a leg, all of which stays where it was before its frame was moved."""
    cos, sin = np.cos(turn), np.sin(turn)
    back = np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])  # into the new frame

    def at(x: float, y: float, z: float) -> str:
        return " ".join(f"{number:.15g}" for number in back @ (np.array([x, y, z]) - shift))

    quat = f"{np.cos(turn / 2):.15g} 0 0 {-np.sin(turn / 2):.15g}"
    pos = " ".join(f"{number:.15g}" for number in np.array([0, 0, 1.0]) + shift)
    turned = f"{np.cos(turn / 2):.15g} 0 0 {np.sin(turn / 2):.15g}"
    return f"""<mujoco><worldbody><body name="base" pos="{pos}" quat="{turned}"><freejoint/>
<inertial pos="{at(0, 0, 0)}" quat="{quat}" mass="3" diaginertia="0.03 0.04 0.05"/>
<body name="leg" pos="{at(0.1, 0, 0)}" quat="{quat}"><joint name="hip" axis="0 1 0"/>
<geom type="capsule" size="0.02" fromto="0 0 0 0.1 0 -0.2" mass="0.5"/></body></body></worldbody>
<actuator><motor joint="hip"/></actuator></mujoco>"""


@pytest.fixture
def run(tmp_path: Path) -> Request:
    """Both files in free fall."""
    left = written(tmp_path / "left.xml", hopper(np.zeros(3), 0.0))
    right = written(tmp_path / "right.xml", hopper(SHIFT, TURN))
    return Request(("gravity",), sides=(Side(str(left)), Side(str(right))), seconds=0.2)


def test_the_offset_of_the_frame_is_told_as_plain_mujoco_has_it(run: Request) -> None:
    frame = load_sides(run.sides, {}, {}).bases.frame
    assert frame is not None
    assert (frame.link_left, frame.link_right) == ("base", "base")
    # Raw: from the base to the leg, which is the same solid of both, and back.
    places = []
    for side in run.sides:
        model = mujoco.MjModel.from_xml_path(side.model)
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        places.append((data.xpos.copy(), data.xmat.reshape(-1, 3, 3).copy()))
    (left, left_mat), (right, right_mat) = places
    np.testing.assert_allclose(left[2], right[2], atol=1e-12)  # the legs are in one place
    np.testing.assert_allclose(frame.pos, left_mat[1].T @ (right[1] - left[1]), atol=1e-9)
    turn = np.arccos((np.trace(left_mat[1].T @ right_mat[1]) - 1) / 2)
    assert frame.angle == pytest.approx(turn, abs=1e-9) == pytest.approx(TURN)
    assert frame.distance == pytest.approx(np.linalg.norm(SHIFT))


def test_both_pages_tell_of_other_base_frames_below_the_verdict(run: Request) -> None:
    compared = gap.answer(gap.CompareRequest(run, uncertainty=None))
    explained = causes.answer(causes.ExplainRequest(run, uncertainty=None, jobs=1))
    for shown in (page(compared), why.page(explained)):
        first = shown.blocks[0]
        assert isinstance(first, Text)
        assert "53.9 mm" in first.text.replace("\u00a0", " ")
        assert "17.19" in first.text


def test_base_frames_that_are_one_are_not_told(tmp_path: Path) -> None:
    files = [str(written(tmp_path / f"{name}.xml", hopper(np.zeros(3), 0.0))) for name in "ab"]
    assert load_sides([Side(file) for file in files], {}, {}).bases.frame is None
