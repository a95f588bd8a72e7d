"""All that is checked of a sweep before anything runs: names, values, models, engines."""

from __future__ import annotations

import dataclasses
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ... import __version__
from ...backends import backend_names, parse_backend
from ...backends.starts import overlap_warning, places_in
from ...errors import BadInputError, MissingEngineError, StateMachineError
from ...installed import require_extra
from ...interface import Model, make_data
from ...interface.options import OptionValue, checked_options
from ...interface.read_options import checked_read_option
from ...interface.records import AS_WRITTEN, READ_OPTIONS
from ...models import resolve
from ..compare.perturbed import EXACT, parse_uncertainty
from ..runs.controllers import file_and_name_of, is_function, parameters_of
from ..runs.drive import check_length, number_of_steps, wall_time_per_second
from ..runs.provenance import model_digest
from ..runs.scenarios import Scenario, scenario
from .design import MODEL, Design, Value, Vary, parse_vary, require_qmc
from .kinds import resolve_kinds, variable_names
from .outcomes import unavailable_columns
from .request import PreparedSweep, Sweep, beyond_ranges, options_at, start_at
from .rows import require_parquet
from .worker import digest_of, load_model_of_sweep

MODEL_OF_A_FUNCTION = "so101/scene"
_ANNOUNCED_CELLS, _MAX_CELLS = (
    10_000,
    10**8,
)  # cells that are told beforehand, and that the driver can remember
_SWITCHES = ("contacts", "actuation", "limits")
_CHECKED_VALUES = 1000  # values of a factor; of more, the ends


def prepare_sweep(sweep: Sweep) -> PreparedSweep:
    """Check a sweep: names, values, models, engines.

    What one backend alone refuses is not an error: its cells will be rows that say so.

    Raises:
        UnknownNameError: No such experiment, backend, option, joint, …
        BadInputError: A value is invalid, or the request contradicts itself.
        MissingEngineError: An engine or a package is missing.
        StateMachineError: A model cannot be loaded on any backend.
    """
    require_parquet()
    require_extra("joblib", "a sweep", "joblib", "sweep")
    typed = parse_vary(sweep.vary)
    function = is_function(sweep.what)
    usual = MODEL_OF_A_FUNCTION if function else scenario(sweep.what).model
    varied = [str(value) for vary in typed if vary.label == MODEL for value in vary.values]
    sweep = dataclasses.replace(
        sweep,
        what=os.path.abspath(sweep.what) if function else sweep.what,
        menagerie=sweep.menagerie and os.path.abspath(sweep.menagerie),
    )
    names = varied if varied else [sweep.model or usual]
    files = {name: model_digest(resolve(name, sweep.menagerie)) for name in names}
    places = {name: os.path.abspath(name) if Path(name).is_file() else name for name in names}
    parameters = parameters_of(sweep.what) if function else ()
    models, backends, notes = _load_models(
        sweep, [*places.values()], _options_of_check(sweep, typed)
    )
    function_name = file_and_name_of(sweep.what)[1] if function else ""
    can_vary = [name for name in parameters if name != "seed"]
    factors = resolve_kinds(typed, variable_names(models, function_name, can_vary))
    design = Design(factors, sweep.samples, sweep.design_seed)
    cells = design.size * sweep.seeds * len(backends)
    if cells > _MAX_CELLS:
        raise BadInputError(
            f"{cells:.3g} cells are more than a sweep can hold, which is {_MAX_CELLS:,}: vary "
            "less, or divide it into several"
        )
    if design.sampled:
        require_qmc()
    if sweep.samples & (sweep.samples - 1):
        notes.append(f"{sweep.samples} samples are not a power of two: a Sobol sequence wants one")
    if cells > _ANNOUNCED_CELLS:
        notes.append(f"{cells:,} cells")
    for vary in factors:
        notes += _check_values(vary, models)
    chosen: dict[str, Value] = {"seed": 0} if "seed" in parameters else {}
    chosen |= {vary.name: vary.extremes[0] for vary in factors if vary.kind == "parameter"}
    asked = sweep.scenario(chosen)
    _report_refusals(models, lambda model: _check_run(asked, factors, model))
    notes += _overlaps_at_start(asked, models)
    spread = EXACT if sweep.spread == "0" else parse_uncertainty(sweep.spread.split(","))
    return PreparedSweep(
        sweep=sweep,
        design=design,
        backends=backends,
        versions=_versions(models),
        files=files,
        places=places,
        function=digest_of(sweep.what) if function else "",
        parameters=parameters,
        spread=spread,
        cost={model.backend: _cell_time(model, asked.seconds) for model in models},
        notes=tuple(notes),
        unavailable=unavailable_columns(models),
    )


def _options_of_check(sweep: Sweep, factors: Sequence[Vary]) -> dict[str, OptionValue]:
    """Return the options with which models are loaded to be checked.

    What an experiment switches off is nothing to refuse; a switch that is varied may be off, and
    a file may be read in the way that refuses least.
    """
    options: dict[str, OptionValue] = {}
    if not is_function(sweep.what):
        options |= scenario(sweep.what).options
    for vary in factors:
        if vary.label in _SWITCHES and False in vary.values:
            options[vary.label] = False
        if vary.label in READ_OPTIONS:
            usual = getattr(AS_WRITTEN, vary.label)
            others = [value for value in vary.values if value != usual]
            if others:
                options[vary.label] = others[0]
    return options


def _versions(models: Sequence[Model]) -> dict[str, str]:
    """Return the versions of this library, of the models' engines and of packages."""
    versions = {"statemachine": __version__}
    for model in models:
        versions[model.backend] = model.engine_version
    versions["numpy"] = np.__version__
    versions["python"] = platform.python_version()
    return versions


def _load_models(
    sweep: Sweep, places: Sequence[str], options: Mapping[str, OptionValue]
) -> tuple[list[Model], tuple[str, ...], list[str]]:
    """Return every variant on every backend, the backends that are here, and lines for the reader.

    A backend that refuses a model stays: its cells are rows that say so.
    """
    asked = list(dict.fromkeys(sweep.backends))
    for name in asked:
        if name != "all":
            parse_backend(name)
    models: list[Model] = []
    notes: list[str] = []
    available: list[str] = []
    failure: StateMachineError | None = None
    for backend in backend_names() if "all" in asked else asked:
        for place in places:
            try:
                models.append(load_model_of_sweep(sweep, place, backend, options))
            except MissingEngineError as error:
                if "all" not in asked:
                    raise
                failure = error
                notes.append(f"{error}; it is left out")
                break
            except StateMachineError as error:
                failure = error
                notes.append(f"{place} on {backend}: {error}; its cells will say so")
        else:
            available.append(backend)
    if failure and not models:
        raise failure
    return models, tuple(available), notes


def _report_refusals(models: Sequence[Model], check: Callable[[Model], object]) -> list[str]:
    """Raise what every model says of a check; else what some say, in lines."""
    errors: list[StateMachineError] = []
    for model in models:
        try:
            check(model)
        except StateMachineError as error:
            errors.append(error)
    if len(errors) == len(models):
        raise errors[0]
    return [f"{text}; its cells will say so" for text in dict.fromkeys(map(str, errors))]


def _check_values(vary: Vary, models: Sequence[Model]) -> list[str]:
    """Raise what every model says of a factor's values; else what some say, in lines."""
    values = vary.extremes
    if len(values) > _CHECKED_VALUES and vary.numeric:
        values = (min(values), max(values))  # pyright: ignore[reportArgumentType, reportCallIssue]

    def check(model: Model) -> None:
        for value in values:
            if vary.name in READ_OPTIONS:
                checked_read_option(vary.name, value)
            elif vary.kind == "option":
                checked_options(model, options_at(model, [(vary, value)]))
            elif vary.kind == "state":
                start_at(model, [(vary, value)])

    notes = _report_refusals(models, check)
    return notes + (beyond_ranges(models[0], vary) if vary.kind == "state" else [])


def _check_run(scenario: Scenario, factors: Sequence[Vary], model: Model) -> None:
    """Raise what a model says of the run itself: its start, its length."""
    keyframe = scenario.on(model).keyframe
    if keyframe is not None:
        model.key_id(keyframe)
    number_of_steps(model, scenario.seconds)
    variants: list[Model] = []
    for vary in factors:
        if vary.label == "timestep":
            settings = [[(vary, value)] for value in vary.extremes]
            variants += [model.replace(**options_at(model, setting)) for setting in settings]
    if not variants:
        variants = [model]
    for variant in variants:
        check_length(variant, scenario.seconds)


def _overlaps_at_start(scenario: Scenario, models: Sequence[Model]) -> list[str]:
    """Return a line for each file whose shapes are inside each other where its runs start."""
    lines: list[str] = []
    for model in models:
        try:
            keyframe = scenario.on(model).keyframe
            line = overlap_warning(model, places_in(model, keyframe))
        except StateMachineError:  # the cells of this model say so
            continue
        if line and line not in lines:
            lines.append(line)
    return lines


def _cell_time(model: Model, seconds: float) -> float:
    """Estimate the wall time of a cell [s]: a Model, a Data, the steps."""
    began = time.perf_counter()
    with make_data(model.replace(timestep=model.timestep)):
        begin = time.perf_counter() - began
    return begin + wall_time_per_second(model) * seconds
