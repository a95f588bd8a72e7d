"""Releases that are asked about from Python: what becomes of the arguments, and what is written."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import statemachine as sm
from statemachine.errors import BadInputError
from statemachine.lab.ask import pages, releases
from statemachine.lab.questions.requests.versions import VersionsRequest, VersionsResult


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[VersionsRequest, Any]]:
    """Let nothing be run; return what was to be."""
    calls: list[tuple[VersionsRequest, Any]] = []

    def noted(request: VersionsRequest, reporter: Any) -> Any:
        calls.append((request, reporter))
        return len(calls)

    monkeypatch.setattr(releases, "answer", noted)
    return calls


@pytest.mark.parametrize("typed", ["3.1.6,3.3.7", ("3.1.6", "3.3.7"), ["3.1.6", "3.3.7"]])
def test_releases_are_named_with_commas_or_one_by_one(
    typed: Any, asked: list[tuple[VersionsRequest, Any]]
) -> None:
    assert releases.versions("so101", releases=typed, what="hold") == 1
    ((request, _),) = asked
    assert (request.versions, request.bisect) == ("3.1.6,3.3.7", False)


def test_what_is_run_is_what_was_said(asked: list[tuple[VersionsRequest, Any]]) -> None:
    reporter: Any = SimpleNamespace()
    releases.versions(
        "so101",
        releases="3.1.6",
        bisect=True,
        what="hold",
        seconds=0.5,
        timestep=0.001,
        seed=7,
        tolerances={"joint": 0.25},
        reporter=reporter,
    )
    ((request, told),) = asked
    run = request.run
    assert told is reporter
    assert request.bisect
    assert (run.seconds, run.seed) == (0.5, 7)
    assert list(request.tolerances.values()) == [0.25]


def test_a_request_is_asked_as_it_is(asked: list[tuple[VersionsRequest, Any]]) -> None:
    releases.versions("so101", releases="3.1.6", what="hold")
    request = asked[0][0]
    releases.versions(request)
    assert asked[1][0] is request


def test_beside_a_request_nothing_else_is_said(asked: list[tuple[VersionsRequest, Any]]) -> None:
    releases.versions("so101", releases="3.1.6", what="hold")
    with pytest.raises(BadInputError):
        releases.versions(asked[0][0], seconds=1.0)
    assert len(asked) == 1


@pytest.mark.parametrize("typed", ["", (), []])
def test_without_releases_nothing_is_asked(
    typed: Any, asked: list[tuple[VersionsRequest, Any]]
) -> None:
    with pytest.raises(BadInputError):
        releases.versions("so101", releases=typed, what="hold")
    assert asked == []


def test_of_a_loaded_model_its_file_is_run(asked: list[tuple[VersionsRequest, Any]]) -> None:
    model = sm.load("so101")
    releases.versions(model, releases="3.1.6", what="hold")
    run: Any = asked[0][0].run
    assert not isinstance(run.model, sm.Model)
    assert run.model is not None or run.sides


# What is written of an answer.


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Let nothing be drawn; return what was to be."""
    calls: dict[str, Any] = {}
    monkeypatch.setattr(pages, "write_pictures", lambda *given: calls.update(pictures=given))
    monkeypatch.setattr(pages, "write_tests", lambda *given: calls.update(tests=given))
    return calls


class _Result(VersionsResult):
    """An answer with a page of two blocks."""

    def __init__(self) -> None:
        """Ask nothing."""
        vars(self).update(pairs=(SimpleNamespace(comparison="a"), SimpleNamespace(comparison="b")))

    def page(self, details: bool = False) -> Any:
        del details
        return SimpleNamespace(blocks=("one", "two"))


@pytest.mark.parametrize("suffix", [".svg", ".png", ".PDF"])
@pytest.mark.usefixtures("matplotlib")
def test_a_figure_of_releases_is_the_pictures_of_its_page(
    suffix: str, drawn: dict[str, Any], tmp_path: Path
) -> None:
    file = tmp_path / f"a{suffix}"
    assert pages.write(_Result(), file) == file
    assert drawn == {"pictures": (("one", "two"), file)}


def test_a_report_of_releases_has_all_their_comparisons(
    drawn: dict[str, Any], tmp_path: Path
) -> None:
    file = tmp_path / "a.xml"
    assert pages.write(_Result(), str(file)) == file
    assert drawn == {"tests": (file, ("a", "b"))}


@pytest.mark.parametrize("suffix", [".html", ".webp", ".txt", ""])
def test_of_releases_there_is_no_page_and_no_film(
    suffix: str, drawn: dict[str, Any], tmp_path: Path
) -> None:
    with pytest.raises(BadInputError):
        pages.write(_Result(), tmp_path / f"a{suffix}")
    assert drawn == {}


@pytest.mark.parametrize("suffix", [".svg", ".xml"])
@pytest.mark.usefixtures("drawn", "matplotlib")
def test_a_file_of_releases_needs_its_folder(suffix: str, tmp_path: Path) -> None:
    with pytest.raises(sm.errors.StateMachineError):
        pages.write(_Result(), tmp_path / "none" / f"a{suffix}")
