"""Read the fingertip four times: fresh, after `forward`, after a write, after `forward`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import conventions
from ..engines import part
from ..interface import Array, Model, forward, make_data
from ..scenarios.provenance import Provenance, provenance
from ..scenarios.robot import scalar_joint
from ..scenarios.runs import Progress, silent
from . import stages


@dataclass(frozen=True)
class OwnAnswer:
    """What an engine itself does, asked of it alone: a question, a part of it, the answer."""

    question: str
    part: str
    answer: str


def own_answers(model: Model, *questions: str) -> tuple[OwnAnswer, ...]:
    """Conventions of the engine behind a Model that emulates some of the contract."""
    if part(model.backend, "as_it_comes") is None:  # the interface is the engine's own
        return ()
    return tuple(
        OwnAnswer(question, finding.of, finding.answer)
        for question in questions
        for finding in conventions.ask(question, model.backend) or ()
    )


@dataclass(frozen=True, eq=False)
class Reading:
    """One reading: what had been done, the fingertip (3,) [m], and the time [s]."""

    after: str
    fingertip: Array
    time: float


@dataclass(frozen=True, eq=False)
class Forward:
    """The four readings.

    Attributes:
        equal: Pairs (i, j), i < j, of readings that are equal bit by bit.
        moved: Distance [m] that the write and the second `forward` moved the fingertip.
        contacts: How many were found after the second `forward`; deepest: how far the two
            surfaces of the worst of them are inside each other [m].
        itself: What the engine does without us, where some of this is emulated.
        stages: What each call changes, and of which moment derived values are.
    """

    joint: str
    value: float
    readings: tuple[Reading, ...]
    equal: tuple[tuple[int, int], ...]
    moved: float
    contacts: int
    deepest: float
    itself: tuple[OwnAnswer, ...]
    stages: stages.Stages
    provenance: Provenance


def run(
    model: Model,
    joint: str = "shoulder_lift",
    value: float = 0.8,
    site: str = "gripperframe",
    seconds: float = 2.0,
    progress: Progress = silent,
) -> Forward:
    """Write one joint into a fresh Data and watch when the fingertip notices.

    Args:
        model: Any model with the joint and the site.
        joint: The joint to write; a hinge or slide.
        value: What to write [rad or m].
        site: The fingertip.
        seconds: Simulated time over which moments are compared; see `stages`.
        progress: Told the fraction that is done.

    Raises:
        UnknownNameError: No such joint or site.
    """
    (place, _), tip = scalar_joint(model, joint), model.site_id(site)
    readings: list[Reading] = []
    with make_data(model) as data:

        def read(after: str) -> None:
            readings.append(Reading(after, np.array(data.site_xpos[tip]), data.time))

        read("make_data")
        forward(model, data)
        read("forward")
        data.qpos[place] = value
        read(f"qpos[{place}] = {value:g}")
        forward(model, data)
        read("forward again")
        found = data.contacts
        count, deepest = len(found), max(0.0, -float(found.dist.min(initial=0.0)))
    equal = tuple(
        (i, j)
        for i in range(len(readings))
        for j in range(i + 1, len(readings))
        if np.array_equal(readings[i].fingertip, readings[j].fingertip)
    )
    moved = float(np.linalg.norm(readings[3].fingertip - readings[2].fingertip))
    looked = stages.run(model, joint, value, site, seconds, progress)
    return Forward(
        joint=joint,
        value=value,
        readings=tuple(readings),
        equal=equal,
        moved=moved,
        contacts=count,
        deepest=deepest,
        itself=own_answers(model, "write", "step"),
        stages=looked,
        provenance=provenance(model),
    )
