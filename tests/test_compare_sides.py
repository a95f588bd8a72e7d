"""Two sides, freely chosen: files, engines, options; what is run, and what they are called."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine import lab
from statemachine.engines import raw_engine_of
from statemachine.errors import BadInputError, StateMachineError, TraceError, UnknownNameError
from statemachine.lab.compare import (
    Comparison,
    Request,
    Side,
    SidesRun,
    compare,
    labels_of,
    parse_sides,
    run_sides,
    split_words,
)
from statemachine.lab.compare.sides import ReplacedParts
from statemachine.lab.recordings import RunStart, record, write
from statemachine.lab.runs.controllers import function_scenario

from .support.claims import assert_has, refused
from .support.compared import page_of
from .support.explained import with_changes
from .support.files import written, written_all
from .support.processes import Cli, one_line
from .support.requirements import ROOT, need_engine
from .support.small_models import BENT, TWO_LINKS, TWO_SERVOS

_FUNCTION = """
calls = 0

def hold(model, data):
    import numpy as np
    global calls
    calls += 1
    ctrl = np.zeros(model.nu)
    ctrl[model.actuator_id("shoulder")] = 0.4
    return ctrl

def feedback(model, data):
    ctrl = data.ctrl.copy()
    elbow = model.jnt_qposadr[model.joint_id("elbow")]
    ctrl[model.actuator_id("shoulder")] = 0.4 - 0.5 * data.qpos[elbow]
    return ctrl

def counted(model, data):
    global calls
    calls += 1
    return [0.001 * calls, 0]

def helped(model, data):
    from helper_of_two_sides import WANTED
    return WANTED

def fails(model, data):
    return 1 / 0

def short(model, data):
    return [1.0]

def name(model, data):
    model.joint_id("elbw")

def one(model):
    pass

def leaves(model, data):
    return None

def ends(model, data):
    raise SystemExit(3)

def looks(model, data):
    return [0.5 if "keyless" in model.path.name else 0.2, 0]

def by_place(model, data):
    return [0.2, 0.1]
"""


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with an arm in several forms, and the user's functions."""
    keys, servos = BENT.format(qpos=".2 -.3"), "".join(TWO_SERVOS)
    arm = TWO_LINKS.format(mass="0.2", drives=servos, keys=keys)
    turned = "".join(reversed(TWO_SERVOS))
    return written_all(
        tmp_path,
        {
            "arm.xml": arm,
            "heavy.xml": TWO_LINKS.format(mass="0.4", drives=servos, keys=keys),
            "keyless.xml": TWO_LINKS.format(mass="0.2", drives=servos, keys=""),
            "turned.xml": TWO_LINKS.format(mass="0.2", drives=turned, keys=""),
            "renamed.xml": arm.replace("elbow", "Gelenk_2").replace("shoulder", "Gelenk_1"),
            "old/robot/arm.xml": arm,
            "new/robot/arm.xml": arm.replace('damping=".3"', 'damping=".2"'),
            "own.py": _FUNCTION,
            "helper_of_two_sides.py": "WANTED = [0.2, 0.1]\n",
        },
    )


def asked(what: str, left: Side, right: Side, **others: Any) -> Request:
    return Request((what,), sides=(left, right), seconds=others.pop("seconds", 0.4), **others)


def ran(what: str, left: Side, right: Side, **others: Any) -> tuple[SidesRun, Comparison]:
    """Return two sides, run and compared."""
    run = run_sides(asked(what, left, right, **others))
    return run, compare(run.left, run.right)


def largest(found: Any) -> float:
    return max(each.max for each in found.agreements)


# What a side is.


@pytest.mark.parametrize(
    ("typed", "engine", "defaults", "options"),
    [
        ("arm.xml", "mujoco", "model", {}),
        (
            "arm.xml@mujoco timestep=0.001 contacts=off",
            "mujoco",
            "model",
            {"timestep": 0.001, "contacts": False},
        ),
        ("so101@mujoco:engine", "mujoco", "engine", {}),
    ],
)
def test_a_side_is_read_as_it_is_typed(
    typed: str, engine: str, defaults: str, options: dict[str, Any], files: Path
) -> None:
    (side,) = parse_sides([typed.replace("arm.xml", str(files / "arm.xml"))])
    assert_has(side, engine=engine, defaults=defaults)
    assert dict(side.options) == options


def test_an_option_in_a_word_of_its_own_is_of_the_side_before_it() -> None:
    (side,) = parse_sides(["so101@mujoco:engine", "gravity=0,0,-1"])
    assert (side.defaults, dict(side.options)) == ("engine", {"gravity": [0.0, 0.0, -1.0]})


def test_a_side_is_called_as_it_was_typed(files: Path) -> None:
    (side,) = parse_sides([f"{files / 'arm.xml'}@mujoco timestep=0.001 contacts=off"])
    assert side.label == "arm.xml@mujoco timestep=0.001 contacts=off"


@pytest.mark.parametrize(
    ("typed", "name", "value"),
    [
        ("so101 timestep=0.001", "timestep", 0.001),
        ("so101 substeps=2 integrator=euler", "substeps", 2),
    ],
)
def test_a_side_is_loaded_with_its_options(typed: str, name: str, value: float) -> None:
    assert_has(parse_sides([typed])[0].load(), **{name: value})


@pytest.mark.parametrize(
    ("name", "more", "options"),
    [
        ("a b@mujoco timestep=1.xml", "", {}),
        ("my arm.xml", " timestep=0.001", {"timestep": 0.001}),
    ],
)
def test_a_file_whose_name_looks_like_more_is_a_file(
    name: str, more: str, options: dict[str, float], files: Path
) -> None:
    file = str(written(files / name, (files / "arm.xml").read_text()))
    (side,) = parse_sides([file + more])
    assert (side.model, side.engine, dict(side.options)) == (file, "mujoco", options)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["so101@mujco"], "no backend named 'mujco'.*Did you mean 'mujoco'"),
        (["so101@pybullet:engin"], "way to load a file on pybullet.*Did you mean 'engine'"),
        (["so101", "timstep=1"], "no option named 'timstep'.*Did you mean 'timestep'"),
        (["timestep=1", "so101"], "timestep=1 stands before any side"),
        (["so101", "timestep="], "timestep= has no value"),
        (["so101", "timestep=fast"], "timestep=fast is not a value"),
        (["so101 timestep=1", "timestep=2"], "timestep is given twice"),
        (["so101@pybullet:users"], "'users'; known: engine"),
        (["no/such.xml"], "no/such.xml does not exist"),
        (["sO101"], "Did you mean 'so101"),
    ],
)
def test_what_is_no_side_is_said_in_one_line(words: list[str], says: str) -> None:
    refused((StateMachineError, says, lambda: parse_sides(words)))


# The four combinations.


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_identical_sides_differ_by_nothing_at_all(engine: str, files: Path) -> None:
    need_engine(engine)
    side = Side(str(files / "arm.xml"), engine)
    run, found = ran("hold", side, side)
    assert largest(found) == 0
    assert (run.commands, run.played, run.unmatched) == ("the same", run.right, ())
    assert (found.left.short, found.right.short) == (f"{engine} (first)", f"{engine} (second)")


@pytest.mark.parametrize(
    ("left", "right", "told", "least"),
    [
        ("arm.xml", "heavy.xml", ("arm.xml", "heavy.xml"), 0.01),
        ("arm.xml damping=0.3", "arm.xml damping=0.1", ("damping=0.3", "damping=0.1"), 0.01),
        # What only one says is told of the other, too, where that is known.
        ("arm.xml", "arm.xml timestep=0.001", ("timestep=0.002", "timestep=0.001"), 0),
        # The shortest path that tells them apart.
        ("old/robot/arm.xml", "new/robot/arm.xml", ("old/robot/arm.xml", "new/robot/arm.xml"), 0),
    ],
)
def test_two_sides_on_one_engine_are_called_by_what_tells_them_apart(
    files: Path,
    monkeypatch: pytest.MonkeyPatch,
    left: str,
    right: str,
    told: tuple[str, str],
    least: float,
) -> None:
    monkeypatch.chdir(files)
    run, found = ran("hold", *parse_sides([left, right]))
    assert labels_of(run.left.header, run.right.header).short == told
    assert largest(found) > least
    assert run.commands == "the same"  # the left's, told to both


@pytest.mark.usefixtures("bullet")
def test_one_file_on_two_engines_agrees_and_is_called_by_the_engine(files: Path) -> None:
    arm = str(files / "arm.xml")
    _, found = ran("hold", Side(arm), Side(arm, "pybullet"))
    assert (found.agrees, found.left.short, found.right.short) == (True, "mujoco", "pybullet")


@pytest.mark.usefixtures("bullet")
def test_an_engine_as_it_comes_is_another_side(files: Path) -> None:
    arm = str(files / "arm.xml")
    as_it_comes = Side(arm, "pybullet", "engine")
    run, found = ran("hold", Side(arm, options={"timestep": 1 / 240}), as_it_comes)
    assert not found.agrees
    assert run.right.header.label.endswith("engine defaults")


def test_an_mjcf_against_its_own_urdf() -> None:
    urdf = str(ROOT / "models" / "so101" / "so101.urdf")
    run, found = ran("fall", Side("so101"), Side(urdf))
    names = {each.name for each in found.agreements}
    assert {"shoulder_pan", "elbow_flex", "gripper", "energy"} <= names
    (line,) = run.unmatched
    assert line.startswith("only so101.xml has actuators shoulder_pan, ")


# Joints and commands by name, by structure, by a map.


@pytest.mark.parametrize("names", [("arm.xml", "turned.xml"), ("turned.xml", "arm.xml")])
def test_permuted_joints_and_actuators_are_the_same_robot(
    names: tuple[str, str], files: Path
) -> None:
    left, right = (Side(str(files / name)) for name in names)
    run, found = ran("waves", left, right)
    assert largest(found) < 1e-12
    assert run.unmatched == ()
    assert not [note for note in found.notes if "actuators" in note or "commands" in note]


def test_commands_of_the_right_are_in_the_order_of_the_left(files: Path) -> None:
    run, _ = ran("waves", Side(str(files / "arm.xml")), Side(str(files / "turned.xml")))
    assert run.right.header.actuators == ("shoulder", "elbow")


@pytest.mark.parametrize("names", [{}, {"shoulder": "Gelenk_1", "elbow": "Gelenk_2"}])
def test_renamed_joints_are_matched_by_place_which_is_said_or_by_a_map(
    names: dict[str, str], files: Path
) -> None:
    sides = Side(str(files / "arm.xml")), Side(str(files / "renamed.xml"))
    run, found = ran("hold", *sides, names=names)
    assert largest(found) == 0
    assert {"shoulder", "elbow"} <= {each.name for each in found.agreements}
    assert bool(run.unmatched) == (not names)


def test_a_map_to_a_name_that_is_not_there_is_refused(files: Path) -> None:
    sides = Side(str(files / "arm.xml")), Side(str(files / "renamed.xml"))
    request = asked("hold", *sides, names={"elbow": "Gelenk_3"})
    refused((UnknownNameError, "Gelenk_3", lambda: run_sides(request)))


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize("mapped", [(), ("--map", "gripperframe=tcp")])
def test_a_tool_frame_that_the_right_calls_otherwise(
    mapped: tuple[str, ...], files: Path, here: Cli
) -> None:
    """It is found by its place, which is said where no map says it."""
    renamed = files / "renamed.xml"
    written(renamed, renamed.read_text().replace("gripperframe", "tcp"))
    words = ("compare", "hold", "arm.xml", "renamed.xml@pybullet", "--seconds", "0.2", "--json")
    found = json.loads(here(*words, "--no-chaos", *mapped).stdout)
    tip = {each["name"]: each["max"] for each in found["comparison"]["agreements"]}
    assert tip["gripperframe, position"] < 1e-9
    assert found["only"][1] == {"joint": [], "actuator": [], "site": []}
    guesses = " ".join(found["unmatched"])
    assert ("'tcp'" in guesses) == (not mapped)
    assert "'Gelenk_2'" in guesses


@pytest.fixture
def with_ball(files: Path) -> tuple[SidesRun, Comparison]:
    """The arm against one beside which a ball falls."""
    ball = '<body name="ball" pos="1 0 1"><freejoint name="ball"/><geom size=".1"/></body>'
    changes = [
        ("</worldbody>", f"{ball}</worldbody>"),
        ('qpos=".2 -.3"', 'qpos=".2 -.3 1 0 1 1 0 0 0"'),
    ]
    more = written(files / "more.xml", with_changes((files / "arm.xml").read_text(), changes))
    return ran("hold", Side(str(files / "arm.xml")), Side(str(more)))


def test_a_joint_that_one_side_has_alone_is_named(
    with_ball: tuple[SidesRun, Comparison],
) -> None:
    matched = with_ball[0].matched
    assert matched is not None
    assert matched.only[1]["joint"] == ("ball",)
    assert "joint ball" in with_ball[0].unmatched[0]


def test_a_contact_of_a_body_that_one_side_lacks_is_no_difference() -> None:
    _, found = ran("hold", Side("so101/scene"), Side("so101/scene_box"))
    assert [touch.pair for touch in found.touches] == ["gripper on floor", "box on floor"]
    assert not [each.name for each in found.agreements if "box" in each.name]
    assert found.outcome == "agrees"


def test_what_both_sides_have_is_compared_and_no_energy_with_that_of_one(
    with_ball: tuple[SidesRun, Comparison],
) -> None:
    gaps = {each.name: each.max for each in with_ball[1].agreements}
    assert {"shoulder", "elbow", "gripperframe, position"} <= set(gaps)
    assert "energy" not in gaps  # that of the ball is in it
    assert set(gaps.values()) == {0.0}


def test_sides_without_a_joint_in_common_are_refused_with_the_map_to_type(files: Path) -> None:
    ball = written(
        files / "ball.xml",
        '<mujoco><worldbody><body name="b" pos="0 0 1"><freejoint/><geom size=".1"/></body>'
        "</worldbody></mujoco>",
    )
    request = asked("gravity", Side(str(files / "arm.xml")), Side(str(ball)))
    refused((TraceError, r"no joint in common.*--map LEFT=RIGHT", lambda: run_sides(request)))


def test_timesteps_that_never_meet_are_refused_with_the_option_to_type(files: Path) -> None:
    arm = str(files / "arm.xml")
    other = Side(arm, options={"timestep": 1 / 240})
    request = asked("hold", Side(arm), other, seconds=0.1)
    refused((TraceError, r"timestep=0\.002 behind the right", lambda: run_sides(request)))


# What is run.


def test_a_function_sees_its_own_side(files: Path) -> None:
    what = f"{files / 'own.py'}:hold"
    run, found = ran(what, Side(str(files / "arm.xml")), Side(str(files / "turned.xml")))
    assert run.left.ctrl[0].tolist() == [0.4, 0.0]
    assert largest(found) < 1e-12
    assert (run.left.header.experiment, run.commands) == ("own.py:hold", "the same")


def test_a_function_is_asked_every_so_many_steps_and_starts_anew_on_each_side(files: Path) -> None:
    what, arm = f"{files / 'own.py'}:counted", Side(str(files / "arm.xml"))
    run = run_sides(asked(what, arm, arm, seconds=0.04, every=5))
    assert run.left.ctrl[:, 0] == pytest.approx(0.001 * (1 + np.arange(21) // 5))
    assert np.array_equal(run.left.ctrl, run.right.ctrl)


# The limits of these arms are of no concern here, and the start is told them.
@pytest.mark.filterwarnings(
    "ignore:the run starts outside of joint limits:statemachine.errors.EngineWarning"
)
def test_the_right_without_the_keyframe_starts_where_the_left_does(files: Path) -> None:
    sides = Side(str(files / "arm.xml")), Side(str(files / "keyless.xml"))
    run = run_sides(asked(f"{files / 'own.py'}:leaves", *sides, keyframe="bent"))
    assert run.left.qpos[0].tolist() == run.right.qpos[0].tolist() == [0.2, -0.3]
    assert run.right.ctrl[0].tolist() == [0.3, -0.4]
    assert largest(compare(run.left, run.right)) == 0
    assert any("'bent'" in line for line in run.notes)


def test_a_keyframe_that_no_side_has_is_refused(files: Path) -> None:
    sides = Side(str(files / "arm.xml")), Side(str(files / "keyless.xml"))
    request = asked(f"{files / 'own.py'}:leaves", *sides, keyframe="home")
    refused((UnknownNameError, "'home'", lambda: run_sides(request)))


def test_a_function_imports_what_lies_beside_it(files: Path) -> None:
    arm = Side(str(files / "arm.xml"))
    run = run_sides(asked(f"{files / 'own.py'}:helped", arm, arm, seconds=0.01))
    assert run.left.ctrl[0].tolist() == [0.2, 0.1]


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("fails", r"own.py, line \d+, at 0.000 s: ZeroDivisionError"),
        ("short", "own.py, at 0.000 s: BadInputError: ctrl takes 2 numbers"),
        ("name", r"own.py, line \d+, at 0.000 s: UnknownNameError.*'elbow'"),
        ("one", r"one of own.py takes \(model\), .*\(model, data\): write def one"),
        ("zzz", r"no function zzz\(model, data\); it has .*hold"),
        ("hodl", r"no function hodl\(model, data\).*hold\?"),
        ("ends", "own.py, line .*ends the program"),
    ],
)
def test_a_mistake_in_a_function_is_one_line_about_it(files: Path, name: str, says: str) -> None:
    arm = Side(str(files / "arm.xml"))
    request = asked(f"{files / 'own.py'}:{name}", arm, arm)
    refused((BadInputError, says, lambda: run_sides(request)))


def test_a_file_of_functions_that_is_mistyped_is_refused_with_the_one_beside_it(
    files: Path,
) -> None:
    scenario = partial(function_scenario, str(files / "owm.py:hold"))
    refused((BadInputError, "own.py", scenario))


# Closed loop and open loop.


@pytest.fixture
def feedback(files: Path) -> SidesRun:
    """A function that reads the elbow, on two arms of other weights."""
    sides = Side(str(files / "arm.xml")), Side(str(files / "heavy.xml"))
    return run_sides(asked(f"{files / 'own.py'}:feedback", *sides))


def test_each_side_is_told_its_own_commands_in_closed_loop(feedback: SidesRun) -> None:
    assert feedback.commands == "its own"
    assert not np.array_equal(feedback.right.ctrl, feedback.left.ctrl)
    notes = compare(feedback.left, feedback.right).notes
    assert any("commands differ" in note for note in notes)


def test_the_left_s_commands_are_played_on_the_right_in_open_loop(feedback: SidesRun) -> None:
    assert np.array_equal(feedback.played.ctrl, feedback.left.ctrl)
    notes = compare(feedback.left, feedback.played).notes
    assert not any("commands differ" in note for note in notes)


def test_feedback_and_the_machine_are_told_apart(feedback: SidesRun) -> None:
    closed = largest(compare(feedback.left, feedback.right))
    opened = largest(compare(feedback.left, feedback.played))
    assert opened > 0.01
    assert opened != closed


def test_feedback_that_makes_the_difference_and_a_machine_that_is_the_same(files: Path) -> None:
    """The function looks at who it drives: in open loop nothing differs."""
    sides = Side(str(files / "arm.xml")), Side(str(files / "keyless.xml"))
    run = run_sides(asked(f"{files / 'own.py'}:looks", *sides))
    closed, opened = compare(run.left, run.right), compare(run.left, run.played)
    assert not closed.agrees
    assert largest(opened) == 0
    assert not page_of(closed, run=run, played=opened).holds


def test_the_commands_of_the_left_are_played_by_name(files: Path) -> None:
    sides = Side(str(files / "arm.xml")), Side(str(files / "turned.xml"))
    # By place: another robot is told another.
    run = run_sides(asked(f"{files / 'own.py'}:by_place", *sides))
    assert run.commands == "its own"
    assert largest(compare(run.left, run.played)) < 1e-12
    assert largest(compare(run.left, run.right)) > 0.01


# The limits of these arms are of no concern here, and the start is told them.
@pytest.fixture
def recorded(files: Path) -> Path:
    """A recorded run of the arm that starts somewhere and is told one pose."""
    model = sm.load(files / "arm.xml")
    start = RunStart(qpos=[0.1, 0.2])
    return write(record(model, lambda _m, _d: [0.3, -0.2], 0.2, start=start), files / "run.npz")


# The limits of these arms are of no concern here, and the start is told them.
any_start = pytest.mark.filterwarnings(
    "ignore:the run starts outside of joint limits:statemachine.errors.EngineWarning"
)


@any_start
def test_a_recorded_run_is_played_on_both_by_name(files: Path, recorded: Path) -> None:
    sides = Side(str(files / "turned.xml")), Side(str(files / "heavy.xml"))
    run = run_sides(Request((str(recorded),), sides=sides))
    assert run.commands == "recorded"
    for trace in (run.left, run.right):
        assert trace.qpos[0, trace.header.joints.index("shoulder")] == 0.1
        told = dict(zip(trace.header.actuators, trace.ctrl[0], strict=True))
        assert told == {"shoulder": 0.3, "elbow": -0.2}


@any_start
@pytest.mark.usefixtures("recorded")
def test_a_recorded_run_is_played_by_name_where_causes_are_looked_for(here: Cli) -> None:
    """The two files are one robot."""
    words = ("compare", "run.npz", "turned.xml", "arm.xml", "--why", "--json")
    assert json.loads(here(*words).stdout)["gap"] == 0


@any_start
def test_a_recorded_run_on_one_robot_twice_is_the_same(files: Path, recorded: Path) -> None:
    sides = (Side(str(files / "arm.xml")),) * 2
    same = run_sides(Request((str(recorded),), sides=sides))
    assert largest(compare(same.left, same.right)) == 0


@any_start
def test_seconds_of_a_recorded_run_are_refused(files: Path, recorded: Path) -> None:
    sides = (Side(str(files / "arm.xml")),) * 2
    request = partial(Request, (str(recorded),), sides=sides, seconds=1.0)
    refused((BadInputError, "seconds", lambda: run_sides(request())))


# The words.


@pytest.mark.parametrize(
    ("words", "what", "options"),
    [
        ("hold", ("hold",), []),
        ("a.npz b.npz", ("a.npz", "b.npz"), []),
        ("a.npz so101 timestep=0.001 so101@mujoco:engine", ("a.npz",), [{"timestep": 0.001}, {}]),
        ("x.py:f so101 so101", ("x.py:f",), [{}, {}]),
        ("x.py:f so101 timestep=0.001", ("x.py:f",), [{"timestep": 0.001}]),
        ("a.npz b.npz so101", ("a.npz", "b.npz"), [{}]),
    ],
)
def test_words_are_sorted_into_what_and_sides(
    words: str, what: tuple[str, ...], options: list[dict[str, float]]
) -> None:
    found, sides = split_words(words.split())
    assert (found, [dict(side.options) for side in sides]) == (what, options)


def test_the_command_shows_both_loops(files: Path, here: Cli) -> None:
    words = ("own.py:feedback", "--every", "2", "arm.xml", "heavy.xml", "--seconds", "0.4")
    result = json.loads(here("compare", *words, "--json").stdout)
    assert [side["model"] for side in result["sides"]] == ["arm.xml", "heavy.xml"]
    assert result["commands"] == "its own"
    assert result["open_loop"]["agreements"] != result["comparison"]["agreements"]
    assert result["comparison"]["left"]["short"] == "arm.xml"


# A robot as a URDF of it is: no floor and no motors; and a damping that somebody changed.
_WITH = """<mujoco><worldbody><geom name="ground" type="plane" size="2 2 .1" friction=".7"/>
<body name="upper" pos="0 0 .3"><joint name="swing" axis="0 1 0" damping="{damping}"/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".03" mass=".5"/><site name="end" pos=".4 0 0"/>
</body></worldbody><actuator><position name="drive" joint="swing" kp="20" kv="1" delay="0.004"
nsample="3" forcerange="-4 3" ctrlrange="-2 2"/><general name="thrust" site="end" gainprm="3"
gear="0 0 1 0 0 0"/></actuator><keyframe><key name="up" qpos=".2" ctrl=".3 .1"/></keyframe>
</mujoco>"""
_ACTUATORS = re.compile("<actuator>.*</actuator>", re.DOTALL)


def _bare(damping: float) -> str:
    text = _ACTUATORS.sub("", _WITH.format(damping=damping)).replace(' ctrl=".3 .1"', "")
    return re.sub("<geom name=.ground.*/>\n<body", "<body", text)


@pytest.fixture
def whole_and_bare(tmp_path: Path) -> tuple[Side, Side]:
    """A robot with motors and a floor, and without."""
    whole = Side(str(written(tmp_path / "whole.xml", _WITH.format(damping=0.3))))
    return whole, Side(str(written(tmp_path / "bare.xml", _bare(0.3))))


def test_a_file_without_motors_and_floor_gets_those_of_the_other(
    whole_and_bare: tuple[Side, Side],
) -> None:
    """All arrays of the compiled model are those of the whole one."""
    whole, bare = whole_and_bare
    got = bare.taking(("actuators", "floor"), whole, {}).load()
    assert (got.nu, got.timestep) == (2, 0.002)
    own = whole.load().raw
    arrays = [n for n in dir(own) if n[0] != "_" and isinstance(getattr(own, n), np.ndarray)]
    other = [
        name
        for name in arrays
        if "name" not in name
        and not np.array_equal(getattr(own, name), getattr(got.raw, name), equal_nan=True)
    ]
    assert other == []


def test_a_file_with_motors_and_floor_loses_them_where_the_other_has_none(
    whole_and_bare: tuple[Side, Side],
) -> None:
    whole, bare = whole_and_bare
    lacking = whole.taking(("actuators", "floor"), bare, {}).load()
    assert (lacking.nu, lacking.ngeom) == (0, 1)


@pytest.fixture
def lacking(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, ...]:
    """The words that compare a robot with motors and a floor to one without, and less damped."""
    monkeypatch.chdir(tmp_path)
    written_all(tmp_path, {"whole.xml": _WITH.format(damping=0.3), "bare.xml": _bare(0.5)})
    return ("compare", "hold", "whole.xml", "bare.xml", "--seconds", "0.5")


GIVEN = ("--actuators", "left", "--floor", "left", "--json", "--no-chaos")


def test_what_a_side_has_nothing_of_is_said_with_the_switch_that_gives_it(
    lacking: tuple[str, ...], here: Cli
) -> None:
    lines = [line for line in here(*lacking, "--why").stdout.splitlines() if "gives" in line]
    assert ["--actuators left" in line for line in lines] == [True, False]
    assert ["--floor left" in line for line in lines] == [False, True]


def test_the_command_to_type_next_has_both_switches(lacking: tuple[str, ...], here: Cli) -> None:
    lines = here(*lacking, "--no-chaos").stdout.splitlines()
    typed = " ".join(line.strip(" \\") for line in lines if line.startswith("    "))
    assert typed == f"statemachine {' '.join(lacking)} --actuators left --floor left"


def test_the_switches_leave_the_other_cause(lacking: tuple[str, ...], here: Cli) -> None:
    found = json.loads(here(*lacking, "--why", *GIVEN).stdout)
    assert_has(found, missing=[], explained=pytest.approx(1.0))
    assert [row["name"] for row in found["shares"]] == ["damping of swing"]


def test_a_side_that_was_given_actuators_is_told_the_same(
    lacking: tuple[str, ...], here: Cli
) -> None:
    assert json.loads(here(*lacking, *GIVEN).stdout)["commands"] == "the same"


def test_an_actuator_whose_site_is_not_there_is_one_line(
    tmp_path: Path, here: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    siteless = re.sub("<site.*?/>", "", _bare(0.3))
    written_all(tmp_path, {"whole.xml": _WITH.format(damping=0.3), "nosite.xml": siteless})
    one_line(here("compare", "hold", "whole.xml", "nosite.xml", "--actuators", "left"), "'end'")


def test_a_binary_model_is_given_nothing(
    tmp_path: Path, here: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    written_all(tmp_path, {"whole.xml": _WITH.format(damping=0.3)})
    whole: Any = sm.load("whole.xml")
    whole.save_binary(tmp_path / "b.mjb")
    words = ("compare", "hold", "whole.xml", "b.mjb", "--trust-binary", "--floor", "left")
    trusted, refusal = here(*words, code=2).stderr.splitlines()
    assert "is trusted" in trusted
    assert "b.mjb is binary" in refusal


@pytest.fixture
def with_the_other_actuators() -> sm.Model:
    """The arm of a URDF, on PyBullet as it comes, with the actuators of the MJCF."""
    need_engine("pybullet")
    arm = ReplacedParts(("actuators",), Side("so101"))
    return arm.apply_to(
        sm.load(ROOT / "models/so101/so101.urdf", backend="pybullet", defaults="engine")
    )


def test_an_engine_as_it_comes_keeps_its_world_with_parts_of_another_file(
    with_the_other_actuators: sm.Model,
) -> None:
    assert with_the_other_actuators.nu == 6
    assert with_the_other_actuators.timestep == pytest.approx(1 / 240)
    assert np.array_equal(with_the_other_actuators.gravity, np.zeros(3))


def test_what_is_emulated_of_a_file_has_the_parts_that_were_given(
    with_the_other_actuators: sm.Model,
) -> None:
    dials = raw_engine_of("pybullet").dials(with_the_other_actuators, {})
    assert dials is not None
    of_file = sm.load(ROOT / "models/so101/so101.urdf", backend="pybullet")
    assert dials.emulated.nu == 6
    assert dials.emulated.timestep == of_file.timestep
    assert np.array_equal(dials.emulated.gravity, of_file.gravity)
    assert np.array_equal(dials.emulated.body_mass, of_file.body_mass)


def test_two_files_of_one_name_are_told_apart_by_their_folders(tmp_path: Path) -> None:
    ball = "<mujoco><worldbody><body><joint/><geom size='.1'/></body></worldbody></mujoco>"
    names = "one/robot/arm.xml", "two/robot/arm.xml"
    written_all(tmp_path, dict.fromkeys(names, ball))
    files = [tmp_path / name for name in names]
    found = lab.compare(*files, what="fall", seconds=0.02, chaos=False).comparison
    assert (found.left.short, found.right.short) == names
