"""Models with rare parts: transmissions that act on no joint, empty tables, parts without names."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import statemachine as sm
from statemachine.engines.mujoco.description import describe
from tools.fuzz import random_models

from .support.files import written
from .support.processes import Cli
from .support.small_models import mjcf

# A mocap body leads a free one by a weld; the file has no keyframe.
LED = mjcf(
    '<body name="target" mocap="true" pos="0.2 0 0.6"><geom size=".01" contype="0"'
    ' conaffinity="0"/></body>'
    '<body name="hand" pos="0 0 .5"><freejoint/><geom size=".05"/><site name="tip"/></body>',
    '<equality><weld body1="target" body2="hand" relpose="{relpose}"/></equality>',
)
# More sites than joints: the number of a site is the number of no joint.
THRUST = mjcf(
    '<body name="x" pos="0 0 1"><freejoint/><geom type="box" size=".1 .1 .02" mass="{mass}"/>'
    '<site name="a" pos=".1 0 0"/><site name="b" pos="-.1 0 0"/></body>',
    '<actuator><motor name="m" site="a" gear="0 0 1 0 0 0" ctrlrange="0 5"/>'
    '<motor name="n" site="b" gear="0 0 1 0 0 0" ctrlrange="0 5"/></actuator>',
)
# Every transmission; each is a servo that may be told more than its joint allows.
ALL = mjcf(
    '<site name="s0"/><site name="s1"/><site name="s2" pos="0 0 .1"/>'
    '<body name="x"><joint name="j" axis="0 1 0" range="-1 1"/><geom size=".1" pos=".1 0 0"/>'
    '<site name="slider" pos=".2 0 0"/><body pos=".3 0 0"><joint axis="0 1 0"/><geom size=".1"/>'
    '<site name="crank" pos=".1 0 0"/></body></body>'
    '<body name="ball" pos="0 1 0"><joint name="turns" type="ball"/><geom size=".1"/></body>',
    '<tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon><actuator>'
    + "".join(
        f'<position kp="5" ctrlrange="-9 9" {target}/>'
        for target in (
            'joint="j"',
            'jointinparent="j"',
            'cranksite="crank" slidersite="slider" cranklength=".5"',
            'tendon="t"',
            'site="s2" refsite="s0"',
        )
    )
    + '<adhesion body="x" ctrlrange="0 1"/><orientation joint="turns" kp="1"/></actuator>',
    '<compiler angle="radian"/>',
)


def test_a_mocap_body_needs_no_keyframe(here: Cli, tmp_path: Path) -> None:
    """Its parts of the keyframes are then empty arrays."""
    left, right = (
        written(tmp_path / f"{name}.xml", LED.format(relpose=relpose))
        for name, relpose in (("left", "0 0 0 0 0 0 0"), ("right", ".1 0 0 1 0 0 0"))
    )
    here("compare", "--models", left, right)
    asked = ("compare", "gravity", left, right, "--seconds", ".1", "--why", "--json")
    found = json.loads(here(*asked, code=0).stdout)
    assert found["shares"][0]["name"] == "parameters of equality 0"
    assert found["explained"] == pytest.approx(1.0)


def test_the_target_of_a_thruster_is_no_joint(here: Cli, tmp_path: Path) -> None:
    left, right = (
        written(tmp_path / f"{mass}.xml", THRUST.format(mass=mass)) for mass in ("1", "1.2")
    )
    said = here("compare", "--models", left, right, "--json", code=1).stdout
    acting = [row for row in json.loads(said)["differences"] if row["matters"]]
    assert [row["subject"] for row in acting] == ["mass", "inertia"]
    asked = ("compare", "waves", left, right, "--seconds", ".2", "--why", "--json")
    (cause,) = json.loads(here(*asked, code=0).stdout)["shares"]
    (values,) = [each for each in cause["values"] if each["quantity"] == "mass"]
    assert (values["left"], values["right"], values["unit"]) == (1.0, 1.2, "kg")
    assert cause["place"] == {"file": "1.2.xml", "line": 1}
    assert cause["share"] == pytest.approx(1.0)


def test_only_transmissions_by_a_joint_have_one(tmp_path: Path) -> None:
    robot = describe(sm.load(written(tmp_path / "m.xml", ALL)).raw, "m")
    assert [drive.joint for drive in robot.actuators] == ["j", "j", "", "", "", "", "turns"]
    # Of the servos only the first turns its joint by the gear alone.
    (note,) = [note for note in robot.notes if "ctrlrange" in note]
    assert "'actuator 0'" in note
    assert "458°" in note


def test_a_lesson_on_runs_refuses_a_model_in_which_nothing_moves(here: Cli, tmp_path: Path) -> None:
    file = written(tmp_path / "still.xml", mjcf('<body><geom size=".1"/></body>'))
    said = here("lesson", "replay", "--model", file, "--no-questions", code=2).stderr
    assert "has no joints" in said


# Two hinges of one body about one axis: its mass matrix has no inverse.
TWICE = mjcf(
    '<body><joint axis="0 1 0"/><joint axis="0 1 0"/><geom size=".1" pos=".1 0 0"/></body>'
    '<body pos="0 1 0"><joint axis="0 1 0" armature=".1"/><geom size=".1" pos=".1 0 0"/></body>'
)


def test_two_joints_about_one_axis_are_loaded_by_pybullet(tmp_path: Path) -> None:
    pytest.importorskip("pybullet")
    file = written(tmp_path / "m.xml", TWICE)
    with sm.make_data(sm.load(file, backend="pybullet")) as data:
        assert data.qpos.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("seed", range(12))
def test_random_models_are_read_without_a_traceback(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    quick: dict[Any, int] = {("compare", "--models", "LEFT", "RIGHT"): 1}
    monkeypatch.setattr(random_models, "COMMANDS", quick)
    assert random_models.examined(seed, tmp_path, readers=1, thorough=False) == []
