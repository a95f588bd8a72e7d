"""How far two fingertips are from where a third party puts them: two that agree may be wrong."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...backends import load
from ...errors import ModelError, StateMachineError
from ...installed import WITNESS
from ...kinematics import Kind, Kinematics, shared_joints
from ...measures import (
    distances,
)
from ..recordings import Header, Trace, model_file
from ..runs.provenance import model_files
from .series import default_tip, joint_columns


@dataclass(frozen=True)
class WitnessResult:
    """How far the fingertip of each side is from where a third party puts it.

    Attributes:
        by: The witness and its version.
        site: Which site.
        left: Largest distance at any row of the first trace [m].
        right: Largest distance at any row of the second trace [m].
        rows: How many poses were compared.
        grade: "own reading" if the witness read the model's file with its own parser, "same
            reading" if it computed from the numbers that the file was compiled to.
    """

    by: str
    site: str
    left: float
    right: float
    rows: int
    grade: str


def witness(left: Trace, right: Trace, path: Path | None = None) -> WitnessResult | None:
    """Hold Pinocchio's forward kinematics of each trace's qpos against the recorded site.

    Args:
        left: A trace.
        right: Another, of the same model.
        path: The model's file; by default the one that the headers name.

    Returns:
        The distances; None where Pinocchio is missing, where neither it nor an engine that is
        here can read the model, and where the file that the traces were recorded with is not
        here.
    """
    site = default_tip(left.header, right.header)
    if not site or "site_xpos" not in left or "site_xpos" not in right:
        return None
    left_digest, right_digest = (trace.header.provenance.model_sha256 for trace in (left, right))
    if path is None and left_digest != right_digest:
        return None  # one model cannot be the witness of two
    try:
        file, same = (path, True) if path else model_file(left.header)
        if not same:
            return None
        kinematics = _readable(file, left.header, site)
        left_gap, right_gap = (_gap(kinematics, trace, site) for trace in (left, right))
        if not np.isfinite([left_gap, right_gap]).all():
            return None
    except StateMachineError:
        return None
    return WitnessResult(
        by=f"{WITNESS} {kinematics.version}",
        site=site,
        left=left_gap,
        right=right_gap,
        rows=len(left) + len(right),
        grade=kinematics.grade,
    )


def _readable(file: Path, header: Header, site: str) -> Kinematics:
    """Return the kinematics of a robot, by the first of its files that has the joints and the site.

    These are the scene's file and what it includes; else the compiled numbers are read.
    """
    for path in model_files(file):
        try:
            kinematics = Kinematics(path)
            names = [header.joints[k] for k in shared_joints(kinematics, header.joints)]
        except StateMachineError:
            continue
        if _kind_of(kinematics, site) is not None:
            return kinematics if kinematics.joint_names == tuple(names) else Kinematics(path, names)
    return Kinematics.same_reading(load(file))


def _kind_of(kinematics: Kinematics, site: str) -> Kind | None:
    """Return as what a witness knows a site; of a URDF a site is the frame of a link.

    Args:
        kinematics: Of the witness.
        site: Its name.
    """
    if site in kinematics.site_names:
        return "site"
    is_urdf = kinematics.path.suffix.lower() == ".urdf"
    return "body" if is_urdf and site in kinematics.body_names else None


def _gap(kinematics: Kinematics, trace: Trace, site: str) -> float:
    """Return how far a site is from where the witness puts it, at most [m]."""
    header, kind = trace.header, _kind_of(kinematics, site)
    if kind is None:
        raise ModelError(f"{kinematics.path.name} has no site named {site!r}")
    joints = [header.joint_labels[k] for k in shared_joints(kinematics, header.joints)]
    qpos = [trace.qpos[:, joint_columns(header, name).qpos] for name in joints]
    poses = kinematics.poses(np.concatenate([trace.qpos[:, :0], *qpos], axis=1), site, kind)
    recorded, _ = trace.site(site)
    return float(distances(recorded, poses.pos).max())
