"""Recordings of the arm whose truth is known, made by the simulation that fits them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

import statemachine as sm
from statemachine.interface import Array
from statemachine.lab.identification.fit import Objective
from statemachine.lab.identification.parameters import ArmParameters
from statemachine.lab.identification.simulation import ArmSimulation
from statemachine.lab.recordings.arm_recording import ArmRecording

FPS = 30.0
COUNT = 2 * np.pi / 4096
SOFT = -3.6  # logarithm of kp 27 by that of the model


def arm_parameters() -> ArmParameters:
    """Return the parameters of the course's arm."""
    model = sm.load("so101")
    return ArmParameters.of(model, model.joint_names)


def swings(parameters: ArmParameters, seconds: float, rate: float = 0.5) -> Array:
    """Return commands (K, 6): all joints swing about a pose in which gravity pulls."""
    times = np.arange(round(seconds * FPS)) / FPS
    phases = np.arange(6)
    middle = np.array([0.0, -0.6, 0.6, 0.3, 0.0, 0.6])
    return middle + 0.3 * np.sin(2 * np.pi * rate * times[:, None] + phases)


def vector(parameters: ArmParameters, values: Mapping[str, float]) -> Array:
    """Return a vector of zeros, with values of whole kinds."""
    made = np.zeros(len(parameters))
    for kind, value in values.items():
        places = [i for i, each in enumerate(parameters.each) if each.kind == kind]
        made[places] = value
    return made


def recording_of(
    parameters: ArmParameters, action: Array, true: Array, noise: float = 0.0, seed: int = 0
) -> ArmRecording:
    """Return what would be recorded of an arm with the figures of a vector."""
    blank = ArmSimulation.of_motion(parameters, action, FPS)
    angles = blank.angles(true)
    angles = angles + np.random.default_rng(seed).normal(0.0, noise, angles.shape)
    return replace(blank.recording, state=angles)


def objective_of(
    parameters: ArmParameters, recording: ArmRecording, kinds: tuple[str, ...], deviation: float
) -> Objective:
    """Return what a fit of some kinds of parameters makes small."""
    free = np.array([i for i, each in enumerate(parameters.each) if each.kind in kinds])
    return Objective(
        simulation=ArmSimulation.of(parameters, recording),
        deviation=np.full(len(parameters.joints), deviation),
        free=free,
        fixed=np.zeros(len(parameters)),
    )
