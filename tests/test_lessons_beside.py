"""The lessons beside the path: what one step does, and which integrator keeps energy."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.backends import parse_backend
from statemachine.course.lessons import LESSONS, PATH
from statemachine.course.lessons.energy import EnergyChange, EnergyResult
from statemachine.course.lessons.program import program_of
from statemachine.course.lessons.request import LessonRequest
from statemachine.course.lessons.session import LessonRun, page_of_lesson, take
from statemachine.course.lessons.step import LINES, StepLessonResult, StepLine, step_source
from statemachine.course.lessons.step_page import ASKED
from statemachine.errors import BadInputError, MissingEngineError, UnsupportedError
from statemachine.lab.runs.scenarios import SCENARIOS
from statemachine.lab.validate.case_runs import measure
from statemachine.lab.validate.cases import CASES
from statemachine.lab.validate.stepper import StepTerms
from statemachine.lab.validate.variants import Variant
from statemachine.models import models_dir
from statemachine.show.blocks import Page, Question, Table, Verdict

from .support.pages import blocks, lesson_result, shown, with_figures
from .support.processes import Cli

BESIDE = ["step", "energy", "recording"]


@cache
def _result(name: str, backend: str = "mujoco") -> Any:
    return lesson_result(name, sm.load(LESSONS[name].model, backend=backend))


def _page(name: str, result: Any, backend: str = "mujoco") -> Page:
    run = LessonRun(result=result, code="", printed="", arm=True)
    return page_of_lesson(LESSONS[name], {backend: run})


def _right(page: Page) -> int | None:
    return blocks(page, Question)[0].right


def test_they_come_after_the_end_of_the_course() -> None:
    names = list(LESSONS)
    assert [name for name, lesson in LESSONS.items() if lesson.ends_course] == ["questions"]
    assert names[names.index("questions") + 1 :] == BESIDE
    assert not set(BESIDE) & {lesson.name for lesson in PATH}


@pytest.mark.slow
def test_one_leads_to_the_other(here: Cli, pinocchio: None) -> None:
    shown = here("lesson", "step", "--no-questions", code=0).stdout
    assert shown.rstrip().endswith("statemachine lesson energy")


# What does one step do?


@pytest.fixture
def step_result(pinocchio: None) -> StepLessonResult:
    return _result("step")


def _raw_hold(terms: str = "") -> np.ndarray:
    """Return the positions after each of 400 steps (400, 6) of the contact-free hold."""
    raw = mujoco.MjModel.from_xml_path(str(models_dir() / "so101" / "scene.xml"))
    raw.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    raw.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    if terms == "force_limits":
        raw.actuator_forcelimited[:] = False
    if terms == "gravity":
        raw.opt.gravity[:] = 0.0
    data = mujoco.MjData(raw)
    data.ctrl[:] = [0.0, -0.6, 1.2, 0.5, 0.0, 0.6]
    positions: list[np.ndarray] = []
    for _ in range(400):
        mujoco.mj_step(raw, data)
        positions.append(data.qpos.copy())
    return np.array(positions)


def test_the_second_program_makes_the_steps_of_mujoco(step_result: StepLessonResult) -> None:
    assert np.array_equal(step_result.qpos[1:], _raw_hold())
    assert step_result.whole.gap < 1e-9


@pytest.mark.parametrize("name", ["gravity", "force_limits"])
def test_what_a_line_is_worth_is_what_mujoco_loses_without_it(
    name: str, step_result: StepLessonResult
) -> None:
    difference = np.abs(_raw_hold(name) - _raw_hold()).max()
    assert step_result.gap_without(name) == pytest.approx(difference, rel=1e-6)


def test_every_line_is_left_out_once_and_is_worth_something(step_result: StepLessonResult) -> None:
    assert [row.name for row in step_result.without] == [line.name for line in LINES]
    assert all(row.gap > 1e-3 for row in step_result.without)
    assert all(row.diverged_at is None for row in step_result.without)


def test_each_line_leaves_one_term_out() -> None:
    whole = vars(StepTerms())
    for line in LINES:
        changed = [name for name, value in vars(line.terms).items() if value != whole[name]]
        assert len(changed) == 1, line.name
    assert len({repr(line.terms) for line in LINES}) == len(LINES)


def _with_gap(result: StepLessonResult, name: str, gap: float) -> StepLessonResult:
    rows = [replace(row, gap=gap) if row.name == name else row for row in result.without]
    return replace(result, without=tuple(rows))


@pytest.mark.parametrize("name", ASKED)
def test_the_right_choice_is_the_line_that_is_worth_most(
    name: str, step_result: StepLessonResult
) -> None:
    assert _right(_page("step", step_result)) == ASKED.index("force_limits")
    assert _right(_page("step", _with_gap(step_result, name, 10.0))) == ASKED.index(name)


def test_a_program_that_is_elsewhere_is_not_called_the_same(step_result: StepLessonResult) -> None:
    page = _page("step", step_result)
    far = _page("step", replace(step_result, whole=replace(step_result.whole, gap=0.1)))
    assert page.holds
    assert len(blocks(far, Verdict)) < len(blocks(page, Verdict))


def test_the_shown_lines_are_those_that_run(step_result: StepLessonResult) -> None:
    assert list(step_result.source) == step_source()
    assert step_result.source[0].startswith("def advance_once")
    assert '"""' not in "".join(step_result.source)
    assert any("np.linalg.solve" in line for line in step_result.source)


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_the_steps_of_pybullet_are_near(pinocchio: None) -> None:
    result = _result("step", "pybullet")
    assert result.whole.gap < 1e-6
    assert result.whole.gap < min(row.gap for row in result.without)


def test_a_run_that_diverges_says_when(pinocchio: None, monkeypatch: pytest.MonkeyPatch) -> None:
    explicit = StepLine("damping", "", StepTerms(damping="explicit", armature=False))
    monkeypatch.setattr("statemachine.course.lessons.step.LINES", (explicit,))
    (row,) = lesson_result("step", sm.load("so101/scene").replace(timestep=0.02)).without
    assert row.diverged_at is not None
    assert 0 < row.diverged_at < 2.0


def test_a_robot_that_the_program_does_not_step_is_refused(pinocchio: None) -> None:
    with pytest.raises(UnsupportedError):
        lesson_result("step", sm.load("so101/scene_box"))


LINK = """
<mujoco>
  <option timestep="0.005" {integrator}/>
  <worldbody>
    <body>
      <joint name="joint" type="{kind}" axis="{axis}" damping="1"/>
      <inertial pos="0 0 -0.3" mass="1" diaginertia="0.01 0.02 0.03"/>
    </body>
  </worldbody>
  {actuator}
</mujoco>
"""
SERVO = '<actuator><position joint="joint" kp="20" kv="1"/></actuator>'


def _link(
    folder: Path, kind: str = "hinge", integrator: str = "", actuator: str = SERVO
) -> sm.Model:
    axis = "0 0 1" if kind == "slide" else "0 1 0"
    text = LINK.format(kind=kind, axis=axis, integrator=integrator, actuator=actuator)
    path = folder / "link.xml"
    path.write_text(text, encoding="utf-8")
    return sm.load(path)


@pytest.mark.parametrize("integrator", ["", 'integrator="RK4"'])
def test_a_file_with_another_integrator_is_run_with_that_of_the_program(
    integrator: str, tmp_path: Path, pinocchio: None
) -> None:
    model = _link(tmp_path, integrator=integrator)
    result = lesson_result("step", model)
    assert result.whole.gap < 1e-12
    raw = mujoco.MjModel.from_xml_path(str(model.path))
    raw.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    data = mujoco.MjData(raw)
    taken = take(LESSONS["step"], model, "mujoco")
    data.ctrl[:] = float(taken.code.partition("ctrl[:] = [")[2].partition("]")[0])
    mujoco.mj_step(raw, data, result.steps)
    assert np.array_equal(result.qpos[-1], data.qpos)


def test_the_code_says_that_it_takes_another_integrator(tmp_path: Path, pinocchio: None) -> None:
    other = take(LESSONS["step"], _link(tmp_path), "mujoco").code
    own = take(LESSONS["step"], _link(tmp_path, integrator='integrator="implicitfast"'), "mujoco")
    assert "Euler" in other
    assert 'integrator="implicitfast"' in other
    assert "integrator" not in own.code


def test_what_a_slide_is_off_by_is_a_length(tmp_path: Path, pinocchio: None) -> None:
    result = lesson_result("step", _link(tmp_path, "slide"))
    row = next(row for row in result.without if row.name == "gravity")
    assert row.slide
    table = next(t for t in blocks(_page("step", result), Table) if len(t.rows) > len(LINES))
    cell = next(cells for cells in table.rows if cells[0] == "gravity")[2]
    assert cell == f"{1000.0 * row.gap:.3f} mm"
    assert not any("°" in cell for cells in table.rows for cell in cells)


@pytest.mark.parametrize("engines", [("mujoco",), ("mujoco", "pybullet")])
def test_each_row_of_the_lines_has_a_cell_below_each_head(
    step_result: StepLessonResult, engines: tuple[str, ...]
) -> None:
    run = LessonRun(result=step_result, code="", printed="", arm=True)
    page = page_of_lesson(LESSONS["step"], dict.fromkeys(engines, run))
    table = next(t for t in blocks(page, Table) if len(t.rows) > len(LINES))
    assert {len(row) for row in table.rows} == {len(table.headers)}


@pytest.mark.parametrize("lesson", ["step", "hold", "gravity"])
def test_a_robot_without_servos_is_told_an_experiment_that_there_is(
    lesson: str, tmp_path: Path, pinocchio: None
) -> None:
    for actuator in ("", '<actuator><motor joint="joint"/></actuator>'):
        model = _link(tmp_path, actuator=actuator)
        with pytest.raises(BadInputError) as caught:
            lesson_result(lesson, model)
        name = str(caught.value).partition("statemachine compare ")[2].split()[0]
        assert SCENARIOS[name].on(model).name == name


def test_a_robot_of_ball_joints_is_not_called_one_without_names(tmp_path: Path) -> None:
    with pytest.raises(BadInputError) as caught:
        lesson_result("forward", _link(tmp_path, "ball", actuator=""))
    assert "ball" in str(caught.value).replace("link.xml", "")


def test_without_pinocchio_the_lesson_says_what_to_install(
    scene: sm.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    with pytest.raises(MissingEngineError, match="pip install"):
        lesson_result("step", scene)


# Which integrator keeps energy?

ALL_OF_MUJOCO = ("Euler", "implicit", "implicitfast", "RK4", "discrete")


def _row(result: EnergyResult, body: str, integrator: str) -> EnergyChange:
    return next(row for row in result.of_body(body) if row.integrator == integrator)


def test_the_model_is_that_of_the_battery_s_case() -> None:
    raw = mujoco.MjModel.from_xml_path(str(models_dir() / "tumbling" / "tumbling.xml"))
    case = mujoco.MjModel.from_xml_string(CASES["tumbling-energy"].model_text(0.005, "Euler"))
    for field in ("body_mass", "body_inertia", "body_ipos", "body_iquat", "jnt_type"):
        assert np.array_equal(getattr(raw, field), getattr(case, field))
    assert raw.opt.timestep == case.opt.timestep
    assert raw.opt.integrator == case.opt.integrator
    assert not raw.opt.gravity.any()


def test_the_typed_program_changes_the_energy_as_plain_mujoco_does() -> None:
    raw = mujoco.MjModel.from_xml_path(str(models_dir() / "tumbling" / "tumbling.xml"))
    data = mujoco.MjData(raw)
    mujoco.mj_resetDataKeyframe(raw, data, 0)
    inertia = np.array([1.0, 2.0, 3.0])
    start = inertia @ data.qvel[3:] ** 2
    mujoco.mj_step(raw, data, 4000)
    expected = float(inertia @ data.qvel[3:] ** 2 / start - 1.0)
    assert _result("energy").change == expected
    assert expected == pytest.approx(0.126, abs=0.002)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
def test_the_tumbling_body_is_that_of_the_battery(integrator: Any) -> None:
    row = _row(_result("energy"), "tumbling", integrator)
    variant = Variant(parse_backend("mujoco"), integrator)
    for timestep, change in zip((0.005, 0.002, 0.001), row.by_timestep, strict=True):
        expected = measure(CASES["tumbling-energy"], variant, timestep).error
        assert change == pytest.approx(expected, rel=0.05, abs=1e-9)


def test_the_spring_is_that_of_the_battery() -> None:
    for integrator in ("Euler", "discrete", "RK4"):
        row = _row(_result("energy"), "spring", integrator)
        variant = Variant(parse_backend("mujoco"), integrator)
        expected = measure(CASES["spring-energy"], variant, 0.005).error
        assert row.longest == pytest.approx(expected, rel=1e-2)


def test_the_pendulum_gains_by_phase_and_rk4_keeps_it() -> None:
    result = _result("energy")
    assert abs(_row(result, "pendulum", "RK4").longest) < 1e-8
    for integrator in ("Euler", "implicitfast"):
        assert 0.003 < abs(_row(result, "pendulum", integrator).longest) < 0.01


def test_all_integrators_of_the_installed_release_have_a_row() -> None:
    rows = _result("energy").of_body("tumbling")
    assert tuple(row.integrator for row in rows) == ALL_OF_MUJOCO
    assert all(row.is_supported for row in rows)


def test_orders_are_those_of_the_integrators() -> None:
    result = _result("energy")
    euler, rk4 = _row(result, "tumbling", "Euler").order, _row(result, "tumbling", "RK4").order
    assert euler == pytest.approx(1.0, abs=0.1)
    assert rk4 is not None
    assert rk4 > 3.5


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_what_pybullet_lacks_is_unsupported_in_its_row() -> None:
    result = _result("energy", "pybullet")
    supported = [row.integrator for row in result.of_body("tumbling") if row.is_supported]
    assert supported == ["Euler", "implicitfast"]
    table = blocks(_page("energy", result, "pybullet"), Table)[0]
    by_integrator = {row[0]: set(row[1:]) for row in table.rows}
    assert by_integrator["RK4"] == {"unsupported"}
    assert "unsupported" not in by_integrator["Euler"]


@pytest.mark.parametrize(("change", "right"), [(0.126, 2), (-0.1, 1), (0.0005, 0)])
def test_the_right_choice_is_what_became_of_the_energy(change: float, right: int) -> None:
    assert _right(_page("energy", with_figures(_result("energy"), change=change))) == right


def test_a_run_that_ends_elsewhere_fails_its_claim() -> None:
    result = _result("energy")
    assert _page("energy", result).holds
    assert not _page("energy", with_figures(result, change=result.change + 0.01)).holds


def test_an_integrator_that_gets_worse_with_shorter_steps_fails_its_claim() -> None:
    result = _result("energy")
    worse = tuple(replace(row, by_timestep=row.by_timestep[::-1]) for row in result.rows)
    assert not _page("energy", replace(result, rows=worse)).holds


def test_a_longer_run_than_was_measured_makes_no_claim_about_it() -> None:
    result = _result("energy")
    longer = _page("energy", replace(result, seconds=result.seconds + 0.1))
    assert len(blocks(longer, Verdict)) == len(blocks(_page("energy", result), Verdict)) - 1


def test_the_simulated_time_acts_on_every_run() -> None:
    result = lesson_result("energy", sm.load("tumbling"), seconds=3.0)
    assert [row.seconds for row in result.rows[::5]] == [1.5, 1.5, 3.0]
    assert result.window == 1.5
    assert _row(result, "tumbling", "Euler").times[-1] == pytest.approx(3.0)
    raw = mujoco.MjModel.from_xml_path(str(models_dir() / "tumbling" / "tumbling.xml"))
    raw.opt.timestep = 0.001
    data = mujoco.MjData(raw)
    data.qvel[3:] = [0.01, 5.0, 0.01]
    inertia = np.array([1.0, 2.0, 3.0])
    start, worst = float(inertia @ data.qvel[3:] ** 2), 0.0
    for step in range(3000):
        mujoco.mj_step(raw, data)
        if step + 1 >= 1500:
            worst = max(worst, float(inertia @ data.qvel[3:] ** 2) / start - 1.0, key=abs)
    assert _row(result, "tumbling", "Euler").by_timestep[2] == pytest.approx(worst, rel=1e-9)
    headers = [table.headers for table in blocks(_page("energy", result), Table)]
    assert headers[1][-1] == "3 s"


def test_of_a_time_without_an_error_no_claim_fails() -> None:
    assert _page("energy", lesson_result("energy", sm.load("tumbling"), seconds=0.013)).holds


@pytest.mark.parametrize("backend", ["mujoco", "without RK4"])
def test_what_rk4_costs_is_said_where_it_is_in_the_table(backend: str) -> None:
    result = _result("energy")
    if backend != "mujoco":
        rows = [replace(row, is_supported=row.integrator != "RK4") for row in result.rows]
        result = replace(result, rows=tuple(rows))
    assert ("about four times as much" in shown(_page("energy", result))) == (backend == "mujoco")


def test_another_model_is_refused(scene: sm.Model) -> None:
    with pytest.raises(BadInputError, match="tumbling"):
        lesson_result("energy", scene)


@pytest.mark.slow
def test_the_text_is_shown_though_the_body_is_no_arm() -> None:
    taken = take(LESSONS["energy"], sm.load("tumbling"), "mujoco")
    page = page_of_lesson(LESSONS["energy"], {"mujoco": taken})
    assert blocks(page, Question)
    assert LESSONS["energy"].question in page.title


@pytest.mark.slow
def test_the_lesson_has_a_picture(tmp_path: Path, here: Cli, matplotlib: Any) -> None:
    file = tmp_path / "energy.svg"
    here("lesson", "energy", "--plot", file, "--no-questions", code=0)
    assert file.read_text(encoding="utf-8").startswith("<?xml")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["step", "energy"])
def test_the_result_is_json(name: str, here: Cli, pinocchio: None) -> None:
    figures = json.loads(here("lesson", name, "--json", code=0).stdout)["mujoco"]
    assert figures["provenance"]["backend"] == "mujoco"


def test_a_lesson_without_a_program_says_so() -> None:
    with pytest.raises(BadInputError, match="no program"):
        program_of(LessonRequest("questions"))


@pytest.mark.parametrize("name", [name for name in LESSONS if name != "questions"])
def test_every_other_lesson_has_a_program(name: str, pinocchio: None) -> None:
    assert program_of(LessonRequest(name)).count("\n") > 2


def test_a_request_takes_their_options() -> None:
    assert LessonRequest("energy", options={"seconds": 1.0}).values["seconds"] == 1.0
    assert LessonRequest("step").is_plain
