"""What was typed behind `statemachine compare`, as a Request: one for each question."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from ...errors import BadInputError
from ...installed import PAIR
from ..common import PROGRAM
from ..experiments import EXPERIMENTS
from .options import PARTS, refuse_options

if TYPE_CHECKING:
    from ...interface.options import OptionValue
    from ...lab.compare import Request, Side
    from ...lab.compare.perturbed import Uncertainty
    from ...lab.questions.requests.causes import ExplainRequest
    from ...lab.questions.requests.converge import ConvergeRequest
    from ...lab.questions.requests.engines import EnginesRequest
    from ...lab.questions.requests.gap import CompareRequest
    from ...lab.questions.requests.models import ModelsRequest
    from ...lab.questions.requests.one_step import OneStepRequest
    from ...lab.questions.requests.versions import VersionsRequest

    Question = (
        CompareRequest
        | EnginesRequest
        | ExplainRequest
        | OneStepRequest
        | ConvergeRequest
        | VersionsRequest
        | ModelsRequest
    )


def request_of(options: argparse.Namespace) -> Question:
    """Return what was asked for.

    Raises:
        BadInputError: What is typed contradicts itself, or is out of range.
        UnknownNameError: There is no such experiment, model, backend or kind of quantity.
    """
    from ...lab.compare import split_words
    from ...lab.questions.requests.converge import ConvergeRequest
    from ...lab.questions.requests.gap import CompareRequest
    from ...lab.questions.requests.one_step import OneStepRequest
    from ...lab.questions.requests.versions import VersionsRequest
    from ...measures import parse_tolerances

    if options.models is not None:
        return _models_request_of(options)
    if not options.what:
        raise BadInputError(
            f"compare what? An experiment ({', '.join(EXPERIMENTS)}), FILE.py:FUNCTION, "
            f"POLICY.onnx, traces or a recorded arm (lerobot:DIR): {PROGRAM} compare hold"
        )
    what, sides = split_words(options.what, options.menagerie)
    if len(sides) > len(PAIR) or _names_several_backends(options):
        return _engines_request_of(options, what, sides)
    run = _run_of(options, what, sides, _backends(options, what))
    if options.one_step:
        return OneStepRequest(run)
    if options.converge:
        return ConvergeRequest(run)
    tolerances = parse_tolerances(options.tolerance)
    if options.versions is not None:
        return VersionsRequest(run, options.versions, options.bisect, tolerances)
    if options.why and options.html is None:
        return explain_request_of(options, run)
    if run.is_traces and len(run.what) == 2:
        refuse_options(
            options, ["backend"], "{} is of a run, and two traces are runs that were made"
        )
    return CompareRequest(run, tolerances, _uncertainty(options))


def _uncertainty(options: argparse.Namespace) -> Uncertainty | None:
    """Return how uncertain the start is; None where no chaos floor is asked for."""
    from ...lab.compare.perturbed import parse_uncertainty

    return None if options.no_chaos else parse_uncertainty(options.uncertainty)


def explain_request_of(options: argparse.Namespace, run: Request) -> ExplainRequest:
    """Return what is asked of causes, with --why or on a page."""
    from ...lab.questions.requests.causes import ExplainRequest

    return ExplainRequest(
        run,
        quantity=options.quantity,
        measure=options.measure or "worst",
        finer=options.finer,
        time_limit=options.time_limit,
        uncertainty=_uncertainty(options),
        jobs=options.jobs,
        write=options.write,
    )


# What is asked of two sides alone.
_OF_TWO = (
    *("why", "one_step", "converge", "versions", "html", "junit", "plot", "film", "map"),
    *PARTS,
)


def _names_several_backends(options: argparse.Namespace) -> bool:
    """Tell whether --backend names three engines or more; of "all" those that are installed."""
    from ...backends.installed_backends import installed_backends

    return len(installed_backends(options.backend or ())[0]) > len(PAIR)


def _engines_request_of(
    options: argparse.Namespace, what: tuple[str, ...], sides: tuple[Side, ...]
) -> EnginesRequest:
    """Return which of three sides or more is to be found odd.

    Raises:
        BadInputError: Something is asked of two sides alone.
    """
    from ...lab.questions.requests.engines import EnginesRequest
    from ...measures import parse_tolerances

    refuse_options(options, _OF_TWO, "{} goes with two sides, and these are more")
    backends: tuple[str, ...] = ()
    if len(sides) > 1:
        _check_options_of_run(options, what, sides)
        run, named = _run_of(options, what, (), PAIR), sides
    else:
        run, named = _run_of(options, what, sides, PAIR), ()
        backends = tuple(options.backend)
    tolerances = parse_tolerances(options.tolerance)
    return EnginesRequest(run, backends, named, tolerances, _uncertainty(options))


def _run_of(
    options: argparse.Namespace,
    what: tuple[str, ...],
    sides: tuple[Side, ...],
    backends: tuple[str, str],
) -> Request:
    """Return what is run on two sides, or which traces are opened.

    Args:
        options: As typed.
        what: What is run.
        sides: Two; or a model for all engines; or none.
        backends: Where no sides are named.
    """
    from ...lab.compare import Request
    from ...lab.policy.command import speeds_of
    from ...lab.runs.call_period import every_of_word

    common: dict[str, OptionValue] = {}
    if options.timestep is not None:
        common["timestep"] = options.timestep
    model = None
    if len(sides) == 1:
        model = sides[0].model
        common |= sides[0].options
        sides = ()
    _check_options_of_run(options, what, sides)
    names = pairs_of(options.map, "--map")
    if sides:
        sides = _with_parts(options, sides[0], sides[1], names)
    every = 1 if options.every is None else every_of_word(options.every)
    command = None if options.command is None else speeds_of(options.command)
    return Request(
        what=what,
        backends=backends,
        model=model,
        menagerie=options.menagerie,
        seconds=options.seconds,
        seed=options.seed,
        options=common,
        sides=sides,
        names=names,
        every=every,
        keyframe=options.keyframe,
        contract=options.contract,
        command=command,
    )


def _check_options_of_run(
    options: argparse.Namespace, what: Sequence[str], sides: Sequence[Side]
) -> None:
    """Check that an option of a run has a meaning for what is run.

    Raises:
        BadInputError: It has none.
    """
    from ...lab.runs.controllers import is_function

    if sides:
        text = "{} goes without sides: each side names its engine: FILE@ENGINE"
        refuse_options(options, ["backend"], text)
    else:
        refuse_options(
            options, ("map", *PARTS), f"{{}} is of two sides: {PROGRAM} compare hold LEFT RIGHT"
        )
    if not (len(what) == 1 and is_function(what[0])):
        refuse_options(options, ["every"], "{} goes with FILE.py:FUNCTION")


def _with_parts(
    options: argparse.Namespace, left: Side, right: Side, names: dict[str, str]
) -> tuple[Side, Side]:
    """Return two sides, each with the parts that it has of the other."""
    of_left = [part for part in PARTS if getattr(options, part) == "left"]
    of_right = [part for part in PARTS if getattr(options, part) == "right"]
    back = {right_name: left_name for left_name, right_name in names.items()}
    return left.taking(of_right, right, back), right.taking(of_left, left, names)


def _backends(options: argparse.Namespace, what: Sequence[str]) -> tuple[str, str]:
    """Return the two backends; one that is named is where a trace is played.

    Where "all" are two, one may be missing: its recorded run may take its side.

    Raises:
        BadInputError: There are not two.
        UnknownNameError: There is no such backend.
    """
    from ...backends.chosen import chosen_backends
    from ...backends.installed_backends import installed_backends
    from ...lab.compare.what import is_trace

    if not options.backend:
        return PAIR
    chosen = [str(backend) for backend in chosen_backends(options.backend)]
    if len(chosen) > len(PAIR):
        chosen = [str(backend) for backend in installed_backends(options.backend)[0]]
    if len(chosen) == 1 and len(what) == 1 and is_trace(what[0]):
        return chosen[0], chosen[0]
    if len(chosen) != 2:
        raise BadInputError(
            "compare takes two engines or more, as in --backend mujoco --backend "
            f"pybullet:engine; got {' and '.join(chosen)}"
        )
    return chosen[0], chosen[1]


def _models_request_of(options: argparse.Namespace) -> ModelsRequest:
    """Return which files are compared."""
    from ...backends.chosen import chosen_backends
    from ...lab.compare.typed_sides import parse_sides
    from ...lab.questions.requests.models import ModelsRequest

    _check_words_of_models(options)
    words = [*options.what, *options.models]
    sides = [side for word in words for side in parse_sides([word], options.menagerie)]
    # The file itself, unless an engine is named.
    engines = [
        None if side.model == word else str(side.chosen_backend())
        for side, word in zip(sides, words, strict=True)
    ]
    if options.backend and any(engines):
        raise BadInputError("--backend and FILE@ENGINE say the same: give one of them")
    if any(side.options for side in sides):
        raise BadInputError("--models compares what the files say, without options of a run")
    models = [side.model for side in sides]
    if options.backend:
        engines = [str(backend) for backend in chosen_backends(options.backend)]
        if len(models) == 1:
            models *= 2
    if len(models) != 2 or len(engines) != 2:
        raise BadInputError(
            f"--models wants two models, or one and --backend A --backend B; got {len(words)}"
        )
    frames, names = pairs_of(options.frame, "--frame"), pairs_of(options.map, "--map")
    return ModelsRequest(
        models=(models[0], models[1]),
        engines=(engines[0], engines[1]),
        frames=frames,
        names=names,
        seed=options.seed,
        menagerie=options.menagerie,
        write=options.write,
    )


def _check_words_of_models(options: argparse.Namespace) -> None:
    """Check that nothing is named that is run.

    Raises:
        BadInputError: Something is.
    """
    from ...lab.compare.what import is_trace
    from ...lab.runs.controllers import is_controller
    from ...lab.runs.scenarios import SCENARIOS

    for word in options.what:
        if word in SCENARIOS or is_trace(word) or is_controller(word):
            others = " ".join(options.what[1:]) or "LEFT RIGHT"
            run = " ".join([*options.what, *options.models])
            raise BadInputError(
                f"--models compares descriptions, and runs nothing: {PROGRAM} compare --models "
                f"{others}; to run something, type {PROGRAM} compare {run}"
            )


def pairs_of(words: Iterable[str], option: str) -> dict[str, str]:
    """Read names of the left and what the right calls them, from words A=B.

    Args:
        words: As typed.
        option: The option, for the message.

    Raises:
        BadInputError: A word is not of that form.
    """
    names: dict[str, str] = {}
    for text in words:
        left, sign, right = text.partition("=")
        if not (left and sign and right):
            raise BadInputError(f"{option} wants A=B, a name of A's and one of B's; got {text!r}")
        names[left] = right
    return names
