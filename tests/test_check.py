"""`statemachine check`: wrong solutions are told from right ones, and from each other."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

from statemachine.grading.examine import Verdict, judged
from statemachine.grading.judges import JUDGES, judge_of
from statemachine.grading.watch import engine_watched
from statemachine.grading.worlds import Scenes, World

from .conftest import ROOT, need_engine
from .exercises import RIGHT, WRONG, Attempt

for _name in ("gravity", "state", "forward", "replay"):
    importlib.import_module(f"tests.exercises.{_name}")

STUDENT = ROOT / "exercises" / "step_loop.py"
SOLUTION = ROOT / "exercises" / "solutions" / "step_loop.py"


def _name(attempt: Attempt) -> str:
    return attempt.name


def _verdict(attempt: Attempt, worlds: list[World]) -> Verdict:
    with engine_watched(worlds[0].model.backend):
        return judged(attempt.function, judge_of(attempt.solves), worlds)


@pytest.fixture(scope="module")
def on_pybullet(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[World]]:
    """The worlds of every judge, made once: nothing there can be changed but a Data."""
    need_engine("pybullet")
    return {
        name: judge_of(name).worlds(Scenes("pybullet", tmp_path_factory.mktemp(name)))
        for name in JUDGES
    }


def _texts(verdict: Verdict) -> list[str]:
    return [remark.text for remark in verdict.remarks]


@pytest.mark.parametrize("attempt", WRONG, ids=_name)
def test_a_wrong_solution_is_told_what_is_wrong(attempt: Attempt, tmp_path: Path) -> None:
    verdict = _verdict(attempt, judge_of(attempt.solves).worlds(Scenes("mujoco", tmp_path)))
    texts = _texts(verdict)
    assert not any(remark.holds for remark in verdict.remarks)
    assert any(attempt.message in text for text in texts), texts
    assert all("\n" not in text for text in texts)


def test_every_wrong_solution_has_a_message_of_its_own() -> None:
    assert len(WRONG) >= 16
    assert len({attempt.message for attempt in WRONG}) == len(WRONG)


@pytest.mark.parametrize("attempt", RIGHT, ids=_name)
def test_right_solutions_of_other_kinds_pass(attempt: Attempt, tmp_path: Path) -> None:
    verdict = _verdict(attempt, judge_of(attempt.solves).worlds(Scenes("mujoco", tmp_path)))
    assert all(remark.holds for remark in verdict.remarks), _texts(verdict)


@pytest.mark.slow
@pytest.mark.parametrize("attempt", [each for each in WRONG + RIGHT if not each.raw], ids=_name)
def test_pybullet_judges_alike(attempt: Attempt, on_pybullet: dict[str, list[World]]) -> None:
    texts = _texts(verdict := _verdict(attempt, on_pybullet[attempt.solves]))
    assert all(remark.holds == (attempt in RIGHT) for remark in verdict.remarks), texts
    if attempt.name != "gravity-read_after_a_step_too_many":  # near rest a step is no figure
        assert any(attempt.message in text for text in texts), texts
