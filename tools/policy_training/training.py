"""The search for the gains: what is walked in a generation, and what a walk is worth."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .contract import Contract
from .evolution import Evolution
from .gait import GAINS, network_of
from .network import Floats
from .observation import FAULTS, SOUND, Fault
from .robots import Course, MujocoRobots
from .walking import Policies, Walked, change, walk

CANDIDATES = 14
COURSES = 8
SECONDS = 4.0
# Each generation walks these, and drawn ones beside them.
COMMANDS = (
    (0.0, 0.0, 0.0),
    (0.5, 0.0, 0.0),
    (0.0, 0.0, 0.6),
    (0.4, 0.0, -0.5),
    (0.3, 0.0, 0.6),
    (0.2, 0.2, 0.0),
)
CALM = 20  # Generations over which pushes and pulls grow to their full size.
WORST = 0.3  # Weight of a candidate's worst walk beside its mean.
# Each candidate also walks so, in the calm, soundly and under some faults of the contract.
TOLD = Course((0.3, 0.0, 0.5), heading=2.5)
HIDDEN = ("gyro", "gravity", "velocity", "angles")
ENOUGH = 0.4  # The change of speed that a fault shall make; more is worth no more.


def search(contract: Contract, generations: int, seed: int) -> Iterator[tuple[Floats, Floats]]:
    """Search the gains; yield the best guess, (n_gains,), and the scores of each generation."""
    generator = np.random.default_rng(seed)
    start, step = (np.array([getattr(gain, part) for gain in GAINS]) for part in ("start", "step"))
    evolution = Evolution(start, step, CANDIDATES, generator)
    for generation in range(generations):
        courses = _draw(generator, min(1.0, generation / CALM))
        candidates = evolution.ask()
        policies = Policies([network_of(gains, contract) for gains in candidates])
        robots = MujocoRobots(contract, courses * CANDIDATES)
        command = np.array([course.command for course in courses] * CANDIDATES)
        scores = score(walk(contract, policies, robots, command, SECONDS)).reshape(CANDIDATES, -1)
        values = scores.mean(axis=1) + WORST * scores.min(axis=1)
        values += told_apart(contract, policies)
        evolution.tell(values)
        yield evolution.mean, values


def score(walked: Walked) -> Floats:
    """Return the worth of n walks, (n,), at most 0: speeds as asked, calm, smooth, to the end."""
    missed = (walked.error / [0.1, 0.1, 0.15]).sum(axis=1)
    fell = 1 - walked.upright / SECONDS
    return -missed - 0.6 * walked.shaking - walked.effort - 20 * fell


def told_apart(contract: Contract, policies: Policies) -> Floats:
    """Return for each network, (n,), how clearly its walk shows that a term is wrong: at most 2.

    A policy that walks as well on a wrong term as on a right one does not use it, and nobody could
    tell by such a walk what is wrong.
    """
    n = len(policies.networks)
    command = np.array([TOLD.command] * n)

    def walked(fault: Fault) -> Walked:
        robots = MujocoRobots(contract, [TOLD] * n)
        return walk(contract, policies, robots, command, SECONDS, fault)

    sound = walked(SOUND)
    worth = np.zeros(n)
    for fault in FAULTS:
        if fault.wrong in HIDDEN:
            worth += np.minimum(change(sound, walked(fault), command), ENOUGH)
    stands = sound.upright == SECONDS
    return stands * worth * (2 / (ENOUGH * len(HIDDEN)))


def _draw(generator: np.random.Generator, force: float) -> list[Course]:
    """Draw a generation's courses; `force`, from 0 to 1, is how hard they are pushed and pulled."""
    drawn = generator.uniform([-0.4, -0.2, -0.6], [0.5, 0.2, 0.6], (COURSES - len(COMMANDS), 3))
    commands = [*COMMANDS, *((x, y, turn) for x, y, turn in drawn.tolist())]
    return [_course(generator, command, force) for command in commands]


def _course(
    generator: np.random.Generator, command: tuple[float, float, float], force: float
) -> Course:
    """Draw a course under a command."""
    pushes = [(time, *(force * generator.uniform(-0.5, 0.5, 2)).tolist()) for time in (1.5, 3.0)]
    pull = force * generator.uniform(-1, 1, 3) * [10, 10, 1.5]
    return Course(
        command,
        start=tuple(generator.normal(0, 0.05, 12)),
        heading=generator.uniform(-3, 3),
        pushes=tuple(pushes),
        pull=tuple(pull),
        friction=generator.uniform(0.7, 1.2),
        mass=generator.uniform(0.9, 1.15),
        gain=generator.uniform(0.85, 1.15),
        softness=generator.uniform(0.5, 1.5),
    )
