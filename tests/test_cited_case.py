"""Which side is nearer to the truth: the cases of the battery that `compare --why` cites."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import get_args
from unittest.mock import Mock

import mujoco
import numpy as np
import pytest

from statemachine.backends import parse_backend
from statemachine.lab.compare import Request, Side
from statemachine.lab.questions.requests.causes import ExplainRequest, ExplainResult, answer
from statemachine.lab.validate.battery import ValidateRequest
from statemachine.lab.validate.case_runs import measure
from statemachine.lab.validate.cases import CASES
from statemachine.lab.validate.run import Run
from statemachine.lab.validate.variants import variants_of
from statemachine.lab.why import case_of_cause
from statemachine.lab.why.case_of_cause import timestep_of_case
from statemachine.lab.why.cited_case import (
    CitedCase,
    DecidedCause,
    ErrorsInRun,
    SideInCase,
    nearer_side,
)
from statemachine.lab.why.deciding_cases import DECIDING_CASES
from statemachine.lab.why.explanation import InterruptedExplanation
from statemachine.lab.why.page import page
from statemachine.show.first_screen import COLUMNS, LINES, lines_of

from .support.files import written_all
from .support.pages import shown
from .support.processes import Cli

TUMBLING = """
<mujoco>
  <option timestep="0.005" integrator="{integrator}" gravity="0 0 0"/>
  <worldbody>
    <body name="body">
      <freejoint/>
      <inertial pos="{centre} 0 0" mass="1" diaginertia="1 2 3"/>
    </body>
  </worldbody>
  <keyframe><key name="home" qvel="0 0 0 0.5 5 0.5"/></keyframe>
</mujoco>
"""
SLIDING = """
<mujoco>
  <option timestep="0.002" cone="{cone}"/>
  <worldbody>
    <geom type="plane" size="0 0 1" friction="0.5 0 0"/>
    <body name="block" pos="0 0 0.05">
      <freejoint/>
      <geom type="box" size="0.1 0.1 0.05" mass="{mass}" friction="0.5 0 0"/>
    </body>
  </worldbody>
  <keyframe><key name="home" qpos="0 0 0.0499 1 0 0 0" qvel="1.5 1.5 0 0 0 0"/></keyframe>
</mujoco>
"""
SERVO = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.005" integrator="{integrator}"/>
  <worldbody>
    <body>
      <joint name="hinge" axis="0 1 0" damping="0.1" armature="0.01"/>
      <inertial pos="0 0 -0.1" mass="0.5" diaginertia="0.003 0.003 0.003"/>
    </body>
  </worldbody>
  <actuator><position joint="hinge" kp="60" kv="2" {limit}/></actuator>
</mujoco>
"""
# A body that turns fast and is looked at while the errors of its integrator are still small.
SPINNING = """
<mujoco>
  <option timestep="0.01" integrator="{integrator}" gravity="0 0 0"/>
  <worldbody>
    <body>
      <freejoint/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1.5 2"/>
      <site name="tip" pos="1 0 0"/>
    </body>
  </worldbody>
  <keyframe><key name="home" qvel="0 0 0 5 1 1"/></keyframe>
</mujoco>
"""
SPRING = """
<mujoco>
  <option timestep="0.002" integrator="{integrator}"/>
  <worldbody>
    <body>
      <joint axis="0 1 0" stiffness="50"/>
      <inertial pos="0.15 0 -0.1" mass="1" diaginertia="0.01 0.01 0.01"/>
    </body>
  </worldbody>
</mujoco>
"""
DRIVEN = """
<mujoco>
  <option timestep="{timestep}" integrator="{integrator}" gravity="0 0 0"/>
  <worldbody>
    <body>
      <joint name="slide" type="slide" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    </body>
  </worldbody>
  <actuator><position joint="slide" kp="{kp}" kv="{kv}"/></actuator>
</mujoco>
"""
PUSHED = "def still(model, data):\n    return None\n"


def _asked(sides: Sequence[Side], what: str = "fall", keyframe: str | None = "home") -> Request:
    left, right = sides
    return Request((what,), sides=(left, right), seconds=0.5, keyframe=keyframe)


def _explained(request: Request) -> ExplainResult:
    return answer(ExplainRequest(request, uncertainty=None, jobs=1))


def _cited(result: ExplainResult) -> CitedCase:
    assert result.cited_case is not None
    return result.cited_case


def _tumbling(folder: Path, *integrators: str, centre: float = 0.0) -> list[Side]:
    sides: list[Side] = []
    for integrator in integrators:
        text = TUMBLING.format(integrator=integrator, centre=centre)
        name = f"{integrator}.xml"
        sides.append(Side(str(written_all(folder, {name: text}) / name)))
    return sides


def _written(
    folder: Path, text: str, *integrators: str, **values: float | str
) -> tuple[Side, Side]:
    """Write a model with each of two integrators."""
    sides: list[Side] = []
    for name in integrators:
        file = f"{name}.xml"
        written_all(folder, {file: text.format(integrator=name, **values)})
        sides.append(Side(str(folder / file)))
    left, right = sides
    return left, right


def _raw_energy_change(integrator: str) -> float:
    """Return the largest change of the energy in the last 4 of 20 s, as a ratio."""
    text = TUMBLING.format(integrator=integrator, centre=0)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qvel[3:] = [0.01, 5.0, 0.01]
    inertia = np.array([1.0, 2.0, 3.0])
    start = float(inertia @ data.qvel[3:] ** 2)
    mujoco.mj_step(model, data, 3200)
    worst = 0.0
    for _ in range(800):
        mujoco.mj_step(model, data)
        change = float(inertia @ data.qvel[3:] ** 2) / start - 1.0
        worst = max(worst, change, key=abs)
    return worst


def test_of_a_tumbling_body_rk4_is_nearer_to_the_truth_than_euler(tmp_path: Path) -> None:
    left, right = _tumbling(tmp_path, "Euler", "RK4")
    cited = _cited(_explained(_asked((left, right))))
    assert (cited.cause, cited.nearer) == ("integrator", "right")
    assert (cited.left.setting, cited.right.setting) == ("Euler", "RK4")
    assert cited.left.case == cited.right.case == "tumbling-energy"
    assert cited.left.error == pytest.approx(_raw_energy_change("Euler"), rel=1e-9)
    assert cited.left.error == pytest.approx(0.126, rel=0.05)
    assert cited.right.error == pytest.approx(_raw_energy_change("RK4"), abs=1e-9)


def test_the_case_is_run_with_the_timestep_of_each_side(tmp_path: Path) -> None:
    left, right = _tumbling(tmp_path, "Euler", "RK4")
    finer = [replace(side, options={"timestep": 0.002}) for side in (left, right)]
    cited = _cited(_explained(_asked(finer)))
    assert cited.left.timestep == cited.right.timestep == 0.002
    assert cited.left.size < 0.07  # of 0.126 at 5 ms: the error is of the first order


def test_sides_in_the_other_order_give_the_other_side(tmp_path: Path) -> None:
    euler, rk4 = _tumbling(tmp_path, "Euler", "RK4")
    assert _cited(_explained(_asked((rk4, euler)))).nearer == "left"


def _raw_slide(cone: str) -> float:
    """Return how far a block slides down the diagonal in 2 s over the closed form, less 1."""
    case = CASES["block-slides-diagonal"]
    model = mujoco.MjModel.from_xml_string(SLIDING.format(cone=cone, mass=1))
    model.opt.gravity[:] = case.gravity
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 1000)
    angle = math.atan(1.2 * 0.5)
    acceleration = 9.81 * (math.sin(angle) - 0.5 * math.cos(angle))
    return float(np.hypot(*data.qpos[:2])) / (2.0 * acceleration) - 1.0


def _sliding(folder: Path, *cones: str) -> Request:
    texts = {f"{cone}.xml": SLIDING.format(cone=cone, mass=1) for cone in cones}
    written_all(folder, {**texts, "pushed.py": PUSHED})
    left, right = (Side(str(folder / name)) for name in texts)
    return _asked((left, right), f"{folder / 'pushed.py'}:still")


def test_of_a_box_that_slides_diagonally_the_elliptic_cone_is_nearer(tmp_path: Path) -> None:
    cited = _cited(_explained(_sliding(tmp_path, "pyramidal", "elliptic")))
    assert (cited.cause, cited.nearer) == ("cone", "right")
    assert (cited.left.setting, cited.right.setting) == ("pyramidal", "elliptic")
    assert cited.left.error == pytest.approx(_raw_slide("pyramidal"), rel=1e-6)
    assert cited.right.error == pytest.approx(_raw_slide("elliptic"), rel=1e-6)
    assert cited.left.size > 1.0
    assert cited.right.size < 0.01


def test_of_a_servo_the_integrator_is_judged_by_a_servo(tmp_path: Path) -> None:
    sides = _written(tmp_path, SERVO, "Euler", "implicitfast", limit="")
    cited = _cited(_explained(_asked(sides, what="hold", keyframe=None)))
    assert cited.left.case == "servo-step"
    assert cited.nearer == "right"
    assert 0.009 < cited.left.size < 0.014
    assert cited.right.size < 0.003


def _raw_run(text: str, integrator: str, finer: int) -> np.ndarray:
    """Return positions of the tip, or of the joint, at each moment of 0.5 s, by plain MuJoCo."""
    model = mujoco.MjModel.from_xml_string(text.format(integrator=integrator))
    steps = round(0.5 / model.opt.timestep)
    model.opt.timestep /= finer
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    rows: list[np.ndarray] = []
    for _ in range(steps):
        mujoco.mj_step(model, data, finer)
        mujoco.mj_kinematics(model, data)
        rows.append(data.site_xpos[0].copy() if model.nsite else data.qpos.copy())
    return np.array(rows)


def _raw_error(text: str, integrator: str, finer: int = 8) -> float:
    """Return how far a run is from its own with finer steps, at most."""
    coarse, fine = _raw_run(text, integrator, 1), _raw_run(text, integrator, finer)
    return float(np.linalg.norm(coarse - fine, axis=1).max())


def test_a_case_that_the_run_contradicts_is_not_cited(tmp_path: Path) -> None:
    request = _asked(_written(tmp_path, SPINNING, "Euler", "implicit"))
    result = answer(ExplainRequest(request, quantity="tip", uncertainty=None, jobs=1))
    assert _raw_error(SPINNING, "Euler", 100) < _raw_error(SPINNING, "implicit", 100)
    contradicted = result.contradicted_case
    assert result.cited_case is None
    assert contradicted is not None
    assert (contradicted.left.case, contradicted.nearer) == ("tumbling-energy", "right")
    assert contradicted.in_run is not None
    assert contradicted.in_run.left == pytest.approx(_raw_error(SPINNING, "Euler"), rel=1e-6)
    assert contradicted.in_run.right == pytest.approx(_raw_error(SPINNING, "implicit"), rel=1e-6)


@pytest.mark.parametrize("details", [False, True])
def test_a_case_that_the_run_contradicts_is_a_detail(tmp_path: Path, details: bool) -> None:
    request = _asked(_written(tmp_path, SPINNING, "Euler", "implicit"))
    result = answer(ExplainRequest(request, quantity="tip", uncertainty=None, jobs=1))
    _check_first_screen(result)
    assert ("tumbling-energy" in shown(page(result, details))) == details


def test_of_a_spring_the_integrator_is_judged_by_a_spring(tmp_path: Path) -> None:
    sides = _written(tmp_path, SPRING, "RK4", "discrete")
    cited = _cited(_explained(_asked(sides, keyframe=None)))
    assert (cited.left.case, cited.nearer) == ("spring-energy", "left")
    assert cited.right.size == pytest.approx(0.865, rel=0.01)
    assert cited.in_run is not None
    assert cited.in_run.nearer == "left"
    assert cited.in_run.left == pytest.approx(_raw_error(SPRING, "RK4"), rel=1e-6)
    assert cited.in_run.right == pytest.approx(_raw_error(SPRING, "discrete"), rel=1e-6)


def test_of_a_servo_that_swings_the_integrator_is_judged_by_a_spring(tmp_path: Path) -> None:
    sides = _written(tmp_path, DRIVEN, "Euler", "discrete", timestep=0.005, kp=400, kv=1)
    cited = _cited(_explained(_asked(sides, what="waves", keyframe=None)))
    assert (cited.left.case, cited.nearer) == ("spring-energy", "left")


def test_a_servo_at_its_limit_that_errs_alike_cites_nothing(tmp_path: Path) -> None:
    sides = _written(tmp_path, SERVO, "Euler", "implicitfast", limit='forcerange="-3 3"')
    result = _explained(_asked(sides, what="hold", keyframe=None))
    assert result.cited_case is None
    assert result.contradicted_case is not None
    in_run = result.contradicted_case.in_run
    assert in_run is not None
    assert in_run.left == pytest.approx(in_run.right, rel=0.1)


@pytest.mark.parametrize("timestep", [0.003, 0.006])
def test_a_timestep_that_does_not_come_by_the_end_of_a_case_is_replaced(
    tmp_path: Path, timestep: float
) -> None:
    sides = _written(tmp_path, DRIVEN, "RK4", "discrete", timestep=timestep, kp=100, kv=20)
    cited = _cited(_explained(_asked(sides, what="waves", keyframe=None)))
    assert (cited.left.case, cited.nearer) == ("servo-step", "left")
    assert cited.left.own_timestep == timestep
    assert cited.left.timestep == pytest.approx(timestep, rel=0.03)
    assert cited.left.size < 1e-6
    assert cited.right.size > 1e-3


@pytest.mark.parametrize("timestep", [0.0005, 0.001, 0.002, 0.005, 0.01])
def test_a_case_is_run_at_a_timestep_that_comes_by_its_end(timestep: float) -> None:
    assert timestep_of_case(timestep) == timestep


def test_every_case_that_is_cited_ends_after_whole_periods(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    durations: list[float] = []
    advance = Run.advance

    def seen(run: Run, duration: float) -> float:
        durations.append(duration)
        return advance(run, duration)

    monkeypatch.setattr(Run, "advance", seen)
    names = {name for row in DECIDING_CASES for name in row.cases.values()}
    for name in names:
        measure(CASES[name], variants_of(parse_backend("mujoco"))[0], CASES[name].timesteps[0])
    assert durations
    assert all(math.isclose(10 * time, round(10 * time)) for time in durations)


IN_RUN = (
    ((0.1, 0.01), (0.1, 0.012), "right", True),
    ((0.01, 0.1), (0.1, 0.012), "left", True),
    ((0.1, 0.095), (0.1, 0.001), None, True),  # too near to each other
    ((0.1, 0.01), (0.2, 0.095), None, True),  # the finer runs are as far apart
    ((0.1, 0.01), (0.1, 0.08), "right", False),  # of two laws
)


@pytest.mark.parametrize(("errors", "gaps", "nearer", "converges"), IN_RUN)
def test_a_run_tells_which_side_is_nearer_only_clearly(
    errors: tuple[float, float], gaps: tuple[float, float], nearer: str | None, converges: bool
) -> None:
    in_run = ErrorsInRun("joints", "rad", 8, *errors, *gaps, negligible=1e-8)
    assert (in_run.nearer, in_run.converges) == (nearer, converges)


@pytest.mark.usefixtures("bullet")
def test_of_a_body_thrown_off_its_centre_pybullet_is_nearer(tmp_path: Path) -> None:
    (side,) = _tumbling(tmp_path, "Euler", centre=0.3)
    cited = _cited(_explained(_asked((side, replace(side, engine="pybullet")))))
    assert (cited.cause, cited.nearer) == ("offset centre of mass", "right")
    assert cited.left.size == pytest.approx(0.0751, rel=0.01)
    assert cited.right.size < 1e-11


@pytest.mark.slow
def test_of_a_limited_servo_the_installed_release_is_nearer(old_releases: None) -> None:
    left, right = Side("so101", engine="mujoco==3.3.7"), Side("so101", engine="mujoco")
    result = _explained(_asked((left, right), "hold", None))
    cited = _cited(result)
    assert (cited.cause, cited.nearer) == ("release", "right")
    assert cited.left.setting == "3.3.7"
    assert cited.left.case == "effort-limit"
    assert cited.left.size == pytest.approx(0.0033, rel=0.1)
    assert cited.right.size < 1e-9
    _check_first_screen(result)


def test_how_a_side_steps_is_found_once_for_all_cases(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A thrown body does not tell these integrators apart; one that tumbles does."""
    finding = Mock(side_effect=variants_of)
    monkeypatch.setattr(case_of_cause, "variants_of", finding)
    sides = _tumbling(tmp_path, "Euler", "implicitfast", centre=0.3)
    _explained(_asked(sides))
    assert finding.call_count == len(sides)


def test_an_interrupt_while_the_case_is_checked_keeps_the_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(case_of_cause, "errors_in_run", interrupted)
    with pytest.raises(InterruptedExplanation) as caught:
        _explained(_asked(_tumbling(tmp_path, "Euler", "RK4")))
    assert caught.value.result.verdict.answer == "cause"
    assert caught.value.result.cited_case is None


def test_another_mass_cites_nothing(tmp_path: Path) -> None:
    request = _sliding(tmp_path, "elliptic", "pyramidal")
    heavy = tmp_path / "heavy.xml"
    heavy.write_text(
        SLIDING.format(cone="elliptic", mass=1).replace("0.5 0 0", "0.3 0 0"), encoding="utf-8"
    )
    result = _explained(replace(request, sides=(request.sides[0], Side(str(heavy)))))
    assert result.verdict.answer == "cause"
    assert result.cited_case is None


def test_sides_that_move_alike_cite_nothing(tmp_path: Path) -> None:
    (side,) = _tumbling(tmp_path, "Euler")
    assert _explained(_asked((side, side))).cited_case is None


def test_an_integrator_that_errs_as_much_is_not_nearer(tmp_path: Path) -> None:
    hinge = """
    <mujoco><option timestep="0.005" integrator="{}"/><worldbody><body>
      <joint axis="0 1 0" damping="0.4"/>
      <inertial pos="0.2 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <body><joint axis="1 0 0"/><inertial pos="0 0.1 -0.3" mass="1" diaginertia=".1 .2 .3"/>
    </body></body></worldbody></mujoco>"""
    names = ("implicitfast", "implicit")
    folder = written_all(tmp_path, {f"{name}.xml": hinge.format(name) for name in names})
    sides = [Side(str(folder / f"{name}.xml")) for name in names]
    result = _explained(_asked(sides, keyframe=None))
    assert result.verdict.answer == "cause"
    assert result.cited_case is None


def _check_first_screen(result: ExplainResult) -> None:
    first = page(result)
    assert lines_of(first) <= LINES
    prose = [line for line in shown(first).splitlines() if not line.startswith("    ")]
    assert max(map(len, prose)) <= COLUMNS  # what is typed is not broken, and names a folder


@pytest.mark.parametrize("details", [False, True])
def test_the_page_names_the_command_of_the_case(tmp_path: Path, details: bool) -> None:
    result = _explained(_asked(_tumbling(tmp_path, "Euler", "RK4")))
    _check_first_screen(result)
    text = shown(page(result, details))
    assert "statemachine validate --case tumbling-energy" in text
    assert ("Landau" in text) == details


def test_a_page_without_a_case_says_nothing_of_one(tmp_path: Path) -> None:
    result = _explained(_asked(_tumbling(tmp_path, "Euler", "RK4")))
    assert "validate" not in shown(page(replace(result, cited_case=None), details=True))


@pytest.mark.slow
def test_the_report_names_the_command_of_the_case(tmp_path: Path, here: Cli) -> None:
    left, right = _tumbling(tmp_path, "Euler", "RK4")
    run = ("fall", left.model, right.model, "--keyframe", "home", "--seconds", "0.5")
    report = tmp_path / "report.html"
    here("compare", *run, "--no-chaos", "--html", report)
    assert "statemachine validate --case tumbling-energy" in report.read_text(encoding="utf-8")


def _side(error: float | None) -> SideInCase:
    return SideInCase("case", "RK4", "mujoco", "RK4", 0.005, 0.005, 1.0, error, "")


NEARER = (
    (0.1, -0.01, "right"),
    (-0.01, 0.1, "left"),
    (0.1, None, "left"),
    (math.inf, 0.1, "right"),
    (None, None, None),
    (0.1, -0.095, None),
    (1e-10, 1e-13, None),
)


@pytest.mark.parametrize(("left", "right", "expected"), NEARER)
def test_the_side_with_the_clearly_smaller_error_is_nearer(
    left: float | None, right: float | None, expected: str | None
) -> None:
    assert nearer_side(_side(left), _side(right), 1e-9) == expected


def test_each_row_of_the_table_names_cases_of_the_battery() -> None:
    for row in DECIDING_CASES:
        assert set(row.cases.values()) <= set(CASES)
        ValidateRequest(cases=tuple(row.cases.values()))
    assert {row.cause for row in DECIDING_CASES} == set(get_args(DecidedCause))
