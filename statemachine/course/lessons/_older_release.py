"""The run of the lesson on six numbers, on a release of the engine that is older."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...backends import load
from ...errors import StateMachineError
from ...installed import DEFAULT
from ...interface import Array, Model
from ...lab.recordings import read_shipped_trace, record_scenario
from ...lab.runs.provenance import model_digest
from ...lab.runs.scenarios import SCENARIOS
from ...measures import largest
from ...release_names import version_of
from ...releases import is_here

OLDER = "mujoco==3.3.7"  # its servos damp where their force is at its limit, too


@dataclass(frozen=True)
class OlderRelease:
    """The run of the course on a release that is older than the installed one.

    Attributes:
        version: Of that release.
        gap: The largest distance between the same joint on the two [rad].
        joint: Which joint it is.
        at: When [s].
        recorded: Whether it is the recorded run that comes with the package.
    """

    version: str
    gap: float
    joint: str
    at: float
    recorded: bool


def on_older_release(model: Model, ctrl: Array, qpos: Array) -> OlderRelease | None:
    """Compare the run (n, nq) of the course with that on a release older than the installed one."""
    if model.backend != DEFAULT:
        return None
    known, here = read_shipped_trace("hold", OLDER), is_here(OLDER)
    same_file = known.header.provenance.model_sha256 == model_digest(model.path)
    same_run = known.qpos.shape == qpos.shape and np.array_equal(known.ctrl[-1], ctrl)
    if not (same_file and same_run):
        return None
    if here:
        try:
            known = record_scenario(SCENARIOS["hold"], load(model.path, OLDER))
        except StateMachineError:  # it does not run any more
            here = False
    gap, place = largest(np.abs(known.qpos - qpos).ravel())
    moment, joint = divmod(place, qpos.shape[1])
    return OlderRelease(
        version=version_of(OLDER),
        gap=gap,
        joint=model.joint_names[joint],
        at=float(known.time[moment]),
        recorded=not here,
    )
