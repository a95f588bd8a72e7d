"""What a function reads or writes by number, or reads from a file's own data, on two sides."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.records import DifferingQuantity
from statemachine.lab.model_differences import compare as compare_models
from statemachine.lab.runs import scenarios
from statemachine.lab.runs.controllers import function_scenario
from statemachine.lab.why import Explanation, WhyRequest, explain

SECONDS = 0.4
HEAD = '<mujoco><option timestep="0.002" gravity="0 0 0"/>'
LINK = (
    '<geom type="capsule" size=".02" fromto="0 0 0 .3 0 0" mass="1" contype="0" conaffinity="0"/>'
)
ARM = (
    '<worldbody><body name="b1" pos="0 0 1"><joint name="j1" axis="0 0 1" damping="0.1"/>'
    f'{LINK}<body name="b2" pos=".3 0 0"><joint name="j2" axis="0 0 1" damping="0.1"/>{LINK}'
    "</body></body></worldbody>"
)
FIRST = '<position name="a1" joint="j1" kp="20"/>'
SECOND = '<position name="a2" joint="j2" kp="20"/>'
BOTH = f"<actuator>{FIRST}{SECOND}</actuator>"


def _written(folder: Path, **texts: str) -> dict[str, Path]:
    """Write files, each by the name of an argument; a Python file is called `function`."""
    paths: dict[str, Path] = {}
    for name, text in texts.items():
        paths[name] = folder / (f"{name}.py" if name == "function" else f"{name}.xml")
        paths[name].write_text(text, encoding="utf-8")
    return paths


def _why(folder: Path, function: str, left: str, right: str) -> Explanation:
    paths = _written(folder, function=function, left=left, right=right)
    return explain(
        WhyRequest(
            sm.load(paths["left"]),
            sm.load(paths["right"]),
            function_scenario(f"{paths['function']}:f"),
            seconds=SECONDS,
            uncertain=None,
        )
    )


def _plain_run(text: str, command: Callable[[Any, Any], list[float]]) -> np.ndarray:
    """Return positions (n, 2) of j1 and j2 [rad], by MuJoCo alone."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    joints = [model.joint(name).qposadr[0] for name in ("j1", "j2")]
    rows = [data.qpos[joints].copy()]
    for _ in range(round(SECONDS / model.opt.timestep)):
        data.ctrl[:] = command(model, data)
        mujoco.mj_step(model, data)
        rows.append(data.qpos[joints].copy())
    return np.array(rows)


def _shares(found: Explanation) -> dict[str, float | None]:
    return {row.name: row.share for row in found.shares}


WAVES = """
import math
def f(model, data):
    return [0.5 * math.sin((3 + i) * data.time) for i in range(len(data.ctrl))]
"""


def _waves(model: Any, data: Any) -> list[float]:
    return [0.5 * math.sin((3 + i) * data.time) for i in range(model.nu)]


@pytest.mark.parametrize(
    ("left", "right"),
    [
        (BOTH, f"<actuator>{SECOND}</actuator>"),
        (f"<actuator>{SECOND}</actuator>", BOTH),
        (BOTH, f"<actuator>{FIRST}</actuator>"),
    ],
    ids=["the left has the first", "the right has the first", "the left has the last"],
)
def test_an_actuator_that_is_put_back_goes_to_its_own_place_of_ctrl(left, right, tmp_path):
    left_text, right_text = (f"{HEAD}{ARM}{actuators}</mujoco>" for actuators in (left, right))
    found = _why(tmp_path, WAVES, left_text, right_text)
    wanted = np.abs(_plain_run(left_text, _waves) - _plain_run(right_text, _waves)).max()
    assert found.gap == pytest.approx(wanted, rel=1e-9)
    (share,) = _shares(found).values()
    assert share == pytest.approx(1.0, abs=1e-9)
    assert found.equalized_gap == pytest.approx(0.0, abs=1e-12)


BY_NUMBER = """
def f(model, data):
    return [0.3 - data.qpos[0], 0.2]
"""
BY_NAME = """
def f(model, data):
    at = model.jnt_qposadr[model.joint_id("j1")]
    ctrl = [0.0, 0.0]
    ctrl[model.actuator_id("a1")] = 0.3 - data.qpos[at]
    ctrl[model.actuator_id("a2")] = 0.2
    return ctrl
"""
CUBE = (
    '<body name="cube" pos="1 0.4 0"><freejoint name="fc"/>'
    '<geom type="box" size=".1 .1 .1" contype="0" conaffinity="0"/></body>'
)
AFTER = f"{HEAD}{ARM.replace('</worldbody>', CUBE + '</worldbody>')}{BOTH}</mujoco>"
BEFORE = f"{HEAD}{ARM.replace('<worldbody>', '<worldbody>' + CUBE)}{BOTH}</mujoco>"
SWAPPED = BEFORE.replace(FIRST + SECOND, SECOND + FIRST)


def test_the_order_of_qpos_is_a_cause_for_a_function_that_reads_by_number(tmp_path):
    found = _why(tmp_path, BY_NUMBER, AFTER, BEFORE)

    def command(_model: Any, data: Any) -> list[float]:
        return [0.3 - data.qpos[0], 0.2]

    wanted = np.abs(_plain_run(AFTER, command) - _plain_run(BEFORE, command)).max()
    assert found.gap == pytest.approx(wanted, rel=1e-6)
    assert _shares(found) == {"order of qpos": pytest.approx(1.0, abs=1e-6)}
    assert found.shares[0].values == (DifferingQuantity("order", "j1 j2 fc", "fc j1 j2"),)


@pytest.mark.parametrize("right", [BEFORE, SWAPPED], ids=["qpos", "qpos and ctrl"])
def test_a_function_that_finds_its_joints_by_name_is_not_led_astray(right, tmp_path):
    damped = right.replace(
        'name="j2" axis="0 0 1" damping="0.1"', 'name="j2" axis="0 0 1" damping="0.3"'
    )
    found = _why(tmp_path, BY_NAME, AFTER, damped)
    assert found.explained == pytest.approx(1.0, abs=1e-6)
    assert found.equalized_gap == pytest.approx(0.0, abs=1e-9)
    if right == BEFORE:
        assert _shares(found)["order of qpos"] == pytest.approx(0.0, abs=1e-6)


SENSORS = '<sensor><jointpos name="s1" joint="j1"/><jointpos name="s2" joint="j2"/></sensor>'
TURNED_SENSORS = '<sensor><jointpos name="s2" joint="j2"/><jointpos name="s1" joint="j1"/></sensor>'
READS_SENSORS = """
def f(model, data):
    return [0.3 - data.raw.sensordata[0], 0.2]
"""


def test_the_order_of_sensordata_is_a_cause(tmp_path):
    left, right = (f"{HEAD}{ARM}{BOTH}{sensors}</mujoco>" for sensors in (SENSORS, TURNED_SENSORS))
    found = _why(tmp_path, READS_SENSORS, left, right)
    assert _shares(found) == {"order of sensordata": pytest.approx(1.0, abs=1e-9)}


USER = {
    "joint": (ARM.replace('name="j1"', 'name="j1" user="{}"'), "jnt_user", "user data of j1"),
    "body": (ARM.replace('name="b1"', 'name="b1" user="{}"'), "body_user", "user data of b1"),
    "geom": (
        ARM.replace("<geom ", '<geom name="g" user="{}" ', 1),
        "geom_user",
        "user data of g",
    ),
    "site": (
        ARM.replace("<geom ", '<site name="s" user="{}"/><geom ', 1),
        "site_user",
        "user data of s",
    ),
    "camera": (
        ARM.replace("<geom ", '<camera name="c" user="{}"/><geom ', 1),
        "cam_user",
        "user data of c",
    ),
    "tendon": (
        ARM + '<tendon><fixed name="t" user="{}"><joint joint="j1" coef="1"/></fixed></tendon>',
        "tendon_user",
        "user data of t",
    ),
    "sensor": (
        ARM + '<sensor><jointpos name="p" joint="j1" user="{}"/></sensor>',
        "sensor_user",
        "user data of p",
    ),
    "actuator": (ARM, "actuator_user", "user data of a1"),
    "numeric": (
        ARM + '<custom><numeric name="n" data="{}"/></custom>',
        "numeric_data",
        "numeric data of n",
    ),
}


@pytest.mark.parametrize("kind", USER)
def test_data_that_only_a_function_reads_is_a_difference_and_a_cause(kind, tmp_path):
    template, array, cause = USER[kind]
    template = f"{HEAD}{template}{BOTH}</mujoco>"
    if kind == "actuator":
        template = template.replace('name="a1"', 'name="a1" user="{}"')
    left, right = template.format(0.3), template.format(0.6)
    function = f"def f(model, data):\n    return [float(model.raw.{array}.max()), 0.2]\n"
    found = _why(tmp_path, function, left, right)

    def command(model: Any, _data: Any) -> list[float]:
        return [float(getattr(model, array).max()), 0.2]

    wanted = np.abs(_plain_run(left, command) - _plain_run(right, command)).max()
    assert found.gap == pytest.approx(wanted, rel=1e-9)
    assert _shares(found) == {cause: pytest.approx(1.0, abs=1e-9)}
    (value,) = found.shares[0].values
    assert (value.left, value.right) == (0.3, 0.6)
    listed = compare_models(tmp_path / "left.xml", tmp_path / "right.xml")
    assert [row.cause for row in listed.differences if row.matters] == [cause]
    assert not listed.equal


def test_a_text_and_a_tuple_are_differences_and_causes(tmp_path):
    custom = (
        '<custom><text name="law" data="{}"/><tuple name="chosen">'
        '<element objtype="body" objname="{}"/></tuple></custom>'
    )
    left, right = (
        f"{HEAD}{ARM}{BOTH}{custom.format(text, body)}</mujoco>"
        for text, body in (("slow", "b1"), ("fast", "b2"))
    )
    function = """
def f(model, data):
    law = bytes(model.raw.text_data).rstrip(b"\\0").decode()
    return [0.1 * int(model.raw.tuple_objid[0]), 0.5 if law == "fast" else 0.1]
"""
    found = _why(tmp_path, function, left, right)
    assert {name.partition(" data of ")[::2] for name in _shares(found)} == {
        ("text", "law"),
        ("tuple", "chosen"),
    }
    assert found.equalized_gap == pytest.approx(0.0, abs=1e-12)


def test_user_data_that_has_no_room_is_refused_with_its_reason(tmp_path):
    template = f"{HEAD}{ARM.replace('name=', '{} name=', 1)}{BOTH}</mujoco>"
    left, right = template.format('user="0.3"'), template.format("")
    found = _why(tmp_path, "def f(model, data):\n    return [0.1, 0.2]\n", left, right)
    assert found.gap == 0
    assert [name.split()[-1] for name in found.unread] == ["b1"]


def test_what_no_function_reads_costs_no_run_and_is_named(tmp_path):
    texts = [f"{HEAD}{USER['joint'][0]}{BOTH}</mujoco>".format(value) for value in (0.3, 0.6)]
    paths = _written(tmp_path, left=texts[0], right=texts[1])
    found = explain(
        WhyRequest(
            sm.load(paths["left"]),
            sm.load(paths["right"]),
            scenarios.scenario("gravity"),
            seconds=SECONDS,
            uncertain=None,
        )
    )
    assert found.shares == ()
    assert [name.split()[-1] for name in found.unread] == ["j1"]


MOCAP = (
    '<body name="{}" mocap="true" pos="{} 1 0">'
    '<geom size=".02" contype="0" conaffinity="0"/></body>'
)
LED = '<equality><weld body1="near" body2="cube" solref="0.1 1"/></equality>'
HOME = '<keyframe><key name="home"/></keyframe>'
MOVES_MOCAP = """
def f(model, data):
    data.mocap_pos[0] = [1 + 0.2 * data.time, 0.4, 0]
    return [0.0, 0.0]
"""


def test_the_order_of_mocap_bodies_is_a_cause_for_who_moves_them_by_number(tmp_path):
    near, far = MOCAP.format("near", 1), MOCAP.format("far", 2)
    left, right = (
        AFTER.replace("</worldbody>", f"{bodies}</worldbody>").replace(
            "</mujoco>", LED + HOME + "</mujoco>"
        )
        for bodies in (near + far, far + near)
    )
    found = _why(tmp_path, MOVES_MOCAP, left, right)
    assert _shares(found)["order of mocap bodies"] == pytest.approx(1.0, abs=1e-3)
