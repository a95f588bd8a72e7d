"""Runs of plain MuJoCo, their Shapley shares, and what `compare --why` says of the same files."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ._tally import command, run_bounded

SECONDS = 0.4  # of a run
TIMESTEP = 0.002
SAME = 1e-6  # of a gap: two computations of one run
SHARE = 0.02  # how far a share may be from the raw one
PATIENCE = 300.0  # s, of one command on a busy machine

Value = TypeVar("Value", float, str)


def raw_joints(
    text: str,
    command_of: Callable[[float, int], float] | None,
    timestep: float = TIMESTEP,
) -> np.ndarray:
    """Return the angles of all hinges at each step, shape (nstep + 1, number of hinges) [rad].

    Args:
        text: MJCF or URDF.
        command_of: The command of an actuator at a time [s]; None for actuators that are off.
        timestep: Of each step [s].
    """
    import mujoco

    model = mujoco.MjModel.from_xml_string(text)
    if command_of is None:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    model.opt.timestep = timestep
    data = mujoco.MjData(model)
    hinges = model.jnt_qposadr[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]
    rows = [data.qpos[hinges].copy()]
    for _ in range(round(SECONDS / timestep)):
        if command_of is not None:
            data.ctrl[:] = [command_of(data.time, index) for index in range(model.nu)]
        mujoco.mj_step(model, data)
        rows.append(data.qpos[hinges].copy())
    return np.array(rows)


def raw_shares(
    left: Mapping[str, Value],
    right: Mapping[str, Value],
    joints_of: Callable[[Mapping[str, Value]], np.ndarray],
) -> tuple[float, dict[str, float]]:
    """Return the worst gap of any joint [rad], and the Shapley share of each edit in it.

    All sets of edits are run. A share is the mean, over all orders of the edits, of the part of the
    gap that goes when this one is taken back.
    """
    names = [name for name in left if left[name] != right[name]]
    truth = joints_of(left)
    gaps: dict[frozenset[str], float] = {}
    for length in range(len(names) + 1):
        for equalized in itertools.combinations(names, length):
            parameters = dict(right) | {name: left[name] for name in equalized}
            gaps[frozenset(equalized)] = float(np.abs(joints_of(parameters) - truth).max())
    whole = gaps[frozenset()]
    shares = dict.fromkeys(names, 0.0)
    orders = list(itertools.permutations(names))
    for order in orders:
        for place, name in enumerate(order):
            before = gaps[frozenset(order[:place])]
            shares[name] += (before - gaps[frozenset(order[: place + 1])]) / whole / len(orders)
    return whole, shares


def asked(folder: Path, *words: str) -> tuple[int | None, dict[str, Any], str]:
    code, out, error = run_bounded(command(*words, "--json"), folder, PATIENCE)
    try:
        return code, json.loads(out), error
    except json.JSONDecodeError:
        return code, {}, error


def asked_why(folder: Path, what: str, *words: str) -> tuple[int | None, dict[str, Any], str]:
    return asked(
        folder, "compare", what, *words, "--why", "--quantity", "joints",
        "--seconds", str(SECONDS),
    )  # fmt: skip
