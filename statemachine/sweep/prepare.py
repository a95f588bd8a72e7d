"""All that is checked of a sweep before anything runs: names, values, models, engines."""

from __future__ import annotations

import dataclasses
import os
import platform
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..backends import backend_names, load
from ..compare.perturbed import EXACT, parse_uncertainty
from ..errors import BadInputError, MissingEngineError, StateMachineError, unknown_name
from ..interface import Model, make_data
from ..interface.options import checked_options
from ..models import resolve
from ..runs.controllers import is_function, parameters_of
from ..runs.drive import check_length, cost_of_a_second, steps_in
from ..runs.provenance import model_digest
from ..runs.scenarios import scenario
from .cell import CellRules
from .design import Design, require_qmc
from .factors import MODEL, Vary, parse_vary, with_kinds
from .request import PreparedSweep, Sweep
from .rows import require_parquet
from .settings import beyond_ranges, options_at, start_at
from .worker import digest_of

MODEL_OF_A_FUNCTION = "so101/scene"
_MANY, _MOST = 10_000, 10**8  # cells that are told beforehand, and that the driver can remember
_LOOKED_AT = 1000  # values of a factor; of more, the ends


def prepared(sweep: Sweep) -> PreparedSweep:
    """Check a sweep: names, values, models, engines.

    What one backend alone refuses is no error: its cells will be rows that say so.

    Raises:
        UnknownNameError: No such experiment, backend, option, joint, …
        BadInputError: A value is none, or the request contradicts itself.
        MissingEngineError: An engine or a package is missing.
        StateMachineError: A model cannot be loaded on any backend.
    """
    require_parquet()
    typed = parse_vary(sweep.vary)
    rules = _rules(sweep, typed)
    models, backends, said = _loaded(sweep, rules, typed)
    options = dict.fromkeys(name for model in models for name in model.capabilities.options)
    free = [name for name in rules.parameters if name != "seed"]
    factors = with_kinds(typed, options, free)
    design = Design(factors, sweep.samples, sweep.indices, sweep.design_seed)
    if design.sampled:
        require_qmc()
        if sweep.samples & (sweep.samples - 1):
            if sweep.indices:
                raise BadInputError(
                    f"--indices wants a power of two of --samples; got {sweep.samples}"
                )
            said.append(f"{sweep.samples} samples are no power of two: a Sobol sequence wants one")
    cells = design.size * sweep.seeds * len(backends)
    if cells > _MOST:
        raise BadInputError(
            f"{cells:.3g} cells are more than a sweep can hold, which is {_MOST:,}: vary less, or "
            "divide it into several"
        )
    if cells > _MANY:
        said.append(f"{cells:,} cells")
    rules = dataclasses.replace(rules, factors=factors)
    for vary in factors:
        said += _check_values(vary, models)
    _check_runs(rules, models)
    versions = {
        "statemachine": __version__,
        **{model.backend: model.engine_version for model in models},
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
    cost = {model.backend: _cost(rules, model) for model in models}
    return PreparedSweep(sweep, rules, design, backends, versions, cost, tuple(said))


def _rules(sweep: Sweep, factors: Sequence[Vary]) -> CellRules:
    """What all cells have in common, but for the factors."""
    for name, value, least in (
        ("seeds", sweep.seeds, 1),
        ("samples", sweep.samples, 0),
        ("design-seed", sweep.design_seed, 0),
        ("every", sweep.every, 1),
        ("moments", sweep.moments, 1),
    ):
        if value < least:
            raise BadInputError(f"--{name} must be at least {least}; got {value}")
    if not 0 < sweep.timeout <= 86400 * 7:
        raise BadInputError(f"--timeout must be above 0 s; got {sweep.timeout:g}")
    spread = EXACT if list(sweep.spread) == ["0"] else parse_uncertainty(sweep.spread)
    function = is_function(sweep.what)
    if not function and (sweep.every != 1 or sweep.keyframe is not None):
        name = "every" if sweep.every != 1 else "keyframe"
        raise BadInputError(f"--{name} is of a FUNCTION; {sweep.what} is an experiment")
    parameters = parameters_of(sweep.what) if function else ()
    usual = MODEL_OF_A_FUNCTION if function else scenario(sweep.what).model
    varied = [str(value) for vary in factors if vary.label == MODEL for value in vary.values]
    if varied and sweep.model is not None:
        raise BadInputError("--model says one model and --vary model=… several: leave one out")
    names = varied or [sweep.model or usual]
    menagerie = sweep.menagerie and os.path.abspath(sweep.menagerie)
    paths = {name: resolve(name, menagerie) for name in names}
    own_file = {name: os.path.abspath(name) for name in names if Path(name).is_file()}
    return CellRules(
        what=os.path.abspath(sweep.what) if function else sweep.what,
        factors=(),
        model=names[0],
        files={name: model_digest(path) for name, path in paths.items()},
        places={name: own_file.get(name, name) for name in names},
        function=digest_of(sweep.what) if function else "",
        parameters=parameters,
        defaults=sweep.defaults,
        menagerie=menagerie,
        seconds=sweep.seconds,
        every=sweep.every,
        keyframe=sweep.keyframe,
        spread=spread,
        moments=sweep.moments,
        timeout=sweep.timeout,
    )


def _loaded(
    sweep: Sweep, rules: CellRules, factors: Sequence[Vary]
) -> tuple[list[Model], tuple[str, ...], list[str]]:
    """Every variant on every backend, the backends that are here, and what a reader should know.

    A backend that refuses a model stays: its cells are rows that say so.
    """
    everyone = tuple(sweep.backends) == ("all",)
    backends = backend_names() if everyone else list(dict.fromkeys(sweep.backends))
    for name in backends:
        if name not in backend_names():
            raise unknown_name("backend", name, ["all", *backend_names()])
    # What an experiment switches off is nothing to refuse; a switch that is varied may be off.
    given = {} if rules.function else dict(scenario(rules.what).options)
    switches = ("contacts", "actuation", "limits")
    given |= {v.label: False for v in factors if v.label in switches and False in v.values}
    models: list[Model] = []
    said: list[str] = []
    here: list[str] = []
    errors: list[StateMachineError] = []
    for backend in backends:
        for place in rules.places.values():
            try:
                models.append(_load(rules, place, backend, given))
            except MissingEngineError as error:
                if not everyone:
                    raise
                said.append(f"{error}; it is left out")
                errors.append(error)
                break
            except StateMachineError as error:
                said.append(f"{place} on {backend}: {error}; its cells will say so")
                errors.append(error)
        else:
            here.append(backend)
    if not models:
        raise errors[-1]
    return models, tuple(here), said


def _load(rules: CellRules, place: str, backend: str, options: Mapping[str, Any]) -> Model:
    return load(
        place, backend=backend, defaults=rules.defaults, menagerie=rules.menagerie, **options
    )


def _check_values(vary: Vary, models: Sequence[Model]) -> list[str]:
    """Raise what every model says of a factor's values; else what some say, in lines."""
    if vary.kind in ("model", "parameter"):
        return []
    values = vary.extremes
    if len(values) > _LOOKED_AT and vary.numeric:
        values = (min(values), max(values))  # pyright: ignore[reportArgumentType, reportCallIssue]
    errors: dict[str, StateMachineError] = {}
    fine = 0
    for model in models:
        try:
            for value in values:
                if vary.kind == "option":
                    checked_options(model, options_at(model, [(vary, value)]))
                else:
                    start_at(model, [(vary, value)])
        except StateMachineError as error:
            errors.setdefault(str(error), error)
        else:
            fine += 1
    if not fine:
        raise next(iter(errors.values()))
    said = [f"{text}; its cells will say so" for text in errors]
    return said + (beyond_ranges(models[0], vary) if vary.kind == "state" else [])


def _check_runs(rules: CellRules, models: Sequence[Model]) -> None:
    """Raise what every model says of the run itself: its start, its length, its function."""
    values = {vary.name: vary.extremes[0] for vary in rules.factors if vary.kind == "parameter"}
    doing = rules.scenario(values)
    timesteps = [vary for vary in rules.factors if vary.label == "timestep"]
    errors: list[StateMachineError] = []
    for model in models:
        try:
            on_it = doing.on(model)
            if on_it.keyframe is not None:
                model.key_id(on_it.keyframe)
            seconds = doing.seconds if rules.seconds is None else rules.seconds
            steps_in(model, seconds)
            for value in timesteps[0].extremes if timesteps else (None,):
                vary = [(timesteps[0], value)] if timesteps and value is not None else []
                options = options_at(model, vary)
                check_length(model.replace(**options) if options else model, seconds)
            return
        except StateMachineError as error:
            errors.append(error)
    raise errors[0]


def _cost(rules: CellRules, model: Model) -> float:
    """Roughly what a cell costs by the clock [s]: a Model, a Data, the steps."""
    seconds = rules.scenario(
        {v.name: v.extremes[0] for v in rules.factors if v.kind == "parameter"}
    )
    began = time.perf_counter()
    with make_data(model.replace(timestep=model.timestep)):
        made = time.perf_counter() - began
    return made + cost_of_a_second(model) * (rules.seconds or seconds.seconds)
