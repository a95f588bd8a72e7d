"""What makes a page of a comparison again: it stands on the page, and asks the same anew."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

import pytest

from statemachine.cli.compare.options import add
from statemachine.cli.compare.requests import explain_request_of, request_of
from statemachine.lab.compare import Request, Side
from statemachine.lab.compare.perturbed import EXACT, Uncertainty
from statemachine.lab.questions.page_command import page_command
from statemachine.lab.questions.requests.causes import ExplainRequest
from statemachine.lab.questions.requests.gap import CompareRequest

from .support.files import written

BALL = (
    '<mujoco><worldbody><body name="ball"><freejoint/><geom size="1"/></body></worldbody></mujoco>'
)


def parsed(command: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add(parser)
    return parser.parse_args(shlex.split(command.replace("\\\n", " "))[2:])


@pytest.fixture
def run(tmp_path: Path) -> Request:
    """Two files in a folder, compared with options."""
    files = [str(written(tmp_path / f"{name}.xml", BALL)) for name in ("left", "right")]
    sides = Side(files[0]), Side(files[1], "pybullet", options={"timestep": 0.001})
    return Request(("fall",), sides=sides, seconds=0.3, names={"ball": "ball"}, menagerie="/a/b")


@pytest.mark.parametrize("uncertainty", [EXACT, None, Uncertainty(length=1e-4, angle=0.002)])
def test_what_is_typed_anew_asks_the_same(
    run: Request, uncertainty: Uncertainty | None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    tolerances = {"joint": 0.00872664625997165, "tip": 0.002, "base rotation": 0.1}
    request = CompareRequest(run, tolerances, uncertainty)
    causes = ExplainRequest(run, quantity="ball", uncertainty=uncertainty)
    options = parsed(page_command(request, causes, tmp_path / "page.html"))
    monkeypatch.chdir(tmp_path)
    again = request_of(options)
    assert isinstance(again, CompareRequest)
    assert again.tolerances == pytest.approx(tolerances)
    if uncertainty is None:
        assert again.uncertainty is None
    else:
        assert again.uncertainty is not None
        assert vars(again.uncertainty) == pytest.approx(vars(uncertainty))
    assert [side.options for side in again.run.sides] == [side.options for side in run.sides]
    assert [side.engine for side in again.run.sides] == ["mujoco", "pybullet"]
    assert (again.run.names, again.run.seconds) == (run.names, run.seconds)
    assert explain_request_of(options, again.run).quantity == "ball"
    assert options.html == "page.html"


@pytest.mark.parametrize("what", ["fall", lambda model, data: None])
def test_no_folder_of_this_machine_is_on_a_page(run: Request, what: object, tmp_path: Path) -> None:
    request = CompareRequest(Request((what,), sides=run.sides, menagerie="/a/b"))  # type: ignore[arg-type]
    command = page_command(request, None, tmp_path / "page.html")
    assert "/" not in command
    assert "page.html" in command
    assert "DIR" in command
