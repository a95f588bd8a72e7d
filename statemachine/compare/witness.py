"""Each side's fingertip against a third party: two that agree may both be wrong."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import StateMachineError
from ..installed import WITNESS
from ..kinematics import Kinematics
from ..scenarios.provenance import model_files
from ..traces import Header, Trace, model_file
from .series import default_tip


@dataclass(frozen=True)
class Witness:
    """How far a site of the traces is from where the witness puts it.

    Attributes:
        by: The witness and its version.
        site: Which site.
        one: Largest distance at any row of the first trace [m]; two: of the second.
        rows: How many poses were compared.
    """

    by: str
    site: str
    one: float
    two: float
    rows: int


def witness(one: Trace, two: Trace, path: Path | None = None) -> Witness | None:
    """Pinocchio's forward kinematics of each trace's qpos, against the recorded site.

    Args:
        one: A trace.
        two: Another, of the same model.
        path: The model's file; by default the one that the headers name.

    Returns:
        None where Pinocchio is missing, where it cannot read the model, and where the file
        that the traces were recorded with is not here.
    """
    site = default_tip(one.header, two.header)
    if not site or "site_xpos" not in one or "site_xpos" not in two:
        return None
    ours, theirs = (trace.header.provenance.model_sha256 for trace in (one, two))
    if path is None and ours != theirs:
        return None  # one model cannot be the witness of two
    try:
        file, same = (path, True) if path else model_file(one.header)
        if not same:
            return None
        kinematics = _readable(file, one.header)
        if kinematics is None:
            return None
        gaps = [_gap(kinematics, trace, site) for trace in (one, two)]
        if not np.isfinite(gaps).all():
            return None
    except StateMachineError:
        return None
    return Witness(f"{WITNESS} {kinematics.version}", site, *gaps, rows=len(one) + len(two))


def _readable(file: Path, header: Header) -> Kinematics | None:
    """The robot from a scene's file or from one that it includes."""
    for path in model_files(file):
        try:
            found = Kinematics(path)
        except StateMachineError:
            continue
        if set(found.joint_names) <= set(header.joints):
            shared = [name for name in header.joints if name in found.joint_names]
            return Kinematics(path, joint_names=shared)
    return None


def _gap(kinematics: Kinematics, trace: Trace, site: str) -> float:
    header = trace.header
    places = [header.jnt_qposadr[header.joints.index(name)] for name in kinematics.joint_names]
    theirs = kinematics.poses(trace.qpos[:, places], site).pos
    ours, _ = trace.site(site)
    return float(np.linalg.norm(ours - theirs, axis=1).max())
