"""What is read alike of every release of MuJoCo: contacts, parts of the constraint forces, fields.

The backend imports it. In the Python of another release `release_child` runs it: so it needs NumPy
and MuJoCo only, on Python 3.9 or later, and imports nothing of this package.
"""

from __future__ import annotations

import mujoco
import numpy as np

_KINDS = mujoco.mjtConstraint
PARTS = {
    "qfrc_contact": (
        _KINDS.mjCNSTR_CONTACT_FRICTIONLESS,
        _KINDS.mjCNSTR_CONTACT_PYRAMIDAL,
        _KINDS.mjCNSTR_CONTACT_ELLIPTIC,
    ),
    "qfrc_friction": (_KINDS.mjCNSTR_FRICTION_DOF, _KINDS.mjCNSTR_FRICTION_TENDON),
    "qfrc_limit": (_KINDS.mjCNSTR_LIMIT_JOINT, _KINDS.mjCNSTR_LIMIT_TENDON),
    "qfrc_equality": (_KINDS.mjCNSTR_EQUALITY,),
}


def contact_arrays(model, data):
    """Return arrays of the contacts, by name; the forces are along the axes of each."""
    listed, force = data.contact, np.zeros((data.ncon, 6))
    for k in range(data.ncon):
        mujoco.mj_contactForce(model, data, k, force[k])
    arrays = {"dist": np.array(listed.dist), "force": force[:, :3], "torque": force[:, 3:]}
    arrays["geom"] = np.array(listed.geom, dtype=np.int64).reshape(-1, 2)
    arrays["pos"] = np.array(listed.pos).reshape(-1, 3)
    arrays["frame"] = np.array(listed.frame).reshape(-1, 3, 3)
    return arrays


def constraint_part(model, data, part):
    """Return the forces (nv,) of the rows of constraints that make up one of `PARTS`."""
    total = np.zeros(model.nv)
    if data.nefc:
        rows = np.isin(data.efc_type, [int(kind) for kind in PARTS[part]])
        mujoco.mj_mulJacTVec(model, data, total, np.where(rows, data.efc_force, 0.0))
    return total


def owner_of_field(model, name):
    """Return the owner of a field, and its name there: "opt.timestep", "body_mass"."""
    holder, _, field = name.rpartition(".")
    return (getattr(model, holder) if holder else model), field
