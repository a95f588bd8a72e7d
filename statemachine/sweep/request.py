"""What a sweep is asked for, and what it is when that was checked."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from ..compare.perturbed import Uncertainty
from ..measures.text import command
from ..runs.controllers import function_scenario, is_function
from ..runs.scenarios import Scenario, scenario
from .design import Design, Value, Vary, digest
from .rows import columns_of

MANIFEST_VERSION = 2
# What a dataset is of, beside the experiment: cells of other values are of another sweep.
REQUEST = ("model", "seconds", "every", "keyframe", "defaults", "spread", "moments")
# What it may grow by.
DESIGN = ("vary", "seeds", "samples", "indices", "design_seed")


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
        spread: How far a seed puts the start away, as "1deg,1mm"; "0" for not at all.
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
    spread: str = "1deg,1mm"
    moments: int = 20
    timeout: float = 600.0

    def scenario(self, parameters: Mapping[str, Any]) -> Scenario:
        """What is done, and for how long, with some values of the function's parameters.

        Raises:
            BadInputError: The user's file fails.
        """
        if is_function(self.what):
            asked = function_scenario(self.what, self.every, self.keyframe, parameters)
        else:
            asked = scenario(self.what)
        return asked if self.seconds is None else dataclasses.replace(asked, seconds=self.seconds)

    def typed(self, out: str) -> str:
        """The command that runs it."""
        given: list[tuple[str, object, object]] = []
        for option in dataclasses.fields(self)[1:]:
            flag = f"--{option.name.replace('_', '-').replace('backends', 'backend')}"
            value = getattr(self, option.name)
            values = value if option.name in ("vary", "backends") else [value]
            given += [(flag, word, option.default) for word in values if value != option.default]
        return command(["statemachine", "sweep", self.what], *given, ("--out", out, None))


@dataclass(frozen=True)
class SweepCell:
    """What is run once.

    Attributes:
        id: A digest of point, seed and backend.
        point: The digest of the values.
        values: One for each factor of the sweep; None is the model's own.
        seed: What is drawn from; 0 draws no start.
        backend: The engine.
        nudge: What a change of start and commands by rounding is drawn from; 0 for none.
    """

    id: str
    point: str
    values: tuple[Value | None, ...]
    seed: int
    backend: str
    nudge: int = 0


@dataclass(frozen=True)
class PreparedSweep:
    """A sweep that was checked, with all that its cells need; it goes to every worker.

    Attributes:
        sweep: What was asked for, with whole paths.
        design: Its points.
        backends: Names, the first of them the one that others are compared with.
        versions: Of this library, of engines and of packages.
        files: The digest of each model's file, by the name that a cell gives; of several the
            model is varied.
        places: What `load` is given for each of these names.
        function: The digest of the user's file; "" for an experiment of ours.
        parameters: What the user's function takes by keyword.
        spread: How far from its start a seed puts a run.
        cost: Roughly what a cell takes on each backend [s].
        said: What a reader should know before it runs, in lines.
    """

    sweep: Sweep
    design: Design
    backends: tuple[str, ...]
    versions: Mapping[str, str]
    files: Mapping[str, str]
    places: Mapping[str, str]
    function: str = ""
    parameters: tuple[str, ...] = ()
    spread: Uncertainty = field(default_factory=Uncertainty)
    cost: Mapping[str, float] = field(default_factory=dict)
    said: tuple[str, ...] = ()

    def settings(self, cell: SweepCell, kind: str) -> list[tuple[Vary, Any]]:
        """The factors of a kind and their values in a cell."""
        pairs = zip(self.design.factors, cell.values, strict=True)
        return [(vary, value) for vary, value in pairs if vary.kind == kind]

    def __len__(self) -> int:
        return self.design.size * self.sweep.seeds * len(self.backends)

    def cells(self, backend: str) -> Iterator[SweepCell]:
        """Every cell on a backend, seed by seed, point by point."""
        for point in self.design.points():
            for seed in range(self.sweep.seeds):
                cell = digest([point.id, seed, backend])
                yield SweepCell(cell, point.id, point.values, seed, backend)

    def provenance(self) -> dict[str, Any]:
        """What was asked for, as plain values, for the metadata of each file."""
        asked = self.sweep
        what = Path(asked.what).name if self.function else asked.what
        request = {name: getattr(asked, name) for name in REQUEST}
        design = {name: getattr(asked, name) for name in DESIGN}
        return {
            "schema": MANIFEST_VERSION,
            "command": asked.typed("DIR"),
            "request": {"what": what, "function": self.function, **request},
            "files": dict(self.files),
            "versions": dict(self.versions),
            "design": {**design, "backends": list(self.backends)},
        }

    def manifest(self) -> dict[str, Any]:
        """The same for sweep.json, with the values of what is varied: they may be many."""
        factors = [
            {**dataclasses.asdict(vary), "label": vary.label} for vary in self.design.factors
        ]
        return {
            **self.provenance(),
            "factors": factors,
            "points": self.design.size,
            "cells": len(self),
            "columns": {
                name: {"unit": unit, "meaning": meaning}
                for name, _, unit, meaning in columns_of(self.design.factors)
            },
        }
