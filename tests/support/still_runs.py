"""Runs in which nothing moves, of a robot that floats, and copies of them that are changed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from statemachine.interface import Model
from statemachine.lab.recordings import Trace, record

from .small_models import loaded
from .traces import added, changed

ROWS = 21
STEP = 0.01  # [s]
ROBOT = """<geom name="floor" type="plane" size="0 0 1"/>
<body name="ball" pos="0 0 0.9"><freejoint/><geom name="ball" size="0.1" mass="1"/>
  <body name="arm" pos="0.2 0 0"><joint name="turn" axis="0 1 0"/>
    <geom name="arm" type="capsule" size="0.02 0.1" mass="0.1"/><site name="tip" pos="0 0 0.1"/>
  </body>
  <body name="cart" pos="3 0 1"><joint name="rail" type="slide"/><geom size="0.1" mass="0.1"/>
  </body></body>"""
SERVOS = """<actuator><position joint="turn" kp="5" gear="2"/>
<position joint="rail" kp="5"/></actuator>"""
TURN, RAIL = 7, 8  # in qpos


FLOOR, BALL, ARM = 0, 1, 2  # geoms


def robot(folder: Path) -> Model:
    """Return a robot that floats, with an arm that a servo holds, and a rail."""
    return loaded(folder, ROBOT, SERVOS, option=f'<option timestep="{STEP}"/>')


def still_run(model: Model) -> Trace:
    """Return a run of 0.2 s in which nothing moves and nothing touches."""
    trace = record(model, seconds=STEP * (ROWS - 1))
    columns: dict[str, Any] = {}
    for name, array in trace.columns.items():
        columns[name] = array[:0] if name.startswith("contact_") else 0 * array + array[:1]
    return Trace(trace.header, {**columns, "time": STEP * np.arange(ROWS)})


def moved(trace: Trace, place: int, values: Any, rows: Any = slice(None)) -> Trace:
    """Return a copy in which a coordinate is off by some values in some rows."""
    return changed(trace, qpos=added(trace.qpos, (rows, place), values))


def touching(trace: Trace, *contacts: tuple[int, tuple[int, int], Any, float]) -> Trace:
    """Return a copy with contacts: the row, both geoms, the force in its frame, the distance."""
    frame = np.array([0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0])  # its normal points up
    columns = {
        "contact_row": np.array([row for row, *_ in contacts]),
        "contact_geom": np.array([geoms for _, geoms, *_ in contacts]),
        "contact_force": np.array([force for _, _, force, _ in contacts], dtype=float),
        "contact_dist": np.array([dist for *_, dist in contacts]),
        "contact_pos": np.zeros((len(contacts), 3)),
        "contact_frame": np.tile(frame, (len(contacts), 1)),
        "contact_torque": np.zeros((len(contacts), 3)),
    }
    known = {name: array for name, array in columns.items() if name in trace.columns}
    shaped = {
        name: array.reshape(len(contacts), *trace[name].shape[1:]) for name, array in known.items()
    }
    return changed(trace, **shaped)
