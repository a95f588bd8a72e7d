"""How often a fit of synthetic recordings says what is true.

python -m tools.arm_recordings.score DIR [--write FILE.json]     after --all DIR of the maker

For each recording: which parameters are called determined, whether the truth is in their intervals,
and how wide these are by those of the Fisher information at the truth (the bound of Cramér and Rao,
with the prior).
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from statemachine.lab.identification.fit import Objective
from statemachine.lab.identification.identify import fitted_arm
from statemachine.lab.identification.parameters import ArmParameters, Parameter
from statemachine.lab.identification.recorded_gap import recorded_arm_of
from statemachine.lab.identification.refinements import tried_refinements
from statemachine.lab.identification.results import FEWEST_STARTS, FittedParameter, RecordingRequest
from statemachine.lab.identification.verdicts import fitted_parameters

COUNTED = ("kp", "viscous", "friction", "delay", "payload")  # of which most are to be determined
_KEYS = {"friction": "frictionloss"}  # in truth.json
_BAND = 2 * 1.96  # width of an interval of 95 %, in standard deviations


@dataclass(frozen=True)
class ScoredParameter:
    """A parameter of a recording.

    Attributes:
        kind, joint: Which.
        truth, fitted, low, high: In SI units.
        determined: Whether the fit calls it so.
        width: Of its interval by that of the bound.
    """

    kind: str
    joint: str | None
    truth: float
    fitted: float
    low: float
    high: float
    determined: bool
    width: float

    @property
    def covered(self) -> bool:
        """Tell whether the truth is in the interval."""
        return self.low <= self.truth <= self.high


@dataclass(frozen=True)
class ScoredRecording:
    """A recording.

    Attributes:
        name: Of its folder.
        parameters: All that were fitted, but for those that its fault changes.
        at_floor, holds: As the fit has them.
        as_good: Starts that ended as well as the best.
        seconds: Of the processor.
    """

    name: str
    parameters: tuple[ScoredParameter, ...]
    at_floor: bool
    holds: bool
    as_good: int
    seconds: float


def scored(folder: Path, starts: int = FEWEST_STARTS) -> ScoredRecording:
    """Fit a recording, and hold what is said against its truth."""
    truth = json.loads((folder / "truth.json").read_text())
    began = time.process_time()
    arm = recorded_arm_of(RecordingRequest(f"lerobot:{folder}", "so101"))
    fitted = fitted_arm(arm, starts, seed=0)
    holds = fitted.holds()
    parameters = fitted_parameters(fitted.fits, holds, (), tried_refinements(fitted.fits))
    seconds = time.process_time() - began
    best = fitted.fits.best.objective
    true = _true_vector(arm.parameters, truth)
    bound = _bound(best, true)
    each: list[ScoredParameter] = []
    for place, parameter in enumerate(parameters):
        if _is_changed(parameter, truth):
            continue
        of_vector = arm.parameters.each[place]
        low, high = parameter.low, parameter.high
        if of_vector.is_factor:
            low, high = (of_vector.value(max(end, 1e-12)) for end in (low, high))
        each.append(
            ScoredParameter(
                kind=parameter.kind,
                joint=parameter.joint,
                truth=of_vector.figure(float(true[place])),
                fitted=parameter.fitted,
                low=parameter.low,
                high=parameter.high,
                determined=parameter.verdict == "determined",
                width=(high - low) / (_BAND * float(bound[place])),
            )
        )
    return ScoredRecording(
        name=folder.name,
        parameters=tuple(each),
        at_floor=fitted.fits.residuals.at_floor,
        holds=holds,
        as_good=len(fitted.fits.as_good),
        seconds=seconds,
    )


def _true_vector(parameters: ArmParameters, truth: dict[str, Any]) -> np.ndarray:
    """Return the vector of the truth."""
    return np.array([each.value(_true_figure(each, truth)) for each in parameters.each])


def _true_figure(parameter: Parameter, truth: dict[str, Any]) -> float:
    figures = truth[_KEYS.get(parameter.kind, parameter.kind)]
    if parameter.joint is None:
        return figures
    return figures[truth["joints"].index(parameter.joint)]


def _is_changed(parameter: FittedParameter, truth: dict[str, Any]) -> bool:
    """Tell whether the fault of a recording changes what a parameter means."""
    if parameter.joint is None:
        return False
    return truth["scale"][truth["joints"].index(parameter.joint)] != 1.0


def _bound(objective: Objective, true: np.ndarray) -> np.ndarray:
    """Return the standard deviations (P,) that no fit can be better than, with the prior."""
    jacobian = objective.jacobian(true[objective.free])
    return np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))


@dataclass(frozen=True)
class Score:
    """What the recordings of a group have in common.

    Attributes:
        recordings: How many.
        determined: Part that is determined of gains, frictions, delays and payloads.
        covered: Part of all that is determined whose interval has the truth in it; None for none.
        width: Median width of these intervals by that of the bound; None for none.
        at_floor: Recordings of which the fit leaves noise alone.
    """

    recordings: int
    determined: float
    covered: float | None
    width: float | None
    at_floor: int


def score_of(recordings: Sequence[ScoredRecording]) -> Score:
    """Return what recordings have in common."""
    all_of = [each for recording in recordings for each in recording.parameters]
    counted = [each for each in all_of if each.kind in COUNTED]
    determined = [each for each in all_of if each.determined]
    covered = width = None
    if determined:
        covered = float(np.mean([each.covered for each in determined]))
        width = float(np.median([each.width for each in determined]))
    return Score(
        recordings=len(recordings),
        determined=float(np.mean([each.determined for each in counted])),
        covered=covered,
        width=width,
        at_floor=sum(recording.at_floor for recording in recordings),
    )


def group_of(name: str) -> str:
    """Return the group of a recording: its name without its seed; those with a fault are one."""
    group = name.rpartition("-")[0]
    if group.startswith(("zero", "sign", "gripper")):
        return "faults"
    return "pybullet" if group.startswith("pybullet") else group


def scores_by_group(recordings: Sequence[ScoredRecording]) -> dict[str, Score]:
    """Return the score of each group, and of all that MuJoCo simulated."""
    groups: dict[str, list[ScoredRecording]] = {}
    for recording in recordings:
        groups.setdefault(group_of(recording.name), []).append(recording)
    scores = {group: score_of(members) for group, members in groups.items()}
    of_mujoco = [each for each in recordings if group_of(each.name) != "pybullet"]
    if of_mujoco:
        scores["all of MuJoCo"] = score_of(of_mujoco)
    return scores


def main() -> None:
    """Score all recordings of a folder, print a line for each and for each group."""
    parser = argparse.ArgumentParser(prog="python -m tools.arm_recordings.score")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--write", type=Path, metavar="FILE.json", help="scores of the groups")
    options = parser.parse_args()
    recordings: list[ScoredRecording] = []
    for folder in sorted(path.parent for path in options.folder.glob("*/truth.json")):
        recordings.append(scored(folder))
        last = recordings[-1]
        missed = [
            f"{each.kind} {each.joint or ''}".strip()
            for each in last.parameters
            if each.determined and not each.covered
        ]
        print(last.name, score_of([last]), f"holds={last.holds}", f"as_good={last.as_good}")
        print(f"  {last.seconds:.0f} s; missed: {', '.join(missed) or 'none'}", flush=True)
        if options.write is not None:
            groups = {name: asdict(score) for name, score in scores_by_group(recordings).items()}
            options.write.write_text(json.dumps(groups, indent=1) + "\n")
    for name, score in scores_by_group(recordings).items():
        print(name, score)


if __name__ == "__main__":
    main()
