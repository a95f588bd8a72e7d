"""Experiments and lessons on robots of other kinds than the arm: what they ask for and say."""

from __future__ import annotations

import itertools
import json
import sys
import types
import urllib.error
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine import errors, models, robot_packages
from statemachine.cli import main
from statemachine.course.lessons import LESSONS
from statemachine.course.lessons.session import page_of_lesson, take
from statemachine.lab.compare import compare
from statemachine.lab.recordings import record_scenario
from statemachine.lab.robots import ExaminedModel, Survey
from statemachine.lab.robots.examine import examine
from statemachine.lab.robots.page import page as survey_page
from statemachine.lab.runs.robot import is_servo
from statemachine.lab.runs.scenarios import SCENARIOS, suitable_scenarios
from statemachine.lab.runs.usual_commands import hold_ctrl
from statemachine.show.blocks import Code, Page, Question, Table, Text

from .support.claims import assert_has, assert_in, assert_not_in, overlapping, refused
from .support.files import written, written_all
from .support.motions import opened
from .support.pages import blocks, shown
from .support.processes import Cli, one_line

# A slide with a servo whose gear is 2, a hinge with a motor of gear 3 that holds a load, and a
# hinge that a velocity servo drives.
MIXED = """<mujoco><worldbody>
  <body name="cart"><joint name="rail" type="slide" axis="1 0 0" range="-1 1" limited="true"/>
    <geom size=".1" mass="1"/>
    <body name="arm" pos="0 0 .5"><joint name="lift" axis="0 1 0" damping="1"/>
      <geom type="capsule" fromto="0 0 0 .4 0 0" size=".03" mass="1"/>
      <body name="wheel" pos=".4 0 0"><joint name="spin" axis="1 0 0"/><geom size=".05"/></body>
    </body></body></worldbody>
  <actuator><position name="p" joint="rail" kp="500" kv="50" gear="2" ctrlrange="-1 1.4"/>
    <motor name="m" joint="lift" gear="3" ctrlrange="-9 9" ctrllimited="true"/>
    <velocity name="v" joint="spin" kv=".05"/></actuator>
  {rest}</mujoco>"""
HOME = '<keyframe><key name="home" qpos=".2 0 0" ctrl=".4 0 1"/></keyframe>'
# A robot of a floating base and two legs on a floor.
FLOATING = """<mujoco><worldbody><geom name="ground" type="plane" size="5 5 .1"/>
  <body name="trunk" pos="0 0 .5"><freejoint name="root"/><geom size=".1" mass="2"/>
    <body name="leg" pos=".1 0 0"><joint name="hip" axis="0 1 0" damping=".1"/>
      <geom type="capsule" fromto="0 0 0 .3 0 -.1" size=".03" mass="1"/></body></body></worldbody>
  <actuator><motor name="hip" joint="hip"/></actuator></mujoco>"""
BOX = """<mujoco><worldbody><body name="box" pos="0 0 1"><freejoint name="float"/>
  <geom type="box" size=".1 .1 .1"/></body></worldbody></mujoco>"""
STILL = '<mujoco><worldbody><geom name="rock" size="1"/></worldbody></mujoco>'
PASSIVE = """<mujoco><worldbody><body name="beam"><joint name="swing" axis="0 1 0"/>
  <geom type="capsule" fromto="0 0 0 .4 0 0" size=".03"/></body></worldbody></mujoco>"""
# A joint on a base that swings on, held still by a limit: at rest beside what moves.
COUPLED = """<mujoco><option timestep=".002"/><worldbody>
  <body name="swing" euler="0 60 0"><joint name="pivot" axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 0 0 -1" size=".02" mass="1"/>
    <body name="load" pos="0 0 -1"><joint name="rail" type="slide" axis="1 0 0" damping="1e6"/>
      <geom size=".05" mass="5"/></body></body></worldbody>
  <actuator><position name="m" joint="rail" kp="0.001"/></actuator></mujoco>"""
SEVERAL = """<mujoco><worldbody><body name="b"><joint name="ball" type="ball"/><geom size=".1"/>
    <body name="c" pos="1 0 0"><joint name="k"/><geom size=".1"/></body></body></worldbody>
  <actuator><orientation name="o" joint="ball" kp="10"/>
    <pid name="p" joint="k" kp="3" ki="1" kv=".1"/><motor name="m" joint="k" gear="3"/>
    <position name="s" joint="k" kp="4" forcerange="-7 7"/>
    <intvelocity name="i" joint="k" kp="4" actrange="-1 1"/></actuator>
  <keyframe><key name="home" ctrl="0 0 .1 0 1 0 0 0"/></keyframe></mujoco>"""


@pytest.fixture
def model(tmp_path: Path) -> Any:
    return lambda text, name="robot.xml": sm.load(written(tmp_path / name, text))


def lesson(name: str, model: sm.Model, **options: Any) -> tuple[Any, Page, str]:
    """Return what a lesson finds on a model, its page, and its code."""
    taken = take(LESSONS[name], model, "mujoco", options, model.path.name)
    return taken.result, page_of_lesson(LESSONS[name], {"mujoco": taken}), taken.code


def words(page: Page) -> str:
    """Return all text of a page, but for its code."""
    whole = replace(page, blocks=[block for block in page.blocks if not isinstance(block, Code)])
    return " ".join(shown(whole).split())


@pytest.fixture
def mixed(model: Any) -> sm.Model:
    """A servo on a slide, a motor that holds a load, and a velocity servo."""
    return model(MIXED.format(rest=""))


def test_only_a_position_servo_is_a_servo(mixed: sm.Model) -> None:
    assert is_servo(mixed).tolist() == [True, False, False]


def test_a_pose_is_asked_of_a_servo(mixed: sm.Model) -> None:
    # The servo stands at 0; a quarter of its 2.4 is beyond what 0.1 m of the joint are.
    assert hold_ctrl(mixed)[0] == pytest.approx(0.2)


def test_a_motor_is_asked_for_the_force_that_holds_its_load(mixed: sm.Model) -> None:
    ctrl = hold_ctrl(mixed)
    data = mujoco.MjData(mixed.raw)
    mujoco.mj_forward(mixed.raw, data)
    assert ctrl[1] == pytest.approx(float(data.qfrc_bias[1]) / 3, rel=1e-3)
    data.ctrl[:] = ctrl
    mujoco.mj_forward(mixed.raw, data)
    assert data.qacc[1] == pytest.approx(0, abs=1e-2)


def test_a_velocity_servo_is_asked_for_nothing(mixed: sm.Model) -> None:
    assert hold_ctrl(mixed)[2] == 0


def test_a_run_of_another_robot_starts_in_its_keyframe_home(model: Any) -> None:
    trace = record_scenario(SCENARIOS["hold"], model(MIXED.format(rest=HOME)), seconds=0.02)
    assert trace.header.keyframe == "home"
    assert "'home'" in trace.header.description
    assert trace.qpos[0].tolist() == [0.2, 0, 0]


def test_commands_of_a_run_begin_with_those_of_home(model: Any) -> None:
    trace = record_scenario(SCENARIOS["hold"], model(MIXED.format(rest=HOME)), seconds=0.02)
    assert trace.ctrl[0, 0] == pytest.approx(0.2)  # from 0.4 towards the farther end
    assert trace.ctrl[0, 2] == 1  # a velocity servo is left at the keyframe's


def test_a_lesson_on_another_robot_starts_in_its_keyframe_home(model: Any) -> None:
    found, _, code = lesson("hold", model(MIXED.format(rest=HOME)), seconds=0.1)
    assert (found.qpos[0, 0], found.keyframe) == (0.2, "home")
    assert "sm.reset(model, data, keyframe='home')" in code


def test_a_force_is_never_read_as_a_place(model: Any) -> None:
    found, page, _ = lesson("hold", model(MIXED.format(rest="")), ctrl=[0.4, 40, 0], seconds=0.5)
    assert found.joints == ("rail",)
    assert found.target.tolist() == pytest.approx([0.2])  # of the joint: the gear is 2
    tables = [table for table in blocks(page, Table) if "joint" in table.headers]
    (row,) = tables[0].rows  # a second table has what the servo exerts
    assert row[1] == "200.00 mm"


@pytest.mark.parametrize("name", ["hold", "gravity"])
def test_what_has_no_servo_is_pointed_to_the_command_that_runs_it(model: Any, name: str) -> None:
    says = rf"statemachine compare {name} \S+robot.xml \(.*trace record"
    refused((errors.BadInputError, says, partial(lesson, name, model(FLOATING))))


def test_a_joint_without_a_servo_is_refused_by_its_name(mixed: sm.Model) -> None:
    refused((errors.BadInputError, "drives lift", lambda: lesson("gravity", mixed, joint="lift")))


@pytest.mark.parametrize(
    ("text", "suitable"), [(PASSIVE, ("gravity", "fall")), (STILL, ())], ids=["passive", "still"]
)
def test_only_what_a_robot_can_show_is_suitable(
    model: Any, text: str, suitable: tuple[str, ...]
) -> None:
    assert suitable_scenarios(model(text)) == suitable


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("hold", PASSIVE, "no actuators.*: gravity, fall"),
        ("droop", PASSIVE, "no actuators.*: gravity, fall"),
        ("waves", PASSIVE, "no actuators.*: gravity, fall"),
        ("box", PASSIVE, "no SO-101"),
        ("gravity", STILL, "no joints"),
    ],
)
def test_what_is_not_suitable_is_refused_with_what_is(
    model: Any, name: str, text: str, says: str
) -> None:
    run = partial(record_scenario, SCENARIOS[name], model(text))
    refused((errors.BadInputError, says, run))


def test_the_questions_are_of_the_arm_alone(model: Any) -> None:
    refused((errors.BadInputError, "SO-101", partial(lesson, "questions", model(PASSIVE))))


@pytest.mark.parametrize(
    ("name", "part"),
    [("hold", "start's ctrl"), ("gravity", "No actuator"), ("fall", "nothing can touch")],
)
def test_an_experiment_is_described_as_it_is_on_another_robot(
    model: Any, name: str, part: str
) -> None:
    assert part in SCENARIOS[name].on(model(FLOATING)).description


def test_an_experiment_on_the_arm_alone_speaks_of_its_servos_and_no_floor(
    mujoco_arm: sm.Model,
) -> None:
    assert "servo" in SCENARIOS["hold"].on(mujoco_arm).description
    assert "floor" not in SCENARIOS["gravity"].on(mujoco_arm).description


def test_experiments_are_described_for_the_arm_above_its_floor(mujoco_scene: sm.Model) -> None:
    assert all(each.on(mujoco_scene) is each for each in SCENARIOS.values())


def test_gravity_takes_a_joint_with_a_servo(model: Any) -> None:
    found, page, code = lesson(
        "gravity", model(MIXED.format(rest="")), seconds=0.5, longer=0.5, further=True
    )
    assert found.joint == "rail"  # the load of the others is larger
    assert "1000 * data.qpos[slot]" in code  # millimetres, as in the table
    assert set(found.longer) == {"contacts", "no contacts"}
    assert "[N]" in words(page)


def test_no_balance_is_drawn_while_the_rest_moves(model: Any) -> None:
    found, page, _ = lesson("gravity", model(COUPLED), seconds=0.3, longer=0.0)
    end = found.servos_on
    assert found.joint == "rail"
    assert abs(end.velocity) < 0.01  # stands on its rail, which swings
    assert abs(end.forces.total) > 0.1
    assert page.holds


def test_a_divergence_costs_its_row(model: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from statemachine.lab.runs import drive

    steps = itertools.count(1)

    def step(model: sm.Model, data: sm.Data) -> None:
        if next(steps) > 700:
            raise errors.DivergedError("gone", time=data.time, quantity="qpos", index=0)
        sm.step(model, data)

    monkeypatch.setattr(drive, "step", step)
    found, page, _ = lesson(
        "gravity", model(MIXED.format(rest="")), seconds=0.1, longer=2.0, further=True
    )
    run = found.longer["contacts"]
    assert run.diverged == pytest.approx(1.4)
    assert run.position.tolist()[:2] == run.path[[0, 500]].tolist()
    assert "diverged" in words(page)


def test_a_free_body_is_written_at_its_height(model: Any) -> None:
    found, page, code = lesson("forward", model(BOX), further=True)
    assert_has(found, value=1.05)
    assert found.further.effects.slide
    assert "+ 2  # the height of a free body" in code
    assert page.holds


ROBOTS = {"mixed": MIXED.format(rest=HOME), "floating": FLOATING, "box": BOX, "passive": PASSIVE}
_QUICK: dict[str, dict[str, Any]] = {
    "gravity": {"seconds": 0.2, "longer": 0.2, "further": True},
    "hold": {"seconds": 0.2},
    "replay": {"steps": 30},
    "forward": {"further": True, "seconds": 0.1},
    "time": {"steps": 40},
}


@pytest.mark.slow
@pytest.mark.parametrize("robot", list(ROBOTS))
@pytest.mark.parametrize(
    "name",
    [
        "nowhere",
        "objects",
        "state",
        "forward",
        "hold",
        "gravity",
        "reset",
        "replay",
        "time",
        "summary",
    ],
)
def test_every_lesson_that_makes_sense_holds(model: Any, robot: str, name: str) -> None:
    """Of another robot than the arm a lesson shows code, tables and curves."""
    made = model(ROBOTS[robot])
    if name in ("hold", "gravity") and not is_servo(made).any():
        return
    _, page, code = lesson(name, made, **_QUICK.get(name, {}))
    assert page.holds, words(page)
    assert_not_in(words(page), "1e+", " arm ")
    assert not any(isinstance(block, (Text, Question)) for block in page.blocks)
    assert code
    assert blocks(page, Table) or name == "nowhere" or (name == "reset" and not made.keyframes)


# A cart that one motor pushes against its limit, with a pole that falls onto its own.
INVERTED = """<mujoco><option integrator="RK4" timestep="0.02"/><worldbody>
  <body name="cart"><joint name="slider" type="slide" axis="1 0 0" range="-1 1" limited="true"
      damping="1"/><geom type="capsule" size=".1 .1" mass="10" contype="0"/>
    <body name="pole"><joint name="hinge" axis="0 1 0" range="-90 90" limited="true" damping="1"/>
      <geom type="capsule" fromto="0 0 0 .001 0 .6" size=".05" mass="5" contype="0"/></body>
  </body></worldbody>
  <actuator><motor joint="slider" gear="100" ctrlrange="-3 3"/></actuator></mujoco>"""


def test_broken_runs_may_end_in_the_same_bits(tmp_path: Path, here: Cli, bullet: object) -> None:
    """At its limits a robot forgets how it came there; the lesson does not say that it differs."""
    file = written(tmp_path / "inverted.xml", INVERTED)
    words = ("lesson", "replay", "--backend", "pybullet", "--model", str(file), "--json")
    found = json.loads(here(*words, code=0).stdout)["pybullet"]
    assert [(run["peak"] > 0.01, run["end"]) for run in found["breaks"]] == [(True, 0.0)] * 2


def test_what_a_stage_of_an_integrator_leaves_is_of_no_moment(model: Any) -> None:
    """RK4 computes four times in a step: that it leaves another place than forward is no fault."""
    found, page, _ = lesson("forward", model(INVERTED), further=True, seconds=0.1)
    raw = mujoco.MjModel.from_xml_string(INVERTED)
    data = mujoco.MjData(raw)
    mujoco.mj_forward(raw, data)
    data.qpos[0] = found.value
    mujoco.mj_step(raw, data)
    left = data.xpos.copy()
    data.qpos[:], data.qvel[:] = 0, 0
    data.qpos[0] = found.value
    mujoco.mj_forward(raw, data)
    assert not np.array_equal(data.xpos, left)
    assert {change.name: change.same for change in found.further.changes}["xpos"] is False
    assert page.holds


def test_a_value_is_in_the_range_of_its_joint(model: Any) -> None:
    robot = model(MIXED.format(rest=""))
    values = [lesson("forward", robot, **joint)[0].value for joint in ({"joint": "rail"}, {})]
    assert values == [0.5, 0.8]  # a quarter of the 2 m


SEVERAL_NAMES = ("o.x", "o.y", "o.z", "p.position", "p.velocity", "m", "s", "i")


def test_each_number_of_ctrl_has_a_name(model: Any) -> None:
    robot = model(SEVERAL)
    assert robot.actuator_names == SEVERAL_NAMES
    assert robot.nu == len(SEVERAL_NAMES) == len(robot.keyframes[0].ctrl)


def test_each_number_of_ctrl_has_what_its_actuator_has(model: Any) -> None:
    robot = model(SEVERAL)
    assert robot.actuator_jntid.tolist() == [-1, -1, -1, 1, 1, 1, 1, 1]
    assert np.flatnonzero(np.isfinite(robot.actuator_kp)).tolist() == [6]
    assert np.flatnonzero(np.isfinite(robot.actuator_gain)).tolist() == [5]
    assert (robot.actuator_gear[5], robot.actuator_forcerange[6].tolist()) == (3, [-7, 7])


def test_a_number_of_ctrl_is_found_by_its_name(model: Any) -> None:
    with opened(model(SEVERAL), "home") as (robot, data):
        data.ctrl[robot.actuator_id("m")] = 2.0
        sm.forward(robot, data)
        assert data.raw.actuator_force[-3] == 2.0  # its gain is 1
        sm.step(robot, data, 10)


def test_a_robot_whose_actuators_take_several_numbers_is_recorded(model: Any) -> None:
    trace = record_scenario(SCENARIOS["waves"], model(SEVERAL), seconds=0.05)
    assert trace.header.actuators == SEVERAL_NAMES


def test_a_robot_whose_actuators_take_several_numbers_is_compared(model: Any) -> None:
    file = str(model(SEVERAL).path)
    assert main(["compare", "--models", file, file]) == 0


@pytest.mark.usefixtures("bullet")
def test_no_filler_of_ours_is_shown(model: Any, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(model(MIXED.format(rest="").replace(' range="-1 1" limited="true"', "")).path)
    # The robots are the same; a motor whose ctrl has a range may differ in what it can exert.
    main(["compare", "--models", file, "--backend", "mujoco", "--backend", "pybullet:engine"])
    assert_not_in(capsys.readouterr().out, "e+09", "e+12")


class _Registry(types.ModuleType):
    """Stands for the package mujoco_menagerie."""

    class MenagerieError(Exception):
        pass

    class Cache:
        root = None
        base_url = "https://nowhere.invalid/assets"

        @staticmethod
        def is_cached(robot: Any) -> bool:
            return robot.here

    here, folder = True, Path()

    def names(self) -> list[str]:
        return ["unitree_g1", "unitree_go2"]

    def get(self, name: str) -> Any:
        def xml(entry: str | None) -> Path:
            if not self.here:
                raise self.MenagerieError("no archive")
            return self.folder / f"{entry or 'scene'}.xml"

        return types.SimpleNamespace(here=self.here, entry_names=("scene", "g1"), xml=xml)


@pytest.fixture
def menagerie_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> _Registry:
    package = _Registry("mujoco_menagerie")
    package.folder = written_all(tmp_path, dict.fromkeys(("scene.xml", "g1.xml"), PASSIVE))
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", package)
    return package


@pytest.mark.parametrize(
    ("name", "folder", "file"),
    [
        ("menagerie:unitree_g1", "", "scene.xml"),
        ("menagerie:unitree_g1/g1", "", "g1.xml"),
        ("menagerie:unitree_g1/g1", "elsewhere", "g1.xml"),
    ],
)
def test_a_robot_by_name_is_a_file_of_the_package(
    name: str, folder: str, file: str, menagerie_package: _Registry
) -> None:
    found = models.resolve(name, menagerie=folder) if folder else models.resolve(name)
    assert found == menagerie_package.folder / file


@pytest.mark.usefixtures("menagerie_package")
def test_a_robot_is_loaded_by_its_name() -> None:
    assert sm.load("menagerie:unitree_g1").joint_names == ("swing",)


@pytest.mark.usefixtures("menagerie_package")
@pytest.mark.parametrize(
    ("name", "says"),
    [("menagerie:unitre_g1", "'unitree_g1'"), ("menagerie:unitree_g1/nope", "scene, g1")],
)
def test_a_name_that_is_not_known_is_refused_with_those_that_are(name: str, says: str) -> None:
    refused((errors.UnknownNameError, says, lambda: models.resolve(name)))


@pytest.fixture
def no_network(menagerie_package: _Registry, monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Nothing is here and nothing can be had; how long it was waited for, each time [s]."""
    menagerie_package.here = False
    asked: list[float] = []

    def urlopen(_request: Any, timeout: float) -> Any:
        asked.append(timeout)
        raise urllib.error.URLError("Name or service not known")

    monkeypatch.setattr(robot_packages.urllib.request, "urlopen", urlopen)
    return asked


@pytest.mark.parametrize(
    ("name", "code", "said"),
    [
        ("menagerie:unitree_g1", 2, "unitree_g1 is not on this machine"),
        ("menagerie:", 2, "menagerie:NAME"),
        ("menagerie:unitre_g1", 2, "'unitree_g1'"),
        ("robot_descriptions:panda_mj_description", 3, "[robots]"),
    ],
)
@pytest.mark.parametrize("command", ["lesson gravity --model", "compare hold", "trace record hold"])
def test_a_robot_that_cannot_be_had_is_one_line(
    monkeypatch: pytest.MonkeyPatch,
    here: Cli,
    command: str,
    name: str,
    code: int,
    said: str,
    no_network: list[float],
) -> None:
    monkeypatch.setitem(sys.modules, "robot_descriptions", None)
    one_line(here(*command.split(), name), said, code)
    assert no_network == [5.0] * ("not on this machine" in said)  # and no further try


@pytest.mark.parametrize(
    ("name", "extra"),
    [("menagerie:unitree_g1", "menagerie"), ("robot_descriptions:panda_description", "robots"),
     ("panda_mj_description", "robots")],
)  # fmt: skip
def test_a_package_that_is_missing_is_named(
    name: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("mujoco_menagerie", "robot_descriptions"):
        monkeypatch.setitem(sys.modules, module, None)
    refused((errors.MissingEngineError, rf"\[{extra}\]", lambda: models.resolve(name)))


@pytest.fixture
def descriptions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a package robot_descriptions that has one MJCF, and one robot of no kind."""
    package = types.ModuleType("robot_descriptions")
    vars(package).update(DESCRIPTIONS={"a_mj_description": None, "b_description": None})
    one = types.ModuleType("robot_descriptions.a_mj_description")
    vars(one).update(MJCF_PATH=str(tmp_path / "a.xml"), URDF_PATH="a.urdf")
    for module in (package, one, types.ModuleType("robot_descriptions.b_description")):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return tmp_path


@pytest.mark.parametrize("name", ["a_mj_description", "robot_descriptions:a_mj_description"])
def test_a_description_is_the_file_that_it_names(name: str, descriptions: Path) -> None:
    assert models.resolve(name) == descriptions / "a.xml"


@pytest.mark.usefixtures("descriptions")
def test_a_description_without_a_file_is_refused() -> None:
    refused((errors.ModelFileError, "b_description", lambda: models.resolve("b_description")))


@pytest.mark.usefixtures("descriptions")
def test_a_description_that_is_not_known_is_refused_with_those_that_are() -> None:
    refused((errors.UnknownNameError, "a_mj_description", lambda: models.resolve("c_description")))


# Two links whose balls are 50 mm apart at the start and 200 mm thick: 150 mm of the one are in the
# other. At home the lower one hangs away.
INSIDE = """<mujoco><worldbody>
  <body name="upper"><joint name="a" axis="0 1 0" damping="1"/><geom size=".1"/></body>
  <body name="lower" pos=".05 0 0"><joint name="b" type="slide" axis="1 0 0" damping="1"/>
    <geom size=".1"/></body></worldbody>
  <actuator><motor joint="a"/><motor joint="b"/></actuator>{rest}</mujoco>"""


BY_150_MM = "lower on upper by 150 mm"


def test_load_warns_of_shapes_inside_each_other_in_the_caller_s_line(model: Any) -> None:
    with pytest.warns(errors.EngineWarning, match=BY_150_MM) as caught:
        robot = model(INSIDE.format(rest=""))
    assert [Path(warning.filename) for warning in caught] == [Path(__file__)]
    raw = mujoco.MjData(robot.raw)
    mujoco.mj_forward(robot.raw, raw)
    assert raw.contact.dist.tolist() == pytest.approx([-0.15])


@overlapping
def test_a_comparison_notes_shapes_inside_each_other_on_each_side(model: Any) -> None:
    run = record_scenario(SCENARIOS["hold"], model(INSIDE.format(rest="")), seconds=0.02)
    assert sum(BY_150_MM in note for note in compare(run, run).notes) == 2


@overlapping
def test_a_survey_lists_robots_with_shapes_inside_each_other(model: Any) -> None:
    file = model(INSIDE.format(rest="")).path
    row = examine(file, ExaminedModel("robot.xml", "", ""), True, 0, lambda *_: None)
    assert row.inside == (BY_150_MM,)
    assert BY_150_MM in words(survey_page(Survey("mujoco", [row, row], [], "")))


# At rest 150 mm of the one are in the other, at home 100 mm; the first keyframe has them apart.
TOLD_OF = INSIDE.format(
    rest='<keyframe><key name="apart" qpos="0 1"/><key name="home" qpos="0 .05"/></keyframe>'
).replace("motor", "position")
HOME_INSIDE = "'home': lower on upper by 100 mm"
AT_REST_INSIDE = "default state: lower on upper by 150 mm"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("compare hold a.xml", HOME_INSIDE),
        ("compare idle.py:idle a.xml", AT_REST_INSIDE),
        ("compare idle.py:idle a.xml --keyframe apart", ""),
        ("compare fall a.xml", ""),  # nothing can touch
        ("trace record hold a.xml", HOME_INSIDE),
        ("trace record idle.py:idle a.xml --keyframe apart", ""),
        ("trace record idle.py:idle a.xml --keyframe home", HOME_INSIDE),
        ("lesson gravity --model a.xml", HOME_INSIDE),
    ],
)
def test_the_state_that_is_told_of_is_the_one_that_a_run_starts_in(
    words: str, told: str, here: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("statemachine.cli.SHOWN_WARNINGS", set())
    written(tmp_path / "a.xml", TOLD_OF)
    written(tmp_path / "idle.py", "def idle(model, data): return None")
    if "compare" in words:
        words += " timestep=.001 a.xml timestep=.002"
    said = here(*words.split(), "--seconds", "0.02").stderr
    assert said.count("inside each other") == bool(told), said
    assert told in said


def test_load_and_robots_name_and_test_the_usual_start(model: Any) -> None:
    with pytest.warns(errors.EngineWarning, match=HOME_INSIDE):
        robot = model(TOLD_OF)
    row = examine(robot.path, ExaminedModel("robot.xml", "", ""), True, 0, lambda *_: None)
    (overlap,) = row.inside
    assert_in(overlap, "lower on upper", "100 mm")


@pytest.mark.parametrize(
    "words",
    [
        "lesson hold --seconds .1 --model",
        "lesson replay --steps 9 --model",
        "trace record hold --seconds .1",
        "compare hold --seconds .1",
    ],
)
def test_a_start_outside_of_joint_limits_is_told(words: str, model: Any, here: Cli) -> None:
    file = model(
        MIXED.format(rest=HOME.replace(".2", f"1.{len(words)}")), "a.xml"
    ).path  # told once
    assert here(*words.split(), file).stderr.count(": rail by 0.") == 1


def test_nothing_is_told_of_shapes_that_touch_or_start_apart(
    model: Any, recwarn: pytest.WarningsRecorder
) -> None:
    robot = model(INSIDE.format(rest='<keyframe><key name="home" qpos="0 .2"/></keyframe>'))
    model(INSIDE.replace('pos=".05', 'pos=".1995').format(rest=""))  # half a millimetre deep
    sm.load(written(robot.path, INSIDE.format(rest="")), contacts=False)
    sm.load(written(robot.path, INSIDE.format(rest="")), contacts=False)
    assert not recwarn.list


# One foot of a robot on the other; the servos push with no force.
FEET = """<mujoco><worldbody><body name="hips" pos="0 0 9"><freejoint name="root"/>
  <geom size=".05"/>
  <body name="left" pos="0 .1 -.3"><joint name="l" axis="1 0 0"/><geom size=".1"/></body>
  <body name="right" pos="0 -.0995 -.3"><joint name="r" axis="1 0 0"/><geom size=".1"/></body>
  </body></worldbody>
  <actuator><position joint="l" kp="1e-9"/><position joint="r" kp="1e-9"/></actuator></mujoco>"""


def test_contacts_of_a_robot_with_itself_are_counted(model: Any) -> None:
    robot = model(FEET)
    found, _, _ = lesson("hold", robot, seconds=1.0)
    data, contacts = mujoco.MjData(robot.raw), 0
    for _ in range(500):
        mujoco.mj_step(robot.raw, data)
        contacts += data.ncon > 0
    assert found.contact_steps == contacts > 0
    assert found.touched == ("right on left",)
