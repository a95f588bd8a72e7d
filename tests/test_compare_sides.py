"""Two sides, freely chosen: files, engines, options; what is run, and what they are called."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
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
    """Two sides, run and compared."""
    run = run_sides(asked(what, left, right, **others))
    return run, compare(run.left, run.right)


def largest(found: Any) -> float:
    return max(each.max for each in found.agreements)


# What a side is.


def test_a_side_is_read_as_it_is_typed(files: Path) -> None:
    arm = str(files / "arm.xml")
    sides = parse_sides(
        [arm, f"{arm}@mujoco timestep=0.001 contacts=off", "so101@mujoco:engine", "gravity=0,0,-1"]
    )
    assert [(side.engine, side.defaults, dict(side.options)) for side in sides] == [
        ("mujoco", "model", {}),
        ("mujoco", "model", {"timestep": 0.001, "contacts": False}),
        ("mujoco", "engine", {"gravity": [0.0, 0.0, -1.0]}),
    ]
    assert sides[1].label == "arm.xml@mujoco timestep=0.001 contacts=off"
    assert sides[1].load().timestep == 0.001
    assert parse_sides(["so101 substeps=2 integrator=euler"])[0].load().substeps == 2


def test_a_file_whose_name_looks_like_more_is_a_file(files: Path) -> None:
    for name, more, options in (
        ("a b@mujoco timestep=1.xml", "", {}),
        ("my arm.xml", " timestep=0.001", {"timestep": 0.001}),
    ):
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


def test_identical_sides_differ_by_nothing_at_all(files: Path) -> None:
    for engine in ("mujoco", "pybullet"):
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
def test_one_file_on_two_engines(files: Path) -> None:
    arm = str(files / "arm.xml")
    _, found = ran("hold", Side(arm), Side(arm, "pybullet"))
    assert (found.agrees, found.left.short, found.right.short) == (True, "mujoco", "pybullet")
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


def test_permuted_joints_and_actuators_are_the_same_robot(files: Path) -> None:
    arm, turned = Side(str(files / "arm.xml")), Side(str(files / "turned.xml"))
    run, found = ran("waves", arm, turned)
    assert run.right.header.actuators == ("shoulder", "elbow")
    assert largest(found) < 1e-12
    assert not [note for note in found.notes if "actuators" in note or "commands" in note]
    assert largest(ran("waves", turned, arm)[1]) < 1e-12


def test_renamed_joints_are_matched_by_place_and_by_a_map(files: Path) -> None:
    sides = Side(str(files / "arm.xml")), Side(str(files / "renamed.xml"))
    for given in ({}, {"shoulder": "Gelenk_1", "elbow": "Gelenk_2"}):
        run, found = ran("hold", *sides, names=given)
        assert largest(found) == 0
        assert {"shoulder", "elbow"} <= {each.name for each in found.agreements}
        assert bool(run.unmatched) == (not given)  # a guess is said
    # A map that says otherwise is followed: the elbow is then held against the shoulder.
    refused(
        (
            UnknownNameError,
            "Gelenk_3",
            lambda: run_sides(asked("hold", *sides, names={"elbow": "Gelenk_3"})),
        )
    )


@pytest.mark.usefixtures("bullet")
def test_a_tool_frame_that_the_right_calls_otherwise(files: Path, here: Cli) -> None:
    renamed = files / "renamed.xml"
    written(renamed, renamed.read_text().replace("gripperframe", "tcp"))
    words = ("compare", "hold", "arm.xml", "renamed.xml@pybullet", "--seconds", "0.2", "--json")
    for more in ((), ("--map", "gripperframe=tcp")):
        found = json.loads(here(*words, "--no-chaos", *more).stdout)
        tip = {each["name"]: each["max"] for each in found["comparison"]["agreements"]}
        assert tip["gripperframe, position"] < 1e-9
        assert found["only"][1] == {"joint": [], "actuator": [], "site": []}  # found by its place
        said = " ".join(found["unmatched"])
        assert ("site 'gripperframe' on the left is taken for 'tcp'" in said) == (not more)
        assert "actuator 'elbow' on the left is taken for 'Gelenk_2' on the right" in said


def test_what_cannot_be_matched_is_said(files: Path) -> None:
    ball = '<body name="ball" pos="1 0 1"><freejoint name="ball"/><geom size=".1"/></body>'
    changes = [
        ("</worldbody>", f"{ball}</worldbody>"),
        ('qpos=".2 -.3"', 'qpos=".2 -.3 1 0 1 1 0 0 0"'),
    ]
    more = written(files / "more.xml", with_changes((files / "arm.xml").read_text(), changes))
    run, found = ran("hold", Side(str(files / "arm.xml")), Side(str(more)))
    assert run.unmatched[0] == "only more.xml has joint ball: not compared"
    gaps = {each.name: each.max for each in found.agreements}
    assert {"shoulder", "elbow", "gripperframe, position"} <= set(gaps)
    assert "energy" not in gaps  # that of the ball is in it
    assert set(gaps.values()) == {0.0}


def test_sides_that_do_not_fit_are_refused_before_anything_runs(files: Path) -> None:
    ball = written(
        files / "ball.xml",
        '<mujoco><worldbody><body name="b" pos="0 0 1"><freejoint/><geom size=".1"/></body>'
        "</worldbody></mujoco>",
    )
    arm = str(files / "arm.xml")
    other = Side(arm, options={"timestep": 1 / 240})
    refused(
        (TraceError, r"no joint in common.*--map LEFT=RIGHT",
         lambda: run_sides(asked("gravity", Side(arm), Side(str(ball))))),
        (TraceError, r"timestep=0\.002 behind the right",
         lambda: run_sides(asked("hold", Side(arm), other, seconds=0.1))),
    )  # fmt: skip


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
def test_a_function_starts_at_a_keyframe_and_the_right_without_it_where_the_left_does(
    files: Path,
) -> None:
    what = f"{files / 'own.py'}:leaves"
    sides = Side(str(files / "arm.xml")), Side(str(files / "keyless.xml"))
    run = run_sides(asked(what, *sides, keyframe="bent"))
    assert run.left.qpos[0].tolist() == run.right.qpos[0].tolist() == [0.2, -0.3]
    assert run.right.ctrl[0].tolist() == [0.3, -0.4]
    assert largest(compare(run.left, run.right)) == 0
    assert any("no keyframe 'bent'" in line for line in run.said)
    refused(
        (
            UnknownNameError,
            "no keyframe named 'home'",
            lambda: run_sides(asked(what, *sides, keyframe="home")),
        )
    )


def test_a_function_imports_what_lies_beside_it(files: Path) -> None:
    arm = Side(str(files / "arm.xml"))
    run = run_sides(asked(f"{files / 'own.py'}:helped", arm, arm, seconds=0.01))
    assert run.left.ctrl[0].tolist() == [0.2, 0.1]


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("fails", r"own.py, line \d+, at 0.000 s: ZeroDivisionError: division by zero"),
        ("short", "own.py, at 0.000 s: BadInputError: ctrl takes 2 numbers"),
        ("name", r"own.py, line \d+, at 0.000 s: UnknownNameError.*Did you mean 'elbow'"),
        ("one", r"one of own.py takes \(model\), .* is called with \(model, data\): write def one"),
        ("zzz", r"no function zzz\(model, data\); it has .*hold"),
        ("hodl", r"no function hodl\(model, data\). Did you mean hold\?"),
        ("ends", "own.py, line .*ends the program"),
    ],
)
def test_a_mistake_in_a_function_is_one_line_about_it(files: Path, name: str, says: str) -> None:
    arm = Side(str(files / "arm.xml"))
    refused(
        (BadInputError, says, lambda: run_sides(asked(f"{files / 'own.py'}:{name}", arm, arm))),
        (
            BadInputError,
            r"no controller file.*Did you mean own.py",
            lambda: function_scenario(str(files / "owm.py:hold")),
        ),
    )


# Closed loop and open loop.


def test_feedback_and_the_machine_are_told_apart(files: Path) -> None:
    sides = Side(str(files / "arm.xml")), Side(str(files / "heavy.xml"))
    run = run_sides(asked(f"{files / 'own.py'}:feedback", *sides))
    assert run.commands == "its own"
    assert np.array_equal(run.played.ctrl, run.left.ctrl)
    assert not np.array_equal(run.right.ctrl, run.left.ctrl)
    closed, opened = compare(run.left, run.right), compare(run.left, run.played)
    assert largest(opened) > 0.01
    assert largest(opened) != largest(closed)
    assert any("commands differ" in note for note in closed.notes)
    assert not any("commands differ" in note for note in opened.notes)


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
@pytest.mark.filterwarnings(
    "ignore:the run starts outside of joint limits:statemachine.errors.EngineWarning"
)
def test_a_recorded_run_is_played_on_both(files: Path, here: Cli) -> None:
    model = sm.load(files / "arm.xml")
    run = record(model, lambda model, data: [0.3, -0.2], 0.2, start=RunStart(qpos=[0.1, 0.2]))
    path = write(run, files / "run.npz")
    sides = Side(str(files / "turned.xml")), Side(str(files / "heavy.xml"))
    run = run_sides(Request((str(path),), sides=sides))
    assert run.commands == "recorded"
    for trace in (run.left, run.right):
        assert trace.qpos[0, trace.header.joints.index("shoulder")] == 0.1
        told = dict(zip(trace.header.actuators, trace.ctrl[0], strict=True))
        assert told == {"shoulder": 0.3, "elbow": -0.2}
    # So it is where the sides run again: the two files are one robot.
    words = ("compare", "run.npz", "turned.xml", "arm.xml", "--why", "--json")
    assert json.loads(here(*words).stdout)["gap"] == 0
    same = run_sides(Request((str(path),), sides=(Side(str(files / "arm.xml")),) * 2))
    assert largest(compare(same.left, same.right)) == 0
    refused(
        (
            BadInputError,
            "seconds is of a run",
            lambda: run_sides(Request((str(path),), sides=sides, seconds=1.0)),
        )
    )


# The words.


def test_words_are_sorted_into_what_and_sides() -> None:
    for words, what, options in (
        ("hold", ("hold",), []),
        ("a.npz b.npz", ("a.npz", "b.npz"), []),
        ("a.npz so101 timestep=0.001 so101@mujoco:engine", ("a.npz",), [{"timestep": 0.001}, {}]),
        ("x.py:f so101 so101", ("x.py:f",), [{}, {}]),
        ("x.py:f so101 timestep=0.001", ("x.py:f",), [{"timestep": 0.001}]),
        ("a.npz b.npz so101", ("a.npz", "b.npz"), [{}]),
    ):
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


def test_a_file_without_motors_and_floor_gets_those_of_the_other(tmp_path: Path) -> None:
    whole = Side(str(written(tmp_path / "whole.xml", _WITH.format(damping=0.3))))
    bare = Side(str(written(tmp_path / "bare.xml", _bare(0.3))))
    got = bare.taking(("actuators", "floor"), whole, {}).load()
    assert (got.nu, got.timestep) == (2, 0.002)
    own = whole.load().raw
    for name in dir(own):
        value = getattr(own, name) if not name.startswith("_") else None
        if isinstance(value, np.ndarray) and "name" not in name:
            assert np.array_equal(value, getattr(got.raw, name), equal_nan=True), name
    lacking = whole.taking(("actuators", "floor"), bare, {}).load()
    assert (lacking.nu, lacking.ngeom) == (0, 1)


def test_what_a_side_has_nothing_of_is_said_first_and_its_switch_shows_the_rest(
    tmp_path: Path, here: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    written_all(tmp_path, {"whole.xml": _WITH.format(damping=0.3), "bare.xml": _bare(0.5)})
    words = ("compare", "hold", "whole.xml", "bare.xml", "--seconds", "0.5")
    lines = [line for line in here(*words, "--why").stdout.splitlines() if "gives" in line]
    assert ["--actuators left" in line for line in lines] == [True, False]
    assert ["--floor left" in line for line in lines] == [False, True]
    lines = here(*words, "--no-chaos").stdout.splitlines()
    typed = " ".join(line.strip(" \\") for line in lines if line.startswith("    "))
    assert typed == f"statemachine {' '.join(words)} --actuators left --floor left"
    both = ("--actuators", "left", "--floor", "left", "--json", "--no-chaos")
    found = json.loads(here(*words, "--why", *both).stdout)
    assert_has(found, missing=[], explained=pytest.approx(1.0))
    assert [row["name"] for row in found["shares"]] == ["damping of swing"]
    assert json.loads(here(*words, *both).stdout)["commands"] == "the same"


def test_parts_that_cannot_be_given_are_one_clear_line(
    tmp_path: Path, here: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    siteless = re.sub("<site.*?/>", "", _bare(0.3))
    written_all(tmp_path, {"whole.xml": _WITH.format(damping=0.3), "nosite.xml": siteless})
    whole: Any = sm.load("whole.xml")
    whole.save_binary(tmp_path / "b.mjb")
    one_line(here("compare", "hold", "whole.xml", "nosite.xml", "--actuators", "left"), "'end'")
    binary = here("compare", "hold", "whole.xml", "b.mjb", "--trust-binary", "--floor", "left")
    trusted, refused = binary.stderr.splitlines()
    assert "is trusted" in trusted
    assert "b.mjb is binary" in refused
    assert binary.returncode == 2
