"""What the template of every lesson may name: its code, what that printed, and its diagram."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields

from ...show.blocks import Block, Code, Printed


@dataclass(frozen=True)
class ShownEngines:
    """Which engines a page is about: some words of a lesson are for one of them.

    Attributes:
        mujoco: Whether MuJoCo is among them.
        pybullet: Whether PyBullet is.
    """

    mujoco: bool
    pybullet: bool

    @classmethod
    def among(cls, backends: Collection[str]) -> ShownEngines:
        """Return which engines are among some backends.

        Args:
            backends: Their names.
        """
        return cls(**{field.name: field.name in backends for field in fields(cls)})


@dataclass(frozen=True)
class LessonFrame:
    """What the page of a lesson shows beside what was measured.

    Attributes:
        code: What a student types.
        printed: What it printed, by engine.
        diagram: What is drawn of the model; empty where nothing is.
        engines: Which engines the page is about.
    """

    code: Code
    printed: Printed
    diagram: Sequence[Block]
    engines: ShownEngines
