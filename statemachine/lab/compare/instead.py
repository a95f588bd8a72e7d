"""Which experiment moves a robot that another one leaves at rest: found by running them."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

from ...errors import EngineWarning, StateMachineError
from ...interface import Model
from ..recordings import rerun_of
from ..runs.scenarios import SCENARIOS
from .motion import least_motions, motion_of

# What moves most robots comes first.
_IN_TURN = ("waves", "hold", "gravity", "droop")


@dataclass(frozen=True)
class Instead:
    """What to run where an experiment moves nothing.

    Attributes:
        experiment: The first of ours that moves the model, as one run of it shows; "" if none does.
        file: The model's file.
        has_actuators: Whether there is anything to command.
    """

    experiment: str
    file: str
    has_actuators: bool


def instead_of(model: Model, experiment: str, seed: int = 0) -> Instead:
    """Return which other experiment moves a model.

    Args:
        model: The left side, as loaded: without the options of the experiment.
        experiment: The experiment that moves nothing.
        seed: Of what an experiment draws.
    """
    moving = ""
    for name in _IN_TURN:
        if name != experiment and not moving and _moves(model, name, seed):
            moving = name
    return Instead(moving, model.path.name, has_actuators=model.nu > 0)


def _moves(model: Model, name: str, seed: int) -> bool:
    """Tell whether an experiment of ours moves a model; not where it makes no sense on it."""
    try:
        # What there is to warn of is told of the run that was asked for.
        with warnings.catch_warnings(action="ignore", category=EngineWarning):
            rerun = rerun_of(SCENARIOS[name], model, seed=seed)
            trace = rerun.record(derived="nothing")
    except StateMachineError:
        return False
    sides = [(trace, trace.header.joint_labels)]
    return motion_of(sides, least_motions(None), rerun.seconds).moved
