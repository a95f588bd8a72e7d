"""What a sweep is asked for, what it is when checked, and what its points mean on a Model."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...errors import BadInputError, check_name, shown
from ...interface import Array, JointType, Model
from ...interface.checks import index_of, whole_number
from ...interface.options import OptionValue
from ...measures.text import command
from ...typed_numbers import is_count
from ..compare.perturbed import Uncertainty, displaced
from ..runs.controllers import function_scenario, is_function
from ..runs.robot import scalar_joint
from ..runs.scenarios import Scenario, scenario
from .design import MODEL, Design, Kind, Value, Vary, digest
from .manifest import (
    MANIFEST_VERSION,
    ColumnMeaning,
    RecordedDesign,
    RecordedFactor,
    RecordedRequest,
    SweepManifest,
    SweepProvenance,
)
from .rows import columns_of

_MAX_TIMEOUT = 7 * 86400.0  # that a cell may take [s]


@dataclass(frozen=True)
class Sweep:
    """The request of a sweep; nothing is loaded before `prepare_sweep`.

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
        timeout: What a cell may take on the clock [s], at most a week.

    Raises:
        BadInputError: A number is out of its range, or the request contradicts itself.
        UnknownNameError: There is no such experiment.
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
        _check_at_least(1, "seeds", self.seeds)
        _check_at_least(0, "samples", self.samples)
        _check_at_least(0, "design-seed", self.design_seed)
        _check_at_least(1, "every", self.every)
        _check_at_least(1, "moments", self.moments)
        if not self.backends:
            raise BadInputError("a sweep is of at least one backend; none is named")
        if not 0 < self.timeout <= _MAX_TIMEOUT:
            raise BadInputError(f"--timeout must be above 0 s; got {self.timeout:g}")
        if not is_function(self.what):
            scenario(self.what)  # raises an error where there is none of this name
            of_a_function = f"is of a FUNCTION; {self.what} is an experiment"
            if self.every != 1:
                raise BadInputError(f"--every {of_a_function}")
            if self.keyframe is not None:
                raise BadInputError(f"--keyframe {of_a_function}")
        varies_model = any(word.partition("=")[0].strip() == MODEL for word in self.vary)
        if varies_model and self.model is not None:
            raise BadInputError(
                "one model is named, and --vary model=… says several: leave one out"
            )

    def scenario(self, parameters: Mapping[str, Value]) -> Scenario:
        """Return what is done, and for how long, with values of the function's parameters.

        Raises:
            BadInputError: The user's file fails.
        """
        if is_function(self.what):
            asked = function_scenario(self.what, self.every, self.keyframe, parameters)
        else:
            asked = scenario(self.what)
        return asked if self.seconds is None else dataclasses.replace(asked, seconds=self.seconds)

    def typed(self, out: str) -> str:
        """Return the command that runs it.

        Args:
            out: The folder of the dataset.
        """
        words = ["statemachine", "sweep", self.what]
        if self.model is not None:
            words.append(self.model)
        options: list[tuple[str, object, object]] = []
        for option in dataclasses.fields(self):
            if option.name in ("what", "model"):
                continue
            flag = f"--{option.name.replace('_', '-').replace('backends', 'backend')}"
            value = getattr(self, option.name)
            values = value if option.name in ("vary", "backends") else [value]
            for word in values:
                if word != option.default:
                    options.append((flag, word, option.default))
        return command(words, *options, ("--out", out, None))


def _check_at_least(smallest: int, flag: str, value: int) -> None:
    """Check that a number is not too small.

    Raises:
        BadInputError: It is.
    """
    if whole_number(value) is None:
        raise BadInputError(f"--{flag} must be a whole number; got {shown(value)}")
    if value < smallest:
        raise BadInputError(f"--{flag} must be at least {smallest}; got {value}")


@dataclass(frozen=True)
class SweepCell:
    """One run of a sweep.

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
        notes: What a reader should know before it runs, in lines.
        unavailable: Columns that no robot of the sweep has.
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
    notes: tuple[str, ...] = ()
    unavailable: tuple[str, ...] = ()

    def settings(self, cell: SweepCell, kind: Kind) -> list[tuple[Vary, Value]]:
        """Return the factors of a kind and their values in a cell."""
        pairs = zip(self.design.factors, cell.values, strict=True)
        return [(vary, value) for vary, value in pairs if vary.kind == kind]

    def __len__(self) -> int:
        return self.design.size * self.sweep.seeds * len(self.backends)

    def cells(self, backend: str) -> Iterator[SweepCell]:
        """Yield every cell on a backend, seed by seed, point by point."""
        for point in self.design.points():
            for seed in range(self.sweep.seeds):
                cell = digest([point.id, seed, backend])
                yield SweepCell(cell, point.id, point.values, seed, backend)

    def provenance(self) -> SweepProvenance:
        """Return what was asked for, as plain values, for the metadata of each file."""
        asked = self.sweep
        request: RecordedRequest = {
            "what": asked.what,
            "function": self.function,
            "model": asked.model,
            "seconds": asked.seconds,
            "every": asked.every,
            "keyframe": asked.keyframe,
            "spread": asked.spread,
            "moments": asked.moments,
        }
        design: RecordedDesign = {
            "vary": asked.vary,
            "seeds": asked.seeds,
            "samples": asked.samples,
            "design_seed": asked.design_seed,
            "backends": self.backends,
        }
        return {
            "schema": MANIFEST_VERSION,
            "command": asked.typed("DIR"),
            "request": request,
            "files": dict(self.files),
            "versions": dict(self.versions),
            "design": design,
        }

    def manifest(self) -> SweepManifest:
        """Return the same for sweep.json, with the values of what is varied: they may be many."""
        columns: dict[str, ColumnMeaning] = {}
        for column in columns_of(self.design.factors):
            columns[column.name] = {"unit": column.unit, "meaning": column.meaning}
        return {
            **self.provenance(),
            "factors": [_recorded_factor(vary) for vary in self.design.factors],
            "points": self.design.size,
            "cells": len(self),
            "columns": columns,
        }


def _recorded_factor(vary: Vary) -> RecordedFactor:
    """Return a factor as plain values."""
    return {
        "name": vary.name,
        "place": vary.place,
        "kind": vary.kind,
        "values": vary.values,
        "bounds": vary.bounds,
        "times": vary.times,
        "label": vary.label,
    }


_AXES = ("x", "y", "z")
_SPREAD_STREAM = 1  # of a seed: not that of the commands which an experiment draws


def options_at(model: Model, settings: Iterable[tuple[Vary, Value]]) -> dict[str, OptionValue]:
    """Return the options that `model.replace` is given for the values of factors.

    Raises:
        BadInputError: The model has no such value of its own.
        UnknownNameError: The model has no such joint, body, geom or actuator.
    """
    options: dict[str, OptionValue] = {}
    for vary, value in settings:
        if not (vary.place or vary.times):
            is_a_count = vary.name == "substeps" and isinstance(value, float) and value.is_integer()
            options[vary.name] = int(value) if is_a_count else value
            continue
        model_value, place = _model_value(model, vary)
        if place is None:
            assert isinstance(value, float), "what is times the model's own is a number"
            options[vary.name] = model_value * value
            continue
        assert isinstance(model_value, np.ndarray), "what has a place has several numbers"
        changed = options.get(vary.name)
        if not isinstance(changed, np.ndarray):
            changed = model_value.copy()
            options[vary.name] = changed
        changed[place] = model_value[place] * value if vary.times else value
    return options


def _model_value(model: Model, vary: Vary) -> tuple[Array | float, int | None]:
    """Return the model's own value of an option, and which of its numbers is meant; None for all.

    Raises:
        BadInputError: The model has no value of its own.
    """
    for owner in ("", "dof", "body", "geom", "actuator"):
        value = getattr(model, f"{owner}_{vary.name}" if owner else vary.name, None)
        if isinstance(value, np.ndarray):
            # Of several numbers of each, as the three frictions of a geom, the first is meant.
            values = np.array(value[:, 0] if value.ndim == 2 else value, dtype=np.float64)
            return values, _entry_index(model, vary, owner, len(values)) if vary.place else None
        if isinstance(value, (int, float)) and not (isinstance(value, bool) or vary.place):
            return float(value), None
    missing = f"{vary.label} cannot be varied like this: a model has no {vary.name} of its own"
    if vary.place:
        missing += " for each of its parts"
    raise BadInputError(missing)


def _entry_index(model: Model, vary: Vary, owner: str, length: int) -> int:
    """Return which number of an array is meant: by joint, body, …, axis or its own number."""
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
    """Return what of qpos and of qvel is overwritten at the start: values by their places.

    Raises:
        BadInputError: A joint is neither a hinge nor a slide, or a number is beyond the array.
        UnknownNameError: The model has no such joint.
    """
    qpos, qvel = dict[int, float](), dict[int, float]()
    for vary, value in settings:
        if isinstance(value, (bool, str)):
            raise BadInputError(f"{vary.label} wants numbers; got {value}")
        if vary.name == "qpos":
            qpos[_entry_index(model, vary, "qpos", model.nq)] = value
        else:
            qvel[_entry_index(model, vary, "dof", model.nv)] = value
    return qpos, qvel


def beyond_ranges(model: Model, vary: Vary) -> list[str]:
    """Return a line for a start beyond the range of its joint; it is legal, and often a mistake."""
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


def spread_start(model: Model, qpos: Array, spread: Uncertainty, seed: int) -> Array:
    """Return a start (nq,) near another one, drawn from a seed; that of seed 0 is the same.

    Each coordinate moves by at most the spread, every value as likely as any other: a hinge and
    a rotation by its angle, a slide and the position of a free body by its length. A joint stays
    within its range.
    """
    if seed == 0:
        return qpos.copy()
    draw = np.random.default_rng([seed, _SPREAD_STREAM])
    moved = displaced(
        model, qpos, spread, draw, lambda: draw.uniform(-1, 1), lambda: draw.uniform(0, 1)
    )
    scalar = np.isin(model.jnt_type, (JointType.HINGE, JointType.SLIDE))
    limited = scalar & np.array(model.jnt_limited, dtype=bool)
    places, (low, high) = model.jnt_qposadr[limited], model.jnt_range[limited].T
    start_values = qpos[places]  # which may be beyond the range
    moved[places] = np.clip(
        moved[places], np.minimum(low, start_values), np.maximum(high, start_values)
    )
    return moved
