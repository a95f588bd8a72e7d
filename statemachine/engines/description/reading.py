"""A robot as one source has it: a file as it says, or what an engine made of a file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...interface import Model
from .lines import SourceLines
from .records import VisualShape
from .urdf import Declared

if TYPE_CHECKING:
    from ...backends.compiled.repairs import Repair


@dataclass(frozen=True)
class Comparable:
    """How a file is made comparable with a format of fewer words, or with an engine's reading.

    Attributes:
        frames: Bodies that get a site of their name where their frame is, beside all that are
            fixed to another one.
        capsules: Whether a cylinder with a sphere on each end is a capsule, for which a URDF has no
            word.
        free_joint: Name of the free joint that the base of a URDF gets, if it has a mass; "" if it
            stands. A URDF does not say whether its base floats.
    """

    frames: frozenset[str] = frozenset()
    capsules: bool = False
    free_joint: str = ""


@dataclass(frozen=True, eq=False)
class ModelReading:
    """A robot as one source has it, as a compiled model.

    Attributes:
        model: The Model, compiled by MuJoCo. Masses and inertias in it are those that the source
            states, before anything was mended.
        format: "URDF", "MJCF", "MJB", or "engine" for what an engine made of a file.
        reader: What read it, with its version: "mujoco 4.0.0".
        repairs: What had to be mended for the compiler.
        visuals: What is only drawn; empty for what an engine made of a file.
        lines: Where the elements of the file stand; None for what an engine made of it.
        declared: What the source says in words of its own, of what it has no word for much: a URDF,
            or what an engine reports. None of an MJCF, which has a word for everything.
        floats: Whether its base was given a free joint, of which the file says nothing.
        settings: Names of the options that the source states; None where it states all.
        notes: What a reader should know, in sentences.
        mended: As `model`, but with the masses and inertias that a run has; None where none was
            mended.
    """

    model: Model
    format: str
    reader: str
    repairs: tuple[Repair, ...] = ()
    visuals: tuple[VisualShape, ...] = ()
    lines: SourceLines | None = None
    declared: Declared | None = None
    floats: bool = False
    settings: frozenset[str] | None = None
    notes: tuple[str, ...] = ()
    mended: Model | None = None

    @property
    def run_model(self) -> Model:
        """Return the Model with the masses and inertias that a run has."""
        return self.model if self.mended is None else self.mended
