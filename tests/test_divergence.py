"""When an engine with a world of its own has diverged: a bound of each Model, which can be set."""

from __future__ import annotations

import json
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.backends import pybullet_backend
from statemachine.backends.compiled.model import compile_file, fastest
from statemachine.cli import main
from statemachine.errors import BadInputError, DivergedError, UnsupportedError
from statemachine.interface.checks import HUGE
from statemachine.lab.compare import Request, run_sides
from statemachine.lab.compare import compare as compare_traces

from .support.claims import overlapping, refused
from .support.compared import page_of
from .support.files import written
from .support.motions import after, opened
from .support.requirements import need_engine
from .support.small_models import ROTOR, STUCK_POST, mjcf


def loaded(folder: Path, text: str, **options: Any) -> sm.Model:
    need_engine("pybullet")
    return sm.load(written(folder / "model.xml", text), backend="pybullet", **options)


def bound(model: sm.Model) -> np.ndarray:
    return vars(model)["max_qvel"]


@pytest.mark.parametrize("timestep", [0.001, 0.005, 0.01])
def test_what_is_fast_is_no_divergence(tmp_path: Path, timestep: float) -> None:
    """A rotor at 2000 rad/s, every coordinate but a free body's turning at 1e4, a long fall."""
    model = loaded(tmp_path, ROTOR.format(timestep=timestep, actuator=""))
    for speed in (2000.0, 1e4):
        with opened(model, qvel=[*[speed] * 5, 0, 0, 0], nstep=200) as (_, data):
            assert data.qvel[0] == pytest.approx(speed, rel=1e-6)
            assert np.abs(data.qvel[1:5]).max() == pytest.approx(speed, rel=0.02)
    fall = np.sqrt(2 * 9.81 * HUGE)  # where it leaves the positions that engines can compute with
    assert bound(model)[[1, 2, 3, 4]].min() > fall


@pytest.mark.parametrize(
    ("actuator", "fastest"),
    [
        ("", 1e5),
        ('<position joint="rotor" kp="1"/>', 1e5),
        # 1 N m against an inertia of 1/2·m·r² = 1.57e-3 kg m², for 1e5 s; twice by its gear.
        ('<motor joint="rotor" ctrlrange="-1 1" gear="2"/>', 2e5 / 1.5708e-3),
        ('<motor joint="rotor" forcerange="-1 .5"/>', 1e5 / 1.5708e-3),
        ('<velocity joint="rotor" kv="1" ctrlrange="-2e6 2e6"/>', 2e6),
        ('<motor joint="rotor"/>', HUGE),
    ],
)
def test_no_motor_drives_a_joint_beyond_the_bound(
    tmp_path: Path, actuator: str, fastest: float
) -> None:
    text = ROTOR.format(timestep=0.01, actuator=actuator)
    model = loaded(tmp_path, text.replace('"cylinder"', '"cylinder" mass=".31416"'))
    assert bound(model)[0] == pytest.approx(fastest, rel=1e-3)
    after(model, 100, ctrl=1)


def test_the_bound_follows_the_timestep_and_the_size(tmp_path: Path) -> None:
    """1000 rad, or 1000 times the extent, in a timestep."""
    model = loaded(tmp_path, ROTOR.format(timestep=1e-4, actuator=""), gravity=[0, 0, 0])
    slide = 1e7 * float(model.compiled.stat.extent)
    assert bound(model) == pytest.approx([1e7, *[slide] * 4, *[1e7] * 3])
    assert bound(model.replace(timestep=2e-4))[0] == pytest.approx(5e6)
    assert bound(model.replace(substeps=2))[0] == pytest.approx(2e7)


def explode(model: sm.Model) -> DivergedError:
    """Step with contacts as hard as the engine makes them, until it raises."""
    import pybullet as pb

    with sm.make_data(model) as data:
        pb.setPhysicsEngineParameter(globalCFM=0, physicsClientId=data.raw.client)
        data.qpos[1] = -1
        error = refused((DivergedError, "", lambda: sm.step(model, data, 500)))
        refused((DivergedError, r"qvel\[\d\] diverged at", lambda: sm.step(model, data)))
        sm.reset(model, data)
        assert data.time == 0
    return error


@overlapping
def test_an_explosion_is_raised_early(tmp_path: Path) -> None:
    model = loaded(tmp_path, STUCK_POST)
    # Set lower it raises before; set as high as positions may be, later.
    lower, error, higher = (
        explode(variant)
        for variant in (model.replace(max_qvel=10), model, model.replace(max_qvel=HUGE))
    )
    assert lower.time < error.time < higher.time < 0.1
    assert "went beyond max_qvel, 5e+05, at time" in str(error)
    assert error.quantity == "qvel"


@pytest.fixture
def rotor_of_500(tmp_path: Path) -> sm.Model:
    """A rotor whose bound was set at load."""
    return loaded(tmp_path, ROTOR.format(timestep=0.002, actuator=""), max_qvel=500)


def test_one_number_bounds_every_coordinate(rotor_of_500: sm.Model) -> None:
    assert np.array_equal(bound(rotor_of_500), np.full(8, 500.0))


def test_a_variant_keeps_the_bound_that_was_set(rotor_of_500: sm.Model) -> None:
    assert np.array_equal(bound(rotor_of_500.replace(timestep=0.001)), bound(rotor_of_500))


@pytest.mark.parametrize(("value", "top"), [(500, 499), ([1000, *[1e5] * 7], 999)])
def test_a_coordinate_beyond_the_bound_that_was_set_diverged(
    value: Any, top: float, rotor_of_500: sm.Model
) -> None:
    variant = rotor_of_500.replace(max_qvel=value)
    with opened(variant, qvel=[top, *[0] * 7], nstep=3) as (_, data):
        data.qvel[0] = top + 2
        error = refused((DivergedError, "max_", partial(sm.step, variant, data)))
    assert (error.quantity, error.index) == ("qvel", 0)


def test_another_joint_may_be_faster_where_each_has_a_bound(rotor_of_500: sm.Model) -> None:
    each = rotor_of_500.replace(max_qvel=[1000, *[1e5] * 7])
    after(each, 3, qvel=[0, 5000, *[0] * 6])


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (0, "above 0"),
        (-1, "above 0"),
        ([1, 2], "max_qvel takes 8 numbers"),
        (np.nan, "not a finite number"),
        (np.inf, "not a finite number"),
        (1e11, "is beyond 1e\\+10"),
        ("fast", "real numbers"),
        (True, "real numbers"),
    ],
)
def test_a_bad_bound_is_refused_in_a_line(tmp_path: Path, value: object, says: str) -> None:
    text = ROTOR.format(timestep=0.002, actuator="")
    refused((BadInputError, says, lambda: loaded(tmp_path, text, max_qvel=value)))


@pytest.mark.parametrize(
    ("options", "words"), [({}, "5e+05 to 1.1e+06"), ({"max_qvel": 700}, "700")]
)
def test_the_record_shows_the_bound(options: dict[str, Any], words: str, tmp_path: Path) -> None:
    text = ROTOR.format(timestep=0.002, actuator="")
    record = str(loaded(tmp_path, text, **options).capabilities)
    assert f"beyond {words} (max_qvel)" in record


def test_the_record_of_mujoco_shows_the_engine_s_own_bound(mujoco_arm: sm.Model) -> None:
    assert "beyond 1e+10" in str(mujoco_arm.capabilities)


def test_mujoco_takes_no_other_bound(mujoco_arm: sm.Model) -> None:
    refused((UnsupportedError, "max_qvel", lambda: mujoco_arm.replace(max_qvel=1e5)))


@pytest.mark.usefixtures("bullet")
def test_a_comparison_in_which_a_side_diverges_says_that(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Which side and when; the verdicts are of the time until then; nothing is explained."""
    monkeypatch.setattr(pybullet_backend, "fastest", lambda raw: np.ones(raw.nv))
    assert main(["compare", "hold", "--why", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)["comparison"]
    assert not found["left"]["run"]["ended"]
    assert found["right"]["run"]["ended"].startswith("qvel[1] (shoulder_lift) = -1.04 went beyond")
    assert {each["verdict"] for each in found["agreements"]} == {"agrees"}


@pytest.mark.usefixtures("bullet")
# Such a motor is what diverges.
@pytest.mark.filterwarnings(
    "ignore:.*kv of actuator number 0 is negative:statemachine.errors.EngineWarning"
)
def test_both_sides_of_a_comparison_may_diverge(tmp_path: Path) -> None:
    """A motor that pushes the faster, the faster its wheel turns."""
    path = written(
        tmp_path / "runaway.xml",
        """<mujoco><option timestep="0.01"/><worldbody><body><joint name="wheel"
      axis="0 0 1"/><geom type="cylinder" size=".1 .02"/></body></worldbody><actuator>
      <general joint="wheel" gainprm="1" biastype="affine" biasprm=".1 0 2" ctrlrange="-1 1"/>
      </actuator></mujoco>""",
    )
    traces = run_sides(Request(("droop",), model=str(path))).traces
    assert all(trace.header.ended for trace in traces)
    assert "ended early" in page_of(compare_traces(*traces)).headline.text


def test_the_bound_of_a_motor_that_pushes_a_free_body_is_a_number(tmp_path: Path) -> None:
    """Its first gear is 0 and its range infinite: there is nothing to multiply."""
    text = mjcf(
        '<body><freejoint name="j"/><geom size=".1"/></body>',
        '<actuator><motor joint="j" gear="0 0 1 0 0 0"/></actuator>',
    )
    compiled = compile_file(written(tmp_path / "m.xml", text))
    with warnings.catch_warnings(action="error", category=RuntimeWarning):
        assert np.isfinite(fastest(compiled)).all()
