"""What a robot of any kind is told: a pose to hold, waves to follow.

A number of ctrl is what its actuator makes of it: a position servo takes it as a target, a motor
as a force. So a pose is asked of servos only, and a motor gets the force that holds its joint.
"""

from __future__ import annotations

import numpy as np

from ...errors import BadInputError
from ...interface import Array, JointType, Model
from .robot import (
    ARM_TARGET,
    home_keyframe,
    is_servo,
    is_so101,
    on_scalar_joint,
    start_qpos_and_holding_force,
    target_towards_farther_end,
)

_MAX_DISPLACEMENT = {JointType.HINGE: 0.5, JointType.SLIDE: 0.1}  # rad, m; of a wide range or none
_FORCE_ROUNDING = 1e-9  # N·m or N; less is rounding
_DIGITS = 4  # of what is computed, so that it can be typed and is the same on every engine


def start_ctrl(model: Model) -> Array:
    """Return ctrl (nu,) at the start: the keyframe's, else zero."""
    key = home_keyframe(model)
    return np.zeros(model.nu) if key is None else model.keyframes[model.key_id(key)].ctrl.copy()


def hold_ctrl(model: Model) -> Array:
    """Return the command (nu,) of `hold`: a pose for the servos, and what holds the other joints.

    The SO-101 gets its own pose. Of another robot each position servo is sent from where it
    starts by a quarter of its range, towards the farther end, and by at most 0.5 rad or 0.1 m. A
    motor gets the force against gravity at the start, as far as that is known and in its range;
    what else there is, as a muscle or a thruster, is left at the start's ctrl.

    Raises:
        BadInputError: The model has no actuators.
    """
    check_has_actuators(model)
    if is_so101(model) and model.nu == len(ARM_TARGET):
        return np.array(ARM_TARGET)
    qpos, load = start_qpos_and_holding_force(model)
    ctrl, servos, key = start_ctrl(model), is_servo(model), home_keyframe(model)
    for i in range(model.nu):
        low, high = model.actuator_ctrlrange[i]
        joint, gear = model.actuator_jntid[i], float(model.actuator_gear[i])
        if servos[i]:
            begin = ctrl[i] if key else float(qpos[model.jnt_qposadr[joint]] * gear)
            most = _MAX_DISPLACEMENT[JointType(int(model.jnt_type[joint]))] * abs(gear)
            ctrl[i] = target_towards_farther_end(begin, _reachable_targets(model, i), most)
        elif load is not None and _is_motor_on_fixed_base(model, i):
            force = load[model.jnt_dofadr[joint]] / np.count_nonzero(model.actuator_jntid == joint)
            if abs(force) > _FORCE_ROUNDING:
                factor = model.actuator_gain[i] * gear
                ctrl[i] = np.clip(force / factor, low, high)
    return np.array([float(f"{value:.{_DIGITS}g}") + 0.0 for value in ctrl])


def check_has_actuators(model: Model) -> None:
    """Raise BadInputError for a model that nothing can be commanded in."""
    if not model.nu:
        raise BadInputError(f"{model.path.name} has no actuators: nothing in it takes a command")


def _reachable_targets(model: Model, i: int) -> tuple[float, float]:
    """Return the targets that a servo can reach: its ctrlrange, within the limits of its joint."""
    low, high = (float(end) for end in model.actuator_ctrlrange[i])
    joint = model.actuator_jntid[i]
    if model.jnt_limited[joint]:
        ends = np.sort(model.jnt_range[joint] * model.actuator_gear[i])
        if max(low, ends[0]) < min(high, ends[1]):
            low, high = max(low, float(ends[0])), min(high, float(ends[1]))
    return low, high


def _is_motor_on_fixed_base(model: Model, i: int) -> bool:
    """Return whether an actuator is a motor on a joint that hangs on no floating base.

    The legs of a robot that floats carry what the floor gives back, which is not known.
    """
    if not (np.isfinite(model.actuator_gain[i]) and on_scalar_joint(model)[i]):
        return False
    if not model.actuator_gain[i] * model.actuator_gear[i]:
        return False
    body = int(model.jnt_bodyid[model.actuator_jntid[i]])
    while body:
        kinds = model.jnt_type[model.jnt_bodyid == body]
        if np.isin(kinds, (int(JointType.FREE), int(JointType.BALL))).any():
            return False
        body = int(model.body_parentid[body])
    return True


def draw_waves(model: Model, seed: int) -> tuple[Array, Array, Array, Array]:
    """Draw the waves that every actuator follows.

    They stay within the middle half of its range; without a range, of one from -1 to 1. A robot
    with a keyframe "home" is moved about that one's ctrl.

    Args:
        model: The robot.
        seed: Draws sizes, frequencies and phases.

    Returns:
        The middle (nu,) [unit of the actuator]; size [the same], frequency [Hz] and phase [rad]
        (3, nu) of three sines.

    Raises:
        BadInputError: The seed is negative.
    """
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")
    low, high = np.nan_to_num(model.actuator_ctrlrange, posinf=1.0, neginf=-1.0).T
    draw = np.random.default_rng(seed)
    frequency = draw.uniform(0.2, 1.5, (3, model.nu))  # Hz
    phase = draw.uniform(0.0, 2 * np.pi, (3, model.nu))
    size = draw.uniform(0.2, 1.0, (3, model.nu))
    size *= 0.25 * (high - low) / size.sum(axis=0)
    middle = (low + high) / 2
    if home_keyframe(model) is not None:
        quarter = 0.25 * (high - low)
        middle = np.clip(start_ctrl(model), low + quarter, high - quarter)
    return middle, size, frequency, phase
