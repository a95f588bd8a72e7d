"""What the options of a compiled model say: its integrator, and what is switched off or on."""

from __future__ import annotations

from enum import IntEnum, IntFlag

import mujoco


class IntegratorKind(IntEnum):
    """Integrators: `opt.integrator`."""

    EULER = int(mujoco.mjtIntegrator.mjINT_EULER)
    RK4 = int(mujoco.mjtIntegrator.mjINT_RK4)
    IMPLICIT = int(mujoco.mjtIntegrator.mjINT_IMPLICIT)
    IMPLICITFAST = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
    DISCRETE = int(mujoco.mjtIntegrator.mjINT_DISCRETE)


class DisableFlag(IntFlag):
    """What a model switches off: `opt.disableflags`."""

    CONSTRAINT = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    EQUALITY = int(mujoco.mjtDisableBit.mjDSBL_EQUALITY)
    FRICTIONLOSS = int(mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS)
    LIMIT = int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    CONTACT = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    SPRING = int(mujoco.mjtDisableBit.mjDSBL_SPRING)
    DAMPER = int(mujoco.mjtDisableBit.mjDSBL_DAMPER)
    GRAVITY = int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    CLAMPCTRL = int(mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL)
    FILTERPARENT = int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    ACTUATION = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    REFSAFE = int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    EULERDAMP = int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)


class EnableFlag(IntFlag):
    """What a model switches on: `opt.enableflags`."""

    OVERRIDE = int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
    SLEEP = int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    DIAGEXACT = int(mujoco.mjtEnableBit.mjENBL_DIAGEXACT)
