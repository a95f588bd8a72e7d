"""Which causes of a gap a case of the battery decides, and which case that is.

A gap between two sides does not tell which of them is right. Some causes have a case of their own
in `lab/validate`, whose truth is known: there each side can be held against it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ...interface import JointType, Model
from ...release_names import engine_of
from .cited_case import DecidedCause
from .explanation import Explanation, Share
from .request import WhyRequest

# What a robot must have for a case to be about it.
RobotPart = Literal[
    "any",
    "free body off its centre of mass",
    "free or ball joint",
    "linked free bodies",
    "position servo",
    "damped position servo",
    "joint that swings on a spring or servo",
    "hinge or slide",
]

# Of the critical damping: a spring or a servo with less swings, so that a critically damped servo
# says nothing of it.
_SWINGS = 0.5
_LOCATED = ("integrator", "timestep")  # what is left out where two engines step differently


@dataclass(frozen=True)
class DecidingCase:
    """A case of the battery that decides between two sides.

    Attributes:
        cause: What the sides differ in.
        part: What the robot must have.
        cases: Name of the case, by the setting of a side: a cone; "" for any.
        reason: Why the case decides it.
    """

    cause: DecidedCause
    part: RobotPart
    cases: Mapping[str, str]
    reason: str

    def case_for(self, setting: str) -> str | None:
        """Return the name of the case of a side with a setting; None where it has none."""
        return self.cases.get(setting, self.cases.get(""))


_THROWN_OFF_CENTRE = DecidingCase(
    "offset centre of mass",
    "free body off its centre of mass",
    {"": "thrown-off-centre"},
    "a thrown body's centre of mass moves on a straight line, seen from above",
)
# Of a cause the first case counts whose part the robot has, and in which the sides' errors differ.
# A robot that swings is judged by a spring before it is by a servo, and by that before a pendulum.
DECIDING_CASES: tuple[DecidingCase, ...] = (
    DecidingCase(
        "cone",
        "any",
        {"elliptic": "block-slides-diagonal", "pyramidal": "block-slides-diagonal-pyramidal"},
        "the cone sets how much friction acts along the diagonal of the contact frame",
    ),
    _THROWN_OFF_CENTRE,
    replace(_THROWN_OFF_CENTRE, cause="integrator"),
    DecidingCase(
        "integrator",
        "free or ball joint",
        {"": "tumbling-energy"},
        "a body that turns without forces keeps its energy",
    ),
    DecidingCase(
        "integrator",
        "joint that swings on a spring or servo",
        {"": "spring-energy"},
        "a mass that swings on a spring keeps its energy",
    ),
    DecidingCase(
        "integrator",
        "damped position servo",
        {"": "servo-step"},
        "a critically damped servo follows a closed form",
    ),
    DecidingCase(
        "integrator",
        "hinge or slide",
        {"": "pendulum-quarter"},
        "the time that a pendulum takes to its lowest point is an elliptic integral",
    ),
    DecidingCase(
        "release",
        "position servo",
        {"": "effort-limit"},
        "a servo at its limit gives a constant force, so that its speed grows evenly",
    ),
    DecidingCase(
        "release",
        "linked free bodies",
        {"": "chain-angular-momentum"},
        "inner forces do not change the angular momentum of bodies in the air",
    ),
)


def deciding_cases(result: Explanation, question: WhyRequest) -> tuple[DecidingCase, ...]:
    """Return the cases that decide the cause that was found; empty where none does.

    Args:
        result: What the gap comes from.
        question: Whose models have the parts that a case is about.
    """
    cause = decided_cause(result, question)
    cases: list[DecidingCase] = []
    for row in DECIDING_CASES:
        if row.cause == cause and has_part(question.left, row.part):
            cases.append(row)
    return tuple(cases)


def decided_cause(result: Explanation, question: WhyRequest) -> DecidedCause | None:
    """Return the cause that most of the gap comes from, where a case may decide it; else None."""
    if result.verdict.answer == "cause":
        return _cause_of_share(next(row for row in result.shares if row.share))
    if not result.found_in:
        return None
    place = max(result.found_in, key=lambda place: place.share)
    if place.name not in _LOCATED or result.verdict.answer != "located":
        return None
    left, right = question.left, question.right
    if engine_of(left.backend) == engine_of(right.backend):
        return "release" if left.engine_version != right.engine_version else None
    return "offset centre of mass"


def cones_of(result: Explanation) -> tuple[str, str]:
    """Return the friction cones of both sides, where they differ; else "" for both."""
    for row in result.shares:
        for value in row.values:
            if row.kind == "option" and value.quantity == "cone":
                return str(value.left), str(value.right)
    return "", ""


def _cause_of_share(share: Share) -> DecidedCause | None:
    """Return what a cause with a part of the gap is, where a case may decide it."""
    quantities = {value.quantity for value in share.values}
    if share.kind != "option":
        return None
    if quantities == {"integrator"}:
        return "integrator"
    return "cone" if quantities == {"cone"} else None


def has_part(model: Model, part: RobotPart) -> bool:
    """Tell whether a robot has what a case is about."""
    kinds = model.jnt_type
    match part:
        case "any":
            return True
        case "free body off its centre of mass":
            return _has_offset_centre(model)
        case "free or ball joint":
            return bool(np.isin(kinds, (JointType.FREE, JointType.BALL)).any())
        case "linked free bodies":
            free = model.jnt_bodyid[kinds == JointType.FREE]
            return bool(np.isin(model.body_parentid, free).any())
        case "position servo":
            return bool(np.isfinite(model.actuator_kp).any())
        case "damped position servo":
            return has_part(model, "position servo") and not _swings(model)
        case "joint that swings on a spring or servo":
            return _swings(model)
        case "hinge or slide":
            return bool(np.isin(kinds, (JointType.HINGE, JointType.SLIDE)).any())


def _has_offset_centre(model: Model) -> bool:
    """Tell whether the centre of mass of a free body is not at the body's origin."""
    compiled = model.compiled
    if compiled is None:
        return False
    free = model.jnt_bodyid[model.jnt_type == JointType.FREE]
    return bool(np.asarray(compiled.body_ipos)[free].any())


def _swings(model: Model) -> bool:
    """Tell whether a hinge or slide swings: its springs and servos are damped by too little.

    A joint with the inertia M, the stiffness K and the damping D is critically damped by
    D = 2 sqrt(K M).
    """
    compiled = model.compiled
    if compiled is None:
        return False
    inertias, stiffnesses = np.asarray(compiled.dof_M0), np.asarray(compiled.jnt_stiffness)
    servos = np.isfinite(model.actuator_kp)
    for joint, kind in enumerate(model.jnt_type):
        if kind not in (JointType.HINGE, JointType.SLIDE):
            continue
        dof = model.jnt_dofadr[joint]
        driving = servos & (model.actuator_jntid == joint)
        squares = model.actuator_gear[driving] ** 2
        stiffness = float(stiffnesses[joint]) + float(model.actuator_kp[driving] @ squares)
        damping = float(model.dof_damping[dof]) + float(model.actuator_kv[driving] @ squares)
        critical = 2.0 * np.sqrt(stiffness * float(inertias[dof]))
        if stiffness > 0.0 and damping < _SWINGS * critical:
            return True
    return False
