"""What comes of the runs of a robot that floats, and which parameter moves it: as raw MuJoCo."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.cli import main
from statemachine.errors import BadInputError
from statemachine.lab.sweep import Sweep
from statemachine.lab.sweep.analysis import MainEffect, SweepEffects
from statemachine.lab.sweep.main_effects import LevelMean
from statemachine.lab.sweep.page import page
from statemachine.lab.sweep.questions import (
    SweepEffectsRequest,
    SweepRequest,
    answer_effects,
)
from statemachine.show.first_screen import COLUMNS, LINES, lines_of

from .support.claims import assert_in
from .support.files import written
from .support.pages import shown
from .support.requirements import SHARED
from .support.sweeps import rows_of

mujoco = pytest.importorskip("mujoco")
pytest.importorskip("pyarrow")
pytest.importorskip("joblib")

# A cart on two pairs of wheels, of which the rear ones are driven by motors.
CART = """
<mujoco><option timestep="0.005"/><worldbody>
  <geom name="floor" type="plane" size="0 0 1"/>
  <body name="chassis" pos="0 0 0.12"><freejoint/>
    <geom name="box" type="box" size="0.2 0.1 0.03" mass="2"/>
    <body name="rear left" pos="-0.15 0.14 -0.02"><joint name="rear left" axis="0 1 0"/>
      <geom type="cylinder" size="0.1 0.02" euler="90 0 0" mass="0.3"/></body>
    <body name="rear right" pos="-0.15 -0.14 -0.02"><joint name="rear right" axis="0 1 0"/>
      <geom type="cylinder" size="0.1 0.02" euler="90 0 0" mass="0.3"/></body>
    <body name="front left" pos="0.15 0.14 -0.02"><joint name="front left" axis="0 1 0"/>
      <geom type="cylinder" size="0.1 0.02" euler="90 0 0" mass="0.3"/></body>
    <body name="front right" pos="0.15 -0.14 -0.02"><joint name="front right" axis="0 1 0"/>
      <geom type="cylinder" size="0.1 0.02" euler="90 0 0" mass="0.3"/></body>
  </body></worldbody>
  <actuator>
    <motor name="left" joint="rear left"/><motor name="right" joint="rear right"/>
  </actuator>
</mujoco>
"""
DRIVE = """
def drive(model, data, gain=1.0):
    return [0.5 * gain, 0.5 * gain]
"""

# A mast with a weight on a servo, which a push at the start overturns or not.
MAST = """
<mujoco><option timestep="0.005"/><worldbody>
  <geom name="floor" type="plane" size="0 0 1"/>
  <body name="mast" pos="0 0 0.5"><freejoint/>
    <geom type="box" size="0.05 0.05 0.5" mass="1"/>
    <body name="arm" pos="0 0.06 0"><joint name="arm" axis="0 1 0" armature="0.01"/>
      <geom type="capsule" size="0.01" fromto="0 0.02 0 0 0.02 -0.1" mass="0.1"/></body>
  </body></worldbody>
  <actuator><position name="arm" joint="arm" kp="1" kv="0.1"/></actuator>
</mujoco>
"""
STILL = """
def still(model, data):
    return [0.3]
"""


def shares_of(cube: np.ndarray) -> list[float]:
    """Return Var(E[Y | X]) / Var(Y) along each axis of a full grid."""
    axes = range(cube.ndim)
    return [
        float(cube.mean(axis=tuple(other for other in axes if other != axis)).var() / cube.var())
        for axis in axes
    ]


def raw_cart(friction: float, gain: float, steps: int) -> Any:
    """Return the state of the cart after so many steps of plain MuJoCo."""
    model = mujoco.MjModel.from_xml_string(CART)
    model.geom_friction[:, 0] = friction
    data = mujoco.MjData(model)
    for _ in range(steps):
        data.ctrl[:] = 0.5 * gain
        mujoco.mj_step(model, data)
    return data


FRICTIONS, GAINS = (0.02, 0.3, 1.0), (0.5, 1.0, 2.0)


def cart_sweep(folder: Path, **others: Any) -> Sweep:
    function = f"{written(folder / 'drive.py', DRIVE)}:drive"
    model = str(written(folder / "cart.xml", CART))
    vary = ("friction=0.02,0.3,1", "gain=0.5,1,2")
    given = {"vary": vary, "backends": ("mujoco",), "seconds": 1.0, "model": model, **others}
    return Sweep(function, **given)


def test_which_parameter_moves_the_base_is_what_raw_mujoco_gives(tmp_path: Path) -> None:
    request = SweepEffectsRequest(SweepRequest(cart_sweep(tmp_path), None, jobs=1), "base x")
    report = answer_effects(request).report
    cube = np.array([[raw_cart(mu, gain, 200).qpos[0] for gain in GAINS] for mu in FRICTIONS])
    friction, gain = shares_of(cube)
    shares = {effect.parameter: effect.share for effect in report.effects}
    assert shares == pytest.approx({"friction": friction, "gain": gain}, abs=1e-9)
    assert 0.05 < min(friction, gain) < max(friction, gain) < 0.95
    assert (report.smallest.value, report.largest.value) == pytest.approx(
        (cube.min(), cube.max()), abs=1e-9
    )
    levels = {effect.parameter: effect.levels for effect in report.effects}
    assert [level.value for level in levels["gain"]] == [*GAINS]
    assert [level.mean for level in levels["gain"]] == pytest.approx(cube.mean(axis=0), abs=1e-9)
    assert report.together == pytest.approx(1 - friction - gain, abs=1e-9)
    assert (report.folder, report.model) == ("", ("cart.xml",))


def test_the_base_and_its_distance_are_those_of_raw_mujoco(tmp_path: Path) -> None:
    for row in rows_of(cart_sweep(tmp_path)):
        data = raw_cart(row["vary.friction"], row["vary.gain"], 200)
        assert row["base"] == pytest.approx(data.qpos[:3], abs=1e-9)
        assert row["distance"] == pytest.approx(np.hypot(*data.qpos[:2]), abs=1e-9)
        assert row["fell"] == 0.0
        assert row["tracking_error"] is None


def test_a_base_that_is_pushed_over_fell(tmp_path: Path, backend: str) -> None:
    function = f"{written(tmp_path / 'still.py', STILL)}:still"
    model = str(written(tmp_path / "mast.xml", MAST))
    sweep = Sweep(function, ("qvel[4]=0,8",), (backend,), model=model, seconds=1.5)
    stands, falls = rows_of(sweep)
    assert (stands["fell"], falls["fell"]) == (0.0, 1.0)
    assert falls["base"][2] < 0.5 / 3 < stands["base"][2]


def test_a_base_that_turns_over_in_the_air_fell(tmp_path: Path) -> None:
    function = f"{written(tmp_path / 'still.py', STILL)}:still"
    floating = MAST.replace("<option", '<option gravity="0 0 0"').replace(
        'pos="0 0 0.5"', 'pos="0 0 5"'
    )
    model = str(written(tmp_path / "mast.xml", floating))
    # In a second it turns by so many radians, and a quarter of a turn is 1.57.
    sweep = Sweep(function, ("qvel[4]=1.2,2",), ("mujoco",), model=model, seconds=1.0)
    assert [row["fell"] for row in rows_of(sweep)] == [0.0, 1.0]


def test_the_tracking_error_is_that_of_raw_mujoco(tmp_path: Path) -> None:
    function = f"{written(tmp_path / 'still.py', STILL)}:still"
    model = str(written(tmp_path / "mast.xml", MAST))
    (row,) = rows_of(Sweep(function, (), ("mujoco",), model=model, seconds=0.5))
    raw = mujoco.MjModel.from_xml_string(MAST)
    data = mujoco.MjData(raw)
    errors: list[float] = []
    for _ in range(100):
        data.ctrl[:] = 0.3
        mujoco.mj_step(raw, data)
        errors.append(0.3 - data.qpos[7])
    assert row["tracking_error"] == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=1e-9)
    assert row["tracking_error"] > 0.01


def test_a_free_box_in_the_scene_of_an_arm_is_no_base() -> None:
    (row,) = rows_of(Sweep("hold", (), ("mujoco",), model="so101/scene_box", seconds=0.05))
    assert [row[name] for name in ("base", "distance", "fell")] == [None] * 3
    assert row["tracking_error"] > 0


def test_the_tracking_errors_of_hinges_and_of_slides_are_two(tmp_path: Path) -> None:
    slide = MAST.replace('name="arm" axis="0 1 0"', 'name="arm" type="slide" axis="0 0 1"')
    function = f"{written(tmp_path / 'still.py', STILL)}:still"
    sweep = Sweep(function, (), ("mujoco",), seconds=0.1)
    for content, column in ((MAST, "tracking_error"), (slide, "slide_tracking_error")):
        model = str(written(tmp_path / "mast.xml", content))
        (row,) = rows_of(replace(sweep, model=model))
        known = [name for name in ("tracking_error", "slide_tracking_error") if row[name]]
        assert known == [column]


@pytest.mark.parametrize("quantity", ["fell", "distance", "base z", "tracking_error"])
def test_what_no_robot_of_a_sweep_has_is_refused_before_it_runs(
    quantity: str, tmp_path: Path
) -> None:
    if quantity == "tracking_error":
        sweep = cart_sweep(tmp_path, seconds=1e4)
    else:
        sweep = Sweep("hold", ("damping=1,2",), ("mujoco",), model="so101", seconds=1e4)
    with pytest.raises(BadInputError, match="robot with"):
        answer_effects(SweepEffectsRequest(SweepRequest(sweep, None), quantity))


# What the report says first.


def report_of(*shares: float | None, error: float | None = None, **others: Any) -> SweepEffects:
    """Return a report with parameters of these shares."""
    from statemachine.lab.sweep.analysis import ExtremeCell

    names = [f"frictionloss[the_{k}th_joint_with_a_long_name]" for k in range(len(shares))]
    levels = (LevelMean(0.5, -1.0), LevelMean(2.0, 3.0))
    cell = ExtremeCell(1.25, tuple(1.0 for _ in names), 0)
    facts: dict[str, Any] = {
        "what": "walk.py:policy", "model": ("robot.xml",), "folder": "",
        "command": f"statemachine sweep walk.py:policy robot.xml {'--vary some=1,2 ' * len(names)}",
        "more_runs": "--seeds 3",
        "versions": {"mujoco": "4"}, "backends": ("mujoco",), "quantity": "base x", "unit": "m",
        "parameters": tuple(names), "units": {}, "scaled": (), "seeds": 1, "samples": 0,
        "effects": tuple(
            MainEffect(name, share, error, levels)
            for name, share in zip(names, shares, strict=True)
        ),
        "why_none": "", "mean": 1.0, "deviation": 0.5, "largest": cell, "smallest": cell,
        "settings": 4, "left_out": 0, "left_out_values": {}, "failed": {}, "missing": 0,
        **others,
    }  # fmt: skip
    return SweepEffects(**facts)


@pytest.mark.parametrize(
    ("shares", "error", "verdict"),
    [
        ((0.84, 0.10), None, "one"),
        ((0.84, 0.10), 0.1, "one"),
        ((0.48, 0.45), 0.1, "tied"),
        ((0.48, 0.45), None, "one"),
        ((0.3, 0.2), None, "together"),
        ((0.0, 0.0), None, "together"),
        ((0.3,), None, "one"),
        ((0.3, None), None, "one"),
        ((None, None), None, "none"),
        ((), None, "none"),
    ],
)
def test_the_verdict_names_one_parameter_only_where_one_leads(
    shares: Sequence[float | None], error: float | None, verdict: str
) -> None:
    assert report_of(*shares, error=error).verdict == verdict


@pytest.mark.parametrize("count", [1, 2, 12, 60])
@pytest.mark.parametrize("verdict", ["one", "tied", "together", "none"])
def test_the_first_screen_is_one_of_24_lines(count: int, verdict: str) -> None:
    leads = {"one": 0.9, "tied": 0.5, "together": 0.1, "none": None}[verdict]
    rest = None if leads is None else (1 - leads) / (2 * count)
    shares = [leads, *[rest] * (count - 1)]
    if verdict == "tied" and count > 1:
        shares[1] = 0.45
    report = report_of(
        *shares,
        error=0.1 if verdict == "tied" else None,
        why_none="it is the same at every setting, but for rounding" if leads is None else "",
        failed={"DivergedError": 3, "TimedOutError": 2, "WorkerEndedError": 1},
        missing=4,
        left_out=7,
        model=tuple(f"a_robot_with_a_long_name_{k}.xml" for k in range(count)),
    )
    lines = shown(page(report)).splitlines()
    assert lines_of(page(report)) <= LINES
    assert max(len(line) for line in lines if not line.startswith("    ")) <= COLUMNS
    assert len(shown(page(report, details=True)).splitlines()) > len(lines)


@pytest.mark.slow
def test_the_command_says_first_which_parameter_moves_the_base(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep = cart_sweep(tmp_path)
    monkeypatch.chdir(tmp_path)
    words = [
        "sweep",
        "drive.py:drive",
        "cart.xml",
        "--vary",
        sweep.vary[0],
        "--vary",
        sweep.vary[1],
    ]
    words += ["--seconds", "1", "--jobs", "1", "--report", "--quantity", "base x"]
    assert main(words) == 0
    lines = capsys.readouterr().out.strip().splitlines()
    assert_in(lines[0], "drive.py:drive", "base x")
    assert lines[3].startswith("friction")
    typed = next(line.strip() for line in lines if line.startswith("    statemachine sweep"))
    assert typed.startswith("statemachine sweep drive.py:drive cart.xml --vary friction=0.02,0.3,1")
    assert typed.endswith("--report --quantity 'base x' --seeds 3")
    left = {path.name for path in tmp_path.iterdir()} - {"__pycache__"}
    assert left == {"cart.xml", "drive.py"}
    assert main([*words, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["summary"]["done"] == 9
    assert result["report"]["effects"][0]["parameter"] == "friction"


# A trot on robots that are public.

TROT = """
import numpy as np

PHASE = {"FR": 0.0, "RL": 0.0, "FL": 0.5, "RR": 0.5}

def targets(names, time, thigh, calf):
    angles = np.zeros(len(names))
    for k, name in enumerate(names):
        leg, part = name.split("_")[:2]
        phase = 2 * np.pi * (2.0 * time + PHASE[leg])
        size = min(1.0, 2 * time)
        if part == "thigh":
            angles[k] = thigh + size * 0.25 * np.cos(phase)
        if part == "calf":
            angles[k] = calf - size * 0.35 * max(0.0, np.sin(phase))
    return angles

def torques(names, time, q, v, gain):
    return gain * 40 * (targets(names, time, 0.9, -1.8) - q) - v

def policy(model, data, gain=1.0):
    joints = model.actuator_jntid
    q = data.qpos[model.jnt_qposadr[joints]]
    v = data.qvel[model.jnt_dofadr[joints]]
    return torques(model.actuator_names, data.time, q, v, gain)
"""


def raw_trot(
    file: Path, torques: Callable[..., np.ndarray], friction: float, gain: float, steps: int
) -> float:
    """Return how far the base gets forward in plain MuJoCo [m]."""
    model = mujoco.MjModel.from_xml_path(str(file))
    model.geom_friction[:, 0] = friction
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    names = [model.actuator(k).name for k in range(model.nu)]
    joints = model.actuator_trnid[:, 0]
    for _ in range(steps):
        q, v = data.qpos[model.jnt_qposadr[joints]], data.qvel[model.jnt_dofadr[joints]]
        data.ctrl[:] = torques(names, data.time, q, v, gain)
        mujoco.mj_step(model, data)
    return float(data.qpos[0])


@pytest.mark.slow
def test_the_gain_moves_the_trot_of_a_go2_more_than_friction_does(tmp_path: Path) -> None:
    file = SHARED / "menagerie" / "unitree_go2" / "scene.xml"
    if not file.exists():
        pytest.skip(f"there is no {file.parent.name} among the public models")
    names: dict[str, Any] = {}
    exec(TROT, names)
    frictions, gains = (0.4, 0.8, 1.2), (0.5, 1.0, 2.0)
    function = f"{written(tmp_path / 'walk.py', TROT)}:policy"
    sweep = Sweep(
        function, ("friction=0.4,0.8,1.2", "gain=0.5,1,2"), ("mujoco",), model=str(file),
        seconds=3.0, keyframe="home",
    )  # fmt: skip
    with warnings.catch_warnings(action="ignore", category=UserWarning):  # of feet in the floor
        report = answer_effects(SweepEffectsRequest(SweepRequest(sweep, None), "base x")).report
    runs = [raw_trot(file, names["torques"], *each, 1500) for each in product(frictions, gains)]
    friction, gain = shares_of(np.reshape(runs, (3, 3)))
    shares = {effect.parameter: effect.share for effect in report.effects}
    assert shares == pytest.approx({"friction": friction, "gain": gain}, abs=1e-9)
    assert report.effects[0].parameter == "gain"
    assert gain > 0.8
    assert friction < 0.2
