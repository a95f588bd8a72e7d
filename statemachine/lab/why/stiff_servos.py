"""Servos that only a limit of their force, or an implicit integrator, keeps from diverging.

MuJoCo's Euler integrates the damping of a servo, its kv, explicitly: beyond kv·gear²·h/M = 2, for a
step h and an inertia M of the joint, the speed of the joint changes its sign and grows in every
step. A limited force ends that growth, and so does an integrator that takes the damping implicitly.
So of two sides that differ in both, the limit cannot be taken away on a side that stays with Euler.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...interface import Array, Model
from .causes import Cause

INTEGRATOR = "integrator"  # the cause
_EULER = "euler"
_STABLE = 2.0
_LIMITS = ("force limit", "force range")  # the subjects of causes that bound the force of a servo


def needs_of_limits(
    causes: Iterable[Cause], right: Model, integrators: tuple[str, str]
) -> dict[str, str]:
    """Return which cause has to be equalized before which, so that no servo diverges.

    Args:
        causes: What two sides differ in.
        right: The right side, which is given the values of the left.
        integrators: What the left and the right integrate with.

    Returns:
        By the name of a cause that of the one which it needs: a limit that is taken away the
        integrator, where the right has Euler; the integrator a limit that is set, where the left
        has it.
    """
    known = {cause.name: cause for cause in causes}
    are_one = len({integrator == _EULER for integrator in integrators}) == 1
    if INTEGRATOR not in known or are_one or not has_stiff_servo(right):
        return {}
    limits = [cause.name for cause in known.values() if _is_limit(cause)]
    if integrators[1] == _EULER:
        return dict.fromkeys(limits, INTEGRATOR)
    return {INTEGRATOR: limits[0]} if len(limits) == 1 else {}


def _is_limit(cause: Cause) -> bool:
    """Tell whether a cause bounds the force of servos."""
    return any(row.subject in _LIMITS for row in cause.differences)


def has_stiff_servo(model: Model) -> bool:
    """Tell whether the damping of a servo is too much for a step of explicit integration."""
    return bool((stiffness_of_servos(model) > _STABLE).any())


def stiffness_of_servos(model: Model) -> Array:
    """Return kv·gear²·h/M (nu,) of servos on hinges and slides, 0 of other actuators.

    Args:
        model: A Model with a compiled model, whose inertias are those in its default state.
    """
    raw, joints = model.compiled, model.actuator_jntid
    stiffness = np.zeros(model.nu)
    if raw is None:
        return stiffness
    on_joint = (joints >= 0) & np.isfinite(model.actuator_kv)
    dofs = model.jnt_dofadr[joints[on_joint]]
    damping = model.actuator_kv[on_joint] * model.actuator_gear[on_joint] ** 2
    stiffness[on_joint] = damping * float(raw.opt.timestep) * raw.dof_invweight0[dofs]
    return stiffness
