"""`--why` where an option of the right side makes a difference, and not its file."""

from __future__ import annotations

from pathlib import Path

import pytest

from statemachine.lab.compare import Request, Side
from statemachine.lab.questions.requests.causes import ExplainRequest, ExplainResult, answer
from statemachine.lab.why import Share
from statemachine.lab.why.table_page import summary_table
from statemachine.show.blocks import Code

from .support.explained import ARM
from .support.files import written

OTHER_DAMPING = ARM.replace('axis="0 1 0"/>', 'axis="0 1 0" damping="0.1"/>', 1).replace(
    'name="elbow" axis="0 1 0" damping="0.1"', 'name="elbow" axis="0 1 0" damping="0.4"'
)


def explained(left: Side, right: Side, write: Path | None = None) -> ExplainResult:
    run = Request(["waves"], sides=(left, right), seconds=0.3)
    return answer(ExplainRequest(run, uncertainty=None, jobs=1, write=write))


def share_of(result: ExplainResult, word: str) -> Share:
    return next(row for row in result.shares if word in row.name)


@pytest.fixture
def arm(tmp_path: Path) -> str:
    return str(written(tmp_path / "arm.xml", ARM))


@pytest.fixture
def damped(tmp_path: Path) -> str:
    return str(written(tmp_path / "damped.xml", OTHER_DAMPING))


def test_a_cause_that_an_option_makes_names_the_option_and_no_line(arm: str) -> None:
    result = explained(Side(arm), Side(arm, options={"kp": 12}))
    (row,) = result.shares
    assert (row.option, row.place, row.changes) == ("kp=12", None, ())
    assert summary_table(result, 3).rows[0][4] == "kp=12"


@pytest.mark.parametrize("option", [{"timestep": 0.001}, {"gravity": (0, 0, -9.0)}, {"kp": 12}])
def test_only_what_an_option_makes_names_it(
    arm: str, damped: str, option: dict[str, float]
) -> None:
    result = explained(Side(arm), Side(damped, options=option))
    (name,) = option
    makes = {row.name for row in result.shares if row.option.startswith(f"{name}=")}
    assert len(result.shares) == 2
    assert makes == {row.name for row in result.shares} - {share_of(result, "damping").name}


def test_an_option_of_the_left_can_be_written_into_the_right_file(arm: str, tmp_path: Path) -> None:
    target = tmp_path / "fixed.xml"
    result = explained(Side(arm, options={"kp": 12}), Side(arm), target)
    assert result.rewritten is not None
    assert result.rewritten.gap == pytest.approx(0, abs=1e-9)
    assert result.page().holds


def test_what_an_option_makes_is_not_written_and_no_file_is(arm: str, tmp_path: Path) -> None:
    target = tmp_path / "fixed.xml"
    result = explained(Side(arm), Side(arm, options={"kp": 12}), target)
    assert result.nothing_written
    assert not target.exists()
    assert not result.page().holds


def test_what_is_typed_next_has_not_the_option_that_makes_the_cause(arm: str) -> None:
    result = explained(Side(arm, options={"kp": 12}), Side(arm, options={"kp": 15}))
    command = result.page().blocks[-1]
    assert isinstance(command, Code)
    words = " ".join(command.lines).split()
    assert "kp=12" in words
    assert "kp=15" not in words
