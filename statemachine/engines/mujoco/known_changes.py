"""Known changes between releases of MuJoCo: those that a run can show, and probes confirm.

A change is told of two Models of one file on two releases where the model and the run have what it
concerns, and where its probe measures another value on each of the two.
"""

from __future__ import annotations

import functools
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ... import releases
from ...errors import EngineError
from ...installed import require
from ...interface import Ints, Model
from ...release_names import is_release
from ..records import KnownChange, KnownChangeName, RunArrays

_PROBES = Path(__file__).with_name("release_probes.py")
_SAME = 1e-6  # of what a probe measures
_AT_LIMIT = 1e-9  # of the limit


def known_changes(
    left: Model, right: Model, runs: tuple[RunArrays, RunArrays]
) -> list[KnownChange]:
    """Return the known changes between two releases that concern a run of one file.

    Args:
        left: A Model of a file, on a release of MuJoCo or on the one that is installed.
        right: A Model of the same file on another one.
        runs: The run of each.

    Raises:
        EngineError: A release does not run.
    """
    if left.engine_version == right.engine_version or left.path != right.path:
        return []
    concerned = list(_concerned(left, right, runs))
    if not concerned:
        return []
    measured = probe_results(left.backend), probe_results(right.backend)
    changes: list[KnownChange] = []
    for name, probe, elements in concerned:
        before, after = measured[0].get(probe), measured[1].get(probe)
        if before is not None and after is not None and abs(before - after) > _SAME:
            changes.append(KnownChange(name, probe, before, after, tuple(elements)))
    return changes


@functools.cache
def probe_results(backend: str) -> dict[str, float | None]:
    """Return what each probe measures on a release.

    Raises:
        EngineError: The release does not run.
    """
    python = releases.python_of(backend) if is_release(backend) else Path(sys.executable)
    command = [str(python), "-I", str(_PROBES)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise EngineError(f"{backend} does not run: {done.stderr.strip().splitlines()[-1:]}")
    return json.loads(done.stdout)


def _concerned(
    left: Model, right: Model, runs: tuple[RunArrays, RunArrays]
) -> Iterator[tuple[KnownChangeName, str, Sequence[str]]]:
    """Yield each change that the model and the run have something of: name, probe, elements."""
    mujoco = require("mujoco")
    raw = left.compiled
    if raw is not None:
        for integrator in ("implicit", "implicitfast"):
            kind = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
            servos = _limited_servos(raw, left, runs[0]) if raw.opt.integrator == kind else []
            if servos:
                yield "kv of a limited servo", integrator, servos
        box, cylinder = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
        touching = np.vstack([run.contact_geom for run in runs])
        boxes = _touching(raw, left, touching, (int(box), int(box)))
        if boxes:
            yield "boxes in contact", "box on box", boxes
        cylinders = _touching(raw, left, touching, (int(box), int(cylinder)))
        if cylinders:
            yield "cylinders in contact", "cylinder on box", cylinders
    if left.path.suffix.lower() == ".urdf":
        robot = ElementTree.parse(left.path).getroot()
        mimics = [j.get("name", "") for j in robot.iter("joint") if j.find("mimic") is not None]
        if mimics:
            yield "mimic of a URDF", "mimic", mimics
        turned = [link.get("name", "") for link in robot.iter("link") if _is_turned(link)]
        if turned:
            yield "turned inertial of a URDF", "turned inertial", turned


def _limited_servos(raw: Any, model: Model, run: RunArrays) -> list[str]:
    """Return the actuators with a gain on velocity whose force is at its limit in a run."""
    mujoco = require("mujoco")
    affine_bias, affine_gain = mujoco.mjtBias.mjBIAS_AFFINE, mujoco.mjtGain.mjGAIN_AFFINE
    has_kv = (raw.actuator_biastype == affine_bias) & (raw.actuator_biasprm[:, 2] != 0)
    has_kv |= (raw.actuator_gaintype == affine_gain) & (raw.actuator_gainprm[:, 2] != 0)
    limited = np.flatnonzero(has_kv & (raw.actuator_forcelimited != 0))
    if not limited.size:
        return []
    data = mujoco.MjData(raw)
    forces = np.empty((len(run.qpos), len(limited)))
    for k in range(len(run.qpos)):
        data.qpos[:], data.qvel[:], data.ctrl[:] = run.qpos[k], run.qvel[k], run.ctrl[k]
        if raw.na and run.act.size:
            data.act[:] = run.act[k]
        mujoco.mj_fwdPosition(raw, data)
        mujoco.mj_fwdVelocity(raw, data)
        mujoco.mj_fwdActuation(raw, data)
        forces[k] = data.actuator_force[raw.actuator_outadr[limited]]
    low, high = raw.actuator_forcerange[limited].T
    at_limit = (forces <= low + _AT_LIMIT * np.abs(low)) | (
        forces >= high - _AT_LIMIT * np.abs(high)
    )
    return [model.actuator_names[limited[k]] for k in np.flatnonzero(at_limit.any(axis=0))]


def _touching(raw: Any, model: Model, pairs: Ints, kinds: tuple[int, int]) -> list[str]:
    """Return which bodies touch with shapes of two kinds, each pair once.

    Args:
        raw: Its compiled model.
        model: The Model.
        pairs: (k, 2) ids of geoms that touch.
        kinds: The kinds of the two shapes; a pair may have both in either order, or the second
            kind twice.
    """
    names: dict[str, None] = {}
    for pair in np.unique(np.sort(pairs, axis=1), axis=0).tolist():
        found = sorted(int(raw.geom_type[geom]) for geom in pair)
        if found in (sorted(kinds), [kinds[1], kinds[1]]):
            bodies = [model.body_names[int(model.geom_bodyid[geom])] for geom in pair]
            names[" and ".join(bodies)] = None
    return list(names)


def _is_turned(link: ElementTree.Element) -> bool:
    """Tell whether a link of a URDF has an inertial whose axes are turned."""
    origin = link.find("inertial/origin")
    if origin is None:
        return False
    return any(float(angle) for angle in origin.get("rpy", "").split())
