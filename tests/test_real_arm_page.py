"""What docs/real_arm.md says of integrators is what runs give."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import statemachine as sm
from examples import record_chirps
from statemachine.interface import Array
from statemachine.lab.identification import verdicts
from statemachine.lab.identification.considered import UNCERTAIN_RATE
from statemachine.lab.identification.parameters import ArmParameters
from statemachine.lab.identification.results import FEWEST_STARTS
from statemachine.lab.recordings.arm_recording import ArmRecording
from statemachine.lab.recordings.arm_source import read_arm_recordings
from statemachine.lab.recordings.synthetic_truth import synthetic_truth
from statemachine.worlds import make_worlds, step

from .support.requirements import ROOT

PAGE = (ROOT / "docs" / "real_arm.md").read_text("utf-8")
FACTORS = np.arange(-0.1, 0.1001, 0.005)  # logarithms of what gains and frictions are multiplied by
STEPS = (8, 16)  # of a frame, in the order of the columns


@pytest.fixture(scope="module")
def recording() -> ArmRecording:
    pytest.importorskip("pyarrow")
    return read_arm_recordings("lerobot:synthetic", sm.load("so101"), None, {}).fitted


def true_vectors(parameters: ArmParameters) -> Array:
    """Return the true figures with gains and frictions multiplied by `FACTORS` (factors, P)."""
    truth = synthetic_truth()
    by_kind = {"kp": truth.kp, "viscous": truth.viscous, "friction": truth.frictionloss}
    vectors = np.zeros((len(FACTORS), len(parameters)))
    for number, parameter in enumerate(parameters.each):
        if parameter.kind in by_kind and parameter.joint is not None:
            figure = by_kind[parameter.kind][truth.joints.index(parameter.joint)]
            vectors[:, number] = parameter.value(figure) + FACTORS
    return vectors


def roughness(recording: ArmRecording, integrator: str, steps: int) -> float:
    """Return the largest second difference of an angle over `FACTORS` [rad]."""
    arm = sm.load("so101")
    parameters = ArmParameters.of(arm, recording.joints)
    timestep = 1.0 / (recording.fps * steps)
    model = arm.replace(timestep=timestep, integrator=integrator, contacts=False)
    options = parameters.options(true_vectors(parameters))
    angles: list[Array] = []
    with make_worlds(model, len(FACTORS), derived=(), **options) as worlds:
        worlds.qpos[:] = recording.state[0]
        for command in recording.action:
            worlds.ctrl[:] = command
            step(worlds, steps)
            angles.append(worlds.qpos.copy())
    return float(np.abs(np.diff(np.array(angles), 2, axis=1)).max())


@pytest.mark.parametrize("integrator", ["implicitfast", "euler"])
def test_the_roughness_of_an_integrator_is_that_of_the_page(
    integrator: str, recording: ArmRecording
) -> None:
    (row,) = re.findall(rf"^\| {integrator} \| ([\d.]+)° \| ([\d.]+)° \|$", PAGE, re.MULTILINE)
    found = [np.degrees(roughness(recording, integrator, steps)) for steps in STEPS]
    assert [float(cell) for cell in row] == pytest.approx(found, rel=0.05)


def test_angles_jump_with_implicitfast_and_not_with_euler(recording: ArmRecording) -> None:
    rough, smooth = (roughness(recording, name, 8) for name in ("implicitfast", "euler"))
    assert rough > 10.0 * smooth


def test_what_the_verdict_demands_is_what_the_page_says() -> None:
    assert f"less than {verdicts.TELLS} of what was uncertain" in PAGE
    assert FEWEST_STARTS == 8
    assert verdicts.AGREEING == 0.5
    assert f"a rate that may be {100.0 * UNCERTAIN_RATE:g} % off" in PAGE


def test_the_speed_of_the_script_is_that_of_the_page() -> None:
    assert f"at most {record_chirps.FASTEST:.0f}° a\nsecond" in PAGE
    assert f"for twice {record_chirps.SECONDS:.0f} s" in PAGE


# How often it is right: a run of minutes, whose outcome is kept.


GROUPS = {
    "soft, chirps": "soft-chirps",
    "soft, hand": "soft-hand",
    "stiff, chirps": "stiff-chirps",
    "stiff, hand": "stiff-hand",
    "soft, a fault": "faults",
    "soft, PyBullet": "pybullet",
}


def _scores() -> dict[str, dict[str, float | None]]:
    file = ROOT / "tools" / "arm_recordings" / "thirty.json"
    return json.loads(file.read_text("utf-8"))


def _cell(part: float | None) -> str:
    return "–" if part is None else f"{100 * part:.0f} %"


@pytest.mark.parametrize("label", GROUPS)
def test_the_table_of_scores_is_that_of_the_thirty(label):
    score = _scores()[GROUPS[label]]
    width = "–" if score["width"] is None else f"{score['width']:.2f}"
    cells = [
        label,
        str(score["recordings"]),
        _cell(score["determined"]),
        _cell(score["covered"]),
        width,
    ]
    assert f"| {' | '.join(cells)} |" in PAGE


def test_of_soft_servos_and_chirps_most_is_determined():
    assert _scores()["soft-chirps"]["determined"] >= 0.6


def test_what_is_called_determined_is_true_and_no_wider_than_it_must_be():
    score = _scores()["all of MuJoCo"]
    assert score["covered"] >= 0.85
    assert score["width"] <= 3.0


def test_there_are_thirty():
    scores = _scores()
    of_mujoco, of_pybullet = (
        scores[group]["recordings"] for group in ("all of MuJoCo", "pybullet")
    )
    assert (of_mujoco, of_pybullet) == (26, 4)
