"""The moment arms of actuators: by how much each drives each joint."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...installed import require
from ...interface import JointType
from ._sides import name_of

_LEAST = 1e-12  # of the largest moment: less is rounding


def moment_arms(raw: Any) -> tuple[dict[str, float], ...]:
    """Return the moment arms of each actuator on hinges and slides, at qpos0.

    A servo of gain kp acts on a joint with the moment arm r as a spring of r² kp.

    Args:
        raw: An mjModel.

    Returns:
        For each actuator, by the name of a joint that it drives, how much its length changes with
        the position of the joint, gear included [m or rad per m or rad]. Of an actuator with
        several outputs they are those of the first.
    """
    mujoco = require("mujoco")

    data = mujoco.MjData(raw)
    for stage in ("kinematics", "comPos", "tendon", "transmission"):
        getattr(mujoco, f"mj_{stage}")(raw, data)
    joints: dict[int, str] = {}
    for joint in range(raw.njnt):
        if JointType(raw.jnt_type[joint]).nv == 1:
            joints[int(raw.jnt_dofadr[joint])] = name_of(raw, "joint", joint)
    arms: list[dict[str, float]] = []
    for output in raw.actuator_outadr.tolist():
        start, count = int(data.moment_rowadr[output]), int(data.moment_rownnz[output])
        dofs = data.moment_colind[start : start + count]
        values = np.array(data.actuator_moment[start : start + count])
        least = _LEAST * np.abs(values).max(initial=0.0)
        arms.append(
            {
                joints[dof]: value
                for dof, value in zip(dofs.tolist(), values.tolist(), strict=True)
                if dof in joints and abs(value) > least
            }
        )
    return tuple(arms)
