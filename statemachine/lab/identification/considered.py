"""What no recording tells and moves what it does: the clock, and where a payload is.

Times are frame / fps, and were not measured: a loop that is late at each frame passes for other
viscous friction, inertia and delay. A payload is a mass at the gripper's own, and may be held
elsewhere. Both are considered, and not fitted (consider covariance analysis: B. Tapley, B. Schutz
and G. Born, Statistical Orbit Determination, 2004, chapter 6).
"""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Final

import numpy as np

from ...interface import Array
from .fit import Fit
from .linear_refit import LinearRefit
from .simulation import ArmSimulation

# Standard deviations: of the rate of frames, as a part of it; of where a payload is, on each axis.
UNCERTAIN_RATE: Final = 0.01
UNCERTAIN_PLACE: Final = 0.03  # m


def considered_shifts(best: Fit) -> Array:
    """Return by how much parameters (S, free) move for each that is off by its deviation."""
    simulation, vector = best.objective.simulation, best.vector
    refit = LinearRefit.of(best)
    others = [_faster(simulation)]
    for place in UNCERTAIN_PLACE * np.eye(3):
        others.append(_with_payload_at(simulation, vector, place))
    shifts: list[Array] = []
    for other in others:
        shifts.append(refit.end(refit.change_with(other)).shift)
    return np.array(shifts)


def _faster(simulation: ArmSimulation) -> ArmSimulation:
    """Return the simulation of a recording whose frames came faster."""
    recording = simulation.recording
    return replace(
        simulation, recording=replace(recording, fps=(1.0 + UNCERTAIN_RATE) * recording.fps)
    )


def _with_payload_at(simulation: ArmSimulation, vector: Array, place: Array) -> ArmSimulation:
    """Return the simulation of an arm whose payload is elsewhere.

    Args:
        simulation: Of the arm.
        vector: (P,) of the parameters.
        place: (3,) of the payload, from the centre of mass of its body, in that body's axes [m].
    """
    parameters = simulation.parameters
    body, model = parameters.payload_body, parameters.model
    payload = float(vector[parameters.of_kind("payload")[0]])
    compiled = copy.copy(model.compiled)
    compiled.body_ipos[body] += payload / (payload + model.body_mass[body]) * place
    moved = replace(parameters, model=model.with_compiled(compiled))
    return replace(simulation, parameters=moved)
