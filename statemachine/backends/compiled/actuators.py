"""Numbers by which a compiled model says how an actuator acts: MuJoCo's enumerations."""

from __future__ import annotations

from enum import IntEnum, IntFlag

import mujoco


class TransmissionKind(IntEnum):
    """What an actuator drives: `actuator_trntype`."""

    JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)
    JOINT_IN_PARENT = int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    SLIDER_CRANK = int(mujoco.mjtTrn.mjTRN_SLIDERCRANK)
    TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)
    SITE = int(mujoco.mjtTrn.mjTRN_SITE)
    BODY = int(mujoco.mjtTrn.mjTRN_BODY)
    SO3 = int(mujoco.mjtTrn.mjTRN_SO3)


class GainKind(IntEnum):
    """What the gain of an actuator depends on: `actuator_gaintype`."""

    FIXED = int(mujoco.mjtGain.mjGAIN_FIXED)
    AFFINE = int(mujoco.mjtGain.mjGAIN_AFFINE)
    MUSCLE = int(mujoco.mjtGain.mjGAIN_MUSCLE)
    SO3 = int(mujoco.mjtGain.mjGAIN_SO3)


class BiasKind(IntEnum):
    """What the bias of an actuator depends on: `actuator_biastype`."""

    NONE = int(mujoco.mjtBias.mjBIAS_NONE)
    AFFINE = int(mujoco.mjtBias.mjBIAS_AFFINE)
    MUSCLE = int(mujoco.mjtBias.mjBIAS_MUSCLE)


class ActivationKind(IntEnum):
    """How the activation of an actuator changes: `actuator_dyntype`."""

    NONE = int(mujoco.mjtDyn.mjDYN_NONE)
    INTEGRATOR = int(mujoco.mjtDyn.mjDYN_INTEGRATOR)
    FILTER = int(mujoco.mjtDyn.mjDYN_FILTER)
    FILTEREXACT = int(mujoco.mjtDyn.mjDYN_FILTEREXACT)
    MUSCLE = int(mujoco.mjtDyn.mjDYN_MUSCLE)


class CtrlInput(IntFlag):
    """What the controls of an actuator with several are: bits of `actuator_ctrlspec`."""

    POSITION = int(mujoco.mjtCtrlInput.mjINPUT_POS)
    VELOCITY = int(mujoco.mjtCtrlInput.mjINPUT_VEL)
    FEEDFORWARD = int(mujoco.mjtCtrlInput.mjINPUT_FF)
    VOLTAGE = int(mujoco.mjtCtrlInput.mjINPUT_VOLTAGE)
    PRESSURE = int(mujoco.mjtCtrlInput.mjINPUT_PRESSURE)


class CtrlChart(IntEnum):
    """In what a rotation is commanded: `actuator_ctrlspec` of an actuator in SO(3)."""

    EXPMAP = int(mujoco.mjtCtrlChart.mjCHART_EXPMAP)
    QUAT = int(mujoco.mjtCtrlChart.mjCHART_QUAT)
