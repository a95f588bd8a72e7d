"""What a sweep is asked for, and what it is when that was checked."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from ..measures.text import command
from ..runs.controllers import is_function
from .cell import CellRules, SweepCell
from .design import Design, digest
from .folder import SCHEMA
from .rows import described

SPREAD = ("1deg", "1mm")
# What a dataset is of, beside the experiment: cells of other values are of another sweep.
REQUEST = ("model", "seconds", "every", "keyframe", "defaults", "spread", "moments")


@dataclass(frozen=True)
class Sweep:
    """What a sweep is asked for; nothing is loaded before it is `prepared`.

    Attributes:
        what: An experiment, or FILE.py:FUNCTION, called as function(model, data, …).
        vary: Words like "timestep=0.001,0.005", "mass=0.8x:1.2x:5", "qpos[elbow_flex]=0:1".
        backends: Names; ("all",) for every one whose engine is here.
        seeds: How many: 0, 1, …; seed 0 starts where the experiment does, and each other one
            nearby (`spread`).
        samples: Points that are drawn of ranges NAME=from:to.
        indices: Whether they are those of Sobol indices; see `Design`.
        design_seed: Of what is drawn for that.
        model: Instead of the experiment's own; menagerie: where its name is looked up.
        menagerie: See model.
        seconds: Instead of the experiment's own time [s].
        every: Steps for which what the function returns holds.
        keyframe: Where a function starts.
        defaults: What `load` is given.
        spread: How far a seed puts the start away, as "1deg", "1mm".
        moments: How many moments of each run are kept.
        timeout: What a cell may take on the clock [s].
    """

    what: str
    vary: Sequence[str] = ()
    backends: Sequence[str] = ("all",)
    seeds: int = 1
    samples: int = 0
    indices: bool = False
    design_seed: int = 0
    model: str | None = None
    menagerie: str | None = None
    seconds: float | None = None
    every: int = 1
    keyframe: str | None = None
    defaults: Literal["model", "engine"] = "model"
    spread: Sequence[str] = SPREAD
    moments: int = 20
    timeout: float = 600.0

    def typed(self, out: str) -> str:
        """The command that runs it."""
        words = ["statemachine", "sweep", self.what]
        for word in self.vary:
            words += ["--vary", word]
        for name in () if tuple(self.backends) == ("all",) else self.backends:
            words += ["--backend", name]
        apart = ("what", "vary", "backends", "indices", "spread")
        given = [
            (f"--{each.name.replace('_', '-')}", getattr(self, each.name), each.default)
            for each in dataclasses.fields(self)
            if each.name not in apart
        ]
        given.append(("--spread", ",".join(self.spread), ",".join(SPREAD)))
        indices = " --indices" if self.indices else ""
        return command(words, *given, ("--out", out, None)) + indices


@dataclass(frozen=True)
class PreparedSweep:
    """A sweep that was checked, with all that its cells need.

    Attributes:
        sweep: What was asked for.
        rules: What every worker is told.
        design: Its points.
        backends: Names, the first of them the one that others are compared with.
        versions: Of this library, of engines and of packages.
        cost: Roughly what a cell takes on each backend [s].
        said: What a reader should know before it runs, in lines.
    """

    sweep: Sweep
    rules: CellRules
    design: Design
    backends: tuple[str, ...]
    versions: Mapping[str, str]
    cost: Mapping[str, float] = field(default_factory=dict)
    said: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.design) * self.sweep.seeds * len(self.backends)

    def cells(self, backend: str) -> Iterator[SweepCell]:
        """Every cell on a backend, seed by seed, point by point."""
        for point in self.design.points():
            for seed in range(self.sweep.seeds):
                cell = digest([point.id, seed, backend])
                yield SweepCell(cell, point.id, point.values, seed, backend)

    def provenance(self) -> dict[str, Any]:
        """What was asked for, for the metadata of each file: the design as it was typed."""
        names = ("schema", "command", "request", "files", "function", "versions", "design")
        told = {name: value for name, value in self.manifest().items() if name in names}
        told["design"].pop("factors")  # their values may be many
        return told

    def manifest(self) -> dict[str, Any]:
        """All of it as plain values, for sweep.json."""
        asked = self.sweep
        factors = [
            {**dataclasses.asdict(vary), "label": vary.label} for vary in self.design.factors
        ]
        function = is_function(asked.what)
        return {
            "schema": SCHEMA,
            "command": asked.typed("DIR"),
            "request": {
                "what": Path(asked.what).name if function else asked.what,
                **{name: getattr(asked, name) for name in REQUEST},
                "spread": list(asked.spread),
            },
            "files": dict(self.rules.files),
            "function": self.rules.function,
            "versions": dict(self.versions),
            "design": {
                "vary": list(asked.vary),
                "seeds": asked.seeds,
                "backends": list(self.backends),
                "samples": asked.samples,
                "indices": asked.indices,
                "design_seed": asked.design_seed,
                "factors": factors,
            },
            "points": len(self.design),
            "cells": len(self),
            "columns": described(self.design.factors),
        }
