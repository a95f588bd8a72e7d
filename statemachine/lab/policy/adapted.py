"""A model as a contract wants it: its servos, their limits, and the timestep."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from ...errors import BadInputError
from ...interface import Array, Ints, Model
from ...measures.text import milliseconds
from .binding import Binding
from .contract import ActuatorKind, Contract

Property = Literal[
    "timestep", "servos", "kp", "kd", "force limit", "armature", "damping", "friction"
]
_SAME: Final = 1e-9  # of a figure: what is nearer is equal
_FIXED_GAIN, _NO_BIAS, _AFFINE_BIAS = 0, 0, 1  # mjtGain, mjtBias


@dataclass(frozen=True)
class ContractChange:
    """What the contract says otherwise than the model's file, and what was run.

    Attributes:
        name: Which property.
        joints: Of how many joints of the policy; 0 of what belongs to no joint.
        unit: SI.
        file: The least and the largest value in the file; None where these are no numbers.
        contract: The same in the contract.
    """

    name: Property
    joints: int
    unit: str
    file: tuple[float, float] | None
    contract: tuple[float, float] | None


@dataclass(frozen=True)
class AdaptedModel:
    """A model as a contract wants it.

    Attributes:
        model: What is run.
        kind: How its joints are driven.
        kp, kd: (n,) of the joints of the policy [N·m/rad, N·m·s/rad].
        limit: (n,) [N·m], infinite of a joint without.
        changes: What the contract says otherwise than the model's file.
    """

    model: Model
    kind: ActuatorKind
    kp: Array
    kd: Array
    limit: Array
    changes: tuple[ContractChange, ...]


def adapted(model: Model, contract: Contract, binding: Binding) -> AdaptedModel:
    """Return a model as a contract wants it; what that does not say stays as it is in the file.

    Args:
        model: As its file has it.
        contract: Where it says nothing of servos, those of the file drive the joints.
        binding: Where the joints of the contract are in the model.

    Raises:
        BadInputError: Neither says how the joints are driven, or the timestep is no whole part of
            the time between two calls of the policy.
        UnsupportedError: The backend cannot change what the contract says otherwise.
    """
    changes: list[ContractChange] = []
    _check_has_no_gears(model, binding)
    timestep = _timestep(model, contract)
    if timestep != model.timestep:
        pair = (model.timestep, timestep)
        changes.append(_scalar_change("timestep", "s", *pair))
    drives = _drives(model, contract, binding, changes)
    result = model
    if drives.compiled is not None:
        result = model.with_compiled(drives.compiled)
    options: dict[str, Any] = dict(drives.options)
    if result.timestep != timestep:
        options["timestep"] = timestep
    options.update(_joint_options(model, contract, binding, changes))
    if options:
        result = result.replace(**options)
    return AdaptedModel(result, drives.kind, drives.kp, drives.kd, drives.limit, tuple(changes))


def unchanged(model: Model, contract: Contract, binding: Binding) -> AdaptedModel:
    """Return how the joints of a model are driven with the servos that it has.

    Where it has motors, torques are computed before each step, with the gains of the contract.

    Args:
        model: It stays as it is, whatever the contract says of servos, limits and timestep.
        contract: How often the policy is called, and the gains of motors.
        binding: Where the joints of the contract are in the model.

    Raises:
        BadInputError: The model has motors and the contract no gains, or the time between two
            calls of the policy is no whole number of timesteps.
    """
    _check_has_no_gears(model, binding)
    policy_dt = contract.timing.policy_dt
    steps = policy_dt / model.timestep
    if round(steps) < 1 or abs(steps - round(steps)) > _SAME * steps:
        raise BadInputError(
            f"{contract.file} calls its policy every {milliseconds(policy_dt)}, which is "
            f"{steps:.6g} steps of {milliseconds(model.timestep)} on {model.backend}: write "
            f"timestep={policy_dt / np.ceil(steps):.6g} behind that side"
        )
    has_servos = _has_servos(model, binding)
    kind: ActuatorKind = "implicit_pd" if has_servos else "explicit_pd"
    kp, kd = contract.servos.kp, contract.servos.kd
    if has_servos:
        kp, kd = model.actuator_kp[binding.ctrl], model.actuator_kv[binding.ctrl]
    if kp is None or kd is None:
        raise _no_gains(model, contract)
    return AdaptedModel(model, kind, kp, kd, _force_limit(model, binding, has_servos), ())


def _check_has_no_gears(model: Model, binding: Binding) -> None:
    """Check that commands are angles or torques at the joints of a policy."""
    if not np.all(model.actuator_gear[binding.ctrl] == 1.0):
        raise BadInputError(
            f"{model.path.name} has gears before the joints of the policy, and a contract tells "
            "angles and torques at the joints"
        )


def _timestep(model: Model, contract: Contract) -> float:
    """Return the timestep that the contract wants [s]; the model's where it does not say."""
    wanted = contract.timing.timestep
    if wanted is not None:
        same = abs(wanted - model.timestep) <= _SAME * wanted
        return model.timestep if same else wanted
    steps = contract.timing.policy_dt / model.timestep
    if abs(steps - round(steps)) > _SAME * steps or steps < 1.0 - _SAME:
        raise BadInputError(
            f"{contract.file} calls its policy every {contract.timing.policy_dt:g} s and does not "
            f"say at which timestep; {model.timestep:g} s, of {model.path.name}, is no whole part "
            "of it: write timing.sim_dt"
        )
    return model.timestep


@dataclass(frozen=True)
class _Drives:
    """How joints are driven.

    Attributes:
        kind: By servos within the step, or by torques that are computed before it.
        kp, kd, limit: (n,) of the joints of the policy.
        compiled: An edited copy of the compiled model; None where the file has it so.
        options: What `Model.replace` is given.
    """

    kind: ActuatorKind
    kp: Array
    kd: Array
    limit: Array
    compiled: Any
    options: dict[str, Array]


def _drives(
    model: Model, contract: Contract, binding: Binding, changes: list[ContractChange]
) -> _Drives:
    """Return how the joints are driven, and note what the file has otherwise."""
    at = binding.ctrl
    has_servos = _has_servos(model, binding)
    kind: ActuatorKind = contract.servos.kind or "implicit_pd"
    kp, kd = _gains(model, contract, binding, has_servos)
    file_limit = _force_limit(model, binding, has_servos)
    limit = contract.servos.effort_limit
    if limit is None:
        limit = file_limit
    elif not _are_equal(file_limit, limit):
        changes.append(_joint_change("force limit", "N·m", file_limit, limit))
    if has_servos is not (kind == "implicit_pd"):
        changes.append(ContractChange("servos", len(at), "", None, None))
    elif has_servos:
        rows: tuple[tuple[Property, str, Array, Array], ...] = (
            ("kp", "N·m/rad", model.actuator_kp[at], kp),
            ("kd", "N·m·s/rad", model.actuator_kv[at], kd),
        )
        for name, unit, of_file, wanted in rows:
            if not _are_equal(of_file, wanted):
                changes.append(_joint_change(name, unit, of_file, wanted))
    names = {change.name for change in changes}
    if names & {"servos", "force limit"} or _says_more(model, binding, kind):
        compiled = _edited(model, binding, kind, kp, kd, limit)
        return _Drives(kind, kp, kd, limit, compiled, {})
    options: dict[str, Array] = {}
    if "kp" in names:
        options["kp"] = _with(model.actuator_kp, at, kp)
    if "kd" in names:
        options["kv"] = _with(model.actuator_kv, at, kd)
    return _Drives(kind, kp, kd, limit, None, options)


def _has_servos(model: Model, binding: Binding) -> bool:
    """Tell whether the joints are driven by servos in the file, and not by motors."""
    are_servos = np.isfinite(model.actuator_kp[binding.ctrl])
    are_motors = np.isfinite(model.actuator_gain[binding.ctrl])
    if not (are_servos.all() or are_motors.all()):
        raise BadInputError(
            f"the joints of the policy are driven by servos and by others in {model.path.name}"
        )
    return bool(are_servos.all())


def _joints(model: Model, binding: Binding) -> Ints:
    """Return the joints (n,) of the policy."""
    return model.actuator_jntid[binding.ctrl]


def _says_more(model: Model, binding: Binding, kind: ActuatorKind) -> bool:
    """Tell whether more than kp, kd and a force limit makes a torque of a command in the file.

    That is the gain of a motor, which is commanded a torque here, and a limit that stands at the
    joint instead of its actuator.
    """
    has_gain = kind == "explicit_pd" and not np.all(model.actuator_gain[binding.ctrl] == 1.0)
    return has_gain or bool(model.compiled.jnt_actfrclimited[_joints(model, binding)].any())


def _gains(
    model: Model, contract: Contract, binding: Binding, has_servos: bool
) -> tuple[Array, Array]:
    """Return the gains (n,) of the contract, or of the file where that does not say."""
    kp, kd = contract.servos.kp, contract.servos.kd
    if has_servos:
        kp = model.actuator_kp[binding.ctrl] if kp is None else kp
        kd = model.actuator_kv[binding.ctrl] if kd is None else kd
    if kp is None or kd is None:
        raise _no_gains(model, contract)
    return kp, kd


def _no_gains(model: Model, contract: Contract) -> BadInputError:
    """Return the error that nobody says how stiff the joints are."""
    return BadInputError(
        f"{model.path.name} has motors, and {contract.file} has no gains: write "
        "control.actuators.kp and kd"
    )


def _force_limit(model: Model, binding: Binding, has_servos: bool) -> Array:
    """Return the largest force (n,) of each joint [N·m], as the file has it.

    What a motor is commanded is its force, so the range of its command limits it, too.
    """
    at, joints, compiled = binding.ctrl, _joints(model, binding), model.compiled
    limit = np.abs(model.actuator_forcerange[at]).min(axis=1)
    of_joints = np.abs(compiled.jnt_actfrcrange[joints]).min(axis=1)
    limit = np.where(compiled.jnt_actfrclimited[joints], np.minimum(limit, of_joints), limit)
    if has_servos:
        return limit
    commands = np.abs(model.actuator_ctrlrange[at]).min(axis=1)
    return np.minimum(limit, commands * np.abs(model.actuator_gain[at]))


def _edited(
    model: Model, binding: Binding, kind: ActuatorKind, kp: Array, kd: Array, limit: Array
) -> Any:
    """Return a copy of the compiled model whose joints are driven as the contract says."""
    compiled = copy.copy(model.compiled)
    for number, actuator in enumerate(binding.ctrl.tolist()):
        compiled.actuator_gaintype[actuator] = _FIXED_GAIN
        compiled.actuator_gainprm[actuator] = 0.0
        compiled.actuator_biasprm[actuator] = 0.0
        if kind == "implicit_pd":
            compiled.actuator_gainprm[actuator, 0] = kp[number]
            compiled.actuator_biastype[actuator] = _AFFINE_BIAS
            compiled.actuator_biasprm[actuator, 1] = -kp[number]
            compiled.actuator_biasprm[actuator, 2] = -kd[number]
        else:
            compiled.actuator_gainprm[actuator, 0] = 1.0
            compiled.actuator_biastype[actuator] = _NO_BIAS
        was_servo = bool(np.isfinite(model.actuator_kp[actuator]))
        if not was_servo or kind == "explicit_pd":
            # The range is of a torque, which the force limit has, or of an angle before.
            compiled.actuator_ctrllimited[actuator] = 0
        compiled.jnt_actfrclimited[model.actuator_jntid[actuator]] = 0
        finite = bool(np.isfinite(limit[number]))
        compiled.actuator_forcelimited[actuator] = finite
        if finite:
            compiled.actuator_forcerange[actuator] = (-limit[number], limit[number])
    return compiled


def _joint_options(
    model: Model, contract: Contract, binding: Binding, changes: list[ContractChange]
) -> dict[str, Array]:
    """Return what `replace` is given for armature, damping and friction of the joints."""
    servos = contract.servos
    at = binding.qvel
    options: dict[str, Array] = {}
    rows: tuple[tuple[Property, str, str, Array, Array | None], ...] = (
        ("armature", "armature", "kg·m²", model.dof_armature, servos.armature),
        ("damping", "damping", "N·m·s/rad", model.dof_damping, servos.damping),
        ("friction", "frictionloss", "N·m", model.dof_frictionloss, servos.friction),
    )
    for name, option, unit, of_file, wanted in rows:
        if wanted is None or _are_equal(of_file[at], wanted):
            continue
        changes.append(_joint_change(name, unit, of_file[at], wanted))
        options[option] = _with(of_file, at, wanted)
    return options


def _with(values: Array, at: Ints, new: Array) -> Array:
    """Return a copy of values with others at some places."""
    changed = np.array(values)
    changed[at] = new
    return changed


def _are_equal(left: Array, right: Array) -> bool:
    return bool(np.allclose(left, right, rtol=_SAME, atol=0.0))


def _joint_change(name: Property, unit: str, of_file: Array, wanted: Array) -> ContractChange:
    """Return a change of joints: how many differ, and between which values each lies."""
    differ = ~np.isclose(of_file, wanted, rtol=_SAME, atol=0.0)
    return ContractChange(
        name=name,
        joints=int(differ.sum()),
        unit=unit,
        file=(float(of_file[differ].min()), float(of_file[differ].max())),
        contract=(float(wanted[differ].min()), float(wanted[differ].max())),
    )


def _scalar_change(name: Property, unit: str, of_file: float, wanted: float) -> ContractChange:
    return ContractChange(name, 0, unit, (of_file, of_file), (wanted, wanted))
