"""Where the bodies of a trace are, at the moments of a film."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..backends import load, on_default
from ..drawing import drawing_of
from ..errors import TraceError
from ..interface import Array, Model, forward, make_data
from ..measures import nearest
from ..rotations import matrix_from_quat
from ..runs import Trace


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses of all bodies, moment by moment.

    Attributes:
        file: The model's.
        xpos: (n, nbody, 3) origins [m].
        xquat: (n, nbody, 4) rotations, wxyz.
    """

    file: Path
    xpos: Array
    xquat: Array


def models_of(*traces: Trace) -> tuple[Model, ...]:
    """The models that traces name, for their looks.

    Raises:
        ModelFileError: A trace was recorded with a file that is not here.
    """
    names = [trace.header.provenance.model_file for trace in traces]
    models = {name: load(name) for name in dict.fromkeys(names)}
    return tuple(models[name] for name in names)


def motion_of(trace: Trace, model: Model, times: Array) -> Motion:
    """The poses of a trace at times (n,), counted from its start: each of the nearest row.

    A trace without poses has them from its qpos.

    Raises:
        TraceError: The model has other bodies than the trace, or a pose is no number.
    """
    if tuple(model.body_names) != trace.header.bodies:
        raise TraceError(
            f"{model.path.name} has other bodies than the trace of {trace.header.experiment}: "
            "it cannot be drawn with it"
        )
    rows = nearest(trace.time - trace.time[0], times)
    if "xpos" in trace and "xquat" in trace:
        xpos, xquat = trace["xpos"][rows], trace["xquat"][rows]
        strange = ~(np.isfinite(xpos).all((1, 2)) & np.isfinite(xquat).all((1, 2)))
        if strange.any():
            raise TraceError(
                f"from {times[int(np.argmax(strange))]:.3g} s on the trace has no poses of the "
                "bodies that are numbers: it cannot be drawn"
            )
        return Motion(model.path, xpos, xquat)
    return motion_through(model, trace.qpos[rows])


def motion_through(model: Model, qpos: Array) -> Motion:
    """The poses that qpos (n, nq) stands for, by MuJoCo's kinematics."""
    reader = on_default(model)
    xpos, xquat = np.empty((len(qpos), model.nbody, 3)), np.empty((len(qpos), model.nbody, 4))
    with make_data(reader) as data:
        for k, row in enumerate(qpos):
            data.qpos[:] = row
            forward(reader, data)
            xpos[k], xquat[k] = data.xpos, data.xquat
    return Motion(model.path, xpos, xquat)


def corners(motion: Motion, model: Model, most: int = 60) -> Array:
    """Corners (n, 3) of boxes about all that belongs to a body, at some of the moments."""
    rows = np.unique(np.linspace(0, len(motion.xpos) - 1, most).astype(int))
    turn = matrix_from_quat(motion.xquat[rows])
    found = []
    parts = [part for part in drawing_of(model).parts if not part.endless]
    for part in [part for part in parts if part.body] or parts:
        ends = np.stack([part.vertices.min(axis=0), part.vertices.max(axis=0)]).astype(float)
        box = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
        placed = np.einsum("nij,kj->nki", turn[:, part.body], box)
        found.append((placed + motion.xpos[rows][:, part.body, None]).reshape(-1, 3))
    if not found:
        return motion.xpos[rows].reshape(-1, 3)
    return np.concatenate(found)
