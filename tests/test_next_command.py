"""What to type after a comparison, by what came of it; and the draws of perturbed runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.interface import Model
from statemachine.lab.compare import Uncertainty, compare, perturbed_runs
from statemachine.lab.compare.instead import Instead
from statemachine.lab.compare.sides import Request, Side
from statemachine.lab.compare.typed_command import typed_command
from statemachine.lab.questions.finding import EarlyEnd, Finding, MissingPart, Rounding, finding_of
from statemachine.lab.questions.next_command import next_command
from statemachine.lab.recordings import Rerun, Trace
from statemachine.lab.runs.call_period import CallPeriods
from statemachine.lab.runs.floating import Bases

from .support.small_models import loaded
from .support.still_runs import RAIL, TURN, moved, robot, still_run


@pytest.fixture(scope="module")
def still(tmp_path_factory: pytest.TempPathFactory) -> Trace:
    return still_run(robot(tmp_path_factory.mktemp("next")))


@pytest.fixture(scope="module")
def differs(still: Trace) -> Finding:
    """Return what two runs come to that differ in the arm."""
    return finding_of(compare(still, moved(still, TURN, 1.0)), None)


TWO_FILES = Request(("hold",), sides=(Side("a.urdf"), Side("b.urdf")))


def typed(finding: Finding, request: Request = TWO_FILES, **more: Any) -> tuple[str, list[str]]:
    """Return what the command is for, and its words."""
    instead, periods = more.get("instead"), more.get("periods")
    command = next_command(request, finding, instead, periods)
    words = command.text.replace("\\\n", " ").split()
    return command.purpose, words


def test_a_difference_is_asked_for_its_causes(differs: Finding) -> None:
    purpose, words = typed(differs)
    assert purpose == "why"
    assert words[-3:] == ["--why", "--quantity", "turn"]


def test_the_short_command_leaves_the_quantity_out(differs: Finding) -> None:
    command = next_command(TWO_FILES, differs, None)
    assert command.short_text == typed_command(TWO_FILES).lines("--why")


@pytest.mark.parametrize(
    ("verdict", "purpose"),
    [
        ("as much", "one step"),
        ("no bound", "one step"),
        ("cannot be told", "why"),
        ("less", "why"),
    ],
)
def test_what_may_be_chance_is_asked_for_one_step(
    differs: Finding, verdict: Any, purpose: str
) -> None:
    assert typed(replace(differs, rounding=Rounding(verdict)))[0] == purpose


def test_timesteps_alone_are_asked_to_converge(differs: Finding) -> None:
    for options, purpose in (
        ({"timestep": 0.001}, "converge"),
        ({"substeps": 2}, "converge"),
        ({"timestep": 0.001, "damping": 1.0}, "why"),
        ({}, "why"),
    ):
        sides = (Side("a.xml"), Side("a.xml", options=options))
        assert typed(differs, Request(("hold",), sides=sides))[0] == purpose
    sides = (Side("a.xml"), Side("b.xml", options={"timestep": 0.001}))
    assert typed(differs, Request(("hold",), sides=sides))[0] == "why"


@pytest.mark.parametrize(
    ("files", "bases", "changed"),
    [
        (("a.urdf", "b.xml"), Bases("fixed", "free"), "base=free"),
        (("a.xml", "b.URDF"), Bases("fixed", "free"), "base=fixed"),
        (("a.urdf", "b.urdf"), Bases("free", "fixed"), "base=fixed"),
        (("a.xml", "b.xml"), Bases("free", "fixed"), ""),
    ],
)
def test_a_side_that_leaves_its_base_open_gets_that_of_the_other(
    differs: Finding, files: tuple[str, str], bases: Bases, changed: str
) -> None:
    request = Request(("hold",), sides=(Side(files[0]), Side(files[1])))
    purpose, words = typed(replace(differs, bases=bases), request)
    assert purpose == ("same base" if changed else "nothing")
    if changed:
        open_side = next(name for name in files if name.lower().endswith(".urdf"))
        assert words[words.index(open_side) + 1] == changed
        assert [word for word in words if word.startswith("base=")] == [changed]


def test_parts_that_a_side_lacks_are_given_by_the_other(differs: Finding) -> None:
    missing = (MissingPart("left", "floor"), MissingPart("right", "actuators"))
    purpose, words = typed(replace(differs, missing=missing))
    assert purpose == "same parts"
    assert words[-4:] == ["--floor", "right", "--actuators", "left"]


def test_a_function_is_called_as_often_first(differs: Finding) -> None:
    purpose, words = typed(differs, periods=CallPeriods(0.002, 0.004, 0.004))
    assert (purpose, words[-2:]) == ("same period", ["--every", "4ms"])
    assert typed(differs, periods=CallPeriods(0.002, 0.002, 0.002))[0] == "why"


@pytest.mark.parametrize(
    ("time", "seconds"), [(2.0, "1.8"), (0.123, "0.11"), (0.0012, "0.001"), (0.001, "")]
)
def test_what_ended_is_asked_for_nine_tenths_of_its_time(
    differs: Finding, time: float, seconds: str
) -> None:
    ends = (EarlyEnd(1, time + 1.0, "later"), EarlyEnd(0, time, "first"))
    finding = replace(differs, outcome="ended", ended=ends)
    purpose, words = typed(finding)
    assert purpose == ("why until then" if seconds else "nothing")
    if seconds:
        assert words[words.index("--seconds") + 1] == seconds
        assert words[-1] == "--why"


def test_after_agreement_comes_what_moves_more(still: Trace) -> None:
    swings = moved(still, TURN, 0.5, rows=slice(9, None))
    agrees = finding_of(compare(swings, swings), None)
    assert agrees.outcome == "agrees"
    purpose, words = typed(agrees)
    assert (purpose, words[1:3]) == ("move more", ["compare", "waves"])
    waves = replace(TWO_FILES, what=("waves",))
    assert typed(agrees, waves)[0] == "nothing"
    assert typed(replace(agrees, open_loop="differs"))[0] == "nothing"
    assert typed(replace(agrees, open_loop="agrees"))[0] == "move more"


def test_where_nothing_moved_what_moves_it_is_typed(still: Trace) -> None:
    rests = finding_of(compare(still, still), None)
    assert rests.outcome == "nothing moved"
    assert typed(rests)[0] == "nothing"
    instead = Instead(experiment="gravity", file="a.urdf", has_actuators=False)
    purpose, words = typed(rests, replace(TWO_FILES, seconds=3.0), instead=instead)
    assert (purpose, words[1:3]) == ("move at all", ["compare", "gravity"])
    assert "--seconds" not in words
    assert typed(rests, instead=replace(instead, experiment=""))[0] == "nothing"


def test_another_quantity_is_asked_for_by_its_own_name(still: Trace) -> None:
    finding = finding_of(compare(still, moved(still, RAIL, 1.0)), None)
    assert typed(finding)[1][-1] == "rail"


# Perturbed runs


@pytest.fixture
def rerun(tmp_path: Path) -> Rerun:
    """Return how a hinge, a slide and a body that floats are run."""
    text = """<body><joint name="a" axis="0 1 0"/><geom size="0.1"/></body>
    <body pos="1 0 0"><joint name="c" type="slide"/><geom size="0.1"/></body>
    <body pos="2 0 0"><freejoint/><geom size="0.1"/></body>"""
    model: Model = loaded(tmp_path, text, option='<option timestep="0.01"/>')
    return Rerun(model, lambda _: None, 0.01)


def test_of_two_perturbed_runs_one_starts_opposite_to_the_other(rerun: Rerun) -> None:
    size = Uncertainty(0.01, 0.1)
    start = rerun.start()[0]
    runs = perturbed_runs(rerun, runs=6, uncertain=size, derive=False)
    starts = [trace.qpos[0] - start for trace in runs]
    for first, second in ((0, 1), (2, 3), (4, 5)):
        assert starts[first][:5] == pytest.approx(-starts[second][:5], abs=1e-9)
    for off in starts:
        assert np.abs(off[:2]) == pytest.approx([0.1, 0.01], abs=1e-9)
        assert np.linalg.norm(off[2:5]) == pytest.approx(0.01, abs=1e-9)
    assert starts[0][2:5] != pytest.approx(starts[2][2:5], abs=1e-6)
    assert starts[2][2:5] != pytest.approx(starts[4][2:5], abs=1e-6)


def test_without_uncertainty_a_start_is_off_by_rounding(rerun: Rerun) -> None:
    for trace in perturbed_runs(rerun, runs=2, derive=False):
        off = np.abs(trace.qpos[0] - rerun.start()[0])
        assert 0 < off.max() <= 3 * rerun.model.capabilities.rounding
