"""How often a function of the user's is called on two sides: in steps, or once in a time."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from statemachine import lab
from statemachine.errors import BadInputError
from statemachine.lab.questions.requests.causes import ExplainResult
from statemachine.lab.questions.requests.gap import CompareResult
from statemachine.lab.runs.call_period import call_periods, every_of_word, steps_of
from statemachine.lab.shown_result import ShownResult
from statemachine.lab.why.trials import Trials

from .support.processes import Cli

_SCENE = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body>
      <joint name="j" type="hinge" axis="0 1 0" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0 0 -.3" size=".02" mass="1"/>
    </body>
  </worldbody>
  <actuator><position name="j" joint="j" kp="20"/></actuator>
</mujoco>
"""
# Its state grows with each call, so that its command depends on how often it is called.
_RATE = """
total = 0.0

def rate(model, data):
    global total
    total += 0.005
    return [min(total, 1.0)]
"""
_SECONDS = 0.5


@pytest.fixture
def files(tmp_path: Path) -> Path:
    (tmp_path / "scene.xml").write_text(_SCENE)
    (tmp_path / "rate.py").write_text(_RATE)
    return tmp_path


def _raw_path(timestep: float, period: float) -> np.ndarray:
    """Return qpos at each 5 ms, of a run of MuJoCo itself."""
    model = mujoco.MjModel.from_xml_string(_SCENE)
    model.opt.timestep = timestep
    data = mujoco.MjData(model)
    each, hold, total, path = round(0.005 / timestep), round(period / timestep), 0.0, [0.0]
    for k in range(round(_SECONDS / timestep)):
        if k % hold == 0:
            total += 0.005
            data.ctrl[0] = min(total, 1.0)
        mujoco.mj_step(model, data)
        if (k + 1) % each == 0:
            path.append(data.qpos[0])
    return np.array(path)


def _raw_gap(left_period: float, right_period: float) -> float:
    """Return the largest gap between timesteps of 5 ms and 1 ms [rad]."""
    left, right = _raw_path(0.005, left_period), _raw_path(0.001, right_period)
    return float(np.abs(left - right).max())


def _compared(files: Path, every: int | str) -> CompareResult:
    scene = files / "scene.xml"
    return lab.compare(
        f"{scene} timestep=0.005",
        f"{scene} timestep=0.001",
        what=f"{files / 'rate.py'}:rate",
        seconds=_SECONDS,
        every=every,
        chaos=False,
    )


def _words(result: ShownResult) -> str:
    """Return the first screen in one line."""
    return " ".join(result.text().replace("\\\n", "").split())


def _gap(result: CompareResult) -> float:
    return next(row.max for row in result.comparison.agreements if row.name == "j")


@pytest.mark.parametrize(
    ("every", "periods"), [(1, (0.005, 0.001)), (5, (0.025, 0.005)), ("5ms", (0.005, 0.005))]
)
def test_the_gap_is_that_of_mujoco_with_these_periods(
    files: Path, every: int | str, periods: tuple[float, float]
) -> None:
    result = _compared(files, every)
    assert result.call_periods is not None
    assert (result.call_periods.left, result.call_periods.right) == pytest.approx(periods)
    assert _gap(result) == pytest.approx(_raw_gap(*periods), rel=1e-9)


def test_most_of_the_gap_is_the_period_and_not_the_timestep(files: Path) -> None:
    assert _gap(_compared(files, "5ms")) < 0.02 * _gap(_compared(files, 1))


def test_the_first_screen_says_both_periods_before_the_worst_rows(files: Path) -> None:
    text = _words(_compared(files, 5))
    assert 0 < text.index("25 ms") < text.index(" 5 ms") < text.index("the worst")


def test_the_first_screen_proposes_the_same_period_where_they_differ(files: Path) -> None:
    text = _words(_compared(files, 5))
    assert "--every 5ms" in text
    assert "timestep differs" not in text


def test_with_the_same_period_nothing_but_the_timestep_differs(files: Path) -> None:
    text = _words(_compared(files, "5ms"))
    assert "timestep differs" in text
    assert "25 ms" not in text


def _explained(files: Path, every: int | str) -> ExplainResult:
    return lab.why(
        f"{files / 'scene.xml'} timestep=0.005",
        f"{files / 'scene.xml'} timestep=0.001",
        what=f"{files / 'rate.py'}:rate",
        seconds=_SECONDS,
        every=every,
        chaos=False,
    )


@pytest.mark.parametrize(
    ("every", "name"),
    [(1, "timestep, and the period of the function with it"), ("5ms", "timestep")],
)
def test_the_cause_is_called_by_all_that_is_equalized_with_it(
    files: Path, every: int | str, name: str
) -> None:
    (share,) = _explained(files, every).shares
    assert share.name == name
    assert share.share == pytest.approx(1.0)


@pytest.mark.parametrize(("every", "differ"), [(1, True), ("5ms", False)])
def test_the_page_of_causes_says_both_periods_where_they_differ(
    files: Path, every: int | str, differ: bool
) -> None:
    words = _words(_explained(files, every))
    assert ("every 1 ms" in words) == differ
    assert "--every 5ms --why" in words


@pytest.mark.parametrize("every", [5, "10ms"])
def test_finer_steps_are_asked_for_with_the_period_that_was_compared(
    files: Path, every: int | str
) -> None:
    scene = files / "scene.xml"
    result = lab.converge(
        f"{scene} timestep=0.002", f"{scene} timestep=0.002 substeps=2",
        what=f"{files / 'rate.py'}:rate", seconds=_SECONDS, every=every,
    )  # fmt: skip
    assert result.state == "vanishes"
    words = _words(result)
    assert "timestep=0.0005" in words
    assert "--every 10ms" in words


def test_periods_that_differ_stand_on_the_page_of_finer_steps(files: Path) -> None:
    scene = files / "scene.xml"
    result = lab.converge(
        f"{scene} timestep=0.005", f"{scene} timestep=0.001",
        what=f"{files / 'rate.py'}:rate", seconds=_SECONDS, every=5,
    )  # fmt: skip
    words = _words(result)
    assert "25 ms" in words
    assert "--every 5ms --converge" in words


@pytest.mark.parametrize(
    ("every", "timesteps", "common"),
    [
        (1, (0.005, 0.001), 0.005),
        (5, (0.005, 0.001), 0.005),
        (1, (1 / 240, 0.002), 0.05),
        (6, (1 / 240, 0.002), 0.05),
        ("50ms", (1 / 240, 0.002), 0.05),
    ],
)
def test_the_common_period_is_whole_on_both_sides(
    every: int | str, timesteps: tuple[float, float], common: float
) -> None:
    periods = call_periods(every, timesteps)
    assert periods.common == pytest.approx(common)
    for timestep in timesteps:
        assert steps_of(periods.common_word, timestep) == round(common / timestep)


@pytest.mark.parametrize("every", ["7ms", "1ms", "5deg", "5", "0ms", "-5ms", "x", "nans"])
def test_a_period_that_no_side_can_have_is_refused(files: Path, every: str) -> None:
    with pytest.raises(BadInputError):
        _compared(files, every)


@pytest.mark.parametrize(("word", "every"), [("5", 5), ("5ms", "5ms")])
def test_every_is_typed_as_steps_or_as_a_time(word: str, every: int | str) -> None:
    assert every_of_word(word) == every


@pytest.mark.parametrize("word", ["0", "-1", "2.5", "ms", "5kg"])
def test_what_is_neither_steps_nor_a_time_is_refused(word: str) -> None:
    with pytest.raises(BadInputError):
        every_of_word(word)


def test_a_time_is_a_number_of_steps() -> None:
    assert math.isclose(steps_of("0.005s", 0.001), 5)


@pytest.mark.usefixtures("files")
def test_the_command_takes_a_time(here: Cli) -> None:
    words = ("rate.py:rate", "scene.xml", "timestep=0.005", "scene.xml", "timestep=0.001")
    refused = here("compare", *words, "--every", "7ms", "--seconds", "0.1")
    assert refused.returncode == 2
    assert "1.4 steps" in refused.stderr


_HINTS = """
from textwrap import dedent

def writes(model, data):
    data.qpos[:] = 0.3

def follows(model, data):
    return [0.1]
"""


@pytest.mark.parametrize(("name", "says_so"), [("writes", True), ("follows", False)])
def test_that_a_function_writes_the_state_stands_on_the_first_screen(
    files: Path, name: str, says_so: bool
) -> None:
    (files / "hints.py").write_text(_HINTS)
    scene = str(files / "scene.xml")
    what = f"{files / 'hints.py'}:{name}"
    result = lab.compare(scene, scene, what=what, seconds=0.05, chaos=False)
    assert ("51 of 51" in _words(result)) == says_so


def test_only_functions_of_the_file_are_proposed(files: Path) -> None:
    (files / "hints.py").write_text(_HINTS)
    scene = str(files / "scene.xml")
    with pytest.raises(BadInputError) as refused:
        lab.compare(scene, scene, what=f"{files / 'hints.py'}:dedant", seconds=0.05)
    assert "dedent" not in str(refused.value)


def test_an_answer_that_is_given_as_a_side_names_what_was_run(files: Path) -> None:
    result = _compared(files, "5ms")
    with pytest.raises(BadInputError, match=r"lab\.why\(result\.request\.run\)"):
        lab.why(result)  # type: ignore[arg-type]
    assert lab.why(result.request.run, chaos=False).shares[0].name == "timestep"


def test_a_stop_before_any_run_prints_no_page(
    files: Path, here: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(_trials: Trials, _equalized: frozenset[str]) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Trials, "gaps", stop)
    monkeypatch.chdir(files)
    run = here("compare", "waves", "scene.xml", "scene.xml", "timestep=0.002", "--why")
    assert (run.returncode, run.stdout) == (130, "")
    assert "stopped before" in run.stderr
