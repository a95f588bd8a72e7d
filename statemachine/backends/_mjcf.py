"""A compiled MJCF as the facts of a Model: read by every backend that starts from one."""

from __future__ import annotations

import os
from typing import Any

import mujoco
import numpy as np

from ..errors import ModelError
from ..records import Array, Keyframe


def compile_file(path: str | os.PathLike[str]) -> mujoco.MjModel:
    """Compile an MJCF, URDF or MJB file.

    Raises:
        ModelError: MuJoCo cannot compile the file; with its reason.
    """
    text = os.fspath(path)
    try:
        if text.lower().endswith(".mjb"):
            return mujoco.MjModel.from_binary_path(text)
        return mujoco.MjModel.from_xml_path(text)
    except (ValueError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        raise ModelError(f"MuJoCo cannot read {text}: {reason}") from error


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


def _ranges(ranges: Array, limited: Any) -> Array:
    return np.where(limited[:, None].astype(bool), ranges, [-np.inf, np.inf])
