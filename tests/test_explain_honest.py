"""An explanation that would be false: each was printed once, with a green verdict."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.cli import main
from statemachine.lab.recordings import RunMetadata, RunStart, read, record, write

from .support.claims import assert_has
from .support.files import written, written_all
from .support.processes import Cli

ARM = """
<mujoco model="arm"><option integrator="implicitfast"/><worldbody>
<body name="a" pos="0 0 1"><joint name="j1" axis="0 1 0" damping="{damping}"/>
<geom name="ga" type="capsule" size=".02" fromto="0 0 0 0 0 -.2" mass=".4" {touches}/>
{load}</body>{more}</worldbody>
<actuator>{actuator}</actuator>
{sensor}
<keyframe><key name="k" qpos="{qpos}" {key}/></keyframe></mujoco>
"""
USUAL = {
    "damping": ".02",
    "touches": "",
    "load": "",
    "more": "",
    "actuator": '<motor name="m" joint="j1"/>',
    "sensor": "",
    "qpos": ".8",
    "key": "",
}
FUNCTIONS = """
import numpy as np

def none(model, data):
    return None

def wave(model, data):
    return [np.sin(6 * data.time)]

def sensed(model, data):
    return [0.3 - 0.2 * data.raw.sensordata[0]]

def pushed(model, data):
    data.raw.xfrc_applied[1, 0] = np.sin(6 * data.time) / (1 + 10 * data.qpos[0] ** 2)
    return [0.0]
"""
LOAD = """
<body name="load" pos="0 0 -.25"><joint name="swing" axis="0 1 0"/>
<geom name="gl" size=".03" pos="0 0 -.1" mass=".4"/></body>
"""
MUSCLE = (
    '<general name="m" joint="j1" biastype="muscle" biasprm=".75 1.05 100 200 .5 1.6 1.5 1.3 1.2" '
    'lengthrange="{} .5"/>'
)
SLIDING = """
<geom name="slope" type="plane" size="3 3 .1" pos="0 1 0" euler="0 20 0" friction=".01"/>
<body name="box" pos="0 1 .06" euler="0 20 0"><freejoint/>
<geom name="gb" type="box" size=".05 .05 .05" friction="{}"/></body>
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(written_all(tmp_path, {"f.py": FUNCTIONS}))
    return tmp_path


def file(folder: Path, name: str, **changed: str) -> str:
    (folder / name).write_text(ARM.format(**{**USUAL, **changed}), encoding="utf-8")
    return name


def asked(capsys: Any, *words: str) -> tuple[int, dict[str, Any]]:
    return main(["compare", *words, "--keyframe", "k", "--json"]), json.loads(
        capsys.readouterr().out
    )


@pytest.mark.usefixtures("bullet")
@pytest.mark.slow
@pytest.mark.parametrize("sides", [("l.xml", "r.xml"), ("r.xml", "l.xml")])
@pytest.mark.parametrize("of_the_engine", [0, 1])
def test_engine_settings_do_not_pay_for_another_file(
    folder: Path, capsys: Any, sides: tuple[str, str], of_the_engine: int
) -> None:
    """A load that swings is on one side only; PyBullet's own motors hold both files still."""
    file(folder, "l.xml")
    file(folder, "r.xml", load=LOAD, qpos=".8 0")
    typed = [
        f"{side}@pybullet:engine" if k == of_the_engine else side for k, side in enumerate(sides)
    ]
    code, found = asked(capsys, "f.py:none", *typed, "--why", "--seconds", "0.6")
    assert code == 1
    assert found["unexplained"] > 0.9


@pytest.mark.usefixtures("bullet")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("option", "name", "word"),
    [("gravity=0,0,-3", "gravity", "3 m/s²"), ("timestep=0.001", "timestep", "1 ms")],
)
def test_an_option_of_an_engine_as_it_comes_counts(
    folder: Path, capsys: Any, option: str, name: str, word: str
) -> None:
    file(folder, "n.xml", actuator="")
    sides = ("n.xml", "n.xml@pybullet:engine", option)
    _, found = asked(capsys, "f.py:none", *sides, "--why", "--seconds", "0.3", "--no-chaos")
    (row,) = (row for row in found["shares"] if row["name"] == name)
    assert row["values"][0]["right"] == word
    # What the file has none of, as the engine, is no difference.
    assert not {"armature", "dry friction", "joint limits"} & {r["name"] for r in found["shares"]}


@pytest.fixture
def sliding(folder: Path) -> Path:
    """Two sides in which a joint's damping hardly differs, and a box slides or does not."""
    file(folder, "l.xml", more=SLIDING.format(".2"), qpos=".8 0 1 .06 1 0 0 0")
    file(folder, "r.xml", damping=".02001", more=SLIDING.format(".6"), qpos=".8 0 1 .06 1 0 0 0")
    return folder


@pytest.mark.slow
@pytest.mark.usefixtures("sliding")
@pytest.mark.parametrize("floor", [(), ("--uncertainty", "0.1deg")])
def test_what_is_explained_is_what_differs(floor: tuple[str, ...], capsys: Any) -> None:
    words = ("f.py:none", "l.xml", "r.xml", "--why", "--seconds", "0.6", *floor)
    code, found = asked(capsys, *words)
    assert (code, found["quantity"]) == (0, "box")
    shares = {each["name"]: each["share"] for each in found["shares"]}
    assert shares["friction of gb"] > 0.95
    assert abs(shares["damping of j1"]) < 0.02


@pytest.mark.slow
@pytest.mark.usefixtures("sliding")
def test_the_quantity_that_is_asked_for_is_explained(capsys: Any) -> None:
    words = ("f.py:none", "l.xml", "r.xml", "--why", "--seconds", "0.6", "--quantity", "joints")
    assert asked(capsys, *words)[1]["quantity"] == "joints"


SENSOR = '<sensor><jointpos name="p" joint="j1" {}/></sensor>'
# What either side has, the function, the cause, its values, and the exit code of `--models`.
ONE_CAUSE: dict[str, tuple[dict[str, str], dict[str, str], str, str, tuple[Any, ...], int]] = {
    "a muscle that pulls by its bias": (
        {"actuator": MUSCLE.format("-.5")},
        {"actuator": MUSCLE.format("-.2")},
        "wave",
        "length range of m",
        ("lengthrange", [-0.5, 0.5], [-0.2, 0.5], "rad"),
        1,
    ),
    "a start at another time": (
        {}, {"key": 'time=".5"'}, "wave", "time of the start", ("time", 0.0, 0.5, "s"), 1
    ),
    "a sensor that a function may read": (
        {"sensor": SENSOR.format("")},
        {"sensor": SENSOR.format('cutoff=".01"')},
        "sensed",
        "cutoff of p",
        ("cutoff", 0.0, 0.01, ""),
        0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ONE_CAUSE)
def test_one_cause_explains_all(folder: Path, capsys: Any, name: str) -> None:
    left, right, function, known, value, _ = ONE_CAUSE[name]
    sides = file(folder, "l.xml", **left), file(folder, "r.xml", **right)
    code, found = asked(capsys, f"f.py:{function}", *sides, "--why", "--no-chaos")
    (cause,) = found["shares"]
    assert code == 0
    assert_has(cause, name=known, share=pytest.approx(1.0))
    assert [tuple(each.values()) for each in cause["values"]] == [value]


@pytest.mark.parametrize("name", ONE_CAUSE)
def test_the_comparison_of_files_says_whether_the_cause_moves_a_robot(
    folder: Path, here: Cli, name: str
) -> None:
    left, right, _, known, _, code = ONE_CAUSE[name]
    sides = folder / file(folder, "l.xml", **left), folder / file(folder, "r.xml", **right)
    text = here("compare", "--models", *sides, "--details", code=code).stdout
    assert known != "time of the start" or "Keyframe k: time" in text


@pytest.fixture
def other_sensor(folder: Path) -> Path:
    """Two sides of which one has a sensor of a joint's velocity instead of its position."""
    sensor = SENSOR.format("")
    file(folder, "l.xml", sensor=sensor)
    file(folder, "v.xml", sensor=sensor.replace("jointpos", "jointvel"))
    return folder


@pytest.mark.usefixtures("other_sensor")
def test_another_sensor_counts_where_a_function_may_read_it(capsys: Any) -> None:
    code, found = asked(capsys, "f.py:sensed", "l.xml", "v.xml", "--why", "--no-chaos")
    assert (code, found["unexplained"]) == (1, 1.0)
    assert found["shares"][0]["name"] == "sensor of p"


@pytest.mark.usefixtures("other_sensor")
def test_another_sensor_moves_nothing_by_itself(capsys: Any) -> None:
    code, found = asked(capsys, "f.py:none", "l.xml", "v.xml", "--why", "--no-chaos")
    assert (code, found["shares"]) == (0, [])


def test_another_sensor_is_listed_among_the_details_of_two_files(
    other_sensor: Path, here: Cli
) -> None:
    sides = other_sensor / "l.xml", other_sensor / "v.xml"
    assert "Sensor of p: type" in here("compare", *sides, "--models", "--details", code=0).stdout


def test_a_sensor_of_a_joint_by_another_name_is_the_same(folder: Path) -> None:
    from statemachine.lab.compare.matching import match_models
    from statemachine.lab.why.causes import sensors_of

    sensor = (
        '<sensor><jointpos name="p" joint="j1"/>'
        '<framepos name="q" objtype="body" objname="a"/></sensor>'
    )
    text = (folder / file(folder, "l.xml", sensor=sensor)).read_text(encoding="utf-8")
    written(folder / "r.xml", text.replace('"j1"', '"hinge"').replace('"a"', '"arm"'))
    one, two = (sm.load(folder / name) for name in ("l.xml", "r.xml"))
    assert sensors_of(match_models(one, two, {"j1": "hinge"})) == []


def test_forces_of_a_function_leave_no_open_loop(folder: Path, capsys: Any) -> None:
    words = ("f.py:pushed", file(folder, "l.xml"), "l.xml", "damping=0.02", "--seconds", "0.5")
    code, found = asked(capsys, *words)
    assert (code, found["commands"]) == (0, "more than ctrl")


@pytest.fixture
def recorded(folder: Path) -> Path:
    """Two files that differ in damping, and a run of each by a wave, and by a push."""
    file(folder, "l.xml")
    file(folder, "r.xml", damping=".2")
    metadata = RunMetadata(options={"timestep": 0.004})
    for side in ("l", "r"):
        model = sm.load(f"{side}.xml").replace(timestep=0.004)
        start = RunStart(keyframe="k")
        waved = record(model, wave, 0.6, start=start, metadata=metadata)
        write(waved, f"{side}.npz")
        write(record(model, lambda _m, _d: [0.5], 0.6, metadata=metadata), f"{side}_push.npz")
    return folder


def wave(_model: sm.Model, data: sm.Data) -> list[float]:
    return [np.sin(6 * data.time)]


def explained_files(capsys: Any, *words: str) -> tuple[int, dict[str, Any]]:
    """Ask why two sides differ: the exit code, and the JSON."""
    code = main(["compare", *words, "--why", "--no-chaos", "--json"])
    return code, json.loads(capsys.readouterr().out)


@pytest.mark.usefixtures("recorded")
def test_recorded_runs_are_explained_by_the_models_that_their_headers_name(capsys: Any) -> None:
    code, found = explained_files(capsys, "l.npz", "r.npz")
    assert (code, [row["name"] for row in found["shares"]]) == (0, ["damping of j1"])
    apart = np.abs(read("l.npz").qpos - read("r.npz").qpos).max()
    assert found["gap"] == pytest.approx(apart, rel=1e-9)


@pytest.mark.usefixtures("recorded")
def test_two_files_are_given_the_commands_of_a_recorded_run(capsys: Any) -> None:
    _, found = explained_files(capsys, "l.npz", "l.xml", "r.xml")
    apart = np.abs(read("l.npz").qpos - read("r.npz").qpos).max()
    assert found["gap"] == pytest.approx(apart, rel=1e-9)


@pytest.mark.usefixtures("recorded")
def test_the_start_and_the_commands_of_recorded_runs_are_causes(capsys: Any) -> None:
    code, found = explained_files(capsys, "l.npz", "r_push.npz")
    names = {row["name"] for row in found["shares"]}
    assert (code, names) == (0, {"damping of j1", "start", "commands"})
    assert sum(row["share"] for row in found["shares"]) == pytest.approx(1.0)


def test_a_recorded_run_whose_file_is_gone_is_refused_by_its_name(
    recorded: Path, capsys: Any
) -> None:
    (recorded / "r.xml").unlink()
    assert main(["compare", "l.npz", "r.npz", "--why"]) == 2
    assert "r.xml" in capsys.readouterr().err
