"""A compiled MJCF as the facts of a Model: read by every backend that starts from one."""

from __future__ import annotations

import copy
import hashlib
import os
from typing import Any

import mujoco
import numpy as np

from ..errors import BadInputError, ModelError
from ..model import Model
from ..records import Array, Keyframe
from ._mjb import check_binary
from ._mjcf_numbers import problems

_DISABLE = mujoco.mjtDisableBit
_SWITCHES = {  # option of `replace` -> the flag that turns it off
    "actuation": _DISABLE.mjDSBL_ACTUATION,
    "contacts": _DISABLE.mjDSBL_CONTACT,
    "limits": _DISABLE.mjDSBL_LIMIT,
}
_HINDRANCES = {  # option -> flags of a file that would leave it without effect
    "gravity": (_DISABLE.mjDSBL_GRAVITY,),
    "damping": (_DISABLE.mjDSBL_DAMPER,),
    "frictionloss": (_DISABLE.mjDSBL_FRICTIONLOSS, _DISABLE.mjDSBL_CONSTRAINT),
    "contacts": (_DISABLE.mjDSBL_CONSTRAINT,),
    "limits": (_DISABLE.mjDSBL_CONSTRAINT,),
}


def compile_file(path: str | os.PathLike[str]) -> mujoco.MjModel:
    """Compile an MJCF, URDF or MJB file.

    Raises:
        ModelError: MuJoCo cannot compile the file, or what it holds makes no simulation; with
            the reason.
    """
    text = os.fspath(path)
    binary = text.lower().endswith(".mjb")
    if binary:
        check_binary(text)
    try:
        raw = (mujoco.MjModel.from_binary_path if binary else mujoco.MjModel.from_xml_path)(text)
    except (ValueError, MemoryError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split()) or "out of memory"
        raise ModelError(f"MuJoCo cannot read {text}: {reason}") from error
    for problem in problems(raw):
        raise ModelError(f"{text}: {problem}")
    return raw


def edited(raw: mujoco.MjModel, options: dict[str, Any]) -> mujoco.MjModel:
    """A copy with checked options of `Model.replace`; timestep and integrator apart."""
    raw = copy.copy(raw)
    for name, value in options.items():
        for flag in _HINDRANCES.get(name, ()):  # else the option would be without effect
            raw.opt.disableflags &= ~int(flag)
        if name in _SWITCHES:
            flag = int(_SWITCHES[name])
            raw.opt.disableflags = (raw.opt.disableflags & ~flag) | (0 if value else flag)
        elif name == "gravity":
            raw.opt.gravity[:] = value
        elif name in ("armature", "damping", "frictionloss"):
            getattr(raw, f"dof_{name}")[:] = value
    if "armature" in options:
        mujoco.mj_setConst(raw, mujoco.MjData(raw))  # inverse weights follow from it
    return raw


def step_length(timestep: float, substeps: int, options: dict[str, Any]) -> float:
    """What one engine step takes [s] after `replace`.

    Raises:
        BadInputError: So many substeps leave nothing of a timestep.
    """
    whole = options.get("timestep", timestep)
    if whole / substeps <= 0:
        raise BadInputError(f"a timestep of {whole} s cannot have {substeps} substeps")
    return whole / substeps


def gravity(m: mujoco.MjModel) -> Array:
    """Gravity (3,) [m/s²], zero where the model's file turns it off."""
    return np.array(m.opt.gravity) * (not m.opt.disableflags & int(_DISABLE.mjDSBL_GRAVITY))


def facts(m: mujoco.MjModel) -> dict[str, Any]:
    """What `Model.__init__` wants of a compiled model, but for what a backend adds."""
    on_joint = m.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)
    servo = (
        (m.actuator_gaintype == int(mujoco.mjtGain.mjGAIN_FIXED))
        & (m.actuator_biastype == int(mujoco.mjtBias.mjBIAS_AFFINE))
        & (m.actuator_biasprm[:, 1] == -m.actuator_gainprm[:, 0])
        & (m.actuator_gainprm[:, 0] != 0)
    )
    return {
        "gravity": gravity(m),
        "nq": m.nq,
        "nv": m.nv,
        "nu": m.nu,
        "nbody": m.nbody,
        "njnt": m.njnt,
        "nsite": m.nsite,
        "ngeom": m.ngeom,
        "body_names": tuple(m.body(i).name for i in range(m.nbody)),
        "joint_names": tuple(m.joint(i).name for i in range(m.njnt)),
        "site_names": tuple(m.site(i).name for i in range(m.nsite)),
        "geom_names": tuple(m.geom(i).name for i in range(m.ngeom)),
        "actuator_names": tuple(m.actuator(i).name for i in range(m.nu)),
        "jnt_type": m.jnt_type.astype(np.int64),
        "jnt_qposadr": m.jnt_qposadr.astype(np.int64),
        "jnt_dofadr": m.jnt_dofadr.astype(np.int64),
        "jnt_limited": m.jnt_limited.astype(bool),
        "jnt_range": m.jnt_range,
        "actuator_jntid": np.where(on_joint, m.actuator_trnid[:, 0], -1).astype(np.int64),
        "actuator_ctrlrange": _ranges(m.actuator_ctrlrange, m.actuator_ctrllimited),
        "actuator_forcerange": _ranges(m.actuator_forcerange, m.actuator_forcelimited),
        "actuator_kp": np.where(servo, m.actuator_gainprm[:, 0], np.nan),
        "actuator_kv": np.where(servo, -m.actuator_biasprm[:, 2], np.nan),
        "dof_armature": m.dof_armature,
        "dof_damping": m.dof_damping,
        "dof_frictionloss": m.dof_frictionloss,
        "body_parentid": m.body_parentid.astype(np.int64),
        "jnt_bodyid": m.jnt_bodyid.astype(np.int64),
        "geom_bodyid": m.geom_bodyid.astype(np.int64),
        "site_bodyid": m.site_bodyid.astype(np.int64),
        "site_pos": m.site_pos,
        "site_quat": m.site_quat,
        "keyframes": tuple(
            Keyframe(
                m.key(i).name, float(m.key_time[i]), m.key_qpos[i], m.key_qvel[i], m.key_ctrl[i]
            )
            for i in range(m.nkey)
        ),
    }


def with_fingerprint(
    model: Model, layout: tuple[tuple[str, int], ...]
) -> tuple[str, tuple[tuple[str, int], ...]]:
    """The layout of a Model's States, after a digest of it and of what it belongs to."""
    identity = (
        model.backend,
        layout,
        model.joint_names,
        model.jnt_type.tolist(),
        model.jnt_qposadr.tolist(),
        model.actuator_names,
    )
    return hashlib.sha256(repr(identity).encode()).hexdigest()[:16], layout


def _ranges(ranges: Array, limited: Any) -> Array:
    return np.where(limited[:, None].astype(bool), ranges, [-np.inf, np.inf])
