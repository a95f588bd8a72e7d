"""A recording of an arm behind `statemachine compare`: what goes with it, and what it asks."""

from __future__ import annotations

import argparse
import errno
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from statemachine import cli, lab
from statemachine.cli.compare.recordings import OPTIONS_OF_RECORDINGS, recording_request_of
from statemachine.errors import BadInputError, StateMachineError
from statemachine.lab.compare.typed_sides import split_words
from statemachine.lab.identification import arm_report, question, recorded_gap
from statemachine.lab.identification.results import (
    IdentificationResult,
    RecordingRequest,
)
from statemachine.lab.recordings.arm_recording import is_arm_recording
from tools.arm_recordings.plans import SHIPPED_FOLDER

from .support.arm_recordings import identification_result, recording_result, request
from .support.requirements import need_engine

RECORDING = "lerobot:DIR#3"
# An option with a word behind it, for each that is of runs which are made on both sides.
WORDS = {
    "backend": "mujoco",
    "timestep": "0.001",
    "tolerance": "joint=1deg",
    "uncertainty": "1mm",
    "junit": "x.xml",
    "actuators": "left",
    "floor": "left",
    "every": "2",
    "keyframe": "home",
    "contract": "c.yaml",
    "command": "1,0,0",
    "quantity": "joints",
    "measure": "rms",
    "time_limit": "3",
    "jobs": "1",
    "versions": "3.3.7",
    "plot": "x.svg",
    "film": "x.webp",
    "models": "so101",
    "frame": "a=b",
}
SWITCHES = ("no_chaos", "no_why", "finer", "one_step", "converge", "bisect")


@pytest.fixture(autouse=True)
def engine() -> None:
    need_engine("mujoco")


def typed(*words: str) -> argparse.Namespace:
    """Return what was typed behind `compare`."""
    parser = cli.parser_of(["compare"])
    return parser.parse_args(["compare", *words])


def asked(*words: str) -> RecordingRequest:
    return recording_request_of(typed(*words))


def test_every_option_of_compare_goes_with_a_recording_or_is_refused() -> None:
    assert {*vars(typed(RECORDING))} == {*OPTIONS_OF_RECORDINGS - {"help"}, *WORDS, *SWITCHES}


@pytest.mark.parametrize("name", WORDS)
def test_an_option_of_runs_is_refused(name: str) -> None:
    flag = f"--{name.replace('_', '-')}"
    with pytest.raises(BadInputError, match=f"^{flag} does not go with a recording"):
        asked(RECORDING, "so101", flag, WORDS[name])


def test_models_without_a_word_behind_it_is_refused() -> None:
    with pytest.raises(BadInputError, match=r"^--models does not go with a recording"):
        asked(RECORDING, "so101", "--models")


@pytest.mark.parametrize("name", SWITCHES)
def test_a_switch_of_runs_is_refused(name: str) -> None:
    flag = f"--{name.replace('_', '-')}"
    with pytest.raises(BadInputError, match=f"^{flag} does not go with a recording"):
        asked(RECORDING, "so101", flag)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((RECORDING,), "compared with its arm"),
        (("so101", RECORDING), "stands first"),
        ((RECORDING, RECORDING), "not with another one"),
        ((RECORDING, "so101", "so101/scene"), "one model; got 2"),
        ((RECORDING, "so101@pybullet"), "worlds of mujoco"),
        ((RECORDING, "so101@mujoco:engine"), "worlds of mujoco"),
        ((RECORDING, "so101", "timestep=0.001"), "timestep= does not go"),
        ((RECORDING, "so101", "--write", "x.xml"), "--write goes with --why"),
        ((RECORDING, "so101", "--map", "a"), "--map wants A=B"),
        ((RECORDING, "so101", "--seconds", "0.5"), "between 1 and 600"),
        ((RECORDING, "so101", "--seed", "-1"), "at least 0"),
    ],
)
def test_what_is_no_question_of_a_recording_is_refused_in_one_line(
    words: tuple[str, ...], says: str
) -> None:
    with pytest.raises(BadInputError, match=says) as refusal:
        asked(*words)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("word", ["synthetic", f"{SHIPPED_FOLDER}#1"])
def test_the_prefix_of_a_recording_is_told_where_it_lacks(word: str) -> None:
    with pytest.raises(BadInputError, match=re.escape(f"is typed lerobot:{word}")):
        split_words([word, "so101"])


def test_a_model_that_is_not_there_is_refused() -> None:
    with pytest.raises(StateMachineError, match="no model named 'nosuch'"):
        asked(RECORDING, "nosuch")


def test_a_calibration_is_refused_without_a_recording(capfd: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["compare", "hold", "so101", "so101", "--calibration", "x.json"]) == 2
    assert "--calibration goes with a recording" in capfd.readouterr().err


def test_what_is_typed_is_what_is_asked() -> None:
    words = ("--calibration", "c.json", "--map", "a=b", "--seconds", "5", "--seed", "2")
    assert asked(RECORDING, "so101", *words, "--why", "--write", "x.xml") == RecordingRequest(
        RECORDING,
        "so101",
        calibration="c.json",
        names={"a": "b"},
        seconds=5.0,
        seed=2,
        menagerie=typed(RECORDING).menagerie,
        write=Path("x.xml"),
    )


def test_the_engine_of_the_fit_may_be_named() -> None:
    assert asked(RECORDING, "so101@mujoco").model == "so101"


@pytest.mark.parametrize(
    ("word", "expected"),
    [("lerobot:x#3", True), ("lerobot:x", True), ("run.npz", False), ("so101", False), (3, False)],
)
def test_a_recording_is_told_by_its_first_word(word: object, expected: bool) -> None:
    assert is_arm_recording(word) is expected


# Which question is asked, and the exit code.


@pytest.fixture
def answered(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Answer both questions with made-up results; return which were asked."""
    names: list[str] = []

    def answer_gap(_request: object, _reporter: object) -> object:
        names.append("gap")
        return recording_result()

    def answer_why(_request: object, _reporter: object) -> object:
        names.append("why")
        return identification_result()

    monkeypatch.setattr(recorded_gap, "answer", answer_gap)
    monkeypatch.setattr(question, "answer", answer_why)
    return names


def test_without_why_the_gap_is_asked(answered: list[str]) -> None:
    assert cli.main(["compare", RECORDING, "so101"]) == 0
    assert answered == ["gap"]


def test_with_why_the_fit_is_asked(answered: list[str]) -> None:
    assert cli.main(["compare", RECORDING, "so101", "--why"]) == 0
    assert answered == ["why"]


def test_a_fit_above_the_floor_says_no(monkeypatch: pytest.MonkeyPatch) -> None:
    above = identification_result(at_floor=False, holds=False)
    monkeypatch.setattr(question, "answer", lambda *_: above)
    assert cli.main(["compare", RECORDING, "so101", "--why"]) == 1


@pytest.mark.usefixtures("answered")
def test_json_has_the_figures_and_no_arrays(capfd: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["compare", RECORDING, "so101", "--why", "--json"]) == 0
    figures = json.loads(capfd.readouterr().out)
    assert figures["gap"]["fitted"] == pytest.approx(0.01885, abs=1e-5)
    assert "recordings" not in figures
    assert figures["parameters"][0]["kind"] == "kp"


@pytest.mark.usefixtures("answered")
def test_a_page_is_checked_before_anything_is_asked(answered: list[str]) -> None:
    assert cli.main(["compare", RECORDING, "so101", "--html", "x.txt"]) == 2
    assert answered == []


@pytest.mark.usefixtures("answered")
def test_what_was_found_is_shown_where_the_page_cannot_be_written(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    def fill_disk(file: Path, _result: object) -> str:
        raise OSError(errno.ENOSPC, "No space left on device", str(file))

    monkeypatch.setattr(arm_report, "write_arm_page", fill_disk)
    page = tmp_path / "page.html"
    assert cli.main(["compare", RECORDING, "so101", "--why", "--json", "--html", str(page)]) == 2
    shown = capfd.readouterr()
    assert shown.err == f"statemachine: {page}: No space left on device\n"
    assert json.loads(shown.out)["gap"]["episode"] == identification_result().gap.episode


# How much is taken.


@pytest.mark.parametrize(
    ("fps", "seconds", "least"), [(1.0, 1.0, 30), (20.0, 1.4, 2), (29.0, 1.0, 2)]
)
def test_too_few_frames_are_refused_with_how_many_seconds_are_needed(
    fps: float, seconds: float, least: int
) -> None:
    recording = replace(recording_result().recordings.fitted, fps=fps)
    with pytest.raises(BadInputError, match=f"take {least} s or more"):
        recorded_gap.shortened(recording, seconds)


# From Python.


def test_python_asks_what_the_command_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    requests: list[RecordingRequest] = []

    def keep(given: RecordingRequest, _reporter: object) -> IdentificationResult:
        requests.append(given)
        return identification_result()

    monkeypatch.setattr(question, "answer", keep)
    lab.identify(RECORDING, "so101", names={"a": "b"}, starts=9, write="x.xml")
    assert requests == [
        RecordingRequest(RECORDING, "so101", names={"a": "b"}, starts=9, write="x.xml")
    ]


@pytest.mark.parametrize("ask", [lab.recording, lab.identify])
def test_a_request_says_all_that_is_asked(ask: Callable[..., object]) -> None:
    with pytest.raises(BadInputError, match="leave seconds out"):
        ask(request(), seconds=3.0)


@pytest.mark.parametrize("ask", [lab.recording, lab.identify])
def test_a_recording_alone_is_refused(ask: Callable[..., object]) -> None:
    with pytest.raises(BadInputError, match="name a model"):
        ask(RECORDING)
