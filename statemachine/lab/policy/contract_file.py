"""A contract from its file: gaitkeeper's format, or what Unitree's robots are deployed with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, cast, get_args

import numpy as np

from ...errors import BadInputError, did_you_mean, one_line, shown
from ...installed import require_extra
from ...interface import Array
from ...models import AnyPath, check_is_file
from .contract import (
    AXES,
    LONGEST_CALL,
    SCHEMA,
    Action,
    ActuatorKind,
    CallTiming,
    Clock,
    Contract,
    Frame,
    History,
    Init,
    Layout,
    ObservedTerm,
    Order,
    QuatOrder,
    Servos,
    TermId,
)
from .contract_fields import ContractSection
from .unitree_deploy import contract_of_deploy

EXTRA: Final = "policy"
_TERMS: tuple[TermId, ...] = get_args(TermId)
_FRAMES: tuple[Frame, ...] = get_args(Frame)
_KINDS: tuple[ActuatorKind, ...] = get_args(ActuatorKind)
_OF_THREE = ("base_lin_vel", "base_ang_vel", "projected_gravity", "velocity_commands")
_OF_ENCODERS = ("joint_pos_rel", "joint_vel_rel")
_OF_CLOCK = {"gait_phase": 2, "gait_phase_legs": 4}
# Sections that say where the figures come from: nothing is computed from them.
_SOURCES = ("schema", "source", "provenance", "evidence")
_LARGEST_FILE = 2_000_000  # bytes; a contract has a few thousand
_MOST_ENTRIES = 200_000  # with those that an alias repeats
_MOST_STEPS = 100_000.0  # between two calls
_WHOLE = 1e-6  # of a step: a number of steps that is nearer to a whole one is that one


def read_contract(file: AnyPath) -> Contract:
    """Return the contract that a file holds.

    Args:
        file: YAML of the format `gaitkeeper/contract/v3`, or a `deploy.yaml` of Unitree's.

    Raises:
        BadInputError: The file is missing, or a field is missing, misspelt or out of range.
        MissingEngineError: PyYAML is not installed.
    """
    path = Path(file)
    content = _yaml_of(path)
    if "joint_ids_map" in content:
        return contract_of_deploy(content, path.name)
    schema = content.get("schema")
    if schema != SCHEMA:
        raise BadInputError(
            f"{path.name} is no contract: schema is {schema!r}, and {SCHEMA!r} is expected (or a "
            "deploy.yaml of Unitree's, which has joint_ids_map)"
        )
    return _contract_of(ContractSection(content, "", path.name), path.name)


def _yaml_of(path: Path) -> Mapping[str, object]:
    """Return the table that a YAML file holds."""
    yaml = require_extra("yaml", "a policy's contract", "PyYAML", EXTRA)
    check_is_file(path)
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise BadInputError(f"{path} is too large for a contract (2 MB)")
        content = yaml.load(path.read_text("utf-8"), _loader_of(yaml, path.name))
    except BadInputError:
        raise
    except FileNotFoundError:
        raise BadInputError(f"there is no contract {path}") from None
    except (OSError, UnicodeDecodeError, RecursionError, ValueError) as error:
        raise BadInputError(f"{path} cannot be read: {one_line(error)}") from error
    except yaml.YAMLError as error:
        raise BadInputError(f"{path.name} is no YAML: {_said_of(error)}") from error
    if not isinstance(content, Mapping):
        raise BadInputError(f"{path.name} is no contract: a table is expected")
    if _has_too_many_entries(content):
        raise BadInputError(f"{path.name} is too large for a contract: its aliases repeat too much")
    return cast("Mapping[str, object]", content)


def _loader_of(yaml: Any, file: str) -> Any:
    """Return PyYAML's safe loader, which takes the last of two equal keys, without that."""

    class UniqueKeyLoader(yaml.SafeLoader):
        """Refuses a table in which a key stands twice."""

        def construct_mapping(self, node: Any, deep: bool = False) -> Any:
            """Return the table of a node.

            Raises:
                BadInputError: A key stands in it twice.
            """
            keys: set[str] = set()
            for key, _ in node.value:
                if not isinstance(key, yaml.ScalarNode):
                    continue
                if key.value in keys:
                    line = key.start_mark.line + 1
                    raise BadInputError(
                        f"{file}: {shown(key.value)} stands twice in a table, again in line {line}"
                    )
                keys.add(key.value)
            return super().construct_mapping(node, deep)

    return UniqueKeyLoader


def _said_of(error: Exception) -> str:
    """Return what a YAML error says: where it is known, the line, the column and what is there."""
    mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None)
    if mark is None or problem is None:
        return one_line(error)
    return f"line {mark.line + 1}, column {mark.column + 1}: {problem}"


def _has_too_many_entries(content: object) -> bool:
    """Tell whether a file holds more than a contract can, each alias counted as what it repeats."""
    pending = [content]
    entries = 0
    while pending and entries <= _MOST_ENTRIES:
        value = pending.pop()
        if isinstance(value, Mapping):
            pending.extend(cast("Mapping[object, object]", value).values())
        elif isinstance(value, list):
            pending.extend(cast("list[object]", value))
        entries += 1
    return bool(pending)


def _contract_of(root: ContractSection, file: str) -> Contract:
    """Return the contract of a file in gaitkeeper's format."""
    root.ignore(*_SOURCES)
    policy_io, control = root.section("policy_io"), root.section("control")
    joints = policy_io.section("joints").names("names")
    default = control.per_joint("default_joint_pos", joints)
    if default is None:
        raise control.error("default_joint_pos", "an angle for each joint is expected")
    group = policy_io.section("observation_groups").section("policy")
    imu = _imu(policy_io.section("imu"))
    terms = _terms(group, joints, default, imu)
    contract = Contract(
        file=file,
        schema=SCHEMA,
        joints=joints,
        default_joint_pos=default,
        terms=terms,
        quat_order=imu.quat_order,
        history=_history(group.section("history")),
        clips_before_scale=group.flag("clip_then_scale", True),
        action=_action(control.section("actions").section("joint_pos"), joints, default),
        servos=_servos(control.section("actuators"), root.section("model"), joints),
        timing=_timing(root.section("timing")),
        command_limits=_command_limits(policy_io.section("commands").section("base_velocity")),
    )
    unread = tuple(root.unread())
    return replace(contract, unread=unread)


@dataclass(frozen=True)
class _Imu:
    """How the harness reads the sensors of the base.

    Attributes:
        frame: In which axes the gyroscope tells the angular velocity.
        site: Whose axes these are; "" for those of the base.
        quat_order: In which order the quaternion of the base is taken for its numbers.
    """

    frame: Frame
    site: str
    quat_order: QuatOrder


def _imu(imu: ContractSection) -> _Imu:
    """Return how the harness reads the sensors of the base."""
    imu.ignore("body")
    rotation = imu.numbers("rotation_in_root", 4) if imu.has("rotation_in_root") else None
    if rotation is not None and not np.array_equal(np.abs(rotation), (1.0, 0.0, 0.0, 0.0)):
        raise imu.error(
            "rotation_in_root", "a sensor that is turned is told by imu.site, a site of the model"
        )
    return _Imu(
        frame=cast("Frame", imu.text("frame", _FRAMES, "body")),
        site=imu.text("site", (), "") if imu.has("site") else "",
        quat_order=cast("QuatOrder", imu.text("quat_order", get_args(QuatOrder), "wxyz")),
    )


def _terms(
    group: ContractSection, joints: Sequence[str], default: Array, imu: _Imu
) -> tuple[ObservedTerm, ...]:
    """Return the terms of an observation."""
    terms: list[ObservedTerm] = []
    for section in group.sections("terms"):
        term = _term(section, joints, default, imu)
        if any(known.name == term.name for known in terms):
            raise section.error("source_name", f"a name of its own for the second {term.id}")
        terms.append(term)
    return tuple(terms)


def _term(
    section: ContractSection, joints: Sequence[str], default: Array, imu: _Imu
) -> ObservedTerm:
    """Return one term of an observation."""
    term_id = cast("TermId", section.text("id", _TERMS))
    parameters = section.section("params")
    dim = _dim(term_id, parameters, len(joints))
    if section.count("dim", dim, 1) != dim:
        raise section.error("dim", f"{term_id} has {dim} numbers")
    if parameters.count("lag", 1) != 1:
        raise parameters.error("lag", "the last action alone (1) can be observed")
    if parameters.has("index"):
        raise parameters.error("index", "terms are taken whole")
    frame, site = _frame_and_site(term_id, parameters, imu)
    told = _told_joints(parameters, joints) if term_id in _OF_ENCODERS else ()
    reference: Array | None = None
    if term_id == "joint_pos_rel":
        reference = parameters.per_joint("default", told or joints)
        if reference is None:
            reference = default[[joints.index(joint) for joint in told or joints]]
    values: tuple[float, ...] = ()
    if term_id == "constant":
        values = tuple(parameters.numbers("value", dim).tolist())
    return ObservedTerm(
        id=term_id,
        name=section.text("source_name", (), term_id),
        scale=section.numbers("scale", dim, 1.0),
        clip=section.pair("clip"),
        joints=told,
        reference=reference,
        frame=frame,
        site=site,
        clock=_clock(parameters) if term_id in _OF_CLOCK else None,
        values=values,
    )


def _frame_and_site(term_id: TermId, parameters: ContractSection, imu: _Imu) -> tuple[Frame, str]:
    """Return in which axes a velocity is told, and the site of its sensor; "" for the base."""
    frame: Frame = "body"
    site = ""
    if term_id == "base_ang_vel":
        frame, site = imu.frame, imu.site
    if term_id in ("base_lin_vel", "base_ang_vel"):
        frame = cast("Frame", parameters.text("frame", _FRAMES, frame))
        site = parameters.text("site", (), "") if parameters.has("site") else site
    return frame, site


def _told_joints(parameters: ContractSection, joints: Sequence[str]) -> tuple[str, ...]:
    """Return whose angles or speeds a term tells; empty for those of the policy, in its order."""
    if not parameters.has("joints"):
        return ()
    told = parameters.names("joints")
    if sorted(told) != sorted(joints):
        raise parameters.error("joints", "the joints of the policy are expected, in any order")
    return () if told == tuple(joints) else told


def _dim(term_id: TermId, parameters: ContractSection, n: int) -> int:
    """Return how many numbers a term has."""
    if term_id in _OF_THREE:
        return 3
    if term_id in _OF_CLOCK:
        return _OF_CLOCK[term_id]
    if term_id == "constant":
        size = parameters.size("value")
        if not size:
            raise parameters.error("value", "at least one number is expected")
        return size
    return n


def _clock(parameters: ContractSection) -> Clock:
    """Return the clock of a term that tells a phase."""
    parameters.ignore("clock", "arithmetic")
    if parameters.has("stand") or parameters.has("gate"):
        key = "stand" if parameters.has("stand") else "gate"
        raise parameters.error(key, "a clock that stops is told by stand_threshold alone")
    threshold: float | None = None
    if parameters.has("stand_threshold"):
        threshold = parameters.number("stand_threshold")
    return Clock(
        period=parameters.positive("period"),
        offset=parameters.number("offset", 0.5),
        offset_steps=parameters.count("clock_offset_steps", 0),
        stand_threshold=threshold,
    )


def _history(section: ContractSection) -> History:
    """Return how earlier observations are handed over."""
    for key in ("chunks", "first_frame"):
        if section.has(key):
            raise section.error(key, "a history is told by length, layout, order and init alone")
    return History(
        length=section.count("length", 1, 1),
        layout=cast("Layout", section.text("layout", get_args(Layout), "term_major")),
        order=cast("Order", section.text("order", get_args(Order), "oldest_first")),
        init=cast("Init", section.text("init", get_args(Init), "repeat_first")),
    )


def _action(section: ContractSection, joints: Sequence[str], default: Array) -> Action:
    """Return how actions become targets."""
    section.ignore("kind", "joints")
    stage = section.text("clip_stage", ("processed", "none"), "processed")
    section.text("filter", ("none",), "none")
    scale = section.per_joint("scale", joints)
    offset = section.per_joint("offset", joints)
    clip: Array | None = None
    section.ignore("clip")  # at the stage "none"
    if section.has("clip") and stage == "processed":
        clip = section.pairs("clip", len(joints))
    return Action(
        scale=np.ones(len(joints)) if scale is None else scale,
        offset=default if offset is None else offset,
        clip=clip,
        delay_steps=section.count("delay_steps", 0),
    )


def _servos(actuators: ContractSection, model: ContractSection, joints: Sequence[str]) -> Servos:
    """Return what drives the joints."""
    actuators.ignore("pd_period", "integrator", "torque_limit_at")
    kind: ActuatorKind | None = None
    if actuators.has("kind"):
        kind = cast("ActuatorKind", actuators.text("kind", _KINDS))
    model.ignore("root", "velocity_limit", "training_envelope")
    servos = Servos(
        kind=kind,
        kp=actuators.non_negative("kp", joints),
        kd=actuators.non_negative("kd", joints),
        effort_limit=model.non_negative("effort_limit", joints, np.inf),
        armature=model.non_negative("armature", joints),
        damping=model.non_negative("joint_damping", joints),
        friction=model.non_negative("joint_friction", joints),
    )
    for key, gains in (("kp", servos.kp), ("kd", servos.kd)):
        if kind == "explicit_pd" and gains is None:
            raise actuators.error(key, "torques that are computed outside need kp and kd")
    return servos


def _timing(section: ContractSection) -> CallTiming:
    """Return how often the policy is called."""
    section.ignore("order", "target_hold")
    policy_dt = section.positive("policy_dt", LONGEST_CALL)
    decimation: int | None = None
    if section.has("decimation"):
        decimation = section.count("decimation", None, 1)
    if section.has("sim_dt"):
        steps = policy_dt / section.positive("sim_dt")
        if steps > _MOST_STEPS or abs(steps - round(steps)) > _WHOLE * steps:
            raise section.error("sim_dt", f"a whole part of policy_dt = {policy_dt:g} is expected")
        if decimation is not None and decimation != round(steps):
            raise section.error("decimation", f"policy_dt / sim_dt = {round(steps)} is expected")
        decimation = round(steps)
    return CallTiming(policy_dt, decimation)


def _command_limits(section: ContractSection) -> dict[str, tuple[float, float]]:
    """Return the speeds that the policy may be asked for, by axis."""
    section.ignore("name", "trained", "heading")
    for key in ("shaping", "gate"):
        if section.has(key):
            raise section.error(key, "commands go to the policy as they are")
    limits: dict[str, tuple[float, float]] = {}
    if not section.has("limit"):
        return limits
    limit = section.section("limit")
    for axis in limit.fields():
        if axis not in AXES:
            raise limit.error(
                axis, f"an axis is one of {', '.join(AXES)}{did_you_mean(axis, AXES)}"
            )
        pair = limit.pair(axis)
        if pair is not None:
            limits[axis] = pair
    return limits
