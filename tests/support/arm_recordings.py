"""Made-up results of a recording of an arm, with figures as a real one had them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from statemachine import load
from statemachine.interface import Array, Model
from statemachine.lab.identification.results import (
    CAUSES,
    CauseShare,
    FittedParameter,
    Hypothesis,
    IdentificationResult,
    JointGap,
    Kind,
    RecordingGap,
    RecordingRequest,
    RecordingResult,
    StartOutcome,
)
from statemachine.lab.recordings.arm_recording import ArmRecording, ArmRecordings
from statemachine.lab.recordings.joint_units import JointUnit
from statemachine.lab.runs.provenance import provenance
from statemachine.lab.runs.robot import SO101_JOINTS

FPS = 30.0
COUNT = 2.0 * math.pi / 4096.0  # rad
ALL = {"commanded": 3.94, "model": 3.40, "fitted": 1.08}  # degrees
SHARES = {"delay": 0.31, "gains": 0.52, "friction": 0.04, "offsets": 0.02, "inertia": 0.01}
ALONE = {"delay": 0.46, "gains": 0.66, "friction": 0.05, "offsets": 0.02, "inertia": 0.01}


def units() -> tuple[JointUnit, ...]:
    """Return units as of a recording whose scale was taken from the step of its numbers."""
    spans = (224.0, 203.0, 194.0, 201.0, 337.0)
    found = [
        JointUnit(
            joint, "-100 to 100", math.radians(span) / 200, 0.0, span / 360 * 4095, 0.09, "quantum"
        )
        for joint, span in zip(SO101_JOINTS, spans, strict=False)
    ]
    gripper = JointUnit("gripper", "0 to 100", math.radians(1.1), -0.17, None, None, "model range")
    return (*found, gripper)


def recording(seconds: float = 1.0, episode: int = 3) -> ArmRecording:
    """Return a slow sine of all joints, which the arm follows two frames late."""
    time = np.arange(round(seconds * FPS)) / FPS
    action = 0.3 * np.sin(2.0 * time)[:, None] * np.ones(6) + 0.2
    return ArmRecording(
        source=f"lerobot:data/pushes#{episode}",
        episode=episode,
        fps=FPS,
        joints=SO101_JOINTS,
        action=action,
        state=np.concatenate([action[:1], action[:1], action[:-2]]),
        units=units(),
    )


def gap(fitted: bool, part: str = "all", episode: int = 3) -> RecordingGap:
    """Return how far model and commands are from the arm, in figures of a real one."""
    factors = (0.4, 1.6, 1.5, 0.8, 0.3, 0.2)
    values = {name: math.radians(value) for name, value in ALL.items()}
    joints = [
        JointGap(
            joint,
            factor * values["commanded"],
            factor * values["model"],
            factor * values["fitted"] if fitted else None,
        )
        for joint, factor in zip(SO101_JOINTS, factors, strict=True)
    ]
    return RecordingGap(
        episode=episode,
        part="last third" if part == "last third" else "all",
        seconds=12.4,
        joints=tuple(joints),
        commanded=values["commanded"],
        model=values["model"],
        fitted=values["fitted"] if fitted else None,
    )


def request() -> RecordingRequest:
    """Return a question of such a recording."""
    return RecordingRequest("lerobot:data/pushes#3", "so101")


def recording_result() -> RecordingResult:
    """Return what a question without --why gives."""
    arm = load("so101")
    return RecordingResult(
        request=request(),
        provenance=provenance(arm),
        gap=gap(fitted=False),
        recordings=ArmRecordings(recording(), None),
        arm=arm,
    )


def parameter(
    kind: Kind, joint: str | None, model: float, fitted: float, determined: bool = True
) -> FittedParameter:
    """Return what a recording tells of a parameter."""
    half = 0.02 * abs(fitted) if determined else 0.8 * abs(fitted) + 0.01
    return FittedParameter(
        kind=kind,
        joint=joint,
        model=model,
        fitted=fitted,
        low=fitted - half,
        high=fitted + half,
        posterior_by_prior=0.05 if determined else 0.9,
        reasons=() if determined else ("too little information",),
        motion="" if determined else "a slow chirp of shoulder_lift",
    )


def parameters() -> tuple[FittedParameter, ...]:
    """Return 32 parameters, of which those of lift and elbow, delay and payload are determined."""
    found: list[FittedParameter] = []
    for joint in SO101_JOINTS:
        known = joint in ("shoulder_lift", "elbow_flex")
        found.append(parameter("kp", joint, 998.22, 8.5, known))
        found.append(parameter("viscous", joint, 3.331, 0.9, known))
        found.append(parameter("friction", joint, 0.052, 0.11, known))
        found.append(parameter("armature", joint, 0.028, 0.03, determined=False))
        found.append(parameter("offset", joint, 0.0, 0.01, determined=False))
    found.append(parameter("delay", None, 0.0, 0.106))
    found.append(parameter("payload", None, 0.0, 0.060))
    return tuple(found)


def with_verdicts(
    parameters: Iterable[FittedParameter], is_determined: Callable[[FittedParameter], bool]
) -> tuple[FittedParameter, ...]:
    """Return parameters of which those are determined, and the others are not."""
    found: list[FittedParameter] = []
    for each in parameters:
        determined = is_determined(each)
        found.append(
            replace(
                each,
                reasons=() if determined else ("residual above the floor",),
                motion="" if determined else each.motion,
            )
        )
    return tuple(found)


def fitted_arm(arm: Model) -> Model:
    """Return the arm with those figures."""
    kp: Array = np.full(6, 8.5)
    mass = arm.body_mass.copy()
    mass[arm.body_id("gripper")] += 0.060
    return arm.replace(
        kp=kp, kv=np.full(6, 0.7), damping=np.full(6, 0.2), frictionloss=0.11, mass=mass
    )


def identification_result(**others: object) -> IdentificationResult:
    """Return what --why gives, with some fields otherwise."""
    arm = load("so101")
    shares = tuple(
        CauseShare(cause, SHARES[cause], ALONE[cause], 0.9 * SHARES[cause]) for cause in CAUSES
    )
    result = IdentificationResult(
        request=request(),
        provenance=provenance(arm),
        fitted_gap=gap(fitted=True),
        gap=gap(fitted=True, episode=4),
        residual=math.radians(0.057),
        floor=math.radians(0.056),
        holds=True,
        at_floor=True,
        parameters=parameters(),
        shares=shares,
        hypotheses=(
            Hypothesis("the sign of elbow_flex", math.radians(4.2), -5000.0, "fits worse"),
            Hypothesis(
                "viscous friction outside of the force limit",
                math.radians(0.057),
                0.4,
                "cannot tell",
            ),
        ),
        starts=tuple(StartOutcome(805.0 + 3.0 * k, k < 6, 40) for k in range(8)),
        saturated=0.02,
        recordings=ArmRecordings(recording(), recording(episode=4)),
        arm=arm,
        fitted_arm=fitted_arm(arm),
    )
    return replace(result, **others)  # pyright: ignore[reportArgumentType]
