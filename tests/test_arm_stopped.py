"""A Ctrl-C while the gap to a recording is divided among its causes: the fit is known by then."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from statemachine.cli import main
from statemachine.cli.common import INTERRUPTED
from statemachine.lab.identification import identify, question
from statemachine.lab.identification.results import (
    IdentificationResult,
    InterruptedIdentification,
    RecordingRequest,
)

from .support.arm_recordings import identification_result
from .support.requirements import need_engine

REQUEST = RecordingRequest("lerobot:synthetic", "so101", seconds=1.0)


def interrupted(*_: object) -> None:
    raise KeyboardInterrupt


@pytest.fixture
def fit() -> IdentificationResult:
    need_engine("mujoco")
    return replace(identification_result(), shares=(), ended_by="interrupt")


def test_the_fit_is_shown_and_no_file_written(
    fit: IdentificationResult,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def stopped(*_: object) -> None:
        raise InterruptedIdentification(fit)

    monkeypatch.setattr(question, "identify", stopped)
    page, model = tmp_path / "c.html", tmp_path / "w.xml"
    words = ["compare", "lerobot:synthetic", "so101", "--why"]
    code = main([*words, "--html", str(page), "--write", str(model)])
    printed = capsys.readouterr()
    assert code == INTERRUPTED
    assert not page.exists()
    assert not model.exists()
    assert printed.out.strip() == str(fit)


@pytest.mark.slow
def test_a_fit_without_shares_is_what_the_interrupt_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    need_engine("mujoco")
    monkeypatch.setattr(identify, "cause_shares", interrupted)
    with pytest.raises(InterruptedIdentification) as stop:
        question.answer(REQUEST)
    result = stop.value.result
    assert (result.ended_by, result.shares) == ("interrupt", ())
    assert result.gap.fitted is not None
    assert result.gap.fitted < result.gap.model
