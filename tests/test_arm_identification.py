"""Synthetic recordings, fitted as a user has them fitted: what is called determined is true."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from statemachine.lab.identification.identify import identify
from statemachine.lab.identification.results import IdentificationResult, RecordingRequest
from tools.arm_recordings.arm_truth import Fault
from tools.arm_recordings.plans import SHIPPED_FOLDER
from tools.arm_recordings.recordings import Plan, make, write
from tools.arm_recordings.score import ScoredRecording, score_of, scored

pytest.importorskip("pyarrow")
pytest.importorskip("scipy")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def shipped() -> IdentificationResult:
    return identify(RecordingRequest("lerobot:synthetic", "so101"))


def test_the_gap_is_closed_on_what_was_not_fitted(shipped):
    assert shipped.gap.model > np.radians(5.0)
    assert shipped.gap.fitted < np.radians(0.08)
    assert shipped.holds


def test_most_of_what_counts_is_determined_and_true(shipped):
    truth = json.loads((SHIPPED_FOLDER / "truth.json").read_text())
    keys = {"friction": "frictionloss"}
    inside: list[bool] = []
    for each in shipped.parameters:
        figures = truth[keys.get(each.kind, each.kind)]
        figure = figures if each.joint is None else figures[truth["joints"].index(each.joint)]
        if each.verdict == "determined":
            inside.append(each.low <= figure <= each.high)
    assert len(inside) >= 20
    assert np.mean(inside) >= 0.85


def test_of_the_vertical_axis_the_offset_is_not_determined(shipped):
    offsets = {each.joint: each for each in shipped.parameters if each.kind == "offset"}
    assert offsets["shoulder_pan"].verdict == "cannot tell"
    assert offsets["shoulder_pan"].motion == ""


def test_delay_and_gains_explain_nearly_all_and_stand_in_for_each_other(shipped):
    shares = {each.cause: each for each in shipped.shares}
    assert shares["delay"].share + shares["gains"].share > 0.9
    assert shares["delay"].alone + shares["gains"].alone > 1.1


def test_the_model_of_the_fit_has_its_gains(shipped):
    gains = [each.fitted for each in shipped.parameters if each.kind == "kp"]
    assert shipped.fitted_arm.actuator_kp == pytest.approx(gains)


@pytest.fixture(scope="module")
def by_hand(tmp_path_factory) -> ScoredRecording:
    return _scored(
        tmp_path_factory.mktemp("hand"), Plan("hand-7", motion="hand", seed=7, seconds=7.0)
    )


def test_what_a_hand_like_motion_determines_is_true(by_hand):
    score = score_of([by_hand])
    assert score.determined > 0.3
    assert score.covered >= 0.8
    assert score.width < 3.0


def test_the_wrong_sign_of_a_joint_is_found(tmp_path):
    plan = Plan("sign-3", seed=3, fault=Fault(reversed_joint="elbow_flex"), seconds=5.0)
    write(make(plan), tmp_path / plan.name)
    result = identify(RecordingRequest(f"lerobot:{tmp_path / plan.name}", "so101"))
    verdicts = {each.name: each.verdict for each in result.hypotheses}
    assert not result.at_floor
    assert verdicts["the other sign of elbow_flex"] == "fits better"
    assert all(each.verdict == "cannot tell" for each in result.parameters)


def _scored(folder: Path, plan: Plan) -> ScoredRecording:
    write(make(plan), folder / plan.name)
    return scored(folder / plan.name)
