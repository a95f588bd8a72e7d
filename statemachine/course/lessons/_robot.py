"""What a lesson watches and writes on a robot of any kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...errors import BadInputError
from ...interface import JointType, Model, make_data
from ...lab.runs.robot import (
    holding_force_size,
    is_servo,
    scalar_joint,
    start_keyframe,
    target_towards_farther_end,
)
from ...measures.text import command

ARM, BOX = "so101/scene", "so101/scene_box"  # the models of the lessons

USUAL = "shoulder_lift"  # the arm's joint that lessons are about
_VALUE = 0.8  # rad
_SHIFT = 0.05  # m; of a slide without a range, or up


@dataclass(frozen=True)
class Coordinate:
    """The coordinate of a joint that a lesson watches.

    It is the position of a hinge [rad] or of a slide [m], or the height of a free body [m].

    Attributes:
        place: Its index in qpos.
        dof: Its index in qvel.
        slide: Whether it is a length, and no angle.
        slot: The index in qpos as it is typed.
    """

    place: int
    dof: int
    slide: bool
    slot: str


def coordinate(model: Model, joint: str) -> Coordinate:
    """Return the coordinate that a lesson watches of a joint.

    Raises:
        UnknownNameError: There is no such joint.
        BadInputError: It is a ball joint.
    """
    number = model.joint_id(joint)
    slot = f"model.jnt_qposadr[model.joint_id({joint!r})]"
    kind = JointType(int(model.jnt_type[number]))
    if kind is JointType.FREE:
        place, dof = int(model.jnt_qposadr[number]) + 2, int(model.jnt_dofadr[number]) + 2
        slot += " + 2  # the height of a free body"
    else:
        place, dof = scalar_joint(model, joint)
    return Coordinate(place, dof, slide=kind is not JointType.HINGE, slot=slot)


def usual_joint(model: Model, servos: bool = False) -> str:
    """Choose the joint of a lesson where nobody names one; with `servos` one that has a servo.

    It is shoulder_lift if there is one; else of the driven hinges and slides the one that takes the
    largest force to keep where it starts. Of a robot without any, a joint that nothing drives.

    Raises:
        BadInputError: There is none with a name.
    """
    if USUAL in model.joint_names:
        return USUAL
    kinds, names = model.jnt_type, model.joint_names
    driven = model.actuator_jntid[is_servo(model)] if servos else model.actuator_jntid
    named = [j for j, name in enumerate(names) if name and kinds[j] != JointType.BALL]
    if not named:
        if not model.njnt:
            raise BadInputError(f"{model.path.name} has no joints, and this lesson is about one")
        if (kinds == JointType.BALL).all():
            raise BadInputError(
                f"{model.path.name} has ball joints alone, and this lesson is about a joint of one "
                "coordinate: a hinge or a slide"
            )
        raise BadInputError(
            f"{model.path.name} names none of its joints, and this lesson is about one"
        )
    scalar = [j for j in named if kinds[j] != JointType.FREE]
    candidates = [j for j in scalar if j in driven]
    if not candidates:
        candidates = scalar if scalar else named
    load = holding_force_size(model)
    return names[max(candidates, key=lambda j: load[coordinate(model, names[j]).dof])]


def usual_value(model: Model, joint: str) -> float:
    """Choose what a lesson writes into a joint where nobody says it [rad; of a length, m]."""
    at = coordinate(model, joint)
    number = model.joint_id(joint)
    low, high = (float(end) for end in model.jnt_range[number])
    limited = bool(model.jnt_limited[number])
    if not at.slide and (not limited or low <= _VALUE <= high):
        return _VALUE
    with make_data(model) as data:
        start = float(data.qpos[at.place])
    value = start + _SHIFT
    if limited and low < high:
        value = target_towards_farther_end(start, (low, high))
    return float(f"{value:.3g}")


def with_joint(model: Model, options: Mapping[str, Any], servos: bool = False) -> dict[str, Any]:
    """Complete options with a joint, if none is named, and with a value to write to it."""
    values = dict(options)
    if values["joint"] is None:
        values["joint"] = usual_joint(model, servos)
    if "value" in values and values["value"] is None:
        values["value"] = usual_value(model, values["joint"])
    return values


def start_line(model: Model, name: str) -> str:
    """Return what is typed after make_data of a Model of some name, so that it starts at home."""
    key = start_keyframe(model)
    return f"sm.reset({name}, data, keyframe={key!r})\n" if key else ""


def check_servos(model: Model, lesson: str, joint: str | None = None) -> None:
    """Raise BadInputError for a model, or a joint, without a position servo."""
    servos = model.actuator_jntid[is_servo(model)]
    has_servo = servos.size > 0 and (joint is None or model.joint_id(joint) in servos)
    if not has_servo:
        driven = model.path.name if joint is None else joint
        words = command([_experiment_like(lesson, model), str(model.path)])
        raise BadInputError(
            f"no position servo drives {driven}, and this lesson is about servos; without one: "
            f"statemachine compare {words} (on one engine: trace record instead of compare)"
        )


def _experiment_like(lesson: str, model: Model) -> str:
    """Return the experiment to run instead of a lesson that is about servos."""
    if not model.nu:
        return "gravity"
    return lesson if lesson in ("hold", "gravity") else "hold"
