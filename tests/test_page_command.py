"""What makes a page of a comparison again: it stands on the page, and asks the same anew."""

from __future__ import annotations

import argparse
import json
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from statemachine.cli import main
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
    """Return two files in a folder, compared with options."""
    files = [str(written(tmp_path / f"{name}.xml", BALL)) for name in ("left", "right")]
    sides = Side(files[0]), Side(files[1], "pybullet", options={"timestep": 0.001})
    return Request(("fall",), sides=sides, seconds=0.3, names={"ball": "ball"}, menagerie="/a/b")


UNCERTAINTIES = {
    "exact": EXACT,
    "none": None,
    "of a user": Uncertainty(length=1e-4, angle=0.002),
}
TOLERANCES = {"joint": 0.00872664625997165, "tip": 0.002, "base rotation": 0.1}


@pytest.fixture
def typed_anew(
    run: Request, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Callable[[Uncertainty | None], argparse.Namespace]:
    """Return what parses the command of a page for an uncertainty, in the folder of the page."""

    def type_anew(uncertainty: Uncertainty | None) -> argparse.Namespace:
        request = CompareRequest(run, TOLERANCES, uncertainty)
        causes = ExplainRequest(run, quantity="ball", uncertainty=uncertainty)
        options = parsed(page_command(request, causes, tmp_path / "page.html"))
        monkeypatch.chdir(tmp_path)
        return options

    return type_anew


def test_the_page_of_why_is_made_again_with_why(run: Request, tmp_path: Path) -> None:
    causes = ExplainRequest(run, measure="end")
    options = parsed(page_command(CompareRequest(run), causes, tmp_path / "p.html", insists=True))
    assert (options.why, options.measure, options.html) == (True, "end", "p.html")


def compare_request(options: argparse.Namespace) -> CompareRequest:
    """Return the request of a command for a gap."""
    request = request_of(options)
    assert isinstance(request, CompareRequest)
    return request


def test_what_is_typed_anew_has_the_same_tolerances(typed_anew) -> None:
    assert compare_request(typed_anew(EXACT)).tolerances == pytest.approx(TOLERANCES)


@pytest.mark.parametrize("name", UNCERTAINTIES)
def test_what_is_typed_anew_has_the_same_uncertainty(typed_anew, name: str) -> None:
    uncertainty = UNCERTAINTIES[name]
    again = compare_request(typed_anew(uncertainty)).uncertainty
    assert (again is None) is (uncertainty is None)
    if uncertainty is not None:
        assert vars(again) == pytest.approx(vars(uncertainty))


def test_what_is_typed_anew_runs_the_same_sides(typed_anew, run: Request) -> None:
    again = compare_request(typed_anew(EXACT)).run
    assert [side.options for side in again.sides] == [side.options for side in run.sides]
    assert [side.engine for side in again.sides] == ["mujoco", "pybullet"]
    assert (again.names, again.seconds) == (run.names, run.seconds)


def test_what_is_typed_anew_asks_for_the_causes_of_the_same_quantity(typed_anew) -> None:
    options = typed_anew(EXACT)
    assert explain_request_of(options, compare_request(options).run).quantity == "ball"


def test_what_is_typed_anew_writes_the_same_page(typed_anew) -> None:
    assert typed_anew(EXACT).html == "page.html"


@pytest.mark.parametrize("what", ["fall", lambda model, data: None])
def test_no_folder_of_this_machine_is_on_a_page(run: Request, what: object, tmp_path: Path) -> None:
    request = CompareRequest(Request((what,), sides=run.sides, menagerie="/a/b"))  # type: ignore[arg-type]
    command = page_command(request, None, tmp_path / "page.html")
    assert "/" not in command
    assert "page.html" in command
    assert "DIR" in command


def test_a_call_of_python_has_the_tolerances_and_the_uncertainty(run: Request) -> None:
    what = lambda model, data: None  # noqa: E731
    asked = CompareRequest(Request((what,), sides=run.sides), {"joint": 0.01}, None)
    command = page_command(asked, None, Path("page.html"))
    assert "tolerances={'joint': 0.01}, chaos=False" in command


def test_why_with_a_page_is_answered_in_the_terminal_and_on_the_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "why.html"
    sides = ("so101/scene", "so101/scene", "gravity=0,0,-9", "--seconds", "0.2", "--no-chaos")
    code = main(["compare", "hold", *sides, "--why", "--html", str(target), "--json"])
    (cause,) = json.loads(capsys.readouterr().out)["shares"]
    assert (code, cause["name"], cause["share"]) == (0, "gravity", pytest.approx(1.0))
    assert "localised" in target.read_text("utf-8")
