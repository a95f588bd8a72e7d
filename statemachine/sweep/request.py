"""What a sweep is asked for, what it is when checked, and what its points mean on a Model."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..compare.perturbed import Uncertainty, displaced
from ..errors import BadInputError, check_name
from ..interface import Array, JointType, Model
from ..interface.options import index_of
from ..measures.text import command
from ..runs.controllers import function_scenario, is_function
from ..runs.robot import scalar_joint
from ..runs.scenarios import SCENARIOS, Scenario, scenario
from ..typed_numbers import is_count
from .design import Design, Value, Vary, digest
from .rows import columns_of

MANIFEST_VERSION = 4
# What a dataset is of, beside the experiment: cells of other values are of another sweep.
REQUEST = ("model", "seconds", "every", "keyframe", "spread", "moments")
# What it may grow by.
DESIGN = ("vary", "seeds", "samples", "design_seed")


@dataclass(frozen=True)
class Sweep:
    """What a sweep is asked for; nothing is loaded before it is `prepared`.

    Attributes:
        what: An experiment, or FILE.py:FUNCTION, called as function(model, data, …).
        vary: Words like "timestep=0.001,0.005", "mass=0.8x:1.2x:5", "qpos[elbow_flex]=0:1".
        backends: As `parse_backend` reads them; ("all",) for every one whose engine is here.
        seeds: How many: 0, 1, …; seed 0 starts where the experiment does, and each other one
            nearby (`spread`).
        samples: Points that are drawn of ranges NAME=from:to.
        design_seed: Of what is drawn for that.
        model: Instead of the experiment's own; menagerie: where its name is looked up.
        menagerie: See model.
        seconds: Instead of the experiment's own time [s].
        every: Steps for which what the function returns holds.
        keyframe: Where a function starts.
        spread: How far a seed puts the start away, as "1deg,1mm"; "0" for not at all.
        moments: How many moments of each run are kept.
        timeout: What a cell may take on the clock [s].
    """

    what: str
    vary: Sequence[str] = ()
    backends: Sequence[str] = ("all",)
    seeds: int = 1
    samples: int = 0
    design_seed: int = 0
    model: str | None = None
    menagerie: str | None = None
    seconds: float | None = None
    every: int = 1
    keyframe: str | None = None
    spread: str = "1deg,1mm"
    moments: int = 20
    timeout: float = 600.0

    def __post_init__(self) -> None:
        least = {"seeds": 1, "samples": 0, "design_seed": 0, "every": 1, "moments": 1}
        for name, smallest in least.items():
            if getattr(self, name) < smallest:
                flag = name.replace("_", "-")
                raise BadInputError(
                    f"--{flag} must be at least {smallest}; got {getattr(self, name)}"
                )
        if not 0 < self.timeout <= 86400 * 7:
            raise BadInputError(f"--timeout must be above 0 s; got {self.timeout:g}")
        if is_function(self.what):
            return
        check_name("experiment", self.what, SCENARIOS)
        if self.every != 1:
            raise BadInputError(f"--every is of a FUNCTION; {self.what} is an experiment")
        if self.keyframe is not None:
            raise BadInputError(f"--keyframe is of a FUNCTION; {self.what} is an experiment")

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
        values: One for each factor of the sweep.
        seed: What is drawn from; 0 draws no start.
        backend: The engine.
    """

    id: str
    point: str
    values: tuple[Value, ...]
    seed: int
    backend: str


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
        request = {name: getattr(asked, name) for name in REQUEST}
        design = {name: getattr(asked, name) for name in DESIGN}
        return {
            "schema": MANIFEST_VERSION,
            "command": asked.typed("DIR"),
            "request": {"what": asked.what, "function": self.function, **request},
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


_AXES = ("x", "y", "z")
_STREAM = 1  # of a seed: not that of the commands which an experiment draws


def options_at(model: Model, settings: Iterable[tuple[Vary, Value]]) -> dict[str, Any]:
    """What `model.replace` is given for the values of factors.

    Raises:
        BadInputError: The model has no such value of its own.
        UnknownNameError: The model has no such joint, body, geom or actuator.
    """
    options: dict[str, Any] = {}
    for vary, value in settings:
        if not (vary.place or vary.times):
            count = vary.name == "substeps" and isinstance(value, float) and value.is_integer()
            options[vary.name] = int(value) if count else value
            continue
        own, place = _own(model, vary)
        if place is None:
            options[vary.name] = own * value
            continue
        changed = options.setdefault(vary.name, own.copy())
        changed[place] = own[place] * value if vary.times else value
    return options


def _own(model: Model, vary: Vary) -> tuple[Any, int | None]:
    """The model's own value of an option, and which of its numbers is meant; None for all."""
    for owner in ("", "dof", "body", "geom", "actuator"):
        own = getattr(model, f"{owner}_{vary.name}" if owner else vary.name, None)
        if isinstance(own, np.ndarray):
            # Of several numbers of each, as the three frictions of a geom, the first is meant.
            values = np.array(own[:, 0] if own.ndim == 2 else own, dtype=np.float64)
            return values, _place(model, vary, owner, len(values)) if vary.place else None
        if isinstance(own, (int, float)) and not (isinstance(own, bool) or vary.place):
            return float(own), None
    raise BadInputError(
        f"{vary.label} cannot be varied like this: a model has no {vary.name} of its own"
        + (" for each of its parts" if vary.place else "")
    )


def _place(model: Model, vary: Vary, owner: str, length: int) -> int:
    """Which number of an array is meant: by joint, body, …, axis or its own number."""
    if is_count(vary.place):
        if int(vary.place) >= length:
            raise BadInputError(f"{vary.label} is beyond the {length} that {model.path.name} has")
        return int(vary.place)
    if owner in ("qpos", "dof"):
        return scalar_joint(model, vary.place)[owner == "dof"]
    if owner:
        return index_of(owner, vary.place, getattr(model, f"{owner}_names"))
    check_name("axis", vary.place, _AXES)
    return _AXES.index(vary.place)


def start_at(model: Model, settings: Iterable[tuple[Vary, Value]]) -> tuple[dict[int, float], ...]:
    """What of qpos and of qvel is overwritten at the start: values by their places.

    Raises:
        BadInputError: A joint is neither a hinge nor a slide, or a number is beyond the array.
        UnknownNameError: The model has no such joint.
    """
    qpos, qvel = dict[int, float](), dict[int, float]()
    for vary, value in settings:
        if isinstance(value, (bool, str)):
            raise BadInputError(f"{vary.label} wants numbers; got {value}")
        if vary.name == "qpos":
            qpos[_place(model, vary, "qpos", model.nq)] = value
        else:
            qvel[_place(model, vary, "dof", model.nv)] = value
    return qpos, qvel


def beyond_ranges(model: Model, vary: Vary) -> list[str]:
    """A line for a start that is beyond the range of its joint; legal, and usually a mistake."""
    if vary.name != "qpos":
        return []
    (place,) = start_at(model, [(vary, vary.extremes[0])])[0]
    joints = np.flatnonzero((model.jnt_qposadr == place) & np.array(model.jnt_limited, dtype=bool))
    for joint in joints.tolist():
        low, high = model.jnt_range[joint].tolist()
        outside = [value for value in vary.extremes if not low <= float(value) <= high]
        if outside:
            unit = vary.unit_on({int(model.jnt_type[joint])})
            return [
                f"{vary.label}={outside[0]:g} starts outside the range of the joint, {low:.4g} to "
                f"{high:.4g} {unit}: its limit pushes from the first step on"
            ]
    return []


def drawn_start(model: Model, qpos: Array, spread: Uncertainty, seed: int) -> Array:
    """A start (nq,) near another one, drawn from a seed; that of seed 0 is the same.

    Each coordinate moves by at most the spread, every value as likely as any other: a hinge and
    a rotation by its angle, a slide and the position of a free body by its length. A joint stays
    within its range.
    """
    if seed == 0:
        return qpos.copy()
    draw = np.random.default_rng([seed, _STREAM])
    moved = displaced(
        model, qpos, spread, draw, lambda: draw.uniform(-1, 1), lambda: draw.uniform(0, 1)
    )
    scalar = np.isin(model.jnt_type, (JointType.HINGE, JointType.SLIDE))
    limited = scalar & np.array(model.jnt_limited, dtype=bool)
    places, (low, high) = model.jnt_qposadr[limited], model.jnt_range[limited].T
    begun = qpos[places]  # which may be beyond the range
    moved[places] = np.clip(moved[places], np.minimum(low, begun), np.maximum(high, begun))
    return moved
